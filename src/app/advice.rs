//! What can be done about errors and warnings, in the words of the command line.

use crate::error::{ExitStatus, Failure};
use crate::procedure::{ErrorKind, ProcedureError};
use crate::session::advice::Advice;

/// The advice with the options that follow it.
pub(super) fn words(advice: Advice) -> String {
    let options = match advice {
        Advice::StateSigma => "give '--sigma-mm', or 'instrument' in the profile",
        Advice::NarrowRanges => {
            "narrow the joint ranges with '--limit' to one side of the cell, or lower '--clearance-mm'"
        }
        Advice::CheckRows => "check '--use': which rows does it leave?",
        Advice::UsePrior => "use '--prior expected' (the default)",
        Advice::IdentifyGeometry => "'--level geometric' identifies those too",
        Advice::VerifyPoints => "give '--verify FILE', or '--use CONDITION --verify-rest'",
        Advice::VerifyDistances => "give '--use CONDITION --verify-rest', or '--leave-one-out position'",
        Advice::SeparateVerification => "'--use' picks rows, such as \"kind == 'verification'\"",
        Advice::StateSocketDistance => "give '--socket-distance-mm'",
        Advice::RefitTarget => {
            "identify it with the others, or verify its rows on their own: 'trupose verify --refit target' fits its position"
        }
        Advice::StateLimits
        | Advice::OmitKind
        | Advice::PlanPoses
        | Advice::CheckTable
        | Advice::CheckRobot
        | Advice::SwapAxes
        | Advice::StateTarget
        | Advice::MountBesideAxis
        | Advice::RebuildRecording => return advice.to_string(),
    };
    options.to_owned()
}

impl From<ProcedureError> for Failure {
    fn from(error: ProcedureError) -> Self {
        let status = match error.kind() {
            ErrorKind::Input => ExitStatus::Usage,
            ErrorKind::Numerical => ExitStatus::Numerical,
        };
        let failure = Self::from_error(status, &error);
        error.advice().iter().fold(failure, |failure, advice| failure.hint(words(*advice)))
    }
}
