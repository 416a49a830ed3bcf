//! A protocol and a simulator face to face, with virtual time: what one sends the other gets, and when nothing moves any more
//! the time goes on to the next deadline.
//!
//! What the protocol was given is on a [`Tape`], to be given again in other pieces or damaged: see [`streams`] and [`fuzz`].

mod cell;
pub mod fuzz;
pub mod streams;
mod tests;

use std::time::Duration;

pub use cell::Cell;
pub use streams::{Input, Tape};

use super::{Output, Simulator};
use crate::link::protocol::{Failure, Moment, Protocol, ProtocolEvent};

/// Virtual time at the beginning: not zero, for only differences matter.
pub const START: Moment = Duration::from_secs(100);

/// Exchanges and deadlines at one moment, above which the two go on for ever.
const MAX_EXCHANGES: u32 = 100_000;

/// An event is waited for so long.
const PATIENCE: Duration = Duration::from_mins(10);

/// Both ends of a wire.
#[derive(Debug)]
pub struct Bench<P, S> {
    /// The near end.
    pub protocol: P,
    /// The far end.
    pub simulator: S,
    /// What the far end looks at.
    pub cell: Cell,
    /// Virtual time.
    pub now: Moment,
    /// Everything that the protocol sent.
    pub sent: Vec<Vec<u8>>,
    /// Everything that the protocol was given.
    pub tape: Tape,
    is_connected: bool,
    /// Exchanges and deadlines since the time went on.
    exchanges: u32,
}

impl<P: Protocol, S: Simulator> Bench<P, S> {
    /// Not connected yet.
    pub fn new(protocol: P, simulator: S) -> Self {
        Self {
            protocol,
            simulator,
            cell: Cell::default(),
            now: START,
            sent: Vec::new(),
            tape: Tape::default(),
            is_connected: false,
            exchanges: 0,
        }
    }

    /// Virtual time that has passed.
    pub fn elapsed(&self) -> Duration {
        self.now.saturating_sub(START)
    }

    /// Connects, or connects again.
    pub fn connect(&mut self) {
        self.is_connected = true;
        self.simulator.accept(self.now);
        self.give(Input::Start(self.now));
    }

    /// Connects and waits until the link is ready or lost; what was said on the way.
    pub fn settle(&mut self) -> Vec<ProtocolEvent> {
        self.connect();
        self.run_until(|event| matches!(event, ProtocolEvent::Ready(_) | ProtocolEvent::Lost(_)))
    }

    /// Asks for a shot, and does not wait.
    pub fn trigger(&mut self) {
        self.give(Input::Trigger(self.now));
    }

    /// Gives up the shot under way.
    pub fn cancel(&mut self) {
        self.give(Input::Cancel(self.now));
    }

    /// Asks for a shot and waits until it is there, has failed or the link is lost: what was said on the way, the answer last.
    pub fn shoot(&mut self) -> Vec<ProtocolEvent> {
        self.trigger();
        self.run_until(|event| is_answer(event) || matches!(event, ProtocolEvent::Lost(_)))
    }

    /// Goes on until an event is as asked for, for ten minutes at most.
    pub fn run_until(&mut self, is_last: impl Fn(&ProtocolEvent) -> bool) -> Vec<ProtocolEvent> {
        let end = self.now + PATIENCE;
        let mut events = Vec::new();
        loop {
            if self.drain(&mut events, &is_last) || !self.advance(end) {
                return events;
            }
        }
    }

    /// Goes on for a time.
    pub fn run_for(&mut self, duration: Duration) -> Vec<ProtocolEvent> {
        let end = self.now + duration;
        let mut events = Vec::new();
        loop {
            self.drain(&mut events, &|_| false);
            if !self.advance(end) {
                return events;
            }
        }
    }

    /// Bytes that a test held back arrive at the simulator.
    pub fn simulator_gets(&mut self, bytes: &[u8]) {
        self.simulator.feed(bytes, &mut self.cell, self.now);
    }

    /// The cable is pulled: nothing arrives any more, on either side, and nobody is told.
    pub fn unplug(&mut self) {
        self.is_connected = false;
    }

    /// One write goes to the simulator, and what it answers comes back.
    pub fn step(&mut self) {
        if let Some(bytes) = self.protocol.next_output() {
            self.simulator_gets(&bytes);
        }
        while let Some(Output::Bytes(bytes)) = self.simulator.next_output() {
            self.give(Input::Feed(bytes, self.now));
        }
    }

    fn give(&mut self, input: Input) {
        input.give_to(&mut self.protocol);
        self.tape.0.push(input);
    }

    /// Moves bytes until there are none; true once an event is as asked for.
    fn drain(&mut self, events: &mut Vec<ProtocolEvent>, is_last: &impl Fn(&ProtocolEvent) -> bool) -> bool {
        let mut has_moved = true;
        while has_moved {
            has_moved = false;
            while let Some(event) = self.protocol.next_event() {
                events.push(event);
                if events.last().is_some_and(is_last) {
                    return true;
                }
            }
            while let Some(bytes) = self.protocol.next_output() {
                has_moved = true;
                if self.is_connected {
                    self.simulator_gets(&bytes);
                }
                self.sent.push(bytes);
            }
            if let Some(output) = self.simulator.next_output() {
                has_moved = true;
                if let Some(event) = self.deliver(output) {
                    events.push(event);
                    if events.last().is_some_and(is_last) {
                        return true;
                    }
                }
            }
            self.count_exchange();
        }
        false
    }

    /// What the simulator does reaches the protocol; what the owner of a socket says when the other side hangs up.
    fn deliver(&mut self, output: Output) -> Option<ProtocolEvent> {
        if !self.is_connected {
            return None;
        }
        match output {
            Output::Bytes(bytes) => {
                self.give(Input::Feed(bytes, self.now));
                None
            }
            Output::Close => {
                self.is_connected = false;
                Some(ProtocolEvent::Lost(Failure::Disconnected("closed by the other side".to_owned())))
            }
        }
    }

    /// Goes to the next deadline; false where there is none before the end.
    fn advance(&mut self, end: Moment) -> bool {
        let deadlines = [self.protocol.next_deadline(), self.simulator.next_deadline()];
        let next = deadlines.into_iter().flatten().min().filter(|next| *next <= end);
        let then = next.map_or(end, |next| next.max(self.now));
        if then > self.now {
            self.exchanges = 0;
        }
        self.count_exchange();
        self.now = then;
        self.give(Input::Tick(then));
        self.simulator.tick(&mut self.cell, then);
        next.is_some()
    }

    fn count_exchange(&mut self) {
        self.exchanges += 1;
        assert!(self.exchanges < MAX_EXCHANGES, "the two ends go on for ever at {:?}", self.now);
    }
}

/// A trigger was answered.
pub const fn is_answer(event: &ProtocolEvent) -> bool {
    matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_))
}

/// Bytes of a text of hexadecimal digits.
///
/// # Panics
/// It is none.
pub fn hex(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.as_bytes().chunks(2).map(byte).collect()
}
