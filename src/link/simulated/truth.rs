//! The true arm of a simulated cell.

use nalgebra::Isometry3;

use super::random::{Random, Use};
use crate::kinematics::{
    Arm, Convention, FreeParameter, JointTerm, JointType, KinematicChain, LinkParameter, ParameterId, SMOOTH_ORDERS,
    curve_share,
};
use crate::link::LinkError;
use crate::profile::{Level, Profile};
use crate::session::simulation::{JointErrorSizes, Simulation, Truth};
use crate::units::{MICRORADIAN, MILLIMETRE, from_deg, from_mm, to_mm};

/// Largest standard deviation per coordinate of a drawn target (m). The uncertainty in a profile may cover a whole flange; a
/// technician with a ruler measures better than that.
const TARGET_SPREAD: f64 = 2.0 * MILLIMETRE;

/// Largest size of an error of a joint (µrad): more is no gear but a defect.
const LARGEST_JOINT_ERROR: f64 = 20_000.0;

/// Largest difference of a constant from that of the method paper's arm (m or rad).
const SAME_GEOMETRY: f64 = 1e-6;

/// Table I of the method paper: α (deg), a (mm), d (mm), θ (deg) per joint.
const TABLE_I: [[f64; 4]; 6] = [
    [-90.0, 170.0, 504.0, 0.0],
    [0.0, 780.0, 0.0, -90.0],
    [-90.0, 140.0, 0.0, 0.0],
    [90.0, 0.0, 760.0, 0.0],
    [-90.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 125.0, 0.0],
];

/// Table II: Δα (deg), Δa (mm), Δd (mm), Δθ (deg) per joint.
const TABLE_II: [[f64; 4]; 6] = [
    [-0.0516, -3.885, 0.0, 0.0],
    [-0.0459, 1.2834, 1.3308, -0.671],
    [0.086, 1.1404, 1.3308, 0.0975],
    [0.0057, -0.1408, -0.3557, -1.04],
    [0.143, 1.6238, -1.4628, 1.77],
    [-0.0115, 0.0199, -0.9708, -0.0287],
];

/// Table II: Δβ of joint 2 (deg).
const TABLE_II_BETA_2: f64 = 0.155;

/// Constants of a table row, in order.
const COLUMNS: [LinkParameter; 4] = [LinkParameter::Alpha, LinkParameter::A, LinkParameter::D, LinkParameter::Theta];

/// The true arm of a simulated cell, which an identification should find.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenArm {
    /// The arm, with its targets before any bump.
    pub arm: Arm,
    /// Pose of the tracker.
    pub base_from_tracker: Isometry3<f64>,
}

/// Deviations from nominal (m or rad), including target coordinates.
pub(super) fn deviations(profile: &Profile, truth: Truth, seed: u64) -> Result<Vec<(ParameterId, f64)>, LinkError> {
    match truth {
        Truth::Nominal => Ok(Vec::new()),
        Truth::Drawn => {
            let mut random = Random::new(seed, Use::Arm);
            let spread = |free: &FreeParameter| match free.id.target() {
                Some(_) => free.expected.min(TARGET_SPREAD),
                None => free.expected,
            };
            let free = profile.parameters(Level::Geometric);
            Ok(free.iter().map(|free| (free.id, spread(free) * random.normal())).collect())
        }
        Truth::Paper => {
            is_paper_arm(profile.chain())
                .map_err(|difference| {
                    LinkError::SetUp(format!(
                        "the true deviations of the method paper belong to its arm (profile 'soochow'), not to '{}': {difference}; use drawn or nominal ones",
                        profile.name()
                    ))
                })
                .map(|()| paper_deviations())
        }
    }
}

/// Table II in metres and radians.
fn paper_deviations() -> Vec<(ParameterId, f64)> {
    let rows = TABLE_II.into_iter().enumerate().flat_map(|(joint, row)| {
        let edge = COLUMNS.into_iter().zip(row);
        edge.map(move |(parameter, value)| {
            (ParameterId::Link { joint, parameter }, parameter.quantity().from_edge(value))
        })
    });
    let beta = ParameterId::Link { joint: 1, parameter: LinkParameter::Beta };
    rows.chain([(beta, from_deg(TABLE_II_BETA_2))]).collect()
}

