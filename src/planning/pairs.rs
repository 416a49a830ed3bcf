//! The Gram matrix of the pair rows `u_jk · (B_k − B_j) S V` of a set, equations (16), (21) and (23) of the method paper, kept up
//! to date while poses come and go: a pose brings the pairs it forms with all others, O(M·rank²).

use nalgebra::{DMatrix, Vector3};

use super::information::Information;
use crate::identification::SAME_POINT;

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
    let mut gram = DMatrix::zeros(rank, rank);
    for (index, &candidate) in set.iter().enumerate() {
        add_upper(information, &mut gram, candidate, &set[..index], 1.0);
    }
    gram.fill_lower_triangle_with_upper_triangle();
    gram
}

/// Adds `sign` times the pairs of `candidate` with `others` to a Gram matrix.
pub(super) fn add_pairs(
    information: &Information,
    gram: &mut DMatrix<f64>,
    candidate: usize,
    others: &[usize],
    sign: f64,
) {
    add_upper(information, gram, candidate, others, sign);
    gram.fill_lower_triangle_with_upper_triangle();
}

/// The same for the upper triangle only.
fn add_upper(information: &Information, gram: &mut DMatrix<f64>, candidate: usize, others: &[usize], sign: f64) {
    let (rank, width) = (information.rank(), information.width());
    let own = information.rows(candidate);
    let (ox, oy, oz) = (&own[..rank], &own[width..width + rank], &own[2 * width..2 * width + rank]);
    let mut row = vec![0.0; rank];
    for &other in others {
        let u = direction(information, other, candidate);
        let their = information.rows(other);
        let (tx, ty, tz) = (&their[..rank], &their[width..width + rank], &their[2 * width..2 * width + rank]);
        for column in 0..rank {
            row[column] =
                u.x * (ox[column] - tx[column]) + u.y * (oy[column] - ty[column]) + u.z * (oz[column] - tz[column]);
        }
        for (column, target) in gram.as_mut_slice().chunks_mut(rank).enumerate() {
            let factor = sign * row[column];
            for (target, value) in target[..=column].iter_mut().zip(&row) {
                *target += factor * value;
            }
        }
    }
}
