//! Undo and redo. The state is the fold of the lines that are not undone, so that the journal only grows.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{FoldError, Sample, SampleState, Session, Stop};
use crate::session::journal::{Decision, Entry, FindingCause, Line, MeasuredText};
use crate::session::plan::PoseKind;

/// The lines since the plan that is being measured, and which of them are undone.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct History {
    /// The session with that plan; `None` before there is one.
    base: Option<Arc<Session>>,
    /// Everything since.
    lines: Vec<Arc<Line>>,
    /// Numbers of the lines that are undone.
    undone: BTreeSet<u64>,
    /// What can be redone, the latest last: the lines that were undone together.
    redo: Vec<Vec<u64>>,
}

/// Something that can be undone or redone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Undoable {
    /// Its first line in the journal.
    pub line: u64,
    /// What it was, in words.
    pub what: String,
}

/// Whether an entry can be undone.
const fn is_undoable(entry: &Entry) -> bool {
    matches!(
        entry,
        Entry::Sample(_)
            | Entry::Decision { .. }
            | Entry::Correction(_)
            | Entry::Skipped { .. }
            | Entry::Note { .. }
            | Entry::PlanExtended(_)
    )
}

/// Whether `keep` is the decision that was written with the sample `taken`, a reading that was held back and accepted.
fn belong_together(taken: &Line, keep: &Line) -> bool {
    let (Entry::Sample(noted), Entry::Decision { sample, decision: Decision::Keep }) = (&taken.entry, &keep.entry)
    else {
        return false;
    };
    let was_held = noted.findings.iter().any(|finding| finding.cause == FindingCause::NotAtRest);
    *sample == noted.number && was_held && taken.number + 1 == keep.number && taken.time == keep.time
}

impl Session {
    /// What would be undone next.
    pub fn undoable(&self) -> Option<Undoable> {
        self.described(&self.last_undoable())
    }

    /// What would be redone next.
    pub fn redoable(&self) -> Option<Undoable> {
        self.described(self.history.redo.last()?)
    }

    /// Lines of the last action that is not undone, in order.
    fn last_undoable(&self) -> Vec<u64> {
        let is_open = |line: &&Arc<Line>| is_undoable(&line.entry) && !self.history.undone.contains(&line.number);
        let mut open = self.history.lines.iter().rev().filter(is_open);
        match (open.next(), open.next()) {
            (Some(last), Some(before)) if belong_together(before, last) => vec![before.number, last.number],
            (Some(last), _) => vec![last.number],
            (None, _) => Vec::new(),
        }
    }

    fn described(&self, lines: &[u64]) -> Option<Undoable> {
        let line = *lines.first()?;
        let entry = &self.history.lines.iter().find(|known| known.number == line)?.entry;
        Some(Undoable { line, what: self.in_words(entry) })
    }

    /// An action in a few words.
    #[expect(clippy::wildcard_enum_match_arm, reason = "all others have words of their own")]
    fn in_words(&self, entry: &Entry) -> String {
        let of_row = |row: usize| self.row_name(row);
        let of_sample = |number: u64| self.sample(number).map_or_else(String::new, |sample| of_row(sample.row));
        match entry {
            Entry::Sample(noted) => format!("pose {} measured", of_row(noted.row)),
            Entry::Decision { sample, decision } => {
                let decided = match decision {
                    Decision::Keep => "kept",
                    Decision::LeaveOut => "excluded",
                    Decision::Undo => "undone",
                };
                format!("pose {} {decided}", of_sample(*sample))
            }
            Entry::Correction(_) => "a correction".to_owned(),
            Entry::Skipped { row, skipped: true } => format!("pose {} skipped", of_row(*row)),
            Entry::Skipped { row, skipped: false } => format!("pose {} no longer skipped", of_row(*row)),
            Entry::Note { pose: Some(pose), .. } => format!("note to pose {pose}"),
            Entry::Note { pose: None, .. } => "note".to_owned(),
            Entry::PlanExtended(_) => "more poses".to_owned(),
            other => other.describe(),
        }
    }

    /// Name of a row of the plan. A pose that is measured again to see drift has the name of the first with `again`.
    pub fn row_name(&self, row: usize) -> String {
        let Some(named) = self.rows.get(row) else { return "?".to_owned() };
        let pose = &named.planned.pose;
        if named.planned.kind != PoseKind::Drift {
            return pose.clone();
        }
        let is_same = |other: &&super::Row| other.planned.kind == PoseKind::Drift && other.planned.pose == *pose;
        match self.rows.iter().take(row).filter(is_same).count() {
            0 => format!("{pose} again"),
            earlier => format!("{pose} again {}", earlier + 1),
        }
    }

