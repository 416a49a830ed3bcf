//! Yaskawa controllers with the High-Speed Ethernet Server, UDP port 10040: reads the pulses of the axes.
//!
//! Everything is little-endian. A header of 32 bytes begins with `YERC`, its own length and the length of what follows; behind the
//! number of the request it has a part that differs between requests (command, instance, attribute, service) and answers (service,
//! status, added status). Command 75h of instance 1 answers with the kind of data, which is 0 for pulses, four more words, and the
//! pulses of eight axes in the controller's order S, L, U, R, B, T and then the seventh. The pulses per degree belong to the type
//! of the arm: they are in the controller's parameters, and here in the options or in the profile. Nothing is ever written.

#[cfg(test)]
mod tests;

use std::time::Duration;

use serde::Deserialize;

use super::excerpt::excerpt;
use super::outbox::Outbox;
use super::receive_buffer::ReceiveBuffer;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// UDP port of the server for the robot.
pub const PORT: u16 = 10040;

/// Length of the header (bytes).
pub const HEADER: usize = 32;

/// Longest content of a datagram (bytes).
pub const MAX_CONTENT: usize = 479;

const MAGIC: &[u8; 4] = b"YERC";
const RESERVED: &[u8; 8] = b"99999999";

/// Marks the only or last datagram of an answer.
pub const LAST_BLOCK: u32 = 0x8000_0000;

/// Interval of the requests.
const INTERVAL: Duration = Duration::from_millis(50);

/// Wait for an answer before the request is sent again: datagrams can be lost.
const REPEAT_AFTER: Duration = Duration::from_millis(400);

/// Number of times that a request is sent.
const ATTEMPTS: u32 = 5;

/// A command of the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Number of the command.
    pub number: u16,
    /// What of it is meant, such as the first robot.
    pub instance: u16,
}

/// Position of the first robot in pulses.
pub const PULSES: Command = Command { number: 0x75, instance: 1 };

/// Versions and model of the first robot.
pub const SYSTEM: Command = Command { number: 0x89, instance: 11 };

/// Reads all attributes of a command.
const READ_ALL: u8 = 0x01;

/// The bit of the service that marks an answer.
pub const ANSWER: u8 = 0x80;

/// Offset and length of the model in an answer to [`SYSTEM`].
pub const MODEL: (usize, usize) = (24, 16);

/// Words in front of the pulses.
pub const WORDS_BEFORE: usize = 5;

/// Options of the link.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct YaskawaOptions {
    /// Pulses per degree of each axis in the controller's order, as many as the arm has; negative where the profile turns the
    /// other way.
    pub pulses_per_degree: Vec<f64>,
}

/// Request for a command.
pub fn request(id: u8, command: Command) -> Vec<u8> {
    let number = command.number.to_le_bytes();
    let instance = command.instance.to_le_bytes();
    let part = [number[0], number[1], instance[0], instance[1], 0, READ_ALL, 0, 0];
    header(id, false, 0, part, 0)
}

/// A header with its last eight bytes.
pub fn header(id: u8, is_answer: bool, content: usize, part: [u8; 8], block: u32) -> Vec<u8> {
    let length = u16::try_from(content).unwrap_or(u16::MAX).to_le_bytes();
    let fixed = [0x20, 0, length[0], length[1], 3, 1, u8::from(is_answer), id];
    [&MAGIC[..], &fixed, &block.to_le_bytes(), RESERVED, &part].concat()
}

/// Answer of the server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Number of the request.
    pub id: u8,
    /// Content, or what the server says instead: status and added status.
    pub content: Result<Vec<u8>, (u8, u16)>,
}

