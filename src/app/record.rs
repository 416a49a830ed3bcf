//! `trupose record rebuild`, and the recordings of commands without a session.

use std::io::Write;
use std::path::Path;

use jiff::Timestamp;

use super::script::session_failure;
use super::session::torn;
use super::{Console, load};
use crate::cli::RecordCommand;
use crate::error::{ExitStatus, Failure};
use crate::kinematics::JointType;
use crate::procedure::identify::{Identified, IdentifyRequest, NamedSample};
use crate::procedure::joint_types;
use crate::procedure::points::point_errors;
use crate::profile::Profile;
use crate::recording::{self, RecordingError, Written};
use crate::session::about::About;
use crate::session::journal::{
    Entry, IdentifiedText, Journal, Line, MeasuredText, PlanText, PlannedText, SCHEMA, to_edge, to_xyz_mm,
};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::sha256;
use crate::session::state::Session;
use crate::store::session::SessionFolder;
use crate::text::{counted, counted_as};
use crate::units::to_mm;

pub(super) fn run<O: Write, E: Write>(
    command: &RecordCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        RecordCommand::Rebuild { folder } => rebuild(folder, console),
    }
}

fn rebuild<O: Write, E: Write>(folder: &Path, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    // The folder is held so that no other program records into it meanwhile.
    let (_held, journal) = SessionFolder::open(folder).map_err(|error| session_failure(&error))?;
    if let Some(note) = torn(folder, &journal) {
        console.remark(&note);
    }
    let Written { path, bytes } = recording::rebuild(folder, &journal.lines).map_err(|error| failure(&error))?;
    let samples = journal.lines.iter().filter(|line| matches!(line.entry, Entry::Sample(_))).count();
    console.say(&format!(
        "written: {}\n{bytes} bytes, {}, {}\n",
        path.display(),
        counted_as(journal.lines.len(), "journal entry", "journal entries"),
        counted(samples, "sample")
    ))?;
    let old_parts = recording::remove_old_parts(folder);
    if old_parts > 0 {
        console.say(&format!("removed: {} of an earlier version\n", counted(old_parts, "part")))?;
    }
    Ok(ExitStatus::Accepted)
}

/// Returns the failure for an error of a recording.
pub(super) fn failure(error: &RecordingError) -> Failure {
    Failure::from_error(ExitStatus::Store, error)
}

/// Refuses to overwrite a file that is not a recording, such as the measurements.
pub(super) fn check_target(path: &Path) -> Result<(), Failure> {
    let size = std::fs::metadata(path).map_or(0, |found| if found.is_file() { found.len() } else { 0 });
    if size == 0 || recording::is_recording(path) {
        return Ok(());
    }
    let message = format!("'{}' already exists and is not a recording", path.display());
    Err(Failure::new(ExitStatus::Usage, message).hint("give '--record' another file"))
}

/// Writes a recording of an identification from files.
pub(super) fn identification(
    path: &Path,
    source: &str,
    about: &About,
    request: &IdentifyRequest,
    identified: &Identified,
) -> Result<(), Failure> {
    let lines = identification_lines(path, source, about, request, identified);
    recording::write(path, &lines, None).map_err(|error| failure(&error))
}

/// Returns an identification from tables as a session, for its report.
pub(super) fn identification_session(
    folder: &Path,
    source: &str,
    about: &About,
    request: &IdentifyRequest,
    identified: &Identified,
) -> Result<Session, Failure> {
    session(identification_lines(folder, source, about, request, identified))
}

fn session(lines: Vec<Line>) -> Result<Session, Failure> {
    let journal = Journal { lines, ..Journal::default() };
    Session::of(&journal).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))
}

