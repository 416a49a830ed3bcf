//! Reads URScript: literal joint vectors and poses, and the motion functions that use them, as PolyScope and people write them.

mod flow;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::Isometry3;

use self::flow::{Block, is_block, is_of_controller, is_routine};
use super::super::ProgramError;
use super::super::configuration::Configuration;
use super::super::findings::{Definition, Findings, Key, Literal, Motion, OtherUse, Point, Source, Way};
use super::super::insert::Spot;
use super::super::lexer::{Kind, Number, Rules, Tokens, Value};
use super::super::motion::{Form, JointUnit, Reason, Scan, Setting, Slot};
use super::super::orientation::Orientation;
use super::polyscope;
use crate::units::DEGREE;

const RULES: Rules = Rules { comment: b"#", quotes: b"\"'", in_words: b"" };

/// Name of the tool that the installation of the robot sets.
const TCP: &str = "tcp";

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let mut findings = Findings::default();
    polyscope::read(source, &mut findings);
    // A program tree has no script; its file has no tokens, so that the others keep their numbers.
    let script_of = |text: &'_ [u8]| if polyscope::is_polyscope(text) { 0..0 } else { 0..text.len() };
    let files: Vec<Tokens<'_>> =
        source.files().map(|(_, text)| Tokens::part(text, script_of(text), 1, RULES)).collect();
    let mut script = Script {
        joints: source.robot.chain.dof(),
        constants: BTreeMap::new(),
        routines: BTreeSet::new(),
        setters: BTreeSet::new(),
    };
    for (file, tokens) in files.iter().enumerate() {
        script.collect(tokens, &statement_ends(tokens), file);
        script.collect_routines(tokens, file);
    }
    for (file, tokens) in files.iter().enumerate() {
        let ends = statement_ends(tokens);
        let mut reader = Reader {
            script: &script,
            tokens,
            ends: &ends,
            file,
            tool: None,
            tools: Vec::new(),
            unset: Vec::new(),
            is_set_late: false,
            is_unclear: false,
            routine: 0,
            has_moved: false,
            blocks: Vec::new(),
            before: None,
            behind_motion: None,
        };
        reader.read(&mut findings);
        reader.complete_tools(&mut findings);
        findings.motions.push(None);
    }
    findings.resolve(source)
}

/// Literal value of a variable with the place of the assignment.
type Assigned = ((usize, usize), Constant);

/// Constants of all files.
struct Script {
    joints: usize,
    constants: BTreeMap<String, Vec<Assigned>>,
    /// Names of the functions and threads of all files.
    routines: BTreeSet<String>,
    /// File and routine of each `set_tcp`.
    setters: BTreeSet<(usize, usize)>,
}

#[derive(Clone, Debug, PartialEq)]
enum Constant {
    Joints(Vec<f64>),
    Pose(Isometry3<f64>),
}

impl Script {
    fn collect(&mut self, tokens: &Tokens<'_>, ends: &[usize], file: usize) {
        for at in 0..tokens.len() {
            let Some(assignment) = Assignment::at(tokens, ends, at) else { continue };
            let literal = literal(tokens, assignment.value.clone(), self.joints);
            if let (Some(Ok(literal)), Some(name)) = (literal, tokens.name(at)) {
                let constant = match literal.form {
                    Form::Joints(_) => Some(Constant::Joints(literal.numbers)),
                    Form::Pose(form) => form.pose(&literal.numbers).map(Constant::Pose),
                };
                self.constants.entry(name).or_default().extend(constant.map(|constant| ((file, at), constant)));
            }
        }
    }

