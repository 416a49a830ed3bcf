//! Whether anything is wrong at all, by four statistics with known distributions; what it is comes later.
//!
//! Limits are set for one false alarm in some hundred sessions of thirty points, although every point is looked at again with each
//! later one. Arms that are less perfect than the instrument (gravity, gear harmonics) are judged by what they show: see [`excess`].

use super::fit::{Fit, Item, Nominal};
use crate::units::MILLIMETRE;

/// The newest point is off: χ² of three values that is exceeded once in 12,000 times.
const NEWEST: f64 = 21.5;
/// An earlier point is off, now that more is known: looked at many times, so once in 100,000 times.
pub(super) const EARLIER: f64 = 26.0;
/// The target has moved since some point, likewise.
const MOVED: f64 = 26.0;
/// All residuals together: standard normal deviate that is exceeded once in 30,000 times.
const TOGETHER: f64 = 4.0;
/// Size of a shift of the target that is looked for (m).
pub(super) const SHIFT: f64 = 5.0 * MILLIMETRE;
/// Median of χ² of three values.
const MEDIAN_CHI_SQUARE_3: f64 = 2.366;
/// Points of this number at least show what the arm itself is worth.
const ENOUGH: usize = 8;
/// What chance does to the typical point.
const BY_CHANCE: f64 = 1.5;
/// No arm bends and creeps by more than this (m): beyond, something is wrong.
const UNMODELLED: f64 = 0.3 * MILLIMETRE;

/// The fit of all items, if something is wrong with them.
pub(super) fn raised<'a>(nominal: &'a Nominal<'a>, items: Vec<Item>) -> Option<Fit<'a>> {
    let full = Fit::new(nominal, items)?;
    let (newest, earlier) =
        full.gains().split_last().map(|(newest, earlier)| (*newest, earlier.iter().copied().fold(0.0, f64::max)))?;
    let moved = full.moved_gains(SHIFT).iter().skip(1).copied().fold(0.0, f64::max);
    let values = 3 * full.items.len() - 6;
    let wrong = newest > NEWEST || earlier > EARLIER || moved > MOVED || full.cost > limit_of_sum(values);
    wrong.then_some(full)
}

/// χ² of so many values that is hardly ever exceeded (Wilson and Hilferty 1931).
pub(super) fn limit_of_sum(values: usize) -> f64 {
    let spread = 2.0 / (9.0 * values as f64);
    values as f64 * (1.0 - spread + TOGETHER * spread.sqrt()).powi(3)
}

/// How many times worse than stated the points scatter about the arm, by the median over all but the newest and the worst one;
/// 1 where they do not, where too few points tell, or where no arm is that bad.
pub(super) fn excess(nominal: &Nominal<'_>, full: &Fit<'_>) -> f64 {
    let gains = full.gains();
    // Bad points only make the others look worse: if those look good, no more need be asked.
    if excess_of(gains.clone()) <= BY_CHANCE {
        return 1.0;
    }
    let newest = gains.len() - 1;
    let worst = (0..newest).max_by(|&a, &b| gains[a].total_cmp(&gains[b])).unwrap_or(newest);
    let others: Vec<Item> =
        (0..newest).filter(|&index| index != worst).map(|index| full.items[index].clone()).collect();
    if others.len() < ENOUGH {
        return 1.0;
    }
    let Some(fit) = Fit::new(nominal, others) else { return 1.0 };
    let excess = excess_of(fit.gains());
    let sigma = fit.items.iter().map(|item| item.sigma).fold(0.0, f64::max);
    if excess > BY_CHANCE && excess * sigma < UNMODELLED { excess } else { 1.0 }
}

/// How many times worse than stated the typical point is.
fn excess_of(mut gains: Vec<f64>) -> f64 {
    let middle = gains.len() / 2;
    let (_, median, _) = gains.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / MEDIAN_CHI_SQUARE_3).sqrt()
}
