//! What a calibration file knows of its arm: the parameters with their whole covariance, worked out again from its samples.
//!
//! The file carries no matrix. The samples, the scatter and the expected deviations are enough: the information of points is
//! `JᵀJ/σ²` without rigid motions, and the covariance is the inverse of its sum with the prior.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::workspace;
use crate::identification::predicted::{free_jacobian, jacobian};
use crate::identification::{Factor, Places};
use crate::kinematics::{Arm, FreeParameter, Joint, KinematicsError, LinkParameter, ParameterId, Place};
use crate::planning::{JointBox, random};
use crate::profile::Profile;
use crate::session::calibration::{Calibration, EarlierText, SampleText};
use crate::units::{MICROMETRE, from_mm};

/// Configurations over the workspace at which arms are compared, and their seed.
const CONFIGURATIONS: usize = 300;
const SEED: u64 = 0x5eed;

/// A calibration from which its covariance cannot be worked out.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum KnownError {
    /// Samples without coordinates.
    #[error(
        "the calibration was made from direct distances; only one from measured points can be compared with points"
    )]
    NoPoints,
    /// An old file.
    #[error("the calibration does not list its samples")]
    NoSamples,
    /// A sample of another robot.
    #[error("sample {number} does not fit the robot of the calibration")]
    Sample { number: usize },
    /// Parameters of another robot.
    #[error(transparent)]
    Parameters(#[from] KinematicsError),
    /// Numbers without a covariance.
    #[error("the numbers of the calibration have no covariance")]
    Singular,
    /// Joints without limits.
    #[error("the profile gives no limits of the joints, so the workspace is unknown")]
    NoRange,
}

/// Poses that were measured for one calibration.
#[derive(Clone, Debug)]
struct Batch {
    places: Vec<Place>,
    /// Readings of each place.
    readings: Vec<f64>,
    /// Variance of a reading and of what a pose has in common (m²).
    variances: (f64, f64),
}

impl Batch {
    fn new(samples: &[SampleText], used_mm: f64, poses_mm: Option<f64>, joints: &[Joint]) -> Result<Self, KnownError> {
        let all: Vec<Place> = places(samples, joints)?;
        let first = Places::new(joints, &all).first_of_each();
        let mut readings: BTreeMap<usize, f64> = BTreeMap::new();
        for index in first {
            *readings.entry(index).or_default() += 1.0;
        }
        Ok(Self {
            places: readings.keys().map(|index| all[*index].clone()).collect(),
            readings: readings.values().copied().collect(),
            variances: batch_variances(used_mm, poses_mm),
        })
    }

    /// What its points tell about the parameters.
    fn information(&self, arm: &Arm, ids: &[ParameterId]) -> DMatrix<f64> {
        let places: Vec<&Place> = self.places.iter().collect();
        let mut rows = free_jacobian(arm, ids, &places);
        let (reading, pose) = self.variances;
        for (index, count) in self.readings.iter().enumerate() {
            let weight = 1.0 / (pose + reading / count).max(f64::MIN_POSITIVE).sqrt();
            rows.rows_mut(3 * index, 3).scale_mut(weight);
        }
        rows.tr_mul(&rows)
    }
}

/// Variances of readings about their pose, and of what a pose has in common (m²).
fn batch_variances(used_mm: f64, poses_mm: Option<f64>) -> (f64, f64) {
    let used = from_mm(used_mm).max(MICROMETRE).powi(2);
    let poses = poses_mm.map_or(used, |poses| from_mm(poses).powi(2)).min(used);
    (used - poses, poses)
}

/// The places of samples in a calibration file.
fn places(samples: &[SampleText], joints: &[Joint]) -> Result<Vec<Place>, KnownError> {
    let place = |(index, sample): (usize, &SampleText)| {
        if sample.joints.len() != joints.len() {
            return Err(KnownError::Sample { number: index + 1 });
        }
        let values = sample.joints.iter().zip(joints);
        let configuration = values.map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect();
        Ok(Place { configuration, target: sample.target })
    };
    samples.iter().enumerate().map(place).collect()
}

/// An arm as a calibration knows it.
#[derive(Clone, Debug)]
pub struct Known {
    /// The nominal robot with its target as it was mounted.
    pub profile: Profile,
    /// The identified arm.
    pub arm: Arm,
    /// The parameters, with their expected deviations.
    pub parameters: Vec<FreeParameter>,
    /// Identified − nominal of each ((m) and (rad)).
    pub deviations: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// What the data told about them, without the prior.
    pub information: DMatrix<f64>,
    /// Standard deviation of a coordinate of a reading (m).
    pub sigma: f64,
    /// Part of it that all readings of a pose share (m).
    pub poses_sigma: f64,
    /// The poses that it was identified from, earlier ones included.
    pub places: Vec<Place>,
    batches: Vec<Batch>,
}

