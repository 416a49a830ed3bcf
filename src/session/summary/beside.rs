//! What an identification can have beside the parameters: fixed things that were found along, and an earlier calibration that it began
//! with.

use serde::{Deserialize, Serialize};

use crate::identification::Shape;
use crate::kinematics::{ParameterId, ParameterUnit};
use crate::text::{counted, decimals_for, fixed, listed};

/// A feature of unknown place, found along with the arm, in the base of the identified arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureSummary {
    pub name: String,
    pub shape: Shape,
    /// Contacts with it, rejected ones included.
    pub contacts: usize,
    /// The point, the middle of a circle, or a point of the plane or line.
    pub at_mm: [f64; 3],
    /// Standard deviation of the point (root of the sum of the squares of the three coordinates).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_mm: Option<f64>,
    /// Normal of a plane or circle, direction of a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// Radius of a circle or sphere, or what a wire reads less than its length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_mm: Option<f64>,
}

/// The earlier calibration that an identification began with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarlierSummary {
    /// When it was made.
    pub created: String,
    /// Different poses that it was identified from, with those of its own beginning.
    pub poses: usize,
    /// Part of the information about positions over the workspace that is not from the new points.
    pub weight_percent: Option<f64>,
    /// Zeros of joints that have moved since.
    pub moved: Vec<MovedSummary>,
    /// How far lengths and angles may have drifted, one standard deviation.
    pub drift_length_mm: f64,
    pub drift_angle_deg: f64,
}

/// The zero of a joint that has moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovedSummary {
    pub parameter: ParameterId,
    pub joint: String,
    pub unit: ParameterUnit,
    pub by: f64,
    pub sigma: f64,
}

impl EarlierSummary {
    /// What the identification began with, in words.
    pub fn sentence(&self) -> String {
        let weight = self.weight_percent.map_or_else(String::new, |percent| {
            format!(", which carry {percent:.0} % of the weight over the workspace")
        });
        let moved: Vec<String> = self
            .moved
            .iter()
            .map(|moved| {
                let decimals = decimals_for(moved.sigma);
                let (by, sigma) = (fixed(moved.by, decimals), fixed(moved.sigma, decimals));
                format!("{} by {by} {} ± {sigma}", moved.joint, moved.unit)
            })
            .collect();
        let zeros = if moved.is_empty() {
            "No zero of a joint has moved".to_owned()
        } else {
            format!("Zeros that have moved and were found again: {}", listed(&moved))
        };
        format!(
            "Begun with the calibration of {} ({}{weight}). {zeros}; every other length may have drifted by {} mm and every angle by {} deg",
            self.created,
            counted(self.poses, "pose"),
            self.drift_length_mm,
            self.drift_angle_deg
        )
    }
}
