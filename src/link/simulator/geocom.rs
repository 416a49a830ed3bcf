//! A simulated total station with GeoCOM.

use std::f64::consts::TAU;
use std::time::Duration;

use nalgebra::Vector3;

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

/// Angle in which a turned instrument finds the prism (rad).
const SEARCH: f64 = 0.1;

/// Time from any other request to its answer.
const ANSWERING: Duration = Duration::from_millis(30);

/// Most decimals of a number.
const MOST_DECIMALS: usize = 15;

/// Correction for the air (ppm).
const AIR_PPM: f64 = 8.4;

/// Scale of a map projection or a height (ppm).
const SCALE_PPM: f64 = 400.0;

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
        EmptyAnswer "empty-answer" "Success without any values.",
        CorrectionsChanged "corrections-changed" "Another program sets 50 ppm before the measurement.",
        Scaled "scaled" "Multiplies distances by a scale of 400 ppm. Occasion: a connection.",
        FewDecimals "few-decimals" "Rounds to 3 decimals and does not accept another number. Occasion: a connection.",
        OldSoftware "old-software" "Does not know decimals and corrections. Occasion: a connection.",
        Unnumbered "unnumbered" "Answers without transaction numbers. Occasion: a connection.",
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
            Self::Asleep | Self::Scaled | Self::FewDecimals | Self::OldSoftware | Self::Unnumbered => {
                Occasion::Connection
            }
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
    /// What is unusual about this connection.
    unusual: Option<GeocomFault>,
    decimals: usize,
    /// Correction for the air (ppm).
    air: f64,
    edm_mode: String,
    prism_constant: String,
    last_polar: [f64; 3],
    late: Option<Vec<u8>>,
    schedule: Schedule,
}

impl GeocomSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<GeocomFault>>) -> Self {
        Self {
            faults: FaultPlan::new(faults),
            received: Vec::new(),
            is_asleep: false,
            unusual: None,
            decimals: MOST_DECIMALS,
            air: AIR_PPM,
            edm_mode: "2".to_owned(),
            prism_constant: "-0.0344".to_owned(),
            last_polar: [0.1, 1.5, 2.5],
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
        if matches!(request.rpc, 17017 | 2108 | 2082 | 2116) {
            return self.measure(&request, with_crc, source, now);
        }
        let (transport, code, parameters) = match request.rpc {
            9027 => (0, turned(&request.parameters, source), String::new()),
            _ => self.ordinary(&request),
        };
        let answer = encode_reply(transport, self.number(&request), code, &parameters, with_crc);
        self.send(now + ANSWERING, ended(&answer));
    }

    /// Transaction number of the answer to a request.
    fn number(&self, request: &Request) -> u16 {
        if self.unusual == Some(GeocomFault::Unnumbered) { 0 } else { request.transaction }
    }

    /// Scale that is applied to distances (ppm).
    fn scale(&self) -> f64 {
        if self.unusual == Some(GeocomFault::Scaled) { SCALE_PPM } else { 0.0 }
    }

    /// A number as it is sent: rounded, without trailing zeros.
    fn number_text(&self, value: f64) -> String {
        let text = format!("{value:.*}", self.decimals);
        let short = text.trim_end_matches('0');
        if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
    }

    /// Transport result, return code and parameters of a request that is not a measurement.
    fn ordinary(&mut self, request: &Request) -> (u32, u32, String) {
        let is_old = self.unusual == Some(GeocomFault::OldSoftware);
        let parameters = match request.rpc {
            107 | 108 | 2126 | 2151 if is_old => return (3080, 0, String::new()),
            107 => {
                let digits = request.parameters.trim().parse().ok().filter(|digits| *digits <= MOST_DECIMALS);
                match digits {
                    Some(digits) if self.unusual != Some(GeocomFault::FewDecimals) => self.decimals = digits,
                    _ => return (0, 2, String::new()),
                }
                String::new()
            }
            108 => self.decimals.to_string(),
            2126 => {
                let prism = self.prism_constant.parse().unwrap_or(0.0);
                format!("{},{}", self.number_text(self.air + self.scale()), self.number_text(prism))
            }
            2151 => self.number_text(self.air),
            // What clients ask about date, station, height, power, orientation and motors does not matter here.
            2009 => "0.0,0.0,0.0,0.0".to_owned(),
            2011 => "0.0".to_owned(),
            5008 => "2020,'01','01','00','00','00'".to_owned(),
            5011 => "20".to_owned(),
            5035 => "5,2".to_owned(),
            5039 => "90,0,1".to_owned(),
            2007 | 9030 => "1".to_owned(),
            2014 => "1,1,1,1".to_owned(),
            2107 => self.angles(),
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
            // Carrier wavelength (m), pressure (mbar), dry and wet temperature (°C).
            2029 => "6.58E-7,1013.25,12,12".to_owned(),
            5003 => "362541".to_owned(),
            5004 => "\"TS30 SIMULATED\"".to_owned(),
            _ => return (3080, 0, String::new()),
        };
        (0, 0, parameters)
    }

