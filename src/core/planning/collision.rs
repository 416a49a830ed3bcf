//! Whether the arm can stand in a configuration, and move from one to another, without touching anything.
//!
//! Arm, SMR and tracker are capsules, keep-out volumes are boxes along the base axes, the floor is a plane. Their distances
//! have closed forms of a few lines ([`Segment`]), so they are written here: parry3d-f64 0.31 has them too, and more of it
//! than is needed, but it computes with glam (a second linear algebra beside nalgebra), takes box against capsule
//! through an iterative GJK, and brings some twenty packages, among them two versions of hashbrown.
//!
//! **Which pairs of bodies count.** Not: bodies of one link or of neighbouring links (their joint holds them together), and
//! bodies that touch in *every* one of [`BUILD_SAMPLES`] configurations spread over the joint limits (that is how
//! the arm is built, not how it stands). A pair that comes little further apart in all of them keeps half of that as
//! clearance. Bodies of link 0 cannot move and are not checked against floor and boxes.
//! A pair that touches in the home pose only is an obstruction like any other: the home pose is then a bad one.
//!
//! **Moves** are straight lines in joint space. Between two checked points no body can come nearer to anything than the
//! steps allow: see [`ArmShape::check_move`].

mod distance;
mod motion;

use std::fmt;

use nalgebra::{Isometry3, Point3};
use thiserror::Error;

pub use distance::Segment;

use super::{Cell, CellError, KeepOutBox};
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::units::MILLIMETRE;
use motion::Reach;

/// Radius of the ball of an SMR with its nest (m): half of 1.5 inch, and a little.
pub const SMR_RADIUS: f64 = 20.0 * MILLIMETRE;

/// Radius that a tracker on its stand takes up (m), with room for the hand that adjusts it.
pub const TRACKER_RADIUS: f64 = 250.0 * MILLIMETRE;

/// Least gap that is left everywhere unless asked otherwise (m): capsules are sketches of castings, without cables and hoses.
pub const DEFAULT_CLEARANCE: f64 = 10.0 * MILLIMETRE;

/// Configurations that decide whether two bodies touch by construction.
pub const BUILD_SAMPLES: u32 = 64;

/// A part of the arm in messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// A body of this link; 0 is the fixed base.
    Link(usize),
    /// The SMR on the flange.
    Target,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(0) => f.write_str("the base"),
            Self::Link(link) => write!(f, "link {link}"),
            Self::Target => f.write_str("the SMR"),
        }
    }
}

/// What is in the way of the arm.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Obstruction {
    /// Two parts of the arm.
    #[error("{first} and {second} of the arm would collide")]
    Arm {
        /// The one nearer to the base.
        first: Part,
        /// The other one.
        second: Part,
    },
    /// The floor.
    #[error("{part} would touch the floor")]
    Floor {
        /// What touches it.
        part: Part,
    },
    /// A keep-out box.
    #[error("{part} would enter the keep-out box '{name}'")]
    KeepOut {
        /// What enters it.
        part: Part,
        /// Name of the box.
        name: String,
    },
    /// The tracker.
    #[error("{part} would hit the tracker")]
    Tracker {
        /// What hits it.
        part: Part,
    },
}

/// A capsule of the arm.
#[derive(Clone, Copy, Debug)]
struct Solid {
    part: Part,
    link: usize,
    line: Segment,
    radius: f64,
}

/// Two things that must not touch.
#[derive(Clone, Copy, Debug)]
enum Contact {
    /// Places of two solids, the one nearer to the base first.
    Arm(usize, usize),
    /// Place of a solid.
    Floor(usize),
    /// Place of a solid, place of a box.
    KeepOut(usize, usize),
    /// Place of a solid.
    Tracker(usize),
}

