//! Circle-point analysis: where the SMR sits on the flange, from turning the last two joints one after the other.
//!
//! While the rest of the arm is still, the SMR goes round the axis of the joint that turns. The two circles give the lines of both
//! axes in the tracker frame; with the nominal geometry between them and the flange, the frame of the flange in the tracker frame
//! follows, and the place of the SMR in it. All points then enter one least-squares adjustment of the frame (6 unknowns) and the
//! target (3), which gives the standard deviations.
//!
//! The last two links are taken as nominal. What they may deviate enters the covariance, because it is the larger part: an
//! offset of the last joint turns the result about its axis, an error of its d moves it along. [`TargetLocation::measured`] is
//! what the readings alone would give.
//!
//! Where the last two axes meet at right angles, as in a spherical wrist, the circles of a mirrored frame, or of a joint that
//! counts the other way, are those of a right arm with the SMR on the other side of the wrist: the residual stays small, and the
//! result is behind the wrist centre. Compare it with where the SMR is mounted.
//!
//! Points in the tracker frame (m), configurations pendant values (rad, sliding joints m).

mod adjustment;
mod circle;
mod whole_arm;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

pub use circle::{CircleFit, CircleResidual, CircleUncertainty, SHORTEST_ARC, SMALLEST_RADIUS, fit_circle};
pub use whole_arm::{JointMotion, MeasuredArm, MeasuredConstant, Template, WholeArmError, measure_arm};

use crate::kinematics::{ForwardKinematics, FreeParameter, JointType, KinematicChain};
use crate::units::{DEGREE, MICROMETRE, to_deg, to_mm};

/// Longest arc of a plan (rad): more adds little, and the ends of a full turn would coincide.
const LONGEST_ARC: f64 = 300.0 * DEGREE;
/// Axes nearer to parallel than this do not tell where along them the flange is (rad).
const NEARLY_PARALLEL: f64 = 5.0 * DEGREE;
/// A joint that should be still may move by this much: 0.02° (rad), 10 µm (m).
const STILL: (f64, f64) = (0.02 * DEGREE, 10.0 * MICROMETRE);

/// Why there is no circle.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CircleError {
    /// Too few places.
    #[error(
        "{given} points ({distinct} different) do not fix a circle: at least 3 different ones are needed, and 4 to see an error{}",
        if *given >= 3 { "; if the joint did turn, the SMR sits on its axis: mount it beside the axis" } else { "" }
    )]
    TooFewPoints {
        /// Different places.
        distinct: usize,
        /// Points given.
        given: usize,
    },
    /// NaN or infinity in the data.
    #[error("a point has a number that is not finite")]
    NotFinite,
    /// All on a line.
    #[error("the points lie on a line: turn the joint further")]
    OnALine,
    /// The SMR sits (nearly) on the axis.
    #[error(
        "the circle has a radius of {:.3} mm: the SMR sits too near to the axis; mount it at least {} mm beside it, better 50 mm",
        to_mm(*radius), to_mm(SMALLEST_RADIUS)
    )]
    TooSmall {
        /// Radius (m).
        radius: f64,
    },
    /// The joint did not turn far enough.
    #[error(
        "the points cover only {:.1} deg of the circle: from {:.0} deg on it is usable, 90 deg or more are good",
        to_deg(*arc), to_deg(SHORTEST_ARC)
    )]
    ShortArc {
        /// Arc covered (rad).
        arc: f64,
    },
    /// The fit fails.
    #[error("no circle fits the points")]
    NotACircle,
}

