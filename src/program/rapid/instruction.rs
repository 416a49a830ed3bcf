//! Motion instructions of RAPID with their arguments, and the values of tools and work objects.

use std::ops::Range;

use nalgebra::Isometry3;

use super::super::findings::Way;
use super::super::lexer::{Kind, Tokens, Value};
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

/// The place behind a label `again:` or a placeholder `<SMT>`, which hide the instruction behind them.
pub(super) fn behind_label(tokens: &Tokens<'_>, at: usize) -> Option<usize> {
    if tokens.is(at, b'<') && tokens.word(at + 1).is_some() && tokens.is(at + 2, b'>') {
        return Some(at + 3);
    }
    let is_label = tokens.word(at).is_some() && tokens.is(at + 1, b':') && !tokens.is(at + 2, b'=');
    is_label.then_some(at + 2)
}

/// Whether an instruction shifts the targets of the moves that follow it.
pub(super) fn displaces(word: &str) -> bool {
    ["pdispon", "pdispset", "eoffson", "eoffsset"].iter().any(|name| word.eq_ignore_ascii_case(name))
}

/// Names, in lower case, of the variables that a file assigns, as a whole or in part. Searches all tokens, as an assignment
/// may be behind the condition of an `IF` without `THEN`.
pub(super) fn assigned(tokens: &Tokens<'_>) -> Vec<String> {
    let assigns = (0..tokens.len()).filter(|at| tokens.is(*at, b':') && tokens.is(at + 1, b'='));
    assigns.filter_map(|assign| assigned_name(tokens, assign)).collect()
}

/// The variable in front of `:=`, without its components and indices; none for declarations and optional arguments.
fn assigned_name(tokens: &Tokens<'_>, assign: usize) -> Option<String> {
    let mut at = previous(tokens, assign)?;
    loop {
        if tokens.is(at, b'}') {
            let open = (0..at).rev().find(|place| tokens.is(*place, b'{'))?;
            at = previous(tokens, open)?;
        }
        let name = tokens.name(at)?;
        let before = previous(tokens, at);
        if let Some(dot) = before.filter(|before| tokens.is(*before, b'.')) {
            at = previous(tokens, dot)?;
            continue;
        }
        let is_other = |before: usize| {
            tokens.is(before, b'\\') || tokens.is_word(before, "tooldata") || tokens.is_word(before, "wobjdata")
        };
        return (!before.is_some_and(is_other)).then(|| name.to_lowercase());
    }
}

/// The token before this place that is no line end.
fn previous(tokens: &Tokens<'_>, at: usize) -> Option<usize> {
    (0..at).rev().find(|place| tokens.get(*place).is_some_and(|token| token.kind != Kind::LineEnd))
}
