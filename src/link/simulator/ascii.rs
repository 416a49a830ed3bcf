//! A simulated program or gauge that prints one line per point, with the same options as the driver.

use std::collections::VecDeque;
use std::time::Duration;

use super::Output;
use super::PointSource;
use super::Simulator;
use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use crate::link::protocol::Moment;
use crate::link::protocol::Shot;
use crate::link::protocol::ascii::AsciiOptions;
use crate::link::protocol::ascii::Checksum;
use crate::link::protocol::ascii::Column;
use crate::link::protocol::ascii::DecimalSign;
use crate::link::protocol::ascii::Layout;
use crate::link::protocol::ascii::Mode;
use crate::link::protocol::ascii::Separator;
use crate::link::protocol::ascii::unescape;
use crate::link::protocol::crc::crc16_arc;
use crate::link::protocol::crc::nmea_xor;

/// Line for a missing point, in the form of T2SA.
const ERROR_TEXT: &str = "ERR-305 point measurement failed";

/// Interval of the lines of a stream.
const PERIOD: Duration = Duration::from_millis(100);

/// Time from a trigger to its line.
const MEASURING: Duration = Duration::from_millis(300);

/// Delay of a late answer, longer than the driver waits.
const LATE: Duration = Duration::from_secs(40);

/// Most bytes of an incomplete trigger.
const MAX_RECEIVED: usize = 4096;

/// Most triggers in progress.
const MAX_MEASURING: usize = 256;

faults! {
    /// A fault of the simulated line source. Its occasion is a line.
    pub AsciiFault {
        Halves "halves" "The line in two halves with a pause between them.",
        Cut "cut" "Half the line, then its terminator; the rest is lost.",
        TwoInOne "two-in-one" "Two lines in one write.",
        Joined "joined" "Two lines without a terminator between them.",
        CarriageReturnOnly "carriage-return-only" "The line ends with CR alone.",
        DecimalComma "decimal-comma" "The wrong decimal sign.",
        NotANumber "not-a-number" "A coordinate is `NaN`.",
        Thousands "thousands" "Digits grouped in thousands: `1,234.5`.",
        EmptyLines "empty-lines" "Some empty lines before the line.",
        LongLine "long-line" "10,000 bytes without a terminator before the line.",
        ErrorText "error-text" "An error message instead of the line.",
        StaleRepeat "stale-repeat" "The previous line again.",
        DisconnectMidLine "disconnect-mid-line" "The connection is closed in the middle of the line.",
        Origin "origin" "0, 0, 0, as some programs print after a failed measurement.",
        WrongUnit "wrong-unit" "A point a million times too far: the wrong unit.",
        BitError "bit-error" "A digit changed in transit; a check sum detects it.",
        Noise "noise" "Bytes as received at a wrong baud rate.",
        Silent "silent" "Nothing is sent.",
        Late "late" "The line arrives long after the driver gave up.",
    }
}

/// A simulated line source: one line per trigger, or ten per second.
#[derive(Debug)]
pub struct AsciiSimulator {
    options: AsciiOptions,
    trigger: Vec<u8>,
    faults: FaultPlan<AsciiFault>,
    received: Vec<u8>,
    measuring: VecDeque<Moment>,
    next_line: Option<Moment>,
    schedule: Schedule,
    last_body: Option<String>,
    printed: u32,
}

impl AsciiSimulator {
    /// Fails if [`AsciiOptions::validate`] does. With a layout by regular expression it answers in the form of T2SA.
    pub fn new(options: AsciiOptions, faults: impl IntoIterator<Item = Planned<AsciiFault>>) -> Result<Self, String> {
        options.validate()?;
        let trigger = match &options.mode {
            Mode::Polled { trigger } => unescape(trigger)?,
            Mode::Streamed { .. } => Vec::new(),
        };
        Ok(Self {
            options,
            trigger,
            faults: FaultPlan::new(faults),
            received: Vec::new(),
            measuring: VecDeque::new(),
            next_line: None,
            schedule: Schedule::default(),
            last_body: None,
            printed: 0,
        })
    }

    /// Bytes of an incomplete trigger.
    pub const fn pending(&self) -> usize {
        self.received.len()
    }

