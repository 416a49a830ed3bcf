//! Universal Robots real-time data exchange over TCP, port 30004: the measured joint values of the controller.
//!
//! The set-up requests version 2 of the protocol, the version of the controller and five values, then starts the stream. From
//! then on every packet is a [`ProtocolEvent::Joints`]; a silent stream counts as lost. Nothing is ever written to the robot.
//! There are no shots: a trigger is refused.

pub mod mode;
pub mod packet;
mod rest;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub use rest::RestDetector;

use self::packet::{Framer, Packet, Record, TextMessage, encode, packet_type, request_version, set_up_outputs};
use super::excerpt::excerpt;
use super::outbox::Outbox;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// TCP port of the interface.
pub const PORT: u16 = 30_004;

/// Highest frequency (Hz). Controllers drop clients that read too slowly, and more is not needed here.
pub const MAX_FREQUENCY: f64 = 25.0;

/// Lowest frequency (Hz).
pub const MIN_FREQUENCY: f64 = 1.0;

/// Options of the robot's stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RtdeOptions {
    /// Packets per second (Hz), clamped to [`MIN_FREQUENCY`] .. [`MAX_FREQUENCY`].
    pub frequency: f64,
    /// Longest wait for an answer in the set-up.
    pub answer_timeout: Duration,
    /// A stream without data for this long counts as lost; at a low frequency, a stream that misses three packets.
    pub stream_timeout: Duration,
}

impl Default for RtdeOptions {
    fn default() -> Self {
        Self {
            frequency: MAX_FREQUENCY,
            answer_timeout: Duration::from_secs(5),
            stream_timeout: Duration::from_secs(1),
        }
    }
}

/// The packet that is awaited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Off,
    ProtocolVersion,
    ControllerVersion,
    Outputs,
    Start,
    Data,
}

/// Protocol driver of a controller.
#[derive(Clone, Debug)]
pub struct Rtde {
    options: RtdeOptions,
    outbox: Outbox,
    framer: Framer,
    phase: Phase,
    name: String,
    recipe: u8,
    /// Robot mode and safety status of the previous packet.
    modes: Option<(i32, i32)>,
    /// Start of the current wait.
    since: Moment,
}

impl Rtde {
    /// A driver that is not connected yet.
    pub fn new(options: RtdeOptions) -> Self {
        let is_number = options.frequency.is_finite();
        let frequency = if is_number { options.frequency.clamp(MIN_FREQUENCY, MAX_FREQUENCY) } else { MIN_FREQUENCY };
        Self {
            options: RtdeOptions { frequency, ..options },
            outbox: Outbox::default(),
            framer: Framer::default(),
            phase: Phase::Off,
            name: String::new(),
            recipe: 0,
            modes: None,
            since: Moment::ZERO,
        }
    }

    /// Longest duration of the current wait.
    fn timeout(&self) -> Duration {
        let three_packets = Duration::from_secs_f64(3.0 / self.options.frequency);
        if self.phase == Phase::Data {
            self.options.stream_timeout.max(three_packets)
        } else {
            self.options.answer_timeout
        }
    }

    /// Sends a request and waits for its answer.
    fn ask(&mut self, phase: Phase, request: Vec<u8>, now: Moment) {
        self.phase = phase;
        self.since = now;
        self.outbox.send(request);
    }

    fn take(&mut self, packet: Packet, now: Moment) {
        match (self.phase, packet) {
            (_, Packet::Text(message)) => self.take_text(&message),
            (Phase::ProtocolVersion, Packet::ProtocolVersion(true)) => {
                let request = encode(packet_type::GET_URCONTROL_VERSION, &[]);
                self.ask(Phase::ControllerVersion, request, now);
            }
            (Phase::ProtocolVersion, Packet::ProtocolVersion(false)) => {
                let text = "version 2 of the interface; update the software of the controller";
                self.lose(Failure::Refused(text.to_owned()));
            }
            (Phase::ControllerVersion, Packet::ControllerVersion([major, minor, fix, build])) => {
                self.name = format!("Universal Robots controller, version {major}.{minor}.{fix}.{build}");
                let names = Record::FIELDS.map(|(name, _)| name);
                self.ask(Phase::Outputs, set_up_outputs(self.options.frequency, &names), now);
            }
            (Phase::Outputs, Packet::Outputs { recipe, types }) => self.take_types(recipe, &types, now),
            (Phase::Start, Packet::Started(true)) => {
                self.phase = Phase::Data;
                self.since = now;
                let checked = vec![format!("joint values: rad, {} Hz", self.options.frequency)];
                let identity = Identity { name: self.name.clone(), checked, ..Identity::default() };
                self.outbox.push(ProtocolEvent::Ready(identity));
            }
            (Phase::Start, Packet::Started(false)) => {
                self.lose(Failure::Refused("the controller does not start the stream".to_owned()));
            }
            (Phase::Data, Packet::Data { recipe, values }) if recipe == self.recipe => self.take_data(&values, now),
            (Phase::Data, Packet::Data { recipe, .. }) => {
                let text = format!("skipped data of recipe {recipe} instead of {}", self.recipe);
                self.outbox.report(Severity::Warning, text);
            }
            _ => {}
        }
    }

