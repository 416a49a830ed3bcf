//! The observations, linearised about an estimate: predicted points, their Jacobians, and the normal equations.
//!
//! Vectors and matrices over parameters follow the order of [`Problem::parameters`]. Places (where a target was observed)
//! follow [`super::Observations::places`]. A Jacobian of a place is stored as three rows of `n` numbers: x, y, z in the robot base.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, SymmetricEigen, Vector3};

use super::feature::Feature;
use super::lengths::{fitted_features, length_rows, length_values, remove_features};
use super::noise::{Groups, Noise, place_weights};
use super::problem::{LengthEnd, Problem};
use crate::geometry::register;
use crate::kinematics::{Arm, IdentificationJacobian};
use crate::units::MICROMETRE;

/// Predicted points and Jacobians of all places.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    /// Number of parameters.
    pub(crate) n: usize,
    /// Predicted positions in the base (m).
    pub(crate) points: Vec<Point3<f64>>,
    /// Jacobians: `3 n` numbers per place.
    pub(crate) rows: Vec<f64>,
}

impl Evaluation {
    pub(crate) fn new(problem: &Problem<'_>, arm: &Arm) -> Self {
        let arm = arm.prepared();
        let n = problem.parameters.len();
        let mut jacobian = IdentificationJacobian::new(&problem.parameter_ids());
        let places = problem.observations.places().count();
        let mut rows = vec![0.0; 3 * n * places];
        let mut points = Vec::with_capacity(places);
        for (index, at) in problem.observations.places().enumerate() {
            points.push(jacobian.at(&arm, at, &mut rows[3 * n * index..3 * n * (index + 1)]));
        }
        Self { n, points, rows }
    }

    /// Norm of the largest Jacobian column over all places, columns scaled by `scale`.
    pub(crate) fn largest_column(&self, scale: &[f64]) -> f64 {
        let mut squares = vec![0.0; self.n];
        for row in self.rows.chunks(self.n.max(1)) {
            for (sum, (value, scale)) in squares.iter_mut().zip(row.iter().zip(scale)) {
                *sum += (value * scale).powi(2);
            }
        }
        squares.into_iter().fold(0.0, f64::max).sqrt()
    }

    /// The three rows of a place.
    pub(super) fn place(&self, index: usize) -> &[f64] {
        &self.rows[3 * self.n * index..3 * self.n * (index + 1)]
    }
}

/// Which observations count.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trust {
    /// Factor per point and per seat of a shared point in 0 … 1: below one for a suspicious sample, zero for a rejected one.
    pub(crate) places: Vec<f64>,
    /// The same per measured length.
    pub(crate) lengths: Vec<f64>,
}

impl Trust {
    /// Every observation counts.
    pub(crate) fn full(problem: &Problem<'_>) -> Self {
        let observations = problem.observations;
        Self { places: vec![1.0; judged_places(problem)], lengths: vec![1.0; observations.lengths.len()] }
    }

    /// Trust of a sample, counted over places with a residual of their own and then lengths.
    pub(crate) fn of_sample(&self, sample: usize) -> f64 {
        self.places.iter().chain(&self.lengths).nth(sample).copied().unwrap_or(0.0)
    }

    /// Sets the trust of a sample, counted as in [`Self::of_sample`].
    pub(crate) fn set_sample(&mut self, sample: usize, value: f64) {
        if let Some(trust) = self.places.iter_mut().chain(&mut self.lengths).nth(sample) {
            *trust = value;
        }
    }

    /// Number of samples, and of those with trust.
    pub(crate) fn samples(&self) -> (usize, usize) {
        let all = self.places.iter().chain(&self.lengths);
        (all.clone().count(), all.filter(|trust| **trust > 0.0).count())
    }
}

/// Places with a residual vector of their own: points and seats of shared points.
pub(crate) fn judged_places(problem: &Problem<'_>) -> usize {
    problem.observations.points.len() + problem.observations.shared.iter().map(|shared| shared.at.len()).sum::<usize>()
}

/// How much each observation weighs: trust over variance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// Inverse variance of each coordinate of a point or seat (1/m²), zero for one that does not count.
    places: Vec<f64>,
    /// Variance of each measured length without that of shared points at its ends (m²), and its trust.
    lengths: Vec<(f64, f64)>,
}

/// No instrument is better than this (m). Smaller values, a σ typed in the wrong unit, would drown the expected deviations in
/// rounding errors.
pub(crate) const SMALLEST_SIGMA: f64 = 0.1 * MICROMETRE;

