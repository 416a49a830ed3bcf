//! Puts further points into the linear moves of a program.
//!
//! A point is put in front of a move only where the move before it is written directly in front of it in the same block: then the arm
//! comes from there whenever the move runs. Each new line is a copy of the move with another point, passed without a stop.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use nalgebra::Isometry3;

use super::lexer::{as_str, line_end};
use super::motion::{Scan, Target};
use super::orientation::Orientation;
use super::{Dialect, Language};
use crate::inverse::Posture;
use crate::text::decimal;

/// A move in front of which points can be put.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Spot {
    /// Bytes from the beginning of its line to its end.
    pub(super) instruction: Range<usize>,
    pub(super) point: Range<usize>,
    /// What the copies have instead, besides the point, such as their zone.
    pub(super) changes: Vec<(Range<usize>, &'static str)>,
}

impl Spot {
    /// A spot for an instruction that is alone in front of its line's end; `None` if something else is on the line before it.
    pub(super) fn alone(text: &[u8], instruction: Range<usize>, point: Range<usize>) -> Option<Self> {
        let before = text.get(..instruction.start)?;
        let start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let is_alone = before.get(start..)?.iter().all(u8::is_ascii_whitespace);
        is_alone.then(|| Self { instruction: start..instruction.end, point, changes: Vec::new() })
    }
}

/// Points to put in front of a move.
#[derive(Clone, Debug, PartialEq)]
pub struct Insertion {
    /// Index of the move in [`Scan::moves`].
    pub step: usize,
    pub points: Vec<InsertedPoint>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct InsertedPoint {
    /// The tool in the frame of the move's target.
    pub frame_from_tool: Isometry3<f64>,
    /// Joint values of the nominal arm there (rad), and its branch.
    pub joints: Vec<f64>,
    pub posture: Option<Posture>,
}

/// Why no points can be put into programs of a language; `None` if they can.
pub const fn cannot_insert(dialect: Dialect) -> Option<&'static str> {
    match dialect {
        Dialect::Rapid | Dialect::Krl | Dialect::Urscript => None,
        Dialect::Fanuc => {
            Some("its points have numbers, and a program may compute the number of a point that it uses or writes")
        }
        Dialect::Val3 => Some("its points are in another file, whose arrays would change their size"),
        Dialect::Inform => {
            Some("its points have numbers in the order of the list, and other jobs and the pendant know them by number")
        }
        Dialect::Ros => Some("each of its points has a time, and the times of new ones belong to the planner"),
    }
}

/// Whether points can be put in front of a move.
pub fn has_spot(scan: &Scan, step: usize) -> bool {
    scan.moves.get(step).is_some_and(|step| step.spot.is_some() && step.target.is_some())
}

/// The program with these points. Insertions without a spot are left out.
pub fn insert(dialect: Dialect, program: &[u8], scan: &Scan, insertions: &[Insertion]) -> Vec<u8> {
    let line_end = line_end(program);
    let mut text = Vec::with_capacity(program.len());
    let mut done = 0;
    for insertion in insertions {
        let step = scan.moves.get(insertion.step);
        let spot = step.and_then(|step| step.spot.as_deref());
        let target = step.and_then(|step| step.target).and_then(|index| scan.targets.get(index));
        let (Some(spot), Some(target)) = (spot, target) else { continue };
        if spot.instruction.start < done {
            continue;
        }
        text.extend_from_slice(program.get(done..spot.instruction.start).unwrap_or_default());
        done = spot.instruction.start;
        for point in &insertion.points {
            let Some(literal) = literal(dialect, program, target, point) else { continue };
            text.extend(copy(program, spot, &literal));
            text.extend_from_slice(line_end.as_bytes());
        }
    }
    text.extend_from_slice(program.get(done..).unwrap_or_default());
    text
}

/// The instruction with another point.
fn copy(program: &[u8], spot: &Spot, point: &str) -> Vec<u8> {
    let mut edits: Vec<(Range<usize>, &str)> = spot.changes.clone();
    edits.push((spot.point.clone(), point));
    edits.sort_by_key(|(place, _)| place.start);
    let mut text = Vec::new();
    let mut done = spot.instruction.start;
    for (place, value) in edits {
        text.extend_from_slice(program.get(done..place.start).unwrap_or_default());
        text.extend_from_slice(value.as_bytes());
        done = place.end;
    }
    text.extend_from_slice(program.get(done..spot.instruction.end).unwrap_or_default());
    text
}

/// A pose as it is written inside an instruction.
fn literal(dialect: Dialect, program: &[u8], target: &Target, point: &InsertedPoint) -> Option<String> {
    let Language { digits, .. } = dialect.language();
    let numbers = |orientation: Orientation, old: &[f64]| -> Vec<String> {
        let values = orientation.write(&point.frame_from_tool, old);
        let decimals = |index: usize| if index < 3 { digits.length } else { digits.turn };
        values.iter().enumerate().map(|(index, value)| decimal(*value, decimals(index))).collect()
    };
    match dialect {
        Dialect::Rapid => {
            let numbers = numbers(Orientation::Quaternion, &[]);
            let (position, turn) = numbers.split_at_checked(3)?;
            let axes = external_axes(program, target)?;
            let branch = confdata(point)?;
            Some(format!("[[{}],[{}],{branch},{axes}]", position.join(","), turn.join(",")))
        }
        Dialect::Krl => {
            let numbers = numbers(Orientation::Zyx, &[]);
            let named =
                ["X", "Y", "Z", "A", "B", "C"].iter().zip(&numbers).map(|(name, value)| format!("{name} {value}"));
            Some(format!("{{{}}}", named.collect::<Vec<_>>().join(",")))
        }
        Dialect::Urscript => Some(format!("p[{}]", numbers(Orientation::Vector, &[]).join(", "))),
        Dialect::Fanuc | Dialect::Val3 | Dialect::Inform | Dialect::Ros => None,
    }
}

/// The list of external axes of a `robtarget`, as it is written.
fn external_axes<'p>(program: &'p [u8], target: &Target) -> Option<&'p str> {
    let behind = target.slots.last()?.place.end;
    let rest = program.get(behind..)?;
    // Behind the quaternion: its bracket, the configuration, the external axes.
    let open = |from: usize| rest.get(from..)?.iter().position(|byte| *byte == b'[').map(|at| from + at);
    let start = open(open(0)? + 1)?;
    let length = rest.get(start..)?.iter().position(|byte| *byte == b']')?;
    Some(as_str(program, behind + start..behind + start + length + 1)).filter(|text| !text.is_empty())
}

#[expect(clippy::cast_possible_truncation, reason = "joints turn a few times at most")]
fn confdata(point: &InsertedPoint) -> Option<String> {
    let posture = point.posture.as_ref()?;
    let quarter = |index: usize| Some((point.joints.get(index)? / FRAC_PI_2).floor() as i32);
    let bit = |is: bool, value: i32| if is { value } else { 0 };
    let form =
        bit(posture.wrist_is_behind, 4) + bit(posture.wrist_is_behind_lower_arm, 2) + bit(posture.wrist_is_negative, 1);
    Some(format!("[{},{},{},{form}]", quarter(0)?, quarter(3)?, quarter(5)?))
}
