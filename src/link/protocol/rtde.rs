//! Universal Robots real-time data exchange over TCP, port 30004: the measured joint values of the controller.
//!
//! The set-up requests version 2 of the protocol, the version of the controller and four values, then starts the stream. A
//! controller that does not know one of the optional values is asked again without it. From then on every packet is a
//! [`ProtocolEvent::Joints`]; a silent stream counts as lost. Nothing is ever written to the robot. There are no shots: a
//! trigger is refused.

pub mod mode;
pub mod packet;
#[cfg(test)]
mod tests;

use std::time::Duration;

use self::packet::{Field, Framer, Packet, Record, TextMessage, encode, packet_type, request_version, set_up_outputs};
use super::excerpt::excerpt;
use super::outbox::Outbox;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// TCP port of the interface.
pub const PORT: u16 = 30_004;

/// Highest frequency (Hz). Controllers drop clients that read too slowly, and more is not needed here.
pub const MAX_FREQUENCY: f64 = 25.0;

/// Lowest frequency (Hz).
pub const MIN_FREQUENCY: f64 = 1.0;

/// Joint values that differ by more than this from all zeros cannot become zeros within one packet (rad).
const DROPOUT: f64 = 0.05;

/// Most consecutive packets of zeros that count as a dropout of the controller.
const MAX_DROPOUTS: u32 = 25;

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
    /// Values of the recipe.
    fields: Vec<Field>,
    /// Robot mode of the previous packet.
    robot_mode: Option<i32>,
    /// Safety status of the previous packet.
    safety_status: Option<i32>,
    /// Joint values of the previous packet (rad).
    previous: Option<[f64; 6]>,
    /// Consecutive packets of zeros.
    dropouts: u32,
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
            fields: Vec::new(),
            robot_mode: None,
            safety_status: None,
            previous: None,
            dropouts: 0,
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
                let text = "version 2 of the interface, which PolyScope has from 3.4 on; update the software of the controller";
                self.lose(Failure::Refused(text.to_owned()));
            }
            (Phase::ControllerVersion, Packet::ControllerVersion([major, minor, fix, build])) => {
                self.name = format!("Universal Robots controller, version {major}.{minor}.{fix}.{build}");
                self.fields = Record::FIELDS.to_vec();
                self.ask_for_fields(now);
            }
            (Phase::Outputs, Packet::Outputs { recipe, types }) => self.take_types(recipe, &types, now),
            (Phase::Start, Packet::Started(true)) => {
                self.phase = Phase::Data;
                self.since = now;
                let identity = self.identity();
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

    /// Requests the values of the recipe.
    fn ask_for_fields(&mut self, now: Moment) {
        let names: Vec<&str> = self.fields.iter().map(|field| field.name()).collect();
        self.ask(Phase::Outputs, set_up_outputs(self.options.frequency, &names), now);
    }

    fn identity(&self) -> Identity {
        let reported: Vec<&str> = self.fields.iter().map(|field| field.name()).collect();
        let has = |field: Field| self.fields.contains(&field);
        let mut notes = Vec::new();
        if !has(Field::SafetyStatus) && !has(Field::SafetyMode) {
            notes.push("this controller does not report its safety state: whether the robot is at rest is judged by its joints alone".to_owned());
        }
        Identity {
            name: self.name.clone(),
            checked: vec![
                format!("joint values: rad, {} Hz", self.options.frequency),
                format!("values of the controller: {}", reported.join(", ")),
            ],
            notes,
            ..Identity::default()
        }
    }

    /// Checks that every requested value is available with the expected type, and adapts the request to older controllers.
    fn take_types(&mut self, recipe: u8, types: &[String], now: Moment) {
        let in_use = self.refused(types, "IN_USE");
        let not_found = self.refused(types, "NOT_FOUND");
        let missing = |field: &&Field| field.is_required();
        if !in_use.is_empty() {
            self.lose(Failure::InUse(format!("another program uses {}", names(&in_use))));
        } else if let Some(field) = not_found.iter().find(missing) {
            self.lose(Failure::Refused(format!("the controller does not know {}", field.name())));
        } else if !not_found.is_empty() {
            // Every further request is shorter or has an older value, so this ends.
            let older = |field: &Field| if not_found.contains(field) { field.older() } else { Some(*field) };
            self.fields = self.fields.iter().filter_map(older).collect();
            self.ask_for_fields(now);
        } else if types.iter().ne(self.fields.iter().map(|field| field.kind())) {
            let types = excerpt(&types.join(","));
            self.lose(Failure::Garbled(format!("unexpected types of the values: {types}")));
        } else {
            self.recipe = recipe;
            self.ask(Phase::Start, encode(packet_type::CONTROL_PACKAGE_START, &[]), now);
        }
    }

    /// The values that were refused with this word in place of a type.
    fn refused(&self, types: &[String], word: &str) -> Vec<Field> {
        let pairs = self.fields.iter().zip(types);
        pairs.filter(|(_, kind)| *kind == word).map(|(field, _)| *field).collect()
    }

    fn take_data(&mut self, values: &[u8], now: Moment) {
        let Some(record) = Record::decode(&self.fields, values) else {
            let size = Record::size(&self.fields);
            let text = format!("a data packet has {} bytes of values instead of {size}", values.len());
            self.lose(Failure::Garbled(text));
            return;
        };
        self.since = now;
        self.watch_modes(&record);
        if !record.is_finite() {
            self.outbox.report(Severity::Warning, "the controller reported a joint value that is not a finite number");
            return;
        }
        if self.is_dropout(&record.actual_q) {
            self.outbox.report(Severity::Warning, "the controller reported zeros in place of its joint values");
            return;
        }
        let safety = record.safety_status.filter(|status| *status != mode::SAFETY_NORMAL);
        let forbidding = safety.filter(|status| mode::forbids_measuring(*status));
        self.outbox.push(ProtocolEvent::Joints(JointState {
            positions: record.actual_q.to_vec(),
            controller_time: record.timestamp,
            stopped: forbidding.map(mode::safety_status),
            remark: safety.filter(|_| forbidding.is_none()).map(mode::safety_status),
        }));
    }

    /// Whether these are zeros that controllers are known to send now and then in place of the joint values. A robot that stays
    /// there is really at zero.
    fn is_dropout(&mut self, positions: &[f64; 6]) -> bool {
        let is_zero = positions.iter().all(|value| *value == 0.0);
        let was_elsewhere = self.previous.is_some_and(|previous| previous.iter().any(|value| value.abs() > DROPOUT));
        if is_zero && was_elsewhere && self.dropouts < MAX_DROPOUTS {
            self.dropouts += 1;
            return true;
        }
        self.dropouts = 0;
        self.previous = Some(*positions);
        false
    }

    /// Reports changes of the modes, and at the start any unusual ones.
    fn watch_modes(&mut self, record: &Record) {
        if let Some(robot_mode) = record.robot_mode
            && self.robot_mode.replace(robot_mode).unwrap_or(mode::MODE_RUNNING) != robot_mode
        {
            self.outbox.report(Severity::Info, format!("robot mode: {}", mode::robot_mode(robot_mode)));
        }
        if let Some(status) = record.safety_status
            && self.safety_status.replace(status).unwrap_or(mode::SAFETY_NORMAL) != status
        {
            let severity = if mode::forbids_measuring(status) { Severity::Warning } else { Severity::Info };
            self.outbox.report(severity, format!("safety status: {}", mode::safety_status(status)));
        }
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.framer.clear();
        self.outbox.lose(failure);
    }
}

fn names(fields: &[Field]) -> String {
    let names: Vec<&str> = fields.iter().map(|field| field.name()).collect();
    names.join(", ")
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

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
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
