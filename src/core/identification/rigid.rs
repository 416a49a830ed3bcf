//! Poses measured with their orientation, as points of a rigid body.
//!
//! The method uses nothing but distances between measured points, and a rigid body shows its orientation in the distances of its
//! points from those of other poses. So a pose is put as four points at the corners of a regular tetrahedron about the measured
//! point. With the right size they carry exactly what was measured: let σ_p be the standard deviation of each coordinate, σ_r that of
//! the rotation about each axis (rad), L the distance of the corners from the centre, and give every coordinate of every corner an
//! independent error of 2 σ_p. Their mean then has σ_p. A rotation φ moves corner k by φ × e_k L, and Σ |a × e_k|² = 8/3 for every
//! axis a, so that the corners determine each rotation with the variance (2 σ_p)² / (8/3 L²), which is σ_r² for L = √(3/2) σ_p / σ_r.

use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use crate::geometry::register;

/// The corners of the body, and the endings of their names.
pub const CORNERS: [(char, [f64; 3]); 4] =
    [('a', [1.0, 1.0, 1.0]), ('b', [1.0, -1.0, -1.0]), ('c', [-1.0, 1.0, -1.0]), ('d', [-1.0, -1.0, 1.0])];
/// The error of a corner in errors of the measured point: the mean of four has half of it.
const CORNER_SIGMA: f64 = 2.0;
/// Second singular value above which the rotations of the arm are all about one axis, so that the mounting is not determined.
const ONE_AXIS: f64 = 0.998;

/// The regular tetrahedron whose corners stand for a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tetrahedron {
    /// Distance of the corners from the centre (m).
    pub radius: f64,
}

impl Tetrahedron {
    /// The body that stands for positions with a standard deviation of `position` per coordinate (m) and orientations with one of
    /// `rotation` per axis (rad); none if they are not positive.
    pub fn of_sigmas(position: f64, rotation: f64) -> Option<Self> {
        let radius = 1.5_f64.sqrt() * position / rotation;
        (position > 0.0 && rotation > 0.0 && radius.is_finite()).then_some(Self { radius })
    }

    /// The corners in the frame of the body (m).
    pub fn corners(&self) -> [Point3<f64>; 4] {
        CORNERS.map(|(_, corner)| Point3::from(Vector3::from(corner) * (self.radius / 3.0_f64.sqrt())))
    }

    /// The corners of the body at a pose.
    pub fn points(&self, pose: &Isometry3<f64>) -> [Point3<f64>; 4] {
        self.corners().map(|corner| pose * corner)
    }

    /// Standard deviation of each coordinate of a corner (m). Where a reading is worse in one of both than the body says, the worse
    /// one counts.
    pub fn corner_sigma(&self, position: f64, rotation: f64) -> f64 {
        CORNER_SIGMA * position.max(rotation * self.radius / 1.5_f64.sqrt())
    }

    /// The body that has these corners, whatever its pose; none if they are one point.
    pub fn of_points(points: &[Point3<f64>; 4]) -> Option<Self> {
        let centre = points.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords) / 4.0;
        let radius = points.iter().map(|point| (point.coords - centre).norm()).sum::<f64>() / 4.0;
        (radius > 0.0 && radius.is_finite()).then_some(Self { radius })
    }

    /// The pose at which the body has these corners.
    pub fn pose(&self, points: &[Point3<f64>; 4]) -> Option<Isometry3<f64>> {
        let pairs = self.corners().into_iter().zip(*points).map(|(corner, point)| (1.0, corner, point));
        register(pairs).map(|registration| registration.to_from_from)
    }
}

/// Finds the pose of a body on the flange from pairs of `base_from_flange` of the nominal arm and `station_from_body` as measured,
/// both of whose mountings are unknown: the robot-world and hand-eye problem. None if the flange turned about one axis only.
///
/// With the rotations M of the measurement, F of the arm, S of the station and H of the mounting, `Sᵀ M = F H` for all pairs. The
/// least squares solution with Sᵀ and H of given norm is the pair of singular vectors of `Σ M ⊗ F` with the largest singular value,
/// made rotations afterwards; the positions are then linear.
pub fn mounting(pairs: &[(Isometry3<f64>, Isometry3<f64>)]) -> Option<Isometry3<f64>> {
    let mut sum = SMatrix::<f64, 9, 9>::zeros();
    for (base_from_flange, station_from_body) in pairs {
        let flange = base_from_flange.rotation.to_rotation_matrix();
        let body = station_from_body.rotation.to_rotation_matrix();
        sum += body.matrix().kronecker(flange.matrix());
    }
    let svd = (sum / pairs.len().max(1) as f64).svd(true, true);
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|one, other| svd.singular_values[*other].total_cmp(&svd.singular_values[*one]));
    let &[first, second, ..] = order.as_slice() else { return None };
    if pairs.len() < 3 || svd.singular_values[second] > ONE_AXIS * svd.singular_values[first] {
        return None;
    }
    let (left, right) = (svd.u?.column(first).into_owned(), svd.v_t?.row(first).transpose());
    let matrix = |vector: &SVector<f64, 9>| Matrix3::from_column_slice(vector.as_slice());
    let (base_from_station, flange_from_body) = (rotation_near(&matrix(&left))?, rotation_near(&matrix(&right))?);
    let position = mounted_position(pairs, &base_from_station)?;
    Some(Isometry3::from_parts(Translation3::from(position), flange_from_body))
}

