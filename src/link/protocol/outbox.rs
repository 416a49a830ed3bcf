//! Bounded queues for the events and outputs of a protocol: neither a peer that floods the wire or never reads, nor a slow
//! owner, can fill the memory.
//!
//! - A new live point replaces the queued one, because only the current value matters.
//! - Only the newest joint states are kept; they are averaged, so there are many.
//! - Only the newest offered points are kept.
//! - For each severity, the first and the newest status messages are kept and those in between are dropped: the first ones
//!   name the cause, the newest describe the current state. Information never displaces warnings. Of a repeated message, the
//!   first and the newest copy are kept.
//! - Answers to a trigger, the end of a set-up and the end of a connection are never dropped; their number is bounded because
//!   each follows a call of the owner.

use std::collections::VecDeque;

use super::{Failure, ProtocolEvent, Severity, Status};

/// Most joint states in the queue: more than one read of a wire brings at the highest frequency.
pub const MAX_JOINTS: usize = 64;

/// Most offered points in the queue.
pub const MAX_OFFERED: usize = 32;

/// Oldest status messages of each severity that are kept in the queue.
pub const MAX_FIRST_STATUSES: usize = 16;

/// Newest status messages of each severity that are kept in the queue.
pub const MAX_NEWEST_STATUSES: usize = 16;

/// Most status messages of each severity in the queue.
pub const MAX_STATUSES: usize = MAX_FIRST_STATUSES + MAX_NEWEST_STATUSES;

/// Most messages waiting to be sent; a peer that accepts none of them is lost anyway.
pub const MAX_OUTPUTS: usize = 64;

/// Events and outputs that the owner of a protocol has not fetched yet.
#[derive(Clone, Debug, Default)]
pub struct Outbox {
    events: VecDeque<ProtocolEvent>,
    outputs: VecDeque<Vec<u8>>,
}

impl Outbox {
    /// Empties both queues for a new connection.
    pub fn clear(&mut self) {
        self.events.clear();
        self.outputs.clear();
    }

    /// Queues an event.
    pub fn push(&mut self, event: ProtocolEvent) {
        match &event {
            ProtocolEvent::Live(_) => self.events.retain(|other| !matches!(other, ProtocolEvent::Live(_))),
            ProtocolEvent::Joints(_) => {
                self.drop_excess(0, MAX_JOINTS, |other| matches!(other, ProtocolEvent::Joints(_)));
            }
            ProtocolEvent::Offered(_) => {
                self.drop_excess(0, MAX_OFFERED, |other| matches!(other, ProtocolEvent::Offered(_)));
            }
            ProtocolEvent::Status(status) => {
                if self.newest_status() == Some(status) {
                    return;
                }
                self.drop_repetition(status);
                let severity = status.severity;
                self.drop_excess(
                    MAX_FIRST_STATUSES,
                    MAX_STATUSES,
                    |other| matches!(other, ProtocolEvent::Status(status) if status.severity == severity),
                );
            }
            ProtocolEvent::Ready(_)
            | ProtocolEvent::Shot(_)
            | ProtocolEvent::Failed(_)
            | ProtocolEvent::Pointed
            | ProtocolEvent::Lost(_) => {}
        }
        self.events.push_back(event);
    }

    /// Queues a status message.
    pub fn report(&mut self, severity: Severity, text: impl Into<String>) {
        self.push(ProtocolEvent::Status(Status { severity, text: text.into() }));
    }

    /// Queues the failure of the requested shot.
    pub fn fail(&mut self, failure: Failure) {
        self.push(ProtocolEvent::Failed(failure));
    }

    /// Queues the refusal of a shot by a robot.
    pub fn refuse_shot(&mut self) {
        self.fail(Failure::Refused("a robot controller reports joint values and takes no shots".to_owned()));
    }

    /// Queues the loss of the connection and discards outputs that were not sent.
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

    /// Removes the later copy of a status message that is queued twice.
    fn drop_repetition(&mut self, status: &Status) {
        let is_same = |event: &ProtocolEvent| matches!(event, ProtocolEvent::Status(other) if other == status);
        if self.events.iter().filter(|event| is_same(event)).count() > 1
            && let Some(later) = self.events.iter().rposition(is_same)
        {
            self.events.remove(later);
        }
    }

    /// Drops one event of a kind if `limit` of them are queued: the oldest one after the first `kept`.
    fn drop_excess(&mut self, kept: usize, limit: usize, is_kind: impl Fn(&ProtocolEvent) -> bool) {
        let indices = || self.events.iter().enumerate().filter(|(_, event)| is_kind(event)).map(|(index, _)| index);
        if indices().count() >= limit
            && let Some(oldest) = indices().nth(kept)
        {
            self.events.remove(oldest);
        }
    }
}

#[cfg(test)]
mod tests;
