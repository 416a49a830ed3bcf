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

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Unit, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::kinematics::Link;
    use crate::planning::{Body, BoxInBase, Cell, KeepOutBox, MountedTarget, TrackerStand};

    const JOINTS: usize = 5;
    const LIMITS: (f64, f64) = (-2.0, 2.0);

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-0.5..0.5_f64).prop_map(Point3::from)
    }

    /// Any arm: both conventions, a sliding joint, a coupling, β.
    fn chain() -> impl Strategy<Value = KinematicChain> {
        let link = (-3.0..3.0_f64, -0.8..0.8_f64, -0.8..0.8_f64, -3.0..3.0_f64, -0.2..0.2_f64)
            .prop_map(|(alpha, a, d, theta, beta)| Link { alpha, a, d, theta, beta });
        let links = prop::collection::vec(link, JOINTS);
        (links, 0..JOINTS, 0..JOINTS, -1.0..1.0_f64, any::<bool>()).prop_map(
            |(links, slides, coupled, by, is_standard)| {
                let joint = |(index, link): (usize, Link)| Joint {
                    name: format!("J{}", index + 1),
                    joint_type: if index == slides { JointType::Prismatic } else { JointType::Revolute },
                    link,
                    direction: if index % 2 == 0 { 1.0 } else { -1.0 },
                    coupling: if index == coupled && index > 0 { vec![by, 0.0, 0.0, 0.0, 0.0] } else { Vec::new() },
                };
                let convention = if is_standard { Convention::Standard } else { Convention::Modified };
                let joints = links.into_iter().enumerate().map(joint).collect();
                let flange = Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::new(0.3, 0.2, 0.1));
                KinematicChain::new(convention, Isometry3::identity(), joints, flange).unwrap()
            },
        )
    }

    fn cell(ends: &[(Point3<f64>, Point3<f64>)]) -> Cell {
        let body = |(link, (from, to)): (usize, &(Point3<f64>, Point3<f64>))| Body {
            link,
            from: *from,
            to: *to,
            radius: 0.01,
        };
        Cell {
            limits: vec![LIMITS; JOINTS],
            bodies: ends.iter().enumerate().map(body).collect(),
            floor: Some(-9.0),
            keep_out: vec![KeepOutBox {
                name: "box".to_owned(),
                space: BoxInBase { min: Point3::new(4.0, -1.0, -1.0), max: Point3::new(5.0, 1.0, 1.0) },
            }],
            tracker: Some(TrackerStand {
                position_in_base: Point3::new(0.0, 7.0, 0.0),
                acceptance_angle: 1.0,
                range: (0.1, 20.0),
            }),
            target: MountedTarget {
                position_in_flange: Point3::new(0.0, 0.1, 0.1),
                axis_in_flange: Unit::new_unchecked(Vector3::z()),
            },
            region: None,
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_gap_changes_by_more_than_its_bound(
            chain in chain(),
            ends in prop::collection::vec((point(), point()), JOINTS + 1),
            from in prop::collection::vec(LIMITS.0..LIMITS.1, JOINTS),
            way in prop::collection::vec(-1.0..1.0_f64, JOINTS),
            length in prop_oneof![Just(1.0), Just(1e-2), Just(1e-4)],
        ) {
            let shape = ArmShape::new(&chain, &cell(&ends), 0.0).unwrap();
            let to: Vec<f64> =
                from.iter().zip(&way).map(|(q, way)| (q + way * length).clamp(LIMITS.0, LIMITS.1)).collect();
            let change: Vec<f64> = chain
                .joints()
                .iter()
                .enumerate()
                .map(|(index, joint)| joint.variable(index, &to) - joint.variable(index, &from))
                .collect();
            let [before, after] = [&from, &to].map(|q| shape.lines(q));
            for &contact in &shape.contacts {
                let moved = (shape.contact_gap(contact, &after) - shape.contact_gap(contact, &before)).abs();
                let bound = shape.reach.bound(contact, &shape.solids, &change);
                prop_assert!(moved <= bound + 1e-12, "{contact:?}: {moved} > {bound}");
            }
        }
    }
}
