//! Why a procedure has no result, and what can be done about it.

use thiserror::Error;

use crate::identification::IdentificationError;
use crate::identification::circle_point::{CircleError, CirclePointError};
use crate::planning::candidates::TooFewCandidates;
use crate::planning::order::OrderError;
use crate::planning::{CellError, PlanningError};
use crate::session::advice::Advice;
use crate::text;

/// Why a procedure has no result.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProcedureError {
    /// A joint without a range to plan in.
    #[error("joint '{joint}' has no limits in profile '{profile}'")]
    NoLimits { joint: String, profile: String },
    /// A profile without a target.
    #[error("the profile has no target")]
    NoTarget,
    /// A cell that makes no sense.
    #[error(transparent)]
    Cell(#[from] CellError),
    /// Too few configurations can be measured.
    #[error(transparent)]
    Candidates(#[from] TooFewCandidates),
    /// No set of poses can be chosen or scored.
    #[error(transparent)]
    Planning(#[from] PlanningError),
    /// An earlier calibration that does not tell enough.
    #[error(transparent)]
    Earlier(#[from] super::known::KnownError),
    /// New points that cannot be compared with an earlier calibration.
    #[error(transparent)]
    Compared(#[from] super::health::HealthError),
    /// No order of the poses can be followed.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// No configuration can serve as home.
    #[error("the arm touches something in every configuration within its planning limits")]
    NoHome,
    /// Every selection contained poses that cannot be reached.
    #[error("the poses cannot be visited without a collision")]
    Unreachable,
    /// A list without poses to score.
    #[error("none of the {rows} rows of '{name}' is of kind 'identification'")]
    NothingToScore { rows: usize, name: String },
    /// No circle of this joint can be planned.
    #[error(transparent)]
    Circles(#[from] CirclePointError),
    /// The target is on the axis, or too close to it.
    #[error("where the profile has the SMR, turning {joint} gives no circle")]
    NoCircle {
        joint: String,
        #[source]
        source: CircleError,
    },
    /// Circles that would all end in a collision.
    #[error("the arm cannot turn its last two joints far enough anywhere in its cell without touching something")]
    NoFreeCircles,
    /// Moves of the joint check that would all end in a collision.
    #[error("the arm cannot move each of its joints by a few degrees anywhere in its cell without touching something")]
    NoFreeMoves,
    /// A known mistake explains the points better than this robot does.
    #[error("{gap}: {mistake}")]
    Mistaken {
        /// How far the points are from the nominal robot, in words.
        gap: String,
        mistake: String,
    },
    /// Too few positions to leave one out.
    #[error("leaving one position out needs at least two positions")]
    OnePosition,
    /// Targets that only the verification has.
    #[error(
        "only the verification has {} of {}, whose position in the flange is not exactly known: its errors would be those of the guess in the profile",
        if .0.len() == 1 { "samples" } else { "those" }, text::listed(.0)
    )]
    UnknownTargets(Vec<String>),
    /// Samples and parameters that would take more memory than a computer should give.
    #[error(
        "{samples} samples with {parameters} parameters would take about {gigabytes:.0} GB of memory, and at most {most:.0} GB are used: identify from fewer samples, or the geometry alone"
    )]
    TooLarge {
        samples: usize,
        parameters: usize,
        /// What they would take (GB).
        gigabytes: f64,
        /// What is used at most (GB).
        most: f64,
    },
    /// Nothing can be identified.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
}

/// Where the cause of a [`ProcedureError`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The profile, the measurements or the request.
    Input,
    /// The numbers: there is no usable solution.
    Numerical,
}

impl ProcedureError {
    /// Where the cause is.
    pub const fn kind(&self) -> ErrorKind {
        match self {
            Self::Identification(
                IdentificationError::RankUnclear { .. }
                | IdentificationError::Diverged
                | IdentificationError::Cancelled,
            ) => ErrorKind::Numerical,
            _ => ErrorKind::Input,
        }
    }

    /// What can be done about it, the best first.
    pub const fn advice(&self) -> &'static [Advice] {
        match self {
            Self::NoLimits { .. } => &[Advice::StateLimits],
            Self::Unreachable => &[Advice::NarrowRanges],
            Self::NothingToScore { .. } => &[Advice::OmitKind],
            Self::Circles(_) | Self::NoFreeCircles | Self::NoFreeMoves => &[Advice::StateTarget],
            Self::NoCircle { .. } => &[Advice::MountBesideAxis],
            Self::Identification(error) => match error {
                IdentificationError::RankUnclear { .. } => &[Advice::UsePrior, Advice::PlanPoses],
                IdentificationError::Diverged => &[Advice::CheckTable, Advice::UsePrior],
                IdentificationError::Mirrored { .. } => &[Advice::SwapAxes],
                IdentificationError::NoData => &[Advice::CheckRows],
                IdentificationError::Cancelled => &[],
                _ => &[Advice::CheckRobot],
            },
            Self::UnknownTargets(_) => &[Advice::RefitTarget],
            Self::NoTarget
            | Self::Cell(_)
            | Self::Candidates(_)
            | Self::Planning(_)
            | Self::Order(_)
            | Self::NoHome
            | Self::Mistaken { .. }
            | Self::Earlier(_)
            | Self::Compared(_)
            | Self::TooLarge { .. }
            | Self::OnePosition => &[],
        }
    }
}
