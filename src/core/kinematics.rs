//! Kinematics of serial arms: link constants, forward kinematics and the Jacobians of identification.
//!
//! Units are metre and radian. A *configuration* `q` is the pendant joint vector; the kinematic joint variables follow from
//! it by direction and coupling ([`Joint::variable`]). Transforms are named so that products cancel:
//! `base_from_flange = base_from_link1 · link1_from_link2 · …`.
//!
//! This module reads no files, knows no tracker, and estimates nothing.
//!
//! An arm of two links whose second link is 1 mm longer than drawn:
//!
//! ```
//! use nalgebra::{Isometry3, Point3};
//! use trupose_core::kinematics::{Arm, Convention, Joint, JointType, KinematicChain, Link, Place};
//!
//! let joint = |name: &str| Joint {
//!     name: name.to_owned(),
//!     joint_type: JointType::Revolute,
//!     link: Link { a: 0.5, ..Link::default() },
//!     direction: 1.0,
//!     coupling: Vec::new(),
//! };
//! let fixed = Isometry3::identity();
//! let chain = KinematicChain::new(Convention::Standard, fixed, vec![joint("J1"), joint("J2")], fixed)?;
//! let nominal = Arm { chain, targets: vec![Point3::origin()] };
//! let real = nominal.with([("a2".parse()?, 1e-3)])?;
//! let place = Place { configuration: vec![0.0, 0.0], target: 0 };
//! assert!((real.point_in_base(&place).x - 1.001).abs() < 1e-12);
//! # Ok::<(), trupose_core::kinematics::KinematicsError>(())
//! ```

#![warn(missing_docs)]
#![warn(clippy::wildcard_enum_match_arm)]

mod arm;
mod chain;
mod coverage;
mod forward;
mod jacobian;
mod joint_error;
mod loads;
mod parameters;

use thiserror::Error;

pub use arm::{Arm, Place, PreparedArm};
pub use chain::{Convention, Joint, JointType, KinematicChain, Link};
pub use coverage::{Gap, JointCoverage, coverage};
pub use forward::ForwardKinematics;
pub use jacobian::{ConfigurationJacobian, IdentificationJacobian};
pub use joint_error::{JointError, JointTerm, MAX_ORDER, SMOOTH_ORDERS, TiltAxis, curve_share};
pub use loads::{GRAVITY, JointLoad, LinkMass, LoadScale, Loads};
pub use parameters::{Axis, FreeParameter, LinkParameter, ParameterId, ParameterUnit};

/// A geometry that cannot be built, or a parameter that does not exist.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum KinematicsError {
    /// A chain needs at least one joint.
    #[error("a kinematic chain needs at least one joint")]
    NoJoints,
    /// A link constant or coupling coefficient is NaN or infinite.
    #[error("joint '{joint}' has a number that is not finite")]
    NotFinite {
        /// Name of the joint.
        joint: String,
    },
    /// A direction other than +1 or −1.
    #[error("joint '{joint}' has direction {direction}; +1 or -1 is allowed")]
    Direction {
        /// Name of the joint.
        joint: String,
        /// The direction given.
        direction: f64,
    },
    /// A coupling row that does not have one entry per joint.
    #[error("the coupling row of joint '{joint}' has {entries} entries; the arm has {joints} joints")]
    Coupling {
        /// Name of the joint.
        joint: String,
        /// Entries given.
        entries: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// A parameter that the arm does not have.
    #[error("the arm has no parameter '{parameter}'")]
    UnknownParameter {
        /// Name of the parameter.
        parameter: String,
    },
    /// A text that is not the name of a parameter.
    #[error("'{name}' is not a parameter; names read like 'a2', 'theta3' or 'target1.x'")]
    ParameterName {
        /// The text.
        name: String,
    },
}
