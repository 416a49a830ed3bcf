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
//! - **Noise.** What poses scatter by, beyond the instrument, is estimated with the parameters: see [`Sigma`].
//! - **Outliers** are points, found with a robust loss and then removed for real.
//! - **Chirality** is checked: distances cannot see a mirrored frame.
//!
//! ```
//! use nalgebra::Isometry3;
//! use trupose_core::identification::{Observations, PointSample, Problem, Settings, identify};
//! use trupose_core::kinematics::{LinkParameter, ParameterId, Place};
//! use trupose_core::profile::{Level, Profile, builtin};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow")?;
//! let nominal = profile.arm();
//! let length = ParameterId::Link { joint: 1, parameter: LinkParameter::A };
//! let real = nominal.with([(length, 0.001)])?; // one link is 1 mm longer
//!
//! // An instrument somewhere in the room measures the target at poses that spread over the joint ranges.
//! let station = Isometry3::translation(2.0, 1.0, 0.5);
//! let value = |pose: usize, joint: usize| 3.0 * ((pose as f64 * (joint as f64 + 2.0).sqrt()).fract() - 0.5);
//! let points = (1..60).map(|pose| {
//!     let at = Place { configuration: (0..6).map(|joint| value(pose, joint)).collect(), target: 0 };
//!     PointSample { point: station.inverse() * real.point_in_base(&at), at, station: 0, sigma: None }
//! });
//! let observations = Observations { points: points.collect(), ..Observations::default() };
//! let parameters = profile.parameters(Level::Geometric);
//! let problem = Problem { arm: &nominal, parameters: &parameters, observations: &observations };
//!
//! let found = identify(&problem, &Settings::default(), &mut |_| {})?;
//! let found = found.estimates.iter().find(|estimate| estimate.id == length).unwrap();
//! assert!((found.deviation - 0.001).abs() < 3.0 * found.sigma);
//! # Ok(())
//! # }
//! ```
//!
//! Vectors and matrices over parameters follow the order of [`Problem::parameters`]; lengths in metres, angles in radians. Nothing
//! here reads a file, a clock or a random number.

#![warn(missing_docs)]
#![warn(clippy::wildcard_enum_match_arm)]

pub mod change;
pub mod circle_point;
mod error;
mod factor;
mod feature;
pub mod joint_check;
mod lengths;
mod linearise;
mod mistake;
mod noise;
mod observability;
mod pairs;
pub mod plausibility;
pub mod predicted;
mod problem;
mod repetitions;
mod result;
pub mod rigid;
mod robust;
mod selection;
mod settings;
mod solver;
mod systematic;
mod terms;
pub mod tested;
pub mod triage;
pub mod verification;

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector, Point3};

pub use error::IdentificationError;
pub use factor::Factor;
pub use feature::{Feature, Shape};
pub use observability::{BlindGroup, Observability};
pub(crate) use pairs::SAME_POINT;
pub use problem::{Length, LengthEnd, Observations, PointSample, Problem, SharedPoint};
pub use repetitions::Places;
pub use result::{Estimate, Identification, Rejected, RejectionReason, SampleIndex, Sigma};
pub use selection::{Scored, Selection, Stage, WithTerms, identify_with_terms};
pub use settings::{Estimator, Iteration, Prior, Settings, SigmaSource, TerminationReason, Weighting};
pub use systematic::Unmodelled;
pub use terms::{TermGroup, Terms};

use crate::geometry::{principal_spread, register};
use crate::kinematics::{Arm, FreeParameter};
use crate::units::MICROMETRE;
use linearise::{SMALLEST_SIGMA, Trust};
use noise::{Estimation, Groups, Noise};
use robust::Decision;
use solver::{Basis, Linearised, Solution, Solve};

