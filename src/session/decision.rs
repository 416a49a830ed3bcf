//! The decision about each acceptance limit with the uncertainty of the figure: pass, fail, or undecided between.

use serde::Serialize;

use super::summary::{LimitCheck, LimitedQuantity, SigmaSummary};

/// Factor of the expanded uncertainty U: about 95 % coverage.
pub const COVERAGE_FACTOR: f64 = 2.0;

/// What a figure with its uncertainty says about a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The figure and its uncertainty are below the limit.
    Pass,
    /// The figure less its uncertainty is above the limit, or a warning rules acceptance out.
    Fail,
    /// The limit is within the uncertainty, or the uncertainty is not known.
    Undecided,
    /// There is no figure, or no limit.
    NotEvaluated,
}

/// The decision about a limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitDecision {
    pub quantity: LimitedQuantity,
    /// The figure that was found.
    pub value_mm: Option<f64>,
    /// Its expanded uncertainty U (k = 2); none with too few poses.
    pub uncertainty_mm: Option<f64>,
    pub limit_mm: f64,
    pub outcome: Outcome,
}

/// Returns the decision about each limit.
pub fn decided(checks: &[LimitCheck], sigma: &SigmaSummary) -> Vec<LimitDecision> {
    let instrument = instrument_sigma_mm(sigma);
    checks.iter().map(|check| LimitDecision::new(check, instrument)).collect()
}

/// Returns the standard deviation of a coordinate of the instrument: as stated, or what the fit leaves if that is less.
pub fn instrument_sigma_mm(sigma: &SigmaSummary) -> f64 {
    let stated = sigma.stated_mm();
    sigma.from_residuals_mm.map_or(stated, |left| stated.min(left))
}

impl LimitDecision {
    fn new(check: &LimitCheck, instrument_mm: f64) -> Self {
        let uncertainty_mm = uncertainty(check, instrument_mm);
        let outcome = match (check.value_mm, uncertainty_mm) {
            (None, _) => Outcome::NotEvaluated,
            (Some(value), None) if value <= check.limit_mm => Outcome::Undecided,
            (Some(_), None) => Outcome::Fail,
            (Some(value), Some(uncertainty)) if value + uncertainty <= check.limit_mm => Outcome::Pass,
            (Some(value), Some(uncertainty)) if value - uncertainty > check.limit_mm => Outcome::Fail,
            // A value that is not a number meets no limit.
            (Some(value), Some(_)) if !value.is_finite() => Outcome::Fail,
            (Some(_), Some(_)) => Outcome::Undecided,
        };
        Self { quantity: check.quantity, value_mm: check.value_mm, uncertainty_mm, limit_mm: check.limit_mm, outcome }
    }
}

/// U of a figure: the scatter over the choice of poses, and the instrument in full, because its errors can be common to all poses.
fn uncertainty(check: &LimitCheck, instrument_mm: f64) -> Option<f64> {
    let [low, high] = check.interval_mm?;
    let of_poses = (high - low) / (2.0 * COVERAGE_FACTOR);
    let of_instrument = match check.quantity {
        LimitedQuantity::PositionMean | LimitedQuantity::PositionRms | LimitedQuantity::PositionMax => instrument_mm,
        // Both ends of a distance are measured.
        LimitedQuantity::DistanceMean | LimitedQuantity::DistanceRms | LimitedQuantity::DistanceMax => {
            instrument_mm * std::f64::consts::SQRT_2
        }
    };
    Some(COVERAGE_FACTOR * of_poses.hypot(of_instrument)).filter(|uncertainty| uncertainty.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decided(value: f64, interval: Option<[f64; 2]>, limit: f64) -> (Option<f64>, Outcome) {
        let check = LimitCheck {
            quantity: LimitedQuantity::PositionRms,
            value_mm: Some(value),
            interval_mm: interval,
            limit_mm: limit,
            met: Some(value <= limit),
        };
        let decision = LimitDecision::new(&check, 0.03);
        (decision.uncertainty_mm, decision.outcome)
    }

    #[test]
    fn within_the_uncertainty_of_the_limit_nothing_is_decided() {
        // Standard deviations of 40 and 30 µm: U = 100 µm.
        let interval = Some([0.42, 0.58]);
        let (found, outcome) = decided(0.5, interval, 0.61);
        assert!((found.unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(outcome, Outcome::Pass);
        assert_eq!(decided(0.5, interval, 0.59).1, Outcome::Undecided);
        assert_eq!(decided(0.5, interval, 0.41).1, Outcome::Undecided);
        assert_eq!(decided(0.5, interval, 0.39).1, Outcome::Fail);
        assert_eq!(decided(0.5, None, 0.6), (None, Outcome::Undecided));
        assert_eq!(decided(0.7, None, 0.6), (None, Outcome::Fail));
        assert_eq!(decided(f64::NAN, interval, 0.6).1, Outcome::Fail);
    }
}
