//! Accuracy on samples that the identification did not see.
//!
//! Errors are measured − predicted. Position errors need the registration of the instrument, which comes from the identification
//! set (or, for another set-up, is fitted anew and said so); distance errors need none.

use nalgebra::{Isometry3, Point3, Vector3};

use super::linearise::{ArmModel, Weights, point_residuals};
use super::problem::{Observations, PointSample, Problem};
use super::{Estimator, IdentificationError, Prior, Settings, Weighting, identify};
use crate::kinematics::FreeParameter;
use crate::units::MILLIMETRE;

/// Above this many points the distances are taken between evenly picked ones: 2000 points have two million pairs.
const PAIRED_POINTS: usize = 2000;

/// Statistics of a non-negative error (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorStatistics {
    /// How many values.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// 95 % of the values are at most this (smallest such value of the sample).
    pub p95: f64,
    /// Largest.
    pub max: f64,
}

impl ErrorStatistics {
    /// Of absolute values; `None` for no value.
    pub fn new(mut values: Vec<f64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let count = values.len();
        values.iter_mut().for_each(|value| *value = value.abs());
        let mean = values.iter().sum::<f64>() / count as f64;
        let rms = (values.iter().map(|value| value * value).sum::<f64>() / count as f64).sqrt();
        let max = values.iter().copied().fold(0.0, f64::max);
        // Smallest order statistic that at least 95 % of the values do not exceed: index ⌈0.95 n⌉ − 1.
        let index = (95 * count).div_ceil(100).saturating_sub(1);
        let (_, p95, _) = values.select_nth_unstable_by(index, f64::total_cmp);
        Some(Self { count, mean, rms, p95: *p95, max })
    }
}

/// Errors of one model on one set of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelErrors {
    /// Measured − predicted per sample, in the robot base (m).
    pub vectors: Vec<Vector3<f64>>,
    /// Norm of the position errors.
    pub position: ErrorStatistics,
    /// Mean of the absolute error along x, y, z of the base (m) (table IV of the paper).
    pub axis_mean: [f64; 3],
    /// Largest absolute error along x, y, z (m) (table IV).
    pub axis_max: [f64; 3],
    /// Distance errors `|l_measured − l_predicted|` over pairs of samples of one station (table III); `None` below two samples.
    pub distance: Option<ErrorStatistics>,
}

impl ModelErrors {
    /// Errors of `model` on `samples` with the instrument at `base_from_station`; `None` without samples.
    pub fn new(model: &ArmModel, base_from_station: &[Isometry3<f64>], samples: &[PointSample]) -> Option<Self> {
        let predicted = model.points_in_base(samples.iter().map(|sample| &sample.at));
        let vectors: Vec<Vector3<f64>> = samples
            .iter()
            .zip(&predicted)
            .filter_map(|(sample, predicted)| Some(base_from_station.get(sample.station)? * sample.point - predicted))
            .collect();
        let position = ErrorStatistics::new(vectors.iter().map(Vector3::norm).collect())?;
        let over_axes = |fold: &dyn Fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|axis| vectors.iter().map(|vector| vector[axis].abs()).fold(0.0, fold))
        };
        let axis_mean = over_axes(&|sum, value| sum + value).map(|sum| sum / vectors.len() as f64);
        let axis_max = over_axes(&f64::max);
        let distance = distance_errors(samples, &predicted);
        Some(Self { vectors, position, axis_mean, axis_max, distance })
    }
}

/// Distance errors over all pairs of one station; evenly picked samples where there are more than 2000.
fn distance_errors(samples: &[PointSample], predicted: &[Point3<f64>]) -> Option<ErrorStatistics> {
    let used = samples.len().min(PAIRED_POINTS);
    let picked: Vec<usize> = (0..used).map(|index| index * samples.len() / used).collect();
    let mut errors = Vec::with_capacity(used * used.saturating_sub(1) / 2);
    for (position, &k) in picked.iter().enumerate() {
        for &j in &picked[..position] {
            if samples[j].station == samples[k].station {
                let measured = (samples[k].point - samples[j].point).norm();
                errors.push(measured - (predicted[k] - predicted[j]).norm());
            }
        }
    }
    ErrorStatistics::new(errors)
}

/// A model with the set-up (instrument frame, and target where it is free) fitted to some samples.
#[derive(Clone, Debug)]
pub struct FittedSetup {
    /// The model; only its targets may differ from what was given.
    pub model: ArmModel,
    /// Pose of each station in the base.
    pub base_from_station: Vec<Isometry3<f64>>,
}

/// Fits the instrument frame, and the target coordinates among `free`, of a given arm to samples. The arm is not changed.
///
/// `trusted` says which samples count. This is how a nominal model is compared fairly: it gets the same frame and target fit
/// as the identified one.
///
/// # Errors
/// Sizes or indices that do not fit, or a mirrored frame.
pub fn fit_setup(
    model: &ArmModel,
    free: &[FreeParameter],
    samples: &[PointSample],
    trusted: impl Fn(usize) -> bool,
) -> Result<FittedSetup, IdentificationError> {
    let points: Vec<PointSample> =
        samples.iter().enumerate().filter(|(index, _)| trusted(*index)).map(|(_, s)| s.clone()).collect();
    let observations = Observations { points, ..Observations::default() };
    let problem =
        Problem { chain: &model.chain, targets: &model.targets, parameters: free, observations: &observations };
    if free.is_empty() {
        problem.check()?;
        let predicted = model.points_in_base(observations.places());
        let weights = Weights::uniform(&problem, MILLIMETRE);
        let residuals = point_residuals(&problem, &predicted, &weights);
        return Ok(FittedSetup { model: model.clone(), base_from_station: residuals.base_from_station });
    }
    // The prior keeps directions in which the data do not show the target (a wrist that never turns) at their nominal value.
    let settings = Settings {
        weighting: Weighting::Covariance,
        prior: Prior::Expected,
        estimator: Estimator::LeastSquares,
        ..Settings::default()
    };
    let fitted = identify(&problem, &settings, &mut |_| {})?;
    Ok(FittedSetup { model: fitted.model, base_from_station: fitted.base_from_station })
}
