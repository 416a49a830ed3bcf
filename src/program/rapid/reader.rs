//! Reads RAPID: `robtarget` and `jointtarget` data and the motion instructions that use them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::Isometry3;

use super::super::ProgramError;
use super::super::configuration::Configuration;
use super::super::findings::{Definition, Findings, Key, Literal, Motion, OtherUse, Point, Source};
use super::super::insert::Spot;
use super::super::lexer::{Kind, Rules, Tokens, Value};
use super::super::motion::{Form, JointUnit, Reason, Scan, Setting, Slot};
use super::super::orientation::Orientation;
use super::instruction::{Arguments, Instruction, assigned, displaces, frame, tool};
use super::statement::{Statement, StatementKind, each_statement, line_ends};

const RULES: Rules = Rules { comment: b"!", quotes: b"\"", in_words: b"" };

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let files: Vec<Tokens<'_>> = source.files().map(|(_, text)| Tokens::new(text, RULES)).collect();
    let mut module = Module::new(source);
    for (file, tokens) in files.iter().enumerate() {
        each_statement(tokens, file, |statement| module.declare(statement));
    }
    for name in files.iter().flat_map(assigned) {
        module.forget(&name);
    }
    let mut findings = Findings::default();
    for (file, tokens) in files.iter().enumerate() {
        each_statement(tokens, file, |statement| module.find(statement, &mut findings));
        findings.motions.push(None);
    }
    drop(files);
    findings.resolve(source)
}

/// Types that matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Robtarget,
    Jointtarget,
    Tooldata,
    Wobjdata,
    Other,
}

impl Type {
    fn named(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "robtarget" => Self::Robtarget,
            "jointtarget" => Self::Jointtarget,
            "tooldata" => Self::Tooldata,
            "wobjdata" => Self::Wobjdata,
            _ => Self::Other,
        }
    }

    const fn is_position(self) -> bool {
        matches!(self, Self::Robtarget | Self::Jointtarget)
    }
}

/// Declarations of all files.
struct Module<'a> {
    source: &'a Source<'a>,
    /// Number of each axis of the controller, in the order of the arm.
    axes: Vec<usize>,
    types: BTreeMap<(usize, String), Type>,
    /// Parameters of routines that are positions.
    parameters: BTreeSet<(usize, String)>,
    tools: BTreeMap<String, Result<Isometry3<f64>, Reason>>,
    frames: BTreeMap<String, Result<Isometry3<f64>, Reason>>,
    /// A program displacement moves all targets.
    is_displaced: bool,
    /// An offset of the external axes, which may carry the arm or the workpiece.
    has_axis_offset: bool,
    /// Routines that set a displacement: it stays in force when they call or return to another.
    displacing: BTreeSet<usize>,
    /// Places of the routine that is noted and of its open loops.
    open_starts: Vec<(usize, usize)>,
    /// Places of the routines and loops that end with a displacement.
    displaced_starts: BTreeSet<(usize, usize)>,
    /// File and end of the last motion instruction, if nothing but moves can follow it directly.
    behind_motion: Option<(usize, usize)>,
}

impl<'a> Module<'a> {
    fn new(source: &'a Source<'a>) -> Self {
        Self {
            source,
            axes: axes(source),
            types: BTreeMap::new(),
            parameters: BTreeSet::new(),
            tools: BTreeMap::new(),
            frames: BTreeMap::new(),
            is_displaced: false,
            has_axis_offset: false,
            displacing: BTreeSet::new(),
            open_starts: Vec::new(),
            displaced_starts: BTreeSet::new(),
            behind_motion: None,
        }
    }

