//! The geometry of a serial arm: links, joints, couplings and the two fixed frames around them.

use std::sync::Arc;

use clap::ValueEnum;
use nalgebra::Isometry3;

use super::{JointError, KinematicsError, Loads};
use crate::units::Quantity;

/// Order of the elementary transforms of a link, with β as Hayati added it. The comments on the values are the help of
/// `--convention`.
///
/// - standard: `Rot(z,θ) Trans(z,d) Trans(x,a) Rot(x,α) Rot(y,β)`, equations (1)–(3) of the method paper.
/// - modified: `Rot(x,α) Trans(x,a) Rot(y,β) Rot(z,θ) Trans(z,d)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Convention {
    /// Denavit and Hartenberg: theta, d, a, alpha
    #[default]
    Standard,
    /// Craig: alpha, a, theta, d
    Modified,
}

/// Whether a joint turns or slides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointType {
    /// The joint variable adds to θ (rad).
    Revolute,
    /// The joint variable adds to d (m).
    Prismatic,
}

impl JointType {
    /// Length for a prismatic joint, angle for a revolute one.
    pub const fn quantity(self) -> Quantity {
        match self {
            Self::Revolute => Quantity::Angle,
            Self::Prismatic => Quantity::Length,
        }
    }
}

/// Constants of one link. Angles in radians, lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    /// Twist about x (rad).
    pub alpha: f64,
    /// Length along x (m).
    pub a: f64,
    /// Offset along z (m); for a prismatic joint the value at joint zero.
    pub d: f64,
    /// Angle about z (rad); for a revolute joint the value at joint zero (joint offset).
    pub theta: f64,
    /// Hayati's rotation about y (rad), for an axis (nearly) parallel to its neighbour.
    pub beta: f64,
}

/// One joint of an arm with the link it drives.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name on the pendant, such as `J1` or `A1`.
    pub name: String,
    /// Turning or sliding.
    pub joint_type: JointType,
    /// Link constants.
    pub link: Link,
    /// `+1` or `−1`: sense of the pendant value about the link's z axis.
    pub direction: f64,
    /// Coupling row, one entry per joint of the arm: this joint's kinematic value is its own pendant value plus the sum of
    /// `coupling[j]` times the pendant value of joint `j`. Empty for an uncoupled joint.
    pub coupling: Vec<f64>,
}

impl Joint {
    /// Kinematic joint variable `direction · (q_i + Σ_j coupling_j q_j)` at the pendant configuration `q` ((rad) or (m)).
    pub fn variable(&self, index: usize, q: &[f64]) -> f64 {
        let coupled: f64 = self.coupling.iter().zip(q).map(|(c, q_j)| c * q_j).sum();
        self.direction * (q[index] + coupled)
    }

    /// Change of the kinematic joint variable of joint `index` (this one) per change of pendant value `j`.
    pub fn variable_by_pendant(&self, index: usize, j: usize) -> f64 {
        let own = if index == j { 1.0 } else { 0.0 };
        self.direction * (own + self.coupling.get(j).copied().unwrap_or(0.0))
    }
}

/// A serial arm: `base_from_flange(q) = base · A_1(q) … A_N(q) · flange`.
#[derive(Clone, Debug, PartialEq)]
pub struct KinematicChain {
    convention: Convention,
    base: Isometry3<f64>,
    joints: Vec<Joint>,
    flange: Isometry3<f64>,
    /// One per joint.
    errors: Vec<JointError>,
    loads: Option<Arc<Loads>>,
}

impl KinematicChain {
    /// A chain from its parts. `base` is the pose of the first link frame in the robot base, `flange` the pose of the
    /// flange in the last link frame; both are fixed and never identified.
    ///
    /// # Errors
    /// No joint, a number that is not finite, a direction other than ±1, or a coupling row of the wrong length.
    pub fn new(
        convention: Convention,
        base: Isometry3<f64>,
        joints: Vec<Joint>,
        flange: Isometry3<f64>,
    ) -> Result<Self, KinematicsError> {
        if joints.is_empty() {
            return Err(KinematicsError::NoJoints);
        }
        let n = joints.len();
        for joint in &joints {
            let Link { alpha, a, d, theta, beta } = joint.link;
            let finite = [alpha, a, d, theta, beta].iter().chain(&joint.coupling).all(|value| value.is_finite());
            if !finite {
                return Err(KinematicsError::NotFinite { joint: joint.name.clone() });
            }
            if joint.direction.abs().to_bits() != 1.0_f64.to_bits() {
                return Err(KinematicsError::Direction { joint: joint.name.clone(), direction: joint.direction });
            }
            if !joint.coupling.is_empty() && joint.coupling.len() != n {
                return Err(KinematicsError::Coupling {
                    joint: joint.name.clone(),
                    entries: joint.coupling.len(),
                    joints: n,
                });
            }
        }
        let errors = vec![JointError::default(); n];
        Ok(Self { convention, base, joints, flange, errors, loads: None })
    }

    /// Order of the elementary transforms.
    pub const fn convention(&self) -> Convention {
        self.convention
    }

    /// Pose of the first link frame in the robot base.
    pub const fn base(&self) -> &Isometry3<f64> {
        &self.base
    }

    /// Pose of the flange in the last link frame.
    pub const fn flange(&self) -> &Isometry3<f64> {
        &self.flange
    }

    /// The joints from base to flange.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Length of the arm stretched out (m): no point of it is much farther from its base.
    pub fn length(&self) -> f64 {
        self.joints.iter().map(|joint| joint.link.a.abs() + joint.link.d.abs()).sum()
    }

    /// What each joint does besides turning by its value.
    pub fn errors(&self) -> &[JointError] {
        &self.errors
    }

    /// Whether gravity bends the arm: a joint has compliance or tilt.
    pub fn is_loaded(&self) -> bool {
        self.errors.iter().any(JointError::is_loaded)
    }

    /// Gravity on the joints, where the masses of the links are known.
    pub fn loads(&self) -> Option<&Loads> {
        self.loads.as_deref()
    }

    /// The geometry alone.
    #[must_use]
    pub fn without_errors(&self) -> Self {
        Self { errors: vec![JointError::default(); self.dof()], loads: None, ..self.clone() }
    }

    pub(super) fn loaded(self, loads: Option<Arc<Loads>>) -> Self {
        Self { loads, ..self }
    }

    pub(super) fn error_mut(&mut self, joint: usize) -> Option<&mut JointError> {
        self.errors.get_mut(joint)
    }

    /// The link driven by a joint, to change its constants.
    pub(super) fn link_mut(&mut self, joint: usize) -> Option<&mut Link> {
        self.joints.get_mut(joint).map(|joint| &mut joint.link)
    }
}
