//! What a technician states about the cell: instrument, place of the tracker, limits, boxes and acceptance.
//!
//! It is a record at the edge (mm, degree), kept in the journal and in `cell.ron`, and offered again for the next session. Applied
//! to a profile it becomes part of its text, so that everything that reads the profile finds it there.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::Profile;
use super::diagnostic::Findings;
use super::syntax::{self, Ast, Node};
use crate::text::{listed, printable};

/// Longest name of an instrument or a box.
const LONGEST_NAME: usize = 60;
/// A box that is given from one corner to the other.
const CORNERS: usize = 6;

/// What is stated about a cell; what is `None` or empty stays as the profile says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CellText {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<InstrumentText>,
    /// Where the tracker stands, in the base.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracker_mm: Option<(f64, f64, f64)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceptance: Option<AcceptanceText>,
    /// Range of a plan per joint name (degree, sliding joints mm).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub planning_limits: BTreeMap<String, (f64, f64)>,
    /// Boxes that the arm must not enter, besides those of the profile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keep_out: Vec<BoxText>,
}

/// An instrument and its standard deviation per coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstrumentText {
    pub name: String,
    pub sigma_um: f64,
    pub sigma_um_per_m: f64,
}

/// Limits of the verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AcceptanceText {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_rms_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_max_mm: Option<f64>,
}

/// A box in the base.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxText {
    pub name: String,
    pub min_mm: (f64, f64, f64),
    pub max_mm: (f64, f64, f64),
}

/// Instruments of a list: name and standard deviation of a coordinate (µm, µm/m), half of the maximum permissible error that the
/// makers state for a point. The certificate of an instrument counts more.
pub const INSTRUMENTS: [(&str, f64, f64); 5] = [
    ("Leica AT9xx or AT4xx", 7.5, 3.0),
    ("FARO Vantage", 10.0, 2.5),
    ("API Radian", 5.0, 2.5),
    ("total station, 0.5 arc seconds", 300.0, 3.0),
    ("total station, 1 arc second", 600.0, 5.0),
];

impl CellText {
    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What a profile says about its cell, as the start of a form.
    pub fn of(profile: &Profile) -> Self {
        let mm = |length: f64| (crate::units::to_mm(length) * 1e6).round() / 1e6;
        let um = |length: f64| (length / crate::units::MICROMETRE * 1e6).round() / 1e6;
        let acceptance = AcceptanceText {
            position_rms_mm: profile.acceptance().position_rms.map(mm),
            position_max_mm: profile.acceptance().position_max.map(mm),
        };
        let place = profile.tracker().position_in_base;
        Self {
            instrument: profile.instrument().map(|instrument| InstrumentText {
                name: instrument.name.clone(),
                sigma_um: um(instrument.sigma),
                sigma_um_per_m: um(instrument.sigma_per_metre),
            }),
            tracker_mm: Some((mm(place.x), mm(place.y), mm(place.z))),
            acceptance: (acceptance != AcceptanceText::default()).then_some(acceptance),
            ..Self::default()
        }
    }

    /// This cell, and what only the other one states. Joints of another arm are left out.
    #[must_use]
    pub fn or(&self, other: &Self, joints: &[&str]) -> Self {
        let own = self.clone();
        let is_known = |(name, _): &(&String, &(f64, f64))| joints.contains(&name.as_str());
        let limits = |cell: &Self| -> BTreeMap<String, (f64, f64)> {
            cell.planning_limits.iter().filter(is_known).map(|(name, range)| (name.clone(), *range)).collect()
        };
        let mut planning_limits = limits(other);
        planning_limits.extend(limits(self));
        Self {
            instrument: own.instrument.or_else(|| other.instrument.clone()),
            tracker_mm: own.tracker_mm.or(other.tracker_mm),
            acceptance: own.acceptance.or(other.acceptance),
            planning_limits,
            keep_out: if own.keep_out.is_empty() { other.keep_out.clone() } else { own.keep_out },
        }
    }

