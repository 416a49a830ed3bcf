//! One least-squares adjustment of all points of both circles: the frame of the arm and the target.

use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Matrix3xX, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3,
};

use super::{CircleFit, CirclePointError, CircleSeries, TargetLocation};
use crate::kinematics::{
    Arm, ForwardKinematics, FreeParameter, IdentificationJacobian, KinematicChain, ParameterId, Place,
};

/// Unknowns: translation, rotation, target.
const UNKNOWNS: usize = 9;
/// Steps, and the step that ends them (m) and (rad).
const STEPS: usize = 50;
const SMALLEST_STEP: f64 = 1e-13;
/// Eigenvalues of the normal equations in this ratio determine nothing.
const SINGULAR: f64 = 1e-12;

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;

/// The problem, and how far it is solved.
struct Adjustment {
    /// The nominal arm with one target: where the SMR is.
    arm: Arm,
    /// All points in the tracker frame (m), those of the first series first.
    samples: Vec<(Place, Point3<f64>)>,
    tracker_from_base: Isometry3<f64>,
    /// Turning is about the middle of the points: it then has little to do with shifting.
    pivot: Vector3<f64>,
}

/// A point with its derivatives: by the unknowns, and by the parameters of the last two links.
struct PointRows {
    residual: Vector3<f64>,
    by_unknowns: SMatrix<f64, 3, UNKNOWNS>,
    by_links: Matrix3xX<f64>,
}

impl Adjustment {
    /// All points; `links` are the parameters to differentiate by.
    fn rows(&self, links: &[ParameterId]) -> Vec<PointRows> {
        let parameters: Vec<ParameterId> = ParameterId::of_target(0).chain(links.iter().copied()).collect();
        let n = parameters.len();
        let mut jacobian = IdentificationJacobian::new(&parameters);
        let turn = *self.tracker_from_base.rotation.to_rotation_matrix().matrix();
        let mut numbers = vec![0.0; 3 * n];
        let prepared = self.arm.prepared();
        self.samples
            .iter()
            .map(|(place, measured)| {
                let in_base = jacobian.at(&prepared, place, &mut numbers);
                let predicted = self.tracker_from_base * in_base;
                let by_parameters = turn * Matrix3xX::from_row_slice(&numbers);
                let mut by_unknowns = SMatrix::<f64, 3, UNKNOWNS>::zeros();
                by_unknowns.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
                let arm = predicted.coords - self.pivot;
                by_unknowns.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
                by_unknowns.fixed_view_mut::<3, 3>(0, 6).copy_from(&by_parameters.columns(0, 3));
                let by_links = by_parameters.columns(3, n - 3).into_owned();
                PointRows { residual: measured - predicted, by_unknowns, by_links }
            })
            .collect()
    }

    fn step(&mut self, step: &Unknowns) {
        let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(step.fixed_rows::<3>(3)));
        let about = Isometry3::from_parts(Translation3::from(self.pivot + shift - turn * self.pivot), turn);
        self.tracker_from_base = about * self.tracker_from_base;
        for target in &mut self.arm.targets {
            *target += Vector3::from(step.fixed_rows::<3>(6));
        }
    }
}

fn normal_equations(rows: &[PointRows]) -> (Normal, Unknowns) {
    rows.iter().fold((Normal::zeros(), Unknowns::zeros()), |(gram, gradient), point| {
        let transposed = point.by_unknowns.transpose();
        (gram + transposed * point.by_unknowns, gradient + transposed * point.residual)
    })
}

