//! What the data show of each joint besides its small errors: which way it counts, and from where.
//!
//! A target on the axis of the last joint stays where it is when that joint turns, so any data of that joint fit: a wrong sign, a
//! wrong zero, a wrong scale. Each joint is altered in turn, the targets are fitted again, and what fits as well was not tested.

use super::plausibility::{TRIED_POINTS, evenly, still_range};
use super::verification::{DirectErrors, ModelErrors, fit_setup};
use super::{Estimator, Identification, Observations, Problem, Settings, geometry, identify};
use crate::kinematics::{Arm, FreeParameter, JointType, Place};
use crate::units::{DEGREE, MICROMETRE};

/// Alterations that make the residuals this many times larger would have been seen.
const TELLS: f64 = 1.5;
/// Residuals after an alteration up to this many times those before are looked into with all constants fitted again.
const LOOK_INTO: f64 = 20.0;
/// Residuals below this (m) are alike.
const ALIKE: f64 = MICROMETRE;
/// A target this many of its standard deviations from where it was stated to be would have been seen.
const FAR_TARGET: f64 = 3.0;
/// A wrong zero that anybody could have: of a turning joint (rad), of a sliding one (m).
const TURNED: f64 = 90.0 * DEGREE;
const SLID: f64 = 0.1;
/// Half a change of a joint for a derivative ((rad) or (m)).
const STEP: f64 = 1e-4;

/// Something about a joint that the data do not show, or contradict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointDoubt {
    /// The data fit far better with its sign reversed.
    Reversed {
        /// Index of the joint.
        joint: usize,
        /// Root mean square residual per coordinate as the data are (m).
        given: f64,
        /// The same with the sign reversed (m).
        reversed: f64,
    },
    /// The data fit as well with its sign reversed: they show nothing of the joint.
    Unseen {
        /// Index of the joint.
        joint: usize,
        /// How far the targets are from its axis (m), or how far they move per metre that it slides.
        lever: f64,
    },
    /// Its sign was seen, but another zero would only put the targets elsewhere on the flange.
    Zero {
        /// Index of the joint.
        joint: usize,
    },
}

/// Doubts about the joints of an identified arm. Joints that hardly move have a
/// [`Weakness`](super::plausibility::Weakness) of their own.
pub fn joint_doubts(problem: &Problem<'_>, found: &Identification) -> Vec<JointDoubt> {
    let accepted = problem.observations.without(&found.rejected);
    let observations = Observations { points: evenly(&accepted.points, TRIED_POINTS), ..accepted };
    let trial = Trial::new(problem, found, &observations);
    let Some(given) = trial.fit(&observations) else { return Vec::new() };
    let joints = problem.arm.chain.joints();
    let moving = (0..joints.len()).filter(|joint| !trial.is_still(*joint));
    moving.filter_map(|joint| trial.doubt(joint, joints[joint].joint_type, given.residual)).collect()
}

/// The identified arm with the targets fitted again to altered observations.
struct Trial<'a> {
    problem: &'a Problem<'a>,
    found: &'a Identification,
    observations: &'a Observations,
    /// The identified arm with its targets where they were stated to be.
    arm: Arm,
    targets: Vec<FreeParameter>,
}

/// What altered observations leave.
struct Fit {
    /// Root mean square residual per coordinate (m).
    residual: f64,
    /// How far the targets are from where they were stated to be, in standard deviations.
    targets: f64,
}

impl<'a> Trial<'a> {
    fn new(problem: &'a Problem<'a>, found: &'a Identification, observations: &'a Observations) -> Self {
        let arm = Arm { targets: problem.arm.targets.clone(), ..found.arm.clone() };
        let is_target = |parameter: &&FreeParameter| parameter.id.target().is_some();
        let targets = problem.parameters.iter().filter(is_target).copied().collect();
        Self { problem, found, observations, arm, targets }
    }

