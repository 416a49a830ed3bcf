//! Joint values of a robot as lines of text, from a small program on the controller or beside it:
//!
//! ```text
//! J,10.0,-20.0,30.0,-40.0,50.0,60.0,deg,0
//! J,0.1745,-0.3490,0.5236,-0.6981,0.8727,1.0472,rad,0,12.345
//! J,1200.5mm,10.0,-20.0,30.0,-40.0,50.0,60.0,deg,protective stop
//! ```
//!
//! The letter J, the joint values as the pendant shows them, their unit, the status and, if the program has one, a time in
//! seconds. A sliding joint has its unit `mm` behind its number. The status is `0` if the robot may be measured; any other text
//! is the reason why it may not. Lines that begin with `#` are comments, the first of which names the source. Nothing is ever
//! sent.

#[cfg(test)]
mod tests;

use std::time::Duration;

use super::error_streak::ErrorStreak;
use super::excerpt::excerpt;
use super::lines::{LineSplitter, MAX_LINE, Piece};
use super::outbox::Outbox;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent, Severity};

/// Longest wait for the first line.
const FIRST_LINE: Duration = Duration::from_secs(10);

/// A stream without a readable line for this long counts as lost.
const SILENCE: Duration = Duration::from_secs(3);

/// Fewest and most joints of an arm.
const JOINTS: std::ops::RangeInclusive<usize> = 2..=12;

/// Largest angle that a joint can have (rad); larger ones are in another unit.
const LARGEST_ANGLE: f64 = 40.0;

/// Largest position of a sliding joint (m).
const LARGEST_POSITION: f64 = 100.0;

/// A driver for lines of joint values.
#[derive(Clone, Debug, Default)]
pub struct JointLines {
    splitter: LineSplitter,
    outbox: Outbox,
    errors: ErrorStreak,
    phase: Phase,
    /// First comment.
    name: Option<String>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    #[default]
    Off,
    /// Waiting for the first line.
    Waiting(Moment),
    /// Receiving lines of this many joints; the time is that of the last one.
    Receiving { joints: usize, since: Moment },
}

/// A line of joint values.
#[derive(Clone, Debug, PartialEq)]
struct JointLine {
    /// Joint values (rad, sliding joints m).
    positions: Vec<f64>,
    unit: AngleUnit,
    stopped: Option<String>,
    /// Time of the source (s).
    time: Option<f64>,
}

/// Unit of the angles of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AngleUnit {
    Degree,
    Radian,
}

impl std::fmt::Display for AngleUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Degree => "deg",
            Self::Radian => "rad",
        })
    }
}

impl std::str::FromStr for AngleUnit {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "deg" => Ok(Self::Degree),
            "rad" => Ok(Self::Radian),
            _ => Err(()),
        }
    }
}

impl JointLine {
    /// Reads a line. Fails with the reason.
    fn read(line: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(line).map_err(|_not_text| "it is not plain text".to_owned())?;
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let Some(("J", fields)) = fields.split_first().map(|(first, rest)| (*first, rest)) else {
            return Err("it does not begin with 'J,'".to_owned());
        };
        let at =
            fields.iter().position(|field| field.parse::<AngleUnit>().is_ok()).ok_or("'deg' or 'rad' is missing")?;
        let (values, rest) = fields.split_at(at);
        let unit = rest.first().and_then(|unit| unit.parse().ok()).ok_or("the unit is missing")?;
        let (status, time) = match rest {
            [_, status] => (*status, None),
            [_, status, time] => (*status, Some(finite(time)?)),
            _ => return Err("after the unit belong the status and perhaps a time".to_owned()),
        };
        if !JOINTS.contains(&values.len()) {
            return Err(format!("it has {} joint values", values.len()));
        }
        let positions = values.iter().map(|value| position(value, unit)).collect::<Result<_, _>>()?;
        if status.is_empty() {
            return Err("the status is empty".to_owned());
        }
        let stopped = (status != "0").then(|| excerpt(status));
        Ok(Self { positions, unit, stopped, time })
    }
}

/// A joint value (rad, sliding joints m).
fn position(text: &str, unit: AngleUnit) -> Result<f64, String> {
    let (value, limit) = match (text.strip_suffix("mm"), unit) {
        (Some(number), _) => (finite(number.trim_end())? * 1e-3, LARGEST_POSITION),
        (None, AngleUnit::Degree) => (finite(text)?.to_radians(), LARGEST_ANGLE),
        (None, AngleUnit::Radian) => (finite(text)?, LARGEST_ANGLE),
    };
    if value.abs() > limit {
        return Err(format!("`{}` is not a joint value in {unit}", excerpt(text)));
    }
    Ok(value)
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("`{}` is not a number", excerpt(text)))
}

impl JointLines {
    fn piece(&mut self, piece: Piece, now: Moment) {
        let line = match piece {
            Piece::Overlong => return self.unreadable(&format!("more than {MAX_LINE} bytes without a line end")),
            Piece::Line(line) => line,
        };
        if let Some(comment) = line.strip_prefix(b"#") {
            let comment = String::from_utf8_lossy(comment);
            self.name.get_or_insert_with(|| excerpt(&comment));
            return;
        }
        match JointLine::read(&line) {
            Ok(line) => self.line(line, now),
            Err(why) => self.unreadable(&why),
        }
    }

    fn line(&mut self, line: JointLine, now: Moment) {
        let count = line.positions.len();
        match self.phase {
            Phase::Off => return,
            Phase::Waiting(_) => {
                let name = self.name.as_deref().unwrap_or("lines of joint values");
                let checked = vec![format!("joint values: {count} in {}, as the line states", line.unit)];
                let identity = Identity { name: name.to_owned(), checked, ..Identity::default() };
                self.outbox.push(ProtocolEvent::Ready(identity));
            }
            Phase::Receiving { joints, .. } if joints != count => {
                let text = format!("a line has {count} joint values, those before had {joints}");
                return self.lose(Failure::Garbled(text));
            }
            Phase::Receiving { .. } => {}
        }
        self.errors.reset();
        self.phase = Phase::Receiving { joints: count, since: now };
        self.outbox.push(ProtocolEvent::Joints(JointState {
            controller_time: line.time.unwrap_or(now.as_secs_f64()),
            stopped: line.stopped,
            ..JointState::at(line.positions)
        }));
    }

    fn unreadable(&mut self, why: &str) {
        if let Some(warning) = self.errors.record("lines", why, "the form 'J,numbers,deg,status' of the lines") {
            self.outbox.report(Severity::Warning, warning);
        }
    }

    fn deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Off => None,
            Phase::Waiting(since) => Some(since + FIRST_LINE),
            Phase::Receiving { since, .. } => Some(since + SILENCE),
        }
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.splitter.clear();
        self.outbox.lose(failure);
    }

    /// Bytes of an incomplete line.
    pub const fn pending(&self) -> usize {
        self.splitter.pending()
    }
}

impl Protocol for JointLines {
    fn start(&mut self, now: Moment) {
        *self = Self { phase: Phase::Waiting(now), ..Self::default() };
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
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return;
        }
        let limit = if matches!(self.phase, Phase::Waiting(_)) { FIRST_LINE } else { SILENCE };
        let what = "waiting for a line of joint values".to_owned();
        self.lose(Failure::Silent { what, seconds: limit.as_secs_f64() });
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.deadline()
    }
}
