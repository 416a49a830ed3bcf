//! Writing URDF: a new one for an arm, or new origins in a given one.
//!
//! In a given URDF only the `<origin>` elements of the chain's joints change. Its link frames keep their place on their link
//! (meshes stay where they are): frame i of the URDF is `F_i K_i`, with `F_i` the frame of joint i of the arm and `K_i`, along
//! and about that axis, taken once from the nominal geometry; new origins follow from `F'_i K_i` of the identified arm. The
//! axes of the URDF stay as they are.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::ModelError;
use super::proof::{Tolerance, configurations};
use super::transforms::{JointFrames, is_coupled, link_values, number, roll_pitch_yaw};
use super::urdf::{Urdf, UrdfChain, UrdfJoint, UrdfJointType};
use crate::kinematics::{ForwardKinematics, JointType, KinematicChain};
use crate::profile::JointRange;
use crate::text::printable;
use crate::units::{MILLIMETRE, MILLIRADIAN, to_deg, to_mm};

/// Base link of a new URDF.
pub(super) const BASE: &str = "base";
/// Tip link of a new URDF.
pub(super) const FLANGE: &str = "flange";

/// Largest difference between a given URDF and the nominal arm: makers round, but another robot is farther off.
const SAME_ROBOT: Tolerance = Tolerance { position: MILLIMETRE, angle: 2.0 * MILLIRADIAN };

/// Number of configurations at which a given URDF is compared with the nominal arm.
const COMPARED: usize = 100;

/// A URDF of an arm: one link without shape per joint, between the links `base` and `flange`.
///
/// # Errors
/// A sliding joint without limits: URDF needs them.
pub fn fresh(
    name: &str,
    comments: &[String],
    chain: &KinematicChain,
    ranges: &[JointRange],
) -> Result<String, ModelError> {
    let frames = JointFrames::new(chain);
    let mut lines = vec!["<?xml version=\"1.0\" encoding=\"utf-8\"?>".to_owned(), "<!--".to_owned()];
    lines.extend(comments.iter().map(|line| format!("  {}", printable(line).replace("--", "__"))));
    lines.push(
        "  Shapes, masses and efforts are not known here: effort is 0, velocity is 0 where it is not known.".to_owned(),
    );
    lines.push("-->".to_owned());
    lines.push(format!("<robot name=\"{}\">", escaped(name)));
    lines.push(format!("  <link name=\"{BASE}\"/>"));
    let mut parent = BASE.to_owned();
    for (index, (joint, origin)) in chain.joints().iter().zip(&frames.origins).enumerate() {
        let child = format!("link_{}", index + 1);
        let limits = link_limits(chain, ranges, index);
        let type_name = match (joint.joint_type, limits) {
            (JointType::Revolute, Some(_)) => "revolute",
            (JointType::Revolute, None) => "continuous",
            (JointType::Prismatic, Some(_)) => "prismatic",
            (JointType::Prismatic, None) => {
                let message = format!("joint '{}' slides and has no limits; URDF needs them", joint.name);
                return Err(ModelError::Unsuitable(message));
            }
        };
        lines.push(format!("  <link name=\"{child}\"/>"));
        lines.push(format!("  <joint name=\"{}\" type=\"{type_name}\">", escaped(&joint.name)));
        lines.push(format!("    <parent link=\"{parent}\"/>"));
        lines.push(format!("    <child link=\"{child}\"/>"));
        lines.push(format!("    {}", origin_element(origin)));
        lines.push(format!("    <axis xyz=\"0 0 {}\"/>", if joint.direction < 0.0 { "-1" } else { "1" }));
        let range = limits.map(|(low, high)| format!("lower=\"{}\" upper=\"{}\" ", number(low), number(high)));
        let speed = ranges.get(index).and_then(|range| range.max_speed).unwrap_or(0.0);
        lines.push(format!("    <limit {}effort=\"0\" velocity=\"{}\"/>", range.unwrap_or_default(), number(speed)));
        lines.push("  </joint>".to_owned());
        parent = child;
    }
    lines.push(format!("  <link name=\"{FLANGE}\"/>"));
    lines.push(format!("  <joint name=\"{}\" type=\"fixed\">", flange_joint(chain)));
    lines.push(format!("    <parent link=\"{parent}\"/>"));
    lines.push(format!("    <child link=\"{FLANGE}\"/>"));
    lines.push(format!("    {}", origin_element(&frames.tail)));
    lines.push("  </joint>".to_owned());
    lines.push("</robot>".to_owned());
    Ok(lines.join("\n") + "\n")
}

