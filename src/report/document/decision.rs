//! The decision about all acceptance limits, as the report has it.

use serde::Serialize;

use super::ResultState;
use crate::session::decision::{COVERAGE_FACTOR, LimitDecision, Outcome, decided, instrument_sigma_mm};
use crate::session::summary::{IdentificationSummary, VerdictStatus};

/// The decision about all limits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DecisionPart {
    pub outcome: Outcome,
    pub coverage_factor: f64,
    /// Standard deviation of a coordinate of the instrument, which enters in full: as stated, or what is left per coordinate after
    /// the fit if that is less, because an instrument cannot scatter more than everything together.
    pub instrument_sigma_mm: f64,
    pub limits: Vec<LimitDecision>,
}

impl DecisionPart {
    /// About a result in this state.
    pub(super) fn new(result: &IdentificationSummary, state: ResultState) -> Self {
        let limits = decided(&result.verdict.checks, &result.sigma);
        let outcome = match (state, result.verdict.status) {
            (ResultState::OutOfDate | ResultState::None, _) | (_, VerdictStatus::NotEvaluated) => Outcome::NotEvaluated,
            (_, VerdictStatus::NotAccepted) => Outcome::Fail,
            (_, VerdictStatus::Accepted) if limits.iter().all(|limit| limit.outcome == Outcome::Pass) => Outcome::Pass,
            (_, VerdictStatus::Accepted) => Outcome::Undecided,
        };
        let instrument_sigma_mm = instrument_sigma_mm(&result.sigma);
        Self { outcome, coverage_factor: COVERAGE_FACTOR, instrument_sigma_mm, limits }
    }
}
