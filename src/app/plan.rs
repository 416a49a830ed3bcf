//! `trupose plan`: which poses to measure, and how good a list of poses is.

mod summary;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use super::cell::{cell, limits, pace};
use super::estimate::{expected_by, warning};
use super::load::{self, LoadedProfile};
use super::progress::{Progress, Stopwatch};
use super::{Console, to_json};
use crate::cli::{LevelArg, ObjectiveArg, PlanArgs};
use crate::error::{ExitStatus, Failure};
use crate::identification::{ArmModel, TargetAt};
use crate::kinematics::{FreeParameter, JointType};
use crate::planning::candidates::{Candidate, CandidateFilter, Candidates};
use crate::planning::order::{OrderError, Route, StepKind, Stops, home_pose, order};
use crate::planning::{
    Chosen, Information, JointBox, Objective, PlanningError, Score, Search, SearchSettings, Stage, low_discrepancy,
    random, verification_set,
};
use crate::profile::{Level, Profile};
use crate::report;
use crate::runtime::search::plan_in_parallel;
use crate::session::plan::{self, PlannedPose, PoseKind};
use crate::session::plan_summary::{PlanSummary, PoseSummary, TimeSummary};
use crate::session::summary::{InputFile, Warning};
use crate::store;
use crate::units::{from_mm, to_mm};

/// Configurations tried per candidate asked for: with ±30° of acceptance about one in twenty faces the tracker.
const TRIES_PER_CANDIDATE: usize = 200;
/// Fresh poses over which a prediction is averaged.
const FRESH_POSES: usize = 1000;
/// Random sets of equal size to compare with.
const RANDOM_SETS: usize = 500;
/// Sizes of the trade-off table.
const SIZES: [usize; 9] = [20, 30, 40, 50, 60, 70, 80, 90, 100];
/// Rounds of leaving out poses that cannot be reached and choosing again.
const ROUNDS: usize = 8;
/// Candidates offered as intermediate stops where a direct move is blocked.
const VIAS: usize = 30;

pub(super) fn run<O: Write, E: Write>(args: &PlanArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let clock = Stopwatch::new();
    let loaded = load::profile(&args.profile)?;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    let planner = Planner::new(args, &loaded)?;
    let interrupted = interrupt_flag()?;
    let keep_going =
        || !interrupted.load(Ordering::Relaxed) && args.time_limit.is_none_or(|limit| clock.seconds() < limit);
    let mut summary = match &args.check {
        Some(file) => planner.check(file)?,
        None => planner.choose(console, &keep_going)?,
    };
    summary.elapsed_s = clock.seconds();
    if let Some(file) = &args.out {
        let rows = planned_rows(&summary, &planner.joint_types);
        let text = plan::write(&rows, &planner.joint_types);
        store::replace(file, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        summary.written.push(file.display().to_string());
    }
    let text = if args.json { to_json(&summary)? } else { report::plan_text(&summary) };
    console.print(&text)?;
    let is_blocked = summary.warnings.iter().any(|warning| warning.blocks_acceptance);
    Ok(if is_blocked { ExitStatus::NotAccepted } else { ExitStatus::Accepted })
}

/// Set by Ctrl-C: the search ends with the best set so far. A second Ctrl-C changes nothing, since wrappers send two at once and
/// the rest takes a second or two.
fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::clone(&flag))
        .map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    Ok(flag)
}

/// What stays the same over all ways of planning.
struct Planner<'a> {
    args: &'a PlanArgs,
    loaded: &'a LoadedProfile,
    model: ArmModel,
    parameters: Vec<FreeParameter>,
    joint_types: Vec<JointType>,
    limits: Vec<(f64, f64)>,
    filter: CandidateFilter<'a>,
}

/// A chosen set with its order.
struct Ordered {
    chosen: Chosen,
    /// Poses to measure with their kinds, in the order of `Stops::poses`.
    stops: Vec<(PoseKind, Candidate)>,
    route: Route,
}

