//! Measurement tables: configurations with the tracker points read at them.
//!
//! Inside, a configuration is the pendant joint vector [rad, or m for a sliding joint] and a point is in the tracker
//! frame (m). The table's own layout names its columns with units:
//!
//! ```text
//! pose,target,q1_deg,…,qn_deg,x_mm,y_mm,z_mm,sigma_mm,temperature_degc,note
//! ```
//!
//! - Joints: `deg` or `rad`, sliding joints `mm`, `m`, `um` or `in`; coordinates and `sigma`: `mm`, `m`, `um` or `in`.
//! - `pose` may be missing: then the rows are numbered from 0, and filters see that number as column `pose`.
//! - `target`, `sigma` and `temperature` may be missing, and their cells empty.
//! - Any other column is kept as text for filters.
//!
//! Tables of others are read as well: with other names and separators, with units in brackets or in a row of their own, with several
//! SMRs in one row. An orientation beside the point, with its standard deviation in `sigma_rot_deg` or stated by a person, makes each
//! row four points of a rigid body. What they mean is found out before anything is read, and refused where it is not clear.
//!
//! Nothing is dropped: copies of rows are kept and listed in [`Measurements::duplicates`].

mod columns;
mod consistency;
mod foreign;
mod imported;
mod join;
mod layout;
mod names;
mod rigid;
mod saved;
mod writer;

use std::mem;

use nalgebra::Point3;

pub use columns::{Columns, ColumnsError, Units};
pub(super) use consistency::farthest_joint;
pub use foreign::{ColumnRead, Expected, Reading, Understood};
pub use join::{JoinBy, NamedPoint, PointFile, joined, points_alone};
pub use layout::Layout;
pub use saved::SavedLayout;
pub(super) use writer::{joint_cells, quoted};
pub use writer::{write, write_with_text};

use super::table::{
    self, Defect, Header, Measure, NumberColumn, Numbers, Record, Shape, TableErrors, TableProblem, decode,
};
use crate::kinematics::JointType;
use foreign::{Foreign, Wanted, as_orientation, understand};
use rigid::{Orientations, unused};

/// The rows of a measurement table.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    /// One per row of the file, in its order, copies included.
    pub rows: Vec<Row>,
    /// Names of the columns, parallel to [`Row::fields`].
    pub columns: Vec<String>,
    /// The layout that was read.
    pub layout: Layout,
    /// Places in `rows` of those that repeat an earlier row in target, configuration and point, ascending. They are
    /// copies made in a spreadsheet, not readings: identification should leave them out.
    pub duplicates: Vec<usize>,
    /// Oddities of the table that do not forbid its use, in the order of its lines.
    pub warnings: Vec<TableProblem>,
    /// What was understood of its columns.
    pub understood: Understood,
}

/// One reading: the configuration of the robot and the measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// 1-based line in the file.
    pub line: usize,
    /// Name of the pose; readings of one pose and target repeat each other.
    pub pose: String,
    /// Name of the SMR, where a table distinguishes several.
    pub target: Option<String>,
    /// Pendant joint values (rad), sliding joints (m).
    pub configuration: Vec<f64>,
    /// Centre of the SMR in the tracker frame (m).
    pub point: Point3<f64>,
    /// Standard deviation of the point, per coordinate (m).
    pub sigma: Option<f64>,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// Text of all cells as in the file, parallel to [`Measurements::columns`], for filters.
    pub fields: Vec<String>,
}

impl Measurements {
    /// The rows without the copies listed in [`Measurements::duplicates`].
    pub fn distinct_rows(&self) -> impl Iterator<Item = &Row> {
        let is_copy = |index: &usize| self.duplicates.binary_search(index).is_ok();
        self.rows.iter().enumerate().filter(move |(index, _)| !is_copy(index)).map(|(_, row)| row)
    }
}

/// Reads a table with named columns for a robot with the given joints. `file` is its name in messages.
///
/// # Errors
/// All defects of the table together.
pub fn read(content: impl AsRef<[u8]>, file: &str, joints: &[JointType]) -> Result<Measurements, TableErrors> {
    read_as(Layout::Named, content, file, joints)
}

/// As [`read`], in a layout chosen by the user.
///
/// # Errors
/// All defects of the table together.
pub fn read_as(
    layout: Layout,
    content: impl AsRef<[u8]>,
    file: &str,
    joints: &[JointType],
) -> Result<Measurements, TableErrors> {
    read_for(&Expected::joints(joints), layout, &Reading::default(), content, file)
}

