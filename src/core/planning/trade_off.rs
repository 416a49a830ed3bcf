//! What more poses would bring: the predicted error against the number of poses.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::PlanningError;
use super::choice::Search;
use super::descent::Descent;
use super::information::Information;
use super::objective::{Objective, SearchSettings, Stage};

/// Sweeps that settle the smallest set, and each larger one after it has grown.
const FIRST_SWEEPS: usize = 4;
const SWEEPS: usize = 1;

/// What a set of some size can predict.
#[derive(Clone, Debug, PartialEq)]
pub struct TradeOff {
    /// Number of poses.
    pub poses: usize,
    /// Its candidates, ascending.
    pub set: Vec<usize>,
    /// Predicted error (σ) of a set chosen for it: a set of the balanced objective lies a few per cent above.
    pub predicted_error: f64,
}

/// The predicted error for each of `sizes`, ascending, with quickly built sets that contain `required`: the smallest one is
/// settled by exchange, larger ones grow from it, best candidate by best candidate, with one sweep of exchange each.
///
/// Sizes that the rank does not allow or the pool does not hold are left out; after an interruption the rest is missing.
///
/// # Errors
/// Required candidates that are not in the pool, or twice.
pub fn trade_off(
    information: &Information,
    required: &[usize],
    sizes: &[usize],
    seed: u64,
    keep_going: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<TradeOff>, PlanningError> {
    let fewest = information.fewest_poses().max(required.len());
    let mut sizes: Vec<usize> =
        sizes.iter().copied().filter(|size| (fewest..=information.len()).contains(size)).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let Some(&smallest) = sizes.first() else { return Ok(Vec::new()) };
    let settings = SearchSettings {
        poses: smallest,
        required: required.to_vec(),
        objective: Objective::Prediction,
        seed,
        ..SearchSettings::default()
    };
    let search = Search::new(information, settings)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let set = search.random_set(&mut rng);
    let mut descent = Descent::new(information, search.settings(), Stage::Prediction, set, rng);
    let mut table = Vec::with_capacity(sizes.len());
    for size in sizes {
        let sweeps = if descent.poses() == size { FIRST_SWEEPS } else { SWEEPS };
        while descent.poses() < size {
            if !keep_going() {
                return Ok(table);
            }
            descent.grow();
        }
        for _ in 0..sweeps {
            if descent.sweep(0.0, keep_going).is_none() {
                return Ok(table);
            }
        }
        table.push(TradeOff { poses: size, set: descent.set(), predicted_error: descent.predicted_error() });
    }
    Ok(table)
}
