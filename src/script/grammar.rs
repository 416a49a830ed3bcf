//! What stands in a script.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::expectation::Check;
use super::placeholders;
use crate::wizard::Intent;

/// A script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// What it is for, in one line.
    pub title: String,
    /// Begin of a virtual clock, in UTC, on which only measuring takes time; none: the clock of the system.
    #[serde(default)]
    pub clock: Option<String>,
    /// What is done, in order.
    pub steps: Vec<ScriptStep>,
}

/// A step of a script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ScriptStep {
    /// Do this, and wait until nothing is under way. It must be possible.
    Do(Intent),
    /// Do this, which must fail with a message that contains the text.
    Fails(Intent, String),
    /// This must not be possible now; the reason contains the text.
    Blocked(Intent, String),
    /// Something on the screen, by its path in the view, must be so.
    Expect(String, Check),
    /// Measure all poses of the plan that wait.
    CaptureAll(OnFinding),
    /// Measure so many poses.
    Capture(usize, OnFinding),
    /// Measure all points of the circle-point analysis.
    CaptureCircles,
    /// End the program and resume the session from its journal.
    Restart,
    /// Print a line.
    Say(String),
}

/// What to do when a check finds something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OnFinding {
    /// The script fails.
    #[default]
    Fail,
    /// Keep the sample.
    Keep,
    /// Leave the sample out.
    LeaveOut,
    /// Measure again, up to three times.
    MeasureAgain,
    /// Correct what can be corrected as proposed; measure again what cannot.
    Remedy,
    /// Stop capturing and go on with the script.
    Stop,
}

/// A script that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScriptError {
    /// Not RON, or not a script.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// A placeholder without value.
    #[error("the script needs a value for '{name}': give it with '--set {name}=…'")]
    MissingValue {
        /// Its name.
        name: String,
    },
    /// A value that no placeholder asks for.
    #[error("the script has no placeholder '{name}'; it knows: {known}")]
    UnknownValue {
        /// The name that was given.
        name: String,
        /// The names it has.
        known: String,
    },
    /// A placeholder that is not closed.
    #[error("line {line}: '${{' without '}}'")]
    OpenPlaceholder {
        /// Line, from 1.
        line: usize,
    },
    /// A clock that is no time.
    #[error("'{text}' is not a time; write for example '2026-01-01T08:00:00Z'")]
    Clock {
        /// What stands there.
        text: String,
    },
}

impl Script {
    /// Reads a script with `values` for its placeholders.
    ///
    /// # Errors
    /// A placeholder without value, a value without placeholder, or not a script.
    pub fn parse(text: &str, values: &BTreeMap<String, String>) -> Result<Self, ScriptError> {
        let text = placeholders::fill(text, values)?;
        let script: Self = ron::from_str(&text).map_err(|error| ScriptError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            message: error.code.to_string(),
        })?;
        if let Some(clock) = &script.clock
            && clock.parse::<jiff::Timestamp>().is_err()
        {
            return Err(ScriptError::Clock { text: clock.clone() });
        }
        Ok(script)
    }

    /// The text of a script.
    ///
    /// # Errors
    /// The serialiser refuses; this is a defect.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let layout = ron::ser::PrettyConfig::new().indentor("    ".to_owned()).compact_structs(true);
        Ok(ron::ser::to_string_pretty(self, layout)? + "\n")
    }
}
