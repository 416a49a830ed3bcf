//! The conversation: waking, set-up, measurement and recovery after silence.

use std::f64::consts::PI;
use std::f64::consts::TAU;
use std::time::Duration;

use nalgebra::Point3;

use super::super::Failure;
use super::super::Identity;
use super::super::Moment;
use super::super::Protocol;
use super::super::ProtocolEvent;
use super::super::Reflector;
use super::super::Severity;
use super::super::Shot;
use super::super::Status;
use super::super::excerpt::excerpt;
use super::super::outbox::Outbox;
use super::codes::ACCURACY_NOT_GUARANTEED;
use super::codes::NO_FULL_CORRECTION;
use super::codes::OK;
use super::codes::code_in_words;
use super::codes::failure_of;
use super::exchange::Call;
use super::exchange::Damage;
use super::exchange::Exchange;
use super::exchange::Outcome;
use super::options::GeocomOptions;
use super::options::Measurement;
use super::wire::Reply;

/// Time limit for waking a sleeping or silent instrument.
const WAKE_LIMIT: Duration = Duration::from_secs(15);

/// Time limit of one attempt to wake it.
const WAKE_ATTEMPT: Duration = Duration::from_secs(1);

/// Time limit of an ordinary request.
const ORDINARY: Duration = Duration::from_secs(15);

/// Idle time after which a keep-alive request is sent.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Decimals that are requested; instruments round to this number and never send trailing zeros.
const DECIMALS: u32 = 15;

/// Fewest decimals of which a point is made: 1 µrad and 1 µm.
const FEWEST_DECIMALS: usize = 6;

/// Remote procedure that reads all corrections of a distance: the total (ppm) and the prism constant (m).
const CORRECTIONS: u32 = 2126;

/// Largest difference between the total correction and that for the air (ppm).
const SCALE_TOLERANCE: f64 = 0.5;

/// Corrections that the air can need, from the hottest to the highest place (ppm).
const POSSIBLE_AIR: std::ops::RangeInclusive<f64> = -70.0..=150.0;

/// Corrections above this are far from the standard atmosphere of the instruments (ppm).
const SUSPICIOUS_AIR: f64 = 25.0;

/// Longest time to turn to a place and to search there.
const TURNING: Duration = Duration::from_mins(1);

/// Note on the accuracy of total stations.
const ACCURACY: &str = "total stations measure to about 0.5 to 1 mm per point: good for a coarse placement of the base, \
                        not for a full calibration (see the data sheet)";

/// Shown for information that the instrument does not report.
const UNKNOWN: &str = "unknown";

/// A Leica total station.
#[derive(Debug)]
pub struct GeocomProtocol {
    options: GeocomOptions,
    exchange: Exchange,
    outbox: Outbox,
    phase: Phase,
    set_up: SetUpResult,
    /// Corrections of the distance at the set-up, if the instrument reports them.
    corrections: Option<Corrections>,
    previous: Option<Point3<f64>>,
}

#[derive(Debug)]
enum Phase {
    Closed,
    /// Requests are sent until one is answered.
    Waking {
        until: Moment,
        then: AfterWaking,
    },
    SetUp {
        steps: Vec<Call>,
    },
    Idle {
        since: Moment,
    },
    /// A keep-alive request is in progress; a shot may wait for its answer.
    KeepAlive {
        is_wanted: bool,
    },
    Measuring {
        steps: Vec<Call>,
    },
    /// Turning to where it was sent.
    Turning,
}

/// What follows when the instrument answers again.
#[derive(Clone, Copy, Debug)]
enum AfterWaking {
    SetUp,
    Idle,
}

/// Results of the set-up.
#[derive(Debug, Default)]
struct SetUpResult {
    serial: Option<String>,
    name: Option<String>,
    release: Option<String>,
    reflector: Option<Reflector>,
    /// Correction for the air (ppm).
    air: Option<f64>,
    corrections: Option<Corrections>,
    checked: Vec<String>,
    warnings: Vec<String>,
}

/// What the instrument adds to a measured distance.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Corrections {
    /// All that is proportional to the distance, for the air and geometric (ppm).
    total: f64,
    /// Prism constant (m).
    prism: f64,
}

impl Corrections {
    fn from_parameters(parameters: &[String]) -> Option<Self> {
        let number = |index: usize| parameters.get(index)?.trim().parse().ok().filter(|value: &f64| value.is_finite());
        Some(Self { total: number(0)?, prism: number(1)? })
    }
}

