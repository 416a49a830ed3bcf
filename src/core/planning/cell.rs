//! The cell as planning sees it: plain values, filled in from the robot profile.

use nalgebra::{Point3, Unit, Vector3};
use thiserror::Error;

use crate::kinematics::KinematicChain;
use crate::units::{to_deg, to_mm};

/// A robot's surroundings, its shape and what it carries. Metres and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Lowest and highest pendant value of each joint in a plan (rad, sliding joints m).
    pub limits: Vec<(f64, f64)>,
    /// What encloses the links; none: nothing collides.
    pub bodies: Vec<Body>,
    /// Height of the floor, z in the base (m).
    pub floor: Option<f64>,
    /// Where no part of the arm may be and no beam passes.
    pub keep_out: Vec<KeepOutBox>,
    /// The tracker; `None`: a method without sight, and nothing to run into.
    pub tracker: Option<TrackerStand>,
    /// The SMR to plan for.
    pub target: MountedTarget,
    /// Where the SMR must be; `None`: anywhere.
    pub region: Option<BoxInBase>,
}

/// A capsule fixed to a link: all points within `radius` of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Link frame: 0 is the fixed base, i the frame after joint i (entry i of
    /// [`base_from_links`](crate::kinematics::ForwardKinematics::base_from_links)).
    pub link: usize,
    /// One end of the line in that frame (m).
    pub from: Point3<f64>,
    /// The other end (m).
    pub to: Point3<f64>,
    /// Distance from line to surface (m).
    pub radius: f64,
}

/// A box along the axes of the robot base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxInBase {
    /// Corner with the smallest coordinates (m).
    pub min: Point3<f64>,
    /// Corner with the largest coordinates (m).
    pub max: Point3<f64>,
}

impl BoxInBase {
    /// Whether a point of the base (m) is inside or on the surface.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        (0..3).all(|axis| (self.min[axis]..=self.max[axis]).contains(&point[axis]))
    }
}

/// A box that the arm must not enter.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOutBox {
    /// Name in messages.
    pub name: String,
    /// The space.
    pub space: BoxInBase,
}

/// Where the tracker stands and what it can see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerStand {
    /// Centre of the head, where the beam begins, in the robot base (m).
    pub position_in_base: Point3<f64>,
    /// Largest angle between beam and SMR axis (rad).
    pub acceptance_angle: f64,
    /// Nearest and farthest SMR (m).
    pub range: (f64, f64),
}

/// An SMR on the flange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedTarget {
    /// Centre in the flange frame (m).
    pub position_in_flange: Point3<f64>,
    /// Direction in which the SMR looks, in the flange frame.
    pub axis_in_flange: Unit<Vector3<f64>>,
}

/// A cell that cannot be planned in.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CellError {
    /// Not one pair of limits per joint.
    #[error("there are limits for {limits} joints, but the arm has {joints}")]
    LimitCount {
        /// Pairs given.
        limits: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// The lower limit is not below the upper one.
    #[error(
        "the limits of joint '{joint}' are crossed: {low} {unit} is not below {high} {unit}; give the lower limit first"
    )]
    LimitsCrossed {
        /// Name of the joint.
        joint: String,
        /// Lower limit at the edge.
        low: f64,
        /// Upper limit at the edge.
        high: f64,
        /// `deg` or `mm`.
        unit: &'static str,
    },
    /// A body on a link that the arm does not have.
    #[error("a body is fixed to link {link}, but the last link is {links}")]
    BodyLink {
        /// Link of the body.
        link: usize,
        /// Last link.
        links: usize,
    },
    /// A box without inside, or with a coordinate that is no number.
    #[error("the box '{name}' is empty: every coordinate of its upper corner must be above that of the lower one")]
    EmptyBox {
        /// Name of the box.
        name: String,
    },
    /// The tracker stands where the robot is.
    #[error(
        "the tracker at ({}, {}, {}) mm stands inside the robot: {body} would touch it in every pose; \
         correct its place (in mm, in the base frame of the robot)",
        tidy_mm(position.x), tidy_mm(position.y), tidy_mm(position.z)
    )]
    TrackerInsideRobot {
        /// Place of the tracker in the base (m).
        position: Point3<f64>,
        /// What it is inside of.
        body: String,
    },
    /// Range or acceptance of the tracker make no sense.
    #[error(
        "the tracker sees from {} mm to {} mm within {} deg: nothing can be measured with that",
        tidy_mm(range.0), tidy_mm(range.1), (to_deg(*acceptance_angle) * 1e3).round() / 1e3
    )]
    BlindTracker {
        /// Nearest and farthest SMR (m).
        range: (f64, f64),
        /// Acceptance (rad).
        acceptance_angle: f64,
    },
}

/// Millimetres to a thousandth.
fn tidy_mm(length: f64) -> f64 {
    (to_mm(length) * 1e3).round() / 1e3
}

impl Cell {
    /// Checks what can be seen without moving the arm.
    ///
    /// # Errors
    /// The first thing that makes no sense.
    pub(super) fn validate(&self, chain: &KinematicChain) -> Result<(), CellError> {
        if self.limits.len() != chain.dof() {
            return Err(CellError::LimitCount { limits: self.limits.len(), joints: chain.dof() });
        }
        for (joint, &(low, high)) in chain.joints().iter().zip(&self.limits) {
            // Not `low >= high`: a NaN is crossed too.
            if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
                let quantity = joint.joint_type.quantity();
                let [low, high] = [low, high].map(|limit| (quantity.to_edge(limit) * 1e6).round() / 1e6);
                return Err(CellError::LimitsCrossed { joint: joint.name.clone(), low, high, unit: quantity.unit() });
            }
        }
        if let Some(body) = self.bodies.iter().find(|body| body.link > chain.dof()) {
            return Err(CellError::BodyLink { link: body.link, links: chain.dof() });
        }
        let boxes = self.keep_out.iter().map(|zone| (zone.name.as_str(), &zone.space));
        for (name, space) in boxes.chain(self.region.iter().map(|region| ("region", region))) {
            if !(0..3).all(|axis| space.min[axis] < space.max[axis]) {
                return Err(CellError::EmptyBox { name: name.to_owned() });
            }
        }
        if let Some(TrackerStand { range, acceptance_angle, .. }) = self.tracker
            && !(range.0 < range.1 && range.1 > 0.0 && acceptance_angle > 0.0)
        {
            return Err(CellError::BlindTracker { range, acceptance_angle });
        }
        Ok(())
    }
}