/// Why the SMR could not be located, or a circle not be planned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CirclePointError {
    /// A circle of one joint.
    #[error("joint {joint}: {error}")]
    Circle {
        /// Name of the joint.
        joint: String,
        /// What is wrong with it.
        error: CircleError,
    },
    /// Not the right joints.
    #[error("circles of the last two joints are needed, one of each; the arm has {joints} joints")]
    OtherJoints {
        /// Joints of the arm.
        joints: usize,
    },
    /// A joint that slides.
    #[error("joint {joint} slides: it makes no circle; give the place of the SMR, or leave it free")]
    Slides {
        /// Name of the joint.
        joint: String,
    },
    /// A pendant value that turns several joints.
    #[error("joint {joint} is coupled: turning it alone moves {moves} too, and the SMR leaves its circle")]
    Coupled {
        /// Name of the joint.
        joint: String,
        /// Name of the joint that moves with it.
        moves: String,
    },
    /// A configuration with the wrong number of joints, or not one per point.
    #[error(
        "joint {joint}: {configurations} configurations and {points} points; each point needs a configuration of {joints} joint values"
    )]
    Counts {
        /// Name of the joint.
        joint: String,
        /// Configurations given.
        configurations: usize,
        /// Points given.
        points: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// The rest of the arm moved.
    #[error(
        "joint {moved} moved while joint {turned} was turned: only the last two joints may move, one after the other"
    )]
    NotStill {
        /// Name of the joint that moved.
        moved: String,
        /// Name of the joint of the circle.
        turned: String,
    },
    /// Axes that do not cross.
    #[error(
        "the last two axes, {first} and {second}, are parallel within {:.0} deg: circles about them do not tell where the flange is along them; give the place of the SMR, or leave it free",
        to_deg(NEARLY_PARALLEL)
    )]
    Parallel {
        /// Name of one joint.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// The least-squares adjustment fails.
    #[error("the circles do not fit the last two joints of this arm: check the joint values of the points")]
    NoFit,
    /// Limits that leave too little.
    #[error(
        "joint {joint} can turn only {:.1} deg inside its limits; at least {:.0} deg are needed",
        to_deg(*range), to_deg(SHORTEST_ARC)
    )]
    NarrowLimits {
        /// Name of the joint.
        joint: String,
        /// Width of the limits (rad).
        range: f64,
    },
    /// A plan of too few points.
    #[error("a circle of {count} points has no residual: plan at least 4, better 8")]
    FewPlanned {
        /// Points asked for.
        count: usize,
    },
}

/// Points of a circle: only one joint turned.
#[derive(Clone, Copy, Debug)]
pub struct CircleSeries<'a> {
    /// Index of the joint that turned.
    pub joint: usize,
    /// Configurations (rad, sliding joints m).
    pub configurations: &'a [Vec<f64>],
    /// The SMR in the tracker frame at each of them (m).
    pub points: &'a [Point3<f64>],
}

/// Where the SMR sits on the flange.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetLocation {
    /// The SMR in the flange frame (m).
    pub point_in_flange: Point3<f64>,
    /// Covariance of its coordinates (m²): noise of the readings and expected deviations of the last two links.
    pub covariance: Matrix3<f64>,
    /// Covariance by the noise of the readings alone (m²).
    pub measured: Matrix3<f64>,
    /// Standard deviation of a coordinate of a reading (m): the stated one, else that of the residuals.
    pub reading_sigma: f64,
    /// Distance of each point from where it should be (m), first series first, in the order of its points.
    pub residuals: [Vec<f64>; 2],
    /// Root mean square of the residuals (m).
    pub rms: f64,
    /// Root mean square that noise and expected deviations explain (m): far more means wrong joint values, an SMR that moved,
    /// or a frame that is mirrored.
    pub expected_rms: f64,
    /// The circles, in the order of the series; normals in the sense in which the pendant values grow.
    pub circles: [CircleFit; 2],
    /// The base of the nominal arm in the tracker frame, right for the last two axes only.
    pub tracker_from_base: Isometry3<f64>,
}

impl TargetLocation {
    /// Standard deviation of each coordinate (m).
    pub fn sigma(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(|variance| variance.max(0.0).sqrt())
    }

    /// The largest residual (m).
    pub fn max(&self) -> f64 {
        self.residuals.iter().flatten().copied().fold(0.0, f64::max)
    }
}

/// Locates the SMR from one series of each of the last two joints, in any order, measured with the rest of the arm still.
///
/// `sigma` is the standard deviation of a coordinate of a reading (m), if it is known. `expected` are the expected deviations
/// of the arm; those of the last two links widen the covariance, the others do not matter.
///
/// # Errors
/// Series of other joints, joints that slide or are coupled, an arm that was not still, circles that cannot be fitted, or last
/// axes that are parallel.
pub fn locate_target(
    chain: &KinematicChain,
    a: &CircleSeries<'_>,
    b: &CircleSeries<'_>,
    sigma: Option<f64>,
    expected: &[FreeParameter],
) -> Result<TargetLocation, CirclePointError> {
    let joints = chain.dof();
    let last_two = joints
        .checked_sub(2)
        .map(|first| (first, first + 1))
        .filter(|last_two| (a.joint, b.joint) == *last_two || (b.joint, a.joint) == *last_two);
    let Some((first_moving, _)) = last_two else { return Err(CirclePointError::OtherJoints { joints }) };
    check_joint(chain, a.joint)?;
    check_joint(chain, b.joint)?;
    check_still(chain, a, a, first_moving)?;
    check_still(chain, a, b, first_moving)?;
    let (line_a, line_b) = (NominalLine::of(chain, a)?, NominalLine::of(chain, b)?);
    if line_a.direction.cross(&line_b.direction).norm() < NEARLY_PARALLEL.sin() {
        let [first, second] = [a.joint.min(b.joint), a.joint.max(b.joint)].map(|joint| name_of(chain, joint));
        return Err(CirclePointError::Parallel { first, second });
    }
    let circles = [measured_circle(chain, a, sigma)?, measured_circle(chain, b, sigma)?];
    let [circle_a, circle_b] = &circles;
    let measured =
        [circle_a, circle_b].map(|fit| NominalLine { point: fit.centre, direction: fit.normal.into_inner() });
    let start = register_lines([line_a, line_b], measured).ok_or(CirclePointError::NoFit)?;
    adjustment::adjust(chain, [a, b], circles, start, sigma, expected)
}

