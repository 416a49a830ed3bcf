//! Factory calibrations of Universal Robots as the nominal arm: `calibration.conf` of the controller, and the kinematics file of the ROS
//! description.
//!
//! The controller keeps deviations that it adds to its DH constants. Axes 2, 3 and 4 are nearly parallel, so that plain DH constants of
//! such an arm have a `d` of metres to hundreds of metres; the arm is therefore derived from its axes, with β where they are parallel.

use nalgebra::Isometry3;

use super::ModelError;
use super::import::{ImportedArm, import};
use super::proof::configurations;
use super::tables::read_ur;
use super::transforms::{link_values, number, roll_pitch_yaw};
use super::urdf::Urdf;
use super::urdf_write;
use crate::kinematics::{Convention, ForwardKinematics, Joint, KinematicChain, Link};
use crate::profile::Profile;
use crate::text::printable;
use crate::units::{MILLIMETRE, to_mm};

/// Joints of these arms.
const JOINTS: usize = 6;
/// Distance (m) of a calibrated flange from the nominal one that no factory calibration reaches: it is one of another model.
const ANOTHER_MODEL: f64 = 50.0 * MILLIMETRE;
/// Configurations at which the two are compared.
const COMPARED: usize = 200;
/// The state of a calibration that the controller uses.
const LINEARISED: &str = "2";

/// A factory calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct FactoryArm {
    /// The calibrated arm.
    pub arm: ImportedArm,
    /// Largest distance between its flange and that of the nominal arm (m).
    pub moved: f64,
}

/// Reads a factory calibration of the robot of `profile`: `calibration.conf`, or the kinematics file of its ROS description.
///
/// # Errors
/// Neither of the two, incomplete, or of another model.
pub fn read_factory(text: &str, profile: &Profile) -> Result<FactoryArm, ModelError> {
    let nominal = profile.chain();
    if nominal.dof() != JOINTS {
        return Err(ModelError::Unsuitable(format!(
            "a factory calibration of Universal Robots is of {JOINTS} joints, and the profile has {}",
            nominal.dof()
        )));
    }
    let mut notes = Vec::new();
    let description = if text.contains("delta_theta") {
        let calibrated = with_deviations(text, nominal, &mut notes)?;
        urdf_write::fresh(profile.name(), &[], &calibrated, profile.joints())?
    } else if text.contains("shoulder:") {
        of_origins(&read_ur(text).map_err(|_incomplete| {
            ModelError::Unsuitable("a link or a number is missing; the file needs x, y, z, roll, pitch and yaw of shoulder, upper_arm, forearm, wrist_1, wrist_2 and wrist_3, one per line".to_owned())
        })?, nominal, profile)
    } else {
        let message = "it is neither a 'calibration.conf' (with delta_theta) nor a kinematics file of the ROS description (with shoulder:)";
        return Err(ModelError::Unsuitable(message.to_owned()));
    };
    let urdf = Urdf::parse(&description)?;
    let chain = urdf.chain(urdf_write::BASE, urdf_write::FLANGE)?;
    let mut arm = import(&chain, nominal.convention())?;
    arm.ranges = profile.joints().to_vec();
    arm.notes = notes;
    let (old, new) = (ForwardKinematics::new(nominal), ForwardKinematics::new(&arm.chain));
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let distance = |q: &Vec<f64>| {
        let (old, new) = (old.base_from_flange(q), new.base_from_flange(&link_values(&arm.chain, q)));
        (old.translation.vector - new.translation.vector).norm()
    };
    let moved = configurations(nominal, &limits, COMPARED).iter().map(distance).fold(0.0, f64::max);
    if moved > ANOTHER_MODEL || !moved.is_finite() {
        return Err(ModelError::Unsuitable(format!(
            "the calibrated flange is up to {:.0} mm from that of '{}'; the calibration is that of another model, or the numbers are not metres and radians",
            to_mm(moved),
            profile.name()
        )));
    }
    Ok(FactoryArm { arm, moved })
}