    /// The text of a profile with this cell in it. Everything else of the text stays, comments included.
    ///
    /// # Errors
    /// The profile cannot be used with it: the reason in words.
    pub fn applied(&self, text: &str) -> Result<String, String> {
        self.check_names()?;
        let mut findings = Findings::new(text, "profile");
        let tree = syntax::parse(text, &mut findings).ok_or("the profile cannot be read")?;
        let mut edits = Vec::new();
        if let Some(instrument) = &self.instrument {
            let InstrumentText { name, sigma_um, sigma_um_per_m } = instrument;
            let value = format!("(name: {}, sigma_um: {sigma_um:?}, sigma_um_per_m: {sigma_um_per_m:?})", quoted(name));
            edits.push(edit(&tree, "instrument", &value));
        }
        if let Some((x, y, z)) = self.tracker_mm {
            let place = format!("({x:?}, {y:?}, {z:?})");
            edits.push(match field(&tree, "tracker") {
                Some(tracker) => edit(tracker, "position_mm", &place),
                None => edit(&tree, "tracker", &format!("(position_mm: {place})")),
            });
        }
        if let Some(acceptance) = &self.acceptance {
            edits.extend(acceptance.edits(&tree));
        }
        for (name, (low, high)) in &self.planning_limits {
            let joint = joint(&tree, name)?;
            let unit = if field(joint, "limits_mm").is_some() { "mm" } else { "deg" };
            edits.push(edit(joint, &format!("planning_limits_{unit}"), &format!("({low:?}, {high:?})")));
        }
        if !self.keep_out.is_empty() {
            edits.push(self.boxes(&tree));
        }
        let mut changed = text.to_owned();
        edits.sort_by_key(|edit| std::cmp::Reverse(edit.at));
        for Edit { at, until, text } in edits {
            changed.replace_range(at..until, &text);
        }
        match Profile::parse(&changed, "the profile with this cell") {
            Ok(_) => Ok(changed),
            Err(errors) => {
                let first = errors.diagnostics.iter().find(|one| one.severity == super::Severity::Error);
                Err(first.map_or_else(String::new, |one| one.message.clone()))
            }
        }
    }

    fn check_names(&self) -> Result<(), String> {
        let names = self.instrument.iter().map(|one| &one.name).chain(self.keep_out.iter().map(|one| &one.name));
        match names.into_iter().find(|name| name.trim().is_empty() || name.chars().count() > LONGEST_NAME) {
            Some(_) => Err(format!("names have 1 to {LONGEST_NAME} characters")),
            None => Ok(()),
        }
    }

    /// The boxes behind those of the profile that have other names.
    fn boxes(&self, tree: &Ast) -> Edit {
        let boxes = self.keep_out.iter().map(|one| {
            let corner = |(x, y, z): (f64, f64, f64)| format!("({x:?}, {y:?}, {z:?})");
            format!("(name: {}, min_mm: {}, max_mm: {})", quoted(&one.name), corner(one.min_mm), corner(one.max_mm))
        });
        let boxes: Vec<String> = boxes.collect();
        edit(tree, "keep_out", &format!("[{}]", boxes.join(", ")))
    }
}

impl AcceptanceText {
    fn edits(&self, tree: &Ast) -> Vec<Edit> {
        let limits = [("position_rms_mm", self.position_rms_mm), ("position_max_mm", self.position_max_mm)];
        let stated: Vec<(&str, f64)> = limits.into_iter().filter_map(|(name, limit)| Some((name, limit?))).collect();
        match field(tree, "acceptance") {
            Some(acceptance) => {
                stated.into_iter().map(|(name, limit)| edit(acceptance, name, &format!("{limit:?}"))).collect()
            }
            None if stated.is_empty() => Vec::new(),
            None => {
                let fields: Vec<String> = stated.iter().map(|(name, limit)| format!("{name}: {limit:?}")).collect();
                vec![edit(tree, "acceptance", &format!("({})", fields.join(", ")))]
            }
        }
    }
}

/// A part of a text and what replaces it (bytes).
#[derive(Debug)]
struct Edit {
    at: usize,
    until: usize,
    text: String,
}

/// A field of a struct.
fn field<'a>(ast: &'a Ast, name: &str) -> Option<&'a Ast> {
    match &ast.node {
        Node::Struct(fields) => fields.iter().find(|field| field.name == name).map(|field| &field.value),
        _ => None,
    }
}

/// Sets a field of a struct: in its place, or as the first one.
fn edit(ast: &Ast, name: &str, value: &str) -> Edit {
    match (field(ast, name), &ast.node) {
        (Some(there), _) => Edit { at: there.span.start, until: there.span.end, text: value.to_owned() },
        (None, Node::Struct(fields)) => {
            let at = fields.first().map_or_else(|| ast.span.end.saturating_sub(1), |field| field.name_span.start);
            Edit { at, until: at, text: format!("{name}: {value}, ") }
        }
        (None, _) => Edit { at: ast.span.start, until: ast.span.start, text: String::new() },
    }
}

/// A joint by its name.
fn joint<'a>(tree: &'a Ast, name: &str) -> Result<&'a Ast, String> {
    let joints = match field(tree, "joints").map(|joints| &joints.node) {
        Some(Node::List(joints)) => joints.as_slice(),
        _ => &[],
    };
    let named =
        |joint: &&Ast| matches!(field(joint, "name").map(|name| &name.node), Some(Node::Text(own)) if own == name);
    joints.iter().find(named).ok_or_else(|| {
        let names: Vec<&str> = joints
            .iter()
            .filter_map(|joint| match field(joint, "name").map(|name| &name.node) {
                Some(Node::Text(name)) => Some(name.as_str()),
                _ => None,
            })
            .collect();
        format!("the arm has no joint '{}'; it has {}", printable(name), listed(&names))
    })
}