    fn collect_routines(&mut self, tokens: &Tokens<'_>, file: usize) {
        // The routine around each open block.
        let mut around: Vec<usize> = Vec::new();
        let mut routine = 0;
        for at in 0..tokens.len() {
            if is_routine(tokens, at) {
                around.push(routine);
                routine = at + 1;
                self.routines.extend(tokens.name(at + 1));
            } else if is_block(tokens, at) {
                around.push(routine);
            } else if tokens.word(at) == Some("end") {
                routine = around.pop().unwrap_or(0);
            } else if tokens.word(at) == Some("set_tcp") && tokens.is(at + 1, b'(') {
                self.setters.insert((file, routine));
            }
        }
    }

    /// Whether a routine other than this one sets the tool.
    fn is_set_elsewhere(&self, routine: (usize, usize)) -> bool {
        self.setters.iter().any(|setter| *setter != routine)
    }

    /// The value of a variable at a place: the last assignment in front of it, or else the first.
    fn constant(&self, name: &str, place: (usize, usize)) -> Option<&Constant> {
        let all = self.constants.get(name)?;
        let split = all.partition_point(|(assigned, _)| *assigned < place);
        all.get(split.saturating_sub(1)).map(|(_, constant)| constant)
    }
}

/// `name = value`.
struct Assignment {
    value: Range<usize>,
}

impl Assignment {
    fn at(tokens: &Tokens<'_>, ends: &[usize], at: usize) -> Option<Self> {
        tokens.word(at)?;
        if !tokens.is(at + 1, b'=') || tokens.is(at + 2, b'=') {
            return None;
        }
        let is_start = at.checked_sub(1).is_none_or(|before| {
            tokens.get(before).is_none_or(|token| token.kind == Kind::LineEnd)
                || tokens.is_word(before, "global")
                || tokens.is_word(before, "local")
        });
        is_start.then(|| Self { value: at + 2..end_of(ends, at + 2) })
    }
}

/// For each token the end of its statement: the next line end outside brackets. Behind a bracket that is never closed every line
/// end counts, so that it does not swallow the file.
fn statement_ends(tokens: &Tokens<'_>) -> Vec<usize> {
    let kind = |at: usize| tokens.get(at).map(|token| token.kind);
    let mut open: Vec<usize> = Vec::new();
    let mut is_end = vec![false; tokens.len()];
    for (at, is_end) in is_end.iter_mut().enumerate() {
        match kind(at) {
            Some(Kind::Symbol(b'(' | b'[' | b'{')) => open.push(at),
            Some(Kind::Symbol(b')' | b']' | b'}')) => drop(open.pop()),
            Some(Kind::LineEnd) => *is_end = open.is_empty(),
            _ => {}
        }
    }
    let torn = open.first().copied().unwrap_or(tokens.len());
    let mut next = tokens.len();
    let mut ends = vec![next; tokens.len()];
    for (at, (end, is_end)) in ends.iter_mut().zip(is_end).enumerate().rev() {
        if is_end || at >= torn && kind(at) == Some(Kind::LineEnd) {
            next = at;
        }
        *end = next;
    }
    ends
}

fn end_of(ends: &[usize], at: usize) -> usize {
    ends.get(at).copied().unwrap_or(ends.len())
}

struct Reader<'r, 'a> {
    script: &'r Script,
    tokens: &'r Tokens<'a>,
    ends: &'r [usize],
    file: usize,
    /// Tool that the routine has set; an error if it is unknown which of several.
    tool: Option<Result<Setting, Reason>>,
    /// All different tools of the file.
    tools: Vec<Setting>,
    /// Motions in front of any `set_tcp` of their routine, and the routine.
    unset: Vec<(usize, usize)>,
    /// A `set_tcp` follows a motion of its function: the tool before it is unknown.
    is_set_late: bool,
    /// When a `set_tcp` runs is unknown: it is in a condition or loop, or in a routine that is called there or between moves.
    is_unclear: bool,
    /// The routine around this place: 1 + the place of its `def`; 0: none.
    routine: usize,
    /// The routine has moved the arm.
    has_moved: bool,
    blocks: Vec<Block>,
    /// Joint values of the last move that states them.
    before: Option<Vec<f64>>,
    /// Place behind the last motion.
    behind_motion: Option<usize>,
}

