//! A simulated Universal Robots controller: the other end of [`crate::link::protocol::rtde`].
//!
//! It knows the output variables of the manufacturer's guide with their types, so that clients of others connect to it. The
//! time, the joint values and speeds, the robot mode and the safety state have meaningful values; all others are zero. A robot
//! with fewer than six joints is padded with zeros, and of one with more the first six are reported. Like a real controller it
//! closes the connection of a client that does not read.

mod outputs;
#[cfg(test)]
mod tests;

use std::time::Duration;

use outputs::Kind;

use super::fault::{FaultPlan, Planned, faults};
use super::writes::Writes;
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;
use crate::link::protocol::rtde::mode::{MODE_RUNNING, SAFETY_NORMAL};
use crate::link::protocol::rtde::packet::{Framer, encode, packet_type};

faults! {
    /// A fault of the simulated controller. Its occasion is a data packet unless the description says otherwise.
    pub RtdeFault {
        Drip "drip" "Sends every byte in its own write. Occasion: a connection.",
        OldProtocol "old-protocol" "Refuses version 2 of the protocol. Occasion: a connection.",
        NotFound "not-found" "Does not know the joint values. Occasion: setting up the outputs.",
        NoSafetyStatus "no-safety-status" "Does not know the safety status, like PolyScope before 3.10 and 5.4. Occasion: setting up the outputs.",
        NoModes "no-modes" "Knows neither robot mode nor safety mode nor safety status. Occasion: setting up the outputs.",
        InUse "in-use" "Reports that the joint values are in use. Occasion: setting up the outputs.",
        WrongType "wrong-type" "Announces integers as the joint values. Occasion: setting up the outputs.",
        StartRefused "start-refused" "Does not start the stream. Occasion: starting it.",
        TextFlood "text-flood" "Sends 1000 different messages before the data.",
        ProtectiveStop "protective-stop" "Reports a protective stop.",
        Reduced "reduced" "Reports the reduced mode.",
        Safeguard "safeguard" "Reports a safeguard stop: a person is in the cell.",
        EnablingSwitch "enabling-switch" "Reports that the enabling switch is released.",
        EncoderNoise "encoder-noise" "Adds noise of 17 to 29 µrad to each joint, as recorded from real encoders at rest.",
        NoisySpeeds "noisy-speeds" "Reports joint speeds of ±0.0015 rad/s at rest.",
        Dropout "dropout" "Reports zeros in place of the joint values.",
        PowerOff "power-off" "Reports that the power is off.",
        Moving "moving" "Reports that the first joint turns at 0.2 rad/s.",
        NotFinite "not-finite" "Reports a joint value that is not a number.",
        WrongRecipe "wrong-recipe" "Sends the data under another recipe.",
        ShortData "short-data" "Sends data without their last value.",
        Silence "silence" "Stops sending data until the next connection.",
        Cut "cut" "Closes the connection in the middle of the data.",
        SizeZero "size-zero" "Sends data whose size field is 0.",
    }
}

/// Number of the only recipe.
const RECIPE: u8 = 1;

/// Highest frequency of a controller (Hz).
const MAX_FREQUENCY: f64 = 500.0;

const FLOOD: usize = 1000;

/// Speed of the moving joint (rad/s).
const SPEED: f64 = 0.2;

/// Safety status of the reduced mode.
const SAFETY_REDUCED: i32 = 2;

/// Safety status of a protective stop.
const SAFETY_PROTECTIVE_STOP: i32 = 3;

/// Safety status of a safeguard stop.
const SAFETY_SAFEGUARD: i32 = 5;

/// Safety status while the enabling switch is released.
const SAFETY_ENABLING_SWITCH: i32 = 13;

/// Robot mode without power.
const MODE_POWER_OFF: i32 = 3;

/// Standard deviation of each encoder at rest (rad), as recorded from two real controllers.
const ENCODER_NOISE: [f64; 6] = [17e-6, 20e-6, 29e-6, 25e-6, 22e-6, 19e-6];

/// Values of one data packet.
#[derive(Clone, Copy, Debug)]
struct Report {
    time: f64,
    positions: [f64; 6],
    speeds: [f64; 6],
    robot_mode: i32,
    safety_status: i32,
}

impl Report {
    /// An output variable as bytes.
    fn bytes(&self, name: &str, kind: Kind) -> Vec<u8> {
        let numbers = |values: &[f64]| values.iter().flat_map(|value| value.to_be_bytes()).collect();
        match name {
            "timestamp" => numbers(&[self.time]),
            "actual_q" | "target_q" => numbers(&self.positions),
            "actual_qd" => numbers(&self.speeds),
            "robot_mode" => self.robot_mode.to_be_bytes().to_vec(),
            "safety_status" | "safety_mode" => self.safety_status.to_be_bytes().to_vec(),
            "speed_scaling" | "target_speed_fraction" => numbers(&[1.0]),
            _ => vec![0; kind.size()],
        }
    }
}

