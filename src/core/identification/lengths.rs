//! Measured lengths and contacts among the rows: what is predicted for each, and what the place of a feature explains of them.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, SVector, SymmetricEigen, Vector3};

use super::feature::{COORDINATES, Contact, Feature};
use super::linearise::{
    Evaluation, PointResiduals, Weights, judged_places, mean_rows, shared_ranges, split_rows, weighted_mean,
};
use super::problem::{Length, LengthEnd, Problem};
use crate::kinematics::Arm;

/// Coordinates of a feature and the turn about its axis.
const NUISANCES: usize = COORDINATES + 1;

/// One end of a measured length among the places.
#[derive(Clone, Debug)]
enum End {
    /// A place of its own.
    Place(usize),
    /// The mean of the places of a shared point.
    Mean(std::ops::Range<usize>),
    /// A feature.
    Feature,
}

impl End {
    fn point(&self, points: &[Point3<f64>], weights: &Weights) -> Option<Point3<f64>> {
        match self {
            Self::Place(place) => points.get(*place).copied(),
            Self::Mean(range) => Some(weighted_mean(weights, range.clone(), |index| points[index].coords).into()),
            Self::Feature => None,
        }
    }
}

/// The ends of every measured length.
fn length_ends(problem: &Problem<'_>) -> Vec<[End; 2]> {
    let ranges: Vec<_> = shared_ranges(problem).collect();
    let mut next_place = judged_places(problem);
    let mut end = |end: &LengthEnd| match end {
        LengthEnd::Target(_) => {
            next_place += 1;
            End::Place(next_place - 1)
        }
        LengthEnd::SharedPoint(shared) => End::Mean(ranges[*shared].clone()),
        LengthEnd::Feature { .. } => End::Feature,
    };
    let both = |length: &Length| [end(&length.from), end(&length.to)];
    problem.observations.lengths.iter().map(both).collect()
}

/// The features fitted to the predicted places.
pub(super) fn fitted_features(
    problem: &Problem<'_>,
    points: &[Point3<f64>],
    weights: &Weights,
) -> Vec<Option<Feature>> {
    let observations = problem.observations;
    if observations.features.is_empty() {
        return Vec::new();
    }
    let mut contacts = vec![Vec::new(); observations.features.len()];
    for (index, (length, ends)) in observations.lengths.iter().zip(length_ends(problem)).enumerate() {
        let Some((feature, component)) = length.feature() else { continue };
        let Some(point) = ends.iter().find_map(|end| end.point(points, weights)) else { continue };
        let weight = weights.of_length(index);
        contacts[feature].push(Contact { point, component, measured: length.length, weight });
    }
    observations.features.iter().zip(&contacts).map(|(shape, contacts)| Feature::fit(*shape, contacts)).collect()
}

/// What is predicted for a measured length, with its derivatives.
#[derive(Clone, Debug)]
pub(super) struct PredictedLength {
    /// The length (m); what was measured where a feature is not known.
    pub(super) value: f64,
    /// By the places of the two ends.
    by_ends: [Vector3<f64>; 2],
    /// By the coordinates of the feature at one end and by the turn that means nothing.
    by_feature: SVector<f64, NUISANCES>,
}

/// The lengths that are predicted at some places.
pub(super) fn length_values(
    problem: &Problem<'_>,
    points: &[Point3<f64>],
    features: &[Option<Feature>],
    weights: &Weights,
) -> Vec<PredictedLength> {
    let lengths = problem.observations.lengths.iter().zip(length_ends(problem));
    let predicted = |(length, ends): (&Length, [End; 2])| {
        let nothing =
            PredictedLength { value: length.length, by_ends: [Vector3::zeros(); 2], by_feature: SVector::zeros() };
        match [ends[0].point(points, weights), ends[1].point(points, weights)] {
            [Some(from), Some(to)] => {
                let difference = to - from;
                // Two points on top of each other have no direction to differentiate along.
                let u = difference.try_normalize(f64::EPSILON).unwrap_or_default();
                PredictedLength { value: difference.norm(), by_ends: [-u, u], ..nothing }
            }
            [from, to] => {
                let known = length.feature().and_then(|(feature, component)| {
                    Some(features.get(feature)?.as_ref()?.predicted(&from.or(to)?, component))
                });
                let Some(known) = known else { return nothing };
                let mut by_feature = SVector::<f64, NUISANCES>::zeros();
                by_feature.fixed_rows_mut::<COORDINATES>(0).copy_from(&known.by_feature);
                by_feature[COORDINATES] = known.by_spin;
                let mut by_ends = [Vector3::zeros(); 2];
                by_ends[usize::from(from.is_none())] = known.by_point;
                PredictedLength { value: known.value, by_ends, by_feature }
            }
        }
    };
    lengths.map(predicted).collect()
}

