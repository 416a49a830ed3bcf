//! How much measured points scatter, in three parts: the instrument (stated), the readings of one pose among each other, and
//! what a pose has in common (repeatability, and what the model lacks), which is estimated and *added* to the others.
//!
//! Readings of one pose are not independent: what moved the arm moved it for all of them. So the mean of the k readings of a
//! group has the variance `σ_pose² + v/k`, and the prior is balanced against the sum, never against the instrument alone: with
//! the instrument alone, badly determined parameters follow what the model lacks.

use nalgebra::Vector3;

use super::Places;
use super::linearise::{SMALLEST_SIGMA, Trust};
use super::problem::{LengthEnd, Problem};
use crate::kinematics::Place;
use crate::units::MICROMETRE;

/// An estimate from no data counts as much as this many values.
const PRIOR_VALUES: f64 = 3.0;
/// The mean of a variance's posterior has this many values fewer in its denominator than there are. Error bars divided by it are
/// right on average although the variance itself is estimated (Student's t), where its most likely value would make them too small.
const OF_MEAN: f64 = 2.0;
/// Expected scatter of an arm and an instrument about which nothing is stated (m).
const EXPECTED: f64 = 20.0 * MICROMETRE;
/// No arm repeats better than this (m), however good the instrument is.
const REPEATABILITY: f64 = 10.0 * MICROMETRE;
/// A variance far below what any instrument sees (m²).
const NEGLIGIBLE: f64 = 1e-6 * SMALLEST_SIGMA * SMALLEST_SIGMA;
/// Residuals never confirm less than this part of a promised variance.
const LEAST_CONFIRMED: f64 = 1e-4;
/// Median of the square norm of three standard normal numbers.
const MEDIAN_SQUARE_3: f64 = 2.365_973_884_375_338;
/// Median of the square of a standard normal number.
const MEDIAN_SQUARE_1: f64 = 0.454_936_423_119_572_7;

/// Which places are readings of one pose.
#[derive(Clone, Debug)]
pub(crate) struct Groups {
    /// Group of each place that is a point or a seat.
    of_place: Vec<usize>,
    /// Pose of each group: groups of one configuration share what the arm does.
    pose: Vec<usize>,
    /// Station of the points of a group, or shared point after the stations.
    owner: Vec<usize>,
    stations: usize,
}

impl Groups {
    pub(crate) fn new(problem: &Problem<'_>) -> Self {
        let observations = problem.observations;
        let joints = problem.arm.chain.joints();
        let stations = observations.points.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
        let points = observations.points.iter().map(|sample| (&sample.at, sample.station));
        let seats = observations.shared.iter().enumerate();
        let seats = seats.flat_map(|(index, shared)| shared.at.iter().map(move |at| (at, stations + index)));
        let places: Vec<(&Place, usize)> = points.chain(seats).collect();
        let same_target = Places::new(joints, places.iter().map(|(at, _)| *at)).first_of_each();
        let without_target: Vec<Place> =
            places.iter().map(|(at, _)| Place { configuration: at.configuration.clone(), target: 0 }).collect();
        let same_pose = Places::new(joints, &without_target).first_of_each();
        let mut groups =
            Self { of_place: Vec::with_capacity(places.len()), pose: Vec::new(), owner: Vec::new(), stations };
        let mut known = std::collections::BTreeMap::new();
        for (place, (_, owner)) in places.iter().enumerate() {
            let group = *known.entry((same_target[place], *owner)).or_insert_with(|| {
                groups.pose.push(same_pose[place]);
                groups.owner.push(*owner);
                groups.owner.len() - 1
            });
            groups.of_place.push(group);
        }
        groups
    }

    /// Number of groups.
    pub(crate) fn len(&self) -> usize {
        self.owner.len()
    }

    /// Group of a place.
    pub(crate) fn of(&self, place: usize) -> usize {
        self.of_place[place]
    }

    /// Station of the points of a group, or its shared point, counted after the stations.
    pub(crate) fn owner(&self, group: usize) -> usize {
        self.owner[group]
    }

    /// The groups of each place that is a point or a seat.
    pub(crate) fn of_places(&self) -> &[usize] {
        &self.of_place
    }

    /// Which pose a group belongs to: the same number for all targets and stations of one configuration.
    pub(crate) fn pose(&self, group: usize) -> usize {
        self.pose[group]
    }
}

/// The variances (m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Of the instrument where a reading has none of its own; zero if nothing is stated.
    pub(crate) stated: f64,
    /// Of readings of one pose among each other, beyond what is stated.
    pub(crate) shot: f64,
    /// Of what a pose has in common.
    pub(crate) pose: f64,
    /// Part of the variance of readings that the residuals confirm, at most 1: an instrument that is better than stated.
    pub(crate) confirmed: f64,
}

