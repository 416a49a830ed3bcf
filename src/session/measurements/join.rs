//! Joints and points in separate files: joined row by row, by the name of the pose, or by time.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::foreign::{Expected, Foreign, Reading, Understood, Wanted, understand};
use super::{Measurements, farthest_joint, read_understood};
use crate::session::table::{self, Defect, NumberColumn, Numbers, Record, Shape, TableErrors, TableProblem, decode};
use crate::text::{counted, names};

/// Names shown in a message.
const SHOWN: usize = 5;

/// What makes a row of joints and a row of points belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoinBy {
    /// The number of the row.
    Row,
    /// The name of the pose.
    Name,
    /// The time: the joints that were read nearest to it.
    Time,
}

names!(JoinBy { Row = "row", Name = "name", Time = "time", });

/// A file with points.
#[derive(Clone, Debug)]
pub struct PointFile {
    /// Name of the file, for messages.
    pub name: String,
    /// Its bytes, or the text of its sheet.
    pub content: Vec<u8>,
    /// The target that was measured; none: the only one of the file.
    pub target: Option<String>,
}

/// Largest difference of times that belong together (s).
const SAME_TIME: f64 = 0.5;

/// One of the files, its columns understood.
struct Part {
    file: String,
    foreign: Foreign,
}

/// Reads a file with joints and files with points as one table. Without `by`, rows are joined by the names of the poses if both have
/// such names, and by their numbers otherwise.
///
/// # Errors
/// A file cannot be understood, or rows of one belong to none of the other.
pub fn joined(
    expected: &Expected<'_>,
    reading: (&Reading, &Reading),
    joints: (&str, &[u8]),
    points: &[PointFile],
    by: Option<JoinBy>,
) -> Result<Measurements, TableErrors> {
    let of_joints = part(expected, reading.0, joints.0, joints.1, Wanted::Joints)?;
    let count = points.len();
    let mut whole: Option<Foreign> = None;
    for (index, file) in points.iter().enumerate() {
        let mut of_points = part(expected, reading.1, &file.name, &file.content, Wanted::Points)?;
        let target =
            file.target.clone().or_else(|| (count > 1).then(|| expected.targets.get(index).cloned()).flatten());
        if count > 1 && target.is_none() && !of_points.has("target") {
            let message = format!(
                "there are {} of points, and the profile has {}; add the others to its 'targets'",
                counted(count, "file"),
                counted(expected.targets.len(), "target")
            );
            return Err(of_points.refused(Defect::Lacking(message)));
        }
        if let Some(target) = target.filter(|_| !of_points.has("target")) {
            of_points.add("target", |_| target.clone());
        }
        let table = join(&of_joints, &of_points, expected, by)?;
        match &mut whole {
            None => whole = Some(table),
            Some(whole) if whole.canonical == table.canonical => whole.records.extend(table.records),
            Some(_) => {
                return Err(of_points
                    .refused(Defect::Lacking("its columns are not those of the other file of points".to_owned())));
            }
        }
    }
    let Some(whole) = whole else {
        return Err(of_joints.refused(Defect::Lacking("no file with points is given".to_owned())));
    };
    let names: Vec<&str> = std::iter::once(joints.0).chain(points.iter().map(|file| file.name.as_str())).collect();
    read_understood(Ok(whole), reading.1, expected, &names.join("' and '"), Vec::new(), Vec::new())
}

/// A point of a table, with the name that it has there.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// Name of the point or its pose, if it has one.
    pub name: Option<String>,
    /// In the tracker frame (m).
    pub point: Point3<f64>,
}

/// Reads a file with points alone, each with its name if the file has names. Coordinates whose columns state no unit are in `unit`.
///
/// # Errors
/// The file cannot be understood.
pub fn points_alone(
    expected: &Expected<'_>,
    unit: &str,
    content: &[u8],
    file: &str,
) -> Result<Vec<NamedPoint>, TableErrors> {
    let units = format!("deg,{unit}").parse().unwrap_or_default();
    let reading = Reading { units, ..Reading::default() };
    let part = part(expected, &reading, file, content, Wanted::Points)?;
    let mut coordinates = Vec::with_capacity(3);
    for base in ["x", "y", "z"] {
        let index = part.quantity(base).unwrap_or(usize::MAX);
        let unit = part.foreign.canonical.get(index).and_then(|name| name.split_once('_')).map_or("", |(_, unit)| unit);
        coordinates.push(part.numbers(NumberColumn::in_unit(index, unit))?);
    }
    let names = part.column("pose").map(|column| part.cells(column));
    let name = |row: usize| names.as_ref()?.get(row).filter(|name| !name.is_empty()).map(|name| (*name).to_owned());
    let point = |row: usize| {
        let at = |axis: usize| coordinates.get(axis)?.get(row).copied();
        Some(NamedPoint { name: name(row), point: Point3::new(at(0)?, at(1)?, at(2)?) })
    };
    Ok((0..part.foreign.records.len()).filter_map(point).collect())
}

