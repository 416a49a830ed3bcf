//! The choice of a set: the starts and the stages of a search.
//!
//! A search is a fixed number of independent starts, each a pure function of the settings and its number ([`Search::start`]), so
//! that the result does not depend on who runs them or in which order. The balanced objective takes two stages: the first
//! finds how well a set can predict, the second lowers the condition number without giving much of that away.

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use super::descent::Descent;
use super::information::Information;
use super::objective::{Chosen, Objective, Progress, SearchSettings, Stage};
use super::{PlanningError, check_count, check_members};

/// Shortfall of the joint angles that the balanced objective may give away, relative to that of the best set: the poses spread
/// afterwards anyhow, and a tighter limit costs up to a tenth of the condition number.
const SHORTFALL_SLACK: f64 = 1.0;

/// A search, checked.
#[derive(Clone, Debug)]
pub struct Search<'a> {
    information: &'a Information,
    settings: SearchSettings,
}

impl<'a> Search<'a> {
    /// Checks the settings against the pool.
    ///
    /// # Errors
    /// Too few or too many poses, or required ones that are not in the pool or do not fit.
    pub fn new(information: &'a Information, settings: SearchSettings) -> Result<Self, PlanningError> {
        let SearchSettings { poses, ref required, .. } = settings;
        check_count(information, poses)?;
        if poses > information.len() {
            return Err(PlanningError::TooFewCandidates { poses, candidates: information.len() });
        }
        if required.len() > poses {
            return Err(PlanningError::TooManyRequired { required: required.len(), poses });
        }
        check_members(information, required)?;
        Ok(Self { information, settings })
    }

    /// The pool.
    pub const fn information(&self) -> &'a Information {
        self.information
    }

    /// The settings.
    pub const fn settings(&self) -> &SearchSettings {
        &self.settings
    }

    /// The first stage.
    pub const fn first_stage(&self) -> Stage {
        match self.settings.objective {
            Objective::Balanced => Stage::Prediction,
            _ => Stage::Objective { limit: f64::INFINITY, shortfall: f64::INFINITY },
        }
    }

    /// The stage after `stage`, whose best result was `best`; `None` at the end.
    pub fn next_stage(&self, stage: Stage, best: &Chosen) -> Option<Stage> {
        match stage {
            Stage::Prediction if self.settings.objective == Objective::Balanced && !best.interrupted => {
                Some(Stage::Objective {
                    limit: best.figures.predicted_error * (1.0 + self.settings.prediction_slack),
                    shortfall: best.shortfall * (1.0 + SHORTFALL_SLACK),
                })
            }
            Stage::Prediction | Stage::Objective { .. } => None,
        }
    }

    /// Runs one start of a stage, from the set `from` or else from a random one. The result depends on the settings, `start`,
    /// `stage` and `from` only, unless `keep_going` says no.
    pub fn start(
        &self,
        stage: Stage,
        start: usize,
        from: Option<&Chosen>,
        keep_going: &(dyn Fn() -> bool + Sync),
        progress: &(dyn Fn(&Progress) + Sync),
    ) -> Chosen {
        let mut rng = ChaCha8Rng::seed_from_u64(self.settings.seed);
        // Every start and stage has random numbers of its own.
        rng.set_stream(2 * start as u64 + u64::from(stage == Stage::Prediction));
        let set = from.map_or_else(|| self.random_set(&mut rng), |from| self.required_first(&from.set));
        Descent::new(self.information, &self.settings, stage, set, rng).run(start, keep_going, progress)
    }

    /// Runs all starts of all stages one after the other.
    ///
    /// # Errors
    /// No start found a set that determines what the pool can.
    pub fn run(
        &self,
        keep_going: &(dyn Fn() -> bool + Sync),
        progress: &(dyn Fn(&Progress) + Sync),
    ) -> Result<Chosen, PlanningError> {
        self.run_with(&mut |stage, from| {
            (0..self.settings.starts)
                .map(|start| self.start(stage, start, from.get(start), keep_going, progress))
                .collect()
        })
    }

    /// Goes through the stages. `run_starts` runs all starts of a stage, in any order, each from the set given for it (none in
    /// the first stage), and returns the results in the order of the starts.
    ///
    /// # Errors
    /// No start found a set that determines what the pool can.
    pub fn run_with(
        &self,
        run_starts: &mut dyn FnMut(Stage, &[Chosen]) -> Vec<Chosen>,
    ) -> Result<Chosen, PlanningError> {
        let singular = || PlanningError::Singular { poses: self.settings.poses, rank: self.information.rank() };
        let mut stage = self.first_stage();
        let mut results = run_starts(stage, &[]);
        loop {
            let best = best_of(&results).filter(|best| best.cost.is_finite()).ok_or_else(singular)?.clone();
            let Some(next) = self.next_stage(stage, &best) else { return Ok(best) };
            stage = next;
            if let Stage::Objective { limit, shortfall } = stage {
                // A start that ended above a limit continues from the best set.
                let is_above = |result: &Chosen| result.figures.predicted_error > limit || result.shortfall > shortfall;
                for result in results.iter_mut().filter(|result| is_above(result)) {
                    result.clone_from(&best);
                }
            }
            results = run_starts(stage, &results);
        }
    }

    /// The required candidates, filled up with random ones.
    pub(super) fn random_set(&self, rng: &mut ChaCha8Rng) -> Vec<usize> {
        let mut set = self.settings.required.clone();
        let mut rest: Vec<usize> = (0..self.information.len()).filter(|index| !set.contains(index)).collect();
        let missing = self.settings.poses - set.len();
        let (picked, _) = rest.partial_shuffle(rng, missing);
        set.extend_from_slice(picked);
        set
    }

    /// The same set with the required candidates in front.
    fn required_first(&self, set: &[usize]) -> Vec<usize> {
        let required = &self.settings.required;
        required.iter().chain(set.iter().filter(|candidate| !required.contains(candidate))).copied().collect()
    }
}

/// The result of lowest cost; the first of equals.
fn best_of(results: &[Chosen]) -> Option<&Chosen> {
    results.iter().reduce(|best, other| if other.cost < best.cost { other } else { best })
}
