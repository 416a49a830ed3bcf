//! How an identification is asked for, and what its steps and its end look like.

/// How pairs of points are weighted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weighting {
    /// With the covariance that pairs really have: cost O(M), about 10 % better parameters.
    #[default]
    Covariance,
    /// All pairs alike, as the paper has it: cost O(M²).
    Uniform,
}

/// What is assumed about the deviations before measuring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prior {
    /// Zero mean, expected deviations as standard deviations.
    #[default]
    Expected,
    /// Nothing: the minimum-norm solution in rad and mm, as in the paper. Badly determined parameters may run away.
    None,
}

/// How samples are trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Outliers are found with a robust loss, named and removed.
    #[default]
    Robust,
    /// Every sample counts.
    LeastSquares,
}

/// Where the measurement σ comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Damping that was needed, relative to the diagonal of the normal matrix.
    pub damping: f64,
    /// The step could not be expected to lower the cost any more.
    pub negligible: bool,
}

/// Why the solver stopped. In every case but [`Self::NonFinite`] the parameters are the best found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TerminationReason {
    /// The step or the expected decrease of the cost became negligible.
    Converged,
    /// The allowed number of steps was taken; parameters are those after the last one.
    IterationLimit,
    /// No step lowers the cost although the gradient is not zero.
    NoImprovement,
    /// A number overflowed; parameters are not usable.
    NonFinite,
}
