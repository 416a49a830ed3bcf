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
use crate::units::{MICROMETRE, MICRORADIAN};

/// Size of joint curves that is expected before anything was measured (rad, rms): between those of a light and of a heavy arm.
pub const EXPECTED_CURVES: f64 = 100.0 * MICRORADIAN;
/// What arms scatter by from pose to pose (m), beside the instrument.
pub const REPEATABILITY: f64 = 20.0 * MICROMETRE;
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

#[cfg(test)]
mod tests {
    use super::super::{JointBox, random};
    use super::*;
    use crate::identification::Terms;
    use crate::profile::{Level, Profile, builtin};

    const SIGMA: f64 = 30.0 * MICROMETRE;

    /// A pool, its fresh poses, and what scores sets of it.
    struct Case {
        arm: Arm,
        pool: Vec<Place>,
        fresh: Vec<Place>,
        information: Information,
    }

    fn case() -> Case {
        let (profile, _) = Profile::parse(builtin("ur5").unwrap(), "").unwrap();
        let ranges = JointBox::new(vec![(-2.5, 2.5); 6]).unwrap();
        let places = |seed, count| -> Vec<Place> {
            random(&ranges, seed).take(count).map(|configuration| Place { configuration, target: 0 }).collect()
        };
        let (arm, pool, fresh) = (profile.arm(), places(1, 120), places(2, 50));
        let information = Information::new(&arm, &profile.parameters(Level::Geometric), &pool, &fresh).unwrap();
        Case { arm, pool, fresh, information }
    }

    #[test]
    fn without_terms_it_is_the_predicted_error_of_the_geometry() {
        let Case { arm, pool, fresh, information } = case();
        let model = TermModel::new(&information, &arm, Vec::new(), &fresh);
        let set: Vec<usize> = (0..60).collect();
        let predicted = model.predicted_rms(&set, &pool[..60], SIGMA).unwrap();
        let geometric = SIGMA * information.predicted_error(&set).unwrap();
        // The prior of the geometry tells next to nothing.
        assert!(predicted <= geometric && predicted > 0.99 * geometric, "{predicted} {geometric}");
    }

    #[test]
    fn it_is_what_all_parameters_together_give() {
        let Case { arm, pool, fresh, information } = case();
        let terms = Terms::all(1e-4).parameters(&arm.chain);
        let model = TermModel::new(&information, &arm, terms.clone(), &fresh);
        let set: Vec<usize> = (20..60).collect();
        let predicted = model.predicted_rms(&set, &pool[20..60], SIGMA).unwrap();

        let stacked = |places: &[Place], geometry: DMatrix<f64>| {
            let terms = columns(&arm, &terms, places);
            let mut all = DMatrix::zeros(geometry.nrows() + terms.nrows(), geometry.ncols());
            all.rows_mut(0, geometry.nrows()).copy_from(&geometry);
            all.rows_mut(geometry.nrows(), terms.nrows()).copy_from(&terms);
            all
        };
        let width = information.width();
        let rows: Vec<f64> = set.iter().flat_map(|&candidate| information.rows(candidate).to_vec()).collect();
        let measured = stacked(&pool[20..60], DMatrix::from_column_slice(width, 3 * set.len(), &rows));
        let fresh = stacked(&fresh, information.fresh_columns().clone_owned());
        let mut precision = &measured * measured.transpose() / (SIGMA * SIGMA);
        for parameter in (0..information.rank()).chain(width..precision.nrows()) {
            precision[(parameter, parameter)] += 1.0;
        }
        let covariance = precision.cholesky().unwrap().inverse();
        let variance = (fresh.transpose() * covariance * &fresh).trace() / 50.0;
        assert!((predicted / variance.sqrt() - 1.0).abs() < 1e-6, "{predicted} {}", variance.sqrt());
    }

    #[test]
    fn more_poses_predict_better_and_terms_cost() {
        let Case { arm, pool, fresh, information } = case();
        let of = |terms: Terms, count: usize| {
            let model = TermModel::new(&information, &arm, terms.parameters(&arm.chain), &fresh);
            model.predicted_rms(&(0..count).collect::<Vec<_>>(), &pool[..count], SIGMA).unwrap()
        };
        let all = Terms::all(1e-4);
        assert!(of(all, 100) < of(all, 60) && of(all, 60) < of(all, 40));
        let smooth = Terms { curves: None, ..all };
        assert!(of(Terms::default(), 60) < of(smooth, 60) && of(smooth, 60) < of(all, 60));
        let model = TermModel::new(&information, &arm, Vec::new(), &fresh);
        assert_eq!(model.predicted_rms(&[], &[], SIGMA), None);
    }
}
