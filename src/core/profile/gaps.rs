//! What a profile does not state although a calibration needs it. Nothing here is wrong, so reading a profile does not report it;
//! `profile check` and the wizard do.

use nalgebra::Point3;

use super::{Acceptance, FREE_TARGET_UNCERTAINTY, JointRange, Profile, Tracker};
use crate::kinematics::{ForwardKinematics, JointType, KinematicChain};
use crate::text::listed;
use crate::units::{MILLIMETRE, to_mm};

/// Distance that the SMR needs from the last axis (m): about its own radius.
const LEAST_LEVER: f64 = 20.0 * MILLIMETRE;

/// Something that a profile does not state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// What is missing, in lower case without a full stop.
    pub message: String,
    /// The field to add, and the consequence of leaving it out.
    pub hint: &'static str,
}

impl Profile {
    /// What this profile does not state although a calibration needs it, in the order in which a technician meets it.
    pub fn gaps(&self) -> Vec<Gap> {
        let far: Vec<&str> = self
            .chain
            .joints()
            .iter()
            .zip(&self.joints)
            .filter(|(joint, range)| is_narrowed(joint.joint_type, range))
            .map(|(joint, _)| joint.name.as_str())
            .collect();
        let on_axis = self.targets.first().filter(|target| {
            target.uncertainty <= FREE_TARGET_UNCERTAINTY
                && lever(&self.chain, &target.position_in_flange).is_some_and(|lever| lever < LEAST_LEVER)
        });
        let gap = |is_missing: bool, message: &str, hint| is_missing.then(|| Gap { message: message.to_owned(), hint });
        [
            (!far.is_empty()).then(|| Gap {
                message: format!(
                    "{} {} beyond 180 deg without 'planning_limits_deg'",
                    listed(&far),
                    if far.len() == 1 { "turns" } else { "turn" }
                ),
                hint: "poses stay within -180 to 180 deg. Add 'planning_limits_deg: (..., ...)', narrower if cables or hoses need it",
            }),
            gap(
                self.bodies.is_empty(),
                "no 'bodies'",
                "collisions of the arm with itself are not checked; only joints and SMR are kept above the floor and out of boxes. \
                 Add a capsule per link, or check every move by hand",
            ),
            gap(
                self.instrument.is_none(),
                "no 'instrument'",
                "errors cannot be predicted in mm before measuring. Add 'instrument: (name: \"...\", sigma_um: 15.0, sigma_um_per_m: 6.0)'",
            ),
            gap(
                self.acceptance == Acceptance::default(),
                "no 'acceptance'",
                "no result can be accepted or refused. Add 'acceptance: (position_rms_mm: ..., position_max_mm: ...)'",
            ),
            gap(
                self.tracker == Tracker::default(),
                "no 'tracker'",
                "lines of sight are planned for a tracker at (3000, 0, 1000) mm. Add 'tracker: (position_mm: (..., ..., ...))'",
            ),
            on_axis.map(|target| Gap {
                message: format!(
                    "the SMR '{}' is less than {:.0} mm away from the last axis",
                    target.name,
                    to_mm(LEAST_LEVER)
                ),
                hint: "the last joint then hardly moves it, and its offset cannot be found. Mount the nest beside the axis and \
                       correct 'position_mm'",
            }),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// Whether the planning limits of a joint are narrower than its limits only because none are stated.
fn is_narrowed(joint_type: JointType, range: &JointRange) -> bool {
    let usual = range.limits.map(|limits| JointRange::usual_planning_limits(joint_type, limits));
    usual != range.limits && range.planning_limits == usual
}

/// Distance of a point of the flange frame from the axis of the last joint (m), if that joint turns.
fn lever(chain: &KinematicChain, point: &Point3<f64>) -> Option<f64> {
    let last = chain.dof().checked_sub(1)?;
    if chain.joints().get(last)?.joint_type != JointType::Revolute {
        return None;
    }
    let kinematics = ForwardKinematics::new(chain);
    let mut turned = vec![0.0; chain.dof()];
    let start = kinematics.point_in_base(&turned, point);
    *turned.get_mut(last)? = std::f64::consts::PI;
    Some((kinematics.point_in_base(&turned, point) - start).norm() / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::builtin;

    #[test]
    fn the_lever_is_the_distance_from_the_last_axis() {
        let (profile, _) = Profile::parse(builtin("ur5e").unwrap(), "ur5e").unwrap();
        for (x, y) in [(0.0, 0.0), (0.03, 0.0), (0.03, -0.04)] {
            let found = lever(profile.chain(), &Point3::new(x, y, 0.05)).unwrap();
            assert!((found - f64::hypot(x, y)).abs() < 1e-12, "{found}");
        }
    }
}
