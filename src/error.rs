//! How the program ends: error kinds, exit codes and the way a failure is printed.

use std::error::Error;
use std::fmt;
use std::process::ExitCode;

/// How a command ended, with the exit code of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitStatus {
    /// Done; where there are acceptance limits they are met.
    Accepted,
    /// Done; the acceptance limits are not met.
    NotAccepted,
    /// The command line, a profile or an input file is not usable.
    Usage,
    /// No usable solution.
    Numerical,
    /// Files of a result or session could not be read or written.
    Store,
    /// A defect of this program.
    Internal,
}

impl ExitStatus {
    /// The exit code: 0, 1, 2, 4, 5 or 70 (3 is for instruments).
    pub const fn code(self) -> u8 {
        match self {
            Self::Accepted => 0,
            Self::NotAccepted => 1,
            Self::Usage => 2,
            Self::Numerical => 4,
            Self::Store => 5,
            Self::Internal => 70,
        }
    }
}

impl From<ExitStatus> for ExitCode {
    fn from(status: ExitStatus) -> Self {
        Self::from(status.code())
    }
}

/// Why a command failed, as it is told to the operator.
#[derive(Debug)]
pub struct Failure {
    /// Decides the exit code.
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
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(cause) = source {
            message = format!("{message}: {cause}");
            source = cause.source();
        }
        Self::new(status, message)
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
        write!(f, "error: {}", self.message)?;
        for hint in &self.hints {
            write!(f, "\nhint: {hint}")?;
        }
        Ok(())
    }
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
    fn a_failure_prints_its_hints_below() {
        let failure = Failure::new(ExitStatus::Usage, "no robot 'kuka'").hint("see 'trupose profile list'");
        assert_eq!(failure.to_string(), "error: no robot 'kuka'\nhint: see 'trupose profile list'");
    }
}
