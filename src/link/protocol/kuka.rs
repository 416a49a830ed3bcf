//! KUKA controllers with KUKAVARPROXY or C3 Bridge, TCP port 7000: reads the variable `$AXIS_ACT`, the joint angles as the
//! pendant shows them.
//!
//! Both are programs of others that run on the controller. A request is big-endian: a number (u16), the length of the rest (u16),
//! 0 for reading (u8), the length of the name (u16) and the name. The answer repeats the number and has the length of the rest, the
//! mode, the length of the value, the value as text, and three bytes of which the last is 1 on success. Nothing is ever written.

#[cfg(test)]
mod tests;

use std::time::Duration;

use super::excerpt::excerpt;
use super::outbox::Outbox;
use super::receive_buffer::ReceiveBuffer;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// TCP port of both programs.
pub const PORT: u16 = 7000;

/// Interval of the requests; an answer takes about 10 ms.
const INTERVAL: Duration = Duration::from_millis(50);

/// Longest wait for an answer. The programs stop answering after a restart of the controller, and a new connection helps.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Longest answer (bytes after its header).
const MAX_ANSWER: usize = 4096;

/// Variable with the joint angles.
const AXES: &str = "$AXIS_ACT";

/// Variable with the name of the robot.
const MODEL: &str = "$MODEL_NAME[]";

/// Names of the joints in [`AXES`].
const NAMES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];

/// Request for a variable.
pub fn read_request(id: u16, name: &str) -> Vec<u8> {
    let length = u16::try_from(name.len()).unwrap_or(u16::MAX);
    let content = [&[0][..], &length.to_be_bytes(), name.as_bytes()].concat();
    let rest = u16::try_from(content.len()).unwrap_or(u16::MAX);
    [&id.to_be_bytes()[..], &rest.to_be_bytes(), &content].concat()
}

/// Answer to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Number of the request.
    pub id: u16,
    /// Value as text; `None` if the variable could not be read.
    pub value: Option<String>,
}

impl Answer {
    /// Reads the content after the header.
    fn read(id: u16, content: &[u8]) -> Option<Self> {
        let (_mode, rest) = content.split_first()?;
        let (length, rest) = rest.split_first_chunk::<2>()?;
        let (value, tail) = rest.split_at_checked(usize::from(u16::from_be_bytes(*length)))?;
        let is_read = tail.last() == Some(&1) && tail.len() == 3;
        let value = String::from_utf8_lossy(value).trim_matches('\0').trim().to_owned();
        Some(Self { id, value: is_read.then_some(value) })
    }
}

/// Joint angles (rad) of a value such as `{E6AXIS: A1 10.0, A2 -90.0, ...}`.
pub fn joint_angles(value: &str) -> Result<Vec<f64>, String> {
    let unreadable = || format!("`{}` is not a value of {AXES}", excerpt(value));
    let inside = value.trim().strip_prefix('{').and_then(|rest| rest.strip_suffix('}')).ok_or_else(unreadable)?;
    let fields = inside.split_once(':').map_or(inside, |(_, fields)| fields);
    let pairs: Vec<(&str, f64)> = fields
        .split(',')
        .map(|field| {
            let (name, number) = field.trim().split_once(' ')?;
            Some((name, number.trim().parse().ok().filter(|number: &f64| number.is_finite())?))
        })
        .collect::<Option<_>>()
        .ok_or_else(unreadable)?;
    let of = |name: &str| pairs.iter().find(|(known, _)| *known == name).map(|(_, angle)| angle.to_radians());
    NAMES.into_iter().map(of).collect::<Option<_>>().ok_or_else(unreadable)
}

/// Driver of a controller.
#[derive(Clone, Debug, Default)]
pub struct Kuka {
    received: ReceiveBuffer,
    outbox: Outbox,
    phase: Phase,
    id: u16,
    name: Option<String>,
    has_reported_failure: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    #[default]
    Off,
    /// Waiting for the name of the robot, since this time.
    Model(Moment),
    /// Waiting for joint angles, since this time.
    Axes { since: Moment, is_ready: bool },
    /// Waiting until the next request.
    Pause(Moment),
}

