//! The observations, linearised about an estimate: predicted points, their Jacobians, and the normal equations.
//!
//! Vectors and matrices over parameters follow the order of [`Problem::parameters`]. Places (where a target was observed)
//! follow [`super::Observations::places`]. A Jacobian of a place is stored as three rows of `n` numbers: x, y, z in the robot base.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, SymmetricEigen, Vector3};

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
    fn place(&self, index: usize) -> &[f64] {
        &self.rows[3 * self.n * index..3 * self.n * (index + 1)]
    }
}

/// How much each observation counts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// Standard deviation of a coordinate (m) where the reading has none.
    pub(crate) sigma: f64,
    /// Factor per place in 0 … 1: below one for a suspicious sample, zero for a rejected one.
    pub(crate) trust: Vec<f64>,
    /// The same per measured length.
    pub(crate) length_trust: Vec<f64>,
}

/// No instrument is better than this (m). Smaller values, a σ typed in the wrong unit, would drown the expected deviations in
/// rounding errors.
pub(crate) const SMALLEST_SIGMA: f64 = 0.1 * MICROMETRE;

impl Weights {
    pub(crate) fn uniform(problem: &Problem<'_>, sigma: f64) -> Self {
        let observations = problem.observations;
        Self {
            sigma,
            trust: vec![1.0; observations.places().count()],
            length_trust: vec![1.0; observations.lengths.len()],
        }
    }

    /// Standard deviation of a coordinate of place `index` (m): of its reading, else the common one.
    pub(crate) fn sigma_of(&self, problem: &Problem<'_>, index: usize) -> f64 {
        let reading = problem.observations.points.get(index).and_then(|sample| sample.sigma);
        reading.map_or(self.sigma, |sigma| sigma.max(SMALLEST_SIGMA))
    }

    /// Trust of a sample, counted over places with a residual of their own and then lengths.
    pub(crate) fn of_sample(&self, sample: usize, places: usize) -> f64 {
        let trust = if sample < places { self.trust.get(sample) } else { self.length_trust.get(sample - places) };
        trust.copied().unwrap_or(0.0)
    }

    /// Sets the trust of a sample, counted as in [`Self::of_sample`].
    pub(crate) fn set_sample(&mut self, sample: usize, places: usize, value: f64) {
        let trust =
            if sample < places { self.trust.get_mut(sample) } else { self.length_trust.get_mut(sample - places) };
        if let Some(trust) = trust {
            *trust = value;
        }
    }

    /// Number of samples with trust, counted as in [`Self::of_sample`].
    pub(crate) fn accepted(&self, places: usize) -> usize {
        self.trust.iter().take(places).chain(&self.length_trust).filter(|trust| **trust > 0.0).count()
    }

    /// Inverse variance of each coordinate of place `index`.
    fn of_place(&self, problem: &Problem<'_>, index: usize) -> f64 {
        self.trust[index] / self.sigma_of(problem, index).powi(2)
    }
}

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
}

/// Frames and residuals of the measured points at an estimate.
#[derive(Clone, Debug)]
pub(crate) struct PointResiduals {
    /// Pose of each station in the robot base; identity where a station has no point.
    pub(crate) base_from_station: Vec<Isometry3<f64>>,
    /// Measured − predicted in the base (m), per place that is a point or a seat of a shared point; zero for ends of lengths.
    pub(crate) of_places: Vec<Vector3<f64>>,
    /// Weighted centroid of the predicted points of each station (m).
    centroids: Vec<Point3<f64>>,
}

/// Registers every station and takes every shared point at its weighted mean: what the distances leave open.
pub(crate) fn point_residuals(problem: &Problem<'_>, points: &[Point3<f64>], weights: &Weights) -> PointResiduals {
    let samples = &problem.observations.points;
    let stations = samples.iter().map(|sample| sample.station + 1).max().unwrap_or(0);
    let mut of_places = vec![Vector3::zeros(); points.len()];
    let mut base_from_station = vec![Isometry3::identity(); stations];
    let mut centroids = vec![Point3::origin(); stations];
    for station in 0..stations {
        let members = samples.iter().enumerate().filter(|(_, sample)| sample.station == station);
        let pairs =
            members.clone().map(|(index, sample)| (weights.of_place(problem, index), points[index], sample.point));
        let Some(registration) = register(pairs) else { continue };
        centroids[station] = registration.centroid_from;
        let base_from = registration.to_from_from.inverse();
        base_from_station[station] = base_from;
        for (index, sample) in members {
            of_places[index] = base_from * sample.point - points[index];
        }
    }
    for range in shared_ranges(problem) {
        let mean = weighted_mean(problem, weights, range.clone(), |index| points[index].coords);
        for index in range {
            of_places[index] = mean - points[index].coords;
        }
    }
    PointResiduals { base_from_station, of_places, centroids }
}

