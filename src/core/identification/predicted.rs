//! What the covariance of the parameters means for positions.

use nalgebra::{DMatrix, Matrix3, Matrix6, Matrix6xX, Point3, SMatrix, Vector3};

use super::Identification;
use crate::kinematics::{Arm, ForwardKinematics, FreeParameter, IdentificationJacobian, ParameterId, Place};

/// Coordinates of a rigid motion.
const MOTIONS: usize = 6;
/// Coordinates of a position.
const AXES: usize = 3;

/// Covariance of each position in the base (m²) that the identified arm predicts at `places`, once the base is registered to
/// these very places: what only moves the whole arm is no error of it.
///
/// `J' Σ J'ᵀ` with the Jacobian of all places freed from rigid motions, `J' = J − Q Qᵀ J`, where Q spans the motions.
pub fn position_covariances(found: &Identification, places: &[&Place]) -> Vec<Matrix3<f64>> {
    let ids: Vec<ParameterId> = found.estimates.iter().map(|estimate| estimate.id).collect();
    let free = without_motions(jacobian(&found.arm, &ids, places), &found.arm, places);
    (0..places.len())
        .map(|place| {
            let rows = free.rows(3 * place, 3);
            let product = rows * &found.covariance * rows.transpose();
            Matrix3::from_fn(|row, column| f64::midpoint(product[(row, column)], product[(column, row)]))
        })
        .collect()
}

/// How uncertain positions are anywhere, in the frame that some measured places define: what only moves the whole arm is no error,
/// but what moves those places is made up for by the frame, which takes other places along.
#[derive(Clone, Debug)]
pub struct Predictor<'a> {
    found: &'a Identification,
    ids: Vec<ParameterId>,
    /// Middle of the places (m).
    centre: Point3<f64>,
    /// How shift and turn of the frame follow the parameters, 6 × n.
    response: Matrix6xX<f64>,
    /// Covariance of shift (m) and turn (rad) of the frame from the noise of the places.
    frame: Matrix6<f64>,
}

impl<'a> Predictor<'a> {
    /// For the frame that the measured `places` define; `None` if they do not define one.
    pub fn new(found: &'a Identification, places: &[&Place]) -> Option<Self> {
        let ids: Vec<ParameterId> = found.estimates.iter().map(|estimate| estimate.id).collect();
        let points = found.arm.points_in_base(places.iter().copied());
        let centre = Point3::from(points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64);
        let rows = jacobian(&found.arm, &ids, places);
        let mut information = Matrix6::zeros();
        let mut projected = Matrix6xX::zeros(ids.len());
        for (index, point) in points.iter().enumerate() {
            let motion = motion(&(point - centre));
            information += motion.transpose() * motion;
            projected += motion.transpose() * rows.rows(3 * index, 3);
        }
        let inverse = information.try_inverse().filter(|inverse| inverse.iter().all(|value| value.is_finite()))?;
        let response = inverse * projected;
        Some(Self { found, ids, centre, response, frame: inverse * found.sigma.used.powi(2) })
    }

    /// Derivatives of all positions by the parameters, and by the frame, once it has followed the parameters.
    fn derivatives(&self, places: &[&Place]) -> (DMatrix<f64>, Vec<SMatrix<f64, 3, 6>>) {
        let points = self.found.arm.points_in_base(places.iter().copied());
        let mut rows = jacobian(&self.found.arm, &self.ids, places);
        let motions: Vec<SMatrix<f64, 3, 6>> = points.iter().map(|point| motion(&(point - self.centre))).collect();
        for (index, motion) in motions.iter().enumerate() {
            let moved = motion * &self.response;
            let mut rows = rows.rows_mut(3 * index, 3);
            rows -= moved;
        }
        (rows, motions)
    }

    /// Mean products (m²) of what the columns of `deviations` ((m) and (rad), in the order of the estimates) do to the positions.
    pub fn effects(&self, places: &[&Place], deviations: &DMatrix<f64>) -> DMatrix<f64> {
        let moved = self.derivatives(places).0 * deviations;
        moved.transpose() * moved / places.len().max(1) as f64
    }

    /// Covariance of the position at each of `places` (m²).
    pub fn covariances(&self, places: &[&Place]) -> Vec<Matrix3<f64>> {
        let (rows, motions) = self.derivatives(places);
        let product = &rows * &self.found.covariance;
        motions
            .iter()
            .enumerate()
            .map(|(index, motion)| {
                let own = product.rows(3 * index, 3) * rows.rows(3 * index, 3).transpose();
                let own = Matrix3::from_fn(|i, j| f64::midpoint(own[(i, j)], own[(j, i)]));
                own + motion * self.frame * motion.transpose()
            })
            .collect()
    }
}

/// The error predicted for a calibration while its poses are measured one by one. Each takes the same time, however many there
/// were before.
///
/// It carries the covariance of all parameters, in units of their expected deviations, and of the frame, about which nothing is known
/// within a metre and a radian.
#[derive(Clone, Debug)]
pub struct Forecast {
    arm: Arm,
    ids: Vec<ParameterId>,
    expected: Vec<f64>,
    /// Variance of a measured coordinate (m²).
    variance: f64,
    covariance: DMatrix<f64>,
    /// Mean of `GᵀG` over the fresh places, with the derivatives G of a position (m²).
    fresh: DMatrix<f64>,
    /// Mean square error at the fresh places (m²).
    square: f64,
}

