//! Reads KRL: aggregates of position types and the motion instructions that use them, in `.src` and `.dat` files.

mod flow;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::Isometry3;

use self::flow::{Block, Routine, called};
use super::super::ProgramError;
use super::super::configuration::Configuration;
use super::super::findings::{Definition, Findings, Key, Motion, OtherUse, Point, Source, Way};
use super::super::insert::Spot;
use super::super::lexer::{Kind, Rules, Tokens};
use super::super::motion::{Form, Hint, Reason, Scan, Setting};
use super::aggregate::{Aggregate, FrameData};

/// More routines than a file can have: their numbers differ between files.
const ROUTINES: usize = 1 << 24;

const RULES: Rules = Rules { comment: b";", quotes: b"\"'", in_words: b"$#" };

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let files: Vec<Tokens<'_>> = source.files().map(|(_, text)| Tokens::new(text, RULES)).collect();
    let mut module = Module::new(source);
    for (file, tokens) in files.iter().enumerate() {
        each_line(tokens, file, |line| module.declare(line));
    }
    module.follow_calls();
    module.forget();
    let mut findings = module.findings(&files);
    if !module.loop_ends.is_empty() {
        // The second round of a loop begins with the tool and base of the end of the first, which are known only now.
        findings = module.findings(&files);
    }
    let hints = findings.definitions.iter().find_map(absolute_accuracy);
    let mut scan = findings.resolve(source)?;
    scan.hints.extend(hints);
    Ok(scan)
}

/// Status bit 4: the point was recorded on an arm with an absolutely accurate model.
fn absolute_accuracy(definition: &Definition) -> Option<Hint> {
    let literal = definition.content.as_ref().ok().filter(|_| definition.file == 0)?;
    match literal.configuration {
        Configuration::Krl { s: Some(s), .. } if s & 0b1_0000 != 0 => {
            Some(Hint::AbsoluteAccuracy { line: definition.line })
        }
        _ => None,
    }
}

/// Beginnings of the names of numbered tools and bases.
const ANY_TOOL: &str = "tool_data[";
const ANY_BASE: &str = "base_data[";

/// A line with its words.
struct Line<'t, 'a> {
    tokens: &'t Tokens<'a>,
    file: usize,
    /// The routine; 0: the data list.
    scope: usize,
    range: Range<usize>,
}

fn each_line<'a>(tokens: &Tokens<'a>, file: usize, mut work: impl FnMut(&Line<'_, 'a>)) {
    let (mut at, mut scope, mut scopes) = (0, 0, file.saturating_mul(ROUTINES));
    while at < tokens.len() {
        let is_end = |place: &usize| tokens.get(*place).is_some_and(|token| token.kind == Kind::LineEnd);
        let end = (at..tokens.len()).find(is_end).unwrap_or(tokens.len());
        let first = at + usize::from(tokens.is_word(at, "GLOBAL"));
        if tokens.is_word(first, "DEF") || tokens.is_word(first, "DEFFCT") {
            scopes += 1;
            scope = scopes;
        }
        if at < end {
            work(&Line { tokens, file, scope, range: at..end });
        }
        if ["END", "ENDFCT", "DEFDAT"].iter().any(|word| tokens.is_word(at, word)) {
            scope = 0;
        }
        at = end + 1;
    }
}

/// Tool and base that count at a place.
#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    tool: Option<Frame>,
    base: Option<Frame>,
    is_stationary: bool,
}

/// Where a tool or base comes from.
#[derive(Clone, Debug, PartialEq)]
enum Frame {
    /// `TOOL_DATA[n]` or `BASE_DATA[n]`.
    Number(String),
    Null,
    Literal(Isometry3<f64>),
    Variable(String),
    /// It depends on how the program runs.
    Unknown,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Axes,
    Position,
    Frame,
    FrameData,
    Other,
}

