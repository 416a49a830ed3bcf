//! Inverse kinematics of an arm: the configurations that bring its flange to a pose.
//!
//! The axes of the joints come from the chain as lines in the base, whatever its convention, offsets, directions and couplings
//! are. Two families of six-axis arms have a closed form on these lines (Paden 1986, Kahan: intersections of circles):
//! arms whose last three axes meet in a point (*spherical wrist*: ABB, FANUC, KUKA, Stäubli, Yaskawa) and arms with three parallel
//! axes in the middle (Universal Robots). Whatever else, and arms that are only nearly of these families, are solved by damped
//! least squares from several starts. A seventh joint is held at a stated value, so that a pose has separate solutions.
//!
//! Closed forms for arms with a parallel basis and a spherical wrist exist as a crate (`rs-opw-kinematics`). It takes seven
//! lengths of an ideal arm; it has no twisted or offset axes, no couplings beyond signs, no Universal Robots, and no solutions with full turns.

#![warn(missing_docs)]

mod closed;
mod lines;
mod posture;
mod search;

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Isometry3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::kinematics::{ForwardKinematics, JointType, KinematicChain};
use closed::Form;
use lines::Line;
pub use posture::Posture;
pub use search::{Found, Goal, Search};

/// Position (m) and orientation (rad) that a solution reaches.
const EXACT: f64 = 1e-9;
/// Two solutions are one if no joint differs by more (rad, m).
const SAME: f64 = 1e-6;
/// Starts of the search for arms without a closed form.
const STARTS: usize = 120;
/// Range of a turning joint without limits, to both sides (rad).
const UNLIMITED: f64 = TAU;
/// How far beyond a limit a configuration may be by rounding (rad, m).
pub const ROUNDING: f64 = 1e-9;
/// The joint of a seven-axis arm that is held: turning the elbow turns it most.
const REDUNDANT: usize = 2;

/// The value at which a joint is held, so that an arm of seven axes has separate solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Index of the joint.
    pub joint: usize,
    /// Its pendant value ((rad) or (m)).
    pub value: f64,
}

/// Inverse kinematics of one arm.
#[derive(Clone, Debug)]
pub struct InverseKinematics<'a> {
    forward: ForwardKinematics<'a>,
    limits: Vec<Option<(f64, f64)>>,
    lines: Vec<Line>,
    form: Option<Form>,
    pendant: Pendant,
}

/// How pendant values follow from kinematic joint variables.
#[derive(Clone, Debug)]
struct Pendant {
    from_variables: DMatrix<f64>,
    /// Each joint is coupled to joints before it only, with whole numbers: its full turns are independent of the joints after it.
    is_ordered: bool,
}

impl Pendant {
    fn new(chain: &KinematicChain) -> Option<Self> {
        let n = chain.dof();
        let joints = chain.joints();
        let variables = DMatrix::from_fn(n, n, |row, column| joints[row].variable_by_pendant(row, column));
        let is_ordered = (0..n).all(|row| (row..n).all(|column| row == column || variables[(row, column)] == 0.0));
        Some(Self { from_variables: variables.try_inverse()?, is_ordered })
    }

    fn values(&self, variables: &[f64]) -> Vec<f64> {
        (&self.from_variables * DVector::from_column_slice(variables)).as_slice().to_vec()
    }
}

impl<'a> InverseKinematics<'a> {
    /// Prepares an arm. `limits` are pendant values ((rad) or (m)), one entry per joint.
    pub fn new(chain: &'a KinematicChain, limits: &[Option<(f64, f64)>]) -> Self {
        let forward = ForwardKinematics::new(chain);
        let lines = lines::of(chain, &forward);
        let pendant = Pendant::new(chain);
        let is_turning = chain.joints().iter().all(|joint| joint.joint_type == JointType::Revolute);
        let form = if is_turning && pendant.is_some() { Form::of(&lines) } else { None };
        let n = chain.dof();
        Self {
            limits: (0..n).map(|index| limits.get(index).copied().flatten()).collect(),
            pendant: pendant.unwrap_or_else(|| Pendant { from_variables: DMatrix::identity(n, n), is_ordered: false }),
            forward,
            lines,
            form,
        }
    }