impl Forecast {
    /// Before the first measurement of the `parameters` of `arm`, judged by the error at the `fresh` places. `sigma` is the standard
    /// deviation of a measured coordinate (m).
    pub fn new(arm: &Arm, parameters: &[FreeParameter], fresh: &[Place], sigma: f64) -> Self {
        let size = parameters.len() + MOTIONS;
        let mut forecast = Self {
            arm: arm.clone(),
            ids: parameters.iter().map(|parameter| parameter.id).collect(),
            expected: parameters.iter().map(|parameter| parameter.expected).collect(),
            variance: sigma * sigma,
            covariance: DMatrix::identity(size, size),
            fresh: DMatrix::zeros(size, size),
            square: 0.0,
        };
        let mut columns = DMatrix::zeros(size, 3 * fresh.len());
        for (index, place) in fresh.iter().enumerate() {
            columns.columns_mut(3 * index, 3).copy_from(&forecast.derivatives(place).columns(0, AXES));
        }
        forecast.fresh = &columns * columns.transpose() / fresh.len().max(1) as f64;
        forecast.square = forecast.fresh.trace();
        forecast
    }

    /// Derivatives of the position at a place: one column per coordinate, then as many empty ones, because products of fewer columns
    /// miss the fast ones of the library.
    fn derivatives(&self, place: &Place) -> DMatrix<f64> {
        let n = self.ids.len();
        let mut rows = vec![0.0; 3 * n];
        let point = IdentificationJacobian::new(&self.ids).at(&self.arm.prepared(), place, &mut rows);
        self.columns(&rows, &point)
    }

    fn columns(&self, rows: &[f64], point: &Point3<f64>) -> DMatrix<f64> {
        let n = self.ids.len();
        let motion = motion(&point.coords);
        let mut derivatives = DMatrix::zeros(n + MOTIONS, 2 * AXES);
        for axis in 0..AXES {
            for (parameter, expected) in self.expected.iter().enumerate() {
                derivatives[(parameter, axis)] = rows[n * axis + parameter] * expected;
            }
            for of_frame in 0..MOTIONS {
                derivatives[(n + of_frame, axis)] = motion[(axis, of_frame)];
            }
        }
        derivatives
    }

    /// Takes a measurement at `place` into account.
    pub fn measure(&mut self, place: &Place) {
        let derivatives = self.derivatives(place);
        let gain = &self.covariance * &derivatives;
        let seen = derivatives.transpose() * &gain;
        let innovation = Matrix3::from_fn(|i, j| f64::midpoint(seen[(i, j)], seen[(j, i)]))
            + Matrix3::identity() * self.variance.max(f64::MIN_POSITIVE);
        let Some(inverse) = innovation.try_inverse() else { return };
        let mut weighted = DMatrix::zeros(gain.nrows(), 2 * AXES);
        weighted.columns_mut(0, AXES).copy_from(&(gain.columns(0, AXES) * inverse));
        self.square -= (&self.fresh * &gain).dot(&weighted);
        self.covariance.gemm(-1.0, &weighted, &gain.transpose(), 1.0);
    }

    /// Root mean square position error predicted for a point of the flange at a configuration (m), in the frame that the
    /// measured places define.
    pub fn error_at(&self, q: &[f64], point_in_flange: &Point3<f64>) -> f64 {
        let mut rows = vec![0.0; 3 * self.ids.len()];
        let forward = ForwardKinematics::new(&self.arm.chain);
        // Of no measured target: its coordinates are known.
        let point =
            IdentificationJacobian::new(&self.ids).evaluate(&forward, q, usize::MAX, point_in_flange, &mut rows);
        let derivatives = self.columns(&rows, &point);
        let gain = &self.covariance * &derivatives;
        derivatives.dot(&gain).max(0.0).sqrt()
    }

    /// Root mean square position error predicted at the fresh places (m).
    pub fn error(&self) -> f64 {
        self.square.max(0.0).sqrt()
    }
}

/// Derivative of a point at `arm` from the centre by shift and turn.
fn motion(arm: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut motion = SMatrix::<f64, 3, 6>::zeros();
    motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&arm.cross_matrix().transpose());
    motion
}

/// Derivatives of positions by a shift (m) and a turn (rad) of all places about their middle, three rows per place.
pub fn motions(arm: &Arm, places: &[&Place]) -> DMatrix<f64> {
    let points = arm.points_in_base(places.iter().copied());
    let count = points.len().max(1) as f64;
    let centre = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let mut motions = DMatrix::zeros(3 * points.len(), MOTIONS);
    for (index, point) in points.iter().enumerate() {
        motions.fixed_view_mut::<3, MOTIONS>(3 * index, 0).copy_from(&motion(&(point.coords - centre)));
    }
    motions
}

