//! The journal of a session: everything that was decided and measured, one entry per line, nothing ever changed.
//!
//! ```text
//! ("5e0c91d2a47b3f68", 7, "2026-03-01T09:15:02.5Z", Sample((number: 4, …)))
//! ```
//!
//! A line is a RON tuple: check sum, number from 1, time in UTC, [`Entry`]. The check sum is the first half of the SHA-256 of
//! the check sum of the line before and of the rest of this line: a line that is changed, lost or moved shows itself.
//!
//! The session **is** the fold of its journal ([`super::state::Session`]). A last write that is not complete, as a crash or a full
//! disk leaves it, is dropped and reported: a line without its line break, or zeros where a page was lost. Any other damage is an
//! error that names the line, also in the last one: a line that is complete was on disk, and may have been acknowledged.
//!
//! The layout has a version, [`SCHEMA`], in the first entry. A later version that changes the meaning of an entry gets a new
//! number, and [`read`] is the place where older ones are brought up to date; fields that are merely added have a default.

mod describe;
mod entry;

use std::str::FromStr as _;

use jiff::Timestamp;
use sha2::{Digest as _, Sha256};
use thiserror::Error;

pub use describe::{correction_text, instrument_text, target_text};
pub use entry::{
    Correction, Decision, Entry, FindingCause, FindingText, IdentifiedText, JointPointText, MeasuredText, PairText,
    PlanText, PlannedText, PointErrorText, RobotProgramText, from_edge, from_xyz_mm, to_edge, to_length_mm, to_xyz_mm,
};

use crate::text::{printable, shortened};

/// Version of the layout of journals.
pub const SCHEMA: u32 = 1;

/// Name of the file in a session's folder.
pub const FILE_NAME: &str = "journal.ron";

/// Start of every line.
const BEGIN: &[u8] = b"(\"";

/// Bytes of a check sum in hexadecimal.
const SUM_DIGITS: usize = 16;

/// Columns of a damaged entry in a message.
const LONGEST_READING: usize = 100;

/// An entry with its place and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// From 1, without gaps.
    pub number: u64,
    /// When it was made. Clocks are set: a later line may have an earlier time.
    pub time: Timestamp,
    pub entry: Entry,
}

/// The check sum of the last line; the next one continues from it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sum(String);

/// A journal as it was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journal {
    /// All complete lines.
    pub lines: Vec<Line>,
    /// Check sum of the last one.
    pub sum: Sum,
    /// Bytes of the complete lines: whatever follows must be cut off before the next line is written.
    pub good_bytes: usize,
    /// Bytes after them that are not a line.
    pub torn_bytes: usize,
}

/// A journal that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum JournalError {
    /// A line in the middle is damaged.
    #[error(
        "line {line} of the journal is damaged ({what}); lines before it are intact, those after it cannot be trusted"
    )]
    Damaged {
        /// Line, from 1.
        line: usize,
        /// In which way.
        what: String,
    },
    /// Written by a newer program.
    #[error("the journal has schema {found}, this program understands up to {SCHEMA}; it was written by {program}")]
    Newer {
        /// Version found.
        found: u32,
        /// Program that wrote it.
        program: String,
    },
    /// There is no complete line.
    #[error("the journal is empty: nothing was measured in this session")]
    Empty,
    /// The first line does not open a session.
    #[error("the journal does not begin with an opening entry: this is not a session of trupose")]
    NotAJournal,
    /// An entry cannot be written; a defect of this program.
    #[error("an entry cannot be written as text: {0}")]
    Unwritable(String),
}

/// The text of a line, line break included, and the check sum to continue from.
///
/// # Errors
/// The entry has no text form; this is a defect.
pub fn encode(line: &Line, before: &Sum) -> Result<(String, Sum), JournalError> {
    let entry = ron::to_string(&line.entry).map_err(|error| JournalError::Unwritable(error.to_string()))?;
    let rest = format!("{}, \"{}\", {entry})", line.number, line.time);
    let sum = before.next(&rest);
    Ok((format!("(\"{}\", {rest}\n", sum.0), sum))
}

/// Reads a journal.
///
/// # Errors
/// Empty, not a journal, of a newer schema, or damaged before its last line.
pub fn read(bytes: &[u8]) -> Result<Journal, JournalError> {
    let mut journal = Journal::default();
    let mut rest = bytes;
    while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
        let (text, after) = (rest.get(..end).unwrap_or_default(), rest.get(end + 1..).unwrap_or_default());
        let number = journal.lines.len() + 1;
        match decode(text, &journal.sum) {
            Ok((line, sum)) if line.number == number as u64 => {
                journal.lines.push(line);
                journal.sum = sum;
                journal.good_bytes += end + 1;
                rest = after;
            }
            Ok((line, _)) => {
                return Err(damaged(number, format!("it has number {}", line.number)));
            }
            Err(LineError::Text(_)) if is_interrupted_write(text, rest) => break,
            Err(LineError::Text(_)) if journal.lines.is_empty() && !has_a_line(bytes) => break,
            Err(LineError::Text(what)) => return Err(damaged(number, with_reading(what, text))),
            Err(error) => return Err(error.at(number)),
        }
        if let [Line { entry: Entry::Opened { schema, program, .. }, .. }] = journal.lines.as_slice()
            && *schema > SCHEMA
        {
            return Err(JournalError::Newer { found: *schema, program: program.clone() });
        }
    }
    journal.torn_bytes = bytes.len() - journal.good_bytes;
    match journal.lines.first().map(|line| &line.entry) {
        None if bytes.starts_with(BEGIN) || BEGIN.starts_with(bytes) => Err(JournalError::Empty),
        Some(Entry::Opened { .. }) => Ok(journal),
        _ => Err(JournalError::NotAJournal),
    }
}

