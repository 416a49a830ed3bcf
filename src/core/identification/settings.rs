//! Settings of an identification, and what its steps and its end look like.
//!
//! The comments on the values of [`Weighting`], [`Prior`] and [`Estimator`] are the help of their options on the command line.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::text::{names_of_option, written_as_text};

/// Weighting of the pairs of points. The covariance costs O(M) and gives about 10 % better parameters than uniform weights, which
/// cost O(M²).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Weighting {
    /// With the covariance that distances really have
    #[default]
    Covariance,
    /// All pairs alike, as in the paper
    Uniform,
}

/// Prior on the deviations: zero mean with the expected deviations as standard deviations, or the minimum-norm solution in rad and
/// mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Prior {
    /// Deviations as the profile expects them
    #[default]
    Expected,
    /// Nothing; badly determined parameters may run away
    None,
}

names_of_option!(Weighting, Prior);
written_as_text!(Weighting, Prior);

/// Treatment of outliers: a robust loss finds them, or there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Find outliers, name them and leave them out
    #[default]
    Robust,
    /// Every sample counts
    LeastSquares,
}

/// Origin of the measurement σ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SigmaSource {
    /// Every reading has its own.
    Readings,
    /// The operator gave it.
    Option,
    /// The instrument of the profile.
    Instrument,
    /// Estimated from the residuals of this fit.
    Residuals,
    /// Nothing was stated and the data are too few to tell: a guess.
    Assumed,
}

/// How to identify.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Weighting of the pairs.
    pub weighting: Weighting,
    /// Prior on the deviations.
    pub prior: Prior,
    /// Treatment of outliers.
    pub estimator: Estimator,
    /// Largest number of solver steps; 1 is the paper's single linear step.
    pub iterations: usize,
    /// Standard deviation of a coordinate (m) and where it comes from; `None`: estimated from the residuals.
    pub sigma: Option<(f64, SigmaSource)>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            weighting: Weighting::default(),
            prior: Prior::default(),
            estimator: Estimator::default(),
            iterations: 100,
            sigma: None,
        }
    }
}

/// One step of the solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Cost after the step: weighted square sum of residuals plus the prior's share.
    pub cost: f64,
    /// Largest change of a parameter, in expected deviations.
    pub step: f64,
    /// Part of the step that was taken: 1 unless a whole one would have made things worse.
    pub part: f64,
    /// How far the step moves a prediction at most, in standard deviations of that prediction.
    pub decrement: f64,
}

/// Why the solver stopped. In every case but [`Self::NonFinite`] the parameters are the best found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TerminationReason {
    /// What is left of the step moves no prediction by more than a hundredth of its standard deviation.
    Converged,
    /// The allowed number of steps was taken; parameters are those after the last one.
    IterationLimit,
    /// No step lowers the cost although the gradient is not zero.
    NoImprovement,
    /// A number overflowed; parameters are not usable.
    NonFinite,
}