/// Adjusts from a start of the frame.
pub(super) fn adjust(
    chain: &KinematicChain,
    series: [&CircleSeries<'_>; 2],
    circles: [CircleFit; 2],
    start: Isometry3<f64>,
    sigma: Option<f64>,
    expected: &[FreeParameter],
) -> Result<TargetLocation, CirclePointError> {
    let place = |configuration: &Vec<f64>| Place { configuration: configuration.clone(), target: 0 };
    let of_series = |series: &CircleSeries<'_>| {
        series.configurations.iter().map(place).zip(series.points.iter().copied()).collect::<Vec<_>>()
    };
    let samples = series.map(of_series).concat();
    let count = samples.len() as f64;
    let forward = ForwardKinematics::new(chain);
    let seen = samples.iter().map(|(place, point)| {
        let tracker_from_flange = start * forward.base_from_flange(&place.configuration);
        tracker_from_flange.inverse_transform_point(point).coords
    });
    let target = Point3::from(seen.sum::<Vector3<f64>>() / count);
    let pivot = samples.iter().map(|(_, point)| point.coords).sum::<Vector3<f64>>() / count;
    let arm = Arm { chain: chain.clone(), targets: vec![target] };
    let mut fit = Adjustment { arm, samples, tracker_from_base: start, pivot };

    let mut converged = false;
    for _ in 0..STEPS {
        let (gram, gradient) = normal_equations(&fit.rows(&[]));
        let step = gram.cholesky().ok_or(CirclePointError::NoFit)?.solve(&gradient);
        fit.step(&step);
        converged = step.amax() < SMALLEST_STEP;
        if converged || !step.iter().all(|value| value.is_finite()) {
            break;
        }
        // At the limit of the numbers the steps stay small without ending.
        converged = step.amax() < SMALLEST_STEP.sqrt();
    }
    if !converged {
        return Err(CirclePointError::NoFit);
    }
    summarise(&fit, series[0].points.len(), circles, sigma, expected)
}

fn summarise(
    fit: &Adjustment,
    in_first_series: usize,
    circles: [CircleFit; 2],
    sigma: Option<f64>,
    expected: &[FreeParameter],
) -> Result<TargetLocation, CirclePointError> {
    let first_moving = fit.arm.chain.dof().saturating_sub(2);
    let (links, sizes): (Vec<ParameterId>, Vec<f64>) = expected
        .iter()
        .filter(|free| free.id.joint().is_some_and(|joint| joint >= first_moving))
        .map(|free| (free.id, free.expected))
        .unzip();
    let rows = fit.rows(&links);
    let (gram, _) = normal_equations(&rows);
    let eigenvalues = gram.symmetric_eigenvalues();
    if eigenvalues.min() < SINGULAR * eigenvalues.max() {
        return Err(CirclePointError::NoFit);
    }
    let inverse = gram.cholesky().ok_or(CirclePointError::NoFit)?.inverse();
    let residuals: Vec<f64> = rows.iter().map(|point| point.residual.norm()).collect();
    let square: f64 = residuals.iter().map(|residual| residual * residual).sum();
    let freedom = (3 * rows.len()).saturating_sub(UNKNOWNS).max(1) as f64;
    let reading_sigma = sigma.unwrap_or_else(|| (square / freedom).sqrt());

    // How the unknowns and the residuals answer to an expected deviation of each link parameter.
    let scale = DMatrix::from_diagonal(&DVector::from_vec(sizes));
    let mut cross = DMatrix::zeros(UNKNOWNS, links.len());
    for point in &rows {
        cross += point.by_unknowns.transpose() * &point.by_links;
    }
    let answer = inverse * cross * scale.clone();
    let explained: f64 =
        rows.iter().map(|point| (&point.by_links * &scale - point.by_unknowns * &answer).norm_squared()).sum();
    let target_answer = answer.rows(6, 3);
    let by_links: Matrix3<f64> = (target_answer * target_answer.transpose()).fixed_view::<3, 3>(0, 0).into_owned();
    let measured: Matrix3<f64> = inverse.fixed_view::<3, 3>(6, 6) * (reading_sigma * reading_sigma);
    let points = rows.len() as f64;
    let (of_a, of_b) = residuals.split_at(in_first_series.min(residuals.len()));
    Ok(TargetLocation {
        point_in_flange: fit.arm.targets.first().copied().unwrap_or_else(Point3::origin),
        covariance: measured + by_links,
        measured,
        reading_sigma,
        residuals: [of_a.to_vec(), of_b.to_vec()],
        rms: (square / points).sqrt(),
        expected_rms: ((reading_sigma * reading_sigma * freedom + explained) / points).sqrt(),
        circles,
        tracker_from_base: fit.tracker_from_base,
    })
}
