//! Which poses to measure, in which order, and how good a list of poses is.

mod history;
mod request;
mod summary;

use std::sync::atomic::{AtomicUsize, Ordering};

use history::History;

use super::cell::cell;
use super::checks::first_of;
use super::{ProcedureError, joint_types};
use crate::kinematics::{Arm, FreeParameter, JointType, Place};
use crate::planning::candidates::{Candidate, CandidateFilter, Candidates};
use crate::planning::order::{OrderError, Pace, Route, StepKind, Stops, home_pose, order};
use crate::planning::{
    Chosen, Information, JointBox, Objective, Score, Search, SearchSettings, Spreading, Stage, low_discrepancy, random,
    verification_set,
};
use crate::profile::Profile;
use crate::search::{available_threads, plan_in_parallel};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::{PlanSummary, PoseSummary, TimeSummary};
use crate::session::summary::{Warning, WarningCode};
use crate::units::{from_mm, to_mm};

pub use super::cell::planning_limits as limits;
pub use request::{INTERACTIVE_CANDIDATES, PlanRequest, Progress};

/// Configurations tried per requested candidate: with an acceptance of ±30° about one in twenty faces the tracker.
const TRIES_PER_CANDIDATE: usize = 200;
/// Number of fresh poses over which a prediction is averaged.
const FRESH_POSES: usize = 1000;
/// Number of random sets of equal size to compare with.
const RANDOM_SETS: usize = 500;
/// Sizes of the trade-off table.
const SIZES: [usize; 9] = [20, 30, 40, 50, 60, 70, 80, 90, 100];
/// Most rounds of leaving out unreachable poses and choosing again.
const ROUNDS: usize = 8;
/// Most findings of one kind that a warning lists.
const SHOWN: usize = 5;
/// Candidates offered as intermediate stops for blocked moves.
const VIAS: usize = 30;

/// Chooses poses, orders and scores them. With [`PlanRequest::included`] these are the next best poses after those.
///
/// Any thread may call `keep_going` and `progress` during the search. Once `keep_going` returns false, the plan is made of the best
/// set so far and marked as interrupted. The caller fills in the elapsed time.
///
/// # Errors
/// The profile lacks something that planning needs, or no such plan exists.
pub fn plan(
    profile: &Profile,
    profile_text: &str,
    request: &PlanRequest,
    keep_going: &(dyn Fn() -> bool + Sync),
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<PlanSummary, ProcedureError> {
    Planner::new(profile, profile_text, request)?.choose(keep_going, progress)
}

/// Scores the poses of a list, which messages call `name`. The number of poses and the objective of the request are not used.
///
/// # Errors
/// As [`plan`]; or the list has no identification poses.
pub fn check(
    profile: &Profile,
    profile_text: &str,
    request: &PlanRequest,
    listed: &[PlannedPose],
    name: &str,
) -> Result<PlanSummary, ProcedureError> {
    Planner::new(profile, profile_text, request)?.check(listed, name)
}

/// Checks whether the profile states what planning needs, and whether limits, region and clearance of the request make sense.
/// [`plan`] and [`check`] do this first.
///
/// # Errors
/// Something is missing or makes no sense.
pub fn check_request(profile: &Profile, request: &PlanRequest) -> Result<(), ProcedureError> {
    Planner::new(profile, "", request).map(drop)
}

/// The rows of a plan file, from the summary.
pub fn rows(summary: &PlanSummary, joint_types: &[JointType]) -> Vec<PlannedPose> {
    summary
        .poses
        .iter()
        .map(|row| PlannedPose {
            pose: row.pose.clone(),
            kind: row.kind,
            configuration: joint_types
                .iter()
                .zip(&row.configuration)
                .map(|(joint_type, value)| joint_type.quantity().from_edge(*value))
                .collect(),
            point_in_base: row
                .point_in_base_mm
                .map(|[x, y, z]| nalgebra::Point3::new(from_mm(x), from_mm(y), from_mm(z))),
        })
        .collect()
}

/// The common data of choosing and checking a plan.
struct Planner<'a> {
    profile: &'a Profile,
    profile_text: &'a str,
    request: &'a PlanRequest,
    arm: Arm,
    parameters: Vec<FreeParameter>,
    joint_types: Vec<JointType>,
    limits: Vec<(f64, f64)>,
    filter: CandidateFilter<'a>,
}

