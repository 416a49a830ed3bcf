//! What can be done about a warning or an error.

use std::fmt;

/// Advice to the operator. `Display` words it independently of how the program is used; commands word it with their options, and
/// the wizard with its steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advice {
    /// State the standard deviation of the instrument.
    StateSigma,
    /// State the ranges of the joints in the profile.
    StateLimits,
    /// Narrow the ranges of the joints, or keep less clearance.
    NarrowRanges,
    /// Score a list whose rows have no kind.
    OmitKind,
    /// Choose poses that determine the parameters.
    PlanPoses,
    /// Check how the table was written.
    CheckTable,
    /// Check that the profile is that of the measured robot.
    CheckRobot,
    /// Check which rows are left to identify from.
    CheckRows,
    /// Turn a left-handed frame of the instrument into a right-handed one.
    SwapAxes,
    /// Identify with the expected deviations as the prior.
    UsePrior,
    /// Identify all link constants, not only joint offsets.
    IdentifyGeometry,
    /// Provide measured points to verify with.
    VerifyPoints,
    /// Provide distances to verify with.
    VerifyDistances,
    /// Verify with poses that are not in the identification set.
    SeparateVerification,
    /// State the known distance between the two sockets of a position.
    StateSocketDistance,
    /// State where the target is, or identify it with the arm.
    StateTarget,
    /// Mount the target beside the axis that is turned.
    MountBesideAxis,
    /// Measure every target at identification poses too, or fit it to the verification.
    RefitTarget,
    /// Make the recording of a session again.
    RebuildRecording,
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StateSigma => "state 'instrument' in the profile",
            Self::StateLimits => {
                "state 'limits_deg' (or 'limits_mm') in the profile: poses are drawn from these ranges"
            }
            Self::NarrowRanges => "narrow 'planning_limits_deg' in the profile to one side of the cell",
            Self::OmitKind => "a plain list needs no 'kind' column: all its rows are then scored",
            Self::PlanPoses => "measure a planned pose set",
            Self::CheckTable => "check units, joint signs and row order",
            Self::CheckRobot => "check that the profile and the measurements belong to the same robot",
            Self::CheckRows => "check which rows are left to identify from",
            Self::SwapAxes => {
                "the instrument's frame is left-handed: reverse the sign of one coordinate axis, or swap two axes"
            }
            Self::UsePrior => "identify with the expected deviations as the prior",
            Self::IdentifyGeometry => "identify all link constants",
            Self::VerifyPoints | Self::VerifyDistances => "measure some verification poses",
            Self::SeparateVerification => "verify with poses that are not in the identification set",
            Self::StateSocketDistance => "state the distance between the sockets",
            Self::StateTarget => "state where the SMR is, or leave it free: it is then identified with the arm",
            Self::MountBesideAxis => {
                "mount the SMR beside the axis and state roughly where, state exactly where it is, or leave it free"
            }
            Self::RefitTarget => "measure it at identification poses too, or leave its samples out",
            Self::RebuildRecording => "it can be rebuilt from the journal at any time",
        })
    }
}
