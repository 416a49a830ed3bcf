//! Exchanges judged by the singular values of the pair rows: condition number and O1–O5.
//!
//! An exact judgement of a candidate needs all its pair rows and an eigenvalue decomposition. Most candidates are turned down
//! before that by a bound that holds exactly. In the basis of eigenvectors `v_k` of the Gram matrix of the other poses:
//!
//! - the smallest eigenvalue of a symmetric matrix is at most that of any principal block, the largest at least any diagonal
//!   entry (Rayleigh–Ritz). The block of the lowest directions and the top direction of a candidate cost a third of the
//!   exact matrix, and a Cholesky factor tells whether the block lies above what would be needed;
//! - sums of concave functions of the eigenvalues are at most those of the diagonal (Schur–Horn): this bounds O1 and O5.

use nalgebra::{DMatrix, Vector3};

use super::choice::Objective;
use super::information::Information;
use super::pairs::{add_pairs, direction};
use super::score::ObservabilityIndices;

/// Directions that enter the bound: the lowest ones and, last, the top one. A multiple of the width of vector registers.
const LANES: usize = 8;

/// One number per direction of the bound.
type Lanes = [f64; LANES];

/// What is minimised, as a function of the eigenvalues of the pair rows' Gram matrix.
pub(super) fn spectral_cost(objective: Objective, eigenvalues: &[f64], poses: usize) -> f64 {
    let smallest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    if smallest <= 0.0 {
        return f64::INFINITY;
    }
    let indices = ObservabilityIndices::new(eigenvalues, poses);
    match objective {
        Objective::O1 => -indices.o1,
        Objective::O3 => -indices.o3,
        Objective::O4 => -indices.o4,
        Objective::O5 => -indices.o5,
        _ => 1.0 / indices.o2,
    }
}

/// The pair rows of a set without one pose, ready to judge what may take its place.
#[derive(Debug)]
pub(super) struct Vacancy<'a> {
    information: &'a Information,
    objective: Objective,
    others: &'a [usize],
    gram: DMatrix<f64>,
    eigenvalues: Vec<f64>,
    /// Columns: eigenvectors, lowest eigenvalue first.
    eigenvectors: DMatrix<f64>,
    /// The directions of the bound, one row of lanes per reduced parameter.
    directions: Vec<Lanes>,
    /// Number of low directions of the bound; the top direction sits in the last lane.
    low: usize,
    /// Rows x, y, z of the other poses along the directions of the bound.
    rows: Vec<[Lanes; 3]>,
}

impl<'a> Vacancy<'a> {
    /// Of `others`, whose Gram matrix is `gram`.
    pub(super) fn new(
        information: &'a Information,
        objective: Objective,
        others: &'a [usize],
        gram: DMatrix<f64>,
    ) -> Self {
        let eigen = gram.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..gram.nrows()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let eigenvalues = order.iter().map(|&index| eigen.eigenvalues[index]).collect();
        let columns: Vec<_> = order.iter().map(|&index| eigen.eigenvectors.column(index)).collect();
        let mut vacancy = Self {
            information,
            objective,
            others,
            low: (LANES - 1).min(gram.nrows() - 1),
            gram,
            eigenvalues,
            eigenvectors: DMatrix::from_columns(&columns),
            directions: Vec::new(),
            rows: Vec::new(),
        };
        let top = vacancy.eigenvectors.ncols() - 1;
        vacancy.directions = (0..vacancy.eigenvectors.nrows())
            .map(|row| {
                std::array::from_fn(|lane| match lane {
                    lane if lane < vacancy.low => vacancy.eigenvectors[(row, lane)],
                    lane if lane == LANES - 1 => vacancy.eigenvectors[(row, top)],
                    _ => 0.0,
                })
            })
            .collect();
        vacancy.rows = others.iter().map(|&other| vacancy.along_directions(other)).collect();
        vacancy
    }

    /// The rows of a candidate along the directions of the bound.
    fn along_directions(&self, candidate: usize) -> [Lanes; 3] {
        let (rank, width) = (self.information.rank(), self.information.width());
        let rows = self.information.rows(candidate);
        let mut lanes = [[0.0; LANES]; 3];
        for (axis, lanes) in lanes.iter_mut().enumerate() {
            for (value, direction) in rows[width * axis..width * axis + rank].iter().zip(&self.directions) {
                for (lane, component) in lanes.iter_mut().zip(direction) {
                    *lane += value * component;
                }
            }
        }
        lanes
    }

