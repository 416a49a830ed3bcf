//! Chooses the cube and the configurations of a test.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::TestError;
use crate::inverse::InverseKinematics;
use crate::iso9283::{CYCLES, Cube, DIRECTIONS, EDGES, Label, MeasuringPlane, POSES};
use crate::planning::collision::{ArmShape, DEFAULT_CLEARANCE};
use crate::procedure::cell::{cell, planning_limits};
use crate::profile::Profile;
use crate::session::plan::{PlannedPose, PoseKind};
use crate::text::alternatives;
use crate::units::{DEGREE, MILLIMETRE, to_mm};

/// How far before a pose its approach begins (m).
const APPROACH: f64 = 50.0 * MILLIMETRE;
/// Poses that are approached from several directions, from 1.
const MULTI_DIRECTIONAL: [usize; 3] = [1, 2, 4];
/// Steps of the grid of centres, per reach of the arm.
const GRID: usize = 12;
/// Configurations that are checked on the way from one pose to the next.
const STEPS: usize = 12;

/// What is wanted of a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestPlanRequest {
    /// Edge of the cube (m); none: the longest one that the standard prefers and that fits.
    pub edge: Option<f64>,
    /// Centre of the cube in the base (m); none: wherever the arm is farthest from its limits.
    pub centre: Option<Point3<f64>>,
    /// The measuring plane.
    pub plane: MeasuringPlane,
    /// Number of cycles.
    pub cycles: usize,
    /// Whether P1, P2 and P4 are also approached from three directions.
    pub multi_directional: bool,
}

impl Default for TestPlanRequest {
    fn default() -> Self {
        Self { edge: None, centre: None, plane: MeasuringPlane::default(), cycles: CYCLES, multi_directional: false }
    }
}

/// A planned test.
#[derive(Clone, Debug, PartialEq)]
pub struct TestPlan {
    /// The cube.
    pub cube: Cube,
    /// Orientation of the flange at all poses.
    pub orientation: UnitQuaternion<f64>,
    /// P1 to P5 in the base (m): places of the target.
    pub poses: [Point3<f64>; POSES],
    /// The rows of the program, in order.
    pub rows: Vec<PlannedPose>,
}

/// Plans a test: the cube, and the program that visits P5, P4, P3, P2, P1 in every cycle.
///
/// The flange keeps its orientation, the arm its branch, and nothing is touched at the poses, at the corners of the cube, and between
/// consecutive poses.
///
/// # Errors
/// The profile has no joint ranges or no target, or no cube fits.
pub fn plan(profile: &Profile, request: &TestPlanRequest) -> Result<TestPlan, TestError> {
    let limits = planning_limits(profile).map_err(Box::new)?;
    // Sight is left to the operator: the tracker of a test may stand anywhere.
    let mut cell = cell(profile, limits.clone(), None, true).map_err(Box::new)?;
    cell.tracker = None;
    let shape = ArmShape::new(profile.chain(), &cell, DEFAULT_CLEARANCE)?;
    let bounds: Vec<_> = limits.iter().copied().map(Some).collect();
    let search = Search {
        inverse: InverseKinematics::new(profile.chain(), &bounds),
        shape,
        limits,
        point_in_flange: cell.target.position_in_flange,
        floor: cell.floor,
    };
    let edges = request.edge.map_or_else(|| EDGES.to_vec(), |edge| vec![edge]);
    let fitting = edges.iter().find_map(|&edge| search.best(edge, request));
    let (cube, found) = fitting.ok_or_else(|| {
        let edges: Vec<String> = edges.iter().map(|edge| to_mm(*edge).to_string()).collect();
        TestError::NoCube { edges: alternatives(&edges) }
    })?;
    Ok(search.program(cube, &found, request))
}

/// How the poses of a cube are reached.
struct Reached {
    orientation: UnitQuaternion<f64>,
    configurations: Vec<Vec<f64>>,
    /// Smallest distance from a joint limit, as a share of half the range.
    margin: f64,
}

struct Search<'a> {
    inverse: InverseKinematics<'a>,
    shape: ArmShape<'a>,
    limits: Vec<(f64, f64)>,
    point_in_flange: Point3<f64>,
    /// Height of the floor, z in the base (m).
    floor: Option<f64>,
}

