//! What gravity acts on: masses of the links, mounting of the base, and payload.

use std::f64::consts::PI;

use nalgebra::{Unit, Vector3};

use super::JointRange;
use crate::kinematics::{JointType, KinematicChain, LinkMass, Loads};

/// Masses of the arm.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Masses {
    /// Not given: nothing about gravity can be identified.
    #[default]
    Unknown,
    /// The weight of the whole arm (kg), which [`KinematicChain::split_weight`] spreads over the links.
    Weight(f64),
    /// Mass and centre of every link.
    Links(Vec<LinkMass>),
}

/// How the base is mounted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mounting {
    /// Upright: gravity along −z of the base.
    #[default]
    Floor,
    /// On a wall: gravity along +x of the base.
    Wall,
    /// Hanging: gravity along +z of the base.
    Ceiling,
    /// Gravity along this direction of the base.
    Gravity(Unit<Vector3<f64>>),
}

impl Mounting {
    /// Direction of gravity in the base.
    pub fn down(self) -> Vector3<f64> {
        match self {
            Self::Floor => -Vector3::z(),
            Self::Wall => Vector3::x(),
            Self::Ceiling => Vector3::z(),
            Self::Gravity(direction) => direction.into_inner(),
        }
    }
}

impl Masses {
    /// Gravity on the arm `chain` with these masses; `None` where they are unknown.
    pub(super) fn loads(
        &self,
        chain: &KinematicChain,
        payload: Option<LinkMass>,
        mounting: Mounting,
        joints: &[JointRange],
    ) -> Option<Loads> {
        let links = match self {
            Self::Unknown => return None,
            Self::Weight(weight) => chain.split_weight(*weight),
            Self::Links(links) => links.clone(),
        };
        let ranges: Vec<(f64, f64)> = chain
            .joints()
            .iter()
            .zip(joints)
            .map(|(joint, range)| {
                let whole = match joint.joint_type {
                    JointType::Revolute => (-PI, PI),
                    JointType::Prismatic => (0.0, 0.0),
                };
                range.limits.unwrap_or(whole)
            })
            .collect();
        Some(Loads::new(chain, links, payload.unwrap_or_default(), mounting.down(), &ranges))
    }
}
