//! Expected deviations of an arm: the prior, and the scale between metres and radians.

use std::collections::BTreeMap;
use std::str::FromStr;

use super::Target;
use crate::kinematics::{FreeParameter, JointType, KinematicChain, LinkParameter, ParameterId, ParameterUnit};
use crate::units::{DEGREE, MICROMETRE, MILLIMETRE, MILLIRADIAN, Quantity};

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
    /// Parameters with their own value, including those of targets.
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
    /// The fields of a profile for single parameters, with the size of their unit (m) or (rad).
    pub const FIELDS: [(&'static str, f64); 2] = [("parameters_mm", MILLIMETRE), ("parameters_mrad", MILLIRADIAN)];

    /// The one of [`Self::FIELDS`] that a parameter belongs in.
    pub const fn field_of(id: ParameterId) -> &'static str {
        match id.unit() {
            ParameterUnit::Millimetre => "parameters_mm",
            ParameterUnit::Degree | ParameterUnit::Microradian => "parameters_mrad",
        }
    }

    /// The expected deviation of a parameter (m) or (rad). A target coordinate has the uncertainty of its target.
    pub fn of(&self, id: ParameterId, chain: &KinematicChain, targets: &[Target]) -> f64 {
        if let Some(own) = self.overrides.get(&id) {
            return *own;
        }
        match id {
            ParameterId::Target { target, .. } => targets.get(target).map_or(self.length, |target| target.uncertainty),
            ParameterId::Joint { term, .. } => term.expected(),
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

/// Expected deviation of all lengths (m) and all angles (rad) of the links, given by the operator instead of the profile. As
/// text, for example `1mm,0.1deg`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedDeviation {
    /// Of every length (m).
    pub length: f64,
    /// Of every angle (rad).
    pub angle: f64,
}

impl ExpectedDeviation {
    /// Replaces the expected deviations of the link constants among `parameters`; errors of joints and targets keep theirs.
    pub fn replace_in(self, parameters: &mut [FreeParameter]) {
        for free in parameters {
            match free.id {
                ParameterId::Link { parameter, .. } => {
                    free.expected = match parameter.quantity() {
                        Quantity::Length => self.length,
                        Quantity::Angle => self.angle,
                    };
                }
                ParameterId::Joint { .. } | ParameterId::Target { .. } => {}
            }
        }
    }
}

impl FromStr for ExpectedDeviation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        const LENGTHS: [(&str, f64); 3] = [("mm", MILLIMETRE), ("um", MICROMETRE), ("m", 1.0)];
        const ANGLES: [(&str, f64); 3] = [("deg", DEGREE), ("mrad", MILLIRADIAN), ("rad", 1.0)];
        let expected =
            || format!("'{text}' is not a length and an angle; write for example '1mm,0.1deg' (mm, um; deg, mrad)");
        let quantity = |text: &str, units: &[(&str, f64)]| {
            units.iter().find_map(|(unit, size)| {
                let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
                (number.is_finite() && number > 0.0).then_some(number * size)
            })
        };
        let (length, angle) = text.split_once(',').ok_or_else(expected)?;
        match (quantity(length, &LENGTHS), quantity(angle, &ANGLES)) {
            (Some(length), Some(angle)) => Ok(Self { length, angle }),
            _ => Err(expected()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expected_deviations_have_units() {
        let parsed: ExpectedDeviation = "1mm,0.1deg".parse().unwrap();
        assert_eq!(parsed, ExpectedDeviation { length: MILLIMETRE, angle: 0.1 * DEGREE });
        let parsed: ExpectedDeviation = "500 um, 5mrad".parse().unwrap();
        assert_eq!(parsed, ExpectedDeviation { length: 500.0 * MICROMETRE, angle: 5.0 * MILLIRADIAN });
        for wrong in ["1,0.1", "1mm", "1deg,1mm", "-1mm,1deg", "nanmm,1deg", "1mm,0deg"] {
            assert!(wrong.parse::<ExpectedDeviation>().is_err(), "{wrong}");
        }
    }
}
