//! Reads FANUC TP programs (`.LS`): positions of group 1 and the motion lines that use them; frames of `.VA` files.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Isometry3;

use super::super::ProgramError;
use super::super::configuration::{Configuration, FanucConfig};
use super::super::findings::{Definition, Findings, Key, Literal, Motion, OtherUse, Point, Source, Way};
use super::super::lexer::{as_str, latin, lines};
use super::super::motion::{Form, JointUnit, LeftAlone, Reason, Scan, Setting, Slot};
use super::super::orientation::Orientation;

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let mut findings = Findings::default();
    let mut frames = BTreeMap::new();
    for (_, text) in source.files() {
        known_frames(text, &mut frames);
    }
    if find(source.program, b"[*POSREG*]").is_some() {
        return Ok(Scan { left: registers(source.program), ..Scan::default() });
    }
    for (_, text) in source.files() {
        forget_assigned(text, &mut frames);
    }
    let positions = positions(source, &mut findings, &frames);
    for line in statements(source.program) {
        motion(&line, &positions, &mut findings);
    }
    findings.resolve(source)
}

/// Tool and frame that a position states.
struct Position {
    tool: Result<Setting, Reason>,
    frame: Result<Setting, Reason>,
}

/// A line of the program part, with its continuation.
struct Statement {
    line: usize,
    text: String,
}

/// Instructions between `/MN` and `/POS`, without remarks and without lines that are commented out.
fn statements(text: &[u8]) -> Vec<Statement> {
    let mut statements: Vec<Statement> = Vec::new();
    let mut is_program = false;
    for (line, place) in lines(text) {
        let content = latin(text.get(place).unwrap_or_default());
        let content = content.trim_end();
        match content {
            "/MN" => is_program = true,
            "/POS" | "/END" => is_program = false,
            _ if !is_program => {}
            _ => {
                let Some((number, rest)) = content.split_once(':') else { continue };
                let rest = rest.trim_end_matches(';').trim();
                let is_new = number.trim().bytes().all(|byte| byte.is_ascii_digit()) && !number.trim().is_empty();
                if is_new {
                    statements.push(Statement { line, text: rest.to_owned() });
                } else if let Some(last) = statements.last_mut().filter(|_| number.trim().is_empty()) {
                    last.text.push(' ');
                    last.text.push_str(rest);
                }
            }
        }
    }
    let is_remark = |text: &str| text.starts_with('!') || text.starts_with("//") || text.starts_with("--");
    statements.retain(|statement| !is_remark(&statement.text));
    statements
}

/// A mention of `P[…]` or `PR[…]`: what is in the brackets without the comment, and its place.
struct Mention<'s> {
    is_register: bool,
    number: &'s str,
    shown: &'s str,
    end: usize,
}

fn mentions(text: &str) -> Vec<Mention<'_>> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(next) = text.get(at..).and_then(|rest| rest.find('P')) {
        let start = at + next;
        at = start + 1;
        let is_inside_word =
            text.get(..start).is_some_and(|before| before.ends_with(|c: char| c.is_ascii_alphanumeric()));
        let behind = text.get(start + 1..).unwrap_or_default();
        let (is_register, length) = match behind.as_bytes() {
            [b'[', ..] => (false, 2),
            [b'R', b'[', ..] => (true, 3),
            _ => continue,
        };
        if is_inside_word {
            continue;
        }
        let mut depth = 1_usize;
        let inside = text.get(start + length..).unwrap_or_default();
        let Some(close) = inside.bytes().position(|byte| {
            match byte {
                b'[' => depth += 1,
                b']' => depth -= 1,
                _ => {}
            }
            depth == 0
        }) else {
            break;
        };
        let end = start + length + close + 1;
        let bracket = inside.get(..close).unwrap_or_default();
        let number = if bracket.starts_with(|c: char| c.is_ascii_digit()) {
            bracket.split_once(':').map_or(bracket, |(number, _)| number)
        } else {
            bracket
        };
        found.push(Mention {
            is_register,
            number: number.trim(),
            shown: text.get(start..end).unwrap_or_default(),
            end,
        });
        at = end;
    }
    found
}

