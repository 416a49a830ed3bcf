//! Small moves of chosen poses that even out the angles which each turning joint visits.
//!
//! An exchange can only choose among candidates, and no choice of a few dozen among thousands is even in six joints at once. So
//! chosen poses turn by a few degrees: one joint into a gap beside it, others at random so that the target stays in sight. A move
//! stays if it lowers `Σ (g/a − 1)³` over the gaps g above a of all joints, a the gap of evenly spread angles or [`SMALL`], and if
//! condition number and predicted error of the set stay within [`SLACK`] of what they were.

use nalgebra::DMatrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::exchange::{Merit, add_pose};
use super::pairs::{add_pairs, pair_gram};
use super::score::condition_number;
use super::{Information, JointBox, PlanningError, check_set};
use crate::kinematics::{Arm, JointCoverage, JointType, Place};
use crate::units::DEGREE;

/// A gap below this needs no more filling (rad).
const SMALL: f64 = 4.5 * DEGREE;
/// Moves that are tried.
const TRIES: usize = 60_000;
/// How many of the poses nearest to a gap may move into it.
const NEIGHBOURS: usize = 8;
/// A pose moves into the middle of a gap, give or take this part of it.
const OFF_THE_MIDDLE: f64 = 0.3;
/// Largest turn of the joints that make room (rad).
const ROOM: f64 = 15.0 * DEGREE;
/// Condition number and predicted error may get worse by this share.
const SLACK: f64 = 0.01;

/// The poses of a chosen set while they spread over the ranges of the joints.
#[derive(Debug)]
pub struct Spreading<'a> {
    arm: &'a Arm,
    information: Information,
    set: Vec<usize>,
    places: Vec<Place>,
    fixed: usize,
    joints: Vec<Angles>,
    /// Information matrix and Gram matrix of the pair rows.
    matrix: DMatrix<f64>,
    gram: DMatrix<f64>,
    largest_condition: f64,
    largest_error: f64,
}

impl<'a> Spreading<'a> {
    /// Of the candidates `set` of `information`, whose places are `places`; the first `fixed` of them do not move.
    ///
    /// # Errors
    /// A set that cannot be scored.
    pub fn new(
        information: &Information,
        arm: &'a Arm,
        ranges: &JointBox,
        set: &[usize],
        places: Vec<Place>,
        fixed: usize,
    ) -> Result<Self, PlanningError> {
        check_set(information, set)?;
        let turning = arm.chain.joints().iter().zip(ranges.ranges()).enumerate();
        let joints = turning
            .filter(|(_, (joint, (low, high)))| joint.joint_type == JointType::Revolute && high - low > SMALL)
            .map(|(index, (_, range))| Angles::new(index, *range, &places))
            .collect();
        let matrix = information.sum(set);
        let gram = pair_gram(information, set);
        let mut spreading = Self {
            arm,
            information: information.clone(),
            set: set.to_vec(),
            places,
            fixed,
            joints,
            matrix,
            gram,
            largest_condition: f64::INFINITY,
            largest_error: f64::INFINITY,
        };
        let (condition, error) = spreading.figures();
        spreading.largest_condition = (1.0 + SLACK) * condition;
        spreading.largest_error = (1.0 + SLACK) * error;
        Ok(spreading)
    }

    /// Moves poses until every gap is small or the tries are over. `placed` returns a wanted configuration as a program can
    /// express it, or nothing where the arm cannot stand or be measured. Returns the information with the places that moved, and
    /// the places.
    pub fn run(mut self, seed: u64, placed: &dyn Fn(&[f64]) -> Option<Vec<f64>>) -> (Information, Vec<Place>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..TRIES {
            let Some((pose, wanted)) = self.proposal(&mut rng) else { break };
            let change: f64 = self.joints.iter().map(|joint| joint.cost_with(pose, &wanted) - joint.cost).sum();
            if change >= 0.0 {
                continue;
            }
            if let Some(configuration) = placed(&wanted) {
                self.take(pose, Place { configuration, ..self.places[pose] });
            }
        }
        (self.information, self.places)
    }

