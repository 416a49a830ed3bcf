//! A list of columns that may be what is meant, for a person to confirm: units by the size of the numbers, joints by their order.

use super::{Study, Wanted};
use crate::kinematics::JointType;
use crate::session::measurements::columns::{Columns, Source};
use crate::session::table::is_number;

/// Angles beyond this are no radians.
const LARGEST_RADIAN: f64 = 7.0;
/// Coordinates beyond this are no metres.
const LARGEST_METRE: f64 = 20.0;
/// Rows whose numbers are looked at.
const LOOKED_AT: usize = 200;
/// Words in names of columns with readings of encoders.
const COUNTS: &[&str] =
    &["pulse", "pulses", "count", "counts", "cnt", "tick", "ticks", "inc", "increment", "increments", "step", "steps"];

impl Study<'_> {
    /// Proposes what the columns with names may be.
    pub(super) fn propose(&mut self, wanted: Wanted) {
        let joints = self.proposed_joints();
        let points = self.proposed_points(joints.as_deref());
        let mut mapped = Vec::new();
        if let Some(pose) = self.canonical.iter().position(|name| name.as_deref() == Some("pose")) {
            mapped.push(("pose".to_owned(), self.source(pose)));
        }
        if wanted != Wanted::Points {
            let Some(joints) = joints else { return };
            if joints.iter().any(|column| self.has_other_unit(*column)) {
                return;
            }
            for (index, (column, joint)) in joints.into_iter().zip(self.expected.joints).enumerate() {
                let unit = self.stated(column).unwrap_or_else(|| self.guessed_unit(&[column], *joint));
                mapped.push((format!("q{}_{unit}", index + 1), self.source(column)));
            }
            agree_on_angles(&mut mapped);
        }
        if wanted != Wanted::Joints {
            let Some(points) = points else { return };
            let columns: Vec<usize> = points.iter().map(|(_, column)| *column).collect();
            for (base, column) in points {
                let unit = self.stated(column).unwrap_or_else(|| self.guessed_length(&columns));
                mapped.push((format!("{base}_{unit}"), self.source(column)));
            }
        }
        self.understood.proposal = Some(Columns { mapped, listed: None }.to_string());
    }

    /// Proposes what the columns of a table without names may be: joints and then points, as most programs write them.
    pub(super) fn propose_by_place(&mut self) {
        let (joints, width) = (self.expected.joints.len(), self.shown.len());
        let is_number_column = |index: usize| self.is_of_numbers(index);
        let texts = (0..width).take_while(|index| !is_number_column(*index)).count();
        let beside_joints = width.saturating_sub(joints);
        let names = usize::from(texts == 1 || (texts == 0 && beside_joints % 3 == 1 && self.counts_up(0)));
        let points = width.saturating_sub(joints + names);
        if texts > 1 || points == 0 || points % 3 != 0 || !(names..width).all(is_number_column) {
            return;
        }
        let mut list: Vec<String> = if names == 1 { vec!["pose".to_owned()] } else { Vec::new() };
        let columns: Vec<usize> = (names..names + joints).collect();
        for (index, joint) in self.expected.joints.iter().enumerate() {
            let same: Vec<usize> = columns
                .iter()
                .zip(self.expected.joints)
                .filter(|(_, other)| *other == joint)
                .map(|(column, _)| *column)
                .collect();
            list.push(format!("q{}_{}", index + 1, self.guessed_unit(&same, *joint)));
        }
        let columns: Vec<usize> = (names + joints..width).collect();
        let unit = self.guessed_length(&columns);
        for group in 1..=points / 3 {
            let number = if points == 3 { String::new() } else { group.to_string() };
            list.extend(["x", "y", "z"].map(|letter| format!("{letter}{number}_{unit}")));
        }
        self.understood.proposal = Some(list.join(","));
    }

    /// The columns that are known to be the joints, or may be them in their order.
    fn proposed_joints(&self) -> Option<Vec<usize>> {
        let count = self.expected.joints.len();
        let known: Option<Vec<usize>> = (1..=count)
            .map(|joint| {
                let base = format!("q{joint}");
                let is = |name: &String| name.split('_').next() == Some(&base);
                self.canonical.iter().position(|name| name.as_ref().is_some_and(is))
            })
            .collect();
        let free: Vec<usize> =
            (0..self.shown.len()).filter(|index| self.is_free(*index) && self.is_of_numbers(*index)).collect();
        let speaks_of_joints = |index: &&usize| {
            let name = self.shown.get(**index).map(|name| name.to_lowercase()).unwrap_or_default();
            ["joint", "position", "axis", "shoulder", "elbow", "wrist"].iter().any(|word| name.contains(word))
        };
        let named: Vec<usize> = free.iter().filter(speaks_of_joints).copied().collect();
        known.or_else(|| (named.len() == count).then_some(named)).or_else(|| (free.len() == count).then_some(free))
    }

    /// The columns that are known to be the points, or may be them.
    fn proposed_points(&self, joints: Option<&[usize]>) -> Option<Vec<(String, usize)>> {
        let is_point = |name: &str| {
            let base = name.split('_').next().unwrap_or_default();
            let mut letters = base.chars();
            matches!(letters.next(), Some('x' | 'y' | 'z')) && letters.all(|c| c.is_ascii_digit())
        };
        let known: Vec<(String, usize)> = self
            .canonical
            .iter()
            .enumerate()
            .filter_map(|(index, name)| {
                let name = name.as_ref().filter(|name| is_point(name))?;
                Some((name.split('_').next().unwrap_or_default().to_owned(), index))
            })
            .collect();
        if known.len() >= 3 {
            return Some(known);
        }
        let taken = joints.unwrap_or_default();
        let free: Vec<usize> = (0..self.shown.len())
            .filter(|index| !taken.contains(index) && self.is_free(*index) && self.is_of_numbers(*index))
            .collect();
        (free.len() == 3).then(|| ["x", "y", "z"].map(str::to_owned).into_iter().zip(free).collect())
    }

    fn is_free(&self, index: usize) -> bool {
        self.canonical.get(index).is_some_and(Option::is_none)
    }

    fn is_of_numbers(&self, index: usize) -> bool {
        let mut cells = self.records.iter().take(LOOKED_AT).filter_map(|record| record.cells.get(index)).peekable();
        cells.peek().is_some() && cells.all(|cell| is_number(cell))
    }

    /// Whether a column counts its rows: 0, 1, 2 or 1, 2, 3.
    fn counts_up(&self, index: usize) -> bool {
        let numbers: Option<Vec<usize>> =
            self.records.iter().map(|record| record.cells.get(index).and_then(|cell| cell.parse().ok())).collect();
        numbers.is_some_and(|numbers| {
            numbers.len() > 1
                && numbers.windows(2).all(|pair| pair.first().map(|first| first + 1) == pair.last().copied())
        })
    }

    /// The unit that the file states for a column.
    fn stated(&self, index: usize) -> Option<&'static str> {
        let name = self.parsed.get(index)?;
        name.unit.or_else(|| self.unit_row.get(index).copied().flatten())
    }

    /// Whether the name of a column states a unit that joints cannot have: its numbers must not be taken for angles.
    fn has_other_unit(&self, index: usize) -> bool {
        if self.stated(index).is_some() {
            return false;
        }
        let name = self.shown.get(index).map(|name| name.to_lowercase()).unwrap_or_default();
        let counts = name.split(|c: char| !c.is_alphanumeric()).any(|word| COUNTS.contains(&word));
        let of_our_names = name.split_once('_').filter(|(base, unit)| {
            base.strip_prefix('q').is_some_and(|number| number.parse::<usize>().is_ok()) && !unit.is_empty()
        });
        counts || of_our_names.is_some()
    }

    fn source(&self, index: usize) -> Source {
        match self.shown.get(index) {
            Some(name) if *name != format!("column{}", index + 1) => Source::Named(name.clone()),
            _ => Source::Place(index + 1),
        }
    }

    fn largest(&self, columns: &[usize]) -> f64 {
        let records = self.records.iter().take(LOOKED_AT);
        let cells = records.flat_map(|record| columns.iter().filter_map(|index| record.cells.get(*index)));
        let values = cells.filter_map(|cell| cell.replacen(',', ".", 1).parse::<f64>().ok());
        values.map(f64::abs).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }

    fn guessed_unit(&self, columns: &[usize], joint: JointType) -> &'static str {
        match joint {
            JointType::Revolute if self.largest(columns) > LARGEST_RADIAN => "deg",
            JointType::Revolute => "rad",
            JointType::Prismatic => self.guessed_length(columns),
        }
    }

    fn guessed_length(&self, columns: &[usize]) -> &'static str {
        if self.largest(columns) > LARGEST_METRE { "mm" } else { "m" }
    }
}

/// A joint that hardly moves looks like radians: all turning joints without a stated unit share one.
fn agree_on_angles(mapped: &mut [(String, Source)]) {
    if mapped.iter().any(|(name, _)| name.starts_with('q') && name.ends_with("_deg")) {
        for (name, _) in mapped.iter_mut().filter(|(name, _)| name.starts_with('q') && name.ends_with("_rad")) {
            *name = name.replace("_rad", "_deg");
        }
    }
}