impl Reader<'_, '_> {
    fn read(&mut self, findings: &mut Findings) {
        let (tokens, ends) = (self.tokens, self.ends);
        let mut at = 0;
        while at < tokens.len() {
            if is_routine(tokens, at) {
                findings.motions.push(None);
                self.open(at, true);
                // A body may follow on the same line.
                at = tokens.behind(at + 2, end_of(ends, at)).max(at + 1);
            } else if is_block(tokens, at) {
                self.open(at, false);
                at += 1;
            } else if matches!(tokens.word(at), Some("elif" | "else")) {
                self.branch();
                at += 1;
            } else if tokens.word(at) == Some("end") {
                self.close();
                at += 1;
            } else if tokens.word(at).is_some() && tokens.is(at + 1, b'(') {
                at = self.call(findings, at);
            } else if let Some(assignment) = Assignment::at(tokens, ends, at) {
                at = self.assignment(findings, at, &assignment);
            } else {
                self.component(findings, at);
                at += 1;
            }
        }
    }

    /// `q[0] = …`.
    fn component(&self, findings: &mut Findings, at: usize) {
        let tokens = self.tokens;
        let is_start =
            at.checked_sub(1).is_none_or(|before| tokens.get(before).is_none_or(|token| token.kind == Kind::LineEnd));
        if !is_start || !tokens.is(at + 1, b'[') || self.file != 0 {
            return;
        }
        let Some(name) = tokens.name(at) else { return };
        let end = tokens.behind(at + 1, (at + 64).min(tokens.len()));
        let is_known =
            self.script.constants.contains_key(&name) || findings.copies.iter().any(|(copy, _)| copy.name == name);
        if tokens.is(end, b'=') && !tokens.is(end + 1, b'=') && is_known {
            findings.leave(tokens.line(at), Some(name), Reason::Component);
        }
    }

    fn assignment(&self, findings: &mut Findings, at: usize, assignment: &Assignment) -> usize {
        let tokens = self.tokens;
        let Some(name) = tokens.name(at) else { return at + 1 };
        let value = assignment.value.clone();
        let key = Key { scope: 0, name: name.clone(), element: String::new() };
        let line = tokens.line(at);
        if let Some(content) = literal(tokens, value.clone(), self.script.joints) {
            findings.definitions.push(Definition {
                file: self.file,
                line,
                name: Some(name),
                key,
                content,
                is_quiet: true,
            });
            return value.end;
        }
        for (index, part) in elements(tokens, value.clone()).into_iter().enumerate() {
            let Some(content) = literal(tokens, part.clone(), self.script.joints) else { continue };
            findings.definitions.push(Definition {
                file: self.file,
                line: tokens.line(part.start),
                name: Some(format!("{name}[{index}]")),
                key: Key { element: index.to_string(), ..key.clone() },
                content,
                is_quiet: true,
            });
        }
        let inner = self.argument(value.clone());
        if self.is_other_tool(&inner) {
            // Moves to it would take the active tool.
            if self.file == 0 {
                findings.leave(line, Some(name), Reason::SeveralSettings);
            }
            return value.start;
        }
        match tokens.name(inner.range.start).filter(|_| inner.range.len() == 1) {
            Some(original) if tokens.word(inner.range.start).is_some() => {
                findings.copies.push((key, Key { scope: 0, name: original, element: String::new() }));
                value.end
            }
            // The value may contain calls.
            _ => value.start,
        }
    }

