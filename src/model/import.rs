//! Import of a URDF: link constants from the axes of a serial chain at rest, from base to tip.
//!
//! Between the axes i and i+1 there are four free numbers and one more where they are (nearly) parallel:
//! `Rot(z,θ_i) Trans(z,d_i) Trans(x,a) Rot(x,α) Rot(y,β)`. This product is a link of the standard convention; the modified
//! one counts `a, α, β` to the next joint. Two cases (angle between the axes against
//! [`PARALLEL_TOLERANCE`]):
//!
//! - crossing axes: x lies on their common normal, β = 0 (Denavit and Hartenberg 1955);
//! - (nearly) parallel axes: the common normal may be hundreds of metres away, so x points from axis i to where axis i+1
//!   meets the plane through the present origin, d_i = 0, and β takes the second tilt (Hayati 1983).
//!
//! A sliding axis has a direction and no place: it is put where `a` vanishes, or on a following parallel axis that turns.
//! Of the two directions of x the one with |θ| ≤ 90° is taken, so `a` may be negative, as makers write it.

use std::str::FromStr;

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::ModelError;
use super::proof::{self, Agreement, prove};
use super::transforms::{between_axes, from_axes, is_coupled, link_values, screw_z};
use super::urdf::{UrdfChain, UrdfJointType};
use crate::kinematics::{Convention, ForwardKinematics, Joint, JointType, KinematicChain, Link, LinkMass};
use crate::profile::{JointRange, Masses, PARALLEL_TOLERANCE};
use crate::text::printable;

/// Lengths (m) below this count as zero where only a direction depends on them.
const NO_LENGTH: f64 = 1e-12;

/// Angles and lengths below this (rad, m) are rounding of the walk: an axis along z is along z.
const ROUNDING: f64 = 1e-13;

/// An arm found in a URDF.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedArm {
    /// The arm; pendant values are the joint values of the URDF.
    pub chain: KinematicChain,
    /// Limits and speeds of the joints.
    pub ranges: Vec<JointRange>,
    /// Joints whose link has a β.
    pub beta_joints: Vec<usize>,
    /// Masses of the links, if the URDF has any.
    pub masses: Masses,
    /// Remarks about what the URDF leaves open, one sentence each.
    pub notes: Vec<String>,
    /// Its agreement with the URDF at random configurations.
    pub agreement: Agreement,
}

/// A joint whose pendant value counts together with that of another: `joint_3=joint_2`, or `joint_3=-joint_2`.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name of the joint.
    pub joint: String,
    /// Name of the joint that also turns its link.
    pub with: String,
    /// By how much.
    pub factor: f64,
}

impl FromStr for Coupling {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("'{}' is no coupling; write for example 'joint_3=joint_2', or 'joint_3=-joint_2'", printable(text))
        };
        let (joint, with) = text.split_once('=').ok_or_else(wrong)?;
        let (factor, with) = match with.trim().strip_prefix('-') {
            Some(with) => (-1.0, with),
            None => (1.0, with.trim()),
        };
        let (joint, with) = (joint.trim(), with.trim());
        if joint.is_empty() || with.is_empty() || joint == with {
            return Err(wrong());
        }
        Ok(Self { joint: joint.to_owned(), with: with.to_owned(), factor })
    }
}

impl Coupling {
    fn apply(&self, joints: &mut [Joint]) -> Result<(), ModelError> {
        let place = |name: &str| {
            let known = || joints.iter().map(|joint| printable(&joint.name)).collect::<Vec<_>>().join(", ");
            let message = || format!("there is no joint '{}' in the chain; joints: {}", printable(name), known());
            joints.iter().position(|joint| joint.name == name).ok_or_else(|| ModelError::Unsuitable(message()))
        };
        let (own, other) = (place(&self.joint)?, place(&self.with)?);
        let count = joints.len();
        if let Some(joint) = joints.get_mut(own) {
            joint.coupling.resize(count, 0.0);
            if let Some(coefficient) = joint.coupling.get_mut(other) {
                *coefficient = self.factor;
            }
        }
        Ok(())
    }
}

/// An axis at rest, in the base of the chain.
#[derive(Clone, Copy, Debug)]
struct Axis {
    joint_type: JointType,
    point: Point3<f64>,
    direction: Unit<Vector3<f64>>,
}

/// The link constants of a chain.
///
/// # Errors
/// The result does not agree with the URDF to 1 nm and 1 nrad.
pub fn import(urdf: &UrdfChain<'_>, convention: Convention) -> Result<ImportedArm, ModelError> {
    import_coupled(urdf, convention, &[])
}

