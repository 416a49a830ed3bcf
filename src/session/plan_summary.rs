//! The numbers of a plan as they leave the program: plain data in mm and degree, the same for the text and the JSON object.

use serde::Serialize;

use super::plan::PoseKind;
use super::summary::{Provenance, Warning};
use crate::planning::{Figures, Objective, Score, Yardstick};

/// Version of the layout of these objects.
pub const SCHEMA: u32 = 1;

/// What some number of poses predicts, and what it costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TradeOffSummary {
    /// Number of identification poses.
    pub poses: usize,
    /// Predicted error per σ.
    pub predicted_error_sigma: f64,
    /// Predicted RMS position error.
    pub predicted_rms_mm: Option<f64>,
    /// Time of the whole program, at the pace of this plan.
    pub time_min: Option<f64>,
}

/// A parameter that stays weak.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeakParameterSummary {
    /// Its name.
    pub name: String,
    /// `mm` or `deg`.
    pub unit: String,
    /// Predicted standard deviation, prior not counted.
    pub predicted_sigma: f64,
    /// Expected deviation.
    pub expected: f64,
}

/// What a rule rejected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RejectionSummary {
    /// The rule.
    pub rule: String,
    /// Configurations it was against.
    pub rejected: usize,
    /// Configurations only it was against.
    pub alone: usize,
}

/// Candidates and what became of the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateSummary {
    /// Configurations tried.
    pub tried: usize,
    /// Configurations that can be measured.
    pub kept: usize,
    /// Why the others cannot.
    pub rejections: Vec<RejectionSummary>,
}

/// Time that the program takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeSummary {
    /// Whole program.
    pub total_min: f64,
    /// On the way.
    pub moving_min: f64,
    /// Standing and measuring.
    pub measuring_min: f64,
}

/// One row of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseSummary {
    /// Name.
    pub pose: String,
    /// What is done there.
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
    /// Version of this layout.
    pub schema: u32,
    /// Where the numbers come from.
    pub provenance: Provenance,
    /// Figure that the search improved; none for a plan that was only checked.
    pub objective: Option<Objective>,
    /// What must be known before the plan is used.
    pub warnings: Vec<Warning>,
    /// Number of identification poses.
    pub identification_poses: usize,
    /// Number of verification poses.
    pub verification_poses: usize,
    /// Free parameters.
    pub parameter_count: usize,
    /// Figures of merit of the identification poses.
    #[serde(flatten)]
    pub score: Score,
    /// σ of a coordinate that the prediction is for.
    pub sigma_mm: Option<f64>,
    /// Predicted RMS position error of the identified robot over its joint ranges, from the instrument alone.
    pub predicted_rms_mm: Option<f64>,
    /// RMS position error that the verification poses of the plan will show, tracker noise included.
    pub predicted_verification_rms_mm: Option<f64>,
    /// Random sets of the same size.
    pub random: Yardstick,
    /// D-efficiency against the upper bound for these candidates, 0 … 1.
    pub d_efficiency: f64,
    /// How far the bound may lie above the true optimum, relative.
    pub d_bound_gap: f64,
    /// Progress of the search, sweep by sweep; empty for a plan that was only checked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub search: Vec<Figures>,
    /// Prediction against number of poses.
    pub trade_off: Vec<TradeOffSummary>,
    /// Parameters that stay weak.
    pub weak_parameters: Vec<WeakParameterSummary>,
    /// Blind directions in words.
    pub blind_groups: Vec<String>,
    /// Candidates.
    pub candidates: CandidateSummary,
    /// Time of the program; none for a plan that was only checked.
    pub time: Option<TimeSummary>,
    /// The rows of the plan in order.
    pub poses: Vec<PoseSummary>,
    /// Time that planning took.
    pub elapsed_s: f64,
    /// Whether the search was cut short.
    pub interrupted: bool,
    /// Files written.
    pub written: Vec<String>,
}
