//! The order of the poses: a short path through all of them that the arm can really follow.
//!
//! Home first and last; the time of each move is that of its slowest joint. A move that something blocks is avoided by
//! another order, or goes through a pose that is already known to be free: home, another measured pose, or a via pose that
//! the caller offers. Every move of the result is checked along its whole length ([`ArmShape::check_move`]).

mod moves;
mod tour;

use thiserror::Error;

use super::collision::{ArmShape, Obstruction};
use crate::kinematics::JointType;
use crate::units::DEGREE;
use moves::Moves;

/// Speed of a turning joint of which none is known (rad/s): 60°/s, slower than any joint of an arm that is measured by tracker.
pub const DEFAULT_JOINT_SPEED: f64 = 60.0 * DEGREE;

/// Speed of a sliding joint of which none is known (m/s).
pub const DEFAULT_SLIDE_SPEED: f64 = 0.25;

/// Rounds of avoiding blocked moves; each one knows all that the ones before have found.
const ROUNDS: usize = 60;

/// How fast things go. Seconds, radians, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// Highest speed of each joint (rad/s, sliding joints m/s); `None`, or an entry that is missing: a cautious default.
    pub max_speeds: Vec<Option<f64>>,
    /// Part of the highest speed that the program asks for, above 0 and at most 1.
    pub speed: f64,
    /// Time that each move takes longer than at constant speed (s): acceleration, braking, the exact stop.
    pub ramp: f64,
    /// Wait before the first reading of a pose (s).
    pub settle: f64,
    /// Readings per pose.
    pub shots: u32,
    /// Time of one reading (s).
    pub shot: f64,
}

/// A tenth of the full speed, 1 s of ramp, 2 s of settling as in the method paper, one reading of 1 s.
impl Default for Pace {
    fn default() -> Self {
        Self { max_speeds: Vec::new(), speed: 0.1, ramp: 1.0, settle: 2.0, shots: 1, shot: 1.0 }
    }
}

impl Pace {
    /// Time of one measurement (s), the way there not counted.
    pub fn measuring_time(&self) -> f64 {
        self.settle + f64::from(self.shots) * self.shot
    }

    /// Time of a move between two configurations (s); `joint_types` are those of the arm.
    pub fn move_time(&self, joint_types: impl IntoIterator<Item = JointType>, from: &[f64], to: &[f64]) -> f64 {
        let joints = joint_types.into_iter().zip(from).zip(to).enumerate();
        let slowest = joints.fold(0.0_f64, |slowest, (index, ((joint_type, from), to))| {
            let default = match joint_type {
                JointType::Revolute => DEFAULT_JOINT_SPEED,
                JointType::Prismatic => DEFAULT_SLIDE_SPEED,
            };
            let max_speed = self.max_speeds.get(index).copied().flatten().unwrap_or(default);
            slowest.max((to - from).abs() / (max_speed * self.speed))
        });
        if slowest > 0.0 { slowest + self.ramp } else { 0.0 }
    }
}

/// What to order.
#[derive(Clone, Copy, Debug)]
pub struct Stops<'a> {
    /// Where the program begins and ends (rad, sliding joints m).
    pub home: &'a [f64],
    /// The poses to measure, identification and verification alike.
    pub poses: &'a [Vec<f64>],
    /// Other configurations that may be passed through where a move is blocked.
    pub vias: &'a [Vec<f64>],
    /// Measure the first pose again after so many poses, and at the end; `None` or 0: never.
    pub drift_every: Option<usize>,
}

/// What happens at a step of a route.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StepKind {
    /// Begin and end.
    Home,
    /// A pose is measured.
    Measure,
    /// The first pose is measured again.
    Drift,
    /// Passed through only.
    Via,
}

/// One stop of a route.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What happens here.
    pub kind: StepKind,
    /// Place in [`Stops::poses`]; `None` for home and for vias that are not poses.
    pub pose: Option<usize>,
    /// Pendant joint values (rad, sliding joints m).
    pub configuration: Vec<f64>,
}

/// An order with its moves checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Home, the poses with drift poses and vias between them, home.
    pub steps: Vec<Step>,
    /// Time on the way (s).
    pub moving_time: f64,
    /// Time standing and measuring (s).
    pub measuring_time: f64,
}

impl Route {
    /// Time of the whole program (s).
    pub fn time(&self) -> f64 {
        self.moving_time + self.measuring_time
    }
}

/// Poses that no program can visit.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum OrderError {
    /// A configuration of the wrong length or outside the limits.
    #[error("{} is outside the joint limits", stop_text(*pose))]
    OutsideLimits {
        /// Place of the pose; `None`: home.
        pose: Option<usize>,
    },
    /// The arm cannot stand there.
    #[error("the arm cannot stand in {}: {obstruction}", stop_text(*pose))]
    Obstructed {
        /// Place of the pose; `None`: home.
        pose: Option<usize>,
        /// What is in the way.
        obstruction: Obstruction,
    },
    /// Every way there is blocked.
    #[error(
        "{} of the poses cannot be reached from home without a collision; leave them out, offer via poses, or choose \
         another home pose",
        poses.len()
    )]
    Unreachable {
        /// Places of the poses, ascending.
        poses: Vec<usize>,
    },
}

fn stop_text(pose: Option<usize>) -> String {
    pose.map_or_else(|| "the home pose".to_owned(), |pose| format!("pose {}", pose + 1))
}