/// The arm with everything that it must not touch.
#[derive(Clone, Debug)]
pub struct ArmShape<'a> {
    arm: ForwardKinematics<'a>,
    limits: Vec<(f64, f64)>,
    solids: Vec<Solid>,
    floor: Option<f64>,
    keep_out: Vec<KeepOutBox>,
    tracker: Option<Segment>,
    contacts: Vec<Contact>,
    /// Least gap of each contact (m), parallel to `contacts`.
    clearances: Vec<f64>,
    reach: Reach,
    /// Whether joint frames replace bodies that nobody has stated.
    is_skeleton: bool,
}

impl<'a> ArmShape<'a> {
    /// The arm `chain` in `cell`, which must stay `clearance` (m) away from everything.
    ///
    /// The SMR counts as a part of the arm. The tracker stands upright on the floor, or is a ball if there is none. An arm without
    /// bodies is a skeleton of its joint frames, which is checked against the floor, the boxes and the tracker only.
    ///
    /// # Errors
    /// A cell that makes no sense, or a tracker that some part touches wherever the arm is.
    pub fn new(chain: &'a KinematicChain, cell: &Cell, clearance: f64) -> Result<Self, CellError> {
        cell.validate(chain)?;
        let solids = solids(chain, cell);
        let tracker = cell.tracker.map(|stand| {
            let head = stand.position_in_base;
            let foot = cell.floor.map_or(head.z, |floor| floor.min(head.z));
            Segment { from: Point3::new(head.x, head.y, foot), to: head }
        });
        let reach = Reach::new(chain, &cell.limits, &solids);
        let mut shape = Self {
            arm: ForwardKinematics::new(chain),
            limits: cell.limits.clone(),
            solids,
            floor: cell.floor,
            keep_out: cell.keep_out.clone(),
            tracker,
            contacts: Vec::new(),
            clearances: Vec::new(),
            reach,
            is_skeleton: cell.bodies.is_empty(),
        };
        shape.contacts = shape.all_contacts();
        let widest = shape.widest_gaps();
        let inside = |(contact, gap): (&Contact, &f64)| match contact {
            Contact::Tracker(index) if *gap < clearance => shape.solids.get(*index).map(|solid| solid.part),
            _ => None,
        };
        let inside = shape.contacts.iter().zip(&widest).find_map(inside);
        if let (Some(stand), Some(body)) = (cell.tracker, inside) {
            return Err(CellError::TrackerInsideRobot { position: stand.position_in_base, body: body.to_string() });
        }
        shape.leave_out_build_contacts(&widest, clearance);
        Ok(shape)
    }

