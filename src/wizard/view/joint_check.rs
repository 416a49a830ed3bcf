//! The view of the joint check.

use serde::Serialize;

use super::JointShown;

/// The joint check: each joint is moved by a few degrees.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointCheckView {
    /// Joint that is moved to get to the next point; `None` at the first one, and when all are measured.
    pub joint: Option<String>,
    /// Configuration to go to; empty when all points are measured.
    pub joints: Vec<JointShown>,
    /// Number of points measured.
    pub measured: usize,
    /// Number of points to measure.
    pub of: usize,
    /// The result, when all points are measured.
    pub verdict: Option<JointCheckVerdict>,
    /// Reason why there is no result.
    pub problem: Option<String>,
    /// Unit of the coordinates, if they are typed.
    pub typed_unit: Option<String>,
}

/// Result of the joint check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointCheckVerdict {
    /// Faults, one sentence each; none if the robot moves as the profile says.
    pub faults: Vec<String>,
    pub joints: Vec<JointCheckRow>,
    /// Position of the SMR in the flange, as the check sees it.
    pub smr_mm: [f64; 3],
    /// Its standard deviation.
    pub smr_sigma_mm: [f64; 3],
    /// Root mean square distance of the points from where the arm should have them.
    pub rms_mm: f64,
}

/// A joint in the joint check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointCheckRow {
    pub name: String,
    /// `deg` or `mm`.
    pub unit: String,
    /// Movement that was asked for.
    pub asked: f64,
    /// Movement that was seen, and its standard deviation; `None` if the SMR does not show it.
    pub seen: Option<(f64, f64)>,
    /// Error of the zero and its standard deviation; `None` if distances cannot show it.
    pub zero: Option<(f64, f64)>,
    /// Whether nothing is wrong with it.
    pub is_right: bool,
}
