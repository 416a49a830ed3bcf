//! Exchanges judged by the information matrix `M = Σ GᵀG`: predicted error and D-criterion, with rank-3 updates.
//!
//! With `P = M⁻¹` of the other poses and `K = G P Gᵀ`, `N = G P W P Gᵀ` (3 × 3) of a candidate, taking it in makes
//! `ln det M` larger by `ln det(I + K)` and `trace(M⁻¹ W)` smaller by `trace((I + K)⁻¹ N)` (Woodbury). All candidates of a
//! block are multiplied at once.

use nalgebra::{DMatrix, DMatrixView, Matrix3};

use super::information::Information;
use super::score::log_det;

/// Candidates per product: the blocks stay in the second cache.
const BLOCK: usize = 64;

/// The information of a set, ready to judge one more pose.
#[derive(Clone, Debug)]
pub(super) struct Prediction {
    /// `[P; P W P]`, 2m × m.
    stacked: DMatrix<f64>,
    /// `trace(P W)`.
    variance: f64,
    /// `ln det M`.
    log_det: f64,
}

/// What the information matrix of a set says about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Merit {
    /// `ln det M`, in units of 1 mm, see [`super::Score::log_det`].
    pub(super) log_det: f64,
    /// `trace(M⁻¹ W)`: its square root is the predicted error.
    pub(super) variance: f64,
}

impl Merit {
    /// Of a set without information.
    pub(super) const NONE: Self = Self { log_det: f64::NEG_INFINITY, variance: f64::INFINITY };

    /// Of the information matrix `matrix`, from scratch.
    pub(super) fn new(information: &Information, matrix: DMatrix<f64>) -> Self {
        matrix.cholesky().map_or(Self::NONE, |factor| Self {
            log_det: log_det(factor.l_dirty()),
            variance: factor.inverse().dot(information.fresh()).max(0.0),
        })
    }

    /// RMS error at fresh poses per σ.
    pub(super) fn predicted_error(&self) -> f64 {
        self.variance.sqrt()
    }
}

impl Prediction {
    /// Of the information matrix `matrix` (m × m); `None` if it is singular.
    pub(super) fn new(information: &Information, matrix: DMatrix<f64>) -> Option<Self> {
        let width = information.width();
        let factor = matrix.cholesky()?;
        let inverse = factor.inverse();
        let weighted = &inverse * information.fresh();
        let variance = weighted.trace();
        let mut stacked = DMatrix::zeros(2 * width, width);
        stacked.rows_mut(0, width).copy_from(&inverse);
        stacked.rows_mut(width, width).copy_from(&(weighted * &inverse));
        Some(Self { stacked, variance, log_det: log_det(factor.l_dirty()) })
    }

    /// Calls `visit` with the merit of the set with each of `candidates` in it.
    pub(super) fn with_each(
        &self,
        information: &Information,
        candidates: &[usize],
        mut visit: impl FnMut(usize, Merit),
    ) {
        let width = information.width();
        let mut gathered = vec![0.0; 3 * width * BLOCK];
        let mut product = DMatrix::zeros(2 * width, 3 * BLOCK);
        for block in candidates.chunks(BLOCK) {
            for (target, &candidate) in gathered.chunks_mut(3 * width).zip(block) {
                target.copy_from_slice(information.rows(candidate));
            }
            let count = 3 * block.len();
            let columns = DMatrixView::from_slice(&gathered[..width * count], width, count);
            product.columns_mut(0, count).gemm(1.0, &self.stacked, &columns, 0.0);
            let products = product.as_slice().chunks(6 * width);
            for ((&candidate, rows), products) in block.iter().zip(gathered.chunks(3 * width)).zip(products) {
                visit(candidate, self.with(rows, products, width));
            }
        }
    }

    /// From `G` (three rows) and the columns `[P; P W P] Gᵀ`.
    fn with(&self, rows: &[f64], products: &[f64], width: usize) -> Merit {
        let mut k = Matrix3::<f64>::identity();
        let mut n = Matrix3::<f64>::zeros();
        for i in 0..3 {
            let row = &rows[width * i..width * (i + 1)];
            for j in 0..=i {
                let (p, q) = products[2 * width * j..2 * width * (j + 1)].split_at(width);
                k[(i, j)] += dot(row, p);
                n[(i, j)] = dot(row, q);
            }
        }
        k.fill_upper_triangle_with_lower_triangle();
        n.fill_upper_triangle_with_lower_triangle();
        // I + K is at least the identity: the inverse exists.
        let inverse = k.try_inverse().unwrap_or_else(Matrix3::zeros);
        Merit {
            log_det: self.log_det + k.determinant().ln(),
            variance: (self.variance - inverse.component_mul(&n).sum()).max(0.0),
        }
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four running sums, so that the additions need not wait for each other.
    let mut sums = [0.0; 4];
    let (a_chunks, b_chunks) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a_chunks.remainder().iter().zip(b_chunks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_chunks.zip(b_chunks) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Adds `sign · GᵀG` of a candidate to an information matrix.
pub(super) fn add_pose(information: &Information, matrix: &mut DMatrix<f64>, candidate: usize, sign: f64) {
    let width = information.width();
    let columns = DMatrixView::from_slice(information.rows(candidate), width, 3);
    matrix.gemm(sign, &columns, &columns.transpose(), 1.0);
}

#[cfg(test)]
mod tests {
    use super::super::information::tests::pool;
    use super::*;

    #[test]
    fn updates_equal_the_merit_from_scratch() {
        let information = pool(300);
        let set: Vec<usize> = (0..30).collect();
        let mut others = information.sum(&set);
        add_pose(&information, &mut others, 7, -1.0);
        let prediction = Prediction::new(&information, others).unwrap();
        let candidates: Vec<usize> = (30..300).chain([7]).collect();
        let mut seen = 0;
        prediction.with_each(&information, &candidates, |candidate, merit| {
            let mut set = set.clone();
            set[7] = candidate;
            let scratch = Merit::new(&information, information.sum(&set));
            assert!((merit.variance / scratch.variance - 1.0).abs() < 1e-9, "{merit:?} {scratch:?}");
            assert!((merit.log_det - scratch.log_det).abs() < 1e-9, "{merit:?} {scratch:?}");
            seen += 1;
        });
        assert_eq!(seen, candidates.len());
    }
}
