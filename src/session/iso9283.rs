//! The figures of a test after ISO 9283 as they leave the program, in mm.

use serde::Serialize;

use super::summary::Provenance;

/// Version of the layout.
pub const SCHEMA: u32 = 1;

/// The result of a test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TestSummary {
    pub schema: u32,
    pub provenance: Provenance,
    /// What the flange carried, in the words of the operator.
    pub load: Option<String>,
    /// The speed of the test, likewise.
    pub speed: Option<String>,
    /// Where the frame of the instrument comes from.
    pub frame: FrameSource,
    /// Accuracy and repeatability of each pose.
    pub poses: Vec<PoseRow>,
    /// Accuracy and repeatability of each distance.
    pub distances: Vec<DistanceRow>,
    /// Variation of each pose with the direction of approach.
    pub directions: Vec<DirectionRow>,
    /// Change of the accuracy of P1 over the cycles (mm), where there are enough of them.
    pub drift_mm: Option<f64>,
    /// What differs from the procedure of the standard.
    pub deviations: Vec<String>,
}

/// Where the frame of the instrument in the base comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameSource {
    /// Fitted to the barycentres of these same poses: pose accuracies are then smaller than in the robot's own base.
    Fitted,
    /// As found by the calibration; the instrument has not moved since.
    Calibration,
}

/// A figure with its 95 % interval (mm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EstimateMm {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// Accuracy against one arm (mm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AccuracyMm {
    #[serde(flatten)]
    pub accuracy: EstimateMm,
    /// Components in the base, attained less commanded.
    pub xyz: [f64; 3],
}

/// One pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseRow {
    /// `P1` to `P5`.
    pub pose: String,
    pub cycles: usize,
    /// Pose accuracy of the arm as it is: its nominal model says where it was sent.
    pub nominal_mm: AccuracyMm,
    /// What is left where commands are corrected with the identified arm.
    pub identified_mm: Option<AccuracyMm>,
    /// Pose repeatability; the same for both.
    pub repeatability_mm: EstimateMm,
}

/// One distance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DistanceRow {
    pub from: String,
    pub to: String,
    pub cycles: usize,
    /// Commanded distance, by the nominal arm.
    pub commanded_mm: f64,
    pub nominal_mm: AccuracyMm,
    pub identified_mm: Option<AccuracyMm>,
    /// Distance repeatability, to both sides.
    pub repeatability_mm: EstimateMm,
}

/// Multi-directional accuracy variation of one pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DirectionRow {
    pub pose: String,
    pub directions: usize,
    /// Largest distance between the barycentres of two directions.
    pub variation_mm: f64,
}
