//! `trupose plan`: which poses to measure, and how good a list of poses is.

mod limits;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, SyncSender};
use std::thread;

use super::load::{self, LoadedProfile, now};
use super::progress::{Progress, Stopwatch};
use super::{Console, advice, record, refused, to_json};
use crate::cli::PlanArgs;
use crate::error::{ExitStatus, Failure};
use crate::planning::Stage;
use crate::planning::order::Pace;
use crate::procedure::plan::{self as procedure, PlanRequest};
use crate::procedure::{checks, input_file, joint_types};
use crate::profile::Profile;
use crate::report;
use crate::session::plan::{self, PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::summary::{InputFile, InputRole, Warning, WarningCode};
use crate::store;
use crate::units::from_mm;

pub(super) fn run<O: Write, E: Write>(args: &PlanArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let clock = Stopwatch::new();
    let loaded = load::profile(&args.profile)?;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    let profile = &loaded.profile;
    args.record.record.as_deref().map_or(Ok(()), record::check_target)?;
    let mut request = request(args, profile)?;
    procedure::check_request(profile, &request)?;
    let interrupted = interrupt_flag()?;
    let keep_going =
        || !interrupted.load(Ordering::Relaxed) && args.time_limit.is_none_or(|limit| clock.seconds() < limit);
    let mut warnings = Vec::new();
    let mut summary = if let Some(file) = &args.check {
        let listed = listed_poses(file, profile)?;
        let mut summary = procedure::check(profile, &loaded.text, &request, &listed.rows, &listed.input.file)?;
        summary.provenance.inputs.push(listed.input);
        warnings = listed.warnings;
        summary
    } else {
        if let Some(file) = &args.include {
            (request.included, warnings) = included(file, profile)?;
        }
        choose(&loaded, &request, &keep_going, console)?
    };
    warnings.append(&mut summary.warnings);
    for warning in &mut warnings {
        warning.put_into_words(advice::words);
    }
    summary.warnings = warnings;
    summary.elapsed_s = clock.seconds();
    if let Some(file) = &args.out {
        let joint_types = joint_types(profile);
        let text = plan::write(&procedure::rows(&summary, &joint_types), &joint_types);
        store::replace(file, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        summary.written.push(file.display().to_string());
    }
    if let Some(path) = &args.record.record {
        record::plan(path, &args.profile, profile, &loaded.text, &summary)?;
        summary.written.push(path.display().to_string());
    }
    let text = if args.json { to_json(&summary)? } else { report::plan_text(&summary) };
    console.print(&text)?;
    let is_blocked = summary.warnings.iter().any(|warning| warning.blocks_acceptance);
    Ok(if is_blocked { ExitStatus::NotAccepted } else { ExitStatus::Accepted })
}

/// A flag that Ctrl-C sets: the search then ends with the best set so far. A second Ctrl-C changes nothing, since wrappers send two
/// at once, and the rest takes only a second or two.
fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::clone(&flag)).map_err(|error| refused(&error))?;
    Ok(flag)
}

/// The request of the command line; its files are not read yet.
fn request(args: &PlanArgs, profile: &Profile) -> Result<PlanRequest, Failure> {
    let limits = (!args.limits.is_empty()).then(|| limits::narrowed(profile, &args.limits)).transpose()?;
    Ok(PlanRequest {
        created: now(),
        poses: args.poses,
        verification: args.verification,
        candidates: args.candidates,
        objective: args.objective,
        seed: args.seed,
        limits,
        region: args.region.map(Into::into),
        included: Vec::new(),
        numbered_after: 0,
        filters: !args.no_filters,
        clearance: from_mm(args.clearance_mm),
        expected_deviation: args.expected_deviation,
        level: args.level,
        sigma: args.sigma_mm.map(from_mm),
        drift_every: args.drift_every,
        pace: Pace { speed: args.speed_percent / 100.0, settle: args.settle_s, shots: args.shots, ..Pace::default() },
        threads: args.threads,
    })
}

/// The poses of a file.
struct Listed {
    rows: Vec<PlannedPose>,
    warnings: Vec<Warning>,
    input: InputFile,
}

