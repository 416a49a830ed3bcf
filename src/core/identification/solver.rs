//! The estimate itself: Gauss–Newton steps with a safeguard. The noise is estimated along with the parameters, before each step.
//!
//! Deviations are written `x = T z`. With the prior, `T = S` (expected deviations) and `z` is drawn to zero with unit weight:
//! the maximum a posteriori estimate. Without it, `T` spans the directions that the nominal model can see, in rad and mm, so
//! that the result is the deviation without any part in a blind direction: the paper's minimum-norm solution, iterated.

use std::ops::ControlFlow;

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Point3, SymmetricEigen};

use super::factor::Factor;
use super::lengths::feature_covariances;
use super::linearise::{
    Evaluation, NormalEquations, PointResiduals, ProjectedRows, Trust, Weights, point_residuals, project,
};
use super::noise::{Estimation, Groups, Noise, Scatter, shot_variance};
use super::observability::Observability;
use super::pairs::{PairPoint, pair_sums};
use super::problem::Problem;
use super::{Belief, IdentificationError, Iteration, Prior, TerminationReason, Weighting};
use crate::kinematics::Arm;

/// Converged: what is left of a step moves no prediction by more than this many of its standard deviations, wherever it is. That is
/// what the Newton decrement `√(δᵀHδ)` says, because `|J δ| ≤ √(J H⁻¹ Jᵀ) √(δᵀHδ)`.
pub(crate) const CONVERGED: f64 = 1e-2;
/// A step as small as this is the last one: what is left after it is far smaller.
const LAST_STEP: f64 = 1e-3;
/// An expected relative decrease of the cost below this is rounding noise.
const COST_TOLERANCE: f64 = 1e-13;
/// Part of a step below which no part of it helps.
const SMALLEST_PART: f64 = 1e-9;
/// Rounds of noise and step before a step is taken, and the relative change of σ that ends them.
const NOISE_ROUNDS: usize = 12;
const NOISE_TOLERANCE: f64 = 1e-5;

/// The parametrisation `x = T z` and the prior on `z`.
#[derive(Clone, Debug)]
pub(crate) struct Basis {
    /// n × m.
    pub(crate) transform: DMatrix<f64>,
    /// Whether the transform is diagonal, which makes products with it cheap.
    is_diagonal: bool,
    /// Deviations at `z = 0` ((m) and (rad)).
    mean: DVector<f64>,
    /// Weight of `z` in the cost: 1 with the prior, 0 without.
    pub(crate) prior_weight: f64,
}

impl Basis {
    /// `Tᵀ M T`.
    pub(crate) fn reduce(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let t = &self.transform;
        if self.is_diagonal {
            return DMatrix::from_fn(t.nrows(), t.ncols(), |i, j| t[(i, i)] * matrix[(i, j)] * t[(j, j)]);
        }
        t.transpose() * (matrix * t)
    }

    /// `T M Tᵀ`.
    pub(crate) fn spread(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let t = &self.transform;
        if self.is_diagonal {
            return DMatrix::from_fn(t.nrows(), t.nrows(), |i, j| t[(i, i)] * matrix[(i, j)] * t[(j, j)]);
        }
        t * matrix * t.transpose()
    }

    /// With what is known before the data.
    pub(crate) fn about(belief: &Belief) -> Result<Self, IdentificationError> {
        let transform = Cholesky::new(belief.covariance.clone()).ok_or(IdentificationError::Belief)?.unpack();
        Ok(Self { transform, is_diagonal: false, mean: belief.mean.clone(), prior_weight: 1.0 })
    }

    /// The same, about other deviations than none.
    pub(crate) fn about_mean(self, mean: DVector<f64>) -> Self {
        Self { mean, ..self }
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
                Ok(Self {
                    transform: DMatrix::from_diagonal(&expected),
                    is_diagonal: true,
                    mean: DVector::zeros(n),
                    prior_weight: 1.0,
                })
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
                Ok(Self { transform, is_diagonal: false, mean: DVector::zeros(n), prior_weight: 0.0 })
            }
        }
    }
}

