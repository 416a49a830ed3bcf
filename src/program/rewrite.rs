//! Finds and replaces the joint targets of existing robot programs. Everything else stays unchanged, byte by byte.
//!
//! Nothing is guessed. Unreadable joint targets are reported with their line and left unchanged; so are Cartesian targets, which
//! do not state a configuration. Values follow the convention of the dialect, as in the programs written by this module.

mod dialects;
mod scanner;

use std::ops::Range;

use super::{Dialect, ProgramError, Robot};
use crate::text::decimal;
use crate::units::{from_deg, to_deg};

/// A joint target in a program.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTarget {
    /// Line, from 1.
    pub line: usize,
    /// Pendant configuration (rad), sliding joints (m).
    pub configuration: Vec<f64>,
    fields: Vec<Range<usize>>,
}

/// A line that is not changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftAlone {
    /// Line, from 1.
    pub line: usize,
    /// Reason why it is not changed.
    pub reason: &'static str,
}

/// Joint targets of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// Joint targets in the order of the text.
    pub targets: Vec<JointTarget>,
    /// Lines that look like targets but are not changed.
    pub left: Vec<LeftAlone>,
}

pub(super) const CARTESIAN: &str = "a Cartesian target; it states no configuration";
pub(super) const UNREADABLE: &str = "looks like a joint target, but is not a list of plain numbers, one per joint";
pub(super) const RELATIVE: &str = "a relative move";

/// Finds the joint targets of a program. `joint_names` are the joint names of a ROS trajectory, from base to flange; by default
/// those of the profile.
///
/// # Errors
/// The program is not text, or the arm's values in this dialect are unknown.
pub fn scan(
    dialect: Dialect,
    robot: &Robot<'_>,
    joint_names: Option<&[String]>,
    program: &[u8],
) -> Result<Scan, ProgramError> {
    if program.contains(&0) {
        return Err(ProgramError::NotText);
    }
    let dof = robot.chain.dof();
    let mut found = dialects::find(dialect, dof, program);
    let order = if dialect == Dialect::Ros { ros_order(robot, joint_names, program)? } else { (0..dof).collect() };
    let mut scan = Scan { targets: Vec::new(), left: std::mem::take(&mut found.left) };
    for target in found.targets {
        // Reorder the values from the order of the text to that of the arm.
        let fields: Vec<Range<usize>> = order.iter().filter_map(|index| target.fields.get(*index).cloned()).collect();
        let values: Option<Vec<f64>> = fields.iter().map(|field| number(program, field)).collect();
        match values {
            Some(values) if values.len() == dof && values.iter().all(|value| value.abs() < 1e7) => {
                let configuration = to_pendant(dialect, robot, &values)?;
                scan.targets.push(JointTarget { line: target.line, configuration, fields });
            }
            _ => scan.left.push(LeftAlone { line: target.line, reason: UNREADABLE }),
        }
    }
    scan.left.sort_by_key(|left| left.line);
    scan.left.dedup();
    Ok(scan)
}

/// Replaces the configurations of a program. `commands` has one entry per target of the scan; `None` keeps the target.
///
/// # Errors
/// The arm's values in this dialect are unknown.
pub fn rewrite(
    dialect: Dialect,
    robot: &Robot<'_>,
    program: &[u8],
    scan: &Scan,
    commands: &[Option<Vec<f64>>],
) -> Result<Vec<u8>, ProgramError> {
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for (target, command) in scan.targets.iter().zip(commands) {
        let Some(command) = command else { continue };
        for (field, value) in target.fields.iter().zip(from_pendant(dialect, robot, command)?) {
            let old = program.get(field.clone()).unwrap_or_default();
            edits.push((field.clone(), written(dialect, old, value)));
        }
    }
    edits.sort_by_key(|(field, _)| field.start);
    let mut text = Vec::with_capacity(program.len() + 8 * edits.len());
    let mut done = 0;
    for (field, value) in edits {
        text.extend_from_slice(program.get(done..field.start).unwrap_or_default());
        text.extend_from_slice(value.as_bytes());
        done = field.end;
    }
    text.extend_from_slice(program.get(done..).unwrap_or_default());
    Ok(text)
}

/// A number with the digits of the dialect, or with those of the old value if it had more; as wide as the old field.
fn written(dialect: Dialect, old: &[u8], value: f64) -> String {
    let usual = match dialect {
        Dialect::Fanuc => 3,
        Dialect::Rapid | Dialect::Krl | Dialect::Val3 => 5,
        Dialect::Urscript | Dialect::Ros => 8,
        Dialect::Inform => 0,
    };
    let old_decimals = old.iter().rev().position(|byte| *byte == b'.').unwrap_or(0);
    let decimals = if dialect == Dialect::Inform { 0 } else { usual.max(old_decimals).min(12) };
    let blanks = old.iter().take_while(|byte| **byte == b' ').count();
    let text = decimal(value, decimals);
    if blanks > 0 { format!("{text:>width$}", width = old.len()) } else { text }
}

