//! A simulated KUKA controller with KUKAVARPROXY: answers requests for `$AXIS_ACT` and a few other variables.

use std::time::Duration;

use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;

/// Time from a request to its answer.
const ANSWERING: Duration = Duration::from_millis(10);

/// Longest accepted request (bytes).
pub(super) const MAX_REQUEST: usize = 1024;

faults! {
    /// A fault of the simulated controller. Its occasion is a request.
    pub KukaFault {
        Unreadable "unreadable" "The variable cannot be read.",
        WrongNumber "wrong-number" "The answer has the number of another request.",
        Halves "halves" "The answer in two halves with a pause between them.",
        MissingAxis "missing-axis" "A6 is missing.",
        NotANumber "not-a-number" "A joint value is not a number.",
        ShortValue "short-value" "The value is shorter than announced.",
        HugeAnswer "huge-answer" "An answer of 65,000 bytes is announced.",
        Silent "silent" "No answer, as after a restart of the controller.",
        DisconnectMidAnswer "disconnect-mid-answer" "The connection is closed in the middle of the answer.",
    }
}

/// A simulated controller.
#[derive(Debug)]
pub struct KukaSimulator {
    faults: FaultPlan<KukaFault>,
    received: Vec<u8>,
    schedule: Schedule,
}

impl KukaSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<KukaFault>>) -> Self {
        let faults = FaultPlan::new(faults);
        Self { faults, received: Vec::new(), schedule: Schedule::default() }
    }

    /// Bytes of an incomplete request.
    pub const fn pending(&self) -> usize {
        self.received.len()
    }

    /// Takes the next complete request: its number, mode and name.
    fn next_request(&mut self) -> Option<(u16, u8, String)> {
        let (&[high, low, above, below], rest) = self.received.split_first_chunk::<4>()?;
        let length = usize::from(u16::from_be_bytes([above, below]));
        if length > MAX_REQUEST {
            // Out of step; nothing that follows can be a request.
            self.received.clear();
            return None;
        }
        let content = rest.get(..length)?.to_vec();
        self.received.drain(..4 + length);
        let (mode, name) = content.split_first().unwrap_or((&0, &[]));
        let name = name.get(2..).unwrap_or_default();
        Some((u16::from_be_bytes([high, low]), *mode, String::from_utf8_lossy(name).into_owned()))
    }

    fn answer(&mut self, id: u16, mode: u8, name: &str, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|_| true);
        let value = match (name.to_uppercase().as_str(), mode) {
            _ if fault == Some(KukaFault::Unreadable) => None,
            ("$AXIS_ACT", 0) => Some(axes(&source.joints().positions, fault)),
            ("$MODEL_NAME[]", 0) => Some("\"#KR_SIMULATED\"".to_owned()),
            ("$OV_PRO", 0) => Some("100".to_owned()),
            ("$MODE_OP", 0) => Some("#T1".to_owned()),
            // Nothing is ever written.
            _ => None,
        };
        let number = id.wrapping_add(u16::from(fault == Some(KukaFault::WrongNumber)) * 7);
        let mut bytes = encode(number, mode, value.as_deref());
        let at = now + ANSWERING;
        match fault {
            Some(KukaFault::Silent) => {}
            Some(KukaFault::Halves) => self.schedule.send_halves(at, &bytes),
            Some(KukaFault::ShortValue) => {
                // The announced length of the value is longer than the content.
                if let Some(length) = bytes.get_mut(5) {
                    *length = 0x7f;
                }
                self.schedule.send(at, bytes);
            }
            Some(KukaFault::HugeAnswer) => {
                bytes.splice(2..4, [0xfd, 0xe8]);
                self.schedule.send(at, bytes);
            }
            Some(KukaFault::DisconnectMidAnswer) => self.schedule.break_off(at, halves(&bytes).0),
            _ => self.schedule.send(at, bytes),
        }
    }
}

/// The value of `$AXIS_ACT` for joint values (rad).
fn axes(positions: &[f64], fault: Option<KukaFault>) -> String {
    let joints = if fault == Some(KukaFault::MissingAxis) { 5 } else { 6 };
    let mut fields: Vec<String> = (0..joints)
        .map(|joint| format!("A{} {:.7}", joint + 1, positions.get(joint).copied().unwrap_or(0.0).to_degrees()))
        .collect();
    if fault == Some(KukaFault::NotANumber)
        && let Some(last) = fields.last_mut()
    {
        "A6 1.#INF".clone_into(last);
    }
    fields.extend((1..=6).map(|axis| format!("E{axis} 0.0")));
    format!("{{E6AXIS: {}}}", fields.join(", "))
}

/// An answer with its header.
fn encode(id: u16, mode: u8, value: Option<&str>) -> Vec<u8> {
    let text = value.unwrap_or_default().as_bytes();
    let length = u16::try_from(text.len()).unwrap_or(u16::MAX);
    let tail: [u8; 3] = if value.is_some() { [0, 1, 1] } else { [0, 0, 0] };
    let content = [&[mode][..], &length.to_be_bytes(), text, &tail].concat();
    let rest = u16::try_from(content.len()).unwrap_or(u16::MAX);
    [&id.to_be_bytes()[..], &rest.to_be_bytes(), &content].concat()
}

impl Simulator for KukaSimulator {
    fn accept(&mut self, _now: Moment) {
        self.received.clear();
        self.schedule.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for chunk in bytes.chunks(MAX_REQUEST) {
            self.received.extend(chunk);
            while let Some((id, mode, name)) = self.next_request() {
                self.answer(id, mode, &name, source, now);
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
