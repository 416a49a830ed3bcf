//! Do these data describe this robot at all? Looks for the mistakes that turn a calibration into nonsense: wrong unit, wrong
//! joint sign or zero, joints that never move, too few or flat points.
//!
//! The yardstick is the nominal model itself: with frame and target fitted, its residual cannot exceed what the expected
//! deviations allow by much. Where it does, each mistake is tried in turn and the one that explains the data is named. This
//! happens before identification, because a solver bends parameters until nonsense looks like a fit.

use nalgebra::{DMatrix, Point3, SymmetricEigen};

use super::linearise::{Evaluation, Weights, point_residuals, project};
use super::mistake;
use super::problem::{Observations, PointSample, Problem};
use super::robust::gross_trust;
use super::{Estimator, Identification, IdentificationError, Observability, Settings, SigmaSource, identify};
use crate::geometry::{principal_spread, register};
use crate::kinematics::{Arm, FreeParameter, JointType, Place};
use crate::units::{DEGREE, MILLIMETRE, to_mm};

pub use super::mistake::{Columns, Mistake};

/// Nominal residuals beyond this many expected ones are not explained by a robot with its expected deviations.
const IMPLAUSIBLE: f64 = 6.0;
/// Nominal residuals below this (m) are never called implausible: every arm deserves a few millimetres.
const ALWAYS_PLAUSIBLE: f64 = 5.0 * MILLIMETRE;
/// A mistake explains the data if it lowers the residual to this fraction.
const EXPLAINS: f64 = 0.25;
/// A mistake explains the data only if what is left is below this fraction of their extent.
const FITS: f64 = 0.1;
/// Evenly picked points that are tried against each mistake: a mistake in a whole table shows in any part of it.
pub(super) const TRIED_POINTS: usize = 500;
/// Points at which mistakes of several numbers are looked at, and how many of those mistakes are then tried.
const GLANCED_AT: usize = 60;
const LOOKED_INTO: usize = 12;
/// Mistakes whose residuals are within this factor of the smallest, or this part of the extent, explain the data equally well.
const EQUALLY: f64 = 1.5;
const SAME_FIT: f64 = 0.002;
/// Most explanations that are named.
const NAMED: usize = 3;
/// A joint that moves less than this over the whole set does not move (rad).
const STILL_JOINT: f64 = 5.0 * DEGREE;
/// The same for a prismatic joint (m).
const STILL_SLIDE: f64 = 20.0 * MILLIMETRE;
/// Independent values per independent combination below which the error bars rest on too little.
const VALUES_PER_COMBINATION: usize = 2;
/// A combination of which this part of the expected variance is left rests on the prior more than on the data.
const WEAK: f64 = 0.5;
/// Points flatter than this fraction of their extent are a plane.
const FLAT: f64 = 0.02;

/// How the measured points compare with the nominal robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plausibility {
    /// Typical (median) distance of the measured points from the nominal prediction, frame and target fitted robustly (m): a few
    /// wrong rows do not change it.
    pub nominal: f64,
    /// Root mean square distance that the expected deviations predict (m).
    pub expected: f64,
    /// The mistakes that explain a nominal residual which is too large, each on its own and equally well, the likeliest first.
    pub mistakes: Vec<Mistake>,
}

impl Plausibility {
    /// Whether the robot with its expected deviations can have produced the points.
    pub fn is_plausible(&self) -> bool {
        self.nominal <= (IMPLAUSIBLE * self.expected).max(ALWAYS_PLAUSIBLE)
    }
}

/// Compares the points of `problem` with its nominal model and, where they do not fit, looks for the mistake.
///
/// # Errors
/// Sizes or indices that do not fit.
pub fn compare_with_nominal(problem: &Problem<'_>) -> Result<Plausibility, IdentificationError> {
    problem.check()?;
    // All points weigh the same here: what the instrument promises for each is no yardstick for a mistake, and residuals would
    // be counted in those standard deviations instead of metres.
    let points = problem.observations.points.iter().map(|sample| PointSample { sigma: None, ..sample.clone() });
    let observations = Observations { points: points.collect(), ..problem.observations.clone() };
    let problem = &Problem { observations: &observations, ..*problem };
    let expected = expected_residual(problem);
    let trial = Trial::new(problem);
    let all = &problem.observations.points;
    let points = evenly(all, TRIED_POINTS);
    let fit = trial.fit(&points);
    let mut plausibility = Plausibility { nominal: fit.typical, expected, mistakes: Vec::new() };
    if points.len() >= 4 && !plausibility.is_plausible() {
        plausibility.mistakes = trial.find_mistakes(all, &points, fit.relative());
    }
    Ok(plausibility)
}