/// As [`read_as`], for a robot whose names are known, as a person says that it should be read.
///
/// # Errors
/// All defects of the table together.
pub fn read_for(
    expected: &Expected<'_>,
    layout: Layout,
    reading: &Reading,
    content: impl AsRef<[u8]>,
    file: &str,
) -> Result<Measurements, TableErrors> {
    let (text, mut problems) = decode(content.as_ref(), file)?;
    let mut warnings: Vec<TableProblem> = table::changed(&text).into_iter().collect();
    let joints = expected.joints;
    let foreign = match layout {
        Layout::Named => {
            let table = table::split(&text, Shape::Named, &mut problems);
            understand(table, expected, reading, Wanted::Rows, &mut problems)
        }
        Layout::RoboDk => {
            let split = imported::split_robodk(&text, joints, &mut problems, &mut warnings);
            return finished(split, Understood::default(), layout, file, joints, problems, warnings);
        }
        Layout::Delmia => {
            let split = imported::split_delmia(&text, joints, &mut problems, &mut warnings);
            return finished(Some(split), Understood::default(), layout, file, joints, problems, warnings);
        }
    };
    read_understood(foreign, reading, expected, file, problems, warnings)
}

/// Reads the rows of a table whose columns are understood.
fn read_understood(
    foreign: Result<Foreign, Understood>,
    reading: &Reading,
    expected: &Expected<'_>,
    file: &str,
    mut problems: Vec<TableProblem>,
    warnings: Vec<TableProblem>,
) -> Result<Measurements, TableErrors> {
    let (split, understood) = match foreign {
        Ok(mut foreign) => {
            let understood = mem::take(&mut foreign.understood);
            (Some(split_named(foreign, reading, expected, &mut problems)), understood)
        }
        Err(understood) => (None, understood),
    };
    finished(split, understood, Layout::Named, file, expected.joints, problems, warnings)
}

/// Reads the rows of a table that is split, and checks them against each other.
fn finished(
    split: Option<Split>,
    mut understood: Understood,
    layout: Layout,
    file: &str,
    joints: &[JointType],
    mut problems: Vec<TableProblem>,
    mut warnings: Vec<TableProblem>,
) -> Result<Measurements, TableErrors> {
    let headers = if layout == Layout::Named { vec![header(joints)] } else { Vec::new() };
    let refused = |problems: Vec<TableProblem>, understood: Understood| {
        let understood = Some(Box::new(understood)).filter(|_| layout == Layout::Named);
        Err(TableErrors { understood, ..TableErrors::new(file, problems, headers.clone()) })
    };
    let Some(Split { mut columns, shown, places, records, decimal_comma }) = split else {
        return refused(problems, understood);
    };
    if records.is_empty() && problems.is_empty() {
        problems.push(Defect::NoRows.of_table());
    }
    let mut numbers = Numbers::new(&shown, decimal_comma);
    let numbered = places.pose.is_none();
    let mut rows = Vec::with_capacity(records.len());
    let mut turned = Vec::new();
    for (index, record) in records.into_iter().enumerate() {
        match &places.orientations {
            Orientations::Used(used) => {
                let row = row(index, record.clone(), &places, &mut numbers, &mut problems);
                turned.extend(row.and_then(|row| used.read(row, &record, &mut numbers, &mut problems)));
            }
            Orientations::None | Orientations::Unused(_) => {
                rows.extend(row(index, record, &places, &mut numbers, &mut problems));
            }
        }
    }
    match &places.orientations {
        Orientations::Used(used) => {
            let (corners, note) = used.corners(turned);
            rows = corners;
            understood.orientation = note;
            for column in understood.columns.iter_mut().filter(|column| column.read_as.is_none()) {
                column.read_as = as_orientation(&column.name.to_lowercase());
            }
        }
        Orientations::Unused(columns) => {
            understood.orientation = Some(unused(columns));
            understood.lacks_orientation_error = true;
        }
        Orientations::None => {}
    }
    if layout == Layout::RoboDk {
        imported::name_targets(&mut rows);
    }
    if numbered {
        columns.insert(0, "pose".to_owned());
        for row in &mut rows {
            row.fields.insert(0, row.pose.clone());
        }
    }
    let duplicates = consistency::check(&rows, joints, &mut problems, &mut warnings);
    if problems.is_empty() {
        warnings.sort_by_key(|warning| warning.line);
        Ok(Measurements { rows, columns, layout, duplicates, warnings, understood })
    } else {
        refused(problems, understood)
    }
}

