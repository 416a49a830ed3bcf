//! The axis of one joint from the points that its motion leads to.

use nalgebra::{Point3, Vector3};

use super::super::{fit_circle, turns_with};
use super::series::Series;
use super::{Axis, EXCESS, JointMotion, SHORTEST_SLIDE, SLIDE_TOLERANCE, Template, WholeArmError};
use crate::kinematics::JointType;

/// The axis of a joint, in the sense in which its variable grows, and how it was seen.
pub(super) fn motion(
    template: &Template,
    series: &Series,
    variables: &[Vec<f64>],
    points: &[Point3<f64>],
) -> Result<(Axis, JointMotion), WholeArmError> {
    let values: Vec<f64> = series.of(variables).iter().filter_map(|row| row.get(series.joint)).copied().collect();
    let points = series.of(points);
    match template.joint_type(series.joint) {
        JointType::Revolute => circle(template, series.joint, &values, points),
        JointType::Prismatic => slide(template, series.joint, &values, points),
    }
}

fn circle(
    template: &Template,
    joint: usize,
    values: &[f64],
    points: &[Point3<f64>],
) -> Result<(Axis, JointMotion), WholeArmError> {
    let fit = fit_circle(points, None).map_err(|error| WholeArmError::Circle { joint: template.name(joint), error })?;
    let normal = fit.normal.into_inner() * if turns_with(&fit, points, values) { 1.0 } else { -1.0 };
    let motion = JointMotion {
        joint,
        points: points.len(),
        radius: Some(fit.radius),
        extent: fit.arc,
        rms: fit.rms,
        sigma: 0.0,
    };
    Ok((Axis { point: fit.centre, direction: normal }, motion))
}

fn slide(
    template: &Template,
    joint: usize,
    values: &[f64],
    points: &[Point3<f64>],
) -> Result<(Axis, JointMotion), WholeArmError> {
    let count = points.len().max(1) as f64;
    let middle = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let per_value =
        points.iter().zip(values).map(|(point, value)| (point.coords - middle) * (value - mean)).sum::<Vector3<f64>>()
            / square.max(f64::MIN_POSITIVE);
    let stated = values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min);
    let seen = stated * per_value.norm();
    let agree = (per_value.norm() - 1.0).abs() < SLIDE_TOLERANCE;
    if points.len() < 3 || stated < SHORTEST_SLIDE || !agree {
        return Err(WholeArmError::Slide { joint: template.name(joint), seen, stated });
    }
    let residual = |(point, value): (&Point3<f64>, &f64)| point.coords - middle - per_value * (value - mean);
    let sum: f64 = points.iter().zip(values).map(|pair| residual(pair).norm_squared()).sum();
    let rms = (sum / count).sqrt();
    let motion = JointMotion { joint, points: points.len(), radius: None, extent: stated, rms, sigma: 0.0 };
    Ok((Axis { point: Point3::from(middle), direction: per_value.normalize() }, motion))
}

/// Number of numbers that the fit of a circle or of a line leaves over.
fn freedom(template: &Template, motion: &JointMotion) -> f64 {
    let values = match template.joint_type(motion.joint) {
        JointType::Revolute => 2 * motion.points,
        JointType::Prismatic => 3 * motion.points,
    };
    values.saturating_sub(6) as f64
}

/// The standard deviation of each series: the stated one, else that of all residuals; that of its own residuals where they are
/// much larger, because its joint does not move as assumed.
pub(super) fn settle_sigmas(template: &Template, motions: &mut [JointMotion], stated: Option<f64>) {
    let square = |motion: &JointMotion| motion.rms.powi(2) * motion.points as f64;
    let total: f64 = motions.iter().map(|motion| freedom(template, motion)).sum();
    let pooled = (motions.iter().map(square).sum::<f64>() / total.max(1.0)).sqrt();
    let common = stated.unwrap_or(pooled);
    for motion in motions {
        let own = (square(motion) / freedom(template, motion).max(1.0)).sqrt();
        motion.sigma = if own > EXCESS * common { own } else { common };
    }
}