/// The problem linearised at one estimate, with the weights of some noise.
#[derive(Clone, Debug)]
pub(crate) struct Linearised {
    pub(crate) z: DVector<f64>,
    pub(crate) x: DVector<f64>,
    pub(crate) arm: Arm,
    pub(crate) noise: Noise,
    weights: Weights,
    /// Predicted positions in the base (m).
    predicted: Vec<Point3<f64>>,
    pub(crate) points: PointResiduals,
    pub(crate) rows: ProjectedRows,
    pub(crate) normal: NormalEquations,
    /// `normal.cost` plus the prior's share.
    pub(crate) cost: f64,
}

/// The step that a linearised problem asks for.
struct Newton {
    delta: DVector<f64>,
    /// How far it moves a prediction at most, in standard deviations of that prediction.
    decrement: f64,
    /// How many values the data determine of the parameters.
    determined: f64,
}

/// How a solve ended.
pub(crate) struct Solution {
    pub(crate) at: Linearised,
    pub(crate) termination: TerminationReason,
}

/// Everything a solve needs that stays the same over its steps.
#[derive(Debug)]
pub(crate) struct Solve<'a, 'p> {
    pub(crate) problem: &'a Problem<'p>,
    pub(crate) weighting: Weighting,
    pub(crate) basis: &'a Basis,
    pub(crate) groups: &'a Groups,
    /// Which samples count.
    pub(crate) trust: &'a Trust,
    /// How the noise is estimated on the way.
    pub(crate) estimation: Estimation,
}

impl Solve<'_, '_> {
    /// Linearises at `z`, with the weights of `noise`.
    pub(crate) fn linearise(&self, z: DVector<f64>, noise: Noise) -> Linearised {
        let problem = self.problem;
        let weights = Weights::new(problem, self.groups, &noise, self.trust);
        let x = &self.basis.mean + &self.basis.transform * &z;
        let arm = problem.arm_with(&x);
        let evaluation = Evaluation::new(problem, &arm);
        let predicted = evaluation.points.clone();
        let points = point_residuals(problem, &predicted, &weights);
        let rows = project(problem, evaluation, &points, &weights);
        let normal = self.normal_equations(&rows, &predicted, &noise);
        let cost = normal.cost + self.basis.prior_weight * z.norm_squared();
        Linearised { z, x, arm, noise, weights, predicted, points, rows, normal, cost }
    }

    /// The same estimate with the weights of another noise.
    fn reweigh(&self, at: &mut Linearised, noise: Noise) {
        let problem = self.problem;
        let weights = Weights::new(problem, self.groups, &noise, self.trust);
        let proportion = at.weights.proportion_of(&weights).filter(|_| self.weighting == Weighting::Covariance);
        at.weights = weights;
        at.noise = noise;
        if let Some(factor) = proportion.filter(|_| problem.observations.lengths.is_empty()) {
            at.rows.weigh(problem, &at.weights);
            at.normal.scale(factor);
        } else {
            at.points = point_residuals(problem, &at.predicted, &at.weights);
            at.rows.project(problem, &at.predicted, &at.points, &at.weights);
            at.normal = self.normal_equations(&at.rows, &at.predicted, &noise);
        }
        at.cost = at.normal.cost + self.basis.prior_weight * at.z.norm_squared();
    }

    fn normal_equations(&self, rows: &ProjectedRows, predicted: &[Point3<f64>], noise: &Noise) -> NormalEquations {
        match self.weighting {
            Weighting::Covariance => rows.normal_equations(),
            Weighting::Uniform => self.uniform_pairs(rows, predicted, noise),
        }
    }

