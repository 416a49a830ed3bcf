//! The circle through measured points: plane and start in closed form, then least squares of the distances to the circle.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix3, Matrix6, Point3, SymmetricEigen, Unit, Vector2, Vector3, Vector6};

use super::CircleError;
use crate::units::{DEGREE, MILLIMETRE};

/// Points nearer to each other count as one (m): far above the noise of a tracker, far below a step of a joint.
const SAME_PLACE: f64 = 0.1 * MILLIMETRE;
/// A circle with a smaller radius says nothing about its axis (m).
pub const SMALLEST_RADIUS: f64 = 5.0 * MILLIMETRE;
/// Along a shorter arc the centre is lost in the noise (rad).
pub const SHORTEST_ARC: f64 = 20.0 * DEGREE;
/// Points are on a line if they are this much narrower than long; an arc of [`SHORTEST_ARC`] is 30 times wider.
const LINE: f64 = 1e-3;
/// Steps of the fit, and the step that ends it (m) and (rad).
const STEPS: usize = 50;
const SMALLEST_STEP: f64 = 1e-14;
/// Numbers that describe a circle in space.
const PARAMETERS: usize = 6;

/// A circle in space with the points it was fitted to.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleFit {
    /// Centre (m).
    pub centre: Point3<f64>,
    /// Direction of the axis; of the two, the one about which the points go round in their order by the shorter way.
    pub normal: Unit<Vector3<f64>>,
    /// Radius (m).
    pub radius: f64,
    /// What is left at each point.
    pub residuals: Vec<CircleResidual>,
    /// Root mean square distance of the points from the circle (m).
    pub rms: f64,
    /// Largest distance of a point from the circle (m).
    pub max: f64,
    /// Part of the circle that the points cover (rad).
    pub arc: f64,
    /// Standard deviations; `None` without a stated σ where three points leave nothing over to estimate it.
    pub uncertainty: Option<CircleUncertainty>,
}

/// Where a point is, seen from its circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleResidual {
    /// Outwards, in the plane (m).
    pub radial: f64,
    /// Out of the plane, along the normal (m).
    pub out_of_plane: f64,
}

impl CircleResidual {
    /// Distance from the circle (m).
    pub fn distance(&self) -> f64 {
        self.radial.hypot(self.out_of_plane)
    }
}

/// Standard deviations of a circle, from the covariance of the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleUncertainty {
    /// Of a coordinate of a point (m): the stated one, else that of the residuals.
    pub point: f64,
    /// Of the centre, in its worst direction (m).
    pub centre: f64,
    /// Of the radius (m).
    pub radius: f64,
    /// Of the direction of the axis, in its worst direction (rad).
    pub normal: f64,
}

/// A circle on the way: the frame has the normal as its third axis.
#[derive(Clone, Copy, Debug)]
struct Circle {
    centre: Vector3<f64>,
    axes: [Vector3<f64>; 3],
    radius: f64,
}

/// A point seen from a circle.
struct Seen {
    residual: CircleResidual,
    /// Derivatives of both residuals by centre (along the three axes), tilt towards the first two axes, and radius.
    radial_row: Vector6<f64>,
    plane_row: Vector6<f64>,
}

impl Circle {
    fn see(&self, point: &Point3<f64>) -> Seen {
        let [first, second, normal] = self.axes;
        let from_centre = point.coords - self.centre;
        let (x, y, height) = (from_centre.dot(&first), from_centre.dot(&second), from_centre.dot(&normal));
        let distance = x.hypot(y).max(f64::MIN_POSITIVE);
        let (u, v) = (x / distance, y / distance);
        Seen {
            residual: CircleResidual { radial: distance - self.radius, out_of_plane: height },
            radial_row: Vector6::new(-u, -v, 0.0, -height * u, -height * v, -1.0),
            plane_row: Vector6::new(0.0, 0.0, -1.0, x, y, 0.0),
        }
    }

    fn moved(&self, step: &Vector6<f64>) -> Self {
        let [first, second, normal] = self.axes;
        let centre = self.centre + first * step[0] + second * step[1] + normal * step[2];
        let normal = Unit::new_normalize(normal + first * step[3] + second * step[4]);
        Self { centre, axes: axes_about(&normal, &first), radius: self.radius + step[5] }
    }
}

/// Right-handed axes with `normal` as the third and the first one near `near`.
fn axes_about(normal: &Unit<Vector3<f64>>, near: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let first = (near - normal.into_inner() * near.dot(normal)).normalize();
    [first, normal.cross(&first), normal.into_inner()]
}