    /// A pose beside a gap that is too large, with its joint turned into the gap; `None` where every gap is small enough.
    fn proposal(&self, rng: &mut ChaCha8Rng) -> Option<(usize, Vec<f64>)> {
        let too_wide: Vec<&Angles> = self.joints.iter().filter(|joint| !joint.wide.is_empty()).collect();
        let chosen = too_wide.get(rng.random_range(0..too_wide.len().max(1)))?;
        // The largest, or any.
        let gap = if rng.random_bool(0.5) { 0 } else { rng.random_range(0..chosen.wide.len()) };
        let (from, size) = *chosen.wide.get(gap)?;
        let middle = from + 0.5 * size;
        let mut beside: Vec<(usize, f64)> = chosen
            .sorted
            .iter()
            .filter(|(_, pose)| *pose >= self.fixed)
            .map(|(angle, pose)| (*pose, chosen.turn(*angle, middle)))
            .collect();
        beside.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        beside.truncate(NEIGHBOURS);
        let (pose, turn) = *beside.get(rng.random_range(0..beside.len().max(1)))?;
        let mut wanted = self.places.get(pose)?.configuration.clone();
        for joint in &self.joints {
            let value = wanted.get_mut(joint.joint)?;
            if joint.joint == chosen.joint {
                *value += turn + size * rng.random_range(-OFF_THE_MIDDLE..OFF_THE_MIDDLE);
            } else if rng.random_bool(0.5) {
                let part: f64 = rng.random_range(-1.0..1.0);
                *value += ROOM * part * part.abs();
            }
        }
        Some((pose, wanted))
    }

    /// Moves a pose if condition number and predicted error stay as they were.
    fn take(&mut self, pose: usize, place: Place) {
        let candidate = self.set[pose];
        let others: Vec<usize> = self.set.iter().copied().filter(|&other| other != candidate).collect();
        let before = (self.matrix.clone(), self.gram.clone());
        add_pose(&self.information, &mut self.matrix, candidate, -1.0);
        add_pairs(&self.information, &mut self.gram, candidate, &others, -1.0);
        self.information.replace(candidate, self.arm, &place);
        add_pose(&self.information, &mut self.matrix, candidate, 1.0);
        add_pairs(&self.information, &mut self.gram, candidate, &others, 1.0);
        let (condition, error) = self.figures();
        if condition > self.largest_condition || error > self.largest_error {
            (self.matrix, self.gram) = before;
            self.information.replace(candidate, self.arm, &self.places[pose]);
            return;
        }
        for joint in &mut self.joints {
            joint.take(pose, &place.configuration);
        }
        self.places[pose] = place;
    }

    /// Condition number and predicted error.
    fn figures(&self) -> (f64, f64) {
        let eigenvalues = self.gram.symmetric_eigenvalues();
        let condition = condition_number(eigenvalues.as_slice()).unwrap_or(f64::INFINITY);
        (condition, Merit::new(&self.information, self.matrix.clone()).predicted_error())
    }
}

/// The angles of one joint at the poses.
#[derive(Debug)]
struct Angles {
    joint: usize,
    empty: JointCoverage,
    /// Angle and pose, ascending; without those outside the range.
    sorted: Vec<(f64, usize)>,
    allowed: f64,
    cost: f64,
    /// Begin and size of the gaps that are too large, the largest first.
    wide: Vec<(f64, f64)>,
}

impl Angles {
    fn new(joint: usize, range: (f64, f64), places: &[Place]) -> Self {
        let empty = JointCoverage::new(JointType::Revolute, range, []);
        let angle = |(pose, place): (usize, &Place)| Some((empty.inside(*place.configuration.get(joint)?)?, pose));
        let sorted = places.iter().enumerate().filter_map(angle).collect();
        let allowed = empty.even_gap(places.len()).max(SMALL);
        let mut angles = Self { joint, empty, sorted, allowed, cost: 0.0, wide: Vec::new() };
        angles.settle();
        angles
    }

    /// The turn (rad) that leads from `angle` to `wanted`, the shorter way.
    fn turn(&self, angle: f64, wanted: f64) -> f64 {
        let (low, high) = self.empty.range();
        let away = wanted - angle;
        if self.empty.is_round() { away - (high - low) * (away / (high - low)).round() } else { away }
    }

    /// The cost with the configuration `wanted` for `pose`.
    fn cost_with(&self, pose: usize, wanted: &[f64]) -> f64 {
        let angle = wanted.get(self.joint).and_then(|value| self.empty.inside(*value));
        let others = self.sorted.iter().filter(|(_, other)| *other != pose).map(|(value, _)| *value);
        let place = angle.map_or(0, |angle| others.clone().take_while(|value| *value < angle).count());
        let before = others.clone().take(place);
        let mut cost = 0.0;
        self.each_gap(before.chain(angle).chain(others.skip(place)), |_, size| cost += self.excess(size));
        cost
    }

