//! The result of a health check as it leaves the program, in mm and deg.

use serde::{Deserialize, Serialize};

use super::summary::{Provenance, Warning};

/// Version of the layout.
pub const SCHEMA: u32 = 1;

/// What a health check says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum HealthVerdict {
    /// Nothing has changed by more than what matters.
    StillValid,
    /// The zero of one joint explains everything.
    ZeroMoved {
        joint: String,
        /// How far (the unit is that of the joint: deg or mm).
        by: f64,
        sigma: f64,
        unit: String,
    },
    /// Something has changed that one zero does not explain.
    Changed {
        /// Joints whose zeros explain it equally well; none if none does.
        candidates: Vec<String>,
    },
    /// One pose contradicts all others: it should be measured again.
    MeasureAgain { pose: String },
    /// Too few poses, or too noisy ones.
    Undecided { reason: String },
}

impl HealthVerdict {
    /// Whether it ends the check.
    pub const fn is_final(&self) -> bool {
        match self {
            Self::StillValid | Self::ZeroMoved { .. } | Self::Changed { .. } => true,
            Self::MeasureAgain { .. } | Self::Undecided { .. } => false,
        }
    }
}

/// The zero of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ZeroSummary {
    pub joint: String,
    /// Unit of the numbers: deg or mm.
    pub unit: String,
    /// Change that explains the points best if nothing else has changed.
    pub moved: f64,
    pub sigma: f64,
    /// Size in standard deviations.
    pub ratio: f64,
    /// Whether these poses can show it.
    pub is_visible: bool,
}

/// The verdict after some of the poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HealthStep {
    pub poses: usize,
    #[serde(flatten)]
    pub verdict: HealthVerdict,
}

/// A health check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HealthSummary {
    pub schema: u32,
    pub provenance: Provenance,
    pub warnings: Vec<Warning>,
    /// When the calibration was made.
    pub calibrated: String,
    pub verdict: HealthVerdict,
    pub poses: usize,
    /// Poses after which the verdict was final for the first time, if before the last.
    pub decided_after: Option<usize>,
    /// Limit of the position error (mm), if there is one.
    pub limit_mm: Option<f64>,
    /// Position error (rms) that the calibrated arm shows at the poses, place of tracker and SMR fitted.
    pub error_mm: f64,
    /// Position error (rms over the workspace) of zeros that may have changed as far as these poses can tell.
    pub hidden_mm: Option<f64>,
    /// How many standard deviations the residuals are larger than at the calibration.
    pub excess: f64,
    pub zeros: Vec<ZeroSummary>,
    /// The verdict pose by pose.
    pub steps: Vec<HealthStep>,
}

/// What a check with some poses will be able to see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForecastSummary {
    pub joint: String,
    /// deg or mm.
    pub unit: String,
    /// Standard deviation of a change of its zero; none if the poses cannot show it.
    pub sigma: Option<f64>,
    /// Smallest change that is found in nine of ten checks.
    pub found: Option<f64>,
}