/// Root mean square residual (m) that the expected deviations predict once frame and target are fitted. Readings must not have
/// standard deviations of their own.
fn expected_residual(problem: &Problem<'_>) -> f64 {
    let evaluation = Evaluation::new(problem, problem.arm);
    let weights = Weights::uniform(problem, 1.0);
    let residuals = point_residuals(problem, &evaluation.points, &weights);
    let gram = project(problem, evaluation, &residuals, &weights).normal_equations().gram;
    let of_links = problem.parameters.iter().enumerate().filter(|(_, p)| p.id.target().is_none());
    let variance: f64 = of_links.map(|(index, p)| gram[(index, index)] * p.expected * p.expected).sum();
    (variance / problem.observations.points.len().max(1) as f64).sqrt()
}

/// The nominal arm with frame and free target fitted robustly to altered data.
struct Trial<'a, 'p> {
    problem: &'a Problem<'p>,
    target_parameters: Vec<FreeParameter>,
}

impl<'a, 'p> Trial<'a, 'p> {
    fn new(problem: &'a Problem<'p>) -> Self {
        let is_target = |p: &&FreeParameter| p.id.target().is_some();
        Self { problem, target_parameters: problem.parameters.iter().filter(is_target).copied().collect() }
    }

    /// The nominal arm on `points`.
    fn fit(&self, points: &[PointSample]) -> TrialFit {
        let observations = Observations { points: points.to_vec(), ..Observations::default() };
        let problem = Problem { parameters: &self.target_parameters, observations: &observations, ..*self.problem };
        let mut predicted = problem.arm.points_in_base(observations.places());
        if !self.target_parameters.is_empty() {
            let settings = Settings {
                iterations: 20,
                sigma: Some((MILLIMETRE, SigmaSource::Option)),
                estimator: Estimator::LeastSquares,
                ..Settings::default()
            };
            if let Ok(found) = identify(&problem, &settings, &mut |_| {}) {
                predicted = found.arm.points_in_base(observations.places());
            }
        }
        let trust = gross_trust(&problem, &predicted);
        let weights = Weights::trusting(&problem, &trust, MILLIMETRE);
        let mut norms: Vec<f64> =
            point_residuals(&problem, &predicted, &weights).of_places.iter().map(nalgebra::Matrix::norm).collect();
        norms.sort_by(f64::total_cmp);
        let typical = norms.get(norms.len() / 2).copied().unwrap_or(0.0);
        TrialFit { typical, extent: extent(&predicted) }
    }

    /// Mistakes that explain the `picked` of `all` points, the likeliest of those that fit equally first.
    fn find_mistakes(&self, all: &[PointSample], picked: &[PointSample], as_given: f64) -> Vec<Mistake> {
        let arm = self.problem.arm;
        let predicted = arm.points_in_base(picked.iter().map(|sample| &sample.at));
        let measured: Vec<Point3<f64>> = picked.iter().map(|sample| sample.point).collect();
        let ratio = extent(&measured) / extent(&predicted);
        let mut trials = mistake::simple(arm, picked, ratio);
        let mut compound: Vec<(f64, mistake::Trial)> =
            mistake::compound(arm, all, picked).into_iter().map(|trial| (self.glance(&trial.1), trial)).collect();
        compound.sort_by(|a, b| a.0.total_cmp(&b.0));
        trials.extend(compound.into_iter().take(LOOKED_INTO).map(|(_, trial)| trial));
        let mut fitting: Vec<(f64, Mistake)> = trials
            .into_iter()
            .map(|(mistake, altered)| (self.fit(&evenly(&altered, TRIED_POINTS)).relative(), mistake))
            .filter(|(relative, _)| *relative < EXPLAINS * as_given && *relative < FITS)
            .collect();
        let best = fitting.iter().map(|(relative, _)| *relative).fold(f64::INFINITY, f64::min);
        fitting.retain(|(relative, _)| *relative < (EQUALLY * best).max(best + SAME_FIT));
        fitting.sort_by(|a, b| a.1.rarity().cmp(&b.1.rarity()).then(a.0.total_cmp(&b.0)));
        let mut found: Vec<Mistake> = Vec::new();
        for (_, mistake) in fitting {
            // A joint that hardly matters can be added to any explanation.
            if found.len() < NAMED && !found.iter().any(|simpler| mistake.contains(simpler)) {
                found.push(mistake);
            }
        }
        found
    }

