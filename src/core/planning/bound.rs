//! How much better any set could be: the D-optimal approximate design of the pool.
//!
//! Where poses may have any share `w` of the measurements (Kiefer & Wolfowitz 1960), the largest `ln det Σ w GᵀG` is a concave
//! problem, and every trial solution carries its own certificate: with `d(x) = trace(G M(w)⁻¹ Gᵀ)`,
//!
//! `ln det M(w*) ≤ ln det M(w) + m ln(max d / m)`,
//!
//! because `det` of a matrix is at most the m-th power of its mean eigenvalue (arithmetic and geometric mean). At the optimum
//! `max d = m`. The weights come from the multiplicative algorithm (Titterington 1976: `w ← w d / m`) on the candidates that
//! still have a share, with the ones of largest `d` in the whole pool brought back now and then (Wynn 1970, Fedorov 1972).

use nalgebra::{DMatrix, DMatrixView};

use super::exchange::Merit;
use super::information::Information;
use super::score::log_det;
use super::{PlanningError, check_set};

/// Relative excess of `max d` over m at which the bound is tight enough.
const TIGHT: f64 = 1e-3;
/// Looks at the whole pool.
const ROUNDS: usize = 60;
/// Multiplicative steps between them.
const STEPS: usize = 20;
/// Candidates brought back per look at the pool, and the share they get together.
const RETURNING: usize = 5;
const RETURNING_SHARE: f64 = 0.01;
/// A candidate with less than this part of an equal share is dropped; a later look at the pool may bring it back.
const DROPPED: f64 = 1e-3;

/// An upper bound of `ln det M` per pose over all sets of a pool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignBound {
    /// Upper bound of `ln det (M / poses)`, in the units of [`super::Score::log_det`].
    pub log_det: f64,
    /// How far the bound may lie above the true optimum: `max d / m − 1` of the equivalence theorem.
    pub gap: f64,
    /// Candidates that share in the design.
    pub support: usize,
}

impl DesignBound {
    /// Of the whole pool; `keep_going` may end it early with a looser bound.
    pub fn new(information: &Information, keep_going: &(dyn Fn() -> bool + Sync)) -> Self {
        let size = information.width() as f64;
        let mut design = Design {
            members: (0..information.len()).collect(),
            shares: vec![1.0 / information.len().max(1) as f64; information.len()],
        };
        let everyone: Vec<usize> = (0..information.len()).collect();
        let mut bound = Self { log_det: f64::INFINITY, gap: f64::INFINITY, support: 0 };
        for _ in 0..ROUNDS {
            let Some((value, variances)) = design.variances(information, &everyone) else { return bound };
            let largest = variances.iter().copied().fold(0.0, f64::max);
            let upper = value + size * (largest / size).ln();
            if upper < bound.log_det {
                bound = Self { log_det: upper, gap: largest / size - 1.0, support: design.members.len() };
            }
            if bound.gap < TIGHT || !keep_going() {
                return bound;
            }
            design.bring_back(&variances);
            for _ in 0..STEPS {
                let Some((_, variances)) = design.variances(information, &design.members) else { return bound };
                design.step(&variances, size);
            }
        }
        bound
    }

    /// D-efficiency of a set, in 0 … 1: `(det M(set) / det M*)^(1/m)` per pose, against the upper bound of `det M*`. A set of
    /// efficiency 0.9 tells what 0.9 times as many ideally chosen poses would.
    ///
    /// # Errors
    /// A set that cannot be scored.
    pub fn efficiency(&self, information: &Information, set: &[usize]) -> Result<f64, PlanningError> {
        check_set(information, set)?;
        let size = information.width() as f64;
        let achieved = Merit::new(information, information.sum(set)).log_det - size * (set.len() as f64).ln();
        Ok(((achieved - self.log_det) / size).exp())
    }
}

/// Shares of some candidates; they sum to one.
#[derive(Debug)]
struct Design {
    members: Vec<usize>,
    shares: Vec<f64>,
}

impl Design {
    /// `ln det M(w)` and `d` of each of `candidates`; `None` if M is singular.
    fn variances(&self, information: &Information, candidates: &[usize]) -> Option<(f64, Vec<f64>)> {
        /// Candidates per product.
        const BLOCK: usize = 128;
        let width = information.width();
        let mut matrix = DMatrix::zeros(width, width);
        let mut gathered = vec![0.0; 3 * width * BLOCK];
        for (members, shares) in self.members.chunks(BLOCK).zip(self.shares.chunks(BLOCK)) {
            for ((target, &member), share) in gathered.chunks_mut(3 * width).zip(members).zip(shares) {
                let root = share.sqrt();
                for (target, value) in target.iter_mut().zip(information.rows(member)) {
                    *target = root * value;
                }
            }
            let count = 3 * members.len();
            let columns = DMatrixView::from_slice(&gathered[..width * count], width, count);
            matrix.gemm(1.0, &columns, &columns.transpose(), 1.0);
        }
        let factor = matrix.cholesky()?;
        let inverse = factor.inverse();
        let mut product = DMatrix::zeros(width, 3 * BLOCK);
        let mut variances = Vec::with_capacity(candidates.len());
        for block in candidates.chunks(BLOCK) {
            for (target, &candidate) in gathered.chunks_mut(3 * width).zip(block) {
                target.copy_from_slice(information.rows(candidate));
            }
            let count = 3 * block.len();
            let columns = DMatrixView::from_slice(&gathered[..width * count], width, count);
            product.columns_mut(0, count).gemm(1.0, &inverse, &columns, 0.0);
            let pairs = product.as_slice().chunks(3 * width).zip(gathered.chunks(3 * width)).take(block.len());
            variances.extend(pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()));
        }
        Some((log_det(factor.l_dirty()), variances))
    }

    /// One multiplicative step; drops members that have next to no share left.
    fn step(&mut self, variances: &[f64], size: f64) {
        for (share, variance) in self.shares.iter_mut().zip(variances) {
            *share *= variance / size;
        }
        let least = DROPPED / self.members.len() as f64;
        let kept = |share: &f64| *share > least;
        let mut keep = self.shares.iter().map(kept);
        self.members.retain(|_| keep.next().unwrap_or(true));
        self.shares.retain(kept);
        self.normalise();
    }

    /// Gives a small share to the candidates of largest `d` in the pool.
    fn bring_back(&mut self, variances: &[f64]) {
        let mut order: Vec<usize> = (0..variances.len()).collect();
        order.sort_by(|&a, &b| variances[b].total_cmp(&variances[a]));
        for &candidate in order.iter().take(RETURNING) {
            let share = RETURNING_SHARE / RETURNING as f64;
            if let Some(index) = self.members.iter().position(|&member| member == candidate) {
                self.shares[index] += share;
            } else {
                self.members.push(candidate);
                self.shares.push(share);
            }
        }
        self.normalise();
    }

    fn normalise(&mut self) {
        let total: f64 = self.shares.iter().sum();
        self.shares.iter_mut().for_each(|share| *share /= total);
    }
}