/// Fits a circle to points (m) by the sum of squares of their distances from it. `sigma` is the standard deviation of a
/// coordinate (m), if it is known; else that of the residuals stands for it.
///
/// # Errors
/// Fewer than three distinct points, points on a line, a circle that is too small, or an arc that is too short.
pub fn fit_circle(points: &[Point3<f64>], sigma: Option<f64>) -> Result<CircleFit, CircleError> {
    if !points.iter().flat_map(|point| point.iter()).chain(&sigma).all(|value| value.is_finite()) {
        return Err(CircleError::NotFinite);
    }
    let mut distinct: Vec<Point3<f64>> = Vec::new();
    for point in points {
        if distinct.iter().all(|known| (point - known).norm() > SAME_PLACE) {
            distinct.push(*point);
        }
    }
    if distinct.len() < 3 {
        return Err(CircleError::TooFewPoints { distinct: distinct.len(), given: points.len() });
    }
    let mut circle = start(points)?;
    let mut normal_equations = Matrix6::zeros();
    for _ in 0..STEPS {
        let mut gradient = Vector6::zeros();
        normal_equations = Matrix6::zeros();
        for seen in points.iter().map(|point| circle.see(point)) {
            let rows = [(seen.radial_row, seen.residual.radial), (seen.plane_row, seen.residual.out_of_plane)];
            for (row, residual) in rows {
                normal_equations += row * row.transpose();
                gradient += row * residual;
            }
        }
        let step = -normal_equations.cholesky().ok_or(CircleError::NotACircle)?.solve(&gradient);
        circle = circle.moved(&step);
        if !(circle.radius.is_finite() && circle.centre.iter().all(|value| value.is_finite())) {
            return Err(CircleError::NotACircle);
        }
        if step.amax() < SMALLEST_STEP {
            break;
        }
    }
    if circle.radius < SMALLEST_RADIUS {
        return Err(CircleError::TooSmall { radius: circle.radius });
    }
    let angles = angles(&circle, points);
    let arc = arc(&angles);
    if arc < SHORTEST_ARC {
        return Err(CircleError::ShortArc { arc });
    }
    let turns: f64 = angles.windows(2).map(|pair| if let [a, b] = pair { (b - a).sin() } else { 0.0 }).sum();
    if turns < 0.0 {
        // Turned over about the first axis.
        circle.axes = circle.axes.map(|axis| -axis);
        circle.axes[0] = -circle.axes[0];
    }
    let residuals: Vec<CircleResidual> = points.iter().map(|point| circle.see(point).residual).collect();
    let square: f64 = residuals.iter().map(|residual| residual.distance().powi(2)).sum();
    let freedom = 2 * points.len() - PARAMETERS;
    let from_residuals = (freedom > 0).then(|| (square / freedom as f64).sqrt());
    let [_, _, normal] = circle.axes;
    Ok(CircleFit {
        centre: Point3::from(circle.centre),
        normal: Unit::new_normalize(normal),
        radius: circle.radius,
        rms: (square / points.len() as f64).sqrt(),
        max: residuals.iter().map(CircleResidual::distance).fold(0.0, f64::max),
        residuals,
        arc,
        uncertainty: sigma.or(from_residuals).and_then(|sigma| uncertainty(&normal_equations, sigma)),
    })
}

/// Plane by singular values, then the algebraic circle in it (Kåsa 1976).
fn start(points: &[Point3<f64>]) -> Result<Circle, CircleError> {
    let mean = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let centred: Vec<Vector3<f64>> = points.iter().map(|point| point.coords - mean).collect();
    // Right singular vectors of the transpose: three of them however few the points.
    let svd = DMatrix::from_fn(centred.len().max(3), 3, |row, axis| centred.get(row).map_or(0.0, |point| point[axis]))
        .svd(false, true);
    let axes = svd.v_t.ok_or(CircleError::NotACircle)?;
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let [longest, wider, thinnest] = order;
    if svd.singular_values[wider] < LINE * svd.singular_values[longest] {
        return Err(CircleError::OnALine);
    }
    let direction = |row: usize| Vector3::new(axes[(row, 0)], axes[(row, 1)], axes[(row, 2)]);
    let axes = axes_about(&Unit::new_normalize(direction(thinnest)), &direction(longest));
    let [first, second, _] = axes;
    let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for point in &centred {
        let at = Vector2::new(point.dot(&first), point.dot(&second));
        let row = Vector3::new(2.0 * at.x, 2.0 * at.y, 1.0);
        gram += row * row.transpose();
        right += row * at.norm_squared();
    }
    let solution = gram.cholesky().ok_or(CircleError::NotACircle)?.solve(&right);
    let radius = (solution.z + solution.x * solution.x + solution.y * solution.y).max(0.0).sqrt();
    Ok(Circle { centre: mean + first * solution.x + second * solution.y, axes, radius })
}

/// Angles of points about the axis (rad).
fn angles(circle: &Circle, points: &[Point3<f64>]) -> Vec<f64> {
    let [first, second, _] = circle.axes;
    let seen = points.iter().map(|point| point.coords - circle.centre);
    seen.map(|from_centre| from_centre.dot(&second).atan2(from_centre.dot(&first))).collect()
}

/// A full turn less the largest gap between neighbours (rad).
fn arc(angles: &[f64]) -> f64 {
    let mut sorted = angles.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return 0.0 };
    let around = first + TAU - last;
    let gaps = sorted.windows(2).map(|pair| if let [a, b] = pair { b - a } else { 0.0 });
    TAU - gaps.fold(around, f64::max)
}

fn uncertainty(normal_equations: &Matrix6<f64>, sigma: f64) -> Option<CircleUncertainty> {
    let covariance = normal_equations.cholesky()?.inverse() * (sigma * sigma);
    let worst = |from: usize, count: usize| {
        let block = covariance.view((from, from), (count, count)).into_owned();
        SymmetricEigen::new(block).eigenvalues.max().max(0.0).sqrt()
    };
    let radius = covariance[(5, 5)].max(0.0).sqrt();
    Some(CircleUncertainty { point: sigma, centre: worst(0, 3), radius, normal: worst(3, 2) })
}
