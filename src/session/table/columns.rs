//! Column names with units, and the columns a reader takes from them.

use super::{Defect, Record, TableProblem};
use crate::kinematics::JointType;
use crate::units::{CENTIMETRE, DEGREE, INCH, MICROMETRE, MILLIMETRE, Quantity};

/// What the numbers of a column measure, and so which units its name may end with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session) enum Measure {
    /// Inside metre.
    Length,
    /// Inside radian.
    Angle,
    /// Degree Celsius, inside and outside.
    Temperature,
}

impl Measure {
    /// Length for a prismatic joint, angle for a revolute one.
    pub(in crate::session) const fn of_joint(joint: JointType) -> Self {
        match joint.quantity() {
            Quantity::Length => Self::Length,
            Quantity::Angle => Self::Angle,
        }
    }

    /// Unit names with their size in the unit of the inside; the usual one first.
    const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Length => &[("mm", MILLIMETRE), ("m", 1.0), ("um", MICROMETRE), ("in", INCH), ("cm", CENTIMETRE)],
            Self::Angle => &[("deg", DEGREE), ("rad", 1.0)],
            Self::Temperature => &[("degc", 1.0)],
        }
    }

    /// The unit that is written when there is a choice: `mm`, `deg`, `degc`.
    pub(in crate::session) fn usual_unit(self) -> &'static str {
        self.units().first().map_or("", |(name, _)| name)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::session) struct NumberColumn {
    /// 0-based place in the row.
    pub(in crate::session) index: usize,
    /// Size of the column's unit in the unit of the inside (m, rad, °C).
    pub(in crate::session) unit: f64,
}

impl NumberColumn {
    /// A column in the usual unit of `measure` (mm, degree, °C).
    pub(in crate::session) fn usual(index: usize, measure: Measure) -> Self {
        Self { index, unit: measure.units().first().map_or(1.0, |(_, size)| *size) }
    }

    /// A column in a unit by its name; in that of the inside if there is no such unit.
    pub(in crate::session) fn in_unit(index: usize, unit: &str) -> Self {
        let all = [Measure::Length, Measure::Angle].into_iter().flat_map(Measure::units);
        Self { index, unit: all.into_iter().find(|(name, _)| *name == unit).map_or(1.0, |(_, size)| *size) }
    }
}

/// The line of column names while a reader takes what it knows from it.
#[derive(Debug)]
pub(in crate::session) struct Header {
    /// 1-based line in the file.
    pub(in crate::session) line: usize,
    /// Names as written.
    pub(in crate::session) names: Vec<String>,
    lower: Vec<String>,
    without_unit: Vec<String>,
    unit_example: Option<String>,
    missing: Vec<String>,
}

impl Header {
    /// Names of a record. Reports names that appear twice; a column without name becomes `column5`, counted from 1.
    /// `None`, reported, for a line of numbers: to look for names in it would only hide the reason.
    pub(in crate::session) fn new(record: Record, problems: &mut Vec<TableProblem>) -> Option<Self> {
        let Record { line, cells } = record;
        if cells.iter().all(|cell| cell.replace(',', ".").parse::<f64>().is_ok()) {
            problems.push(Defect::NoHeader { cells: cells.len() }.at(line));
            return None;
        }
        let named = |(index, cell): (usize, String)| {
            if cell.is_empty() { format!("column{}", index + 1) } else { cell }
        };
        let names: Vec<String> = cells.into_iter().enumerate().map(named).collect();
        let lower = names.clone();
        Some(Self::renamed(line, names, &lower, problems))
    }

    /// A line whose `names` are those of the file, and mean the names in `known`. Reports those that appear twice.
    pub(in crate::session) fn renamed(
        line: usize,
        names: Vec<String>,
        known: &[String],
        problems: &mut Vec<TableProblem>,
    ) -> Self {
        let lower: Vec<String> = known.iter().map(|name| name.to_lowercase()).collect();
        for (index, name) in lower.iter().enumerate() {
            if let Some(first) = lower.iter().take(index).position(|earlier| earlier == name) {
                let shown = names.get(index).map_or("", String::as_str);
                problems.push(Defect::DuplicateColumn { first: first + 1, second: index + 1 }.at_cell(line, shown));
            }
        }
        Self { line, names, lower, without_unit: Vec::new(), unit_example: None, missing: Vec::new() }
    }

    /// The names of all columns in lower case, as this program calls them.
    pub(in crate::session) fn known(&self) -> &[String] {
        &self.lower
    }

    /// Place of the text column `name`.
    pub(in crate::session) fn text(&self, name: &str) -> Option<usize> {
        self.lower.iter().position(|known| known == name)
    }

    /// As [`Header::text`], and reports the column as missing when there is none.
    pub(in crate::session) fn required_text(&mut self, name: &str) -> Option<usize> {
        let place = self.text(name);
        if place.is_none() {
            self.missing.push(name.to_owned());
        }
        place
    }

