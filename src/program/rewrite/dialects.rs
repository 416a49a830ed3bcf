//! The form of joint targets in each language.

use std::collections::BTreeSet;
use std::ops::Range;

use super::scanner::{after_blanks, are_numbers, items, line_of, masked, part};
use super::{CARTESIAN, Dialect, LeftAlone, RELATIVE, UNREADABLE};

/// The values of a target as ranges of the text, in the order of the text.
pub(super) struct TargetFields {
    pub(super) line: usize,
    pub(super) fields: Vec<Range<usize>>,
}

/// Targets of a program, and lines that are not changed.
#[derive(Default)]
pub(super) struct Matches {
    pub(super) targets: Vec<TargetFields>,
    pub(super) left: Vec<LeftAlone>,
}

impl Matches {
    fn target(&mut self, line: usize, fields: Vec<Range<usize>>) {
        self.targets.push(TargetFields { line, fields });
    }

    fn leave(&mut self, line: usize, reason: &'static str) {
        self.left.push(LeftAlone { line, reason });
    }
}

pub(super) fn find(dialect: Dialect, dof: usize, program: &[u8]) -> Matches {
    match dialect {
        Dialect::Rapid => rapid(dof, &masked(program, "!", None, true)),
        Dialect::Krl => krl(dof, &masked(program, ";", None, true)),
        Dialect::Fanuc => fanuc(dof, &masked(program, "", None, false)),
        Dialect::Urscript => urscript(dof, &masked(program, "#", None, true)),
        Dialect::Val3 => val3(dof, &masked(program, "", Some(("<!--", "-->")), false)),
        Dialect::Inform => inform(dof, &masked(program, "", None, false)),
        Dialect::Ros => ros(dof, &masked(program, "#", None, false)),
    }
}

/// Lines with their number and offset.
fn lines(text: &str) -> impl Iterator<Item = (usize, usize, &str)> {
    let mut at = 0;
    text.split('\n').enumerate().map(move |(index, line)| {
        let start = at;
        at += line.len() + 1;
        (index + 1, start, line)
    })
}

/// Finds `[[j1,…,j6],[e1,…,e6]]`.
fn rapid(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    let mut lines_done = BTreeSet::new();
    for (at, _) in text.match_indices('[') {
        let inner = after_blanks(text, at + 1);
        let Some((values, end)) = items(text, inner, '[', ']') else { continue };
        let comma = after_blanks(text, end);
        let second = after_blanks(text, comma + 1);
        let extra = if text.get(comma..).is_some_and(|rest| rest.starts_with(',')) {
            items(text, second, '[', ']')
        } else {
            None
        };
        let Some((extra, _)) = extra else { continue };
        if values.len() == 6 && extra.len() == 6 {
            let line = line_of(text, at);
            lines_done.insert(line);
            if dof == 6 && are_numbers(text, &values) {
                matches.target(line, values);
            } else {
                matches.leave(line, UNREADABLE);
            }
        }
    }
    for (line, _, code) in lines(text).filter(|(line, _, _)| !lines_done.contains(line)) {
        let lower = code.to_ascii_lowercase();
        let has_literal = lower.contains('[') || lower.contains(":=");
        if (lower.contains("moveabsj") && lower.contains('[')) || (lower.contains("jointtarget") && has_literal) {
            matches.leave(line, UNREADABLE);
        } else if lower.contains("robtarget") && has_literal
            || ["movel ", "movej ", "movec "].iter().any(|word| lower.contains(word))
        {
            matches.leave(line, CARTESIAN);
        }
    }
    matches
}

