//! Live triage while points are measured: does the newest one belong to the others, and if not, what has happened?
//!
//! Distances only: no frame is known and none is asked for. The nominal arm with its expected deviations is a prior for the distances;
//! every accepted point sharpens it (Bayes), so the check is coarse at the 4th point (millimetres) and fine later on. As in
//! [`super::Weighting::Covariance`], all distances with their covariance are the points with the rigid motion of the station left
//! free, so points are compared instead of M(M−1)/2 pairs: the answer is the same for any position of the tracker.
//!
//! - `fit`: the most probable arm given some samples, its uncertainty, and the probability of the data.
//! - `alarm`: whether anything is wrong at all; limits that a faultless session hardly ever crosses.
//! - `explain`: every fault that could be behind it, compared by the probability that it gives to *all* data.
//! - `slips`: faults of one sample. `words`: for the technician.
//!
//! `docs/triage.md` shows what was measured: which faults of what size are found when.

mod alarm;
mod explain;
mod fit;
mod slips;
#[cfg(test)]
mod tests;
mod words;

use super::linearise::SMALLEST_SIGMA;
use super::{PointSample, RejectionReason};
use crate::kinematics::{Arm, FreeParameter};
use crate::units::Quantity;
use fit::{Item, Nominal};
pub use words::Names;

/// Shots that scatter by more than this many times what the instrument states show a target that moves.
const AT_REST: f64 = 4.0;
/// Samples before which nothing is said about distances: three points say nothing that a prior does not.
const FIRST_CHECK: usize = 4;

/// What is known when the newest sample has come in.
#[derive(Clone, Copy, Debug)]
pub struct Triage<'a> {
    /// Nominal arm.
    pub arm: &'a Arm,
    /// Free parameters with their expected deviations (m) or (rad).
    pub parameters: &'a [FreeParameter],
    /// Standard deviation of a coordinate (m) where a sample has none.
    pub sigma: f64,
    /// Configurations of all planned poses (rad) or (m): where the arm may stand instead.
    pub planned: &'a [Vec<f64>],
    /// Samples in order of capture; the last one is the newest.
    pub samples: &'a [PointSample],
    /// Samples that take no part: left out by the operator, or reported before and kept as they are.
    pub excluded: &'a [usize],
    /// Root mean square distance of the shots of the newest sample from their mean (m).
    pub scatter: Option<f64>,
}

/// Something is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The sample to look at; the newest one where the fault is of the whole set.
    pub sample: usize,
    /// By how many standard deviations it is off.
    pub ratio: f64,
    /// Distances from this sample that are off the most, worst first.
    pub worst: Vec<PairDeviation>,
    /// What has most likely happened.
    pub cause: Cause,
    /// How likely that is among all explanations that were tried, 0 … 1.
    pub share: f64,
    /// Other explanations that are not much worse, best first.
    pub alternatives: Vec<Explanation>,
    /// The slip of the pen that explains a bad reading of this sample: a wrong sign or digit of one coordinate.
    pub typed: Option<RejectionReason>,
    /// Whether so few samples came before that a pose exchanged with a later one looks like a bad reading.
    pub is_early: bool,
}

/// A measured distance against its prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairDeviation {
    /// The other sample.
    pub other: usize,
    /// Measured − predicted distance (m).
    pub deviation: f64,
    /// Standard deviation (m) that it should have.
    pub expected: f64,
}

/// One story that explains the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The sample that it blames; the newest one where the fault is of the whole set.
    pub sample: usize,
    /// The story.
    pub cause: Cause,
    /// Its probability among all explanations that were tried, 0 … 1.
    pub share: f64,
}