impl Answer {
    /// Reads the next answer of a stream with its length; `None` if it is not complete.
    pub fn read(bytes: &[u8]) -> Result<Option<(Self, usize)>, String> {
        let begins_right = bytes.iter().zip(MAGIC).all(|(byte, expected)| byte == expected);
        if !begins_right {
            return Err(format!("`{}` does not begin with YERC", excerpt(&String::from_utf8_lossy(bytes))));
        }
        let Some((header, rest)) = bytes.split_first_chunk::<HEADER>() else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes([header[6], header[7]]));
        if length > MAX_CONTENT {
            return Err(format!("an answer of {length} bytes was announced"));
        }
        if header[4..6] != [0x20, 0] || header[10] != 1 {
            return Err("the header is not that of an answer".to_owned());
        }
        let Some(content) = rest.get(..length) else { return Ok(None) };
        let (status, added) = (header[25], u16::from_le_bytes([header[28], header[29]]));
        let content = if status == 0 { Ok(content.to_vec()) } else { Err((status, added)) };
        Ok(Some((Self { id: header[11], content }, HEADER + length)))
    }
}

/// Driver of a controller.
#[derive(Clone, Debug, Default)]
pub struct Yaskawa {
    options: YaskawaOptions,
    received: ReceiveBuffer,
    outbox: Outbox,
    phase: Phase,
    id: u8,
    attempts: u32,
    model: Option<String>,
    has_reported_failure: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    #[default]
    Off,
    /// Waiting for the model, since this time.
    Model(Moment),
    /// Waiting for pulses, since this time.
    Pulses { since: Moment, is_ready: bool },
    /// Waiting until the next request.
    Pause(Moment),
}

impl Yaskawa {
    /// A driver with these options.
    ///
    /// # Errors
    /// Pulses per degree are missing or no numbers.
    pub fn new(options: YaskawaOptions) -> Result<Self, String> {
        if options.pulses_per_degree.is_empty() {
            return Err(
                "a Yaskawa controller reports pulses: state '(pulses_per_degree: [1000.0, ...])' in the options of the robot, or 'pulses_per_degree' of each joint in the profile".to_owned(),
            );
        }
        let is_usable = |pulses: &f64| pulses.is_finite() && pulses.abs() >= 1.0;
        if options.pulses_per_degree.len() > 8 || !options.pulses_per_degree.iter().all(is_usable) {
            return Err("pulses_per_degree: up to eight numbers, each at least 1".to_owned());
        }
        Ok(Self { options, ..Self::default() })
    }

    fn send(&mut self) {
        let command = if matches!(self.phase, Phase::Model(_)) { SYSTEM } else { PULSES };
        self.outbox.send(request(self.id, command));
    }

    fn ask(&mut self, phase: Phase) {
        self.id = self.id.wrapping_add(1);
        self.attempts = 1;
        self.phase = phase;
        self.send();
    }

    fn take(&mut self, answer: Answer, now: Moment) {
        // A late answer to an earlier request.
        if answer.id != self.id {
            return;
        }
        match self.phase {
            Phase::Off | Phase::Pause(_) => {}
            Phase::Model(_) => {
                let content = answer.content.unwrap_or_default();
                let model = content.get(MODEL.0..MODEL.0 + MODEL.1).unwrap_or_default();
                let model = String::from_utf8_lossy(model).trim_matches(['\0', ' ']).to_owned();
                self.model = (!model.is_empty()).then(|| excerpt(&model));
                self.ask(Phase::Pulses { since: now, is_ready: false });
            }
            Phase::Pulses { is_ready, .. } => self.take_pulses(answer.content, is_ready, now),
        }
    }

    fn take_pulses(&mut self, content: Result<Vec<u8>, (u8, u16)>, is_ready: bool, now: Moment) {
        let content = match content {
            Ok(content) => content,
            Err((status, added)) => {
                let text = format!("the pulses cannot be read: status {status:02X}h, added status {added:04X}h");
                if !is_ready {
                    return self.lose(Failure::Refused(text));
                }
                if !std::mem::replace(&mut self.has_reported_failure, true) {
                    self.outbox.report(Severity::Warning, text);
                }
                self.phase = Phase::Pause(now + INTERVAL);
                return;
            }
        };
        match self.positions(&content) {
            Err(why) => self.lose(Failure::Garbled(why)),
            Ok(positions) => {
                self.has_reported_failure = false;
                if !is_ready {
                    let model = self.model.as_deref().unwrap_or("unknown robot");
                    let axes = positions.len();
                    self.outbox.push(ProtocolEvent::Ready(Identity {
                        name: format!("Yaskawa controller, {model}"),
                        checked: vec![format!(
                            "joint values: pulses of {axes} axes, with the pulses per degree stated"
                        )],
                        ..Identity::default()
                    }));
                }
                let controller_time = now.as_secs_f64();
                self.outbox.push(ProtocolEvent::Joints(JointState { controller_time, ..JointState::at(positions) }));
                self.phase = Phase::Pause(now + INTERVAL);
            }
        }
    }

