//! Identification of kinematic errors from distances between measured points.
//!
//! Method: "A distance error based industrial robot kinematic calibration method", Industrial Robot 41/5 (2014) 439–446. Only
//! distances enter, so the instrument is never registered to the robot base. What the paper leaves open is settled as follows:
//!
//! - **Scaling.** Every parameter is measured in units of its expected deviation ([`crate::kinematics::FreeParameter::expected`]).
//! - **Identifiability.** The rank comes from a clear gap in the singular values; blind directions are named ([`Observability`]).
//! - **Prior.** A zero-mean prior with the expected deviations ([`Prior::Expected`]), or the minimum-norm solution of the paper.
//! - **Weighting.** M points give M(M−1)/2 distances but only 3M − 6 independent values. Weighted with their true covariance the
//!   distances are the position problem with the rigid motion projected out ([`Weighting::Covariance`]); the paper's choice is
//!   [`Weighting::Uniform`]. Standard deviations are right for either.
//! - **Outliers** are points, found with a robust loss and then removed for real.
//! - **Chirality** is checked: distances cannot see a mirrored frame.
//!
//! Vectors and matrices over parameters follow the order of [`Problem::parameters`]; lengths in metres, angles in radians. Nothing
//! here reads a file, a clock or a random number.

#![warn(missing_docs)]
#![warn(clippy::wildcard_enum_match_arm)]

pub mod circle_point;
mod error;
mod linearise;
mod observability;
mod pairs;
pub mod plausibility;
pub mod predicted;
mod problem;
mod repetitions;
mod result;
mod robust;
mod settings;
mod solver;
pub mod triage;
pub mod verification;

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector, Point3};

pub use error::IdentificationError;
pub use observability::{BlindGroup, Observability};
pub(crate) use pairs::SAME_POINT;
pub use problem::{Length, LengthEnd, Observations, PointSample, Problem, SharedPoint};
pub use repetitions::Places;
pub use result::{Estimate, Identification, Rejected, RejectionReason, SampleIndex, Sigma};
pub use settings::{Estimator, Iteration, Prior, Settings, SigmaSource, TerminationReason, Weighting};

use crate::geometry::{principal_spread, register};
use crate::kinematics::Arm;
use crate::units::MICROMETRE;
use linearise::{Evaluation, SMALLEST_SIGMA, Weights, length_rows};
use solver::{Basis, Linearised, Solve};

/// First guess of σ where it is estimated (m).
const FIRST_SIGMA: f64 = 50.0 * MICROMETRE;
/// Two rows are swapped if exchanging their points leaves less than this fraction of their residuals.
const SWAP_FITS: f64 = 0.05;
/// Rounds of estimating σ, and the relative change that ends them.
const SIGMA_ROUNDS: usize = 50;
const SIGMA_TOLERANCE: f64 = 1e-4;
/// A mirrored registration must be this much better than the proper one to be called the truth.
const MIRROR_RATIO: f64 = 0.4;

/// Identifies the free parameters of `problem`. `progress` sees every step of the solver as it is taken.
///
/// # Errors
/// Misuse of the problem, a rank that cannot be decided where one is needed, or a mirrored frame. Not having converged is not
/// an error but a [`TerminationReason`].
pub fn identify(
    problem: &Problem<'_>,
    settings: &Settings,
    progress: &mut dyn FnMut(&Iteration),
) -> Result<Identification, IdentificationError> {
    identify_while(problem, settings, &mut |iteration| {
        progress(iteration);
        ControlFlow::Continue(())
    })
}

