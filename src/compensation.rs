//! Compensation: the joint values to command so that the real arm reaches what the nominal one would have reached.
//!
//! The identified arm is inverted numerically: damped least squares from the intended configuration (Levenberg 1944,
//! Marquardt 1963; Wampler 1986 for arms), on position and orientation of a point of the tool together, an angle counted as the
//! arc it makes at 1 m. Corrections are small, so two or three steps do. A joint that would pass its limit is held there and
//! the others continue without it. If the orientation cannot be reached with small corrections (near a singularity), only the
//! position is reached and the result says so; if the position cannot be reached either, nothing is commanded.
//!
//! No files, no profiles, no randomness but from a seed.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6xX, Point3, Translation3, UnitQuaternion, Vector6};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

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

/// Inverts the identified arm.
#[derive(Clone, Debug)]
pub struct Compensator<'a> {
    nominal: Side<'a>,
    identified: Side<'a>,
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

impl Side<'_> {
    fn base_from_tool(&self, q: &[f64]) -> Isometry3<f64> {
        self.arm.base_from_flange(q) * self.flange_from_tool
    }
}

/// The result of a search.
#[derive(Clone, Debug)]
struct Found {
    q: Vec<f64>,
    position: f64,
    angle: f64,
    held: Vec<usize>,
}

/// Largest number of steps; a search that converges needs a handful.
const MOST_STEPS: usize = 60;
/// Number of starts of the search for a Cartesian goal, whose branch is not known.
const STARTS: usize = 60;
/// Below this share of the tolerance a search stops.
const FINE: f64 = 1e-4;
/// How much further than a limit a configuration may be by rounding (rad, m).
const ROUNDING: f64 = 1e-9;
/// Range of a joint without limits, to both sides (rad, m).
const UNLIMITED: (f64, f64) = (PI, 1.0);

impl<'a> Compensator<'a> {
    /// Prepares two arms with the same joints. `limits` are pendant values ((rad) or (m)), one entry per joint.
    pub fn new(
        nominal: &'a ToolArm,
        identified: &'a ToolArm,
        limits: &[Option<(f64, f64)>],
        settings: Settings,
    ) -> Self {
        let side =
            |arm: &'a ToolArm| Side { arm: ForwardKinematics::new(&arm.chain), flange_from_tool: arm.flange_from_tool };
        let dof = nominal.chain.dof();
        Self {
            nominal: side(nominal),
            identified: side(identified),
            quantities: nominal.chain.joints().iter().map(|joint| joint.joint_type.quantity()).collect(),
            limits: (0..dof).map(|index| limits.get(index).copied().flatten()).collect(),
            settings,
        }
    }

