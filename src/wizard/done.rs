//! How much of a running request is done.

use super::RequestProgress;
use crate::planning::Stage;
use crate::procedure::plan::Progress;

/// Parts of a search at which its first stage and its second one are done; what follows puts the poses in order.
const STAGES: [f64; 2] = [0.5, 0.9];

/// The fraction of a request that is done. It never decreases: a search that begins again takes the fraction that is left.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Done {
    /// The fraction, once something is known.
    part: Option<f64>,
    /// Fraction that was done when the present search began.
    before: f64,
}

impl Done {
    /// The fraction, if it is known.
    pub(super) const fn part(self) -> Option<f64> {
        self.part
    }

    /// Takes note of progress.
    pub(super) fn take(&mut self, progress: &RequestProgress) {
        let RequestProgress::Search(search) = progress else { return };
        match search {
            Progress::Searching | Progress::Unreachable { .. } => self.before = self.part.unwrap_or(0.0),
            Progress::Sweep { found, done, sweeps, .. } => {
                let [first, second] = STAGES;
                let of_stage = (*done as f64 / (*sweeps).max(1) as f64).min(1.0);
                let of_search = match found.stage {
                    Stage::Prediction => first * of_stage,
                    Stage::Objective { .. } => first + (second - first) * of_stage,
                };
                let part = self.before + (1.0 - self.before) * of_search;
                self.part = Some(self.part.unwrap_or(0.0).max(part));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::{self, Figures};

    #[test]
    fn it_never_decreases_and_ends_with_the_answer() {
        let figures = Figures { condition_number: 1.0, o1: 1.0, predicted_error: 1.0 };
        let sweep = |is_first: bool, done| {
            let stage =
                if is_first { Stage::Prediction } else { Stage::Objective { limit: 1.0, shortfall: f64::INFINITY } };
            let found = planning::Progress { stage, start: 0, sweep: done, figures };
            RequestProgress::Search(Progress::Sweep { found, done, sweeps: 4, starts: 1 })
        };
        let mut done = Done::default();
        let mut last = 0.0;
        for _ in 0..3 {
            done.take(&RequestProgress::Search(Progress::Searching));
            for is_first in [true, false] {
                for number in 1..=4 {
                    done.take(&sweep(is_first, number));
                    let part = done.part().unwrap();
                    assert!((last..1.0).contains(&part), "{last} {part}");
                    last = part;
                }
            }
            done.take(&RequestProgress::Search(Progress::Unreachable { poses: 2 }));
        }
    }
}
