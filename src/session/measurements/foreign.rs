//! What the columns of a table of others mean: under which names, in which units, and whether they are there at all.
//!
//! Nothing is guessed. Where names or units leave a choice, the table is refused with a proposal that a person can confirm.

mod expand;
mod proposal;

use std::collections::{BTreeMap, BTreeSet};

use super::columns::{Columns, Source, Units, other_unit};
use super::names::{self, Name, Place};
use crate::identification::rigid::{CORNERS, Tetrahedron};
use crate::kinematics::JointType;
use crate::profile::{Profile, Target};
use crate::session::orientation;
use crate::session::table::{Defect, Measure, Record, Table, TableProblem, is_number};
use crate::text::{counted, listed};

/// What a table must fit: the joints and targets of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Expected<'a> {
    /// Types of the joints.
    pub joints: &'a [JointType],
    /// The names of each joint; none if they are not known.
    pub names: Vec<Vec<String>>,
    /// Names of the targets; none if they are not known.
    pub targets: Vec<String>,
    /// Bodies whose corners are targets, by their names.
    pub bodies: BTreeMap<String, Tetrahedron>,
}

impl<'a> Expected<'a> {
    /// Joints of which nothing but the type is known.
    pub fn joints(joints: &'a [JointType]) -> Self {
        Self { joints, names: Vec::new(), targets: Vec::new(), bodies: BTreeMap::new() }
    }

    /// The robot of a profile, whose joint types are `joints`.
    pub fn of(profile: &Profile, joints: &'a [JointType]) -> Self {
        let names = profile.chain().joints().iter().enumerate().map(|(index, joint)| {
            let aliases = profile.joint_aliases().get(index).into_iter().flatten();
            std::iter::once(&joint.name).chain(aliases).cloned().collect()
        });
        let targets = profile.targets().iter().map(|target| target.name.clone()).collect();
        let place = |name: &str| {
            let target = profile.targets().iter().find(|target| target.name == name)?;
            Some(target.position_in_flange)
        };
        let body = |target: &Target| {
            let name = target.name.strip_suffix(".a")?;
            let [a, b, c, d] = CORNERS.map(|(letter, _)| place(&format!("{name}.{letter}")));
            Some((name.to_owned(), Tetrahedron::of_points(&[a?, b?, c?, d?])?))
        };
        let bodies = profile.targets().iter().filter_map(body).collect();
        Self { joints, names: names.collect(), targets, bodies }
    }

    /// The target of rows that name none.
    pub(super) fn usual_target(&self) -> Option<&str> {
        let first = self.targets.first()?;
        let body = first.strip_suffix(".a").filter(|name| self.bodies.contains_key(*name));
        Some(body.unwrap_or(first))
    }
}

/// What a person says about a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Which column is which.
    pub columns: Option<Columns>,
    /// Units of columns whose names state none.
    pub units: Units,
    /// Leave out readings without a point instead of refusing the table.
    pub skip_missing: bool,
    /// Standard deviation of each coordinate (m) where a row with an orientation states none.
    pub sigma: Option<f64>,
    /// Standard deviation of the orientation about each axis (rad) where the row states none.
    pub sigma_rotation: Option<f64>,
}

/// What was understood of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Understood {
    /// What separates the cells, in words.
    pub separator: &'static str,
    /// The columns of the file, in order.
    pub columns: Vec<ColumnRead>,
    /// What else was noticed, one sentence each.
    pub notes: Vec<String>,
    /// How orientations beside the points are used, or why they are not.
    pub orientation: Option<String>,
    /// Whether there are orientations that cannot be used, because their error is not stated.
    pub lacks_orientation_error: bool,
    /// A list of columns that may be what is meant, to be confirmed.
    pub proposal: Option<String>,
}

/// A column of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColumnRead {
    /// Its name in the file; none if it has none.
    pub name: String,
    /// What it is read as; none if it is kept as text.
    pub read_as: Option<String>,
    /// Its first cell.
    pub example: String,
}

