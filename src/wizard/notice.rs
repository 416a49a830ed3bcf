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
    /// Whether it is about results that could not be written.
    #[serde(skip)]
    pub is_unwritten: bool,
}

impl Notice {
    fn new(severity: Severity, what: impl Into<String>) -> Self {
        Self { severity, what: what.into(), hints: Vec::new(), is_unwritten: false }
    }

    pub fn info(what: impl Into<String>) -> Self {
        Self::new(Severity::Info, what)
    }

    pub fn attention(what: impl Into<String>) -> Self {
        Self::new(Severity::Attention, what)
    }

    pub fn error(what: impl Into<String>) -> Self {
        Self::new(Severity::Error, what)
    }

    pub fn stop(what: impl Into<String>) -> Self {
        Self::new(Severity::Stop, what)
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
    /// Whether results could not be written.
    pub is_unwritten: bool,
}

impl Problem {
    /// A problem without remedies.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), ..Self::default() }
    }

    /// Results that could not be written.
    pub fn unwritten(message: impl Into<String>) -> Self {
        Self { is_unwritten: true, ..Self::new(message) }
    }

    /// Adds a remedy.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }
}

impl From<Problem> for Notice {
    fn from(problem: Problem) -> Self {
        Self { hints: problem.hints, is_unwritten: problem.is_unwritten, ..Self::error(problem.message) }
    }
}