/// Whether anything reads like a line of a journal: another file has no line that could be damaged.
fn has_a_line(bytes: &[u8]) -> bool {
    bytes.starts_with(BEGIN)
        || bytes
            .split(|byte| *byte == b'\n')
            .any(|line| std::str::from_utf8(line).is_ok_and(|line| Parts::of(line).is_some()))
}

/// Whether `rest`, which begins with the line `first` that cannot be read, is what a power cut leaves of the last write.
///
/// A file system may keep a later page of a write and lose an earlier one, which then reads as zeros. All lines of one write have the
/// same time. A line that ends in a line break and has no zeros was complete on disk, so it has been damaged since.
fn is_interrupted_write(first: &[u8], rest: &[u8]) -> bool {
    let mut times =
        rest.split(|byte| *byte == b'\n').filter_map(|line| Some(Parts::of(std::str::from_utf8(line).ok()?)?.time));
    let time = times.next();
    // One byte in the middle is a flipped bit.
    let has_hole = first.ends_with(&[0]) || first.windows(2).any(|pair| pair == [0, 0]);
    has_hole && times.all(|other| Some(other) == time)
}

/// What is wrong with a line, with what can still be read of it: the operator looks for a pose, not for a line.
fn with_reading(what: &str, line: &[u8]) -> String {
    let text = String::from_utf8_lossy(line);
    let entry = Parts::of(&text).and_then(|parts| ron::from_str::<Entry>(parts.entry).ok());
    let pose =
        || text.split_once("pose:\"").and_then(|(_, after)| after.split_once('"')).map(|(pose, _)| pose.to_owned());
    match entry {
        Some(entry) => format!("{what}; it reads '{}'", shortened(&entry.describe(), LONGEST_READING)),
        None => {
            pose().map_or_else(|| what.to_owned(), |pose| format!("{what}; it is about pose '{}'", printable(&pose)))
        }
    }
}

impl Sum {
    fn next(&self, rest: &str) -> Self {
        let digest = Sha256::new().chain_update(&self.0).chain_update(rest).finalize();
        Self(digest.iter().take(SUM_DIGITS / 2).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat())
    }
}

/// Damage of a line.
enum LineError {
    Text(&'static str),
    Entry(String),
    Opening { schema: u32, program: String },
}

impl LineError {
    fn at(self, line: usize) -> JournalError {
        match self {
            Self::Text(what) => damaged(line, what.to_owned()),
            Self::Entry(what) => damaged(line, what),
            Self::Opening { schema, program } => JournalError::Newer { found: schema, program },
        }
    }
}

const fn damaged(line: usize, what: String) -> JournalError {
    JournalError::Damaged { line, what }
}

/// Whether `text`, a line of a journal with its break, says what `line` says: the same number, time and entry. Check sums are not
/// looked at, and fields that a program of another version leaves out count as it means them.
pub fn says(text: &str, line: &Line) -> bool {
    let Some(Parts { number, time, entry, .. }) = Parts::of(text.trim_end_matches('\n')) else { return false };
    let same = || ron::to_string(&line.entry).is_ok_and(|own| own == entry || own_again(entry) == Some(own));
    number == line.number && time == line.time && same()
}

/// An entry as this program writes it.
fn own_again(entry: &str) -> Option<String> {
    ron::to_string(&ron::from_str::<Entry>(entry).ok()?).ok()
}

/// A line taken to pieces.
struct Parts<'a> {
    sum: &'a str,
    /// The text that the checksum covers.
    rest: &'a str,
    number: u64,
    time: Timestamp,
    entry: &'a str,
}

impl<'a> Parts<'a> {
    /// `text` is without a line break.
    fn of(text: &'a str) -> Option<Self> {
        let (sum, rest) = text.strip_prefix("(\"")?.split_once("\", ")?;
        let (number, after) = rest.split_once(", \"")?;
        let (time, entry) = after.split_once("\", ")?;
        let (number, time) = (number.parse().ok()?, Timestamp::from_str(time).ok()?);
        Some(Self { sum, rest, number, time, entry: entry.strip_suffix(')')? })
    }
}

fn decode(bytes: &[u8], before: &Sum) -> Result<(Line, Sum), LineError> {
    let text = std::str::from_utf8(bytes).map_err(|_error| LineError::Text("it is not UTF-8 text"))?;
    let Parts { sum, rest, number, time, entry } =
        Parts::of(text).ok_or(LineError::Text("it does not read like a line of a journal"))?;
    let expected = before.next(rest);
    if sum != expected.0 {
        return Err(LineError::Text("its check sum does not fit"));
    }
    match ron::from_str(entry) {
        Ok(entry) => Ok((Line { number, time, entry }, expected)),
        // The check sum fits, so a newer program has written something that this one does not know.
        Err(error) => {
            Err(newer_schema(entry).unwrap_or_else(|| LineError::Entry(format!("unknown entry: {}", error.code))))
        }
    }
}

/// An opening entry of a newer schema, whatever else it has.
fn newer_schema(entry: &str) -> Option<LineError> {
    let after = entry.strip_prefix("Opened(schema:")?;
    let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
    let schema = digits.parse().ok().filter(|schema| *schema > SCHEMA)?;
    let program =
        after.split_once("program:\"").and_then(|(_, text)| text.split_once('"')).map_or("?", |(name, _)| name);
    Some(LineError::Opening { schema, program: program.to_owned() })
}

#[cfg(test)]
mod tests;
