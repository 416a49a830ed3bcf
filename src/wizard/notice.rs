//! Messages to the operator: what happened and what to do about it.

use serde::Serialize;

/// Importance of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Severity {
    /// Information only.
    Info,
    /// To be looked at before continuing.
    Attention,
    /// A request could not be carried out.
    Error,
    /// Nothing continues until the problem is resolved.
    Stop,
}

/// A message to the operator.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Notice {
    pub severity: Severity,
    /// What happened, with names and numbers.
    pub what: String,
    /// Possible remedies.
    pub hints: Vec<String>,
}

impl Notice {
    pub fn info(what: impl Into<String>) -> Self {
        Self { severity: Severity::Info, what: what.into(), hints: Vec::new() }
    }

    pub fn attention(what: impl Into<String>) -> Self {
        Self { severity: Severity::Attention, what: what.into(), hints: Vec::new() }
    }

    pub fn error(what: impl Into<String>) -> Self {
        Self { severity: Severity::Error, what: what.into(), hints: Vec::new() }
    }

    pub fn stop(what: impl Into<String>) -> Self {
        Self { severity: Severity::Stop, what: what.into(), hints: Vec::new() }
    }

    /// Adds a remedy.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }
}

/// Why a request failed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// What happened.
    pub message: String,
    /// Possible remedies.
    pub hints: Vec<String>,
}

impl From<Problem> for Notice {
    fn from(problem: Problem) -> Self {
        Self { severity: Severity::Error, what: problem.message, hints: problem.hints }
    }
}
