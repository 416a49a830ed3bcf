//! Contacts of the target with features of unknown place: lengths to fixed points, planes, lines and circles.

use std::collections::BTreeMap;

use super::{Input, configuration, digits};
use crate::identification::Shape;
use crate::session::table::{Defect, Measure, Numbers, Record, TableProblem};
use crate::units::to_mm;

/// The rows of a table of contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Contacts {
    /// In the order in which they first appear in the file.
    pub features: Vec<NamedShape>,
    /// One per row of the file, in its order; copies of a row are kept and warned about.
    pub rows: Vec<ContactRow>,
    /// Names of the columns, parallel to [`ContactRow::fields`].
    pub columns: Vec<String>,
    /// What is odd about the table but does not forbid its use, in the order of its lines.
    pub warnings: Vec<TableProblem>,
}

/// A feature with its name in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedShape {
    /// The text that its rows share.
    pub name: String,
    /// Its kind.
    pub shape: Shape,
}

/// One contact.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactRow {
    /// 1-based line in the file.
    pub line: usize,
    /// Index of the feature.
    pub feature: usize,
    /// Pendant joint values (rad), sliding joints (m).
    pub configuration: Vec<f64>,
    /// Measured length (m); zero where the shape has none.
    pub length: f64,
    /// Standard deviation of the length, or of the contact (m).
    pub sigma: Option<f64>,
    /// Text of all cells as in the file, parallel to [`Contacts::columns`], for filters.
    pub fields: Vec<String>,
}

/// What a row says about its feature.
struct Cells {
    line: usize,
    name: String,
    shape: Option<Shape>,
    configuration: Vec<f64>,
    length: Option<f64>,
    sigma: Option<f64>,
    fields: Vec<String>,
}

/// What the table calls the shapes; a circle whose radius is measured is one of known radius.
const WORDS: [Shape; 6] = [Shape::Point, Shape::Wire, Shape::Sphere, Shape::Plane, Shape::Line, Shape::Circle];

pub(super) fn read(input: Input<'_>, problems: &mut Vec<TableProblem>) -> Contacts {
    let Input { mut header, records, decimal_comma, joints } = input;
    let name = header.text("anchor").or_else(|| header.required_text("feature"));
    let shape = header.text("shape");
    let places = header.joints("", joints, problems);
    let length = header.number("length", Measure::Length, problems);
    let sigma = header.number("sigma", Measure::Length, problems);
    let columns = header.finish(problems);
    let mut numbers = Numbers::new(&columns, decimal_comma);
    let mut rows = Vec::with_capacity(records.len());
    for record in records {
        let configuration = configuration(&record, &places, &mut numbers, problems);
        let length = length.and_then(|column| numbers.optional(&record, column, problems));
        let sigma = sigma.and_then(|column| numbers.deviation(&record, column, problems));
        let shape = shape.and_then(|column| shape_of(&record, column, &columns, problems));
        let Record { line, cells } = record;
        let Some(text) = name.and_then(|column| cells.get(column)) else { continue };
        if text.is_empty() {
            let column = name.and_then(|column| columns.get(column)).map_or("", String::as_str);
            problems.push(Defect::Empty.at_cell(line, column));
            continue;
        }
        let name = text.clone();
        let Some(configuration) = configuration else { continue };
        rows.push(Cells { line, name, shape, configuration, length, sigma, fields: cells });
    }
    assembled(rows, columns, problems)
}

/// The shape that a row names; `None` for an empty cell, which means what the other rows say.
fn shape_of(record: &Record, column: usize, columns: &[String], problems: &mut Vec<TableProblem>) -> Option<Shape> {
    let text = record.cells.get(column).filter(|text| !text.is_empty())?;
    let known = WORDS.into_iter().find(|shape| shape.name().eq_ignore_ascii_case(text));
    if known.is_none() {
        let allowed = WORDS.iter().map(|shape| shape.name()).collect();
        let name = columns.get(column).map_or("", String::as_str);
        problems.push(Defect::UnknownShape { text: text.clone(), allowed }.at_cell(record.line, name));
    }
    known
}

/// Joins the rows of each feature, and reports what is missing or contradicts.
fn assembled(rows: Vec<Cells>, columns: Vec<String>, problems: &mut Vec<TableProblem>) -> Contacts {
    let mut first: BTreeMap<&str, (usize, usize, Option<Shape>, bool)> = BTreeMap::new();
    let mut names: Vec<&str> = Vec::new();
    for row in &rows {
        let next = names.len();
        let (_, line, shape, has_length) =
            first.entry(&row.name).or_insert_with(|| (next, row.line, row.shape, row.length.is_some()));
        if names.len() == next && *line == row.line {
            names.push(&row.name);
        }
        let differs = row.shape.is_some() && *shape != row.shape;
        if differs || *has_length != row.length.is_some() {
            problems.push(Defect::OtherShape { feature: row.name.clone(), first_line: *line }.at(row.line));
        }
    }
    let mut features = Vec::with_capacity(names.len());
    for name in &names {
        let Some((_, line, shape, has_length)) = first.get(name) else { continue };
        let stated = shape.unwrap_or(Shape::Point);
        let shape = if stated == Shape::Circle && *has_length { Shape::KnownCircle } else { stated };
        let needs_length = matches!(shape, Shape::Point | Shape::Wire);
        let takes_length = needs_length || matches!(shape, Shape::Plane | Shape::KnownCircle);
        if (needs_length && !has_length) || (*has_length && !takes_length) {
            problems.push(Defect::LengthOfShape { shape: shape.name(), is_missing: needs_length }.at(*line));
        }
        features.push(NamedShape { name: (*name).to_owned(), shape });
    }
    let index_of: BTreeMap<String, usize> =
        first.iter().map(|(name, (index, ..))| ((*name).to_owned(), *index)).collect();
    let mut warnings = Vec::new();
    let mut seen: BTreeMap<(usize, Vec<u64>), usize> = BTreeMap::new();
    let mut contacts = vec![0; features.len()];
    let mut kept = Vec::with_capacity(rows.len());
    for row in rows {
        let Cells { line, name, configuration, length, sigma, fields, .. } = row;
        let Some((&feature, shape)) = index_of.get(&name).and_then(|index| Some((index, features.get(*index)?.shape)))
        else {
            continue;
        };
        let length = length.unwrap_or(0.0);
        let is_distance = matches!(shape, Shape::Point | Shape::KnownCircle);
        if is_distance && length <= 0.0 && problems.is_empty() {
            problems.push(Defect::NegativeLength { text: to_mm(length).to_string() }.at(line));
        }
        let first_line = *seen.entry((feature, digits(&configuration))).or_insert(line);
        if first_line != line {
            warnings.push(Defect::RepeatsConfiguration { first_line }.at(line));
        }
        contacts[feature] += shape.components();
        kept.push(ContactRow { line, feature, configuration, length, sigma, fields });
    }
    for (named, values) in features.iter().zip(&contacts) {
        if *values <= named.shape.unknowns() {
            let needed = named.shape.unknowns() / named.shape.components() + 1;
            let found = values / named.shape.components();
            warnings.push(Defect::FewContacts { feature: named.name.clone(), found, needed }.of_table());
        }
    }
    warnings.sort_by_key(|warning| warning.line);
    Contacts { features, rows: kept, columns, warnings }
}
