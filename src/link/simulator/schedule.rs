//! Scheduled writes of a simulated instrument.

use std::collections::VecDeque;
use std::time::Duration;

use super::Output;
use crate::link::protocol::Moment;

/// Pause between the halves of a split write.
const PAUSE: Duration = Duration::from_millis(700);

/// Most scheduled writes, and most due writes that were not fetched; further ones are dropped.
const MAX_WAITING: usize = 256;

/// Scheduled writes, and due ones that were not fetched yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    later: VecDeque<(Moment, Output)>,
    now: VecDeque<Output>,
}

impl Schedule {
    /// Discards all writes for a new connection.
    pub(super) fn clear(&mut self) {
        self.later.clear();
        self.now.clear();
    }

    /// Schedules a write.
    pub(super) fn send(&mut self, at: Moment, bytes: Vec<u8>) {
        self.insert(at, Output::Bytes(bytes));
    }

    /// Schedules the bytes in two halves with a pause between them.
    pub(super) fn send_halves(&mut self, at: Moment, bytes: &[u8]) {
        let (first, rest) = halves(bytes);
        self.send(at, first.to_vec());
        self.send(at + PAUSE, rest.to_vec());
    }

    /// Schedules the first half of the bytes and the end of the connection.
    pub(super) fn break_off(&mut self, at: Moment, bytes: &[u8]) {
        self.send(at, halves(bytes).0.to_vec());
        self.insert(at, Output::Close);
    }

    /// Makes the writes available that are due.
    pub(super) fn tick(&mut self, now: Moment) {
        while let Some((_, output)) = self.later.pop_front_if(|(at, _)| *at <= now) {
            if self.now.len() < MAX_WAITING {
                self.now.push_back(output);
            }
        }
    }

    /// The next write.
    pub(super) fn next_output(&mut self) -> Option<Output> {
        self.now.pop_front()
    }

    /// The next time at which [`Self::tick`] has something to do.
    pub(super) fn next_deadline(&self) -> Option<Moment> {
        self.later.front().map(|(at, _)| *at)
    }

    fn insert(&mut self, at: Moment, output: Output) {
        if self.later.len() < MAX_WAITING {
            let index = self.later.partition_point(|(other, _)| *other <= at);
            self.later.insert(index, (at, output));
        }
    }
}

/// The two halves of bytes.
pub(super) fn halves(bytes: &[u8]) -> (&[u8], &[u8]) {
    bytes.split_at_checked(bytes.len() / 2).unwrap_or((bytes, &[]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A time in seconds.
    const fn at(seconds: u64) -> Moment {
        Duration::from_secs(seconds)
    }

    #[test]
    fn writes_come_in_the_order_of_their_times_and_not_before() {
        let mut schedule = Schedule::default();
        schedule.break_off(at(3), b"abcd");
        schedule.send(at(1), b"1".to_vec());
        schedule.send_halves(at(1), b"xyz");
        assert_eq!((schedule.next_output(), schedule.next_deadline()), (None, Some(at(1))));
        let bytes = |bytes: &[u8]| Some(Output::Bytes(bytes.to_vec()));
        schedule.tick(at(1));
        assert_eq!([schedule.next_output(), schedule.next_output()], [bytes(b"1"), bytes(b"x")]);
        assert_eq!((schedule.next_output(), schedule.next_deadline()), (None, Some(at(1) + PAUSE)));
        schedule.tick(at(3));
        let rest: Vec<Output> = std::iter::from_fn(|| schedule.next_output()).collect();
        assert_eq!(rest, [Output::Bytes(b"yz".to_vec()), Output::Bytes(b"ab".to_vec()), Output::Close]);
    }

    #[test]
    fn writes_that_are_never_fetched_are_bounded() {
        let mut schedule = Schedule::default();
        for second in 0..1000 {
            schedule.send(at(second), vec![1]);
            schedule.tick(at(second));
        }
        (0..1000).for_each(|second| schedule.send(at(2000 + second), vec![1]));
        assert_eq!((schedule.now.len(), schedule.later.len()), (MAX_WAITING, MAX_WAITING));
        schedule.clear();
        assert_eq!((schedule.next_output(), schedule.next_deadline()), (None, None));
    }
}