    fn take(&mut self, pose: usize, configuration: &[f64]) {
        self.sorted.retain(|(_, other)| *other != pose);
        let angle = configuration.get(self.joint).and_then(|value| self.empty.inside(*value));
        self.sorted.extend(angle.map(|angle| (angle, pose)));
        self.settle();
    }

    fn settle(&mut self) {
        self.sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut wide = Vec::new();
        self.each_gap(self.sorted.iter().map(|(angle, _)| *angle), |from, size| {
            if size > self.allowed {
                wide.push((from, size));
            }
        });
        wide.sort_by(|a, b| b.1.total_cmp(&a.1));
        self.cost = wide.iter().map(|(_, size)| self.excess(*size)).sum();
        self.wide = wide;
    }

    fn excess(&self, gap: f64) -> f64 {
        (gap / self.allowed - 1.0).max(0.0).powi(3)
    }

    /// Calls `visit` with begin and size of the gaps between ascending angles.
    fn each_gap(&self, angles: impl Iterator<Item = f64>, mut visit: impl FnMut(f64, f64)) {
        let (low, high) = self.empty.range();
        let mut first = None;
        let mut last = low;
        for angle in angles {
            if first.is_some() || !self.empty.is_round() {
                visit(last, angle - last);
            }
            first = first.or(Some(angle));
            last = angle;
        }
        match first.filter(|_| self.empty.is_round()) {
            Some(first) => visit(last, first + (high - low) - last),
            None => visit(last, high - last),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Score, random};
    use super::*;
    use crate::kinematics::coverage;
    use crate::profile::{Level, Profile, builtin};

    #[test]
    fn gaps_close_and_the_figures_stay() {
        let (profile, _) = Profile::parse(builtin("ur5").unwrap(), "").unwrap();
        let arm = profile.arm();
        let ranges = JointBox::new(vec![(-3.0, 3.0), (-2.5, 0.0), (-2.0, 2.0), (-4.0, 4.0), (-2.0, 2.0), (-3.2, 3.2)]);
        let ranges = ranges.unwrap();
        let places = |seed, count| -> Vec<Place> {
            random(&ranges, seed).take(count).map(|configuration| Place { configuration, target: 0 }).collect()
        };
        let pool = places(1, 200);
        let information =
            Information::new(&arm, &profile.parameters(Level::Geometric), &pool, &places(2, 100)).unwrap();
        let set: Vec<usize> = (10..60).collect();
        let chosen = pool[10..60].to_vec();
        let fixed = 5;
        let spreading = Spreading::new(&information, &arm, &ranges, &set, chosen.clone(), fixed).unwrap();
        let inside = |q: &[f64]| ranges.contains(q).then(|| q.to_vec());
        let (spread, moved) = spreading.run(1, &inside);

        assert_eq!(moved[..fixed], chosen[..fixed]);
        assert!(moved.iter().all(|place| ranges.contains(&place.configuration)));
        let before = Score::new(&information, &set).unwrap();
        let after = Score::new(&spread, &set).unwrap();
        assert!(after.predicted_error <= (1.0 + SLACK + 1e-9) * before.predicted_error);
        assert!(after.condition_number <= (1.0 + SLACK + 1e-9) * before.condition_number);
        let largest = |places: &[Place]| -> Vec<f64> {
            let configurations = places.iter().map(|place| place.configuration.as_slice());
            let joints = coverage(&arm.chain, ranges.ranges(), &configurations);
            joints.iter().map(|joint| joint.largest_gap().size() / joint.even_gap(50).max(SMALL)).collect()
        };
        let (before, after) = (largest(&chosen), largest(&moved));
        assert!(before.iter().zip(&after).all(|(before, after)| *after < 0.7 * before), "{before:?} {after:?}");
        assert!(after.iter().all(|gap| *gap < 1.8), "{after:?}");
        // The information is that of the moved poses.
        let scratch = Information::new(&arm, &profile.parameters(Level::Geometric), &pool, &places(2, 100)).unwrap();
        let mut replaced = scratch;
        set.iter().zip(&moved).for_each(|(&candidate, place)| replaced.replace(candidate, &arm, place));
        assert_eq!(replaced.predicted_error(&set), spread.predicted_error(&set));
    }
}