impl Weights {
    /// All alike, with the standard deviation `sigma` (m).
    pub(crate) fn uniform(problem: &Problem<'_>, sigma: f64) -> Self {
        Self::trusting(problem, &Trust::full(problem), sigma)
    }

    /// All that are trusted alike, with the standard deviation `sigma` (m).
    pub(crate) fn trusting(problem: &Problem<'_>, trust: &Trust, sigma: f64) -> Self {
        let of_length = |length: &super::Length| length.sigma.unwrap_or(sigma).max(SMALLEST_SIGMA).powi(2);
        let lengths = problem.observations.lengths.iter().zip(&trust.lengths);
        Self {
            places: trust.places.iter().map(|trust| trust / (sigma * sigma)).collect(),
            lengths: lengths.map(|(length, trust)| (of_length(length), *trust)).collect(),
        }
    }

    /// As their noise and trust have it.
    pub(crate) fn new(problem: &Problem<'_>, groups: &Groups, noise: &Noise, trust: &Trust) -> Self {
        let lengths = trust.lengths.iter().enumerate();
        Self {
            places: place_weights(problem, groups, noise, trust),
            lengths: lengths.map(|(index, trust)| (noise.of_length(problem, index), *trust)).collect(),
        }
    }

    /// Inverse variance of each coordinate of place `index` (1/m²).
    pub(crate) fn of_place(&self, index: usize) -> f64 {
        self.places[index]
    }

    /// Inverse variance of length `index` without that of shared points (1/m²).
    pub(super) fn of_length(&self, index: usize) -> f64 {
        let (variance, trust) = self.lengths[index];
        trust / variance.max(f64::MIN_POSITIVE)
    }

    /// The factor by which `other` weighs every place more; `None` if it is not the same for all.
    pub(crate) fn proportion_of(&self, other: &Self) -> Option<f64> {
        let weighed = other.places.iter().zip(&self.places).filter(|(a, b)| **a > 0.0 || **b > 0.0);
        let mut ratios = weighed.map(|(a, b)| a / b);
        let first = ratios.next().filter(|first| first.is_finite() && *first > 0.0)?;
        ratios.all(|ratio| (ratio / first - 1.0).abs() < PROPORTIONAL).then_some(first)
    }
}

/// Weights that differ by less than this have the same frames.
const PROPORTIONAL: f64 = 1e-9;

/// Normal equations of the linearised problem, without prior: `gram · δ = gradient`.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    /// `Σ w rᵀ r` over rows, n × n.
    pub(crate) gram: DMatrix<f64>,
    /// `Σ w rᵀ (measured − predicted)`.
    pub(crate) gradient: DVector<f64>,
    /// Weighted square sum of the residuals.
    pub(crate) cost: f64,
    /// Covariance of `gradient` where it differs from `gram` (rows that are not independent).
    pub(crate) gradient_covariance: Option<DMatrix<f64>>,
}

impl NormalEquations {
    fn zeros(n: usize) -> Self {
        Self { gram: DMatrix::zeros(n, n), gradient: DVector::zeros(n), cost: 0.0, gradient_covariance: None }
    }

    /// The same with every weight multiplied by `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.gram *= factor;
        self.gradient *= factor;
        self.cost *= factor;
    }
}

/// Frames and residuals of the measured points at an estimate.
#[derive(Clone, Debug, Default)]
pub(crate) struct PointResiduals {
    /// Pose of each station in the robot base; identity where a station has no point.
    pub(crate) base_from_station: Vec<Isometry3<f64>>,
    /// Measured − predicted in the base (m), per place that is a point or a seat of a shared point; zero for ends of lengths.
    pub(crate) of_places: Vec<Vector3<f64>>,
    /// Weighted centroid of the predicted points of each station (m).
    centroids: Vec<Point3<f64>>,
    /// Features where the predicted places have them; `None` for one that too few contacts show.
    pub(crate) features: Vec<Option<Feature>>,
}

impl PointResiduals {
    /// Weighted centroid of the predicted points of a station (m).
    pub(crate) fn centroid(&self, station: usize) -> Point3<f64> {
        self.centroids.get(station).copied().unwrap_or_else(Point3::origin)
    }
}