    /// Notes the type of a variable, and the value of tools and work objects.
    fn declare(&mut self, statement: &Statement<'_, 'a>) {
        let (tokens, range) = (statement.tokens, statement.range.clone());
        self.note_displacement(statement);
        if statement.kind == StatementKind::Routine {
            for at in range {
                let (Some(word), Some(name)) = (tokens.word(at), tokens.name(at + 1)) else { continue };
                let kind = Type::named(word);
                if kind.is_position() {
                    self.parameters.insert((statement.scope, name.to_lowercase()));
                }
                if kind != Type::Other {
                    self.types.insert((statement.scope, name.to_lowercase()), kind);
                }
            }
            return;
        }
        if tokens.word(range.start).is_some_and(displaces) {
            self.displacing.insert(statement.scope);
        }
        let Some(declaration) = Declaration::of(statement) else { return };
        let kind = declaration.kind;
        let Some(name) = tokens.name(declaration.name).map(|name| name.to_lowercase()) else { return };
        self.types.insert((statement.scope, name.clone()), kind);
        let value = declaration.value.map(|range| Value::read(tokens, range, b'['));
        match (kind, value) {
            (Type::Tooldata, Some(value)) => {
                self.tools.insert(name, tool(tokens, &value));
            }
            (Type::Wobjdata, Some(value)) => {
                self.frames.insert(name, frame(tokens, &value));
            }
            _ => {}
        }
    }

    /// Follows displacements through loops and routines: the second round of a loop, and the second call of a routine, begin as the first
    /// one ends.
    fn note_displacement(&mut self, statement: &Statement<'_, 'a>) {
        match statement.kind {
            StatementKind::Routine => {
                self.open_starts = vec![statement.place()];
                self.is_displaced = false;
            }
            StatementKind::LoopStart => self.open_starts.push(statement.place()),
            StatementKind::LoopEnd => {
                let start = if self.open_starts.len() > 1 { self.open_starts.pop() } else { None };
                self.displaced_starts.extend(start.filter(|_| self.is_displaced));
            }
            StatementKind::Plain => {
                let word = statement.tokens.word(statement.range.start).unwrap_or_default();
                if displaces(word) {
                    self.is_displaced = true;
                    // Until it is switched off, that is how the routine ends.
                    self.displaced_starts.extend(self.open_starts.first().copied());
                } else if ["PDispOff", "EOffsOff"].iter().any(|off| word.eq_ignore_ascii_case(off)) {
                    self.is_displaced = false;
                    if let Some(routine) = self.open_starts.first() {
                        self.displaced_starts.remove(routine);
                    }
                }
            }
        }
    }

    /// Drops the declared value of a tool or work object that the program changes: which one holds at a move is unknown. One
    /// that cannot be used at all keeps its reason.
    fn forget(&mut self, name: &str) {
        for known in [&mut self.tools, &mut self.frames] {
            if known.get(name).is_some_and(Result::is_ok) {
                known.remove(name);
            }
        }
    }

    /// Notes values of positions, and motions.
    fn find(&mut self, statement: &Statement<'_, 'a>, findings: &mut Findings) {
        match statement.kind {
            StatementKind::Plain => {}
            StatementKind::Routine => {
                let is_displaced_at_end = self.displaced_starts.contains(&statement.place());
                self.is_displaced = is_displaced_at_end;
                self.has_axis_offset = is_displaced_at_end;
                findings.motions.push(None);
                return;
            }
            StatementKind::LoopStart => {
                self.is_displaced |= self.displaced_starts.contains(&statement.place());
                return;
            }
            StatementKind::LoopEnd => return,
        }
        let (tokens, range) = (statement.tokens, statement.range.clone());
        if let Some(declaration) = Declaration::of(statement) {
            if let Some(value) = declaration.value.filter(|_| declaration.kind.is_position()) {
                self.define(statement, findings, declaration.name, declaration.kind, value);
            }
            return;
        }
        let word = tokens.word(range.start).unwrap_or_default().to_ascii_lowercase();
        match word.as_str() {
            "pdispon" | "pdispset" => self.is_displaced = true,
            "pdispoff" => self.is_displaced = false,
            "eoffson" | "eoffsset" => self.has_axis_offset = true,
            "eoffsoff" => self.has_axis_offset = false,
            _ => {}
        }
        let assign = range.clone().find(|at| tokens.is(*at, b':') && tokens.is(at + 1, b'='));
        let has_arguments = !tokens.is(range.start + 1, b':') && !tokens.is(range.start + 1, b'(');
        match (Instruction::named(&word).filter(|_| has_arguments), assign) {
            (Some(instruction), _) => {
                self.motion(statement, findings, &instruction);
                self.behind_motion = (!statement.is_conditional).then_some((statement.file, range.end));
            }
            // The first `:=` of a call belongs to an optional argument.
            (None, Some(assign)) if !range.clone().take_while(|at| *at < assign).any(|at| tokens.is(at, b'\\')) => {
                self.assignment(statement, findings, assign);
            }
            (None, _) => self.call(statement, findings),
        }
    }