/// A simulated controller.
#[derive(Clone, Debug)]
pub struct RtdeSimulator {
    faults: FaultPlan<RtdeFault>,
    framer: Framer,
    writes: Writes,
    /// Names and types of the recipe.
    fields: Vec<(String, Kind)>,
    interval: Duration,
    next_data: Option<Moment>,
    is_connected: bool,
    /// Angle by which a fault has turned the first joint (rad).
    travel: f64,
    /// State of the sequence of noise.
    noise: u64,
}

impl RtdeSimulator {
    /// A controller with planned faults.
    pub fn new(faults: Vec<Planned<RtdeFault>>) -> Self {
        Self {
            faults: FaultPlan::new(faults),
            framer: Framer::default(),
            writes: Writes::default(),
            fields: Vec::new(),
            interval: Duration::from_millis(40),
            next_data: None,
            is_connected: false,
            travel: 0.0,
            noise: 1,
        }
    }

    fn answer(&mut self, kind: u8, content: &[u8]) {
        self.writes.send(encode(kind, content));
    }

    fn hang_up(&mut self) {
        self.is_connected = false;
        self.next_data = None;
        self.framer.clear();
        self.writes.close();
    }

    fn execute(&mut self, kind: u8, content: &[u8], now: Moment) {
        match kind {
            packet_type::REQUEST_PROTOCOL_VERSION => {
                let is_accepted = content == [0, 2] && !self.faults.strikes(RtdeFault::OldProtocol);
                self.answer(kind, &[u8::from(is_accepted)]);
            }
            packet_type::GET_URCONTROL_VERSION => {
                let version: Vec<u8> = [5_u32, 11, 0, 108].iter().flat_map(|number| number.to_be_bytes()).collect();
                self.answer(kind, &version);
            }
            packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS => self.set_up(content),
            packet_type::CONTROL_PACKAGE_SETUP_INPUTS => self.answer(kind, b"\0NOT_FOUND"),
            packet_type::CONTROL_PACKAGE_START => {
                let is_started = !self.fields.is_empty() && !self.faults.strikes(RtdeFault::StartRefused);
                self.next_data = is_started.then(|| now + self.interval);
                self.answer(kind, &[u8::from(is_started)]);
            }
            packet_type::CONTROL_PACKAGE_PAUSE => {
                self.next_data = None;
                self.answer(kind, &[1]);
            }
            _ => {}
        }
    }

    /// Sets up a recipe from a frequency and names. It is accepted only if every name is known.
    fn set_up(&mut self, content: &[u8]) {
        const JOINTS: &[&str] = &["actual_q"];
        const MODES: &[&str] = &["robot_mode", "safety_mode", "safety_status"];
        let Some((frequency, names)) = content.split_first_chunk::<8>() else { return };
        let names = String::from_utf8_lossy(names);
        let mut fields = Vec::new();
        let mut types = Vec::new();
        for name in names.split(',').map(str::trim) {
            let kind = outputs::kind(name);
            fields.extend(kind.map(|kind| (name.to_owned(), kind)));
            types.push(kind.map_or("NOT_FOUND", Kind::name));
        }
        for (fault, affected, answer) in [
            (RtdeFault::NotFound, JOINTS, "NOT_FOUND"),
            (RtdeFault::NoSafetyStatus, &["safety_status"], "NOT_FOUND"),
            (RtdeFault::NoModes, MODES, "NOT_FOUND"),
            (RtdeFault::InUse, JOINTS, "IN_USE"),
            (RtdeFault::WrongType, JOINTS, "VECTOR6INT32"),
        ] {
            if self.faults.strikes(fault) {
                let refused = names.split(',').zip(&mut types).filter(|(name, _)| affected.contains(&name.trim()));
                refused.for_each(|(_, kind)| *kind = answer);
            }
        }
        let is_known = !types.iter().any(|kind| ["NOT_FOUND", "IN_USE"].contains(kind));
        self.fields = if is_known { fields } else { Vec::new() };
        let frequency = f64::from_be_bytes(*frequency);
        let frequency = if frequency.is_finite() { frequency.clamp(1.0, MAX_FREQUENCY) } else { 1.0 };
        self.interval = Duration::from_secs_f64(1.0 / frequency);
        let recipe = if is_known { RECIPE } else { 0 };
        let content = [&[recipe][..], types.join(",").as_bytes()].concat();
        self.answer(packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS, &content);
    }