impl Noise {
    /// Variance of a reading about its pose.
    pub(crate) fn of_reading(&self, own_sigma: Option<f64>) -> f64 {
        self.confirmed * self.promised(own_sigma)
    }

    /// Variance of a reading about its pose, as stated and as the readings of a pose show.
    pub(crate) fn promised(&self, own_sigma: Option<f64>) -> f64 {
        own_sigma.map_or(self.stated, |sigma| sigma.max(SMALLEST_SIGMA).powi(2)) + self.shot
    }

    /// Own σ of a place, where its reading has one.
    pub(crate) fn own_sigma(problem: &Problem<'_>, place: usize) -> Option<f64> {
        problem.observations.points.get(place).and_then(|sample| sample.sigma)
    }

    /// Variance of a length measured between two points, without that of shared points.
    pub(crate) fn of_length(&self, problem: &Problem<'_>, length: usize) -> f64 {
        let observations = problem.observations;
        let length = &observations.lengths[length];
        self.of_reading(length.sigma) + ends_that_move(problem, length) * self.pose
    }
}

/// How often the variance of a pose is in a length: the arm stands at one or both of its ends. A length without a σ, where nothing
/// else is measured, scatters as a whole.
fn ends_that_move(problem: &Problem<'_>, length: &super::Length) -> f64 {
    let ends = [&length.from, &length.to].into_iter().filter(|end| matches!(end, LengthEnd::Target(_))).count() as f64;
    let observations = problem.observations;
    let alone = observations.points.is_empty() && observations.shared.is_empty();
    if alone || (length.sigma.is_none() && ends == 0.0) { 1.0 } else { ends }
}

/// How the variance of poses is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Estimation {
    /// From the squares of the residuals.
    Efficient,
    /// From their median, while there may be outliers among them.
    Robust,
}

/// A residual of known size: of the mean of a group, or of a length.
#[derive(Clone, Copy, Debug)]
struct Residual {
    square: f64,
    values: f64,
    /// Promised variance beside that of the pose (m²).
    variance: f64,
    /// How often the variance of a pose is in it.
    poses: f64,
}

/// Trusted residuals, ready to estimate the variance of poses.
#[derive(Clone, Debug)]
pub(crate) struct Scatter {
    residuals: Vec<Residual>,
    /// Independent values among them: less those that the frames took.
    pub(crate) values: f64,
    /// Mean promised variance of a reading beside that of the pose.
    reading: f64,
    expected: f64,
}

impl Scatter {
    /// Of `of_places` (m, measured − predicted) and `of_lengths` (m).
    pub(crate) fn new(
        problem: &Problem<'_>,
        groups: &Groups,
        noise: &Noise,
        trust: &Trust,
        of_places: &[Vector3<f64>],
        of_lengths: &[f64],
    ) -> Self {
        let noise = &Noise { confirmed: 1.0, ..*noise };
        let means = GroupMeans::new(problem, groups, noise, trust, of_places);
        let mut frames = vec![0.0; groups.owner.iter().map(|owner| owner + 1).max().unwrap_or(0)];
        let mut residuals = Vec::with_capacity(groups.len());
        for group in (0..groups.len()).filter(|&group| means.count[group] > 0.0) {
            let square = means.residual[group].norm_squared();
            residuals.push(Residual { square, values: 3.0, variance: means.variance[group], poses: 1.0 });
            frames[groups.owner[group]] += 3.0;
        }
        let mut values = 0.0;
        for (owner, seen) in frames.iter().enumerate() {
            let taken: f64 = if owner < groups.stations { 6.0 } else { 3.0 };
            values += (seen - taken).max(0.0);
        }
        let scatters = |index: usize| {
            trust.lengths[index] > 0.0 && ends_that_move(problem, &problem.observations.lengths[index]) > 0.0
        };
        for (index, (length, residual)) in problem.observations.lengths.iter().zip(of_lengths).enumerate() {
            if scatters(index) {
                let variance = noise.of_reading(length.sigma);
                let poses = ends_that_move(problem, length);
                residuals.push(Residual { square: residual * residual, values: 1.0, variance, poses });
            }
        }
        values += problem.observations.length_values(scatters) as f64;
        let total: f64 = residuals.iter().map(|residual| residual.variance).sum();
        let reading = means.mean_reading.max(total / residuals.len().max(1) as f64);
        let is_stated = noise.stated > 0.0 || problem.observations.points.iter().any(|sample| sample.sigma.is_some());
        let expected = if is_stated { reading + REPEATABILITY.powi(2) } else { EXPECTED.powi(2) };
        Self { residuals, values, reading, expected }
    }

