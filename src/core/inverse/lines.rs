//! The axes of the joints as lines in the base, and the rotations about them.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, UnitVector3, Vector3};

use crate::kinematics::{Convention, ForwardKinematics, KinematicChain};

/// The axis of a joint in the base with all joints at zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) direction: UnitVector3<f64>,
    pub(super) point: Vector3<f64>,
}

impl Line {
    /// The rotation about this line.
    pub(super) fn turn(&self, angle: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_axis_angle(&self.direction, angle);
        Isometry3::from_parts(Translation3::from(self.point - rotation * self.point), rotation)
    }

    /// The angle about this line that takes a point to another one, as far as the line allows.
    pub(super) fn angle_between(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
        angle_about(&self.direction, &(from - self.point), &(to - self.point))
    }

    /// Middle of the shortest connection with another line, and its length; `None` for parallel lines.
    pub(super) fn meeting(&self, other: &Self) -> Option<(Vector3<f64>, f64)> {
        let normal = self.direction.cross(&other.direction);
        let size = normal.norm_squared();
        if size < 1e-6 {
            return None;
        }
        let between = other.point - self.point;
        let along = between.cross(&other.direction).dot(&normal) / size;
        let other_along = between.cross(&self.direction).dot(&normal) / size;
        let one = self.point + self.direction.into_inner() * along;
        let two = other.point + other.direction.into_inner() * other_along;
        Some(((one + two) / 2.0, (one - two).norm()))
    }
}

/// The part of a vector across a direction.
pub(super) fn across(axis: &UnitVector3<f64>, vector: &Vector3<f64>) -> Vector3<f64> {
    vector - axis.into_inner() * axis.dot(vector)
}

/// The angle about an axis that takes the part of one vector across it to that of another.
pub(super) fn angle_about(axis: &UnitVector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let (from, to) = (across(axis, from), across(axis, to));
    axis.dot(&from.cross(&to)).atan2(from.dot(&to))
}

/// The angles about an axis that turn `vector` so that its part along `along` is `size`: two, or none. A size that is out of reach by less
/// than `slack`, relative to the reach, counts as just reached.
pub(super) fn angles_of_part(
    axis: &UnitVector3<f64>,
    vector: &Vector3<f64>,
    along: &Vector3<f64>,
    size: f64,
    slack: f64,
) -> Option<[f64; 2]> {
    let constant = along.dot(axis) * axis.dot(vector);
    let cosine = along.dot(vector) - constant;
    let sine = along.dot(&axis.cross(vector));
    let reach = cosine.hypot(sine);
    let rest = size - constant;
    if rest.abs() > reach * (1.0 + slack) + 1e-12 {
        return None;
    }
    let middle = sine.atan2(cosine);
    let half = if reach > 0.0 { (rest / reach).clamp(-1.0, 1.0).acos() } else { 0.0 };
    Some([middle + half, middle - half])
}

/// The axes of all joints of an arm.
pub(super) fn of(chain: &KinematicChain, forward: &ForwardKinematics<'_>) -> Vec<Line> {
    let frames = forward.base_from_links(&vec![0.0; chain.dof()]);
    // A link of the standard convention turns about the z axis that it starts from, a modified one about that of its own frame.
    let skipped = match chain.convention() {
        Convention::Standard => 0,
        Convention::Modified => 1,
    };
    let of_joints = frames.iter().skip(skipped).take(chain.dof());
    let line = |frame: &Isometry3<f64>| Line {
        direction: UnitVector3::new_normalize(frame.rotation * Vector3::z()),
        point: frame.translation.vector,
    };
    of_joints.map(line).collect()
}