    fn kind_of(&self, key: &Key) -> Option<Type> {
        let local = self.types.get(&(key.scope, key.name.clone()));
        local.or_else(|| self.types.get(&(0, key.name.clone()))).copied()
    }

    /// Notes the value of a variable, and each element of an array separately.
    fn define(
        &self,
        statement: &Statement<'_, 'a>,
        findings: &mut Findings,
        name_at: usize,
        kind: Type,
        value: Range<usize>,
    ) {
        let tokens = statement.tokens;
        let Some(key) = statement.key(name_at) else { return };
        let Some(name) = tokens.name(name_at) else { return };
        let line = tokens.line(name_at);
        let read = Value::read(tokens, value.clone(), b'[');
        let parts = if kind == Type::Robtarget { 4 } else { 2 };
        let mut elements = Vec::new();
        collect(&read, parts, &mut Vec::new(), &mut elements);
        if elements.is_empty() {
            elements.push((Vec::new(), &read));
        }
        for (index, element) in elements {
            let content = match kind {
                Type::Robtarget => self.robtarget(element),
                _ => self.jointtarget(element),
            };
            let indices: Vec<String> = index.iter().map(usize::to_string).collect();
            let element_text = indices.join(",");
            let shown = if element_text.is_empty() { name.clone() } else { format!("{name}{{{element_text}}}") };
            let place = content.as_ref().ok().and_then(|literal| literal.slots.first()).map(|slot| slot.place.start);
            let line =
                if element_text.is_empty() { line } else { line_of(tokens, value.clone(), place).unwrap_or(line) };
            findings.definitions.push(Definition {
                file: statement.file,
                line,
                name: Some(shown),
                key: Key { element: element_text, ..key.clone() },
                content,
                is_quiet: false,
            });
        }
    }

    fn assignment(&self, statement: &Statement<'_, 'a>, findings: &mut Findings, assign: usize) {
        let (tokens, range) = (statement.tokens, statement.range.clone());
        let value = tokens.trimmed(assign + 2..range.end);
        self.other_uses(statement, findings, value.clone(), None);
        let Some(key) = statement.key(range.start) else { return };
        let Some(kind) = self.kind_of(&key).filter(|kind| kind.is_position()) else { return };
        let name = tokens.name(range.start);
        let is_own = statement.file == 0;
        if tokens.is(range.start + 1, b'.') {
            if is_own {
                findings.leave(statement.line(), name, Reason::Component);
            }
            return;
        }
        if tokens.is(value.start, b'[') {
            let element = element(tokens, range.start + 1, assign);
            let before = findings.definitions.len();
            self.define(statement, findings, range.start, kind, value);
            for definition in findings.definitions.iter_mut().skip(before).filter(|_| !element.is_empty()) {
                definition.name = definition.name.take().map(|name| format!("{name}{{{element}}}"));
                definition.key.element.clone_from(&element);
            }
            return;
        }
        match (statement.key(value.start), value.len()) {
            (Some(original), 1) => findings.copies.push((key, original)),
            _ if is_own => {
                let is_offset = tokens.is_word(value.start, "Offs") || tokens.is_word(value.start, "RelTool");
                findings.leave(statement.line(), name, if is_offset { Reason::Offset } else { Reason::Computed });
            }
            _ => {}
        }
    }

