//! Corrections of wrong entries, and how they are withdrawn with the measurement that led to them.

use std::collections::BTreeSet;

use super::{Sample, SampleState, Session};
use crate::session::journal::{Correction, MeasuredText, to_edge};

/// A correction in force.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// Line of the journal that has it, from 1.
    pub line: u64,
    pub correction: Correction,
    /// Number of the last measurement at that time: it, or one before, led to the correction.
    pub measurements: u64,
    /// The samples that it changed.
    changes: Vec<Change>,
}

/// A sample before and after a correction.
#[derive(Clone, Debug, PartialEq)]
struct Change {
    sample: usize,
    before: Standing,
    after: Standing,
}

/// The part of a sample that a correction may change.
#[derive(Clone, Debug, PartialEq)]
struct Standing {
    row: usize,
    joints: Vec<f64>,
    state: SampleState,
    settled: u64,
}

impl Standing {
    fn of(sample: &Sample) -> Self {
        let Sample { row, joints, state, settled, .. } = sample;
        Self { row: *row, joints: joints.clone(), state: *state, settled: *settled }
    }
}

/// Whether coordinates can be multiplied by this.
pub(super) fn is_factor(factor: f64) -> bool {
    factor.is_finite() && factor > 0.0
}

impl Session {
    /// Factor for the lengths recorded at a measurement, from the corrections.
    pub fn correction_of(&self, number: u64) -> f64 {
        let factors = self.corrections.iter().filter_map(|corrected| match corrected.correction {
            Correction::Scale { since, factor, until } => {
                (since <= number && until.is_none_or(|until| number <= until)).then_some(factor)
            }
            Correction::Swap { .. }
            | Correction::Row { .. }
            | Correction::Joints { .. }
            | Correction::TakenBack { .. } => None,
        });
        factors.product()
    }

    /// Total factor for the lengths of a sample, which need not be in the session yet.
    pub fn scale_noted(&self, noted: &MeasuredText) -> f64 {
        self.correction_of(noted.number) * noted.factor.unwrap_or(1.0)
    }

    /// The corrections that the measurement `number` and those after it led to, the latest first.
    pub fn corrections_since(&self, number: u64) -> impl Iterator<Item = &Corrected> {
        self.corrections.iter().rev().filter(move |corrected| corrected.measurements >= number)
    }

    pub(super) fn correct(&mut self, correction: &Correction, line: u64) -> Option<()> {
        if let Correction::TakenBack { line } = correction {
            return self.take_back(*line);
        }
        let before: Vec<Standing> = self.samples.iter().map(Standing::of).collect();
        self.set_right(correction)?;
        let changes = before.into_iter().zip(&self.samples).enumerate().filter_map(|(sample, (before, after))| {
            let after = Standing::of(after);
            (before != after).then_some(Change { sample, before, after })
        });
        let changes = changes.collect();
        self.corrections.push(Corrected {
            line,
            correction: correction.clone(),
            measurements: self.measurements,
            changes,
        });
        Some(())
    }

    /// Reverts the changes of the correction in a line, except for what was decided since.
    fn take_back(&mut self, line: u64) -> Option<()> {
        let place = self.corrections.iter().position(|corrected| corrected.line == line)?;
        let corrected = self.corrections.remove(place);
        for Change { sample, before, after } in &corrected.changes {
            let Some(changed) = self.samples.get_mut(*sample) else { continue };
            if changed.row == after.row && changed.joints == after.joints {
                (changed.row, changed.joints) = (before.row, before.joints.clone());
            }
            if changed.state == after.state {
                changed.state = before.state;
            }
            if changed.settled == after.settled {
                changed.settled = before.settled;
            }
        }
        // A later correction may have moved a sample on to a third row.
        let rows = corrected.changes.iter().flat_map(|change| {
            let now = self.samples.get(change.sample).map(|sample| sample.row);
            [Some(change.before.row), Some(change.after.row), now]
        });
        for row in rows.flatten().collect::<BTreeSet<usize>>() {
            self.keep_latest(row);
        }
        Some(())
    }

    fn set_right(&mut self, correction: &Correction) -> Option<()> {
        match correction {
            Correction::Scale { since, factor, until } => {
                if !is_factor(*factor) {
                    return None;
                }
                self.settle(|number| number >= *since && until.is_none_or(|until| number <= until));
            }
            Correction::Swap { first, second } => {
                let place = |number: u64| self.samples.iter().position(|sample| sample.noted.number == number);
                let (a, b) = (place(*first)?, place(*second)?);
                let (row, joints) = (self.samples[a].row, self.samples[a].joints.clone());
                let (other_row, other_joints) = (self.samples[b].row, self.samples[b].joints.clone());
                (self.samples[a].row, self.samples[a].joints) = (other_row, other_joints);
                (self.samples[b].row, self.samples[b].joints) = (row, joints);
                self.keep_latest(row);
                self.keep_latest(other_row);
                self.settle(|number| number == *first || number == *second);
            }
            Correction::Row { sample, row } => {
                let robot = self.robot.as_ref()?;
                let joints: Vec<f64> = {
                    let planned = &self.rows.get(*row)?.planned;
                    to_edge(&planned.configuration, &robot.joint_types)
                };
                let moved = *sample;
                let counts = self.sample(moved)?.state == SampleState::Counts;
                for other in self.samples.iter_mut().filter(|other| other.row == *row && other.noted.number != moved) {
                    if counts && matches!(other.state, SampleState::Counts | SampleState::LeftOut) {
                        other.state = SampleState::Superseded;
                    }
                }
                let sample = self.sample_mut(moved)?;
                (sample.row, sample.joints) = (*row, joints);
                self.rows_measured = self.rows_measured.max(*row + 1);
                self.settle(|number| number == moved);
                self.keep_latest(*row);
            }
            Correction::Joints { sample, joints } => {
                if !self.fits(joints) {
                    return None;
                }
                let sample = self.sample_mut(*sample)?;
                sample.joints.clone_from(joints);
                let corrected = sample.noted.number;
                self.settle(|number| number == corrected);
            }
            Correction::TakenBack { .. } => return None,
        }
        Some(())
    }

    /// At most one sample of a row counts or is left out: the latest one.
    fn keep_latest(&mut self, row: usize) {
        let stands = |sample: &&mut Sample| {
            sample.row == row && matches!(sample.state, SampleState::Counts | SampleState::LeftOut)
        };
        for sample in self.samples.iter_mut().filter(stands).rev().skip(1) {
            sample.state = SampleState::Superseded;
        }
    }

    /// Settles the findings about these measurements.
    fn settle(&mut self, concerns: impl Fn(u64) -> bool) {
        let measurements = self.measurements;
        for sample in self.samples.iter_mut().filter(|sample| concerns(sample.noted.number)) {
            sample.settled = measurements;
        }
    }
}
