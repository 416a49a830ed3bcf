//! The arm with the points on its flange that are measured: what identification changes and everything else predicts with.

use nalgebra::Point3;

use super::{ForwardKinematics, KinematicChain, KinematicsError, LinkMass, ParameterId};

/// A configuration and the target that is observed there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Pendant configuration (rad) or (m).
    pub configuration: Vec<f64>,
    /// Index of the target.
    pub target: usize,
}

/// A serial arm with its targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The links and joints.
    pub chain: KinematicChain,
    /// Target coordinates in the flange frame (m).
    pub targets: Vec<Point3<f64>>,
}

/// An arm without targets.
impl From<KinematicChain> for Arm {
    fn from(chain: KinematicChain) -> Self {
        Self { chain, targets: Vec::new() }
    }
}

impl Arm {
    /// Value of a parameter ((m) or (rad)); `None` if the arm does not have it.
    pub fn value(&self, id: ParameterId) -> Option<f64> {
        match id {
            ParameterId::Link { joint, parameter } => Some(self.chain.joints().get(joint)?.link.value(parameter)),
            ParameterId::Joint { joint, term } => {
                let has_term = self.chain.has_term(joint, term);
                self.chain.errors().get(joint).filter(|_| has_term).map(|error| error.value(term))
            }
            ParameterId::Target { target, axis } => Some(self.targets.get(target)?[axis.index()]),
        }
    }

    /// The same arm with deviations ((m) or (rad)) added to its parameters.
    ///
    /// # Errors
    /// A parameter that the arm does not have.
    pub fn with(&self, deviations: impl IntoIterator<Item = (ParameterId, f64)>) -> Result<Self, KinematicsError> {
        let mut arm = self.clone();
        for (id, deviation) in deviations {
            let value =
                arm.value_mut(id).ok_or_else(|| KinematicsError::UnknownParameter { parameter: id.to_string() })?;
            *value += deviation;
        }
        Ok(arm)
    }

    fn value_mut(&mut self, id: ParameterId) -> Option<&mut f64> {
        match id {
            ParameterId::Link { joint, parameter } => Some(self.chain.link_mut(joint)?.value_mut(parameter)),
            ParameterId::Joint { joint, term } if self.chain.has_term(joint, term) => {
                self.chain.error_mut(joint)?.value_mut(term)
            }
            ParameterId::Joint { .. } => None,
            ParameterId::Target { target, axis } => Some(&mut self.targets.get_mut(target)?[axis.index()]),
        }
    }

    /// The same arm with another payload on its flange; see [`KinematicChain::with_payload`].
    #[must_use]
    pub fn with_payload(self, payload: LinkMass) -> Self {
        Self { chain: self.chain.with_payload(payload), ..self }
    }

    /// The arm prepared for many places.
    pub fn prepared(&self) -> PreparedArm<'_> {
        PreparedArm { forward: ForwardKinematics::new(&self.chain), targets: &self.targets }
    }

    /// Position in the base of the target at a place (m). For many places, [prepare](Self::prepared) the arm once.
    pub fn point_in_base(&self, place: &Place) -> Point3<f64> {
        self.prepared().point_in_base(place)
    }

    /// Positions in the base (m), in the order of `places`.
    pub fn points_in_base<'a>(&self, places: impl IntoIterator<Item = &'a Place>) -> Vec<Point3<f64>> {
        let arm = self.prepared();
        places.into_iter().map(|place| arm.point_in_base(place)).collect()
    }
}

/// An arm prepared for many places: sines and cosines of the constant angles are computed once.
#[derive(Clone, Debug)]
pub struct PreparedArm<'a> {
    pub(super) forward: ForwardKinematics<'a>,
    pub(super) targets: &'a [Point3<f64>],
}

impl PreparedArm<'_> {
    /// Position in the base of the target at a place (m).
    pub fn point_in_base(&self, place: &Place) -> Point3<f64> {
        self.forward.point_in_base(&place.configuration, &self.targets[place.target])
    }
}