    fn call(&mut self, findings: &mut Findings, at: usize) -> usize {
        let tokens = self.tokens;
        let name = tokens.str(at);
        let end = tokens.behind(at + 1, end_of(self.ends, at));
        let inside = at + 2..end.saturating_sub(1);
        if name == "set_tcp" {
            self.set_tool(inside);
            return end;
        }
        let Some(instruction) = Instruction::named(name) else {
            self.other_call(name);
            if !is_of_controller(name) {
                self.arguments(findings, name, inside);
            }
            return at + 2;
        };
        let parts = tokens.split(inside);
        let mut points = Vec::new();
        let mut frame = Setting::Identity;
        let mut configuration = None;
        let mut has_other_tool = false;
        for (index, keyword) in instruction.keywords.iter().enumerate() {
            let named =
                parts.iter().find(|part| tokens.is_word(part.start, keyword) && tokens.is(part.start + 1, b'='));
            let Some(part) = named.or_else(|| parts.get(index)).or_else(|| parts.first()) else { continue };
            let argument = self.argument(without_keyword(tokens, part.clone()));
            frame = argument.frame.clone();
            has_other_tool |= self.is_other_tool(&argument);
            configuration = argument.near.clone().map(Configuration::Near);
            points.push(self.point(findings, &argument));
        }
        let Some(point) = points.pop() else { return at + 2 };
        let near = match &configuration {
            Some(Configuration::Near(values)) => Some(values.clone()),
            // The variable may come from `get_inverse_kin` with its own `qnear`.
            _ if instruction.way != Way::Linear && self.is_without_value(&point, at) => None,
            _ => self.before.clone(),
        };
        self.before = self.joints_after(findings, instruction.way, &point, near.as_ref(), at);
        let tool = if has_other_tool {
            Err(Reason::SeveralSettings)
        } else {
            if self.tool.is_none() {
                self.unset.push((findings.motions.len(), self.routine));
            }
            self.tool.clone().unwrap_or_else(|| Ok(Setting::Named(TCP.to_owned())))
        };
        self.has_moved = true;
        findings.motions.push(Some(Motion {
            file: self.file,
            line: tokens.line(at),
            way: instruction.way,
            via: points.pop().map(Box::new),
            point,
            tool,
            frame: Ok(frame),
            configuration: near.map(Configuration::Near),
            spot: if name == "movel" { self.spot(at, end, &parts).map(Box::new) } else { None },
        }));
        self.behind_motion = Some(end);
        end
    }

    /// A `movel` in the line behind another motion: its copies are passed with a small radius.
    fn spot(&self, at: usize, end: usize, parts: &[Range<usize>]) -> Option<Spot> {
        let tokens = self.tokens;
        let is_line_end = |at: usize| tokens.get(at).is_some_and(|token| token.kind == Kind::LineEnd);
        let mut between = self.behind_motion?;
        while between < at {
            // PolyScope marks its nodes with lines that begin with a dollar sign.
            let is_mark = tokens.is(between, b'$');
            while is_mark && between < at && !is_line_end(between) {
                between += 1;
            }
            if !is_line_end(between) {
                return None;
            }
            between += 1;
        }
        let named = |part: &Range<usize>| tokens.word(part.start).filter(|_| tokens.is(part.start + 1, b'='));
        let positional = parts.iter().filter(|part| named(part).is_none()).count();
        let has = |name: &str| parts.iter().any(|part| named(part) == Some(name));
        let point = parts.iter().find(|part| named(part) == Some("pose")).or_else(|| parts.first())?;
        let argument = self.argument(without_keyword(tokens, point.clone()));
        if self.file != 0 || positional > 3 || has("t") || argument.near.is_some() || !is_line_end(end) {
            return None;
        }
        let instruction = tokens.bytes(at..end);
        let close = instruction.end - 1;
        let spot = Spot::alone(tokens.text, instruction, tokens.bytes(argument.range))?;
        let changes = if has("r") { Vec::new() } else { vec![(close..close, ", r=0.001")] };
        Some(Spot { changes, ..spot })
    }

