//! Why nothing could be identified.

use thiserror::Error;

use crate::units::to_mm;

/// Misuse, or data from which nothing can be identified.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum IdentificationError {
    /// A parameter that the arm or its targets do not have.
    #[error("the arm has no parameter '{parameter}'")]
    UnknownParameter {
        /// Its name.
        parameter: String,
    },
    /// An expected deviation that is not a positive number.
    #[error("the expected deviation of '{parameter}' is {expected}; it must be positive")]
    ExpectedDeviation {
        /// Its name.
        parameter: String,
        /// What was given.
        expected: f64,
    },
    /// A configuration with the wrong number of joints.
    #[error("sample {sample} has {given} joint values; the arm has {joints} joints")]
    Joints {
        /// Index of the place.
        sample: usize,
        /// Values given.
        given: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// A target that does not exist.
    #[error("sample {sample} names target {target}; there are {targets}")]
    Target {
        /// Index of the place.
        sample: usize,
        /// Index given.
        target: usize,
        /// Number of targets.
        targets: usize,
    },
    /// NaN or infinity in the data.
    #[error("sample {sample} has a number that is not finite")]
    NotFinite {
        /// Index of the place.
        sample: usize,
    },
    /// A length that is not positive, or ends at a shared point that does not exist.
    #[error("measured length {length} is not usable (value {value} m)")]
    Length {
        /// Index of the length.
        length: usize,
        /// What was given (m).
        value: f64,
    },
    /// Nothing that a distance could be made of.
    #[error(
        "there is nothing to identify from: at least three measured points, a shared point seen twice, or a length are needed"
    )]
    NoData,
    /// No parameter is free.
    #[error("no parameter is free to be identified")]
    NoParameters,
    /// The minimum-norm solution needs a rank, and there is no clear gap.
    #[error(
        "the rank is not clear (largest gap in the singular values {gap:.1}); without a prior the solution would be a guess"
    )]
    RankUnclear {
        /// The largest ratio of neighbouring singular values that could have been the gap.
        gap: f64,
    },
    /// A covariance of what is known before the data that is none, or that does not fit the parameters.
    #[error("what is known before the data has no usable covariance")]
    Belief,
    /// The points fit only when mirrored.
    #[error(
        "the measured points are a mirror image of the robot's: residual {:.3} mm mirrored, {:.3} mm as given",
        to_mm(*mirrored), to_mm(*proper)
    )]
    Mirrored {
        /// Root mean square residual of the best proper registration (m).
        proper: f64,
        /// The same with one axis reversed (m).
        mirrored: f64,
    },
    /// The solver ran into numbers that are not finite.
    #[error("the solver ran into numbers that are not finite; the data do not describe this robot")]
    Diverged,
    /// Whoever watched the progress asked to stop.
    #[error("the identification was cancelled")]
    Cancelled,
}
