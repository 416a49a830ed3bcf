//! What random sets of the same size reach: the yardstick beside every plan.

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::exchange::Merit;
use super::information::Information;
use super::pairs::pair_gram;
use super::score::condition_number;
use super::{PlanningError, check_count};

/// Median and best of a figure that is better when small; infinite for sets that determine nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the sets do better.
    pub median: f64,
    /// The best set.
    pub best: f64,
}

/// Random sets of one size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Yardstick {
    /// Number of sets drawn.
    pub sets: usize,
    /// Condition numbers of `A·S`.
    #[serde(rename = "condition_number")]
    pub conditions: Spread,
    /// Predicted errors (σ).
    #[serde(rename = "predicted_error_sigma")]
    pub errors: Spread,
}

impl Yardstick {
    /// Scores `sets` random sets (at least one) of `poses` candidates each.
    ///
    /// # Errors
    /// Fewer poses than the rank needs, or more than there are candidates.
    pub fn new(information: &Information, poses: usize, sets: usize, seed: u64) -> Result<Self, PlanningError> {
        check_count(information, poses)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        if poses > information.len() {
            return Err(PlanningError::TooFewCandidates { poses, candidates: information.len() });
        }
        let sets = sets.max(1);
        let mut pool: Vec<usize> = (0..information.len()).collect();
        let (conditions, errors) = (0..sets)
            .map(|_| {
                let (set, _) = pool.partial_shuffle(&mut rng, poses);
                let eigenvalues = pair_gram(information, set).symmetric_eigenvalues();
                let condition = condition_number(eigenvalues.as_slice()).unwrap_or(f64::INFINITY);
                (condition, Merit::new(information, information.sum(set)).predicted_error())
            })
            .unzip();
        Ok(Self { sets, conditions: Spread::new(conditions), errors: Spread::new(errors) })
    }
}

impl Spread {
    fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        let median =
            if values.len() % 2 == 1 { values[middle] } else { f64::midpoint(values[middle - 1], values[middle]) };
        Self { median, best: values[0] }
    }
}
