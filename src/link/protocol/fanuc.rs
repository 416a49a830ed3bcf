//! FANUC controllers with the Remote Motion Interface (RMI), TCP port 16001: reads the joint angles. Nothing is ever moved.
//!
//! Messages are JSON objects in lines that end with CR LF. `FRC_Connect` answers with the number of a second port, over which
//! everything else goes. `FRC_ReadJointAngles` answers with J1 to J9 in degree, in `JointAngle` or, on older software, in
//! `JointAngles`; a six-axis arm has zeros from J7 on. J3 is counted from the horizontal, as the pendant shows it, so it depends on
//! J2. Reading needs a connection only: `FRC_Initialize`, which takes the robot over for motion, is never sent.

#[cfg(test)]
mod tests;

use std::time::Duration;

use serde::Deserialize;
use serde_json::Value;

use super::excerpt::excerpt;
use super::lines::{LineSplitter, MAX_LINE, Piece};
use super::outbox::Outbox;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// TCP port for the first connection.
pub const PORT: u16 = 16001;

/// Interval of the requests.
const INTERVAL: Duration = Duration::from_millis(50);

/// Longest wait for an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of joints that are read; further ones are external axes.
const JOINTS: usize = 6;

const CONNECT: &str = "FRC_Connect";
const READ: &str = "FRC_ReadJointAngles";
const TERMINATED: &str = "FRC_Terminate";
const FAULT: &str = "FRC_SystemFault";

/// Options of the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FanucOptions {
    /// Motion group of the arm.
    pub group: u8,
    /// Whether the controller counts J3 from the upper arm. The default is that it counts it from the horizontal, as the pendant
    /// does.
    pub j3_from_upper_arm: bool,
}

impl Default for FanucOptions {
    fn default() -> Self {
        Self { group: 1, j3_from_upper_arm: false }
    }
}

/// A message of the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// What it answers, or what has happened.
    pub name: String,
    /// Number of the error; 0 for none.
    pub error: i64,
    fields: Value,
}

impl Message {
    /// Reads a line. Fails with the reason.
    pub fn read(line: &[u8]) -> Result<Self, String> {
        let unreadable = || format!("`{}` is not a message", excerpt(&String::from_utf8_lossy(line)));
        let fields: Value = serde_json::from_slice(line).map_err(|_error| unreadable())?;
        let name = ["Communication", "Command", "Instruction"].into_iter().find_map(|kind| fields.get(kind)?.as_str());
        let name = name.ok_or_else(unreadable)?.to_owned();
        let error = fields.get("ErrorID").and_then(Value::as_i64).unwrap_or(0);
        Ok(Self { name, error, fields })
    }

    /// The second port of an answer to `FRC_Connect`.
    fn port(&self) -> Option<u16> {
        self.fields.get("PortNumber")?.as_u64()?.try_into().ok().filter(|port| *port > 0)
    }

    /// Version of the interface.
    fn version(&self) -> Option<String> {
        let number = |name: &str| self.fields.get(name)?.as_u64();
        Some(format!("{}.{}", number("MajorVersion")?, number("MinorVersion")?))
    }

    /// Joint angles (rad) of an answer to `FRC_ReadJointAngles`.
    pub fn joint_angles(&self, options: FanucOptions) -> Result<Vec<f64>, String> {
        let angles = self.fields.get("JointAngle").or_else(|| self.fields.get("JointAngles"));
        let angle = |joint: usize| {
            let value = angles?.get(format!("J{joint}"))?.as_f64();
            value.filter(|value| value.is_finite() && value.abs() < 3600.0).map(f64::to_radians)
        };
        let mut angles: Vec<f64> = (1..=JOINTS)
            .map(angle)
            .collect::<Option<_>>()
            .ok_or_else(|| format!("`{}` has no angles J1 to J6", excerpt(&self.fields.to_string())))?;
        if options.j3_from_upper_arm
            && let [_, j2, j3, ..] = angles.as_mut_slice()
        {
            *j3 -= *j2;
        }
        Ok(angles)
    }
}

/// Driver of a controller.
#[derive(Clone, Debug, Default)]
pub struct Fanuc {
    options: FanucOptions,
    splitter: LineSplitter,
    outbox: Outbox,
    phase: Phase,
    /// The port to continue at.
    redirect: Option<u16>,
    version: Option<String>,
    has_reported_failure: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    #[default]
    Off,
    /// Waiting for the second port, since this time.
    Connecting(Moment),
    /// Waiting for joint angles, since this time.
    Reading { since: Moment, is_ready: bool },
    /// Waiting until the next request.
    Pause(Moment),
}

impl Fanuc {
    /// A driver with these options.
    pub fn new(options: FanucOptions) -> Self {
        Self { options, ..Self::default() }
    }

