//! Reads VAL3: joints and points in data files (`.dtx`, of both XML forms), and the moves of programs (`.pgx`) that use them.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Isometry3;

use super::super::ProgramError;
use super::super::configuration::Configuration;
use super::super::findings::{Definition, Findings, Key, Literal, Motion, OtherUse, Point, Source, Way};
use super::super::lexer::{Kind, Rules, Tokens, Value};
use super::super::motion::{Form, JointUnit, Reason, Scan, Setting, Slot};
use super::super::orientation::Orientation;
use super::super::xml::{Tag, Xml};

const RULES: Rules = Rules { comment: b"//", quotes: b"\"", in_words: b"" };

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let files: Vec<Xml<'_>> = source.files().map(|(_, text)| Xml::read(text)).collect();
    let mut application =
        Application { source, frames: BTreeMap::new(), tools: BTreeMap::new(), fathers: BTreeMap::new() };
    let mut findings = Findings::default();
    for (file, xml) in files.iter().enumerate() {
        application.data(xml, file, &mut findings);
    }
    for (file, xml) in files.iter().enumerate() {
        for (range, line) in &xml.code {
            let tokens = Tokens::part(xml.text, range.clone(), *line, RULES);
            application.code(&tokens, file, &mut findings);
            findings.motions.push(None);
        }
    }
    findings.resolve(source)
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Joints(usize),
    Point,
    Frame,
    Tool,
}

impl Type {
    fn named(name: &str) -> Option<Self> {
        match name {
            "jointRx" | "joint" => Some(Self::Joints(6)),
            "jointRs" => Some(Self::Joints(4)),
            "pointRx" | "point" | "pointRs" => Some(Self::Point),
            "frame" => Some(Self::Frame),
            "tool" => Some(Self::Tool),
            _ => None,
        }
    }
}

/// A frame or tool, and the one that it is relative to.
#[derive(Clone, Debug)]
struct Child {
    pose: Option<Isometry3<f64>>,
    father: Option<String>,
}

/// A variable whose values follow.
struct Open {
    name: String,
    kind: Type,
    father: Option<String>,
    index: String,
}

struct Application<'a> {
    source: &'a Source<'a>,
    frames: BTreeMap<String, Child>,
    tools: BTreeMap<String, Child>,
    /// Frame of each point, by `name[index]`.
    fathers: BTreeMap<String, Option<String>>,
}

const POSE: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Deepest chain of frames.
const DEEPEST: usize = 16;