fn motion(statement: &Statement, positions: &BTreeMap<String, Position>, findings: &mut Findings) {
    let text = statement.text.as_str();
    let all = mentions(text);
    let way = match text.as_bytes() {
        [b'J', b' ', ..] => Some(Way::Joint),
        [b'L' | b'S', b' ', ..] => Some(Way::Linear),
        [b'C' | b'A', b' ', ..] => Some(Way::Circular),
        _ => None,
    };
    let is_motion =
        all.first().is_some_and(|first| text.get(1..).unwrap_or_default().trim_start().starts_with(first.shown));
    let Some(way) = way.filter(|_| is_motion) else {
        for mention in all.iter().filter(|mention| !mention.is_register) {
            findings.other_uses.push(OtherUse { key: key(mention.number), reason: Reason::NotMovedTo });
        }
        return;
    };
    let count = if text.starts_with('C') { 2 } else { 1 };
    let rest = all.get(count - 1).and_then(|last| text.get(last.end..)).unwrap_or_default();
    let words: Vec<String> = rest
        .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_uppercase)
        .collect();
    let has = |names: &[&str]| words.iter().any(|word| names.contains(&word.as_str()));
    let shift = if has(&["INC"]) {
        Some(Reason::Relative)
    } else if has(&["OFFSET", "TOOL_OFFSET", "VOFFSET"]) {
        Some(Reason::Offset)
    } else {
        None
    };
    let mut used = None;
    let mut via = None;
    let mut points: Vec<Point> = Vec::new();
    for mention in all.iter().take(count) {
        let name = Some(mention.shown.to_owned());
        let is_constant = !mention.number.is_empty() && mention.number.bytes().all(|byte| byte.is_ascii_digit());
        points.push(match &shift {
            _ if mention.is_register => Point::Left { name, reason: Reason::Register },
            Some(reason) => {
                let its = if *reason == Reason::Offset { Reason::OffsetBase } else { Reason::Relative };
                findings.other_uses.push(OtherUse { key: key(mention.number), reason: its });
                Point::Left { name, reason: reason.clone() }
            }
            None if !is_constant => Point::Left { name, reason: Reason::Computed },
            None => {
                via = used;
                used = positions.get(mention.number);
                Point::Variable { key: key(mention.number), name: mention.shown.to_owned() }
            }
        });
    }
    let Some(point) = points.pop() else { return };
    // A motion has the settings of its end. A via point with others is not tied to it and keeps those that it states.
    let is_apart =
        via.zip(used).is_some_and(|(via, end): (&Position, &Position)| via.tool != end.tool || via.frame != end.frame);
    let via = points.pop().filter(|_| !is_apart).map(Box::new);
    let identity = || Ok(Setting::Identity);
    findings.motions.push(Some(Motion {
        file: 0,
        line: statement.line,
        way,
        via,
        point,
        // Every position states its own tool and frame.
        tool: used.map_or_else(identity, |position| position.tool.clone()),
        frame: used.map_or_else(identity, |position| position.frame.clone()),
        configuration: None,
        spot: None,
    }));
}

fn key(number: &str) -> Key {
    Key { scope: 0, name: format!("P[{number}]"), element: String::new() }
}

/// Reads the position part.
fn positions(
    source: &Source<'_>,
    findings: &mut Findings,
    frames: &BTreeMap<String, Isometry3<f64>>,
) -> BTreeMap<String, Position> {
    let text = source.program;
    let mut positions = BTreeMap::new();
    let mut is_positions = false;
    let mut open: Option<Header> = None;
    for (line, place) in lines(text) {
        let content = text.get(place.clone()).unwrap_or_default();
        let trimmed = content.trim_ascii();
        if content.trim_ascii_end() == b"/POS" {
            is_positions = true;
        } else if content.trim_ascii_end() == b"/END" {
            is_positions = false;
        }
        if !is_positions {
            continue;
        }
        if let Some(header) = Header::read(line, place.clone(), content) {
            close(source, findings, frames, &mut positions, open.replace(header), place.start);
        } else if trimmed.starts_with(b"}") {
            close(source, findings, frames, &mut positions, open.take(), place.start);
        }
    }
    close(source, findings, frames, &mut positions, open, text.len());
    positions
}