/// What a file should contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Joints and points.
    Rows,
    Joints,
    Points,
}

/// A table with the names that trupose gives its columns.
#[derive(Debug)]
pub(super) struct Foreign {
    /// 1-based line of the names.
    pub(super) line: usize,
    /// Names in the file, for messages.
    pub(super) shown: Vec<String>,
    /// Names of a table of trupose; those of other columns as in the file.
    pub(super) canonical: Vec<String>,
    pub(super) records: Vec<Record>,
    pub(super) decimal_comma: bool,
    pub(super) understood: Understood,
}

/// A column of a point: its place, the axis, and the number of the point in the row.
type PointColumn = (usize, usize, Option<usize>);

/// The words beside the letters of coordinates that belong together, and the number of their point.
type PointSet = (String, Option<usize>);

/// A table while its columns are found out.
struct Study<'a> {
    expected: &'a Expected<'a>,
    reading: &'a Reading,
    wanted: Wanted,
    line: usize,
    shown: Vec<String>,
    parsed: Vec<Name>,
    records: Vec<Record>,
    /// Units below the names.
    unit_row: Vec<Option<&'static str>>,
    /// Units that a comment states.
    commented: Units,
    /// The name that each column gets, if it is known.
    canonical: Vec<Option<String>>,
    understood: Understood,
}

/// Finds out what the columns of `table` mean.
///
/// # Errors
/// Reported in `problems`; what was understood up to there.
pub(super) fn understand(
    table: Table,
    expected: &Expected<'_>,
    reading: &Reading,
    wanted: Wanted,
    problems: &mut Vec<TableProblem>,
) -> Result<Foreign, Understood> {
    let understood = Understood { separator: table.separator.name(), ..Understood::default() };
    let Some(header) = table.header else {
        problems.push(Defect::NoRows.of_table());
        return Err(understood);
    };
    let mut study = Study {
        expected,
        reading,
        wanted,
        line: header.line,
        shown: Vec::new(),
        parsed: Vec::new(),
        records: table.records,
        unit_row: Vec::new(),
        commented: commented_units(&table.comments),
        canonical: Vec::new(),
        understood,
    };
    if !study.take_header(header, table.heading, wanted, problems) {
        return Err(study.finished_columns());
    }
    study.drop_repeated_headers();
    study.take_unit_row(problems);
    let before = problems.len();
    match &reading.columns {
        Some(columns) => study.map(columns, problems),
        None => study.find(wanted, problems),
    }
    study.name_pose_and_target(problems);
    study.note_tools(problems);
    if problems.len() > before {
        study.propose(wanted);
        return Err(study.finished_columns());
    }
    if study.lacks_units(wanted) {
        study.propose(wanted);
    }
    study.expand(problems);
    if problems.len() > before {
        return Err(study.finished_columns());
    }
    let canonical = study.final_names();
    let understood = study.finished_columns();
    Ok(Foreign {
        line: study.line,
        shown: study.shown,
        canonical,
        records: study.records,
        decimal_comma: table.decimal_comma,
        understood,
    })
}

/// The units that comments such as `// Units: Millimeters` state.
fn commented_units(comments: &[String]) -> Units {
    let states = |comment: &&String| {
        let lower = comment.to_lowercase();
        ["unit", "einheit", "unité", "单位", "単位"].iter().any(|word| lower.contains(word))
    };
    let stated: Vec<&str> = comments.iter().filter(states).map(String::as_str).collect();
    Units::in_text(&stated.join(" ")).unwrap_or_default()
}

/// Whether a line holds numbers, not names.
fn is_of_numbers(cells: &[String]) -> bool {
    let numbers = cells.iter().filter(|cell| is_number(cell)).count();
    (numbers * 2 > cells.len() && numbers > 2) || (numbers == cells.len() && numbers > 0)
}

