//! A whole arm from circles: the result beside the data sheet, and the profile that is made of it.

use nalgebra::Point3;

use crate::identification::circle_point::{MeasuredArm, MeasuredConstant};
use crate::kinematics::{LinkParameter, ParameterId};
use crate::model::{Heading, complete};
use crate::profile::{Profile, Target};
use crate::units::{MILLIMETRE, Quantity};

/// Differences from the data sheet beyond these are no assembly errors (mm), (degree).
pub const ASTONISHING: (f64, f64) = (5.0, 0.5);
/// Zeros of joints are set less exactly (degree).
pub const ASTONISHING_ZERO_DEG: f64 = 2.0;

/// A measured constant in edge units (mm, degree).
#[derive(Clone, Debug, PartialEq)]
pub struct ConstantRow {
    pub name: String,
    pub unit: &'static str,
    pub measured: f64,
    pub sigma: f64,
    /// That of the data sheet, if there is one.
    pub nominal: Option<f64>,
    /// Whether the difference is too large for an assembly error.
    pub is_astonishing: bool,
}

impl ConstantRow {
    /// Measured less nominal.
    pub fn difference(&self) -> Option<f64> {
        self.nominal.map(|nominal| self.measured - nominal)
    }
}

/// All constants that the circles give.
pub fn constants(arm: &MeasuredArm) -> Vec<ConstantRow> {
    arm.constants.iter().filter_map(row).collect()
}

fn row(constant: &MeasuredConstant) -> Option<ConstantRow> {
    let ParameterId::Link { parameter, .. } = constant.id else { return None };
    let quantity = parameter.quantity();
    let edge = |value: f64| quantity.to_edge(value);
    let limit = match (quantity, parameter) {
        (Quantity::Length, _) => ASTONISHING.0,
        (Quantity::Angle, LinkParameter::Theta) => ASTONISHING_ZERO_DEG,
        (Quantity::Angle, _) => ASTONISHING.1,
    };
    let is_off = |nominal: f64| edge(constant.value - nominal).abs() > limit;
    Some(ConstantRow {
        name: constant.id.to_string(),
        unit: quantity.unit(),
        measured: edge(constant.value),
        sigma: edge(constant.sigma),
        nominal: constant.nominal.map(edge),
        is_astonishing: constant.nominal.is_some_and(is_off),
    })
}

/// The text of a profile with the measured constants, SMR and place of the tracker. `origin` says where the points come from.
pub fn profile_text(profile: &Profile, arm: &MeasuredArm, name: Option<&str>, origin: &str) -> String {
    let first = profile.targets().first().cloned().unwrap_or_else(|| Target::beside_the_flange("smr"));
    let target = Target {
        position_in_flange: arm.point_in_flange,
        // Relative to the last axis. The flange itself is not seen.
        uncertainty: arm.point_sigma.max().max(MILLIMETRE),
        ..first
    };
    let tracker = arm.base_from_tracker * Point3::origin();
    let placed = profile.with_tracker_at(tracker).with_target(0, target);
    let targets = placed.targets().to_vec();
    let comments = [
        "Link constants from circles: each joint was moved in turn, and the axes of the circles give the constants."
            .to_owned(),
        "Not measured: d and theta of the first link, all constants of the last one, and d between parallel axes."
            .to_owned(),
    ];
    let heading = Heading {
        comments: &comments,
        name: name.unwrap_or_else(|| profile.name()),
        title: name.unwrap_or_else(|| profile.title()),
        source: &format!("{}, link constants measured with circles ({origin})", profile.source()),
    };
    complete(&heading, &placed, &arm.chain, &targets)
}