fn number(program: &[u8], field: &Range<usize>) -> Option<f64> {
    let text = std::str::from_utf8(program.get(field.clone())?).ok()?;
    text.trim().parse::<f64>().ok().filter(|value| value.is_finite())
}

fn is_coupled(robot: &Robot<'_>) -> bool {
    robot.chain.joints().iter().any(|joint| joint.coupling.iter().any(|coefficient| *coefficient != 0.0))
}

/// Pulses per degree of all joints.
fn pulses(robot: &Robot<'_>) -> Result<Vec<f64>, ProgramError> {
    let joints = robot.chain.joints();
    if is_coupled(robot) {
        let coupled = joints.iter().find(|joint| joint.coupling.iter().any(|c| *c != 0.0));
        let joint = coupled.map_or_else(String::new, |joint| super::names::ascii(&joint.name));
        return Err(ProgramError::CoupledPulses { joint });
    }
    let given = |index: usize| robot.pulses_per_degree.get(index).copied().flatten().filter(|size| *size != 0.0);
    let missing: Vec<String> = joints
        .iter()
        .enumerate()
        .filter(|(index, _)| given(*index).is_none())
        .map(|(_, joint)| super::names::ascii(&joint.name))
        .collect();
    if missing.is_empty() {
        Ok((0..joints.len()).filter_map(given).collect())
    } else {
        Err(ProgramError::PulsesPerDegree { joints: missing })
    }
}

fn to_pendant(dialect: Dialect, robot: &Robot<'_>, values: &[f64]) -> Result<Vec<f64>, ProgramError> {
    let joints = robot.chain.joints();
    Ok(match dialect {
        Dialect::Rapid | Dialect::Krl | Dialect::Fanuc | Dialect::Val3 => {
            values.iter().zip(joints).map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect()
        }
        Dialect::Urscript => values.to_vec(),
        Dialect::Inform => values.iter().zip(pulses(robot)?).map(|(value, size)| from_deg(value / size)).collect(),
        Dialect::Ros => {
            // A joint of a URDF turns a link relative to the previous one, so its value includes the coupled ones. Couplings are
            // triangular in all known arms, so this iteration removes one coupling after the other; a wrong result would fail the
            // later check.
            let mut q = values.to_vec();
            for _ in 0..joints.len() {
                let links: Vec<f64> = (0..joints.len()).map(|index| link_value(robot, index, &q)).collect();
                for ((q, value), link) in q.iter_mut().zip(values).zip(links) {
                    *q += value - link;
                }
            }
            q
        }
    })
}

fn from_pendant(dialect: Dialect, robot: &Robot<'_>, q: &[f64]) -> Result<Vec<f64>, ProgramError> {
    let joints = robot.chain.joints();
    Ok(match dialect {
        Dialect::Rapid | Dialect::Krl | Dialect::Fanuc | Dialect::Val3 => {
            q.iter().zip(joints).map(|(q, joint)| joint.joint_type.quantity().to_edge(*q)).collect()
        }
        Dialect::Urscript => q.to_vec(),
        Dialect::Inform => q.iter().zip(pulses(robot)?).map(|(q, size)| (to_deg(*q) * size).round()).collect(),
        Dialect::Ros => (0..joints.len()).map(|index| link_value(robot, index, q)).collect(),
    })
}

fn link_value(robot: &Robot<'_>, index: usize, q: &[f64]) -> f64 {
    robot.chain.joints().get(index).map_or(0.0, |joint| joint.direction * joint.variable(index, q))
}

/// For each joint of the arm, its index in the lists of the trajectory.
fn ros_order(robot: &Robot<'_>, joint_names: Option<&[String]>, program: &[u8]) -> Result<Vec<usize>, ProgramError> {
    let expected: Vec<String> = joint_names.map_or_else(
        || robot.chain.joints().iter().map(|joint| super::names::ascii(&joint.name)).collect(),
        <[String]>::to_vec,
    );
    let found = dialects::ros_names(program);
    let order: Option<Vec<usize>> = expected.iter().map(|name| found.iter().position(|known| known == name)).collect();
    match order {
        Some(order) if found.len() == expected.len() => Ok(order),
        _ => Err(ProgramError::JointNames { found, expected }),
    }
}