impl<'a> Planner<'a> {
    fn new(args: &'a PlanArgs, loaded: &'a LoadedProfile) -> Result<Self, Failure> {
        let profile = &loaded.profile;
        let limits = limits(profile, &args.limits)?;
        let cell = cell(profile, limits.clone(), args.region.as_ref(), args.no_filters)?;
        let filter = CandidateFilter::new(profile.chain(), &cell, from_mm(args.clearance_mm))
            .map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        let level = match args.level {
            LevelArg::Offsets => Level::Offsets,
            LevelArg::Geometric => Level::Geometric,
        };
        // The poses are for the first target: coordinates of others cannot be seen with it.
        let is_seen = |parameter: &FreeParameter| match parameter.id {
            crate::kinematics::ParameterId::Target { target, .. } => target == 0,
            crate::kinematics::ParameterId::Link { .. } => true,
        };
        let mut parameters = profile.free_parameters(level);
        parameters.retain(is_seen);
        expected_by(args.expected_deviation, &mut parameters);
        let targets = profile.targets().iter().map(|target| target.position_in_flange).collect();
        Ok(Self {
            args,
            loaded,
            model: ArmModel { chain: profile.chain().clone(), targets },
            parameters,
            joint_types: load::joint_types(profile),
            limits,
            filter,
        })
    }