impl std::fmt::Display for Corrections {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} ppm and {:.2} mm", self.total, self.prism * 1e3)
    }
}

impl GeocomProtocol {
    /// Fails if [`GeocomOptions::validate`] does.
    pub fn new(options: GeocomOptions) -> Result<Self, String> {
        options.validate()?;
        let exchange = Exchange::new(options.checksum);
        let outbox = Outbox::default();
        Ok(Self {
            options,
            exchange,
            outbox,
            phase: Phase::Closed,
            set_up: SetUpResult::default(),
            corrections: None,
            previous: None,
        })
    }

    /// Bytes of an incomplete line.
    pub const fn pending(&self) -> usize {
        self.exchange.pending_bytes()
    }

    fn ask(&mut self, call: Call, now: Moment) {
        self.exchange.ask(call, now, &mut self.outbox);
    }

    fn wake(&mut self, now: Moment, limit: Duration, then: AfterWaking) {
        self.phase = Phase::Waking { until: now + limit, then };
        self.ask(null_call(WAKE_ATTEMPT), now);
    }

    /// Sends the request of the next step.
    fn make_step(&mut self, now: Moment) {
        let step = match &self.phase {
            Phase::SetUp { steps } | Phase::Measuring { steps } => steps.last().cloned(),
            _ => None,
        };
        if let Some(call) = step {
            self.ask(call, now);
        }
    }

    fn handle(&mut self, outcome: Outcome, now: Moment) {
        match std::mem::replace(&mut self.phase, Phase::Closed) {
            Phase::Closed => {}
            Phase::Waking { until, then } => self.handle_waking(&outcome, until, then, now),
            Phase::SetUp { steps } => self.handle_set_up(outcome, steps, now),
            Phase::Idle { since } => self.phase = Phase::Idle { since },
            Phase::KeepAlive { is_wanted } => self.handle_keep_alive(&outcome, is_wanted, now),
            Phase::Measuring { steps } => self.handle_measured(outcome, steps, now),
            Phase::Turning => self.handle_turned(&outcome, now),
        }
    }

    fn handle_waking(&mut self, outcome: &Outcome, until: Moment, then: AfterWaking, now: Moment) {
        match (outcome, then) {
            (Outcome::Reply(..), AfterWaking::SetUp) => {
                self.phase = Phase::SetUp { steps: set_up_calls(&self.options) };
                self.make_step(now);
            }
            (Outcome::Reply(..), AfterWaking::Idle) => {
                self.outbox.report(Severity::Info, "the instrument answers again");
                self.phase = Phase::Idle { since: now };
            }
            _ if now >= until => self.lose(failure_of_outcome(outcome, WAKE_LIMIT)),
            _ => {
                self.phase = Phase::Waking { until, then };
                self.ask(null_call(WAKE_ATTEMPT), now);
            }
        }
    }

    fn handle_keep_alive(&mut self, outcome: &Outcome, is_wanted: bool, now: Moment) {
        let is_there = matches!(outcome, Outcome::Reply(..));
        if is_there && is_wanted {
            return self.measure(now);
        }
        if is_there {
            self.phase = Phase::Idle { since: now };
            return;
        }
        if is_wanted {
            self.outbox.fail(failure_of_outcome(outcome, KEEP_ALIVE));
        }
        self.wake(now, WAKE_LIMIT, AfterWaking::Idle);
    }

    fn handle_set_up(&mut self, outcome: Outcome, mut steps: Vec<Call>, now: Moment) {
        let (call, reply) = match outcome {
            Outcome::Reply(call, reply) => (call, reply),
            other => return self.lose(failure_of_outcome(&other, ORDINARY)),
        };
        if let Err(failure) = self.set_up.record(&call, &reply, &self.options) {
            return self.lose(failure);
        }
        steps.pop();
        if steps.is_empty() {
            if let Err(failure) = self.set_up.judge_corrections() {
                return self.lose(failure);
            }
            self.phase = Phase::Idle { since: now };
            self.corrections = self.set_up.corrections;
            let identity = std::mem::take(&mut self.set_up).identity();
            return self.outbox.push(ProtocolEvent::Ready(identity));
        }
        self.phase = Phase::SetUp { steps };
        self.make_step(now);
    }