impl Study<'_> {
    /// Takes the names from the header, a comment above it or the list of columns. `false`, reported, if there are none.
    fn take_header(
        &mut self,
        header: Record,
        heading: Option<Record>,
        wanted: Wanted,
        problems: &mut Vec<TableProblem>,
    ) -> bool {
        let width = header.cells.len();
        let listed = self.reading.columns.as_ref().and_then(|columns| columns.listed);
        let names = if !is_of_numbers(&header.cells) && (wanted != Wanted::Points || !is_point_row(&header.cells)) {
            header.cells
        } else {
            let in_comment = heading.filter(|heading| {
                heading.cells.len() == width && heading.cells.iter().all(|cell| !cell.is_empty() && !is_number(cell))
            });
            let places = self.reading.columns.is_some();
            let headerless = self.headerless_names(&header.cells, wanted);
            let line = header.line;
            let cells = header.cells.len();
            self.records.insert(0, header);
            match (in_comment, headerless) {
                (Some(heading), _) if listed.is_none() => {
                    self.note(format!("the names of the columns are those of the comment on line {}", heading.line));
                    heading.cells
                }
                (_, Some(names)) if !places => {
                    self.note("there are no names of columns; this is the only way to read them".to_owned());
                    names
                }
                _ if places => vec![String::new(); width],
                _ => {
                    problems.push(self.without_names(cells, wanted).at(line));
                    self.shown = (1..=width).map(|place| format!("column{place}")).collect();
                    self.canonical = vec![None; width];
                    self.parsed = vec![Name::default(); width];
                    self.propose_by_place();
                    return false;
                }
            }
        };
        if let Some(count) = listed.filter(|count| *count != names.len()) {
            let message = format!("{} are listed, but the table has {}", counted(count, "column"), names.len());
            problems.push(Defect::Lacking(message).at(self.line));
            self.shown = names;
            return false;
        }
        let named = |(index, name): (usize, &String)| {
            if name.is_empty() { format!("column{}", index + 1) } else { name.clone() }
        };
        let is_german = names::is_german(names.iter().map(String::as_str));
        self.shown = names.iter().enumerate().map(named).collect();
        self.parsed = self.shown.iter().map(|name| Name::new(name, is_german)).collect();
        self.canonical = vec![None; self.shown.len()];
        self.unit_row = vec![None; self.shown.len()];
        true
    }

    /// Why a table without names cannot be read.
    fn without_names(&self, cells: usize, wanted: Wanted) -> Defect {
        let row = self.records.first().map(|record| record.cells.as_slice()).unwrap_or_default();
        let numbers = row.iter().filter(|cell| is_number(cell)).count();
        if wanted == Wanted::Rows && is_point_row(row) && numbers < row.len() {
            return Defect::Lacking(
                "these are points without joint values; give the table of the joint values as well, to join them"
                    .to_owned(),
            );
        }
        Defect::NoHeader { cells }
    }

    /// The names of a table without any, if they can be nothing else: joints alone, or points alone.
    fn headerless_names(&self, cells: &[String], wanted: Wanted) -> Option<Vec<String>> {
        let texts = cells.iter().take_while(|cell| !is_number(cell)).count();
        let numbers = cells.len() - texts;
        let mut names: Vec<String> = (1..=texts).map(|place| format!("column{place}")).collect();
        if let Some(last) = names.last_mut() {
            "pose".clone_into(last);
        }
        match wanted {
            Wanted::Joints if numbers == self.expected.joints.len() => {
                names.extend((1..=numbers).map(|joint| format!("q{joint}")));
            }
            Wanted::Points if numbers == 3 => names.extend(["x", "y", "z"].map(str::to_owned)),
            Wanted::Rows | Wanted::Joints | Wanted::Points => return None,
        }
        Some(names)
    }

    /// Leaves out lines that repeat the names: files that were put one behind the other.
    fn drop_repeated_headers(&mut self) {
        let before = self.records.len();
        let shown = &self.shown;
        self.records.retain(|record| record.cells != *shown);
        let dropped = before - self.records.len();
        if dropped > 0 {
            self.note(format!("{} the names of the columns and left out", counted_as_repeats(dropped)));
        }
    }

    /// Takes the units from a row below the names. Such rows may be repeated with the names.
    fn take_unit_row(&mut self, problems: &mut Vec<TableProblem>) {
        let is_german = names::is_german(self.shown.iter().map(String::as_str));
        let unit = |cell: &String| {
            let inner = cell.trim_matches(|c| matches!(c, '[' | ']' | '(' | ')'));
            names::unit(&inner.to_lowercase(), is_german)
        };
        let is_of_units = |record: &Record| {
            let words = record.cells.iter().filter(|cell| !cell.is_empty() && *cell != "-").count();
            words > 1
                && record.cells.iter().filter(|cell| unit(cell).is_some()).count() * 2 > words
                && !record.cells.iter().any(|cell| is_number(cell))
        };
        let Some(first) = self.records.first().filter(|record| is_of_units(record)).cloned() else { return };
        self.unit_row = first.cells.iter().map(unit).collect();
        for (index, (stated, below)) in self.parsed.iter().zip(&self.unit_row).enumerate() {
            if let (Some(stated), Some(below)) = (stated.unit, below)
                && stated != *below
            {
                let shown = self.shown.get(index).map_or("", String::as_str);
                let defect =
                    Defect::OtherUnit { stated: stated.to_owned(), against: format!("the row below it '{below}'") };
                problems.push(defect.at_cell(first.line, shown));
            }
        }
        self.records.retain(|record| record.cells != first.cells);
        self.note(format!("line {} gives the units", first.line));
    }

    fn note(&mut self, note: String) {
        self.understood.notes.push(note);
    }

    /// The unit that the file or a person states for a column with this measure.
    fn unit_of(&self, index: usize, measure: Measure) -> Option<String> {
        let name = self.parsed.get(index)?;
        if let Some(unknown) = &name.unknown_unit {
            return Some(unknown.clone());
        }
        let stated = name.unit.or_else(|| self.unit_row.get(index).copied().flatten());
        let general = |units: Units| match measure {
            Measure::Angle => units.angle,
            Measure::Length => units.length,
            Measure::Temperature => None,
        };
        stated.or_else(|| general(self.reading.units)).or_else(|| general(self.commented)).map(str::to_owned)
    }

    fn call(&mut self, index: usize, base: &str, measure: Measure) {
        let unit = self.unit_of(index, measure).map_or_else(String::new, |unit| format!("_{unit}"));
        if let Some(name) = self.canonical.get_mut(index) {
            *name = Some(format!("{base}{unit}"));
        }
    }

    /// Takes the columns that a person names.
    fn map(&mut self, columns: &Columns, problems: &mut Vec<TableProblem>) {
        for (name, source) in &columns.mapped {
            let Some(index) = self.find_source(source) else {
                let (name, known) = match source {
                    Source::Named(name) => (name.clone(), self.shown.join(", ")),
                    Source::Place(place) => (format!("#{place}"), counted(self.shown.len(), "column")),
                };
                problems.push(Defect::NoSuchColumn { name, known }.at(self.line));
                continue;
            };
            let stated = self.parsed.get(index).and_then(|parsed| other_unit(parsed, name));
            let below = self.unit_row.get(index).copied().flatten();
            let below = below.filter(|below| !name.ends_with(&format!("_{below}")) && name.contains('_'));
            if let Some(stated) = stated.or(below) {
                let shown = self.shown.get(index).map_or("", String::as_str);
                let defect = Defect::OtherUnit { stated: stated.to_owned(), against: format!("'{name}' is asked for") };
                problems.push(defect.at_cell(self.line, shown));
            }
            if let Some(slot) = self.canonical.get_mut(index) {
                *slot = Some(name.clone());
            }
        }
    }

    fn find_source(&self, source: &Source) -> Option<usize> {
        match source {
            Source::Place(place) => place.checked_sub(1).filter(|index| *index < self.shown.len()),
            Source::Named(name) => {
                let wanted = Name::new(name, false);
                let exactly = self.shown.iter().position(|shown| shown.eq_ignore_ascii_case(name));
                let alike = || {
                    let mut alike = self.parsed.iter().enumerate().filter(|(_, parsed)| parsed.is(&wanted));
                    alike.next().filter(|_| alike.next().is_none()).map(|(index, _)| index)
                };
                exactly.or_else(alike)
            }
        }
    }

    /// Finds joints and points by the names of the columns.
    fn find(&mut self, wanted: Wanted, problems: &mut Vec<TableProblem>) {
        let (joints, joint_sets) = self.joints();
        if joint_sets.len() > 1 && wanted != Wanted::Points {
            problems.push(Defect::SeveralJointSets { sets: joint_sets }.at(self.line));
        }
        for (index, joint) in joints {
            let measure = joint.checked_sub(1).and_then(|place| self.expected.joints.get(place));
            let measure = measure.map_or(Measure::Angle, |joint| Measure::of_joint(*joint));
            self.call(index, &format!("q{joint}"), measure);
        }
        if wanted == Wanted::Joints {
            return;
        }
        let (points, point_sets) = self.points();
        if point_sets.len() > 1 {
            problems.push(Defect::SeveralPoints { sets: point_sets }.at(self.line));
        }
        for (index, axis, group) in points {
            let letter = ["x", "y", "z"].get(axis).copied().unwrap_or_default();
            let base = group.map_or_else(|| letter.to_owned(), |group| format!("{letter}{group}"));
            self.call(index, &base, Measure::Length);
        }
    }

    /// The columns of the joints with their numbers from 1, and the sets that they could be if there are several.
    fn joints(&self) -> (Vec<(usize, usize)>, Vec<String>) {
        let count = self.expected.joints.len();
        if let Some(named) = self.joints_of_profile() {
            return (named, Vec::new());
        }
        let mut sets: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
        let places: Vec<Option<Place>> = self.parsed.iter().map(Name::place).collect();
        for (index, place) in places.iter().enumerate() {
            if let Some(Place::Joint { set, number }) = place {
                sets.entry(set).or_default().push((index, *number));
            }
        }
        let complete = |columns: &Vec<(usize, usize)>| {
            let mut numbers: Vec<usize> = columns.iter().map(|(_, number)| *number).collect();
            numbers.sort_unstable();
            numbers == (1..=count).collect::<Vec<_>>() || numbers == (0..count).collect::<Vec<_>>()
        };
        let from_one = |columns: &Vec<(usize, usize)>| {
            let shift = usize::from(columns.iter().any(|(_, number)| *number == 0));
            columns.iter().map(|(index, number)| (*index, number + shift)).collect::<Vec<_>>()
        };
        let full: Vec<&Vec<(usize, usize)>> = sets.values().filter(|columns| complete(columns)).collect();
        let own = sets.get("q").filter(|columns| {
            let has_unit =
                |(index, _): &(usize, usize)| self.parsed.get(*index).is_some_and(|name| name.unit.is_some());
            complete(columns) && columns.iter().all(has_unit)
        });
        if let Some(own) = own {
            return (from_one(own), Vec::new());
        }
        match full.as_slice() {
            [only] => (from_one(only), Vec::new()),
            [] => match (sets.get("q"), sets.len()) {
                (Some(own), _) => (own.clone(), Vec::new()),
                // Too many or too few of `J1`, `J2`: shown as they are. Of `wrist_1_joint` to `wrist_3_joint` nothing is known.
                (None, 1) => {
                    let only = sets.iter().next().filter(|(set, _)| names::is_plain_joint(set));
                    (only.map(|(_, columns)| columns.clone()).unwrap_or_default(), Vec::new())
                }
                (None, _) => (Vec::new(), Vec::new()),
            },
            [first, ..] => (from_one(first), full.iter().map(|columns| self.range_of(columns)).collect()),
        }
    }

    /// `J1 … J6`.
    fn range_of(&self, columns: &[(usize, usize)]) -> String {
        let name = |column: Option<&(usize, usize)>| {
            column.and_then(|(index, _)| self.shown.get(*index)).map_or("", String::as_str)
        };
        format!("{} … {}", name(columns.first()), name(columns.last()))
    }

    /// The columns that have the names of the profile's joints, if all of them are there.
    fn joints_of_profile(&self) -> Option<Vec<(usize, usize)>> {
        let known = &self.expected.names;
        if known.is_empty() {
            return None;
        }
        let mut columns = Vec::with_capacity(known.len());
        for (joint, names) in known.iter().enumerate() {
            let names: Vec<Name> = names.iter().map(|name| Name::new(name, false)).collect();
            let mut found =
                self.parsed.iter().enumerate().filter(|(_, parsed)| names.iter().any(|name| name.is(parsed)));
            let (index, _) = found.next()?;
            if found.next().is_some() {
                return None;
            }
            columns.push((index, joint + 1));
        }
        Some(columns)
    }

    /// The columns of the points with axis and group, and the sets that they could be if there are several.
    fn points(&self) -> (Vec<PointColumn>, Vec<String>) {
        let mut sets: BTreeMap<PointSet, Vec<(usize, usize)>> = BTreeMap::new();
        for (index, name) in self.parsed.iter().enumerate() {
            if let Some(Place::Coordinate { set, axis, group }) = name.place() {
                sets.entry((set, group)).or_default().push((index, axis));
            }
        }
        let complete = |columns: &Vec<(usize, usize)>| {
            columns.len() == 3 && (0..3).all(|axis| columns.iter().any(|(_, known)| *known == axis))
        };
        let full: Vec<_> = sets.iter().filter(|(_, columns)| complete(columns)).collect();
        let taken = |(set, columns): &(&PointSet, &Vec<(usize, usize)>), group: bool| {
            let group = set.1.filter(|_| group);
            columns.iter().map(|(index, axis)| (*index, *axis, group)).collect::<Vec<_>>()
        };
        let one_family =
            full.iter().all(|(set, _)| set.1.is_some() && full.first().is_some_and(|(first, _)| first.0 == set.0));
        match full.as_slice() {
            [] => {
                let plain = sets.iter().filter(|(set, _)| set.0.is_empty() && set.1.is_none());
                (
                    plain.flat_map(|(_, columns)| columns.iter().map(|(index, axis)| (*index, *axis, None))).collect(),
                    Vec::new(),
                )
            }
            [only] => (taken(only, false), Vec::new()),
            several if one_family => (several.iter().flat_map(|set| taken(set, true)).collect(), Vec::new()),
            [first, ..] => (taken(first, false), full.iter().map(|(_, columns)| self.range_of(columns)).collect()),
        }
    }

    /// Refuses columns of a tool centre that changes: rows of different targets must not be mixed.
    fn note_tools(&self, problems: &mut Vec<TableProblem>) {
        let is_of_tool = |index: &usize| {
            let is_free = self.canonical.get(*index).is_some_and(Option::is_none);
            let first = self.records.first().and_then(|record| record.cells.get(*index));
            is_free
                && self.parsed.get(*index).is_some_and(Name::is_of_tool)
                && first.is_some_and(|cell| is_number(cell))
        };
        let of_tool: Vec<usize> = (0..self.shown.len()).filter(is_of_tool).collect();
        let place = |record: &Record| -> Vec<String> {
            of_tool.iter().filter_map(|index| record.cells.get(*index).cloned()).collect()
        };
        let places: BTreeSet<Vec<String>> = self.records.iter().map(place).collect();
        // The tool centre in the frame of the robot moves with the arm: only a place on the flange repeats itself.
        let repeats = places.len() > 1 && places.len() * 2 <= self.records.len();
        let has_target = self.canonical.iter().flatten().any(|name| name == "target");
        if repeats && !has_target {
            let columns = of_tool.iter().filter_map(|index| self.shown.get(*index).cloned()).collect();
            problems.push(Defect::VaryingTool { columns }.at(self.line));
        }
    }

    /// Whether a joint or a coordinate has no unit, or is missing.
    fn lacks_units(&self, wanted: Wanted) -> bool {
        let names: Vec<&str> = self.canonical.iter().flatten().map(String::as_str).collect();
        let is_joint = |name: &&&str| name.starts_with('q');
        let is_point = |name: &&&str| name.starts_with(['x', 'y', 'z']);
        let without = names.iter().any(|name| !name.contains('_') && (is_joint(&name) || is_point(&name)));
        let joints = names.iter().filter(is_joint).count();
        let points = names.iter().filter(is_point).count();
        without
            || (wanted != Wanted::Points && joints != self.expected.joints.len())
            || (wanted != Wanted::Joints && points < 3)
    }

    /// The final name of every column: that of others as in the file, unless it would be taken for one of ours.
    fn final_names(&self) -> Vec<String> {
        let takes_q = self.canonical.iter().flatten().any(|name| is_numbered_q(name));
        let takes_orientation = self.reading.sigma_rotation.is_some()
            || self.shown.iter().any(|name| name.to_lowercase().starts_with("sigma_rot"));
        let is_taken = |lower: &String| self.canonical.iter().flatten().any(|name| name == lower);
        let name = |(index, (canonical, shown)): (usize, (&Option<String>, &String))| {
            let lower = shown.to_lowercase();
            match canonical {
                Some(name) => name.clone(),
                None if is_taken(&lower)
                    || (takes_q && is_numbered_q(&lower))
                    || (self.reading.columns.is_some() && is_ours(&lower)) =>
                {
                    format!("column {}", index + 1)
                }
                None if takes_orientation => as_orientation(&lower).unwrap_or_else(|| shown.clone()),
                None => shown.clone(),
            }
        };
        self.canonical.iter().zip(&self.shown).enumerate().map(name).collect()
    }

    /// What was understood of the columns of the file.
    fn finished_columns(&mut self) -> Understood {
        let mut understood = std::mem::take(&mut self.understood);
        if understood.columns.is_empty() {
            understood.columns = self.columns_read();
        }
        understood
    }

    fn columns_read(&self) -> Vec<ColumnRead> {
        let first = self.records.first();
        let column = |(index, name): (usize, &String)| ColumnRead {
            name: name.clone(),
            read_as: self.canonical.get(index).cloned().flatten(),
            example: first.and_then(|record| record.cells.get(index)).cloned().unwrap_or_default(),
        };
        self.shown.iter().enumerate().map(column).collect()
    }
}