    const fn profile(&self) -> &'a Profile {
        &self.loaded.profile
    }

    /// Standard deviation of a coordinate (m) that predictions are for.
    fn sigma(&self) -> Option<f64> {
        let distance = self.profile().tracker().position_in_base.coords.norm();
        let instrument = || self.profile().instrument().map(|instrument| instrument.sigma_at(distance));
        self.args.sigma_mm.map(from_mm).or_else(instrument)
    }

    fn joint_box(&self) -> Result<JointBox, Failure> {
        JointBox::new(self.limits.clone()).map_err(|error| planning_failure(&error))
    }

    fn information(&self, pool: &[Candidate]) -> Result<Information, Failure> {
        let at = |configuration: Vec<f64>| TargetAt { configuration, target: 0 };
        let candidates: Vec<TargetAt> = pool.iter().map(|candidate| at(candidate.configuration.clone())).collect();
        let fresh: Vec<TargetAt> = random(&self.joint_box()?, !self.args.seed).take(FRESH_POSES).map(at).collect();
        Information::new(&self.model, &self.parameters, &candidates, &fresh).map_err(|error| planning_failure(&error))
    }

    /// Candidates, those that must be in first.
    fn candidates(&self, needed: usize, included: &[PlannedPose]) -> Result<Candidates, Failure> {
        let count = self.args.candidates;
        let joint_box = self.joint_box()?;
        let stream = low_discrepancy(&joint_box, self.args.seed).take(count.saturating_mul(TRIES_PER_CANDIDATE));
        let mut candidates = self
            .filter
            .collect_at_least(stream, count, needed)
            .map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        let mut kept: Vec<Candidate> = included.iter().map(|row| self.candidate(&row.configuration)).collect();
        kept.append(&mut candidates.kept);
        candidates.kept = kept;
        Ok(candidates)
    }

    /// The identification poses that are already measured, and what to say about them.
    fn included(&self) -> Result<(Vec<PlannedPose>, Vec<Warning>), Failure> {
        let Some(file) = &self.args.include else { return Ok((Vec::new(), Vec::new())) };
        let (rows, mut warnings, _) = self.listed_poses(file)?;
        let all = rows.len();
        let included: Vec<PlannedPose> = rows.into_iter().filter(|row| row.kind == PoseKind::Identification).collect();
        if included.len() < all {
            let text = format!(
                "{} of {all} rows of '{}' are not identification poses and do not count as measured",
                all - included.len(),
                file.display()
            );
            warnings.push(warning("not_included", text, false));
        }
        let outside: Vec<String> =
            included.iter().filter(|row| self.is_outside(&row.configuration)).map(|row| row.pose.clone()).collect();
        if !outside.is_empty() {
            let text = format!("measured poses outside the joint limits of the profile: {}", shortened(&outside));
            warnings.push(warning("joint_limits", text, false));
        }
        Ok((included, warnings))
    }

    /// Whether a configuration is outside the limits that the arm itself has.
    fn is_outside(&self, configuration: &[f64]) -> bool {
        let ranges = self.profile().joints().iter().zip(configuration);
        ranges
            .filter_map(|(range, value)| Some((range.limits?, value)))
            .any(|((low, high), value)| !(low - 1e-9..=high + 1e-9).contains(value))
    }

    /// What makes a plan unfit to be run as it is.
    fn safety_warnings(&self) -> Vec<Warning> {
        if self.args.no_filters {
            let text = "no check of collisions and sight was made ('--no-filters'): such a plan is for comparison, do not run it on a robot";
            return vec![warning("not_checked", text.to_owned(), false)];
        }
        if self.profile().bodies().is_empty() {
            let text = "the profile has no bodies, so the arm was not checked against itself, the floor or keep-out boxes: add 'bodies', or check every move by hand";
            return vec![warning("not_checked", text.to_owned(), false)];
        }
        Vec::new()
    }

    fn candidate(&self, configuration: &[f64]) -> Candidate {
        let at = TargetAt { configuration: configuration.to_vec(), target: 0 };
        Candidate { point_in_base: self.model.point_in_base(&at), configuration: at.configuration }
    }

    /// The identification poses of a plan, or all rows of a plain list.
    fn listed_poses(&self, file: &Path) -> Result<(Vec<PlannedPose>, Vec<Warning>, InputFile), Failure> {
        let bytes = store::read(file).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        let name = file.display().to_string();
        let listed = plan::read_bytes(&bytes, &name, &self.joint_types)
            .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
        let warnings = listed.warnings.iter().map(|problem| warning("table", problem.to_string(), false)).collect();
        Ok((listed.rows, warnings, load::input_file("plan", name, &bytes)))
    }

    /// Chooses, orders and scores a new plan.
    fn choose<O: Write, E: Write>(
        &self,
        console: &mut Console<O, E>,
        keep_going: &(dyn Fn() -> bool + Sync),
    ) -> Result<PlanSummary, Failure> {
        let args = self.args;
        let (included, mut warnings) = self.included()?;
        let required = included.len();
        let mut candidates = self.candidates(args.poses + args.verification, &included)?;
        let mut round = 0;
        let (information, ordered) = loop {
            round += 1;
            let information = self.information(&candidates.kept)?;
            let chosen = self.search(&information, required, console, keep_going)?;
            match self.order(&candidates.kept, required, chosen)? {
                Ok(ordered) => break (information, ordered),
                Err(unreachable) if round < ROUNDS => {
                    console.remark(&format!(
                        "{} poses cannot be reached without a collision: choosing again",
                        unreachable.len()
                    ));
                    let mut index = 0;
                    candidates.kept.retain(|_| {
                        index += 1;
                        !unreachable.contains(&(index - 1))
                    });
                }
                Err(_) => {
                    return Err(Failure::new(ExitStatus::Usage, "the poses cannot be visited without a collision")
                        .hint(
                            "narrow the joint ranges with '--limit' to one side of the cell, or lower '--clearance-mm'",
                        ));
                }
            }
        };
        let set = &ordered.chosen.set;
        let mut summary = self.summary(&information, set, required, &candidates.rejections)?;
        warnings.extend(self.safety_warnings());
        warnings.append(&mut summary.warnings);
        summary.warnings = warnings;
        summary.predicted_verification_rms_mm = self.predicted_verification(&candidates.kept, set, &ordered)?;
        summary.objective = Some(objective_name(args.objective).to_owned());
        summary.interrupted = ordered.chosen.interrupted;
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
        summary.poses = self.route_rows(&ordered, &included);
        Ok(summary)
    }

    fn search<O: Write, E: Write>(
        &self,
        information: &Information,
        required: usize,
        console: &mut Console<O, E>,
        keep_going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Chosen, Failure> {
        let settings = SearchSettings {
            poses: self.args.poses + required,
            required: (0..required).collect(),
            objective: objective(self.args.objective),
            seed: self.args.seed,
            ..SearchSettings::default()
        };
        let starts = settings.starts;
        let search = Search::new(information, settings).map_err(|error| planning_failure(&error))?;
        let threads = self.args.threads.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from));
        let (sender, receiver) = std::sync::mpsc::sync_channel::<crate::planning::Progress>(64);
        let mut lines = Progress::new(&mut console.err);
        let result = thread::scope(|scope| {
            let worker = thread::Builder::new().name("plan".to_owned()).spawn_scoped(scope, || {
                // A progress line that nobody has room for is dropped: the search never waits for a terminal.
                let told = |progress: &crate::planning::Progress| {
                    let _was_full = sender.try_send(*progress).is_err();
                };
                let chosen = plan_in_parallel(&search, threads, keep_going, &told);
                drop(sender);
                chosen
            });
            let worker = worker.map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
            while let Ok(progress) = receiver.recv() {
                let stage = match progress.stage {
                    Stage::Prediction => "predicting",
                    Stage::Objective { .. } => "choosing",
                };
                let sweeps = search.settings().sweeps_of(progress.stage);
                lines.say(|| {
                    format!(
                        "{stage} [{}] start {} of {starts}, condition {:.1}, predicted error {:.3} sigma",
                        bar(progress.sweep, sweeps),
                        progress.start + 1,
                        progress.condition_number,
                        progress.predicted_error
                    )
                });
            }
            // A panic of the search is a defect: let it be seen where it happened.
            worker.join().map_err(|panic| std::panic::resume_unwind(panic))
        })?;
        result.map_err(|error| planning_failure(&error))
    }

    /// Orders the chosen poses that are not measured yet and the verification poses; the inner error names candidates
    /// that cannot be reached.
    fn order(
        &self,
        pool: &[Candidate],
        required: usize,
        chosen: Chosen,
    ) -> Result<Result<Ordered, Vec<usize>>, Failure> {
        let verification = verification_set::choose(pool, &chosen.set, &self.limits, self.args.verification);
        let new = chosen.set.iter().copied().filter(|index| *index >= required);
        let stops: Vec<(PoseKind, usize)> = new
            .map(|index| (PoseKind::Identification, index))
            .chain(verification.iter().map(|&index| (PoseKind::Verification, index)))
            .collect();
        let poses: Vec<Vec<f64>> = stops.iter().map(|(_, index)| pool[*index].configuration.clone()).collect();
        let shape = self.filter.shape();
        let Some(home) = home_pose(shape, pool.iter().map(|candidate| candidate.configuration.as_slice())) else {
            return Err(Failure::new(ExitStatus::Usage, "the arm cannot stand anywhere in its planning limits"));
        };
        let spread = (pool.len() / VIAS).max(1);
        let vias: Vec<Vec<f64>> =
            pool.iter().step_by(spread).map(|candidate| candidate.configuration.clone()).collect();
        let request = Stops { home: &home, poses: &poses, vias: &vias, drift_every: Some(self.args.drift_every) };
        match order(shape, &request, &pace(self.profile(), self.args)) {
            Ok(route) => {
                let stops = stops.iter().map(|(kind, index)| (*kind, pool[*index].clone())).collect();
                Ok(Ok(Ordered { chosen, stops, route }))
            }
            Err(OrderError::Unreachable { poses }) => Ok(Err(poses.iter().map(|order| stops[*order].1).collect())),
            Err(error) => Err(Failure::from_error(ExitStatus::Usage, &error)),
        }
    }

    /// The rows of a plan. Measured poses are numbered as they are visited, after those that are measured already; a drift pose
    /// has the number of the pose that it repeats.
    fn route_rows(&self, ordered: &Ordered, included: &[PlannedPose]) -> Vec<PoseSummary> {
        let mut last = included.iter().filter_map(|row| row.pose.parse::<u64>().ok()).max().unwrap_or(0);
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
    ) -> Result<Option<f64>, Failure> {
        const FEWEST: usize = 3;
        let verification: Vec<TargetAt> = ordered
            .stops
            .iter()
            .filter(|(kind, _)| *kind == PoseKind::Verification)
            .map(|(_, candidate)| TargetAt { configuration: candidate.configuration.clone(), target: 0 })
            .collect();
        let Some(sigma) = self.sigma().filter(|_| verification.len() >= FEWEST) else { return Ok(None) };
        let chosen: Vec<TargetAt> = set
            .iter()
            .filter_map(|index| pool.get(*index))
            .map(|candidate| TargetAt { configuration: candidate.configuration.clone(), target: 0 })
            .collect();
        let information = Information::new(&self.model, &self.parameters, &chosen, &verification)
            .map_err(|error| planning_failure(&error))?;
        let all: Vec<usize> = (0..chosen.len()).collect();
        let score = Score::new(&information, &all).map_err(|error| planning_failure(&error))?;
        // Three coordinates of a reading scatter by σ each on top of what the robot misses.
        Ok(Some(to_mm(sigma * (score.predicted_error.powi(2) + 3.0).sqrt())))
    }

    fn row(&self, kind: PoseKind, pose: String, configuration: &[f64], problems: Vec<String>) -> PoseSummary {
        let edge = |(joint_type, value): (&JointType, &f64)| joint_type.quantity().to_edge(*value);
        let point = self.candidate(configuration).point_in_base;
        PoseSummary {
            pose,
            kind: kind.name().to_owned(),
            configuration: self.joint_types.iter().zip(configuration).map(edge).collect(),
            point_in_base_mm: Some([to_mm(point.x), to_mm(point.y), to_mm(point.z)]),
            problems,
        }
    }

    /// Scores the poses of a file.
    fn check(&self, file: &Path) -> Result<PlanSummary, Failure> {
        let (rows, mut warnings, input) = self.listed_poses(file)?;
        let scored: Vec<&PlannedPose> = rows.iter().filter(|row| row.kind == PoseKind::Identification).collect();
        let count = scored.len();
        if count == 0 {
            return Err(Failure::new(
                ExitStatus::Usage,
                format!("none of the {} rows of '{}' is of kind 'identification'", rows.len(), file.display()),
            )
            .hint("a plain list needs no 'kind' column: all its rows are then scored"));
        }
        let mut candidates = self.candidates(count, &[])?;
        let mut pool: Vec<Candidate> = scored.iter().map(|row| self.candidate(&row.configuration)).collect();
        pool.append(&mut candidates.kept);
        let information = self.information(&pool)?;
        let set: Vec<usize> = (0..count).collect();
        let mut summary = self.summary(&information, &set, 0, &candidates.rejections)?;
        warnings.extend(self.safety_warnings());
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
            warnings.push(warning("not_measurable", shortened(&bad), true));
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
            let text =
                format!("moves that are not free (joint moves in the order of the file): {}", shortened(&blocked));
            warnings.push(warning("blocked_move", text, true));
        }
        summary.verification_poses = rows.iter().filter(|row| row.kind == PoseKind::Verification).count();
        warnings.append(&mut summary.warnings);
        summary.warnings = warnings;
        summary.provenance.inputs.push(input);
        Ok(summary)
    }
}