    /// Notes positions that are handed to a routine.
    fn call(&self, statement: &Statement<'_, 'a>, findings: &mut Findings) {
        let routine = statement.tokens.name(statement.range.start);
        self.other_uses(statement, findings, statement.range.start + 1..statement.range.end, routine.as_deref());
        if let Some(routine) = routine.filter(|_| statement.file == 0) {
            self.written_arguments(statement, findings, &routine);
        }
    }

    /// Names positions that are written in the call of a routine.
    fn written_arguments(&self, statement: &Statement<'_, 'a>, findings: &mut Findings, routine: &str) {
        let tokens = statement.tokens;
        let mut at = statement.range.start + 1;
        while at < statement.range.end {
            if !tokens.is(at, b'[') {
                at += 1;
                continue;
            }
            let end = tokens.behind(at, statement.range.end);
            let value = Value::read(tokens, at..end, b'[');
            let is_unreadable = |content: &Result<Literal, Reason>| matches!(content, Err(Reason::Unreadable));
            if !is_unreadable(&self.robtarget(&value)) || !is_unreadable(&self.jointtarget(&value)) {
                findings.leave(tokens.line(at), None, Reason::PassedTo(routine.to_owned()));
            }
            at = end.max(at + 1);
        }
    }

    fn other_uses(
        &self,
        statement: &Statement<'_, 'a>,
        findings: &mut Findings,
        range: Range<usize>,
        routine: Option<&str>,
    ) {
        let tokens = statement.tokens;
        let mut is_offset = false;
        for at in range {
            let Some(word) = tokens.word(at) else { continue };
            if tokens.is(at + 1, b'(') {
                is_offset = matches!(word.to_ascii_lowercase().as_str(), "offs" | "reltool");
                continue;
            }
            let Some(key) = statement.key(at) else { continue };
            if !self.kind_of(&key).is_some_and(Type::is_position) {
                continue;
            }
            let reason = match routine {
                _ if is_offset => Reason::OffsetBase,
                // It moves external axes and no arm.
                Some(routine) if routine.eq_ignore_ascii_case("MoveExtJ") => Reason::OtherGroup,
                Some(routine) => Reason::PassedTo(routine.to_owned()),
                None => continue,
            };
            findings.other_uses.push(OtherUse { key, reason });
        }
    }

    fn motion(&self, statement: &Statement<'_, 'a>, findings: &mut Findings, instruction: &Instruction) {
        let tokens = statement.tokens;
        let arguments = Arguments::read(tokens, statement.range.start + 1..statement.range.end);
        let behind = instruction.first + instruction.points;
        let tool_at = arguments.tool.or_else(|| {
            let heads = arguments.heads.iter().enumerate().skip(behind);
            let is_tool = |head: &Range<usize>| {
                let name = (head.len() == 1).then(|| statement.key(head.start)).flatten();
                name.is_some_and(|key| key.name == "tool0" || self.kind_of(&key) == Some(Type::Tooldata))
            };
            heads.filter(|(_, head)| is_tool(head)).map(|(index, _)| index).next()
        });
        let tool_at = tool_at.or_else(|| {
            let usual = behind + instruction.tool;
            (usual < arguments.heads.len()).then_some(usual)
        });
        let tool = tool_at.and_then(|index| arguments.heads.get(index)).cloned();
        let tool = setting(tokens, tool, "tool0", &self.tools);
        let frame = match arguments.frame.clone() {
            Some(range) => setting(tokens, Some(range), "wobj0", &self.frames),
            None => Ok(Setting::Identity),
        };
        let mut points = Vec::new();
        for head in arguments.heads.iter().skip(instruction.first).take(instruction.points) {
            points.push(self.point(statement, findings, head.clone(), instruction.is_joints));
        }
        // The order of calls is unknown, so a displacement of another routine counts for all moves of this one.
        let is_displaced_elsewhere = self.displacing.iter().any(|scope| *scope != statement.scope);
        let is_displaced = self.is_displaced || self.has_axis_offset || is_displaced_elsewhere;
        if is_displaced && !instruction.is_joints {
            points = points.into_iter().map(|point| displaced(findings, point)).collect();
        }
        let Some(point) = points.pop() else { return };
        findings.motions.push(Some(Motion {
            file: statement.file,
            line: statement.line(),
            way: instruction.way,
            via: points.pop().map(Box::new),
            point,
            tool,
            frame,
            configuration: None,
            spot: self.spot(statement, &arguments).map(Box::new),
        }));
    }

