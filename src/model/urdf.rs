//! Reading URDF: the joints of a robot description, and the serial chain between two of its links.
//!
//! What has no effect on the chain is no reason to refuse a file: defects are kept with the joint or link that they belong to, and
//! matter only once it is part of a chain.
//!
//! Only `<joint>` elements directly under `<robot>` are joints: transmissions, `ros2_control` and simulators have elements of
//! the same name that mean something else. Metres and radians, as in the format.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;
use std::ops::Range;

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use roxmltree::{Document, Node, ParsingOptions};
use thiserror::Error;

use super::transforms::{from_roll_pitch_yaw, motion};
use super::urdf_text::{beside_xacro, parseable};
use crate::kinematics::{JointType, LinkMass};
use crate::text::printable;
use crate::units::to_deg;

/// Most decimals of an angle that a person rounded.
const MOST_DECIMALS: usize = 5;
/// Rounding (rad) of which nothing is said: 10 µm at 1 m.
const NOT_WORTH_A_WORD: f64 = 1e-5;

/// A defect of a URDF.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum UrdfError {
    /// Not well-formed XML.
    #[error("line {line}, column {column}: not well-formed XML: {message}")]
    Xml {
        line: u32,
        column: u32,
        /// Message of the XML reader.
        message: String,
    },
    /// An element that cannot be used.
    #[error("line {line}: {element}: {message}")]
    Element {
        line: u32,
        /// The element with its name, such as `joint 'elbow'`.
        element: String,
        /// The defect, and what to do about it.
        message: String,
    },
    /// No chain between the links asked for.
    #[error("{0}")]
    Chain(String),
}

/// The motion of a joint of a URDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UrdfJointType {
    /// No motion.
    Fixed,
    /// Turning or sliding.
    Moving(JointType),
    /// `floating`, `planar` or an unknown word.
    Unsupported,
}

#[derive(Clone, Debug, PartialEq)]
pub struct UrdfJoint {
    pub name: String,
    /// Its motion.
    pub joint_type: UrdfJointType,
    /// The type as written in the file.
    pub type_name: String,
    /// Link before it.
    pub parent: String,
    /// Link after it.
    pub child: String,
    /// Frame of the joint at rest, in the link before it (m).
    pub origin: Isometry3<f64>,
    /// Axis in the frame of the joint.
    pub axis: Unit<Vector3<f64>>,
    /// Lowest and highest value ((rad) or (m)), if the file has a usable range.
    pub limits: Option<(f64, f64)>,
    /// Highest speed ((rad/s) or (m/s)).
    pub max_speed: Option<f64>,
    /// Joint that this one follows.
    pub mimic: Option<String>,
    /// Why it cannot be part of a chain.
    pub defect: Option<UrdfError>,
    /// Oddities, one sentence each.
    pub notes: Vec<String>,
    /// Line in the file, from 1.
    pub line: u32,
    /// Byte range of its `<origin>` element, or the position where one can be inserted.
    pub(super) origin_bytes: Range<usize>,
}

/// A robot description.
#[derive(Clone, Debug, PartialEq)]
pub struct Urdf {
    /// Name of the robot.
    pub robot: String,
    /// Links in the order of the file.
    pub links: Vec<String>,
    /// Joints in the order of the file.
    pub joints: Vec<UrdfJoint>,
    /// Masses of the links that have an `<inertial>`, with the centre in the frame of the link (m).
    pub masses: BTreeMap<String, LinkMass>,
    /// Masses that cannot be read, by link.
    pub mass_defects: BTreeMap<String, UrdfError>,
    /// Links with the name of another.
    pub repeated_links: BTreeMap<String, UrdfError>,
    /// Joints that connect nothing, because a name is missing or wrong.
    pub unplaced: Vec<UrdfError>,
}

/// The path between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfChain<'u> {
    /// From the base link up to the link where the way turns down; identity if the base is above the tip.
    pub base_from_top: Isometry3<f64>,
    /// The joints down to the tip, fixed ones among them.
    pub joints: Vec<&'u UrdfJoint>,
    /// What each moving joint carries up to the next one, with the centre in the frame of its child link (m): that link and all
    /// that is fixed to it, without what hangs on the tip.
    pub masses: Vec<LinkMass>,
    /// Links with a mass that are fixed to the tip: a tool.
    pub on_tip: Vec<&'u str>,
    /// A mass of the arm that cannot be read.
    pub mass_defect: Option<&'u UrdfError>,
}

