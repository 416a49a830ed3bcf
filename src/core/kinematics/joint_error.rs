//! What a joint does besides turning by its value: small rotations before its own, each a coefficient times a fixed function φ of
//! the configuration.
//!
//! Gears, encoders and bearings belong to a joint, so these errors hold in the whole workspace. φ is computed with the *nominal*
//! geometry and masses, so it does not change while the geometry is identified.

use std::fmt;

use nalgebra::Vector3;

use super::chain::JointType;
use super::loads::{JointLoad, NO_TORQUE};
use super::{Axis, KinematicChain};
use crate::units::MILLIRADIAN;

/// Highest order of a harmonic: a term's order fits every table.
pub const MAX_ORDER: u8 = 50;
/// Harmonics up to this order have a prior of their own; a joint curve begins above.
pub const SMOOTH_ORDERS: u8 = 2;

/// A term of the error of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JointTerm {
    /// About the joint's axis, in proportion to the gravity torque about it: the angle (rad) at the largest such torque.
    Compliance,
    /// Tilt of the bearing about the x or y axis of the joint, in proportion to the gravity moment about it: the angle (rad) at the
    /// largest moment of the arm.
    Tilt(TiltAxis),
    /// About the joint's axis: amplitude (rad) of `sin(h q)`, with the pendant value q of the joint.
    Sine(u8),
    /// About the joint's axis: amplitude (rad) of `cos(h q)`.
    Cosine(u8),
}

/// Axis of a tilt: across the joint's own axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TiltAxis {
    /// Across, first axis.
    X,
    /// Across, second axis.
    Y,
}

impl JointTerm {
    /// All terms of one joint.
    pub fn all() -> impl Iterator<Item = Self> {
        let tilts = TiltAxis::ALL.into_iter().map(Self::Tilt);
        let harmonics = (1..=MAX_ORDER).flat_map(|order| [Self::Sine(order), Self::Cosine(order)]);
        std::iter::once(Self::Compliance).chain(tilts).chain(harmonics)
    }

    /// What it is, in words for people.
    pub(super) fn meaning(self) -> String {
        match self {
            Self::Compliance => "turn at its largest gravity torque".to_owned(),
            Self::Tilt(axis) => {
                let axis = if axis == TiltAxis::X { "x" } else { "y" };
                format!("tilt about {axis} at the largest gravity moment")
            }
            Self::Sine(order) => format!("angle error, sine of {order} cycles per turn"),
            Self::Cosine(order) => format!("angle error, cosine of {order} cycles per turn"),
        }
    }
}

impl TiltAxis {
    /// Both, in order.
    pub const ALL: [Self; 2] = [Self::X, Self::Y];

    pub(super) const fn index(self) -> usize {
        match self {
            Self::X => Axis::X.index(),
            Self::Y => Axis::Y.index(),
        }
    }
}

impl JointTerm {
    /// Standard deviation of the zero-mean prior (rad): what joints of industrial arms show.
    pub fn expected(self) -> f64 {
        match self {
            Self::Compliance => MILLIRADIAN,
            Self::Tilt(_) => 0.2 * MILLIRADIAN,
            Self::Sine(order) | Self::Cosine(order) if order <= SMOOTH_ORDERS => 0.3 * MILLIRADIAN,
            Self::Sine(order) | Self::Cosine(order) => curve_share(order),
        }
    }
}

/// Standard deviation of a harmonic above [`SMOOTH_ORDERS`] of a joint curve whose rms is one radian: the spectrum of a periodic squared
/// exponential of length ℓ, in which order h has the variance `I_h(1/ℓ²)`.
pub fn curve_share(order: u8) -> f64 {
    // Ratios I_(h+1)/I_h downwards by their continued fraction; only relative sizes count.
    const LENGTH: f64 = 0.06;
    let x = 1.0 / (LENGTH * LENGTH);
    let orders = usize::from(MAX_ORDER);
    let mut ratio = 0.0;
    let mut ratios = vec![0.0; orders + 1];
    for h in (0..orders + 200).rev() {
        ratio = 1.0 / (2.0 * (h as f64 + 1.0) / x + ratio);
        if h <= orders {
            ratios[h] = ratio;
        }
    }
    let mut variance = 1.0;
    let mut variances = vec![0.0; orders + 1];
    for h in 1..=orders {
        variance *= ratios[h - 1];
        variances[h] = variance;
    }
    let total: f64 = variances[usize::from(SMOOTH_ORDERS) + 1..].iter().sum();
    variances.get(usize::from(order)).map_or(0.0, |variance| (variance / total).sqrt())
}