    /// Root mean square per value (m), with `determined` of the values taken by the parameters; `None` without a value left.
    pub(crate) fn root_mean_square(&self, determined: f64) -> Option<f64> {
        let freedom = self.values - determined;
        let square: f64 = self.residuals.iter().map(|residual| residual.square).sum();
        (freedom >= 1.0).then(|| (square / freedom).sqrt())
    }

    /// Root mean square in units of what is stated and what readings of one pose show, with `determined` of the values taken by the
    /// parameters; `None` without a value left, or where nothing is stated.
    pub(crate) fn normalised(&self, determined: f64) -> Option<f64> {
        let freedom = self.values - determined;
        let is_stated = self.residuals.iter().all(|residual| residual.variance > 0.0);
        (freedom >= 1.0 && is_stated).then(|| (self.chi_square(0.0, Estimation::Efficient) / freedom).sqrt())
    }

    /// Standard deviation of one reading (m) at some noise.
    pub(crate) fn of_reading(&self, noise: &Noise) -> f64 {
        (noise.pose + noise.confirmed * self.reading).sqrt()
    }

    /// The noise at which the residuals are as large as they should be, where the parameters took `determined` of the values, with
    /// a few values of the expected size beside them so that it cannot collapse: more than promised is the variance of poses (m²),
    /// and if there is less, only a part of the promised one is confirmed.
    pub(crate) fn noise(&self, at: &Noise, determined: f64, estimation: Estimation) -> Noise {
        let target = (self.values - determined).max(0.0) + PRIOR_VALUES - OF_MEAN;
        let sum = |pose: f64| self.chi_square(pose, estimation) + self.prior(pose);
        let as_promised = sum(NEGLIGIBLE);
        if as_promised <= target {
            // By an upper bound, one standard deviation of the sum above it: chance alone makes no instrument better. Outliers
            // among the residuals say nothing about that.
            let upper = (as_promised + (2.0 * target).sqrt()) / target;
            let is_judged = self.reading > 0.0 && estimation == Estimation::Efficient;
            let confirmed = if is_judged { upper.clamp(LEAST_CONFIRMED, 1.0) } else { 1.0 };
            return Noise { pose: 0.0, confirmed, ..*at };
        }
        let largest = self.residuals.iter().map(|residual| residual.square).fold(self.expected, f64::max);
        let pose = variance_where(largest * PRIOR_VALUES * self.values.max(1.0), |pose| sum(pose) > target);
        Noise { pose, confirmed: 1.0, ..*at }
    }

    fn prior(&self, pose: f64) -> f64 {
        PRIOR_VALUES * self.expected / (pose + self.reading)
    }

    fn chi_square(&self, pose: f64, estimation: Estimation) -> f64 {
        let normalised =
            |residual: &Residual| residual.square / (residual.poses * pose + residual.variance).max(f64::MIN_POSITIVE);
        match estimation {
            Estimation::Efficient => self.residuals.iter().map(normalised).sum(),
            Estimation::Robust => {
                let points = self.residuals.iter().filter(|residual| residual.values > 1.0);
                let mut squares: Vec<f64> = points.map(normalised).collect();
                let mut median_of_standard = MEDIAN_SQUARE_3 / 3.0;
                if squares.is_empty() {
                    squares = self.residuals.iter().map(normalised).collect();
                    median_of_standard = MEDIAN_SQUARE_1;
                }
                if squares.is_empty() {
                    return 0.0;
                }
                let middle = squares.len() / 2;
                let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
                *median / median_of_standard * self.values
            }
        }
    }
}

/// Means over the trusted readings of each group.
pub(crate) struct GroupMeans {
    /// Trusted readings.
    count: Vec<f64>,
    /// Measured − predicted (m); zero without a trusted reading.
    pub(crate) residual: Vec<Vector3<f64>>,
    /// Variance of the mean, beside that of the pose.
    variance: Vec<f64>,
    /// Mean variance of one reading.
    mean_reading: f64,
}

