//! Messages to the operator: what happened, and what to do about it.

use serde::Serialize;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Severity {
    /// For information.
    Info,
    /// To be looked at before going on.
    Attention,
    /// What was asked for could not be done.
    Error,
    /// Nothing goes on before it is resolved.
    Stop,
}

/// A message.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Notice {
    /// How much it matters.
    pub severity: Severity,
    /// What happened, with names and numbers.
    pub what: String,
    /// What to do.
    pub hints: Vec<String>,
}

impl Notice {
    /// For information.
    pub fn info(what: impl Into<String>) -> Self {
        Self { severity: Severity::Info, what: what.into(), hints: Vec::new() }
    }

    /// To be looked at.
    pub fn attention(what: impl Into<String>) -> Self {
        Self { severity: Severity::Attention, what: what.into(), hints: Vec::new() }
    }

    /// What was asked for could not be done.
    pub fn error(what: impl Into<String>) -> Self {
        Self { severity: Severity::Error, what: what.into(), hints: Vec::new() }
    }

    /// Nothing goes on before it is resolved.
    pub fn stop(what: impl Into<String>) -> Self {
        Self { severity: Severity::Stop, what: what.into(), hints: Vec::new() }
    }

    /// With what to do.
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
    /// What to do.
    pub hints: Vec<String>,
}

impl From<Problem> for Notice {
    fn from(problem: Problem) -> Self {
        Self { severity: Severity::Error, what: problem.message, hints: problem.hints }
    }
}
