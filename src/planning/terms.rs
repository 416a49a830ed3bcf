//! Predicted error of complete sets with the errors of the joints that are identified beside the geometry: compliance, tilt,
//! harmonics and curves with their priors.
//!
//! These are hundreds of parameters, too many for the exchange of single poses, but a set has only three coordinates per pose.
//! With the terms in units of their priors, `L` their columns at the poses of the set and `L_f` at a fresh pose, what they do
//! to the measurements is noise of covariance `K = L Lᵀ + σ² I`, 3M × 3M. The geometry and the frame are estimated under that noise:
//!
//! `variance at a fresh pose = |L_f|² − k K⁻¹ kᵀ + R C Rᵀ`, `k = L_f Lᵀ`, `C = (Gᵀ K⁻¹ G + I)⁻¹`, `R = G_f − k K⁻¹ G`,
//!
//! I the prior of the geometry (not of the frame). This is exact for the linear model, and the same as with all parameters in one
//! information matrix.

use nalgebra::DMatrix;

use super::information::Information;
use crate::identification::Factor;
use crate::kinematics::{Arm, FreeParameter, IdentificationJacobian, Place};

/// Fresh poses over which the error is averaged: it differs by less than one per cent from that over all of them.
const FRESH: usize = 300;

/// Terms of joint errors beside the geometry of an [`Information`].
#[derive(Clone, Debug)]
pub struct TermModel<'a> {
    information: &'a Information,
    arm: &'a Arm,
    terms: Vec<FreeParameter>,
    /// Columns of the terms at the fresh poses, terms × 3F (m).
    fresh: DMatrix<f64>,
}

impl<'a> TermModel<'a> {
    /// With `terms` as parameters of `arm`. `fresh` are the fresh poses of `information`.
    pub fn new(information: &'a Information, arm: &'a Arm, terms: Vec<FreeParameter>, fresh: &[Place]) -> Self {
        let count = FRESH.min(fresh.len()).min(information.fresh_columns().ncols() / 3);
        let fresh = columns(arm, &terms, &fresh[..count]);
        Self { information, arm, terms, fresh }
    }

    /// Predicted RMS position error (m) at fresh poses from measuring at the candidates `set`, whose places are `places`, where a
    /// coordinate scatters by `sigma` (m), priors counted; `None` if the set cannot be scored.
    pub fn predicted_rms(&self, set: &[usize], places: &[Place], sigma: f64) -> Option<f64> {
        let width = self.information.width();
        let count = 3 * set.len();
        let rows = columns(self.arm, &self.terms, places);
        let mut covariance = rows.tr_mul(&rows);
        if covariance.nrows() != count || count == 0 {
            return None;
        }
        for coordinate in 0..count {
            covariance[(coordinate, coordinate)] += sigma * sigma;
        }
        let factor = Factor::new(covariance)?;
        let mut geometry = DMatrix::zeros(count, width);
        for (pose, &candidate) in set.iter().enumerate() {
            for (axis, row) in self.information.rows(candidate).chunks(width).enumerate() {
                geometry.row_mut(3 * pose + axis).copy_from_slice(row);
            }
        }
        let geometry = factor.whiten(&geometry);
        let common = factor.whiten(&rows.tr_mul(&self.fresh));
        let mut precision = geometry.tr_mul(&geometry);
        for parameter in 0..self.information.rank() {
            precision[(parameter, parameter)] += 1.0;
        }
        let fresh = self.information.fresh_columns();
        let rest = fresh.columns(0, self.fresh.ncols()) - geometry.tr_mul(&common);
        let by_geometry = Factor::new(precision)?.whiten(&rest).norm_squared();
        let by_terms = self.fresh.norm_squared() - common.norm_squared();
        let poses = (self.fresh.ncols() / 3).max(1) as f64;
        Some(((by_terms + by_geometry).max(0.0) / poses).sqrt()).filter(|error| error.is_finite())
    }
}

/// Columns of `terms` in units of their priors at `places`: x, y, z of each, terms × 3N (m).
fn columns(arm: &Arm, terms: &[FreeParameter], places: &[Place]) -> DMatrix<f64> {
    let n = terms.len();
    let arm = arm.prepared();
    let ids: Vec<_> = terms.iter().map(|term| term.id).collect();
    let mut jacobian = IdentificationJacobian::new(&ids);
    let mut columns = DMatrix::zeros(n, 3 * places.len());
    if n == 0 {
        return columns;
    }
    for (place, rows) in places.iter().zip(columns.as_mut_slice().chunks_mut(3 * n)) {
        jacobian.at(&arm, place, rows);
        for row in rows.chunks_mut(n) {
            for (value, term) in row.iter_mut().zip(terms) {
                *value *= term.expected;
            }
        }
    }
    columns
}
