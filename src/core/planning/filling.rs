//! How a set fills the ranges of the turning joints. A joint's error curve is known only near visited angles, so the angles of a set
//! should leave no large gap in any range.
//!
//! The shortfall of a joint is `Σ max(0, g/a − 1)² · a/r` over its gaps g, r its range and a the gap that would do: that of evenly
//! spread angles, or [`FINE`] where there are poses enough. The shortfall of a set is the mean of its joints': 0 where every
//! gap will do, about 0.74 for random angles, r/a where nothing was visited.

use super::JointBox;
use crate::kinematics::{JointCoverage, JointType, KinematicChain, Place};
use crate::units::DEGREE;

/// A gap that does in any case (rad): half of it is well inside the length over which joint curves are alike, 3.4°.
const FINE: f64 = 4.0 * DEGREE;

/// The joint angles of a pool of candidates in their ranges.
#[derive(Clone, Debug)]
pub(super) struct Filling {
    joints: Vec<FilledJoint>,
}

#[derive(Clone, Debug)]
struct FilledJoint {
    joint: usize,
    /// Nothing visited.
    empty: JointCoverage,
    /// The angle of every candidate; none where it is outside the range.
    angles: Vec<Option<f64>>,
}

impl Filling {
    /// Of `candidates`; `None` if no joint turns over a range.
    pub(super) fn new(chain: &KinematicChain, ranges: &JointBox, candidates: &[Place]) -> Option<Self> {
        let joints = chain.joints().iter().zip(ranges.ranges()).enumerate();
        let filled = joints
            .filter(|(_, (joint, (low, high)))| joint.joint_type == JointType::Revolute && high - low > FINE)
            .map(|(index, (_, range))| {
                let empty = JointCoverage::new(JointType::Revolute, *range, []);
                let angle = |place: &Place| place.configuration.get(index).and_then(|value| empty.inside(*value));
                FilledJoint { joint: index, angles: candidates.iter().map(angle).collect(), empty }
            });
        let joints: Vec<FilledJoint> = filled.collect();
        (!joints.is_empty()).then_some(Self { joints })
    }

    /// Takes the angles of `place` for a candidate.
    pub(super) fn replace(&mut self, candidate: usize, place: &Place) {
        for joint in &mut self.joints {
            if let Some(angle) = joint.angles.get_mut(candidate) {
                *angle = place.configuration.get(joint.joint).and_then(|value| joint.empty.inside(*value));
            }
        }
    }

    /// The shortfall of `set`.
    pub(super) fn shortfall(&self, set: &[usize]) -> f64 {
        Unfilled::new(self, set, set.len()).shortfall
    }
}

/// The gaps of a set, ready to judge one more pose.
#[derive(Debug)]
pub(super) struct Unfilled<'a> {
    joints: Vec<UnfilledJoint<'a>>,
    /// Of the set as it is.
    pub(super) shortfall: f64,
    /// No candidate brings it below this.
    pub(super) least: f64,
}

#[derive(Debug)]
struct UnfilledJoint<'a> {
    angles: &'a [Option<f64>],
    /// The ends of the gaps, ascending; those of a full turn go on into the next one.
    ends: Vec<f64>,
    turn: f64,
    /// The gap that would do.
    allowed: f64,
    /// What the square of an excess counts.
    weight: f64,
}

impl<'a> Unfilled<'a> {
    /// Of `set`, judged as a part of a set of `poses`.
    pub(super) fn new(filling: &'a Filling, set: &[usize], poses: usize) -> Self {
        let count = filling.joints.len().max(1) as f64;
        let joints: Vec<UnfilledJoint<'_>> =
            filling.joints.iter().map(|joint| UnfilledJoint::new(joint, set, poses, count)).collect();
        let shortfall: f64 = joints.iter().map(UnfilledJoint::shortfall).sum();
        let least = (shortfall - joints.iter().map(UnfilledJoint::largest_gain).sum::<f64>()).max(0.0);
        Self { joints, shortfall, least }
    }

    /// The shortfall with `candidate` in the set.
    pub(super) fn with(&self, candidate: usize) -> f64 {
        self.shortfall - self.joints.iter().map(|joint| joint.gain(candidate)).sum::<f64>()
    }
}

