//! How large the deviations of an arm are expected to be: the prior, and the scale between metres and radians.

use std::collections::BTreeMap;

use super::Target;
use crate::kinematics::{JointType, KinematicChain, LinkParameter, ParameterId};
use crate::units::{MILLIMETRE, MILLIRADIAN};

/// Standard deviations of the zero-mean prior (m) and (rad), each above zero.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedDeviations {
    /// Lengths a and d (m).
    pub length: f64,
    /// Angles α and β, and θ of prismatic joints (rad).
    pub angle: f64,
    /// Joint offsets θ of revolute joints (rad).
    pub joint_offset: f64,
    /// Joint offsets d of prismatic joints (m).
    pub prismatic_offset: f64,
    /// Parameters with an own value; of targets too.
    pub overrides: BTreeMap<ParameterId, f64>,
}

/// Tolerances of machining and assembly: 1 mm, 2 mrad, 10 mrad, 1 mm.
impl Default for ExpectedDeviations {
    fn default() -> Self {
        Self {
            length: MILLIMETRE,
            angle: 2.0 * MILLIRADIAN,
            joint_offset: 10.0 * MILLIRADIAN,
            prismatic_offset: MILLIMETRE,
            overrides: BTreeMap::new(),
        }
    }
}

impl ExpectedDeviations {
    /// The expected deviation of a parameter (m) or (rad). A target coordinate has the uncertainty of its target.
    pub fn of(&self, id: ParameterId, chain: &KinematicChain, targets: &[Target]) -> f64 {
        if let Some(own) = self.overrides.get(&id) {
            return *own;
        }
        match id {
            ParameterId::Target { target, .. } => targets.get(target).map_or(self.length, |target| target.uncertainty),
            ParameterId::Link { joint, parameter } => {
                let joint_type = chain.joints().get(joint).map(|joint| joint.joint_type);
                match (parameter, joint_type) {
                    (LinkParameter::Theta, Some(JointType::Revolute)) => self.joint_offset,
                    (LinkParameter::D, Some(JointType::Prismatic)) => self.prismatic_offset,
                    (LinkParameter::A | LinkParameter::D, _) => self.length,
                    (LinkParameter::Alpha | LinkParameter::Theta | LinkParameter::Beta, _) => self.angle,
                }
            }
        }
    }
}