/// Name of a joint for messages.
fn name_of(chain: &KinematicChain, joint: usize) -> String {
    chain.joints().get(joint).map_or_else(|| format!("{}", joint + 1), |joint| joint.name.clone())
}

/// Whether a joint turns, and alone.
fn check_joint(chain: &KinematicChain, index: usize) -> Result<(), CirclePointError> {
    let Some(joint) = chain.joints().get(index) else {
        return Err(CirclePointError::OtherJoints { joints: chain.dof() });
    };
    if joint.joint_type != JointType::Revolute {
        return Err(CirclePointError::Slides { joint: joint.name.clone() });
    }
    let mut others = chain.joints().iter().enumerate().filter(|(other, _)| *other != index);
    match others.find(|(other, joint)| joint.variable_by_pendant(*other, index).abs() > 0.0) {
        Some((_, moved)) => Err(CirclePointError::Coupled { joint: joint.name.clone(), moves: moved.name.clone() }),
        None => Ok(()),
    }
}

/// Whether the joints before `first_moving`, and those that `series` does not turn, keep to the first configuration (of
/// `reference` for the former).
fn check_still(
    chain: &KinematicChain,
    reference: &CircleSeries<'_>,
    series: &CircleSeries<'_>,
    first_moving: usize,
) -> Result<(), CirclePointError> {
    let (configurations, points, joints) = (series.configurations.len(), series.points.len(), chain.dof());
    let is_complete = |q: &Vec<f64>| q.len() == joints && q.iter().all(|value| value.is_finite());
    if configurations != points || configurations == 0 || !series.configurations.iter().all(is_complete) {
        return Err(CirclePointError::Counts { joint: name_of(chain, series.joint), configurations, points, joints });
    }
    let reference = reference.configurations.first().map(Vec::as_slice).unwrap_or_default();
    let own = series.configurations.first().map(Vec::as_slice).unwrap_or_default();
    for q in series.configurations {
        for (index, joint) in chain.joints().iter().enumerate().filter(|(index, _)| *index != series.joint) {
            let tolerance = if joint.joint_type == JointType::Revolute { STILL.0 } else { STILL.1 };
            let expected = if index < first_moving { reference } else { own };
            let moved = q.get(index).zip(expected.get(index)).is_none_or(|(a, b)| (a - b).abs() > tolerance);
            if moved {
                return Err(CirclePointError::NotStill {
                    moved: joint.name.clone(),
                    turned: name_of(chain, series.joint),
                });
            }
        }
    }
    Ok(())
}

/// A line with a sense.
#[derive(Clone, Copy, Debug)]
struct NominalLine {
    point: Point3<f64>,
    direction: Vector3<f64>,
}

impl NominalLine {
    /// The axis of the joint that a series turns, in the base of the nominal arm; its sense is that of the pendant value.
    fn of(chain: &KinematicChain, series: &CircleSeries<'_>) -> Result<Self, CirclePointError> {
        let q = series.configurations.first().ok_or(CirclePointError::NoFit)?;
        let jacobian = ForwardKinematics::new(chain).configuration_jacobian(q, &Point3::origin());
        let column = jacobian.matrix.column(series.joint);
        let linear = Vector3::new(column[0], column[1], column[2]);
        let direction = Vector3::new(column[3], column[4], column[5]);
        // The flange goes round the axis with `linear`: the foot of the perpendicular from it.
        Ok(Self { point: jacobian.point_in_base + direction.cross(&linear), direction })
    }
}

