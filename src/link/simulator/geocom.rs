//! A simulated total station with GeoCOM.

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

/// Duration of a measurement.
const MEASURING: Duration = Duration::from_millis(1500);

/// Time from any other request to its answer.
const ANSWERING: Duration = Duration::from_millis(30);

/// Longest accepted request (bytes).
const MAX_RECEIVED: usize = 4096;

faults! {
    /// A fault of the simulated total station. Its occasion is a measurement unless the description says otherwise.
    pub GeocomFault {
        WrongTransaction "wrong-transaction" "The answer has the transaction number of another request.",
        LateReply "late-reply" "The answer arrives just before the next one.",
        CrcError "crc-error" "The answer has a wrong CRC.",
        HalfLine "half-line" "The answer in two halves with a pause between them.",
        CarriageReturnOnly "carriage-return-only" "The answer ends with CR alone.",
        AngleOnly "angle-only" "Code 1285 with the plausible numbers of the previous measurement.",
        NoTarget "no-target" "Code 8710 with zeros.",
        Busy "busy" "Code 1293.",
        AccuracyNotGuaranteed "accuracy-not-guaranteed" "Code 1284 with a good point.",
        NoFullCorrection "no-full-correction" "Code 1283 with a good point.",
        LicenceMissing "licence-missing" "Code 27: the licence is missing.",
        TransportTimeout "transport-timeout" "Transport error 3077: timeout.",
        StaleRepeat "stale-repeat" "Success, but with the numbers of the previous measurement.",
        NotANumber "not-a-number" "Success, but with values that are not numbers.",
        Silent "silent" "No answer.",
        DisconnectMidLine "disconnect-mid-line" "The connection is closed in the middle of the answer.",
        Noise "noise" "Noise, as at a wrong baud rate, instead of the answer.",
        Asleep "asleep" "Asleep when connected; the request that wakes it is lost. Occasion: a connection.",
        Echo "echo" "Echoes the request before its answer, as some Bluetooth adapters do. Occasion: a request.",
        Dead "dead" "No answer, as from an instrument that is switched off. Occasion: a request.",
    }
}

/// Occasion of a fault.
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

/// A simulated total station.
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

    /// Bytes of an incomplete request.
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

    /// Transport result, return code and parameters of a request that is not a measurement.
    fn ordinary(&mut self, request: &Request) -> (u32, u32, String) {
        let parameters = match request.rpc {
            0 | 2008 | 9037 | 18005 => String::new(),
            110 => "1,50,3".to_owned(),
            2020 => {
                self.edm_mode.clone_from(&stored(&request.parameters));
                String::new()
            }
            2021 => self.edm_mode.clone(),
            2023 => self.prism_constant.clone(),
            2024 => {
                self.prism_constant.clone_from(&stored(&request.parameters));
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

    /// Sends a delayed answer just before the next one.
    fn send_late(&mut self, at: Moment) {
        if let Some(late) = self.late.take() {
            self.schedule.send(at, late);
        }
    }
}

/// A parameter as the instrument stores it, with a limited length.
fn stored(text: &str) -> String {
    text.chars().take(32).collect()
}

fn ended(text: &str) -> Vec<u8> {
    format!("{text}\r\n").into_bytes()
}

/// Horizontal angle, zenith angle (rad) and slope distance (m), written to better than a nanometre.
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
