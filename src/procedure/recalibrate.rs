//! Recalibration: an identification that begins with what an earlier calibration knows.
//!
//! The belief before the data is the posterior of the earlier calibration, widened by what may have changed since. A small drift is
//! allowed for every constant; the zero of a joint gets a wide one only if the new points show that it has moved, because a few poses
//! tell little about six zeros and much about one. Errors of joints (elasticity, curves) are kept as they were.

use super::ProcedureError;
use super::compare::Space;
use super::health::{self, Mounting, MovedZero};
use super::identify::NamedSample;
use super::known::Known;
use crate::identification::{Belief, Factor, Identification};
use crate::kinematics::{Arm, FreeParameter, ParameterId};
use crate::profile::{ExpectedDeviation, Profile};
use crate::session::calibration::{Calibration, EarlierText};
use crate::session::summary::{EarlierSummary, MovedSummary, ParameterSummary, Warning, WarningCode};
use crate::units::{DEGREE, Quantity, from_mm, to_deg, to_mm};

/// How far a zero that has moved may have moved (rad; m).
const FREED_ANGLE: f64 = 2.0 * DEGREE;
const FREED_LENGTH: f64 = 20e-3;
/// Standard deviation of the place of a remounted target (m).
const REMOUNTED: f64 = 50e-3;

/// An earlier calibration to begin with.
#[derive(Clone, Debug, PartialEq)]
pub struct Previous {
    /// It.
    pub calibration: Calibration,
    /// Whether the SMR is still where it was.
    pub mounting: Mounting,
    /// How far every length (m) and angle (rad) may have drifted since, one standard deviation.
    pub drift: ExpectedDeviation,
}

impl Previous {
    /// What is allowed for if nothing is said.
    pub const fn usual_drift() -> ExpectedDeviation {
        ExpectedDeviation { length: from_mm(0.002), angle: 0.0002 * DEGREE }
    }
}

/// Where a recalibration begins.
pub(super) struct Beginning {
    /// The nominal arm with the errors of joints of the earlier calibration.
    pub(super) arm: Arm,
    pub(super) parameters: Vec<FreeParameter>,
    pub(super) belief: Belief,
    known: Known,
    widened: Vec<(ParameterId, f64)>,
    moved: Vec<MovedZero>,
    /// How many standard deviations the new points are off although the moved zeros are free.
    excess: f64,
}