impl Urdf {
    /// Reads a URDF.
    ///
    /// # Errors
    /// Not XML, or not a URDF.
    pub fn parse(text: &str) -> Result<Self, UrdfError> {
        let text = parseable(text);
        let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
        let document = Document::parse_with_options(&text, options).map_err(|error| UrdfError::Xml {
            line: error.pos().row,
            column: error.pos().col,
            message: printable(&error.to_string()),
        })?;
        let root = document.root_element();
        let reader = Reader { document: &document };
        if root.tag_name().name() != "robot" {
            let name = root.tag_name().name();
            return Err(reader.element(root, format!("<{}>", printable(name)), "a URDF begins with <robot>"));
        }
        if let Some(node) = root.descendants().find(|node| is_xacro(node)) {
            let message = "this is xacro, not URDF; expand it first: 'xacro FILE.xacro > FILE.urdf'";
            return Err(reader.element(node, format!("<xacro:{}>", printable(node.tag_name().name())), message));
        }
        let mut urdf = Self {
            robot: root.attribute("name").unwrap_or("robot").to_owned(),
            links: Vec::new(),
            joints: Vec::new(),
            masses: BTreeMap::new(),
            mass_defects: BTreeMap::new(),
            repeated_links: BTreeMap::new(),
            unplaced: Vec::new(),
        };
        let mut links: BTreeMap<&str, u32> = BTreeMap::new();
        for node in elements(root, "link") {
            let name = match reader.attribute(node, "<link>", "name") {
                Ok(name) => name,
                Err(defect) => {
                    urdf.unplaced.push(defect);
                    continue;
                }
            };
            if let Some(line) = links.get(name) {
                let message = format!("the link of line {line} has the same name");
                let defect = reader.element(node, format!("link '{}'", printable(name)), message);
                urdf.repeated_links.entry(name.to_owned()).or_insert(defect);
                continue;
            }
            links.insert(name, reader.line(node));
            urdf.links.push(name.to_owned());
            match elements(node, "inertial").next().map(|inertial| reader.mass(inertial, name)) {
                None => {}
                Some(Ok(mass)) => {
                    urdf.masses.insert(name.to_owned(), mass);
                }
                Some(Err(defect)) => {
                    urdf.mass_defects.insert(name.to_owned(), defect);
                }
            }
        }
        for node in elements(root, "joint") {
            match reader.joint(node, &links) {
                Ok(joint) => urdf.joints.push(joint),
                Err(defect) => urdf.unplaced.push(defect),
            }
        }
        Ok(urdf)
    }

