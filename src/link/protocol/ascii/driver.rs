//! The conversation: triggers, streams, and lines that must not be taken for the answer.

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::Point3;
use nalgebra::Vector3;

use super::super::Failure;
use super::super::Identity;
use super::super::Moment;
use super::super::Protocol;
use super::super::ProtocolEvent;
use super::super::Severity;
use super::super::Shot;
use super::super::Status;
use super::super::error_streak::ErrorStreak;
use super::super::lines::LineSplitter;
use super::super::lines::MAX_LINE;
use super::super::lines::Piece;
use super::super::outbox::Outbox;
use super::escape::unescape;
use super::options::AsciiOptions;
use super::options::Checksum;
use super::options::Mode;
use super::parser::LineParser;
use super::parser::ParsedLine;
use super::parser::Rejection;

/// Idle time after which no more of a late answer is expected.
const DRAIN: Duration = Duration::from_millis(200);

/// Time after which a missing answer is no longer expected.
const FORGET: Duration = Duration::from_mins(1);

/// Most unanswered triggers that are kept.
const MAX_OWED: usize = 16;

/// Consecutive lines with an old time that mean a clock that was set back instead of late lines.
const OLD_IN_A_ROW: u32 = 3;

/// Most restarts of an average after unreadable lines.
const MAX_RESTARTS: u32 = 3;

/// Most raw bytes that an averaged shot keeps.
const MAX_RAW: usize = 65_536;

/// The generic line driver.
#[derive(Debug)]
pub struct AsciiProtocol {
    parser: LineParser,
    trigger: Vec<u8>,
    timeout: Duration,
    splitter: LineSplitter,
    outbox: Outbox,
    started: bool,
    capture: Option<Capture>,
    /// Unanswered triggers, each with the time at which its answer is no longer expected. For each of them a line may still
    /// arrive that is older than the next trigger.
    owed: VecDeque<Moment>,
    last_byte: Option<Moment>,
    last_line: Option<Moment>,
    silence_reported: bool,
    last_time: Option<f64>,
    previous: Option<Point3<f64>>,
    errors: ErrorStreak,
    old_in_a_row: u32,
}

/// A shot in progress.
#[derive(Debug)]
enum Capture {
    /// Waiting for the line to be idle before the trigger is sent.
    Draining { until: Moment, deadline: Moment },
    /// Waiting for the answer. `unsure` lines may still arrive that are older than the trigger; `old` lines arrived that are
    /// older by their own time.
    Waiting { deadline: Moment, unsure: usize, old: u32 },
    /// Collecting lines of a stream.
    Averaging { deadline: Moment, shots: Vec<Shot>, restarts: u32, last_fault: Option<String> },
}

impl AsciiProtocol {
    /// Fails if [`AsciiOptions::validate`] does.
    pub fn new(options: AsciiOptions) -> Result<Self, String> {
        let trigger = match &options.mode {
            Mode::Polled { trigger } => unescape(trigger)?,
            Mode::Streamed { .. } => Vec::new(),
        };
        let parser = LineParser::new(options)?;
        let timeout = Duration::try_from_secs_f64(parser.options().timeout_s).map_err(|error| error.to_string())?;
        Ok(Self {
            parser,
            trigger,
            timeout,
            splitter: LineSplitter::default(),
            outbox: Outbox::default(),
            started: false,
            capture: None,
            owed: VecDeque::new(),
            last_byte: None,
            last_line: None,
            silence_reported: false,
            last_time: None,
            previous: None,
            errors: ErrorStreak::default(),
            old_in_a_row: 0,
        })
    }

    /// Bytes of an incomplete line.
    pub const fn pending(&self) -> usize {
        self.splitter.pending()
    }

    const fn lines(&self) -> Option<u32> {
        match self.parser.options().mode {
            Mode::Streamed { lines } => Some(lines),
            Mode::Polled { .. } => None,
        }
    }

