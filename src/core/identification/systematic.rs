//! Rejected samples that are the arm and not bumped reflectors: they share a region of a joint, or are all targets of a pose.

use std::collections::BTreeMap;

use super::linearise::Trust;
use super::problem::PointSample;
use super::repetitions::Places;
use crate::kinematics::{Joint, Place};

/// A sample further off than this many robust standard deviations is a blunder wherever it is.
const BLUNDER: f64 = 30.0;
/// Fewer poses are no pattern.
const FEWEST_POSES: usize = 4;
/// Share of the rejected poses that a region must contain.
const MOST: f64 = 0.8;
/// A region that chance makes with a larger probability is none (logarithm; some hundred regions are tried).
const BY_CHANCE: f64 = -13.8;
/// Regions end at these parts of all samples, and contain at most half of them.
const PARTS: usize = 20;
/// Rejected samples that take up so little more than their number in the order of measuring are something that happened then.
const RUN: f64 = 1.5;

/// A part of the arm's joint space that the model does not describe; its samples count.
#[derive(Clone, Debug, PartialEq)]
pub enum Unmodelled {
    /// One end of a joint's range.
    End {
        /// Index of the joint.
        joint: usize,
        /// Where the region ends ((rad) or (m)).
        at: f64,
        /// Whether it is the end above.
        above: bool,
        /// Places that were kept.
        places: Vec<usize>,
        /// Poses in the region that did not fit, and all poses that did not.
        poses: (usize, usize),
    },
    /// Poses at which no target fits.
    Poses {
        /// Places that were kept.
        places: Vec<usize>,
        /// How many poses.
        poses: usize,
    },
}

impl Unmodelled {
    /// The places that were kept.
    pub fn places(&self) -> &[usize] {
        match self {
            Self::End { places, .. } | Self::Poses { places, .. } => places,
        }
    }
}

/// Finds the samples without trust that are the arm. `ratios` are in robust standard deviations of the accepted samples.
pub(super) fn unmodelled(joints: &[Joint], samples: &[PointSample], trust: &Trust, ratios: &[f64]) -> Vec<Unmodelled> {
    let is_out = |place: usize| trust.of_sample(place) <= 0.0;
    let rejected: Vec<usize> = (0..samples.len()).filter(|&place| is_out(place) && ratios[place] <= BLUNDER).collect();
    if rejected.is_empty() {
        return Vec::new();
    }
    let any_target: Vec<Place> = samples.iter().map(|sample| Place { target: 0, ..sample.at.clone() }).collect();
    let pose = Places::new(joints, &any_target).first_of_each();
    let end = region(joints, samples, &pose, &rejected);
    end.into_iter().chain(whole_poses(samples, &pose, trust, &rejected)).collect()
}

/// Poses with several targets of which every one was rejected.
fn whole_poses(samples: &[PointSample], pose: &[usize], trust: &Trust, rejected: &[usize]) -> Option<Unmodelled> {
    let mut of_pose: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, pose) in pose.iter().enumerate() {
        of_pose.entry(*pose).or_default().push(place);
    }
    let is_whole = |places: &&Vec<usize>| {
        let first = places.first().map(|place| samples[*place].at.target);
        let several = places.iter().any(|place| Some(samples[*place].at.target) != first);
        several && places.iter().all(|place| trust.of_sample(*place) <= 0.0 && rejected.contains(place))
    };
    let whole: Vec<&Vec<usize>> = of_pose.values().filter(is_whole).collect();
    let places: Vec<usize> = whole.iter().flat_map(|places| places.iter().copied()).collect();
    (!places.is_empty()).then_some(Unmodelled::Poses { places, poses: whole.len() })
}

/// The end of a joint's range that has most of the rejected poses, and so few of all that chance does not explain it.
fn region(joints: &[Joint], samples: &[PointSample], pose: &[usize], rejected: &[usize]) -> Option<Unmodelled> {
    let firsts: Vec<usize> = (0..samples.len()).filter(|&place| pose[place] == place).collect();
    let mut out: Vec<usize> = rejected.iter().map(|place| pose[*place]).collect();
    out.sort_unstable();
    out.dedup();
    let (first, last) = (rejected.first()?, rejected.last()?);
    let happened = ((last - first + 1) as f64) < RUN * rejected.len() as f64;
    if out.len() < FEWEST_POSES || happened {
        return None;
    }
    let mut best: Option<(f64, usize, f64, bool)> = None;
    for joint in 0..joints.len() {
        let value = |place: usize| samples[place].at.configuration[joint];
        let mut values: Vec<f64> = firsts.iter().map(|place| value(*place)).collect();
        values.sort_by(f64::total_cmp);
        for part in 1..=PARTS / 2 {
            for above in [false, true] {
                let share = if above { PARTS - part } else { part };
                let at = values[(values.len() * share / PARTS).min(values.len() - 1)];
                let is_inside = |value: f64| if above { value >= at } else { value <= at };
                let inside = out.iter().filter(|place| is_inside(value(**place))).count();
                let of_all = values.iter().filter(|value| is_inside(**value)).count() as f64 / values.len() as f64;
                let chance = log_tail(out.len(), inside, of_all);
                if inside as f64 >= MOST * out.len() as f64 && best.is_none_or(|(least, ..)| chance < least) {
                    best = Some((chance, joint, at, above));
                }
            }
        }
    }
    let (_, joint, at, above) = best.filter(|(chance, ..)| *chance < BY_CHANCE)?;
    let is_inside = |place: &usize| {
        let value = samples[*place].at.configuration[joint];
        if above { value >= at } else { value <= at }
    };
    let inside = out.iter().filter(|place| is_inside(place)).count();
    let places = rejected.iter().copied().filter(is_inside).collect();
    Some(Unmodelled::End { joint, at, above, places, poses: (inside, out.len()) })
}

/// Logarithm of a bound on the probability of so many of `count` in a region that has this share of all (Chernoff 1952).
fn log_tail(count: usize, inside: usize, share: f64) -> f64 {
    let part = inside as f64 / count as f64;
    if part <= share {
        return 0.0;
    }
    let term = |part: f64, share: f64| if part > 0.0 { part * (part / share).ln() } else { 0.0 };
    -(count as f64) * (term(part, share) + term(1.0 - part, 1.0 - share))
}
