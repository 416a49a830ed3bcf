//! Socket tables: a ball on the flange seated in sockets of a plate.

use std::collections::BTreeMap;

use super::{Input, configuration, digits};
use crate::session::table::{Defect, Numbers, Record, TableProblem};

/// Configurations grouped by the point they share.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedPoints {
    /// In the order in which they first appear in the file.
    pub groups: Vec<SharedPointGroup>,
    /// Names of the columns, parallel to [`ConfigurationRow::fields`].
    pub columns: Vec<String>,
    /// What is odd about the table but does not forbid its use, in the order of its lines.
    pub warnings: Vec<TableProblem>,
}

/// All configurations with the target in one socket of the plate, the plate in one place.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedPointGroup {
    /// Place of the plate.
    pub position: String,
    /// Socket of the plate.
    pub socket: String,
    /// In the order of the file; copies of a row are kept and warned about.
    pub samples: Vec<ConfigurationRow>,
}

/// One configuration of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigurationRow {
    /// 1-based line in the file.
    pub line: usize,
    /// Pendant joint values (rad), sliding joints (m).
    pub configuration: Vec<f64>,
    /// Text of all cells as in the file, parallel to [`SharedPoints::columns`], for filters.
    pub fields: Vec<String>,
}

pub(super) fn read(input: Input<'_>, problems: &mut Vec<TableProblem>) -> SharedPoints {
    let Input { mut header, records, decimal_comma, joints } = input;
    let position = header.required_text("position");
    let socket = header.required_text("socket");
    let places = header.joints("", joints, problems);
    let columns = header.finish(problems);
    let mut numbers = Numbers::new(&columns, decimal_comma);
    let mut groups: Vec<SharedPointGroup> = Vec::new();
    let mut group_of: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut seen: BTreeMap<(usize, Vec<u64>), usize> = BTreeMap::new();
    let mut warnings = Vec::new();
    for record in records {
        let position = label(&record, position, "position", problems);
        let socket = label(&record, socket, "socket", problems);
        let configuration = configuration(&record, &places, &mut numbers, problems);
        let (Some(position), Some(socket), Some(configuration)) = (position, socket, configuration) else { continue };
        let Record { line, cells } = record;
        let index = *group_of.entry((position.clone(), socket.clone())).or_insert_with(|| {
            groups.push(SharedPointGroup { position, socket, samples: Vec::new() });
            groups.len() - 1
        });
        let first_line = *seen.entry((index, digits(&configuration))).or_insert(line);
        if first_line != line {
            warnings.push(Defect::RepeatsConfiguration { first_line }.at(line));
        }
        if let Some(group) = groups.get_mut(index) {
            group.samples.push(ConfigurationRow { line, configuration, fields: cells });
        }
    }
    for group in &groups {
        if let [only] = &group.samples[..] {
            let (position, socket) = (group.position.clone(), group.socket.clone());
            warnings.push(Defect::LoneRow { position, socket }.at(only.line));
        }
    }
    warnings.sort_by_key(|warning| warning.line);
    SharedPoints { groups, columns, warnings }
}

/// Text of a cell that names something; `None` with a problem when it is empty, without one when the column is missing.
fn label(record: &Record, place: Option<usize>, name: &str, problems: &mut Vec<TableProblem>) -> Option<String> {
    let text = record.cells.get(place?)?;
    if text.is_empty() {
        problems.push(Defect::Empty.at_cell(record.line, name));
        return None;
    }
    Some(text.clone())
}
