//! Exchanges judged by the singular values of the pair rows: condition number and O1–O5.
//!
//! An exact judgement of a candidate needs all its pair rows and an eigenvalue decomposition. Most candidates are turned down
//! before that by a bound that holds exactly. In the basis of eigenvectors `v_k` of the Gram matrix of the other poses:
//!
//! - the smallest eigenvalue of a symmetric matrix is at most that of any principal block, the largest at least any diagonal
//!   entry (Rayleigh–Ritz). The lowest direction alone turns most candidates down. The block of the lowest directions and the
//!   top direction of the others cost a third of the exact matrix, and a Cholesky factor tells whether the block lies above what
//!   would be needed;
//! - sums of concave functions of the eigenvalues are at most those of the diagonal (Schur–Horn): this bounds O1 and O5. The
//!   bound is close and seldom turns one down, so that only the most promising candidates are judged exactly.

use nalgebra::{DMatrix, Point3, Vector3};

use super::information::Information;
use super::objective::Objective;
use super::pairs::{add_pairs, direction};
use super::score::ObservabilityIndices;
use crate::identification::SAME_POINT;

/// Directions that enter the bound: the lowest ones and, last, the top one. A multiple of the width of vector registers.
const LANES: usize = 8;

/// Candidates that O1 and O5 judge exactly per place.
const SHORTLIST: usize = 12;

/// Candidates that the other objectives look at per place after the lowest direction.
const LONGLIST: usize = 2000;

/// One number per direction of the bound.
type Lanes = [f64; LANES];

/// Pairs that are summed side by side.
const SIDE_BY_SIDE: usize = 8;

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
    /// Points of the other poses and their rows along the lowest direction: x, y, z of each.
    lowest: Lowest,
    /// Rows x, y, z of the other poses along all eigenvectors, rank × 3M; empty where the block decides.
    rotated: DMatrix<f64>,
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
            lowest: Lowest::default(),
            rotated: DMatrix::zeros(0, 0),
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
        vacancy.lowest = Lowest::new(information, others, &vacancy.rows);
        if vacancy.diagonal_decides() {
            vacancy.rotated = vacancy.along_eigenvectors(others);
        }
        vacancy
    }

    /// Whether the bound is that of the diagonal, not of the block.
    const fn diagonal_decides(&self) -> bool {
        matches!(self.objective, Objective::O1 | Objective::O5)
    }

    /// Rows x, y, z of candidates along all eigenvectors, as columns.
    fn along_eigenvectors(&self, candidates: &[usize]) -> DMatrix<f64> {
        let (rank, width) = (self.information.rank(), self.information.width());
        let mut rows = DMatrix::zeros(rank, 3 * candidates.len());
        for (index, &candidate) in candidates.iter().enumerate() {
            for (axis, row) in self.information.rows(candidate).chunks(width).enumerate() {
                rows.column_mut(3 * index + axis).copy_from_slice(&row[..rank]);
            }
        }
        self.eigenvectors.tr_mul(&rows)
    }

    /// The candidates worth an exact judgement for a cost below `limit`, the most promising ones first.
    pub(super) fn shortlist(&self, candidates: &[usize], limit: f64) -> Vec<usize> {
        let (mut hopes, length): (Vec<(f64, usize)>, _) = if self.diagonal_decides() {
            let cost = |&candidate: &usize| (self.diagonal_cost(candidate), candidate);
            (candidates.iter().map(cost).filter(|(cost, _)| *cost < limit).collect(), SHORTLIST)
        } else {
            // The more it adds to the lowest direction the better.
            let needed = self.needed(limit);
            let shortfall = |&candidate: &usize| (needed - self.lowest_with(candidate), candidate);
            (candidates.iter().map(shortfall).filter(|(shortfall, _)| *shortfall < 0.0).collect(), LONGLIST)
        };
        hopes.sort_by(|a, b| a.0.total_cmp(&b.0));
        hopes.into_iter().take(length).map(|(_, candidate)| candidate).collect()
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

    /// The Gram matrix with `candidate` along the lowest direction of the others: its smallest eigenvalue is not larger.
    fn lowest_with(&self, candidate: usize) -> f64 {
        let (rank, width) = (self.information.rank(), self.information.width());
        let lowest = self.eigenvectors.column(0);
        let rows = self.information.rows(candidate);
        let own = std::array::from_fn(|axis| dot(&rows[width * axis..width * axis + rank], lowest.as_slice()));
        self.eigenvalues[0] + self.lowest.with(self.information.point(candidate), own)
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
        if self.diagonal_decides() {
            self.diagonal_cost(candidate) < limit
        } else {
            self.block_reaches(candidate, limit)
        }
    }

    /// The smallest eigenvalue that `limit` asks for at least: a candidate can only make the largest eigenvalue larger.
    fn needed(&self, limit: f64) -> f64 {
        self.needed_below(limit, self.eigenvalues.last().copied().unwrap_or(0.0))
    }

    /// The smallest eigenvalue that `limit` asks for where the largest is `top`.
    fn needed_below(&self, limit: f64, top: f64) -> f64 {
        match self.objective {
            Objective::O3 => limit * limit,
            Objective::O4 => -limit * top.sqrt(),
            _ => top / (limit * limit),
        }
    }

    /// The block of the low directions with the candidate, tested against the smallest eigenvalue that `limit` asks for.
    fn block_reaches(&self, candidate: usize, limit: f64) -> bool {
        if self.lowest_with(candidate) <= self.needed(limit) {
            return false;
        }
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
        let needed = self.needed_below(limit, top);
        // Most of the rest fail on the diagonal alone.
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
        let mut diagonal = self.eigenvalues.clone();
        let own = self.along_eigenvectors(&[candidate]);
        let (ox, rest) = own.as_slice().split_at(rank);
        let (oy, oz) = rest.split_at(rank);
        for (&other, their) in self.others.iter().zip(self.rotated.as_slice().chunks(3 * rank)) {
            let u = direction(self.information, other, candidate);
            let (tx, rest) = their.split_at(rank);
            let (ty, tz) = rest.split_at(rank);
            for (k, target) in diagonal.iter_mut().enumerate() {
                let value = u.x * (ox[k] - tx[k]) + u.y * (oy[k] - ty[k]) + u.z * (oz[k] - tz[k]);
                *target += value * value;
            }
        }
        spectral_cost(self.objective, &diagonal, self.others.len() + 1)
    }
}