impl Known {
    /// Of the calibration of the robot of `profile`.
    ///
    /// # Errors
    /// The file does not tell enough.
    pub fn new(calibration: &Calibration, profile: &Profile) -> Result<Self, KnownError> {
        if calibration.base_from_station.is_none() {
            return Err(KnownError::NoPoints);
        }
        if calibration.samples.is_empty() {
            return Err(KnownError::NoSamples);
        }
        let profile = calibration.mounted_on(profile);
        let arm = calibration.identified(&profile)?;
        let parameters: Vec<FreeParameter> = calibration
            .parameters
            .iter()
            .map(|parameter| FreeParameter {
                id: parameter.id,
                expected: parameter.unit.from_edge(parameter.expected).max(f64::MIN_POSITIVE),
            })
            .collect();
        let inside =
            |parameter: &crate::session::summary::ParameterSummary| parameter.unit.from_edge(parameter.deviation);
        let deviations = DVector::from_iterator(parameters.len(), calibration.parameters.iter().map(inside));
        let ids: Vec<ParameterId> = parameters.iter().map(|parameter| parameter.id).collect();
        let joints = arm.chain.joints();
        let prior = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| 1.0 / p.expected.powi(2)));
        let mut precision = DMatrix::from_diagonal(&prior);
        let mut batches = Vec::new();
        for earlier in &calibration.earlier {
            let EarlierText { samples, used_mm, poses_mm, .. } = earlier;
            let batch = Batch::new(samples, *used_mm, *poses_mm, joints)?;
            precision += batch.information(&arm, &ids);
            let mut covariance = Factor::new(precision).ok_or(KnownError::Singular)?.inverse();
            for (index, id) in ids.iter().enumerate() {
                covariance[(index, index)] += earlier.widened(*id).powi(2);
            }
            precision = Factor::new(covariance).ok_or(KnownError::Singular)?.inverse();
            batches.push(batch);
        }
        let sigma = &calibration.sigma;
        let batch = Batch::new(&calibration.samples, sigma.used_mm, sigma.poses_mm, joints)?;
        precision += batch.information(&arm, &ids);
        batches.push(batch);
        let places = batches.iter().flat_map(|batch| batch.places.iter().cloned()).collect();
        let covariance = Factor::new(precision.clone()).ok_or(KnownError::Singular)?.inverse();
        let information = precision - DMatrix::from_diagonal(&prior);
        let (_, poses) = batch_variances(sigma.used_mm, sigma.poses_mm);
        let sigma = from_mm(sigma.used_mm).max(MICROMETRE);
        let poses_sigma = poses.sqrt();
        Ok(Self { profile, arm, parameters, deviations, covariance, information, sigma, poses_sigma, places, batches })
    }

    /// The ids of the parameters, in order.
    pub fn ids(&self) -> Vec<ParameterId> {
        self.parameters.iter().map(|parameter| parameter.id).collect()
    }

    /// What all poses told about these parameters, whether they were free or not.
    pub(super) fn information_of(&self, ids: &[ParameterId]) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(ids.len(), ids.len());
        for batch in &self.batches {
            sum += batch.information(&self.arm, ids);
        }
        sum
    }

    /// The same without the parameters that `drop` picks: what is known of the others, whatever those are.
    #[must_use]
    pub fn without(&self, drop: impl Fn(ParameterId) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.parameters.len()).filter(|index| !drop(self.parameters[*index].id)).collect();
        let pick = |matrix: &DMatrix<f64>| matrix.select_rows(&kept).select_columns(&kept);
        Self {
            parameters: kept.iter().map(|index| self.parameters[*index]).collect(),
            deviations: self.deviations.select_rows(&kept),
            covariance: pick(&self.covariance),
            information: pick(&self.information),
            ..self.clone()
        }
    }

    /// Configurations over the workspace, with the first target.
    ///
    /// # Errors
    /// Joints without limits.
    pub fn workspace(&self) -> Result<Vec<Place>, KnownError> {
        workspace_places(&self.profile)
    }

    /// Derivatives of positions at `places` by all parameters.
    pub(super) fn jacobian(&self, arm: &Arm, places: &[&Place]) -> DMatrix<f64> {
        jacobian(arm, &self.ids(), places)
    }
}

/// Configurations over the workspace of a profile, with the first target.
pub(super) fn workspace_places(profile: &Profile) -> Result<Vec<Place>, KnownError> {
    let ranges = workspace::ranges(profile).ok_or(KnownError::NoRange)?;
    let joint_box = JointBox::new(ranges).map_err(|_no_range| KnownError::NoRange)?;
    let configurations = random(&joint_box, SEED).take(CONFIGURATIONS);
    Ok(configurations.map(|configuration| Place { configuration, target: 0 }).collect())
}

/// The parameter that is the zero of a joint.
pub(super) fn zero_of(joint: usize, joints: &[Joint]) -> ParameterId {
    let parameter =
        joints.get(joint).map_or(LinkParameter::Theta, |joint| LinkParameter::joint_offset(joint.joint_type));
    ParameterId::Link { joint, parameter }
}
