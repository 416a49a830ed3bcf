//! Reads INFORM jobs (`.JBI`): positions in pulses, angles or coordinates, and the moves that use them; tools and user frames of
//! `TOOL.CND` and `UFRAME.CND`.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Isometry3;

use super::super::ProgramError;
use super::super::configuration::{Configuration, Rconf};
use super::super::findings::{Definition, Findings, Key, Literal, Motion, OtherUse, Point, Source, Way};
use super::super::lexer::{self, latin};
use super::super::motion::{Form, JointUnit, Reason, Scan, Setting, Slot};
use super::super::orientation::Orientation;
use super::shift::Shifts;

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let mut frames = BTreeMap::new();
    for (_, text) in source.files() {
        known_frames(text, &mut frames);
    }
    let mut job = Job { source, frames, settings: BTreeMap::new(), has_base: false, state: State::default() };
    let mut findings = Findings::default();
    let text = source.program;
    job.has_base = lines(text).any(|(_, _, line)| line.starts_with("BC") || line.starts_with("BP"));
    let shifts = Shifts::of(source);
    let mut part = Part::Head;
    for (number, place, line) in lines(text) {
        match line.as_str() {
            "//POS" => part = Part::Positions,
            "//INST" => part = Part::Instructions,
            _ => match part {
                Part::Head => {}
                Part::Positions => job.position(number, place, &line, &mut findings),
                Part::Instructions => job.instruction(number, &line, shifts.holds(number), &mut findings),
            },
        }
    }
    // A part of a job may lack its header.
    if part == Part::Head {
        for (number, place, line) in lines(text) {
            job.position(number, place, &line, &mut findings);
        }
    }
    findings.resolve(source)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Head,
    Positions,
    Instructions,
}

/// Lines with their number and place, without blanks around them.
pub(super) fn lines(text: &[u8]) -> impl Iterator<Item = (usize, Range<usize>, String)> + '_ {
    lexer::lines(text).map(|(number, place)| {
        let line = text.get(place.clone()).unwrap_or_default();
        let begin = place.start + line.len() - line.trim_ascii_start().len();
        let content = line.trim_ascii();
        (number, begin..begin + content.len(), latin(content))
    })
}

/// Pseudo instructions that count for the positions behind them.
#[derive(Clone, Debug, Default)]
struct State {
    tool: Option<String>,
    user: Option<String>,
    kind: String,
    rconf: Option<String>,
}

struct Job<'a> {
    source: &'a Source<'a>,
    frames: BTreeMap<String, Isometry3<f64>>,
    /// Tool and frame of each position.
    settings: BTreeMap<String, [Result<Setting, Reason>; 2]>,
    /// Base axes, such as a track, carry the arm.
    has_base: bool,
    state: State,
}