/// A chosen set with its order.
struct Ordered {
    chosen: Chosen,
    /// The poses to measure with their kinds, in the order of `Stops::poses`.
    stops: Vec<(PoseKind, Candidate)>,
    route: Route,
}

impl<'a> Planner<'a> {
    fn new(profile: &'a Profile, profile_text: &'a str, request: &'a PlanRequest) -> Result<Self, ProcedureError> {
        let limits = request.limits.clone().map_or_else(|| limits(profile), Ok)?;
        let cell = cell(profile, limits.clone(), request.region, request.filters)?;
        let filter = CandidateFilter::new(profile.chain(), &cell, request.clearance)?;
        // The poses are for the first target, which says nothing about the coordinates of others.
        let is_seen = |parameter: &FreeParameter| parameter.id.target().is_none_or(|target| target == 0);
        let mut parameters = profile.parameters(request.level);
        parameters.retain(is_seen);
        if let Some(expected) = request.expected_deviation {
            expected.replace_in(&mut parameters);
        }
        Ok(Self {
            profile,
            profile_text,
            request,
            arm: profile.arm(),
            parameters,
            joint_types: joint_types(profile),
            limits,
            filter,
        })
    }

    /// Standard deviation of a coordinate (m) for predictions.
    fn sigma(&self) -> Option<f64> {
        let distance = self.profile.tracker().position_in_base.coords.norm();
        let instrument = || self.profile.instrument().map(|instrument| instrument.sigma_at(distance));
        self.request.sigma.or_else(instrument)
    }

    fn threads(&self) -> usize {
        self.request.threads.unwrap_or_else(available_threads)
    }

    /// The pace of the program, with the joint speeds of the profile.
    fn pace(&self) -> Pace {
        let max_speeds = self.profile.joints().iter().map(|joint| joint.max_speed).collect();
        Pace { max_speeds, ..self.request.pace.clone() }
    }

    fn joint_box(&self) -> Result<JointBox, ProcedureError> {
        Ok(JointBox::new(self.limits.clone())?)
    }

    fn information(&self, pool: &[Candidate]) -> Result<Information, ProcedureError> {
        let candidates: Vec<Place> = pool.iter().map(Candidate::place).collect();
        let information = Information::new(&self.arm, &self.parameters, &candidates, &self.fresh()?)?;
        Ok(information.filling(&self.joint_box()?, &self.arm, &candidates))
    }

    /// The configurations at which predictions are averaged.
    fn fresh(&self) -> Result<Vec<Place>, ProcedureError> {
        let joint_box = self.joint_box()?;
        let configurations = random(&joint_box, !self.request.seed).take(FRESH_POSES);
        Ok(configurations.map(|configuration| Place { configuration, target: 0 }).collect())
    }

    /// Spreads the chosen poses of a balanced set over the ranges of the joints, in the pool and in its information.
    fn spread(
        &self,
        information: Information,
        pool: &mut [Candidate],
        required: usize,
        chosen: &Chosen,
    ) -> Result<Information, ProcedureError> {
        if self.request.objective != Objective::Balanced {
            return Ok(information);
        }
        let places = chosen.set.iter().filter_map(|index| pool.get(*index)).map(Candidate::place).collect();
        let spreading = Spreading::new(&information, &self.arm, &self.joint_box()?, &chosen.set, places, required)?;
        let placed =
            |wanted: &[f64]| self.filter.collect([wanted.to_vec()], 1).kept.pop().map(|kept| kept.configuration);
        let (information, places) = spreading.run(self.request.seed, &placed);
        for (&index, place) in chosen.set.iter().zip(&places) {
            pool[index] = self.candidate(&place.configuration);
        }
        Ok(information)
    }

    /// Candidates for the plan; required poses come first.
    fn candidates(&self, needed: usize, included: &[PlannedPose]) -> Result<Candidates, ProcedureError> {
        let count = self.request.candidates;
        let joint_box = self.joint_box()?;
        let stream = low_discrepancy(&joint_box, self.request.seed).take(count.saturating_mul(TRIES_PER_CANDIDATE));
        let mut candidates = self.filter.collect_at_least(stream, count, needed)?;
        let mut kept: Vec<Candidate> = included.iter().map(|row| self.candidate(&row.configuration)).collect();
        kept.append(&mut candidates.kept);
        candidates.kept = kept;
        Ok(candidates)
    }