/// Rows of the measured lengths, `u · (B_to − B_from)`, equations (16) and (21) with a measured length, and their residuals (m).
pub(super) fn length_rows(
    problem: &Problem<'_>,
    evaluation: &Evaluation,
    features: &[Option<Feature>],
    weights: &Weights,
) -> (Vec<f64>, Vec<f64>) {
    let n = evaluation.n;
    let values = length_values(problem, &evaluation.points, features, weights);
    let mut rows = vec![0.0; n * values.len()];
    let mut residuals = Vec::with_capacity(values.len());
    let lengths = problem.observations.lengths.iter().zip(length_ends(problem)).zip(&values);
    for (index, ((length, ends), predicted)) in lengths.enumerate() {
        let row = &mut rows[n * index..n * (index + 1)];
        for (end, by) in ends.iter().zip(&predicted.by_ends) {
            let own;
            let of_end = match end {
                End::Place(place) => evaluation.place(*place),
                End::Mean(range) => {
                    own = mean_rows(n, &evaluation.rows, range.clone(), weights);
                    &own
                }
                End::Feature => continue,
            };
            let (x, y, z) = split_rows(of_end, n);
            for (column, value) in row.iter_mut().enumerate() {
                *value += by.x * x[column] + by.y * y[column] + by.z * z[column];
            }
        }
        residuals.push(length.length - predicted.value);
    }
    (rows, residuals)
}

/// Takes from the rows of the lengths what the place of each feature explains.
pub(super) fn remove_features(
    n: usize,
    rows: &mut [f64],
    problem: &Problem<'_>,
    predicted: &[PredictedLength],
    weights: &Weights,
) {
    for feature in 0..problem.observations.features.len() {
        let response = Response::new(n, rows, problem, feature, predicted, weights);
        for &index in &response.contacts {
            let taken = response.by_parameters.tr_mul(&predicted[index].by_feature);
            for (value, taken) in rows[n * index..n * (index + 1)].iter_mut().zip(taken.iter()) {
                *value -= taken;
            }
        }
    }
}

/// How a feature that is fitted to its contacts follows the parameters.
struct Response {
    /// The lengths that are contacts with it.
    contacts: Vec<usize>,
    /// Covariance of its coordinates at a known arm.
    covariance: DMatrix<f64>,
    /// What the parameters take from its coordinates, one column per parameter.
    by_parameters: DMatrix<f64>,
}

impl Response {
    fn new(
        n: usize,
        rows: &[f64],
        problem: &Problem<'_>,
        feature: usize,
        predicted: &[PredictedLength],
        weights: &Weights,
    ) -> Self {
        let lengths = &problem.observations.lengths;
        let is_of_it = |index: &usize| lengths[*index].feature().is_some_and(|(own, _)| own == feature);
        let contacts: Vec<usize> = (0..lengths.len()).filter(is_of_it).collect();
        let mut information = DMatrix::zeros(NUISANCES, NUISANCES);
        let mut products = DMatrix::zeros(NUISANCES, n);
        for &index in &contacts {
            let (by, weight) = (&predicted[index].by_feature, weights.of_length(index));
            information += by * by.transpose() * weight;
            let row = DVector::from_column_slice(&rows[n * index..n * (index + 1)]);
            products += by * row.transpose() * weight;
        }
        let covariance = feature_inverse(&information);
        Self { contacts, by_parameters: &covariance * products, covariance }
    }
}

/// Covariance of where each feature was found (m²), with that of the parameters of the arm, `covariance`. It is that of the point
/// itself, of the middle of a circle, and of the point of a plane or line that is kept.
pub(super) fn feature_covariances(
    problem: &Problem<'_>,
    arm: &Arm,
    points: &PointResiduals,
    weights: &Weights,
    covariance: &DMatrix<f64>,
) -> Vec<Matrix3<f64>> {
    if problem.observations.features.is_empty() {
        return Vec::new();
    }
    let evaluation = Evaluation::new(problem, arm);
    let (rows, _) = length_rows(problem, &evaluation, &points.features, weights);
    let predicted = length_values(problem, &evaluation.points, &points.features, weights);
    (0..problem.observations.features.len())
        .map(|feature| {
            let response = Response::new(evaluation.n, &rows, problem, feature, &predicted, weights);
            let by_arm = &response.by_parameters * covariance * response.by_parameters.transpose();
            Matrix3::from_fn(|i, j| response.covariance[(i, j)] + by_arm[(i, j)])
        })
        .collect()
}

/// Inverse of the normal matrix of a feature's coordinates, zero along those that mean nothing for its shape.
fn feature_inverse(information: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = information.diagonal().map(|value| if value > 0.0 { 1.0 / value.sqrt() } else { 0.0 });
    let scale = DMatrix::from_diagonal(&scale);
    let eigen = SymmetricEigen::new(&scale * information * &scale);
    let inverse = eigen.eigenvalues.map(|value| if value > 1e-12 { 1.0 / value } else { 0.0 });
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    &scale * inverse * &scale
}