/// Finds `{A1 …,A2 …,…}`, also after a type.
fn krl(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    for (at, _) in text.match_indices('{') {
        let Some((parts, _)) = items(text, at, '{', '}') else { continue };
        let line = line_of(text, at);
        let before = part(text, text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |end| end + 1)..at);
        let mut values: Vec<Option<Range<usize>>> = vec![None; dof];
        let (mut axes, mut is_cartesian) = (0, false);
        for item in parts {
            let whole = part(text, item.clone());
            // `{E6AXIS: A1 0,…}`
            let named = whole.split_once(':').map_or(whole, |(_, rest)| rest).trim_start();
            let (name, value) = named.split_once(char::is_whitespace).unwrap_or((named, ""));
            let lead = item.end - value.trim_start().len();
            let axis = name.strip_prefix(['A', 'a']).and_then(|digits| digits.parse::<usize>().ok());
            is_cartesian |= ["X", "Y", "Z"].iter().any(|known| name.eq_ignore_ascii_case(known));
            if let Some(axis) = axis {
                axes += 1;
                if let Some(slot) = axis.checked_sub(1).and_then(|index| values.get_mut(index)) {
                    *slot = Some(lead..item.end);
                }
            }
        }
        let upper = before.to_ascii_uppercase();
        let values: Option<Vec<Range<usize>>> = values.into_iter().collect();
        if axes == 0 {
            if is_cartesian && ["PTP", "LIN", "CIRC", "POS", "SPL"].iter().any(|word| upper.contains(word)) {
                matches.leave(line, CARTESIAN);
            }
        } else if upper.contains("_REL") {
            matches.leave(line, RELATIVE);
        } else {
            match values {
                Some(values) if axes == dof && are_numbers(text, &values) => matches.target(line, values),
                _ => matches.leave(line, UNREADABLE),
            }
        }
    }
    matches
}

/// Finds `P[1]{ GP1: … J1= 0.000 deg, … };`, in group 1 only.
fn fanuc(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    let start = text.find("/POS").unwrap_or(text.len());
    let mut at = start;
    while let Some(place) = text.get(at..).and_then(|rest| rest.find("P[")).map(|place| at + place) {
        let end = text.get(place..).and_then(|rest| rest.find("};")).map_or(text.len(), |end| place + end);
        at = end.max(place + 2);
        let line = line_of(text, place);
        let block = part(text, place..end);
        let Some(group) = block.find("GP1") else {
            matches.leave(line, UNREADABLE);
            continue;
        };
        let stop = block.find("GP2").unwrap_or(block.len());
        let group = place + group..place + stop.max(group);
        let values: Vec<Option<Range<usize>>> = (1..=dof).map(|axis| fanuc_value(text, &group, axis)).collect();
        let is_joint = part(text, group.clone()).contains("J1");
        let values: Option<Vec<Range<usize>>> = values.into_iter().collect();
        // More axes than the arm has belong to equipment that is not in the profile.
        let has_more = fanuc_value(text, &group, dof + 1).is_some();
        match values {
            Some(values) if !has_more => matches.target(line, values),
            _ if is_joint => matches.leave(line, UNREADABLE),
            _ => matches.leave(line, CARTESIAN),
        }
    }
    matches
}

/// The number in `J1=   10.000 deg`, with the blanks before it.
fn fanuc_value(text: &str, group: &Range<usize>, axis: usize) -> Option<Range<usize>> {
    let mark = format!("J{axis}");
    let inside = part(text, group.clone());
    let place = inside.find(&mark)? + mark.len();
    let rest = inside.get(place..)?;
    let equals = rest.find('=')?;
    if !rest.get(..equals)?.trim().is_empty() {
        return None;
    }
    let value = rest.get(equals + 1..)?;
    let blanks = value.len() - value.trim_start_matches(' ').len();
    let length = value.trim_start_matches(' ').find([' ', ',', '\t', '\r', '\n'])?;
    let start = group.start + place + equals + 1;
    Some(start..start + blanks + length)
}

/// Finds `movej([…]`, and `name=[…]` if the program contains `movej(name`.
fn urscript(dof: usize, text: &str) -> Matches {
    const MOVES: [&str; 4] = ["movej", "movel", "movep", "servoj"];
    let mut matches = Matches::default();
    let mut names: BTreeSet<&str> = BTreeSet::new();
    for (line, start, code) in lines(text) {
        if code.contains("movec(") {
            matches.leave(line, CARTESIAN);
        }
        for (place, name) in MOVES.iter().flat_map(|name| code.match_indices(*name)) {
            let open = after_blanks(text, start + place + name.len());
            if !text.get(open..).is_some_and(|rest| rest.starts_with('(')) {
                continue;
            }
            let argument = after_blanks(text, open + 1);
            let rest = text.get(argument..).unwrap_or_default();
            if rest.starts_with('[') {
                match items(text, argument, '[', ']') {
                    Some((values, _)) if values.len() == dof && are_numbers(text, &values) => {
                        matches.target(line, values);
                    }
                    _ => matches.leave(line, UNREADABLE),
                }
            } else {
                let length = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
                let word = part(text, argument..argument + length);
                let next = rest.get(length..).unwrap_or_default();
                if word.is_empty() || next.starts_with(['[', '(']) {
                    matches.leave(line, if word == "p" || word.starts_with("pose") { CARTESIAN } else { UNREADABLE });
                } else {
                    names.insert(word);
                }
            }
        }
    }
    for (line, start, code) in lines(text) {
        let Some((left, right)) = code.split_once('=') else { continue };
        let name = left.split_whitespace().next_back().unwrap_or_default();
        if !names.contains(name) {
            continue;
        }
        let value = start + left.len() + 1 + (right.len() - right.trim_start().len());
        match items(text, value, '[', ']') {
            Some((values, _)) if values.len() == dof && are_numbers(text, &values) => matches.target(line, values),
            _ if right.trim_start().starts_with("p[") => matches.leave(line, CARTESIAN),
            _ => matches.leave(line, UNREADABLE),
        }
    }
    matches.targets.sort_by_key(|target| target.line);
    matches
}

