//! The choice of a set: what for, how hard to search, and the stages of a search.
//!
//! A search is a fixed number of independent starts, each a pure function of the settings and its number ([`Search::start`]), so
//! that the result does not depend on who runs them or in which order. The balanced objective takes two stages: the first
//! finds how well a set can predict, the second lowers the condition number without giving much of that away.

use clap::ValueEnum;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::descent::Descent;
use super::information::Information;
use super::{PlanningError, check_count, check_members};

/// The figure that a search improves. The indices O1 to O5 are those of [`super::ObservabilityIndices`].
//
// The first line of each variant is the help of `--objective`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// Lowest condition number among sets that predict within 4 % of the best
    #[default]
    Balanced,
    /// Lowest condition number; predicts worse than random poses
    Condition,
    /// Lowest predicted error
    Prediction,
    /// D-optimal: largest determinant of the information
    D,
    /// Observability index O1
    O1,
    /// Observability index O2
    O2,
    /// Observability index O3
    O3,
    /// Observability index O4
    O4,
    /// Observability index O5
    O5,
}

crate::text::names_of_option!(Objective);

impl Objective {
    /// Whether it looks at the singular values of the pair rows (else at the information matrix).
    pub(super) const fn is_spectral(self) -> bool {
        !matches!(self, Self::Prediction | Self::D)
    }
}

/// How to search.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchSettings {
    /// Number of poses, the required ones included.
    pub poses: usize,
    /// Candidates that must be in, such as poses already measured.
    pub required: Vec<usize>,
    /// What to choose for.
    pub objective: Objective,
    /// Predicted error that [`Objective::Balanced`] may give away, relative to the best found.
    pub prediction_slack: f64,
    /// Seed of every random decision.
    pub seed: u64,
    /// Number of independent starts; the best result counts.
    pub starts: usize,
    /// Sweeps over all poses per start and stage: the work of an uninterrupted search. Prediction and D alone get three times
    /// as many, which take no longer.
    pub sweeps: usize,
    /// Candidates that a place looks at in one visit; a larger pool is gone through in turn.
    pub window: usize,
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self {
            poses: 56,
            required: Vec::new(),
            objective: Objective::default(),
            prediction_slack: 0.04,
            seed: 1,
            starts: 4,
            sweeps: 8,
            window: 1500,
        }
    }
}

impl SearchSettings {
    /// Sweeps per start of a stage.
    pub const fn sweeps_of(&self, stage: Stage) -> usize {
        match (stage, self.objective) {
            (Stage::Objective { .. }, Objective::Prediction | Objective::D) => 3 * self.sweeps,
            _ => self.sweeps,
        }
    }
}

/// A part of a search that runs on all starts before the next one begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Exchange on the predicted error: the reference of the balanced objective.
    Prediction,
    /// Exchange on the objective, with a predicted error of at most this.
    Objective {
        /// Largest predicted error allowed; infinite without a bound.
        limit: f64,
    },
}

/// Figures of merit of a set during the search, for progress and for the curve of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Condition number of `A·S`; infinite for a singular set.
    pub condition_number: f64,
    /// Observability index O1 (m), see [`super::ObservabilityIndices`].
    pub o1: f64,
    /// Predicted error (σ).
    #[serde(rename = "predicted_error_sigma")]
    pub predicted_error: f64,
}

/// A chosen set.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// Candidates, ascending.
    pub set: Vec<usize>,
    /// What the stage minimised: condition number, predicted error, −ln det M or −O.
    pub cost: f64,
    /// Its figures of merit.
    pub figures: Figures,
    /// Whether the search was cut short; the set is the best so far.
    pub interrupted: bool,
}

/// The state of one start, after every sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Which start.
    pub start: usize,
    /// Which stage.
    pub stage: Stage,
    /// Sweeps done, of [`SearchSettings::sweeps_of`].
    pub sweep: usize,
    /// Figures of merit of the best set of this start.
    pub figures: Figures,
}

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
            _ => Stage::Objective { limit: f64::INFINITY },
        }
    }

    /// The stage after `stage`, whose best result was `best`; `None` at the end.
    pub fn next_stage(&self, stage: Stage, best: &Chosen) -> Option<Stage> {
        match stage {
            Stage::Prediction if self.settings.objective == Objective::Balanced && !best.interrupted => {
                Some(Stage::Objective { limit: best.figures.predicted_error * (1.0 + self.settings.prediction_slack) })
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
            if let Stage::Objective { limit } = stage {
                // A start that ended above the limit continues from the best set.
                for result in results.iter_mut().filter(|result| result.figures.predicted_error > limit) {
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
