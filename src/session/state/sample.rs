//! Samples of a session, and where the arm stopped.

use std::fmt;

use jiff::Timestamp;

use crate::session::journal::MeasuredText;

/// Whether a sample counts, and why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleState {
    Counts,
    /// Replaced by a later measurement of the same row.
    Superseded,
    /// The operator excluded it.
    LeftOut,
    /// It was taken by mistake.
    Undone,
}

impl fmt::Display for SampleState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Counts => "counts",
            Self::Superseded => "remeasured",
            Self::LeftOut => "excluded",
            Self::Undone => "undone",
        })
    }
}

/// A stop of the arm.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// Where this measurement was taken.
    Sample(u64),
    /// A configuration that the operator has driven through.
    Passed {
        pose: String,
        /// Pendant values (rad, m).
        configuration: Vec<f64>,
    },
}

/// A measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The record in the journal.
    pub noted: MeasuredText,
    pub time: Timestamp,
    /// Row of the plan that it belongs to now.
    pub row: usize,
    /// Configuration of the robot, pendant values at the edge (deg, mm).
    pub joints: Vec<f64>,
    /// State of the row.
    pub state: SampleState,
    /// Whether the operator kept it in spite of a finding.
    pub kept: bool,
    /// Number of the last measurement when it was corrected: findings up to then are settled. 0: never.
    pub settled: u64,
}
