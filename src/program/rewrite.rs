//! Finds and replaces the motion targets of existing robot programs. Everything else stays unchanged, byte by byte.
//!
//! A value is a target because a motion instruction of the given files uses it, by its type and name, never by its looks.
//! Whatever is not changed although it looks like a target or a motion uses it is listed with its reason. Joint values follow
//! the convention of the language, as in the programs written by this module.

use std::ops::Range;

use super::findings::Source;
use super::lexer::with_line_feeds;
pub use super::motion::{Command, Companion, ReadOptions};
use super::motion::{Form, Goal, Hint, JointUnit, Scan, Slot, Target};
use super::orientation::Orientation;
use super::{Dialect, Digits, ProgramError, Robot, gzip};
use crate::text::decimal;
use crate::units::{from_deg, to_deg};

/// Finds the motion targets of a program.
///
/// # Errors
/// The program is not text, or the arm's values in this dialect are unknown.
pub fn scan(dialect: Dialect, robot: &Robot<'_>, options: &ReadOptions, program: &[u8]) -> Result<Scan, ProgramError> {
    if gzip::is_packed(program) {
        return Err(ProgramError::Compressed);
    }
    if program.contains(&0) {
        return Err(ProgramError::NotText);
    }
    let program = &*with_line_feeds(program);
    let companions = options.companions.iter().map(|companion| with_line_feeds(&companion.text));
    let source = Source { robot, options, program, companions: &companions.collect::<Vec<_>>() };
    let mut scan = (dialect.language().read)(&source)?;
    scan.hints.extend(offline_system(program));
    scan.hints.extend(round_numbers(program, &scan.targets));
    Ok(scan)
}

/// Replaces the values of targets. `commands` has one entry per target of the scan; `None` keeps the target, and so does a
/// command of the other kind.
///
/// # Errors
/// The arm's values in this dialect are unknown.
pub fn rewrite(
    dialect: Dialect,
    robot: &Robot<'_>,
    program: &[u8],
    scan: &Scan,
    commands: &[Option<Command>],
) -> Result<Vec<u8>, ProgramError> {
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for (target, command) in scan.targets.iter().zip(commands) {
        let values = match (command, target.form) {
            (Some(Command::Joints(command)), Form::Joints(unit)) if command.len() == target.slots.len() => {
                from_pendant(unit, robot, command)?
            }
            (Some(Command::Pose(pose)), Form::Pose(orientation)) => {
                let old: Vec<f64> = target.slots.iter().map(|slot| value(program, slot).unwrap_or(0.0)).collect();
                orientation.write(pose, &old)
            }
            (Some(_), Form::Joints(_) | Form::Pose(_)) | (None, _) => continue,
        };
        for (index, (slot, value)) in target.slots.iter().zip(values).enumerate() {
            edits.extend(edit(dialect, program, target.form, index, slot, value));
        }
    }
    edits.sort_by_key(|(place, _)| place.start);
    let mut text = Vec::with_capacity(program.len() + 8 * edits.len());
    let mut done = 0;
    for (place, value) in edits {
        // Two targets never share a number; should a reader ever err, the second edit is dropped.
        if place.start < done {
            continue;
        }
        text.extend_from_slice(program.get(done..place.start).unwrap_or_default());
        text.extend_from_slice(value.as_bytes());
        done = place.end;
    }
    text.extend_from_slice(program.get(done..).unwrap_or_default());
    Ok(text)
}

/// The text that replaces a number.
fn edit(
    dialect: Dialect,
    program: &[u8],
    form: Form,
    index: usize,
    slot: &Slot,
    value: f64,
) -> Option<(Range<usize>, String)> {
    let digits = dialect.language().digits;
    let decimals = decimals(digits, form, index);
    if let Some(attribute) = &slot.attribute {
        let text = decimal(value / slot.scale, decimals);
        let is_zero = text.parse::<f64>().is_ok_and(|value| value == 0.0);
        return (!is_zero).then(|| (slot.place.clone(), format!(" {attribute}=\"{text}\"")));
    }
    let old = program.get(slot.place.clone()).unwrap_or_default();
    Some((slot.place.clone(), written(old, value / slot.scale, decimals, digits.are_fixed)))
}

/// Decimals of the number at this index of a target.
const fn decimals(digits: Digits, form: Form, index: usize) -> usize {
    match form {
        Form::Joints(JointUnit::Pulses) => 0,
        Form::Joints(JointUnit::Edge | JointUnit::Si | JointUnit::Links) => digits.joint,
        Form::Pose(_) if index < 3 => digits.length,
        Form::Pose(_) => digits.turn,
    }
}

