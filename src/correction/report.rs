//! What happened to each target: for people, and as JSON.

use std::fmt;

use nalgebra::Isometry3;
use serde::Serialize;

use crate::text::{counted, decimal, printable};
use crate::units::{to_deg, to_mm};

/// A target and its correction.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TargetReport {
    pub line: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub status: &'static str,
    /// Why it is not corrected, or only in part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The tool or the frame that nobody states.
    #[serde(skip)]
    pub missing: Option<Missing>,
    #[serde(flatten)]
    pub moved: Option<Moved>,
    /// Predicted error of the identified arm there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty_mm: Option<f64>,
}

/// A tool or a frame that neither the program nor its user states.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// `tool` or `frame`.
    pub kind: &'static str,
    /// Name in the program; empty if it has none.
    pub name: String,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, name } = self;
        if name.is_empty() {
            write!(f, "its {kind} is not stated")
        } else {
            write!(f, "its {kind} '{}' is not in the given files", printable(name))
        }
    }
}

/// By how much a command differs from its target: the tool of the nominal arm, from one to the other.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Moved {
    pub moved_mm: f64,
    pub moved_deg: f64,
}

impl Moved {
    pub fn between(meant: &Isometry3<f64>, commanded: &Isometry3<f64>) -> Self {
        Self {
            moved_mm: to_mm((commanded.translation.vector - meant.translation.vector).norm()),
            moved_deg: to_deg(commanded.rotation.angle_to(&meant.rotation)),
        }
    }
}

/// The result of a table or a program.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    pub targets: Vec<TargetReport>,
    pub corrected: usize,
    pub left: usize,
    /// Moves between corrected targets, with the largest deviation of the path.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub paths: Vec<PathReport>,
    /// That the calibration was changed after it was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edited: Option<String>,
    /// Files that were written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub written: Vec<String>,
    /// Copies of programs in which nothing was corrected.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unchanged: Vec<String>,
}

/// A linear or circular move between corrected targets.
#[derive(Clone, Debug, Serialize)]
pub struct PathReport {
    pub line: usize,
    /// Largest distance of the tool from where the nominal arm would have had it, with the targets corrected and without.
    pub corrected_mm: f64,
    pub uncorrected_mm: f64,
    /// Points that were put into it.
    #[serde(skip_serializing_if = "is_zero")]
    pub inserted: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
const fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Report {
    /// The largest and the mean move, the largest predicted error and the worst path, in one line each.
    pub fn lines(&self) -> Vec<String> {
        let moved: Vec<&Moved> = self.targets.iter().filter_map(|target| target.moved.as_ref()).collect();
        let mut lines = Vec::new();
        if !moved.is_empty() {
            let mean = moved.iter().map(|moved| moved.moved_mm).sum::<f64>() / moved.len() as f64;
            let largest = moved.iter().map(|moved| moved.moved_mm).fold(0.0, f64::max);
            let turned = moved.iter().map(|moved| moved.moved_deg).fold(0.0, f64::max);
            lines.push(format!(
                "targets moved by {} mm on average, {} mm and {} deg at most",
                decimal(mean, 3),
                decimal(largest, 3),
                decimal(turned, 3)
            ));
        }
        let uncertainties = self.targets.iter().filter_map(|target| target.uncertainty_mm);
        if let Some(largest) = uncertainties.max_by(f64::total_cmp) {
            lines.push(format!(
                "the arm is known within +-{} mm at these targets (predicted, rms)",
                decimal(largest, 3)
            ));
        }
        let inserted: usize = self.paths.iter().map(|path| path.inserted).sum();
        if inserted > 0 {
            let moves = self.paths.iter().filter(|path| path.inserted > 0).count();
            lines.push(format!("{} inserted into {}", counted(inserted, "point"), counted(moves, "linear move")));
        }
        if let Some(worst) = self.paths.iter().max_by(|a, b| a.corrected_mm.total_cmp(&b.corrected_mm)) {
            lines.push(format!(
                "between the targets of linear and circular moves the path deviates by {} mm at most (line {}; {} mm without compensation)",
                decimal(worst.corrected_mm, 3),
                worst.line,
                decimal(worst.uncorrected_mm, 3)
            ));
        }
        lines
    }
}