    /// The chain from the frame of link `base` to that of link `tip`. From the base the way may lead up, but only over fixed
    /// joints (as from `base` to `base_link` on some robots).
    ///
    /// # Errors
    /// Links that do not exist or are not connected, a moving joint above the base, a joint that cannot be in a chain.
    pub fn chain(&self, base: &str, tip: &str) -> Result<UrdfChain<'_>, UrdfError> {
        for link in [base, tip] {
            if !self.links.iter().any(|known| known == link) {
                let known: Vec<String> = self.links.iter().map(|name| printable(name)).collect();
                let message = format!("there is no link '{}'; links: {}", printable(link), known.join(", "));
                return Err(UrdfError::Chain(message));
            }
        }
        let (up, down) = (self.above(base)?, self.above(tip)?);
        // Both lists of ancestors end at the root, so the common end of the lists is the part above the turning point.
        let shared = up.iter().rev().zip(down.iter().rev()).take_while(|(a, b)| a.name == b.name).count();
        let is_connected = root_of(&up, base) == root_of(&down, tip);
        let up: Vec<&UrdfJoint> = up.into_iter().rev().skip(shared).rev().collect();
        let down: Vec<&UrdfJoint> = down.into_iter().rev().skip(shared).collect();
        if !is_connected {
            let cause = self.unplaced.first().map_or_else(String::new, |defect| format!("; {defect}"));
            let message = format!("links '{}' and '{}' are not connected{cause}", printable(base), printable(tip));
            return Err(UrdfError::Chain(message));
        }
        self.check(&up, &down)?;
        let mut base_from_top = Isometry3::identity();
        for joint in up {
            if joint.joint_type != UrdfJointType::Fixed {
                let message = format!(
                    "the way from '{}' to '{}' leads up over this {} joint; use a base link above it",
                    printable(base),
                    printable(tip),
                    printable(&joint.type_name)
                );
                return Err(joint.error(message));
            }
            base_from_top *= joint.origin.inverse();
        }
        for joint in &down {
            if joint.joint_type == UrdfJointType::Unsupported {
                let message = format!(
                    "type '{}' is not part of a serial arm; allowed: fixed, revolute, continuous, prismatic",
                    printable(&joint.type_name)
                );
                return Err(joint.error(message));
            }
            if let Some(other) = &joint.mimic {
                let message = format!(
                    "it follows joint '{}' (<mimic>), so it does not move independently; use a tip link before it",
                    printable(other)
                );
                return Err(joint.error(message));
            }
        }
        let masses = self.carried(&down, tip);
        let mass_defect = self.unreadable_mass(&down, tip);
        let mut on_tip = Vec::new();
        self.fixed_to(tip, None, &mut |link, _| {
            if let Some((name, mass)) = self.masses.get_key_value(link)
                && link != tip
                && mass.mass > 0.0
            {
                on_tip.push(name.as_str());
            }
        });
        let chain = UrdfChain { base_from_top, joints: down, masses, on_tip, mass_defect };
        if chain.moving().next().is_none() {
            let message = format!("no joint moves between '{}' and '{}'", printable(base), printable(tip));
            return Err(UrdfError::Chain(message));
        }
        Ok(chain)
    }

    /// Refuses a way with a defect on it.
    fn check(&self, up: &[&UrdfJoint], down: &[&UrdfJoint]) -> Result<(), UrdfError> {
        let way: Vec<&UrdfJoint> = up.iter().chain(down).copied().collect();
        for (index, joint) in way.iter().enumerate() {
            if let Some(defect) = &joint.defect {
                return Err(defect.clone());
            }
            let repeated = [&joint.parent, &joint.child].into_iter().find_map(|link| self.repeated_links.get(link));
            if let Some(defect) = repeated {
                return Err(defect.clone());
            }
            if let Some(other) = way.iter().take(index).find(|other| other.name == joint.name) {
                return Err(joint.error(format!("the joint of line {} has the same name", other.line)));
            }
        }
        Ok(())
    }

    /// What each moving joint of `way` carries up to the next one.
    fn carried(&self, way: &[&UrdfJoint], tip: &str) -> Vec<LinkMass> {
        let moving = way.iter().filter(|joint| joint.joint_type != UrdfJointType::Fixed);
        moving
            .map(|joint| {
                let (mut mass, mut weighted) = (0.0, Vector3::zeros());
                self.fixed_to(&joint.child, Some(tip), &mut |link, pose| {
                    if let Some(own) = self.masses.get(link) {
                        mass += own.mass;
                        weighted += (pose * own.centre).coords * own.mass;
                    }
                });
                let centre = if mass > 0.0 { Point3::from(weighted / mass) } else { Point3::origin() };
                LinkMass { mass, centre }
            })
            .collect()
    }

    /// The first mass of the moving arm that cannot be read.
    fn unreadable_mass(&self, way: &[&UrdfJoint], tip: &str) -> Option<&UrdfError> {
        let mut found = None;
        for joint in way.iter().filter(|joint| joint.joint_type != UrdfJointType::Fixed) {
            self.fixed_to(&joint.child, Some(tip), &mut |link, _| {
                found = found.or_else(|| self.mass_defects.get(link));
            });
        }
        found
    }

    /// Visits a link and all that is fixed to it, with their poses in its frame. What hangs on the link `end` is left out.
    fn fixed_to(&self, link: &str, end: Option<&str>, visit: &mut dyn FnMut(&str, &Isometry3<f64>)) {
        let mut open = vec![(link, Isometry3::identity())];
        let mut visited = 0;
        while let Some((link, pose)) = open.pop() {
            visit(link, &pose);
            visited += 1;
            if Some(link) == end || visited > self.joints.len() {
                continue;
            }
            let fixed = self.joints.iter().filter(|joint| joint.joint_type == UrdfJointType::Fixed);
            open.extend(
                fixed.filter(|joint| joint.parent == link).map(|joint| (joint.child.as_str(), pose * joint.origin)),
            );
        }
    }

    /// The joints above a link, nearest first.
    fn above(&self, link: &str) -> Result<Vec<&UrdfJoint>, UrdfError> {
        let mut joints: Vec<&UrdfJoint> = Vec::new();
        let mut below = link;
        while let Some(joint) = self.joints.iter().find(|joint| joint.child == below) {
            if joints.len() > self.joints.len() {
                return Err(joint.error("it is part of a ring; a URDF is a tree".to_owned()));
            }
            if let Some(second) = self.joints.iter().find(|other| other.child == below && other.line != joint.line) {
                let message = format!(
                    "link '{}' already hangs on joint '{}' (line {}); a URDF is a tree",
                    printable(below),
                    printable(&joint.name),
                    joint.line
                );
                return Err(second.error(message));
            }
            joints.push(joint);
            below = &joint.parent;
        }
        Ok(joints)
    }
}