/// `P[1:"comment"]{`.
struct Header {
    line: usize,
    number: String,
    /// Place behind the brace.
    end: usize,
}

impl Header {
    fn read(line: usize, place: Range<usize>, content: &[u8]) -> Option<Self> {
        let blanks = content.len() - content.trim_ascii_start().len();
        let inside = content.get(blanks..)?.strip_prefix(b"P[")?;
        let digits = inside.iter().take_while(|byte| byte.is_ascii_digit()).count();
        // The comment is in quotes and may contain anything but a quote.
        let brace = inside.iter().rposition(|byte| *byte == b'{')?;
        let number = as_str(inside, 0..digits).trim_start_matches('0').to_owned();
        (digits > 0).then(|| Self {
            line,
            number: if number.is_empty() { "0".to_owned() } else { number },
            end: place.start + blanks + 2 + brace + 1,
        })
    }
}

fn close(
    source: &Source<'_>,
    findings: &mut Findings,
    frames: &BTreeMap<String, Isometry3<f64>>,
    positions: &mut BTreeMap<String, Position>,
    header: Option<Header>,
    end: usize,
) {
    let Some(header) = header else { return };
    let group = group(source.program, header.end..end);
    let body = group.clone().map(|range| Body::read(source.program, range)).unwrap_or_default();
    let content = if group.is_none() { Err(Reason::OtherGroup) } else { body.literal(source) };
    let setting = |name: &str, number: Option<&String>| match number.map(String::as_str) {
        Some("0") => Ok(Setting::Identity),
        Some(number) => {
            let name = format!("{name}[{number}]");
            Ok(match frames.get(&name) {
                Some(pose) => Setting::Known { name, pose: Box::new(*pose) },
                None => Setting::Named(name),
            })
        }
        None => Ok(Setting::Named(name.to_owned())),
    };
    let position =
        Position { tool: setting("UTOOL", body.words.get("UT")), frame: setting("UFRAME", body.words.get("UF")) };
    findings.always.insert(findings.definitions.len(), [position.tool.clone(), position.frame.clone()]);
    findings.definitions.push(Definition {
        file: 0,
        line: header.line,
        name: Some(format!("P[{}]", header.number)),
        key: key(&header.number),
        content,
        is_quiet: false,
    });
    positions.insert(header.number, position);
}

/// The part of group 1, or everything if no group is named.
fn group(text: &[u8], range: Range<usize>) -> Option<Range<usize>> {
    let mut groups: Vec<(bool, usize)> = Vec::new();
    for (_, place) in lines(text.get(range.clone()).unwrap_or_default()) {
        let line = text.get(range.start + place.start..range.start + place.end).unwrap_or_default().trim_ascii();
        let number = line.strip_prefix(b"GP").and_then(|rest| rest.strip_suffix(b":"));
        if let Some(number) = number.filter(|number| number.iter().all(u8::is_ascii_digit)) {
            groups.push((number == b"1", range.start + place.end));
        }
    }
    let first = groups.iter().position(|(is_first, _)| *is_first);
    match first {
        Some(index) => {
            let start = groups.get(index).map_or(range.start, |(_, start)| *start);
            Some(start..groups.get(index + 1).map_or(range.end, |(_, start)| *start))
        }
        None => groups.is_empty().then_some(range),
    }
}

/// Fields of a position.
#[derive(Default)]
struct Body {
    /// Name and place of the number, with the blanks in front of it.
    numbers: Vec<(String, Range<usize>, Option<f64>)>,
    words: BTreeMap<String, String>,
}

