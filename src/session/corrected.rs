//! Robot programs that were corrected with the result of a session.

use serde::{Deserialize, Serialize};

use crate::text::{counted, decimal, names, written_as_text};

/// A robot program to correct, and what only its user knows about it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ProgramChoice {
    /// Path of the program.
    pub file: String,
    /// Name of its language; empty: as the ending of the file says.
    pub dialect: String,
    pub points: Points,
    /// Tool of the targets in the flange, for what the program does not state: `[NAME=]X,Y,Z,RX,RY,RZ`, several with semicolons.
    pub tool: String,
    /// Frame of the targets in the world of the controller, in the same form.
    pub frame: String,
    /// Files that belong to it, with semicolons between them.
    pub companions: String,
}

/// Where the points of a program come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Points {
    #[default]
    NotStated,
    /// By an offline programming system, from CAD or by calculation.
    Computed,
    /// On the robot, with its pendant or by hand.
    Taught,
}

names!(Points { NotStated = "not stated", Computed = "computed", Taught = "taught", });
written_as_text!(Points);

/// A program that was corrected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CorrectedText {
    /// The program as it was given.
    pub source: String,
    /// The corrected one in the session's folder.
    pub file: String,
    /// Number of targets that were corrected.
    pub corrected: usize,
    /// Number of motion targets that stay as they are.
    pub left: usize,
    /// What stays and why, line by line; the first ones if there are many.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<String>,
    /// Largest move of a target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_mm: Option<f64>,
    /// Largest predicted error of the identified arm at the targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty_mm: Option<f64>,
    /// Largest deviation of the path between the targets of linear and circular moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path_mm: Option<f64>,
}

impl CorrectedText {
    /// What was done, in one line.
    pub fn line(&self) -> String {
        let mut parts = vec![format!("{} corrected, {} left", counted(self.corrected, "target"), self.left)];
        parts.extend(self.largest_mm.map(|moved| format!("moved by {} mm at most", decimal(moved, 3))));
        parts.extend(
            self.uncertainty_mm.map(|known| format!("the arm is known there within +-{} mm", decimal(known, 3))),
        );
        parts.extend(
            self.path_mm.map(|off| format!("the path between them deviates by {} mm at most", decimal(off, 3))),
        );
        format!("{}: {}", self.file, parts.join("; "))
    }
}