/// Understands one of the files.
fn part(
    expected: &Expected<'_>,
    reading: &Reading,
    file: &str,
    content: &[u8],
    wanted: Wanted,
) -> Result<Part, TableErrors> {
    let (text, mut problems) = decode(content, file)?;
    let table = table::split(&text, Shape::Named, &mut problems);
    let found = understand(table, expected, reading, wanted, &mut problems);
    let refused = |problems: Vec<TableProblem>, understood: Understood| TableErrors {
        understood: Some(Box::new(understood)),
        ..TableErrors::new(file, problems, Vec::new())
    };
    let foreign = match found {
        Ok(foreign) if problems.is_empty() => foreign,
        Ok(foreign) => return Err(refused(problems, foreign.understood)),
        Err(understood) => return Err(refused(problems, understood)),
    };
    let part = Part { file: file.to_owned(), foreign };
    let (needed, what): (Vec<String>, &str) = match wanted {
        Wanted::Joints => ((1..=expected.joints.len()).map(|joint| format!("q{joint}")).collect(), "joint values"),
        Wanted::Points | Wanted::Rows => (["x", "y", "z"].map(str::to_owned).to_vec(), "points"),
    };
    let missing: Vec<&String> = needed.iter().filter(|base| part.quantity(base).is_none()).collect();
    if !missing.is_empty() {
        let columns: Vec<&str> = missing.iter().map(|name| name.as_str()).collect();
        let message = format!("no columns for the {what} are found ({}); name them", columns.join(", "));
        return Err(refused(vec![Defect::Lacking(message).at(part.foreign.line)], part.foreign.understood));
    }
    let without: Vec<String> = needed
        .iter()
        .filter_map(|base| part.quantity(base))
        .filter(|index| part.foreign.canonical.get(*index).is_some_and(|name| !name.contains('_')))
        .filter_map(|index| part.foreign.shown.get(index).cloned())
        .collect();
    if let Some(first) = without.first() {
        let example = format!("{first}_{}", if wanted == Wanted::Joints { "deg" } else { "mm" });
        let defect = Defect::MissingUnits { columns: without.clone(), example };
        return Err(refused(vec![defect.at(part.foreign.line)], part.foreign.understood));
    }
    if part.foreign.records.is_empty() {
        return Err(refused(vec![Defect::NoRows.of_table()], part.foreign.understood));
    }
    Ok(part)
}

impl Part {
    fn refused(&self, defect: Defect) -> TableErrors {
        TableErrors::new(&self.file, vec![defect.of_table()], Vec::new())
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.foreign.canonical.iter().position(|known| known == name)
    }

    fn has(&self, name: &str) -> bool {
        self.column(name).is_some()
    }

    /// The column of a quantity, whatever its unit.
    fn quantity(&self, base: &str) -> Option<usize> {
        self.foreign.canonical.iter().position(|known| known.split('_').next() == Some(base) && !known.contains(' '))
    }

    fn add(&mut self, name: &str, cell: impl Fn(&Record) -> String) {
        self.foreign.canonical.push(name.to_owned());
        self.foreign.shown.push(name.to_owned());
        for record in &mut self.foreign.records {
            let cell = cell(record);
            record.cells.push(cell);
        }
    }

    /// The cells of a column, one per record.
    fn cells(&self, index: usize) -> Vec<&str> {
        self.foreign.records.iter().map(|record| record.cells.get(index).map_or("", String::as_str)).collect()
    }

    /// The numbers of a column; all of them, or what is wrong.
    fn numbers(&self, column: NumberColumn) -> Result<Vec<f64>, TableErrors> {
        let mut numbers = Numbers::new(&self.foreign.shown, self.foreign.decimal_comma);
        let mut problems = Vec::new();
        let values: Vec<f64> =
            self.foreign.records.iter().filter_map(|record| numbers.required(record, column, &mut problems)).collect();
        if problems.is_empty() { Ok(values) } else { Err(TableErrors::new(&self.file, problems, Vec::new())) }
    }
}

