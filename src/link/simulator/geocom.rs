//! A total station that speaks GeoCOM.

use std::f64::consts::TAU;
use std::time::Duration;

use super::Output;
use super::PointSource;
use super::Simulator;
use super::fault::{FaultPlan, Planned, faults};
use super::schedule::Schedule;
use crate::link::protocol::Moment;
use crate::link::protocol::Shot;
use crate::link::protocol::geocom::Request;
use crate::link::protocol::geocom::decode_request;
use crate::link::protocol::geocom::encode_reply;

/// Time of a measurement.
const MEASURING: Duration = Duration::from_millis(1500);

/// Time of everything else.
const ANSWERING: Duration = Duration::from_millis(30);

/// Longest request that is kept (bytes).
const MAX_RECEIVED: usize = 4096;

faults! {
    /// What can go wrong.
    pub GeocomFault {
        WrongTransaction "wrong-transaction" "The answer has the number of another request.",
        LateReply "late-reply" "The answer comes only just before the next one.",
        CrcError "crc-error" "The answer carries a wrong CRC.",
        HalfLine "half-line" "Half the answer, a pause, the other half.",
        CarriageReturnOnly "carriage-return-only" "CR alone ends the answer.",
        AngleOnly "angle-only" "Code 1285 with the plausible numbers of the measurement before.",
        NoTarget "no-target" "Code 8710, and zeros for numbers.",
        Busy "busy" "Code 1293.",
        AccuracyNotGuaranteed "accuracy-not-guaranteed" "Code 1284 with a good point.",
        NoFullCorrection "no-full-correction" "Code 1283 with a good point.",
        LicenceMissing "licence-missing" "Code 27: the licence is missing.",
        TransportTimeout "transport-timeout" "The transport times out: 3077.",
        StaleRepeat "stale-repeat" "Everything is well, but the numbers are those of the measurement before.",
        NotANumber "not-a-number" "Everything is well, but the numbers are not.",
        Silent "silent" "No answer.",
        DisconnectMidLine "disconnect-mid-line" "Hangs up in the middle of the answer.",
        Noise "noise" "Noise of a wrong baud rate in place of the answer.",
        Asleep "asleep" "Sleeps when connected: what wakes it is lost.",
        Echo "echo" "Every request comes back before its answer, as some Bluetooth adapters do.",
        Dead "dead" "No answer to anything, as from an instrument that is off.",
    }
}

/// When a fault can happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Occasion {
    Connection,
    Request,
    Measurement,
}

impl GeocomFault {
    const fn occasion(self) -> Occasion {
        match self {
            Self::Asleep => Occasion::Connection,
            Self::Echo | Self::Dead => Occasion::Request,
            _ => Occasion::Measurement,
        }
    }
}

/// A total station.
#[derive(Debug)]
pub struct GeocomSimulator {
    faults: FaultPlan<GeocomFault>,
    received: Vec<u8>,
    is_asleep: bool,
    edm_mode: String,
    prism_constant: String,
    last_polar: String,
    late: Option<Vec<u8>>,
    schedule: Schedule,
}

impl GeocomSimulator {
    /// An instrument with some faults.
    pub fn new(faults: impl IntoIterator<Item = Planned<GeocomFault>>) -> Self {
        Self {
            faults: FaultPlan::new(faults),
            received: Vec::new(),
            is_asleep: false,
            edm_mode: "2".to_owned(),
            prism_constant: "-0.0344".to_owned(),
            last_polar: "0.1,1.5,2.5".to_owned(),
            late: None,
            schedule: Schedule::default(),
        }
    }

    /// Bytes of a request that is not complete, for the bound of the memory.
    pub const fn pending(&self) -> usize {
        self.received.len()
    }

    fn request(&mut self, line: &[u8], source: &mut dyn PointSource, now: Moment) {
        if std::mem::take(&mut self.is_asleep) {
            return;
        }
        let fault = self.faults.occasion(|fault| fault.occasion() == Occasion::Request);
        match fault {
            Some(GeocomFault::Dead) => return,
            Some(GeocomFault::Echo) => self.send(now, [line, b"\r\n"].concat()),
            _ => {}
        }
        let (request, with_crc) = match decode_request(line) {
            Ok(request) => request,
            Err(text) => {
                let transport = if text.contains("CRC") { 3101 } else { 3074 };
                return self.send(now, ended(&encode_reply(transport, 0, 0, "", false)));
            }
        };
        if matches!(request.rpc, 17017 | 2108) {
            return self.measure(&request, with_crc, source, now);
        }
        let (transport, code, parameters) = self.ordinary(&request);
        let answer = encode_reply(transport, request.transaction, code, &parameters, with_crc);
        self.send(now + ANSWERING, ended(&answer));
    }