    fn is_still(&self, joint: usize) -> bool {
        let joint_type = self.problem.arm.chain.joints()[joint].joint_type;
        still_range(self.observations, joint, joint_type).is_some()
    }

    fn doubt(&self, joint: usize, joint_type: JointType, given: f64) -> Option<JointDoubt> {
        let reversed = self.observations.at(|place| place.configuration[joint] *= -1.0);
        let turned = self.fit(&reversed).map_or(f64::INFINITY, |fit| fit.residual);
        if turned < LOOK_INTO * given.max(ALIKE) {
            // With errors of joints or without: each is compared with its like.
            let (all, all_reversed) = (self.fit_all(self.observations), self.fit_all(&reversed));
            if TELLS * all_reversed.max(ALIKE) < all {
                return Some(JointDoubt::Reversed { joint, given: all, reversed: all_reversed });
            }
            if turned < TELLS * given.max(ALIKE) || all_reversed < TELLS * all.max(ALIKE) {
                return Some(JointDoubt::Unseen { joint, lever: self.lever(joint) });
            }
        }
        // That of joint 1 only moves the base: distances cannot see it, and need not.
        let by = match joint_type {
            JointType::Revolute => TURNED,
            JointType::Prismatic => SLID,
        };
        let moved =
            (joint > 0).then(|| self.fit(&self.observations.at(|place| place.configuration[joint] += by)))??;
        let fits = moved.residual < TELLS * given.max(ALIKE) && moved.targets < FAR_TARGET;
        fits.then_some(JointDoubt::Zero { joint })
    }

    /// The identified arm, with the frame and the targets fitted again.
    fn fit(&self, observations: &Observations) -> Option<Fit> {
        let setup = fit_setup(&self.arm, &self.targets, observations).ok()?;
        let away = self.targets.iter().map(|parameter| {
            let value = |arm: &Arm| arm.value(parameter.id).unwrap_or(0.0);
            (value(&setup.arm) - value(&self.arm)) / parameter.expected
        });
        let targets = away.map(|away| away * away).sum::<f64>().sqrt();
        let points = ModelErrors::new(&setup.arm, &setup.base_from_station, &observations.points);
        let direct = DirectErrors::new(&setup.arm, &setup.features, observations);
        let points = points.map_or_else(Vec::new, |errors| errors.vectors);
        let vectors = points.iter().chain(&direct.seats);
        let sum = vectors.clone().map(nalgebra::Matrix::norm_squared).sum::<f64>()
            + direct.lengths.iter().map(|error| error * error).sum::<f64>();
        let count = 3 * vectors.count() + direct.lengths.len();
        (count > 0).then(|| Fit { residual: (sum / count as f64).sqrt(), targets })
    }

    /// Root mean square residual (m) with all constants of the geometry fitted again.
    fn fit_all(&self, observations: &Observations) -> f64 {
        let parameters = geometry(self.problem);
        let problem = Problem { arm: self.problem.arm, parameters: &parameters, observations };
        let settings = Settings { estimator: Estimator::LeastSquares, ..Settings::default() };
        let Ok(found) = identify(&problem, &settings, &mut |_| {}) else { return f64::INFINITY };
        let again = Trial { arm: found.arm, targets: Vec::new(), ..*self };
        again.fit(observations).map_or(f64::INFINITY, |fit| fit.residual)
    }

    /// Root mean square change of the observed places per change of a joint.
    fn lever(&self, joint: usize) -> f64 {
        let moved = |by: f64| {
            let at = |place: &Place| {
                let mut place = place.clone();
                place.configuration[joint] += by;
                self.found.arm.point_in_base(&place)
            };
            self.observations.places().map(at).collect::<Vec<_>>()
        };
        let (back, forth) = (moved(-STEP), moved(STEP));
        let squares = back.iter().zip(&forth).map(|(back, forth)| ((forth - back) / (2.0 * STEP)).norm_squared());
        (squares.sum::<f64>() / back.len().max(1) as f64).sqrt()
    }
}
