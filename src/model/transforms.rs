//! Fixed transforms: roll, pitch, yaw without loss at the poles, numbers as text, and a chain as a row of joint frames.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::kinematics::{Convention, Joint, JointType, KinematicChain, Link};

/// Digits after the point in all files (m, rad, mm, degree): a picometre.
const DECIMALS: usize = 12;

/// Formats a number: fixed decimals without trailing zeros, at least one after the point, never `-0.0`.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:.DECIMALS$}");
    let short = text.trim_end_matches('0');
    let short = if short.ends_with('.') { format!("{short}0") } else { short.to_owned() };
    if short == "-0.0" { "0.0".to_owned() } else { short }
}

/// Roll, pitch, yaw (rad) about the fixed axes x, y, z, as in URDF: `R = Rz(yaw) Ry(pitch) Rx(roll)`.
///
/// Pitch and yaw are computed after removing the roll, so that the product is exact to rounding even if the pitch is ±90° and
/// roll and yaw turn about the same axis.
pub fn roll_pitch_yaw(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m: Matrix3<f64> = *rotation.to_rotation_matrix().matrix();
    let (m21, m22) = (m[(2, 1)], m[(2, 2)]);
    let roll = if m21.hypot(m22) < 1e-14 { 0.0 } else { m21.atan2(m22) };
    let (sin, cos) = roll.sin_cos();
    // The columns y and z of R Rx(-roll) = Rz(yaw) Ry(pitch).
    let y = m.column(1) * cos - m.column(2) * sin;
    let z = m.column(1) * sin + m.column(2) * cos;
    [roll, (-m[(2, 0)]).atan2(z[2]), (-y[0]).atan2(y[1])]
}

/// The pose with this position (m) and roll, pitch, yaw (rad).
pub fn from_roll_pitch_yaw(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation)
}

/// A rotation about z and a translation along it.
pub(super) fn screw_z(theta: f64, d: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(0.0, 0.0, d), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta))
}

/// `Trans(x,a) Rot(x,α) Rot(y,β)`: the transform between the axes of two neighbouring joints, in both conventions.
pub(super) fn between_axes(link: &Link) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), link.alpha)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), link.beta);
    Isometry3::from_parts(Translation3::new(link.a, 0.0, 0.0), rotation)
}

/// The motion of a joint at this value ((rad) or (m)) along or about its axis.
pub(super) fn motion(joint_type: JointType, axis: &Unit<Vector3<f64>>, value: f64) -> Isometry3<f64> {
    match joint_type {
        JointType::Revolute => {
            Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(axis, value))
        }
        JointType::Prismatic => {
            Isometry3::from_parts(Translation3::from(axis.into_inner() * value), UnitQuaternion::identity())
        }
    }
}

/// A chain as fixed transforms and joints that move about or along the z axis of their own frame:
/// `base_from_flange = O_1 M_1 O_2 M_2 … O_n M_n tail`. The joint offsets θ and d are in the fixed transforms.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct JointFrames {
    /// `O_i`: frame of joint i at rest, seen from the frame of joint i − 1 (the base for the first).
    pub(super) origins: Vec<Isometry3<f64>>,
    /// The flange seen from the last joint.
    pub(super) tail: Isometry3<f64>,
}

impl JointFrames {
    pub(super) fn new(chain: &KinematicChain) -> Self {
        let mut carried = *chain.base();
        let mut origins = Vec::with_capacity(chain.dof());
        for joint in chain.joints() {
            let own = screw_z(joint.link.theta, joint.link.d);
            let between = between_axes(&joint.link);
            match chain.convention() {
                Convention::Standard => {
                    origins.push(carried * own);
                    carried = between;
                }
                Convention::Modified => {
                    origins.push(carried * between * own);
                    carried = Isometry3::identity();
                }
            }
        }
        Self { origins, tail: carried * chain.flange() }
    }
}

/// Values of the joints of a URDF, each of which turns one link against the one before, with the signs of the pendant. They equal
/// the pendant values unless joints are coupled.
pub fn link_values(chain: &KinematicChain, q: &[f64]) -> Vec<f64> {
    let joints = chain.joints().iter().enumerate();
    joints.map(|(index, joint)| joint.direction * joint.variable(index, q)).collect()
}

/// Whether the value of a joint depends on other joints of the pendant.
pub(super) fn is_coupled(joint: &Joint) -> bool {
    joint.coupling.iter().any(|coefficient| *coefficient != 0.0)
}

/// Isometry from a position and three axes that are orthonormal to rounding.
pub(super) fn from_axes(origin: Vector3<f64>, x: Vector3<f64>, z: Vector3<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_short_and_never_minus_zero() {
        for (value, text) in
            [(0.0, "0.0"), (-0.0, "0.0"), (-1e-15, "0.0"), (1.5, "1.5"), (-90.0, "-90.0"), (1e-12, "0.000000000001")]
        {
            assert_eq!(number(value), text);
        }
    }

    fn check(rotation: &UnitQuaternion<f64>) {
        let [roll, pitch, yaw] = roll_pitch_yaw(rotation);
        let back = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        assert!(rotation.angle_to(&back) < 2e-15, "{roll} {pitch} {yaw}: {}", rotation.angle_to(&back));
    }

    #[test]
    fn roll_pitch_yaw_is_exact_at_the_poles() {
        for pitch in [FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 - 1e-9, FRAC_PI_2 + 1e-12, -FRAC_PI_2 + 3e-8] {
            for (roll, yaw) in [(0.0, 0.0), (0.3, -1.2), (PI, 0.4), (-2.0, 2.0)] {
                check(&UnitQuaternion::from_euler_angles(roll, pitch, yaw));
            }
        }
    }

    proptest! {
        #[test]
        fn roll_pitch_yaw_makes_the_same_rotation(angles in prop::array::uniform3(-3.2..3.2_f64)) {
            check(&UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]));
        }
    }
}