    fn identity(&self) -> Identity {
        let options = self.parser.options();
        let mut notes = vec!["unit, frame and reflector are as set here; the lines do not contain them".to_owned()];
        if options.checksum == Checksum::None {
            notes.push("lines have no check sum, so a damaged digit is not detected".to_owned());
        }
        let mut warnings = Vec::new();
        if options.allow_identical {
            warnings.push(
                "identical readings are allowed, so a source that repeats its last line is not detected".to_owned(),
            );
        }
        Identity {
            name: "source of text lines".to_owned(),
            reflector: None,
            checked: vec![format!("unit: {} (as set)", options.unit.symbol())],
            warnings,
            notes,
        }
    }

    fn take(&mut self, piece: Piece, now: Moment) {
        match piece {
            Piece::Overlong => {
                self.refuse(Rejection::Garbled(format!("more than {MAX_LINE} bytes without a line end")), now);
            }
            Piece::Line(line) => match self.parser.read(&line) {
                Ok(ParsedLine::Skipped) => {}
                Ok(ParsedLine::Point(shot)) => self.accept(shot, now),
                Err(rejection) => self.refuse(rejection, now),
            },
        }
    }

    /// Handles a readable line.
    fn accept(&mut self, shot: Shot, now: Moment) {
        self.errors.reset();
        self.last_line = Some(now);
        self.silence_reported = false;
        let is_old = matches!((shot.instrument_time, self.last_time), (Some(time), Some(last)) if time <= last);
        if is_old {
            self.pass_over_old();
            return;
        }
        self.old_in_a_row = 0;
        self.last_time = shot.instrument_time.or(self.last_time);
        match self.lines() {
            None => self.accept_polled(shot, now),
            Some(lines) => self.accept_streamed(shot, lines, now),
        }
    }

    /// Handles a line whose time is not later than that of an earlier line: a repetition or a late answer.
    fn pass_over_old(&mut self) {
        self.old_in_a_row = self.old_in_a_row.saturating_add(1);
        if self.old_in_a_row == OLD_IN_A_ROW {
            let text = "the times in the lines do not advance; if the instrument's clock was set back, reconnect";
            self.outbox.report(Severity::Warning, text);
        }
        self.owed.pop_front();
        if let Some(Capture::Waiting { unsure, old, .. }) = &mut self.capture {
            *unsure = unsure.saturating_sub(1);
            *old = old.saturating_add(1);
        } else if let Some(Capture::Averaging { last_fault, .. }) = &mut self.capture {
            *last_fault = Some("its time is not later than that of the previous line".to_owned());
        }
    }

    fn accept_polled(&mut self, shot: Shot, now: Moment) {
        let was_owed = self.owed.pop_front().is_some();
        match self.capture {
            // It may be the answer to an earlier trigger. One more trigger resolves that.
            Some(Capture::Waiting { unsure: unsure @ 1.., .. }) => self.send_trigger(unsure - 1, now),
            Some(Capture::Waiting { .. }) => {
                let soon = now + self.timeout * 2;
                self.owed.iter_mut().for_each(|expires| *expires = soon.min(*expires));
                self.finish(shot);
            }
            _ if was_owed || self.is_repeat(&shot) => {}
            _ if self.started => self.outbox.push(ProtocolEvent::Offered(shot)),
            _ => {}
        }
    }

    fn accept_streamed(&mut self, shot: Shot, lines: u32, now: Moment) {
        let next = now + self.timeout;
        match &mut self.capture {
            Some(Capture::Averaging { deadline, shots, .. }) => {
                shots.push(shot);
                *deadline = next;
                if shots.len() >= lines as usize {
                    let mean = average(shots);
                    self.finish(mean);
                }
            }
            _ if self.started => self.outbox.push(ProtocolEvent::Live(shot)),
            _ => {}
        }
    }

    fn is_repeat(&self, shot: &Shot) -> bool {
        !self.parser.options().allow_identical && self.previous == Some(shot.point)
    }

    /// Reports the shot, unless it repeats the previous one.
    fn finish(&mut self, shot: Shot) {
        self.capture = None;
        if self.is_repeat(&shot) {
            return self.outbox.fail(Failure::Repeated);
        }
        self.previous = Some(shot.point);
        self.outbox.push(ProtocolEvent::Shot(shot));
    }

