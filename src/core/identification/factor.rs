//! Cholesky factor of a normal matrix in blocks, so that the work of the larger ones (hundreds of parameters) is matrix products.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Columns per block.
const BLOCK: usize = 48;

/// `L⁻¹` of a symmetric positive definite matrix `L Lᵀ`.
#[derive(Clone, Debug)]
pub struct Factor {
    inverse: DMatrix<f64>,
}

impl Factor {
    /// `None` if the matrix is not positive definite.
    pub fn new(mut matrix: DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let mut diagonal = Vec::with_capacity(n.div_ceil(BLOCK));
        for start in (0..n).step_by(BLOCK) {
            let size = BLOCK.min(n - start);
            let block = matrix.view((start, start), (size, size)).clone_owned();
            let lower = Cholesky::<f64, Dyn>::new(block)?.unpack();
            let inverse = lower.solve_lower_triangular(&DMatrix::identity(size, size))?;
            let below = start + size;
            if below < n {
                let panel = matrix.view((below, start), (n - below, size)) * inverse.transpose();
                for column in (below..n).step_by(BLOCK) {
                    let width = BLOCK.min(n - column);
                    let rows = panel.rows(column - below, n - column);
                    let columns = panel.rows(column - below, width).transpose();
                    matrix.view_mut((column, column), (n - column, width)).gemm(-1.0, &rows, &columns, 1.0);
                }
                matrix.view_mut((below, start), (n - below, size)).copy_from(&panel);
            }
            diagonal.push(inverse);
        }
        let mut inverse = DMatrix::zeros(n, n);
        for (block, of_diagonal) in diagonal.iter().enumerate() {
            let start = block * BLOCK;
            let size = of_diagonal.nrows();
            if start > 0 {
                let left = matrix.view((start, 0), (size, start)) * inverse.view((0, 0), (start, start));
                inverse.view_mut((start, 0), (size, start)).gemm(-1.0, of_diagonal, &left, 0.0);
            }
            inverse.view_mut((start, start), (size, size)).copy_from(of_diagonal);
        }
        Some(Self { inverse })
    }

    /// `M⁻¹ b`.
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.inverse.tr_mul(&(&self.inverse * right))
    }

    /// Rows of `M`.
    pub fn size(&self) -> usize {
        self.inverse.nrows()
    }

    /// Trace of `M⁻¹`.
    pub fn inverse_trace(&self) -> f64 {
        self.inverse.norm_squared()
    }

    /// `L⁻¹ B`: the square sum of a column `b` is `bᵀ M⁻¹ b`.
    pub fn whiten(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        &self.inverse * right
    }

    /// `M⁻¹`.
    pub fn inverse(&self) -> DMatrix<f64> {
        self.inverse.transpose() * &self.inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_give_the_inverse() {
        for n in [0, 1, 3, 47, 48, 49, 130] {
            let rows = DMatrix::from_fn(n + 5, n, |i, j| ((i * 31 + j * 17) as f64).sin());
            let matrix = rows.tr_mul(&rows) + DMatrix::identity(n, n);
            let factor = Factor::new(matrix.clone()).unwrap();
            let inverse = factor.inverse();
            assert!((&matrix * &inverse - DMatrix::identity(n, n)).amax_or_zero() < 1e-9, "{n}");
            assert!((inverse.trace() - factor.inverse_trace()).abs() < 1e-9 * (1.0 + inverse.trace()));
            let right = DVector::from_fn(n, |i, _| i as f64);
            assert!((&matrix * factor.solve(&right) - &right).norm() < 1e-7 * (1.0 + right.norm()));
        }
        assert!(Factor::new(-DMatrix::identity(60, 60)).is_none());
    }

    trait AmaxOrZero {
        fn amax_or_zero(&self) -> f64;
    }

    impl AmaxOrZero for DMatrix<f64> {
        fn amax_or_zero(&self) -> f64 {
            self.iter().fold(0.0, |largest, value| f64::max(largest, value.abs()))
        }
    }
}
