//! Accuracy on samples that the identification did not see.
//!
//! Errors are measured − predicted. Position errors need the registration of the instrument, which comes from the identification
//! set (or, for another set-up, is fitted again, which the result says); distance errors need none.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, Isometry3, Point3, Vector3};

use super::feature::Feature;
use super::linearise::{PointResiduals, Weights, point_residuals};
use super::problem::{LengthEnd, Observations, PointSample, Problem};
use super::{Estimator, Identification, IdentificationError, Length, Places, Prior, Settings, Weighting, identify};
use crate::geometry::{principal_spread, register};
use crate::kinematics::{Arm, ForwardKinematics, FreeParameter, Joint, JointType, Place};
use crate::units::MILLIMETRE;

/// Above this many points the distances are taken between evenly picked ones: 2000 points have two million pairs.
const PAIRED_POINTS: usize = 2000;

/// Points narrower than this part of their length are on a line, about which they do not show a rotation.
const ON_A_LINE: f64 = 0.05;

/// Statistics of a non-negative error ((m) or (rad)).
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
        for value in &mut values {
            *value = value.abs();
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let rms = (values.iter().map(|value| value * value).sum::<f64>() / count as f64).sqrt();
        let max = values.iter().copied().fold(0.0, f64::max);
        // Smallest order statistic that at least 95 % of the values do not exceed: index ⌈0.95 n⌉ − 1.
        let index = (95 * count).div_ceil(100).saturating_sub(1);
        let (_, p95, _) = values.select_nth_unstable_by(index, f64::total_cmp);
        Some(Self { count, mean, rms, p95: *p95, max })
    }
}

/// Errors of one arm on one set of samples.
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
    /// Distance errors `|l_measured − l_predicted|` over pairs of samples of one station (table III), but not between repetitions
    /// of a pose, whose distance is that of no two poses; `None` without a pair.
    pub distance: Option<ErrorStatistics>,
    /// The distance errors behind it.
    pub distances: Vec<DistanceError>,
    /// Orientation errors (rad) of poses at which at least three points of the flange were measured that are on no line; `None`
    /// without such a pose. Distances between points of a rigid body carry its orientation.
    pub orientation: Option<ErrorStatistics>,
    /// The orientation errors behind it.
    pub orientations: Vec<OrientationError>,
}

/// Error of the orientation of the flange in one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationError {
    /// Index of the first sample of the pose.
    pub sample: usize,
    /// Rotation from the predicted to the measured points, in the base (rad).
    pub vector: Vector3<f64>,
}

/// Error of the distance between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceError {
    /// Indices of the samples, small because there may be two million errors.
    pub samples: [u32; 2],
    /// Measured − predicted (m).
    pub error: f64,
}

impl ModelErrors {
    /// Errors of `arm` on `samples` with the instrument at `base_from_station`; `None` without samples.
    pub fn new(arm: &Arm, base_from_station: &[Isometry3<f64>], samples: &[PointSample]) -> Option<Self> {
        let predicted = arm.points_in_base(samples.iter().map(|sample| &sample.at));
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
        let distances = distance_errors(arm.chain.joints(), samples, &predicted);
        let distance = ErrorStatistics::new(distances.iter().map(|distance| distance.error).collect());
        let measured: Vec<Point3<f64>> =
            predicted.iter().zip(&vectors).map(|(predicted, error)| predicted + error).collect();
        let orientations = orientation_errors(arm.chain.joints(), samples, &predicted, &measured);
        let orientation = ErrorStatistics::new(orientations.iter().map(|error| error.vector.norm()).collect());
        Some(Self { vectors, position, axis_mean, axis_max, distance, distances, orientation, orientations })
    }
}

