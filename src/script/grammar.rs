//! The script format.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::ScriptError;
use super::expectation::Check;
use super::placeholders;
use crate::wizard::Intent;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Purpose in one line.
    pub title: String,
    /// Start of a virtual clock, in UTC, on which only measuring takes time; `None`: the system clock.
    #[serde(default)]
    pub clock: Option<String>,
    /// Steps in order.
    pub steps: Vec<ScriptStep>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ScriptStep {
    /// Send the intent and wait until it is finished. It must be possible.
    Do(Intent),
    /// Send the intent, which must fail with a message that contains the text.
    Fails(Intent, String),
    /// The intent must not be possible now, for a reason that contains the text.
    Blocked(Intent, String),
    /// The value at a path of the view must meet a condition.
    Expect(String, Check),
    /// Measure all open poses of the plan.
    CaptureAll(OnFinding),
    /// Measure this many open poses.
    Capture(usize, OnFinding),
    /// Measure all points of the circle-point analysis.
    CaptureCircles,
    /// End the program and resume the session from its journal.
    Restart,
    /// Print a line.
    Say(String),
}

/// Reaction to a finding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OnFinding {
    /// Fail the script.
    #[default]
    Fail,
    /// Keep the sample.
    Keep,
    /// Exclude the sample.
    LeaveOut,
    /// Measure again, up to three times.
    MeasureAgain,
    /// Apply the proposed correction; measure again if there is none.
    Remedy,
    /// Stop capturing and continue the script.
    Stop,
}

impl Script {
    /// Reads a script with `values` for its placeholders.
    ///
    /// # Errors
    /// A placeholder has no value, a value has no placeholder, or the text is not a script.
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
    /// The serialiser fails, which is a defect.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let layout = ron::ser::PrettyConfig::new().indentor("    ".to_owned()).compact_structs(true);
        Ok(ron::ser::to_string_pretty(self, layout)? + "\n")
    }
}