    /// The arm.
    pub fn forward(&self) -> &ForwardKinematics<'a> {
        &self.forward
    }

    /// Whether solutions come from a closed form, which finds all of them.
    pub const fn is_closed(&self) -> bool {
        self.form.is_some()
    }

    /// All solutions within the limits, those that differ by full turns included. Without a closed form, those that a search from
    /// many starts finds; an arm with seven axes holds its third joint in the middle of its range.
    pub fn solutions(&self, base_from_flange: &Isometry3<f64>) -> Vec<Vec<f64>> {
        let held = self.redundant().map(|joint| Held { joint, value: self.middle(joint) });
        self.solutions_with(base_from_flange, held)
    }

    /// All solutions within the limits with a joint held.
    pub fn solutions_with(&self, base_from_flange: &Isometry3<f64>, held: Option<Held>) -> Vec<Vec<f64>> {
        let branches = match &self.form {
            Some(_) if held.is_none() => self.branches(base_from_flange),
            _ => self.searched(base_from_flange, held),
        };
        let mut all = Vec::new();
        for branch in branches {
            self.turned(&branch, &mut |q| all.push(q.to_vec()));
        }
        all
    }

    /// The solution of each branch that is meant and, among full turns, nearest to a configuration.
    pub fn meant(
        &self,
        base_from_flange: &Isometry3<f64>,
        near: &[f64],
        is_meant: &dyn Fn(Option<&Posture>, &[f64]) -> bool,
    ) -> Vec<Vec<f64>> {
        let branches = match &self.form {
            Some(_) => self.branches(base_from_flange),
            None => self.searched(base_from_flange, self.held_of(near)),
        };
        let of_branch = |mut q: Vec<f64>| {
            self.unwind(&mut q, near);
            // Full turns leave the posture as it is.
            let posture = self.posture(&q);
            if self.is_within(&q) && is_meant(posture.as_ref(), &q) {
                return Some(q);
            }
            let mut nearest: Option<Vec<f64>> = None;
            self.turned(&q, &mut |turned| {
                let is_nearer = nearest.as_ref().is_none_or(|known| distance(turned, near) < distance(known, near));
                if is_meant(posture.as_ref(), turned) && is_nearer {
                    nearest = Some(turned.to_vec());
                }
            });
            nearest
        };
        branches.into_iter().filter_map(of_branch).collect()
    }

    /// The solution nearest to a configuration: its branch, full turns and, for an arm with seven axes, its third joint.
    pub fn nearest(&self, base_from_flange: &Isometry3<f64>, near: &[f64]) -> Option<Vec<f64>> {
        if near.len() != self.limits.len() {
            return None;
        }
        let held = self.held_of(near);
        let mut best: Option<Vec<f64>> = None;
        let mut consider = |q: Vec<f64>| {
            let is_nearer = best.as_ref().is_none_or(|best| distance(&q, near) < distance(best, near));
            if is_nearer && self.is_within(&q) {
                best = Some(q);
            }
        };
        if self.form.is_some() && held.is_none() {
            for mut branch in self.branches(base_from_flange) {
                self.unwind(&mut branch, near);
                consider(branch);
            }
        }
        // Where the wrist is straight a branch is a whole family of solutions; the search finds the nearest of it.
        if best.as_ref().is_none_or(|best| distance(best, near) > FAR) {
            let found = self.search(held).from(near, &Goal::Pose(*base_from_flange));
            if found.reaches(EXACT) {
                let mut q = found.q;
                self.unwind(&mut q, near);
                if best.as_ref().is_none_or(|best| distance(&q, near) < distance(best, near)) && self.is_within(&q) {
                    best = Some(q);
                }
            }
        }
        best
    }

    /// The branch of a configuration; `None` for an arm without a closed form.
    pub fn posture(&self, q: &[f64]) -> Option<Posture> {
        let form = self.form.as_ref()?;
        let variables: Vec<f64> =
            self.chain().joints().iter().enumerate().map(|(index, joint)| joint.variable(index, q)).collect();
        Some(Posture::new(form, &self.lines, self.chain(), &variables))
    }

    /// Joints whose value is beyond its limits or not a number.
    pub fn beyond(&self, q: &[f64]) -> Vec<usize> {
        let pairs = q.iter().zip(&self.limits).enumerate();
        pairs.filter(|(_, (value, limits))| !is_inside(**value, **limits)).map(|(index, _)| index).collect()
    }

    /// Full turns that bring a configuration nearest to another one, within the limits where that is possible.
    pub fn unwind(&self, q: &mut [f64], near: &[f64]) {
        for (index, near) in near.iter().enumerate() {
            if self.turns_alone(index) {
                let turned = q[index] - TAU * ((q[index] - near) / TAU).round();
                q[index] = self.within(index, turned);
            }
        }
    }

    /// The same pose with every joint within its limits by full turns, where that is possible.
    pub fn turned_into_limits(&self, q: &[f64]) -> Vec<f64> {
        let mut turned = q.to_vec();
        for (index, value) in turned.iter_mut().enumerate() {
            if self.turns_alone(index) {
                *value = self.within(index, *value);
            }
        }
        turned
    }

    fn chain(&self) -> &'a KinematicChain {
        self.forward.chain()
    }

    fn is_within(&self, q: &[f64]) -> bool {
        q.iter().zip(&self.limits).all(|(value, limits)| is_inside(*value, *limits))
    }

    /// The value itself if its joint may have it, otherwise the nearest one that full turns bring into the limits.
    fn within(&self, index: usize, value: f64) -> f64 {
        let Some((low, high)) = self.limits[index] else { return value };
        if (low - ROUNDING..=high + ROUNDING).contains(&value) {
            return value;
        }
        let turns = if value < low {
            ((low - ROUNDING - value) / TAU).ceil()
        } else {
            ((high + ROUNDING - value) / TAU).floor()
        };
        let turned = value + TAU * turns;
        if (low - ROUNDING..=high + ROUNDING).contains(&turned) { turned } else { value }
    }

    /// Whether a full turn of this joint's pendant value turns every joint by full turns.
    fn turns_alone(&self, index: usize) -> bool {
        let joints = self.chain().joints();
        let is_whole = |joint: &crate::kinematics::Joint| {
            joint.coupling.get(index).is_none_or(|coefficient| {
                *coefficient == 0.0
                    || (joint.joint_type == JointType::Revolute && (coefficient - coefficient.round()).abs() < 1e-12)
            })
        };
        joints[index].joint_type == JointType::Revolute && joints.iter().all(is_whole)
    }

    /// The joint that an arm with seven axes holds to stay near a configuration.
    pub fn held_of(&self, near: &[f64]) -> Option<Held> {
        let joint = self.redundant()?;
        Some(Held { joint, value: *near.get(joint)? })
    }

    fn redundant(&self) -> Option<usize> {
        (self.limits.len() > 6).then_some(REDUNDANT)
    }

    fn middle(&self, joint: usize) -> f64 {
        self.limits[joint].map_or(0.0, |(low, high)| f64::midpoint(low, high))
    }

    fn search(&self, held: Option<Held>) -> Search<'_, 'a> {
        Search { arm: &self.forward, limits: &[], held, fine: 0.1 * EXACT }
    }

    /// Solutions of the closed form, one per branch, as pendant values without regard to limits.
    fn branches(&self, base_from_flange: &Isometry3<f64>) -> Vec<Vec<f64>> {
        let Some(form) = &self.form else { return Vec::new() };
        let mut solutions: Vec<Vec<f64>> = Vec::with_capacity(8);
        let motion = base_from_flange * self.forward.base_from_flange(&vec![0.0; self.limits.len()]).inverse();
        for variables in form.solutions(&self.lines, &motion) {
            let mut q = self.pendant.values(&variables);
            let reached = self.forward.base_from_flange(&q);
            let position = (reached.translation.vector - base_from_flange.translation.vector).norm();
            let angle = reached.rotation.angle_to(&base_from_flange.rotation);
            if position.max(angle) > EXACT {
                let found = self.search(None).from(&q, &Goal::Pose(*base_from_flange));
                if !found.reaches(EXACT) {
                    continue;
                }
                q = found.q;
            }
            if !solutions.iter().any(|known| is_same(known, &q)) {
                solutions.push(q);
            }
        }
        solutions
    }

    /// Solutions that a search from random starts finds.
    fn searched(&self, base_from_flange: &Isometry3<f64>, held: Option<Held>) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut solutions: Vec<Vec<f64>> = Vec::new();
        let search = self.search(held);
        for _ in 0..STARTS {
            let start: Vec<f64> = (0..self.limits.len())
                .map(|joint| match (held, self.start_range(joint)) {
                    (Some(held), _) if held.joint == joint => held.value,
                    (_, (low, high)) if low < high => random.random_range(low..high),
                    (_, (low, _)) => low,
                })
                .collect();
            let found = search.from(&start, &Goal::Pose(*base_from_flange));
            let mut q = found.q.clone();
            for (joint, value) in q.iter_mut().enumerate() {
                if self.turns_alone(joint) {
                    *value -= TAU * (*value / TAU).round();
                }
            }
            if found.reaches(EXACT) && !solutions.iter().any(|known| is_same(known, &q)) {
                solutions.push(q);
            }
        }
        solutions
    }

    fn start_range(&self, joint: usize) -> (f64, f64) {
        let (wide, turn) = match self.chain().joints()[joint].joint_type {
            JointType::Revolute => (PI, PI),
            JointType::Prismatic => (1.0, f64::INFINITY),
        };
        // More than half a turn to each side reaches no new pose.
        let (low, high) = self.limits[joint].unwrap_or((-wide, wide));
        (low.max(-turn).min(high), high.min(turn).max(low))
    }

    /// Visits all configurations within the limits that differ from `q` by full turns.
    fn turned(&self, q: &[f64], visit: &mut dyn FnMut(&[f64])) {
        if !self.pendant.is_ordered {
            let turned = self.turned_into_limits(q);
            if self.is_within(&turned) {
                visit(&turned);
            }
            return;
        }
        let values: Vec<Vec<f64>> = q.iter().enumerate().map(|(joint, value)| self.turns_of(joint, *value)).collect();
        if values.iter().any(Vec::is_empty) {
            return;
        }
        let mut chosen = vec![0; q.len()];
        let mut turned: Vec<f64> = values.iter().map(|values| values[0]).collect();
        loop {
            if self.is_within(&turned) {
                visit(&turned);
            }
            // The next combination, as a counter with one digit per joint.
            let Some(joint) = (0..q.len()).find(|&joint| chosen[joint] + 1 < values[joint].len()) else { return };
            chosen[joint] += 1;
            chosen[..joint].fill(0);
            for earlier in 0..=joint {
                turned[earlier] = values[earlier][chosen[earlier]];
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a float to integer cast saturates")]
    fn turns_of(&self, joint: usize, value: f64) -> Vec<f64> {
        if !self.turns_alone(joint) {
            return vec![value];
        }
        let (low, high) = self.limits[joint].unwrap_or((-UNLIMITED, UNLIMITED));
        let first = ((low - ROUNDING - value) / TAU).ceil() as i32;
        let last = ((high + ROUNDING - value) / TAU).floor() as i32;
        (first..=last).map(|turn| value + TAU * f64::from(turn)).collect()
    }
}

/// Beyond this distance (rad, m) from the configuration that was asked for, a search may find a nearer solution.
const FAR: f64 = 0.5;

fn is_inside(value: f64, limits: Option<(f64, f64)>) -> bool {
    value.is_finite() && limits.is_none_or(|(low, high)| (low - ROUNDING..=high + ROUNDING).contains(&value))
}

/// Largest difference of two configurations.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Whether two configurations are one but for full turns.
fn is_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| {
        let difference = a - b;
        (difference - TAU * (difference / TAU).round()).abs() < SAME
    })
}
