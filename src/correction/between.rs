//! What the arm does between two corrected targets.
//!
//! A controller interpolates the pose between the targets it gets and inverts its nominal arm all along. The ends are corrected, so
//! what remains is how much the error of the arm bends along the way.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::report::PathReport;
use crate::compensation::{Compensator, PoseGoal};
use crate::inverse::Posture;
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
    Some(PathReport { line, corrected_mm: to_mm(largest[0]), uncorrected_mm: to_mm(largest[1]), inserted: 0 })
}

/// A point inside a linear move.
#[derive(Clone, Debug)]
pub(super) struct Inside {
    /// What to command there.
    pub(super) base_from_tool: Isometry3<f64>,
    /// Configurations of the nominal arm at the point and at its command.
    meant: Vec<f64>,
    pub(super) commanded: Vec<f64>,
}

/// Shortest piece of a move that is divided (m).
const SHORTEST: f64 = 4.0 * MILLIMETRE;
/// Most pieces of a move.
const MOST_PIECES: u32 = 64;

/// A linear move in pieces that deviate by no more than `limit` (m): the points between them, and the report. `None` if there is no such
/// division.
pub(super) fn divided(
    line: usize,
    compensator: &Compensator<'_>,
    flange_from_tool: &Isometry3<f64>,
    [meant, commanded]: [&Ends; 2],
    start: &[f64],
    limit: f64,
) -> Option<(Vec<Inside>, PathReport)> {
    let course = Course::new(meant);
    let mut pieces: u32 = 2;
    while pieces <= MOST_PIECES && course.length() >= SHORTEST * f64::from(pieces) {
        let points = inside(compensator, flange_from_tool, meant, start, pieces)?;
        let report = of_pieces(line, compensator, flange_from_tool, [meant, commanded], start, &points)?;
        if report.corrected_mm <= to_mm(limit) {
            return Some((points, report));
        }
        pieces *= 2;
    }
    None
}

/// The points that divide a move, each corrected in the branch of its start.
fn inside(
    compensator: &Compensator<'_>,
    flange_from_tool: &Isometry3<f64>,
    meant: &Ends,
    start: &[f64],
    pieces: u32,
) -> Option<Vec<Inside>> {
    let course = Course::new(meant);
    let posture = compensator.inverse().posture(start);
    let is_meant = |other: Option<&Posture>, _: &[f64]| other == posture.as_ref();
    let mut near = start.to_vec();
    (1..pieces)
        .map(|piece| {
            let goal = PoseGoal {
                base_from_tool: meant.pose(&course, f64::from(piece) / f64::from(pieces)),
                flange_from_tool: *flange_from_tool,
                is_meant: &is_meant,
                near: Some(&near),
            };
            let done = compensator.solve_pose(&goal).ok()?;
            near.clone_from(&done.meant);
            Some(Inside { base_from_tool: done.base_from_tool, meant: done.meant, commanded: done.command })
        })
        .collect()
}

/// The largest deviation of all pieces.
fn of_pieces(
    line: usize,
    compensator: &Compensator<'_>,
    flange_from_tool: &Isometry3<f64>,
    [meant, commanded]: [&Ends; 2],
    start: &[f64],
    points: &[Inside],
) -> Option<PathReport> {
    let course = Course::new(meant);
    let pieces = points.len() + 1;
    let mut all = PathReport { line, corrected_mm: 0.0, uncorrected_mm: 0.0, inserted: points.len() };
    for piece in 0..pieces {
        let at = |piece: usize| meant.pose(&course, piece as f64 / pieces as f64);
        let part = Ends { from: at(piece), via: None, to: at(piece + 1) };
        let before = piece.checked_sub(1).and_then(|before| points.get(before));
        let new = Ends {
            from: before.map_or(commanded.from, |point| point.base_from_tool),
            via: None,
            to: points.get(piece).map_or(commanded.to, |point| point.base_from_tool),
        };
        let start = before.map_or(start, |point| point.meant.as_slice());
        let report = deviation(line, compensator, flange_from_tool, [&part, &new], start)?;
        all.corrected_mm = all.corrected_mm.max(report.corrected_mm);
        all.uncorrected_mm = all.uncorrected_mm.max(report.uncorrected_mm);
    }
    Some(all)
}
