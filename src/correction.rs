//! Applies a calibration to targets and robot programs: what to command so that the real arm goes where the nominal one would be.
//!
//! The same for commands and wizard. Texts in, texts out: no files.

mod between;
pub mod program;
pub mod report;
pub mod settings;
pub mod targets;
mod uncertainty;

use nalgebra::{Isometry3, Translation3};

use crate::compensation::{Compensated, Compensator, Settings, Status, ToolArm};
use crate::kinematics::{Arm, Joint};
use crate::model::CalibratedArm;
use crate::profile::Profile;
use crate::session::calibration::Calibration;
use crate::text::listed;
use crate::units::{MILLIMETRE, to_deg, to_mm};
use uncertainty::Uncertainty;

/// Predicted error of the identified arm beyond which nothing is corrected, unless something else is stated (m).
pub const LARGEST_UNCERTAINTY: f64 = 2.0 * MILLIMETRE;

/// A calibrated arm, ready to correct.
#[derive(Debug)]
pub struct Corrector<'a> {
    pub arm: &'a CalibratedArm,
    pub compensator: Compensator<'a>,
    /// The point to bring to the targets, in the flange of the nominal and of the identified arm.
    pub tools: [Isometry3<f64>; 2],
    /// None where the calibration has no samples that tell it.
    uncertainty: Option<Uncertainty>,
    /// Beyond it nothing is corrected (m).
    largest_uncertainty: f64,
    pub position_only: bool,
}

impl<'a> Corrector<'a> {
    /// A corrector for the point at `tools` in the flange of the `nominal` and of the identified arm.
    pub fn new(
        calibration: &Calibration,
        arm: &'a CalibratedArm,
        [nominal, identified]: [&'a ToolArm; 2],
        largest_uncertainty: f64,
        position_only: bool,
    ) -> Self {
        let limits: Vec<_> = arm.profile.joints().iter().map(|range| range.limits).collect();
        let settings = Settings { position_only, ..Settings::default() };
        Self {
            arm,
            compensator: Compensator::new(nominal, identified, &limits, settings),
            tools: [nominal.flange_from_tool, identified.flange_from_tool],
            uncertainty: Uncertainty::new(calibration, arm),
            largest_uncertainty,
            position_only,
        }
    }

    pub fn joints(&self) -> &[Joint] {
        self.arm.identified.chain.joints()
    }

    /// The world of the controller, in which programs state their frames, in the base of the profile.
    pub const fn base_from_world(&self) -> &Isometry3<f64> {
        self.arm.profile.base_from_world()
    }

    /// The predicted error at a configuration (m).
    pub fn uncertainty(&self, q: &[f64], flange_from_tool: &Isometry3<f64>) -> Option<f64> {
        Some(self.uncertainty.as_ref()?.at(q, flange_from_tool))
    }

    /// The reason not to correct at a place that the calibration does not know well enough.
    pub fn too_uncertain(&self, uncertainty: Option<f64>) -> Option<String> {
        let uncertainty = uncertainty.filter(|uncertainty| *uncertainty > self.largest_uncertainty)?;
        Some(format!(
            "the arm is known there only within +-{:.2} mm (predicted), above the limit of {:.2} mm",
            to_mm(uncertainty),
            to_mm(self.largest_uncertainty)
        ))
    }
}

/// The nominal and the identified arm with the point to bring to the targets: the flange, or a target of the profile by its index.
pub fn tool_arms(arm: &CalibratedArm, target: Option<usize>) -> [ToolArm; 2] {
    let with_tool = |arm: &Arm| {
        let point = target.and_then(|index| arm.targets.get(index));
        let flange_from_tool =
            point.map_or_else(Isometry3::identity, |point| Isometry3::from(Translation3::from(point.coords)));
        ToolArm { chain: arm.chain.clone(), flange_from_tool }
    };
    let profile: &Profile = &arm.profile;
    [with_tool(&profile.arm()), with_tool(&arm.identified)]
}

/// Why a target is not reached, or only in part.
pub fn reason(done: &Compensated, joints: &[Joint]) -> String {
    let left = format!("{:.3} mm and {:.4} deg are left", to_mm(done.position_error), to_deg(done.angle_error));
    match &done.status {
        Status::PositionOnly => {
            format!(
                "near a singularity only the position is reached; the orientation is off by {:.4} deg",
                to_deg(done.angle_error)
            )
        }
        Status::AtLimit(_) | Status::Singular => {
            format!("not reached: {}; {left}", status_reason(&done.status, joints))
        }
        Status::Reached
        | Status::OutOfReach
        | Status::BeyondLimit(_)
        | Status::NotInConfiguration
        | Status::Ambiguous
        | Status::OtherConfiguration => format!("not reached: {}", status_reason(&done.status, joints)),
    }
}

pub fn status_reason(status: &Status, joints: &[Joint]) -> String {
    let names = |held: &[usize]| {
        let names = held.iter().filter_map(|index| joints.get(*index)).map(|joint| joint.name.as_str());
        listed(&names.collect::<Vec<_>>())
    };
    let limits = |held: &[usize]| if held.len() == 1 { "its limit" } else { "their limits" };
    match status {
        Status::Reached => "it is reached".to_owned(),
        Status::PositionOnly => "near a singularity only the position is reached".to_owned(),
        Status::AtLimit(held) => format!("{} would have to pass {}", names(held), limits(held)),
        Status::Singular => "near a singularity the corrections become too large".to_owned(),
        Status::OutOfReach => "it is out of reach of this arm".to_owned(),
        Status::BeyondLimit(held) => {
            let have = if held.len() == 1 { "has a target" } else { "have targets" };
            format!("{} {have} beyond {}", names(held), limits(held))
        }
        Status::NotInConfiguration => "the arm does not reach it in the stated configuration".to_owned(),
        Status::Ambiguous => {
            "several configurations reach it, and what is stated does not tell which is meant".to_owned()
        }
        Status::OtherConfiguration => "the corrected target would be in another configuration".to_owned(),
    }
}
