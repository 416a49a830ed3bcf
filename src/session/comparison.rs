//! The comparison of calibrations as it leaves the program, in mm, deg and µrad.

use serde::{Deserialize, Serialize};

use super::summary::Warning;
use crate::kinematics::{ParameterId, ParameterUnit};

/// Version of the layout.
pub const SCHEMA: u32 = 1;

/// A comparison of two or more calibrations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonSummary {
    pub schema: u32,
    pub program: String,
    pub created: String,
    pub robot: String,
    pub profile: String,
    pub warnings: Vec<Warning>,
    /// In the order in which they were named.
    pub calibrations: Vec<CalibrationPart>,
    /// Each calibration with the one before it, and the last with the first where there are more than two.
    pub pairs: Vec<PairSummary>,
}

/// One of the calibrations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationPart {
    pub file: String,
    pub created: String,
    /// Different poses that it was identified from.
    pub poses: usize,
    pub sigma_mm: f64,
    /// Position error (rms over the workspace) that it leaves open.
    pub open_mm: f64,
}

/// The difference between two calibrations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSummary {
    /// Indices of the earlier and of the later one.
    pub from: usize,
    pub to: usize,
    /// Distance between the positions of both arms over the workspace, once their bases (and tools, if the SMR was mounted again) are
    /// brought together.
    pub rms_mm: f64,
    pub p95_mm: f64,
    pub max_mm: f64,
    /// Distance (rms) that two calibrations of one unchanged arm would show.
    pub sigma_mm: f64,
    /// How many standard deviations the difference is larger than chance.
    pub excess: f64,
    pub has_changed: bool,
    /// The fewest changes that explain the difference; none if nothing has changed.
    pub causes: Vec<CauseSummary>,
    /// Whether they explain all of it.
    pub is_explained: bool,
    /// Parameters that differ by more than three standard deviations.
    pub parameters: Vec<DifferenceSummary>,
    /// The curves of the joints, where both calibrations have them.
    pub curves: Vec<CurveDifference>,
}

/// A change that explains a difference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CauseSummary {
    /// The parameter; several if they explain it equally well.
    pub parameters: Vec<ParameterId>,
    /// What the first of them is, in words.
    pub meaning: String,
    pub unit: ParameterUnit,
    /// Change of the first of them.
    pub change: f64,
    pub sigma: f64,
}

/// A parameter that differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DifferenceSummary {
    pub parameter: ParameterId,
    pub unit: ParameterUnit,
    pub difference: f64,
    pub sigma: f64,
    pub ratio: f64,
}

/// How far two curves of a joint are apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveDifference {
    pub joint: String,
    /// Root mean square over the common range, without a constant.
    pub rms_urad: f64,
    /// Root mean square in standard deviations.
    pub ratio: f64,
    /// Both curves: value of the joint (deg), error and its standard deviation (µrad).
    pub before: Vec<(f64, f64, f64)>,
    pub after: Vec<(f64, f64, f64)>,
}