/// First guess of what the arm scatters from pose to pose (m).
const FIRST_SIGMA: f64 = 50.0 * MICROMETRE;
/// Two rows are swapped if exchanging their points leaves less than this fraction of their residuals.
const SWAP_FITS: f64 = 0.05;
/// Targets that were found this close (m) to where they were thought to be, and how often they are looked for without a prior.
const SAME_TARGET: f64 = 10.0 * MICROMETRE;
const TARGET_ROUNDS: usize = 6;
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
    if settings.prior == Prior::None && settings.iterations > 1 {
        return identify_without_prior(problem, settings, progress);
    }
    identify_prepared(&Prepared::new(problem, settings)?, settings, progress)
}

/// The directions in which a fit without a prior may move are those that the data see with the targets where they are. The profile
/// only guesses that, so they are judged again where the targets were found.
fn identify_without_prior(
    problem: &Problem<'_>,
    settings: &Settings,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identification, IdentificationError> {
    problem.check()?;
    check_chirality(problem, problem.arm, None)?;
    let is_target = |parameter: &&FreeParameter| parameter.id.target().is_some();
    let free: Vec<FreeParameter> = problem.parameters.iter().filter(is_target).copied().collect();
    if free.is_empty() {
        return identify_prepared(&Prepared::new(problem, settings)?, settings, progress);
    }
    let mut targets = verification::fit_setup(problem.arm, &free, problem.observations)?.arm.targets;
    let mut round = 1;
    loop {
        let found = identify_prepared(&Prepared::seen_with(problem, settings, &targets)?, settings, progress)?;
        let moved = found.arm.targets.iter().zip(&targets).map(|(to, from)| (to - from).norm()).fold(0.0, f64::max);
        if moved <= SAME_TARGET || round == TARGET_ROUNDS {
            return Ok(found);
        }
        targets = found.arm.targets;
        round += 1;
    }
}

/// What is known of the parameters before the data: their deviations with a covariance ((m) and (rad)).
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// Expected deviations from nominal, in the order of [`Problem::parameters`].
    pub mean: DVector<f64>,
    /// Their covariance, positive definite.
    pub covariance: DMatrix<f64>,
}

