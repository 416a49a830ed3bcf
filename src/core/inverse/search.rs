//! Damped least squares on position and orientation, an angle counted as the arc it makes at 1 m (Levenberg 1944, Marquardt 1963;
//! Wampler 1986 for arms).

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6xX, Point3, Vector3, Vector6};

use super::{Held, ROUNDING};
use crate::kinematics::ForwardKinematics;

/// Largest number of steps; a search that converges needs a handful.
const MOST_STEPS: usize = 60;

/// What the end of the arm is to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// A pose of the flange in the base.
    Pose(Isometry3<f64>),
    /// A pose in the base of a tool that the flange carries.
    Tool {
        /// Where the tool is to be.
        base_from_tool: Isometry3<f64>,
        /// The tool in the flange.
        flange_from_tool: Isometry3<f64>,
    },
    /// A point in the base for a point of the flange, with any orientation.
    Point {
        /// Where the point is to be.
        in_base: Point3<f64>,
        /// The point in the flange.
        in_flange: Point3<f64>,
    },
}

/// The result of a search.
#[derive(Clone, Debug)]
pub struct Found {
    /// The configuration.
    pub q: Vec<f64>,
    /// Distance from the goal (m).
    pub position: f64,
    /// Angle from the goal (rad); zero if the orientation is free.
    pub angle: f64,
    /// Joints that are at a limit.
    pub held: Vec<usize>,
}

impl Found {
    /// Whether position (m) and orientation (rad) are within a tolerance.
    pub fn reaches(&self, tolerance: f64) -> bool {
        self.position <= tolerance && self.angle <= tolerance
    }
}

/// Moves an arm to a goal.
#[derive(Clone, Copy, Debug)]
pub struct Search<'s, 'a> {
    /// The arm.
    pub arm: &'s ForwardKinematics<'a>,
    /// Limits that are kept; joints without an entry are free.
    pub limits: &'s [Option<(f64, f64)>],
    /// A joint that stays where it is.
    pub held: Option<Held>,
    /// Error (m, rad) at which the search ends.
    pub fine: f64,
}

impl Goal {
    fn point_in_flange(&self) -> Point3<f64> {
        match self {
            Self::Pose(_) => Point3::origin(),
            Self::Tool { flange_from_tool, .. } => Point3::from(flange_from_tool.translation.vector),
            Self::Point { in_flange, .. } => *in_flange,
        }
    }

    fn rows(&self) -> usize {
        match self {
            Self::Pose(_) | Self::Tool { .. } => 6,
            Self::Point { .. } => 3,
        }
    }

    /// What is missing from a pose of the flange.
    fn error(&self, base_from_flange: &Isometry3<f64>) -> Vector6<f64> {
        let to = |pose: Isometry3<f64>, goal: &Isometry3<f64>| {
            let position = goal.translation.vector - pose.translation.vector;
            (position, (goal.rotation * pose.rotation.inverse()).scaled_axis())
        };
        let (position, turn) = match self {
            Self::Pose(goal) => to(*base_from_flange, goal),
            Self::Tool { base_from_tool, flange_from_tool } => to(base_from_flange * flange_from_tool, base_from_tool),
            Self::Point { in_base, in_flange } => (in_base - base_from_flange * in_flange, Vector3::zeros()),
        };
        Vector6::new(position.x, position.y, position.z, turn.x, turn.y, turn.z)
    }
}

impl Search<'_, '_> {
    /// Searches from a configuration. A joint that would pass its limit is kept there, and the others continue without it.
    pub fn from(&self, start: &[f64], goal: &Goal) -> Found {
        let point = goal.point_in_flange();
        let mut q = start.to_vec();
        let mut error = goal.error(&self.arm.base_from_flange(&q));
        let mut kept: Vec<usize> = self.held.iter().map(|held| held.joint).collect();
        if let Some(held) = self.held {
            q[held.joint] = held.value;
            error = goal.error(&self.arm.base_from_flange(&q));
        }
        let mut damping = 1e-9;
        for _ in 0..MOST_STEPS {
            if error.norm() < self.fine {
                break;
            }
            let jacobian = self.arm.configuration_jacobian(&q, &point).matrix;
            let step = step(&jacobian, &error, goal.rows(), &kept, damping);
            let (trial, stopped) = self.moved(&q, &step);
            let trial_error = goal.error(&self.arm.base_from_flange(&trial));
            if trial_error.norm() < error.norm() {
                let gain = 1.0 - trial_error.norm() / error.norm();
                q = trial;
                error = trial_error;
                damping = (damping * 0.1).max(1e-12);
                if gain < 1e-9 {
                    break;
                }
            } else if !stopped.iter().all(|index| kept.contains(index)) {
                kept.extend(stopped);
            } else {
                damping *= 30.0;
                if damping > 1e3 {
                    break;
                }
            }
        }
        let held = (0..q.len()).filter(|&index| self.is_at_limit(index, q[index])).collect();
        Found { position: error.fixed_rows::<3>(0).norm(), angle: error.fixed_rows::<3>(3).norm(), held, q }
    }

    fn limits(&self, index: usize) -> Option<(f64, f64)> {
        self.limits.get(index).copied().flatten()
    }

    fn is_at_limit(&self, index: usize, value: f64) -> bool {
        let is_near = |limit: f64| (value - limit).abs() < ROUNDING;
        self.limits(index).is_some_and(|(low, high)| is_near(low) || is_near(high))
    }

    /// The configuration after a step within the limits, and the joints that a limit stopped.
    fn moved(&self, q: &[f64], step: &DVector<f64>) -> (Vec<f64>, Vec<usize>) {
        let mut stopped = Vec::new();
        let values = q.iter().zip(step.iter()).enumerate().map(|(index, (value, step))| {
            let value = value + step;
            match self.limits(index) {
                Some((low, high)) if !(low..=high).contains(&value) => {
                    stopped.push(index);
                    value.clamp(low, high)
                }
                Some(_) | None => value,
            }
        });
        (values.collect(), stopped)
    }
}

/// `(JᵀJ + λ I)⁻¹ Jᵀ e` over the joints that are free.
fn step(jacobian: &Matrix6xX<f64>, error: &Vector6<f64>, rows: usize, kept: &[usize], damping: f64) -> DVector<f64> {
    let n = jacobian.ncols();
    let jacobian = jacobian.rows(0, rows);
    let error = error.rows(0, rows);
    let mut normal: DMatrix<f64> = jacobian.tr_mul(&jacobian);
    let mut right: DVector<f64> = jacobian.tr_mul(&error);
    for &index in kept {
        normal.row_mut(index).fill(0.0);
        normal.column_mut(index).fill(0.0);
        right[index] = 0.0;
    }
    for index in 0..n {
        normal[(index, index)] += damping;
    }
    normal.cholesky().map_or_else(|| DVector::zeros(n), |cholesky| cholesky.solve(&right))
}
