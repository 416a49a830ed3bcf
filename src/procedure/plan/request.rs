//! What a plan is asked for with, and what is told while it is made.

use crate::planning::order::Pace;
use crate::planning::{self, BoxInBase, Objective};
use crate::profile::{ExpectedDeviation, Level};
use crate::session::plan::PlannedPose;
use crate::units::MILLIMETRE;

/// How to plan. The default is what `trupose plan` does without options.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanRequest {
    /// When this is asked for (RFC 3339, UTC); empty by default.
    pub created: String,
    /// Number of new poses to identify from; those of `included` come on top.
    pub poses: usize,
    /// Number of poses to verify with.
    pub verification: usize,
    /// Number of candidates to choose from.
    pub candidates: usize,
    /// What to choose for.
    pub objective: Objective,
    /// Seed of every random decision: the same seed gives the same plan.
    pub seed: u64,
    /// Range of every joint (rad, sliding joints m) instead of the planning limits of the profile, see [`super::limits`].
    pub limits: Option<Vec<(f64, f64)>>,
    /// The reflector stays inside this box in the robot base (m).
    pub region: Option<BoxInBase>,
    /// Poses that are already measured for the identification (rad, sliding joints m).
    pub included: Vec<PlannedPose>,
    /// New poses are numbered from the number after this one, or after the highest of `included`.
    pub numbered_after: u64,
    /// Whether collisions and sight are checked, not only joint limits.
    pub filters: bool,
    /// Clearance to keep from everything (m).
    pub clearance: f64,
    /// Expected deviation of every length (m) and angle (rad) of the links instead of the profile's.
    pub expected_deviation: Option<ExpectedDeviation>,
    /// What will be identified.
    pub level: Level,
    /// Standard deviation of a measured coordinate (m); `None`: that of the profile's instrument, if it has one.
    pub sigma: Option<f64>,
    /// The first pose is measured again after so many poses; 0: never.
    pub drift_every: usize,
    /// How fast the program will be; the highest speeds of the joints are those of the profile.
    pub pace: Pace,
    /// Threads to search with; `None`: one per core. The plan does not depend on it.
    pub threads: Option<usize>,
}

impl Default for PlanRequest {
    fn default() -> Self {
        Self {
            created: String::new(),
            poses: 56,
            verification: 20,
            candidates: 10_000,
            objective: Objective::default(),
            seed: 1,
            limits: None,
            region: None,
            included: Vec::new(),
            numbered_after: 0,
            filters: true,
            clearance: 10.0 * MILLIMETRE,
            expected_deviation: None,
            level: Level::default(),
            sigma: None,
            drift_every: 20,
            pace: Pace::default(),
            threads: None,
        }
    }
}

/// What happens while a plan is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// The candidates are known and a search begins.
    Searching,
    /// A sweep of the search is done.
    Sweep {
        /// What it found.
        found: planning::Progress,
        /// Sweeps of this stage that all starts together have done.
        done: usize,
        /// Sweeps that this stage takes of all starts together.
        sweeps: usize,
        /// Number of starts.
        starts: usize,
    },
    /// So many poses cannot be reached without a collision: others are chosen in another search.
    Unreachable {
        /// How many.
        poses: usize,
    },
}
