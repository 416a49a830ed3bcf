//! Moves: straight lines in joint space, checked without gaps.

use super::{ArmShape, Contact, Obstruction, Solid};
use crate::kinematics::{Convention, Joint, JointType, KinematicChain};
use crate::units::MILLIMETRE;

/// Between two checked points of a move no part comes nearer to anything than the gap before it, except for steps this short (m).
pub(super) const SHORTEST_STEP: f64 = MILLIMETRE;

/// How far points of the arm can move when its joints move.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// Per solid and joint: farthest that a point on the solid's line can be from the axis of the joint (m); 1 for a
    /// sliding joint. Zero for joints behind the solid.
    by_joint: Vec<Vec<f64>>,
}

impl Reach {
    pub(super) fn new(chain: &KinematicChain, limits: &[(f64, f64)], solids: &[Solid]) -> Self {
        let joints = chain.joints();
        // Longest that each link can be, with and without what lies along the axis of its own joint.
        let lengths: Vec<(f64, f64)> = joints
            .iter()
            .enumerate()
            .map(|(index, joint)| {
                let d = largest_offset(index, joint, limits);
                match chain.convention() {
                    Convention::Standard => (joint.link.a.hypot(d), joint.link.a.abs()),
                    // The joint's axis goes through the end of the link; β tilts d against a.
                    Convention::Modified => (joint.link.a.abs() + d, 0.0),
                }
            })
            .collect();
        let by_joint = solids
            .iter()
            .map(|solid| {
                let mut reach = vec![0.0; joints.len()];
                let mut behind = solid.line.from.coords.norm().max(solid.line.to.coords.norm());
                let before = joints.iter().zip(&lengths).zip(&mut reach).take(solid.link);
                for ((joint, (length, own)), reach) in before.rev() {
                    *reach = match joint.joint_type {
                        JointType::Revolute => behind + own,
                        JointType::Prismatic => 1.0,
                    };
                    behind += length;
                }
                reach
            })
            .collect();
        Self { by_joint }
    }

    /// An upper bound of how much a gap changes (m) when the kinematic joint variables change by `change`.
    fn bound(&self, contact: Contact, solids: &[Solid], change: &[f64]) -> f64 {
        // Joints before both bodies move them together.
        let (index, common) = match contact {
            Contact::Arm(first, second) => (second, solids.get(first).map_or(0, |solid| solid.link)),
            Contact::Floor(index) | Contact::KeepOut(index, _) | Contact::Tracker(index) => (index, 0),
        };
        let reach = self.by_joint.get(index).map_or(&[][..], Vec::as_slice);
        reach.iter().zip(change).skip(common).map(|(reach, change)| reach * change.abs()).sum()
    }
}

/// Largest |d| of a link within the limits (m).
fn largest_offset(index: usize, joint: &Joint, limits: &[(f64, f64)]) -> f64 {
    match joint.joint_type {
        JointType::Revolute => joint.link.d.abs(),
        JointType::Prismatic => {
            let largest = |j: usize| limits.get(j).map_or(0.0, |(low, high)| low.abs().max(high.abs()));
            let gains = (0..limits.len()).map(|j| joint.variable_by_pendant(index, j).abs() * largest(j));
            joint.link.d.abs() + gains.sum::<f64>()
        }
    }
}

impl ArmShape<'_> {
    /// Whether the arm can move from one configuration to another, all joints starting and ending together.
    ///
    /// Conservative advancement: at each checked point the gap `g` of every contact is known, and so is a bound `b` of how
    /// much that gap can change on the rest of the way; the next point is at the smallest `g / b`. Nothing can be
    /// touched between two points, and at each of them the clearance is kept. (Mirtich 1996, *Impulse-based dynamic
    /// simulation of rigid body systems*, §2.3; here with bounds from link lengths.)
    ///
    /// # Errors
    /// The obstruction that was met first.
    pub fn check_move(&self, from: &[f64], to: &[f64]) -> Result<(), Obstruction> {
        let joints = self.arm.chain().joints();
        let change: Vec<f64> = joints
            .iter()
            .enumerate()
            .map(|(index, joint)| joint.variable(index, to) - joint.variable(index, from))
            .collect();
        let bounds: Vec<f64> =
            self.contacts.iter().map(|&contact| self.reach.bound(contact, &self.solids, &change)).collect();
        let mut at = 0.0;
        loop {
            let q: Vec<f64> = from.iter().zip(to).map(|(from, to)| from + (to - from) * at).collect();
            let lines = self.lines(&q);
            if let Some((contact, _)) = self.too_near(&lines).next() {
                return Err(self.obstruction(contact));
            }
            let mut step = 1.0_f64;
            for ((_, gap), bound) in self.gaps(&lines).zip(&bounds) {
                if *bound > 0.0 {
                    step = step.min(gap.max(SHORTEST_STEP) / bound);
                }
            }
            if at >= 1.0 {
                return Ok(());
            }
            at = (at + step).min(1.0);
        }
    }
}
