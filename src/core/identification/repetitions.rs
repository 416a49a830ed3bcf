//! Which samples show a configuration and target again. A repetition tells about noise, nothing about the arm.

use crate::kinematics::{Joint, Place};

/// Joint values closer than this (deg, sliding joints mm) are the same configuration, written down once more.
const SAME_JOINT_VALUE: f64 = 0.01;

/// Configurations and targets that can be looked up. Sorted by one number each, so that only few candidates are compared joint
/// by joint.
#[derive(Clone, Debug)]
pub struct Places<'a> {
    sorted: Vec<(f64, usize, &'a Place)>,
    /// What joint values may differ by ((rad) or (m)).
    tolerances: Vec<f64>,
}

impl<'a> Places<'a> {
    /// Of an arm with these joints; every configuration has a value for each.
    pub fn new(joints: &[Joint], places: impl IntoIterator<Item = &'a Place>) -> Self {
        Self::within(SAME_JOINT_VALUE, joints, places)
    }

    /// As [`Self::new`], with another difference (deg, sliding joints mm) up to which joint values are the same.
    pub fn within(difference: f64, joints: &[Joint], places: impl IntoIterator<Item = &'a Place>) -> Self {
        let tolerances = joints.iter().map(|joint| joint.joint_type.quantity().from_edge(difference)).collect();
        let mut found = Self { sorted: Vec::new(), tolerances };
        let listed = places.into_iter().enumerate();
        found.sorted = listed.map(|(index, at)| (found.key(at), index, at)).collect();
        found.sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// Whether one of them is the same as `at`.
    pub fn contains(&self, at: &Place) -> bool {
        self.same(at).next().is_some()
    }

    /// For every one, in the order in which they were given, the index of the first that is the same: its own if it is no
    /// repetition.
    pub fn first_of_each(&self) -> Vec<usize> {
        let mut in_order: Vec<(usize, &Place)> = self.sorted.iter().map(|(_, index, at)| (*index, *at)).collect();
        in_order.sort_by_key(|(index, _)| *index);
        let mut first = Vec::with_capacity(in_order.len());
        for (index, at) in in_order {
            let same = self.same(at).min().unwrap_or(index);
            // Step by step: what is the same as a repetition is one too.
            first.push(first.get(same).copied().unwrap_or(index));
        }
        first
    }

    /// How many differ.
    pub fn distinct(&self) -> usize {
        self.first_of_each().iter().enumerate().filter(|(index, first)| index == *first).count()
    }

    /// Joint values in tolerances, with weights between 1 and 2 that no regular grid of configurations has.
    fn key(&self, at: &Place) -> f64 {
        let values = at.configuration.iter().zip(&self.tolerances).enumerate();
        values.map(|(joint, (value, size))| value / size * weight(joint)).sum()
    }

    fn same<'b>(&'b self, at: &'b Place) -> impl Iterator<Item = usize> + 'b {
        let reach: f64 = (0..self.tolerances.len()).map(weight).sum();
        let key = self.key(at);
        let first = self.sorted.partition_point(|(other, ..)| *other < key - reach);
        let near = self.sorted.iter().skip(first).take_while(move |(other, ..)| *other <= key + reach);
        near.filter(|(_, _, other)| self.is_same(other, at)).map(|(_, index, _)| *index)
    }

    fn is_same(&self, a: &Place, b: &Place) -> bool {
        let mut values = a.configuration.iter().zip(&b.configuration).zip(&self.tolerances);
        a.target == b.target && values.all(|((a, b), size)| (a - b).abs() <= *size)
    }
}

fn weight(joint: usize) -> f64 {
    1.0 + (0.618_034 * joint as f64).fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{JointType, Link};

    #[test]
    fn what_is_nearly_the_same_is_a_repetition() {
        let joint = |joint_type| Joint {
            name: String::new(),
            joint_type,
            link: Link::default(),
            direction: 1.0,
            coupling: Vec::new(),
        };
        let joints = [joint(JointType::Revolute), joint(JointType::Prismatic)];
        let at = |degrees: f64, millimetres: f64, target| Place {
            configuration: vec![degrees.to_radians(), 1e-3 * millimetres],
            target,
        };
        let places = [
            at(10.0, 5.0, 0),
            at(10.0, 5.0, 1),
            at(-20.0, 5.0, 0),
            at(10.009, 4.991, 0),
            at(10.011, 5.0, 0),
            at(10.0, 5.011, 0),
            at(-20.0, 5.0, 0),
        ];
        let index = Places::new(&joints, &places);
        // The fifth is 0.011 degrees from the first, but 0.002 from the fourth.
        assert_eq!(index.first_of_each(), [0, 1, 2, 0, 0, 5, 2]);
        assert_eq!(index.distinct(), 4);
        assert!(index.contains(&at(-19.995, 5.0, 0)) && !index.contains(&at(-19.98, 5.0, 0)));
        assert_eq!(Places::new(&joints, []).distinct(), 0);
    }
}
