//! All pairs of measured points as rows `u_jk · (B_k − B_j)`, equations (10)–(16) and (21)–(23) of the method paper,
//! without ever storing a row per pair.
//!
//! With `C_k = Σ_j w u_jk r_jk` (3 × n, the rows that point k takes part in, seen from k) the Gram matrix of all rows is
//! `Σ_k B_kᵀ C_k`, and the covariance of the gradient for independent *points* (not pairs) is `Σ_k σ_k² C_kᵀ C_k`: memory
//! grows with the points, not with the pairs.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

/// Points closer than this (m) have no usable direction between them.
pub(crate) const SAME_POINT: f64 = 1e-6;

/// One point of a pair problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairPoint<'a> {
    /// Predicted position in the base (m).
    pub(crate) predicted: Point3<f64>,
    /// Measured position in the frame of its station (m).
    pub(crate) measured: Point3<f64>,
    /// Jacobian, `3 n` numbers.
    pub(crate) rows: &'a [f64],
    /// Factor of this point in the weight of its pairs.
    pub(crate) trust: f64,
    /// Points of one group share what their pose has in common.
    pub(crate) group: usize,
    /// Variance of a coordinate (m²), beside what the group has in common.
    pub(crate) variance: f64,
}

/// Sums over all pairs of one station.
#[derive(Clone, Debug)]
pub(crate) struct PairSums {
    /// `Σ w rᵀ r`.
    pub(crate) gram: DMatrix<f64>,
    /// `Σ w rᵀ Δl`.
    pub(crate) gradient: DVector<f64>,
    /// `Σ w Δl²`.
    pub(crate) cost: f64,
    /// Covariance of `gradient` for independent poses.
    pub(crate) gradient_covariance: DMatrix<f64>,
}

/// Sums over all pairs `j < k`, each with weight `weight · trust_j · trust_k`. `common` is the variance of what the points of a
/// group have in common (m²).
pub(crate) fn pair_sums(points: &[PairPoint<'_>], n: usize, weight: f64, common: f64) -> PairSums {
    let mut combined = vec![0.0; 3 * n * points.len()];
    let mut pull = vec![Vector3::zeros(); points.len()];
    let mut row = vec![0.0; n];
    let mut cost = 0.0;
    for (k, to) in points.iter().enumerate().skip(1) {
        let (earlier, own) = combined.split_at_mut(3 * n * k);
        let own = &mut own[..3 * n];
        for (j, from) in points[..k].iter().enumerate() {
            let difference = to.predicted - from.predicted;
            let predicted = difference.norm();
            let w = weight * from.trust * to.trust;
            if predicted < SAME_POINT || w <= 0.0 {
                continue;
            }
            let u = difference / predicted;
            let error = (to.measured - from.measured).norm() - predicted;
            cost += w * error * error;
            pull[k] += u * (w * error);
            pull[j] -= u * (w * error);
            pair_row(&u, from.rows, to.rows, &mut row);
            accumulate(&(u * w), &row, own, &mut earlier[3 * n * j..3 * n * (j + 1)]);
        }
    }
    let mut sums = PairSums {
        gram: DMatrix::zeros(n, n),
        gradient: DVector::zeros(n),
        cost,
        gradient_covariance: DMatrix::zeros(n, n),
    };
    let mut of_groups = BTreeMap::new();
    for (index, point) in points.iter().enumerate() {
        let combined = DMatrix::from_column_slice(n, 3, &combined[3 * n * index..3 * n * (index + 1)]);
        let jacobian = DMatrix::from_column_slice(n, 3, point.rows);
        sums.gram.gemm(1.0, &jacobian, &combined.transpose(), 1.0);
        sums.gradient.gemv(1.0, &jacobian, &pull[index], 1.0);
        sums.gradient_covariance.gemm(point.variance, &combined, &combined.transpose(), 1.0);
        if common > 0.0 {
            *of_groups.entry(point.group).or_insert_with(|| DMatrix::zeros(n, 3)) += combined;
        }
    }
    for combined in of_groups.values() {
        sums.gradient_covariance.gemm(common, combined, &combined.transpose(), 1.0);
    }
    sums
}

/// `row = u · (to − from)`.
#[inline]
fn pair_row(u: &Vector3<f64>, from: &[f64], to: &[f64], row: &mut [f64]) {
    let n = row.len();
    let (fx, rest) = from.split_at(n);
    let (fy, fz) = rest.split_at(n);
    let (tx, rest) = to.split_at(n);
    let (ty, tz) = rest.split_at(n);
    let (fz, tz) = (&fz[..n], &tz[..n]);
    for c in 0..n {
        row[c] = u.x * (tx[c] - fx[c]) + u.y * (ty[c] - fy[c]) + u.z * (tz[c] - fz[c]);
    }
}

/// Adds `u ⊗ row` to one point and takes it from the other.
#[inline]
fn accumulate(u: &Vector3<f64>, row: &[f64], own: &mut [f64], other: &mut [f64]) {
    let n = row.len();
    for (axis, &factor) in u.iter().enumerate() {
        let own = &mut own[axis * n..(axis + 1) * n];
        let other = &mut other[axis * n..(axis + 1) * n];
        for c in 0..n {
            let value = factor * row[c];
            own[c] += value;
            other[c] -= value;
        }
    }
}
