//! Lengths measured between the target points of two configurations.

use std::collections::BTreeMap;

use super::{Input, configuration, digits};
use crate::session::table::{Defect, Measure, Numbers, Record, TableProblem};

/// The rows of a table of lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct Lengths {
    /// One per row of the file, in its order; copies of a row are kept and warned about.
    pub rows: Vec<LengthRow>,
    /// Names of the columns, parallel to [`LengthRow::fields`].
    pub columns: Vec<String>,
    /// What is odd about the table but does not forbid its use, in the order of its lines.
    pub warnings: Vec<TableProblem>,
}

/// One measured length.
#[derive(Clone, Debug, PartialEq)]
pub struct LengthRow {
    /// 1-based line in the file.
    pub line: usize,
    /// Pendant joint values at one end (rad), sliding joints (m).
    pub from: Vec<f64>,
    /// Pendant joint values at the other end (rad), sliding joints (m).
    pub to: Vec<f64>,
    /// Measured distance between the two target points (m), never negative.
    pub length: f64,
    /// Standard deviation of the length (m).
    pub sigma: Option<f64>,
    /// Text of all cells as in the file, parallel to [`Lengths::columns`], for filters.
    pub fields: Vec<String>,
}

pub(super) fn read(input: Input<'_>, problems: &mut Vec<TableProblem>) -> Lengths {
    let Input { mut header, records, decimal_comma, joints } = input;
    let from_places = header.joints("from_", joints, problems);
    let to_places = header.joints("to_", joints, problems);
    let length_place = header.required("length", Measure::Length, problems);
    let sigma_place = header.number("sigma", Measure::Length, problems);
    let columns = header.finish(problems);
    let mut numbers = Numbers::new(&columns, decimal_comma);
    let mut rows = Vec::with_capacity(records.len());
    let mut seen: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let mut warnings = Vec::new();
    for record in records {
        let from = configuration(&record, &from_places, &mut numbers, problems);
        let to = configuration(&record, &to_places, &mut numbers, problems);
        let length = length_place.and_then(|column| {
            let length = numbers.required(&record, column, problems)?;
            if length < 0.0 {
                let text = Numbers::text(&record, column).to_owned();
                problems.push(Defect::NegativeLength { text }.at_cell(record.line, numbers.name(column)));
            }
            Some((length, Numbers::text(&record, column).to_owned()))
        });
        let sigma = sigma_place.and_then(|column| numbers.deviation(&record, column, problems));
        let (Some(from), Some(to), Some((length, text))) = (from, to, length) else { continue };
        let Record { line, cells } = record;
        if length > 0.0 && !from.is_empty() && digits(&from) == digits(&to) {
            problems.push(Defect::SameEnds { text }.at(line));
        }
        let reading: Vec<f64> = from.iter().chain(&to).copied().chain([length]).collect();
        let first_line = *seen.entry(digits(&reading)).or_insert(line);
        if first_line != line {
            warnings.push(Defect::RepeatsLength { first_line }.at(line));
        }
        rows.push(LengthRow { line, from, to, length, sigma, fields: cells });
    }
    Lengths { rows, columns, warnings }
}