    fn measure(&mut self, now: Moment) {
        let mut steps = measurement(&self.options);
        if self.corrections.is_some() {
            // Nothing reports that the corrections were changed at the instrument.
            steps.push(ordinary(CORRECTIONS, String::new(), "reading the corrections of the distance"));
        }
        self.phase = Phase::Measuring { steps };
        self.make_step(now);
    }

    fn handle_measured(&mut self, outcome: Outcome, mut steps: Vec<Call>, now: Moment) {
        let limit = Duration::from_secs_f64(self.options.timeout_s);
        let (call, reply) = match outcome {
            Outcome::Reply(call, reply) => (call, reply),
            Outcome::Busy(_) => {
                self.phase = Phase::Idle { since: now };
                return self.outbox.fail(failure_of_outcome(&outcome, limit));
            }
            other => {
                self.outbox.fail(failure_of_outcome(&other, limit));
                return self.wake(now, WAKE_LIMIT, AfterWaking::Idle);
            }
        };
        steps.pop();
        if call.rpc == CORRECTIONS
            && let Err(failure) = self.check_corrections(&reply)
        {
            // The set-up judges the new corrections.
            return self.lose(failure);
        }
        if reply.code == OK && !steps.is_empty() {
            self.phase = Phase::Measuring { steps };
            return self.make_step(now);
        }
        self.phase = Phase::Idle { since: now };
        let answer = if steps.is_empty() { self.shot(&reply) } else { Err(failure_of(reply.code)) };
        match answer {
            Ok(shot) => self.outbox.push(ProtocolEvent::Shot(shot)),
            // Another program has changed a setting of the set-up, which sets it again.
            Err(failure @ Failure::Settings(_)) if reply.code == OK => self.lose(failure),
            Err(failure) => self.outbox.fail(failure),
        }
    }

    fn handle_turned(&mut self, outcome: &Outcome, now: Moment) {
        self.phase = Phase::Idle { since: now };
        match outcome {
            Outcome::Reply(_, reply) if reply.code == OK => self.outbox.push(ProtocolEvent::Pointed),
            Outcome::Reply(..) | Outcome::Busy(_) => self.outbox.fail(failure_of_outcome(outcome, TURNING)),
            other => {
                self.outbox.fail(failure_of_outcome(other, TURNING));
                self.wake(now, WAKE_LIMIT, AfterWaking::Idle);
            }
        }
    }

    /// Compares the corrections with those of the set-up.
    fn check_corrections(&self, reply: &Reply) -> Result<(), Failure> {
        let now = Corrections::from_parameters(&reply.parameters).filter(|_| reply.code == OK);
        match (self.corrections, now) {
            (Some(before), Some(now)) if before != now => Err(Failure::Settings(format!(
                "the corrections of the distance were {before} at the set-up and are {now} now"
            ))),
            (_, Some(_)) => Ok(()),
            (_, None) => Err(failure_of(reply.code)),
        }
    }

    fn shot(&mut self, reply: &Reply) -> Result<Shot, Failure> {
        let remark = match reply.code {
            OK if reply.parameters.is_empty() => {
                return Err(Failure::Unusable("it reports success but sends no values".to_owned()));
            }
            OK => None,
            NO_FULL_CORRECTION | ACCURACY_NOT_GUARANTEED => {
                Some(format!("{} (code {})", code_in_words(reply.code), reply.code))
            }
            // The numbers that follow an error may belong to an earlier measurement.
            code => return Err(failure_of(code)),
        };
        let (point, face) = point_from_polar(&reply.parameters)?;
        if self.previous == Some(point) {
            return Err(Failure::Repeated);
        }
        self.previous = Some(point);
        let raw = format!("{},{}", reply.code, reply.parameters.join(",")).into_bytes();
        let remarks = remark.into_iter().map(|text| Status { severity: Severity::Warning, text }).collect();
        Ok(Shot { face: Some(face), remarks, raw, ..Shot::bare(point) })
    }

    fn lose(&mut self, failure: Failure) {
        self.exchange.abandon();
        self.phase = Phase::Closed;
        self.outbox.lose(failure);
    }
}

