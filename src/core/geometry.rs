//! Rigid registration of two point sets, and how points are spread in space.
//!
//! Points in metres. `to_from_from` maps coordinates of the first set into the frame of the second.

use nalgebra::{
    Isometry3, Matrix3, Matrix4, Point3, Quaternion, SymmetricEigen, Translation3, UnitQuaternion, Vector3,
};

/// The rigid motion that brings one point set onto another with the least weighted square error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// Maps the first set into the frame of the second.
    pub to_from_from: Isometry3<f64>,
    /// Weighted mean of the first set.
    pub centroid_from: Point3<f64>,
    /// Root mean square of what is left (m), weighted.
    pub rms: f64,
}

/// Registers pairs `(weight, from, to)` by Horn's quaternion method (Horn 1987, "Closed-form solution of absolute orientation
/// using unit quaternions"): the rotation is the eigenvector of the largest eigenvalue of a 4 × 4 matrix. A proper rotation
/// always comes out, also for mirrored data.
///
/// Returns `None` without a positive total weight.
pub fn register(pairs: impl Iterator<Item = (f64, Point3<f64>, Point3<f64>)> + Clone) -> Option<Registration> {
    let (mut total, mut sum_from, mut sum_to) = (0.0, Vector3::zeros(), Vector3::zeros());
    for (weight, from, to) in pairs.clone() {
        total += weight;
        sum_from += from.coords * weight;
        sum_to += to.coords * weight;
    }
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let (mean_from, mean_to) = (sum_from / total, sum_to / total);
    let mut cross = Matrix3::zeros();
    for (weight, from, to) in pairs.clone() {
        cross += (from.coords - mean_from) * (to.coords - mean_to).transpose() * weight;
    }
    let rotation = horn_rotation(&cross);
    let translation = Translation3::from(mean_to - rotation * mean_from);
    let to_from_from = Isometry3::from_parts(translation, rotation);
    let square: f64 = pairs.map(|(weight, from, to)| weight * (to - to_from_from * from).norm_squared()).sum();
    Some(Registration { to_from_from, centroid_from: Point3::from(mean_from), rms: (square / total).sqrt() })
}

/// The rotation that maximises `trace(R · cross)` for `cross = Σ w from toᵀ` of centred points.
fn horn_rotation(cross: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let s = cross;
    let trace = s.trace();
    let skew = Vector3::new(s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)]);
    let block = s + s.transpose() - Matrix3::identity() * trace;
    let mut horn = Matrix4::zeros();
    horn[(0, 0)] = trace;
    horn.fixed_view_mut::<3, 1>(1, 0).copy_from(&skew);
    horn.fixed_view_mut::<1, 3>(0, 1).copy_from(&skew.transpose());
    horn.fixed_view_mut::<3, 3>(1, 1).copy_from(&block);
    let eigen = SymmetricEigen::new(horn);
    let best = eigen.eigenvalues.imax();
    let vector = eigen.eigenvectors.column(best);
    UnitQuaternion::from_quaternion(Quaternion::new(vector[0], vector[1], vector[2], vector[3]))
}

/// How many times longer something of length `largest` is drawn so that it is about `shown` long, in the same unit: 1, 2 or 5
/// times a power of ten, not longer than that unless it is already, and at least 1.
pub fn enlargement(largest: f64, shown: f64) -> f64 {
    let factor = shown / largest;
    if !factor.is_finite() || factor < 1.0 {
        return 1.0;
    }
    let power = 10_f64.powf(factor.log10().floor());
    [5.0, 2.0].into_iter().map(|step| step * power).find(|round| *round <= factor).unwrap_or(power)
}

/// Root mean square spread of points along their principal axes (m), largest first: `(0.5, 0.3, 0.0)` is a flat set.
pub fn principal_spread<'a>(points: impl Iterator<Item = &'a Point3<f64>> + Clone) -> [f64; 3] {
    let count = points.clone().count();
    if count == 0 {
        return [0.0; 3];
    }
    let mean = points.clone().fold(Vector3::zeros(), |sum, point| sum + point.coords) / count as f64;
    let scatter = points.fold(Matrix3::zeros(), |sum, point| {
        let centred = point.coords - mean;
        sum + centred * centred.transpose()
    }) / count as f64;
    let mut variances: [f64; 3] = SymmetricEigen::new(scatter).eigenvalues.into();
    variances.sort_by(|a, b| b.total_cmp(a));
    variances.map(|variance| variance.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-2.0..2.0_f64).prop_map(Point3::from)
    }

    #[test]
    fn an_enlargement_is_round_and_never_below_one() {
        let shown = [(10.0, 500.0), (0.01, 500.0), (3.0, 500.0), (5000.0, 500.0), (0.0, 500.0), (f64::NAN, 0.25)];
        assert_eq!(
            shown.map(|(largest, shown)| enlargement(largest, shown)).to_vec(),
            [50.0, 50_000.0, 100.0, 1.0, 1.0, 1.0]
        );
    }

    proptest! {
        #[test]
        fn registration_finds_the_motion_that_made_the_data(
            points in prop::collection::vec(point(), 4..20),
            axis in prop::array::uniform3(-3.0..3.0_f64),
            shift in prop::array::uniform3(-10.0..10.0_f64),
        ) {
            prop_assume!(principal_spread(points.iter())[1] > 0.05);
            let motion = Isometry3::new(Vector3::from(shift), Vector3::from(axis));
            let found = register(points.iter().map(|p| (1.0, *p, motion * p))).unwrap();
            prop_assert!(found.rms < 1e-12);
            for p in &points {
                prop_assert!((found.to_from_from * p - motion * p).norm() < 1e-12);
            }
        }

        #[test]
        fn registration_cannot_be_improved_by_a_small_motion(
            pairs in prop::collection::vec((0.1..2.0_f64, point(), point()), 5..20),
            axis in prop::array::uniform3(-1e-3..1e-3_f64),
            shift in prop::array::uniform3(-1e-3..1e-3_f64),
        ) {
            let best = register(pairs.iter().copied()).unwrap();
            let other = Isometry3::new(Vector3::from(shift), Vector3::from(axis)) * best.to_from_from;
            let cost = |motion: &Isometry3<f64>| -> f64 {
                pairs.iter().map(|(w, a, b)| w * (b - motion * a).norm_squared()).sum()
            };
            prop_assert!(cost(&best.to_from_from) <= cost(&other) + 1e-12);
        }
    }

    #[test]
    fn a_mirrored_set_leaves_a_residual() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point3::from);
        let mirrored = |p: &Point3<f64>| Point3::new(-p.x, p.y, p.z);
        let found = register(points.iter().map(|p| (1.0, *p, mirrored(p)))).unwrap();
        assert!(found.rms > 0.1);
    }

    #[test]
    fn spread_of_a_flat_set_has_a_zero() {
        let points = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, -0.5, 0.0]].map(Point3::from);
        let spread = principal_spread(points.iter());
        assert!((spread[0] - 0.5_f64.sqrt()).abs() < 1e-12 && (spread[1] - 0.125_f64.sqrt()).abs() < 1e-12);
        assert!(spread[2] < 1e-9);
    }
}
