//! How the program ends: error kinds, exit codes and the way a failure is printed.

use std::error::Error;
use std::fmt;
use std::process::ExitCode;

use crate::text::{causes, printable};

/// How a command ended, with the exit code of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitStatus {
    /// Done; the acceptance limits, if there are any, are met.
    Accepted,
    /// Done; the acceptance limits are not met.
    NotAccepted,
    /// The command line, a profile or an input file cannot be used.
    Usage,
    /// An instrument or robot does not answer, or does not answer correctly.
    Instrument,
    /// No usable solution.
    Numerical,
    /// Files of a result or session could not be read or written, or the system refuses what the program needs.
    Store,
    /// A defect of this program.
    Internal,
    /// Ended cleanly by the signal with this number.
    Signal(i32),
}

impl ExitStatus {
    /// The exit code: 0, 1, 2, 3, 4, 5 or 70, 128 + number for a signal.
    pub const fn code(self) -> u8 {
        match self {
            Self::Accepted => 0,
            Self::NotAccepted => 1,
            Self::Usage => 2,
            Self::Instrument => 3,
            Self::Numerical => 4,
            Self::Store => 5,
            Self::Internal => 70,
            Self::Signal(number) => 128_u8.saturating_add(number.to_le_bytes()[0]),
        }
    }
}

impl From<ExitStatus> for ExitCode {
    fn from(status: ExitStatus) -> Self {
        Self::from(status.code())
    }
}

/// Why a command failed, in words for the operator.
#[derive(Debug)]
pub struct Failure {
    /// The kind of failure, which decides the exit code.
    pub status: ExitStatus,
    /// What happened, with names and numbers.
    pub message: String,
    /// What to do about it.
    pub hints: Vec<String>,
}

impl Failure {
    /// A failure with a message.
    pub fn new(status: ExitStatus, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), hints: Vec::new() }
    }

    /// A failure from an error and its sources, joined by colons.
    pub fn from_error(status: ExitStatus, error: &dyn Error) -> Self {
        Self::new(status, causes(error))
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&laid_out("error: ", &self.message))?;
        for hint in &self.hints {
            write!(f, "\n{}", laid_out("hint: ", hint))?;
        }
        Ok(())
    }
}

/// Width of a message on a terminal.
const WIDTH: usize = 80;
/// Deepest indentation that continuation lines keep.
const DEEPEST: usize = 8;

/// A message made safe for a terminal: control characters replaced, lines broken at 80 columns and indented. A message with carets
/// below an excerpt keeps its lines, because the carets would point elsewhere.
fn laid_out(lead: &str, message: &str) -> String {
    let lines: Vec<String> = format!("{lead}{message}").split('\n').map(printable).collect();
    let is_caret_line = |line: &String| line.contains('^') && line.chars().all(|c| matches!(c, ' ' | '|' | '^'));
    if lines.iter().any(is_caret_line) {
        return lines.join("\n");
    }
    lines.iter().map(|line| broken(line)).collect::<Vec<_>>().join("\n")
}

/// A line broken at blanks, continuation lines indented by two more. A word that is longer than a line stays whole.
fn broken(line: &str) -> String {
    if line.chars().count() <= WIDTH {
        return line.to_owned();
    }
    let depth = line.chars().take_while(|c| *c == ' ').count().min(DEEPEST);
    let mut lines = vec![" ".repeat(depth)];
    let mut empty = true;
    for word in line.split_whitespace() {
        let room = lines.last().map_or(0, |last| last.chars().count()) + word.chars().count() < WIDTH;
        if !empty && !room {
            lines.push(" ".repeat(depth + 2));
            empty = true;
        }
        if let Some(last) = lines.last_mut() {
            if !empty {
                last.push(' ');
            }
            last.push_str(word);
            empty = false;
        }
    }
    lines.join("\n")
}

impl Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_codes_are_stable() {
        use ExitStatus as S;
        let codes = [S::Accepted, S::NotAccepted, S::Usage, S::Numerical, S::Store, S::Internal].map(S::code);
        assert_eq!(codes, [0, 1, 2, 4, 5, 70]);
    }

    #[test]
    fn messages_keep_to_80_columns_and_disturb_no_terminal() {
        let failure = Failure::new(ExitStatus::Usage, format!("\u{1b}[31m {}", "word ".repeat(40)));
        let text = failure.hint("more ".repeat(40)).to_string();
        assert!(text.starts_with("error: \u{fffd}[31m word"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(text.contains("\n  word") && text.contains("\nhint: more"), "{text}");
        let excerpt = format!("x\n | {}\n | ^^", "y ".repeat(60));
        assert_eq!(Failure::new(ExitStatus::Usage, excerpt.clone()).to_string(), format!("error: {excerpt}"));
    }

    #[test]
    fn a_failure_prints_its_hints_below() {
        let failure = Failure::new(ExitStatus::Usage, "no robot 'kuka'").hint("see 'trupose profile list'");
        assert_eq!(failure.to_string(), "error: no robot 'kuka'\nhint: see 'trupose profile list'");
    }
}