    /// Forward kinematics of the arm.
    pub const fn arm(&self) -> &ForwardKinematics<'a> {
        &self.arm
    }

    /// Lowest and highest pendant value of each joint (rad, sliding joints m).
    pub fn limits(&self) -> &[(f64, f64)] {
        &self.limits
    }

    /// Whether a configuration is inside the limits and not NaN.
    pub fn is_within_limits(&self, q: &[f64]) -> bool {
        q.len() == self.limits.len() && q.iter().zip(&self.limits).all(|(q, (low, high))| (low..=high).contains(&q))
    }

    /// Whether the arm can stand in `q` (rad, sliding joints m).
    ///
    /// # Errors
    /// The worst obstruction: the one that is touched most.
    pub fn check(&self, q: &[f64]) -> Result<(), Obstruction> {
        let lines = self.lines(q);
        let worst = self.too_near(&lines).min_by(|(_, a), (_, b)| a.total_cmp(b));
        worst.map_or(Ok(()), |(contact, _)| Err(self.obstruction(contact)))
    }

    /// Everything that is in the way in `q`, nearest to the base first.
    pub fn obstructions(&self, q: &[f64]) -> Vec<Obstruction> {
        let mut obstructions = Vec::new();
        self.for_each_obstruction(&self.arm.base_from_links(q), |obstruction| obstructions.push(obstruction));
        obstructions
    }

    /// As [`Self::obstructions`], with the link frames at hand.
    pub(super) fn for_each_obstruction(&self, base_from_links: &[Isometry3<f64>], mut found: impl FnMut(Obstruction)) {
        let lines = self.lines_at(base_from_links);
        for (contact, _) in self.too_near(&lines) {
            found(self.obstruction(contact));
        }
    }

    /// The smallest gap anywhere in `q` (m), negative for an overlap; infinite when there is nothing to touch.
    pub fn gap(&self, q: &[f64]) -> f64 {
        let lines = self.lines(q);
        self.gaps(&lines).map(|(_, gap)| gap).fold(f64::INFINITY, f64::min)
    }

    /// The capsules of the arm in `q`, in the base: part, line and radius (m).
    pub fn placed(&self, q: &[f64]) -> Vec<(Part, Segment, f64)> {
        self.solids.iter().zip(self.lines(q)).map(|(solid, line)| (solid.part, line, solid.radius)).collect()
    }

    /// Pairs of parts that can collide at all; see the module for the others.
    pub fn checked_pairs(&self) -> impl Iterator<Item = (Part, Part)> {
        self.contacts.iter().filter_map(|contact| match *contact {
            Contact::Arm(first, second) => Some((self.solids.get(first)?.part, self.solids.get(second)?.part)),
            _ => None,
        })
    }

    /// Contacts whose gap is less than their clearance. A NaN is too near.
    fn too_near(&self, lines: &[Segment]) -> impl Iterator<Item = (Contact, f64)> {
        let gaps = self.gaps(lines).zip(&self.clearances);
        gaps.filter(|((_, gap), clearance)| gap.is_nan() || *gap < **clearance).map(|(gap, _)| gap)
    }

    /// Lines of the capsules in the base.
    fn lines(&self, q: &[f64]) -> Vec<Segment> {
        let poses = self.arm.base_from_links(q);
        self.lines_at(&poses)
    }

    fn lines_at(&self, base_from_links: &[Isometry3<f64>]) -> Vec<Segment> {
        let placed = |solid: &Solid| {
            let pose = base_from_links.get(solid.link).copied().unwrap_or_default();
            Segment { from: pose * solid.line.from, to: pose * solid.line.to }
        };
        self.solids.iter().map(placed).collect()
    }

    fn gaps(&self, lines: &[Segment]) -> impl Iterator<Item = (Contact, f64)> {
        self.contacts.iter().map(|&contact| (contact, self.contact_gap(contact, lines)))
    }

    /// Distance between the surfaces of a contact (m). Places come from this shape, so all of them exist.
    fn contact_gap(&self, contact: Contact, lines: &[Segment]) -> f64 {
        let solid = |index: usize| lines.get(index).zip(self.solids.get(index).map(|solid| solid.radius));
        let gap = match contact {
            Contact::Arm(first, second) => solid(first)
                .zip(solid(second))
                .map(|((one, r_one), (other, r_other))| one.distance_to(other) - r_one - r_other),
            Contact::Floor(index) => {
                solid(index).zip(self.floor).map(|((line, radius), floor)| line.from.z.min(line.to.z) - radius - floor)
            }
            Contact::KeepOut(index, zone) => solid(index)
                .zip(self.keep_out.get(zone))
                .map(|((line, radius), zone)| line.distance_to_box(&zone.space) - radius),
            Contact::Tracker(index) => solid(index)
                .zip(self.tracker)
                .map(|((line, radius), tracker)| line.distance_to(&tracker) - radius - TRACKER_RADIUS),
        };
        gap.unwrap_or(f64::INFINITY)
    }

    fn obstruction(&self, contact: Contact) -> Obstruction {
        let part = |index: usize| self.solids.get(index).map_or(Part::Link(0), |solid| solid.part);
        match contact {
            Contact::Arm(first, second) => Obstruction::Arm { first: part(first), second: part(second) },
            Contact::Floor(index) => Obstruction::Floor { part: part(index) },
            Contact::KeepOut(index, zone) => Obstruction::KeepOut {
                part: part(index),
                name: self.keep_out.get(zone).map(|zone| zone.name.clone()).unwrap_or_default(),
            },
            Contact::Tracker(index) => Obstruction::Tracker { part: part(index) },
        }
    }

    fn all_contacts(&self) -> Vec<Contact> {
        let mut contacts = Vec::new();
        let is_checked = |one: &Solid, other: &Solid| !self.is_skeleton && one.link + 1 < other.link;
        for (first, one) in self.solids.iter().enumerate() {
            for (second, other) in self.solids.iter().enumerate() {
                if is_checked(one, other) {
                    contacts.push(Contact::Arm(first, second));
                }
            }
        }
        for (index, solid) in self.solids.iter().enumerate() {
            if solid.link > 0 {
                contacts.extend(self.floor.map(|_| Contact::Floor(index)));
                contacts.extend((0..self.keep_out.len()).map(|zone| Contact::KeepOut(index, zone)));
            }
            contacts.extend(self.tracker.map(|_| Contact::Tracker(index)));
        }
        contacts
    }

    /// The widest gap (m) that each contact has in [`BUILD_SAMPLES`] configurations.
    fn widest_gaps(&self) -> Vec<f64> {
        let mut widest = vec![f64::NEG_INFINITY; self.contacts.len()];
        for q in self.build_samples() {
            let lines = self.lines(&q);
            for (widest, (_, gap)) in widest.iter_mut().zip(self.gaps(&lines)) {
                *widest = widest.max(gap);
            }
        }
        widest
    }

    /// Forgets pairs of bodies that touch wherever the arm stands, and sets the clearance of the others.
    fn leave_out_build_contacts(&mut self, widest: &[f64], clearance: f64) {
        let contacts = std::mem::take(&mut self.contacts);
        for (contact, &widest) in contacts.into_iter().zip(widest) {
            match contact {
                Contact::Arm(..) if widest < motion::SHORTEST_STEP => continue,
                // The lowest joints of a skeleton may be below the floor wherever the arm is.
                _ if self.is_skeleton && widest < clearance => continue,
                Contact::Arm(..) => self.clearances.push(clearance.min(widest / 2.0)),
                _ => self.clearances.push(clearance),
            }
            self.contacts.push(contact);
        }
    }

    /// Configurations spread evenly over the limits: the additive recurrence of Roberts (2018, "The unreasonable
    /// effectiveness of quasirandom sequences"), step `1/φ^i` with `φ^(n+1) = φ + 1`.
    fn build_samples(&self) -> impl Iterator<Item = Vec<f64>> {
        let joints = self.limits.len();
        let exponent = 1.0 / (joints as f64 + 1.0);
        let golden = (0..40).fold(2.0_f64, |phi, _| (1.0 + phi).powf(exponent));
        (1..=BUILD_SAMPLES).map(move |sample| {
            let mut step = 1.0;
            let place = |&(low, high): &(f64, f64)| {
                step /= golden;
                low + (high - low) * (0.5 + step * f64::from(sample)).fract()
            };
            self.limits.iter().map(place).collect()
        })
    }
}

/// Bodies, or the joint frames if there are none, and the SMR, in link frames.
fn solids(chain: &KinematicChain, cell: &Cell) -> Vec<Solid> {
    let body = |body: &super::Body| Solid {
        part: Part::Link(body.link),
        link: body.link,
        line: Segment { from: body.from, to: body.to },
        radius: body.radius,
    };
    let mut solids: Vec<Solid> = cell.bodies.iter().map(body).collect();
    if solids.is_empty() {
        solids = skeleton(chain);
    }
    let line = Segment { from: chain.flange() * Point3::origin(), to: chain.flange() * cell.target.position_in_flange };
    solids.push(Solid { part: Part::Target, link: chain.dof(), line, radius: SMR_RADIUS });
    solids
}

/// A point at every joint frame but the first, which is part of the base. Links lie between two of them, so that an elbow below
/// the floor is seen.
fn skeleton(chain: &KinematicChain) -> Vec<Solid> {
    let origin = Segment { from: Point3::origin(), to: Point3::origin() };
    (2..=chain.dof()).map(|link| Solid { part: Part::Link(link), link, line: origin, radius: 0.0 }).collect()
}