/// Checks that a chain is that of table I; returns the first difference otherwise.
fn is_paper_arm(chain: &KinematicChain) -> Result<(), String> {
    if chain.convention() != Convention::Standard || chain.dof() != TABLE_I.len() {
        return Err("the paper's arm has six joints in the standard convention".to_owned());
    }
    for (index, (joint, row)) in chain.joints().iter().zip(TABLE_I).enumerate() {
        let is_plain = joint.joint_type == JointType::Revolute
            && joint.direction > 0.0
            && joint.coupling.iter().all(|coupling| coupling.abs() <= 0.0);
        if !is_plain {
            return Err(format!("in the paper, joint {} turns by its pendant value, without a coupling", joint.name));
        }
        for (parameter, value) in COLUMNS.into_iter().zip(row) {
            let id = ParameterId::Link { joint: index, parameter };
            let here = joint.link.value(parameter);
            let quantity = parameter.quantity();
            let excess = (here - quantity.from_edge(value)).abs();
            if excess.is_nan() || excess > SAME_GEOMETRY {
                return Err(format!(
                    "{id} is {value} {} in the paper and {} in the profile",
                    quantity.unit(),
                    quantity.to_edge(here)
                ));
            }
        }
        if joint.link.beta.abs() > SAME_GEOMETRY {
            return Err(format!("beta{} is zero in the paper", index + 1));
        }
    }
    // A fixed frame at the flange changes no distance between flange poses, but it would move the targets.
    let offset = chain.flange().translation.vector.norm();
    if offset > from_mm(SAME_GEOMETRY) || chain.flange().rotation.angle() > SAME_GEOMETRY {
        return Err(format!(
            "the paper's flange is the last link frame, the profile's is {} mm from it",
            to_mm(offset)
        ));
    }
    Ok(())
}

/// The errors of the joints (rad). All that an arm can have are drawn, so that masses and payload do not change the others.
fn joint_errors(chain: &KinematicChain, sizes: &JointErrorSizes, seed: u64) -> Vec<(ParameterId, f64)> {
    let mut random = Random::new(seed, Use::JointErrors);
    let mut drawn = Vec::new();
    for joint in 0..chain.dof() {
        for term in JointTerm::all() {
            let normal = random.normal();
            let value = match term {
                JointTerm::Compliance => sizes.compliance_urad * normal.abs(),
                JointTerm::Tilt(_) => sizes.tilt_urad * normal.abs(),
                JointTerm::Sine(order) | JointTerm::Cosine(order) if order <= SMOOTH_ORDERS => {
                    sizes.harmonics_urad * normal
                }
                JointTerm::Sine(order) | JointTerm::Cosine(order) => sizes.curves_urad * curve_share(order) * normal,
            };
            if chain.has_term(joint, term) && value != 0.0 {
                drawn.push((ParameterId::Joint { joint, term }, value * MICRORADIAN));
            }
        }
    }
    drawn
}

/// Checks the sizes of the errors of the joints, and that the arm can have them.
fn check_joint_errors(profile: &Profile, sizes: &JointErrorSizes) -> Result<(), LinkError> {
    let refused = |message: String| Err(LinkError::SetUp(message));
    for (name, size) in sizes.named() {
        if !(0.0..=LARGEST_JOINT_ERROR).contains(&size) {
            return refused(format!(
                "the joint errors have {name} of {size} urad; they must be from 0 to {LARGEST_JOINT_ERROR} urad"
            ));
        }
    }
    let name = profile.name();
    if profile.chain().loads().is_none() && (sizes.compliance_urad > 0.0 || sizes.tilt_urad > 0.0) {
        return refused(format!(
            "compliance and tilt need the masses of the arm, which the profile '{name}' does not give"
        ));
    }
    Ok(())
}

/// The true arm and targets of a profile.
pub(super) fn hidden_arm(
    profile: &Profile,
    simulation: &Simulation,
    base_from_tracker: Isometry3<f64>,
) -> Result<HiddenArm, LinkError> {
    let Simulation { seed, truth, .. } = *simulation;
    let loaded = match simulation.payload {
        Some(payload) if payload.is_usable() => &profile.with_payload(payload.mass()),
        Some(payload) => return Err(LinkError::SetUp(format!("a payload of {payload} cannot be simulated"))),
        None => profile,
    };
    let mut deviations = deviations(loaded, truth, seed)?;
    if let Some(sizes) = &simulation.joint_errors {
        check_joint_errors(loaded, sizes)?;
        deviations.extend(joint_errors(loaded.chain(), sizes, seed));
    }
    let arm = loaded.arm().with(deviations).map_err(|error| LinkError::SetUp(error.to_string()))?;
    Ok(HiddenArm { arm, base_from_tracker })
}