    /// Joint values (rad) of the pulses.
    fn positions(&self, content: &[u8]) -> Result<Vec<f64>, String> {
        let words: Vec<i32> =
            content.chunks_exact(4).map(|word| i32::from_le_bytes(word.try_into().unwrap_or_default())).collect();
        let (kind, pulses) = match words.split_at_checked(WORDS_BEFORE) {
            Some(([kind, ..], pulses)) => (*kind, pulses),
            _ => return Err(format!("an answer of {} bytes has no pulses", content.len())),
        };
        if kind != 0 {
            return Err(format!("the answer has data of kind {kind} in place of pulses"));
        }
        let scales = &self.options.pulses_per_degree;
        if pulses.len() < scales.len() {
            return Err(format!(
                "the answer has {} axes, and pulses per degree of {} are stated",
                pulses.len(),
                scales.len()
            ));
        }
        Ok(pulses.iter().zip(scales).map(|(pulses, scale)| (f64::from(*pulses) / scale).to_radians()).collect())
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.received.clear();
        self.outbox.lose(failure);
    }

    /// Bytes of an incomplete answer.
    pub fn pending(&self) -> usize {
        self.received.unread().len()
    }
}

impl Protocol for Yaskawa {
    fn start(&mut self, now: Moment) {
        // Numbers continue, so that answers to an earlier set-up are not accepted.
        *self = Self { options: std::mem::take(&mut self.options), id: self.id, ..Self::default() };
        self.ask(Phase::Model(now));
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        if self.phase == Phase::Off {
            return;
        }
        self.received.feed(bytes);
        while self.phase != Phase::Off {
            let unread = self.received.unread();
            if unread.is_empty() {
                return;
            }
            match Answer::read(unread) {
                Ok(Some((answer, length))) => {
                    self.received.consume(length);
                    self.take(answer, now);
                }
                Ok(None) => return,
                Err(why) if matches!(self.phase, Phase::Model(_)) => {
                    self.lose(Failure::Foreign(format!("it does not answer like a High-Speed Ethernet Server: {why}")));
                }
                Err(why) => self.lose(Failure::Garbled(why)),
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        match self.phase {
            Phase::Pause(until) if until <= now => self.ask(Phase::Pulses { since: now, is_ready: true }),
            Phase::Model(since) | Phase::Pulses { since, .. } if since + REPEAT_AFTER <= now => {
                if self.attempts >= ATTEMPTS {
                    let what = "waiting for the pulses of the axes".to_owned();
                    let seconds = REPEAT_AFTER.as_secs_f64() * f64::from(ATTEMPTS);
                    return self.lose(Failure::Silent { what, seconds });
                }
                self.attempts += 1;
                // Half a datagram of before is no beginning of the next.
                self.received.clear();
                self.phase = match self.phase {
                    Phase::Model(_) => Phase::Model(now),
                    Phase::Pulses { is_ready, .. } => Phase::Pulses { since: now, is_ready },
                    other @ (Phase::Off | Phase::Pause(_)) => other,
                };
                self.send();
            }
            Phase::Off | Phase::Pause(_) | Phase::Model(_) | Phase::Pulses { .. } => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Off => None,
            Phase::Pause(until) => Some(until),
            Phase::Model(since) | Phase::Pulses { since, .. } => Some(since + REPEAT_AFTER),
        }
    }
}
