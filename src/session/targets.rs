//! Targets to compensate: configurations, or poses of the tool in the robot base.
//!
//! ```text
//! pose,q1_deg,…,qn_deg                                             joint targets
//! pose,x_mm,y_mm,z_mm[,roll_deg,pitch_deg,yaw_deg][,q1_deg,…]      Cartesian targets
//! ```
//!
//! Roll, pitch and yaw turn about the fixed axes x, y and z, as in URDF; without them the orientation is free. Joint values
//! beside a Cartesian target say which branch (elbow, wrist) is meant. Units as in all tables: `mm`, `m`, `um`, `in`, `deg`, `rad`.

use super::table::{self, Defect, Header, Measure, NumberColumn, Numbers, Shape, TableErrors, TableProblem, decode};
use crate::kinematics::JointType;

/// What is to be reached.
#[derive(Clone, Debug, PartialEq)]
pub enum TargetGoal {
    /// A pendant configuration (rad), sliding joints (m).
    Configuration(Vec<f64>),
    /// A point of the tool in the base (m), its roll, pitch, yaw (rad) if they matter, and a configuration of the branch meant.
    Cartesian {
        /// Position (m).
        position: [f64; 3],
        /// Roll, pitch, yaw (rad).
        roll_pitch_yaw: Option<[f64; 3]>,
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
}

/// Column of a table of commands, which must not be compensated again.
const COMMANDS: &str = "status";

/// Reads targets for a robot with these joints. `file` is its name in messages.
///
/// # Errors
/// All defects of the table together.
pub fn read(content: impl AsRef<[u8]>, file: &str, joints: &[JointType]) -> Result<Vec<TargetRow>, TableErrors> {
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

fn rows(text: &str, joints: &[JointType], problems: &mut Vec<TableProblem>) -> Option<Vec<TargetRow>> {
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
    let (point, angles) = (["x", "y", "z"], ["roll", "pitch", "yaw"]);
    let is_cartesian = point.iter().chain(&angles).any(|name| header.has_quantity(name));
    let has_angles = angles.iter().any(|name| header.has_quantity(name));
    let has_joints = !is_cartesian || header.has_quantity("q1");
    let mut columns = |names: [&str; 3], measure: Measure, are_there: bool| -> Vec<NumberColumn> {
        let names = names.into_iter().filter(|_| are_there);
        names.filter_map(|name| header.required(name, measure, problems)).collect()
    };
    let point = columns(point, Measure::Length, is_cartesian);
    let angles = columns(angles, Measure::Angle, has_angles);
    let joints = if has_joints { header.joints("", joints, problems) } else { Vec::new() };
    let names = header.finish(problems);
    let mut numbers = Numbers::new(&names, table.decimal_comma);
    let mut rows = Vec::with_capacity(table.records.len());
    for (index, record) in table.records.iter().enumerate() {
        let before = problems.len();
        let name = pose.and_then(|place| record.cells.get(place)).cloned().unwrap_or_else(|| index.to_string());
        let mut values = |columns: &[NumberColumn]| -> Vec<f64> {
            columns.iter().filter_map(|&column| numbers.required(record, column, problems)).collect()
        };
        let (point, angles, q) = (values(&point), values(&angles), values(&joints));
        let goal = match point[..] {
            [x, y, z] => TargetGoal::Cartesian {
                position: [x, y, z],
                roll_pitch_yaw: <[f64; 3]>::try_from(angles).ok(),
                near: (!q.is_empty()).then_some(q),
            },
            _ => TargetGoal::Configuration(q),
        };
        if problems.len() == before {
            rows.push(TargetRow { line: record.line, pose: name, goal });
        }
    }
    Some(rows)
}

/// A name of an output table, in quotation marks where it needs them.
pub fn quoted(name: &str) -> String {
    super::measurements::quoted(name)
}
