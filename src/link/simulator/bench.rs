//! Connects a protocol to a simulator in virtual time: each receives what the other sends, and when nothing is left to send, the
//! time advances to the next deadline.
//!
//! The inputs of the protocol are recorded on a [`Tape`], for replays that are split differently or damaged: see [`streams`] and
//! [`fuzz`].

mod cell;
pub mod fuzz;
pub mod robots;
pub mod streams;
mod tests;

use std::time::Duration;

pub use cell::MockCell;
pub use streams::{Input, Tape};

use super::{Output, Simulator};
use crate::link::protocol::{Failure, Moment, Protocol, ProtocolEvent};

/// Virtual start time. It is not zero, because only differences may matter.
pub const START: Moment = Duration::from_secs(100);

/// Most exchanges and deadlines at one time; more mean an endless loop.
const MAX_EXCHANGES: u32 = 100_000;

/// Longest wait for an event.
const EVENT_TIMEOUT: Duration = Duration::from_mins(10);

/// Both ends of a wire.
#[derive(Debug)]
pub struct Bench<P, S> {
    /// The near end.
    pub protocol: P,
    /// The far end.
    pub simulator: S,
    /// Source of the far end's measurements.
    pub cell: MockCell,
    /// Virtual time.
    pub now: Moment,
    /// Everything the protocol sent.
    pub sent: Vec<Vec<u8>>,
    /// Everything the protocol received.
    pub tape: Tape,
    is_connected: bool,
    /// Exchanges and deadlines since the time advanced.
    exchanges: u32,
}

impl<P: Protocol, S: Simulator> Bench<P, S> {
    pub fn new(protocol: P, simulator: S) -> Self {
        Self {
            protocol,
            simulator,
            cell: MockCell::default(),
            now: START,
            sent: Vec::new(),
            tape: Tape::default(),
            is_connected: false,
            exchanges: 0,
        }
    }

    /// Virtual time since the start.
    pub fn elapsed(&self) -> Duration {
        self.now.saturating_sub(START)
    }

    /// Connects or reconnects.
    pub fn connect(&mut self) {
        self.is_connected = true;
        self.simulator.accept(self.now);
        self.pass(Input::Start(self.now));
    }

    /// Connects, waits until the link is ready or lost, and returns all events.
    pub fn settle(&mut self) -> Vec<ProtocolEvent> {
        self.connect();
        self.run_until(|event| matches!(event, ProtocolEvent::Ready(_) | ProtocolEvent::Lost(_)))
    }

    /// Requests a shot without waiting for it.
    pub fn trigger(&mut self) {
        self.pass(Input::Trigger(self.now));
    }

    /// Cancels the shot in progress.
    pub fn cancel(&mut self) {
        self.pass(Input::Cancel(self.now));
    }

    /// Requests a shot, waits until it is answered or the link is lost, and returns all events, the answer last.
    pub fn shoot(&mut self) -> Vec<ProtocolEvent> {
        self.trigger();
        self.run_until(|event| is_answer(event) || matches!(event, ProtocolEvent::Lost(_)))
    }

    /// Runs until `is_last` accepts an event, at most ten minutes, and returns all events.
    pub fn run_until(&mut self, is_last: impl Fn(&ProtocolEvent) -> bool) -> Vec<ProtocolEvent> {
        let end = self.now + EVENT_TIMEOUT;
        let mut events = Vec::new();
        loop {
            if self.drain(&mut events, &is_last) || !self.advance(end) {
                return events;
            }
        }
    }

    /// Runs for a time and returns all events.
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

    /// Passes bytes to the simulator.
    pub fn simulator_gets(&mut self, bytes: &[u8]) {
        self.simulator.feed(bytes, &mut self.cell, self.now);
    }

    /// Pulls the cable: nothing arrives on either side, and neither is notified.
    pub fn unplug(&mut self) {
        self.is_connected = false;
    }

    /// Passes one write to the simulator and its answers to the protocol.
    pub fn step(&mut self) {
        if let Some(bytes) = self.protocol.next_output() {
            self.simulator_gets(&bytes);
        }
        while let Some(Output::Bytes(bytes)) = self.simulator.next_output() {
            self.pass(Input::Feed(bytes, self.now));
        }
    }

    fn pass(&mut self, input: Input) {
        input.pass_to(&mut self.protocol);
        self.tape.0.push(input);
    }

    /// Moves bytes until there are none left; `true` once `is_last` accepts an event.
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
            while let Some(change) = self.protocol.next_line_change() {
                has_moved = true;
                self.simulator.change_line(change, self.now);
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

    /// Passes an output of the simulator to the protocol. Returns the event for the end of a connection.
    fn deliver(&mut self, output: Output) -> Option<ProtocolEvent> {
        if !self.is_connected {
            return None;
        }
        match output {
            Output::Bytes(bytes) => {
                self.pass(Input::Feed(bytes, self.now));
                None
            }
            Output::Close => {
                self.is_connected = false;
                Some(ProtocolEvent::Lost(Failure::Disconnected("closed by the other side".to_owned())))
            }
        }
    }

    /// Advances to the next deadline; `false` if there is none before the end.
    fn advance(&mut self, end: Moment) -> bool {
        let deadlines = [self.protocol.next_deadline(), self.simulator.next_deadline()];
        let next = deadlines.into_iter().flatten().min().filter(|next| *next <= end);
        let then = next.map_or(end, |next| next.max(self.now));
        if then > self.now {
            self.exchanges = 0;
        }
        self.count_exchange();
        self.now = then;
        self.pass(Input::Tick(then));
        self.simulator.tick(&mut self.cell, then);
        next.is_some()
    }

    fn count_exchange(&mut self) {
        self.exchanges += 1;
        assert!(self.exchanges < MAX_EXCHANGES, "endless exchange at {:?}", self.now);
    }
}

/// Whether an event answers a trigger.
pub const fn is_answer(event: &ProtocolEvent) -> bool {
    matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_))
}

/// Bytes of a text of hexadecimal digits.
///
/// # Panics
/// The text contains anything else.
pub fn hex(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.as_bytes().chunks(2).map(byte).collect()
}