    fn take_text(&mut self, message: &TextMessage) {
        let severity = if message.level >= 3 { Severity::Info } else { Severity::Warning };
        self.outbox.report(severity, format!("{}: {}", message.source, message.text));
    }

    /// Checks that every requested value is available with the expected type.
    fn take_types(&mut self, recipe: u8, types: &[String], now: Moment) {
        let in_use: Vec<&str> = refused(types, "IN_USE");
        let not_found = refused(types, "NOT_FOUND");
        if !in_use.is_empty() {
            self.lose(Failure::InUse(format!("another program uses {}", in_use.join(", "))));
        } else if !not_found.is_empty() {
            self.lose(Failure::Refused(format!("the controller does not know {}", not_found.join(", "))));
        } else if types.iter().ne(Record::FIELDS.iter().map(|(_, kind)| kind)) {
            let types = excerpt(&types.join(","));
            self.lose(Failure::Garbled(format!("unexpected types of the values: {types}")));
        } else {
            self.recipe = recipe;
            self.ask(Phase::Start, encode(packet_type::CONTROL_PACKAGE_START, &[]), now);
        }
    }

    fn take_data(&mut self, values: &[u8], now: Moment) {
        let Some(record) = Record::decode(values) else {
            let text = format!("a data packet has {} bytes of values instead of {}", values.len(), Record::SIZE);
            self.lose(Failure::Garbled(text));
            return;
        };
        self.since = now;
        self.watch_modes(&record);
        if !record.is_finite() {
            self.outbox.report(Severity::Warning, "the controller reported a joint value that is not a finite number");
            return;
        }
        let is_normal = record.safety_status == mode::SAFETY_NORMAL;
        self.outbox.push(ProtocolEvent::Joints(JointState {
            positions: record.actual_q.to_vec(),
            speeds: Some(record.actual_qd.to_vec()),
            controller_time: record.timestamp,
            stopped: (!is_normal).then(|| mode::safety_status(record.safety_status)),
        }));
    }

    /// Reports changes of the modes, and at the start any unusual ones.
    fn watch_modes(&mut self, record: &Record) {
        let usual = (mode::MODE_RUNNING, mode::SAFETY_NORMAL);
        let (robot_mode, safety_status) =
            self.modes.replace((record.robot_mode, record.safety_status)).unwrap_or(usual);
        if robot_mode != record.robot_mode {
            self.outbox.report(Severity::Info, format!("robot mode: {}", mode::robot_mode(record.robot_mode)));
        }
        if safety_status != record.safety_status {
            let is_normal = record.safety_status == mode::SAFETY_NORMAL;
            let severity = if is_normal { Severity::Info } else { Severity::Warning };
            self.outbox.report(severity, format!("safety status: {}", mode::safety_status(record.safety_status)));
        }
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.framer.clear();
        self.outbox.lose(failure);
    }
}

/// Names of the values that were refused with this word in place of a type.
fn refused(types: &[String], word: &str) -> Vec<&'static str> {
    let pairs = Record::FIELDS.iter().zip(types);
    pairs.filter(|(_, kind)| *kind == word).map(|((name, _), _)| *name).collect()
}

impl Default for Rtde {
    fn default() -> Self {
        Self::new(RtdeOptions::default())
    }
}

impl Protocol for Rtde {
    fn start(&mut self, now: Moment) {
        *self = Self::new(self.options);
        self.ask(Phase::ProtocolVersion, request_version(), now);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        if self.phase == Phase::Off {
            return;
        }
        self.framer.feed(bytes);
        if self.phase == Phase::ProtocolVersion
            && let Err(error) = self.framer.check_header()
        {
            // No packet was understood so far, so the other end is not a controller.
            self.lose(Failure::Foreign(format!("it does not use RTDE: {error}")));
            return;
        }
        while self.phase != Phase::Off {
            let packet = match self.framer.next_packet() {
                Ok(Some((kind, content))) => Packet::decode(kind, &content),
                Ok(None) => return,
                Err(error) => Err(error),
            };
            match packet {
                Ok(packet) => self.take(packet, now),
                Err(error) => self.lose(Failure::Garbled(error.to_string())),
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        if self.phase == Phase::Off || now < self.since.saturating_add(self.timeout()) {
            return;
        }
        let what = match self.phase {
            Phase::Data => "waiting for joint values",
            _ => "setting up the stream of joint values",
        };
        let seconds = now.saturating_sub(self.since).as_secs_f64();
        self.lose(Failure::Silent { what: what.to_owned(), seconds });
    }

    fn trigger(&mut self, _now: Moment) {
        let text = "a robot controller reports joint values and takes no shots".to_owned();
        self.outbox.fail(Failure::Refused(text));
    }

    fn cancel(&mut self, _now: Moment) {}

    fn next_output(&mut self) -> Option<Vec<u8>> {
        self.outbox.next_output()
    }

    fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.outbox.next_event()
    }

    fn next_deadline(&self) -> Option<Moment> {
        (self.phase != Phase::Off).then(|| self.since.saturating_add(self.timeout()))
    }
}

#[cfg(test)]
impl Rtde {
    /// Bytes of an incomplete packet.
    pub(in crate::link) fn pending(&self) -> usize {
        self.framer.pending()
    }
}