    /// Whether a column is named `name` or `name_unit`.
    pub(in crate::session) fn has_quantity(&self, name: &str) -> bool {
        self.lower.iter().any(|known| unit_after(known, name).is_some())
    }

    /// Whether the name of a column begins with `prefix`.
    pub(in crate::session) fn has_prefix(&self, prefix: &str) -> bool {
        self.lower.iter().any(|known| known.starts_with(prefix))
    }

    /// The number column `name`, a name without unit. `None` when there is none; defects of its unit are reported and
    /// the column is taken as if in the unit of the inside, so that its cells are checked too.
    pub(in crate::session) fn number(
        &mut self,
        name: &str,
        measure: Measure,
        problems: &mut Vec<TableProblem>,
    ) -> Option<NumberColumn> {
        let mut taken: Option<NumberColumn> = None;
        for (index, (shown, lower)) in self.names.iter().zip(&self.lower).enumerate() {
            let Some(unit) = unit_after(lower, name) else { continue };
            if let Some(other) = taken.and_then(|column| self.names.get(column.index)) {
                if !other.eq_ignore_ascii_case(shown) {
                    problems.push(Defect::SameQuantity { other: other.clone() }.at_cell(self.line, shown));
                }
                continue;
            }
            let known = measure.units().iter().find(|(known, _)| *known == unit);
            match known {
                _ if unit.is_empty() => {
                    self.unit_example.get_or_insert_with(|| format!("{shown}_{}", measure.usual_unit()));
                    self.without_unit.push(shown.clone());
                }
                Some(_) => {}
                None => {
                    let allowed = measure.units().iter().map(|(name, _)| *name).collect();
                    problems.push(Defect::UnknownUnit { unit: unit.to_owned(), allowed }.at_cell(self.line, shown));
                }
            }
            taken = Some(NumberColumn { index, unit: known.map_or(1.0, |(_, size)| *size) });
        }
        taken
    }

    /// As [`Header::number`], and reports the column as missing when there is none.
    pub(in crate::session) fn required(
        &mut self,
        name: &str,
        measure: Measure,
        problems: &mut Vec<TableProblem>,
    ) -> Option<NumberColumn> {
        let column = self.number(name, measure, problems);
        if column.is_none() {
            self.missing.push(format!("{name}_{}", measure.usual_unit()));
        }
        column
    }

    /// The joint columns `prefix`q1 … `prefix`qn. Reports when their number is not the one of the robot.
    pub(in crate::session) fn joints(
        &mut self,
        prefix: &str,
        joints: &[JointType],
        problems: &mut Vec<TableProblem>,
    ) -> Vec<NumberColumn> {
        let (found, lower): (Vec<String>, Vec<String>) = self
            .names
            .iter()
            .zip(&self.lower)
            .filter(|(_, lower)| is_joint(lower, prefix))
            .map(|(name, lower)| (name.clone(), lower.clone()))
            .unzip();
        let mut columns = Vec::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let name = format!("{prefix}q{}", index + 1);
            columns.extend(self.number(&name, Measure::of_joint(*joint), problems));
        }
        let expected = |name: &String| (1..=joints.len()).any(|i| unit_after(name, &format!("{prefix}q{i}")).is_some());
        if columns.len() != joints.len() || !lower.iter().all(expected) {
            let prefix = prefix.to_owned();
            problems.push(Defect::JointColumns { prefix, joints: joints.len(), found }.at(self.line));
        }
        columns
    }

    /// Reports the columns that were asked for and are missing, and those without unit, in one message each.
    pub(in crate::session) fn finish(self, problems: &mut Vec<TableProblem>) -> Vec<String> {
        let Self { line, names, without_unit, unit_example, missing, .. } = self;
        if !missing.is_empty() {
            problems.push(Defect::MissingColumns { columns: missing }.at(line));
        }
        if let Some(example) = unit_example {
            problems.push(Defect::MissingUnits { columns: without_unit, example }.at(line));
        }
        names
    }
}

/// The unit of the column name `lower` if it is `name` or `name_unit`; empty without unit.
///
/// A further underscore makes another name: `x_nominal_mm` is not `x`.
fn unit_after<'a>(lower: &'a str, name: &str) -> Option<&'a str> {
    let rest = lower.strip_prefix(name)?;
    if rest.is_empty() {
        return Some("");
    }
    rest.strip_prefix('_').filter(|unit| !unit.contains('_'))
}

/// Whether a name is `prefix`q and digits, with or without unit.
fn is_joint(lower: &str, prefix: &str) -> bool {
    let Some(rest) = lower.strip_prefix(prefix).and_then(|rest| rest.strip_prefix('q')) else { return false };
    let (number, unit) = rest.split_once('_').unwrap_or((rest, ""));
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) && !unit.contains('_')
}