/// Derivatives of all positions by the parameters, freed from rigid motions of all places.
pub fn free_jacobian(arm: &Arm, ids: &[ParameterId], places: &[&Place]) -> DMatrix<f64> {
    without_motions(jacobian(arm, ids, places), arm, places)
}

/// Derivatives of all positions by the parameters, three rows per place.
pub fn jacobian(arm: &Arm, ids: &[ParameterId], places: &[&Place]) -> DMatrix<f64> {
    let arm = arm.prepared();
    let mut evaluated = IdentificationJacobian::new(ids);
    let mut rows = vec![0.0; 3 * ids.len() * places.len()];
    if ids.is_empty() {
        return DMatrix::zeros(3 * places.len(), 0);
    }
    for (place, rows) in places.iter().zip(rows.chunks_mut(3 * ids.len())) {
        evaluated.at(&arm, place, rows);
    }
    DMatrix::from_row_slice(3 * places.len(), ids.len(), &rows)
}

/// The part of `jacobian` that no rigid motion of all places explains.
fn without_motions(jacobian: DMatrix<f64>, arm: &Arm, places: &[&Place]) -> DMatrix<f64> {
    let motions = motions(arm, places);
    if motions.nrows() < MOTIONS {
        // One point: every error of it is a motion.
        return DMatrix::zeros(jacobian.nrows(), jacobian.ncols());
    }
    let basis = motions.svd(true, false);
    let Some(u) = basis.u else { return jacobian };
    let largest = basis.singular_values.max();
    let spanned: Vec<usize> =
        (0..basis.singular_values.len()).filter(|&index| basis.singular_values[index] > 1e-9 * largest).collect();
    let q = u.select_columns(&spanned);
    &jacobian - &q * (q.transpose() * &jacobian)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::identification::{Observations, PointSample, Problem, Settings, SigmaSource, identify};
    use crate::kinematics::{Convention, Joint, JointType, KinematicChain, Link, LinkParameter};

    fn arm() -> Arm {
        let joint = |index: usize| Joint {
            name: format!("J{}", index + 1),
            joint_type: JointType::Revolute,
            link: Link { alpha: 1.5 * (index % 2) as f64, a: 0.3, d: 0.1, theta: 0.0, beta: 0.0 },
            direction: 1.0,
            coupling: Vec::new(),
        };
        let joints = (0..4).map(joint).collect();
        let chain =
            KinematicChain::new(Convention::Standard, Isometry3::identity(), joints, Isometry3::identity()).unwrap();
        Arm { chain, targets: vec![Point3::new(0.05, 0.0, 0.1)] }
    }

    fn place(index: usize) -> Place {
        let value = |joint: usize| 4.0 * (((index + 1) as f64 * (joint as f64 + 2.0).sqrt()).fract() - 0.5);
        Place { configuration: (0..4).map(value).collect(), target: 0 }
    }

    /// Measuring one by one leads to the covariance of an identification from all of them.
    #[test]
    fn one_by_one_is_the_same_as_all_at_once() {
        let arm = arm();
        let of_joint = |joint| {
            LinkParameter::ALL
                .map(|parameter| FreeParameter { id: ParameterId::Link { joint, parameter }, expected: 1e-3 })
        };
        let parameters: Vec<FreeParameter> = (0..4).flat_map(of_joint).collect();
        let measured: Vec<Place> = (0..25).map(place).collect();
        let fresh: Vec<Place> = (100..160).map(place).collect();
        let station = Isometry3::new(Vector3::new(1.0, 2.0, 0.3), Vector3::new(0.2, 0.1, 1.0));
        // Residuals of the size that is stated leave the noise at what is stated.
        let sigma = 1e-3;
        let points = measured.iter().enumerate().map(|(index, at)| {
            let noise = Vector3::from_fn(|axis, _| sigma * (((index * 3 + axis) as f64 * 0.754).fract() - 0.5) * 3.46);
            let point = station.inverse() * (arm.point_in_base(at) + noise);
            PointSample { at: at.clone(), station: 0, point, sigma: None }
        });
        let observations = Observations { points: points.collect(), ..Observations::default() };
        let problem = Problem { arm: &arm, parameters: &parameters, observations: &observations };
        let settings = Settings { sigma: Some((sigma, SigmaSource::Option)), ..Settings::default() };
        let found = identify(&problem, &settings, &mut |_| {}).unwrap();
        let predictor = Predictor::new(&found, &measured.iter().collect::<Vec<_>>()).unwrap();
        let covariances = predictor.covariances(&fresh.iter().collect::<Vec<_>>());
        let all_at_once = (covariances.iter().map(Matrix3::trace).sum::<f64>() / fresh.len() as f64).sqrt();

        let mut forecast = Forecast::new(&arm, &parameters, &fresh, found.sigma.used);
        let mut before = forecast.error();
        for at in &measured {
            forecast.measure(at);
            assert!(forecast.error() <= before);
            before = forecast.error();
        }
        assert!((forecast.error() / all_at_once - 1.0).abs() < 0.02, "{} {all_at_once}", forecast.error());
    }
}
