//! Compensation: what to command so that the real arm reaches what the nominal one would have reached.
//!
//! The identified arm is inverted numerically from the intended configuration, on position and orientation of a point of the tool
//! together (see [`inverse`]). Corrections are small, so two or three steps do. A joint that would pass its limit is
//! held there and the others continue without it. If the orientation cannot be reached with small corrections (near a singularity), only
//! the position is reached and the result says so; if the position cannot be reached either, nothing is commanded.
//!
//! A controller that gets a pose instead of joint values inverts its own nominal arm, in the configuration that the program states. So
//! what it gets is the pose that the nominal arm has at the corrected joint values, and these must be in the same configuration.
//!
//! No files, no profiles, no randomness but from a seed.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::inverse::{self, Found, Held, InverseKinematics, Posture, Search, distance};
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::units::{DEGREE, MICROMETRE, MILLIMETRE, Quantity};

#[derive(Clone, Debug, PartialEq)]
pub struct ToolArm {
    pub chain: KinematicChain,
    /// The tool frame in the flange; identity for the flange itself.
    pub flange_from_tool: Isometry3<f64>,
}

/// Settings of the compensation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Only the position of the tool point counts.
    pub position_only: bool,
    /// Largest position error that counts as reached (m).
    pub position_tolerance: f64,
    /// Largest orientation error that counts as reached (rad).
    pub angle_tolerance: f64,
    /// Largest correction of a turning joint (rad): more means a singularity.
    pub largest_turn: f64,
    /// Largest correction of a sliding joint (m).
    pub largest_slide: f64,
}

/// 1 µm, 1 µrad; 5° and 50 mm.
impl Default for Settings {
    fn default() -> Self {
        Self {
            position_only: false,
            position_tolerance: MICROMETRE,
            angle_tolerance: 1e-6,
            largest_turn: 5.0 * DEGREE,
            largest_slide: 50.0 * MILLIMETRE,
        }
    }
}

/// A goal for the tool.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// The pose that the nominal arm reaches at this pendant configuration ((rad) or (m)).
    Configuration(Vec<f64>),
    /// A pose of the tool in the base; the nearest nominal solution to `near`, or to the middle of the limits.
    Pose {
        /// The pose (m).
        base_from_tool: Isometry3<f64>,
        /// A configuration of the intended branch.
        near: Option<Vec<f64>>,
    },
    /// A point in the base; orientation free.
    Position {
        /// The point (m).
        point_in_base: Point3<f64>,
        /// A configuration of the intended branch.
        near: Option<Vec<f64>>,
    },
}

/// How far a goal is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Status {
    /// Position and orientation, or the position if only that was requested.
    Reached,
    /// The position; the orientation would need larger corrections than allowed: near a singularity.
    PositionOnly,
    /// Nothing, because these joints (from 0) are held at their limits.
    AtLimit(Vec<usize>),
    /// Nothing: corrections become too large, near a singularity.
    Singular,
    /// Nothing: the goal is out of reach.
    OutOfReach,
    /// Nothing: the intended configuration is itself beyond the limit of these joints (from 0).
    BeyondLimit(Vec<usize>),
    /// Nothing: the nominal arm does not reach the pose in the configuration that is stated.
    NotInConfiguration,
    /// Nothing: several branches reach the pose, and what is stated does not tell which is meant.
    Ambiguous,
    /// Nothing: the corrected joint values are in another configuration than the one that is stated.
    OtherConfiguration,
}

impl Status {
    /// Whether the command can be used.
    pub const fn is_usable(&self) -> bool {
        matches!(self, Self::Reached | Self::PositionOnly)
    }

    /// The word in tables.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::PositionOnly => "position_only",
            Self::AtLimit(_) => "at_limit",
            Self::Singular => "singular",
            Self::OutOfReach => "out_of_reach",
            Self::BeyondLimit(_) => "beyond_limit",
            Self::NotInConfiguration => "not_in_configuration",
            Self::Ambiguous => "ambiguous",
            Self::OtherConfiguration => "other_configuration",
        }
    }
}

/// The command for a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Compensated {
    /// Pendant configuration that the nominal arm would need ((rad) or (m)); none if it cannot reach the goal.
    pub meant: Option<Vec<f64>>,
    /// Pendant configuration to command; if the goal is not reached, the best one found. Use it only if the status allows it.
    pub command: Vec<f64>,
    /// Remaining distance between the identified arm at `command` and the goal (m).
    pub position_error: f64,
    /// Remaining orientation error (rad); zero if the orientation is free.
    pub angle_error: f64,
    /// How far the goal is reached.
    pub status: Status,
}