fn quoted(text: &str) -> String {
    let clean = printable(text).replace(['"', '\\'], "'");
    format!("\"{}\"", clean.trim())
}

/// Limits per joint as they are typed: `J1 -90..90, J4 -180..180`.
///
/// # Errors
/// What is wrong, in words.
pub fn limits_from_text(text: &str) -> Result<BTreeMap<String, (f64, f64)>, String> {
    let wrong = |part: &str| format!("'{}' is no limit of a joint: write J1 -90..90, J4 -180..180", printable(part));
    let parts = text.split([',', ';']).map(str::trim).filter(|part| !part.is_empty());
    let limit = |part: &str| {
        let (name, range) = part.split_once(char::is_whitespace).ok_or_else(|| wrong(part))?;
        let (low, high) = range.trim().split_once("..").ok_or_else(|| wrong(part))?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        match (number(low), number(high)) {
            (Some(low), Some(high)) if low < high => Ok((name.to_owned(), (low, high))),
            _ => Err(wrong(part)),
        }
    };
    parts.map(limit).collect()
}

/// Limits per joint as [`limits_from_text`] reads them.
pub fn limits_as_text(limits: &BTreeMap<String, (f64, f64)>) -> String {
    limits.iter().map(|(name, (low, high))| format!("{name} {low}..{high}")).collect::<Vec<_>>().join(", ")
}

/// Boxes as they are typed: `table 300 -500 0 900 500 400; fence …`, a name and two corners.
///
/// # Errors
/// What is wrong, in words.
pub fn boxes_from_text(text: &str) -> Result<Vec<BoxText>, String> {
    let wrong = |part: &str| {
        format!("'{}' is no box: write a name and two corners, such as table 300 -500 0 900 500 400", printable(part))
    };
    let parts = text.split(';').map(str::trim).filter(|part| !part.is_empty());
    let one = |part: &str| {
        let words: Vec<&str> = part.split([' ', ',']).filter(|word| !word.is_empty()).collect();
        let (name, numbers) = words.split_first().ok_or_else(|| wrong(part))?;
        let numbers: Vec<f64> = numbers.iter().filter_map(|word| word.parse().ok()).collect();
        let [x1, y1, z1, x2, y2, z2] = <[f64; CORNERS]>::try_from(numbers).ok().ok_or_else(|| wrong(part))?;
        Ok(BoxText {
            name: (*name).to_owned(),
            min_mm: (x1.min(x2), y1.min(y2), z1.min(z2)),
            max_mm: (x1.max(x2), y1.max(y2), z1.max(z2)),
        })
    };
    parts.map(one).collect()
}

