//! Kinematics of serial arms: link constants, forward kinematics and the Jacobians of identification.
//!
//! Units are metre and radian. A *configuration* `q` is the pendant joint vector; the kinematic joint variables follow from
//! it by direction and coupling ([`Joint::variable`]). Transforms are named so that products cancel:
//! `base_from_flange = base_from_link1 · link1_from_link2 · …`.
//!
//! This module does not read files, does not know a tracker, and never estimates anything.

#![warn(missing_docs)]

mod arm;
mod chain;
mod forward;
mod jacobian;
mod parameters;

use thiserror::Error;

pub use arm::{Arm, Place, PreparedArm};
pub use chain::{Convention, Joint, JointType, KinematicChain, Link};
pub use forward::ForwardKinematics;
pub use jacobian::{ConfigurationJacobian, IdentificationJacobian};
pub use parameters::{Axis, FreeParameter, LinkParameter, ParameterId, ParameterUnit};

/// Misuse of a chain: a geometry that cannot be built.
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
        /// What was given.
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
    /// A parameter that the chain does not have.
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
