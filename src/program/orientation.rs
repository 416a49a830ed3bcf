//! Poses as the languages write them: three coordinates and an orientation, read and written without a change of branch.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::units::{MILLIMETRE, from_deg, to_deg};

/// Notation of an orientation, with the unit of the position that goes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    /// Quaternion with the real part first; mm (RAPID).
    Quaternion,
    /// Degrees about z, the new y and the new x; mm (KRL `A`, `B`, `C`).
    Zyx,
    /// Degrees about the fixed x, y and z; mm (FANUC `W`, `P`, `R`; INFORM `Rx`, `Ry`, `Rz`).
    FixedXyz,
    /// Degrees about x, the new y and the new z; mm (VAL3 `rx`, `ry`, `rz`).
    MovingXyz,
    /// Rotation vector (rad); m (URScript).
    Vector,
}

/// A quaternion whose length is further from 1 than this is no rotation.
const QUATERNION_TOLERANCE: f64 = 0.1;

impl Orientation {
    const fn length_unit(self) -> f64 {
        match self {
            Self::Vector => 1.0,
            Self::Quaternion | Self::Zyx | Self::FixedXyz | Self::MovingXyz => MILLIMETRE,
        }
    }

    /// The pose that values of the text describe.
    pub(super) fn pose(self, values: &[f64]) -> Option<Isometry3<f64>> {
        let (&[x, y, z], turn) = values.split_first_chunk::<3>()?;
        let translation = Translation3::from(Vector3::new(x, y, z) * self.length_unit());
        let rotation = match (self, turn) {
            (Self::Quaternion, &[w, x, y, z]) => {
                let quaternion = Quaternion::new(w, x, y, z);
                if (quaternion.norm() - 1.0).abs() > QUATERNION_TOLERANCE {
                    return None;
                }
                UnitQuaternion::from_quaternion(quaternion)
            }
            (Self::Zyx, &[a, b, c]) => UnitQuaternion::from_euler_angles(from_deg(c), from_deg(b), from_deg(a)),
            (Self::FixedXyz, &[w, p, r]) => UnitQuaternion::from_euler_angles(from_deg(w), from_deg(p), from_deg(r)),
            (Self::MovingXyz, &[x, y, z]) => {
                // About moving axes x, y, z: the inverse of the rotation about the fixed axes by the negative angles.
                UnitQuaternion::from_euler_angles(-from_deg(x), -from_deg(y), -from_deg(z)).inverse()
            }
            (Self::Vector, &[x, y, z]) => UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z)),
            _ => return None,
        };
        Some(Isometry3::from_parts(translation, rotation))
    }

    /// Values of the text for a pose, on the branch of the `old` values.
    pub(super) fn write(self, pose: &Isometry3<f64>, old: &[f64]) -> Vec<f64> {
        let position = pose.translation.vector / self.length_unit();
        let old: Vec<f64> = old.iter().skip(3).copied().collect();
        let turn = match self {
            Self::Quaternion => {
                let new = [pose.rotation.w, pose.rotation.i, pose.rotation.j, pose.rotation.k];
                let along: f64 = new.iter().zip(&old).map(|(new, old)| new * old).sum();
                let sign = if along < 0.0 { -1.0 } else { 1.0 };
                new.map(|part| sign * part).to_vec()
            }
            Self::Zyx => {
                let near = [old.get(2), old.get(1), old.first()].map(|angle| from_deg(angle.copied().unwrap_or(0.0)));
                let [x, y, z] = fixed_angles(&pose.rotation, near);
                [z, y, x].map(to_deg).to_vec()
            }
            Self::FixedXyz => {
                let near = [old.first(), old.get(1), old.get(2)].map(|angle| from_deg(angle.copied().unwrap_or(0.0)));
                fixed_angles(&pose.rotation, near).map(to_deg).to_vec()
            }
            Self::MovingXyz => {
                let near = [old.first(), old.get(1), old.get(2)].map(|angle| -from_deg(angle.copied().unwrap_or(0.0)));
                fixed_angles(&pose.rotation.inverse(), near).map(|angle| to_deg(-angle)).to_vec()
            }
            Self::Vector => vector_near(&pose.rotation, &old),
        };
        position.iter().copied().chain(turn).collect()
    }
}

/// Rotation vector of the same rotation that is nearest to the old one: a vector near half a turn must not change its side.
fn vector_near(rotation: &UnitQuaternion<f64>, old: &[f64]) -> Vec<f64> {
    let vector = rotation.scaled_axis();
    let old = Vector3::from_iterator(old.iter().copied().chain([0.0; 3]).take(3));
    let angle = vector.norm();
    if angle < 1e-9 {
        return vector.iter().copied().collect();
    }
    let axis = vector / angle;
    let candidates = [angle, angle - TAU, angle + TAU].map(|angle| axis * angle);
    let nearest = candidates.into_iter().min_by(|one, two| (one - old).norm().total_cmp(&(two - old).norm()));
    nearest.unwrap_or(vector).iter().copied().collect()
}