    /// Prints one line, with any fault that is due.
    fn print(&mut self, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|_| true);
        self.printed = self.printed.saturating_add(1);
        let Some(shot) = source.shot() else {
            let line = self.line(ERROR_TEXT);
            return self.schedule.send(now, line.into_bytes());
        };
        let body = self.body(&shot, fault, now);
        self.send_body(&body, fault, now);
        self.last_body = Some(body);
    }

    fn send_body(&mut self, body: &str, fault: Option<AsciiFault>, now: Moment) {
        let line = self.line(body);
        let bytes = line.clone().into_bytes();
        match fault {
            Some(AsciiFault::Halves) => self.schedule.send_halves(now, &bytes),
            Some(AsciiFault::Cut) => self.schedule.send(now, [halves(&bytes).0, b"\r\n"].concat()),
            Some(AsciiFault::TwoInOne) => self.schedule.send(now, line.repeat(2).into_bytes()),
            Some(AsciiFault::Joined) => self.schedule.send(now, [line.trim_end().as_bytes(), &bytes].concat()),
            Some(AsciiFault::CarriageReturnOnly) => {
                self.schedule.send(now, format!("{}\r", line.trim_end()).into_bytes());
            }
            Some(AsciiFault::EmptyLines) => self.schedule.send(now, format!("\r\n\n\r{line}").into_bytes()),
            Some(AsciiFault::LongLine) => {
                self.schedule.send(now, format!("{}\r\n{line}", "x".repeat(10_000)).into_bytes());
            }
            Some(AsciiFault::ErrorText) => self.schedule.send(now, self.line(ERROR_TEXT).into_bytes()),
            Some(AsciiFault::StaleRepeat) => {
                let stale = self.last_body.as_ref().map_or(line, |last| self.line(last));
                self.schedule.send(now, stale.into_bytes());
            }
            Some(AsciiFault::DisconnectMidLine) => self.schedule.break_off(now, &bytes),
            Some(AsciiFault::BitError) => self.schedule.send(now, with_digit_changed(bytes)),
            Some(AsciiFault::Noise) => {
                self.schedule.send(now, [b"\xF8\x80\x78\xFE\x98\r".as_slice(), b"\x06\xE6\n"].concat());
            }
            Some(AsciiFault::Silent) => {}
            Some(AsciiFault::Late) => self.schedule.send(now + LATE, bytes),
            _ => self.schedule.send(now, bytes),
        }
    }

    /// The values as text.
    fn body(&self, shot: &Shot, fault: Option<AsciiFault>, now: Moment) -> String {
        let mut values = shot.point.coords.map(|value| value / self.options.unit.metres());
        match fault {
            Some(AsciiFault::Origin) => values.fill(0.0),
            Some(AsciiFault::WrongUnit) => values *= 1e6,
            _ => {}
        }
        let mut texts = [values.x, values.y, values.z].map(|value| self.number(value, fault));
        if let (Some(AsciiFault::NotANumber), [_, y, _]) = (fault, &mut texts) {
            "NaN".clone_into(y);
        }
        match &self.options.layout {
            Layout::Columns(columns) => self.columns(columns, &texts, shot, now),
            Layout::Regex(_) => format!("ACK-300 measured; result {}", texts.join(",")),
        }
    }

    fn columns(&self, columns: &[Column], texts: &[String; 3], shot: &Shot, now: Moment) -> String {
        let [x, y, z] = texts;
        let sigma = shot.sigma.map(|sigma| sigma.map(|value| self.number(value / self.options.unit.metres(), None)));
        let [sx, sy, sz] = sigma.unwrap_or_default();
        let values: Vec<String> = columns
            .iter()
            .map(|column| match column {
                Column::Skip => "-".to_owned(),
                Column::Literal(text) => text.clone(),
                Column::Name => format!("P{}", self.printed),
                Column::X => x.clone(),
                Column::Y => y.clone(),
                Column::Z => z.clone(),
                Column::Sigma | Column::SigmaX => sx.clone(),
                Column::SigmaY => sy.clone(),
                Column::SigmaZ => sz.clone(),
                Column::Time => self.number(now.as_secs_f64() + 1.0, None),
                Column::Status => self.options.valid_statuses.first().cloned().unwrap_or_default(),
            })
            .collect();
        values.join(match self.options.separator {
            Separator::Comma => ",",
            Separator::Semicolon => ";",
            Separator::Tab => "\t",
            Separator::Spaces => " ",
        })
    }

    /// A number with ten decimals, which is finer than a nanometre in every unit.
    fn number(&self, value: f64, fault: Option<AsciiFault>) -> String {
        let text = format!("{value:.10}");
        let own = if self.options.decimal_sign == DecimalSign::Comma { "," } else { "." };
        match fault {
            Some(AsciiFault::DecimalComma) => text.replace('.', if own == "," { "." } else { "," }),
            Some(AsciiFault::Thousands) => "1,234.5".to_owned(),
            _ => text.replace('.', own),
        }
    }

    /// The line with its check sum and terminator.
    fn line(&self, body: &str) -> String {
        match self.options.checksum {
            Checksum::None => format!("{body}\r\n"),
            Checksum::Nmea => format!("${body}*{:02X}\r\n", nmea_xor(body.as_bytes())),
            Checksum::Crc16 => format!("{body}{:04X}\r\n", crc16_arc(body.as_bytes())),
        }
    }
}

/// Increments a digit, so that the result is still a number.
fn with_digit_changed(mut bytes: Vec<u8>) -> Vec<u8> {
    if let Some(digit) = bytes.iter_mut().find(|byte| byte.is_ascii_digit()) {
        *digit = if *digit == b'9' { b'0' } else { *digit + 1 };
    }
    bytes
}

impl Simulator for AsciiSimulator {
    fn accept(&mut self, now: Moment) {
        self.received.clear();
        self.measuring.clear();
        self.schedule.clear();
        self.next_line = self.trigger.is_empty().then_some(now + PERIOD);
    }

    fn feed(&mut self, bytes: &[u8], _source: &mut dyn PointSource, now: Moment) {
        let Some(&end) = self.trigger.last() else {
            return;
        };
        for &byte in bytes {
            if self.received.len() >= MAX_RECEIVED {
                self.received.clear();
            }
            self.received.push(byte);
            if byte == end && self.received.ends_with(&self.trigger) {
                self.received.clear();
                if self.measuring.len() < MAX_MEASURING {
                    self.measuring.push_back(now + MEASURING);
                }
            }
        }
    }

    fn tick(&mut self, source: &mut dyn PointSource, now: Moment) {
        while self.measuring.pop_front_if(|at| *at <= now).is_some() {
            self.print(source, now);
        }
        if self.next_line.is_some_and(|at| at <= now) {
            self.next_line = Some(now + PERIOD);
            self.print(source, now);
        }
        self.schedule.tick(now);
    }

    fn next_output(&mut self) -> Option<Output> {
        self.schedule.next_output()
    }

    fn next_deadline(&self) -> Option<Moment> {
        let own = [self.measuring.front().copied(), self.next_line];
        own.into_iter().flatten().chain(self.schedule.next_deadline()).min()
    }
}

#[cfg(test)]
mod tests;