/// `compliance`, `tilt_x`, `sin3`, `cos3`.
impl fmt::Display for JointTerm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Compliance => f.write_str("compliance"),
            Self::Tilt(TiltAxis::X) => f.write_str("tilt_x"),
            Self::Tilt(TiltAxis::Y) => f.write_str("tilt_y"),
            Self::Sine(order) => write!(f, "sin{order}"),
            Self::Cosine(order) => write!(f, "cos{order}"),
        }
    }
}

/// The errors of one joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointError {
    compliance: f64,
    tilt: [f64; 2],
    sine: Vec<f64>,
    cosine: Vec<f64>,
}

impl JointError {
    /// The coefficient of a term (rad).
    pub fn value(&self, term: JointTerm) -> f64 {
        match term {
            JointTerm::Compliance => self.compliance,
            JointTerm::Tilt(axis) => self.tilt[axis.index()],
            JointTerm::Sine(order) => of_order(&self.sine, order),
            JointTerm::Cosine(order) => of_order(&self.cosine, order),
        }
    }

    /// The coefficient of a term (rad), to be changed; `None` for an order outside 1 … [`MAX_ORDER`].
    pub fn value_mut(&mut self, term: JointTerm) -> Option<&mut f64> {
        let harmonic = |values: &mut Vec<f64>, order: u8| {
            let index = usize::from(order).checked_sub(1).filter(|_| order <= MAX_ORDER)?;
            if values.len() <= index {
                values.resize(index + 1, 0.0);
            }
            Some(index)
        };
        match term {
            JointTerm::Compliance => Some(&mut self.compliance),
            JointTerm::Tilt(axis) => Some(&mut self.tilt[axis.index()]),
            JointTerm::Sine(order) => harmonic(&mut self.sine, order).and_then(|index| self.sine.get_mut(index)),
            JointTerm::Cosine(order) => harmonic(&mut self.cosine, order).and_then(|index| self.cosine.get_mut(index)),
        }
    }

    /// Whether gravity has a part in it.
    pub(super) fn is_loaded(&self) -> bool {
        self.compliance != 0.0 || self.tilt.iter().any(|tilt| *tilt != 0.0)
    }

    /// The rotation about x, y and z (rad) at the joint value `q` under the relative `load`.
    pub(super) fn rotation(&self, q: f64, load: &JointLoad) -> Vector3<f64> {
        let angle = self.compliance * load.torque + self.curve(q);
        Vector3::new(self.tilt[0] * load.moment[0], self.tilt[1] * load.moment[1], angle)
    }

    /// The part that follows the joint's own value (rad).
    pub fn curve(&self, q: f64) -> f64 {
        let orders = self.sine.len().max(self.cosine.len());
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(0.0);
        harmonics(q, orders)
            .enumerate()
            .map(|(index, (sine, cosine))| at(&self.sine, index) * sine + at(&self.cosine, index) * cosine)
            .sum()
    }
}

fn of_order(values: &[f64], order: u8) -> f64 {
    usize::from(order).checked_sub(1).and_then(|index| values.get(index)).copied().unwrap_or(0.0)
}

/// `sin(h q)` and `cos(h q)` for h = 1 … `orders`, by the addition theorem.
pub(super) fn harmonics(q: f64, orders: usize) -> impl Iterator<Item = (f64, f64)> {
    let (sine, cosine) = q.sin_cos();
    let mut now = (0.0, 1.0);
    (0..orders).map(move |_| {
        now = (now.0 * cosine + now.1 * sine, now.1 * cosine - now.0 * sine);
        now
    })
}

impl KinematicChain {
    /// Whether the joint can have this term: harmonics belong to turning joints, compliance and tilt need masses.
    pub fn has_term(&self, joint: usize, term: JointTerm) -> bool {
        let Some(of) = self.joints().get(joint) else { return false };
        let turns = of.joint_type == JointType::Revolute;
        match term {
            JointTerm::Compliance => turns && self.loads().is_some_and(|loads| loads.turns(joint)),
            JointTerm::Tilt(_) => self.loads().is_some_and(|loads| loads.largest_moment() > NO_TORQUE),
            JointTerm::Sine(order) | JointTerm::Cosine(order) => turns && (1..=MAX_ORDER).contains(&order),
        }
    }
}