/// Rotations from the predicted to the measured points of each pose that shows its orientation.
fn orientation_errors(
    joints: &[Joint],
    samples: &[PointSample],
    predicted: &[Point3<f64>],
    measured: &[Point3<f64>],
) -> Vec<OrientationError> {
    if predicted.len() != samples.len() || measured.len() != samples.len() {
        return Vec::new();
    }
    let any_target: Vec<Place> = samples.iter().map(|sample| Place { target: 0, ..sample.at.clone() }).collect();
    let first = Places::new(joints, &any_target).first_of_each();
    let mut poses: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (index, (first, sample)) in first.into_iter().zip(samples).enumerate() {
        poses.entry((first, sample.station)).or_default().push(index);
    }
    let turned = |members: Vec<usize>| {
        let targets: BTreeSet<usize> = members.iter().map(|&index| samples[index].at.target).collect();
        let [long, wide, _] = principal_spread(members.iter().map(|&index| &predicted[index]));
        if targets.len() < 3 || wide <= ON_A_LINE * long {
            return None;
        }
        let pairs = members.iter().map(|&index| (1.0, predicted[index], measured[index]));
        let vector = register(pairs)?.to_from_from.rotation.scaled_axis();
        Some(OrientationError { sample: *members.first()?, vector })
    };
    poses.into_values().filter_map(turned).collect()
}

/// Distance errors over all pairs of one station that are no repetitions; evenly picked samples where there are more than 2000.
fn distance_errors(joints: &[Joint], samples: &[PointSample], predicted: &[Point3<f64>]) -> Vec<DistanceError> {
    let pose = Places::new(joints, samples.iter().map(|sample| &sample.at)).first_of_each();
    let used = samples.len().min(PAIRED_POINTS);
    let picked: Vec<usize> = (0..used).map(|index| index * samples.len() / used).collect();
    let mut errors = Vec::with_capacity(used * used.saturating_sub(1) / 2);
    for (position, &k) in picked.iter().enumerate() {
        for &j in &picked[..position] {
            if samples[j].station == samples[k].station && pose[j] != pose[k] {
                let measured = (samples[k].point - samples[j].point).norm();
                let error = measured - (predicted[k] - predicted[j]).norm();
                let samples = [j, k].map(|index| u32::try_from(index).unwrap_or(u32::MAX));
                errors.push(DistanceError { samples, error });
            }
        }
    }
    errors
}

/// Distance of every seat from the mean of its shared point (m), and the errors of lengths between shared points (m).
#[derive(Clone, Debug, PartialEq)]
pub struct DirectErrors {
    /// Predicted position of each seat less the mean of its shared point, in the base (m).
    pub seats: Vec<Vector3<f64>>,
    /// Index of the shared point of each seat.
    pub shared: Vec<usize>,
    /// Statistics of the distances of the seats from their mean; `None` without a shared point that was seen twice.
    pub seat: Option<ErrorStatistics>,
    /// Measured − predicted lengths (m).
    pub lengths: Vec<f64>,
    /// Their statistics; `None` without lengths.
    pub length: Option<ErrorStatistics>,
}

impl DirectErrors {
    /// Errors of `arm` on shared points and lengths, with the features where they were found with it.
    pub fn new(arm: &Arm, features: &[Option<Feature>], observations: &Observations) -> Self {
        let mut means = Vec::with_capacity(observations.shared.len());
        let (mut seats, mut of_shared) = (Vec::new(), Vec::new());
        for (index, shared) in observations.shared.iter().enumerate() {
            let points = arm.points_in_base(shared.at.iter());
            let sum = points.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords);
            let mean = Point3::from(sum / points.len().max(1) as f64);
            means.push(mean);
            if points.len() > 1 {
                seats.extend(points.iter().map(|point| point - mean));
                of_shared.extend(points.iter().map(|_| index));
            }
        }
        let end = |end: &LengthEnd| match end {
            LengthEnd::Target(at) => Some(arm.point_in_base(at)),
            LengthEnd::SharedPoint(index) => means.get(*index).copied(),
            LengthEnd::Feature { .. } => None,
        };
        let predicted = |length: &Length| {
            let ends = [end(&length.from), end(&length.to)];
            match (length.feature(), ends) {
                (Some((feature, component)), [from, to]) => {
                    Some(features.get(feature)?.as_ref()?.predicted(&from.or(to)?, component).value)
                }
                (None, [from, to]) => Some((to? - from?).norm()),
            }
        };
        let errors = observations.lengths.iter().filter_map(|length| Some(length.length - predicted(length)?));
        let lengths: Vec<f64> = errors.collect();
        Self::of_values(seats, of_shared, lengths)
    }

    /// The errors of both, as one set.
    #[must_use]
    pub fn pooled_with(&self, other: &Self) -> Self {
        let seats = self.seats.iter().chain(&other.seats).copied().collect();
        let lengths = self.lengths.iter().chain(&other.lengths).copied().collect();
        let next = self.shared.iter().max().map_or(0, |last| last + 1);
        let shared = self.shared.iter().copied().chain(other.shared.iter().map(|index| next + index)).collect();
        Self::of_values(seats, shared, lengths)
    }

    fn of_values(seats: Vec<Vector3<f64>>, shared: Vec<usize>, lengths: Vec<f64>) -> Self {
        Self {
            shared,
            seat: ErrorStatistics::new(seats.iter().map(Vector3::norm).collect()),
            length: ErrorStatistics::new(lengths.clone()),
            seats,
            lengths,
        }
    }
}