/// As [`import`], for an arm whose pendant counts some joints together with others: FANUC, and arms with a parallel linkage.
///
/// # Errors
/// As [`import`], and a coupling of joints that the chain does not have.
pub fn import_coupled(
    urdf: &UrdfChain<'_>,
    convention: Convention,
    couplings: &[Coupling],
) -> Result<ImportedArm, ModelError> {
    let (axes, base_from_tip) = axes_at_rest(urdf);
    let walked = walk(&axes, &base_from_tip);
    let moving: Vec<_> = urdf.moving().collect();
    let mut joints = Vec::with_capacity(moving.len());
    let mut beta_joints = Vec::new();
    for (index, (joint, joint_type)) in moving.iter().enumerate() {
        let own = walked.screws.get(index).copied().unwrap_or_default();
        let between = match convention {
            Convention::Standard => walked.between.get(index),
            Convention::Modified => index.checked_sub(1).and_then(|before| walked.between.get(before)),
        };
        let between = between.copied().unwrap_or_default();
        if between.has_beta {
            beta_joints.push(index);
        }
        let link = Link { theta: own.theta, d: own.d, ..between.link };
        joints.push(Joint {
            name: joint.name.clone(),
            joint_type: *joint_type,
            link,
            direction: 1.0,
            coupling: Vec::new(),
        });
    }
    for coupling in couplings {
        coupling.apply(&mut joints)?;
    }
    let chain = KinematicChain::new(convention, walked.base, joints, walked.flange)?;
    let limits: Vec<_> = moving.iter().map(|(joint, _)| joint.limits).collect();
    let agreement = prove(&chain, &limits, proof::IMPORT, |q| urdf.base_from_tip(&link_values(&chain, q)))?;
    let ranges = moving
        .iter()
        .map(|(joint, joint_type)| JointRange {
            limits: joint.limits,
            planning_limits: joint.limits.map(|limits| JointRange::usual_planning_limits(*joint_type, limits)),
            max_speed: joint.max_speed,
            pulses_per_degree: None,
        })
        .collect();
    let masses = masses(urdf, &chain);
    let unlimited = moving.iter().filter(|(joint, _)| joint.limits.is_none());
    let notes = unlimited.map(|(joint, _)| {
        if joint.type_name == "continuous" {
            format!("joint '{}' is continuous: it has no limits; poses are planned only within limits", joint.name)
        } else {
            format!("joint '{}' has no usable <limit>; poses are planned only within limits", joint.name)
        }
    });
    let tools = urdf.on_tip.iter().map(|link| {
        format!(
            "link '{}' is fixed to the tip: its mass is not part of the arm; state it as 'payload'",
            printable(link)
        )
    });
    let mut notes: Vec<String> = notes.chain(tools).collect();
    notes.extend(urdf.joints.iter().flat_map(|joint| joint.notes.iter().cloned()));
    notes.extend(urdf.mass_defect.map(|defect| format!("no masses are taken: {defect}")));
    let coupled = chain.joints().iter().filter(|joint| is_coupled(joint));
    notes.extend(coupled.map(|joint| {
        format!("joint '{}' counts with another: its limits are those of the URDF; check them", printable(&joint.name))
    }));
    Ok(ImportedArm { chain, ranges, beta_joints, masses, notes, agreement })
}

/// The masses of the links, in the frames at the ends of the links of `chain`.
fn masses(urdf: &UrdfChain<'_>, chain: &KinematicChain) -> Masses {
    if urdf.mass_defect.is_some() || urdf.masses.iter().all(|link| link.mass <= 0.0) {
        return Masses::Unknown;
    }
    let ends = ForwardKinematics::new(chain).base_from_links(&vec![0.0; chain.dof()]);
    let mut pose = urdf.base_from_top;
    let mut children = Vec::new();
    for joint in &urdf.joints {
        pose *= joint.origin;
        if joint.joint_type != UrdfJointType::Fixed {
            children.push(pose);
        }
    }
    let in_end = |((link, child), end): ((&LinkMass, &Isometry3<f64>), &Isometry3<f64>)| LinkMass {
        centre: (end.inverse() * child * link.centre).map(tidy),
        ..*link
    };
    Masses::Links(urdf.masses.iter().zip(&children).zip(&ends[1..]).map(in_end).collect())
}

fn axes_at_rest(urdf: &UrdfChain<'_>) -> (Vec<Axis>, Isometry3<f64>) {
    let mut pose = urdf.base_from_top;
    let mut axes = Vec::new();
    for joint in &urdf.joints {
        pose *= joint.origin;
        if let UrdfJointType::Moving(joint_type) = joint.joint_type {
            let direction = Unit::new_normalize(pose.rotation * joint.axis.into_inner());
            axes.push(Axis { joint_type, point: Point3::from(pose.translation.vector), direction });
        }
    }
    (axes, pose)
}

/// θ (rad) and d (m) of a joint.
#[derive(Clone, Copy, Debug, Default)]
struct Screw {
    theta: f64,
    d: f64,
}

/// The transform between two axes; only α, a and β of `link` are used.
#[derive(Clone, Copy, Debug, Default)]
struct Between {
    link: Link,
    has_beta: bool,
}

