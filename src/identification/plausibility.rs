//! Do these data describe this robot at all? Looks for the mistakes that turn a calibration into nonsense: wrong unit, wrong
//! joint sign or zero, joints that never move, too few or flat points.
//!
//! The yardstick is the nominal model itself: with frame and target fitted, its residual cannot exceed what the expected
//! deviations allow by much. Where it does, each mistake is tried in turn and the one that explains the data is named. This
//! happens before identification, because a solver bends parameters until nonsense looks like a fit.

use nalgebra::{DMatrix, Point3, SymmetricEigen};

use super::linearise::{Evaluation, Weights, point_residuals, project};
use super::problem::{Observations, PointSample, Problem};
use super::robust::gross_trust;
use super::{Estimator, Identification, IdentificationError, Observability, Settings, SigmaSource, identify};
use crate::geometry::principal_spread;
use crate::kinematics::{Arm, FreeParameter, JointType, Place};
use crate::units::{DEGREE, INCH, MILLIMETRE, to_deg, to_mm};

/// Nominal residuals beyond this many expected ones are not explained by a robot with its expected deviations.
const IMPLAUSIBLE: f64 = 6.0;
/// Nominal residuals below this (m) are never called implausible: every arm deserves a few millimetres.
const ALWAYS_PLAUSIBLE: f64 = 5.0 * MILLIMETRE;
/// A mistake explains the data if it lowers the residual to this fraction.
const EXPLAINS: f64 = 0.25;
/// A mistake explains the data only if what is left is below this fraction of their extent.
const FITS: f64 = 0.1;
/// Evenly picked points that are tried against each mistake: a mistake in a whole table shows in any part of it.
const TRIED_POINTS: usize = 500;
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

/// A mistake that explains data the nominal robot cannot.
#[derive(Clone, Debug, PartialEq)]
pub enum Mistake {
    /// Measured coordinates are in another unit; they should have been multiplied by `factor`.
    CoordinateUnit {
        /// Measured extent over predicted extent.
        ratio: f64,
        /// The likely story.
        story: &'static str,
    },
    /// Joint values were radians read as degrees.
    RadiansAsDegrees,
    /// Joint values were degrees read as radians.
    DegreesAsRadians,
    /// A joint counts the other way.
    JointSign {
        /// Index of the joint.
        joint: usize,
    },
    /// A joint has another zero.
    JointZero {
        /// Index of the joint.
        joint: usize,
        /// What has to be added to its pendant value (rad).
        offset: f64,
    },
    /// The measured frame is left-handed.
    Mirrored,
}

impl Mistake {
    /// What it is and what to do, with names instead of indices.
    pub fn describe(&self, joint_name: impl Fn(usize) -> String) -> String {
        match self {
            Self::CoordinateUnit { ratio, story } => {
                format!("the measured points span {ratio:.4} times what the robot can reach between them: {story}")
            }
            Self::RadiansAsDegrees => {
                "the joint values fit when read as radians: name the columns 'q1_rad', 'q2_rad', …".to_owned()
            }
            Self::DegreesAsRadians => {
                "the joint values fit when read as degrees: name the columns 'q1_deg', 'q2_deg', …".to_owned()
            }
            Self::JointSign { joint } => format!(
                "joint {} counts the other way: the data fit with its sign reversed; check the sign of its column, or 'direction' in the profile",
                joint_name(*joint)
            ),
            Self::JointZero { joint, offset } => format!(
                "joint {} has another zero: the data fit with {:+.0} deg added to it; check the column, or 'theta_deg' in the profile",
                joint_name(*joint),
                to_deg(*offset)
            ),
            Self::Mirrored => {
                "the points fit only when mirrored: the instrument's frame is left-handed; reverse one of its axes"
                    .to_owned()
            }
        }
    }
}

