//! What can be wrong with a planning problem.

use thiserror::Error;

use crate::identification::IdentificationError;

/// Misuse, or a problem without a solution.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PlanningError {
    /// A box without joints.
    #[error("there is no joint to sample")]
    NoJoints,
    /// Limits in the wrong order, or not finite.
    #[error("the limits of joint {joint} are crossed or not finite: {low} to {high}")]
    CrossedLimits {
        /// Number of the joint, from 1.
        joint: String,
        /// Lower limit (rad) or (m).
        low: f64,
        /// Upper limit (rad) or (m).
        high: f64,
    },
    /// Limits that have nothing in common with those of the profile.
    #[error("{low} to {high} has nothing in common with the limits {} to {} of joint {joint}", limits.0, limits.1)]
    OutsideLimits {
        /// Number of the joint, from 1.
        joint: String,
        /// Lower limit asked for (rad) or (m).
        low: f64,
        /// Upper limit asked for (rad) or (m).
        high: f64,
        /// Limits of the joint (rad) or (m).
        limits: (f64, f64),
    },
    /// A joint that the arm does not have.
    #[error("there is no joint {joint}; the arm has {joints}")]
    UnknownJoint {
        /// Number asked for, from 1.
        joint: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// Nothing to identify.
    #[error("no parameter is free: there is nothing to plan for")]
    NoParameters,
    /// Too few fresh poses to predict at.
    #[error("{given} fresh poses are too few to predict the error at; at least {needed} are needed")]
    FreshPoses {
        /// Poses given.
        given: usize,
        /// Fewest poses.
        needed: usize,
    },
    /// The pool or the model is not usable for identification.
    #[error("the candidates are not usable")]
    Candidates(#[source] IdentificationError),
    /// The singular values of the whole pool have no clear gap.
    #[error(
        "the rank is not clear: the largest gap between singular values of all candidates together is a factor of {gap:.0}"
    )]
    RankUnclear {
        /// Ratio of the neighbouring singular values.
        gap: f64,
    },
    /// Distances say nothing about the free parameters.
    #[error("distances cannot find any of the {parameters} free parameters")]
    NothingIdentifiable {
        /// Free parameters.
        parameters: usize,
    },
    /// Fewer poses than the rank needs.
    #[error(
        "{poses} poses are too few: {parameters} parameters have {rank} combinations that distances can find; with the 6 of the \
         tracker's frame that is {} unknowns at 3 coordinates per pose, so at least {needed} poses are needed",
        rank + 6
    )]
    TooFewPoses {
        /// Poses asked for.
        poses: usize,
        /// Free parameters.
        parameters: usize,
        /// Combinations of parameters that distances can find.
        rank: usize,
        /// Fewest poses.
        needed: usize,
    },
    /// More poses than candidates.
    #[error(
        "{poses} poses were asked for, but there are only {candidates} candidates; relax a filter or add candidates"
    )]
    TooFewCandidates {
        /// Poses asked for.
        poses: usize,
        /// Candidates that passed.
        candidates: usize,
    },
    /// A pose of the set that is not in the pool.
    #[error("pose {pose} is not in the pool of {candidates} candidates")]
    UnknownCandidate {
        /// Index given.
        pose: usize,
        /// Candidates in the pool.
        candidates: usize,
    },
    /// A pose that is in the set twice.
    #[error("pose {pose} is in the set twice")]
    RepeatedPose {
        /// Its index in the pool.
        pose: usize,
    },
    /// More fixed poses than poses.
    #[error("{required} poses must be in the set, but it may have only {poses}")]
    TooManyRequired {
        /// Poses that must be in.
        required: usize,
        /// Poses asked for.
        poses: usize,
    },
    /// The set cannot determine what the pool can.
    #[error("the {poses} poses do not determine all {rank} combinations of parameters that the candidates could")]
    Singular {
        /// Poses of the set.
        poses: usize,
        /// Combinations of parameters that distances can find.
        rank: usize,
    },
}