/// Point (m) and face of the horizontal angle, zenith angle (rad) and slope distance (m).
fn point_from_polar(parameters: &[String]) -> Result<(Point3<f64>, u8), Failure> {
    let value = |index: usize| parameters.get(index).and_then(|text: &String| text.trim().parse::<f64>().ok());
    let (Some(horizontal), Some(zenith), Some(distance)) = (value(0), value(1), value(2)) else {
        return Err(Failure::Garbled(format!("`{}` is not two angles and a distance", excerpt(&parameters.join(",")))));
    };
    let is_angle = |angle: f64| (-TAU..=2.0 * TAU).contains(&angle);
    if !is_angle(horizontal) || !is_angle(zenith) {
        return Err(Failure::Unusable("an angle is out of range".to_owned()));
    }
    if !(distance > 0.0 && distance < 1e5) {
        return Err(Failure::Unusable(format!("the distance is {distance} m")));
    }
    let digits = parameters.iter().take(3).filter_map(|text| decimals(text)).max().unwrap_or(0);
    if digits < FEWEST_DECIMALS {
        let text = format!("it sends only {digits} decimals, so that points are rounded; another program has set that");
        return Err(Failure::Settings(text));
    }
    let face = if zenith.rem_euclid(TAU) > PI { 2 } else { 1 };
    let (east, north) = (zenith.sin() * horizontal.sin(), zenith.sin() * horizontal.cos());
    Ok((Point3::new(east * distance, north * distance, zenith.cos() * distance), face))
}

/// Number of decimals of a number; an exponent carries its own precision. `None` without a decimal point.
fn decimals(text: &str) -> Option<usize> {
    let text = text.trim();
    if text.contains(['e', 'E']) {
        return Some(usize::MAX);
    }
    text.split_once('.').map(|(_, digits)| digits.len())
}

fn failure_of_outcome(outcome: &Outcome, limit: Duration) -> Failure {
    match outcome {
        Outcome::Reply(_, reply) => failure_of(reply.code),
        Outcome::TimedOut(call) => Failure::Silent { what: call.what.to_owned(), seconds: limit.as_secs_f64() },
        Outcome::Busy(code) | Outcome::Damaged(Damage::Code(code)) => failure_of(*code),
        Outcome::Damaged(Damage::Line(text)) => Failure::Garbled(text.clone()),
        Outcome::Damaged(Damage::Unnumbered) => Failure::Refused(
            "it answers without the number of the request, so that a late answer could not be told from a new one; a newer \
             version of its software is needed"
                .to_owned(),
        ),
    }
}

/// `COM_NullProc`: a request without effect, to get an answer.
const fn null_call(limit: Duration) -> Call {
    Call { rpc: 0, parameters: String::new(), limit, what: "waiting for any answer" }
}

fn ordinary(rpc: u32, parameters: String, what: &'static str) -> Call {
    Call { rpc, parameters, limit: ORDINARY, what }
}

/// The calls of the set-up in reverse order.
fn set_up_calls(options: &GeocomOptions) -> Vec<Call> {
    let plain = |rpc, what| ordinary(rpc, String::new(), what);
    let mut steps = vec![
        plain(5003, "asking for the serial number"),
        plain(5004, "asking for the name"),
        plain(110, "asking for the version"),
        // First of all settings: the others are read with this number of decimals.
        ordinary(107, DECIMALS.to_string(), "setting the number of decimals"),
        plain(108, "reading the number of decimals"),
    ];
    if let Some(is_on) = options.target_recognition {
        steps.push(ordinary(18005, u8::from(is_on).to_string(), "setting the target recognition"));
    }
    if let Some(mode) = options.edm_mode {
        steps.push(ordinary(2020, mode.to_string(), "setting the EDM mode"));
    }
    steps.push(plain(2021, "reading the EDM mode"));
    if let Some(constant) = options.prism_constant_mm {
        steps.push(ordinary(2024, format!("{:.7}", constant * 1e-3), "setting the prism constant"));
    }
    steps.push(plain(2023, "reading the prism constant"));
    steps.push(plain(2151, "reading the correction for the air"));
    steps.push(plain(CORRECTIONS, "reading the corrections of the distance"));
    steps.push(plain(2026, "reading the face"));
    steps.reverse();
    steps
}

/// The calls of a measurement in reverse order.
fn measurement(options: &GeocomOptions) -> Vec<Call> {
    let limit = Duration::from_secs_f64(options.timeout_s);
    let what = "measuring";
    let long = |rpc, parameters: &str| Call { rpc, parameters: parameters.to_owned(), limit, what };
    match options.measurement {
        Measurement::DistanceAngle => vec![long(17017, "2")],
        Measurement::FineAdjust => {
            let range = options.search_deg.to_radians();
            vec![long(17017, "2"), long(9037, &format!("{range:.6},{range:.6},0"))]
        }
        Measurement::Simple => {
            vec![long(2108, "5000,1"), ordinary(2008, "1,1".to_owned(), what), ordinary(2008, "3,1".to_owned(), what)]
        }
    }
}