    /// Names positions that are handed to a routine whose use of them is unknown.
    fn arguments(&self, findings: &mut Findings, routine: &str, inside: Range<usize>) {
        let tokens = self.tokens;
        for part in tokens.split(inside) {
            let part = self.bare(without_keyword(tokens, part));
            if literal(tokens, part.clone(), self.script.joints).is_some() {
                if self.file == 0 {
                    findings.leave(tokens.line(part.start), None, Reason::PassedTo(routine.to_owned()));
                }
            } else if let Some(name) = tokens.name(part.start).filter(|_| part.len() == 1) {
                let key = Key { scope: 0, name, element: String::new() };
                findings.other_uses.push(OtherUse { key, reason: Reason::PassedTo(routine.to_owned()) });
            }
        }
    }

    /// Whether a point is a variable without a single literal value.
    fn is_without_value(&self, point: &Point, at: usize) -> bool {
        match point {
            Point::Variable { name, .. } => self.script.constant(name, (self.file, at)).is_none(),
            Point::Here(_) | Point::Left { .. } | Point::Current => false,
        }
    }

    /// Joint values whose branch the arm has after a move; `None` if its target is unknown.
    fn joints_after(
        &self,
        findings: &Findings,
        way: Way,
        point: &Point,
        near: Option<&Vec<f64>>,
        at: usize,
    ) -> Option<Vec<f64>> {
        match point {
            Point::Here(index) => match &findings.definitions.get(*index)?.content {
                Ok(literal) if matches!(literal.form, Form::Joints(_)) => Some(literal.numbers.clone()),
                Ok(_) => near.cloned(),
                Err(_) => None,
            },
            Point::Variable { name, .. } => match self.script.constant(name, (self.file, at)) {
                Some(Constant::Joints(numbers)) => Some(numbers.clone()),
                Some(Constant::Pose(_)) => near.cloned(),
                // A straight move to an element of a list of poses keeps the branch.
                None if way == Way::Linear => {
                    let is_listed = findings.definitions.iter().any(|definition| definition.key.name == *name);
                    near.filter(|_| is_listed).cloned()
                }
                None => None,
            },
            Point::Left { .. } | Point::Current => None,
        }
    }

    /// Whether `get_inverse_kin` states a tool that is not known to be the active one.
    fn is_other_tool(&self, argument: &Argument) -> bool {
        match (&argument.tool, &self.tool) {
            (None, _) => false,
            (Some(Setting::Known { pose: stated, .. }), Some(Ok(Setting::Known { pose, .. }))) => stated != pose,
            (Some(_), _) => true,
        }
    }

    /// The tool that `get_inverse_kin` states: `tcp=`, the fifth argument, or a pose in front of it.
    fn stated_tool(&self, parts: &[Range<usize>]) -> Option<Setting> {
        let tokens = self.tokens;
        parts.iter().enumerate().skip(1).find_map(|(index, part)| {
            let is_named = tokens.word(part.start).is_some() && tokens.is(part.start + 1, b'=');
            if is_named && !tokens.is_word(part.start, "tcp") {
                return None;
            }
            let tool = self.setting(self.bare(without_keyword(tokens, part.clone())), "tcp");
            (is_named || index >= 4 || matches!(tool, Setting::Known { .. })).then_some(tool)
        })
    }

    /// Takes `get_inverse_kin(…)` and `pose_trans(…)` off a point.
    fn argument(&self, range: Range<usize>) -> Argument {
        let tokens = self.tokens;
        let mut argument = Argument { range: self.bare(range), frame: Setting::Identity, near: None, tool: None };
        for _ in 0..DEEPEST {
            let start = argument.range.start;
            let is_whole =
                tokens.is(start + 1, b'(') && tokens.behind(start + 1, argument.range.end) == argument.range.end;
            if !is_whole {
                break;
            }
            let parts = tokens.split(start + 2..argument.range.end.saturating_sub(1));
            if tokens.is_word(start, "get_inverse_kin") {
                let near = parts
                    .iter()
                    .skip(1)
                    .find(|part| tokens.is_word(part.start, "qnear") || !tokens.is(part.start + 1, b'='));
                if let Some(part) = near {
                    argument.near = self.joints(without_keyword(tokens, part.clone()));
                }
                argument.tool = argument.tool.or_else(|| self.stated_tool(&parts));
                let Some(first) = parts.first() else { break };
                argument.range = self.bare(without_keyword(tokens, first.clone()));
            } else if tokens.is_word(start, "pose_trans") && argument.frame == Setting::Identity {
                let [frame, point] = parts.as_slice() else { break };
                argument.frame = self.setting(frame.clone(), "frame");
                argument.range = self.bare(point.clone());
            } else {
                break;
            }
        }
        argument
    }