/// A pose for a tool in a configuration, as programs state it.
#[derive(Clone, Copy)]
pub struct PoseGoal<'g> {
    /// Where the tool is to be (m).
    pub base_from_tool: Isometry3<f64>,
    /// The tool in the flange (m).
    pub flange_from_tool: Isometry3<f64>,
    /// Whether a configuration of the nominal arm is the one that is stated.
    pub is_meant: &'g dyn Fn(Option<&Posture>, &[f64]) -> bool,
    /// A configuration of the intended branch, where one is known: of several that could be meant the nearest one is.
    pub near: Option<&'g [f64]>,
}

impl std::fmt::Debug for PoseGoal<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("PoseGoal")
            .field("base_from_tool", &self.base_from_tool)
            .field("flange_from_tool", &self.flange_from_tool)
            .field("near", &self.near)
            .finish_non_exhaustive()
    }
}

/// The pose to command so that the real arm brings its tool to a [`PoseGoal`].
#[derive(Clone, Debug, PartialEq)]
pub struct PoseCommand {
    /// Configuration that the nominal arm would take for the goal ((rad) or (m)).
    pub meant: Vec<f64>,
    /// Configuration that it takes for the command.
    pub command: Vec<f64>,
    /// The pose to command (m).
    pub base_from_tool: Isometry3<f64>,
    /// Remaining distance between the identified arm at `command` and the goal (m).
    pub position_error: f64,
    /// Remaining orientation error (rad).
    pub angle_error: f64,
}

/// Inverts the identified arm.
#[derive(Clone, Debug)]
pub struct Compensator<'a> {
    nominal: Side<'a>,
    identified: Side<'a>,
    inverse: InverseKinematics<'a>,
    quantities: Vec<Quantity>,
    limits: Vec<Option<(f64, f64)>>,
    settings: Settings,
}

/// One of the two arms with its kinematics.
#[derive(Clone, Debug)]
struct Side<'a> {
    arm: ForwardKinematics<'a>,
    flange_from_tool: Isometry3<f64>,
}

impl<'a> Side<'a> {
    fn new(arm: &'a ToolArm) -> Self {
        Self { arm: ForwardKinematics::new(&arm.chain), flange_from_tool: arm.flange_from_tool }
    }

    fn base_from_tool(&self, q: &[f64]) -> Isometry3<f64> {
        self.arm.base_from_flange(q) * self.flange_from_tool
    }

    fn with_tool(&self, flange_from_tool: Isometry3<f64>) -> Self {
        Self { flange_from_tool, ..self.clone() }
    }

    /// The goal of a search for a pose of the tool, or for its position only.
    fn goal(&self, base_from_tool: &Isometry3<f64>, with_angle: bool) -> inverse::Goal {
        let flange_from_tool = self.flange_from_tool;
        if with_angle {
            inverse::Goal::Tool { base_from_tool: *base_from_tool, flange_from_tool }
        } else {
            inverse::Goal::Point {
                in_base: Point3::from(base_from_tool.translation.vector),
                in_flange: Point3::from(flange_from_tool.translation.vector),
            }
        }
    }
}

/// Number of starts of the search for a Cartesian goal, whose branch is not known.
const STARTS: usize = 60;
/// Below this share of the tolerance a search stops.
const FINE: f64 = 1e-4;
/// Range of a joint without limits, to both sides (rad, m).
const UNLIMITED: (f64, f64) = (PI, 1.0);
/// Two configurations are one if no joint differs by more (rad, m).
const SAME: f64 = 1e-5;
/// How much farther the second branch must be than the nearest one, so that the nearest is meant (rad).
const CLEARLY: f64 = 5.0 * DEGREE;

impl<'a> Compensator<'a> {
    /// Prepares two arms with the same joints. `limits` are pendant values ((rad) or (m)), one entry per joint.
    pub fn new(
        nominal: &'a ToolArm,
        identified: &'a ToolArm,
        limits: &[Option<(f64, f64)>],
        settings: Settings,
    ) -> Self {
        let dof = nominal.chain.dof();
        let limits: Vec<_> = (0..dof).map(|index| limits.get(index).copied().flatten()).collect();
        Self {
            nominal: Side::new(nominal),
            identified: Side::new(identified),
            inverse: InverseKinematics::new(&nominal.chain, &limits),
            quantities: nominal.chain.joints().iter().map(|joint| joint.joint_type.quantity()).collect(),
            limits,
            settings,
        }
    }