/// As [`identify_while`], with what is known before the data instead of the prior of the settings.
///
/// # Errors
/// As [`identify_while`]; [`IdentificationError::Belief`] if its sizes do not fit or its covariance is none.
pub fn identify_with_belief(
    problem: &Problem<'_>,
    settings: &Settings,
    belief: &Belief,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identification, IdentificationError> {
    let n = problem.parameters.len();
    if belief.mean.len() != n || belief.covariance.shape() != (n, n) {
        return Err(IdentificationError::Belief);
    }
    let basis = Basis::about(belief)?;
    identify_prepared(&Prepared { basis, ..Prepared::new(problem, settings)? }, settings, progress)
}

fn identify_prepared(
    prepared: &Prepared<'_, '_>,
    settings: &Settings,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identification, IdentificationError> {
    let problem = prepared.problem;
    let everything = Trust::full(problem);
    let solve = prepared.solve(&everything);
    let zero = DVector::zeros(prepared.basis.transform.ncols());
    let stated = settings.sigma.map_or(0.0, |(sigma, _)| sigma.max(SMALLEST_SIGMA).powi(2));
    let noise = Noise { stated, shot: 0.0, pose: FIRST_SIGMA * FIRST_SIGMA, confirmed: 1.0 };
    let mut fit = Fit { iterations: Vec::new(), path: Vec::new(), progress };
    let mut trust = everything.clone();
    let mut unmodelled = Vec::new();
    if settings.estimator == Estimator::Robust {
        let predicted = problem.arm.points_in_base(problem.observations.places());
        let plausible = robust::gross_trust(problem, &predicted);
        let search = Solve { trust: &plausible, estimation: Estimation::Robust, ..solve };
        let searched = fit.solve(&search, zero.clone(), noise, settings.iterations)?;
        let decision = robust::find_outliers(&search, &searched.at);
        (trust, unmodelled) = (decision.trust, decision.unmodelled);
        // The steps on record are those that lead to the result.
        fit.iterations.clear();
        fit.path.clear();
    }
    let solution = fit.solve(&Solve { trust: &trust, ..solve }, zero, noise, settings.iterations)?;
    Ok(Identification { unmodelled, ..prepared.finish(settings, fit, &trust, solution)? })
}

/// Where a fit with more parameters begins: at what one with fewer found.
struct Start<'a> {
    /// The other fit.
    found: &'a Identification,
    /// First guess of the deviations, in expected deviations.
    deviations: DVector<f64>,
    /// First guess of the noise.
    noise: Noise,
    /// Samples that the other fit accepted.
    trust: Trust,
}

/// As [`identify_while`] from `start`: samples change sides only where this fit disagrees about them.
fn identify_from(
    problem: &Problem<'_>,
    settings: &Settings,
    start: Start<'_>,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identification, IdentificationError> {
    let Start { found, deviations, noise, mut trust } = start;
    let prepared = Prepared::new(problem, settings)?;
    let n = problem.parameters.len();
    let mut fit = Fit {
        iterations: found.iterations.clone(),
        path: found.path.iter().map(|step| step.clone().resize_vertically(n, 0.0)).collect(),
        progress,
    };
    let mut solution = fit.solve(&prepared.solve(&trust), deviations, noise, settings.iterations)?;
    let mut unmodelled = Vec::new();
    if settings.estimator == Estimator::Robust {
        let settled = robust::settle(&prepared.solve(&trust), solution.at.clone());
        let decision = Decision::new(&prepared.solve(&trust), settled.trust, &settled.at);
        unmodelled = decision.unmodelled;
        if decision.trust != trust {
            trust = decision.trust;
            let Linearised { z, noise, .. } = settled.at;
            solution = fit.solve(&prepared.solve(&trust), z, noise, settings.iterations)?;
        }
    }
    Ok(Identification { unmodelled, ..prepared.finish(settings, fit, &trust, solution)? })
}

/// A problem that was found to be well posed, with what every fit of it needs.
struct Prepared<'a, 'p> {
    problem: &'a Problem<'p>,
    weighting: Weighting,
    observability: Observability,
    basis: Basis,
    groups: Groups,
}

impl<'a, 'p> Prepared<'a, 'p> {
    fn new(problem: &'a Problem<'p>, settings: &Settings) -> Result<Self, IdentificationError> {
        problem.check()?;
        if problem.parameters.is_empty() {
            return Err(IdentificationError::NoParameters);
        }
        let observability = Observability::new(&problem.of_geometry(&geometry(problem)));
        check_chirality(problem, problem.arm, None)?;
        let basis = Basis::new(problem, settings.prior, &observability)?;
        Ok(Self { problem, weighting: settings.weighting, observability, basis, groups: Groups::new(problem) })
    }

    /// Without a prior, with the directions that the data see with the targets at these positions. What the data cannot tell from a move
    /// of a target is left to the arm as designed.
    fn seen_with(
        problem: &'a Problem<'p>,
        settings: &Settings,
        targets: &[Point3<f64>],
    ) -> Result<Self, IdentificationError> {
        let arm = Arm { targets: targets.to_vec(), ..problem.arm.clone() };
        let observability = Observability::new(&Problem { arm: &arm, ..problem.of_geometry(&geometry(problem)) });
        let deviation = |parameter: &FreeParameter| {
            let value = |arm: &Arm| parameter.id.target().and_then(|_| arm.value(parameter.id)).unwrap_or(0.0);
            value(&arm) - value(problem.arm)
        };
        let mean = DVector::from_iterator(problem.parameters.len(), problem.parameters.iter().map(deviation));
        let basis = Basis::new(problem, Prior::None, &observability)?.about_mean(mean);
        Ok(Self { problem, weighting: settings.weighting, observability, basis, groups: Groups::new(problem) })
    }

    fn solve<'s>(&'s self, trust: &'s Trust) -> Solve<'s, 'p> {
        let Self { problem, weighting, basis, groups, .. } = self;
        Solve { problem, weighting: *weighting, basis, groups, trust, estimation: Estimation::Efficient }
    }

    fn finish(
        &self,
        settings: &Settings,
        fit: Fit<'_>,
        trust: &Trust,
        solution: Solution,
    ) -> Result<Identification, IdentificationError> {
        let Solution { at, termination } = solution;
        if termination == TerminationReason::NonFinite || !at.x.iter().all(|value| value.is_finite()) {
            return Err(IdentificationError::Diverged);
        }
        check_chirality(self.problem, &at.arm, Some(trust))?;
        let Fit { iterations, path, .. } = fit;
        let observability = self.observability.clone();
        Ok(summarise(&self.solve(trust), settings, Solved { iterations, path, termination, at, observability }))
    }
}

