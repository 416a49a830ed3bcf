//! Universal Robots real-time data exchange over TCP, port 30004: the joint values that the controller measures.
//!
//! The set-up asks for version 2 of the protocol, the version of the controller and five values, then starts the stream. From
//! then on every packet is a [`ProtocolEvent::Joints`]; a stream that is silent is lost. Nothing is ever written to the robot.
//! There are no shots: a trigger is refused.

pub mod mode;
pub mod packet;
mod stillness;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub use stillness::Stillness;

use self::packet::{Framer, Packet, Record, TextMessage, encode, packet_type, request_version, set_up_outputs};
use super::outbox::Outbox;
use super::text::shown;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// TCP port of the interface.
pub const PORT: u16 = 30_004;

/// Controllers drop clients that read too slowly; more than this is of no use here (Hz).
pub const MAX_FREQUENCY: f64 = 25.0;

/// The least that is asked for (Hz).
pub const MIN_FREQUENCY: f64 = 1.0;

/// How the robot is to be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RtdeOptions {
    /// Packets per second (Hz), taken into [`MIN_FREQUENCY`] to [`MAX_FREQUENCY`].
    pub frequency: f64,
    /// An answer in the set-up comes within this.
    pub patience: Duration,
    /// A stream without data for this is lost; at a low frequency, without three packets.
    pub silence: Duration,
}

impl Default for RtdeOptions {
    fn default() -> Self {
        Self { frequency: MAX_FREQUENCY, patience: Duration::from_secs(5), silence: Duration::from_secs(1) }
    }
}

/// What is awaited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Off,
    ProtocolVersion,
    ControllerVersion,
    Outputs,
    Start,
    Data,
}

/// The conversation with a controller.
#[derive(Clone, Debug)]
pub struct Rtde {
    options: RtdeOptions,
    outbox: Outbox,
    framer: Framer,
    phase: Phase,
    name: String,
    recipe: u8,
    /// Robot mode and safety status of the packet before.
    modes: Option<(i32, i32)>,
    /// When what is awaited began to be awaited.
    since: Moment,
}

impl Rtde {
    /// A conversation that has not begun.
    pub fn new(options: RtdeOptions) -> Self {
        let is_number = options.frequency.is_finite();
        let frequency = if is_number { options.frequency } else { MIN_FREQUENCY }.clamp(MIN_FREQUENCY, MAX_FREQUENCY);
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

    /// How long what is awaited may take.
    fn patience(&self) -> Duration {
        let three_packets = Duration::from_secs_f64(3.0 / self.options.frequency);
        if self.phase == Phase::Data { self.options.silence.max(three_packets) } else { self.options.patience }
    }

    /// Sends a request and awaits its answer.
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
                let text = "version 2 of the interface; the controller needs newer software";
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
                let text = format!("skipped data of recipe {recipe}; recipe {} was asked for", self.recipe);
                self.outbox.say(Severity::Warning, text);
            }
            _ => {}
        }
    }

    fn take_text(&mut self, message: &TextMessage) {
        let severity = if message.level >= 3 { Severity::Info } else { Severity::Warning };
        self.outbox.say(severity, format!("{}: {}", message.source, message.text));
    }

    /// Every value has to be there, with the type that it is read as.
    fn take_types(&mut self, recipe: u8, types: &[String], now: Moment) {
        let in_use: Vec<&str> = refused(types, "IN_USE");
        let not_found = refused(types, "NOT_FOUND");
        if !in_use.is_empty() {
            self.lose(Failure::InUse(format!("another program has {}", in_use.join(", "))));
        } else if !not_found.is_empty() {
            self.lose(Failure::Refused(format!("the controller does not know {}", not_found.join(", "))));
        } else if types.iter().ne(Record::FIELDS.iter().map(|(_, kind)| kind)) {
            let types = shown(&types.join(","));
            self.lose(Failure::Garbled(format!("the controller announced values of other types: {types}")));
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
            self.outbox.say(Severity::Warning, "the controller reported a joint value that is no finite number");
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

    /// Says changes of the modes, and at the beginning what is not as usual.
    fn watch_modes(&mut self, record: &Record) {
        let usual = (mode::MODE_RUNNING, mode::SAFETY_NORMAL);
        let (robot_mode, safety_status) =
            self.modes.replace((record.robot_mode, record.safety_status)).unwrap_or(usual);
        if robot_mode != record.robot_mode {
            self.outbox.say(Severity::Info, format!("robot mode: {}", mode::robot_mode(record.robot_mode)));
        }
        if safety_status != record.safety_status {
            let is_normal = record.safety_status == mode::SAFETY_NORMAL;
            let severity = if is_normal { Severity::Info } else { Severity::Warning };
            self.outbox.say(severity, format!("safety status: {}", mode::safety_status(record.safety_status)));
        }
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.framer.clear();
        self.outbox.lose(failure);
    }
}

/// The names whose type says that they are refused.
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
            // Nothing was understood so far: this never was a controller.
            self.lose(Failure::Foreign(format!("no RTDE comes: {error}")));
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
        if self.phase == Phase::Off || now < self.since.saturating_add(self.patience()) {
            return;
        }
        let what = match self.phase {
            Phase::Data => "joint values were awaited",
            _ => "the stream of joint values was set up",
        };
        let seconds = now.saturating_sub(self.since).as_secs_f64();
        self.lose(Failure::Silent { what: what.to_owned(), seconds });
    }

    fn trigger(&mut self, _now: Moment) {
        let text = "a robot controller has joint values and no shots".to_owned();
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
        (self.phase != Phase::Off).then(|| self.since.saturating_add(self.patience()))
    }
}

#[cfg(test)]
impl Rtde {
    /// Bytes that wait for the rest of a packet.
    pub(in crate::link) fn pending(&self) -> usize {
        self.framer.pending()
    }
}