    /// A plain `MoveL` directly behind another motion: its copies get the smallest usual zone, so that the arm does not stop.
    fn spot(&self, statement: &Statement<'_, 'a>, arguments: &Arguments) -> Option<Spot> {
        let (tokens, range) = (statement.tokens, statement.range.clone());
        let (file, behind) = self.behind_motion?;
        let is_next = file == statement.file && (behind + 1..range.start).all(|at| line_ends(tokens, at));
        let options = range.clone().filter(|at| tokens.is(*at, b'\\'));
        let is_plain = tokens.is_word(range.start, "MoveL")
            && options.into_iter().all(|at| tokens.is_word(at + 1, "WObj"))
            && tokens.is(range.end, b';');
        let [point, _speed, zone, _tool] = arguments.heads.as_slice() else { return None };
        if !is_plain || !is_next || statement.is_conditional || statement.file != 0 {
            return None;
        }
        let instruction = tokens.bytes(range.start..range.end + 1);
        let spot = Spot::alone(tokens.text, instruction, tokens.bytes(point.clone()))?;
        Some(Spot { changes: vec![(tokens.bytes(zone.clone()), "z1")], ..spot })
    }

    fn point(
        &self,
        statement: &Statement<'_, 'a>,
        findings: &mut Findings,
        head: Range<usize>,
        is_joints: bool,
    ) -> Point {
        let tokens = statement.tokens;
        if tokens.is(head.start, b'[') {
            let value = Value::read(tokens, head.clone(), b'[');
            let content = if is_joints { self.jointtarget(&value) } else { self.robtarget(&value) };
            return findings.here(statement.file, tokens.line(head.start), content);
        }
        if tokens.is(head.start, b'*') {
            return Point::Left { name: None, reason: Reason::Elsewhere };
        }
        let Some(key) = statement.key(head.start) else {
            return Point::Left { name: None, reason: Reason::Computed };
        };
        let name = tokens.name(head.start).unwrap_or_default();
        let is_indexed = tokens.is(head.start + 1, b'{') && tokens.behind(head.start + 1, head.end) == head.end;
        if head.len() == 1 || is_indexed {
            if self.parameters.contains(&(key.scope, key.name.clone())) {
                return Point::Left { name: Some(name), reason: Reason::Computed };
            }
            let element = if is_indexed { element(tokens, head.start + 1, head.end) } else { String::new() };
            return Point::Variable { key: Key { element, ..key }, name };
        }
        self.other_uses(statement, findings, head.clone(), None);
        let is_offset = tokens.is_word(head.start, "Offs") || tokens.is_word(head.start, "RelTool");
        let reason = if is_offset { Reason::Offset } else { Reason::Computed };
        Point::Left { name: Some(tokens.source(head)), reason }
    }