impl Application<'_> {
    fn data(&mut self, xml: &Xml<'_>, file: usize, findings: &mut Findings) {
        let text = xml.text;
        let mut open: Option<Open> = None;
        for (at, tag) in xml.tags.iter().enumerate() {
            let is_variable = matches!(tag.name.as_str(), "Data" | "joint" | "point" | "frame" | "tool");
            if is_variable {
                let kind = if tag.name == "Data" { tag.value(text, "type") } else { Some(tag.name.clone()) };
                let kind = kind.as_deref().and_then(Type::named).filter(|_| !tag.is_closing && !tag.is_empty);
                open = kind.zip(tag.value(text, "name")).map(|(kind, name)| Open {
                    name,
                    kind,
                    father: None,
                    index: String::new(),
                });
                continue;
            }
            let Some(variable) = open.as_mut().filter(|_| !tag.is_closing) else { continue };
            match tag.name.as_str() {
                "fatherAlias" => {
                    let index = tag.value(text, "fatherIndex").unwrap_or_else(|| "0".to_owned());
                    variable.father = tag.value(text, "name").map(|name| format!("{name}[{index}]"));
                }
                "valueJoint" | "valuePoint" | "valueFrame" | "valueTool" => {
                    variable.index = tag.value(text, "index").unwrap_or_default();
                }
                "Value" => {
                    variable.index = tag.value(text, "key").unwrap_or_default();
                    variable.father = tag.value(text, "fatherId");
                    let words = ["shoulder", "elbow", "wrist"].map(|name| tag.value(text, name));
                    self.value(xml, file, tag, variable, &words, findings);
                }
                "jointValue" => self.value(xml, file, tag, variable, &[None, None, None], findings),
                "tfValue" | "ttValue" => {
                    let rest = xml.tags.get(at + 1..).unwrap_or_default();
                    let near = rest.iter().take(12).take_while(|next| next.name != tag.name);
                    let near: Vec<&Tag> =
                        near.take_while(|next| !next.name.starts_with("value") || next.is_closing).collect();
                    let word = |name: &str| {
                        near.iter().find(|next| next.name == name).and_then(|next| next.value(text, "val"))
                    };
                    let words = ["cfShoulder", "cfElbow", "cfWrist"].map(word);
                    self.value(xml, file, tag, variable, &words, findings);
                }
                _ => {}
            }
        }
    }

    fn value(
        &mut self,
        xml: &Xml<'_>,
        file: usize,
        tag: &Tag,
        variable: &Open,
        words: &[Option<String>; 3],
        findings: &mut Findings,
    ) {
        let index = if variable.index.is_empty() { "0" } else { variable.index.as_str() };
        let full = format!("{}[{index}]", variable.name);
        let content = match variable.kind {
            Type::Joints(count) => self.joints(xml, tag, count),
            Type::Point => {
                self.fathers.insert(full.clone(), variable.father.clone());
                pose_numbers(xml, tag).and_then(|(slots, numbers)| {
                    let configuration = configuration(words)?;
                    Ok(Literal { form: Form::Pose(Orientation::MovingXyz), slots, numbers, configuration })
                })
            }
            Type::Frame | Type::Tool => {
                let numbers = pose_numbers(xml, tag).ok().map(|(_, numbers)| numbers);
                let pose = numbers.and_then(|numbers| Orientation::MovingXyz.pose(&numbers));
                let child = Child { pose, father: variable.father.clone() };
                let known = if variable.kind == Type::Frame { &mut self.frames } else { &mut self.tools };
                known.insert(full, child);
                return;
            }
        };
        findings.definitions.push(Definition {
            file,
            line: tag.line,
            name: Some(full),
            key: Key { scope: 0, name: variable.name.clone(), element: index.to_owned() },
            content,
            is_quiet: false,
        });
    }

    fn joints(&self, xml: &Xml<'_>, tag: &Tag, count: usize) -> Result<Literal, Reason> {
        let joints = self.source.robot.chain.dof();
        if count != joints {
            return Err(Reason::JointCount { found: count, joints });
        }
        let names: Vec<String> = (1..=joints).map(|axis| format!("j{axis}")).collect();
        let (slots, numbers) = tag.numbers(xml.text, &names)?;
        Ok(Literal { form: Form::Joints(JointUnit::Edge), slots, numbers, configuration: Configuration::Free })
    }

    /// The frame or tool of this name in the world or the flange, through all that it is relative to.
    fn chain(known: &BTreeMap<String, Child>, name: &str, root: &str) -> Setting {
        let mut pose = Isometry3::identity();
        let mut at = indexed(name);
        for _ in 0..DEEPEST {
            if at == indexed(root) {
                let is_root = at == indexed(name);
                return if is_root {
                    Setting::Identity
                } else {
                    Setting::Known { name: short(name), pose: Box::new(pose) }
                };
            }
            let Some(Child { pose: Some(own), father }) = known.get(&at) else {
                return Setting::Named(short(name));
            };
            pose = own * pose;
            at = father.as_deref().map_or_else(|| indexed(root), indexed);
        }
        Setting::Named(short(name))
    }

    fn code(&self, tokens: &Tokens<'_>, file: usize, findings: &mut Findings) {
        for at in 0..tokens.len() {
            let Some(name) = tokens.word(at) else { continue };
            if tokens.is(at + 1, b'(') {
                let end = tokens.behind(at + 1, (at + LONGEST).min(tokens.len()));
                let inside = at + 2..end.saturating_sub(1);
                match name.to_ascii_lowercase().as_str() {
                    "movej" => self.motion(tokens, file, findings, at, Way::Joint, inside),
                    "movel" => self.motion(tokens, file, findings, at, Way::Linear, inside),
                    "movec" => self.motion(tokens, file, findings, at, Way::Circular, inside),
                    _ if tokens.is_word(at.wrapping_sub(1), "call") => {
                        findings.other_uses.extend(inside.filter_map(|place| {
                            let key = Key { scope: 0, name: tokens.name(place)?, element: String::new() };
                            Some(OtherUse { key, reason: Reason::PassedTo(name.to_owned()) })
                        }));
                    }
                    _ => {}
                }
                continue;
            }
            self.assignment(tokens, file, findings, at);
        }
    }

    /// `jA={…}`, `jA=jB` and `jA.j1=…`.
    fn assignment(&self, tokens: &Tokens<'_>, file: usize, findings: &mut Findings, at: usize) {
        let is_start = at.checked_sub(1).is_none_or(|before| {
            tokens.get(before).is_none_or(|token| token.kind == Kind::LineEnd) || tokens.word(before).is_some()
        });
        let Some(variable) = Variable::read(tokens, at).filter(|_| is_start) else { return };
        let line = tokens.line(at);
        if tokens.is(variable.end, b'.') {
            let component = tokens.str(variable.end + 1);
            let is_coordinate = component.len() == 2 && component.starts_with(['j', 'r'])
                || component == "trsf"
                || component == "config";
            if is_coordinate && tokens.is(variable.end + 2, b'=') && file == 0 {
                findings.leave(line, Some(variable.name), Reason::Component);
            }
            return;
        }
        if !tokens.is(variable.end, b'=') || tokens.is(variable.end + 1, b'=') {
            return;
        }
        let start = variable.end + 1;
        if tokens.is(start, b'{') {
            let end = tokens.behind(start, (start + LONGEST).min(tokens.len()));
            let content = self.literal(tokens, start..end);
            let (name, key) = (Some(variable.name), variable.key);
            findings.definitions.push(Definition { file, line, name, key, content, is_quiet: false });
            return;
        }
        let original = Variable::read(tokens, start);
        let ends = |end: usize| tokens.get(end).is_none_or(|token| token.kind == Kind::LineEnd);
        if let Some(original) = original.filter(|original| ends(original.end)) {
            findings.copies.push((variable.element(), original.element()));
        }
    }

    /// A joint vector in braces.
    fn literal(&self, tokens: &Tokens<'_>, range: Range<usize>) -> Result<Literal, Reason> {
        let joints = self.source.robot.chain.dof();
        let value = Value::read(tokens, range, b'{');
        let numbers = value.numbers().ok_or(Reason::Computed)?;
        if numbers.len() != joints {
            return Err(Reason::JointCount { found: numbers.len(), joints });
        }
        Ok(Literal {
            form: Form::Joints(JointUnit::Edge),
            slots: numbers.iter().map(|number| Slot::at(number.place.clone())).collect(),
            numbers: numbers.iter().map(|number| number.value).collect(),
            configuration: Configuration::Free,
        })
    }

    fn motion(
        &self,
        tokens: &Tokens<'_>,
        file: usize,
        findings: &mut Findings,
        at: usize,
        way: Way,
        inside: Range<usize>,
    ) {
        let parts = tokens.split(inside);
        let count = if way == Way::Circular { 2 } else { 1 };
        let line = tokens.line(at);
        let tool = match parts.get(count).and_then(|part| Variable::read(tokens, part.start)) {
            Some(variable) => Self::chain(&self.tools, &variable.full(), "flange"),
            None => Setting::Named("tool".to_owned()),
        };
        let mut frame = Setting::Identity;
        let mut is_framed = false;
        let mut points = Vec::new();
        for part in parts.into_iter().take(count) {
            if tokens.is(part.start, b'{') {
                let content = self.literal(tokens, part.clone());
                points.push(findings.here(file, tokens.line(part.start), content));
                continue;
            }
            let variable = Variable::read(tokens, part.start).filter(|variable| variable.end == part.end);
            if let Some(variable) = variable {
                let key = variable.element();
                if let Some(father) = self.father(&key) {
                    if is_framed && father != frame {
                        leave(&mut points, findings);
                    }
                    frame = father;
                    is_framed = true;
                }
                points.push(Point::Variable { key, name: variable.name });
                continue;
            }
            let is_offset = tokens.is_word(part.start, "appro") || tokens.is_word(part.start, "compose");
            if let Some(base) = Variable::read(tokens, part.start + 2).filter(|_| is_offset) {
                findings.other_uses.push(OtherUse { key: base.element(), reason: Reason::OffsetBase });
            }
            let reason = if is_offset { Reason::Offset } else { Reason::Computed };
            points.push(Point::Left { name: Some(tokens.source(part)), reason });
        }
        let Some(point) = points.pop() else { return };
        findings.motions.push(Some(Motion {
            file,
            line,
            way,
            via: points.pop().map(Box::new),
            point,
            tool: Ok(tool),
            frame: Ok(frame),
            configuration: None,
            spot: None,
        }));
    }

    /// Frame of a point; of any element, if all have the same.
    fn father(&self, key: &Key) -> Option<Setting> {
        let element = if key.element.is_empty() { "0" } else { key.element.as_str() };
        let father = self.fathers.get(&format!("{}[{element}]", key.name))?;
        Some(father.as_deref().map_or(Setting::Identity, |father| Self::chain(&self.frames, father, "world")))
    }
}