/// How much of the remaining error follows one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointResidual {
    /// Index of the joint.
    pub joint: usize,
    /// Share of the square error explained by `a + b cos q + c sin q` (revolute) or `a + b q + c q²` (prismatic) per
    /// component, less what chance explains; 0 … 1.
    pub explained: f64,
    /// Mean error over ranges of the joint: from, to (rad or m), count, mean norm (m).
    pub bins: Vec<(f64, f64, usize, f64)>,
}

/// Looks for a joint that the errors follow: gear harmonics, gravity, a wrong coupling. `vectors` are error vectors (m) at
/// `configurations`.
pub fn residual_against_joints(
    joints: &[Joint],
    configurations: &[&[f64]],
    vectors: &[Vector3<f64>],
) -> Vec<JointResidual> {
    const BINS: usize = 5;
    joints
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let values: Vec<f64> = configurations.iter().map(|configuration| configuration[index]).collect();
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let width = (high - low) / BINS as f64;
            let bins = if width > 0.0 {
                (0..BINS)
                    .map(|bin| {
                        let (from, to) = (low + bin as f64 * width, low + (bin + 1) as f64 * width);
                        let inside = |value: f64| value >= from && (value < to || bin + 1 == BINS);
                        let members: Vec<f64> = values
                            .iter()
                            .zip(vectors)
                            .filter(|(value, _)| inside(**value))
                            .map(|(_, vector)| vector.norm())
                            .collect();
                        let mean = members.iter().sum::<f64>() / members.len().max(1) as f64;
                        (from, to, members.len(), mean)
                    })
                    .collect()
            } else {
                Vec::new()
            };
            JointResidual { joint: index, explained: explained_share(joint.joint_type, &values, vectors), bins }
        })
        .collect()
}

fn explained_share(joint_type: JointType, values: &[f64], vectors: &[Vector3<f64>]) -> f64 {
    let count = values.len();
    if count < 8 {
        return 0.0;
    }
    let centre = values.iter().sum::<f64>() / count as f64;
    let regressors = DMatrix::from_fn(count, 3, |row, column| match (joint_type, column) {
        (_, 0) => 1.0,
        (JointType::Revolute, 1) => values[row].cos(),
        (JointType::Revolute, _) => values[row].sin(),
        (JointType::Prismatic, 1) => values[row] - centre,
        (JointType::Prismatic, _) => (values[row] - centre).powi(2),
    });
    let errors = DMatrix::from_fn(count, 3, |row, column| vectors[row][column]);
    let means = errors.row_mean();
    let total: f64 = errors.row_iter().map(|row| (row - &means).norm_squared()).sum();
    let svd = regressors.clone().svd(true, true);
    let Ok(coefficients) = svd.solve(&errors, 1e-9) else { return 0.0 };
    let left = (&errors - regressors * coefficients).norm_squared();
    if total <= 0.0 {
        return 0.0;
    }
    let adjusted = 1.0 - (left / (count - 3) as f64) / (total / (count - 1) as f64);
    adjusted.clamp(0.0, 1.0)
}

/// A part of a joint's range that one of the two sets covers and the other does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverageGap {
    /// Index of the joint.
    pub joint: usize,
    /// Range of the identification set (rad or m).
    pub identification: (f64, f64),
    /// Range of the verification set (rad or m).
    pub verification: (f64, f64),
    /// Whether it is the verification set that reaches further; otherwise it covers less than half.
    pub extrapolates: bool,
}