/// The parameters that are no errors of joints: the data alone need not determine those, so that they have no part in the rank.
fn geometry(problem: &Problem<'_>) -> Vec<FreeParameter> {
    problem.parameters.iter().copied().filter(|parameter| !parameter.id.is_joint_error()).collect()
}

/// The record of an identification.
struct Fit<'a> {
    iterations: Vec<Iteration>,
    path: Vec<DVector<f64>>,
    progress: &'a mut dyn FnMut(&Iteration) -> ControlFlow<()>,
}

impl Fit<'_> {
    fn solve(
        &mut self,
        solve: &Solve<'_, '_>,
        start: DVector<f64>,
        noise: Noise,
        limit: usize,
    ) -> Result<Solution, IdentificationError> {
        let mut cancelled = false;
        let solution = solve.run(start, noise, limit.max(1), &mut |iteration, deviations| {
            let flow = (self.progress)(&iteration);
            cancelled |= flow.is_break();
            self.iterations.push(iteration);
            self.path.push(deviations.clone());
            flow
        });
        if cancelled { Err(IdentificationError::Cancelled) } else { Ok(solution) }
    }
}

/// A finished solve.
struct Solved {
    iterations: Vec<Iteration>,
    path: Vec<DVector<f64>>,
    termination: TerminationReason,
    at: Linearised,
    observability: Observability,
}

fn summarise(solve: &Solve<'_, '_>, settings: &Settings, solved: Solved) -> Identification {
    let Solved { iterations, path, termination, at, observability } = solved;
    let problem = solve.problem;
    let sigma = sigma(solve, settings, &at);
    let covariance = covariance(solve, &at);
    let feature_covariances = solve.feature_covariances(&at, &in_nominal_base(problem, &observability, &covariance));
    let rejected = rejected(solve, &at);
    let observability = if rejected.is_empty() && at.arm.targets == problem.arm.targets {
        observability
    } else {
        // As designed, so that parallel axes are parallel, but with the targets where they are: a guess of the profile on the last
        // axis would hide what the data can tell.
        let arm = Arm { targets: at.arm.targets.clone(), ..problem.arm.clone() };
        let accepted = problem.observations.without(&rejected);
        let geometry = geometry(problem);
        Observability::new(&Problem { arm: &arm, observations: &accepted, ..problem.of_geometry(&geometry) })
    };
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
    Identification {
        arm: at.arm,
        estimates,
        covariance,
        observability,
        sigma,
        rejected,
        unmodelled: Vec::new(),
        iterations,
        path,
        termination,
        base_from_station: at.points.base_from_station,
        features: at.points.features,
        feature_covariances,
        residuals: at.points.of_places,
    }
}

/// The scatter of the readings, in its parts.
fn sigma(solve: &Solve<'_, '_>, settings: &Settings, at: &Linearised) -> Sigma {
    let scatter = solve.scatter(at, &DVector::zeros(at.x.len()));
    let determined = solve.determined(at);
    let from_residuals = determined.and_then(|determined| scatter.root_mean_square(determined));
    let normalised = determined.and_then(|determined| scatter.normalised(determined));
    let readings = solve.problem.observations.points.iter().map(|sample| sample.sigma).collect::<Option<Vec<f64>>>();
    let (instrument, source) = match (readings.filter(|readings| !readings.is_empty()), settings.sigma) {
        (Some(readings), _) => {
            let mean = readings.iter().map(|sigma| sigma * sigma).sum::<f64>() / readings.len() as f64;
            (Some(mean.sqrt()), SigmaSource::Readings)
        }
        (None, Some((sigma, source))) => (Some(sigma.max(SMALLEST_SIGMA)), source),
        (None, None) if from_residuals.is_some() => (None, SigmaSource::Residuals),
        (None, None) => (None, SigmaSource::Assumed),
    };
    Sigma {
        used: scatter.of_reading(&at.noise),
        confirmed: at.noise.confirmed,
        source,
        from_residuals,
        normalised,
        instrument,
        shots: at.noise.shot.sqrt(),
        poses: at.noise.pose.sqrt(),
    }
}