/// The rows of a plan file from the summary.
fn planned_rows(summary: &PlanSummary, joint_types: &[JointType]) -> Vec<PlannedPose> {
    summary
        .poses
        .iter()
        .map(|row| PlannedPose {
            pose: row.pose.clone(),
            kind: row.kind.parse().unwrap_or(PoseKind::Via),
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

/// A bar of twenty signs.
fn bar(done: usize, of: usize) -> String {
    const WIDTH: usize = 20;
    let full = (WIDTH * done / of.max(1)).min(WIDTH);
    format!("{}{}", "#".repeat(full), ".".repeat(WIDTH - full))
}

/// The first few of many findings.
fn shortened(findings: &[String]) -> String {
    const SHOWN: usize = 5;
    let more = findings.len().saturating_sub(SHOWN);
    let list = findings.iter().take(SHOWN).cloned().collect::<Vec<_>>().join("; ");
    if more > 0 { format!("{list}; and {more} more") } else { list }
}

fn planning_failure(error: &PlanningError) -> Failure {
    Failure::from_error(ExitStatus::Usage, error)
}

const fn objective(argument: ObjectiveArg) -> Objective {
    match argument {
        ObjectiveArg::Balanced => Objective::Balanced,
        ObjectiveArg::Condition => Objective::Condition,
        ObjectiveArg::Prediction => Objective::Prediction,
        ObjectiveArg::D => Objective::D,
        ObjectiveArg::O1 => Objective::O1,
        ObjectiveArg::O2 => Objective::O2,
        ObjectiveArg::O3 => Objective::O3,
        ObjectiveArg::O4 => Objective::O4,
        ObjectiveArg::O5 => Objective::O5,
    }
}

const fn objective_name(argument: ObjectiveArg) -> &'static str {
    match argument {
        ObjectiveArg::Balanced => "balanced",
        ObjectiveArg::Condition => "condition",
        ObjectiveArg::Prediction => "prediction",
        ObjectiveArg::D => "d",
        ObjectiveArg::O1 => "o1",
        ObjectiveArg::O2 => "o2",
        ObjectiveArg::O3 => "o3",
        ObjectiveArg::O4 => "o4",
        ObjectiveArg::O5 => "o5",
    }
}
