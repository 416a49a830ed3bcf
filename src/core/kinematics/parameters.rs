//! The kinematic parameters: their names, their units and what they mean.

use std::fmt;
use std::str::FromStr;

use super::{Convention, JointTerm, JointType, KinematicChain, KinematicsError, Link};
use crate::text::{self, names, written_as_text};
use crate::units::{DEGREE, MICRORADIAN, MILLIMETRE, Quantity};

/// A wrong name in a message is cut at this many columns.
const LONGEST_NAME: usize = 40;

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

    /// What it is, in words for people.
    const fn meaning(self) -> &'static str {
        match self {
            Self::Alpha => "twist about x",
            Self::A => "length along x",
            Self::D => "offset along z",
            Self::Theta => "angle about z",
            Self::Beta => "turn about y",
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
///
/// The name is the same wherever a parameter is written: in files, tables and messages. Reading it back gives the parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ParameterId {
    /// A constant of the link driven by joint `joint`.
    Link {
        /// Index of the joint, from 0.
        joint: usize,
        /// Which constant.
        parameter: LinkParameter,
    },
    /// A term of the error of joint `joint`.
    Joint {
        /// Index of the joint, from 0.
        joint: usize,
        /// Which term.
        term: JointTerm,
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
    /// Whether it belongs to the error of a joint, not to the geometry.
    pub const fn is_joint_error(self) -> bool {
        match self {
            Self::Joint { .. } => true,
            Self::Link { .. } | Self::Target { .. } => false,
        }
    }

    /// All parameters of an arm with this number of joints and targets.
    pub fn all(joints: usize, targets: usize) -> impl Iterator<Item = Self> {
        (0..joints).flat_map(Self::of_joint).chain((0..targets).flat_map(Self::of_target))
    }

    /// The parameters of one joint with its link.
    fn of_joint(joint: usize) -> impl Iterator<Item = Self> {
        LinkParameter::ALL.into_iter().map(move |parameter| Self::Link { joint, parameter })
    }

    /// The parameters of one target.
    pub fn of_target(target: usize) -> impl Iterator<Item = Self> {
        Axis::ALL.into_iter().map(move |axis| Self::Target { target, axis })
    }

    /// The unit that people read it in.
    pub const fn unit(self) -> ParameterUnit {
        match self {
            Self::Link { parameter, .. } => match parameter.quantity() {
                Quantity::Length => ParameterUnit::Millimetre,
                Quantity::Angle => ParameterUnit::Degree,
            },
            Self::Joint { .. } => ParameterUnit::Microradian,
            Self::Target { .. } => ParameterUnit::Millimetre,
        }
    }

    /// Index of the joint whose link it shapes; `None` for what sits on the flange.
    pub const fn joint(self) -> Option<usize> {
        match self {
            Self::Link { joint, .. } | Self::Joint { joint, .. } => Some(joint),
            Self::Target { .. } => None,
        }
    }

    /// Index of the target that it places; `None` for what belongs to the arm itself.
    pub const fn target(self) -> Option<usize> {
        match self {
            Self::Link { .. } | Self::Joint { .. } => None,
            Self::Target { target, .. } => Some(target),
        }
    }

    /// What it is, in words for people: `J3: twist about x`.
    pub fn meaning(self, chain: &KinematicChain) -> String {
        match self {
            Self::Link { joint, parameter } => {
                let what = parameter.meaning();
                match chain.joints().get(joint) {
                    Some(joint) => format!("{}: {what}", joint.name),
                    None => format!("link {}: {what}", joint + 1),
                }
            }
            Self::Joint { joint, term } => {
                let what = term.meaning();
                match chain.joints().get(joint) {
                    Some(joint) => format!("{}: {what}", joint.name),
                    None => format!("joint {}: {what}", joint + 1),
                }
            }
            Self::Target { target, axis } => format!("SMR {} on the flange, {}", target + 1, axis.name()),
        }
    }
}

/// `alpha1`, `d2`, `beta2`, `joint2.compliance`, `joint1.tilt_x`, `joint6.sin3`, `target1.x`.
impl fmt::Display for ParameterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Link { joint, parameter } => format!("{}{}", parameter.name(), joint + 1),
            Self::Joint { joint, term } => format!("joint{}.{term}", joint + 1),
            Self::Target { target, axis } => format!("target{}.{}", target + 1, axis.name()),
        };
        f.pad(&name)
    }
}