    fn report(&mut self, source: &mut dyn PointSource, now: Moment) -> Report {
        let state = source.joints();
        let six = |values: &[f64]| std::array::from_fn(|joint| values.get(joint).copied().unwrap_or(0.0));
        let mut report = Report {
            time: now.as_secs_f64(),
            positions: six(&state.positions),
            speeds: [0.0; 6],
            robot_mode: MODE_RUNNING,
            safety_status: if state.stopped.is_some() { SAFETY_PROTECTIVE_STOP } else { SAFETY_NORMAL },
        };
        if self.faults.strikes(RtdeFault::Moving) {
            self.travel += SPEED * self.interval.as_secs_f64();
            report.speeds[0] = SPEED;
        }
        report.positions[0] += self.travel;
        if self.faults.strikes(RtdeFault::EncoderNoise) {
            for (position, sigma) in report.positions.iter_mut().zip(ENCODER_NOISE) {
                *position += sigma * self.normal();
            }
        }
        if self.faults.strikes(RtdeFault::NoisySpeeds) {
            report.speeds = std::array::from_fn(|_| 0.0015 * self.normal().clamp(-1.0, 1.0));
        }
        if self.faults.strikes(RtdeFault::Dropout) {
            report.positions = [0.0; 6];
        }
        if self.faults.strikes(RtdeFault::NotFinite) {
            report.positions[5] = f64::NAN;
        }
        for (fault, status) in [
            (RtdeFault::Reduced, SAFETY_REDUCED),
            (RtdeFault::Safeguard, SAFETY_SAFEGUARD),
            (RtdeFault::EnablingSwitch, SAFETY_ENABLING_SWITCH),
            (RtdeFault::ProtectiveStop, SAFETY_PROTECTIVE_STOP),
        ] {
            if self.faults.strikes(fault) {
                report.safety_status = status;
            }
        }
        if self.faults.strikes(RtdeFault::PowerOff) {
            report.robot_mode = MODE_POWER_OFF;
        }
        report
    }

    /// Next number of a fixed sequence that is nearly standard normal: a sum of twelve even ones.
    fn normal(&mut self) -> f64 {
        let mut even = || {
            // Marsaglia 2003.
            self.noise ^= self.noise << 13;
            self.noise ^= self.noise >> 7;
            self.noise ^= self.noise << 17;
            (self.noise >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| even()).sum::<f64>() - 6.0
    }

    fn send_data(&mut self, source: &mut dyn PointSource, now: Moment) {
        let report = self.report(source, now);
        let recipe = if self.faults.strikes(RtdeFault::WrongRecipe) { RECIPE + 1 } else { RECIPE };
        let mut content = vec![recipe];
        content.extend(self.fields.iter().flat_map(|(name, kind)| report.bytes(name, *kind)));
        if self.faults.strikes(RtdeFault::TextFlood) {
            (0..FLOOD).for_each(|number| self.send_text(&format!("message {number}")));
        }
        if self.faults.strikes(RtdeFault::ShortData) {
            content.truncate(content.len().saturating_sub(4));
        }
        let mut packet = encode(packet_type::DATA_PACKAGE, &content);
        if self.faults.strikes(RtdeFault::SizeZero) {
            packet.iter_mut().take(2).for_each(|byte| *byte = 0);
        }
        if self.faults.strikes(RtdeFault::Silence) {
            self.next_data = None;
        } else if self.faults.strikes(RtdeFault::Cut) {
            packet.truncate(packet.len() / 2);
            self.writes.send(packet);
            self.hang_up();
        } else {
            self.writes.send(packet);
        }
    }

    /// Sends a warning as text.
    fn send_text(&mut self, text: &str) {
        let source = "simulator";
        let with_length = |text: &str| [&[u8::try_from(text.len()).unwrap_or(0)][..], text.as_bytes()].concat();
        let content = [with_length(text), with_length(source), vec![2]].concat();
        self.answer(packet_type::TEXT_MESSAGE, &content);
    }
}

impl Simulator for RtdeSimulator {
    fn accept(&mut self, _now: Moment) {
        self.framer.clear();
        self.writes = Writes::default();
        self.writes.is_dripping = self.faults.strikes(RtdeFault::Drip);
        self.fields.clear();
        self.next_data = None;
        self.is_connected = true;
    }

    fn feed(&mut self, bytes: &[u8], _source: &mut dyn PointSource, now: Moment) {
        if self.is_connected {
            self.framer.feed(bytes);
        }
        while self.is_connected {
            match self.framer.next_packet() {
                Ok(Some((kind, content))) => self.execute(kind, &content, now),
                Ok(None) => return,
                Err(_) => self.hang_up(),
            }
            if self.writes.is_overfull() {
                self.hang_up();
            }
        }
    }

    fn tick(&mut self, source: &mut dyn PointSource, now: Moment) {
        if self.next_data.is_some_and(|next| now >= next) {
            self.next_data = Some(now + self.interval);
            self.send_data(source, now);
        }
        if self.is_connected && self.writes.is_overfull() {
            self.hang_up();
        }
    }

    fn next_output(&mut self) -> Option<Output> {
        self.writes.next()
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.next_data
    }
}

#[cfg(test)]
impl RtdeSimulator {
    /// Bytes of an incomplete request.
    pub(in crate::link) fn pending(&self) -> usize {
        self.framer.pending()
    }
}