/// Finds `<Value … j1="…" … j6="…" />`.
fn val3(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    for (at, _) in text.match_indices("<Value") {
        let Some(end) = text.get(at..).and_then(|rest| rest.find('>')).map(|end| at + end) else { continue };
        let line = line_of(text, at);
        let attribute = |name: &str| {
            let mark = format!(" {name}=\"");
            let start = part(text, at..end).find(&mark).map(|place| at + place + mark.len())?;
            let length = part(text, start..end).find('"')?;
            Some(start..start + length)
        };
        let values: Option<Vec<Range<usize>>> = (1..=dof).map(|axis| attribute(&format!("j{axis}"))).collect();
        match values {
            Some(values) if are_numbers(text, &values) => matches.target(line, values),
            None if attribute("j1").is_none() => {
                if attribute("rz").is_some() {
                    matches.leave(line, CARTESIAN);
                }
            }
            _ => matches.leave(line, UNREADABLE),
        }
    }
    for (line, _, code) in lines(text) {
        let is_move = code.contains("movej({") || code.contains("movel({");
        let is_literal = code.contains("={") && code.contains(',');
        if is_move || is_literal {
            matches.leave(line, UNREADABLE);
        }
    }
    matches
}

/// Finds `C00000=…` in pulses.
fn inform(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    let mut in_pulses = false;
    for (line, start, code) in lines(text) {
        if let Some(kind) = code.strip_prefix("///POSTYPE") {
            in_pulses = kind.trim() == "PULSE";
            continue;
        }
        let Some((name, _)) = code.split_once('=') else { continue };
        let Some(digits) = name.strip_prefix(['C', 'P']) else { continue };
        if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
            continue;
        }
        // Treat the rest of the line as a list from the `=` to the line end.
        let closed = format!("{}\n", code.trim_end_matches('\r'));
        let values = items(&closed, name.len(), '=', '\n');
        match values {
            Some((values, _)) if in_pulses && values.len() == dof && are_numbers(&closed, &values) => {
                matches.target(line, values.into_iter().map(|item| start + item.start..start + item.end).collect());
            }
            _ if in_pulses => matches.leave(line, UNREADABLE),
            _ => matches.leave(line, CARTESIAN),
        }
    }
    matches
}

/// Finds `positions: […]`.
fn ros(dof: usize, text: &str) -> Matches {
    let mut matches = Matches::default();
    for (at, mark) in text.match_indices("positions:") {
        let line = line_of(text, at);
        let list = after_blanks(text, at + mark.len());
        match items(text, list, '[', ']') {
            Some((values, _)) if values.len() == dof && are_numbers(text, &values) => matches.target(line, values),
            _ => matches.leave(line, UNREADABLE),
        }
    }
    matches
}

/// The names of `joint_names`, as a list in brackets or one per line.
pub(super) fn ros_names(program: &[u8]) -> Vec<String> {
    let text = masked(program, "#", None, false);
    let mark = "joint_names:";
    let Some(at) = text.find(mark).map(|at| at + mark.len()) else { return Vec::new() };
    let clean = |name: &str| name.trim().trim_matches(['"', '\'']).to_owned();
    let list = after_blanks(&text, at);
    if let Some((names, _)) = items(&text, list, '[', ']') {
        return names.into_iter().map(|name| clean(part(&text, name))).collect();
    }
    let rest = text.get(at..).unwrap_or_default();
    let rows = rest.lines().map(str::trim).filter(|line| !line.is_empty());
    rows.map_while(|line| line.strip_prefix("- ")).map(clean).collect()
}