/// What can have happened. Samples, joints and planned poses count from 0.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// Coordinates are in another unit.
    Unit {
        /// What the coordinates have to be multiplied by.
        factor: f64,
        /// First sample with it.
        since: usize,
    },
    /// A joint turns the other way than the profile says, in all samples.
    JointSign {
        /// Which joint.
        joint: usize,
    },
    /// One joint stands elsewhere than shown.
    MistypedJoint {
        /// Which joint.
        joint: usize,
        /// What must be added to the shown value (rad) or (m).
        by: f64,
        /// Angle or length.
        quantity: Quantity,
    },
    /// The arm stands at another planned pose.
    WrongPose {
        /// Index of that pose.
        planned: usize,
    },
    /// The arm has not left the pose of the sample before.
    StayedAtPrevious,
    /// The points of two samples are exchanged.
    SwappedRows {
        /// The other sample.
        with: usize,
    },
    /// The SMR sits elsewhere on the flange.
    TargetMoved {
        /// First sample with it.
        since: usize,
        /// How far (m).
        by: f64,
    },
    /// The instrument stands elsewhere.
    InstrumentMoved {
        /// First sample with it.
        since: usize,
    },
    /// The target moved while it was measured.
    NotAtRest {
        /// Root mean square distance of the shots from their mean (m).
        scatter: f64,
    },
    /// The reading fits nothing: a bad reading, or a fault that is not known here.
    Unexplained,
}

/// Checks the newest sample, and with it all earlier ones, by distance. `None`: nothing is wrong, or it cannot be seen yet.
///
/// Misuse (an index or a joint vector that does not fit) is no finding either: [`super::Problem::check`] is there for it.
pub fn triage(triage: &Triage<'_>) -> Option<Finding> {
    let newest = triage.samples.len().checked_sub(1)?;
    if let Some(finding) = not_at_rest(triage, newest) {
        return Some(finding);
    }
    let nominal = Nominal::new(triage.arm, triage.parameters);
    if triage.excluded.contains(&newest) || !fits_together(triage) {
        return None;
    }
    let items = items(triage, 1.0);
    let active: Vec<Item> = items.iter().filter(|item| !triage.excluded.contains(&item.sample)).cloned().collect();
    if active.len() < FIRST_CHECK {
        return None;
    }
    let full = alarm::raised(&nominal, active.clone())?;
    let excess = alarm::excess(&nominal, &full);
    if excess <= 1.0 {
        return explain::explain(triage, &nominal, &items, &full);
    }
    // The arm itself is not as good as the instrument: judged by what it shows.
    let widened =
        |items: Vec<Item>| items.into_iter().map(|item| Item { sigma: item.sigma * excess, ..item }).collect();
    let full = alarm::raised(&nominal, widened(active))?;
    explain::explain(triage, &nominal, &widened(items), &full)
}

fn not_at_rest(triage: &Triage<'_>, newest: usize) -> Option<Finding> {
    let scatter = triage.scatter?;
    let ratio = scatter / (3.0_f64.sqrt() * triage.sigma.max(SMALLEST_SIGMA));
    (ratio > AT_REST).then(|| Finding {
        sample: newest,
        ratio,
        worst: Vec::new(),
        cause: Cause::NotAtRest { scatter },
        share: 1.0,
        alternatives: Vec::new(),
        typed: None,
        is_early: false,
    })
}

fn fits_together(triage: &Triage<'_>) -> bool {
    let sample_ok = |sample: &PointSample| {
        sample.at.configuration.len() == triage.arm.chain.dof()
            && sample.at.target < triage.arm.targets.len()
            && sample.at.configuration.iter().chain(sample.point.coords.iter()).all(|value| value.is_finite())
    };
    let parameter_ok = |parameter: &FreeParameter| triage.arm.value(parameter.id).is_some();
    triage.samples.iter().all(sample_ok)
        && triage.parameters.iter().all(parameter_ok)
        && triage.excluded.iter().all(|sample| *sample < triage.samples.len())
        && triage.planned.iter().all(|configuration| configuration.len() == triage.arm.chain.dof())
}

fn items(triage: &Triage<'_>, excess: f64) -> Vec<Item> {
    let item = |(sample, given): (usize, &PointSample)| Item {
        sample,
        at: given.at.clone(),
        station: given.station,
        point: given.point,
        sigma: given.sigma.unwrap_or(triage.sigma).max(SMALLEST_SIGMA) * excess,
        moved: false,
    };
    triage.samples.iter().enumerate().map(item).collect()
}