    /// A warning about poses that are already measured, but outside the joint limits.
    fn included_warning(&self) -> Option<Warning> {
        let included = self.request.included.iter();
        let outside: Vec<String> =
            included.filter(|row| self.is_outside(&row.configuration)).map(|row| row.pose.clone()).collect();
        let text = || format!("measured poses outside the joint limits of the profile: {}", first_of(&outside, SHOWN));
        (!outside.is_empty()).then(|| Warning::new(WarningCode::JointLimits, text(), false))
    }

    /// Whether a configuration is outside the mechanical limits of the arm.
    fn is_outside(&self, configuration: &[f64]) -> bool {
        let ranges = self.profile.joints().iter().zip(configuration);
        ranges
            .filter_map(|(range, value)| Some((range.limits?, value)))
            .any(|((low, high), value)| !(low - 1e-9..=high + 1e-9).contains(value))
    }

    /// Warnings that a plan must not be run without further checks.
    fn safety_warnings(&self) -> Vec<Warning> {
        if !self.request.filters {
            let text = "collision and line-of-sight checks were skipped: the plan is for comparison only, do not run it on a robot";
            return vec![Warning::new(WarningCode::NotChecked, text, false)];
        }
        if self.profile.bodies().is_empty() {
            let text = "the profile has no bodies, so the arm was not checked against itself, and only its joints and the SMR against floor and boxes: add 'bodies', or check every move by hand";
            return vec![Warning::new(WarningCode::NotChecked, text, false)];
        }
        Vec::new()
    }

    fn candidate(&self, configuration: &[f64]) -> Candidate {
        let at = Place { configuration: configuration.to_vec(), target: 0 };
        Candidate { point_in_base: self.arm.point_in_base(&at), configuration: at.configuration }
    }