impl<'a> UnfilledJoint<'a> {
    fn new(joint: &'a FilledJoint, set: &[usize], poses: usize, joints: f64) -> Self {
        let (low, high) = joint.empty.range();
        let mut ends: Vec<f64> = set.iter().filter_map(|&pose| joint.angles.get(pose).copied().flatten()).collect();
        ends.sort_by(f64::total_cmp);
        match ends.first() {
            Some(first) if joint.empty.is_round() => ends.push(first + (high - low)),
            _ => {
                ends.insert(0, low);
                ends.push(high);
            }
        }
        let allowed = joint.empty.even_gap(poses).max(FINE);
        let turn = if joint.empty.is_round() { high - low } else { 0.0 };
        Self { angles: &joint.angles, ends, turn, allowed, weight: allowed / ((high - low) * joints) }
    }

    fn excess(&self, gap: f64) -> f64 {
        self.weight * (gap / self.allowed - 1.0).max(0.0).powi(2)
    }

    fn shortfall(&self) -> f64 {
        self.ends.windows(2).map(|ends| self.excess(ends[1] - ends[0])).sum()
    }

    /// By how much one angle can lower the shortfall at best: in the middle of a gap.
    fn largest_gain(&self) -> f64 {
        let gain = |gap: f64| self.excess(gap) - 2.0 * self.excess(0.5 * gap);
        self.ends.windows(2).map(|ends| gain(ends[1] - ends[0])).fold(0.0, f64::max)
    }

    /// By how much the angle of `candidate` lowers the shortfall.
    fn gain(&self, candidate: usize) -> f64 {
        let Some(angle) = self.angles.get(candidate).copied().flatten() else { return 0.0 };
        let angle = if self.ends.first().is_some_and(|first| angle < *first) { angle + self.turn } else { angle };
        let next = self.ends.partition_point(|end| *end < angle);
        let Some(after) = self.ends.get(next) else { return 0.0 };
        let Some(before) = next.checked_sub(1).and_then(|index| self.ends.get(index)) else { return 0.0 };
        self.excess(after - before) - self.excess(angle - before) - self.excess(after - angle)
    }
}

#[cfg(test)]
mod tests {
    use super::super::random;
    use super::*;
    use crate::profile::{Profile, builtin};

    /// A pool whose joints turn over a full turn and over less.
    fn filling() -> Filling {
        let (profile, _) = Profile::parse(builtin("ur5").unwrap(), "").unwrap();
        let ranges = JointBox::new(vec![(-4.0, 4.0), (-1.0, 0.5), (-3.0, 3.0), (0.0, 0.0), (-3.2, 3.2), (0.0, 1.0)]);
        let ranges = ranges.unwrap();
        let places = random(&ranges, 1).take(300).map(|configuration| Place { configuration, target: 0 });
        Filling::new(profile.chain(), &ranges, &places.collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn one_more_pose_counts_as_from_scratch() {
        let filling = filling();
        assert_eq!(filling.joints.len(), 5);
        for count in [0, 1, 2, 30] {
            let set: Vec<usize> = (0..count).collect();
            let unfilled = Unfilled::new(&filling, &set, count + 1);
            for candidate in count..300 {
                let mut with = set.clone();
                with.push(candidate);
                let scratch = filling.shortfall(&with);
                assert!((unfilled.with(candidate) - scratch).abs() < 1e-9 * (1.0 + scratch), "{count} {candidate}");
                assert!(unfilled.least <= scratch + 1e-9 * (1.0 + scratch), "{count} {candidate}");
            }
        }
    }

    #[test]
    fn random_angles_fall_short_and_more_of_them_less() {
        let filling = filling();
        let shortfall = |count: usize| filling.shortfall(&(0..count).collect::<Vec<_>>());
        assert!((0.4..1.1).contains(&shortfall(60)), "{}", shortfall(60));
        assert!(shortfall(300) < 0.1 && shortfall(300) < shortfall(100), "{} {}", shortfall(300), shortfall(100));
        let everywhere: Vec<usize> = (0..300).collect();
        let nowhere = Unfilled::new(&filling, &[], 60).shortfall;
        assert!(nowhere > 10.0 && Unfilled::new(&filling, &everywhere, 300).shortfall < 0.1, "{nowhere}");
    }
}