/// Angles about the fixed axes x, y and z (rad), nearest to `near`.
///
/// Each rotation has two sets of angles, apart from whole turns. Where the middle angle is ±90° only the sum or the difference of
/// the others is determined; the last one then keeps its value.
fn fixed_angles(rotation: &UnitQuaternion<f64>, near: [f64; 3]) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let (sine, cosine) = (-r[(2, 0)], r[(0, 0)].hypot(r[(1, 0)]));
    let y = sine.atan2(cosine);
    let angles = if cosine < 1e-10 {
        // R = Rz·Ry·Rx with y = ±90°: with z given, x follows from the remaining rotation.
        let rest = UnitQuaternion::from_euler_angles(0.0, y, near[2]).inverse() * rotation;
        let x = rest.to_rotation_matrix();
        [[x[(2, 1)].atan2(x[(1, 1)]), y, near[2]]; 2]
    } else {
        let (x, z) = (r[(2, 1)].atan2(r[(2, 2)]), r[(1, 0)].atan2(r[(0, 0)]));
        [[x, y, z], [x + PI, PI - y, z + PI]]
    };
    let distance =
        |angles: &[f64; 3]| -> f64 { angles.iter().zip(near).map(|(angle, near)| wrapped(angle - near).abs()).sum() };
    let [first, second] = angles;
    let chosen = if distance(&second) + 1e-9 < distance(&first) { second } else { first };
    // An angle that was within half a turn stays there: controllers may refuse more.
    let mut written = [0.0; 3];
    for ((written, angle), near) in written.iter_mut().zip(chosen).zip(near) {
        let wound = near + wrapped(angle - near);
        *written = if wound.abs() > PI && near.abs() <= PI + 1e-12 { wrapped(angle) } else { wound };
    }
    written
}

/// An angle within half a turn (rad).
fn wrapped(angle: f64) -> f64 {
    let turned = (angle + PI).rem_euclid(TAU) - PI;
    if turned <= -PI { PI } else { turned }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ALL: [Orientation; 5] =
        [Orientation::Quaternion, Orientation::Zyx, Orientation::FixedXyz, Orientation::MovingXyz, Orientation::Vector];

    #[test]
    #[expect(clippy::float_cmp, reason = "rounded to six decimals")]
    fn notations_agree_with_the_manuals() {
        let turned = |notation: Orientation, values: [f64; 3], of: [f64; 3]| {
            let pose = notation.pose(&[[0.0; 3], values].concat()).unwrap();
            let to = pose.rotation * Vector3::from(of);
            [to.x, to.y, to.z].map(|part| (part * 1e6).round() / 1e6 + 0.0)
        };
        // KUKA: A turns about z first; then B about the new y, so x ends down.
        assert_eq!(turned(Orientation::Zyx, [90.0, 90.0, 0.0], [1.0, 0.0, 0.0]), [0.0, 0.0, -1.0]);
        assert_eq!(turned(Orientation::Zyx, [90.0, 90.0, 0.0], [0.0, 0.0, 1.0]), [0.0, 1.0, 0.0]);
        // FANUC: W about the fixed x first, then P about the fixed y.
        assert_eq!(turned(Orientation::FixedXyz, [90.0, 90.0, 0.0], [0.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
        // VAL3: rx first, then ry about the new y, which points up.
        assert_eq!(turned(Orientation::MovingXyz, [90.0, 90.0, 0.0], [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn poses_survive_and_keep_their_branch(
            notation in 0..5_usize, a in -180.0..180.0_f64, b in -180.0..180.0_f64, c in -180.0..180.0_f64,
            special in 0..4_usize, small in -0.01..0.01_f64,
        ) {
            let notation = ALL[notation];
            let b = match special { 0 => 90.0, 1 => -90.0, 2 => 0.0, _ => b };
            let values = match notation {
                Orientation::Quaternion => {
                    let q = UnitQuaternion::from_euler_angles(a, b, c);
                    vec![1.0, 2.0, 3.0, q.w, q.i, q.j, q.k]
                }
                Orientation::Vector => vec![1.0, 2.0, 3.0, a.to_radians(), b.to_radians(), c.to_radians()],
                _ => vec![1.0, 2.0, 3.0, a, b, c],
            };
            let pose = notation.pose(&values).unwrap();
            let same = notation.write(&pose, &values);
            for (same, old) in same.iter().zip(&values) {
                prop_assert!((same - old).abs() < 1e-6, "{notation:?} {same} {old}");
            }
            let moved = Isometry3::from_parts(pose.translation, pose.rotation * UnitQuaternion::from_euler_angles(small, -small, small));
            let written = notation.write(&moved, &values);
            let again = notation.pose(&written).unwrap();
            prop_assert!(again.rotation.angle_to(&moved.rotation) < 1e-7);
        }
    }
}