impl Beginning {
    /// For new `samples` of the robot of `profile`.
    pub(super) fn new(
        previous: &Previous,
        profile: &Profile,
        samples: &[NamedSample],
        sigma: Option<f64>,
    ) -> Result<Self, ProcedureError> {
        let Previous { calibration, mounting, drift } = previous;
        let known = Known::new(calibration, profile)?;
        let errors = calibration
            .parameters
            .iter()
            .map(|parameter| if parameter.id.is_joint_error() { parameter.deviation } else { 0.0 });
        let arm = calibration.identified_with(profile, errors).map_err(super::known::KnownError::from)?;
        let is_new = |id: ParameterId| *mounting == Mounting::New && id.target().is_some();
        let geometry = known.without(|id| id.is_joint_error() || is_new(id));
        let (moved, excess) = health::moved_zeros(&known, samples, *mounting, sigma)?;
        let mut parameters = geometry.parameters.clone();
        let mut mean = geometry.deviations.clone();
        let mut covariance = geometry.covariance.clone();
        let mut widened = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            let width = match parameter.id {
                ParameterId::Link { .. } if moved.iter().any(|moved| moved.id == parameter.id) => {
                    match quantity_of(parameter.id) {
                        Quantity::Angle => FREED_ANGLE,
                        Quantity::Length => FREED_LENGTH,
                    }
                }
                ParameterId::Link { .. } => match quantity_of(parameter.id) {
                    Quantity::Angle => drift.angle,
                    Quantity::Length => drift.length,
                },
                ParameterId::Joint { .. } | ParameterId::Target { .. } => continue,
            };
            covariance[(index, index)] += width * width;
            widened.push((parameter.id, parameter.id.unit().to_edge(width)));
        }
        if *mounting == Mounting::New {
            let mut targets: Vec<usize> = samples.iter().map(|named| named.sample.at.target).collect();
            targets.sort_unstable();
            targets.dedup();
            for id in targets.into_iter().flat_map(ParameterId::of_target) {
                let count = parameters.len();
                parameters.push(FreeParameter { id, expected: REMOUNTED });
                mean = mean.push(0.0);
                covariance = covariance.insert_row(count, 0.0).insert_column(count, 0.0);
                covariance[(count, count)] = REMOUNTED * REMOUNTED;
                widened.push((id, id.unit().to_edge(REMOUNTED)));
            }
        }
        Ok(Self { arm, parameters, belief: Belief { mean, covariance }, known, widened, moved, excess })
    }

    /// A warning that the earlier calibration does not describe this arm any longer.
    pub(super) fn warning(&self) -> Option<Warning> {
        let message = format!(
            "the new points contradict the earlier calibration by {:.0} standard deviations in a way that no zero of a joint explains: its data do not belong to this arm as it is now. Identify without them",
            self.excess
        );
        (self.excess > health::EXCESS).then(|| Warning::new(WarningCode::EarlierDoesNotFit, message, true))
    }

    /// What the report says about the earlier data.
    pub(super) fn summary(&self, previous: &Previous, found: &Identification) -> EarlierSummary {
        let joints = self.arm.chain.joints();
        let moved = self.moved.iter().map(|moved| {
            let unit = moved.id.unit();
            MovedSummary {
                parameter: moved.id,
                joint: moved
                    .id
                    .joint()
                    .and_then(|joint| joints.get(joint))
                    .map_or_else(String::new, |j| j.name.clone()),
                unit,
                by: unit.to_edge(moved.explanation.size),
                sigma: unit.to_edge(moved.explanation.sigma),
            }
        });
        EarlierSummary {
            created: previous.calibration.provenance.created.clone(),
            poses: self.known.places.len(),
            weight_percent: self.weight(found, previous.mounting).map(|weight| 100.0 * weight),
            moved: moved.collect(),
            drift_length_mm: to_mm(previous.drift.length),
            drift_angle_deg: to_deg(previous.drift.angle),
        }
    }

    /// Part of the information about positions over the workspace that is not from the new points.
    fn weight(&self, found: &Identification, mounting: Mounting) -> Option<f64> {
        let ids: Vec<ParameterId> = self.parameters.iter().map(|parameter| parameter.id).collect();
        let products = Space::new(&self.known, &ids, mounting).ok()?.products;
        let before = Factor::new(self.belief.covariance.clone())?.inverse();
        let after = &found.covariance;
        let total = (&products * after).trace();
        (total > 0.0).then(|| ((&products * after * before * after).trace() / total).clamp(0.0, 1.0))
    }

    /// The data of the next calibration.
    pub(super) fn earlier(&self, previous: &Previous) -> Vec<EarlierText> {
        let Calibration { earlier, provenance, samples, sigma, .. } = &previous.calibration;
        let last = EarlierText {
            created: provenance.created.clone(),
            samples: samples.clone(),
            used_mm: sigma.used_mm,
            poses_mm: sigma.poses_mm,
            widened: self.widened.clone(),
        };
        earlier.iter().cloned().chain([last]).collect()
    }
}

fn quantity_of(id: ParameterId) -> Quantity {
    match id {
        ParameterId::Link { parameter, .. } => parameter.quantity(),
        ParameterId::Joint { .. } => Quantity::Angle,
        ParameterId::Target { .. } => Quantity::Length,
    }
}

/// The parameters of the earlier calibration that were kept: errors of joints.
pub(super) fn kept_errors(previous: &Previous) -> impl Iterator<Item = &ParameterSummary> {
    previous.calibration.parameters.iter().filter(|parameter| parameter.id.is_joint_error())
}

/// The best geometry alone: that of the earlier calibration, changed as the geometry beside the errors of joints has changed.
pub(super) fn geometric(previous: &Previous, now: &[ParameterSummary]) -> Vec<ParameterSummary> {
    let earlier = &previous.calibration;
    let changed = |geometric: &ParameterSummary| {
        let of =
            |all: &[ParameterSummary]| all.iter().find(|parameter| parameter.id == geometric.id).map(|p| p.deviation);
        let change = of(now).zip(of(&earlier.parameters)).map_or(0.0, |(now, before)| now - before);
        ParameterSummary { deviation: geometric.deviation + change, ..geometric.clone() }
    };
    earlier.geometric.iter().map(changed).collect()
}