    /// A range without parentheses around it.
    fn bare(&self, range: Range<usize>) -> Range<usize> {
        let tokens = self.tokens;
        let mut range = tokens.trimmed(range);
        for _ in 0..DEEPEST {
            let is_open = range.len() > 2 && tokens.is(range.start, b'(') && tokens.is(range.end - 1, b')');
            if !is_open || tokens.behind(range.start, range.end) != range.end {
                break;
            }
            range = tokens.trimmed(range.start + 1..range.end - 1);
        }
        range
    }

    fn joints(&self, range: Range<usize>) -> Option<Vec<f64>> {
        match literal(self.tokens, range.clone(), self.script.joints) {
            Some(Ok(literal)) if matches!(literal.form, Form::Joints(_)) => Some(literal.numbers),
            Some(_) => None,
            None => match self.script.constant(&self.tokens.name(range.start)?, (self.file, range.start)) {
                Some(Constant::Joints(numbers)) if range.len() == 1 => Some(numbers.clone()),
                _ => None,
            },
        }
    }

    fn setting(&self, range: Range<usize>, name: &str) -> Setting {
        let tokens = self.tokens;
        if let Some(Ok(Literal { form: Form::Pose(form), numbers, .. })) =
            literal(tokens, range.clone(), self.script.joints)
            && let Some(pose) = form.pose(&numbers)
        {
            return Setting::Known { name: name.to_owned(), pose: Box::new(pose) };
        }
        let variable = tokens.name(range.start).filter(|_| range.len() == 1);
        let constant = variable.as_deref().and_then(|name| self.script.constant(name, (self.file, range.start)));
        match (variable, constant) {
            (Some(name), Some(Constant::Pose(pose))) => Setting::Known { name, pose: Box::new(*pose) },
            (Some(name), _) => Setting::Named(name),
            (None, _) => Setting::Named(tokens.source(range)),
        }
    }

    fn point(&self, findings: &mut Findings, argument: &Argument) -> Point {
        let (tokens, range) = (self.tokens, argument.range.clone());
        if let Some(content) = literal(tokens, range.clone(), self.script.joints) {
            return findings.here(self.file, tokens.line(range.start), content);
        }
        let source = || Some(tokens.source(range.clone()));
        let Some(name) = tokens.name(range.start) else {
            return Point::Left { name: source(), reason: Reason::Computed };
        };
        let index_end =
            if tokens.is(range.start + 1, b'[') { tokens.behind(range.start + 1, range.end) } else { range.start + 1 };
        if index_end == range.end && name != "p" {
            let is_constant =
                range.len() == 4 && tokens.get(range.start + 2).is_some_and(|token| token.kind == Kind::Number);
            let element = if is_constant { tokens.str(range.start + 2).to_owned() } else { String::new() };
            return Point::Variable { key: Key { scope: 0, name: name.clone(), element }, name };
        }
        let is_offset = matches!(name.as_str(), "pose_add" | "pose_trans");
        if is_offset {
            for at in range.clone().skip(1) {
                if let Some(name) = tokens.name(at) {
                    let key = Key { scope: 0, name, element: String::new() };
                    findings.other_uses.push(OtherUse { key, reason: Reason::OffsetBase });
                }
            }
        }
        Point::Left { name: source(), reason: if is_offset { Reason::Offset } else { Reason::Computed } }
    }
}