    fn ask(&mut self, text: &str) {
        self.outbox.send(format!("{text}\r\n").into_bytes());
    }

    fn ask_for_joints(&mut self, is_ready: bool, now: Moment) {
        self.phase = Phase::Reading { since: now, is_ready };
        self.ask(&format!(r#"{{"Command":"{READ}","Group":{}}}"#, self.options.group));
    }

    fn piece(&mut self, piece: Piece, now: Moment) {
        let read = match piece {
            Piece::Line(line) => Message::read(&line),
            Piece::Overlong => Err(format!("more than {MAX_LINE} bytes without a line end")),
        };
        match read {
            Ok(message) => self.take(&message, now),
            Err(why) if matches!(self.phase, Phase::Connecting(_)) => {
                self.lose(Failure::Foreign(format!("it does not answer like the Remote Motion Interface: {why}")));
            }
            Err(why) => self.lose(Failure::Garbled(why)),
        }
    }

    fn take(&mut self, message: &Message, now: Moment) {
        match (message.name.as_str(), self.phase) {
            (TERMINATED, _) => {
                self.lose(Failure::Disconnected(format!("the controller has ended the connection ({TERMINATED})")));
            }
            (FAULT, _) => self.outbox.report(Severity::Warning, "the controller reports a fault; look at the pendant"),
            (CONNECT, Phase::Connecting(_)) => self.take_connection(message, now),
            (READ, Phase::Reading { is_ready, .. }) => self.take_joints(message, is_ready, now),
            // Late answers, and what others have asked for.
            _ => {}
        }
    }

    fn take_connection(&mut self, message: &Message, now: Moment) {
        match message.port() {
            _ if message.error != 0 => {
                let text = format!("{CONNECT}: error {}; RMI serves one program at a time", message.error);
                self.lose(Failure::Refused(text));
            }
            None => self.lose(Failure::Garbled(format!("the answer to {CONNECT} has no port"))),
            Some(port) => {
                self.version = message.version();
                self.redirect = Some(port);
                self.ask_for_joints(false, now);
            }
        }
    }

    fn take_joints(&mut self, message: &Message, is_ready: bool, now: Moment) {
        if message.error != 0 {
            if !is_ready {
                return self.lose(Failure::Refused(format!("{READ}: error {}", message.error)));
            }
            if !std::mem::replace(&mut self.has_reported_failure, true) {
                let text = format!("the joint angles cannot be read now: error {}", message.error);
                self.outbox.report(Severity::Warning, text);
            }
            self.phase = Phase::Pause(now + INTERVAL);
            return;
        }
        match message.joint_angles(self.options) {
            Err(why) => self.lose(Failure::Garbled(why)),
            Ok(positions) => {
                self.has_reported_failure = false;
                if !is_ready {
                    let version = self.version.as_ref().map_or_else(String::new, |version| format!(" {version}"));
                    let j3 = if self.options.j3_from_upper_arm { "the upper arm, converted" } else { "the horizontal" };
                    self.outbox.push(ProtocolEvent::Ready(Identity {
                        name: format!("FANUC controller, RMI{version}"),
                        checked: vec![format!("joint values: J1 to J6 in deg, J3 counted from {j3}")],
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
        self.splitter.clear();
        self.redirect = None;
        self.outbox.lose(failure);
    }

    /// Bytes of an incomplete line.
    pub const fn pending(&self) -> usize {
        self.splitter.pending()
    }
}

impl Protocol for Fanuc {
    fn start(&mut self, now: Moment) {
        *self = Self { phase: Phase::Connecting(now), ..Self::new(self.options) };
        self.ask(&format!(r#"{{"Communication":"{CONNECT}"}}"#));
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        for &byte in bytes {
            if self.phase != Phase::Off
                && let Some(piece) = self.splitter.push(byte)
            {
                self.piece(piece, now);
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        match self.phase {
            Phase::Pause(until) if until <= now => self.ask_for_joints(true, now),
            Phase::Connecting(since) | Phase::Reading { since, .. } if since + ANSWER_TIMEOUT <= now => {
                let what = "waiting for joint angles".to_owned();
                self.lose(Failure::Silent { what, seconds: ANSWER_TIMEOUT.as_secs_f64() });
            }
            Phase::Off | Phase::Pause(_) | Phase::Connecting(_) | Phase::Reading { .. } => {}
        }
    }

    fn next_redirect(&mut self) -> Option<u16> {
        self.redirect.take()
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Off => None,
            Phase::Pause(until) => Some(until),
            Phase::Connecting(since) | Phase::Reading { since, .. } => Some(since + ANSWER_TIMEOUT),
        }
    }
}
