//! Plans: the configurations to measure, in the order of the program.
//!
//! ```text
//! pose,kind,q1_deg,…,qn_deg,x_mm,y_mm,z_mm
//! ```
//!
//! - Joints are pendant values: `deg` or `rad`, sliding joints `mm`, `m`, `um` or `in`.
//! - `kind` is `identification`, `verification`, `home`, `drift` or `via`; without that column, or with an empty cell, a row is
//!   `identification`. So a plain list `pose,q1_deg,…` is a plan.
//! - `pose` may be missing: then the rows are numbered from 0.
//! - `x`, `y`, `z` is where the nominal arm should have the SMR, in the **robot base**: for information, and they may be missing.
//! - Any other column is passed over.
//!
//! A drift pose has the name and the configuration of the pose that it repeats.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::measurements::{farthest_joint, joint_cells, joint_names, quoted};
use super::table::{
    self, Defect, Header, Measure, NumberColumn, Numbers, Record, Shape, TableErrors, TableProblem, decode,
};
use crate::kinematics::JointType;
use crate::text::{decimal, names};
use crate::units::to_mm;

/// Purpose of a row of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseKind {
    /// Measured to identify the arm.
    #[default]
    Identification,
    /// Measured to verify what was identified.
    Verification,
    /// Start and end of the program; not measured.
    Home,
    /// Measured again to detect drift.
    Drift,
    /// Passed through on the way to the next pose; not measured.
    Via,
}

names!(PoseKind {
    Identification = "identification",
    Verification = "verification",
    Home = "home",
    Drift = "drift",
    Via = "via",
});

impl PoseKind {
    /// Whether the tracker measures here.
    pub const fn is_measured(self) -> bool {
        match self {
            Self::Identification | Self::Verification | Self::Drift => true,
            Self::Home | Self::Via => false,
        }
    }
}

/// The rows of a plan, in the order of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// One per row of the file.
    pub rows: Vec<PlannedPose>,
    /// Oddities of the plan that do not forbid its use, in the order of its lines.
    pub warnings: Vec<TableProblem>,
}

/// One row of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPose {
    pub pose: String,
    pub kind: PoseKind,
    /// Pendant joint values (rad), sliding joints (m).
    pub configuration: Vec<f64>,
    /// Point of the SMR in the robot base (m), from the nominal arm.
    pub point_in_base: Option<Point3<f64>>,
}

/// Reads a plan for a robot with the given joints: UTF-8, with or without byte order mark. `file` is its name in messages.
///
/// # Errors
/// All defects of the table together, lines that are not UTF-8 among them.
pub fn read(content: impl AsRef<[u8]>, file: &str, joints: &[JointType]) -> Result<Plan, TableErrors> {
    let (text, mut problems) = decode(content.as_ref(), file)?;
    let rows = rows(&text, joints, &mut problems).unwrap_or_default();
    if problems.is_empty() && !rows.iter().any(|(_, row)| row.kind.is_measured()) {
        problems.push(Defect::NothingToMeasure.of_table());
    }
    let mut warnings: Vec<TableProblem> = table::changed(&text).into_iter().collect();
    warnings.extend(consistency(&rows, joints, &mut problems));
    if problems.is_empty() {
        Ok(Plan { rows: rows.into_iter().map(|(_, row)| row).collect(), warnings })
    } else {
        Err(TableErrors::new(file, problems, vec![header(joints)]))
    }
}

/// The line of column names of a plan for this robot: `pose,kind,q1_deg,…`.
pub fn header(joints: &[JointType]) -> String {
    format!("pose,kind,{}", joint_names("", joints).join(","))
}