/// Registers every station, takes every shared point at its weighted mean and fits every feature: what the distances leave open.
pub(crate) fn point_residuals(problem: &Problem<'_>, points: &[Point3<f64>], weights: &Weights) -> PointResiduals {
    let samples = &problem.observations.points;
    let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
    let mut of_places = vec![Vector3::zeros(); points.len()];
    let mut base_from_station = vec![Isometry3::identity(); stations];
    let mut centroids = vec![Point3::origin(); stations];
    for station in 0..stations {
        let members = samples.iter().enumerate().filter(|(_, sample)| sample.station == station);
        let pairs = members.clone().map(|(index, sample)| (weights.of_place(index), points[index], sample.point));
        let Some(registration) = register(pairs) else { continue };
        centroids[station] = registration.centroid_from;
        let base_from = registration.to_from_from.inverse();
        base_from_station[station] = base_from;
        for (index, sample) in members {
            of_places[index] = base_from * sample.point - points[index];
        }
    }
    for range in shared_ranges(problem) {
        let mean = weighted_mean(weights, range.clone(), |index| points[index].coords);
        for index in range {
            of_places[index] = mean - points[index].coords;
        }
    }
    let features = fitted_features(problem, points, weights);
    PointResiduals { base_from_station, of_places, centroids, features }
}

/// Places of each shared point.
pub(super) fn shared_ranges(problem: &Problem<'_>) -> impl Iterator<Item = std::ops::Range<usize>> {
    problem.observations.shared.iter().scan(problem.observations.points.len(), |start, shared| {
        let range = *start..*start + shared.at.len();
        *start = range.end;
        Some(range)
    })
}

pub(super) fn weighted_mean(
    weights: &Weights,
    range: std::ops::Range<usize>,
    value: impl Fn(usize) -> Vector3<f64>,
) -> Vector3<f64> {
    let (mut total, mut sum) = (0.0, Vector3::zeros());
    for index in range {
        let weight = weights.of_place(index);
        total += weight;
        sum += value(index) * weight;
    }
    if total > 0.0 { sum / total } else { sum }
}

/// Rows of the Jacobian with their residuals, free of every frame, and what each weighs.
#[derive(Clone, Debug)]
pub(crate) struct ProjectedRows {
    /// Number of parameters.
    pub(crate) n: usize,
    /// `n` numbers per row: three rows per point or seat, then one per length.
    pub(crate) rows: Vec<f64>,
    /// Measured − predicted (m), one per row.
    pub(crate) residuals: Vec<f64>,
    /// Inverse variance (1/m²), one per row; zero where a sample does not count.
    pub(crate) weights: Vec<f64>,
    /// Variance of each length (m²), whether it counts or not.
    pub(crate) length_variances: Vec<f64>,
}

/// The position problem with the rigid motion of every station, every shared point, the place of every feature, and the turn of the
/// base under shared points projected out. For measured points this is exactly the distance problem weighted with the covariance of the pairs
/// (distances lose nothing but the frame).
///
/// About the centroid the columns of a shift and of a turn are orthogonal, so the projection needs no decomposition:
/// `B − mean(B)`, then `− (I⁻¹ Σ w r×B) × r` with the inertia I. Shared points do not see a turn of the base either; their
/// rows would show one of the size of the residuals, `ω × (p − mean)`, which means nothing.
pub(crate) fn project(
    problem: &Problem<'_>,
    evaluation: Evaluation,
    residuals: &PointResiduals,
    weights: &Weights,
) -> ProjectedRows {
    let n = evaluation.n;
    let (length_rows, length_residuals) = length_rows(problem, &evaluation, &residuals.features, weights);
    let Evaluation { mut rows, points, .. } = evaluation;
    let places = judged_places(problem);
    rows.truncate(3 * n * places);
    rows.extend(length_rows);
    let mut projected =
        ProjectedRows { n, rows, residuals: length_residuals, weights: Vec::new(), length_variances: Vec::new() };
    projected.project(problem, &points, residuals, weights);
    projected
}

