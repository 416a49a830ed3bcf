//! Motion instructions of RAPID with their arguments, and the values of tools and work objects.

use std::ops::Range;

use nalgebra::Isometry3;

use super::super::findings::Way;
use super::super::lexer::{Tokens, Value};
use super::super::motion::Reason;
use super::super::orientation::Orientation;

/// A motion instruction of RAPID and its options.
pub(super) struct Instruction {
    /// Positional argument with the first point.
    pub(super) first: usize,
    pub(super) points: usize,
    pub(super) way: Way,
    pub(super) is_joints: bool,
    /// Arguments between the last point and the tool.
    pub(super) tool: usize,
}

impl Instruction {
    /// Knows an instruction by its family and the letters behind it; routines of users are not instructions.
    pub(super) fn named(name: &str) -> Option<Self> {
        const FAMILIES: &[(&str, &[&str], usize)] = &[
            ("arcmove", &["", "sync"], 2),
            ("move", &["", "do", "ao", "go", "sync", "std"], 2),
            ("trigg", &["", "ios"], 3),
            ("arc", &["", "start", "end", "1", "2", "1start", "2start", "1end", "2end"], 4),
            ("spotm", &[""], 1),
            ("spot", &[""], 3),
            ("search", &[""], 1),
            ("paint", &[""], 2),
            ("disp", &[""], 3),
            ("cap", &[""], 5),
            ("nut", &[""], 3),
            ("cut", &[""], 3),
            ("laser", &["", "start", "end"], 4),
            ("glue", &[""], 3),
        ];
        let (rest, endings, tool) =
            FAMILIES.iter().find_map(|(family, endings, tool)| Some((name.strip_prefix(family)?, *endings, *tool)))?;
        let (letters, ending) = match rest.strip_prefix("absj") {
            Some(ending) => ("absj", ending),
            None => rest.split_at_checked(1)?,
        };
        if !endings.contains(&ending) {
            return None;
        }
        let (way, points, is_joints) = match letters {
            "absj" => (Way::Joint, 1, true),
            "j" => (Way::Joint, 1, false),
            "l" => (Way::Linear, 1, false),
            "c" => (Way::Circular, 2, false),
            _ => return None,
        };
        let first = if name.starts_with("search") { 2 } else { 0 };
        let tool = if ending == "ios" { 2 } else { tool };
        Some(Self { first, points, way, is_joints, tool })
    }
}

/// Arguments of an instruction.
pub(super) struct Arguments {
    /// Positional arguments, without the optional ones behind them.
    pub(super) heads: Vec<Range<usize>>,
    /// Index of the tool, known by the `\WObj` behind it.
    pub(super) tool: Option<usize>,
    pub(super) frame: Option<Range<usize>>,
}

impl Arguments {
    pub(super) fn read(tokens: &Tokens<'_>, range: Range<usize>) -> Self {
        let mut arguments = Self { heads: Vec::new(), tool: None, frame: None };
        for part in tokens.split(range) {
            let option = part.clone().find(|at| tokens.is(*at, b'\\')).unwrap_or(part.end);
            let head = tokens.trimmed(part.start..option);
            let is_positional = head.start < head.end;
            if is_positional {
                arguments.heads.push(head);
            }
            let options = option..part.end;
            if let Some(at) =
                options.clone().find(|at| tokens.is(at.wrapping_sub(1), b'\\') && tokens.is_word(*at, "WObj"))
            {
                let value = tokens.trimmed(at + 3..part.end);
                let end = value.clone().find(|at| tokens.is(*at, b'\\')).unwrap_or(value.end);
                arguments.frame = Some(tokens.trimmed(value.start..end));
                arguments.tool = is_positional.then(|| arguments.heads.len() - 1);
            }
        }
        arguments
    }
}

/// A pose `[[x,y,z],[q1,q2,q3,q4]]`.
pub(super) fn pose(value: &Value) -> Option<Isometry3<f64>> {
    let [position, orientation] = value.list()? else { return None };
    let numbers: Vec<f64> =
        position.numbers()?.iter().chain(&orientation.numbers()?).map(|number| number.value).collect();
    (numbers.len() == 7).then(|| Orientation::Quaternion.pose(&numbers)).flatten()
}

pub(super) fn is_true(tokens: &Tokens<'_>, value: &Value) -> Option<bool> {
    let Value::Other(range) = value else { return None };
    match tokens.word(range.start)?.to_ascii_lowercase().as_str() {
        "true" => Some(true),
        "false" => Some(false),
        _ => None,
    }
}

/// `tooldata`: `[robhold, tframe, tload]`.
pub(super) fn tool(tokens: &Tokens<'_>, value: &Value) -> Result<Isometry3<f64>, Reason> {
    let [holds, frame, ..] = value.list().unwrap_or_default() else { return Err(Reason::Unreadable) };
    match is_true(tokens, holds) {
        Some(true) => pose(frame).ok_or(Reason::Unreadable),
        Some(false) => Err(Reason::StationaryTool),
        None => Err(Reason::Unreadable),
    }
}

/// `wobjdata`: `[robhold, ufprog, ufmec, uframe, oframe]`.
pub(super) fn frame(tokens: &Tokens<'_>, value: &Value) -> Result<Isometry3<f64>, Reason> {
    let [holds, is_fixed, _, user, object] = value.list().unwrap_or_default() else { return Err(Reason::Unreadable) };
    match (is_true(tokens, holds), is_true(tokens, is_fixed)) {
        (Some(true), _) => Err(Reason::StationaryTool),
        (_, Some(false)) => Err(Reason::MovingFrame),
        (Some(false), Some(true)) => match (pose(user), pose(object)) {
            (Some(user), Some(object)) => Ok(user * object),
            _ => Err(Reason::Unreadable),
        },
        _ => Err(Reason::Unreadable),
    }
}