/// A name that no joint of the arm has.
fn flange_joint(chain: &KinematicChain) -> String {
    let mut name = "flange_joint".to_owned();
    while chain.joints().iter().any(|joint| joint.name == name) {
        name.push('_');
    }
    name
}

/// Range of the value of a URDF joint. For a coupled joint it is everything that the limits of the pendant values allow.
fn link_limits(chain: &KinematicChain, ranges: &[JointRange], index: usize) -> Option<(f64, f64)> {
    let joint = chain.joints().get(index)?;
    let own = ranges.get(index)?.limits?;
    let others = ranges.iter().zip(&joint.coupling).filter(|(_, coefficient)| **coefficient != 0.0);
    others.map(|(range, coefficient)| range.limits.map(|limits| (limits, *coefficient))).try_fold(
        own,
        |(low, high), other| {
            let ((a, b), coefficient) = other?;
            let (a, b) = (a * coefficient, b * coefficient);
            Some((low + a.min(b), high + a.max(b)))
        },
    )
}

fn origin_element(origin: &Isometry3<f64>) -> String {
    let triple = |values: [f64; 3]| values.map(number).join(" ");
    format!(
        "<origin xyz=\"{}\" rpy=\"{}\"/>",
        triple(origin.translation.vector.into()),
        triple(roll_pitch_yaw(&origin.rotation))
    )
}

pub(super) fn escaped(text: &str) -> String {
    printable(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A given URDF with other origins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Patched {
    pub(super) text: String,
    /// Pose of the tip link in the flange of the arm, which does not change.
    pub(super) flange_from_tip: Isometry3<f64>,
    /// Joints whose origin was replaced.
    pub(super) joints: Vec<String>,
}

/// Puts the identified geometry into a URDF of the nominal arm.
///
/// # Errors
/// No such chain, another number or kind of joints, another robot or zero position, or no fixed joint behind the last axis
/// that could carry the rest.
pub(super) fn patch(
    text: &str,
    base: &str,
    tip: &str,
    nominal: &KinematicChain,
    identified: &KinematicChain,
    limits: &[Option<(f64, f64)>],
) -> Result<Patched, ModelError> {
    if text.contains("<!DOCTYPE") {
        let message = "the URDF has a document type with entities, which cannot be changed in place; expand it first: 'xmllint --noent --dropdtd FILE.urdf'";
        return Err(ModelError::Unsuitable(message.to_owned()));
    }
    let urdf = Urdf::parse(text)?;
    let chain = urdf.chain(base, tip)?;
    same_joints(&chain, nominal)?;
    let flange_from_tip = same_geometry(&chain, nominal, limits)?;
    let (old, new) = (JointFrames::new(nominal), JointFrames::new(identified));
    // From the outside inwards: poses at rest of the nominal and of the identified arm, and of the URDF as it is.
    let (mut before, mut after) = (Isometry3::identity(), Isometry3::identity());
    let mut given = chain.base_from_top;
    let mut parent = chain.base_from_top;
    let mut moving = old.origins.iter().zip(&new.origins).zip(nominal.joints());
    let mut left = nominal.dof();
    let mut changes: Vec<(&UrdfJoint, Isometry3<f64>)> = Vec::new();
    for (place, joint) in chain.joints.iter().enumerate() {
        given *= joint.origin;
        let pose = match joint.joint_type {
            UrdfJointType::Moving(_) => {
                let Some(((old, new), arm_joint)) = moving.next() else { continue };
                before *= old;
                after *= new;
                left -= 1;
                after * on_axis(&(before.inverse() * given), arm_joint.direction, &joint.axis, joint)?
            }
            _ if left > 0 => parent * joint.origin,
            // Behind the last axis the first fixed joint carries the whole rest.
            _ if chain.joints.get(place - 1).is_some_and(|joint| joint.joint_type != UrdfJointType::Fixed) => {
                let behind = chain.joints.iter().skip(place + 1);
                let rest = behind.fold(Isometry3::identity(), |pose, joint| pose * joint.origin);
                after * new.tail * flange_from_tip * rest.inverse()
            }
            _ => parent * joint.origin,
        };
        let origin = parent.inverse() * pose;
        if origin != joint.origin && !is_same(&origin, &joint.origin) {
            changes.push((joint, origin));
        }
        parent = pose;
    }
    if !is_same(&parent, &(after * new.tail * flange_from_tip)) {
        let last = chain.joints.last().map_or("", |joint| joint.name.as_str());
        let message = format!(
            "joint '{}' turns link '{}' itself, and there is no fixed joint behind it that could take alpha, a and beta of \
             the last link; take a tip link behind a fixed joint, such as 'flange' or 'tool0'",
            printable(last),
            printable(tip)
        );
        return Err(ModelError::Unsuitable(message));
    }
    changes.sort_by_key(|(joint, _)| joint.origin_bytes.start);
    let mut patched = String::with_capacity(text.len() + 64 * changes.len());
    let mut done = 0;
    for (joint, origin) in &changes {
        patched.push_str(text.get(done..joint.origin_bytes.start).unwrap_or_default());
        patched.push_str(&origin_element(origin));
        done = joint.origin_bytes.end;
    }
    patched.push_str(text.get(done..).unwrap_or_default());
    let joints = changes.iter().map(|(joint, _)| joint.name.clone()).collect();
    Ok(Patched { text: patched, flange_from_tip, joints })
}

/// Whether two origins are written identically.
fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.translation.vector - b.translation.vector).norm() < 1e-12 && a.rotation.angle_to(&b.rotation) < 1e-12
}