/// Where the body is on the flange, with the place of the station: `Sᵀ p − o = F t + c` for all pairs.
fn mounted_position(
    pairs: &[(Isometry3<f64>, Isometry3<f64>)],
    base_from_station: &UnitQuaternion<f64>,
) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
    for (base_from_flange, station_from_body) in pairs {
        let mut rows = SMatrix::<f64, 3, 6>::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(base_from_flange.rotation.to_rotation_matrix().matrix());
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
        let value = base_from_station * station_from_body.translation.vector - base_from_flange.translation.vector;
        normal += rows.transpose() * rows;
        right += rows.transpose() * value;
    }
    let solution = normal.lu().solve(&right)?;
    let position = Vector3::new(solution[0], solution[1], solution[2]);
    position.iter().all(|coordinate| coordinate.is_finite()).then_some(position)
}

/// The rotation nearest to a multiple of `matrix`, whose sign is not known.
fn rotation_near(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let turned = if matrix.determinant() < 0.0 { -matrix } else { *matrix };
    let svd = turned.svd(true, true);
    let nearest = svd.u? * svd.v_t?;
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(nearest);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn pose() -> impl Strategy<Value = Isometry3<f64>> {
        (prop::array::uniform3(-3.0..3.0_f64), prop::array::uniform3(-1.8..1.8_f64))
            .prop_map(|(shift, turn)| Isometry3::new(Vector3::from(shift), Vector3::from(turn)))
    }

    proptest! {
        #[test]
        fn a_pose_comes_back_from_its_corners(pose in pose(), radius in 0.001..10.0_f64) {
            let body = Tetrahedron { radius };
            let points = body.points(&pose);
            let found = Tetrahedron::of_points(&points).unwrap();
            prop_assert!((found.radius - radius).abs() < 1e-12 * (1.0 + radius) * 10.0);
            let back = found.pose(&points).unwrap();
            prop_assert!((back.translation.vector - pose.translation.vector).norm() < 1e-10);
            prop_assert!(back.rotation.angle_to(&pose.rotation) < 1e-7);
        }

        #[test]
        fn the_mounting_is_found_where_the_flange_turns(
            flanges in prop::collection::vec(pose(), 6..20),
            station in pose(),
            body in pose(),
        ) {
            let pairs: Vec<_> = flanges.iter().map(|flange| (*flange, station * flange * body)).collect();
            let found = mounting(&pairs).unwrap();
            prop_assert!((found.translation.vector - body.translation.vector).norm() < 1e-6);
            prop_assert!(found.rotation.angle_to(&body.rotation) < 1e-6);
        }
    }

    #[test]
    fn a_flange_that_turns_about_one_axis_does_not_show_the_mounting() {
        let flange =
            |step: i32| Isometry3::new(Vector3::new(f64::from(step), 0.3, 0.0), Vector3::z() * f64::from(step) * 0.3);
        let pairs: Vec<_> = (0..12).map(|step| (flange(step), flange(step))).collect();
        assert_eq!(mounting(&pairs), None);
        assert_eq!(mounting(&[]), None);
    }

    /// Corners with independent errors show position and rotation with exactly the stated standard deviations, without correlation.
    #[test]
    fn corners_carry_the_position_and_the_rotation_with_their_own_errors() {
        let (position, rotation) = (30e-6, 120e-6);
        let body = Tetrahedron::of_sigmas(position, rotation).unwrap();
        let sigma = body.corner_sigma(position, rotation);
        let pose = Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.4, 1.1, -0.7));
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        let count = 20_000;
        let mut squares = SMatrix::<f64, 6, 6>::zeros();
        for _ in 0..count {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let points = body.points(&pose).map(|point| point + Vector3::from_fn(|_, _| sigma * normal()));
            let found = body.pose(&points).unwrap();
            let turn = (found.rotation * pose.rotation.inverse()).scaled_axis() / rotation;
            let shift = (found.translation.vector - pose.translation.vector) / position;
            let error = SVector::<f64, 6>::from_iterator(shift.iter().chain(turn.iter()).copied());
            squares += error * error.transpose() / f64::from(count);
        }
        let off = (squares - SMatrix::<f64, 6, 6>::identity()).amax();
        // Four standard deviations of a variance from so many tries.
        assert!(off < 4.0 * (2.0 / f64::from(count)).sqrt(), "{squares}");
    }
}