/// Places of each shared point.
fn shared_ranges(problem: &Problem<'_>) -> impl Iterator<Item = std::ops::Range<usize>> {
    problem.observations.shared.iter().scan(problem.observations.points.len(), |start, shared| {
        let range = *start..*start + shared.at.len();
        *start = range.end;
        Some(range)
    })
}

fn weighted_mean(
    problem: &Problem<'_>,
    weights: &Weights,
    range: std::ops::Range<usize>,
    value: impl Fn(usize) -> Vector3<f64>,
) -> Vector3<f64> {
    let (mut total, mut sum) = (0.0, Vector3::zeros());
    for index in range {
        let weight = weights.of_place(problem, index);
        total += weight;
        sum += value(index) * weight;
    }
    if total > 0.0 { sum / total } else { sum }
}

/// Weighted rows `√w · r` with their residuals `√w · (measured − predicted)`, free of every frame.
#[derive(Clone, Debug)]
pub(crate) struct ProjectedRows {
    /// Number of parameters.
    pub(crate) n: usize,
    /// `n` numbers per row.
    pub(crate) rows: Vec<f64>,
    /// One residual per row.
    pub(crate) residuals: Vec<f64>,
}

/// The position problem with the rigid motion of every station, every shared point, and the turn of the base under shared
/// points projected out. For measured points this is exactly the distance problem weighted with the covariance of the pairs
/// (distances lose nothing but the frame).
///
/// About the centroid the columns of a shift and of a turn are orthogonal, so the projection needs no decomposition:
/// `B − mean(B)`, then `− (I⁻¹ Σ w r×B) × r` with the inertia I. Shared points do not see a turn of the base either; their
/// rows would show one of the size of the residuals, `ω × (p − mean)`, which means nothing.
///
/// What is projected out is fitted with `weights`; the rows themselves are multiplied by the weights of `scale`, which is the
/// same except where samples that do not count are to be judged.
pub(crate) fn project(
    problem: &Problem<'_>,
    mut evaluation: Evaluation,
    residuals: &PointResiduals,
    weights: &Weights,
    scale: &Weights,
) -> ProjectedRows {
    let n = evaluation.n;
    let lengths = length_rows(problem, &evaluation, weights, scale);
    let samples = &problem.observations.points;
    for (station, centroid) in residuals.centroids.iter().enumerate() {
        let members: Vec<usize> = (0..samples.len()).filter(|&index| samples[index].station == station).collect();
        let arms: Vec<Vector3<f64>> = members.iter().map(|&index| evaluation.points[index] - centroid).collect();
        remove_mean(problem, &mut evaluation, &members, weights);
        remove_turn(problem, &mut evaluation, &members, &arms, weights);
    }
    let mut seats = Vec::new();
    for range in shared_ranges(problem) {
        let members: Vec<usize> = range.collect();
        remove_mean(problem, &mut evaluation, &members, weights);
        seats.extend(members);
    }
    let arms: Vec<Vector3<f64>> = seats.iter().map(|&index| -residuals.of_places[index]).collect();
    remove_turn(problem, &mut evaluation, &seats, &arms, weights);
    let independent = samples.len() + seats.len();
    let Evaluation { mut rows, .. } = evaluation;
    rows.truncate(3 * n * independent);
    let mut values = Vec::with_capacity(3 * independent + lengths.residuals.len());
    for index in 0..independent {
        let root = scale.of_place(problem, index).sqrt();
        for value in &mut rows[3 * n * index..3 * n * (index + 1)] {
            *value *= root;
        }
        values.extend(residuals.of_places[index].iter().map(|value| value * root));
    }
    rows.extend(lengths.rows);
    values.extend(lengths.residuals);
    ProjectedRows { n, rows, residuals: values }
}

/// Takes the weighted mean of the Jacobians from each: a shift of all members.
fn remove_mean(problem: &Problem<'_>, evaluation: &mut Evaluation, members: &[usize], weights: &Weights) {
    let n = evaluation.n;
    let mean = mean_rows(problem, evaluation, members.iter().copied(), weights);
    for &index in members {
        for (value, mean) in evaluation.rows[3 * n * index..3 * n * (index + 1)].iter_mut().zip(&mean) {
            *value -= mean;
        }
    }
}