fn root_of<'a>(above: &[&'a UrdfJoint], link: &'a str) -> &'a str {
    above.last().map_or(link, |joint| joint.parent.as_str())
}

impl UrdfJoint {
    pub(super) fn error(&self, message: String) -> UrdfError {
        UrdfError::Element { line: self.line, element: format!("joint '{}'", printable(&self.name)), message }
    }
}

impl<'u> UrdfChain<'u> {
    /// The joints that move, with their types.
    pub fn moving(&self) -> impl Iterator<Item = (&'u UrdfJoint, JointType)> {
        self.joints.iter().filter_map(|joint| match joint.joint_type {
            UrdfJointType::Moving(joint_type) => Some((*joint, joint_type)),
            UrdfJointType::Fixed | UrdfJointType::Unsupported => None,
        })
    }

    /// Pose of the tip in the base at these joint values ((rad) or (m)); missing ones are zero.
    pub fn base_from_tip(&self, values: &[f64]) -> Isometry3<f64> {
        let mut values = values.iter();
        let mut pose = self.base_from_top;
        for joint in &self.joints {
            pose *= joint.origin;
            if let UrdfJointType::Moving(joint_type) = joint.joint_type {
                pose *= motion(joint_type, &joint.axis, values.next().copied().unwrap_or(0.0));
            }
        }
        pose
    }
}

fn elements<'a, 'i>(parent: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    parent.children().filter(move |node| node.is_element() && node.tag_name().name() == name)
}

fn is_xacro(node: &Node<'_, '_>) -> bool {
    node.is_element() && node.tag_name().namespace().is_some_and(|space| space.contains("xacro"))
}

/// Says of an angle that is a rounded multiple of 45° which one may be meant.
fn rounded_angle(joint: &str, text: &str) -> Option<String> {
    let value: f64 = text.parse().ok().filter(|value: &f64| value.is_finite())?;
    let decimals = text.rsplit_once('.').map_or(0, |(_, decimals)| decimals.len());
    let exact = (value / FRAC_PI_4).round() * FRAC_PI_4;
    let off = (value - exact).abs();
    // Rounded or cut off at its last decimal; a measured angle near 90° is neither.
    let is_rounded =
        (2..=MOST_DECIMALS).contains(&decimals) && off < 0.1_f64.powi(i32::try_from(decimals).unwrap_or(i32::MAX));
    (is_rounded && exact.abs() > 0.0 && off > NOT_WORTH_A_WORD).then(|| {
        format!(
            "joint '{}': {text} rad is {:.4} deg; if {:.0} deg is meant, write {exact}",
            printable(joint),
            to_deg(value),
            to_deg(exact)
        )
    })
}