    /// Takes note of a line that was applied.
    pub(super) fn remember(&mut self, line: &Line) {
        if matches!(line.entry, Entry::Plan(_)) {
            // Poses of another plan: what was measured for the earlier one is settled.
            self.history = History::default();
            self.history.base = Some(Arc::new(self.clone()));
        } else if self.history.base.is_some() {
            self.history.lines.push(Arc::new(line.clone()));
            if is_undoable(&line.entry) {
                self.history.redo.clear();
            }
        }
    }

    /// Undoes the last action, which begins in line `undone`.
    pub(super) fn undo(&mut self, line: &Line, undone: u64) -> Result<(), FoldError> {
        let lines = self.last_undoable();
        if lines.first() != Some(&undone) {
            return Err(misfit(line, "an undo of what was not done last"));
        }
        let mut history = self.history.clone();
        history.undone.extend(&lines);
        history.redo.push(lines);
        self.fold_again(history, line, undone)
    }

    /// Redoes what was undone last, which begins in line `redone`.
    pub(super) fn redo(&mut self, line: &Line, redone: u64) -> Result<(), FoldError> {
        let mut history = self.history.clone();
        let lines = history.redo.pop().filter(|lines| lines.first() == Some(&redone));
        let lines = lines.ok_or_else(|| misfit(line, "a redo of what was not undone last"))?;
        history.undone.retain(|undone| !lines.contains(undone));
        self.fold_again(history, line, redone)
    }

    /// Folds the lines since the plan again, without those that are undone.
    fn fold_again(&mut self, mut history: History, line: &Line, concerns: u64) -> Result<(), FoldError> {
        let base = history.base.clone().ok_or_else(|| misfit(line, "an undo without a plan"))?;
        let mut session = Self::clone(&base);
        for known in &history.lines {
            if matches!(known.entry, Entry::Undone { .. } | Entry::Redone { .. }) {
                session.advance(known);
            } else if history.undone.contains(&known.number) {
                session.apply_undone(known);
            } else {
                session.apply_once(known)?;
            }
        }
        session.advance(line);
        session.shown = session.row_of(&history, concerns).or(session.shown);
        history.lines.push(Arc::new(line.clone()));
        session.history = history;
        *self = session;
        Ok(())
    }

    /// Row of the plan that a line is about.
    #[expect(clippy::wildcard_enum_match_arm, reason = "of what can be undone, only these are about a row")]
    fn row_of(&self, history: &History, line: u64) -> Option<usize> {
        match &history.lines.iter().find(|known| known.number == line)?.entry {
            Entry::Sample(noted) => Some(noted.row),
            Entry::Decision { sample, .. } => self.sample(*sample).map(|sample| sample.row),
            Entry::Skipped { row, .. } => Some(*row),
            _ => None,
        }
    }

    /// What remains of a line that is undone: the sample is still to be seen, and its number is used.
    #[expect(clippy::wildcard_enum_match_arm, reason = "of what can be undone, only these leave something")]
    fn apply_undone(&mut self, line: &Line) {
        match &line.entry {
            Entry::Sample(noted) => self.add_undone(noted, line),
            Entry::PlanExtended(plan) => {
                let first = self.rows.len();
                self.rows.extend(self.planned_rows(&plan.rows).unwrap_or_default());
                for row in self.rows.iter_mut().skip(first) {
                    row.active = false;
                }
            }
            _ => {}
        }
        self.advance(line);
    }

    fn add_undone(&mut self, noted: &MeasuredText, line: &Line) {
        self.measurements = noted.number;
        // The arm was there all the same.
        self.last_stop = Some(Stop::Sample(noted.number));
        self.is_stop_certain = true;
        self.rows_measured = self.rows_measured.max(noted.row + 1);
        self.samples.push(Sample {
            row: noted.row,
            joints: noted.reported_joints.clone().unwrap_or_else(|| noted.joints.clone()),
            noted: noted.clone(),
            time: line.time,
            state: SampleState::Undone,
            kept: false,
            settled: 0,
        });
    }
}

fn misfit(line: &Line, what: &str) -> FoldError {
    FoldError::Misfit { line: line.number, what: what.to_owned() }
}