/// The kinds of the joints `q1`, `q2`, … that the first line of a table names; `None` without such columns.
pub fn types_in_header(content: impl AsRef<[u8]>) -> Option<Vec<JointType>> {
    let text = String::from_utf8_lossy(content.as_ref());
    let header = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let names: Vec<String> = header
        .trim_start_matches('\u{feff}')
        .split([',', ';', '\t'])
        .map(|name| name.trim().trim_matches('"').to_lowercase())
        .collect();
    let kind = |number: usize| {
        let start = format!("q{number}_");
        let unit = names.iter().find_map(|name| name.strip_prefix(&start))?;
        Some(if matches!(unit, "deg" | "rad") { JointType::Revolute } else { JointType::Prismatic })
    };
    let types: Vec<JointType> = (1..=names.len()).map_while(kind).collect();
    (!types.is_empty()).then_some(types)
}

/// The line of column names that a table for this robot can have: `pose,target,q1_deg,…,x_mm,y_mm,z_mm`.
pub fn header(joints: &[JointType]) -> String {
    let mut names = vec!["pose".to_owned(), "target".to_owned()];
    names.extend(joint_names("", joints));
    names.extend(["x_mm", "y_mm", "z_mm"].map(str::to_owned));
    names.join(",")
}

/// `q1_deg` … `qn_deg` after `prefix`, sliding joints in mm.
pub(super) fn joint_names(prefix: &str, joints: &[JointType]) -> Vec<String> {
    let name = |(index, joint): (usize, &JointType)| {
        format!("{prefix}q{}_{}", index + 1, Measure::of_joint(*joint).usual_unit())
    };
    joints.iter().enumerate().map(name).collect()
}

/// Columns of the parts of a row.
#[derive(Debug, Default)]
struct Places {
    pose: Option<usize>,
    target: Option<usize>,
    joints: Vec<NumberColumn>,
    point: Vec<NumberColumn>,
    sigma: Option<NumberColumn>,
    temperature: Option<NumberColumn>,
    orientations: Orientations,
}

/// A table before its cells are read: names, places and rows of text.
struct Split {
    /// Names for filters.
    columns: Vec<String>,
    /// Names in the file, for messages.
    shown: Vec<String>,
    places: Places,
    records: Vec<Record>,
    decimal_comma: bool,
}

/// Finds the columns of the table's own layout.
fn split_named(
    foreign: Foreign,
    reading: &Reading,
    expected: &Expected<'_>,
    problems: &mut Vec<TableProblem>,
) -> Split {
    let Foreign { line, shown, canonical, records, decimal_comma, understood: _ } = foreign;
    let mut header = Header::renamed(line, shown, &canonical, problems);
    let places = Places {
        pose: header.text("pose"),
        target: header.text("target"),
        joints: header.joints("", expected.joints, problems),
        point: ["x", "y", "z"]
            .into_iter()
            .filter_map(|name| header.required(name, Measure::Length, problems))
            .collect(),
        sigma: header.number("sigma", Measure::Length, problems),
        temperature: header.number("temperature", Measure::Temperature, problems),
        orientations: Orientations::find(&mut header, reading, expected, problems),
    };
    let shown = header.finish(problems);
    Split { columns: canonical, shown, places, records, decimal_comma }
}

/// Reads one row. All its cells are checked, also after the first defect.
fn row(
    index: usize,
    mut record: Record,
    places: &Places,
    numbers: &mut Numbers<'_>,
    problems: &mut Vec<TableProblem>,
) -> Option<Row> {
    let before = problems.len();
    let text = |place: Option<usize>| place.and_then(|place| record.cells.get(place)).map(String::as_str);
    let pose = text(places.pose).map_or_else(|| index.to_string(), str::to_owned);
    if pose.is_empty() {
        problems.push(Defect::Empty.at_cell(record.line, "pose"));
    }
    let target = text(places.target).filter(|text| !text.is_empty()).map(str::to_owned);
    let configuration: Vec<f64> =
        places.joints.iter().filter_map(|&column| numbers.required(&record, column, problems)).collect();
    let point: Vec<f64> =
        places.point.iter().filter_map(|&column| numbers.required(&record, column, problems)).collect();
    let sigma = places.sigma.and_then(|column| numbers.deviation(&record, column, problems));
    let temperature = places.temperature.and_then(|column| numbers.optional(&record, column, problems));
    let point = match point[..] {
        [x, y, z] => Point3::new(x, y, z),
        _ => return None,
    };
    if point.coords.iter().all(|coordinate| coordinate.abs() <= 0.0) {
        problems.push(Defect::ZeroPoint.at(record.line));
    }
    let complete = problems.len() == before && configuration.len() == places.joints.len();
    let fields = mem::take(&mut record.cells);
    complete.then_some(Row { line: record.line, pose, target, configuration, point, sigma, temperature, fields })
}
