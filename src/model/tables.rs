//! Tables of link constants: CSV for spreadsheets, JSON for programs, and the parameter file of the ROS driver for
//! Universal Robots. Each with its reader.

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::ModelError;
use super::transforms::{JointFrames, from_roll_pitch_yaw, is_coupled, number, roll_pitch_yaw, screw_z};
use crate::kinematics::{Convention, Joint, JointType, KinematicChain, Link};
use crate::profile::Target;
use crate::text::printable;
use crate::units::{from_deg, from_mm, to_deg, to_mm};

/// Version of the layout of the JSON.
const SCHEMA: u32 = 1;

/// `model.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelText {
    schema: u32,
    robot: String,
    about: Vec<String>,
    /// `standard` or `modified`.
    convention: ConventionText,
    base: PoseText,
    joints: Vec<JointText>,
    flange: PoseText,
    targets: Vec<TargetText>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ConventionText {
    Standard,
    Modified,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum JointTypeText {
    Revolute,
    Prismatic,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseText {
    xyz_mm: [f64; 3],
    rpy_deg: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkText {
    alpha_deg: f64,
    a_mm: f64,
    d_mm: f64,
    theta_deg: f64,
    beta_deg: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointText {
    name: String,
    r#type: JointTypeText,
    direction: f64,
    coupling: Vec<f64>,
    identified: LinkText,
    nominal: LinkText,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetText {
    name: String,
    xyz_mm: [f64; 3],
}

impl From<&Isometry3<f64>> for PoseText {
    fn from(pose: &Isometry3<f64>) -> Self {
        let xyz_mm = pose.translation.vector.map(to_mm).into();
        Self { xyz_mm, rpy_deg: roll_pitch_yaw(&pose.rotation).map(to_deg) }
    }
}

impl From<PoseText> for Isometry3<f64> {
    fn from(text: PoseText) -> Self {
        from_roll_pitch_yaw(text.xyz_mm.map(from_mm), text.rpy_deg.map(from_deg))
    }
}

impl From<Link> for LinkText {
    fn from(link: Link) -> Self {
        Self {
            alpha_deg: to_deg(link.alpha),
            a_mm: to_mm(link.a),
            d_mm: to_mm(link.d),
            theta_deg: to_deg(link.theta),
            beta_deg: to_deg(link.beta),
        }
    }
}

impl From<LinkText> for Link {
    fn from(text: LinkText) -> Self {
        Self {
            alpha: from_deg(text.alpha_deg),
            a: from_mm(text.a_mm),
            d: from_mm(text.d_mm),
            theta: from_deg(text.theta_deg),
            beta: from_deg(text.beta_deg),
        }
    }
}

/// The arm as JSON; constants of the identified and the nominal arm side by side.
pub(super) fn write_json(
    robot: &str,
    about: &[String],
    nominal: &KinematicChain,
    identified: &KinematicChain,
    targets: &[Target],
) -> Result<String, ModelError> {
    let joints = identified.joints().iter().zip(nominal.joints());
    let text = ModelText {
        schema: SCHEMA,
        robot: robot.to_owned(),
        about: about.to_vec(),
        convention: match identified.convention() {
            Convention::Standard => ConventionText::Standard,
            Convention::Modified => ConventionText::Modified,
        },
        base: identified.base().into(),
        joints: joints
            .map(|(joint, nominal)| JointText {
                name: joint.name.clone(),
                r#type: match joint.joint_type {
                    JointType::Revolute => JointTypeText::Revolute,
                    JointType::Prismatic => JointTypeText::Prismatic,
                },
                direction: joint.direction,
                coupling: joint.coupling.clone(),
                identified: joint.link.into(),
                nominal: nominal.link.into(),
            })
            .collect(),
        flange: identified.flange().into(),
        targets: targets
            .iter()
            .map(|target| TargetText {
                name: target.name.clone(),
                xyz_mm: target.position_in_flange.coords.map(to_mm).into(),
            })
            .collect(),
    };
    let text = serde_json::to_string_pretty(&text).map_err(|error| ModelError::ReadBack(error.to_string()))?;
    Ok(text + "\n")
}

/// The identified arm of such a JSON.
pub(super) fn read_json(text: &str) -> Result<KinematicChain, ModelError> {
    let model: ModelText = serde_json::from_str(text).map_err(|error| ModelError::ReadBack(error.to_string()))?;
    let convention = match model.convention {
        ConventionText::Standard => Convention::Standard,
        ConventionText::Modified => Convention::Modified,
    };
    let joints = model.joints.into_iter().map(|joint| Joint {
        name: joint.name,
        joint_type: match joint.r#type {
            JointTypeText::Revolute => JointType::Revolute,
            JointTypeText::Prismatic => JointType::Prismatic,
        },
        link: joint.identified.into(),
        direction: joint.direction,
        coupling: joint.coupling,
    });
    Ok(KinematicChain::new(convention, model.base.into(), joints.collect(), model.flange.into())?)
}

/// Columns of the CSV before those of the couplings.
const COLUMNS: [&str; 8] = ["joint", "type", "alpha_deg", "a_mm", "d_mm", "theta_deg", "beta_deg", "direction"];

/// The table of link constants. Values of the whole arm are above it, in lines `# name: value`.
pub(super) fn write_csv(about: &[String], chain: &KinematicChain) -> Result<String, ModelError> {
    let failed = |error: &dyn std::error::Error| ModelError::ReadBack(error.to_string());
    let mut text: String = about.iter().flat_map(|line| ["# ".to_owned(), printable(line), "\n".to_owned()]).collect();
    let (convention, product) = match chain.convention() {
        Convention::Standard => ("standard", "Rot(z,theta) Trans(z,d) Trans(x,a) Rot(x,alpha) Rot(y,beta)"),
        Convention::Modified => ("modified", "Rot(x,alpha) Trans(x,a) Rot(y,beta) Rot(z,theta) Trans(z,d)"),
    };
    text.extend([format!("# {product}; joint values add to theta (revolute) or d (prismatic)\n")]);
    text.extend([format!("# convention: {convention}\n")]);
    for (name, pose) in [("base", chain.base()), ("flange", chain.flange())] {
        let PoseText { xyz_mm, rpy_deg } = pose.into();
        let values: Vec<String> = xyz_mm.into_iter().chain(rpy_deg).map(number).collect();
        text.extend([format!("# {name} x y z (mm), roll pitch yaw (deg): {}\n", values.join(" "))]);
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    let couplings = chain.joints().iter().map(|joint| format!("coupling_{}", joint.name));
    let header: Vec<String> = COLUMNS.map(str::to_owned).into_iter().chain(couplings).collect();
    writer.write_record(&header).map_err(|error| failed(&error))?;
    for joint in chain.joints() {
        let LinkText { alpha_deg, a_mm, d_mm, theta_deg, beta_deg } = joint.link.into();
        let joint_type = match joint.joint_type {
            JointType::Revolute => "revolute",
            JointType::Prismatic => "prismatic",
        };
        let mut cells = vec![printable(&joint.name), joint_type.to_owned()];
        cells.extend([alpha_deg, a_mm, d_mm, theta_deg, beta_deg, joint.direction].map(number));
        let coupling = |index: usize| joint.coupling.get(index).copied().unwrap_or(0.0);
        cells.extend((0..chain.dof()).map(|index| number(coupling(index))));
        writer.write_record(&cells).map_err(|error| failed(&error))?;
    }
    let table = writer.into_inner().map_err(|error| failed(&error))?;
    text.push_str(&String::from_utf8(table).map_err(|error| failed(&error))?);
    Ok(text)
}

/// The arm of such a table.
pub(super) fn read_csv(text: &str) -> Result<KinematicChain, ModelError> {
    let missing = |what: &str| ModelError::ReadBack(format!("there is no {what}"));
    let value = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix("# ")?.strip_prefix(name)?.split_once(": "));
        line.map(|(_, value)| value).ok_or_else(|| missing(name))
    };
    let pose = |name: &str| -> Result<Isometry3<f64>, ModelError> {
        let numbers: Vec<f64> = value(name)?.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [x, y, z, roll, pitch, yaw] = numbers[..] else { return Err(missing(name)) };
        Ok(PoseText { xyz_mm: [x, y, z], rpy_deg: [roll, pitch, yaw] }.into())
    };
    let convention = match text.lines().find_map(|line| line.strip_prefix("# convention: ")) {
        Some("standard") => Convention::Standard,
        Some("modified") => Convention::Modified,
        _ => return Err(missing("convention")),
    };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let mut joints = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| ModelError::ReadBack(error.to_string()))?;
        let numbers: Vec<f64> = record.iter().skip(2).filter_map(|cell| cell.parse().ok()).collect();
        let (Some(name), Some([alpha, a, d, theta, beta, direction, coupling @ ..])) = (record.get(0), numbers.get(..))
        else {
            return Err(missing("complete row"));
        };
        let link = LinkText { alpha_deg: *alpha, a_mm: *a, d_mm: *d, theta_deg: *theta, beta_deg: *beta };
        let joint_type = if record.get(1) == Some("prismatic") { JointType::Prismatic } else { JointType::Revolute };
        joints.push(Joint {
            name: name.to_owned(),
            joint_type,
            link: link.into(),
            direction: *direction,
            coupling: coupling.to_vec(),
        });
    }
    Ok(KinematicChain::new(convention, pose("base")?, joints, pose("flange")?)?)
}

