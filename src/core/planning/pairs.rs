//! The Gram matrix of the pair rows `u_jk · (B_k − B_j) S V` of a set, equations (16), (21) and (23) of the method paper, kept up
//! to date while poses come and go: a pose brings the pairs it forms with all others, O(M·rank²).

use nalgebra::{DMatrix, DMatrixView, Vector3};

use super::information::Information;
use crate::identification::SAME_POINT;

/// Pairs whose rows are multiplied at once: they stay in the first cache.
const PAIRS: usize = 128;

/// Unit vector from one candidate to another; zero for points on top of each other, which have no distance to differentiate.
#[inline]
pub(super) fn direction(information: &Information, from: usize, to: usize) -> Vector3<f64> {
    let difference = information.point(to) - information.point(from);
    let length = difference.norm();
    if length < SAME_POINT { Vector3::zeros() } else { difference / length }
}

/// Gram matrix of all pairs of a set, rank × rank (m²).
pub(super) fn pair_gram(information: &Information, set: &[usize]) -> DMatrix<f64> {
    let rank = information.rank();
    let mut sum = PairSum { gram: DMatrix::zeros(rank, rank), rows: vec![0.0; rank * PAIRS], filled: 0, sign: 1.0 };
    for (index, &candidate) in set.iter().enumerate() {
        sum.add(information, candidate, &set[..index]);
    }
    sum.finish()
}

/// Adds `sign` times the pairs of `candidate` with `others` to a Gram matrix.
pub(super) fn add_pairs(
    information: &Information,
    gram: &mut DMatrix<f64>,
    candidate: usize,
    others: &[usize],
    sign: f64,
) {
    let rows = vec![0.0; information.rank() * PAIRS.min(others.len())];
    let mut sum = PairSum { gram: std::mem::replace(gram, DMatrix::zeros(0, 0)), rows, filled: 0, sign };
    sum.add(information, candidate, others);
    *gram = sum.finish();
}

/// A Gram matrix to which rows are added, many at once.
#[derive(Debug)]
struct PairSum {
    gram: DMatrix<f64>,
    /// Rows that wait, rank numbers each.
    rows: Vec<f64>,
    filled: usize,
    sign: f64,
}

impl PairSum {
    fn add(&mut self, information: &Information, candidate: usize, others: &[usize]) {
        let (rank, width) = (information.rank(), information.width());
        let own = information.rows(candidate);
        let (ox, oy, oz) = (&own[..rank], &own[width..width + rank], &own[2 * width..2 * width + rank]);
        for &other in others {
            let u = direction(information, other, candidate);
            let their = information.rows(other);
            let (tx, ty, tz) = (&their[..rank], &their[width..width + rank], &their[2 * width..2 * width + rank]);
            let row = &mut self.rows[rank * self.filled..rank * (self.filled + 1)];
            for (column, value) in row.iter_mut().enumerate() {
                *value =
                    u.x * (ox[column] - tx[column]) + u.y * (oy[column] - ty[column]) + u.z * (oz[column] - tz[column]);
            }
            self.filled += 1;
            if rank * self.filled == self.rows.len() {
                self.multiply();
            }
        }
    }

    fn multiply(&mut self) {
        let rank = self.gram.nrows();
        let rows = DMatrixView::from_slice(&self.rows[..rank * self.filled], rank, self.filled);
        self.gram.gemm(self.sign, &rows, &rows.transpose(), 1.0);
        self.filled = 0;
    }

    fn finish(mut self) -> DMatrix<f64> {
        self.multiply();
        // Both triangles are sums of the same products, but not always in the same order.
        self.gram.fill_lower_triangle_with_upper_triangle();
        self.gram
    }
}