fn identification_lines(
    path: &Path,
    source: &str,
    about: &About,
    request: &IdentifyRequest,
    identified: &Identified,
) -> Vec<Line> {
    let types = joint_types(&request.profile);
    let mut lines = Lines::new(path, source, &request.profile_text);
    if *about != About::default() {
        lines.push(Entry::About(about.clone()));
    }
    let named = |kind: PoseKind, samples: &[NamedSample]| -> Vec<(PoseKind, NamedSample)> {
        samples.iter().map(|sample| (kind, sample.clone())).collect()
    };
    let (judged, tested) = (&request.identification.samples, &request.verification.samples);
    let mut all = named(PoseKind::Identification, judged);
    all.extend(named(PoseKind::Verification, tested));
    let rows = all.iter().map(|(kind, sample)| PlannedPose {
        pose: sample.pose.clone(),
        kind: *kind,
        configuration: sample.sample.at.configuration.clone(),
        point_in_base: None,
    });
    let summary = &identified.summary;
    // Direct distances are of no planned pose.
    if !all.is_empty() {
        lines.push(Entry::Plan(PlanText {
            origin: "the rows of the measured files".to_owned(),
            condition_number: summary.condition_number,
            predicted_error_sigma: None,
            minutes: None,
            search: Vec::new(),
            rows: rows.map(|row| PlannedText::new(&row, &types)).collect(),
        }));
    }
    for (row, (kind, sample)) in all.iter().enumerate() {
        lines.push(Entry::Sample(measured(row, *kind, sample, &types)));
    }
    lines.push(Entry::Identified(Box::new(IdentifiedText {
        samples: (1..=all.len() as u64).collect(),
        summary: summary.clone(),
        calibration: identified.calibration.clone(),
        points: point_errors(identified, judged, tested),
    })));
    lines.lines
}

fn measured(row: usize, kind: PoseKind, named: &NamedSample, types: &[JointType]) -> MeasuredText {
    let sample = &named.sample;
    MeasuredText {
        number: row as u64 + 1,
        row,
        pose: named.pose.clone(),
        kind,
        target: sample.at.target,
        joints: to_edge(&sample.at.configuration, types),
        reported_joints: None,
        reported_scatter: None,
        reported_count: None,
        xyz_mm: to_xyz_mm(&sample.point, 9),
        factor: None,
        sigma_mm: sample.sigma.map(to_mm),
        scatter_mm: None,
        shots: 1,
        temperature_degc: named.temperature,
        pressure_hpa: None,
        humidity_percent: None,
        seconds: 0.0,
        predicted_error_sigma: None,
        remarks: Vec::new(),
        findings: Vec::new(),
    }
}

/// Writes a recording of a plan.
pub(super) fn plan(
    path: &Path,
    source: &str,
    profile: &Profile,
    profile_text: &str,
    summary: &PlanSummary,
) -> Result<(), Failure> {
    let types = joint_types(profile);
    let rows = crate::procedure::plan::rows(summary, &types);
    let mut lines = Lines::new(path, source, profile_text);
    let origin =
        summary.objective.map_or_else(|| "a list that was checked".to_owned(), |objective| objective.to_string());
    lines.push(Entry::Plan(PlanText::new(origin, Some(summary), &rows, &types)));
    recording::write(path, &lines.lines, Some(summary)).map_err(|error| failure(&error))
}

/// Journal lines of a calculation without a session.
struct Lines {
    time: Timestamp,
    lines: Vec<Line>,
}

impl Lines {
    fn new(path: &Path, source: &str, profile_text: &str) -> Self {
        let name = path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let time = load::now().parse().unwrap_or(Timestamp::UNIX_EPOCH);
        let mut lines = Self { time, lines: Vec::new() };
        let program = crate::wizard::program();
        lines.push(Entry::Opened { schema: SCHEMA, program, name });
        let text = profile_text.to_owned();
        lines.push(Entry::Profile { source: source.to_owned(), sha256: sha256(text.as_bytes()), text });
        lines
    }

    fn push(&mut self, entry: Entry) {
        self.lines.push(Line { number: self.lines.len() as u64 + 1, time: self.time, entry });
    }
}
