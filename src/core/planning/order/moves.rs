//! Moves between known configurations, checked when they are needed and remembered.

use super::Pace;
use crate::kinematics::JointType;
use crate::planning::collision::ArmShape;

use super::tour::{Pairs, Times};

/// A complete graph: configurations, the time between them, and what is known of the moves.
#[derive(Debug)]
pub(super) struct Moves<'s, 'q> {
    shape: &'s ArmShape<'s>,
    nodes: Vec<&'q [f64]>,
    times: Times,
    checked: Pairs,
    blocked: Pairs,
}

impl<'s, 'q> Moves<'s, 'q> {
    pub(super) fn new(shape: &'s ArmShape<'_>, nodes: Vec<&'q [f64]>, pace: &Pace) -> Self {
        let types: Vec<JointType> = shape.arm().chain().joints().iter().map(|joint| joint.joint_type).collect();
        let at = |node: usize| nodes.get(node).copied().unwrap_or_default();
        let times = Times::new(nodes.len(), |a, b| pace.move_time(types.iter().copied(), at(a), at(b)));
        let (checked, blocked) = (Pairs::new(nodes.len()), Pairs::new(nodes.len()));
        Self { shape, nodes, times, checked, blocked }
    }

    pub(super) fn configuration(&self, node: usize) -> &'q [f64] {
        self.nodes.get(node).copied().unwrap_or_default()
    }

    /// Time of the straight move (s).
    pub(super) fn time(&self, a: usize, b: usize) -> f64 {
        self.times.get(a, b)
    }

    /// Whether the straight move touches nothing. A move and its reverse are the same.
    pub(super) fn is_free(&mut self, a: usize, b: usize) -> bool {
        if a == b {
            return true;
        }
        let (first, last) = (a.min(b), a.max(b));
        if self.checked.insert(first, last)
            && self.shape.check_move(self.configuration(first), self.configuration(last)).is_err()
        {
            self.blocked.insert(first, last);
        }
        !self.blocked.contains(first, last)
    }

    /// Time along nodes (s).
    pub(super) fn way_time(&self, way: &[usize]) -> f64 {
        way.windows(2).map(|leg| if let [a, b] = leg { self.time(*a, *b) } else { 0.0 }).sum()
    }

    /// The quickest way from `a` to `b` through nodes, both included, on which nothing is touched.
    ///
    /// Lazy search: moves count as free until the quickest way uses them and they are checked (Dellin & Srinivasa 2016,
    /// "A unifying formalism for shortest path problems with expensive edge evaluations via lazy best-first search").
    pub(super) fn way(&mut self, a: usize, b: usize) -> Option<Vec<usize>> {
        loop {
            let way = self.quickest(a, b)?;
            let mut is_free = true;
            for leg in way.windows(2) {
                if let [from, to] = leg {
                    is_free &= self.is_free(*from, *to);
                }
            }
            if is_free {
                return Some(way);
            }
        }
    }

    /// Dijkstra over the moves that are not known to be blocked.
    fn quickest(&self, a: usize, b: usize) -> Option<Vec<usize>> {
        let count = self.nodes.len();
        // Per node: time from `a`, the node before, whether it is final.
        let mut best: Vec<(f64, usize, bool)> = vec![(f64::INFINITY, a, false); count];
        best.get_mut(a)?.0 = 0.0;
        loop {
            let open = best.iter().enumerate().filter(|(_, (time, _, is_final))| !is_final && time.is_finite());
            let (node, time) = open.map(|(node, (time, ..))| (node, *time)).min_by(|(_, a), (_, b)| a.total_cmp(b))?;
            if node == b {
                break;
            }
            if let Some(entry) = best.get_mut(node) {
                entry.2 = true;
            }
            for (next, entry) in best.iter_mut().enumerate() {
                let through = time + self.times.get(node, next);
                if !entry.2 && through < entry.0 && !self.blocked.contains(node, next) {
                    *entry = (through, node, false);
                }
            }
        }
        let mut way = vec![b];
        let mut at = b;
        while at != a {
            at = best.get(at)?.1;
            way.push(at);
        }
        way.reverse();
        Some(way)
    }
}
