//! Targets to compensate: configurations, or poses of the tool in the robot base.
//!
//! ```text
//! pose,q1_deg,…,qn_deg                                             joint targets
//! pose,x_mm,y_mm,z_mm[,roll_deg,pitch_deg,yaw_deg][,q1_deg,…]      Cartesian targets
//! ```
//!
//! Roll, pitch and yaw turn about the fixed axes x, y and z, as in URDF; other forms of orientation are recognised by their names
//! (see `orientation`), and without any the orientation is free. Joint values beside a Cartesian target say which branch (elbow, wrist)
//! is meant. Other columns are kept. Units as in all tables: `mm`, `m`, `um`, `in`, `deg`, `rad`.

use nalgebra::UnitQuaternion;

use super::orientation::Orientation;
use super::table::{self, Defect, Header, Measure, NumberColumn, Numbers, Shape, TableErrors, TableProblem, decode};
use crate::kinematics::JointType;

/// What is to be reached.
#[derive(Clone, Debug, PartialEq)]
pub enum TargetGoal {
    /// A pendant configuration (rad), sliding joints (m).
    Configuration(Vec<f64>),
    /// A point of the tool in the base (m), its orientation if it matters, and a configuration of the branch meant.
    Cartesian {
        /// Position (m).
        position: [f64; 3],
        /// Orientation of the tool in the base; free without it.
        orientation: Option<UnitQuaternion<f64>>,
        /// Pendant configuration nearby.
        near: Option<Vec<f64>>,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct TargetRow {
    /// Line in the file, from 1.
    pub line: usize,
    /// Name; the number of the row, from 0, in a table without names.
    pub pose: String,
    /// What is to be reached.
    pub goal: TargetGoal,
    /// Cells of the columns that are not read, as written.
    pub extra: Vec<String>,
}

/// A table of targets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Targets {
    pub rows: Vec<TargetRow>,
    /// Names of the columns that are not read, as written.
    pub extra: Vec<String>,
}

/// Column of a table of commands, which must not be compensated again.
const COMMANDS: &str = "status";

/// Reads targets for a robot with these joints. `file` is its name in messages.
///
/// # Errors
/// All defects of the table together.
pub fn read(content: impl AsRef<[u8]>, file: &str, joints: &[JointType]) -> Result<Targets, TableErrors> {
    let (text, mut problems) = decode(content.as_ref(), file)?;
    let rows = if problems.is_empty() { rows(&text, joints, &mut problems) } else { None };
    if problems.is_empty() {
        Ok(rows.unwrap_or_default())
    } else {
        let names = super::measurements::joint_names("", joints);
        let hint = format!("pose,{} or pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg", names.join(","));
        Err(TableErrors::new(file, problems, vec![hint]))
    }
}

fn rows(text: &str, joints: &[JointType], problems: &mut Vec<TableProblem>) -> Option<Targets> {
    let table = table::split(text, Shape::Named, problems);
    if table.records.is_empty() && problems.is_empty() {
        problems.push(Defect::NoRows.of_table());
    }
    let names = table.header?;
    if names.cells.iter().any(|name| name == COMMANDS) {
        problems.push(Defect::AlreadyCompensated.of_table());
        return None;
    }
    let mut header = Header::new(names, problems)?;
    let pose = header.text("pose");
    let axes = ["x", "y", "z"];
    let orientation = Orientation::find(&mut header, &[], problems);
    let is_cartesian = axes.iter().any(|name| header.has_quantity(name)) || orientation.is_some();
    let has_joints = !is_cartesian || header.has_quantity("q1");
    let point: Vec<NumberColumn> = axes
        .into_iter()
        .filter(|_| is_cartesian)
        .filter_map(|name| header.required(name, Measure::Length, problems))
        .collect();
    let joints = if has_joints { header.joints("", joints, problems) } else { Vec::new() };
    let of_orientation = orientation.iter().flat_map(|orientation| &orientation.columns);
    let used: Vec<usize> =
        point.iter().chain(&joints).chain(of_orientation).map(|column| column.index).chain(pose).collect();
    let names = header.finish(problems);
    let is_extra = |index: &usize| !used.contains(index);
    let extra: Vec<usize> = (0..names.len()).filter(is_extra).collect();
    let mut numbers = Numbers::new(&names, table.decimal_comma);
    let mut rows = Vec::with_capacity(table.records.len());
    for (index, record) in table.records.iter().enumerate() {
        let before = problems.len();
        let name = pose.and_then(|place| record.cells.get(place)).cloned().unwrap_or_else(|| index.to_string());
        let mut values = |columns: &[NumberColumn]| -> Vec<f64> {
            columns.iter().filter_map(|&column| numbers.required(record, column, problems)).collect()
        };
        let (point, q) = (values(&point), values(&joints));
        let turn = orientation.as_ref().map(|orientation| (orientation, values(&orientation.columns)));
        let is_complete = problems.len() == before;
        let turn = turn.filter(|_| is_complete).map(|(orientation, values)| orientation.rotation(&values));
        let turn = turn.transpose().unwrap_or_else(|defect| {
            problems.push(defect.at(record.line));
            None
        });
        let goal = match point[..] {
            [x, y, z] => {
                TargetGoal::Cartesian { position: [x, y, z], orientation: turn, near: (!q.is_empty()).then_some(q) }
            }
            _ => TargetGoal::Configuration(q),
        };
        let kept = extra.iter().map(|&index| record.cells.get(index).cloned().unwrap_or_default()).collect();
        if problems.len() == before {
            rows.push(TargetRow { line: record.line, pose: name, goal, extra: kept });
        }
    }
    let extra = extra.iter().filter_map(|&index| names.get(index).cloned()).collect();
    Some(Targets { rows, extra })
}

/// A name of an output table, in quotation marks where it needs them.
pub fn quoted(name: &str) -> String {
    super::measurements::quoted(name)
}
