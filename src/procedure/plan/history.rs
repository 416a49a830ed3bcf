//! The history of a search, sweep by sweep.

use std::sync::{Mutex, PoisonError};

use super::request::Progress;
use crate::planning::{self, Figures, Stage};

/// The sweeps of a search, reported by any thread in any order.
#[derive(Debug, Default)]
pub(super) struct History {
    sweeps: Mutex<Vec<planning::Progress>>,
}

impl History {
    /// Keeps a sweep; a new search discards all earlier ones.
    pub(super) fn take(&self, step: &Progress) {
        let mut sweeps = self.sweeps.lock().unwrap_or_else(PoisonError::into_inner);
        match step {
            Progress::Sweep { found, .. } => sweeps.push(*found),
            Progress::Unreachable { .. } => sweeps.clear(),
            Progress::Searching => {}
        }
    }

    /// The best start after every sweep, in order. It does not depend on the threads.
    pub(super) fn steps(&self) -> Vec<Figures> {
        let mut sweeps = self.sweeps.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let stage = |found: &planning::Progress| u8::from(matches!(found.stage, Stage::Objective { .. }));
        let merit = |found: &planning::Progress| match found.stage {
            Stage::Prediction => found.figures.predicted_error,
            Stage::Objective { .. } => found.figures.condition_number,
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
            .map(|found| Figures {
                condition_number: rounded(found.figures.condition_number),
                o1: rounded(found.figures.o1),
                predicted_error: rounded(found.figures.predicted_error),
            })
            .filter(|step| step.condition_number.is_finite() && step.o1.is_finite())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(start: usize, is_objective: bool, sweep: usize, value: f64) -> Progress {
        let stage =
            if is_objective { Stage::Objective { limit: 1.0, shortfall: f64::INFINITY } } else { Stage::Prediction };
        let found = planning::Progress {
            start,
            stage,
            sweep,
            figures: Figures { condition_number: 100.0 * value, o1: 1e-3, predicted_error: value },
        };
        Progress::Sweep { found, done: sweep, sweeps: 6, starts: 2 }
    }

    #[test]
    fn threads_may_tell_in_any_order() {
        let told = [
            sweep(0, false, 1, 0.9),
            sweep(1, false, 1, 0.8),
            sweep(0, false, 2, 0.7),
            sweep(1, false, 2, 0.75),
            sweep(0, true, 1, 0.72),
            sweep(1, true, 1, 0.71),
        ];
        let steps = |order: &[usize]| {
            let history = History::default();
            for index in order {
                history.take(&told[*index]);
            }
            history.steps()
        };
        let found = steps(&[0, 1, 2, 3, 4, 5]);
        assert_eq!(found, steps(&[5, 3, 1, 4, 2, 0]));
        // The best start of every sweep, one stage after the other.
        let errors: Vec<f64> = found.iter().map(|step| step.predicted_error).collect();
        assert_eq!(errors, [0.8, 0.7, 0.71]);
    }

    #[test]
    fn another_search_starts_again() {
        let history = History::default();
        history.take(&sweep(0, false, 1, 0.9));
        history.take(&Progress::Unreachable { poses: 2 });
        history.take(&Progress::Searching);
        history.take(&sweep(0, false, 1, 0.5));
        history.take(&sweep(0, false, 2, f64::INFINITY));
        let steps = history.steps();
        // A set that determines nothing is no point of a plot.
        assert_eq!(steps.len(), 1);
        assert!((steps[0].predicted_error - 0.5).abs() < 1e-12);
    }
}