/// How the measured points compare with the nominal robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plausibility {
    /// Typical (median) distance of the measured points from the nominal prediction, frame and target fitted robustly (m): a few
    /// wrong rows do not change it.
    pub nominal: f64,
    /// Root mean square distance that the expected deviations predict (m).
    pub expected: f64,
    /// The mistake that explains a nominal residual which is too large.
    pub mistake: Option<Mistake>,
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
    let used = all.len().min(TRIED_POINTS);
    let points: Vec<PointSample> = (0..used).map(|index| all[index * all.len() / used].clone()).collect();
    let fit = trial.fit(&points);
    let mut plausibility = Plausibility { nominal: fit.typical, expected, mistake: None };
    if points.len() >= 4 && !plausibility.is_plausible() {
        plausibility.mistake = trial.find_mistake(&points, fit.relative());
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

    fn find_mistake(&self, points: &[PointSample], as_given: f64) -> Option<Mistake> {
        let mut trials = self.coordinate_mistakes(points);
        trials.extend(self.joint_mistakes(points));
        let mirrored =
            alter(points, |sample| sample.point = Point3::new(-sample.point.x, sample.point.y, sample.point.z));
        trials.push((Mistake::Mirrored, mirrored));
        trials
            .into_iter()
            .map(|(mistake, altered)| (self.fit(&altered).relative(), mistake))
            .filter(|(relative, _)| *relative < EXPLAINS * as_given && *relative < FITS)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, mistake)| mistake)
    }

    /// The extent of the measured points against the predicted ones suggests a unit; the fit decides.
    fn coordinate_mistakes(&self, points: &[PointSample]) -> Vec<(Mistake, Vec<PointSample>)> {
        const STORIES: [(f64, &str); 5] = [
            (1e-3, "metres were read as millimetres; name the columns 'x_m', 'y_m', 'z_m'"),
            (1e3, "millimetres were read as metres; name the columns 'x_mm', 'y_mm', 'z_mm'"),
            (MILLIMETRE / INCH, "inches were read as millimetres; name the columns 'x_in', 'y_in', 'z_in'"),
            (INCH / MILLIMETRE, "millimetres were read as inches; name the columns 'x_mm', 'y_mm', 'z_mm'"),
            (1e-3 / INCH, "metres were read as inches; name the columns 'x_m', 'y_m', 'z_m'"),
        ];
        let predicted = self.problem.arm.points_in_base(points.iter().map(|sample| &sample.at));
        let measured: Vec<Point3<f64>> = points.iter().map(|sample| sample.point).collect();
        let ratio = extent(&measured) / extent(&predicted);
        STORIES
            .iter()
            .filter(|(factor, _)| (0.5..2.0).contains(&(ratio / factor)))
            .map(|(factor, story)| {
                let scaled = alter(points, |sample| sample.point.coords /= *factor);
                (Mistake::CoordinateUnit { ratio, story }, scaled)
            })
            .collect()
    }

    fn joint_mistakes(&self, points: &[PointSample]) -> Vec<(Mistake, Vec<PointSample>)> {
        let joints = self.problem.arm.chain.joints();
        let turning = |joint: &usize| joints[*joint].joint_type == JointType::Revolute;
        let scaled = |factor: f64| {
            alter(points, |sample| {
                for joint in (0..joints.len()).filter(turning) {
                    sample.at.configuration[joint] *= factor;
                }
            })
        };
        let mut mistakes =
            vec![(Mistake::RadiansAsDegrees, scaled(1.0 / DEGREE)), (Mistake::DegreesAsRadians, scaled(DEGREE))];
        for joint in 0..joints.len() {
            let reversed = alter(points, |sample| sample.at.configuration[joint] *= -1.0);
            mistakes.push((Mistake::JointSign { joint }, reversed));
        }
        // The zero of joint 1 only turns the base: distances cannot see it, and need not.
        for joint in (1..joints.len()).filter(turning) {
            for offset in [90.0, -90.0, 180.0] {
                let offset = offset * DEGREE;
                let shifted = alter(points, |sample| sample.at.configuration[joint] += offset);
                mistakes.push((Mistake::JointZero { joint, offset }, shifted));
            }
        }
        mistakes
    }
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

fn alter(points: &[PointSample], change: impl Fn(&mut PointSample)) -> Vec<PointSample> {
    let mut altered = points.to_vec();
    altered.iter_mut().for_each(change);
    altered
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
        let values = || problem.observations.places().map(|place| place.configuration[joint]);
        let range = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        let still = match definition.joint_type {
            JointType::Revolute => STILL_JOINT,
            JointType::Prismatic => STILL_SLIDE,
        };
        if range < still {
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
