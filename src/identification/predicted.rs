//! What the covariance of the parameters means for positions.

use nalgebra::{DMatrix, Matrix3};

use super::Identification;
use crate::kinematics::{Arm, IdentificationJacobian, ParameterId, Place};

/// Coordinates of a rigid motion.
const MOTIONS: usize = 6;

/// Covariance of each position in the base (m²) that the identified arm predicts at `places`, once the base is registered to
/// these very places: what only moves the whole arm is no error of it.
///
/// `J' Σ J'ᵀ` with the Jacobian of all places freed from rigid motions, `J' = J − Q Qᵀ J`, where Q spans the motions.
pub fn position_covariances(found: &Identification, places: &[&Place]) -> Vec<Matrix3<f64>> {
    let ids: Vec<ParameterId> = found.estimates.iter().map(|estimate| estimate.id).collect();
    let free = without_motions(jacobian(&found.arm, &ids, places), &found.arm, places);
    (0..places.len())
        .map(|place| {
            let rows = free.rows(3 * place, 3);
            let product = rows * &found.covariance * rows.transpose();
            Matrix3::from_fn(|row, column| f64::midpoint(product[(row, column)], product[(column, row)]))
        })
        .collect()
}

/// Derivatives of all positions by the parameters, three rows per place.
fn jacobian(arm: &Arm, ids: &[ParameterId], places: &[&Place]) -> DMatrix<f64> {
    let arm = arm.prepared();
    let mut evaluated = IdentificationJacobian::new(ids);
    let mut rows = vec![0.0; 3 * ids.len() * places.len()];
    if ids.is_empty() {
        return DMatrix::zeros(3 * places.len(), 0);
    }
    for (place, rows) in places.iter().zip(rows.chunks_mut(3 * ids.len())) {
        evaluated.at(&arm, place, rows);
    }
    DMatrix::from_row_slice(3 * places.len(), ids.len(), &rows)
}

/// The part of `jacobian` that no rigid motion of all places explains.
fn without_motions(jacobian: DMatrix<f64>, arm: &Arm, places: &[&Place]) -> DMatrix<f64> {
    let points = arm.points_in_base(places.iter().copied());
    let count = points.len().max(1) as f64;
    let centre = points.iter().fold(nalgebra::Vector3::zeros(), |sum, point| sum + point.coords) / count;
    let mut motions = DMatrix::zeros(3 * points.len(), MOTIONS);
    for (index, point) in points.iter().enumerate() {
        // Turning about the centre: a column of the cross product matrix.
        let turning = (point.coords - centre).cross_matrix().transpose();
        motions.fixed_view_mut::<3, 3>(3 * index, 0).copy_from(&Matrix3::identity());
        motions.fixed_view_mut::<3, 3>(3 * index, 3).copy_from(&turning);
    }
    if motions.nrows() < MOTIONS {
        // One point: every error of it is a motion.
        return DMatrix::zeros(jacobian.nrows(), jacobian.ncols());
    }
    let basis = motions.svd(true, false);
    let Some(u) = basis.u else { return jacobian };
    let largest = basis.singular_values.max();
    let spanned: Vec<usize> =
        (0..basis.singular_values.len()).filter(|&index| basis.singular_values[index] > 1e-9 * largest).collect();
    let q = u.select_columns(&spanned);
    &jacobian - &q * (q.transpose() * &jacobian)
}