/// Lowest and highest value, and highest speed.
type RangeAndSpeed = (Option<(f64, f64)>, Option<f64>);

/// Adds line numbers to errors.
struct Reader<'d, 'i> {
    document: &'d Document<'i>,
}

impl Reader<'_, '_> {
    fn line(&self, node: Node<'_, '_>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn element(&self, node: Node<'_, '_>, element: String, message: impl Into<String>) -> UrdfError {
        UrdfError::Element { line: self.line(node), element, message: message.into() }
    }

    fn attribute<'a>(&self, node: Node<'a, '_>, element: &str, name: &str) -> Result<&'a str, UrdfError> {
        let value = node.attribute(name).filter(|value| !value.trim().is_empty());
        value.ok_or_else(|| self.element(node, element.to_owned(), format!("has no attribute '{name}'")))
    }

    /// Mass and centre of an `<inertial>` of this link.
    fn mass(&self, node: Node<'_, '_>, link: &str) -> Result<LinkMass, UrdfError> {
        let what = format!("<inertial> of link '{}'", printable(link));
        let Some(mass) = elements(node, "mass").next() else {
            return Err(self.element(node, what, "has no <mass>"));
        };
        let element = format!("<mass> of link '{}'", printable(link));
        let text = self.attribute(mass, &element, "value")?;
        let value = self.finite(mass, &element, "value", text)?;
        if value < 0.0 {
            return Err(self.element(mass, element, format!("{value} kg is below zero")));
        }
        let centre = match elements(node, "origin").next() {
            Some(origin) => self.triple(origin, &format!("<origin> of the {what}"), "xyz")?.unwrap_or([0.0; 3]),
            None => [0.0; 3],
        };
        Ok(LinkMass { mass: value, centre: Point3::from(centre) })
    }

    fn joint(&self, node: Node<'_, '_>, links: &BTreeMap<&str, u32>) -> Result<UrdfJoint, UrdfError> {
        let name = self.attribute(node, "<joint>", "name")?;
        let what = format!("joint '{}'", printable(name));
        let type_name = self.attribute(node, &what, "type")?;
        let joint_type = match type_name {
            "fixed" => UrdfJointType::Fixed,
            "revolute" | "continuous" => UrdfJointType::Moving(JointType::Revolute),
            "prismatic" => UrdfJointType::Moving(JointType::Prismatic),
            _ => UrdfJointType::Unsupported,
        };
        let link = |tag: &'static str| {
            let Some(node) = elements(node, tag).next() else {
                return Err(self.element(node, what.clone(), format!("has no <{tag}>")));
            };
            let link = self.attribute(node, &format!("<{tag}> of {what}"), "link")?;
            if links.contains_key(link) {
                return Ok(link.to_owned());
            }
            let message = format!("there is no link '{}'", printable(link));
            Err(self.element(node, format!("<{tag}> of {what}"), message))
        };
        let (parent, child) = (link("parent")?, link("child")?);
        let mut joint = UrdfJoint {
            name: name.to_owned(),
            joint_type,
            type_name: type_name.to_owned(),
            parent,
            child,
            origin: Isometry3::identity(),
            axis: Vector3::x_axis(),
            limits: None,
            max_speed: None,
            mimic: elements(node, "mimic").next().map(|mimic| mimic.attribute("joint").unwrap_or("?").to_owned()),
            defect: None,
            notes: Vec::new(),
            line: self.line(node),
            // There is a child: <parent> was found.
            origin_bytes: node.first_child().map_or_else(
                || node.range().start..node.range().start,
                |child| child.range().start..child.range().start,
            ),
        };
        let origins: Vec<Node<'_, '_>> = elements(node, "origin").collect();
        if let Some(second) = origins.get(1) {
            joint.defect = Some(self.element(*second, format!("<origin> of {what}"), "the joint has two of them"));
        } else if let Some(origin) = origins.first() {
            joint.origin_bytes = origin.range();
            match self.origin(*origin, &format!("<origin> of {what}")) {
                Ok(pose) => joint.origin = pose,
                Err(defect) => joint.defect = Some(defect),
            }
            let angles = origin.attribute("rpy").unwrap_or_default();
            joint.notes.extend(angles.split_whitespace().filter_map(|angle| rounded_angle(&joint.name, angle)));
        }
        // A fixed joint has no axis and no limits, whatever stands there.
        if matches!(joint_type, UrdfJointType::Moving(_)) {
            match self.axis(node, &what) {
                Ok(axis) => joint.axis = axis,
                Err(defect) => joint.defect = joint.defect.or(Some(defect)),
            }
            let (limits, max_speed) = self.limits(node, type_name, &mut joint.notes, &what);
            (joint.limits, joint.max_speed) = (limits, max_speed);
        }
        Ok(joint)
    }