impl ProjectedRows {
    /// Takes what the frames explain from the rows, for these weights; rows that were projected with others have lost nothing else,
    /// so they can be projected again.
    pub(crate) fn project(
        &mut self,
        problem: &Problem<'_>,
        points: &[Point3<f64>],
        residuals: &PointResiduals,
        weights: &Weights,
    ) {
        let n = self.n;
        let samples = &problem.observations.points;
        for (station, centroid) in residuals.centroids.iter().enumerate() {
            let members: Vec<usize> = (0..samples.len()).filter(|&index| samples[index].station == station).collect();
            let arms: Vec<Vector3<f64>> = members.iter().map(|&index| points[index] - centroid).collect();
            remove_mean(n, &mut self.rows, &members, weights);
            remove_turn(n, &mut self.rows, &members, &arms, weights);
        }
        let mut seats = Vec::new();
        for range in shared_ranges(problem) {
            let members: Vec<usize> = range.collect();
            remove_mean(n, &mut self.rows, &members, weights);
            seats.extend(members);
        }
        let arms: Vec<Vector3<f64>> = seats.iter().map(|&index| -residuals.of_places[index]).collect();
        remove_turn(n, &mut self.rows, &seats, &arms, weights);
        let places = judged_places(problem);
        self.residuals = residuals.of_places[..places].iter().flat_map(|residual| residual.iter().copied()).collect();
        let contacts = length_values(problem, points, &residuals.features, weights);
        self.residuals
            .extend(problem.observations.lengths.iter().zip(&contacts).map(|(length, at)| length.length - at.value));
        remove_features(n, &mut self.rows[3 * n * places..], problem, &contacts, weights);
        self.weigh(problem, weights);
    }

    /// Gives the rows other weights in the same proportion.
    pub(crate) fn weigh(&mut self, problem: &Problem<'_>, weights: &Weights) {
        self.weights.clear();
        self.length_variances.clear();
        self.weights.extend(weights.places.iter().flat_map(|weight| [*weight; 3]));
        let ranges: Vec<_> = shared_ranges(problem).collect();
        for (length, (variance, trust)) in problem.observations.lengths.iter().zip(&weights.lengths) {
            // A shared point is known only as the mean of its seats.
            let of_end = |end: &LengthEnd| match end {
                LengthEnd::Target(_) | LengthEnd::Feature { .. } => 0.0,
                LengthEnd::SharedPoint(shared) => {
                    let information: f64 = ranges[*shared].clone().map(|index| weights.of_place(index)).sum();
                    if information > 0.0 { 1.0 / information } else { 0.0 }
                }
            };
            let variance = (variance + of_end(&length.from) + of_end(&length.to)).max(f64::MIN_POSITIVE);
            self.length_variances.push(variance);
            self.weights.push(trust / variance);
        }
    }

    /// Residual vectors of points and seats (m), and residuals of lengths (m), after a change `delta` of the parameters.
    pub(crate) fn residuals_after(&self, lengths: usize, delta: &DVector<f64>) -> (Vec<Vector3<f64>>, Vec<f64>) {
        let after: Vec<f64> = if self.n == 0 {
            self.residuals.clone()
        } else {
            let rows = self.rows.chunks_exact(self.n);
            let change = |row: &[f64]| row.iter().zip(delta.iter()).map(|(row, delta)| row * delta).sum::<f64>();
            rows.zip(&self.residuals).map(|(row, residual)| residual - change(row)).collect()
        };
        let (places, of_lengths) = after.split_at(after.len() - lengths);
        (places.chunks_exact(3).map(Vector3::from_column_slice).collect(), of_lengths.to_vec())
    }
}

/// Takes the weighted mean of the Jacobians from each: a shift of all members.
fn remove_mean(n: usize, rows: &mut [f64], members: &[usize], weights: &Weights) {
    let mean = mean_rows(n, rows, members.iter().copied(), weights);
    for &index in members {
        for (value, mean) in rows[3 * n * index..3 * n * (index + 1)].iter_mut().zip(&mean) {
            *value -= mean;
        }
    }
}