impl Body {
    fn read(text: &[u8], range: Range<usize>) -> Self {
        let mut body = Self::default();
        let mut at = range.start;
        while at < range.end {
            let Some(&byte) = text.get(at) else { break };
            if !byte.is_ascii_alphabetic() {
                at += 1;
                continue;
            }
            let start = at;
            at = end_while(text, at, range.end, |byte| byte.is_ascii_alphanumeric() || byte == b'_');
            let name = as_str(text, start..at).to_owned();
            let sign = end_while(text, at, range.end, |byte| byte == b' ' || byte == b'\t');
            match text.get(sign).filter(|_| sign < range.end) {
                Some(b'=') => {
                    let first = end_while(text, sign + 1, range.end, |byte| byte == b' ');
                    let end = end_while(text, first, range.end, |byte| {
                        byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+' | b'*')
                    });
                    let value = as_str(text, first..end).parse::<f64>().ok().filter(|value| value.is_finite());
                    body.numbers.push((name, sign + 1..end, value));
                    // The unit behind the number is no name.
                    at = end_while(text, end, range.end, |byte| byte != b',' && byte != b'\n');
                }
                Some(b':') => {
                    let first = end_while(text, sign + 1, range.end, |byte| byte == b' ');
                    let is_text = text.get(first) == Some(&b'\'');
                    let end = if is_text {
                        1 + end_while(text, first + 1, range.end, |byte| byte != b'\'' && byte != b'\n')
                    } else {
                        end_while(text, first, range.end, |byte| byte != b',' && byte != b'\n')
                    };
                    let word = as_str(text, first..end.min(range.end)).trim().trim_matches('\'').to_owned();
                    body.words.insert(name, word);
                    at = end;
                }
                _ => {}
            }
        }
        body
    }

    fn literal(&self, source: &Source<'_>) -> Result<Literal, Reason> {
        let named = |name: &str| self.numbers.iter().find(|(found, ..)| found == name);
        let is_axis = |name: &str| {
            name.strip_prefix('J')
                .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
        };
        let axes = self.numbers.iter().filter(|(name, ..)| is_axis(name)).count();
        let (names, form): (Vec<String>, Form) = if axes > 0 {
            let joints = source.robot.chain.dof();
            if axes != joints {
                return Err(Reason::JointCount { found: axes, joints });
            }
            ((1..=joints).map(|axis| format!("J{axis}")).collect(), Form::Joints(JointUnit::Edge))
        } else {
            (["X", "Y", "Z", "W", "P", "R"].map(str::to_owned).to_vec(), Form::Pose(Orientation::FixedXyz))
        };
        let fields: Option<Vec<_>> = names.iter().map(|name| named(name)).collect();
        let Some(fields) = fields else {
            return Err(if self.numbers.is_empty() { Reason::Untaught } else { Reason::Incomplete });
        };
        if fields
            .iter()
            .any(|(_, place, _)| source.program.get(place.clone()).is_some_and(|field| field.contains(&b'*')))
        {
            return Err(Reason::Untaught);
        }
        let numbers: Option<Vec<f64>> = fields.iter().map(|(_, _, value)| *value).collect();
        let Some(numbers) = numbers else { return Err(Reason::Unreadable) };
        let configuration = match form {
            Form::Joints(_) => Configuration::Free,
            Form::Pose(_) => {
                let is_moved = |(name, _, value): &(String, Range<usize>, Option<f64>)| {
                    name.len() == 2 && name.starts_with('E') && *value != Some(0.0)
                };
                if self.numbers.iter().any(is_moved) && !source.options.ignores_external_axes {
                    return Err(Reason::ExternalAxes);
                }
                let config = self.words.get("CONFIG").and_then(|text| config(text));
                Configuration::Fanuc(config.ok_or(Reason::UnknownConfiguration)?)
            }
        };
        let slots = fields.iter().map(|(_, place, _)| Slot::at(place.clone())).collect();
        Ok(Literal { form, slots, numbers, configuration })
    }
}

/// `N U T, 0, 0, 0`, with `L` or `R` on some arms.
fn config(text: &str) -> Option<FanucConfig> {
    let mut parts = text.split([',', ' ']).map(str::trim).filter(|part| !part.is_empty()).peekable();
    let is_flipped = match parts.next()? {
        "N" => false,
        "F" => true,
        _ => return None,
    };
    let is_left = match parts.peek().copied() {
        Some("L") => Some(true),
        Some("R") => Some(false),
        _ => None,
    };
    if is_left.is_some() {
        parts.next();
    }
    let elbow_is_up = match parts.next()? {
        "U" => true,
        "D" => false,
        _ => return None,
    };
    let is_front = match parts.next()? {
        "T" => true,
        "B" => false,
        _ => return None,
    };
    let mut turns = [0; 3];
    for turn in &mut turns {
        *turn = parts.next()?.parse().ok()?;
    }
    Some(FanucConfig { is_flipped, elbow_is_up, is_front, is_left, turns })
}