/// Deepest nesting of `get_inverse_kin` and `pose_trans`.
const DEEPEST: usize = 4;

/// A point without the functions around it.
struct Argument {
    range: Range<usize>,
    frame: Setting,
    near: Option<Vec<f64>>,
    /// Tool that `get_inverse_kin` states.
    tool: Option<Setting>,
}

struct Instruction {
    way: Way,
    /// Names of the arguments that are points.
    keywords: &'static [&'static str],
}

impl Instruction {
    fn named(name: &str) -> Option<Self> {
        let (way, keywords): (Way, &'static [&'static str]) = match name {
            "movej" | "optimovej" => (Way::Joint, &["q"]),
            "movel" | "movep" | "optimovel" | "servoc" | "servol" => (Way::Linear, &["pose"]),
            "movec" => (Way::Circular, &["pose_via", "pose_to"]),
            "servoj" => (Way::Streamed, &["q"]),
            _ => return None,
        };
        Some(Self { way, keywords })
    }
}

fn without_keyword(tokens: &Tokens<'_>, part: Range<usize>) -> Range<usize> {
    let is_named =
        tokens.word(part.start).is_some() && tokens.is(part.start + 1, b'=') && !tokens.is(part.start + 2, b'=');
    if is_named { tokens.trimmed(part.start + 2..part.end) } else { part }
}

/// The parts of a list of lists.
fn elements(tokens: &Tokens<'_>, range: Range<usize>) -> Vec<Range<usize>> {
    let is_list = tokens.is(range.start, b'[') && tokens.behind(range.start, range.end) == range.end;
    if is_list { tokens.split(range.start + 1..range.end.saturating_sub(1)) } else { Vec::new() }
}

/// A joint vector or pose; `None` if the range is something else.
fn literal(tokens: &Tokens<'_>, range: Range<usize>, joints: usize) -> Option<Result<Literal, Reason>> {
    let is_pose = tokens.is_word(range.start, "p") && tokens.is(range.start + 1, b'[');
    let list = if is_pose { range.start + 1..range.end } else { range };
    let parts = elements(tokens, list);
    let needed = if is_pose { 6 } else { joints };
    let is_flat = parts.iter().all(|part| !tokens.is(part.start, b'[') && !tokens.is_word(part.start, "p"));
    if parts.is_empty() || !is_flat || (!is_pose && parts.len() != needed) {
        return None;
    }
    let values: Option<Vec<(Number, f64)>> = parts.into_iter().map(|part| value(tokens, part)).collect();
    let Some(values) = values.filter(|values| values.len() == needed) else {
        return Some(Err(if is_pose { Reason::Unreadable } else { Reason::Computed }));
    };
    let form = if is_pose { Form::Pose(Orientation::Vector) } else { Form::Joints(JointUnit::Si) };
    let slots = values.iter().map(|(number, scale)| Slot { scale: *scale, ..Slot::at(number.place.clone()) });
    Some(Ok(Literal {
        form,
        slots: slots.collect(),
        numbers: values.iter().map(|(number, scale)| number.value * scale).collect(),
        configuration: Configuration::Free,
    }))
}

/// A number, or one inside `d2r(…)`.
fn value(tokens: &Tokens<'_>, range: Range<usize>) -> Option<(Number, f64)> {
    match Value::read(tokens, range.clone(), b'[') {
        Value::Number(number) => Some((number, 1.0)),
        Value::List(_) => None,
        Value::Other(_) => {
            let is_degrees = tokens.is_word(range.start, "d2r") && tokens.is(range.start + 1, b'(');
            let (number, end) = tokens.number(range.start + 2).filter(|_| is_degrees)?;
            (tokens.is(end, b')') && end + 1 == range.end).then_some((number, DEGREE))
        }
    }
}