/// Leaves the via point of a motion whose end is in another frame: a motion has one frame only.
fn leave(points: &mut [Point], findings: &mut Findings) {
    for point in points {
        if let Point::Variable { key, name } = point {
            let reason = Reason::SeveralSettings;
            findings.other_uses.push(OtherUse { key: key.clone(), reason: reason.clone() });
            *point = Point::Left { name: Some(name.clone()), reason };
        }
    }
}

/// Longest list of arguments (tokens).
const LONGEST: usize = 2000;

/// A name with its index.
struct Variable {
    name: String,
    key: Key,
    /// Place behind it.
    end: usize,
}

impl Variable {
    fn read(tokens: &Tokens<'_>, at: usize) -> Option<Self> {
        let name = tokens.name(at)?;
        let mut key = Key { scope: 0, name: name.clone(), element: String::new() };
        if !tokens.is(at + 1, b'[') {
            return Some(Self { name, key, end: at + 1 });
        }
        let end = tokens.behind(at + 1, (at + 64).min(tokens.len()));
        let shown = tokens.source(at..end);
        if end == at + 4 && tokens.get(at + 2).is_some_and(|token| token.kind == Kind::Number) {
            tokens.str(at + 2).clone_into(&mut key.element);
        }
        Some(Self { name: shown, key, end })
    }