/// A number with these decimals, or with those of the old value if it had more; as wide as the old field if that begins with
/// blanks.
fn written(old: &[u8], value: f64, decimals: usize, are_fixed: bool) -> String {
    let mantissa = old.split(|byte| matches!(byte, b'e' | b'E')).next().unwrap_or_default();
    let old_decimals = mantissa.iter().rev().position(|byte| *byte == b'.').unwrap_or(0);
    let decimals = if are_fixed { decimals } else { decimals.max(old_decimals).min(12) };
    let text = decimal(value, decimals);
    let has_blanks = old.first().is_some_and(|byte| *byte == b' ');
    if has_blanks { format!("{text:>width$}", width = old.len()) } else { text }
}

/// The value at a slot, in the units of its form.
fn value(program: &[u8], slot: &Slot) -> Option<f64> {
    let text = std::str::from_utf8(program.get(slot.place.clone())?).ok()?;
    let digits: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    digits.parse::<f64>().ok().map(|value| value * slot.scale)
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

/// Pendant values (rad), sliding joints (m).
pub(super) fn to_pendant(unit: JointUnit, robot: &Robot<'_>, values: &[f64]) -> Result<Vec<f64>, ProgramError> {
    let joints = robot.chain.joints();
    Ok(match unit {
        JointUnit::Edge => {
            values.iter().zip(joints).map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect()
        }
        JointUnit::Si => values.to_vec(),
        JointUnit::Pulses => values.iter().zip(pulses(robot)?).map(|(value, size)| from_deg(value / size)).collect(),
        JointUnit::Links => {
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

fn from_pendant(unit: JointUnit, robot: &Robot<'_>, q: &[f64]) -> Result<Vec<f64>, ProgramError> {
    let joints = robot.chain.joints();
    Ok(match unit {
        JointUnit::Edge => q.iter().zip(joints).map(|(q, joint)| joint.joint_type.quantity().to_edge(*q)).collect(),
        JointUnit::Si => q.to_vec(),
        JointUnit::Pulses => q.iter().zip(pulses(robot)?).map(|(q, size)| (to_deg(*q) * size).round()).collect(),
        JointUnit::Links => (0..joints.len()).map(|index| link_value(robot, index, q)).collect(),
    })
}

fn link_value(robot: &Robot<'_>, index: usize, q: &[f64]) -> f64 {
    robot.chain.joints().get(index).map_or(0.0, |joint| joint.direction * joint.variable(index, q))
}

/// Names of offline programming systems, as they write them into comments and headers.
const OFFLINE_SYSTEMS: &[&str] = &[
    "RoboDK",
    "RobotStudio",
    "Process Simulate",
    "RoboGuide",
    "Robotmaster",
    "SprutCAM",
    "KUKA|prc",
    "KUKA.Sim",
    "Grasshopper",
    "HAL Robotics",
    "Delmia",
    "Visual Components",
    "MotoSim",
    "Octopuz",
    "PowerMill",
    "Fusion 360",
    "hyperMILL",
    "COMPAS",
    "MoveIt",
    "FASTSUITE",
    "Mastercam",
];

/// Header in which the system that wrote the program names itself (bytes).
const HEADER: usize = 16 * 1024;

fn offline_system(program: &[u8]) -> Option<Hint> {
    let header = program.get(..HEADER.min(program.len()))?;
    let header = super::lexer::latin(header).to_ascii_lowercase();
    let is_word = |at: usize, name: &str| {
        let is_letter = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
        let (before, behind) = (header.get(..at), header.get(at + name.len()..));
        let follows = behind.and_then(|text| text.chars().next());
        !is_letter(before.and_then(|text| text.chars().next_back())) && !follows.is_some_and(char::is_alphabetic)
    };
    OFFLINE_SYSTEMS.iter().find_map(|name| {
        let lower = name.to_ascii_lowercase();
        let (at, _) = header.match_indices(&lower).find(|(at, _)| is_word(*at, &lower))?;
        let line = 1 + header.get(..at)?.bytes().filter(|byte| *byte == b'\n').count();
        Some(Hint::OfflineSystem { line, name })
    })
}

/// Counts whole numbers among the coordinates and joint values that are not zero.
fn round_numbers(program: &[u8], targets: &[Target]) -> Option<Hint> {
    let (mut round, mut values) = (0, 0);
    for target in targets {
        let (unit, count) = match (&target.goal, target.form) {
            (Goal::Pose(_), Form::Pose(Orientation::Vector)) => (1e-3, 3),
            (Goal::Pose(_), _) => (1.0, 3),
            (Goal::Joints(_), Form::Joints(JointUnit::Edge)) => (1.0, target.slots.len()),
            (Goal::Joints(_), _) => continue,
        };
        for value in target.slots.iter().take(count).filter_map(|slot| value(program, slot)) {
            let multiple = value / unit;
            if multiple.abs() > 1e-9 {
                values += 1;
                round += usize::from((multiple - multiple.round()).abs() < 1e-6);
            }
        }
    }
    (values > 0).then_some(Hint::RoundNumbers { round, values })
}