impl Job<'_> {
    fn position(&mut self, number: usize, place: Range<usize>, line: &str, findings: &mut Findings) {
        if let Some(pseudo) = line.strip_prefix("///") {
            let (word, value) = pseudo.split_once(' ').unwrap_or((pseudo, ""));
            let value = value.trim().to_owned();
            match word {
                "TOOL" => self.state.tool = Some(value),
                "USER" => self.state.user = Some(value),
                "POSTYPE" => self.state.kind = value,
                "RCONF" => self.state.rconf = Some(value),
                _ => {}
            }
            return;
        }
        let Some((name, values)) = line.split_once('=') else { return };
        let Some(key) = variable(name) else { return };
        let behind = place.start + name.len() + 1;
        let content = self.content(behind, values);
        let name = name.to_owned();
        let setting = self.setting();
        if key.starts_with('C') {
            findings.always.insert(findings.definitions.len(), setting.clone());
        }
        self.settings.insert(key.clone(), setting);
        let key = Key { scope: 0, name: key, element: String::new() };
        findings.definitions.push(Definition {
            file: 0,
            line: number,
            name: Some(name),
            key,
            content,
            is_quiet: false,
        });
    }

    fn content(&self, start: usize, text: &str) -> Result<Literal, Reason> {
        let mut slots = Vec::new();
        let mut numbers = Vec::new();
        let mut at = start;
        for part in text.split(',') {
            let blanks = part.len() - part.trim_start().len();
            let trimmed = part.trim();
            let value = trimmed.parse::<f64>().ok().filter(|value| value.is_finite());
            numbers.push(value.ok_or(Reason::Unreadable)?);
            slots.push(Slot::at(at + blanks..at + blanks + trimmed.len()));
            at += part.len() + 1;
        }
        let joints = self.source.robot.chain.dof();
        let counted = |form| {
            if numbers.len() == joints {
                Ok((form, Configuration::Free))
            } else {
                Err(Reason::JointCount { found: numbers.len(), joints })
            }
        };
        let (form, configuration) = match self.state.kind.as_str() {
            "PULSE" => counted(Form::Joints(JointUnit::Pulses))?,
            "ANGLE" => counted(Form::Joints(JointUnit::Edge))?,
            "BASE" | "ROBOT" | "USER" => {
                if self.has_base && !self.source.options.ignores_external_axes {
                    return Err(Reason::ExternalAxes);
                }
                let rconf = self.state.rconf.as_deref().and_then(rconf);
                let configuration = Configuration::Inform(rconf.ok_or(Reason::UnknownConfiguration)?);
                match numbers.len() {
                    6 => (Form::Pose(Orientation::FixedXyz), configuration),
                    7 => return Err(Reason::ArmAngle),
                    _ => return Err(Reason::Unreadable),
                }
            }
            "TOOL" => return Err(Reason::Relative),
            _ => return Err(Reason::UnknownConfiguration),
        };
        Ok(Literal { form, slots, numbers, configuration })
    }

    /// Tool and frame that count at this place.
    fn setting(&self) -> [Result<Setting, Reason>; 2] {
        let known = |name: String| match self.frames.get(&name) {
            Some(pose) => Setting::Known { name, pose: Box::new(*pose) },
            None => Setting::Named(name),
        };
        let tool = known(format!("TOOL {}", self.state.tool.as_deref().unwrap_or("0")));
        let frame = match self.state.kind.as_str() {
            "USER" => known(format!("USER {}", self.state.user.as_deref().unwrap_or_default())),
            _ => Setting::Identity,
        };
        [Ok(tool), Ok(frame)]
    }

    fn instruction(&self, number: usize, line: &str, is_shifted: bool, findings: &mut Findings) {
        if line.starts_with(['\'', '/', '*']) {
            return;
        }
        let mut words = line.split_whitespace();
        let instruction = words.next().unwrap_or_default();
        // `+MOVL` moves a second robot, `SMOVL` is synchronised.
        let name = instruction.strip_prefix('+').unwrap_or(instruction);
        let name = if name.starts_with("SMOV") { name.get(1..).unwrap_or_default() } else { name };
        let way = match name {
            "MOVJ" => Some(Way::Joint),
            "MOVL" | "MOVS" | "EIMOVL" => Some(Way::Linear),
            "MOVC" | "EIMOVC" => Some(Way::Circular),
            _ => None,
        };
        let variables: Vec<(&str, String)> = words.filter_map(|word| variable(word).map(|key| (word, key))).collect();
        let Some(way) = way else {
            let reason = if name == "IMOV" || name == "SFTON" { Reason::Relative } else { Reason::NotMovedTo };
            for (word, key) in variables {
                let key = Key { scope: 0, name: key, element: String::new() };
                if name == "IMOV" {
                    findings.leave(number, Some(word.to_owned()), Reason::Relative);
                }
                findings.other_uses.push(OtherUse { key, reason: reason.clone() });
            }
            return;
        };
        let Some((word, key)) = variables.into_iter().next() else {
            findings.leave(number, None, Reason::Computed);
            return;
        };
        let [tool, frame] = self.settings.get(&key).cloned().unwrap_or([Ok(Setting::Identity), Ok(Setting::Identity)]);
        let key = Key { scope: 0, name: key, element: String::new() };
        let point = if is_shifted {
            findings.other_uses.push(OtherUse { key, reason: Reason::OffsetBase });
            Point::Left { name: Some(word.to_owned()), reason: Reason::Offset }
        } else {
            Point::Variable { key, name: word.to_owned() }
        };
        findings.motions.push(Some(Motion {
            file: 0,
            line: number,
            way,
            via: None,
            point,
            tool,
            frame,
            configuration: None,
            spot: None,
        }));
    }
}

/// `C00012` or `P012` as `C12`, `P12`; other words are no robot positions.
fn variable(name: &str) -> Option<String> {
    let letter = name.chars().next().filter(|letter| matches!(letter, 'C' | 'P'))?;
    let digits = name.get(1..)?;
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let digits = digits.trim_start_matches('0');
    is_number.then(|| format!("{letter}{}", if digits.is_empty() { "0" } else { digits }))
}

/// The first six values of `RCONF`.
fn rconf(text: &str) -> Option<Rconf> {
    let mut bits = text.split(',').map(|bit| match bit.trim() {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    });
    let mut next = || bits.next().flatten();
    Some(Rconf {
        is_no_flip: next()?,
        is_lower_arm: next()?,
        is_rear: next()?,
        r_is_wound: next()?,
        t_is_wound: next()?,
        s_is_wound: next()?,
    })
}

/// Tools of `TOOL.CND` (the first row of numbers) and user frames of `UFRAME.CND` (`///BUSER`).
fn known_frames(text: &[u8], frames: &mut BTreeMap<String, Isometry3<f64>>) {
    let mut open: Option<String> = None;
    for (_, _, line) in lines(text) {
        if let Some(number) = line.strip_prefix("//TOOL ") {
            open = Some(format!("TOOL {}", number.trim()));
            continue;
        }
        if let Some(number) = line.strip_prefix("//UFRAME ") {
            open = Some(format!("USER {}", number.trim()));
            continue;
        }
        let Some(name) = open.clone() else { continue };
        let values = match line.strip_prefix("///") {
            Some(rest) => match rest.strip_prefix("BUSER ") {
                Some(values) if name.starts_with("USER") => values.to_owned(),
                _ => continue,
            },
            None if line.starts_with("//") => {
                open = None;
                continue;
            }
            None if name.starts_with("TOOL") => line,
            None => continue,
        };
        let numbers: Option<Vec<f64>> = values.split(',').map(|value| value.trim().parse().ok()).collect();
        if let Some(pose) = numbers.filter(|numbers| numbers.len() == 6).and_then(|n| Orientation::FixedXyz.pose(&n)) {
            frames.insert(name, pose);
            open = None;
        }
    }
}
