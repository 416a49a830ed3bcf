//! What a search improves, how hard it searches, and what it finds.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

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
    /// Exchange on the predicted error, and on the gaps in the ranges of the joints: the reference of the balanced objective.
    Prediction,
    /// Exchange on the objective, with a predicted error of at most this.
    Objective {
        /// Largest predicted error allowed; infinite without a bound.
        limit: f64,
        /// Largest shortfall allowed of the joint angles in their ranges; infinite without a bound.
        shortfall: f64,
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
    /// How far its joint angles fall short of filling their ranges: 0 where every gap is small enough.
    pub shortfall: f64,
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