fn end_while(text: &[u8], from: usize, end: usize, is: impl Fn(u8) -> bool) -> usize {
    let rest = text.get(from..end).unwrap_or_default();
    from + rest.iter().take_while(|byte| is(**byte)).count()
}

fn find(text: &[u8], mark: &[u8]) -> Option<usize> {
    text.windows(mark.len()).position(|window| window == mark)
}

/// The beginning of an entry, as `[1,5] =`.
struct Entry {
    number: u32,
    /// Whether it belongs to group 1, the arm.
    is_of_arm: bool,
}

fn entry(line: &str) -> Option<Entry> {
    let (inside, rest) = line.trim().strip_prefix('[')?.split_once(']')?;
    if !rest.trim_start().starts_with('=') {
        return None;
    }
    let (group, number) = inside.split_once(',')?;
    let number = number.trim().parse().ok()?;
    Some(Entry { number, is_of_arm: group.trim() == "1" })
}

/// Positions registers of a `posreg.va`.
fn registers(text: &[u8]) -> Vec<LeftAlone> {
    let mut left = Vec::new();
    for (line, place) in lines(text) {
        let content = latin(text.get(place).unwrap_or_default());
        if let Some(Entry { number, is_of_arm: true }) = entry(&content) {
            left.push(LeftAlone { line, name: Some(format!("PR[{number}]")), reason: Reason::Register });
        }
    }
    left
}

/// Drops tools and frames that a program sets, such as `UFRAME[1]=PR[2]`: their values in the files may not be in force.
fn forget_assigned(text: &[u8], frames: &mut BTreeMap<String, Isometry3<f64>>) {
    for statement in statements(text) {
        for kind in ["UFRAME[", "UTOOL["] {
            for part in statement.text.split(kind).skip(1) {
                let Some((inside, rest)) = part.split_once(']') else { continue };
                if !rest.trim_start_matches(']').trim_start().starts_with('=') {
                    continue;
                }
                let number = inside.split(':').next().unwrap_or_default().trim();
                match number.parse::<u32>() {
                    Ok(number) => {
                        frames.remove(&format!("{kind}{number}]"));
                    }
                    // A number that is computed may be any.
                    Err(_) => frames.retain(|name, _| !name.starts_with(kind)),
                }
            }
        }
    }
}

/// Tools and frames of a variable file: `$MNUTOOL` and `$MNUFRAME`.
fn known_frames(text: &[u8], frames: &mut BTreeMap<String, Isometry3<f64>>) {
    if find(text, b"$MNUTOOL").is_none() && find(text, b"$MNUFRAME").is_none() {
        return;
    }
    let mut kind = None;
    let mut open: Option<(String, Vec<f64>)> = None;
    for (_, place) in lines(text) {
        let line = latin(text.get(place).unwrap_or_default());
        if line.contains('$') {
            let is_variable = |name: &str| line.contains(&format!("{name} ")) || line.trim_end().ends_with(name);
            kind = match (is_variable("$MNUTOOL"), is_variable("$MNUFRAME")) {
                (true, _) => Some("UTOOL"),
                (_, true) => Some("UFRAME"),
                _ => None,
            };
            open = None;
        }
        let Some(kind) = kind else { continue };
        if let Some(Entry { number, is_of_arm }) = entry(&line) {
            open = is_of_arm.then(|| (format!("{kind}[{number}]"), Vec::new()));
            continue;
        }
        let Some((name, values)) = open.as_mut() else { continue };
        let words: Vec<&str> =
            line.split(|c: char| c.is_whitespace() || c == ':' || c == '=').filter(|word| !word.is_empty()).collect();
        for pair in words.windows(2) {
            let expected = ["X", "Y", "Z", "W", "P", "R"].get(values.len());
            if let [label, value] = pair
                && Some(label) == expected
                && let Ok(value) = value.parse::<f64>()
            {
                values.push(value);
            }
        }
        if values.len() == 6
            && let Some(pose) = Orientation::FixedXyz.pose(values)
        {
            frames.insert(name.clone(), pose);
            open = None;
        }
    }
}