impl FromStr for ParameterId {
    type Err = KinematicsError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        if let Some(id) = joint_term(name) {
            return Ok(id);
        }
        let number: String = name.chars().filter(char::is_ascii_digit).collect();
        let index = number.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let mut candidates = index.into_iter().flat_map(|index| Self::of_joint(index).chain(Self::of_target(index)));
        candidates.find(|id| id.to_string() == name).ok_or_else(|| KinematicsError::ParameterName {
            name: text::shortened(&text::printable(name), LONGEST_NAME),
        })
    }
}

/// The term of a joint with this name, such as `joint6.sin3`.
fn joint_term(name: &str) -> Option<ParameterId> {
    let (number, term) = name.strip_prefix("joint")?.split_once('.')?;
    let joint = number.parse::<usize>().ok()?.checked_sub(1)?;
    let term = JointTerm::all().find(|known| known.to_string() == term)?;
    Some(ParameterId::Joint { joint, term }).filter(|id| id.to_string() == name)
}

/// The unit that people read a parameter in. Inside, lengths are in metres and angles in radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ParameterUnit {
    /// Of a length.
    Millimetre,
    /// Of an angle.
    Degree,
    /// Of a small angle.
    Microradian,
}

names!(ParameterUnit { Millimetre = "mm", Degree = "deg", Microradian = "urad", });
written_as_text!(ParameterId, ParameterUnit);

impl ParameterUnit {
    /// One of it in the unit of the inside ((m) or (rad)).
    pub const fn size(self) -> f64 {
        match self {
            Self::Millimetre => MILLIMETRE,
            Self::Degree => DEGREE,
            Self::Microradian => MICRORADIAN,
        }
    }

    /// The unit that the method paper has for it: mm or rad, in that of the inside. Condition numbers without scaling are in it.
    pub const fn of_the_paper(self) -> f64 {
        match self {
            Self::Millimetre => MILLIMETRE,
            Self::Degree | Self::Microradian => 1.0,
        }
    }

    /// A value of the inside in this unit.
    pub const fn to_edge(self, value: f64) -> f64 {
        value / self.size()
    }

    /// The value of the inside of a number in this unit.
    pub const fn from_edge(self, value: f64) -> f64 {
        value * self.size()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_read_back() {
        let ids: Vec<ParameterId> = ParameterId::all(12, 11).collect();
        assert!(ids.len() >= 12 * 5 + 11 * 3);
        for id in ids {
            assert_eq!(id.to_string().parse(), Ok(id));
            assert_eq!(ron::from_str::<ParameterId>(&ron::to_string(&id).unwrap()), Ok(id));
            assert_eq!(id.joint().is_some(), id.target().is_none());
        }
        for wrong in
            ["", "a", "a0", "a02", "+2", "a+2", "a2 ", "A2", "gamma1", "target1", "target0.x", "target1.w", "1a"]
        {
            assert!(wrong.parse::<ParameterId>().is_err(), "{wrong}");
        }
        let long = "x".repeat(1000).parse::<ParameterId>().unwrap_err().to_string();
        assert!(long.len() < 150, "{long}");
    }

    #[test]
    fn units_have_the_size_that_they_say() {
        for unit in ParameterUnit::ALL {
            assert_eq!(ron::from_str(&ron::to_string(unit).unwrap()), Ok(*unit));
            assert!((unit.to_edge(unit.from_edge(3.0)) - 3.0).abs() < 1e-15);
        }
        assert!("um".parse::<ParameterUnit>().is_err());
        for id in ParameterId::all(1, 1) {
            if let ParameterId::Link { parameter, .. } = id {
                assert_eq!(id.unit().name(), parameter.quantity().unit());
            }
        }
    }
}