/// Reads all rows of a plan or of a plain list.
fn listed_poses(file: &Path, profile: &Profile) -> Result<Listed, Failure> {
    let bytes = store::read(file).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let name = file.display().to_string();
    let listed = plan::read(&bytes, &name, &joint_types(profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let warnings = checks::table_warnings(None, &listed.warnings);
    Ok(Listed { rows: listed.rows, warnings, input: input_file(InputRole::Plan, name, &bytes) })
}

/// The identification poses that are already measured, and warnings about the file.
fn included(file: &Path, profile: &Profile) -> Result<(Vec<PlannedPose>, Vec<Warning>), Failure> {
    let Listed { rows, mut warnings, .. } = listed_poses(file, profile)?;
    let all = rows.len();
    let included: Vec<PlannedPose> = rows.into_iter().filter(|row| row.kind == PoseKind::Identification).collect();
    if included.len() < all {
        let text = format!(
            "{} of {all} rows of '{}' are not identification poses and do not count as measured",
            all - included.len(),
            file.display()
        );
        warnings.push(Warning::new(WarningCode::NotIncluded, text, false));
    }
    Ok((included, warnings))
}

/// Chooses poses on another thread while this one prints the progress.
fn choose<O: Write, E: Write>(
    loaded: &LoadedProfile,
    request: &PlanRequest,
    keep_going: &(dyn Fn() -> bool + Sync),
    console: &mut Console<O, E>,
) -> Result<PlanSummary, Failure> {
    let (sender, receiver) = mpsc::sync_channel(64);
    thread::scope(|scope| {
        let worker = thread::Builder::new().name("plan".to_owned()).spawn_scoped(scope, move || {
            let told = |progress| tell(&sender, progress);
            procedure::plan(&loaded.profile, &loaded.text, request, keep_going, &told)
        });
        let worker = worker.map_err(|error| refused(&error))?;
        let mut lines = Progress::new(&mut console.err);
        while let Ok(progress) = receiver.recv() {
            match progress {
                procedure::Progress::Searching => lines = Progress::new(&mut console.err),
                procedure::Progress::Sweep { found, done, sweeps, starts } => {
                    lines.say(|| sweep_text(&found, &bar(done, sweeps), starts));
                }
                procedure::Progress::Unreachable { poses } => {
                    console.remark(&format!("{poses} poses cannot be reached without a collision: choosing others"));
                    lines = Progress::new(&mut console.err);
                }
            }
        }
        // A panic of the search is a defect: it is passed on so that it shows where it happened.
        Ok(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?)
    })
}

/// Hands progress to the printing thread. Sweeps are dropped when its channel is full, so that the search never waits for a
/// terminal; once that thread has ended, everything is.
fn tell(sender: &SyncSender<procedure::Progress>, progress: procedure::Progress) {
    let _was_lost = match progress {
        procedure::Progress::Sweep { .. } => sender.try_send(progress).is_err(),
        procedure::Progress::Searching | procedure::Progress::Unreachable { .. } => sender.send(progress).is_err(),
    };
}

/// The progress line of a sweep.
fn sweep_text(found: &crate::planning::Progress, bar: &str, starts: usize) -> String {
    let stage = match found.stage {
        Stage::Prediction => "predicting",
        Stage::Objective { .. } => "choosing",
    };
    format!(
        "{stage} [{bar}] start {} of {starts}, condition {:.1}, predicted error {:.3} sigma",
        found.start + 1,
        found.figures.condition_number,
        found.figures.predicted_error
    )
}

/// A progress bar of twenty characters.
fn bar(done: usize, of: usize) -> String {
    const WIDTH: usize = 20;
    let full = (WIDTH * done / of.max(1)).min(WIDTH);
    format!("{}{}", "#".repeat(full), ".".repeat(WIDTH - full))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::{Cli, Command};

    #[test]
    fn without_options_the_command_asks_for_the_default() {
        let Some(Command::Plan(args)) = Cli::parse_from(["trupose", "plan", "--profile", "soochow"]).command else {
            panic!("not the command");
        };
        let profile = load::profile(&args.profile).unwrap().profile;
        let asked = PlanRequest { created: String::new(), ..request(&args, &profile).unwrap() };
        assert_eq!(asked, PlanRequest::default());
    }
}
