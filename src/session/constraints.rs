//! Tables of direct distances: no tracker, no coordinates.
//!
//! Three kinds, told apart by their column names:
//!
//! ```text
//! position,socket,q1_rad,…,qn_rad                       rows of one position and socket share one point
//! from_q1_deg,…,from_qn_deg,to_q1_deg,…,to_qn_deg,length_mm,sigma_mm
//! feature,shape,q1_deg,…,qn_deg,length_mm,sigma_mm     contacts with a point, plane, line or circle of unknown place
//! ```
//!
//! Inside, configurations are pendant joint vectors [rad, sliding joints m] and lengths metres. Other columns are kept as
//! text for filters. The distance between the sockets of a plate is not in the table: the caller knows the plate.

mod contacts;
mod lengths;
mod shared_points;

pub use contacts::{ContactRow, Contacts, NamedShape};
pub use lengths::{LengthRow, Lengths};
pub use shared_points::{ConfigurationRow, SharedPointGroup, SharedPoints};

use super::measurements::joint_names;
use super::table::{self, Defect, Header, Numbers, Record, Shape, TableErrors, TableProblem, decode};
use crate::kinematics::JointType;

/// The rows of a table of direct distances.
#[derive(Clone, Debug, PartialEq)]
pub enum Constraints {
    /// Configurations in which the target sat in the same place.
    SharedPoints(SharedPoints),
    /// Measured lengths between the target points of two configurations.
    Lengths(Lengths),
    /// Contacts with features of unknown place.
    Contacts(Contacts),
}

/// Reads a table of direct distances for a robot with the given joints: UTF-8, with or without byte order mark. `file` is its
/// name in messages.
///
/// # Errors
/// All defects of the table together, lines that are not UTF-8 among them.
pub fn read_constraints(
    content: impl AsRef<[u8]>,
    file: &str,
    joints: &[JointType],
) -> Result<Constraints, TableErrors> {
    let (text, mut problems) = decode(content.as_ref(), file)?;
    let [sockets, lengths, contacts] = headers(joints);
    let table = table::split(&text, Shape::Named, &mut problems);
    let Some(record) = table.header else {
        problems.push(Defect::NoRows.of_table());
        return Err(TableErrors::new(file, problems, vec![sockets, lengths, contacts]));
    };
    if table.records.is_empty() && problems.is_empty() {
        problems.push(Defect::NoRows.of_table());
    }
    let Some(header) = Header::new(record, &mut problems) else {
        return Err(TableErrors::new(file, problems, vec![sockets, lengths, contacts]));
    };
    let is_contacts = header.text("feature").is_some() || header.text("anchor").is_some();
    let is_sockets = header.text("socket").is_some() || header.text("position").is_some();
    let is_lengths = header.has_prefix("from_q") || header.has_prefix("to_q") || header.has_prefix("length");
    let has_points = ["x", "y", "z"].iter().any(|name| header.has_quantity(name));
    let line = header.line;
    let input = Input { header, records: table.records, decimal_comma: table.decimal_comma, joints };
    let (constraints, expected) = if is_contacts {
        (Constraints::Contacts(contacts::read(input, &mut problems)), vec![contacts])
    } else if is_lengths {
        (Constraints::Lengths(lengths::read(input, &mut problems)), vec![lengths])
    } else if is_sockets && !has_points {
        (Constraints::SharedPoints(shared_points::read(input, &mut problems)), vec![sockets])
    } else {
        problems.push(Defect::NotConstraints { has_points }.at(line));
        return Err(TableErrors::new(file, problems, vec![sockets, lengths, contacts]));
    };
    if problems.is_empty() { Ok(constraints) } else { Err(TableErrors::new(file, problems, expected)) }
}

/// The lines of column names for this robot: socket table, table of lengths, table of contacts.
pub fn headers(joints: &[JointType]) -> [String; 3] {
    let names = |prefix| joint_names(prefix, joints).join(",");
    [
        format!("position,socket,{}", names("")),
        format!("{},{},length_mm", names("from_"), names("to_")),
        format!("feature,shape,{},length_mm", names("")),
    ]
}

/// What both kinds of table are read from.
struct Input<'a> {
    header: Header,
    records: Vec<Record>,
    decimal_comma: bool,
    joints: &'a [JointType],
}

/// All joint values of a row; `None` with problems when one is missing.
fn configuration(
    record: &Record,
    columns: &[table::NumberColumn],
    numbers: &mut Numbers<'_>,
    problems: &mut Vec<TableProblem>,
) -> Option<Vec<f64>> {
    let values: Vec<f64> = columns.iter().filter_map(|&column| numbers.required(record, column, problems)).collect();
    (values.len() == columns.len()).then_some(values)
}

/// Bits of joint values, the same for both zeros: equal for equal rows.
fn digits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| (value + 0.0).to_bits()).collect()
}
