//! How a search went on.

use std::sync::{Mutex, PoisonError};

use super::request::Progress;
use crate::planning::{self, Stage};
use crate::session::plan_summary::SearchStepSummary;

/// The sweeps of a search, told from any thread in any order.
#[derive(Debug, Default)]
pub(super) struct History {
    sweeps: Mutex<Vec<planning::Progress>>,
}

impl History {
    /// Keeps a sweep; another search makes those before it void.
    pub(super) fn take(&self, step: &Progress) {
        let mut sweeps = self.sweeps.lock().unwrap_or_else(PoisonError::into_inner);
        match step {
            Progress::Sweep { found, .. } => sweeps.push(*found),
            Progress::Unreachable { .. } => sweeps.clear(),
            Progress::Searching => {}
        }
    }

    /// The best start after every sweep, in order: whatever the threads did, the same for the same search.
    pub(super) fn steps(&self) -> Vec<SearchStepSummary> {
        let mut sweeps = self.sweeps.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let stage = |found: &planning::Progress| u8::from(matches!(found.stage, Stage::Objective { .. }));
        let merit = |found: &planning::Progress| match found.stage {
            Stage::Prediction => found.predicted_error,
            Stage::Objective { .. } => found.condition_number,
        };
        sweeps.sort_by(|one, other| {
            (stage(one), one.sweep)
                .cmp(&(stage(other), other.sweep))
                .then(merit(one).total_cmp(&merit(other)))
                .then(one.start.cmp(&other.start))
        });
        sweeps.dedup_by_key(|found| (stage(found), found.sweep));
        let rounded = |value: f64| format!("{value:.6e}").parse().unwrap_or(value);
        sweeps
            .iter()
            .map(|found| SearchStepSummary {
                condition_number: rounded(found.condition_number),
                o1: rounded(found.o1),
                predicted_error_sigma: rounded(found.predicted_error),
            })
            .filter(|step| step.condition_number.is_finite() && step.o1.is_finite())
            .collect()
    }
}