/// A plan that [`read`] reads back: joints in degrees with nine decimals (sliding joints in mm with six), the predicted point
/// in mm with three, if a row has one. Control characters in names are replaced.
pub fn write(rows: &[PlannedPose], joints: &[JointType]) -> String {
    let has_point = rows.iter().any(|row| row.point_in_base.is_some());
    let mut text = header(joints);
    if has_point {
        text.push_str(",x_mm,y_mm,z_mm");
    }
    text.push('\n');
    for row in rows {
        let mut cells = vec![quoted(&row.pose), row.kind.name().to_owned()];
        cells.extend(joint_cells(&row.configuration, joints));
        if has_point {
            let cell = |axis: usize| row.point_in_base.map_or_else(String::new, |point| decimal(to_mm(point[axis]), 3));
            cells.extend((0..3).map(cell));
        }
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// Columns of the parts of a row.
struct Places {
    pose: Option<usize>,
    kind: Option<usize>,
    joints: Vec<NumberColumn>,
    point: Vec<NumberColumn>,
}

/// A row with its line in the file.
type Placed = (usize, PlannedPose);

/// All rows without defects; `None`, reported, if the columns are not recognised.
fn rows(text: &str, joints: &[JointType], problems: &mut Vec<TableProblem>) -> Option<Vec<Placed>> {
    let table = table::split(text, Shape::Named, problems);
    if table.records.is_empty() && problems.is_empty() {
        problems.push(Defect::NoRows.of_table());
    }
    let mut header = Header::new(table.header?, problems)?;
    let point = ["x", "y", "z"];
    let has_point = point.iter().any(|name| header.has_quantity(name));
    let places = Places {
        pose: header.text("pose"),
        kind: header.text("kind"),
        joints: header.joints("", joints, problems),
        // Some coordinates without the others are a slip of the pen.
        point: point
            .into_iter()
            .filter(|_| has_point)
            .filter_map(|name| header.required(name, Measure::Length, problems))
            .collect(),
    };
    let columns = header.finish(problems);
    let mut numbers = Numbers::new(&columns, table.decimal_comma);
    let mut rows = Vec::with_capacity(table.records.len());
    for (index, record) in table.records.iter().enumerate() {
        rows.extend(row(index, record, &places, &mut numbers, problems).map(|row| (record.line, row)));
    }
    Some(rows)
}

/// Reads one row. All its cells are checked, also after the first defect.
fn row(
    index: usize,
    record: &Record,
    places: &Places,
    numbers: &mut Numbers<'_>,
    problems: &mut Vec<TableProblem>,
) -> Option<PlannedPose> {
    let before = problems.len();
    let text = |place: Option<usize>| place.and_then(|place| record.cells.get(place)).map(String::as_str);
    let pose = text(places.pose).map_or_else(|| index.to_string(), str::to_owned);
    if pose.is_empty() {
        problems.push(Defect::Empty.at_cell(record.line, "pose"));
    }
    let kind = match text(places.kind) {
        None | Some("") => PoseKind::default(),
        Some(text) => text.parse().unwrap_or_else(|_| {
            let allowed = PoseKind::NAMES.to_vec();
            problems.push(Defect::UnknownKind { text: text.to_owned(), allowed }.at_cell(record.line, "kind"));
            PoseKind::default()
        }),
    };
    let configuration: Vec<f64> =
        places.joints.iter().filter_map(|&column| numbers.required(record, column, problems)).collect();
    let point: Vec<f64> =
        places.point.iter().filter_map(|&column| numbers.optional(record, column, problems)).collect();
    let point_in_base = match point[..] {
        [x, y, z] => Some(Point3::new(x, y, z)),
        _ => None,
    };
    (problems.len() == before).then_some(PlannedPose { pose, kind, configuration, point_in_base })
}

/// Rows of one name have one configuration; poses that are measured twice for the same purpose are warned about.
fn consistency(rows: &[Placed], joints: &[JointType], problems: &mut Vec<TableProblem>) -> Vec<TableProblem> {
    let mut poses: BTreeMap<&str, &Placed> = BTreeMap::new();
    let mut configurations: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let mut warnings = Vec::new();
    for placed in rows {
        let (line, row) = placed;
        let (first_line, first) = *poses.entry(&row.pose).or_insert(placed);
        if let Some((joint, quantity, before, here)) = farthest_joint(&first.configuration, &row.configuration, joints)
        {
            let rounded = |value: f64| (quantity.to_edge(value) * 1e3).round() / 1e3;
            let defect = Defect::OtherConfiguration {
                pose: row.pose.clone(),
                target: None,
                first_line: *first_line,
                joint: joint + 1,
                first: rounded(before),
                here: rounded(here),
                unit: quantity.unit(),
            };
            problems.push(defect.at(*line));
        }
        if matches!(row.kind, PoseKind::Identification | PoseKind::Verification) {
            // Zero has two signs.
            let digits = row.configuration.iter().map(|value| (value + 0.0).to_bits()).collect();
            let first_line = *configurations.entry(digits).or_insert(*line);
            if first_line != *line {
                warnings.push(Defect::RepeatsConfiguration { first_line }.at(*line));
            }
        }
    }
    warnings
}