/// Links of a Universal Robots arm in the ROS description, from base to flange.
const UR_LINKS: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// An arm in the parameters of the ROS description of Universal Robots, and the rest behind the last axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct UrKinematics {
    pub(super) text: String,
    /// Pose of the flange in the last link: identity, or the part that a tool must carry.
    pub(super) flange_in_wrist_3: Isometry3<f64>,
}

/// Writes `kinematics: shoulder: {x, y, z, roll, pitch, yaw} …`: origins of the joints, each turning about its own z.
pub(super) fn write_ur(about: &[String], chain: &KinematicChain) -> Result<UrKinematics, ModelError> {
    let unsuitable = |reason: &str| {
        let message = format!("the UR kinematics file is for arms of Universal Robots only: {reason}");
        Err(ModelError::Unsuitable(message))
    };
    if chain.dof() != UR_LINKS.len() || chain.joints().iter().any(|joint| joint.joint_type != JointType::Revolute) {
        return unsuitable("six turning joints are needed; this arm has other joints");
    }
    if chain.joints().iter().any(is_coupled) {
        return unsuitable("coupled joints are not possible; this arm has some");
    }
    if chain.joints().iter().any(|joint| joint.direction < 0.0) {
        return unsuitable("all joints must turn positively about +z; this arm has one that turns the other way");
    }
    let mut frames = JointFrames::new(chain);
    // What turns about and moves along the last axis belongs to its origin.
    let (along, rest) = split_screw(&frames.tail);
    if let Some(last) = frames.origins.last_mut() {
        *last *= along;
    }
    let mut text: String = about.iter().flat_map(|line| ["# ".to_owned(), printable(line), "\n".to_owned()]).collect();
    text.push_str(
        "# Metres and radians. There is no 'hash': the driver cannot tell whether it belongs to the robot. Check it.\n",
    );
    if rest != Isometry3::identity() {
        let PoseText { xyz_mm, rpy_deg } = (&rest).into();
        text.extend([format!(
            "# The flange is not on axis 6: add to every tool, in front of it, x y z {} mm, roll pitch yaw {} deg.\n",
            xyz_mm.map(number).join(" "),
            rpy_deg.map(number).join(" ")
        )]);
    }
    text.push_str("kinematics:\n");
    for (name, origin) in UR_LINKS.iter().zip(&frames.origins) {
        let [x, y, z]: [f64; 3] = origin.translation.vector.into();
        let [roll, pitch, yaw] = roll_pitch_yaw(&origin.rotation);
        text.extend([format!("  {name}:\n")]);
        for (field, value) in [("x", x), ("y", y), ("z", z), ("roll", roll), ("pitch", pitch), ("yaw", yaw)] {
            text.extend([format!("    {field}: {}\n", number(value))]);
        }
    }
    Ok(UrKinematics { text, flange_in_wrist_3: rest })
}

