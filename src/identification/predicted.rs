//! What the covariance of the parameters means for positions.

use nalgebra::{DMatrix, Matrix3, Matrix6, Matrix6xX, Point3, SMatrix, Vector3};

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

/// How uncertain positions are anywhere, in the frame that some measured places define: what only moves the whole arm is no error,
/// but what moves those places is made up for by the frame, which takes other places along.
#[derive(Clone, Debug)]
pub struct Predictor<'a> {
    found: &'a Identification,
    ids: Vec<ParameterId>,
    /// Middle of the places (m).
    centre: Point3<f64>,
    /// How shift and turn of the frame follow the parameters, 6 × n.
    response: Matrix6xX<f64>,
    /// Covariance of shift (m) and turn (rad) of the frame from the noise of the places.
    frame: Matrix6<f64>,
}

impl<'a> Predictor<'a> {
    /// For the frame that the measured `places` define; `None` if they do not define one.
    pub fn new(found: &'a Identification, places: &[&Place]) -> Option<Self> {
        let ids: Vec<ParameterId> = found.estimates.iter().map(|estimate| estimate.id).collect();
        let points = found.arm.points_in_base(places.iter().copied());
        let centre = Point3::from(points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64);
        let rows = jacobian(&found.arm, &ids, places);
        let mut information = Matrix6::zeros();
        let mut projected = Matrix6xX::zeros(ids.len());
        for (index, point) in points.iter().enumerate() {
            let motion = motion(&(point - centre));
            information += motion.transpose() * motion;
            projected += motion.transpose() * rows.rows(3 * index, 3);
        }
        let inverse = information.try_inverse().filter(|inverse| inverse.iter().all(|value| value.is_finite()))?;
        let response = inverse * projected;
        Some(Self { found, ids, centre, response, frame: inverse * found.sigma.used.powi(2) })
    }

    /// Covariance of the position at each of `places` (m²).
    pub fn covariances(&self, places: &[&Place]) -> Vec<Matrix3<f64>> {
        let points = self.found.arm.points_in_base(places.iter().copied());
        let mut rows = jacobian(&self.found.arm, &self.ids, places);
        let motions: Vec<SMatrix<f64, 3, 6>> = points.iter().map(|point| motion(&(point - self.centre))).collect();
        for (index, motion) in motions.iter().enumerate() {
            let moved = motion * &self.response;
            let mut rows = rows.rows_mut(3 * index, 3);
            rows -= moved;
        }
        let product = &rows * &self.found.covariance;
        motions
            .iter()
            .enumerate()
            .map(|(index, motion)| {
                let own = product.rows(3 * index, 3) * rows.rows(3 * index, 3).transpose();
                let own = Matrix3::from_fn(|i, j| f64::midpoint(own[(i, j)], own[(j, i)]));
                own + motion * self.frame * motion.transpose()
            })
            .collect()
    }
}

/// Derivative of a point at `arm` from the centre by shift and turn.
fn motion(arm: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut motion = SMatrix::<f64, 3, 6>::zeros();
    motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&arm.cross_matrix().transpose());
    motion
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
    let centre = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let mut motions = DMatrix::zeros(3 * points.len(), MOTIONS);
    for (index, point) in points.iter().enumerate() {
        motions.fixed_view_mut::<3, MOTIONS>(3 * index, 0).copy_from(&motion(&(point.coords - centre)));
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