    /// All pairs of each station alike. Each pair weighs `3 / (M σ²)`, so that the pairs together carry as much information
    /// as the 3M coordinates they come from and the prior keeps its meaning. Readings of one pose share its weight.
    fn uniform_pairs(&self, rows: &ProjectedRows, predicted: &[Point3<f64>], noise: &Noise) -> NormalEquations {
        let n = rows.n;
        let samples = &self.problem.observations.points;
        let mut normal = rows.normal_equations_of(3 * samples.len()..rows.residuals.len());
        let mut covariance = normal.gram.clone();
        let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
        let mut readings = vec![0.0; self.groups.len()];
        for (index, _) in samples.iter().enumerate().filter(|(index, _)| self.trust.places[*index] > 0.0) {
            readings[self.groups.of(index)] += 1.0;
        }
        for station in 0..stations {
            let points: Vec<PairPoint<'_>> = samples
                .iter()
                .enumerate()
                .filter(|(index, sample)| sample.station == station && self.trust.places[*index] > 0.0)
                .map(|(index, sample)| PairPoint {
                    predicted: predicted[index],
                    measured: sample.point,
                    rows: &rows.rows[3 * n * index..3 * n * (index + 1)],
                    trust: self.trust.places[index] / readings[self.groups.of(index)],
                    group: self.groups.of(index),
                    variance: noise.of_reading(sample.sigma),
                })
                .collect();
            let poses: f64 = points.iter().map(|point| 1.0 / readings[point.group]).sum();
            let variance = points.iter().map(|point| point.variance / readings[point.group].powi(2)).sum::<f64>();
            let variance = noise.pose + variance / poses.max(1.0);
            let weight = 3.0 / (poses.max(1.0) * variance.max(f64::MIN_POSITIVE));
            let sums = pair_sums(&points, n, weight, noise.pose);
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

    /// Residuals of the linear problem after a change of the parameters, with what they took of the values.
    pub(crate) fn scatter(&self, at: &Linearised, change: &DVector<f64>) -> Scatter {
        let lengths = self.problem.observations.lengths.len();
        let (places, lengths) = at.rows.residuals_after(lengths, change);
        Scatter::new(self.problem, self.groups, &at.noise, self.trust, &places, &lengths)
    }

    /// Covariance of where each feature was found (m²), with that of the parameters.
    pub(crate) fn feature_covariances(&self, at: &Linearised, covariance: &DMatrix<f64>) -> Vec<Matrix3<f64>> {
        feature_covariances(self.problem, &at.arm, &at.points, &at.weights, covariance)
    }

    /// How many values the data, not the prior, determine of the parameters. `None` where the normal matrix is singular.
    pub(crate) fn determined(&self, at: &Linearised) -> Option<f64> {
        Factor::new(self.hessian(at)).map(|factor| self.determined_by(&factor))
    }

    /// With `H = TᵀGT + Λ` that is the trace of `H⁻¹TᵀGT`.
    fn determined_by(&self, factor: &Factor) -> f64 {
        self.basis.transform.ncols() as f64 - self.basis.prior_weight * factor.inverse_trace()
    }

    /// The step from `at` at its noise.
    fn newton_at(&self, at: &Linearised) -> Option<Newton> {
        let has_few_rows = at.rows.residuals.len() < self.basis.transform.ncols();
        if has_few_rows && self.basis.prior_weight > 0.0 && self.weighting == Weighting::Covariance {
            return self.newton_by_rows(at);
        }
        let factor = Factor::new(self.hessian(at))?;
        let gradient = self.basis.transform.transpose() * &at.normal.gradient - &at.z * self.basis.prior_weight;
        let delta = factor.solve(&gradient);
        Some(Newton { decrement: delta.dot(&gradient).max(0.0).sqrt(), determined: self.determined_by(&factor), delta })
    }

    /// The same step by the covariance of the rows, `I + B Bᵀ` with the weighted rows B: joint curves have more parameters than a
    /// few poses have rows.
    fn newton_by_rows(&self, at: &Linearised) -> Option<Newton> {
        let ProjectedRows { n, rows, residuals, weights, .. } = &at.rows;
        let transform = &self.basis.transform;
        let mut weighted = if self.basis.is_diagonal {
            DMatrix::from_fn(*n, residuals.len(), |i, j| rows[n * j + i] * transform[(i, i)])
        } else {
            transform.tr_mul(&DMatrix::from_column_slice(*n, residuals.len(), rows))
        };
        for (mut column, weight) in weighted.column_iter_mut().zip(weights) {
            column *= weight.sqrt();
        }
        let residuals = DVector::from_fn(residuals.len(), |j, _| residuals[j] * weights[j].sqrt());
        let mut kernel = weighted.transpose() * &weighted;
        for index in 0..kernel.nrows() {
            kernel[(index, index)] += 1.0;
        }
        let factor = Factor::new(kernel)?;
        let from_nominal = &residuals + weighted.tr_mul(&at.z);
        let delta = &weighted * factor.solve(&from_nominal) - &at.z;
        let gradient = &weighted * &residuals - &at.z;
        Some(Newton {
            decrement: delta.dot(&gradient).max(0.0).sqrt(),
            determined: residuals.len() as f64 - factor.inverse_trace(),
            delta,
        })
    }

    /// The step from `at`, with the noise that its residuals show: both are found together, on the linear problem.
    fn newton(&self, at: &mut Linearised) -> Option<Newton> {
        for round in 0.. {
            let found = self.newton_at(at)?;
            if round == NOISE_ROUNDS {
                return Some(found);
            }
            let scatter = self.scatter(at, &(&self.basis.transform * &found.delta));
            let noise = scatter.noise(&at.noise, found.determined, self.estimation);
            let change = scatter.of_reading(&noise) / scatter.of_reading(&at.noise) - 1.0;
            if change.abs() <= NOISE_TOLERANCE {
                return Some(found);
            }
            self.reweigh(at, noise);
        }
        None
    }

    /// One step of fixed noise from `at`, halved until it does not make things worse; `None` if no part of it helps.
    fn advance(&self, at: &Linearised, newton: &Newton, first: f64) -> Option<(Linearised, f64)> {
        let negligible = newton.decrement.powi(2) <= COST_TOLERANCE * at.cost || newton.decrement <= LAST_STEP;
        let mut part = first;
        while part >= SMALLEST_PART {
            let next = self.linearise(&at.z + &newton.delta * part, at.noise);
            if next.cost.is_finite() && (next.cost <= at.cost || negligible) {
                return Some((next, part));
            }
            part /= 2.0;
        }
        None
    }

    /// One step without a new estimate of the noise.
    pub(crate) fn step(&self, at: &Linearised) -> Option<Linearised> {
        let newton = self.newton_at(at)?;
        self.advance(at, &newton, 1.0).map(|(next, _)| next)
    }

    /// Steps until converged or `limit` steps were taken; `record` sees each with the deviations it leads to ((m) and (rad)) and
    /// may ask to stop there.
    pub(crate) fn run(
        &self,
        start: DVector<f64>,
        noise: Noise,
        limit: usize,
        record: &mut dyn FnMut(Iteration, &DVector<f64>) -> ControlFlow<()>,
    ) -> Solution {
        let shot = shot_variance(self.problem, self.groups, noise.stated, self.trust);
        let mut at = self.linearise(start, Noise { shot, ..noise });
        let mut part = 1.0;
        let mut steps = 0;
        let mut is_last = false;
        let termination = loop {
            let Some(newton) = self.newton(&mut at) else { break TerminationReason::NonFinite };
            if is_last {
                break TerminationReason::Converged;
            }
            let is_small = newton.decrement <= CONVERGED;
            if steps == limit {
                break if is_small { TerminationReason::Converged } else { TerminationReason::IterationLimit };
            }
            let Some((next, taken)) = self.advance(&at, &newton, f64::min(1.0, 2.0 * part)) else {
                break if is_small { TerminationReason::Converged } else { TerminationReason::NoImprovement };
            };
            is_last = newton.decrement <= LAST_STEP && taken >= 1.0;
            let change = (&next.x - &at.x).component_div(&self.expected());
            at = next;
            part = taken;
            steps += 1;
            let step = change.amax();
            let flow = record(Iteration { cost: at.cost, step, part, decrement: newton.decrement }, &at.x);
            if flow.is_break() {
                break TerminationReason::IterationLimit;
            }
        };
        Solution { at, termination }
    }

    fn expected(&self) -> DVector<f64> {
        let parameters = self.problem.parameters;
        DVector::from_iterator(parameters.len(), parameters.iter().map(|parameter| parameter.expected))
    }
}
