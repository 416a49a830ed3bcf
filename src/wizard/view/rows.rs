//! Rows of the plan in the capture step, and points that are shown before they are taken.

use serde::Serialize;

use crate::session::plan::PoseKind;

/// A sample in short.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleView {
    /// Number of the measurement.
    pub measurement: u64,
    /// Name of its pose.
    pub pose: String,
    /// Measured point in the tracker frame, corrections applied.
    pub xyz_mm: [f64; 3],
    /// Scatter of the shots.
    pub scatter_mm: Option<f64>,
    /// Whether the sample counts.
    pub counts: bool,
}

/// A row of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowView {
    /// Row of the plan, from 0.
    pub row: usize,
    /// Name of the pose; `again` marks one that is measured again to see drift.
    pub pose: String,
    pub kind: PoseKind,
    /// State of the row.
    pub state: RowState,
    /// Pendant joint values of the plan (deg, mm).
    pub joints: Vec<f64>,
    /// The sample that counts or is excluded, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredRow>,
    /// Notes about the pose.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// Where the instrument will see the SMR.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExpectedView {
    /// Place in the tracker frame, from the nominal arm.
    pub xyz_mm: [f64; 3],
    /// How far the samples so far are from such places (RMS).
    pub spread_mm: f64,
}

/// What is known about the sample of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredRow {
    /// Distance from where the identified arm has it, or the nominal one (see [`super::CaptureView::fit_is_nominal`]).
    pub fit_mm: Option<f64>,
    pub shots: u32,
    /// Time of day (UTC), `09:15`.
    pub time: String,
    /// The sample itself.
    #[serde(flatten)]
    pub sample: SampleView,
    /// Findings about it, resolved ones included.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<String>,
    /// Number of earlier measurements of the pose.
    pub earlier: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RowState {
    /// Still to be measured.
    Open,
    /// Measured, and the sample counts.
    Measured,
    /// Measured, but the sample is excluded.
    LeftOut,
    /// Skipped by the operator.
    Skipped,
}

impl RowState {
    /// The state in a word.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Measured => "done",
            Self::LeftOut => "excluded",
            Self::Skipped => "skipped",
        }
    }
}

/// Points that are shown before they are taken.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProposedView {
    /// Where they come from, in words.
    pub source: String,
    pub points: Vec<ProposedPointView>,
}

/// A point with what the checks say about it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProposedPointView {
    /// Name that the point has where it comes from.
    pub name: Option<String>,
    /// Pose of the plan that it belongs to.
    pub pose: Option<String>,
    pub xyz_mm: [f64; 3],
    pub state: ProposedState,
    /// What the checks say, if it does not simply fit.
    pub message: Option<String>,
}

/// Result of the checks of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ProposedState {
    /// It fits all points so far, or nothing can be said yet.
    Fits,
    /// It does not fit.
    InQuestion,
    /// It is no measurement, or belongs to no pose.
    Impossible,
}

impl ProposedState {
    /// The state in a word or two.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Fits => "fits",
            Self::InQuestion => "in question",
            Self::Impossible => "not taken",
        }
    }
}