/// Splits a pose into the part that a joint about z can carry, and the rest.
fn split_screw(pose: &Isometry3<f64>) -> (Isometry3<f64>, Isometry3<f64>) {
    let x = pose.rotation * nalgebra::Vector3::x();
    let along = screw_z(x.y.atan2(x.x), pose.translation.vector.z);
    let rest = along.inverse() * pose;
    let is_none = rest.translation.vector.norm() < 1e-12 && rest.rotation.angle() < 1e-12;
    (along, if is_none { Isometry3::identity() } else { rest })
}

/// The origins of such a file.
pub(super) fn read_ur(text: &str) -> Result<Vec<Isometry3<f64>>, ModelError> {
    let mut origins: Vec<(String, [Option<f64>; 6])> = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#') && line.starts_with("  ")) {
        let Some((name, value)) = line.trim().split_once(':') else { continue };
        if value.is_empty() {
            origins.push((name.to_owned(), [None; 6]));
            continue;
        }
        let place = ["x", "y", "z", "roll", "pitch", "yaw"].iter().position(|field| *field == name);
        if let (Some(place), Some((_, values))) = (place, origins.last_mut())
            && let Some(slot) = values.get_mut(place)
        {
            *slot = value.trim().parse().ok();
        }
    }
    let origins: Option<Vec<Isometry3<f64>>> = UR_LINKS
        .iter()
        .map(|name| {
            let (_, values) = origins.iter().find(|(known, _)| known == name)?;
            let [x, y, z, roll, pitch, yaw] = *values;
            Some(from_roll_pitch_yaw([x?, y?, z?], [roll?, pitch?, yaw?]))
        })
        .collect();
    origins.ok_or_else(|| ModelError::ReadBack("a link or a number of it is missing".to_owned()))
}
