//! Aggregates of KRL: positions, frames and the data of inline forms.

use nalgebra::Isometry3;

use super::super::configuration::Configuration;
use super::super::findings::{Literal, Source};
use super::super::lexer::{Number, Tokens};
use super::super::motion::{Form, JointUnit, Reason, Slot};
use super::super::orientation::Orientation;
use std::ops::Range;

/// `FDAT`: tool, base and interpolation of an inline form.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameData {
    pub(super) tool: Option<String>,
    pub(super) base: Option<String>,
    pub(super) is_stationary: bool,
}

/// `{A1 10, A2 -90, …}` by components.
pub(super) struct Aggregate {
    components: Vec<(String, Component)>,
}

pub(super) enum Component {
    Number(Number),
    /// `'B0110'` or `'H1A'`.
    Bits(u32),
    /// A word or a text, as tokens.
    Other(usize),
}

impl Aggregate {
    /// Reads an aggregate that begins a range.
    pub(super) fn read(tokens: &Tokens<'_>, range: Range<usize>) -> Option<Self> {
        if !tokens.is(range.start, b'{') {
            return None;
        }
        let end = tokens.behind(range.start, range.end).saturating_sub(1);
        let mut start = range.start + 1;
        if tokens.is(start + 1, b':') {
            start += 2;
        }
        let mut components = Vec::new();
        for part in tokens.split(start..end) {
            let Some(name) = tokens.word(part.start) else { continue };
            let component = match tokens.number(part.start + 1) {
                Some((number, end)) if end == part.end => Component::Number(number),
                _ => match bits_of_text(tokens.str(part.start + 1)) {
                    Some(bits) => Component::Bits(bits),
                    None => Component::Other(part.start + 1),
                },
            };
            components.push((name.to_ascii_uppercase(), component));
        }
        Some(Self { components })
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.components.iter().any(|(found, _)| found == name)
    }

    /// The numbers of these components, if each is there once.
    pub(super) fn numbers(&self, names: &[&str]) -> Result<Vec<&Number>, Reason> {
        let mut numbers = Vec::new();
        for name in names {
            let mut found = self.components.iter().filter(|(found, _)| found == name);
            match (found.next(), found.next()) {
                (Some((_, Component::Number(number))), None) => numbers.push(number),
                (None, _) => return Err(Reason::Incomplete),
                (Some(_), _) => return Err(Reason::Unreadable),
            }
        }
        Ok(numbers)
    }

    pub(super) fn frame(&self) -> Option<Isometry3<f64>> {
        let numbers = self.numbers(&POSE).ok()?;
        Orientation::Zyx.pose(&numbers.iter().map(|number| number.value).collect::<Vec<_>>())
    }

    pub(super) fn frame_data(&self, tokens: &Tokens<'_>) -> Option<FrameData> {
        if !self.has("TOOL_NO") && !self.has("BASE_NO") {
            return None;
        }
        let number = |name: &str| {
            let numbers = self.numbers(&[name]).ok()?;
            numbers.first().map(|number| format!("{}", number.value))
        };
        let is_tcp = |(name, component): &(String, Component)| {
            name == "IPO_FRAME" && matches!(component, Component::Other(at) if tokens.is_word(*at, "#TCP"))
        };
        let is_stationary = self.components.iter().any(is_tcp);
        Some(FrameData { tool: number("TOOL_NO"), base: number("BASE_NO"), is_stationary })
    }

    /// The value of a position; `None` if it is something else.
    pub(super) fn literal(&self, source: &Source<'_>) -> Option<Result<Literal, Reason>> {
        if AXES.iter().any(|axis| self.has(axis)) {
            return Some(self.axes(source));
        }
        ["X", "Y", "Z"].iter().any(|name| self.has(name)).then(|| self.pose(source))
    }

    pub(super) fn axes(&self, source: &Source<'_>) -> Result<Literal, Reason> {
        let joints = source.robot.chain.dof();
        if joints != AXES.len() {
            return Err(Reason::JointCount { found: AXES.len(), joints });
        }
        let numbers = self.numbers(&AXES)?;
        Ok(literal(&numbers, Form::Joints(JointUnit::Edge), Configuration::Free))
    }

    pub(super) fn pose(&self, source: &Source<'_>) -> Result<Literal, Reason> {
        let numbers = self.numbers(&POSE)?;
        let is_external = |(name, component): &(String, Component)| {
            let is_axis = name.len() == 2 && name.starts_with('E') && name.ends_with(|c: char| c.is_ascii_digit());
            is_axis && !matches!(component, Component::Number(number) if number.value == 0.0)
        };
        if self.components.iter().any(is_external) && !source.options.ignores_external_axes {
            return Err(Reason::ExternalAxes);
        }
        let bits = |name: &str| match self.components.iter().find(|(found, _)| found == name) {
            None => Ok(None),
            Some((_, Component::Number(number))) => bits_of(number.value).map(Some).ok_or(Reason::UnknownConfiguration),
            Some((_, Component::Bits(bits))) => Ok(Some(*bits)),
            Some((_, Component::Other(_))) => Err(Reason::UnknownConfiguration),
        };
        let (s, t) = (bits("S")?, bits("T")?);
        Ok(literal(&numbers, Form::Pose(Orientation::Zyx), Configuration::Krl { s, t }))
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be whole, small and positive")]
pub(super) fn bits_of(value: f64) -> Option<u32> {
    (value.fract() == 0.0 && (0.0..256.0).contains(&value)).then_some(value as u32)
}

/// The bits of `'B0110'` or `'H1A'`.
pub(super) fn bits_of_text(text: &str) -> Option<u32> {
    let inside = text.strip_prefix('\'')?.strip_suffix('\'')?;
    let (base, digits) = inside.split_at_checked(1)?;
    let radix = match base {
        "B" | "b" => 2,
        "H" | "h" => 16,
        _ => return None,
    };
    u32::from_str_radix(digits, radix).ok().filter(|bits| *bits < 256)
}

pub(super) fn literal(numbers: &[&Number], form: Form, configuration: Configuration) -> Literal {
    Literal {
        form,
        slots: numbers.iter().map(|number| Slot::at(number.place.clone())).collect(),
        numbers: numbers.iter().map(|number| number.value).collect(),
        configuration,
    }
}

pub(super) const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
pub(super) const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