impl Type {
    fn named(name: &str) -> Self {
        match name.to_ascii_uppercase().as_str() {
            "E6AXIS" | "AXIS" => Self::Axes,
            "E6POS" | "POS" | "E3POS" => Self::Position,
            "FRAME" => Self::Frame,
            "FDAT" => Self::FrameData,
            _ => Self::Other,
        }
    }

    const fn is_position(self) -> bool {
        matches!(self, Self::Axes | Self::Position | Self::Frame)
    }
}

struct Module<'a> {
    source: &'a Source<'a>,
    types: BTreeMap<(usize, String), Type>,
    parameters: BTreeSet<(usize, String)>,
    /// Frames by lower-case name, such as `tool_data[1]`.
    frames: BTreeMap<String, Isometry3<f64>>,
    frame_data: BTreeMap<String, FrameData>,
    state: State,
    /// The only tool and base that a file sets.
    set: State,
    /// First motion of the routine.
    routine: usize,
    /// Whether the routine sets tool and base.
    sets: [bool; 2],
    /// Motions of routines, and whether they inherit tool and base from the caller.
    heirs: Vec<(Range<usize>, [bool; 2])>,
    /// Routines of the given files by lower-case name.
    routines: BTreeMap<String, Routine>,
    /// Name of the routine whose lines are noted in `routines`.
    declared: String,
    /// Open branches and loops, the innermost last.
    blocks: Vec<Block>,
    /// Tool and base at the end of each loop that sets them, by its file and first token.
    loop_ends: BTreeMap<(usize, usize), [Option<Frame>; 2]>,
    /// Lower-case names of frames whose value changes while the program runs.
    changing: BTreeSet<String>,
    /// File and end of the line of the last motion.
    behind_motion: Option<(usize, usize)>,
}

/// A name with constant indices.
struct Variable {
    name: String,
    key: Key,
    /// Place behind it.
    end: usize,
}

impl Variable {
    fn read(line: &Line<'_, '_>, at: usize) -> Option<Self> {
        let tokens = line.tokens;
        let name = tokens.name(at)?;
        let mut key = Key { scope: line.scope, name: name.to_lowercase(), element: String::new() };
        if !tokens.is(at + 1, b'[') {
            return Some(Self { name, key, end: at + 1 });
        }
        let end = tokens.behind(at + 1, line.range.end);
        let inside = at + 2..end.saturating_sub(1);
        let is_constant = inside
            .clone()
            .all(|at| tokens.get(at).is_some_and(|token| matches!(token.kind, Kind::Number | Kind::Symbol(b','))));
        let element: String = inside.map(|at| tokens.str(at)).collect();
        let shown = format!("{name}[{element}]");
        if is_constant {
            key.element = element;
        }
        Some(Self { name: shown, key, end })
    }
}

impl<'a> Module<'a> {
    fn new(source: &'a Source<'a>) -> Self {
        Self {
            source,
            types: BTreeMap::new(),
            parameters: BTreeSet::new(),
            frames: BTreeMap::new(),
            frame_data: BTreeMap::new(),
            state: State::default(),
            set: State::default(),
            routine: 0,
            sets: [false; 2],
            heirs: Vec::new(),
            routines: BTreeMap::new(),
            declared: String::new(),
            blocks: Vec::new(),
            loop_ends: BTreeMap::new(),
            changing: BTreeSet::new(),
            behind_motion: None,
        }
    }

