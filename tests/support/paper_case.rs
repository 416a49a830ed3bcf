//! Simulated robots and data that several test programs share.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "every test program uses a part of it; a failure of a test is a panic"
)]
#![allow(clippy::allow_attributes, reason = "whether code is dead differs from one test program to the next")]

use nalgebra::{DVector, Isometry3, Point3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use trupose::identification::{Observations, PointSample, Problem};
use trupose::kinematics::{
    Arm, Convention, FreeParameter, Joint, JointType, KinematicChain, Link, LinkParameter, ParameterId, Place,
};
use trupose::units::{MILLIMETRE, from_deg, from_mm};

/// Table I: (α [deg], a [mm], d [mm], θ [deg]) per joint.
pub(crate) const TABLE_I: [[f64; 4]; 6] = [
    [-90.0, 170.0, 504.0, 0.0],
    [0.0, 780.0, 0.0, -90.0],
    [-90.0, 140.0, 0.0, 0.0],
    [90.0, 0.0, 760.0, 0.0],
    [-90.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 125.0, 0.0],
];

/// Table II: (Δα [deg], Δa [mm], Δd [mm], Δθ [deg]) per joint.
pub(crate) const TABLE_II: [[f64; 4]; 6] = [
    [-0.0516, -3.885, 0.0, 0.0],
    [-0.0459, 1.2834, 1.3308, -0.671],
    [0.086, 1.1404, 1.3308, 0.0975],
    [0.0057, -0.1408, -0.3557, -1.04],
    [0.143, 1.6238, -1.4628, 1.77],
    [-0.0115, 0.0199, -0.9708, -0.0287],
];

/// Table II, Δβ of joint 2 [deg].
pub(crate) const TABLE_II_BETA_2: f64 = 0.155;

/// Joint ranges of the reference case [deg].
pub(crate) const RANGES: [(f64, f64); 6] =
    [(-120.0, 120.0), (-60.0, 90.0), (-70.0, 60.0), (-180.0, 180.0), (-100.0, 100.0), (-180.0, 180.0)];

/// SMR of the paper in the flange frame [m].
pub(crate) fn paper_target() -> Point3<f64> {
    Point3::new(from_mm(-1.473), from_mm(26.384), from_mm(71.991))
}

/// The paper's robot, table I.
pub(crate) fn paper_chain() -> KinematicChain {
    let joints = TABLE_I
        .iter()
        .enumerate()
        .map(|(index, [alpha, a, d, theta])| Joint {
            name: format!("J{}", index + 1),
            joint_type: JointType::Revolute,
            link: Link { alpha: from_deg(*alpha), a: from_mm(*a), d: from_mm(*d), theta: from_deg(*theta), beta: 0.0 },
            direction: 1.0,
            coupling: Vec::new(),
        })
        .collect();
    KinematicChain::new(Convention::Standard, Isometry3::identity(), joints, Isometry3::identity()).unwrap()
}

/// The paper's 25 parameters with the default expected deviations.
pub(crate) fn paper_parameters() -> Vec<FreeParameter> {
    let link = |joint, parameter, expected| FreeParameter { id: ParameterId::Link { joint, parameter }, expected };
    let mut parameters: Vec<FreeParameter> = (0..6)
        .flat_map(|joint| {
            [
                link(joint, LinkParameter::Alpha, 2e-3),
                link(joint, LinkParameter::A, MILLIMETRE),
                link(joint, LinkParameter::D, MILLIMETRE),
                link(joint, LinkParameter::Theta, 10e-3),
            ]
        })
        .collect();
    parameters.push(link(1, LinkParameter::Beta, 2e-3));
    parameters
}

/// Table II in the order of [`paper_parameters`] ([m] and [rad]).
pub(crate) fn paper_deviations() -> DVector<f64> {
    let mut values: Vec<f64> = TABLE_II
        .iter()
        .flat_map(|[alpha, a, d, theta]| [from_deg(*alpha), from_mm(*a), from_mm(*d), from_deg(*theta)])
        .collect();
    values.push(from_deg(TABLE_II_BETA_2));
    DVector::from_vec(values)
}

/// Random numbers of a test.
pub(crate) fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// One standard normal number.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Uniformly random configurations in the reference ranges [rad].
pub(crate) fn random_configurations(count: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    (0..count).map(|_| RANGES.iter().map(|(low, high)| from_deg(rng.random_range(*low..*high))).collect()).collect()
}

/// A tracker somewhere in front of the robot.
pub(crate) fn station_from_base() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(2.9, -1.1, 0.6), Vector3::new(0.3, -0.2, 2.1))
}

/// Measures `truth` at configurations with `noise` [m] per coordinate.
pub(crate) fn measure(truth: &Arm, configurations: &[Vec<f64>], noise: f64, rng: &mut ChaCha8Rng) -> Vec<PointSample> {
    configurations
        .iter()
        .map(|configuration| {
            let at = Place { configuration: configuration.clone(), target: 0 };
            let mut point = station_from_base() * truth.point_in_base(&at);
            for axis in 0..3 {
                point[axis] += noise * normal(rng);
            }
            PointSample { at, station: 0, point, sigma: None }
        })
        .collect()
}

/// The paper's robot with its 25 parameters and some observations.
#[derive(Debug)]
pub(crate) struct PaperCase {
    pub(crate) arm: Arm,
    pub(crate) parameters: Vec<FreeParameter>,
    pub(crate) observations: Observations,
}

impl PaperCase {
    pub(crate) fn new(points: Vec<PointSample>) -> Self {
        Self {
            arm: Arm { chain: paper_chain(), targets: vec![paper_target()] },
            parameters: paper_parameters(),
            observations: Observations { points, ..Observations::default() },
        }
    }

    /// Random poses measured on the nominal robot plus `deviations`.
    pub(crate) fn simulated(deviations: &DVector<f64>, poses: usize, noise: f64, rng: &mut ChaCha8Rng) -> Self {
        let mut case = Self::new(Vec::new());
        let truth = case.problem().arm_with(deviations);
        let configurations = random_configurations(poses, rng);
        case.observations.points = measure(&truth, &configurations, noise, rng);
        case
    }

    pub(crate) fn problem(&self) -> Problem<'_> {
        Problem { arm: &self.arm, parameters: &self.parameters, observations: &self.observations }
    }
}