    /// The element that is meant: without an index, the first.
    fn element(&self) -> Key {
        if self.name.ends_with(']') { self.key.clone() } else { self.first() }
    }

    /// The first element.
    fn first(&self) -> Key {
        Key { element: "0".to_owned(), ..self.key.clone() }
    }

    fn full(&self) -> String {
        let element = if self.key.element.is_empty() { "0" } else { self.key.element.as_str() };
        format!("{}[{element}]", self.key.name)
    }
}

fn indexed(name: &str) -> String {
    if name.ends_with(']') { name.to_owned() } else { format!("{name}[0]") }
}

/// `fPart[0]` as people write it.
fn short(name: &str) -> String {
    name.strip_suffix("[0]").unwrap_or(name).to_owned()
}

fn pose_numbers(xml: &Xml<'_>, tag: &Tag) -> Result<(Vec<Slot>, Vec<f64>), Reason> {
    tag.numbers(xml.text, &POSE.map(str::to_owned))
}

/// Shoulder, elbow and wrist; a missing word keeps the form of the arm.
fn configuration(words: &[Option<String>; 3]) -> Result<Configuration, Reason> {
    let part = |word: &Option<String>, no: &str, yes: &str| match word.as_deref() {
        Some(word) if word == no => Ok(Some(false)),
        Some(word) if word == yes => Ok(Some(true)),
        None | Some("" | "ssame" | "sfree" | "esame" | "efree" | "wsame" | "wfree" | "same" | "free") => Ok(None),
        Some(_) => Err(Reason::UnknownConfiguration),
    };
    let [shoulder, elbow, wrist] = words;
    Ok(Configuration::Val3 {
        righty: part(shoulder, "lefty", "righty")?,
        elbow_is_positive: part(elbow, "enegative", "epositive")?,
        wrist_is_positive: part(wrist, "wnegative", "wpositive")?,
    })
}