    /// How well a few points fit with the target of the profile: rough, but quick.
    fn glance(&self, points: &[PointSample]) -> f64 {
        let few = evenly(points, GLANCED_AT);
        let predicted = self.problem.arm.points_in_base(few.iter().map(|sample| &sample.at));
        let pairs = few.iter().zip(&predicted).map(|(sample, predicted)| (1.0, sample.point, *predicted));
        let rms = register(pairs).map_or(f64::INFINITY, |registered| registered.rms);
        rms / extent(&predicted).max(f64::MIN_POSITIVE)
    }
}

/// At most `most` of the points, evenly picked.
pub(super) fn evenly(points: &[PointSample], most: usize) -> Vec<PointSample> {
    let used = points.len().min(most);
    (0..used).map(|index| points[index * points.len() / used].clone()).collect()
}

/// How well the nominal arm fits altered data.
struct TrialFit {
    /// Median residual (m).
    typical: f64,
    /// Root mean square extent of the predicted points (m).
    extent: f64,
}

impl TrialFit {
    /// Residual relative to the extent: comparable between data of different size.
    fn relative(&self) -> f64 {
        self.typical / self.extent.max(f64::MIN_POSITIVE)
    }
}

/// Root mean square distance from the centroid (m).
fn extent(points: &[Point3<f64>]) -> f64 {
    principal_spread(points.iter()).iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Something that makes the result of an identification doubtful although it can be computed.
#[derive(Clone, Debug, PartialEq)]
pub enum Weakness {
    /// Fewer independent values than twice the combinations to find.
    TooFewData {
        /// Independent values in the observations.
        values: usize,
        /// Combinations that are to be found.
        combinations: usize,
        /// Some samples repeat others, and count once.
        repeats: bool,
    },
    /// A joint that does not move.
    StillJoint {
        /// Index of the joint.
        joint: usize,
        /// How far it moves over all samples (rad or m).
        range: f64,
    },
    /// The points lie (nearly) in a plane or on a line: distances do not see motion out of it.
    Flat {
        /// Spread along the principal axes, root mean square (m).
        spread: [f64; 3],
    },
    /// No gap in the singular values decides the rank.
    RankUnclear {
        /// The largest ratio of neighbours.
        gap: f64,
    },
}

impl Weakness {
    /// What it is and what to do.
    pub fn describe(&self, joint_name: impl Fn(usize) -> String, joint_type: impl Fn(usize) -> JointType) -> String {
        match self {
            Self::TooFewData { values, combinations, repeats } => format!(
                "too few data: {values} independent values for {combinations} combinations of parameters{}; measure at least {} poses, better twice as many",
                if *repeats { " (a pose that is measured again counts once)" } else { "" },
                (VALUES_PER_COMBINATION * combinations + 6).div_ceil(3)
            ),
            Self::StillJoint { joint, range } => {
                let quantity = joint_type(*joint).quantity();
                format!(
                    "joint {} hardly moves ({:.2} {} over all poses): its errors and those of its neighbours cannot be told apart; add poses that turn it",
                    joint_name(*joint),
                    quantity.to_edge(*range),
                    quantity.unit()
                )
            }
            Self::Flat { spread } => format!(
                "the points lie nearly in a plane (spread {:.0} x {:.0} x {:.1} mm): spread them in all directions",
                to_mm(spread[0]),
                to_mm(spread[1]),
                to_mm(spread[2])
            ),
            Self::RankUnclear { gap } => format!(
                "the rank is not clear (largest gap in the singular values {gap:.1}): which parameters can be found is not decided by these data"
            ),
        }
    }
}

/// The rank that this robot with these parameters has for points all over its joint space.
fn structural_rank(problem: &Problem<'_>) -> usize {
    const POSES: usize = 60;
    /// Primes, whose square roots are independent.
    const IRRATIONAL: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let joints = problem.arm.chain.joints();
    let points = (0..POSES)
        .map(|pose| {
            // Multiples of independent irrational numbers spread evenly (Weyl); any generic set of poses shows the same rank.
            let place = |joint: usize| ((pose + 1) as f64 * IRRATIONAL[joint % IRRATIONAL.len()].sqrt()).fract() - 0.5;
            let configuration = joints.iter().enumerate().map(|(joint, definition)| match definition.joint_type {
                JointType::Revolute => 4.0 * place(joint),
                JointType::Prismatic => 0.5 * place(joint),
            });
            let at = Place { configuration: configuration.collect(), target: pose % problem.arm.targets.len().max(1) };
            PointSample { at, station: 0, point: Point3::origin(), sigma: None }
        })
        .collect();
    let observations = Observations { points, ..Observations::default() };
    let generic = Problem { observations: &observations, ..*problem };
    Observability::new(&generic).rank.unwrap_or(problem.parameters.len())
}

/// How far a joint moves over all samples ((rad) or (m)), if it hardly does.
pub(super) fn still_range(observations: &Observations, joint: usize, joint_type: JointType) -> Option<f64> {
    let values = || observations.places().map(|place| place.configuration[joint]);
    let range = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    let still = match joint_type {
        JointType::Revolute => STILL_JOINT,
        JointType::Prismatic => STILL_SLIDE,
    };
    (range < still).then_some(range)
}

/// Looks at how rich the accepted data of an identification are.
pub fn weaknesses(problem: &Problem<'_>, identification: &Identification) -> Vec<Weakness> {
    let accepted = problem.observations.without(&identification.rejected);
    let problem = &Problem { observations: &accepted, ..*problem };
    let observability = &identification.observability;
    // The rank is a matter of where the targets are, not of where the profile guesses them.
    let arm = Arm { targets: identification.arm.targets.clone(), ..problem.arm.clone() };
    let problem = &Problem { arm: &arm, ..*problem };
    let mut found = Vec::new();
    let once = problem.observations.without_repetitions(problem.arm.chain.joints());
    let (values, all) = (once.independent_values(), problem.observations.independent_values());
    // A handful of samples cannot show the rank that the robot has: what could be found sets the demand.
    let combinations = if values < VALUES_PER_COMBINATION * problem.parameters.len() {
        structural_rank(problem)
    } else {
        observability.rank.unwrap_or(problem.parameters.len())
    };
    if values < VALUES_PER_COMBINATION * combinations {
        found.push(Weakness::TooFewData { values, combinations, repeats: values < all });
    }
    for (joint, definition) in problem.arm.chain.joints().iter().enumerate() {
        if let Some(range) = still_range(problem.observations, joint, definition.joint_type) {
            found.push(Weakness::StillJoint { joint, range });
        }
    }
    let points = &problem.observations.points;
    if !points.is_empty() {
        let spread = principal_spread(points.iter().map(|sample| &sample.point));
        if spread[2] < FLAT * spread[0] {
            found.push(Weakness::Flat { spread });
        }
    }
    if observability.rank.is_none() {
        found.push(Weakness::RankUnclear { gap: observability.gap });
    }
    found
}

/// The combinations of geometry and targets of which the data say less than the expected deviations do, as columns: deviations ((m)
/// and (rad)) of one standard deviation each, in the order of the estimates. Those without any effect are among them.
pub fn weak_combinations(identification: &Identification) -> DMatrix<f64> {
    let n = identification.estimates.len();
    let geometry: Vec<usize> = (0..n).filter(|&index| !identification.estimates[index].id.is_joint_error()).collect();
    let expected = |index: usize| identification.estimates[geometry[index]].expected;
    // What is left of the expected variances: between 0, known from the data, and 1, nothing known.
    let left = DMatrix::from_fn(geometry.len(), geometry.len(), |i, j| {
        identification.covariance[(geometry[i], geometry[j])] / (expected(i) * expected(j))
    });
    if left.iter().any(|value| !value.is_finite()) {
        return DMatrix::zeros(n, 0);
    }
    let spread = SymmetricEigen::new(left);
    let weak: Vec<usize> = (0..geometry.len()).filter(|&index| spread.eigenvalues[index] > WEAK).collect();
    let mut combinations = DMatrix::zeros(n, weak.len());
    for (column, &direction) in weak.iter().enumerate() {
        let size = spread.eigenvalues[direction].sqrt();
        for (row, &parameter) in geometry.iter().enumerate() {
            combinations[(parameter, column)] = spread.eigenvectors[(row, direction)] * size * expected(row);
        }
    }
    combinations
}
