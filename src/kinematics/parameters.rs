//! Names of the kinematic parameters.

use std::fmt;

use super::{Convention, JointType, KinematicChain, Link};
use crate::units::Quantity;

/// One of the five constants of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LinkParameter {
    /// Twist α.
    Alpha,
    /// Length a.
    A,
    /// Offset d.
    D,
    /// Angle θ, the joint offset of a revolute joint.
    Theta,
    /// Hayati's β.
    Beta,
}

impl LinkParameter {
    /// All five, in the order of the paper's equation (19): α, a, d, θ, β.
    pub const ALL: [Self; 5] = [Self::Alpha, Self::A, Self::D, Self::Theta, Self::Beta];

    /// Length or angle.
    pub const fn quantity(self) -> Quantity {
        match self {
            Self::A | Self::D => Quantity::Length,
            Self::Alpha | Self::Theta | Self::Beta => Quantity::Angle,
        }
    }

    /// The constant that the joint variable adds to: the joint offset.
    pub const fn joint_offset(joint_type: JointType) -> Self {
        match joint_type {
            JointType::Revolute => Self::Theta,
            JointType::Prismatic => Self::D,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Alpha => "alpha",
            Self::A => "a",
            Self::D => "d",
            Self::Theta => "theta",
            Self::Beta => "beta",
        }
    }
}

/// One coordinate of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
    /// Third coordinate.
    Z,
}

impl Axis {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Index 0, 1 or 2.
    pub const fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// A parameter that identification may change. Joints and targets count from 0 inside and from 1 in the printed name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ParameterId {
    /// A constant of the link driven by joint `joint`.
    Link {
        /// Index of the joint, from 0.
        joint: usize,
        /// Which constant.
        parameter: LinkParameter,
    },
    /// A coordinate of target `target` in the flange frame.
    Target {
        /// Index of the target, from 0.
        target: usize,
        /// Which coordinate.
        axis: Axis,
    },
}

impl ParameterId {
    /// Length or angle.
    pub const fn quantity(self) -> Quantity {
        match self {
            Self::Link { parameter, .. } => parameter.quantity(),
            Self::Target { .. } => Quantity::Length,
        }
    }

    /// Whether this is the joint offset of its joint: what level-1 calibration identifies.
    pub fn is_joint_offset(self, chain: &KinematicChain) -> bool {
        match self {
            Self::Link { joint, parameter } => chain
                .joints()
                .get(joint)
                .is_some_and(|joint| parameter == LinkParameter::joint_offset(joint.joint_type)),
            Self::Target { .. } => false,
        }
    }
}

/// A parameter to identify, with the deviation one expects of it: the scale of the problem and the width of the prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeParameter {
    /// Which parameter.
    pub id: ParameterId,
    /// Expected deviation from nominal, one standard deviation (m) or (rad); positive.
    pub expected: f64,
}

/// `alpha1`, `d2`, `beta2`, `target1.x`.
impl fmt::Display for ParameterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link { joint, parameter } => write!(f, "{}{}", parameter.name(), joint + 1),
            Self::Target { target, axis } => write!(f, "target{}.{}", target + 1, axis.name()),
        }
    }
}

impl Link {
    /// A constant (m) or (rad).
    pub const fn value(&self, parameter: LinkParameter) -> f64 {
        match parameter {
            LinkParameter::Alpha => self.alpha,
            LinkParameter::A => self.a,
            LinkParameter::D => self.d,
            LinkParameter::Theta => self.theta,
            LinkParameter::Beta => self.beta,
        }
    }

    /// A constant (m) or (rad), to be changed.
    pub const fn value_mut(&mut self, parameter: LinkParameter) -> &mut f64 {
        match parameter {
            LinkParameter::Alpha => &mut self.alpha,
            LinkParameter::A => &mut self.a,
            LinkParameter::D => &mut self.d,
            LinkParameter::Theta => &mut self.theta,
            LinkParameter::Beta => &mut self.beta,
        }
    }
}

impl KinematicChain {
    /// Pairs of neighbouring joints whose axes are parallel or antiparallel at the nominal geometry, within `tolerance` (rad):
    /// index of the first joint of each pair. Between such axes the common normal is undefined and plain DH is singular.
    ///
    /// The angle between axes i and i+1 is fixed: it is α of link i (standard) or of link i+1 (modified), tilted by β.
    /// A prismatic axis is a direction only, so pairs with one are left out.
    pub fn parallel_axes(&self, tolerance: f64) -> Vec<usize> {
        (0..self.dof().saturating_sub(1))
            .filter(|&i| {
                let (first, second) = (&self.joints()[i], &self.joints()[i + 1]);
                let link = match self.convention() {
                    Convention::Standard => first.link,
                    Convention::Modified => second.link,
                };
                // z of the second frame seen from the first: Rot(x,α) Rot(y,β) z, whose third entry is cos α cos β.
                let cosine = link.alpha.cos() * link.beta.cos();
                let both_turn = first.joint_type == JointType::Revolute && second.joint_type == JointType::Revolute;
                both_turn && cosine.abs() > tolerance.cos()
            })
            .collect()
    }

    /// The joint whose link carries Hayati's β for the parallel pair that begins at joint `first` (see [`Self::parallel_axes`]).
    pub const fn beta_joint(&self, first: usize) -> usize {
        match self.convention() {
            Convention::Standard => first,
            Convention::Modified => first + 1,
        }
    }
}