impl Kuka {
    fn ask(&mut self, name: &str) {
        self.id = self.id.wrapping_add(1);
        self.outbox.send(read_request(self.id, name));
    }

    fn ask_for_axes(&mut self, is_ready: bool, now: Moment) {
        self.phase = Phase::Axes { since: now, is_ready };
        self.ask(AXES);
    }

    /// The next complete answer.
    fn next_answer(&mut self) -> Result<Option<Answer>, String> {
        let rest = self.received.unread();
        let Some((&[high, low, above, below], rest)) = rest.split_first_chunk::<4>() else { return Ok(None) };
        let length = usize::from(u16::from_be_bytes([above, below]));
        if length > MAX_ANSWER {
            return Err(format!("an answer of {length} bytes was announced"));
        }
        let Some(content) = rest.get(..length) else { return Ok(None) };
        let answer = Answer::read(u16::from_be_bytes([high, low]), content);
        self.received.consume(4 + length);
        answer.map(Some).ok_or_else(|| "an answer is too short for its content".to_owned())
    }

    fn take(&mut self, answer: &Answer, now: Moment) {
        // A late answer to an earlier request.
        if answer.id != self.id {
            return;
        }
        match self.phase {
            Phase::Off | Phase::Pause(_) => {}
            Phase::Model(_) => {
                self.name = answer.value.as_deref().map(|name| excerpt(name.trim_matches('"')));
                self.ask_for_axes(false, now);
            }
            Phase::Axes { is_ready, .. } => self.take_axes(answer.value.as_deref(), is_ready, now),
        }
    }

    fn take_axes(&mut self, value: Option<&str>, is_ready: bool, now: Moment) {
        let Some(value) = value else {
            if !is_ready {
                return self.lose(Failure::Refused(format!("the variable {AXES} cannot be read")));
            }
            if !std::mem::replace(&mut self.has_reported_failure, true) {
                self.outbox.report(Severity::Warning, format!("the variable {AXES} cannot be read now"));
            }
            self.phase = Phase::Pause(now + INTERVAL);
            return;
        };
        match joint_angles(value) {
            Err(why) => self.lose(Failure::Garbled(why)),
            Ok(positions) => {
                self.has_reported_failure = false;
                if !is_ready {
                    let name = self.name.as_deref().unwrap_or("unknown robot");
                    self.outbox.push(ProtocolEvent::Ready(Identity {
                        name: format!("KUKA controller, {name}"),
                        checked: vec![format!("joint values: A1 to A6 in deg, from {AXES}")],
                        ..Identity::default()
                    }));
                }
                let controller_time = now.as_secs_f64();
                self.outbox.push(ProtocolEvent::Joints(JointState { controller_time, ..JointState::at(positions) }));
                self.phase = Phase::Pause(now + INTERVAL);
            }
        }
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

impl Protocol for Kuka {
    fn start(&mut self, now: Moment) {
        // Numbers continue, so that answers from an earlier connection are not accepted.
        *self = Self { id: self.id, phase: Phase::Model(now), ..Self::default() };
        self.ask(MODEL);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        if self.phase == Phase::Off {
            return;
        }
        self.received.feed(bytes);
        while self.phase != Phase::Off {
            match self.next_answer() {
                Ok(Some(answer)) => self.take(&answer, now),
                Ok(None) => return,
                Err(why) if matches!(self.phase, Phase::Model(_)) => {
                    self.lose(Failure::Foreign(format!("it does not answer like KUKAVARPROXY: {why}")));
                }
                Err(why) => self.lose(Failure::Garbled(why)),
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        match self.phase {
            Phase::Pause(until) if until <= now => self.ask_for_axes(true, now),
            Phase::Model(since) | Phase::Axes { since, .. } if since + ANSWER_TIMEOUT <= now => {
                let what = "waiting for joint angles".to_owned();
                self.lose(Failure::Silent { what, seconds: ANSWER_TIMEOUT.as_secs_f64() });
            }
            Phase::Off | Phase::Pause(_) | Phase::Model(_) | Phase::Axes { .. } => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Off => None,
            Phase::Pause(until) => Some(until),
            Phase::Model(since) | Phase::Axes { since, .. } => Some(since + ANSWER_TIMEOUT),
        }
    }
}