    /// Notes the values and motions of all files.
    fn findings(&mut self, files: &[Tokens<'a>]) -> Findings {
        let mut findings = Findings::default();
        for (file, tokens) in files.iter().enumerate() {
            self.state = State::default();
            self.set = State::default();
            self.heirs.clear();
            self.blocks.clear();
            self.routine = findings.motions.len();
            self.sets = [false; 2];
            each_line(tokens, file, |line| self.find(line, &mut findings));
            self.end_routine(findings.motions.len());
            self.inherit(&mut findings);
            findings.motions.push(None);
        }
        findings
    }

    /// Notes types, frames and the data of inline forms.
    fn declare(&mut self, line: &Line<'_, 'a>) {
        self.note_routine(line);
        let (tokens, range) = (line.tokens, line.range.clone());
        let start = behind_words(tokens, range.start, &["GLOBAL", "DECL", "CONST", "IMPORT"]);
        if tokens.is_word(start, "DEF") || tokens.is_word(start, "DEFFCT") {
            for at in range {
                if tokens.is(at + 1, b':')
                    && let Some(name) = tokens.name(at)
                {
                    self.parameters.insert((line.scope, name.to_lowercase()));
                }
            }
            return;
        }
        let kind = tokens.word(start).map_or(Type::Other, Type::named);
        let is_declaration = start > range.start || kind != Type::Other && tokens.word(start + 1).is_some();
        let first = if is_declaration { start + 1 } else { start };
        if is_declaration {
            for part in tokens.split(first..range.end) {
                if let Some(name) = tokens.name(part.start) {
                    self.types.insert((line.scope, name.to_lowercase()), kind);
                }
            }
        }
        self.note_change(line, first);
        let Some(variable) = Variable::read(line, first).filter(|variable| tokens.is(variable.end, b'=')) else {
            return;
        };
        let Some(aggregate) = Aggregate::read(tokens, variable.end + 1..range.end) else { return };
        let name = variable.name.to_lowercase();
        if let Some(pose) = aggregate.frame() {
            if self.frames.get(&name).is_some_and(|known| *known != pose) {
                self.changing.insert(name.clone());
            }
            self.frames.insert(name, pose);
        } else if aggregate.has("X") || aggregate.has("Y") || aggregate.has("Z") {
            // The other components stay as they were.
            self.changing.insert(name);
        } else if let Some(data) = aggregate.frame_data(tokens) {
            self.frame_data.insert(name, data);
        }
    }

    /// Notes values of positions, and motions.
    fn find(&mut self, line: &Line<'_, 'a>, findings: &mut Findings) {
        self.statement(line, findings);
        // A routine that sets tool or base may do so in a branch only: behind its call they are unknown.
        for name in called(line) {
            let [tool, base] = self.routines.get(&name).map_or([false; 2], |routine| routine.sets);
            if tool {
                self.set_tool(Frame::Unknown);
            }
            if base {
                self.set_base(Frame::Unknown);
            }
        }
    }

    fn statement(&mut self, line: &Line<'_, 'a>, findings: &mut Findings) {
        let (tokens, range) = (line.tokens, line.range.clone());
        let start = behind_words(tokens, range.start, &["GLOBAL", "DECL", "CONST", "IMPORT"]);
        let Some(word) = tokens.word(start).map(str::to_ascii_uppercase) else { return };
        if matches!(word.as_str(), "DEF" | "DEFFCT" | "END" | "ENDFCT") {
            self.end_routine(findings.motions.len());
            findings.motions.push(None);
            self.state = State::default();
            self.blocks.clear();
            return;
        }
        self.block(line, &word);
        let is_call = tokens.is(start + 1, b'(') || tokens.is(start + 1, b'=') || tokens.is(start + 1, b'.');
        if let Some(instruction) = Instruction::named(&word).filter(|_| !is_call) {
            self.motion(line, findings, &instruction, start + 1);
            return;
        }
        if word == "BAS" {
            self.bas(line, start);
            return;
        }
        let kind = Type::named(&word);
        let is_declaration = start > range.start || kind != Type::Other && tokens.word(start + 1).is_some();
        let first = if is_declaration { start + 1 } else { start };
        match Variable::read(line, first) {
            // The other components stay as they were, perhaps not as the program last set them.
            Some(variable) if variable.name.eq_ignore_ascii_case("$TOOL") && tokens.is(variable.end, b'.') => {
                self.set_tool(Frame::Unknown);
            }
            Some(variable) if variable.name.eq_ignore_ascii_case("$BASE") && tokens.is(variable.end, b'.') => {
                self.set_base(Frame::Unknown);
            }
            Some(variable) if tokens.is(variable.end, b'=') => self.assignment(line, findings, &variable),
            Some(variable) if tokens.is(variable.end, b'.') && line.file == 0 => {
                let is_known = self.kind_of(&variable.key).is_some_and(Type::is_position);
                let component = tokens.word(variable.end + 1).unwrap_or_default();
                let is_assigned = tokens.is(variable.end + 2, b'=');
                if is_assigned && (is_known || is_coordinate(component)) && !variable.name.starts_with('$') {
                    findings.leave(tokens.line(first), Some(variable.name), Reason::Component);
                }
            }
            _ => self.call(line, findings, first),
        }
    }

    fn kind_of(&self, key: &Key) -> Option<Type> {
        let local = self.types.get(&(key.scope, key.name.clone()));
        local.or_else(|| self.types.get(&(0, key.name.clone()))).copied()
    }

    /// The key with the scope of its declaration.
    fn scoped(&self, key: Key) -> Key {
        let is_local = self.types.contains_key(&(key.scope, key.name.clone()));
        Key { scope: if is_local { key.scope } else { 0 }, ..key }
    }

    /// `BAS(#TOOL,1)` and `BAS(#BASE,2)`.
    fn bas(&mut self, line: &Line<'_, 'a>, start: usize) {
        let tokens = line.tokens;
        let number = || {
            let token = tokens.get(start + 4).filter(|token| token.kind == Kind::Number);
            token.map(|_| tokens.str(start + 4).to_owned())
        };
        if tokens.is_word(start + 2, "#TOOL") {
            let tool =
                number().map_or_else(|| Frame::Variable(tokens.source(start + 4..line.range.end)), Frame::Number);
            self.set_tool(tool);
        } else if tokens.is_word(start + 2, "#BASE") {
            let base =
                number().map_or_else(|| Frame::Variable(tokens.source(start + 4..line.range.end)), Frame::Number);
            self.set_base(base);
        }
    }

    fn end_routine(&mut self, end: usize) {
        self.heirs.push((self.routine..end, self.sets.map(|sets| !sets)));
        self.routine = end;
        self.sets = [false; 2];
    }

    fn set_tool(&mut self, tool: Frame) {
        self.sets[0] = true;
        note(&mut self.set.tool, &tool);
        if let Some(block) = self.blocks.last_mut() {
            block.differs[0] |= block.tool.as_ref() != Some(&tool);
        }
        self.state.tool = Some(tool);
    }

    fn set_base(&mut self, base: Frame) {
        self.sets[1] = true;
        note(&mut self.set.base, &base);
        if let Some(block) = self.blocks.last_mut() {
            block.differs[1] |= block.base.as_ref() != Some(&base);
        }
        self.state.base = Some(base);
    }

    fn assignment(&mut self, line: &Line<'_, 'a>, findings: &mut Findings, variable: &Variable) {
        let tokens = line.tokens;
        let value = variable.end + 1..line.range.end;
        let name = variable.name.to_uppercase();
        match name.as_str() {
            "$TOOL" => return self.set_tool(frame(tokens, value, "TOOL_DATA")),
            "$BASE" => return self.set_base(frame(tokens, value, "BASE_DATA")),
            "$IPO_MODE" => {
                self.state.is_stationary = tokens.is_word(value.start, "#TCP");
                return;
            }
            "FDAT_ACT" => {
                let data = tokens.name(value.start).map(|name| name.to_lowercase());
                self.use_frame_data(data.as_deref());
                return;
            }
            _ => {}
        }
        let kind = self.kind_of(&variable.key);
        let line_number = tokens.line(line.range.start);
        if let Some(aggregate) = Aggregate::read(tokens, value.clone()) {
            let Some(content) = aggregate.literal(self.source) else { return };
            let is_frame = content.as_ref().is_ok_and(|literal| matches!(literal.form, Form::Pose(_)));
            let is_system = name.starts_with('$');
            if is_system || name.starts_with("TOOL_DATA[") || name.starts_with("BASE_DATA[") {
                if !aggregate.has("X") && line.file == 0 {
                    findings.leave(line_number, Some(variable.name.clone()), Reason::SystemVariable);
                }
                return;
            }
            findings.definitions.push(Definition {
                file: line.file,
                line: line_number,
                name: Some(variable.name.clone()),
                key: self.scoped(variable.key.clone()),
                content,
                is_quiet: kind == Some(Type::Frame) && is_frame,
            });
            return;
        }
        let original = Variable::read(line, value.start).filter(|original| original.end == value.end);
        match original.filter(|original| !original.name.starts_with('$')) {
            Some(original) if kind.is_none_or(Type::is_position) => {
                findings.copies.push((variable.key.clone(), original.key));
            }
            _ if kind.is_some_and(Type::is_position) && line.file == 0 => {
                let is_offset = value.clone().any(|at| tokens.is(at, b':'));
                let reason = if is_offset { Reason::Offset } else { Reason::Computed };
                findings.leave(line_number, Some(variable.name.clone()), reason);
                self.offset_uses(line, findings, value);
            }
            _ => {}
        }
    }

    fn setting(&self, frame: Option<&Frame>, what: &str) -> Setting {
        let name = match frame {
            Some(Frame::Null) => return Setting::Identity,
            // Not even a value that the program gives it elsewhere counts.
            Some(Frame::Unknown) | None => return Setting::Named(format!("${what}")),
            Some(Frame::Number(number)) if number.trim_start_matches('0').is_empty() => return Setting::Identity,
            Some(Frame::Literal(pose)) => return Setting::Known { name: format!("${what}"), pose: Box::new(*pose) },
            Some(Frame::Number(number)) => format!("{what}_DATA[{number}]"),
            Some(Frame::Variable(name)) if !name.is_empty() => name.clone(),
            Some(Frame::Variable(_)) => format!("${what}"),
        };
        match self.frames.get(&name.to_lowercase()) {
            Some(pose) => Setting::Known { name, pose: Box::new(*pose) },
            None => Setting::Named(name),
        }
    }

    /// Notes positions that are handed to a routine.
    fn call(&self, line: &Line<'_, 'a>, findings: &mut Findings, start: usize) {
        let tokens = line.tokens;
        if !tokens.is(start + 1, b'(') {
            return;
        }
        let routine = tokens.name(start).unwrap_or_default();
        for at in start + 1..line.range.end {
            if tokens.is(at, b'{') {
                let aggregate = Aggregate::read(tokens, at..line.range.end);
                let is_position = aggregate.is_some_and(|aggregate| aggregate.has("A1") || aggregate.has("X"));
                if is_position && line.file == 0 {
                    findings.leave(tokens.line(at), None, Reason::PassedTo(routine.clone()));
                }
                continue;
            }
            let Some(variable) = Variable::read(line, at) else { continue };
            if self.kind_of(&variable.key).is_some_and(Type::is_position) {
                findings.other_uses.push(OtherUse { key: variable.key, reason: Reason::PassedTo(routine.clone()) });
            }
        }
    }

    fn offset_uses(&self, line: &Line<'_, 'a>, findings: &mut Findings, range: Range<usize>) {
        for variable in range.filter_map(|at| Variable::read(line, at)) {
            if self.kind_of(&variable.key).is_some_and(Type::is_position) {
                findings.other_uses.push(OtherUse { key: variable.key, reason: Reason::OffsetBase });
            }
        }
    }

    fn motion(&mut self, line: &Line<'_, 'a>, findings: &mut Findings, instruction: &Instruction, start: usize) {
        let tokens = line.tokens;
        let with = (start..line.range.end).find(|at| tokens.is_word(*at, "WITH")).unwrap_or(line.range.end);
        let before = self.state.clone();
        // What a `WITH` part sets ends with the motion, so the block around it does not see it.
        let blocks = std::mem::take(&mut self.blocks);
        if with < line.range.end {
            self.with(line, with + 1);
        }
        let parts = tokens.split(start..with);
        let count = if instruction.way == Way::Circular { 2 } else { 1 };
        let mut points: Vec<Point> = parts
            .into_iter()
            .take(count)
            .map(|part| self.point(line, findings, part, instruction.is_relative))
            .collect();
        self.blocks = blocks;
        let Some(point) = points.pop() else { return };
        let is_stationary = self.state.is_stationary;
        let tool = self.setting(self.state.tool.as_ref(), "TOOL");
        findings.motions.push(Some(Motion {
            file: line.file,
            line: tokens.line(line.range.start),
            way: instruction.way,
            via: points.pop().map(Box::new),
            point,
            tool: if is_stationary { Err(Reason::StationaryTool) } else { Ok(tool) },
            frame: Ok(self.setting(self.state.base.as_ref(), "BASE")),
            configuration: None,
            spot: self.spot(line, with, start).map(Box::new),
        }));
        self.behind_motion = Some((line.file, line.range.end));
        self.state = before;
    }

    /// A plain `LIN` in the line behind another motion.
    fn spot(&self, line: &Line<'_, 'a>, end: usize, start: usize) -> Option<Spot> {
        let tokens = line.tokens;
        let (file, behind) = self.behind_motion?;
        let is_line_end = |at: usize| tokens.get(at).is_some_and(|token| token.kind == Kind::LineEnd);
        let is_next = file == line.file && (behind..line.range.start).all(is_line_end);
        let is_plain =
            tokens.is_word(line.range.start, "LIN") && start == line.range.start + 1 && end == line.range.end;
        if !is_plain || !is_next || line.file != 0 {
            return None;
        }
        let point_end =
            if tokens.is(start, b'{') { tokens.behind(start, end) } else { Variable::read(line, start)?.end };
        let instruction = tokens.bytes(line.range.clone());
        let spot = Spot::alone(tokens.text, instruction.clone(), tokens.bytes(start..point_end))?;
        let is_exact = point_end == end;
        let changes = if is_exact { vec![(instruction.end..instruction.end, " C_DIS")] } else { Vec::new() };
        Some(Spot { changes, ..spot })
    }

    /// Tool and base in the `WITH` part of a spline motion, such as `$TOOL=STOOL2(FP3)`.
    fn with(&mut self, line: &Line<'_, 'a>, start: usize) {
        let tokens = line.tokens;
        for part in tokens.split(start..line.range.end) {
            let value = part.start + 2..part.end;
            let data = || {
                let inside = tokens.name(value.start + 2).map(|name| name.to_lowercase());
                inside.and_then(|name| self.frame_data.get(&name)).cloned()
            };
            let is_call = tokens.is(value.start + 1, b'(');
            if tokens.is_word(part.start, "$TOOL") {
                let number = data().and_then(|data| data.tool);
                let tool = match number.filter(|_| is_call) {
                    Some(number) => Frame::Number(number),
                    None => frame(tokens, value, "TOOL_DATA"),
                };
                self.set_tool(tool);
            } else if tokens.is_word(part.start, "$BASE") {
                let number = data().and_then(|data| data.base);
                let base = match number.filter(|_| is_call) {
                    Some(number) => Frame::Number(number),
                    None => frame(tokens, value, "BASE_DATA"),
                };
                self.set_base(base);
            } else if tokens.is_word(part.start, "$IPO_MODE") {
                let is_tcp = tokens.is_word(value.start, "#TCP");
                self.state.is_stationary = is_tcp || data().is_some_and(|data| is_call && data.is_stationary);
            }
        }
    }

    fn point(&self, line: &Line<'_, 'a>, findings: &mut Findings, part: Range<usize>, is_relative: bool) -> Point {
        let tokens = line.tokens;
        if tokens.is(part.start, b'{') {
            let end = tokens.behind(part.start, part.end);
            if is_relative {
                return Point::Left { name: None, reason: Reason::Relative };
            }
            if tokens.is(end, b':') {
                return Point::Left { name: None, reason: Reason::Offset };
            }
            let aggregate = Aggregate::read(tokens, part.start..end);
            let content =
                aggregate.and_then(|aggregate| aggregate.literal(self.source)).unwrap_or(Err(Reason::Incomplete));
            return findings.here(line.file, tokens.line(part.start), content);
        }
        let Some(variable) = Variable::read(line, part.start) else {
            return Point::Left { name: None, reason: Reason::Computed };
        };
        let name = Some(variable.name.clone());
        if is_relative {
            findings.other_uses.push(OtherUse { key: variable.key, reason: Reason::Relative });
            return Point::Left { name, reason: Reason::Relative };
        }
        let is_alone = tokens.get(variable.end).is_none_or(|next| {
            variable.end >= part.end || next.kind == Kind::LineEnd || tokens.word(variable.end).is_some()
        });
        if !is_alone {
            let is_offset = tokens.is(variable.end, b':');
            self.offset_uses(line, findings, part.clone());
            let reason = if is_offset { Reason::Offset } else { Reason::Computed };
            return Point::Left { name: Some(tokens.source(part)), reason };
        }
        match variable.name.to_uppercase().as_str() {
            "$AXIS_ACT" | "$POS_ACT" | "$AXIS_INT" | "$POS_INT" => return Point::Current,
            system if system.starts_with('$') => return Point::Left { name, reason: Reason::SystemVariable },
            _ => {}
        }
        if self.parameters.contains(&(line.scope, variable.key.name.clone())) {
            return Point::Left { name, reason: Reason::Computed };
        }
        Point::Variable { key: variable.key, name: variable.name }
    }
}

/// Keeps a setting if it is the only one of the file.
fn note(known: &mut Option<Frame>, new: &Frame) {
    match known {
        Some(old) if old != new => *known = Some(Frame::Unknown),
        Some(_) => {}
        None => *known = Some(new.clone()),
    }
}

/// The value of `$TOOL` or `$BASE`.
fn frame(tokens: &Tokens<'_>, range: Range<usize>, data: &str) -> Frame {
    if tokens.is_word(range.start, "$NULLFRAME") || tokens.is_word(range.start, "$WORLD") {
        return Frame::Null;
    }
    if let Some(pose) = Aggregate::read(tokens, range.clone()).and_then(|aggregate| aggregate.frame()) {
        return Frame::Literal(pose);
    }
    let is_data = tokens.is_word(range.start, data) && tokens.is(range.start + 1, b'[');
    match tokens.get(range.start + 2) {
        Some(token) if is_data && token.kind == Kind::Number => Frame::Number(tokens.str(range.start + 2).to_owned()),
        _ => Frame::Variable(tokens.source(range)),
    }
}

fn behind_words(tokens: &Tokens<'_>, mut at: usize, words: &[&str]) -> usize {
    while words.iter().any(|word| tokens.is_word(at, word)) {
        at += 1;
    }
    at
}

fn is_coordinate(name: &str) -> bool {
    let name = name.to_ascii_uppercase();
    matches!(name.as_str(), "X" | "Y" | "Z" | "A" | "B" | "C" | "A1" | "A2" | "A3" | "A4" | "A5" | "A6")
}

struct Instruction {
    way: Way,
    is_relative: bool,
}

impl Instruction {
    fn named(word: &str) -> Option<Self> {
        let (name, is_relative) = match word.strip_suffix("_REL") {
            Some(name) => (name, true),
            None => (word, false),
        };
        let way = match name {
            "PTP" | "SPTP" => Way::Joint,
            "LIN" | "SLIN" | "SPL" => Way::Linear,
            "CIRC" | "SCIRC" => Way::Circular,
            _ => return None,
        };
        Some(Self { way, is_relative })
    }
}
