//! Whether the tracker sees the SMR in a configuration.
//!
//! The SMR must look at the tracker (angle between its axis and the beam), be within range and inside the region asked for,
//! and nothing may stand in the beam: no body of the arm, no keep-out box. What cannot block the beam:
//! - the first [`OWN_BODY`] of the beam by the link that carries the SMR: the nest is there;
//! - a box that contains the tracker: it is there to keep the arm away from it;
//! - the floor: it is often the plate of a table, and the tracker stands beside it.

use nalgebra::{Isometry3, Point3};
use thiserror::Error;

use super::collision::{Part, SMR_RADIUS, Segment};
use super::{Body, Cell, CellError, KeepOutBox, MountedTarget, TrackerStand};
use crate::kinematics::KinematicChain;
use crate::units::{MILLIMETRE, to_deg, to_mm};

/// Radius of the beam, with room for the tracker not standing exactly where it was planned (m).
pub const BEAM_RADIUS: f64 = 15.0 * MILLIMETRE;

/// Part of the beam that the link which carries the SMR cannot block, from the centre of the SMR (m).
pub const OWN_BODY: f64 = 2.0 * SMR_RADIUS;

/// Why the tracker cannot measure the SMR.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Hidden {
    /// Nearer or farther than the tracker measures.
    #[error("the SMR is {:.0} mm from the tracker; the range is {:.0} to {:.0} mm", to_mm(*distance), to_mm(range.0), to_mm(range.1))]
    Range {
        /// Distance of SMR and tracker (m).
        distance: f64,
        /// Nearest and farthest (m).
        range: (f64, f64),
    },
    /// The SMR looks elsewhere.
    #[error(
        "the SMR looks {:.1} deg past the tracker; its acceptance angle is {:.1} deg",
        to_deg(*angle), to_deg(*acceptance)
    )]
    FacesAway {
        /// Angle between SMR axis and beam (rad).
        angle: f64,
        /// Largest angle (rad).
        acceptance: f64,
    },
    /// A part of the arm is in the beam.
    #[error("{part} is in the beam")]
    BehindArm {
        /// The part.
        part: Part,
    },
    /// A keep-out box is in the beam.
    #[error("the keep-out box '{name}' is in the beam")]
    BehindBox {
        /// Name of the box.
        name: String,
    },
    /// Not in the region asked for.
    #[error("the SMR at ({:.0}, {:.0}, {:.0}) mm is outside the region", to_mm(point.x), to_mm(point.y), to_mm(point.z))]
    OutsideRegion {
        /// Centre of the SMR in the base (m).
        point: Point3<f64>,
    },
}

/// What the tracker can see.
#[derive(Clone, Debug)]
pub struct Sight {
    target: MountedTarget,
    tracker: Option<TrackerStand>,
    region: Option<super::BoxInBase>,
    bodies: Vec<Body>,
    /// Boxes that can block the beam.
    screens: Vec<KeepOutBox>,
    last_link: usize,
}

impl Sight {
    /// The tracker of `cell` looking at the SMR on the arm `chain`. Without a tracker only the region counts.
    ///
    /// # Errors
    /// A cell that makes no sense.
    pub fn new(chain: &KinematicChain, cell: &Cell) -> Result<Self, CellError> {
        cell.validate(chain)?;
        let is_screen =
            |zone: &&KeepOutBox| cell.tracker.is_none_or(|stand| !zone.space.contains(&stand.position_in_base));
        Ok(Self {
            target: cell.target,
            tracker: cell.tracker,
            region: cell.region,
            bodies: cell.bodies.clone(),
            screens: cell.keep_out.iter().filter(is_screen).cloned().collect(),
            last_link: chain.dof(),
        })
    }

    /// Centre of the SMR in the base (m). `base_from_links` are all link frames with the flange at the end, as from
    /// [`base_from_links`](crate::kinematics::ForwardKinematics::base_from_links).
    pub fn point_in_base(&self, base_from_links: &[Isometry3<f64>]) -> Point3<f64> {
        base_from_links.last().copied().unwrap_or_default() * self.target.position_in_flange
    }

    /// Whether the SMR can be measured when the link frames stand like this.
    ///
    /// # Errors
    /// The first reason against it, in the order of [`Self::reasons`].
    pub fn check(&self, base_from_links: &[Isometry3<f64>]) -> Result<(), Hidden> {
        self.reasons(base_from_links).next().map_or(Ok(()), Err)
    }

    /// All reasons against measuring here: region, range, angle, beam. Each is looked for when it is asked for.
    pub fn reasons(&self, base_from_links: &[Isometry3<f64>]) -> impl Iterator<Item = Hidden> {
        let point = self.point_in_base(base_from_links);
        let outside = self.region.filter(|region| !region.contains(&point));
        let outside = outside.map(|_| Hidden::OutsideRegion { point });
        let stand = self.tracker;
        let range = move || stand.and_then(|stand| out_of_range(&stand, &point));
        let angle = move || stand.and_then(|stand| self.faces_away(&stand, &point, base_from_links));
        let beam = move || stand.and_then(|stand| self.blocked(&stand, point, base_from_links));
        outside
            .into_iter()
            .chain(std::iter::once_with(range).flatten())
            .chain(std::iter::once_with(angle).flatten())
            .chain(std::iter::once_with(beam).flatten())
    }