    fn jointtarget(&self, value: &Value) -> Result<Literal, Reason> {
        let [axes, external] = value.list().unwrap_or_default() else { return Err(Reason::Unreadable) };
        let (Some(axes), Some(external)) = (axes.numbers(), external.numbers()) else {
            return Err(Reason::Unreadable);
        };
        if axes.len() != 6 || external.len() != 6 {
            return Err(Reason::Unreadable);
        }
        let all: Vec<_> = axes.into_iter().chain(external.first().copied()).collect();
        let joints = self.source.robot.chain.dof();
        if self.axes.len() != joints {
            return Err(Reason::JointCount { found: 6, joints });
        }
        // The joints of a seven-axis arm are no target of a six-axis one.
        let has_seventh = external.first().is_some_and(|axis| axis.value < UNUSED && axis.value != 0.0);
        if joints == 6 && has_seventh && !self.source.options.ignores_external_axes {
            return Err(Reason::SeventhAxis);
        }
        let chosen: Vec<_> = self.axes.iter().filter_map(|axis| all.get(*axis)).collect();
        if chosen.iter().any(|number| number.value >= UNUSED) {
            return Err(Reason::Incomplete);
        }
        Ok(Literal {
            form: Form::Joints(JointUnit::Edge),
            slots: chosen.iter().map(|number| Slot::at(number.place.clone())).collect(),
            numbers: chosen.iter().map(|number| number.value).collect(),
            configuration: Configuration::Free,
        })
    }

    fn robtarget(&self, value: &Value) -> Result<Literal, Reason> {
        let [position, orientation, configuration, external] = value.list().unwrap_or_default() else {
            return Err(Reason::Unreadable);
        };
        let parts = [position, orientation, configuration, external].map(Value::numbers);
        let [Some(position), Some(orientation), Some(configuration), Some(external)] = parts else {
            return Err(Reason::Unreadable);
        };
        if [position.len(), orientation.len(), configuration.len(), external.len()] != [3, 4, 4, 6] {
            return Err(Reason::Unreadable);
        }
        if self.source.robot.chain.dof() > 6 {
            return Err(Reason::ArmAngle);
        }
        let is_moved = external.iter().any(|axis| axis.value < UNUSED && axis.value != 0.0);
        if is_moved && !self.source.options.ignores_external_axes {
            return Err(Reason::ExternalAxes);
        }
        let quarters: Option<Vec<i32>> = configuration.iter().map(|number| whole(number.value)).collect();
        let Some([cf1, cf4, cf6, cfx]) = quarters.as_deref() else { return Err(Reason::UnknownConfiguration) };
        let numbers: Vec<_> = position.iter().chain(&orientation).collect();
        Ok(Literal {
            form: Form::Pose(Orientation::Quaternion),
            slots: numbers.iter().map(|number| Slot::at(number.place.clone())).collect(),
            numbers: numbers.iter().map(|number| number.value).collect(),
            configuration: Configuration::Rapid { cf1: *cf1, cf4: *cf4, cf6: *cf6, cfx: *cfx },
        })
    }
}

/// From this value on an axis is not used (9E9).
const UNUSED: f64 = 8e9;

/// A whole number.
#[expect(clippy::cast_possible_truncation, reason = "checked to be whole and small")]
fn whole(value: f64) -> Option<i32> {
    (value.fract() == 0.0 && value.abs() < 1e6).then_some(value as i32)
}

/// For each joint from base to flange its axis of the controller, from 0. Axis 7 of ABB's seven-axis arms is between the second
/// and the third, so names with numbers decide; without them, that order counts.
fn axes(source: &Source<'_>) -> Vec<usize> {
    let joints = source.robot.chain.joints();
    if joints.len() != 7 {
        return if joints.len() == 6 { (0..6).collect() } else { Vec::new() };
    }
    let number = |name: &str| {
        let digits: String = name.chars().filter(char::is_ascii_digit).collect();
        digits.parse::<usize>().ok().filter(|number| (1..=7).contains(number)).map(|number| number - 1)
    };
    let numbers: Option<Vec<usize>> = joints.iter().map(|joint| number(&joint.name)).collect();
    let is_each_once = |numbers: &Vec<usize>| (0..7).all(|axis| numbers.contains(&axis));
    numbers.filter(is_each_once).unwrap_or_else(|| vec![0, 1, 6, 2, 3, 4, 5])
}

