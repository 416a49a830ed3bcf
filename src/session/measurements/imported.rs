//! Layouts of other programs: columns by place, units fixed, the first line ignored.

use super::{JointType, Places, Row, Split, joint_names};
use crate::session::table::{self, Defect, Measure, NumberColumn, Shape, TableProblem};

/// Joints in a table of RoboDK.
const ROBODK_JOINTS: usize = 6;
/// Columns in a table of RoboDK: joints, measured point, target in the flange.
const ROBODK_CELLS: usize = 12;
/// Where the target's coordinates begin.
const ROBODK_TARGET: usize = 9;

/// RoboDK: six turning joints, x y z measured, x y z of the target in the flange.
pub(super) fn split_robodk(
    text: &str,
    joints: &[JointType],
    problems: &mut Vec<TableProblem>,
    warnings: &mut Vec<TableProblem>,
) -> Option<Split> {
    if joints != [JointType::Revolute; ROBODK_JOINTS] {
        problems.push(Defect::LayoutJoints { joints: joints.len() }.of_table());
        return None;
    }
    let mut columns = joint_names("", joints);
    columns.extend(["x_mm", "y_mm", "z_mm", "tcp_x_mm", "tcp_y_mm", "tcp_z_mm"].map(str::to_owned));
    let shape = Shape::Fixed { cells: ROBODK_CELLS };
    Some(split(text, shape, columns, placed(0, joints), problems, warnings))
}

/// DELMIA: name of the pose, joints, x y z measured.
pub(super) fn split_delmia(
    text: &str,
    joints: &[JointType],
    problems: &mut Vec<TableProblem>,
    warnings: &mut Vec<TableProblem>,
) -> Split {
    let mut columns = vec!["pose".to_owned()];
    columns.extend(joint_names("", joints));
    columns.extend(["x_mm", "y_mm", "z_mm"].map(str::to_owned));
    let shape = Shape::Tabs { cells: columns.len() };
    split(text, shape, columns, Places { pose: Some(0), ..placed(1, joints) }, problems, warnings)
}

/// Names the targets of a RoboDK table `tcp1`, `tcp2`, … by their coordinates in the flange, in order of appearance;
/// a table with a single one has no target names.
pub(super) fn name_targets(rows: &mut [Row]) {
    let mut known: Vec<Vec<String>> = Vec::new();
    let mut place_of = |row: &mut Row| {
        let target = row.fields.get(ROBODK_TARGET..).unwrap_or_default();
        known.iter().position(|earlier| earlier == target).unwrap_or_else(|| {
            known.push(target.to_vec());
            known.len() - 1
        })
    };
    let places: Vec<usize> = rows.iter_mut().map(&mut place_of).collect();
    if known.len() > 1 {
        for (row, place) in rows.iter_mut().zip(places) {
            row.target = Some(format!("tcp{}", place + 1));
        }
    }
}

/// Joints and point, one after the other from `first` on.
fn placed(first: usize, joints: &[JointType]) -> Places {
    let joint = |(index, joint): (usize, &JointType)| NumberColumn::usual(first + index, Measure::of_joint(*joint));
    let end = first + joints.len();
    Places {
        joints: joints.iter().enumerate().map(joint).collect(),
        point: (end..end + 3).map(|index| NumberColumn::usual(index, Measure::Length)).collect(),
        ..Places::default()
    }
}

fn split(
    text: &str,
    shape: Shape,
    columns: Vec<String>,
    places: Places,
    problems: &mut Vec<TableProblem>,
    warnings: &mut Vec<TableProblem>,
) -> Split {
    let width = columns.len();
    let table = table::split(text, shape, problems);
    let mut records = table.records;
    let separator = if matches!(shape, Shape::Tabs { .. }) { "separated by tabs" } else { "separated by commas" };
    for problem in &mut *problems {
        if let Defect::CellCount { found, expected, .. } = problem.defect {
            problem.defect = Defect::LayoutCells { found, expected, separator, columns: columns.join(" ") };
        }
    }
    let is_number = |cell: &String| cell.replace(',', ".").parse::<f64>().is_ok();
    if let Some(header) = table.header.filter(|header| header.cells.iter().filter(|cell| is_number(cell)).count() > 3) {
        if header.line > 1 && header.cells.len() == width {
            // The line to ignore was a comment or blank and is gone already.
            records.insert(0, header);
        } else {
            warnings.push(Defect::NumbersIgnored.at(header.line));
        }
    }
    Split { shown: columns.clone(), columns, places, records, decimal_comma: table.decimal_comma }
}