/// The rows of both files that belong together.
fn join(joints: &Part, points: &Part, expected: &Expected<'_>, by: Option<JoinBy>) -> Result<Foreign, TableErrors> {
    let both_named = joints.has("pose") && points.has("pose");
    let by = by.unwrap_or(if both_named { JoinBy::Name } else { JoinBy::Row });
    let pairs = match by {
        JoinBy::Row => by_row(joints, points)?,
        JoinBy::Name => by_name(joints, points)?,
        JoinBy::Time => by_time(joints, points, expected)?,
    };
    let repeated: BTreeSet<&String> = points.foreign.canonical.iter().collect();
    let own: Vec<usize> = (0..joints.foreign.canonical.len())
        .filter(|index| {
            joints.foreign.canonical.get(*index).is_some_and(|name| !repeated.contains(name) || name == "pose")
        })
        .collect();
    // The pose of the joints names the row; that of the points is the same, or has no meaning here.
    let takes_pose = joints.has("pose");
    let others: Vec<usize> = (0..points.foreign.canonical.len())
        .filter(|index| !takes_pose || points.foreign.canonical.get(*index).is_some_and(|name| name != "pose"))
        .collect();
    let pick = |list: &[String], of: &[usize]| -> Vec<String> {
        of.iter().filter_map(|index| list.get(*index).cloned()).collect()
    };
    let concatenated = |first: Vec<String>, second: Vec<String>| first.into_iter().chain(second).collect::<Vec<_>>();
    let records = pairs
        .iter()
        .filter_map(|(joint, point)| {
            let (joint, point) = (joints.foreign.records.get(*joint)?, points.foreign.records.get(*point)?);
            let first = pointed(pick(&joint.cells, &own), joints.foreign.decimal_comma);
            let second = pointed(pick(&point.cells, &others), points.foreign.decimal_comma);
            Some(Record { line: point.line, cells: concatenated(first, second) })
        })
        .collect();
    let (joint_count, point_count) = (joints.foreign.records.len(), points.foreign.records.len());
    let mut understood = joints.foreign.understood.clone();
    understood.columns.extend(points.foreign.understood.columns.iter().cloned());
    understood.notes.extend(points.foreign.understood.notes.iter().cloned());
    understood.notes.push(format!(
        "'{}' ({}) and '{}' ({}) are joined by {}: {}",
        joints.file,
        counted(joint_count, "row"),
        points.file,
        counted(point_count, "row"),
        match by {
            JoinBy::Row => "the number of the row",
            JoinBy::Name => "the name of the pose",
            JoinBy::Time => "time",
        },
        counted(pairs.len(), "row")
    ));
    Ok(Foreign {
        line: points.foreign.line,
        shown: concatenated(pick(&joints.foreign.shown, &own), pick(&points.foreign.shown, &others)),
        canonical: concatenated(pick(&joints.foreign.canonical, &own), pick(&points.foreign.canonical, &others)),
        records,
        decimal_comma: true,
        understood,
    })
}

/// Cells with decimal points, so that files with different decimal signs make one table.
fn pointed(cells: Vec<String>, decimal_comma: bool) -> Vec<String> {
    let is_plain = |cell: &String| {
        decimal_comma && cell.matches(',').count() == 1 && !cell.contains('.') && table::is_number(cell)
    };
    cells.into_iter().map(|cell| if is_plain(&cell) { cell.replacen(',', ".", 1) } else { cell }).collect()
}

fn by_row(joints: &Part, points: &Part) -> Result<Vec<(usize, usize)>, TableErrors> {
    let (count, other) = (joints.foreign.records.len(), points.foreign.records.len());
    if count == other {
        return Ok((0..count).map(|index| (index, index)).collect());
    }
    let message = format!(
        "it has {}, but '{}' has {}: rows are missing somewhere, and from there on every point would get the joints of another pose; name the poses in both files, or complete the rows",
        counted(other, "row"),
        joints.file,
        count
    );
    Err(points.refused(Defect::NotJoined(message)))
}

