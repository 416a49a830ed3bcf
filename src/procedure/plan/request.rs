//! The request for a plan, and its progress.

use crate::planning::collision::DEFAULT_CLEARANCE;
use crate::planning::order::Pace;
use crate::planning::{self, BoxInBase, Objective, SearchSettings};
use crate::profile::{ExpectedDeviation, Level};
use crate::session::plan::PlannedPose;

/// Number of candidates of a plan.
const CANDIDATES: usize = 10_000;

/// Number of candidates where somebody waits for the plan: half as many save a third of the time, and the
/// plan predicts less than one per cent worse.
pub const INTERACTIVE_CANDIDATES: usize = 5_000;

/// How to plan. The defaults are those of every command and of the wizard.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanRequest {
    /// Time of the request (RFC 3339, UTC); empty by default.
    pub created: String,
    /// Number of new poses to identify from; those of `included` come on top.
    pub poses: usize,
    /// Number of poses to verify with.
    pub verification: usize,
    /// Number of candidates to choose from.
    pub candidates: usize,
    /// The figure of merit.
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
    /// The parameters to identify.
    pub level: Level,
    /// Standard deviation of a measured coordinate (m); `None`: that of the profile's instrument, if it has one.
    pub sigma: Option<f64>,
    /// The first pose is measured again after this many poses; 0: never.
    pub drift_every: usize,
    /// How fast the program will be; the highest speeds of the joints are those of the profile.
    pub pace: Pace,
    /// Threads to search with; `None`: one per core. The plan does not depend on it.
    pub threads: Option<usize>,
}

impl Default for PlanRequest {
    fn default() -> Self {
        let SearchSettings { poses, objective, seed, .. } = SearchSettings::default();
        Self {
            created: String::new(),
            poses,
            verification: 20,
            candidates: CANDIDATES,
            objective,
            seed,
            limits: None,
            region: None,
            included: Vec::new(),
            numbered_after: 0,
            filters: true,
            clearance: DEFAULT_CLEARANCE,
            expected_deviation: None,
            level: Level::default(),
            sigma: None,
            drift_every: 20,
            pace: Pace::default(),
            threads: None,
        }
    }
}

/// Progress of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// The candidates are known and a search begins.
    Searching,
    /// A sweep of the search is done.
    Sweep {
        /// Its result.
        found: planning::Progress,
        /// Sweeps of this stage that all starts together have done.
        done: usize,
        /// Sweeps that this stage takes of all starts together.
        sweeps: usize,
        /// Number of starts.
        starts: usize,
    },
    /// Some poses cannot be reached without a collision: another search replaces them.
    Unreachable {
        /// Number of these poses.
        poses: usize,
    },
}
