//! What a protocol has to say and to send, in bounded queues.

use std::collections::VecDeque;

use super::Identity;
use super::ProtocolEvent;
use super::Severity;
use super::Shot;
use super::Status;

/// Most offered measurements that wait; the oldest goes.
pub const MAX_OFFERED: usize = 16;

/// Most status texts that wait; later ones are dropped, for the first ones name the cause.
pub const MAX_STATUS: usize = 32;

/// Most messages that wait to be sent; a peer that takes none is lost anyway.
pub const MAX_OUTPUT: usize = 64;

/// Events and bytes on their way to the owner of a protocol. Of live points only the newest is kept.
#[derive(Debug, Default)]
pub struct Outbox {
    events: VecDeque<ProtocolEvent>,
    output: VecDeque<Vec<u8>>,
}

impl Outbox {
    /// Adds an event that answers something the owner asked for: their number is his.
    pub fn push(&mut self, event: ProtocolEvent) {
        self.events.push_back(event);
    }

    /// The set-up is complete.
    pub fn ready(&mut self, identity: Identity) {
        self.push(ProtocolEvent::Ready(identity));
    }

    /// A live point takes the place of the one that still waits.
    pub fn live(&mut self, shot: Shot) {
        self.events.retain(|event| !matches!(event, ProtocolEvent::Live(_)));
        self.push(ProtocolEvent::Live(shot));
    }

    /// A measurement that somebody started at the instrument.
    pub fn offered(&mut self, shot: Shot) {
        let is_offered = |event: &ProtocolEvent| matches!(event, ProtocolEvent::Offered(_));
        if self.events.iter().filter(|event| is_offered(event)).count() >= MAX_OFFERED
            && let Some(oldest) = self.events.iter().position(is_offered)
        {
            self.events.remove(oldest);
        }
        self.push(ProtocolEvent::Offered(shot));
    }

    /// Something to know.
    pub fn status(&mut self, severity: Severity, text: impl Into<String>) {
        let waiting = self.events.iter().filter(|event| matches!(event, ProtocolEvent::Status(_))).count();
        if waiting < MAX_STATUS {
            self.push(ProtocolEvent::Status(Status { severity, text: text.into() }));
        }
    }

    /// Sends bytes.
    pub fn send(&mut self, bytes: Vec<u8>) {
        if self.output.len() < MAX_OUTPUT && !bytes.is_empty() {
            self.output.push_back(bytes);
        }
    }

    /// A new connection: what was not yet sent belongs to the old one.
    pub fn clear_output(&mut self) {
        self.output.clear();
    }

    /// The next bytes to send.
    pub fn next_output(&mut self) -> Option<Vec<u8>> {
        self.output.pop_front()
    }

    /// The next event.
    pub fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.events.pop_front()
    }

    /// Number of events that wait.
    pub fn waiting(&self) -> usize {
        self.events.len()
    }
}

#[cfg(test)]
mod tests;