    /// Chooses, orders and scores a new plan.
    fn choose(
        &self,
        keep_going: &(dyn Fn() -> bool + Sync),
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<PlanSummary, ProcedureError> {
        let request = self.request;
        let required = request.included.len();
        let mut candidates = self.candidates(request.poses + request.verification, &request.included)?;
        let mut round = 0;
        let history = History::default();
        let told = |step: Progress| {
            history.take(&step);
            progress(step);
        };
        let (information, ordered) = loop {
            round += 1;
            let information = self.information(&candidates.kept)?;
            let chosen = self.search(&information, required, keep_going, &told)?;
            let information = self.spread(information, &mut candidates.kept, required, &chosen)?;
            match self.order(&candidates.kept, required, chosen)? {
                Ok(ordered) => break (information, ordered),
                Err(unreachable) if round < ROUNDS => {
                    told(Progress::Unreachable { poses: unreachable.len() });
                    let mut index = 0;
                    candidates.kept.retain(|_| {
                        index += 1;
                        !unreachable.contains(&(index - 1))
                    });
                }
                Err(_) => return Err(ProcedureError::Unreachable),
            }
        };
        let set = &ordered.chosen.set;
        let mut summary = self.summary(&information, &candidates.kept, set, required, &candidates.rejections)?;
        let mut warnings: Vec<Warning> = self.included_warning().into_iter().collect();
        warnings.extend(self.safety_warnings());
        warnings.append(&mut summary.warnings);
        summary.warnings = warnings;
        summary.predicted_verification_rms_mm = self.predicted_verification(&candidates.kept, set, &ordered)?;
        summary.objective = Some(request.objective);
        summary.interrupted = ordered.chosen.interrupted;
        summary.search = history.steps();
        let minutes = |seconds: f64| seconds / 60.0;
        let Route { moving_time, measuring_time, .. } = ordered.route;
        let total = ordered.route.time();
        summary.time = Some(TimeSummary {
            total_min: minutes(total),
            moving_min: minutes(moving_time),
            measuring_min: minutes(measuring_time),
        });
        let stops = ordered.stops.len().max(1);
        let extra = ordered.stops.len().saturating_sub(set.len() - required);
        for size in &mut summary.trade_off {
            size.time_min = Some(minutes(total) * (size.poses + extra) as f64 / stops as f64);
        }
        summary.verification_poses = extra;
        summary.poses = self.route_rows(&ordered, &request.included);
        Ok(summary)
    }

    fn search(
        &self,
        information: &Information,
        required: usize,
        keep_going: &(dyn Fn() -> bool + Sync),
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Chosen, ProcedureError> {
        let settings = SearchSettings {
            poses: self.request.poses + required,
            required: (0..required).collect(),
            objective: self.request.objective,
            seed: self.request.seed,
            ..SearchSettings::default()
        };
        let starts = settings.starts;
        let search = Search::new(information, settings)?;
        // Starts run in parallel, so the sweeps of all of them are counted together.
        let (predicted, optimised) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let told = |found: &crate::planning::Progress| {
            let count = if found.stage == Stage::Prediction { &predicted } else { &optimised };
            let done = count.fetch_add(1, Ordering::Relaxed) + 1;
            let sweeps = starts * search.settings().sweeps_of(found.stage);
            progress(Progress::Sweep { found: *found, done, sweeps, starts });
        };
        progress(Progress::Searching);
        Ok(plan_in_parallel(&search, self.threads(), keep_going, &told)?)
    }

    /// Orders the chosen poses that are not measured yet and the verification poses; the inner error names candidates
    /// that cannot be reached.
    fn order(
        &self,
        pool: &[Candidate],
        required: usize,
        chosen: Chosen,
    ) -> Result<Result<Ordered, Vec<usize>>, ProcedureError> {
        let verification = verification_set::choose(pool, &chosen.set, &self.limits, self.request.verification);
        let new = chosen.set.iter().copied().filter(|index| *index >= required);
        let stops: Vec<(PoseKind, usize)> = new
            .map(|index| (PoseKind::Identification, index))
            .chain(verification.iter().map(|&index| (PoseKind::Verification, index)))
            .collect();
        let poses: Vec<Vec<f64>> = stops.iter().map(|(_, index)| pool[*index].configuration.clone()).collect();
        let shape = self.filter.shape();
        let Some(home) = home_pose(shape, pool.iter().map(|candidate| candidate.configuration.as_slice())) else {
            return Err(ProcedureError::NoHome);
        };
        let spread = (pool.len() / VIAS).max(1);
        let vias: Vec<Vec<f64>> =
            pool.iter().step_by(spread).map(|candidate| candidate.configuration.clone()).collect();
        let request = Stops { home: &home, poses: &poses, vias: &vias, drift_every: Some(self.request.drift_every) };
        match order(shape, &request, &self.pace()) {
            Ok(route) => {
                let stops = stops.iter().map(|(kind, index)| (*kind, pool[*index].clone())).collect();
                Ok(Ok(Ordered { chosen, stops, route }))
            }
            Err(OrderError::Unreachable { poses }) => Ok(Err(poses.iter().map(|order| stops[*order].1).collect())),
            Err(error) => Err(error.into()),
        }
    }

    /// The rows of a plan. Measured poses are numbered as they are visited, after those that are measured already; a drift pose
    /// has the number of the pose that it repeats.
    fn route_rows(&self, ordered: &Ordered, included: &[PlannedPose]) -> Vec<PoseSummary> {
        let highest = included.iter().filter_map(|row| row.pose.parse::<u64>().ok()).max().unwrap_or(0);
        let mut last = highest.max(self.request.numbered_after);
        let mut numbers = vec![String::new(); ordered.stops.len()];
        let mut vias = 0;
        let mut rows = Vec::with_capacity(ordered.route.steps.len());
        for step in &ordered.route.steps {
            let stop = step.pose.and_then(|pose| Some((pose, ordered.stops.get(pose)?)));
            let (kind, pose) = match (step.kind, stop) {
                (StepKind::Measure, Some((index, (kind, _)))) => {
                    last += 1;
                    numbers[index] = last.to_string();
                    (*kind, numbers[index].clone())
                }
                (StepKind::Drift, Some((index, _))) => (PoseKind::Drift, numbers[index].clone()),
                (StepKind::Home, _) => (PoseKind::Home, "home".to_owned()),
                _ => {
                    vias += 1;
                    (PoseKind::Via, format!("via{vias}"))
                }
            };
            rows.push(self.row(kind, pose, &step.configuration, Vec::new()));
        }
        rows
    }

    /// Root mean square (mm) that the verification poses of the plan will show, tracker noise included.
    fn predicted_verification(
        &self,
        pool: &[Candidate],
        set: &[usize],
        ordered: &Ordered,
    ) -> Result<Option<f64>, ProcedureError> {
        const FEWEST: usize = 3;
        let verification: Vec<Place> = ordered
            .stops
            .iter()
            .filter(|(kind, _)| *kind == PoseKind::Verification)
            .map(|(_, candidate)| candidate.place())
            .collect();
        let Some(sigma) = self.sigma().filter(|_| verification.len() >= FEWEST) else { return Ok(None) };
        let chosen: Vec<Place> = set.iter().filter_map(|index| pool.get(*index)).map(Candidate::place).collect();
        let information = Information::new(&self.arm, &self.parameters, &chosen, &verification)?;
        let all: Vec<usize> = (0..chosen.len()).collect();
        let score = Score::new(&information, &all)?;
        // Each of the three coordinates of a reading adds its own scatter σ to the error of the robot.
        Ok(Some(to_mm(sigma * (score.predicted_error.powi(2) + 3.0).sqrt())))
    }

    fn row(&self, kind: PoseKind, pose: String, configuration: &[f64], problems: Vec<String>) -> PoseSummary {
        let edge = |(joint_type, value): (&JointType, &f64)| joint_type.quantity().to_edge(*value);
        let point = self.candidate(configuration).point_in_base;
        PoseSummary {
            pose,
            kind,
            configuration: self.joint_types.iter().zip(configuration).map(edge).collect(),
            point_in_base_mm: Some([to_mm(point.x), to_mm(point.y), to_mm(point.z)]),
            problems,
        }
    }

    /// Scores the poses of the list `name`.
    fn check(&self, rows: &[PlannedPose], name: &str) -> Result<PlanSummary, ProcedureError> {
        let scored: Vec<&PlannedPose> = rows.iter().filter(|row| row.kind == PoseKind::Identification).collect();
        let count = scored.len();
        if count == 0 {
            return Err(ProcedureError::NothingToScore { rows: rows.len(), name: name.to_owned() });
        }
        let mut candidates = self.candidates(count, &[])?;
        let mut pool: Vec<Candidate> = scored.iter().map(|row| self.candidate(&row.configuration)).collect();
        pool.append(&mut candidates.kept);
        let information = self.information(&pool)?;
        let set: Vec<usize> = (0..count).collect();
        let mut summary = self.summary(&information, &pool, &set, 0, &candidates.rejections)?;
        let mut warnings = self.safety_warnings();
        summary.poses = rows
            .iter()
            .map(|row| {
                let problems = match row.kind {
                    PoseKind::Home | PoseKind::Via => {
                        let outside =
                            self.is_outside(&row.configuration).then(|| "outside the joint limits".to_owned());
                        let shape = self.filter.shape();
                        let obstructions = shape.obstructions(&row.configuration);
                        outside.into_iter().chain(obstructions.iter().map(ToString::to_string)).collect()
                    }
                    _ => self.filter.reasons(&row.configuration),
                };
                self.row(row.kind, row.pose.clone(), &row.configuration, problems)
            })
            .collect();
        let bad: Vec<String> = summary
            .poses
            .iter()
            .filter(|pose| !pose.problems.is_empty())
            .map(|pose| format!("pose {}: {}", pose.pose, pose.problems.join(", ")))
            .collect();
        if !bad.is_empty() {
            warnings.push(Warning::new(WarningCode::NotMeasurable, first_of(&bad, SHOWN), true));
        }
        let blocked: Vec<String> = rows
            .windows(2)
            .filter_map(|pair| {
                let obstruction =
                    self.filter.shape().check_move(&pair[0].configuration, &pair[1].configuration).err()?;
                Some(format!("from {} to {}: {obstruction}", pair[0].pose, pair[1].pose))
            })
            .collect();
        if !blocked.is_empty() {
            let text = format!(
                "moves that are not free (joint moves in the order of the file): {}",
                first_of(&blocked, SHOWN)
            );
            warnings.push(Warning::new(WarningCode::BlockedMove, text, true));
        }
        summary.verification_poses = rows.iter().filter(|row| row.kind == PoseKind::Verification).count();
        warnings.append(&mut summary.warnings);
        summary.warnings = warnings;
        Ok(summary)
    }
}