impl SetUpResult {
    fn record(&mut self, call: &Call, reply: &Reply, options: &GeocomOptions) -> Result<(), Failure> {
        let is_write = matches!(call.rpc, 2020 | 2024 | 18005);
        if reply.code != OK && matches!(call.rpc, 107 | 2151 | CORRECTIONS) {
            // Older instruments have none of these; what is missing is judged at the end.
            return Ok(());
        }
        if reply.code != OK {
            let text = format!("{} failed: {} (code {})", call.what, code_in_words(reply.code), reply.code);
            if is_write {
                return Err(Failure::Settings(text));
            }
            self.warnings.push(text);
            return self.check_read_back(call, options);
        }
        let first = reply.parameters.first().map_or_else(|| UNKNOWN.to_owned(), |text| excerpt(text));
        match call.rpc {
            5003 => self.serial = Some(first),
            5004 => self.name = Some(first),
            110 => self.release = Some(excerpt(&reply.parameters.join("."))),
            18005 => {
                self.checked.push(format!("target recognition: {}", if call.parameters == "1" { "on" } else { "off" }));
            }
            108 => return self.record_decimals(&first),
            2151 => self.air = first.parse().ok().filter(|air: &f64| air.is_finite()),
            CORRECTIONS => self.corrections = Corrections::from_parameters(&reply.parameters),
            2021 => return self.record_edm_mode(&first, options),
            2023 => return self.record_prism(&first, options),
            2026 => self.checked.push(format!("face: {}", if first == "1" { 2 } else { 1 })),
            _ => {}
        }
        Ok(())
    }

    /// Fails if a setting that was written could not be read back.
    fn check_read_back(&self, call: &Call, options: &GeocomOptions) -> Result<(), Failure> {
        let was_set = (call.rpc == 2021 && options.edm_mode.is_some())
            || (call.rpc == 2023 && options.prism_constant_mm.is_some());
        match self.warnings.last() {
            Some(text) if was_set => Err(Failure::Settings(text.clone())),
            _ => Ok(()),
        }
    }

    fn record_decimals(&mut self, text: &str) -> Result<(), Failure> {
        let Ok(decimals) = text.parse::<usize>() else {
            return Err(Failure::Garbled(format!("`{text}` is not a number of decimals")));
        };
        if decimals < FEWEST_DECIMALS {
            return Err(Failure::Settings(format!("it sends only {decimals} decimals and does not accept {DECIMALS}")));
        }
        self.checked.push(format!("decimals: {decimals} (read back)"));
        Ok(())
    }

    /// Refuses a scale, as of a map projection: it belongs to a survey and not to the distances of a robot. What corrects for the
    /// air is right.
    fn judge_corrections(&mut self) -> Result<(), Failure> {
        let Some(corrections) = self.corrections else {
            self.warnings.push("the instrument does not report its corrections: make sure at the instrument that no scale, map projection or ppm is set".to_owned());
            return Ok(());
        };
        let scaled = |ppm: f64| Err(Failure::Scaled(1.0 + ppm * 1e-6));
        match self.air {
            Some(air) if (corrections.total - air).abs() > SCALE_TOLERANCE => return scaled(corrections.total - air),
            None if !POSSIBLE_AIR.contains(&corrections.total) => return scaled(corrections.total),
            None if corrections.total.abs() > SUSPICIOUS_AIR => self.warnings.push(format!(
                "distances are corrected by {:.1} ppm in all, and the instrument does not report how much of it is for the air: \
                 make sure that no scale or map projection is set",
                corrections.total
            )),
            Some(_) | None => {}
        }
        self.checked.push(format!("correction of distances: {:.2} ppm for the air, no scale", corrections.total));
        Ok(())
    }

    fn record_edm_mode(&mut self, text: &str, options: &GeocomOptions) -> Result<(), Failure> {
        if options.edm_mode.is_some_and(|mode| text.parse() != Ok(mode)) {
            return Err(Failure::Settings(format!("the EDM mode remains {text}")));
        }
        self.checked.push(format!("EDM mode: {text} (read back)"));
        Ok(())
    }