/// The circle of a series; its normal in the sense in which the pendant values grow.
fn measured_circle(
    chain: &KinematicChain,
    series: &CircleSeries<'_>,
    sigma: Option<f64>,
) -> Result<CircleFit, CirclePointError> {
    let mut fit = fit_circle(series.points, sigma)
        .map_err(|error| CirclePointError::Circle { joint: name_of(chain, series.joint), error })?;
    let values: Vec<f64> = series.configurations.iter().filter_map(|q| q.get(series.joint)).copied().collect();
    if !turns_with(&fit, series.points, &values) {
        fit.normal = -fit.normal;
        for residual in &mut fit.residuals {
            residual.out_of_plane = -residual.out_of_plane;
        }
    }
    Ok(fit)
}

/// Whether points go round the normal of their circle in the sense in which the joint values grow.
fn turns_with(fit: &CircleFit, points: &[Point3<f64>], values: &[f64]) -> bool {
    // Angles about the normal follow the joint values or their negatives: the sum of unit phasors says which.
    let reference = points.first().map_or_else(Vector3::x, |point| point - fit.centre);
    let across = fit.normal.cross(&reference);
    let (mut same, mut opposite) = ((0.0, 0.0), (0.0, 0.0));
    for (point, value) in points.iter().zip(values) {
        let from_centre = point - fit.centre;
        let seen = from_centre.dot(&across).atan2(from_centre.dot(&reference));
        let add = |sum: &mut (f64, f64), angle: f64| *sum = (sum.0 + angle.cos(), sum.1 + angle.sin());
        add(&mut same, seen - value);
        add(&mut opposite, seen + value);
    }
    opposite.0.hypot(opposite.1) <= same.0.hypot(same.1)
}

/// The motion that brings two lines onto two others: both directions, and the middle of their common perpendicular.
fn register_lines(from: [NominalLine; 2], to: [NominalLine; 2]) -> Option<Isometry3<f64>> {
    let (from_axes, from_middle) = crossing(from)?;
    let (to_axes, to_middle) = crossing(to)?;
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(to_axes * from_axes.transpose()));
    Some(Isometry3::from_parts(Translation3::from(to_middle - rotation * from_middle), rotation))
}

/// Axes of two lines that are not parallel, and the middle of their common perpendicular.
fn crossing([first, second]: [NominalLine; 2]) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let normal = Unit::try_new(first.direction.cross(&second.direction), 1e-6)?.into_inner();
    let axes = Matrix3::from_columns(&[first.direction, normal, first.direction.cross(&normal)]);
    let cosine = first.direction.dot(&second.direction);
    let across = second.point - first.point;
    let (along_first, along_second) = (across.dot(&first.direction), across.dot(&second.direction));
    let scale = 1.0 - cosine * cosine;
    let foot = |line: &NominalLine, along: f64| line.point.coords + line.direction * (along / scale);
    let feet = foot(&first, along_first - cosine * along_second) + foot(&second, cosine * along_first - along_second);
    Some((axes, feet / 2.0))
}

/// Configurations that turn one joint evenly from `base`, over as much of its limits as 300° allow and around its base value
/// where possible. `limits` has one range per joint (rad, sliding joints m).
///
/// # Errors
/// A joint that the arm does not have, that slides or is coupled, limits that are too narrow, or fewer than four points.
pub fn circle_plan(
    chain: &KinematicChain,
    limits: &[(f64, f64)],
    joint: usize,
    base: &[f64],
    count: usize,
) -> Result<Vec<Vec<f64>>, CirclePointError> {
    check_joint(chain, joint)?;
    if base.len() != chain.dof() {
        return Err(CirclePointError::Counts {
            joint: name_of(chain, joint),
            configurations: 1,
            points: count,
            joints: chain.dof(),
        });
    }
    if count < 4 {
        return Err(CirclePointError::FewPlanned { count });
    }
    let (low, high) = limits.get(joint).copied().unwrap_or((0.0, 0.0));
    let arc = (high - low).min(LONGEST_ARC);
    if arc.is_nan() || arc < SHORTEST_ARC {
        return Err(CirclePointError::NarrowLimits { joint: name_of(chain, joint), range: high - low });
    }
    let middle = base.get(joint).copied().unwrap_or_default();
    let from = (middle - arc / 2.0).clamp(low, (high - arc).max(low));
    let step = arc / (count - 1) as f64;
    let turned = (0..count).map(|index| {
        let mut q = base.to_vec();
        if let Some(value) = q.get_mut(joint) {
            *value = (from + index as f64 * step).min(high);
        }
        q
    });
    Ok(turned.collect())
}

#[cfg(test)]
mod tests;
