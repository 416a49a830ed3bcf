//! How configurations cover the range of each joint. What depends on the angle of a joint is known only near visited angles.

use std::f64::consts::TAU;

use super::{JointType, KinematicChain};

/// Rounding of a value at the end of a range.
const ROUNDING: f64 = 1e-9;

/// A stretch of a joint's range without a visited value: pendant values (rad, sliding joints m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Where it begins: a visited value or the lower end of the range.
    pub from: f64,
    /// Where it ends. A gap that a full turn closes ends beyond the upper end of the range.
    pub to: f64,
}

impl Gap {
    /// Its length (rad, sliding joints m).
    pub const fn size(&self) -> f64 {
        self.to - self.from
    }
}

/// The visited values of one joint in its range. An angle and the same angle a full turn later are one value: a range of a full turn
/// or more has no ends.
#[derive(Clone, Debug, PartialEq)]
pub struct JointCoverage {
    range: (f64, f64),
    turns: bool,
    values: Vec<f64>,
}

impl JointCoverage {
    /// Of a joint that may move in `range` and visited `values`, in any order. Values outside the range do not count.
    pub fn new(joint_type: JointType, range: (f64, f64), values: impl IntoIterator<Item = f64>) -> Self {
        let turns = joint_type == JointType::Revolute;
        let range = if turns && range.1 - range.0 > TAU - ROUNDING { (range.0, range.0 + TAU) } else { range };
        let mut coverage = Self { range, turns, values: Vec::new() };
        coverage.values = values.into_iter().filter_map(|value| coverage.inside(value)).collect();
        coverage.values.sort_by(f64::total_cmp);
        coverage
    }

    /// The visited values in the range, ascending.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The range (rad, sliding joints m); one turn where the joint may turn further.
    pub const fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Whether the range is a full turn.
    pub fn is_round(&self) -> bool {
        self.turns && self.range.1 - self.range.0 > TAU - ROUNDING
    }

    /// The largest gap between neighbouring values that so many could leave at best, the ends of the range included.
    pub fn even_gap(&self, count: usize) -> f64 {
        let gaps = if self.is_round() { count.max(1) } else { count + 1 };
        (self.range.1 - self.range.0) / gaps as f64
    }

    /// The gaps between neighbouring values and to the ends of the range, in order.
    pub fn gaps(&self) -> impl Iterator<Item = Gap> {
        let (first, last) = if self.is_round() && !self.values.is_empty() {
            (None, self.values.first().map(|first| first + TAU))
        } else {
            (Some(self.range.0), Some(self.range.1))
        };
        let begins = first.into_iter().chain(self.values.iter().copied());
        let ends = self.values.iter().copied().skip(usize::from(first.is_none())).chain(last);
        begins.zip(ends).map(|(from, to)| Gap { from, to })
    }

    /// The largest of the gaps; the first of equals.
    pub fn largest_gap(&self) -> Gap {
        let whole = Gap { from: self.range.0, to: self.range.1 };
        self.gaps().reduce(|largest, gap| if gap.size() > largest.size() { gap } else { largest }).unwrap_or(whole)
    }

    /// Distance of a value to the nearest visited one (rad, sliding joints m); infinite if there is none.
    pub fn distance(&self, value: f64) -> f64 {
        let value = if self.turns { self.folded(value) } else { value };
        let next = self.values.partition_point(|visited| *visited < value);
        let beside = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|index| self.values.get(index));
        let ends = self.values.first().into_iter().chain(self.values.last());
        let turned = |difference: f64| if self.turns { difference.min(TAU - difference) } else { difference };
        beside.chain(ends).map(|visited| turned((visited - value).abs())).fold(f64::INFINITY, f64::min)
    }

    /// The value in the range that is the same place of the joint.
    pub fn inside(&self, value: f64) -> Option<f64> {
        let value = if self.turns { self.folded(value) } else { value };
        let (low, high) = self.range;
        (low - ROUNDING..=high + ROUNDING).contains(&value).then(|| value.clamp(low, high))
    }

    /// The same angle in the turn that begins at the lower end of the range.
    fn folded(&self, value: f64) -> f64 {
        // Most values are in it, and stay exactly what they are.
        if (self.range.0..self.range.0 + TAU).contains(&value) {
            return value;
        }
        let beyond = (value - self.range.0).rem_euclid(TAU);
        self.range.0 + if beyond > TAU - ROUNDING { 0.0 } else { beyond }
    }
}

