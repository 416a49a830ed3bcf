//! A protocol and a simulator on one wire, in virtual time.

pub(in crate::link) mod streams;

use std::time::Duration;

use nalgebra::Point3;

use super::Output;
use super::PointSource;
use super::Simulator;
use crate::link::protocol::JointState;
use crate::link::protocol::Moment;
use crate::link::protocol::Protocol;
use crate::link::protocol::ProtocolEvent;
use crate::link::protocol::Shot;

/// Points on a helix, a new one for every shot, so that a stale one cannot pass for a fresh one.
#[derive(Debug, Default)]
pub(in crate::link) struct Helix {
    shots: u32,
    /// The beam is broken.
    pub(in crate::link) is_blocked: bool,
}

impl Helix {
    /// The point of a shot, counted from 1 (m).
    pub(in crate::link) fn point(shot: u32) -> Point3<f64> {
        let turn = f64::from(shot) * 0.7;
        Point3::new(2.5 * turn.cos() + 0.123_456_789, 2.5 * turn.sin() - 0.4, 0.1 * turn - 1.2)
    }

    /// Number of shots taken.
    pub(in crate::link) const fn taken(&self) -> u32 {
        self.shots
    }
}

impl PointSource for Helix {
    fn shot(&mut self) -> Option<Shot> {
        self.shots += 1;
        (!self.is_blocked).then(|| Shot::bare(Self::point(self.shots)))
    }

    fn look(&mut self) -> Option<Shot> {
        (!self.is_blocked).then(|| Shot::bare(Self::point(self.shots)))
    }

    fn joints(&mut self) -> JointState {
        JointState { positions: vec![0.0; 6], speeds: None, controller_time: 0.0, stopped: None }
    }
}

/// What a protocol was given, to be given again in another way.
#[derive(Clone, Debug)]
pub(in crate::link) enum Input {
    Start(Moment),
    Feed(Vec<u8>, Moment),
    Tick(Moment),
    Trigger(Moment),
}

/// Both ends and the wire.
#[derive(Debug)]
pub(in crate::link) struct Bench<P, S> {
    pub(in crate::link) protocol: P,
    pub(in crate::link) simulator: S,
    pub(in crate::link) source: Helix,
    pub(in crate::link) now: Moment,
    /// The simulator has hung up.
    pub(in crate::link) is_closed: bool,
    /// All that the protocol was given.
    pub(in crate::link) tape: Vec<Input>,
    /// All that the protocol sent.
    pub(in crate::link) sent: Vec<Vec<u8>>,
}

impl<P: Protocol, S: Simulator> Bench<P, S> {
    /// Connected and started.
    pub(in crate::link) fn new(protocol: P, simulator: S) -> Self {
        let now = Duration::from_secs(100);
        let source = Helix::default();
        let mut bench = Self { protocol, simulator, source, now, is_closed: false, tape: Vec::new(), sent: Vec::new() };
        bench.connect();
        bench
    }

    /// A new connection.
    pub(in crate::link) fn connect(&mut self) {
        self.is_closed = false;
        self.simulator.accept(self.now);
        self.tape.push(Input::Start(self.now));
        self.protocol.start(self.now);
    }

    /// Asks for a shot, and does not wait.
    pub(in crate::link) fn trigger(&mut self) {
        self.tape.push(Input::Trigger(self.now));
        self.protocol.trigger(self.now);
    }

    /// Gives up the shot under way.
    pub(in crate::link) fn cancel(&mut self) {
        self.protocol.cancel(self.now);
    }

    /// Carries bytes until neither side has any; bounded, so that two sides which answer each other for ever are found.
    fn carry(&mut self) {
        for _ in 0..10_000 {
            let mut moved = false;
            while let Some(bytes) = self.protocol.next_output() {
                moved = true;
                self.simulator.feed(&bytes, &mut self.source, self.now);
                self.sent.push(bytes);
            }
            self.simulator.tick(&mut self.source, self.now);
            while let Some(output) = self.simulator.next_output() {
                moved = true;
                match output {
                    Output::Bytes(bytes) if !self.is_closed => {
                        self.protocol.feed(&bytes, self.now);
                        self.tape.push(Input::Feed(bytes, self.now));
                    }
                    Output::Bytes(_) => {}
                    Output::Close => self.is_closed = true,
                }
            }
            if !moved {
                return;
            }
        }
        panic!("both sides answer each other without end");
    }

    /// One step of time: to the next deadline of either side, at most to `end`.
    fn step(&mut self, end: Moment) {
        self.carry();
        let next = [self.protocol.next_deadline(), self.simulator.next_deadline()].into_iter().flatten().min();
        let next = next.unwrap_or(end).max(self.now + Duration::from_millis(1));
        self.now = next.min(end);
        self.tape.push(Input::Tick(self.now));
        self.protocol.tick(self.now);
        self.carry();
    }

    /// All events of a span of time.
    pub(in crate::link) fn run(&mut self, span: Duration) -> Vec<ProtocolEvent> {
        let end = self.now + span;
        let mut events = Vec::new();
        while self.now < end && !self.is_closed {
            self.step(end);
            events.extend(std::iter::from_fn(|| self.protocol.next_event()));
        }
        events.extend(std::iter::from_fn(|| self.protocol.next_event()));
        events
    }

    /// Runs until an event is found, at most for two minutes; all events up to it.
    pub(in crate::link) fn until(&mut self, found: impl Fn(&ProtocolEvent) -> bool) -> Vec<ProtocolEvent> {
        let end = self.now + Duration::from_mins(2);
        let mut events = Vec::new();
        loop {
            while let Some(event) = self.protocol.next_event() {
                let is_last = found(&event);
                events.push(event);
                if is_last {
                    return events;
                }
            }
            if self.now >= end || self.is_closed {
                return events;
            }
            self.step(end);
        }
    }

    /// Asks for a shot: the answer, and what was said before it.
    pub(in crate::link) fn shoot(&mut self) -> (Option<ProtocolEvent>, Vec<ProtocolEvent>) {
        self.trigger();
        let mut events = self.until(is_answer);
        let answer = events.pop_if(|event| is_answer(event));
        (answer, events)
    }
}

/// Answers to a trigger, or the end of the link.
pub(in crate::link) fn is_answer(event: &ProtocolEvent) -> bool {
    matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_) | ProtocolEvent::Lost(_))
}
