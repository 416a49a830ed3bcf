//! The estimate itself: Gauss–Newton steps with a safeguard, for given weights.
//!
//! Deviations are written `x = T z`. With the prior, `T = S` (expected deviations) and `z` is drawn to zero with unit weight:
//! the maximum a posteriori estimate. Without it, `T` spans the directions that the nominal model can see, in rad and mm, so
//! that the result is the deviation without any part in a blind direction: the paper's minimum-norm solution, iterated.

use std::ops::ControlFlow;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::linearise::length_rows;
use super::linearise::{Evaluation, NormalEquations, PointResiduals, Weights, point_residuals, project};
use super::observability::Observability;
use super::pairs::{PairPoint, pair_sums};
use super::problem::Problem;
use super::{IdentificationError, Iteration, Prior, TerminationReason, Weighting};
use crate::kinematics::Arm;

/// What is left to go, in expected deviations, that ends the iteration.
const STEP_TOLERANCE: f64 = 1e-7;
/// An expected relative decrease of the cost below this ends the iteration.
const COST_TOLERANCE: f64 = 1e-13;
/// First damping after a step that made things worse, relative to the diagonal.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping beyond which no step helps.
const LAST_DAMPING: f64 = 1e12;

/// The parametrisation `x = T z` and the prior on `z`.
#[derive(Clone, Debug)]
pub(crate) struct Basis {
    /// n × m.
    pub(crate) transform: DMatrix<f64>,
    /// Weight of `z` in the cost: 1 with the prior, 0 without.
    pub(crate) prior_weight: f64,
}

impl Basis {
    /// `Tᵀ M T`.
    pub(crate) fn reduce(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let t = &self.transform;
        if self.prior_weight > 0.0 {
            // T is diagonal with the prior.
            return DMatrix::from_fn(t.nrows(), t.ncols(), |i, j| t[(i, i)] * matrix[(i, j)] * t[(j, j)]);
        }
        t.transpose() * (matrix * t)
    }

    pub(crate) fn new(
        problem: &Problem<'_>,
        prior: Prior,
        observability: &Observability,
    ) -> Result<Self, IdentificationError> {
        let n = problem.parameters.len();
        match prior {
            Prior::Expected => {
                let expected = DVector::from_iterator(n, problem.parameters.iter().map(|parameter| parameter.expected));
                Ok(Self { transform: DMatrix::from_diagonal(&expected), prior_weight: 1.0 })
            }
            Prior::None => {
                if observability.rank.is_none() {
                    return Err(IdentificationError::RankUnclear { gap: observability.gap });
                }
                // Blind directions in rad and mm, orthonormal; their complement is the row space of the raw A.
                let unit = |index: usize| problem.parameters[index].id.unit().of_the_paper();
                let blind = DMatrix::from_fn(n, observability.blind.ncols(), |i, j| {
                    observability.blind[(i, j)] * problem.parameters[i].expected / unit(i)
                });
                let blind = if blind.ncols() == 0 { blind } else { blind.qr().q() };
                let visible = SymmetricEigen::new(DMatrix::identity(n, n) - &blind * blind.transpose());
                let columns: Vec<DVector<f64>> = (0..n)
                    .filter(|&index| visible.eigenvalues[index] > 0.5)
                    .map(|index| DVector::from_fn(n, |i, _| visible.eigenvectors[(i, index)] * unit(i)))
                    .collect();
                let transform = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
                Ok(Self { transform, prior_weight: 0.0 })
            }
        }
    }
}

/// The problem linearised at one estimate.
#[derive(Clone, Debug)]
pub(crate) struct Linearised {
    pub(crate) z: DVector<f64>,
    pub(crate) x: DVector<f64>,
    pub(crate) arm: Arm,
    pub(crate) points: PointResiduals,
    pub(crate) normal: NormalEquations,
    /// `normal.cost` plus the prior's share.
    pub(crate) cost: f64,
}

/// Everything a solve needs that stays the same over its steps.
#[derive(Debug)]
pub(crate) struct Solve<'a, 'p> {
    pub(crate) problem: &'a Problem<'p>,
    pub(crate) weighting: Weighting,
    pub(crate) basis: &'a Basis,
    pub(crate) weights: &'a Weights,
}

impl Solve<'_, '_> {
    /// Linearises at `z`.
    pub(crate) fn linearise(&self, z: DVector<f64>) -> Linearised {
        let x = &self.basis.transform * &z;
        let arm = self.problem.arm_with(&x);
        let evaluation = Evaluation::new(self.problem, &arm);
        let points = point_residuals(self.problem, &evaluation.points, self.weights);
        let normal = match self.weighting {
            Weighting::Covariance => {
                project(self.problem, evaluation, &points, self.weights, self.weights).normal_equations()
            }
            Weighting::Uniform => self.uniform_pairs(&evaluation),
        };
        let cost = normal.cost + self.basis.prior_weight * z.norm_squared();
        Linearised { z, x, arm, points, normal, cost }
    }