fn by_name(joints: &Part, points: &Part) -> Result<Vec<(usize, usize)>, TableErrors> {
    let column = |part: &Part| {
        let lacking = || part.refused(Defect::Lacking("it has no column with the names of the poses".to_owned()));
        part.column("pose").ok_or_else(lacking)
    };
    let (joint_names, point_names) = (joints.cells(column(joints)?), points.cells(column(points)?));
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, name) in joint_names.iter().enumerate() {
        if known.insert(name, index).is_some() {
            let message = format!("the pose '{name}' is in it twice, so that it names no row alone");
            return Err(joints.refused(Defect::NotJoined(message)));
        }
    }
    let unknown: Vec<String> = point_names
        .iter()
        .filter(|name| !known.contains_key(*name))
        .take(SHOWN)
        .map(|name| format!("'{name}'"))
        .collect();
    if !unknown.is_empty() {
        let message = format!(
            "'{}' has no joints for the points {}; names must be the same in both files",
            joints.file,
            unknown.join(", ")
        );
        return Err(points.refused(Defect::NotJoined(message)));
    }
    Ok(point_names.iter().enumerate().filter_map(|(index, name)| Some((*known.get(name)?, index))).collect())
}

fn by_time(joints: &Part, points: &Part, expected: &Expected<'_>) -> Result<Vec<(usize, usize)>, TableErrors> {
    let times = |part: &Part| {
        let lacking = || part.refused(Defect::Lacking("it has no column with times".to_owned()));
        let column = part.column("time").ok_or_else(lacking)?;
        seconds(part, column)
    };
    let (joint_times, point_times) = (times(joints)?, times(points)?);
    let configurations = configurations(joints, expected)?;
    let mut pairs = Vec::with_capacity(point_times.len());
    for (index, time) in point_times.iter().enumerate() {
        let line = points.foreign.records.get(index).map_or(0, |record| record.line);
        let near: Vec<usize> = joint_times
            .iter()
            .enumerate()
            .filter(|(_, other)| (*other - time).abs() <= SAME_TIME)
            .map(|(joint, _)| joint)
            .collect();
        let nearest = near.iter().copied().min_by(|a, b| {
            let gap = |joint: &usize| joint_times.get(*joint).map_or(f64::INFINITY, |other| (other - time).abs());
            gap(a).total_cmp(&gap(b))
        });
        let Some(nearest) = nearest else {
            let message = format!(
                "no joints were read within {SAME_TIME} s of this point; do both files count time from the same moment?"
            );
            return Err(TableErrors::new(&points.file, vec![Defect::NotJoined(message).at(line)], Vec::new()));
        };
        let of = |joint: usize| configurations.get(joint).map_or(&[][..], Vec::as_slice);
        if near.iter().any(|joint| farthest_joint(of(nearest), of(*joint), expected.joints).is_some()) {
            let message =
                format!("the robot moved within {SAME_TIME} s of this point, so that its joints are not known");
            return Err(TableErrors::new(&points.file, vec![Defect::NotJoined(message).at(line)], Vec::new()));
        }
        pairs.push((nearest, index));
    }
    Ok(pairs)
}

/// The times of a file (s). Numbers as large as those of a clock in milli-, micro- or nanoseconds since 1970 are taken as such.
fn seconds(part: &Part, column: usize) -> Result<Vec<f64>, TableErrors> {
    let mut times = Vec::with_capacity(part.foreign.records.len());
    for (cell, record) in part.cells(column).into_iter().zip(&part.foreign.records) {
        let cell = cell.replacen(',', ".", 1);
        let clock = cell.parse::<jiff::Timestamp>().ok().map(|time| time.as_duration().as_secs_f64());
        let value = cell.parse::<f64>().ok().filter(|value| value.is_finite()).map(|value| match value.abs() {
            size if size >= 1e17 => value / 1e9,
            size if size >= 1e14 => value / 1e6,
            size if size >= 1e11 => value / 1e3,
            _ => value,
        });
        let Some(time) = clock.or(value) else {
            let defect =
                Defect::Lacking(format!("'{cell}' is no time; write seconds, or a date and time as in RFC 3339"));
            return Err(TableErrors::new(&part.file, vec![defect.at(record.line)], Vec::new()));
        };
        times.push(time);
    }
    Ok(times)
}

fn configurations(joints: &Part, expected: &Expected<'_>) -> Result<Vec<Vec<f64>>, TableErrors> {
    let mut columns = Vec::with_capacity(expected.joints.len());
    for joint in 1..=expected.joints.len() {
        let index = joints.quantity(&format!("q{joint}")).unwrap_or(usize::MAX);
        let unit =
            joints.foreign.canonical.get(index).and_then(|name| name.split_once('_')).map_or("", |(_, unit)| unit);
        columns.push(joints.numbers(NumberColumn::in_unit(index, unit))?);
    }
    let rows = joints.foreign.records.len();
    Ok((0..rows).map(|row| columns.iter().filter_map(|column| column.get(row).copied()).collect()).collect())
}