    fn record_prism(&mut self, text: &str, options: &GeocomOptions) -> Result<(), Failure> {
        let Some(constant) = text.parse::<f64>().ok().filter(|constant| constant.is_finite()) else {
            return Err(Failure::Garbled(format!("`{text}` is not a prism constant")));
        };
        if options.prism_constant_mm.is_some_and(|wanted| (wanted * 1e-3 - constant).abs() > 1e-6) {
            return Err(Failure::Settings(format!("the prism constant remains {:.2} mm", constant * 1e3)));
        }
        self.checked.push(format!("prism constant: {:.2} mm (read back)", constant * 1e3));
        self.reflector = Some(Reflector { id: 0, name: "prism by its constant".to_owned(), offset: constant });
        Ok(())
    }

    fn identity(mut self) -> Identity {
        let or_unknown = |text: Option<String>| text.unwrap_or_else(|| UNKNOWN.to_owned());
        let name = format!(
            "{}, serial number {}, GeoCOM {}",
            or_unknown(self.name),
            or_unknown(self.serial),
            or_unknown(self.release)
        );
        self.checked.insert(0, "units: m, rad (fixed in GeoCOM)".to_owned());
        self.checked.insert(1, "frame: the instrument's own, from angles and distance".to_owned());
        Identity {
            name,
            reflector: self.reflector,
            checked: self.checked,
            warnings: self.warnings,
            notes: vec![ACCURACY.to_owned()],
        }
    }
}

impl Protocol for GeocomProtocol {
    fn start(&mut self, now: Moment) {
        self.exchange.restart();
        self.outbox.clear();
        self.set_up = SetUpResult::default();
        self.wake(now, WAKE_LIMIT, AfterWaking::SetUp);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        for &byte in bytes {
            if let Some(outcome) = self.exchange.push(byte, now, &mut self.outbox) {
                self.handle(outcome, now);
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        if let Some(outcome) = self.exchange.tick(now, &mut self.outbox) {
            self.handle(outcome, now);
        }
        if let Phase::Idle { since } = self.phase
            && since + KEEP_ALIVE <= now
        {
            self.phase = Phase::KeepAlive { is_wanted: false };
            self.ask(null_call(KEEP_ALIVE), now);
        }
    }

    fn trigger(&mut self, now: Moment) {
        let failure = match &mut self.phase {
            Phase::Idle { .. } => return self.measure(now),
            Phase::KeepAlive { is_wanted } if !*is_wanted => {
                *is_wanted = true;
                return;
            }
            Phase::Waking { then: AfterWaking::Idle, .. } => {
                Failure::NotReady("the last request was not answered; trying to reach the instrument".to_owned())
            }
            Phase::Closed | Phase::Waking { .. } | Phase::SetUp { .. } => {
                Failure::TooEarly("the set-up is not complete".to_owned())
            }
            Phase::Turning => Failure::TooEarly("the instrument is turning".to_owned()),
            Phase::KeepAlive { .. } | Phase::Measuring { .. } => {
                Failure::TooEarly("another shot is in progress".to_owned())
            }
        };
        self.outbox.fail(failure);
    }

    fn point(&mut self, at: &Point3<f64>, now: Moment) -> bool {
        if !matches!(self.phase, Phase::Idle { .. }) {
            self.outbox.fail(Failure::TooEarly("the instrument is busy or not set up".to_owned()));
            return true;
        }
        let horizontal = at.x.atan2(at.y).rem_euclid(TAU);
        let zenith = (at.z / at.coords.norm().max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).acos();
        // Precise, with search of the target; the last parameter is reserved.
        let parameters = format!("{horizontal:.9},{zenith:.9},0,1,0");
        self.phase = Phase::Turning;
        self.ask(Call { rpc: 9027, parameters, limit: TURNING, what: "turning to the prism" }, now);
        true
    }

    fn cancel(&mut self, now: Moment) {
        match &mut self.phase {
            Phase::Turning => self.wake(now, TURNING, AfterWaking::Idle),
            Phase::KeepAlive { is_wanted } => *is_wanted = false,
            Phase::Measuring { .. } => {
                // The instrument answers nothing else until it has finished the measurement.
                let limit = WAKE_LIMIT + Duration::from_secs_f64(self.options.timeout_s);
                self.wake(now, limit, AfterWaking::Idle);
            }
            _ => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Idle { since } => Some(since + KEEP_ALIVE),
            _ => self.exchange.next_deadline(),
        }
    }
}