/// Takes from the Jacobians what a common turn of all members about the origin of `arms` (m) explains.
fn remove_turn(
    problem: &Problem<'_>,
    evaluation: &mut Evaluation,
    members: &[usize],
    arms: &[Vector3<f64>],
    weights: &Weights,
) {
    let n = evaluation.n;
    let mut inertia = Matrix3::zeros();
    let mut turn = vec![0.0; 3 * n];
    for (&index, r) in members.iter().zip(arms) {
        let weight = weights.of_place(problem, index);
        inertia += (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * weight;
        let (bx, by, bz) = split_rows(evaluation.place(index), n);
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
        let rows = &mut evaluation.rows[3 * n * index..3 * n * (index + 1)];
        let (bx, rest) = rows.split_at_mut(n);
        let (by, bz) = rest.split_at_mut(n);
        for c in 0..n {
            bx[c] -= ty[c] * r.z - tz[c] * r.y;
            by[c] -= tz[c] * r.x - tx[c] * r.z;
            bz[c] -= tx[c] * r.y - ty[c] * r.x;
        }
    }
}

fn mean_rows(
    problem: &Problem<'_>,
    evaluation: &Evaluation,
    members: impl Iterator<Item = usize>,
    weights: &Weights,
) -> Vec<f64> {
    let mut mean = vec![0.0; 3 * evaluation.n];
    let mut total = 0.0;
    for index in members {
        let weight = weights.of_place(problem, index);
        total += weight;
        for (sum, value) in mean.iter_mut().zip(evaluation.place(index)) {
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

fn split_rows(rows: &[f64], n: usize) -> (&[f64], &[f64], &[f64]) {
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

/// Rows of the measured lengths: `u · (B_to − B_from)`, equations (16) and (21) with a measured length.
pub(crate) fn length_rows(
    problem: &Problem<'_>,
    evaluation: &Evaluation,
    weights: &Weights,
    scale: &Weights,
) -> ProjectedRows {
    let n = evaluation.n;
    let observations = problem.observations;
    let ranges: Vec<_> = shared_ranges(problem).collect();
    let mut next_place =
        observations.points.len() + observations.shared.iter().map(|shared| shared.at.len()).sum::<usize>();
    let mut system = ProjectedRows { n, rows: Vec::new(), residuals: Vec::new() };
    for (index, length) in observations.lengths.iter().enumerate() {
        let mut end = |end: &LengthEnd| match end {
            LengthEnd::Target(_) => {
                let index = next_place;
                next_place += 1;
                (evaluation.points[index].coords, evaluation.place(index).to_vec(), 0.0)
            }
            LengthEnd::SharedPoint(shared) => {
                let range = ranges[*shared].clone();
                let point = weighted_mean(problem, weights, range.clone(), |index| evaluation.points[index].coords);
                let information: f64 = range.clone().map(|index| weights.of_place(problem, index)).sum();
                let variance = if information > 0.0 { 1.0 / information } else { 0.0 };
                (point, mean_rows(problem, evaluation, range, weights), variance)
            }
        };
        let (from, from_rows, from_variance) = end(&length.from);
        let (to, to_rows, to_variance) = end(&length.to);
        let difference = to - from;
        let predicted = difference.norm();
        // Two points on top of each other have no direction to differentiate along.
        let u = if predicted > f64::EPSILON { difference / predicted } else { Vector3::zeros() };
        // A shared point is known only as the mean of its seats.
        let sigma = length.sigma.unwrap_or(weights.sigma);
        let sigma = sigma.max(SMALLEST_SIGMA);
        let root = (scale.length_trust[index] / (sigma * sigma + from_variance + to_variance)).sqrt();
        let (fx, fy, fz) = split_rows(&from_rows, n);
        let (tx, ty, tz) = split_rows(&to_rows, n);
        for c in 0..n {
            let row = u.x * (tx[c] - fx[c]) + u.y * (ty[c] - fy[c]) + u.z * (tz[c] - fz[c]);
            system.rows.push(root * row);
        }
        system.residuals.push(root * (length.length - predicted));
    }
    system
}

impl ProjectedRows {
    /// Their normal equations, in blocks so that the transposed copy stays in cache.
    pub(crate) fn normal_equations(&self) -> NormalEquations {
        const BLOCK: usize = 256;
        let mut normal = NormalEquations::zeros(self.n);
        if self.n == 0 {
            normal.cost = self.residuals.iter().map(|value| value * value).sum();
            return normal;
        }
        for (rows, residuals) in self.rows.chunks(BLOCK * self.n).zip(self.residuals.chunks(BLOCK)) {
            let transposed = DMatrix::from_column_slice(self.n, residuals.len(), rows);
            let residual = DVector::from_column_slice(residuals);
            normal.gram.gemm(1.0, &transposed, &transposed.transpose(), 1.0);
            normal.gradient.gemv(1.0, &transposed, &residual, 1.0);
            normal.cost += residual.norm_squared();
        }
        normal
    }

    /// The triangular factor R of the rows with every column scaled by `scale` (n × n), by blocked Householder QR: same
    /// singular values as the rows, without squaring them.
    pub(crate) fn triangular_factor(&self, scale: &[f64]) -> DMatrix<f64> {
        const BLOCK: usize = 512;
        let n = self.n;
        let mut factor = DMatrix::zeros(0, n);
        for rows in self.rows.chunks(BLOCK * n) {
            let count = rows.len() / n;
            let above = factor.nrows();
            let mut stacked = DMatrix::zeros(above + count, n);
            stacked.rows_mut(0, above).copy_from(&factor);
            for (index, row) in rows.chunks(n).enumerate() {
                for (column, (value, scale)) in row.iter().zip(scale).enumerate() {
                    stacked[(above + index, column)] = value * scale;
                }
            }
            factor = stacked.qr().unpack_r();
        }
        factor.resize_vertically(n, 0.0)
    }
}
