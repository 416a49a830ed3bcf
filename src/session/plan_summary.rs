//! The numbers of a plan as they leave the program: plain data in mm and degree, the same for the text and the JSON object.

use serde::Serialize;

use super::plan::PoseKind;
use super::summary::{Provenance, Warning};
use crate::planning::{Figures, Objective, Score, Yardstick};

/// Version of the layout of these objects.
pub const SCHEMA: u32 = 1;

/// Prediction and time for a number of poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TradeOffSummary {
    pub poses: usize,
    /// Predicted error per σ.
    pub predicted_error_sigma: f64,
    pub predicted_rms_mm: Option<f64>,
    /// RMS position error where errors of the joints are identified beside the geometry.
    pub predicted_level3_rms_mm: Option<f64>,
    /// Time of the whole program, at the pace of this plan.
    pub time_min: Option<f64>,
}

/// The largest gap between neighbouring values of a joint that the identification poses visit, the ends of its range included.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointGapSummary {
    pub joint: String,
    /// `mm` or `deg`.
    pub unit: String,
    pub largest_gap: f64,
    /// Where it begins and ends. A gap through the end of a full turn ends beyond it.
    pub from: f64,
    pub to: f64,
    /// The gap between evenly spread values.
    pub even_gap: f64,
}

/// A parameter that stays weak.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeakParameterSummary {
    pub name: String,
    /// `mm` or `deg`.
    pub unit: String,
    /// Predicted standard deviation, prior not counted.
    pub predicted_sigma: f64,
    pub expected: f64,
}

/// Configurations that a rule rejected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RejectionSummary {
    pub rule: String,
    /// Configurations that it rejected.
    pub rejected: usize,
    /// Configurations that no other rule rejected.
    pub alone: usize,
}

/// Candidates, and how many configurations each rule rejected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateSummary {
    /// Configurations tried.
    pub tried: usize,
    /// Configurations that can be measured.
    pub kept: usize,
    /// Rules that rejected the others.
    pub rejections: Vec<RejectionSummary>,
}

/// Time that the program takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeSummary {
    /// Time of the whole program.
    pub total_min: f64,
    /// Time of motion.
    pub moving_min: f64,
    /// Time of settling and measuring.
    pub measuring_min: f64,
}

/// One row of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseSummary {
    pub pose: String,
    pub kind: PoseKind,
    /// Pendant joint values: degree, sliding joints mm.
    pub configuration: Vec<f64>,
    /// Predicted place of the reflector in the base.
    pub point_in_base_mm: Option<[f64; 3]>,
    /// Why it cannot be measured; empty for a good pose. Only filled when a plan is checked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub problems: Vec<String>,
}

/// Everything about a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanSummary {
    pub schema: u32,
    /// Origin of the numbers.
    pub provenance: Provenance,
    /// Figure that the search improved; none for a plan that was only checked.
    pub objective: Option<Objective>,
    /// Warnings to read before the plan is used.
    pub warnings: Vec<Warning>,
    pub identification_poses: usize,
    pub verification_poses: usize,
    pub parameter_count: usize,
    /// Figures of merit of the identification poses.
    #[serde(flatten)]
    pub score: Score,
    /// σ of a coordinate that the prediction is for.
    pub sigma_mm: Option<f64>,
    /// Predicted RMS position error of the identified robot over its joint ranges, from the instrument alone.
    pub predicted_rms_mm: Option<f64>,
    /// The same where errors of the joints (curves, compliance, tilt) are identified beside the geometry, from the instrument and the
    /// repeatability of the arm.
    pub predicted_level3_rms_mm: Option<f64>,
    /// RMS position error that the verification poses of the plan will show, tracker noise included.
    pub predicted_verification_rms_mm: Option<f64>,
    /// Random sets of the same size.
    pub random: Yardstick,
    /// D-efficiency against the upper bound for these candidates, 0 … 1.
    pub d_efficiency: f64,
    /// Largest distance of the bound from the true optimum, relative.
    pub d_bound_gap: f64,
    /// Progress of the search, sweep by sweep; empty for a plan that was only checked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub search: Vec<Figures>,
    /// Prediction against number of poses.
    pub trade_off: Vec<TradeOffSummary>,
    /// The largest gap of every joint.
    pub joint_gaps: Vec<JointGapSummary>,
    pub weak_parameters: Vec<WeakParameterSummary>,
    /// Blind directions in words.
    pub blind_groups: Vec<String>,
    pub candidates: CandidateSummary,
    /// Time of the program; none for a plan that was only checked.
    pub time: Option<TimeSummary>,
    pub poses: Vec<PoseSummary>,
    pub elapsed_s: f64,
    /// Whether the search was cut short.
    pub interrupted: bool,
    pub written: Vec<String>,
}