/// How `configurations` cover the ranges of the joints of `chain`, joint by joint.
pub fn coverage<'a>(
    chain: &KinematicChain,
    ranges: &[(f64, f64)],
    configurations: &(impl Iterator<Item = &'a [f64]> + Clone),
) -> Vec<JointCoverage> {
    let joints = chain.joints().iter().zip(ranges).enumerate();
    joints
        .map(|(index, (joint, range))| {
            let values = configurations.clone().filter_map(|configuration| configuration.get(index).copied());
            JointCoverage::new(joint.joint_type, *range, values)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::DEGREE;

    fn degrees(range: (f64, f64), values: &[f64]) -> JointCoverage {
        let range = (range.0 * DEGREE, range.1 * DEGREE);
        JointCoverage::new(JointType::Revolute, range, values.iter().map(|value| value * DEGREE))
    }

    fn largest(coverage: &JointCoverage) -> (f64, f64) {
        let gap = coverage.largest_gap();
        ((gap.from / DEGREE).round(), (gap.to / DEGREE).round())
    }

    #[test]
    fn gaps_reach_to_the_ends_of_the_range() {
        assert_eq!(largest(&degrees((-90.0, 90.0), &[80.0, -50.0, 0.0, 40.0])), (-50.0, 0.0));
        assert_eq!(largest(&degrees((-90.0, 90.0), &[80.0, 20.0, 50.0, -20.0])), (-90.0, -20.0));
        assert_eq!(largest(&degrees((-90.0, 90.0), &[])), (-90.0, 90.0));
        let coverage = degrees((-90.0, 90.0), &[80.0, -50.0]);
        assert_eq!(coverage.gaps().count(), 3);
        assert!((coverage.gaps().map(|gap| gap.size()).sum::<f64>() / DEGREE - 180.0).abs() < 1e-9);
        assert!((coverage.even_gap(2) / DEGREE - 60.0).abs() < 1e-9);
    }

    #[test]
    fn a_full_turn_has_no_ends() {
        let coverage = degrees((-180.0, 180.0), &[-100.0, 20.0, 100.0]);
        assert_eq!(largest(&coverage), (100.0, 260.0));
        assert_eq!(coverage.gaps().count(), 3);
        assert!((coverage.distance(-175.0 * DEGREE) / DEGREE - 75.0).abs() < 1e-9);
        assert!((coverage.distance(175.0 * DEGREE) / DEGREE - 75.0).abs() < 1e-9);
        // More than a turn: the same angles a turn later count.
        assert_eq!(largest(&degrees((-360.0, 360.0), &[0.0, 100.0, 200.0])), (-160.0, 0.0));
        assert_eq!(degrees((-180.0, 180.0), &[180.0, -180.0]).values(), [-180.0 * DEGREE; 2]);
    }

    #[test]
    fn values_outside_the_range_do_not_count() {
        assert_eq!(degrees((0.0, 90.0), &[-10.0, 45.0, 100.0]).values().len(), 1);
        // A full turn away is inside.
        assert_eq!(degrees((0.0, 90.0), &[-330.0, 405.0]).values().len(), 2);
        let slide = JointCoverage::new(JointType::Prismatic, (0.0, 0.4), [0.1, 0.3, 7.0]);
        assert_eq!(slide.values(), [0.1, 0.3]);
        assert!((slide.largest_gap().size() - 0.2).abs() < 1e-12 && (slide.distance(0.0) - 0.1).abs() < 1e-12);
        assert!(JointCoverage::new(JointType::Prismatic, (0.0, 0.4), []).distance(0.1).is_infinite());
    }

    #[test]
    fn configurations_are_taken_joint_by_joint() {
        let (profile, _) = crate::profile::Profile::parse(crate::profile::builtin("ur5").unwrap(), "").unwrap();
        let configurations = [vec![0.1; 6], vec![-0.5; 6], vec![0.7; 6]];
        let joints = coverage(profile.chain(), &[(-1.0, 1.0); 6], &configurations.iter().map(Vec::as_slice));
        assert_eq!(joints.len(), 6);
        assert!(joints.iter().all(|joint| joint.values() == [-0.5, 0.1, 0.7]));
    }
}
