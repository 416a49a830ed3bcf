//! What the arm does between two corrected targets.
//!
//! A controller interpolates the pose between the targets it gets and inverts its nominal arm all along. The ends are corrected, so
//! what remains is how much the error of the arm bends along the way.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::report::PathReport;
use crate::compensation::Compensator;
use crate::units::{MILLIMETRE, to_mm};

/// Distance between samples of a path (m), and their least and largest number.
const SPACING: f64 = 20.0 * MILLIMETRE;
const FEWEST: usize = 8;
const MOST: usize = 200;

/// The targets of one move as they are meant or as they are commanded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub(super) from: Isometry3<f64>,
    /// A point on the way of a circular move.
    pub(super) via: Option<Point3<f64>>,
    pub(super) to: Isometry3<f64>,
}

/// The positions of a path: a straight line, or an arc.
#[derive(Clone, Debug)]
enum Course {
    Line { from: Point3<f64>, to: Point3<f64> },
    Arc { centre: Point3<f64>, start: Vector3<f64>, axis: Unit<Vector3<f64>>, angle: f64 },
}

impl Course {
    fn new(ends: &Ends) -> Self {
        let (from, to) = (Point3::from(ends.from.translation.vector), Point3::from(ends.to.translation.vector));
        let line = Self::Line { from, to };
        let Some(via) = ends.via else { return line };
        let (a, b) = (via - from, to - from);
        let normal = a.cross(&b);
        let size = normal.norm_squared();
        if size < 1e-18 {
            return line;
        }
        let centre = from + (normal.cross(&a) * b.norm_squared() + b.cross(&normal) * a.norm_squared()) / (2.0 * size);
        let axis = Unit::new_normalize(normal);
        let start = from - centre;
        let end = to - centre;
        let angle = axis.dot(&start.cross(&end)).atan2(start.dot(&end)).rem_euclid(std::f64::consts::TAU);
        Self::Arc { centre, start, axis, angle }
    }

    fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => (to - from).norm(),
            Self::Arc { start, angle, .. } => start.norm() * angle,
        }
    }

    fn at(&self, part: f64) -> Point3<f64> {
        match self {
            Self::Line { from, to } => from + (to - from) * part,
            Self::Arc { centre, start, axis, angle } => {
                centre + UnitQuaternion::from_axis_angle(axis, angle * part) * start
            }
        }
    }
}

impl Ends {
    fn pose(&self, course: &Course, part: f64) -> Isometry3<f64> {
        let rotation = self.from.rotation.try_slerp(&self.to.rotation, part, 1e-12).unwrap_or(self.from.rotation);
        Isometry3::from_parts(Translation3::from(course.at(part).coords), rotation)
    }
}

/// The largest deviation of a path; `None` if the nominal arm cannot follow it from the configuration `start`.
pub(super) fn deviation(
    line: usize,
    compensator: &Compensator<'_>,
    flange_from_tool: &Isometry3<f64>,
    [meant, commanded]: [&Ends; 2],
    start: &[f64],
) -> Option<PathReport> {
    let courses = [Course::new(meant), Course::new(commanded)];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates, and no length is negative"
    )]
    let samples = ((courses[0].length() / SPACING).ceil() as usize).clamp(FEWEST, MOST);
    let mut near = [start.to_vec(), start.to_vec()];
    let mut largest = [0.0_f64; 2];
    for sample in 0..=samples {
        let part = sample as f64 / samples as f64;
        let goal = courses[0].at(part);
        // Without compensation the controller would get the meant path itself.
        for (index, ends) in [commanded, meant].into_iter().enumerate() {
            let pose = ends.pose(&courses[1 - index], part);
            let q = compensator.inverse().nearest(&(pose * flange_from_tool.inverse()), &near[index])?;
            let there = compensator.identified_pose(&q, flange_from_tool);
            largest[index] = largest[index].max((there.translation.vector - goal.coords).norm());
            near[index] = q;
        }
    }
    Some(PathReport { line, corrected_mm: to_mm(largest[0]), uncorrected_mm: to_mm(largest[1]) })
}