    /// The Gram matrix with `candidate` in the set.
    pub(super) fn gram_with(&self, candidate: usize) -> DMatrix<f64> {
        let mut gram = self.gram.clone();
        add_pairs(self.information, &mut gram, candidate, self.others, 1.0);
        gram
    }

    /// The cost with `candidate` in the set.
    pub(super) fn cost(&self, candidate: usize) -> f64 {
        let gram = self.gram_with(candidate);
        spectral_cost(self.objective, gram.symmetric_eigenvalues().as_slice(), self.others.len() + 1)
    }

    /// Whether `candidate` might bring the cost below `limit`: never false for one that does.
    pub(super) fn may_reach(&self, candidate: usize, limit: f64) -> bool {
        if limit.is_infinite() {
            return true;
        }
        match self.objective {
            Objective::O1 | Objective::O5 => self.diagonal_cost(candidate) < limit,
            _ => self.block_reaches(candidate, limit),
        }
    }

    /// The block of the low directions with the candidate, tested against the smallest eigenvalue that `limit` asks for.
    fn block_reaches(&self, candidate: usize, limit: f64) -> bool {
        let own = self.along_directions(candidate);
        let mut diagonal = [0.0; LANES];
        let rows = self.others.iter().zip(&self.rows).map(|(&other, rows)| {
            let row = pair_lanes(&direction(self.information, other, candidate), rows, &own);
            for (sum, value) in diagonal.iter_mut().zip(row) {
                *sum += value * value;
            }
            row
        });
        let rows: Vec<Lanes> = rows.collect();
        let top = self.eigenvalues.last().copied().unwrap_or(0.0) + diagonal[LANES - 1];
        let needed = match self.objective {
            Objective::O3 => limit * limit,
            Objective::O4 => -limit * top.sqrt(),
            _ => top / (limit * limit),
        };
        // Most candidates fail on the diagonal alone.
        if self.eigenvalues[..self.low].iter().zip(diagonal).any(|(value, added)| value + added <= needed) {
            return false;
        }
        let mut block = [[0.0; LANES]; LANES];
        for row in &rows {
            for (index, target) in block.iter_mut().enumerate() {
                for (target, value) in target.iter_mut().zip(row) {
                    *target += row[index] * value;
                }
            }
        }
        for (index, value) in self.eigenvalues[..self.low].iter().enumerate() {
            block[index][index] += value - needed;
        }
        is_positive_definite(&mut block, self.low)
    }

    /// The cost of the diagonal in the basis of eigenvectors: a lower bound of the cost.
    fn diagonal_cost(&self, candidate: usize) -> f64 {
        let rank = self.information.rank();
        let mut rotated = vec![0.0; rank];
        let mut diagonal = self.eigenvalues.clone();
        let width = self.information.width();
        let own = self.information.rows(candidate);
        for &other in self.others {
            let u = direction(self.information, other, candidate);
            let their = self.information.rows(other);
            let row: Vec<f64> = (0..rank)
                .map(|column| {
                    (0..3).map(|axis| u[axis] * (own[width * axis + column] - their[width * axis + column])).sum()
                })
                .collect();
            for (value, vector) in rotated.iter_mut().zip(self.eigenvectors.as_slice().chunks(rank)) {
                *value = row.iter().zip(vector).map(|(a, b)| a * b).sum();
            }
            for (target, value) in diagonal.iter_mut().zip(&rotated) {
                *target += value * value;
            }
        }
        spectral_cost(self.objective, &diagonal, self.others.len() + 1)
    }
}

/// `u · (own − their)` in every lane.
#[inline]
fn pair_lanes(u: &Vector3<f64>, their: &[Lanes; 3], own: &[Lanes; 3]) -> Lanes {
    std::array::from_fn(|lane| {
        u.x * (own[0][lane] - their[0][lane])
            + u.y * (own[1][lane] - their[1][lane])
            + u.z * (own[2][lane] - their[2][lane])
    })
}

/// Whether the leading `size` × `size` block is positive definite; by Cholesky in place, lower triangle.
fn is_positive_definite(block: &mut [Lanes; LANES], size: usize) -> bool {
    for pivot in 0..size {
        let value = block[pivot][pivot];
        if value <= 0.0 {
            return false;
        }
        for i in pivot + 1..size {
            let factor = block[i][pivot] / value;
            for j in pivot + 1..=i {
                block[i][j] -= factor * block[j][pivot];
            }
        }
    }
    true
}