/// Boxes as [`boxes_from_text`] reads them.
pub fn boxes_as_text(boxes: &[BoxText]) -> String {
    let one = |one: &BoxText| {
        let ((x1, y1, z1), (x2, y2, z2)) = (one.min_mm, one.max_mm);
        format!("{} {x1} {y1} {z1} {x2} {y2} {z2}", one.name)
    };
    boxes.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// `laser tracker 10 um + 5 um/m, tracker at (3000, 0, 1000) mm, accepted up to 0.3 mm RMS and 0.8 mm, …`.
impl fmt::Display for CellText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(one) = &self.instrument {
            parts.push(format!("{} ({} um + {} um/m)", printable(&one.name), one.sigma_um, one.sigma_um_per_m));
        }
        parts.extend(self.tracker_mm.map(|(x, y, z)| format!("tracker at ({x}, {y}, {z}) mm")));
        if let Some(acceptance) = &self.acceptance {
            let limits = [("RMS", acceptance.position_rms_mm), ("max", acceptance.position_max_mm)];
            let limits: Vec<String> =
                limits.into_iter().filter_map(|(name, limit)| Some(format!("{name} {} mm", limit?))).collect();
            parts.push(format!("accepted with a position error of {}", listed(&limits)));
        }
        if !self.planning_limits.is_empty() {
            parts.push(format!("limits {}", limits_as_text(&self.planning_limits)));
        }
        parts.extend(self.keep_out.iter().map(|one| format!("box '{}'", printable(&one.name))));
        f.write_str(&if parts.is_empty() { "nothing stated".to_owned() } else { parts.join(", ") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{builtin, builtin_names};
    use crate::units::{from_deg, from_mm};

    fn cell() -> CellText {
        CellText {
            instrument: Some(InstrumentText { name: "Leica \"AT960\"".to_owned(), sigma_um: 7.5, sigma_um_per_m: 3.0 }),
            tracker_mm: Some((1500.0, -200.0, 900.0)),
            acceptance: Some(AcceptanceText { position_rms_mm: Some(0.25), position_max_mm: None }),
            planning_limits: BTreeMap::new(),
            keep_out: boxes_from_text("table 900 -500 0 300 500 400").unwrap(),
        }
    }

    #[test]
    fn every_shipped_profile_takes_a_cell() {
        for name in builtin_names() {
            let text = builtin(name).unwrap();
            let (before, _) = Profile::parse(text, name).unwrap();
            let first = before.chain().joints()[0].name.clone();
            let mut cell = cell();
            cell.planning_limits.insert(first, (-30.0, 40.0));
            let applied = cell.applied(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            let (after, _) = Profile::parse(&applied, name).unwrap();
            let instrument = after.instrument().unwrap();
            assert_eq!(instrument.name, "Leica 'AT960'", "{name}");
            assert!((instrument.sigma - 7.5e-6).abs() < 1e-15, "{name}");
            assert!((after.tracker().position_in_base.x - 1.5).abs() < 1e-12, "{name}");
            assert_eq!(after.tracker().range, before.tracker().range, "{name}");
            assert_eq!(after.acceptance().position_rms, Some(from_mm(0.25)), "{name}");
            assert_eq!(after.acceptance().position_max, before.acceptance().position_max, "{name}");
            assert_eq!(after.joints()[0].planning_limits, Some((from_deg(-30.0), from_deg(40.0))), "{name}");
            assert_eq!((after.keep_out().len(), after.keep_out()[0].min.x), (1, from_mm(300.0)), "{name}");
            assert_eq!((after.chain(), after.targets()), (before.chain(), before.targets()), "{name}");
            // Comments stay, and a second time changes nothing.
            let comments = |text: &str| text.lines().filter(|line| line.trim_start().starts_with("//")).count();
            assert_eq!(comments(text), comments(&applied), "{name}");
            assert_eq!(cell.applied(&applied).as_ref(), Ok(&applied), "{name}");
        }
    }

    #[test]
    fn what_is_not_stated_stays() {
        let text = builtin("soochow").unwrap();
        assert_eq!(CellText::default().applied(text).as_deref(), Ok(text));
        let (profile, _) = Profile::parse(text, "soochow").unwrap();
        let (again, _) = Profile::parse(&CellText::of(&profile).applied(text).unwrap(), "soochow").unwrap();
        assert_eq!(again, profile);
    }

    #[test]
    fn what_cannot_be_meant_is_refused_in_words() {
        let text = builtin("soochow").unwrap();
        let with = |change: &dyn Fn(&mut CellText)| {
            let mut cell = cell();
            change(&mut cell);
            cell.applied(text).unwrap_err()
        };
        let messages = [
            with(&|cell| cell.planning_limits = limits_from_text("J9 -1..1").unwrap()),
            with(&|cell| cell.planning_limits = limits_from_text("J1 -999..1").unwrap()),
            with(&|cell| cell.keep_out[0].max_mm.0 = 0.0),
            with(&|cell| cell.instrument.as_mut().unwrap().sigma_um = -1.0),
            with(&|cell| cell.tracker_mm = Some((f64::NAN, 0.0, 0.0))),
            with(&|cell| cell.keep_out[0].name = String::new()),
        ];
        assert!(messages[0].starts_with("the arm has no joint 'J9'; it has J1, J2"), "{messages:?}");
        assert!(messages.iter().all(|message| !message.is_empty()), "{messages:?}");
    }

    #[test]
    fn limits_and_boxes_are_read_as_they_are_written() {
        let limits = limits_from_text("J1 -90..90; J4 -180.5..180").unwrap();
        assert_eq!(limits_from_text(&limits_as_text(&limits)), Ok(limits));
        let boxes = boxes_from_text("table 300 -500 0 900 500 400; fence 1,2,3,4,5,6").unwrap();
        assert_eq!(boxes_from_text(&boxes_as_text(&boxes)), Ok(boxes));
        for wrong in ["J1", "J1 90", "J1 9..1", "J1 a..b"] {
            assert!(limits_from_text(wrong).is_err(), "{wrong}");
        }
        for wrong in ["table", "table 1 2 3", "table 1 2 3 4 5 x", "table 1 2 3 4 5 6 7"] {
            assert!(boxes_from_text(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_cell_is_offered_again_to_another_arm() {
        let mut other = cell();
        other.planning_limits = limits_from_text("J1 -90..90, A7 -10..10").unwrap();
        let merged = CellText { tracker_mm: Some((1.0, 2.0, 3.0)), ..CellText::default() }.or(&other, &["J1", "J2"]);
        assert_eq!(merged.tracker_mm, Some((1.0, 2.0, 3.0)));
        assert_eq!((merged.instrument, merged.keep_out.len()), (other.instrument, 1));
        assert_eq!(merged.planning_limits.keys().collect::<Vec<_>>(), ["J1"]);
    }
}