    /// Handles a line without a point.
    fn refuse(&mut self, rejection: Rejection, now: Moment) {
        if !self.started {
            return;
        }
        if let Rejection::Garbled(text) = &rejection {
            self.count_bad(text);
        } else {
            self.errors.reset();
            self.last_line = Some(now);
            self.silence_reported = false;
        }
        match &mut self.capture {
            Some(Capture::Waiting { .. }) => self.refuse_polled(rejection, now),
            Some(Capture::Averaging { .. }) => self.refuse_averaged(rejection),
            Some(Capture::Draining { .. }) => {
                self.owed.pop_front();
            }
            None => {
                let was_owed = self.owed.pop_front().is_some();
                if !was_owed && let Rejection::Instrument(text) = rejection {
                    self.outbox.report(Severity::Warning, format!("message of the instrument: {text}"));
                }
            }
        }
    }

    fn refuse_polled(&mut self, rejection: Rejection, now: Moment) {
        self.owed.pop_front();
        match self.capture {
            // It may belong to an earlier trigger.
            Some(Capture::Waiting { unsure: unsure @ 1.., .. }) => self.send_trigger(unsure - 1, now),
            _ => self.fail(failure(rejection)),
        }
    }

    /// Restarts the average after noise, and fails it after any other rejection.
    fn refuse_averaged(&mut self, rejection: Rejection) {
        let Some(Capture::Averaging { shots, restarts, last_fault, .. }) = &mut self.capture else {
            return;
        };
        shots.clear();
        *restarts += 1;
        *last_fault = Some(rejection.to_string());
        if *restarts > MAX_RESTARTS || !matches!(rejection, Rejection::Garbled(_)) {
            self.fail(failure(rejection));
        }
    }

    fn count_bad(&mut self, text: &str) {
        let check = "baud rate, line ending, separator and decimal sign";
        if let Some(warning) = self.errors.record("lines", text, check) {
            self.outbox.report(Severity::Warning, warning);
        }
    }

    fn fail(&mut self, failure: Failure) {
        self.capture = None;
        self.outbox.fail(failure);
    }

    fn send_trigger(&mut self, unsure: usize, now: Moment) {
        self.splitter.discard_partial();
        self.outbox.send(self.trigger.clone());
        if self.owed.len() >= MAX_OWED {
            self.owed.pop_front();
        }
        self.owed.push_back(now + FORGET);
        self.capture = Some(Capture::Waiting { deadline: now + self.timeout, unsure, old: 0 });
    }

    fn begin_polled(&mut self, now: Moment) {
        self.owed.retain(|expires| *expires > now);
        let until = self.last_byte.unwrap_or(Moment::ZERO) + DRAIN;
        if !self.owed.is_empty() && until > now {
            self.capture = Some(Capture::Draining { until, deadline: now + self.timeout });
        } else {
            self.send_trigger(self.owed.len(), now);
        }
    }

    fn time_out(&mut self) {
        let seconds = self.timeout.as_secs_f64();
        let failure = match self.capture.take() {
            Some(Capture::Waiting { old, .. }) if old > 0 => {
                Failure::Unusable("all lines have a time that is not later than that of an earlier line".to_owned())
            }
            Some(Capture::Averaging { last_fault: Some(text), .. }) => Failure::Garbled(text),
            Some(Capture::Averaging { shots, .. }) if !shots.is_empty() => {
                Failure::Silent { what: format!("collecting lines ({} received)", shots.len()), seconds }
            }
            _ if self.lines().is_some() => {
                let what = "waiting for its lines (if each must be requested, set the option 'mode')".to_owned();
                Failure::Silent { what, seconds }
            }
            _ => Failure::Silent { what: "waiting for a line".to_owned(), seconds },
        };
        self.outbox.fail(failure);
    }

    /// When to report that a stream stopped.
    fn silence_deadline(&self) -> Option<Moment> {
        let is_watched = self.started && self.lines().is_some() && self.capture.is_none() && !self.silence_reported;
        self.last_line.filter(|_| is_watched).map(|last| last + self.timeout)
    }
}

