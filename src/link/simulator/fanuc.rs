//! A simulated FANUC controller with the Remote Motion Interface: connects at one port and answers at a second one.

use std::time::Duration;

use serde_json::{Map, Value, json};

use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;
use crate::link::protocol::lines::{LineSplitter, Piece};

/// Time from a request to its answer.
const ANSWERING: Duration = Duration::from_millis(8);

/// Port of the manual, where there is no socket.
const SECOND_PORT: u16 = 16002;

/// Error of a command that is not known.
const UNKNOWN: i64 = 2_556_950;

faults! {
    /// A fault of the simulated controller. Its occasion is a request.
    pub FanucFault {
        Refused "refused" "The request is answered with an error.",
        NoPort "no-port" "The answer has no number of the second port.",
        OldName "old-name" "The angles are in JointAngles, as on older software.",
        MissingJoint "missing-joint" "J6 is missing.",
        NotANumber "not-a-number" "A joint value is not a number.",
        NoJson "no-json" "The answer is not JSON.",
        SystemFault "system-fault" "A message about a fault comes before the answer.",
        Terminate "terminate" "The controller ends the connection.",
        Halves "halves" "The answer in two halves with a pause between them.",
        Silent "silent" "No answer.",
        DisconnectMidAnswer "disconnect-mid-answer" "The connection is closed in the middle of the answer.",
    }
}

/// A simulated controller.
#[derive(Debug)]
pub struct FanucSimulator {
    faults: FaultPlan<FanucFault>,
    splitter: LineSplitter,
    schedule: Schedule,
    second_port: u16,
}

impl FanucSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<FanucFault>>) -> Self {
        let faults = FaultPlan::new(faults);
        Self { faults, splitter: LineSplitter::default(), schedule: Schedule::default(), second_port: SECOND_PORT }
    }

    /// Bytes of an incomplete request.
    pub const fn pending(&self) -> usize {
        self.splitter.pending()
    }

    fn answer(&mut self, line: &[u8], source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|_| true);
        let request: Value = serde_json::from_slice(line).unwrap_or(Value::Null);
        let named = ["Communication", "Command", "Instruction"]
            .into_iter()
            .find_map(|kind| Some((kind, request.get(kind)?.as_str()?.to_owned())));
        let Some((kind, name)) = named else { return };
        let mut fields = Map::new();
        fields.insert(kind.to_owned(), Value::from(name.clone()));
        let error = if fault == Some(FanucFault::Refused) { UNKNOWN } else { 0 };
        fields.insert("ErrorID".to_owned(), Value::from(error));
        match name.as_str() {
            _ if error != 0 => {}
            "FRC_Connect" => {
                if fault != Some(FanucFault::NoPort) {
                    fields.insert("PortNumber".to_owned(), Value::from(self.second_port));
                }
                fields.insert("MajorVersion".to_owned(), Value::from(6));
                fields.insert("MinorVersion".to_owned(), Value::from(1));
            }
            "FRC_ReadJointAngles" => {
                let key = if fault == Some(FanucFault::OldName) { "JointAngles" } else { "JointAngle" };
                fields.insert("TimeTag".to_owned(), Value::from(now.as_millis().try_into().unwrap_or(u64::MAX)));
                fields.insert(key.to_owned(), angles(&source.joints().positions, fault));
                fields.insert("Group".to_owned(), request.get("Group").cloned().unwrap_or_else(|| Value::from(1)));
            }
            "FRC_GetStatus" => {
                for (key, value) in [
                    ("ServoReady", 1),
                    ("TPMode", 1),
                    ("RMIMotionStatus", 0),
                    ("ProgramStatus", 0),
                    ("SingleStepMode", 0),
                    ("NumberUTool", 10),
                    ("NumberUFrame", 9),
                ] {
                    fields.insert(key.to_owned(), Value::from(value));
                }
            }
            "FRC_Disconnect" => {}
            // Nothing is ever moved or written.
            _ => {
                fields.insert("ErrorID".to_owned(), Value::from(UNKNOWN));
            }
        }
        self.send(&Value::Object(fields), fault, now + ANSWERING);
    }

    fn send(&mut self, answer: &Value, fault: Option<FanucFault>, at: Moment) {
        let line = |value: &Value| format!("{value}\r\n").into_bytes();
        let bytes = line(answer);
        match fault {
            Some(FanucFault::Silent) => {}
            Some(FanucFault::NoJson) => self.schedule.send(at, b"HTTP/1.1 400 Bad Request\r\n".to_vec()),
            Some(FanucFault::Terminate) => {
                self.schedule.send(at, line(&json!({"Communication": "FRC_Terminate"})));
            }
            Some(FanucFault::SystemFault) => {
                let fault = line(&json!({"Communication": "FRC_SystemFault", "SequenceID": 0}));
                self.schedule.send(at, [fault, bytes].concat());
            }
            Some(FanucFault::Halves) => self.schedule.send_halves(at, &bytes),
            Some(FanucFault::DisconnectMidAnswer) => self.schedule.break_off(at, halves(&bytes).0),
            _ => self.schedule.send(at, bytes),
        }
    }
}

/// J1 to J9 (deg) of joint values (rad).
fn angles(positions: &[f64], fault: Option<FanucFault>) -> Value {
    let mut angles: Map<String, Value> = (0..9)
        .map(|joint| {
            let angle = positions.get(joint).copied().unwrap_or(0.0).to_degrees();
            (format!("J{}", joint + 1), Value::from(angle))
        })
        .collect();
    match fault {
        Some(FanucFault::MissingJoint) => drop(angles.remove("J6")),
        Some(FanucFault::NotANumber) => drop(angles.insert("J6".to_owned(), Value::from("1.#INF"))),
        _ => {}
    }
    Value::Object(angles)
}

impl Simulator for FanucSimulator {
    fn accept(&mut self, _now: Moment) {
        self.splitter.clear();
        self.schedule.clear();
    }

    fn wants_second_port(&self) -> bool {
        true
    }

    fn second_port(&mut self, port: u16) {
        self.second_port = port;
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for &byte in bytes {
            if let Some(Piece::Line(line)) = self.splitter.push(byte) {
                self.answer(&line, source, now);
            }
        }
    }

    fn tick(&mut self, _source: &mut dyn PointSource, now: Moment) {
        self.schedule.tick(now);
    }

    fn next_output(&mut self) -> Option<Output> {
        self.schedule.next_output()
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.schedule.next_deadline()
    }
}