    fn faces_away(&self, stand: &TrackerStand, point: &Point3<f64>, links: &[Isometry3<f64>]) -> Option<Hidden> {
        let flange = links.last().copied().unwrap_or_default();
        let angle = (flange * self.target.axis_in_flange.into_inner()).angle(&(stand.position_in_base - point));
        let acceptance = stand.acceptance_angle;
        // A NaN faces away too.
        let is_seen = angle <= acceptance;
        (!is_seen).then_some(Hidden::FacesAway { angle, acceptance })
    }

    fn blocked(&self, stand: &TrackerStand, point: Point3<f64>, links: &[Isometry3<f64>]) -> Option<Hidden> {
        let beam = Segment { from: point, to: stand.position_in_base };
        let length = (beam.to - beam.from).norm();
        let shortened = if length > OWN_BODY {
            Segment { from: beam.from + (beam.to - beam.from) * (OWN_BODY / length), to: beam.to }
        } else {
            Segment { from: beam.to, to: beam.to }
        };
        for body in &self.bodies {
            let pose = links.get(body.link).copied().unwrap_or_default();
            let line = Segment { from: pose * body.from, to: pose * body.to };
            let seen = if body.link == self.last_link { &shortened } else { &beam };
            if line.distance_to(seen) < body.radius + BEAM_RADIUS {
                return Some(Hidden::BehindArm { part: Part::Link(body.link) });
            }
        }
        let screen = self.screens.iter().find(|zone| beam.distance_to_box(&zone.space) < BEAM_RADIUS);
        screen.map(|zone| Hidden::BehindBox { name: zone.name.clone() })
    }
}

fn out_of_range(stand: &TrackerStand, point: &Point3<f64>) -> Option<Hidden> {
    let distance = (stand.position_in_base - point).norm();
    let is_inside = distance >= stand.range.0 && distance <= stand.range.1;
    (!is_inside).then_some(Hidden::Range { distance, range: stand.range })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Unit, Vector3};

    use super::*;
    use crate::kinematics::{Convention, Joint, JointType, Link};
    use crate::units::DEGREE;

    /// One joint about the vertical, an arm of 0.5 m at a height of 1 m; the SMR looks outwards along x of the flange.
    fn chain() -> KinematicChain {
        let joint = Joint {
            name: "J1".to_owned(),
            joint_type: JointType::Revolute,
            link: Link { a: 0.5, d: 1.0, ..Link::default() },
            direction: 1.0,
            coupling: Vec::new(),
        };
        KinematicChain::new(Convention::Standard, Isometry3::identity(), vec![joint], Isometry3::identity()).unwrap()
    }

    fn cell() -> Cell {
        Cell {
            limits: vec![(-3.0, 3.0)],
            bodies: vec![Body { link: 1, from: Point3::origin(), to: Point3::new(-0.5, 0.0, 0.0), radius: 0.08 }],
            floor: Some(0.0),
            keep_out: Vec::new(),
            tracker: Some(TrackerStand {
                position_in_base: Point3::new(3.0, 0.0, 1.0),
                acceptance_angle: 30.0 * DEGREE,
                range: (1.0, 10.0),
            }),
            target: MountedTarget {
                position_in_flange: Point3::new(0.1, 0.0, 0.0),
                axis_in_flange: Unit::new_unchecked(Vector3::x()),
            },
            region: None,
        }
    }

    fn seen(cell: &Cell, q: f64) -> Result<(), Hidden> {
        let chain = chain();
        let arm = crate::kinematics::ForwardKinematics::new(&chain);
        Sight::new(&chain, cell).unwrap().check(&arm.base_from_links(&[q]))
    }

    #[test]
    fn the_smr_is_seen_when_it_looks_at_the_tracker() {
        assert_eq!(seen(&cell(), 0.0), Ok(()));
        // At 25° the SMR looks 31° past the tracker, which is 2.46 m ahead and 0.25 m aside.
        assert!(seen(&cell(), 24.0 * DEGREE).is_ok());
        assert!(matches!(seen(&cell(), 25.0 * DEGREE), Err(Hidden::FacesAway { .. })));
    }

    #[test]
    fn range_region_box_and_arm_hide_the_smr() {
        let mut near = cell();
        near.tracker = near.tracker.map(|stand| TrackerStand { range: (2.5, 10.0), ..stand });
        assert!(matches!(seen(&near, 0.0), Err(Hidden::Range { .. })));

        let mut region = cell();
        region.region = Some(super::super::BoxInBase { min: Point3::origin(), max: Point3::new(0.5, 1.0, 2.0) });
        assert!(matches!(seen(&region, 0.0), Err(Hidden::OutsideRegion { .. })));

        let screen = |x: f64| {
            let space = super::super::BoxInBase { min: Point3::new(x, -0.1, 0.5), max: Point3::new(x + 0.2, 0.1, 1.5) };
            let mut cell = cell();
            cell.keep_out.push(KeepOutBox { name: "pillar".to_owned(), space });
            cell
        };
        assert_eq!(seen(&screen(1.5), 0.0), Err(Hidden::BehindBox { name: "pillar".to_owned() }));
        // Around the tracker itself.
        assert_eq!(seen(&screen(2.9), 0.0), Ok(()));

        // The SMR on the far side of its own arm.
        let mut turned = cell();
        turned.target.position_in_flange = Point3::new(-0.7, 0.0, 0.0);
        assert_eq!(seen(&turned, 0.0), Err(Hidden::BehindArm { part: Part::Link(1) }));

        let mut blind = cell();
        blind.tracker = None;
        assert_eq!(seen(&blind, 2.0), Ok(()));
    }
}