    /// The command for a goal.
    pub fn solve(&self, goal: &Goal) -> Compensated {
        match goal {
            Goal::Configuration(meant) => {
                let beyond = self.beyond(meant);
                if !beyond.is_empty() || meant.len() != self.limits.len() {
                    return Self::unreached(meant, Status::BeyondLimit(beyond));
                }
                self.correct(meant, &self.nominal.base_from_tool(meant), !self.settings.position_only)
            }
            Goal::Pose { base_from_tool, near } => {
                self.reach(base_from_tool, !self.settings.position_only, near.as_deref())
            }
            Goal::Position { point_in_base, near } => {
                let pose = Isometry3::from_parts(Translation3::from(point_in_base.coords), UnitQuaternion::identity());
                self.reach(&pose, false, near.as_deref())
            }
        }
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
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut best: Option<Found> = None;
        for start in 0..STARTS {
            let q: Vec<f64> = if start == 0 {
                first.to_vec()
            } else {
                self.ranges().map(|(low, high)| if low < high { random.random_range(low..high) } else { low }).collect()
            };
            let mut found = self.search(&self.nominal, &self.clamped(&q), goal, with_angle);
            self.unwind(&mut found.q, first);
            let is_reached = self.is_reached(&found, with_angle);
            let is_better = best.as_ref().is_none_or(|best| {
                let before = (self.is_reached(best, with_angle), distance(&best.q, first));
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
        if self.is_reached(&best, with_angle) {
            return self.correct(&best.q, goal, with_angle);
        }
        // A goal that the nominal arm just misses may still be reached by the real one.
        let corrected = self.correct(&best.q, goal, with_angle);
        if corrected.status == Status::Reached {
            return Compensated { meant: None, ..corrected };
        }
        let status = if best.held.is_empty() { Status::OutOfReach } else { Status::AtLimit(best.held.clone()) };
        Compensated { meant: None, status, ..corrected }
    }

    /// Full turns that bring a configuration nearer to another one, within the limits.
    fn unwind(&self, q: &mut [f64], near: &[f64]) {
        for (index, ((value, near), quantity)) in q.iter_mut().zip(near).zip(&self.quantities).enumerate() {
            if *quantity == Quantity::Angle && self.is_uncoupled(index) {
                let turned = *value - 2.0 * PI * ((*value - near) / (2.0 * PI)).round();
                if self.limits.get(index).copied().flatten().is_none_or(|(low, high)| (low..=high).contains(&turned)) {
                    *value = turned;
                }
            }
        }
    }

    /// Whether a full turn of this joint's pendant value turns no other joint.
    fn is_uncoupled(&self, index: usize) -> bool {
        let joints = self.nominal.arm.chain().joints();
        joints.iter().all(|joint| joint.coupling.get(index).is_none_or(|coefficient| *coefficient == 0.0))
    }

    /// Moves the identified arm to the goal, from the intended configuration.
    fn correct(&self, meant: &[f64], goal: &Isometry3<f64>, with_angle: bool) -> Compensated {
        let result = |found: Found, status: Status| Compensated {
            meant: Some(meant.to_vec()),
            command: found.q,
            position_error: found.position,
            angle_error: found.angle,
            status,
        };
        let full = self.search(&self.identified, meant, goal, with_angle);
        let is_small = self.is_small(&full.q, meant);
        if self.is_reached(&full, with_angle) && is_small {
            return result(full, Status::Reached);
        }
        if with_angle {
            let mut position = self.search(&self.identified, meant, goal, false);
            if self.is_reached(&position, false) && self.is_small(&position.q, meant) {
                position.angle = self.identified.base_from_tool(&position.q).rotation.angle_to(&goal.rotation);
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

    fn is_reached(&self, found: &Found, with_angle: bool) -> bool {
        found.position <= self.settings.position_tolerance
            && (!with_angle || found.angle <= self.settings.angle_tolerance)
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

    /// Damped least squares with held joints.
    fn search(&self, side: &Side<'_>, start: &[f64], goal: &Isometry3<f64>, with_angle: bool) -> Found {
        let rows = if with_angle { 6 } else { 3 };
        let error_at = |q: &[f64]| {
            let pose = side.base_from_tool(q);
            let position = goal.translation.vector - pose.translation.vector;
            let turn = if with_angle {
                (goal.rotation * pose.rotation.inverse()).scaled_axis()
            } else {
                nalgebra::Vector3::zeros()
            };
            Vector6::new(position.x, position.y, position.z, turn.x, turn.y, turn.z)
        };
        let point = Point3::from(side.flange_from_tool.translation.vector);
        let mut q = start.to_vec();
        let mut error = error_at(&q);
        let mut held: Vec<usize> = Vec::new();
        let mut damping = 1e-9;
        for _ in 0..MOST_STEPS {
            let fine = FINE * self.settings.position_tolerance.min(self.settings.angle_tolerance);
            if error.norm() < fine {
                break;
            }
            let jacobian = side.arm.configuration_jacobian(&q, &point).matrix;
            let step = Self::step(&jacobian, &error, rows, &held, damping);
            let mut trial = q.clone();
            let mut newly_held = Vec::new();
            for (index, (value, step)) in trial.iter_mut().zip(step.iter()).enumerate() {
                *value += step;
                if let Some((low, high)) = self.limits.get(index).copied().flatten()
                    && !(low..=high).contains(value)
                {
                    *value = value.clamp(low, high);
                    newly_held.push(index);
                }
            }
            let trial_error = error_at(&trial);
            if trial_error.norm() < error.norm() {
                let gain = 1.0 - trial_error.norm() / error.norm();
                q = trial;
                error = trial_error;
                damping = (damping * 0.1).max(1e-12);
                if gain < 1e-9 {
                    break;
                }
            } else if !newly_held.iter().all(|index| held.contains(index)) {
                held.extend(newly_held);
            } else {
                damping *= 30.0;
                if damping > 1e3 {
                    break;
                }
            }
        }
        let at_limit = (0..q.len()).filter(|&index| self.is_at_limit(index, &q));
        let held = at_limit.collect();
        let position = error.fixed_rows::<3>(0).norm();
        Found { position, angle: error.fixed_rows::<3>(3).norm(), held, q }
    }

    fn is_at_limit(&self, index: usize, q: &[f64]) -> bool {
        let limits = self.limits.get(index).copied().flatten();
        let near = |value: f64, limit: f64| (value - limit).abs() < ROUNDING;
        q.get(index).zip(limits).is_some_and(|(value, (low, high))| near(*value, low) || near(*value, high))
    }

    /// `(JᵀJ + λ I)⁻¹ Jᵀ e` over the joints that are free.
    fn step(
        jacobian: &Matrix6xX<f64>,
        error: &Vector6<f64>,
        rows: usize,
        held: &[usize],
        damping: f64,
    ) -> DVector<f64> {
        let n = jacobian.ncols();
        let jacobian = jacobian.rows(0, rows);
        let error = error.rows(0, rows);
        let mut normal: DMatrix<f64> = jacobian.tr_mul(&jacobian);
        let mut right: DVector<f64> = jacobian.tr_mul(&error);
        for &index in held {
            normal.row_mut(index).fill(0.0);
            normal.column_mut(index).fill(0.0);
            right[index] = 0.0;
        }
        for index in 0..n {
            normal[(index, index)] += damping;
        }
        normal.cholesky().map_or_else(|| DVector::zeros(n), |cholesky| cholesky.solve(&right))
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

    /// Joints whose value is beyond its limits or not a number.
    fn beyond(&self, q: &[f64]) -> Vec<usize> {
        let inside = |value: f64, limits: Option<(f64, f64)>| {
            value.is_finite() && limits.is_none_or(|(low, high)| (low - ROUNDING..=high + ROUNDING).contains(&value))
        };
        let pairs = q.iter().zip(&self.limits).enumerate();
        pairs.filter(|(_, (value, limits))| !inside(**value, **limits)).map(|(index, _)| index).collect()
    }
}

/// Largest difference of two configurations.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