    /// The inverse kinematics of the nominal arm.
    pub const fn inverse(&self) -> &InverseKinematics<'a> {
        &self.inverse
    }

    /// The pose in the base (m) of a tool that the identified arm carries, at a configuration.
    pub fn identified_pose(&self, q: &[f64], flange_from_tool: &Isometry3<f64>) -> Isometry3<f64> {
        self.identified.arm.base_from_flange(q) * flange_from_tool
    }

    /// The command for a goal.
    pub fn solve(&self, goal: &Goal) -> Compensated {
        match goal {
            Goal::Configuration(meant) => {
                if meant.len() != self.limits.len() {
                    return Self::unreached(meant, Status::BeyondLimit(Vec::new()));
                }
                let meant = self.inverse.turned_into_limits(meant);
                let beyond = self.inverse.beyond(&meant);
                if !beyond.is_empty() {
                    return Self::unreached(&meant, Status::BeyondLimit(beyond));
                }
                let goal = self.nominal.base_from_tool(&meant);
                self.correct(&self.identified, &meant, &goal, !self.settings.position_only, None)
            }
            Goal::Pose { base_from_tool, near } if self.settings.position_only => {
                self.reach(base_from_tool, false, near.as_deref())
            }
            Goal::Pose { base_from_tool, near } => self.reach(base_from_tool, true, near.as_deref()),
            Goal::Position { point_in_base, near } => {
                let pose = Isometry3::translation(point_in_base.x, point_in_base.y, point_in_base.z);
                self.reach(&pose, false, near.as_deref())
            }
        }
    }

    /// The pose to command for a pose that is stated with its configuration.
    ///
    /// # Errors
    /// The reason why there is none: it never [is usable](Status::is_usable).
    pub fn solve_pose(&self, goal: &PoseGoal<'_>) -> Result<PoseCommand, Status> {
        let meant = self.taken(goal)?;
        let identified = self.identified.with_tool(goal.flange_from_tool);
        // The controller holds the redundant joint where it is; so the correction does.
        let done = self.correct(&identified, &meant, &goal.base_from_tool, true, self.inverse.held_of(&meant));
        match done.status {
            Status::Reached => {}
            Status::PositionOnly => return Err(Status::Singular),
            status => return Err(status),
        }
        // The controller inverts the nominal arm for the written pose; it must end at these very joint values.
        let base_from_tool = self.nominal.arm.base_from_flange(&done.command) * goal.flange_from_tool;
        let taken = self.taken(&PoseGoal { base_from_tool, ..*goal });
        let is_same = self.inverse.posture(&meant) == self.inverse.posture(&done.command)
            && taken.is_ok_and(|taken| distance(&taken, &done.command) < SAME);
        if !is_same {
            return Err(Status::OtherConfiguration);
        }
        Ok(PoseCommand {
            base_from_tool,
            meant,
            command: done.command,
            position_error: done.position_error,
            angle_error: done.angle_error,
        })
    }

    /// The configuration that the nominal arm takes for a pose.
    ///
    /// # Errors
    /// No configuration, or several branches of which none is clearly meant.
    pub fn taken(&self, goal: &PoseGoal<'_>) -> Result<Vec<f64>, Status> {
        let base_from_flange = goal.base_from_tool * goal.flange_from_tool.inverse();
        let is_meant = |q: &[f64]| (goal.is_meant)(self.inverse.posture(q).as_ref(), q);
        if let Some(near) = goal.near
            && (!self.inverse.is_closed() || near.len() != self.limits.len())
        {
            let found = self.inverse.nearest(&base_from_flange, near).ok_or(Status::NotInConfiguration)?;
            return if is_meant(&found) { Ok(found) } else { Err(Status::NotInConfiguration) };
        }
        // Among full turns of one branch the nearest to zero, where nothing else is known.
        let zero = vec![0.0; self.limits.len()];
        let near = goal.near.unwrap_or(&zero);
        let mut meant = self.inverse.meant(&base_from_flange, near, goal.is_meant);
        meant.sort_by(|a, b| distance(a, near).total_cmp(&distance(b, near)));
        let Some(first) = meant.first() else {
            let is_reachable = !self.inverse.solutions(&base_from_flange).is_empty();
            return Err(if is_reachable { Status::NotInConfiguration } else { Status::OutOfReach });
        };
        // There is one solution of each branch.
        let is_clear = meant
            .get(1)
            .is_none_or(|rival| goal.near.is_some_and(|near| distance(rival, near) > distance(first, near) + CLEARLY));
        if is_clear { Ok(first.clone()) } else { Err(Status::Ambiguous) }
    }

    fn unreached(meant: &[f64], status: Status) -> Compensated {
        Compensated {
            meant: Some(meant.to_vec()),
            command: meant.to_vec(),
            position_error: f64::NAN,
            angle_error: f64::NAN,
            status,
        }
    }

    /// Moves first the nominal arm to the goal, which gives the branch, then the identified one from there.
    fn reach(&self, goal: &Isometry3<f64>, with_angle: bool, near: Option<&[f64]>) -> Compensated {
        let middle: Vec<f64> = self.ranges().map(|(low, high)| f64::midpoint(low, high)).collect();
        let first = near.filter(|near| near.len() == middle.len()).unwrap_or(&middle);
        if with_angle && self.inverse.is_closed() {
            let flange = goal * self.nominal.flange_from_tool.inverse();
            if let Some(meant) = self.inverse.nearest(&flange, first) {
                return self.correct(&self.identified, &meant, goal, true, None);
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut best: Option<Found> = None;
        let search = self.search(&self.nominal);
        let nominal_goal = self.nominal.goal(goal, with_angle);
        for start in 0..STARTS {
            let q: Vec<f64> = if start == 0 {
                first.to_vec()
            } else {
                self.ranges().map(|(low, high)| if low < high { random.random_range(low..high) } else { low }).collect()
            };
            let mut found = search.from(&self.clamped(&q), &nominal_goal);
            self.inverse.unwind(&mut found.q, first);
            let is_reached = self.is_reached(&found);
            let is_better = best.as_ref().is_none_or(|best| {
                let before = (self.is_reached(best), distance(&best.q, first));
                if is_reached == before.0 {
                    if is_reached { distance(&found.q, first) < before.1 } else { found.position < best.position }
                } else {
                    is_reached
                }
            });
            if is_better {
                best = Some(found);
            }
            // A given configuration selects the branch; without one the nearest of several solutions is taken.
            if is_reached && (near.is_some() || start >= STARTS / 4) {
                break;
            }
        }
        let Some(best) = best else { return Self::unreached(first, Status::OutOfReach) };
        let corrected = self.correct(&self.identified, &best.q, goal, with_angle, None);
        if self.is_reached(&best) {
            return corrected;
        }
        // A goal that the nominal arm just misses may still be reached by the real one.
        if corrected.status == Status::Reached {
            return Compensated { meant: None, ..corrected };
        }
        let status = if best.held.is_empty() { Status::OutOfReach } else { Status::AtLimit(best.held.clone()) };
        Compensated { meant: None, status, ..corrected }
    }

    /// Moves the identified arm to the goal, from the intended configuration.
    fn correct(
        &self,
        identified: &Side<'a>,
        meant: &[f64],
        goal: &Isometry3<f64>,
        with_angle: bool,
        held: Option<Held>,
    ) -> Compensated {
        let result = |found: Found, status: Status| Compensated {
            meant: Some(meant.to_vec()),
            command: found.q,
            position_error: found.position,
            angle_error: found.angle,
            status,
        };
        let search = Search { held, ..self.search(identified) };
        let full = search.from(meant, &identified.goal(goal, with_angle));
        let is_small = self.is_small(&full.q, meant);
        if self.is_reached(&full) && is_small {
            return result(full, Status::Reached);
        }
        if with_angle {
            let mut position = search.from(meant, &identified.goal(goal, false));
            if self.is_reached(&position) && self.is_small(&position.q, meant) {
                position.angle = identified.base_from_tool(&position.q).rotation.angle_to(&goal.rotation);
                return result(position, Status::PositionOnly);
            }
        }
        let status = if !full.held.is_empty() {
            Status::AtLimit(full.held.clone())
        } else if is_small {
            Status::OutOfReach
        } else {
            Status::Singular
        };
        result(full, status)
    }

    fn search<'s>(&'s self, side: &'s Side<'a>) -> Search<'s, 'a> {
        let fine = FINE * self.settings.position_tolerance.min(self.settings.angle_tolerance);
        Search { arm: &side.arm, limits: &self.limits, held: None, fine }
    }

    fn is_reached(&self, found: &Found) -> bool {
        found.position <= self.settings.position_tolerance && found.angle <= self.settings.angle_tolerance
    }

    fn is_small(&self, q: &[f64], meant: &[f64]) -> bool {
        q.iter().zip(meant).zip(&self.quantities).all(|((q, meant), quantity)| {
            let largest = match quantity {
                Quantity::Angle => self.settings.largest_turn,
                Quantity::Length => self.settings.largest_slide,
            };
            (q - meant).abs() <= largest
        })
    }

    fn ranges(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.limits.iter().zip(&self.quantities).map(|(limits, quantity)| {
            let wide = match quantity {
                Quantity::Angle => UNLIMITED.0,
                Quantity::Length => UNLIMITED.1,
            };
            let (low, high) = limits.unwrap_or((-wide, wide));
            // More than one turn to each side reaches no new pose.
            match quantity {
                Quantity::Angle => (low.max(-PI).min(high), high.min(PI).max(low)),
                Quantity::Length => (low, high),
            }
        })
    }

    fn clamped(&self, q: &[f64]) -> Vec<f64> {
        let pairs = q.iter().zip(&self.limits);
        pairs.map(|(value, limits)| limits.map_or(*value, |(low, high)| value.clamp(low, high))).collect()
    }
}