/// Whether a line is a point with its name, as `Coll::Group::P1, 1.0, 2.0, 3.0`.
fn is_point_row(cells: &[String]) -> bool {
    let texts = cells.iter().take_while(|cell| !is_number(cell)).count();
    cells.len() == texts + 3 && cells.iter().skip(texts).all(|cell| is_number(cell))
}

fn is_numbered_q(name: &str) -> bool {
    let base = name.split_once('_').map_or(name, |(base, _)| base);
    base.strip_prefix('q').is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Whether a table of trupose would read a column of this name.
fn is_ours(lower: &str) -> bool {
    let base = lower.split_once('_').map_or(lower, |(base, _)| base);
    is_numbered_q(lower)
        || ["x", "y", "z", "sigma", "temperature"].contains(&base)
        || lower == "target"
        || lower == "pose"
}

/// The name of a column of an orientation with its unit in brackets, as `A [deg]`, in the way of trupose.
pub(super) fn as_orientation(lower: &str) -> Option<String> {
    let parts = lower.split(|c: char| c.is_whitespace() || "[]()_".contains(c)).filter(|part| !part.is_empty());
    let name = parts.map(|part| if part == "°" { "deg" } else { part }).collect::<Vec<_>>().join("_");
    orientation::is_column(&name).then_some(name)
}

fn counted_as_repeats(count: usize) -> String {
    if count == 1 { "1 line repeats".to_owned() } else { format!("{count} lines repeat") }
}

/// `'a', 'b' and 'c'`.
fn quoted_list(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
    listed(&quoted)
}