    /// All pairs of each station alike. Each pair weighs `3 / (M σ²)`, so that the pairs together carry as much information
    /// as the 3M coordinates they come from and the prior keeps its meaning.
    fn uniform_pairs(&self, evaluation: &Evaluation) -> NormalEquations {
        let n = evaluation.n;
        let mut normal = length_rows(self.problem, evaluation, self.weights, self.weights).normal_equations();
        let mut covariance = normal.gram.clone();
        let samples = &self.problem.observations.points;
        let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
        for station in 0..stations {
            let points: Vec<PairPoint<'_>> = samples
                .iter()
                .enumerate()
                .filter(|(index, sample)| sample.station == station && self.weights.trust[*index] > 0.0)
                .map(|(index, sample)| PairPoint {
                    predicted: evaluation.points[index],
                    measured: sample.point,
                    rows: &evaluation.rows[3 * n * index..3 * n * (index + 1)],
                    trust: self.weights.trust[index],
                    sigma: sample.sigma.unwrap_or(self.weights.sigma),
                })
                .collect();
            let weight = 3.0 / (points.len().max(1) as f64 * self.weights.sigma.powi(2));
            let sums = pair_sums(&points, n, weight);
            normal.gram += sums.gram;
            normal.gradient += sums.gradient;
            normal.cost += sums.cost;
            covariance += sums.gradient_covariance;
        }
        normal.gradient_covariance = Some(covariance);
        normal
    }

    /// Normal matrix of `z` with the prior, `TᵀGT + Λ`.
    pub(crate) fn hessian(&self, at: &Linearised) -> DMatrix<f64> {
        let mut hessian = self.basis.reduce(&at.normal.gram);
        for index in 0..hessian.nrows() {
            hessian[(index, index)] += self.basis.prior_weight;
        }
        hessian
    }

    /// One step from `at`, damped until it does not make things worse.
    ///
    /// Returns the new point with its record, or the reason why there is none.
    pub(crate) fn step(&self, at: &Linearised) -> Result<(Linearised, Iteration), TerminationReason> {
        let hessian = self.hessian(at);
        let rhs = self.basis.transform.transpose() * &at.normal.gradient - &at.z * self.basis.prior_weight;
        let mut damping = 0.0;
        while damping <= LAST_DAMPING {
            let mut damped = hessian.clone();
            for index in 0..damped.nrows() {
                damped[(index, index)] += damping * hessian[(index, index)].max(f64::MIN_POSITIVE);
            }
            if let Some(factor) = Cholesky::<f64, Dyn>::new(damped) {
                let delta = factor.solve(&rhs);
                let next = self.linearise(&at.z + &delta);
                let expected = delta.dot(&rhs);
                let negligible = expected <= COST_TOLERANCE * at.cost;
                if next.cost.is_finite() && (next.cost <= at.cost || negligible) {
                    let change = &next.x - &at.x;
                    let relative = change
                        .iter()
                        .zip(self.problem.parameters)
                        .map(|(change, parameter)| (change / parameter.expected).abs())
                        .fold(0.0, f64::max);
                    let record = Iteration { cost: next.cost, step: relative, damping, negligible };
                    return Ok((next, record));
                }
                if negligible {
                    return Err(TerminationReason::Converged);
                }
            }
            damping = if damping == 0.0 { FIRST_DAMPING } else { damping * 10.0 };
        }
        Err(if at.cost.is_finite() { TerminationReason::NoImprovement } else { TerminationReason::NonFinite })
    }

    /// Steps until converged or `limit` steps were taken; `record` sees each with the deviations it leads to ((m) and (rad)) and
    /// may ask to stop there.
    pub(crate) fn run(
        &self,
        start: DVector<f64>,
        limit: usize,
        record: &mut dyn FnMut(Iteration, &DVector<f64>) -> ControlFlow<()>,
    ) -> (Linearised, TerminationReason) {
        let mut at = self.linearise(start);
        let mut last_step = 0.0;
        for _ in 0..limit {
            match self.step(&at) {
                Ok((next, step)) => {
                    at = next;
                    // Steps shrink by about the same factor each time: what is left is the next one of the series.
                    let left = step.step * (step.step / last_step).min(1.0);
                    let converged = step.damping == 0.0 && left <= STEP_TOLERANCE || step.negligible;
                    last_step = step.step;
                    let flow = record(step, &at.x);
                    if converged {
                        return (at, TerminationReason::Converged);
                    }
                    if flow.is_break() {
                        break;
                    }
                }
                Err(reason) => return (at, reason),
            }
        }
        (at, TerminationReason::IterationLimit)
    }
}