/// As [`identify`], but `progress` may ask to stop after any step.
///
/// # Errors
/// As [`identify`]; [`IdentificationError::Cancelled`] once `progress` has asked to stop.
pub fn identify_while(
    problem: &Problem<'_>,
    settings: &Settings,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identification, IdentificationError> {
    problem.check()?;
    if problem.parameters.is_empty() {
        return Err(IdentificationError::NoParameters);
    }
    let observability = Observability::new(problem);
    let nominal = problem.arm;
    check_chirality(problem, nominal, None)?;
    let basis = Basis::new(problem, settings.prior, &observability)?;

    let mut fit = Fit {
        problem,
        settings,
        basis: &basis,
        weights: Weights::uniform(problem, settings.sigma.map_or(FIRST_SIGMA, |(sigma, _)| sigma.max(SMALLEST_SIGMA))),
        iterations: Vec::new(),
        path: Vec::new(),
        progress,
    };
    let zero = DVector::zeros(basis.transform.ncols());
    if settings.estimator == Estimator::Robust {
        let predicted = nominal.points_in_base(problem.observations.places());
        fit.weights.trust = robust::gross_trust(problem, &predicted);
    }
    let mut at = fit.solve(zero.clone())?;
    if settings.estimator == Estimator::Robust {
        // Where σ was stated, a sample within it is never an outlier, however good the others are.
        let floor = if settings.sigma.is_some() || has_own_sigmas(problem) { 1.0 } else { 1e-3 };
        let solve = Solve { problem, weighting: settings.weighting, basis: &basis, weights: &fit.weights };
        let trusted = robust::find_outliers(&solve, &at.0, floor);
        if (&trusted.trust, &trusted.length_trust) != (&fit.weights.trust, &fit.weights.length_trust) {
            // From the start: the steps on record are those that lead to the result.
            fit.weights = trusted;
            fit.iterations.clear();
            fit.path.clear();
            at = fit.solve(zero)?;
        }
    }
    let (at, termination) = at;
    if termination == TerminationReason::NonFinite || !at.x.iter().all(|value| value.is_finite()) {
        return Err(IdentificationError::Diverged);
    }
    check_chirality(problem, &at.arm, Some(&fit.weights))?;
    let Fit { weights, iterations, path, .. } = fit;
    Ok(summarise(Solved {
        problem,
        settings,
        basis: &basis,
        weights,
        iterations,
        path,
        termination,
        at,
        observability,
    }))
}

/// Whether every point comes with its own σ.
fn has_own_sigmas(problem: &Problem<'_>) -> bool {
    let points = &problem.observations.points;
    !points.is_empty() && points.iter().all(|sample| sample.sigma.is_some())
}

/// The running state of an identification.
struct Fit<'a, 'p> {
    problem: &'a Problem<'p>,
    settings: &'a Settings,
    basis: &'a Basis,
    weights: Weights,
    iterations: Vec<Iteration>,
    path: Vec<DVector<f64>>,
    progress: &'a mut dyn FnMut(&Iteration) -> ControlFlow<()>,
}

impl Fit<'_, '_> {
    /// Solves with the weights as they are; where σ is estimated, repeats with the σ of the residuals until both agree.
    fn solve(&mut self, start: DVector<f64>) -> Result<(Linearised, TerminationReason), IdentificationError> {
        let mut z = start;
        let mut rounds = 0;
        loop {
            let solve = Solve {
                problem: self.problem,
                weighting: self.settings.weighting,
                basis: self.basis,
                weights: &self.weights,
            };
            let before = self.iterations.len();
            let left = self.settings.iterations.saturating_sub(before).max(usize::from(before == 0));
            let (iterations, path, progress) = (&mut self.iterations, &mut self.path, &mut *self.progress);
            let mut cancelled = false;
            let mut record = |iteration, deviations: &DVector<f64>| {
                let flow = progress(&iteration);
                cancelled |= flow.is_break();
                iterations.push(iteration);
                path.push(deviations.clone());
                flow
            };
            let (at, termination) = solve.run(z, left, &mut record);
            if cancelled {
                return Err(IdentificationError::Cancelled);
            }
            rounds += 1;
            let stop = termination != TerminationReason::Converged || rounds >= SIGMA_ROUNDS;
            let estimated = self.settings.sigma.is_none().then(|| residual_sigma(&solve, &at)).flatten();
            let Some(sigma) = estimated.map(|scatter| scatter.absolute.max(SMALLEST_SIGMA)) else {
                return Ok((at, termination));
            };
            // Without a prior σ only scales the cost: the solution is the same.
            let settled =
                (sigma / self.weights.sigma - 1.0).abs() < SIGMA_TOLERANCE || self.settings.prior == Prior::None;
            self.weights.sigma = sigma;
            if settled || stop {
                return Ok((solve_with(self, at.z), termination));
            }
            z = at.z;
        }
    }
}

/// Linearises once more with the final weights.
fn solve_with(fit: &Fit<'_, '_>, z: DVector<f64>) -> Linearised {
    Solve { problem: fit.problem, weighting: fit.settings.weighting, basis: fit.basis, weights: &fit.weights }
        .linearise(z)
}

/// Scatter of the residuals.
#[derive(Clone, Copy, Debug)]
struct Scatter {
    /// Root mean square (m), of samples without a σ of their own if there are any.
    absolute: f64,
    /// Root mean square in units of the σ of each sample.
    normalised: f64,
}

/// Scatter of the residuals, over independent values less the parameters that the data (not the prior) determined. `None` where
/// nothing is left over to tell.
fn residual_sigma(solve: &Solve<'_, '_>, at: &Linearised) -> Option<Scatter> {
    let Solve { problem, weights, basis, .. } = solve;
    let observations = problem.observations;
    let (mut square, mut normalised, mut values) = (0.0, 0.0, 0.0);
    let mut add = |residual: f64, sigma: f64| {
        square += residual;
        normalised += residual / (sigma * sigma);
    };
    let stations = at.points.base_from_station.len();
    let mut seen = vec![0.0; stations];
    for (index, sample) in observations.points.iter().enumerate() {
        if weights.trust[index] > 0.0 {
            add(at.points.of_places[index].norm_squared(), weights.sigma_of(problem, index));
            seen[sample.station] += 3.0;
        }
    }
    values += seen.iter().map(|values| (values - 6.0_f64).max(0.0)).sum::<f64>();
    let mut place = observations.points.len();
    for shared in &observations.shared {
        let seats = (place..place + shared.at.len()).filter(|&index| weights.trust[index] > 0.0);
        values += 3.0 * seats.clone().count().saturating_sub(1) as f64;
        for index in seats {
            add(at.points.of_places[index].norm_squared(), weights.sigma);
        }
        place += shared.at.len();
    }
    if !observations.lengths.is_empty() {
        let evaluation = Evaluation::new(problem, &at.arm);
        let rows = length_rows(problem, &evaluation, weights, weights);
        for ((length, residual), trust) in observations.lengths.iter().zip(&rows.residuals).zip(&weights.length_trust) {
            // A known distance between sockets is a condition, not a sample of the scatter.
            if *trust > 0.0
                && (length.sigma.is_none() || observations.points.is_empty() && observations.shared.is_empty())
            {
                let sigma = length.sigma.unwrap_or(weights.sigma).max(SMALLEST_SIGMA);
                add((residual * sigma).powi(2), sigma);
                values += 1.0;
            }
        }
    }
    let data = basis.reduce(&at.normal.gram);
    let determined = solve.hessian(at).cholesky().map(|factor| factor.solve(&data).trace())?;
    let freedom = values - determined;
    (freedom >= 1.0).then(|| Scatter { absolute: (square / freedom).sqrt(), normalised: (normalised / freedom).sqrt() })
}

/// A finished solve.
struct Solved<'a, 'p> {
    problem: &'a Problem<'p>,
    settings: &'a Settings,
    basis: &'a Basis,
    weights: Weights,
    iterations: Vec<Iteration>,
    path: Vec<DVector<f64>>,
    termination: TerminationReason,
    at: Linearised,
    observability: Observability,
}

fn summarise(solved: Solved<'_, '_>) -> Identification {
    let Solved { problem, settings, basis, weights, iterations, path, termination, at, observability } = solved;
    let solve = Solve { problem, weighting: settings.weighting, basis, weights: &weights };
    let scatter = residual_sigma(&solve, &at);
    let (from_residuals, normalised) = (scatter.map(|s| s.absolute), scatter.map(|s| s.normalised));
    let readings = problem.observations.points.iter().map(|sample| sample.sigma).collect::<Option<Vec<f64>>>();
    let (used, source) = match (readings.filter(|readings| !readings.is_empty()), settings.sigma) {
        (Some(readings), _) => {
            let mean = readings.iter().map(|sigma| sigma * sigma).sum::<f64>() / readings.len() as f64;
            (mean.sqrt(), SigmaSource::Readings)
        }
        (None, Some((_, source))) => (weights.sigma, source),
        (None, None) if scatter.is_some() => (weights.sigma, SigmaSource::Residuals),
        (None, None) => (weights.sigma, SigmaSource::Assumed),
    };
    let sigma = Sigma { used, source, from_residuals, normalised };
    let covariance = covariance(&solve, &at, sigma.excess());
    let estimates = problem
        .parameters
        .iter()
        .enumerate()
        .map(|(index, parameter)| Estimate {
            id: parameter.id,
            nominal: problem.arm.value(parameter.id).unwrap_or(0.0),
            deviation: at.x[index],
            sigma: covariance[(index, index)].max(0.0).sqrt(),
            expected: parameter.expected,
            identifiable: observability.is_identifiable(index),
        })
        .collect();
    let rejected = rejected(&solve, &at, &weights);
    let observability = if rejected.is_empty() {
        observability
    } else {
        let accepted = problem.observations.without(&rejected);
        Observability::new(&Problem { observations: &accepted, ..*problem })
    };
    Identification {
        arm: at.arm,
        estimates,
        covariance,
        observability,
        sigma,
        rejected,
        iterations,
        path,
        termination,
        base_from_station: at.points.base_from_station,
        residuals: at.points.of_places,
    }
}

/// Covariance of the deviations: `T H⁻¹ (excess² · cov(gradient) + Λ) H⁻¹ Tᵀ` with `H = TᵀGT + Λ`. For independent rows and no
/// excess this is the posterior `T H⁻¹ Tᵀ`.
fn covariance(solve: &Solve<'_, '_>, at: &Linearised, excess: f64) -> DMatrix<f64> {
    let t = &solve.basis.transform;
    let n = t.nrows();
    let Some(factor) = solve.hessian(at).cholesky() else { return DMatrix::from_element(n, n, f64::NAN) };
    let gradient_covariance = at.normal.gradient_covariance.as_ref().unwrap_or(&at.normal.gram);
    let mut middle = solve.basis.reduce(gradient_covariance) * (excess * excess);
    for index in 0..middle.nrows() {
        middle[(index, index)] += solve.basis.prior_weight;
    }
    let left = factor.solve(&middle);
    let inner = factor.solve(&left.transpose());
    t * inner * t.transpose()
}

/// The samples without trust, with the likely cause.
fn rejected(solve: &Solve<'_, '_>, at: &Linearised, weights: &Weights) -> Vec<Rejected> {
    let problem = solve.problem;
    let points = &problem.observations.points;
    let lengths = &problem.observations.lengths;
    let places = points.len() + problem.observations.shared.iter().map(|shared| shared.at.len()).sum::<usize>();
    let left_out: Vec<usize> =
        (0..places + lengths.len()).filter(|&sample| weights.of_sample(sample, places) <= 0.0).collect();
    if left_out.is_empty() {
        return Vec::new();
    }
    let judged = robust::judge(solve, at, weights, 0.0);
    let predicted = |place: usize| at.arm.point_in_base(&points[place].at);
    let measured = |place: usize| at.points.base_from_station[points[place].station] * points[place].point;
    // Close enough to be the other's point: a small part of how far off each is where it stands.
    let fits = |place: usize, other: usize| {
        let own = at.points.of_places[place].norm().min(at.points.of_places[other].norm());
        (measured(other) - predicted(place)).norm() < SWAP_FITS * own
    };
    let swapped = |place: usize| {
        left_out
            .iter()
            .copied()
            .filter(|&other| other != place && place < points.len() && other < points.len())
            .find(|&other| fits(place, other) && fits(other, place))
    };
    let length_residual = |index: usize| {
        let errors = verification::DirectErrors::new(&at.arm, problem.observations);
        errors.lengths.get(index).map_or(0.0, |error| error.abs())
    };
    left_out
        .iter()
        .map(|&sample| {
            let (index, residual) = if sample < places {
                (SampleIndex::Place(sample), at.points.of_places[sample].norm())
            } else {
                (SampleIndex::Length(sample - places), length_residual(sample - places))
            };
            let reason = swapped(sample).map_or(RejectionReason::Outlier, RejectionReason::SwappedWith);
            Rejected { sample: index, residual, ratio: judged.ratios[sample], reason }
        })
        .collect()
}

/// Distances cannot see a mirrored frame; the registration can.
fn check_chirality(problem: &Problem<'_>, arm: &Arm, weights: Option<&Weights>) -> Result<(), IdentificationError> {
    let samples = &problem.observations.points;
    let predicted = arm.points_in_base(samples.iter().map(|sample| &sample.at));
    let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
    for station in 0..stations {
        let members = samples.iter().zip(&predicted).enumerate().filter(|(index, (sample, _))| {
            sample.station == station && weights.is_none_or(|weights| weights.trust[*index] > 0.0)
        });
        let pairs = members.map(|(_, (sample, predicted))| (1.0, *predicted, sample.point));
        let reversed = pairs.clone().map(|(weight, from, to)| (weight, Point3::new(-from.x, from.y, from.z), to));
        let (Some(proper), Some(mirrored)) = (register(pairs), register(reversed)) else { continue };
        let spread = principal_spread(predicted.iter());
        // Points in a plane are their own mirror image: nothing can be said, and nothing is wrong.
        let decidable = spread[2] > 3.0 * mirrored.rms;
        if decidable && mirrored.rms < MIRROR_RATIO * proper.rms {
            return Err(IdentificationError::Mirrored { proper: proper.rms, mirrored: mirrored.rms });
        }
    }
    Ok(())
}
