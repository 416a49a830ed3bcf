//! Positions of the parts of an arm at a configuration.

use nalgebra::{Isometry3, Point3};

use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::profile::{JointRange, Profile};

/// An arm at a configuration: its frames and the points that a line through it visits, the reflector last.
pub(super) struct Posture {
    pub(super) frames: Vec<Isometry3<f64>>,
    pub(super) line: Vec<Point3<f64>>,
    pub(super) reflector: Point3<f64>,
}

impl Posture {
    /// Computes the posture at the pendant values `q` ((rad) or (m)); missing ones are zero.
    pub(super) fn new(chain: &KinematicChain, target: &Point3<f64>, q: &[f64]) -> Self {
        let mut q = q.to_vec();
        q.resize(chain.dof(), 0.0);
        let forward = ForwardKinematics::new(chain);
        let frames = forward.base_from_links(&q);
        let reflector = forward.point_in_base(&q, target);
        let mut line = vec![Point3::origin()];
        line.extend(frames.iter().map(|frame| Point3::from(frame.translation.vector)));
        line.push(reflector);
        line.dedup_by(|one, other| (*one - *other).norm() < 1e-6);
        Self { frames, line, reflector }
    }

    /// Computes the posture of the nominal arm of `profile` with its first target.
    pub(super) fn nominal(profile: &Profile, q: &[f64]) -> Self {
        let target = profile.targets().first().map_or_else(Point3::origin, |target| target.position_in_flange);
        Self::new(profile.chain(), &target, q)
    }
}

/// Returns the length of the stretched arm (m), the unit of sizes in the picture.
pub(super) fn reach(profile: &Profile) -> f64 {
    profile.chain().length().max(0.1)
}

/// Returns the middle of each joint's range ((rad) or (m)).
pub(super) fn rest(profile: &Profile) -> Vec<f64> {
    let middle =
        |range: &JointRange| range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high));
    profile.joints().iter().map(middle).collect()
}