/// Covariance of the deviations: `T H⁻¹ (cov(gradient) + Λ) H⁻¹ Tᵀ` with `H = TᵀGT + Λ`. For rows that are weighted with their
/// covariance this is the posterior `T H⁻¹ Tᵀ`.
fn covariance(solve: &Solve<'_, '_>, at: &Linearised) -> DMatrix<f64> {
    let t = &solve.basis.transform;
    let n = t.nrows();
    let Some(factor) = Factor::new(solve.hessian(at)) else { return DMatrix::from_element(n, n, f64::NAN) };
    let inverse = factor.inverse();
    let Some(gradient_covariance) = at.normal.gradient_covariance.as_ref() else { return solve.basis.spread(&inverse) };
    let mut middle = solve.basis.reduce(gradient_covariance);
    for index in 0..middle.nrows() {
        middle[(index, index)] += solve.basis.prior_weight;
    }
    solve.basis.spread(&(&inverse * middle * &inverse))
}

/// The covariance without what only moves the base of the robot: parameters of the first link that the data cannot find.
fn in_nominal_base(problem: &Problem<'_>, observability: &Observability, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let moves_base =
        |index: usize| problem.parameters[index].id.joint() == Some(0) && !observability.is_identifiable(index);
    let n = covariance.nrows();
    DMatrix::from_fn(n, n, |i, j| if moves_base(i) || moves_base(j) { 0.0 } else { covariance[(i, j)] })
}

/// The samples without trust, with the likely cause.
fn rejected(solve: &Solve<'_, '_>, at: &Linearised) -> Vec<Rejected> {
    let problem = solve.problem;
    let points = &problem.observations.points;
    let places = solve.trust.places.len();
    let left_out: Vec<usize> =
        (0..solve.trust.samples().0).filter(|&sample| solve.trust.of_sample(sample) <= 0.0).collect();
    if left_out.is_empty() {
        return Vec::new();
    }
    let judged = robust::judge(solve, at);
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
    let scatter = solve.scatter(at, &DVector::zeros(at.x.len()));
    let typical = scatter.of_reading(&at.noise);
    let length_residual = |index: usize| at.rows.residuals.get(3 * places + index).map_or(0.0, |error| error.abs());
    left_out
        .iter()
        .map(|&sample| {
            let (index, residual) = if sample < places {
                (SampleIndex::Place(sample), at.points.of_places[sample].norm())
            } else {
                (SampleIndex::Length(sample - places), length_residual(sample - places))
            };
            let typed = || {
                let point = points.get(sample)?;
                let station = at.points.base_from_station.get(point.station)?;
                let fitting = station.inverse_transform_point(&predicted(sample));
                RejectionReason::typed(&point.point, &fitting, typical)
            };
            let reason = swapped(sample)
                .map_or_else(|| typed().unwrap_or(RejectionReason::Outlier), RejectionReason::SwappedWith);
            Rejected { sample: index, residual, ratio: judged.ratios[sample], reason }
        })
        .collect()
}

/// Distances cannot see a mirrored frame; the registration can.
fn check_chirality(problem: &Problem<'_>, arm: &Arm, trust: Option<&Trust>) -> Result<(), IdentificationError> {
    let samples = &problem.observations.points;
    let predicted = arm.points_in_base(samples.iter().map(|sample| &sample.at));
    let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
    for station in 0..stations {
        let members = samples.iter().zip(&predicted).enumerate().filter(|(index, (sample, _))| {
            sample.station == station && trust.is_none_or(|trust| trust.places[*index] > 0.0)
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