    /// Transport result, code and parameters of a request that is no measurement.
    fn ordinary(&mut self, request: &Request) -> (u32, u32, String) {
        let parameters = match request.rpc {
            0 | 2008 | 9037 | 18005 => String::new(),
            110 => "1,50,3".to_owned(),
            2020 => {
                self.edm_mode.clone_from(&short(&request.parameters));
                String::new()
            }
            2021 => self.edm_mode.clone(),
            2023 => self.prism_constant.clone(),
            2024 => {
                self.prism_constant.clone_from(&short(&request.parameters));
                String::new()
            }
            2026 => "0".to_owned(),
            5003 => "362541".to_owned(),
            5004 => "\"TS30, simulated\"".to_owned(),
            _ => return (3080, 0, String::new()),
        };
        (0, 0, parameters)
    }

    fn measure(&mut self, request: &Request, with_crc: bool, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|fault| fault.occasion() == Occasion::Measurement);
        let before = self.last_polar.clone();
        let is_measured =
            !matches!(fault, Some(GeocomFault::Busy | GeocomFault::TransportTimeout | GeocomFault::StaleRepeat));
        let shot = if is_measured { source.shot() } else { None };
        if let Some(shot) = &shot {
            self.last_polar = polar(shot);
        }
        let mode = if request.rpc == 17017 { ",2" } else { "" };
        let (transport, code, numbers) = match fault {
            Some(GeocomFault::TransportTimeout) => (3077, 0, String::new()),
            Some(GeocomFault::Busy) => (0, 1293, before),
            Some(GeocomFault::AngleOnly) => (0, 1285, before),
            Some(GeocomFault::NoTarget) => (0, 8710, "0,0,0".to_owned()),
            Some(GeocomFault::LicenceMissing) => (0, 27, "0,0,0".to_owned()),
            Some(GeocomFault::AccuracyNotGuaranteed) => (0, 1284, self.last_polar.clone()),
            Some(GeocomFault::NoFullCorrection) => (0, 1283, self.last_polar.clone()),
            Some(GeocomFault::StaleRepeat) => (0, 0, before),
            Some(GeocomFault::NotANumber) => (0, 0, "nan,1.5,inf".to_owned()),
            _ if shot.is_none() => (0, 1285, before),
            _ => (0, 0, self.last_polar.clone()),
        };
        let shift = u16::from(fault == Some(GeocomFault::WrongTransaction)) * 7;
        let transaction = request.transaction.wrapping_add(shift);
        let answer = encode_reply(transport, transaction, code, &format!("{numbers}{mode}"), with_crc);
        self.answer(&answer, fault, request, now + MEASURING);
    }

    fn answer(&mut self, answer: &str, fault: Option<GeocomFault>, request: &Request, at: Moment) {
        let bytes = ended(answer);
        match fault {
            Some(GeocomFault::Silent) => {}
            Some(GeocomFault::LateReply) => self.late = Some(bytes),
            Some(GeocomFault::CrcError) => {
                let body = answer.split_once(':').map_or("", |(_, body)| body);
                self.send(at, ended(&format!("%R1P,0,{},1:{body}", request.transaction)));
            }
            Some(GeocomFault::HalfLine) => {
                self.send_late(at);
                self.schedule.send_halves(at, &bytes);
            }
            Some(GeocomFault::CarriageReturnOnly) => self.send(at, format!("{answer}\r").into_bytes()),
            Some(GeocomFault::Noise) => self.send(at, b"\xF8\x80\x78\xFE\x98\r\n\x06\xE6\n\xFF\r".to_vec()),
            Some(GeocomFault::DisconnectMidLine) => {
                self.send_late(at);
                self.schedule.break_off(at, &bytes);
            }
            _ => self.send(at, bytes),
        }
    }

    fn send(&mut self, at: Moment, bytes: Vec<u8>) {
        self.send_late(at);
        self.schedule.send(at, bytes);
    }

    /// An answer that was held back comes just before the next one.
    fn send_late(&mut self, at: Moment) {
        if let Some(late) = self.late.take() {
            self.schedule.send(at, late);
        }
    }
}

/// A parameter that is kept; no instrument keeps long ones.
fn short(text: &str) -> String {
    text.chars().take(32).collect()
}

fn ended(text: &str) -> Vec<u8> {
    format!("{text}\r\n").into_bytes()
}

/// Horizontal angle, zenith angle (rad) and slope distance (m), with digits for less than a nanometre.
fn polar(shot: &Shot) -> String {
    let point = shot.point.coords;
    let horizontal = point.x.atan2(point.y).rem_euclid(TAU);
    let zenith = point.x.hypot(point.y).atan2(point.z);
    format!("{horizontal:.15},{zenith:.15},{:.12}", point.norm())
}

impl Simulator for GeocomSimulator {
    fn accept(&mut self, _now: Moment) {
        self.received.clear();
        self.schedule.clear();
        self.late = None;
        let fault = self.faults.occasion(|fault| fault.occasion() == Occasion::Connection);
        self.is_asleep = fault == Some(GeocomFault::Asleep);
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for &byte in bytes {
            match byte {
                // A line feed clears the buffer.
                b'\n' => self.received.clear(),
                b'\r' => {
                    let line = std::mem::take(&mut self.received);
                    if !line.is_empty() {
                        self.request(&line, source, now);
                    }
                }
                _ if self.received.len() < MAX_RECEIVED => self.received.push(byte),
                _ => {}
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

#[cfg(test)]
mod tests;