/// Takes from the Jacobians what a common turn of all members about the origin of `arms` (m) explains.
fn remove_turn(n: usize, rows: &mut [f64], members: &[usize], arms: &[Vector3<f64>], weights: &Weights) {
    let mut inertia = Matrix3::zeros();
    let mut turn = vec![0.0; 3 * n];
    for (&index, r) in members.iter().zip(arms) {
        let weight = weights.of_place(index);
        inertia += (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * weight;
        let (bx, by, bz) = split_rows(&rows[3 * n * index..3 * n * (index + 1)], n);
        for c in 0..n {
            turn[c] += weight * (r.y * bz[c] - r.z * by[c]);
            turn[n + c] += weight * (r.z * bx[c] - r.x * bz[c]);
            turn[2 * n + c] += weight * (r.x * by[c] - r.y * bx[c]);
        }
    }
    let inverse = pseudo_inverse(&inertia);
    for c in 0..n {
        let omega = inverse * Vector3::new(turn[c], turn[n + c], turn[2 * n + c]);
        for (axis, value) in omega.iter().enumerate() {
            turn[axis * n + c] = *value;
        }
    }
    let (tx, ty, tz) = split_rows(&turn, n);
    for (&index, r) in members.iter().zip(arms) {
        let rows = &mut rows[3 * n * index..3 * n * (index + 1)];
        let (bx, rest) = rows.split_at_mut(n);
        let (by, bz) = rest.split_at_mut(n);
        for c in 0..n {
            bx[c] -= ty[c] * r.z - tz[c] * r.y;
            by[c] -= tz[c] * r.x - tx[c] * r.z;
            bz[c] -= tx[c] * r.y - ty[c] * r.x;
        }
    }
}

pub(super) fn mean_rows(n: usize, rows: &[f64], members: impl Iterator<Item = usize>, weights: &Weights) -> Vec<f64> {
    let mut mean = vec![0.0; 3 * n];
    let mut total = 0.0;
    for index in members {
        let weight = weights.of_place(index);
        total += weight;
        for (sum, value) in mean.iter_mut().zip(&rows[3 * n * index..3 * n * (index + 1)]) {
            *sum += weight * value;
        }
    }
    if total > 0.0 {
        for value in &mut mean {
            *value /= total;
        }
    }
    mean
}

pub(super) fn split_rows(rows: &[f64], n: usize) -> (&[f64], &[f64], &[f64]) {
    let (x, rest) = rows.split_at(n);
    let (y, z) = rest.split_at(n);
    (x, y, z)
}

/// Inverse of a symmetric 3 × 3 matrix, zero along directions without inertia (all points on one line).
fn pseudo_inverse(inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(*inertia);
    let largest = eigen.eigenvalues.amax();
    let inverse = eigen.eigenvalues.map(|value| if value > 1e-13 * largest { 1.0 / value } else { 0.0 });
    eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose()
}

impl ProjectedRows {
    /// Their normal equations, in blocks so that the transposed copy stays in cache.
    pub(crate) fn normal_equations(&self) -> NormalEquations {
        self.normal_equations_of(0..self.residuals.len())
    }

    /// Normal equations of some of the rows.
    pub(crate) fn normal_equations_of(&self, range: std::ops::Range<usize>) -> NormalEquations {
        const BLOCK: usize = 256;
        let n = self.n;
        let mut normal = NormalEquations::zeros(n);
        let mut start = range.start;
        while start < range.end {
            let end = range.end.min(start + BLOCK);
            let mut transposed = DMatrix::from_column_slice(n, end - start, &self.rows[n * start..n * end]);
            let mut residual = DVector::from_column_slice(&self.residuals[start..end]);
            for (index, weight) in self.weights[start..end].iter().enumerate() {
                let root = weight.sqrt();
                transposed.column_mut(index).scale_mut(root);
                residual[index] *= root;
            }
            if n > 0 {
                normal.gram.gemm(1.0, &transposed, &transposed.transpose(), 1.0);
                normal.gradient.gemv(1.0, &transposed, &residual, 1.0);
            }
            normal.cost += residual.norm_squared();
            start = end;
        }
        normal
    }

    /// The triangular factor R of the weighted rows with every column scaled by `scale` (n × n), by blocked Householder QR: same
    /// singular values as the rows, without squaring them.
    pub(crate) fn triangular_factor(&self, scale: &[f64]) -> DMatrix<f64> {
        const BLOCK: usize = 512;
        let n = self.n;
        let mut factor = DMatrix::zeros(0, n);
        for (rows, weights) in self.rows.chunks(BLOCK * n.max(1)).zip(self.weights.chunks(BLOCK)) {
            let above = factor.nrows();
            let mut stacked = DMatrix::zeros(above + weights.len(), n);
            stacked.rows_mut(0, above).copy_from(&factor);
            for (index, (row, weight)) in rows.chunks(n.max(1)).zip(weights).enumerate() {
                let root = weight.sqrt();
                for (column, (value, scale)) in row.iter().zip(scale).enumerate() {
                    stacked[(above + index, column)] = value * scale * root;
                }
            }
            factor = stacked.qr().unpack_r();
        }
        factor.resize_vertically(n, 0.0)
    }
}