    fn measure(&mut self, request: &Request, with_crc: bool, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|fault| fault.occasion() == Occasion::Measurement);
        let before = self.polar_text();
        if fault == Some(GeocomFault::CorrectionsChanged) {
            self.air = 50.0;
        }
        let is_measured =
            !matches!(fault, Some(GeocomFault::Busy | GeocomFault::TransportTimeout | GeocomFault::StaleRepeat));
        let shot = if is_measured { source.shot() } else { None };
        if let Some(shot) = &shot {
            self.last_polar = polar(shot);
            self.last_polar[2] *= 1.0 + self.scale() * 1e-6;
        }
        let current = if matches!(request.rpc, 2082 | 2116) { self.coordinates() } else { self.polar_text() };
        let mode = if request.rpc == 17017 && fault != Some(GeocomFault::EmptyAnswer) { ",2" } else { "" };
        let (transport, code, numbers) = match fault {
            Some(GeocomFault::TransportTimeout) => (3077, 0, String::new()),
            Some(GeocomFault::Busy) => (0, 1293, before),
            Some(GeocomFault::AngleOnly) => (0, 1285, before),
            Some(GeocomFault::NoTarget) => (0, 8710, "0,0,0".to_owned()),
            Some(GeocomFault::LicenceMissing) => (0, 27, "0,0,0".to_owned()),
            Some(GeocomFault::AccuracyNotGuaranteed) => (0, 1284, current),
            Some(GeocomFault::NoFullCorrection) => (0, 1283, current),
            Some(GeocomFault::EmptyAnswer) => (0, 0, String::new()),
            Some(GeocomFault::StaleRepeat) => (0, 0, before),
            Some(GeocomFault::NotANumber) => (0, 0, "nan,1.5,inf".to_owned()),
            _ if shot.is_none() => (0, 1285, before),
            _ => (0, 0, current),
        };
        let shift = u16::from(fault == Some(GeocomFault::WrongTransaction)) * 7;
        let transaction = self.number(request).wrapping_add(shift);
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

    /// The latest horizontal angle, zenith angle and slope distance.
    fn polar_text(&self) -> String {
        self.last_polar.map(|value| self.number_text(value)).join(",")
    }

    /// Both angles of the latest measurement.
    fn angles(&self) -> String {
        let [horizontal, zenith, _] = self.last_polar;
        [horizontal, zenith].map(|value| self.number_text(value)).join(",")
    }

    /// East, north and height of the latest measurement.
    fn coordinates(&self) -> String {
        let [horizontal, zenith, distance] = self.last_polar;
        let level = distance * zenith.sin();
        let coordinates = [level * horizontal.sin(), level * horizontal.cos(), distance * zenith.cos()];
        coordinates.map(|value| self.number_text(value)).join(",")
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

/// Horizontal angle, zenith angle (rad) and slope distance (m).
fn polar(shot: &Shot) -> [f64; 3] {
    let point = shot.point.coords;
    let horizontal = point.x.atan2(point.y).rem_euclid(TAU);
    let zenith = point.x.hypot(point.y).atan2(point.z);
    [horizontal, zenith, point.norm()]
}

/// Return code of a turn: the prism is found where it is near the direction.
fn turned(parameters: &str, source: &mut dyn PointSource) -> u32 {
    let angles: Vec<f64> = parameters.split(',').filter_map(|text| text.trim().parse().ok()).collect();
    let (&[horizontal, zenith, ..], Some(shot)) = (angles.as_slice(), source.position()) else { return 8710 };
    let direction = Vector3::new(zenith.sin() * horizontal.sin(), zenith.sin() * horizontal.cos(), zenith.cos());
    if direction.angle(&shot.point.coords) < SEARCH { 0 } else { 8710 }
}

impl Simulator for GeocomSimulator {
    fn accept(&mut self, _now: Moment) {
        self.received.clear();
        self.schedule.clear();
        self.late = None;
        let fault = self.faults.occasion(|fault| fault.occasion() == Occasion::Connection);
        self.is_asleep = fault == Some(GeocomFault::Asleep);
        self.decimals = if fault == Some(GeocomFault::FewDecimals) { 3 } else { MOST_DECIMALS };
        self.air = AIR_PPM;
        self.unusual = fault;
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