/// A frame of the URDF in the frame of the arm's joint, moved onto the axis: turned about it and shifted along it.
fn on_axis(
    seen: &Isometry3<f64>,
    direction: f64,
    axis: &Unit<Vector3<f64>>,
    joint: &UrdfJoint,
) -> Result<Isometry3<f64>, ModelError> {
    let axis_in_urdf = seen.rotation.inverse() * (Vector3::z() * direction);
    let correction = UnitQuaternion::rotation_between(axis, &axis_in_urdf);
    let Some(correction) = correction.filter(|turn| turn.angle() < SAME_ROBOT.angle) else {
        let message =
            "its axis points elsewhere than that of the profile; is it the same robot, with the same joint directions?";
        return Err(ModelError::Urdf(joint.error(message.to_owned())));
    };
    let along = Translation3::new(0.0, 0.0, seen.translation.vector.z);
    let is_sliding = joint.joint_type == UrdfJointType::Moving(JointType::Prismatic);
    // The position of a sliding joint is arbitrary, so it is kept.
    let along = if is_sliding { seen.translation } else { along };
    Ok(Isometry3::from_parts(along, seen.rotation * correction))
}

fn same_joints(chain: &UrdfChain<'_>, nominal: &KinematicChain) -> Result<(), ModelError> {
    let moving: Vec<_> = chain.moving().collect();
    if moving.len() != nominal.dof() {
        let names: Vec<String> = moving.iter().map(|(joint, _)| printable(&joint.name)).collect();
        let message = format!(
            "the chain has {} moving joints ({}), the profile has {}",
            moving.len(),
            names.join(", "),
            nominal.dof()
        );
        return Err(ModelError::Unsuitable(message));
    }
    for ((joint, joint_type), own) in moving.into_iter().zip(nominal.joints()) {
        if joint_type != own.joint_type {
            let message = format!("it is {}, but joint '{}' of the profile is not", joint.type_name, own.name);
            return Err(ModelError::Urdf(joint.error(message)));
        }
    }
    Ok(())
}

/// Compares a URDF with the nominal arm. Returns the tip seen from the flange.
fn same_geometry(
    chain: &UrdfChain<'_>,
    nominal: &KinematicChain,
    limits: &[Option<(f64, f64)>],
) -> Result<Isometry3<f64>, ModelError> {
    let arm = ForwardKinematics::new(nominal);
    let zero = vec![0.0; nominal.dof()];
    let flange_from_tip = arm.base_from_flange(&zero).inverse() * chain.base_from_tip(&link_values(nominal, &zero));
    let differs = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        let position = (a.translation.vector - b.translation.vector).norm();
        let angle = a.rotation.angle_to(&b.rotation);
        (position > SAME_ROBOT.position || angle > SAME_ROBOT.angle).then_some((position, angle))
    };
    for q in configurations(nominal, limits, COMPARED) {
        let meant = arm.base_from_flange(&q) * flange_from_tip;
        if let Some((position, angle)) = differs(&meant, &chain.base_from_tip(&link_values(nominal, &q))) {
            let coupled = nominal.joints().iter().any(is_coupled);
            let message = format!(
                "the URDF is not the nominal arm of the profile: up to {:.3} mm and {:.3} deg apart. Its base link must be \
                 the base of the profile, with the maker's geometry, zero position and senses of the joints{}",
                to_mm(position),
                to_deg(angle),
                if coupled { "; a coupled joint must turn its link against the one before" } else { "" }
            );
            return Err(ModelError::Unsuitable(message));
        }
    }
    let identity = Isometry3::identity();
    Ok(if differs(&flange_from_tip, &identity).is_none() { identity } else { flange_from_tip })
}
