//! What a protocol has to say and to send, in bounded queues: neither a peer that floods the wire or reads nothing nor an owner
//! that is slow can fill the memory.
//!
//! - A live point or joint state takes the place of the one that still waits: only now is of interest.
//! - Of offered points the newest wait.
//! - Of the statuses of each severity the first and the newest wait, and those between them go: the first ones name the cause,
//!   the newest say how things are. Information cannot crowd out warnings. Of a status that comes again and again the first and
//!   the newest wait.
//! - Nothing that answers a trigger, no end of a set-up and no end of a connection is ever dropped: their number is the owner's.

use std::collections::VecDeque;

use super::{Failure, ProtocolEvent, Severity, Status};

/// Most offered points that wait.
pub const MAX_OFFERED: usize = 32;

/// Most statuses of a severity that wait: so many of the first ones, and so many of the newest.
pub const MAX_STATUSES: (usize, usize) = (16, 16);

/// Most messages that wait to be sent; a peer that takes none is lost anyway.
pub const MAX_OUTPUTS: usize = 64;

/// Events and bytes on their way to the owner of a protocol.
#[derive(Clone, Debug, Default)]
pub struct Outbox {
    events: VecDeque<ProtocolEvent>,
    outputs: VecDeque<Vec<u8>>,
}

impl Outbox {
    /// Forgets everything: a new connection.
    pub fn clear(&mut self) {
        self.events.clear();
        self.outputs.clear();
    }

    /// Queues an event.
    pub fn push(&mut self, event: ProtocolEvent) {
        match &event {
            ProtocolEvent::Live(_) => self.events.retain(|other| !matches!(other, ProtocolEvent::Live(_))),
            ProtocolEvent::Joints(_) => self.events.retain(|other| !matches!(other, ProtocolEvent::Joints(_))),
            ProtocolEvent::Offered(_) => {
                self.make_room(0, MAX_OFFERED, |other| matches!(other, ProtocolEvent::Offered(_)));
            }
            ProtocolEvent::Status(status) => {
                if self.newest_status() == Some(status) {
                    return;
                }
                self.drop_repetition(status);
                let (first, newest) = MAX_STATUSES;
                let severity = status.severity;
                self.make_room(
                    first,
                    first + newest,
                    |other| matches!(other, ProtocolEvent::Status(status) if status.severity == severity),
                );
            }
            ProtocolEvent::Ready(_) | ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_) | ProtocolEvent::Lost(_) => {}
        }
        self.events.push_back(event);
    }

    /// Queues a status.
    pub fn say(&mut self, severity: Severity, text: impl Into<String>) {
        self.push(ProtocolEvent::Status(Status { severity, text: text.into() }));
    }

    /// The shot that was asked for did not come.
    pub fn fail(&mut self, failure: Failure) {
        self.push(ProtocolEvent::Failed(failure));
    }

    /// The connection is of no use any more: what was not sent yet goes nowhere.
    pub fn lose(&mut self, failure: Failure) {
        self.outputs.clear();
        self.push(ProtocolEvent::Lost(failure));
    }

    /// Queues bytes to send.
    pub fn send(&mut self, bytes: Vec<u8>) {
        if self.outputs.len() < MAX_OUTPUTS && !bytes.is_empty() {
            self.outputs.push_back(bytes);
        }
    }

    /// The next bytes to send.
    pub fn next_output(&mut self) -> Option<Vec<u8>> {
        self.outputs.pop_front()
    }

    /// The next event.
    pub fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.events.pop_front()
    }

    fn newest_status(&self) -> Option<&Status> {
        self.events.iter().rev().find_map(|event| match event {
            ProtocolEvent::Status(status) => Some(status),
            _ => None,
        })
    }

    /// Of a status that waits twice the later one goes.
    fn drop_repetition(&mut self, status: &Status) {
        let is_same = |event: &ProtocolEvent| matches!(event, ProtocolEvent::Status(other) if other == status);
        if self.events.iter().filter(|event| is_same(event)).count() > 1
            && let Some(later) = self.events.iter().rposition(is_same)
        {
            self.events.remove(later);
        }
    }

    /// Makes room for one more of a kind of which at most `limit` wait: the oldest behind the first `kept` goes.
    fn make_room(&mut self, kept: usize, limit: usize, is_kind: impl Fn(&ProtocolEvent) -> bool) {
        let places = || self.events.iter().enumerate().filter(|(_, event)| is_kind(event)).map(|(place, _)| place);
        if places().count() >= limit
            && let Some(oldest) = places().nth(kept)
        {
            self.events.remove(oldest);
        }
    }
}

#[cfg(test)]
mod tests;
