//! What a protocol has to say, in bounded queues: a peer that floods the wire, or an owner that is slow, cannot fill the memory.
//!
//! A live point and a joint state replace the older one that nobody has fetched; of statuses and offered points the newest are
//! kept. Nothing that answers a trigger, and no end of a connection, is ever dropped.

use std::collections::VecDeque;

use super::{ProtocolEvent, Severity, Status};

/// Statuses that wait at most.
pub const MAX_STATUSES: usize = 64;

/// Offered points that wait at most.
pub const MAX_OFFERED: usize = 32;

/// Bytes to send and events to fetch.
#[derive(Clone, Debug, Default)]
pub struct Mailbox {
    outputs: VecDeque<Vec<u8>>,
    events: VecDeque<ProtocolEvent>,
}

impl Mailbox {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.outputs.clear();
        self.events.clear();
    }

    /// Queues bytes to send.
    pub fn send(&mut self, bytes: Vec<u8>) {
        self.outputs.push_back(bytes);
    }

    /// Drops what was not sent yet: the connection is gone.
    pub fn drop_outputs(&mut self) {
        self.outputs.clear();
    }

    /// Queues an event. Replaces an older live point or joint state; drops the oldest status or offered point above the limit.
    pub fn report(&mut self, event: ProtocolEvent) {
        let is_same_kind = |queued: &ProtocolEvent| std::mem::discriminant(queued) == std::mem::discriminant(&event);
        match &event {
            ProtocolEvent::Live(_) | ProtocolEvent::Joints(_) => self.drop_oldest_above(0, is_same_kind),
            ProtocolEvent::Offered(_) => self.drop_oldest_above(MAX_OFFERED - 1, is_same_kind),
            ProtocolEvent::Status(_) if self.events.contains(&event) => return,
            ProtocolEvent::Status(_) => self.drop_oldest_above(MAX_STATUSES - 1, is_same_kind),
            _ => {}
        }
        self.events.push_back(event);
    }

    /// Queues a status.
    pub fn say(&mut self, severity: Severity, text: impl Into<String>) {
        self.report(ProtocolEvent::Status(Status { severity, text: text.into() }));
    }

    /// The next bytes to send.
    pub fn next_output(&mut self) -> Option<Vec<u8>> {
        self.outputs.pop_front()
    }

    /// The next event.
    pub fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.events.pop_front()
    }

    /// Drops the oldest of a kind until at most `limit` are left.
    fn drop_oldest_above(&mut self, limit: usize, is_kind: impl Fn(&ProtocolEvent) -> bool) {
        while self.events.iter().filter(|queued| is_kind(queued)).count() > limit {
            if let Some(oldest) = self.events.iter().position(&is_kind) {
                self.events.remove(oldest);
            }
        }
    }
}

#[cfg(test)]
impl Mailbox {
    /// How many outputs and events wait.
    pub fn waiting(&self) -> (usize, usize) {
        (self.outputs.len(), self.events.len())
    }
}

/// Text of a peer without control characters.
pub fn printable(text: &str) -> String {
    text.trim().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::link::protocol::{Failure, Shot};

    fn shot(x: f64) -> Shot {
        Shot::bare(Point3::new(x, 0.0, 0.0))
    }

    /// What comes out of a mailbox into which these events went.
    fn kept(events: impl IntoIterator<Item = ProtocolEvent>) -> Vec<ProtocolEvent> {
        let mut mailbox = Mailbox::default();
        for event in events {
            mailbox.report(event);
        }
        std::iter::from_fn(|| mailbox.next_event()).collect()
    }

    #[test]
    fn of_live_points_the_newest_is_kept_behind_what_came_before_it() {
        let failed = || ProtocolEvent::Failed(Failure::TooEarly(String::new()));
        let events = kept([ProtocolEvent::Live(shot(1.0)), failed(), ProtocolEvent::Live(shot(2.0)), failed()]);
        assert_eq!(events, [failed(), ProtocolEvent::Live(shot(2.0)), failed()]);
    }

    #[test]
    fn of_offered_points_and_statuses_the_newest_are_kept_and_of_answers_all() {
        let numbers = || (0..200_i32).map(f64::from);
        let offered = kept(numbers().map(|x| ProtocolEvent::Offered(shot(x))));
        assert_eq!(offered.len(), MAX_OFFERED);
        assert_eq!(offered.last(), Some(&ProtocolEvent::Offered(shot(199.0))));
        let status = |text: String| ProtocolEvent::Status(Status { severity: Severity::Info, text });
        let statuses = kept(numbers().map(|x| status(x.to_string())));
        assert_eq!(statuses.len(), MAX_STATUSES);
        assert_eq!(statuses.last(), Some(&status("199".to_owned())));
        assert_eq!(kept(numbers().map(|_| status("same".to_owned()))).len(), 1);
        assert_eq!(kept(numbers().map(|x| ProtocolEvent::Shot(shot(x)))).len(), 200);
    }

    #[test]
    fn text_of_a_peer_has_no_control_characters() {
        assert_eq!(printable(" a\u{1b}[31m\u{7f}b\u{9b}\r\n"), "a\u{fffd}[31m\u{fffd}b\u{fffd}");
    }
}