/// Orders poses for the arm `shape`.
///
/// Nearest neighbour, then 2-opt and or-opt exchanges (Croes 1958; Or 1976) on the time of the moves; then the moves in
/// use are checked, blocked ones become as long as the way round, and the exchanges go on until nothing changes.
///
/// # Errors
/// A stop where the arm cannot stand, or poses that cannot be reached. Via configurations where the arm cannot stand are
/// passed over.
pub fn order(shape: &ArmShape<'_>, stops: &Stops<'_>, pace: &Pace) -> Result<Route, OrderError> {
    check_stops(shape, stops)?;
    let vias = stops.vias.iter().filter(|via| shape.is_within_limits(via) && shape.check(via).is_ok());
    let mut nodes = vec![stops.home];
    nodes.extend(stops.poses.iter().chain(vias).map(Vec::as_slice));
    let mut moves = Moves::new(shape, nodes, pace);

    let count = stops.poses.len() + 1;
    let mut times = tour::Times::new(count, |a, b| moves.time(a, b));
    let mut settled = tour::Pairs::new(count);
    let mut visits = tour::nearest_neighbour(&times);
    for _ in 0..ROUNDS {
        tour::improve(&mut visits, &times);
        let mut is_changed = false;
        for (a, b) in tour::legs(&visits) {
            if !settled.insert(a, b) || moves.is_free(a, b) {
                continue;
            }
            let Some(way) = moves.way(a, b) else { return Err(unreachable_poses(&mut moves, count)) };
            times.set(a, b, moves.way_time(&way));
            is_changed = true;
        }
        if !is_changed {
            break;
        }
    }

    let planned = with_drift(&visits, stops.drift_every.filter(|every| *every > 0));
    let mut route =
        Route { steps: vec![step(&moves, StepKind::Home, 0, count)], moving_time: 0.0, measuring_time: 0.0 };
    let mut at = 0;
    for (kind, node) in planned {
        let Some(way) = moves.way(at, node) else { return Err(unreachable_poses(&mut moves, count)) };
        route.moving_time += moves.way_time(&way);
        let between = way.iter().take(way.len().saturating_sub(1)).skip(1);
        route.steps.extend(between.map(|&via| step(&moves, StepKind::Via, via, count)));
        route.steps.push(step(&moves, kind, node, count));
        if kind != StepKind::Home {
            route.measuring_time += pace.measuring_time();
        }
        at = node;
    }
    Ok(route)
}

fn check_stops(shape: &ArmShape<'_>, stops: &Stops<'_>) -> Result<(), OrderError> {
    let poses = stops.poses.iter().enumerate().map(|(index, pose)| (Some(index), pose.as_slice()));
    for (pose, q) in std::iter::once((None, stops.home)).chain(poses) {
        if !shape.is_within_limits(q) {
            return Err(OrderError::OutsideLimits { pose });
        }
        shape.check(q).map_err(|obstruction| OrderError::Obstructed { pose, obstruction })?;
    }
    Ok(())
}

/// Node 0 is home, nodes below `count` are poses.
fn step(moves: &Moves<'_, '_>, kind: StepKind, node: usize, count: usize) -> Step {
    let pose = node.checked_sub(1).filter(|_| node < count);
    Step { kind, pose, configuration: moves.configuration(node).to_vec() }
}

fn unreachable_poses(moves: &mut Moves<'_, '_>, count: usize) -> OrderError {
    OrderError::Unreachable {
        poses: (1..count).filter(|&node| moves.way(0, node).is_none()).map(|node| node - 1).collect(),
    }
}

/// The stops after the first home: poses with the first one repeated, then home.
fn with_drift(visits: &[usize], every: Option<usize>) -> Vec<(StepKind, usize)> {
    let mut planned = Vec::new();
    let poses = visits.get(1..).unwrap_or_default();
    let mut since_drift = 0;
    for (index, &node) in poses.iter().enumerate() {
        planned.push((StepKind::Measure, node));
        since_drift += 1;
        let is_last = index + 1 == poses.len();
        if let (Some(every), Some(&first)) = (every, poses.first())
            && index > 0
            && (since_drift >= every || is_last)
        {
            planned.push((StepKind::Drift, first));
            since_drift = 0;
        }
    }
    planned.push((StepKind::Home, 0));
    planned
}

/// A home pose: the middle of the limits if the arm can stand there, or else the one of `others` (rad, sliding joints m) that
/// is nearest to it relative to the limits. `None` if there is none.
///
/// The result is on the grid of [`on_grid`](super::candidates::on_grid).
pub fn home_pose<'q>(shape: &ArmShape<'_>, others: impl IntoIterator<Item = &'q [f64]>) -> Option<Vec<f64>> {
    let limits = shape.limits();
    let middle: Vec<f64> = limits.iter().map(|(low, high)| f64::midpoint(*low, *high)).collect();
    let distance = |q: &[f64]| -> f64 {
        let parts = q.iter().zip(&middle).zip(limits).map(|((q, middle), (low, high))| (q - middle) / (high - low));
        parts.map(|part| part * part).sum()
    };
    let mut known: Vec<(f64, &[f64])> = others.into_iter().map(|q| (distance(q), q)).collect();
    known.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let grid = |q: &[f64]| super::candidates::on_grid(shape.arm().chain(), limits, q);
    let mut choice = std::iter::once(middle.as_slice()).chain(known.into_iter().map(|(_, q)| q)).map(grid);
    choice.find(|q| shape.is_within_limits(q) && shape.check(q).is_ok())
}