/// The nominal arm with the deviations of a `calibration.conf` added to its constants (rad, m).
fn with_deviations(
    text: &str,
    nominal: &KinematicChain,
    notes: &mut Vec<String>,
) -> Result<KinematicChain, ModelError> {
    if nominal.convention() != Convention::Standard {
        return Err(ModelError::Unsuitable(
            "the deviations belong to constants in the standard convention, and the profile is modified".to_owned(),
        ));
    }
    let [theta, a, d, alpha] = ["delta_theta", "delta_a", "delta_d", "delta_alpha"].map(|name| six(text, name));
    let (theta, a, d, alpha) = (theta?, a?, d?, alpha?);
    match value(text, "calibration_status") {
        Some(status) if status != LINEARISED => notes.push(format!(
            "calibration_status is {}, not {LINEARISED}: the controller itself may not use these deviations",
            printable(status)
        )),
        Some(_) | None => {}
    }
    let deviations = theta.into_iter().zip(a).zip(d).zip(alpha);
    let joints = nominal.joints().iter().zip(deviations).map(|(joint, (((theta, a), d), alpha))| Joint {
        link: Link {
            theta: joint.link.theta + theta,
            a: joint.link.a + a,
            d: joint.link.d + d,
            alpha: joint.link.alpha + alpha,
            ..joint.link
        },
        ..joint.clone()
    });
    Ok(KinematicChain::new(Convention::Standard, *nominal.base(), joints.collect(), *nominal.flange())?)
}

/// The value of `name = value # comment`, in whichever section.
fn value<'t>(text: &'t str, name: &str) -> Option<&'t str> {
    text.lines().find_map(|line| {
        let (key, value) = line.split_once('=')?;
        (key.trim() == name).then(|| value.split('#').next().unwrap_or_default().trim())
    })
}

/// The six numbers of `name = [ … ]`.
fn six(text: &str, name: &str) -> Result<[f64; JOINTS], ModelError> {
    let unsuitable = |what: &str| ModelError::Unsuitable(format!("'{name}' {what}"));
    let value = value(text, name).ok_or_else(|| unsuitable("is missing"))?;
    let inner = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let inner = inner.ok_or_else(|| unsuitable("is not a list in brackets"))?;
    let numbers: Option<Vec<f64>> =
        inner.split(',').map(|number| number.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    let numbers = numbers.ok_or_else(|| unsuitable("has something that is not a number"))?;
    <[f64; JOINTS]>::try_from(numbers)
        .map_err(|numbers| unsuitable(&format!("has {} numbers; {JOINTS} are needed", numbers.len())))
}

/// A description of joints that turn about the z axes of these frames.
fn of_origins(origins: &[Isometry3<f64>], nominal: &KinematicChain, profile: &Profile) -> String {
    let mut text = format!("<robot name=\"arm\">\n<link name=\"{}\"/>\n", urdf_write::BASE);
    let mut parent = urdf_write::BASE.to_owned();
    for (index, (origin, joint)) in origins.iter().zip(nominal.joints()).enumerate() {
        let child = format!("link_{}", index + 1);
        let range = profile.joints().get(index).and_then(|range| range.limits);
        let limit = range.map_or_else(String::new, |(low, high)| {
            format!("<limit lower=\"{}\" upper=\"{}\"/>", number(low), number(high))
        });
        text.extend([format!(
            "<link name=\"{child}\"/>\n<joint name=\"{}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"0 0 1\"/>{limit}</joint>\n",
            urdf_write::escaped(&joint.name),
            <[f64; 3]>::from(origin.translation.vector).map(number).join(" "),
            roll_pitch_yaw(&origin.rotation).map(number).join(" "),
        )]);
        parent = child;
    }
    text.extend([format!(
        "<link name=\"{flange}\"/>\n<joint name=\"end\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{flange}\"/></joint>\n</robot>\n",
        flange = urdf_write::FLANGE
    )]);
    text
}
