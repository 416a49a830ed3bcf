//! Output of a script: one line per event, stable enough to be compared.

use std::io::{self, Write};

use jiff::Timestamp;
use serde::Serialize;

use crate::text::printable;

/// Format of a transcript.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

/// Prints events.
#[derive(Debug)]
pub struct Transcript<'a, W: Write> {
    out: &'a mut W,
    format: Format,
    /// Whether times are printed, which makes sense only if they are the same in every run.
    with_time: bool,
}

/// A line of the JSON form.
#[derive(Serialize)]
struct Record<'a> {
    event: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    entry: Option<u64>,
    text: &'a str,
}

impl<'a, W: Write> Transcript<'a, W> {
    /// Prints to `out`; `with_time` for a virtual clock.
    pub fn new(out: &'a mut W, format: Format, with_time: bool) -> Self {
        Self { out, format, with_time }
    }

    /// An entry of the journal that is on disk.
    pub(super) fn entry(&mut self, number: u64, time: Timestamp, text: &str) -> io::Result<()> {
        let time = self.with_time.then(|| time.to_string());
        self.line("saved", time, Some(number), text)
    }

    /// Any other event: `script`, `do`, `notice`, `expect`, `say`, `failed`, `done`.
    pub(super) fn event(&mut self, event: &str, text: &str) -> io::Result<()> {
        self.line(event, None, None, text)
    }

    /// A text as it is, in the text format only.
    pub(super) fn table(&mut self, text: &str) -> io::Result<()> {
        match self.format {
            Format::Text => {
                write!(self.out, "\n{text}\n")?;
                self.out.flush()
            }
            Format::Json => Ok(()),
        }
    }

    fn line(&mut self, event: &str, time: Option<String>, entry: Option<u64>, text: &str) -> io::Result<()> {
        let text = text.lines().map(printable).collect::<Vec<_>>().join(" | ");
        let line = match self.format {
            Format::Text => {
                let number = entry.map_or_else(|| "     ".to_owned(), |number| format!("{number:>4} "));
                let clock = time.as_deref().map_or_else(String::new, |time| {
                    // `2026-01-01T08:03:12Z`: the time of day is enough.
                    let time: String = time.chars().skip(11).take(8).collect();
                    format!("{time} ")
                });
                format!("{number}{clock}{event:<7} {text}")
            }
            Format::Json => {
                serde_json::to_string(&Record { event, time, entry, text: &text }).map_err(io::Error::other)?
            }
        };
        writeln!(self.out, "{line}")?;
        self.out.flush()
    }
}