/// Compares the ranges of both sets joint by joint. A verification outside the identification range by more than a tenth of it
/// tests extrapolation; one that covers less than half of it leaves the rest untested.
pub fn coverage_gaps(joints: &[Joint], identification: &[&[f64]], verification: &[&[f64]]) -> Vec<CoverageGap> {
    let range = |set: &[&[f64]], joint: usize| {
        set.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), configuration| {
            (low.min(configuration[joint]), high.max(configuration[joint]))
        })
    };
    if identification.is_empty() || verification.is_empty() {
        return Vec::new();
    }
    (0..joints.len())
        .filter_map(|joint| {
            let (known, tested) = (range(identification, joint), range(verification, joint));
            let width = known.1 - known.0;
            // A tenth of the range, and never less than what a still joint wobbles.
            let margin = (0.1 * width).max(0.02);
            let extrapolates = tested.0 < known.0 - margin || tested.1 > known.1 + margin;
            let narrow = (tested.1.min(known.1) - tested.0.max(known.0)) < 0.5 * width - margin;
            (extrapolates || narrow).then_some(CoverageGap {
                joint,
                identification: known,
                verification: tested,
                extrapolates,
            })
        })
        .collect()
}

/// An arm with the set-up (instrument frame, and target where it is free) fitted to some samples.
#[derive(Clone, Debug)]
pub struct FittedSetup {
    /// The arm; only its targets may differ from what was given.
    pub arm: Arm,
    /// Pose of each station in the base.
    pub base_from_station: Vec<Isometry3<f64>>,
    /// Features of unknown place in the base.
    pub features: Vec<Option<Feature>>,
}

/// Fits the instrument frame, and the target coordinates among `free`, of a given arm to observations. The arm is not changed.
///
/// This is how a nominal arm is compared fairly: it gets the same frame and target fit as the identified one.
///
/// # Errors
/// Sizes or indices that do not fit, or a mirrored frame.
pub fn fit_setup(
    arm: &Arm,
    free: &[FreeParameter],
    observations: &Observations,
) -> Result<FittedSetup, IdentificationError> {
    let problem = Problem { arm, parameters: free, observations };
    problem.check()?;
    if free.is_empty() {
        let predicted = arm.points_in_base(observations.places());
        let weights = Weights::uniform(&problem, MILLIMETRE);
        let residuals = point_residuals(&problem, &predicted, &weights);
        let PointResiduals { base_from_station, features, .. } = residuals;
        return Ok(FittedSetup { arm: arm.clone(), base_from_station, features });
    }
    // The prior keeps directions in which the data do not show the target (a wrist that never turns) at their nominal value.
    let settings = Settings {
        weighting: Weighting::Covariance,
        prior: Prior::Expected,
        estimator: Estimator::LeastSquares,
        ..Settings::default()
    };
    let fitted = identify(&problem, &settings, &mut |_| {})?;
    let Identification { arm, base_from_station, features, .. } = fitted;
    Ok(FittedSetup { arm, base_from_station, features })
}

/// The arm with the targets of `samples` fitted to them where the poses of the instrument are known; `None` where a station is not.
pub fn fit_targets(arm: &Arm, base_from_station: &[Isometry3<f64>], samples: &[PointSample]) -> Option<FittedSetup> {
    let mut fitted = arm.clone();
    let forward = ForwardKinematics::new(&arm.chain);
    for (target, point) in fitted.targets.iter_mut().enumerate() {
        let of_target: Vec<Vector3<f64>> = samples
            .iter()
            .filter(|sample| sample.at.target == target)
            .map(|sample| {
                let in_base = base_from_station.get(sample.station)? * sample.point;
                Some(forward.base_from_flange(&sample.at.configuration).inverse_transform_point(&in_base).coords)
            })
            .collect::<Option<_>>()?;
        if !of_target.is_empty() {
            *point = Point3::from(of_target.iter().sum::<Vector3<f64>>() / of_target.len() as f64);
        }
    }
    Some(FittedSetup { arm: fitted, base_from_station: base_from_station.to_vec(), features: Vec::new() })
}
