//! Reads the XML of a PolyScope program (`.urp`, unpacked): the joint angles of fixed waypoints.
//!
//! A waypoint states its joint angles, from which PolyScope computes the pose of the tool that it writes into the script.

use std::ops::Range;

use super::super::configuration::Configuration;
use super::super::findings::{Findings, Literal, Motion, Source, Way};
use super::super::lexer::as_str;
use super::super::motion::{Form, JointUnit, Reason, Setting, Slot};
use super::super::xml::{Tag, Xml};

/// Whether a text is such a program.
pub(super) fn is_polyscope(text: &[u8]) -> bool {
    let start = text.trim_ascii_start();
    let is_xml = start.starts_with(b"<");
    is_xml && start.get(..start.len().min(4096)).is_some_and(|head| head.windows(10).any(|part| part == b"<URProgram"))
}

/// What encloses a tag.
#[derive(Clone, Debug)]
struct Around {
    name: String,
    /// Motion of a `Move` node.
    way: Option<Way>,
    waypoint: Option<Waypoint>,
}

#[derive(Clone, Debug)]
struct Waypoint {
    name: Option<String>,
    line: usize,
    is_fixed: bool,
    is_relative: bool,
    has_angles: bool,
}

/// Notes the waypoints of all files and the moves to them.
pub(super) fn read(source: &Source<'_>, findings: &mut Findings) {
    for (file, text) in source.files().filter(|(_, text)| is_polyscope(text)) {
        let xml = Xml::read(text);
        let mut around: Vec<Around> = Vec::new();
        for tag in xml.tags.iter().filter(|tag| !tag.name.starts_with('?') && !tag.name.starts_with('!')) {
            if tag.is_closing {
                while let Some(closed) = around.pop() {
                    leave(findings, file, &closed);
                    if closed.name == tag.name {
                        break;
                    }
                }
                continue;
            }
            if tag.name == "JointAngles" {
                angles(source, findings, file, &xml, tag, &mut around);
            }
            let entered = entered(&xml, tag);
            if entered.way.is_some() {
                findings.motions.push(None);
            }
            if !tag.is_empty {
                around.push(entered);
            }
        }
        findings.motions.push(None);
    }
}

fn entered(xml: &Xml<'_>, tag: &Tag) -> Around {
    let kind = |name: &str| tag.value(xml.text, name);
    let way = match (tag.name.as_str(), kind("motionType").as_deref()) {
        ("Move", Some("MoveJ")) => Some(Way::Joint),
        // The tool of these moves is in the installation, so their path is not judged.
        ("Move", _) => Some(Way::Streamed),
        _ => None,
    };
    let waypoint = (tag.name == "Waypoint").then(|| Waypoint {
        name: kind("name"),
        line: tag.line,
        is_fixed: kind("type").is_none_or(|kind| kind == "Fixed"),
        is_relative: kind("type").as_deref() == Some("Relative"),
        has_angles: false,
    });
    Around { name: tag.name.clone(), way, waypoint }
}

/// Names a waypoint that is no fixed one.
fn leave(findings: &mut Findings, file: usize, closed: &Around) {
    let Some(waypoint) = closed.waypoint.as_ref().filter(|_| file == 0) else { return };
    let reason = if waypoint.is_relative {
        Reason::Relative
    } else if !waypoint.is_fixed {
        Reason::Computed
    } else if waypoint.has_angles {
        return;
    } else {
        Reason::Untaught
    };
    findings.leave(waypoint.line, waypoint.name.clone(), reason);
}

/// The joint angles of the waypoint around them.
fn angles(source: &Source<'_>, findings: &mut Findings, file: usize, xml: &Xml<'_>, tag: &Tag, around: &mut [Around]) {
    let way = around.iter().rev().find_map(|outer| outer.way);
    let waypoint = around.iter_mut().rev().find_map(|outer| outer.waypoint.as_mut());
    let (Some(way), Some(waypoint)) = (way, waypoint.filter(|waypoint| waypoint.is_fixed && !waypoint.has_angles))
    else {
        return;
    };
    waypoint.has_angles = true;
    let content = tag.place("angles").ok_or(Reason::Untaught).and_then(|place| literal(source, xml.text, place));
    let point = findings.here(file, tag.line, content);
    if let Some(definition) = findings.definitions.last_mut() {
        definition.name.clone_from(&waypoint.name);
    }
    findings.motions.push(Some(Motion {
        file,
        line: tag.line,
        way,
        via: None,
        point,
        tool: Ok(Setting::Identity),
        frame: Ok(Setting::Identity),
        configuration: None,
        spot: None,
    }));
}

/// Numbers between commas (rad).
fn literal(source: &Source<'_>, text: &[u8], place: Range<usize>) -> Result<Literal, Reason> {
    let list = as_str(text, place.clone());
    let (mut slots, mut numbers, mut at) = (Vec::new(), Vec::new(), place.start);
    for part in list.split(',') {
        let number = part.trim();
        let start = at + part.len() - part.trim_start().len();
        numbers.push(number.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or(Reason::Unreadable)?);
        slots.push(Slot::at(start..start + number.len()));
        at += part.len() + 1;
    }
    let joints = source.robot.chain.dof();
    if numbers.len() != joints {
        return Err(Reason::JointCount { found: numbers.len(), joints });
    }
    Ok(Literal { form: Form::Joints(JointUnit::Si), slots, numbers, configuration: Configuration::Free })
}
