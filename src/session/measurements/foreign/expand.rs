//! Names of poses and targets, several SMRs in one row, and readings without a point.

use std::collections::BTreeSet;

use super::{Study, Wanted, quoted_list};
use crate::session::measurements::names::Place;
use crate::session::table::{Defect, Record, TableProblem, is_number};
use crate::text::counted;

/// The number of a point in a row, and per coordinate its column, letter and unit with its underscore.
type Group = (usize, Vec<(usize, char, String)>);

/// Targets named in a message.
const SHOWN_TARGETS: usize = 5;

impl Study<'_> {
    /// Finds the columns with the names of pose and target.
    pub(super) fn name_pose_and_target(&mut self, problems: &mut Vec<TableProblem>) {
        self.shorten_point_names(problems);
        let of = |study: &Self, wanted: &Place| -> Vec<usize> {
            let free = study.canonical.iter().map(Option::is_none);
            let named = study.parsed.iter().map(|name| name.place().as_ref() == Some(wanted));
            named.zip(free).enumerate().filter(|(_, (named, free))| *named && *free).map(|(index, _)| index).collect()
        };
        if !self.has("pose") {
            let candidates = of(self, &Place::Pose);
            let own = candidates.iter().copied().find(|index| self.is_called(*index, "pose"));
            let unique: Vec<usize> = candidates.iter().copied().filter(|index| self.is_unique(*index)).collect();
            // Names that join two files may be repeated: whether that is right is seen there.
            let named = if self.wanted == Wanted::Rows { &unique } else { &candidates };
            let chosen = own.or(if let [only] = named.as_slice() { Some(*only) } else { None });
            match chosen {
                Some(index) => self.set(index, "pose"),
                None if !candidates.is_empty() => {
                    let names: Vec<String> =
                        candidates.iter().filter_map(|index| self.shown.get(*index).cloned()).collect();
                    self.note(format!("poses are numbered: {} names no row alone", quoted_list(&names)));
                }
                None => {}
            }
        }
        if !self.has("target") {
            let candidates = of(self, &Place::Target);
            match candidates.iter().copied().find(|index| self.is_called(*index, "target")) {
                Some(index) => self.set(index, "target"),
                None => {
                    if let [only] = candidates.as_slice() {
                        self.take_target(*only, problems);
                    }
                }
            }
        }
        if !self.has("temperature_degc") {
            for index in of(self, &Place::Temperature) {
                self.set(index, "temperature_degc");
            }
        }
        for index in of(self, &Place::Time) {
            self.set(index, "time");
        }
    }

    fn has(&self, name: &str) -> bool {
        self.canonical.iter().flatten().any(|known| known == name)
    }

    fn is_called(&self, index: usize, name: &str) -> bool {
        self.shown.get(index).is_some_and(|shown| shown.eq_ignore_ascii_case(name))
    }

    fn set(&mut self, index: usize, name: &str) {
        if let Some(slot) = self.canonical.get_mut(index)
            && slot.is_none()
        {
            *slot = Some(name.to_owned());
        }
    }

    fn cells(&self, index: usize) -> impl Iterator<Item = &str> {
        self.records.iter().filter_map(move |record| record.cells.get(index)).map(String::as_str)
    }

    fn is_unique(&self, index: usize) -> bool {
        let distinct: BTreeSet<&str> = self.cells(index).collect();
        distinct.len() == self.records.len() && !distinct.contains("")
    }

    /// Point names of SpatialAnalyzer, `Collection::Group::Point`: the point is the pose, the group a target where there are several.
    fn shorten_point_names(&mut self, problems: &mut Vec<TableProblem>) {
        let is_qualified =
            |study: &Self, index: usize| study.records.len() > 1 && study.cells(index).all(|cell| cell.contains("::"));
        let Some(index) = (0..self.shown.len()).find(|index| is_qualified(self, *index)) else { return };
        let groups: BTreeSet<String> =
            self.cells(index).filter_map(|cell| cell.rsplit_once("::")).map(|(group, _)| group.to_owned()).collect();
        let last = |group: &str| group.rsplit_once("::").map_or(group, |(_, last)| last).to_owned();
        let names: Vec<String> = groups.iter().map(|group| last(group)).collect();
        if groups.len() > 1 {
            let known = &self.expected.targets;
            if !known.is_empty() && !names.iter().all(|name| known.contains(name)) {
                let source_name = format!("the points are in {} ({})", counted(names.len(), "group"), shown(&names));
                problems.push(self.more_targets(source_name).at(self.line));
                return;
            }
            for record in &mut self.records {
                let group =
                    record.cells.get(index).and_then(|cell| cell.rsplit_once("::")).map(|(group, _)| last(group));
                record.cells.push(group.unwrap_or_default());
            }
            self.add_column("group", Some("target".to_owned()));
        }
        for record in &mut self.records {
            if let Some(cell) = record.cells.get_mut(index)
                && let Some((_, point)) = cell.rsplit_once("::")
            {
                *cell = point.to_owned();
            }
        }
        self.note("points are named 'collection::group::point'; the point is the pose".to_owned());
        self.set(index, "pose");
    }

    fn add_column(&mut self, name: &str, canonical: Option<String>) {
        self.shown.push(name.to_owned());
        self.parsed.push(super::Name::default());
        self.unit_row.push(None);
        self.canonical.push(canonical);
    }

    fn more_targets(&self, source_name: String) -> Defect {
        let known = format!("{} ({})", counted(self.expected.targets.len(), "target"), shown(&self.expected.targets));
        Defect::MoreTargets { source_name, known }
    }

    /// A column that names the SMR by the name of a target, or by its number in the profile.
    fn take_target(&mut self, index: usize, problems: &mut Vec<TableProblem>) {
        let distinct: BTreeSet<String> = self.cells(index).map(str::to_owned).collect();
        let known = self.expected.targets.clone();
        let name = self.shown.get(index).cloned().unwrap_or_default();
        if known.is_empty() || distinct.iter().all(|cell| known.contains(cell)) {
            self.set(index, "target");
            return;
        }
        if distinct.len() == 1 && known.len() == 1 {
            return;
        }
        let numbered: Option<Vec<usize>> =
            distinct.iter().map(|cell| cell.parse().ok().filter(|number| (1..=known.len()).contains(number))).collect();
        if numbered.is_none() {
            let cells: Vec<String> = distinct.into_iter().collect();
            let source_name = format!("column '{name}' names {} ({})", counted(cells.len(), "target"), shown(&cells));
            problems.push(self.more_targets(source_name).at(self.line));
            return;
        }
        for record in &mut self.records {
            if let Some(cell) = record.cells.get_mut(index)
                && let Some(target) = cell.parse::<usize>().ok().and_then(|number| known.get(number.checked_sub(1)?))
            {
                cell.clone_from(target);
            }
        }
        self.note(format!(
            "column '{name}' counts the targets of the profile: 1 is '{}'",
            known.first().map_or("", String::as_str)
        ));
        self.set(index, "target");
    }

    /// One record for each point of a row, without those that were not measured if they are to be left out.
    pub(super) fn expand(&mut self, problems: &mut Vec<TableProblem>) {
        // Before the rows change: the columns of the file are what a person wants to see.
        self.understood.columns = self.columns_read();
        let groups = self.groups();
        if groups.len() > 1 {
            self.split_groups(&groups, problems);
        } else if let Some((_, columns)) = groups.first() {
            for (index, letter, unit) in columns.clone() {
                if let Some(slot) = self.canonical.get_mut(index) {
                    *slot = Some(format!("{letter}{unit}"));
                }
            }
        }
        if self.reading.skip_missing {
            self.leave_out_missing();
        }
    }

    /// The numbered points of a row: number, and per coordinate the column, the letter and the unit with its underscore.
    fn groups(&self) -> Vec<Group> {
        let mut groups: std::collections::BTreeMap<usize, Vec<(usize, char, String)>> =
            std::collections::BTreeMap::new();
        for (index, name) in self.canonical.iter().enumerate() {
            let Some(name) = name else { continue };
            let (base, unit) =
                name.split_once('_').map_or((name.as_str(), String::new()), |(base, unit)| (base, format!("_{unit}")));
            let mut letters = base.chars();
            if let Some(letter @ ('x' | 'y' | 'z')) = letters.next()
                && let Ok(number) = letters.as_str().parse()
            {
                groups.entry(number).or_default().push((index, letter, unit));
            }
        }
        groups.into_iter().collect()
    }

    fn split_groups(&mut self, groups: &[Group], problems: &mut Vec<TableProblem>) {
        let known = &self.expected.targets;
        if !known.is_empty() && known.len() < groups.len() {
            let source_name = format!("every row has {}", counted(groups.len(), "point"));
            problems.push(self.more_targets(source_name).at(self.line));
            return;
        }
        let units: BTreeSet<&String> =
            groups.iter().flat_map(|(_, columns)| columns.iter().map(|(.., unit)| unit)).collect();
        if units.len() != 1 || groups.iter().any(|(_, columns)| columns.len() != 3) {
            problems.push(
                Defect::Lacking("every numbered point needs x, y and z in the same unit".to_owned()).at(self.line),
            );
            return;
        }
        let unit = units.into_iter().next().cloned().unwrap_or_default();
        let names: Vec<String> = groups
            .iter()
            .enumerate()
            .map(|(place, (number, _))| known.get(place).cloned().unwrap_or_else(|| number.to_string()))
            .collect();
        let used: BTreeSet<usize> =
            groups.iter().flat_map(|(_, columns)| columns.iter().map(|(index, ..)| *index)).collect();
        let numbered = !self.has("pose");
        let kept: Vec<usize> = (0..self.shown.len()).filter(|index| !used.contains(index)).collect();
        let mut records = Vec::with_capacity(self.records.len() * groups.len());
        for (row, record) in self.records.iter().enumerate() {
            for ((_, columns), name) in groups.iter().zip(&names) {
                let mut cells: Vec<String> =
                    kept.iter().filter_map(|index| record.cells.get(*index).cloned()).collect();
                cells.extend(numbered.then(|| row.to_string()));
                cells.push(name.clone());
                for letter in ['x', 'y', 'z'] {
                    let column = columns.iter().find(|(_, known, _)| *known == letter);
                    cells.push(column.and_then(|(index, ..)| record.cells.get(*index)).cloned().unwrap_or_default());
                }
                records.push(Record { line: record.line, cells });
            }
        }
        self.records = records;
        self.shown = kept.iter().filter_map(|index| self.shown.get(*index).cloned()).collect();
        self.canonical = kept.iter().filter_map(|index| self.canonical.get(*index).cloned()).collect();
        if numbered {
            self.shown.push("pose".to_owned());
            self.canonical.push(Some("pose".to_owned()));
        }
        self.shown.push("target".to_owned());
        self.canonical.push(Some("target".to_owned()));
        for letter in ["x", "y", "z"] {
            self.shown.push(letter.to_owned());
            self.canonical.push(Some(format!("{letter}{unit}")));
        }
        self.note(format!(
            "every row has {}, taken as targets {}",
            counted(groups.len(), "point"),
            quoted_list(&names)
        ));
    }

    fn leave_out_missing(&mut self) {
        let is_of_point = |name: &Option<String>| {
            name.as_ref().is_some_and(|name| {
                name.starts_with(['x', 'y', 'z']) && name.split('_').next().is_some_and(|base| base.len() == 1)
            })
        };
        let columns: Vec<usize> =
            self.canonical.iter().enumerate().filter(|(_, name)| is_of_point(name)).map(|(index, _)| index).collect();
        if columns.len() != 3 {
            return;
        }
        let mut lines = BTreeSet::new();
        self.records.retain(|record| {
            let cells: Vec<&str> =
                columns.iter().filter_map(|index| record.cells.get(*index)).map(String::as_str).collect();
            let is_missing = is_missing(&cells);
            if is_missing {
                lines.insert(record.line);
            }
            !is_missing
        });
        if !lines.is_empty() {
            let lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
            let noun = if lines.len() == 1 { "line" } else { "lines" };
            self.note(format!("left out, without a point: {noun} {}", shown_plain(&lines)));
        }
    }
}

/// Whether a tracker had no target: all coordinates are empty, not numbers, or zero.
fn is_missing(cells: &[&str]) -> bool {
    let is_empty = |cell: &&str| cell.is_empty() || cell.eq_ignore_ascii_case("nan") || *cell == "-";
    let is_zero = |cell: &&str| {
        is_number(cell) && cell.replacen(',', ".", 1).parse::<f64>().is_ok_and(|value| value.abs() <= 0.0)
    };
    cells.iter().all(is_empty) || cells.iter().all(is_zero)
}

/// The first names, in quotation marks.
fn shown(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().take(SHOWN_TARGETS).map(|name| format!("'{name}'")).collect();
    let more = if names.len() > SHOWN_TARGETS { ", …" } else { "" };
    format!("{}{more}", quoted.join(", "))
}

/// The first numbers of lines.
fn shown_plain(lines: &[String]) -> String {
    let first = lines.iter().take(4 * SHOWN_TARGETS).cloned().collect::<Vec<_>>().join(", ");
    let rest = lines.len().saturating_sub(4 * SHOWN_TARGETS);
    if rest == 0 { first } else { format!("{first} and {rest} more") }
}