/// Points of poses and their rows along one direction, coordinate by coordinate, so that several pairs are summed at once.
#[derive(Debug, Default)]
struct Lowest {
    points: [Vec<f64>; 3],
    rows: [Vec<f64>; 3],
}

impl Lowest {
    /// Of `others`, whose rows along the directions of the bound are `rows`, the lowest direction first.
    fn new(information: &Information, others: &[usize], rows: &[[Lanes; 3]]) -> Self {
        let coordinates = |axis: usize| others.iter().map(|&other| information.point(other)[axis]).collect();
        Self {
            points: std::array::from_fn(coordinates),
            rows: std::array::from_fn(|axis| rows.iter().map(|row| row[axis][0]).collect()),
        }
    }

    /// What the pairs of a pose at `point` with the rows `own` add along the direction, or a little more: two points on top of each
    /// other count as if they were [`SAME_POINT`] apart.
    fn with(&self, point: &Point3<f64>, own: [f64; 3]) -> f64 {
        let [px, py, pz] = &self.points;
        let [rx, ry, rz] = &self.rows;
        let mut sums = [0.0; SIDE_BY_SIDE];
        let mut add = |from: usize, to: usize| {
            let columns = px[from..to].iter().zip(&py[from..to]).zip(&pz[from..to]);
            let columns = columns.zip(rx[from..to].iter().zip(&ry[from..to]).zip(&rz[from..to]));
            for (sum, (((x, y), z), ((rx, ry), rz))) in sums.iter_mut().zip(columns) {
                let (x, y, z) = (point.x - x, point.y - y, point.z - z);
                let along = x * (own[0] - rx) + y * (own[1] - ry) + z * (own[2] - rz);
                *sum += along * along / (x * x + y * y + z * z).max(SAME_POINT * SAME_POINT);
            }
        };
        let whole = px.len() - px.len() % SIDE_BY_SIDE;
        for from in (0..whole).step_by(SIDE_BY_SIDE) {
            add(from, from + SIDE_BY_SIDE);
        }
        add(whole, px.len());
        sums.iter().sum()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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

/// Whether the leading `size` × `size` block is positive definite; by Gaussian elimination in place, upper triangle.
fn is_positive_definite(block: &mut [Lanes; LANES], size: usize) -> bool {
    for pivot in 0..size {
        let value = block[pivot][pivot];
        if value <= 0.0 {
            return false;
        }
        let row = block[pivot];
        for i in pivot + 1..size {
            let factor = row[i] / value;
            for (target, above) in block[i][i..size].iter_mut().zip(&row[i..size]) {
                *target -= factor * above;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::information::tests::pool;
    use super::super::pairs::pair_gram;
    use super::*;

    #[test]
    fn updates_equal_the_sums_from_scratch() {
        let information = pool(200);
        let set: Vec<usize> = (0..40).collect();
        let mut gram = pair_gram(&information, &set);
        let mut set = set;
        for step in 0..100 {
            let place = step % 40;
            let others: Vec<usize> = set.iter().copied().filter(|&pose| pose != set[place]).collect();
            add_pairs(&information, &mut gram, set[place], &others, -1.0);
            set[place] = 40 + (7 * step) % 160;
            add_pairs(&information, &mut gram, set[place], &others, 1.0);
        }
        let scratch = pair_gram(&information, &set);
        assert!((&gram - &scratch).norm() < 1e-9 * scratch.norm());
        let (updated, scratch) = (gram.symmetric_eigenvalues(), scratch.symmetric_eigenvalues());
        let cost = |values: &[f64]| spectral_cost(Objective::Condition, values, 40);
        assert!((cost(updated.as_slice()) / cost(scratch.as_slice()) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_bound_turns_down_only_what_does_not_reach() {
        let information = pool(400);
        let others: Vec<usize> = (0..39).collect();
        for objective in [Objective::Condition, Objective::O1, Objective::O3, Objective::O4, Objective::O5] {
            let vacancy = Vacancy::new(&information, objective, &others, pair_gram(&information, &others));
            let costs: Vec<(usize, f64)> = (39..400).map(|candidate| (candidate, vacancy.cost(candidate))).collect();
            let mut sorted: Vec<f64> = costs.iter().map(|(_, cost)| *cost).collect();
            sorted.sort_by(f64::total_cmp);
            let mut turned_down = 0;
            for limit in [sorted[1], sorted[20], sorted[180], sorted[360]] {
                for &(candidate, cost) in &costs {
                    let may = vacancy.may_reach(candidate, limit);
                    assert!(may || cost >= limit, "{objective:?}: candidate {candidate} reaches {cost} < {limit}");
                    turned_down += usize::from(!may);
                }
            }
            assert!(turned_down > 0, "{objective:?}");
        }
    }
}