impl Search<'_> {
    /// The cube of this edge at which the arm is farthest from its limits.
    fn best(&self, edge: f64, request: &TestPlanRequest) -> Option<(Cube, Reached)> {
        let centres = request.centre.map_or_else(|| self.centres(edge), |centre| vec![centre]);
        let mut best: Option<(Cube, Reached)> = None;
        for centre in centres {
            let cube = Cube { centre, edge };
            if let Some(reached) = self.reached(&cube, request.plane)
                && best.as_ref().is_none_or(|(_, known)| reached.margin > known.margin)
            {
                best = Some((cube, reached));
            }
        }
        best
    }

    /// Places for a cube in front of the robot, on its x axis.
    fn centres(&self, edge: f64) -> Vec<Point3<f64>> {
        let links = self.shape.arm().chain().joints().iter();
        let reach: f64 = links.map(|joint| joint.link.a.hypot(joint.link.d)).sum();
        let step = reach / GRID as f64;
        let steps =
            |from: f64| (0..2 * GRID).map(move |index| from + index as f64 * step).take_while(move |at| *at <= reach);
        // The base of some arms is at the shoulder, so there is room below it.
        let lowest = self.floor.unwrap_or(-reach) + edge / 2.0;
        steps(edge / 2.0).flat_map(|x| steps(lowest).map(move |z| Point3::new(x, 0.0, z))).collect()
    }

    fn reached(&self, cube: &Cube, plane: MeasuringPlane) -> Option<Reached> {
        let poses = cube.poses(plane);
        let mut best: Option<Reached> = None;
        for orientation in orientations() {
            for start in self.inverse.solutions(&self.flange(&orientation, &poses[0])) {
                let Some(configurations) = self.followed(&orientation, &poses, &start) else { continue };
                let margin = configurations.iter().map(|q| self.margin(q)).fold(f64::INFINITY, f64::min);
                let is_better = best.as_ref().is_none_or(|best| margin > best.margin);
                if is_better
                    && self.followed(&orientation, &cube.corners(), &start).is_some()
                    && self.is_free(&configurations)
                {
                    best = Some(Reached { orientation, configurations, margin });
                }
            }
        }
        best
    }

    /// Configurations of the same branch at all points, none of which touches anything.
    fn followed(
        &self,
        orientation: &UnitQuaternion<f64>,
        points: &[Point3<f64>],
        start: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        let posture = self.inverse.posture(start);
        points
            .iter()
            .map(|point| {
                let q = self.inverse.nearest(&self.flange(orientation, point), start)?;
                let fits = self.inverse.posture(&q) == posture
                    && self.shape.is_within_limits(&q)
                    && self.shape.check(&q).is_ok();
                fits.then_some(q)
            })
            .collect()
    }

    /// Whether nothing is touched between consecutive poses of a cycle.
    fn is_free(&self, configurations: &[Vec<f64>]) -> bool {
        let next = configurations.iter().cycle().skip(1);
        configurations.iter().zip(next).all(|(from, to)| {
            (1..STEPS).all(|step| {
                let share = step as f64 / STEPS as f64;
                let q: Vec<f64> = from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect();
                self.shape.check(&q).is_ok()
            })
        })
    }

    fn margin(&self, q: &[f64]) -> f64 {
        let shares = q.iter().zip(&self.limits).map(|(q, (low, high))| (q - low).min(high - q) / ((high - low) / 2.0));
        shares.fold(f64::INFINITY, f64::min)
    }

    /// The pose of the flange that brings the target to a point.
    fn flange(&self, orientation: &UnitQuaternion<f64>, point: &Point3<f64>) -> Isometry3<f64> {
        let origin = point - orientation * self.point_in_flange.coords;
        Isometry3::from_parts(Translation3::from(origin.coords), *orientation)
    }

    fn program(&self, cube: Cube, reached: &Reached, request: &TestPlanRequest) -> TestPlan {
        let poses = cube.poses(request.plane);
        let mut rows = Vec::new();
        for cycle in 1..=request.cycles {
            for pose in (1..=POSES).rev() {
                let label = Label { cycle, pose, direction: None };
                rows.push(row(
                    label.to_string(),
                    PoseKind::Verification,
                    &reached.configurations[pose - 1],
                    poses[pose - 1],
                ));
            }
        }
        if request.multi_directional {
            for cycle in 1..=request.cycles {
                for pose in MULTI_DIRECTIONAL {
                    self.approaches(cycle, pose, &poses[pose - 1], reached, &mut rows);
                }
            }
        }
        TestPlan { cube, orientation: reached.orientation, poses, rows }
    }

    /// A pose approached along the three axes of the base.
    fn approaches(
        &self,
        cycle: usize,
        pose: usize,
        point: &Point3<f64>,
        reached: &Reached,
        rows: &mut Vec<PlannedPose>,
    ) {
        let q = &reached.configurations[pose - 1];
        for direction in 1..=DIRECTIONS {
            let mut offset = Vector3::zeros();
            offset[direction - 1] = -APPROACH;
            let before = point + offset;
            let label = Label { cycle, pose, direction: Some(direction) }.to_string();
            if let Some(via) = self.inverse.nearest(&self.flange(&reached.orientation, &before), q) {
                rows.push(row(format!("{label} approach"), PoseKind::Via, &via, before));
            }
            rows.push(row(label, PoseKind::Verification, q, *point));
        }
    }
}

fn row(pose: String, kind: PoseKind, configuration: &[f64], point: Point3<f64>) -> PlannedPose {
    PlannedPose { pose, kind, configuration: configuration.to_vec(), point_in_base: Some(point) }
}

/// Orientations of the flange: down, forward and in between, turned about its axis in quarters.
fn orientations() -> impl Iterator<Item = UnitQuaternion<f64>> {
    [180.0, 135.0, 90.0].into_iter().flat_map(|tilt| {
        (0..4).map(move |quarter| {
            let tilted = Rotation3::from_axis_angle(&Vector3::y_axis(), tilt * DEGREE);
            let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(quarter) * 90.0 * DEGREE);
            UnitQuaternion::from_rotation_matrix(&(tilted * turned))
        })
    })
}