/// A declaration with `CONST`, `VAR` or `PERS`.
struct Declaration {
    kind: Type,
    /// Token of the name.
    name: usize,
    value: Option<Range<usize>>,
}

impl Declaration {
    fn of(statement: &Statement<'_, '_>) -> Option<Self> {
        let (tokens, range) = (statement.tokens, statement.range.clone());
        let is_data = ["CONST", "VAR", "PERS"].iter().any(|word| tokens.is_word(range.start, word));
        if !is_data {
            return None;
        }
        let kind = Type::named(tokens.word(range.start + 1)?);
        let assign = range.clone().find(|at| tokens.is(*at, b':') && tokens.is(at + 1, b'='));
        let value = assign.map(|assign| tokens.trimmed(assign + 2..range.end));
        Some(Self { kind, name: range.start + 2, value })
    }
}

/// A point under a program displacement, which is an offset.
fn displaced(findings: &mut Findings, point: Point) -> Point {
    match point {
        Point::Variable { key, name } => {
            findings.other_uses.push(OtherUse { key, reason: Reason::OffsetBase });
            Point::Left { name: Some(name), reason: Reason::Offset }
        }
        Point::Here(index) => {
            if let Some(definition) = findings.definitions.get_mut(index) {
                definition.content = Err(Reason::Offset);
            }
            Point::Here(index)
        }
        Point::Left { .. } | Point::Current => point,
    }
}

/// Where the tool or work object of an instruction comes from.
fn setting(
    tokens: &Tokens<'_>,
    range: Option<Range<usize>>,
    own: &str,
    known: &BTreeMap<String, Result<Isometry3<f64>, Reason>>,
) -> Result<Setting, Reason> {
    let Some(range) = range else { return Ok(Setting::Named(own.to_owned())) };
    let name = if range.len() == 1 { tokens.name(range.start).unwrap_or_default() } else { tokens.source(range) };
    if name.eq_ignore_ascii_case(own) {
        return Ok(Setting::Identity);
    }
    match known.get(&name.to_lowercase()) {
        Some(Ok(pose)) => Ok(Setting::Known { name, pose: Box::new(*pose) }),
        Some(Err(reason)) => Err(reason.clone()),
        None => Ok(Setting::Named(name)),
    }
}

/// Values with `parts` parts inside arrays, with their indices from 1.
fn collect<'v>(value: &'v Value, parts: usize, index: &mut Vec<usize>, elements: &mut Vec<(Vec<usize>, &'v Value)>) {
    let Some(items) = value.list() else { return };
    let is_number_list = |item: &Value| item.list().is_some_and(|list| list.iter().any(|part| part.number().is_some()));
    if items.len() == parts && items.first().is_some_and(is_number_list) {
        elements.push((index.clone(), value));
        return;
    }
    for (at, item) in items.iter().enumerate() {
        index.push(at + 1);
        if item.list().is_some() {
            collect(item, parts, index, elements);
        }
        index.pop();
    }
}

/// Constant indices `{1,2}` of an element; empty if they are computed.
fn element(tokens: &Tokens<'_>, start: usize, end: usize) -> String {
    if !tokens.is(start, b'{') {
        return String::new();
    }
    let inside: Vec<usize> = (start + 1..end.saturating_sub(1)).collect();
    let is_constant = inside
        .iter()
        .all(|at| tokens.get(*at).is_some_and(|token| matches!(token.kind, Kind::Number | Kind::Symbol(b','))));
    if is_constant { inside.iter().map(|at| tokens.str(*at)).collect() } else { String::new() }
}

fn line_of(tokens: &Tokens<'_>, range: Range<usize>, byte: Option<usize>) -> Option<usize> {
    let byte = byte?;
    let (mut low, mut high) = (range.start, range.end);
    while low < high {
        let middle = low.midpoint(high);
        if tokens.get(middle)?.start < byte { low = middle + 1 } else { high = middle }
    }
    tokens.get(low).map(|token| token.line)
}