    fn origin(&self, origin: Node<'_, '_>, element: &str) -> Result<Isometry3<f64>, UrdfError> {
        let position = self.triple(origin, element, "xyz")?.unwrap_or([0.0; 3]);
        let angles = self.triple(origin, element, "rpy")?.unwrap_or([0.0; 3]);
        Ok(from_roll_pitch_yaw(position, angles))
    }

    fn axis(&self, node: Node<'_, '_>, what: &str) -> Result<Unit<Vector3<f64>>, UrdfError> {
        let axis = match elements(node, "axis").next() {
            Some(axis) => self.triple(axis, &format!("<axis> of {what}"), "xyz")?.unwrap_or([1.0, 0.0, 0.0]),
            None => [1.0, 0.0, 0.0],
        };
        let axis = Unit::try_new(Vector3::from(axis), 1e-9);
        axis.ok_or_else(|| self.element(node, format!("<axis> of {what}"), "it has no direction"))
    }

    /// Range and speed. An empty range (such as `lower="0" upper="0"`), an endless and a reversed one count as none; the geometry does
    /// not depend on them.
    fn limits(&self, node: Node<'_, '_>, type_name: &str, notes: &mut Vec<String>, what: &str) -> RangeAndSpeed {
        let Some(limit) = elements(node, "limit").next() else { return (None, None) };
        let mut value = |name: &str| {
            let text = limit.attribute(name)?.trim();
            match text.parse::<f64>() {
                Ok(value) => Some(value).filter(|value| value.is_finite()),
                Err(_not_a_number) => {
                    let line = self.line(limit);
                    let shown = printable(text);
                    notes.push(format!(
                        "line {line}: {what}: {name} '{shown}' is not a number and is left out{}",
                        beside_xacro(text)
                    ));
                    None
                }
            }
        };
        let speed = value("velocity").filter(|speed| *speed > 0.0);
        let ends = (value("lower"), value("upper"));
        let is_stated = |name: &str| limit.has_attribute(name);
        // An end that is not stated is zero, one that is endless is none.
        let (low, high) = match ends {
            (None, Some(high)) if !is_stated("lower") => (0.0, high),
            (Some(low), None) if !is_stated("upper") => (low, 0.0),
            (Some(low), Some(high)) => (low, high),
            _ => return (None, speed),
        };
        if low > high && type_name != "continuous" {
            notes.push(format!(
                "line {}: {what}: lower {low} is above upper {high}, taken as no limits",
                self.line(limit)
            ));
        }
        ((low < high && type_name != "continuous").then_some((low, high)), speed)
    }

    fn finite(&self, node: Node<'_, '_>, element: &str, name: &str, text: &str) -> Result<f64, UrdfError> {
        let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| {
            let xacro = beside_xacro(text);
            let message = format!("attribute '{name}' has '{}', which is not a number{xacro}", printable(text));
            self.element(node, element.to_owned(), message)
        })
    }

    fn triple(&self, node: Node<'_, '_>, element: &str, name: &str) -> Result<Option<[f64; 3]>, UrdfError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let values: Result<Vec<f64>, _> =
            text.split_whitespace().map(|word| self.finite(node, element, name, word)).collect();
        <[f64; 3]>::try_from(values?).map(Some).map_err(|values| {
            let message = format!("attribute '{name}' needs three numbers, it has {}", values.len());
            self.element(node, element.to_owned(), message)
        })
    }
}
