//! A simulated Yaskawa controller with the High-Speed Ethernet Server: answers with the pulses of its axes and with its model.

use std::time::Duration;

use super::fault::{FaultPlan, Planned, faults};
use super::schedule::Schedule;
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;
use crate::link::protocol::yaskawa::{
    ANSWER, Command, HEADER, LAST_BLOCK, MODEL, PULSES, SYSTEM, WORDS_BEFORE, header,
};

/// Time from a request to its answer.
const ANSWERING: Duration = Duration::from_millis(4);

/// Most axes of an answer.
const AXES: usize = 8;

/// Pulses per degree of the simulated axes.
pub const PULSES_PER_DEGREE: [f64; 6] = [1344.5, 1290.25, 1209.5, 1024.0, 1137.75, -622.25];

faults! {
    /// A fault of the simulated controller. Its occasion is a request.
    pub YaskawaFault {
        Refused "refused" "The request is answered with a status.",
        WrongNumber "wrong-number" "The answer has the number of another request.",
        Lost "lost" "The answer is lost on the way.",
        Cartesian "cartesian" "The answer has coordinates in place of pulses.",
        Short "short" "The answer has fewer axes.",
        HugeAnswer "huge-answer" "An answer of 65,000 bytes is announced.",
        NoMagic "no-magic" "The answer does not begin with YERC.",
        Truncated "truncated" "The second half of the answer is missing.",
    }
}

/// A simulated controller.
#[derive(Debug)]
pub struct YaskawaSimulator {
    faults: FaultPlan<YaskawaFault>,
    received: Vec<u8>,
    schedule: Schedule,
}

impl YaskawaSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<YaskawaFault>>) -> Self {
        let faults = FaultPlan::new(faults);
        Self { faults, received: Vec::new(), schedule: Schedule::default() }
    }

    /// Bytes of an incomplete request.
    pub const fn pending(&self) -> usize {
        self.received.len()
    }

    fn answer(&mut self, id: u8, command: Command, service: u8, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|_| true);
        let content = match command {
            _ if fault == Some(YaskawaFault::Refused) => None,
            PULSES => Some(pulses(&source.joints().positions, fault)),
            SYSTEM => Some(system()),
            // Nothing is ever written.
            _ => None,
        };
        let id = id.wrapping_add(u8::from(fault == Some(YaskawaFault::WrongNumber)) * 7);
        // A status with one added word of two bytes.
        let (status, added) = if content.is_some() { (0, [0, 0]) } else { (0x1f, [0x40, 0xb0]) };
        let size = u8::from(content.is_none()) * 2;
        let part = [service | ANSWER, status, size, 0, added[0], added[1], 0, 0];
        let content = content.unwrap_or_default();
        let mut bytes = [header(id, true, content.len(), part, LAST_BLOCK), content].concat();
        match fault {
            Some(YaskawaFault::Lost) => return,
            Some(YaskawaFault::HugeAnswer) => drop(bytes.splice(6..8, [0xe8, 0xfd])),
            Some(YaskawaFault::NoMagic) => drop(bytes.splice(0..4, *b"ERR0")),
            Some(YaskawaFault::Truncated) => bytes.truncate(bytes.len() / 2),
            _ => {}
        }
        self.schedule.send(now + ANSWERING, bytes);
    }
}

/// The answer with pulses for joint values (rad).
fn pulses(positions: &[f64], fault: Option<YaskawaFault>) -> Vec<u8> {
    let kind = if fault == Some(YaskawaFault::Cartesian) { 16 } else { 0 };
    let axes = if fault == Some(YaskawaFault::Short) { 4 } else { AXES };
    let before = [kind, 0, 0, 0, 0_i32];
    debug_assert_eq!(before.len(), WORDS_BEFORE);
    let axis = |axis: usize| {
        let scale = PULSES_PER_DEGREE.get(axis).copied().unwrap_or(1000.0);
        let pulses = positions.get(axis).copied().unwrap_or(0.0).to_degrees() * scale;
        #[expect(clippy::cast_possible_truncation, reason = "it saturates, as a counter does not reach that far")]
        let pulses = pulses.round() as i32;
        pulses
    };
    before.into_iter().chain((0..axes).map(axis)).flat_map(i32::to_le_bytes).collect()
}

/// The answer with versions and model.
fn system() -> Vec<u8> {
    let mut content = vec![0; 48];
    for (at, text) in [(0, &b"YAS0.00.00A(SIM)"[..]), (MODEL.0, b"SIMULATED"), (40, b"00.00")] {
        for (place, byte) in content.iter_mut().skip(at).zip(text) {
            *place = *byte;
        }
    }
    content
}

impl Simulator for YaskawaSimulator {
    fn accept(&mut self, _now: Moment) {
        self.received.clear();
        self.schedule.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for byte in bytes {
            self.received.push(*byte);
            if !self.received.iter().zip(b"YERC").all(|(byte, expected)| byte == expected) {
                self.received.clear();
                continue;
            }
            // Requests that are understood have no content.
            if let Some(request) = self.received.first_chunk::<HEADER>() {
                let number = u16::from_le_bytes([request[24], request[25]]);
                let instance = u16::from_le_bytes([request[26], request[27]]);
                let (id, command, service) = (request[11], Command { number, instance }, request[29]);
                self.received.clear();
                self.answer(id, command, service, source, now);
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