impl GroupMeans {
    pub(crate) fn new(
        problem: &Problem<'_>,
        groups: &Groups,
        noise: &Noise,
        trust: &Trust,
        of_places: &[Vector3<f64>],
    ) -> Self {
        let n = groups.len();
        let (mut count, mut residual, mut information) = (vec![0.0; n], vec![Vector3::zeros(); n], vec![0.0; n]);
        let mut weights = vec![0.0; n];
        let (mut sum, mut readings) = (0.0, 0.0);
        for (place, &group) in groups.of_places().iter().enumerate() {
            if trust.places[place] <= 0.0 {
                continue;
            }
            let variance = noise.of_reading(Noise::own_sigma(problem, place));
            // Without any scatter about the pose, readings count alike.
            let weight = if variance > 0.0 { 1.0 / variance } else { 1.0 };
            count[group] += 1.0;
            weights[group] += weight;
            residual[group] += of_places[place] * weight;
            information[group] += if variance > 0.0 { 1.0 / variance } else { f64::INFINITY };
            sum += variance;
            readings += 1.0;
        }
        for (residual, weight) in residual.iter_mut().zip(&weights).filter(|(_, weight)| **weight > 0.0) {
            *residual /= *weight;
        }
        let variance = information.iter().map(|information| 1.0 / information).collect();
        Self { count, residual, variance, mean_reading: sum / f64::max(readings, 1.0) }
    }
}

/// Variance of the readings of one pose among each other beyond what is stated (m²); zero without repetitions.
pub(crate) fn shot_variance(problem: &Problem<'_>, groups: &Groups, stated: f64, trust: &Trust) -> f64 {
    let points = &problem.observations.points;
    let trusted = |place: &usize| trust.places[*place] > 0.0;
    let mut mean = vec![(0.0, Vector3::zeros()); groups.len()];
    for place in (0..points.len()).filter(trusted) {
        let (count, sum) = &mut mean[groups.of(place)];
        *count += 1.0;
        *sum += points[place].point.coords;
    }
    let mut squares = Vec::new();
    let mut values = 0.0;
    for place in (0..points.len()).filter(trusted) {
        let (count, sum) = mean[groups.of(place)];
        if count > 1.0 {
            let own = points[place].sigma.map_or(stated, |sigma| sigma.max(SMALLEST_SIGMA).powi(2));
            squares.push(((points[place].point.coords - sum / count).norm_squared(), own));
            values += 3.0 * (count - 1.0) / count;
        }
    }
    if squares.is_empty() {
        return 0.0;
    }
    let own = squares.iter().map(|(_, own)| own).sum::<f64>() / squares.len() as f64;
    let expected = own.max(REPEATABILITY.powi(2));
    let excess = |shot: f64| {
        let chi: f64 = squares.iter().map(|(square, own)| square / (own + shot)).sum();
        chi + PRIOR_VALUES * expected / (own + shot) - (values + PRIOR_VALUES - OF_MEAN)
    };
    if excess(NEGLIGIBLE) <= 0.0 {
        return 0.0;
    }
    let total: f64 = squares.iter().map(|(square, _)| square).sum();
    variance_where(total + PRIOR_VALUES * expected, |shot| excess(shot) > 0.0)
}

/// The variance (m²) between a negligible one and `high` up to which residuals are too large, by bisection of its logarithm.
fn variance_where(mut high: f64, are_too_large: impl Fn(f64) -> bool) -> f64 {
    let mut low = NEGLIGIBLE;
    while high / low > 1.0 + 1e-9 {
        let middle = (low * high).sqrt();
        *(if are_too_large(middle) { &mut low } else { &mut high }) = middle;
    }
    (low * high).sqrt()
}

/// Trust over variance of each place, so that the rows of a group together weigh as much as their mean.
pub(crate) fn place_weights(problem: &Problem<'_>, groups: &Groups, noise: &Noise, trust: &Trust) -> Vec<f64> {
    let n = groups.len();
    let (mut count, mut information) = (vec![0.0; n], vec![0.0; n]);
    let of_place: Vec<f64> =
        (0..groups.of_places().len()).map(|place| noise.of_reading(Noise::own_sigma(problem, place))).collect();
    let inverse = |variance: f64| if variance > 0.0 { 1.0 / variance } else { 1.0 };
    for (place, &group) in groups.of_places().iter().enumerate() {
        if trust.places[place] > 0.0 {
            count[group] += 1.0;
            information[group] += inverse(of_place[place]);
        }
    }
    // Groups of one pose share the arm's error: each gets its part of what that pose tells.
    let mut sharing = vec![0.0; groups.of_places().len()];
    for group in (0..n).filter(|&group| count[group] > 0.0) {
        sharing[groups.pose(group)] += 1.0;
    }
    groups
        .of_places()
        .iter()
        .enumerate()
        .map(|(place, &group)| {
            let variance = of_place[place];
            if trust.places[place] <= 0.0 {
                return 0.0;
            }
            let of_mean = if variance > 0.0 { 1.0 / information[group] } else { 0.0 };
            let share = inverse(variance) / information[group];
            trust.places[place] * share / (noise.pose * sharing[groups.pose(group)] + of_mean).max(f64::MIN_POSITIVE)
        })
        .collect()
}