impl Protocol for AsciiProtocol {
    fn start(&mut self, now: Moment) {
        self.splitter.clear();
        self.outbox.clear();
        self.capture = None;
        self.owed.clear();
        self.errors.reset();
        self.old_in_a_row = 0;
        self.last_byte = None;
        self.last_time = None;
        self.last_line = Some(now);
        self.silence_reported = false;
        self.started = true;
        let identity = self.identity();
        self.outbox.push(ProtocolEvent::Ready(identity));
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        if !bytes.is_empty() {
            self.last_byte = Some(now);
        }
        if let Some(Capture::Draining { until, deadline }) = &mut self.capture {
            *until = (now + DRAIN).min(*deadline);
        }
        for &byte in bytes {
            if let Some(piece) = self.splitter.push(byte) {
                self.take(piece, now);
            }
        }
        if self.parser.options().datagrams
            && let Some(piece) = self.splitter.end()
        {
            self.take(piece, now);
        }
    }

    fn tick(&mut self, now: Moment) {
        match self.capture {
            Some(Capture::Draining { deadline, .. }) if deadline <= now => {
                let text = "it keeps sending lines without a request; check whether it is a stream";
                self.fail(Failure::NotReady(text.to_owned()));
            }
            Some(Capture::Draining { until, .. }) if until <= now => self.send_trigger(self.owed.len(), now),
            Some(Capture::Waiting { deadline, .. } | Capture::Averaging { deadline, .. }) if deadline <= now => {
                self.time_out();
            }
            _ => {}
        }
        if self.silence_deadline().is_some_and(|deadline| deadline <= now) {
            self.silence_reported = true;
            let text = format!("no readable line for {:.1} s", self.timeout.as_secs_f64());
            self.outbox.report(Severity::Warning, text);
        }
    }

    fn trigger(&mut self, now: Moment) {
        let refused = match (self.started, &self.capture) {
            (false, _) => Some("the link is not connected"),
            (true, Some(_)) => Some("another shot is in progress"),
            (true, None) => None,
        };
        if let Some(text) = refused {
            return self.outbox.fail(Failure::TooEarly(text.to_owned()));
        }
        if self.lines().is_none() {
            return self.begin_polled(now);
        }
        // A partial line is older than the trigger.
        self.splitter.discard_partial();
        let deadline = now + self.timeout;
        self.capture = Some(Capture::Averaging { deadline, shots: Vec::new(), restarts: 0, last_fault: None });
    }

    fn cancel(&mut self, _now: Moment) {
        self.capture = None;
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.capture {
            Some(Capture::Draining { until, .. }) => Some(until),
            Some(Capture::Waiting { deadline, .. } | Capture::Averaging { deadline, .. }) => Some(deadline),
            None => self.silence_deadline(),
        }
    }

    fn shows_live(&self) -> bool {
        self.lines().is_some()
    }
}

fn failure(rejection: Rejection) -> Failure {
    match rejection {
        Rejection::Garbled(text) => Failure::Garbled(text),
        Rejection::NoPoint(text) => Failure::Unusable(text),
        Rejection::Instrument(text) => Failure::Refused(text),
    }
}

/// The mean of lines. The stated standard deviation is not reduced, because most of the error is common to all of them.
fn average(shots: &[Shot]) -> Shot {
    let Some(last) = shots.last() else {
        return Shot::bare(Point3::origin());
    };
    let mut mean = last.clone();
    if shots.len() < 2 {
        return mean;
    }
    let count = shots.len() as f64;
    let sum: Vector3<f64> = shots.iter().map(|shot| shot.point.coords).sum();
    mean.point = Point3::from(sum / count);
    let scatter =
        (shots.iter().map(|shot| (shot.point - mean.point).norm_squared()).sum::<f64>() / (count - 1.0)).sqrt();
    mean.sigma = mean_square_root(shots);
    let text = format!("mean of {} lines, scatter {:.4} mm", shots.len(), scatter * 1e3);
    mean.remarks.push(Status { severity: Severity::Info, text });
    mean.raw = shots.iter().map(|shot| shot.raw.as_slice()).collect::<Vec<_>>().join(&b'\n');
    mean.raw.truncate(MAX_RAW);
    mean
}

/// RMS of the stated standard deviations (m), if every line states one.
fn mean_square_root(shots: &[Shot]) -> Option<[f64; 3]> {
    let mut squares = [0.0; 3];
    for shot in shots {
        for (square, sigma) in squares.iter_mut().zip(shot.sigma?) {
            *square += sigma * sigma;
        }
    }
    Some(squares.map(|square| (square / shots.len() as f64).sqrt()))
}
