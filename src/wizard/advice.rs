//! What can be done about errors and warnings, in the words of the wizard.

use super::notice::Problem;
use crate::procedure::ProcedureError;
use crate::session::advice::Advice;
use crate::text::causes;

/// The advice with the step where it is followed.
pub(super) fn words(advice: Advice) -> String {
    match advice {
        Advice::VerifyPoints => "go back, plan some verification poses and measure them".to_owned(),
        Advice::PlanPoses => "go back, choose poses and measure them".to_owned(),
        Advice::CheckRows => "measure more poses".to_owned(),
        Advice::StateSigma => "state the accuracy of the instrument on the page of the cell".to_owned(),
        Advice::StateLimits
        | Advice::NarrowRanges
        | Advice::OmitKind
        | Advice::CheckTable
        | Advice::CheckRobot
        | Advice::SwapAxes
        | Advice::UsePrior
        | Advice::IdentifyGeometry
        | Advice::VerifyDistances
        | Advice::SeparateVerification
        | Advice::StateSocketDistance
        | Advice::StateTarget
        | Advice::MountBesideAxis
        | Advice::RebuildRecording
        | Advice::RefitTarget => advice.to_string(),
    }
}

impl From<ProcedureError> for Problem {
    fn from(error: ProcedureError) -> Self {
        Self { hints: error.advice().iter().copied().map(words).collect(), ..Self::new(causes(&error)) }
    }
}