#[derive(Debug)]
struct Walked {
    base: Isometry3<f64>,
    screws: Vec<Screw>,
    between: Vec<Between>,
    flange: Isometry3<f64>,
}

fn walk(axes: &[Axis], base_from_tip: &Isometry3<f64>) -> Walked {
    let base = axes.first().map_or_else(Isometry3::identity, base_frame);
    let mut frame = base;
    let (mut screws, mut between) = (Vec::new(), Vec::new());
    for (index, pair) in axes.windows(2).enumerate() {
        let [_, next] = pair else { continue };
        let after = axes.get(index + 2);
        let (screw, step) = step(&frame, next, after);
        frame *= screw_z(screw.theta, screw.d) * between_axes(&step.link);
        screws.push(screw);
        between.push(step);
    }
    let tip = frame.inverse() * base_from_tip;
    let x = tip.rotation * Vector3::x();
    let theta = if x.xy().norm() < 1e-6 { 0.0 } else { tidy(x.y.atan2(x.x)) };
    let last = Screw { theta, d: tidy(tip.translation.vector.z) };
    screws.push(last);
    Walked { base, flange: tidied(&(screw_z(last.theta, last.d).inverse() * tip)), screws, between }
}

/// A frame with z along the first axis: the base itself if possible, otherwise as near to it as possible.
fn base_frame(axis: &Axis) -> Isometry3<f64> {
    let z = axis.direction.into_inner();
    let (point, along) = (axis.point.coords, z.z);
    let origin = match axis.joint_type {
        JointType::Prismatic => Vector3::zeros(),
        // Where a steep axis meets the ground, else its point nearest to the origin.
        JointType::Revolute if along.abs() > 0.5 => point - z * (point.z / along),
        JointType::Revolute => point - z * point.dot(&z),
    };
    let forward = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = (forward - z * forward.dot(&z)).normalize();
    tidied(&from_axes(origin, x, z))
}

/// The link from `frame`, whose z is the current axis, to the next axis. `after` is the axis behind the next one.
fn step(frame: &Isometry3<f64>, next: &Axis, after: Option<&Axis>) -> (Screw, Between) {
    let seen = |axis: &Axis| {
        (frame.inverse_transform_point(&axis.point), frame.inverse_transform_unit_vector(&axis.direction))
    };
    let (point, u) = seen(next);
    let is_parallel = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(b).abs() > PARALLEL_TOLERANCE.cos();
    // Where a sliding axis is put, if that is not free.
    let place = match (next.joint_type, after) {
        (JointType::Revolute, _) => Some(point),
        (JointType::Prismatic, Some(after))
            if after.joint_type == JointType::Revolute && is_parallel(&after.direction, &next.direction) =>
        {
            Some(seen(after).0)
        }
        (JointType::Prismatic, _) => None,
    };
    let (theta, a, d, has_beta) = if is_parallel(&u, &Vector3::z()) {
        let meeting = place.map_or_else(Vector3::zeros, |point| point.coords - u.into_inner() * (point.z / u.z));
        let distance = meeting.xy().norm();
        if distance < NO_LENGTH {
            (0.0, 0.0, 0.0, true)
        } else {
            let (theta, flip) = quarter(meeting.y.atan2(meeting.x));
            (theta, distance * flip, 0.0, true)
        }
    } else {
        let (theta, _) = quarter(u.x.atan2(-u.y));
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -theta);
        let direction = turned * u.into_inner();
        let foot = place.map(|point| {
            let point = turned * point.coords;
            point - direction * (point.y / direction.y)
        });
        foot.map_or((theta, 0.0, 0.0, false), |foot| (theta, foot.x, foot.z, false))
    };
    let theta = tidy(theta);
    let u = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -theta) * u.into_inner();
    let beta = if has_beta { tidy(u.x.atan2(u.y.hypot(u.z))) } else { 0.0 };
    let alpha = tidy((-u.y).atan2(u.z));
    let link = Link { alpha, a: tidy(a), beta, ..Link::default() };
    (Screw { theta, d: tidy(d) }, Between { link, has_beta })
}

/// The angle or the opposite one, whichever is within ±90°, with +1 or −1.
fn quarter(angle: f64) -> (f64, f64) {
    use std::f64::consts::{FRAC_PI_2, PI};
    if angle > FRAC_PI_2 + ROUNDING {
        (angle - PI, -1.0)
    } else if angle <= -FRAC_PI_2 + ROUNDING {
        (angle + PI, -1.0)
    } else {
        (angle, 1.0)
    }
}

/// Zero instead of rounding.
fn tidy(value: f64) -> f64 {
    if value.abs() < ROUNDING { 0.0 } else { value }
}

/// The identity, or no translation, or no rotation, instead of rounding.
fn tidied(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let rotation = if pose.rotation.angle() < ROUNDING { UnitQuaternion::identity() } else { pose.rotation };
    Isometry3::from_parts(Translation3::from(pose.translation.vector.map(tidy)), rotation)
}
