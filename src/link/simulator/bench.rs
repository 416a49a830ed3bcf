//! A protocol and a simulator face to face, with virtual time: what one sends the other gets, and when nothing moves any more
//! the time goes on to the next deadline.

pub mod fuzz;

use nalgebra::Point3;

use super::{Output, PointSource, Simulator};
use crate::link::protocol::{Failure, JointState, Moment, Protocol, ProtocolEvent, Shot};

/// Exchanges at one moment, above which the two talk for ever.
const MAX_EXCHANGES: usize = 100_000;

/// A reflector in front of the tracker; every shot is at another place.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Shots so far.
    pub shots: u32,
    /// The beam reaches the reflector.
    pub has_beam: bool,
    /// What the robot reports.
    pub joints: JointState,
}

impl Cell {
    /// The point of the shot with this number (m).
    pub fn point(shot: u32) -> Point3<f64> {
        Point3::new(1.2345 + f64::from(shot), -0.67825, 0.090_125)
    }
}

impl Default for Cell {
    fn default() -> Self {
        let positions = vec![0.1, -1.2, 1.3, -0.4, 0.5, -0.6];
        let joints = JointState { positions, speeds: Some(vec![0.0; 6]), controller_time: 0.0, stopped: None };
        Self { shots: 0, has_beam: true, joints }
    }
}

impl PointSource for Cell {
    fn shot(&mut self) -> Option<Shot> {
        let point = Self::point(self.shots);
        self.has_beam.then(|| {
            self.shots += 1;
            Shot { sigma: Some([4e-6, 5e-6, 6e-6]), ..Shot::bare(point) }
        })
    }

    fn look(&mut self) -> Option<Shot> {
        self.has_beam.then(|| Shot::bare(Self::point(self.shots)))
    }

    fn joints(&mut self) -> JointState {
        self.joints.clone()
    }
}

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
    /// Everything that it was sent.
    pub received: Vec<u8>,
    is_connected: bool,
}

impl<P: Protocol, S: Simulator> Bench<P, S> {
    /// Not connected yet.
    pub fn new(protocol: P, simulator: S) -> Self {
        Self {
            protocol,
            simulator,
            cell: Cell::default(),
            now: Moment::ZERO,
            sent: Vec::new(),
            received: Vec::new(),
            is_connected: false,
        }
    }

    /// Connects, or connects again.
    pub fn connect(&mut self) {
        self.is_connected = true;
        self.simulator.accept(self.now);
        self.protocol.start(self.now);
    }

    /// Connects and waits until the link is ready or lost; what was said on the way.
    pub fn settle(&mut self) -> Vec<ProtocolEvent> {
        self.connect();
        self.run_until(is_settled)
    }

    /// Asks for a shot and waits until it is there, has failed or the link is lost; what was said on the way.
    pub fn shoot(&mut self) -> Vec<ProtocolEvent> {
        self.protocol.trigger(self.now);
        self.run_until(is_answer)
    }

    /// Goes on until an event is as asked for, for ten minutes at most.
    pub fn run_until(&mut self, is_last: impl Fn(&ProtocolEvent) -> bool) -> Vec<ProtocolEvent> {
        let end = self.now + Moment::from_mins(10);
        let mut events = Vec::new();
        loop {
            if self.drain(&mut events, &is_last) || !self.advance(end) {
                return events;
            }
        }
    }

    /// Goes on for a time.
    pub fn run_for(&mut self, duration: Moment) -> Vec<ProtocolEvent> {
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
            self.simulator.feed(&bytes, &mut self.cell, self.now);
        }
        while let Some(Output::Bytes(bytes)) = self.simulator.next_output() {
            self.protocol.feed(&bytes, self.now);
        }
    }

    /// Moves bytes until there are none; true once an event is as asked for.
    fn drain(&mut self, events: &mut Vec<ProtocolEvent>, is_last: &impl Fn(&ProtocolEvent) -> bool) -> bool {
        for _ in 0..MAX_EXCHANGES {
            let mut has_moved = false;
            while let Some(event) = self.protocol.next_event() {
                events.push(event);
                if events.last().is_some_and(is_last) {
                    return true;
                }
            }
            while let Some(bytes) = self.protocol.next_output() {
                has_moved = true;
                if self.is_connected {
                    self.simulator.feed(&bytes, &mut self.cell, self.now);
                }
                self.sent.push(bytes);
            }
            if let Some(output) = self.simulator.next_output() {
                has_moved = true;
                self.deliver(&output, events);
                if events.last().is_some_and(is_last) {
                    return true;
                }
            }
            if !has_moved {
                return false;
            }
        }
        panic!("the two ends talk for ever at {:?}", self.now);
    }

    fn deliver(&mut self, output: &Output, events: &mut Vec<ProtocolEvent>) {
        match output {
            Output::Bytes(bytes) if self.is_connected => {
                self.received.extend(bytes);
                self.protocol.feed(bytes, self.now);
            }
            Output::Close if self.is_connected => {
                self.is_connected = false;
                // What the owner of a socket says when the other side hangs up.
                events.push(ProtocolEvent::Lost(Failure::Disconnected("closed by the other side".to_owned())));
            }
            Output::Bytes(_) | Output::Close => {}
        }
    }

    /// Goes to the next deadline; false where there is none before the end.
    fn advance(&mut self, end: Moment) -> bool {
        let deadlines = [self.protocol.next_deadline(), self.simulator.next_deadline()];
        let next = deadlines.into_iter().flatten().min().filter(|next| *next <= end);
        self.now = next.map_or(end, |next| next.max(self.now));
        self.protocol.tick(self.now);
        self.simulator.tick(&mut self.cell, self.now);
        next.is_some()
    }
}

/// The set-up has ended.
pub fn is_settled(event: &ProtocolEvent) -> bool {
    matches!(event, ProtocolEvent::Ready(_) | ProtocolEvent::Lost(_))
}

/// A trigger was answered, or the link is lost.
pub fn is_answer(event: &ProtocolEvent) -> bool {
    matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_) | ProtocolEvent::Lost(_))
}
