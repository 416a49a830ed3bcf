//! `trupose record rebuild | compact | check`, and the recordings of commands without a session.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use jiff::Timestamp;

use super::script::session_failure;
use super::{Console, load};
use crate::cli::RecordCommand;
use crate::error::{ExitStatus, Failure};
use crate::kinematics::JointType;
use crate::procedure::identify::{Identified, IdentifyRequest, NamedSample};
use crate::procedure::joint_types;
use crate::procedure::points::point_errors;
use crate::profile::Profile;
use crate::recording::{self, Check, Compaction, RecordingError};
use crate::session::calibration::Calibration;
use crate::session::journal::{
    Entry, IdentifiedText, Journal, Line, MeasuredText, PlanText, PlannedText, SCHEMA, to_edge, to_xyz_mm,
};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::sha256;
use crate::session::state::Session;
use crate::session::summary::IdentificationSummary;
use crate::store::session::{SessionFolder, read_journal};
use crate::units::to_mm;

pub(super) fn run<O: Write, E: Write>(
    command: &RecordCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        RecordCommand::Rebuild { folder } => {
            // Held, so that no program records into the folder meanwhile.
            let (_held, journal) = SessionFolder::open(folder).map_err(|error| session_failure(&error))?;
            let path = recording::rebuild(folder, &journal.lines).map_err(|error| failure(&error))?;
            console.print(&format!("written: {}\n{}\n", path.display(), described(&check(&path)?)))?;
            Ok(ExitStatus::Accepted)
        }
        RecordCommand::Compact { path } => compact(path, console),
        RecordCommand::Check { paths } => {
            let mut all_whole = true;
            for path in paths {
                all_whole &= check_one(path, console)?;
            }
            Ok(if all_whole { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
        }
    }
}

/// Makes one compact file of a folder's parts, or of a file. What is damaged is not touched: compact it would look whole.
fn compact<O: Write, E: Write>(path: &Path, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let before;
    let file = if path.is_dir() {
        let (_held, journal) = SessionFolder::open(path).map_err(|error| session_failure(&error))?;
        before = None;
        if recording::files(path).is_empty() {
            let message = format!("there is no recording in '{}'", path.display());
            return Err(Failure::new(ExitStatus::Usage, message)
                .hint("'trupose record rebuild DIR' makes one from the journal"));
        }
        recording::compact_folder(path, &journal.lines).map_err(|error| failure(&error))?
    } else {
        let found = check(path)?;
        match recording::compact_file(path).map_err(|error| failure(&error))? {
            Compaction::AsItWas => {}
            Compaction::DrawnAnew => {
                console
                    .print(&format!("its end was torn: all {} entries that it has are drawn anew\n", found.lines))?;
            }
            Compaction::Refused => return Err(refused(path, &found)),
        }
        before = Some(found.bytes);
        path.to_owned()
    };
    let after = check(&file)?;
    let change = before.map_or_else(String::new, |before| format!(", {before} bytes before"));
    console.print(&format!("written: {}\n{}{change}\n", file.display(), described(&after)))?;
    Ok(ExitStatus::Accepted)
}

/// Why a file is not made compact.
fn refused(path: &Path, found: &Check) -> Failure {
    let message = format!(
        "'{}' is not whole and stays as it is: {}; compact it would look whole",
        path.display(),
        described(found)
    );
    let failure = Failure::new(ExitStatus::NotAccepted, message)
        .hint("'trupose record rebuild DIR' makes the recording anew from the journal of its session");
    if found.lines == 0 {
        return failure;
    }
    let shown = format!("'trupose replay {} --print' prints the entries that it has from the first", path.display());
    failure.hint(shown)
}

/// Whether a recording is whole, and says so.
fn check_one<O: Write, E: Write>(path: &Path, console: &mut Console<O, E>) -> Result<bool, Failure> {
    if !path.is_dir() {
        let found = check(path)?;
        console.print(&format!("{}: {}\n", path.display(), described(&found)))?;
        return Ok(found.is_whole());
    }
    let mut journal = read_journal(path).map_err(|error| session_failure(&error))?;
    let files = recording::files(path);
    if files.is_empty() {
        console.print(&format!(
            "{}: no recording of {} journal entries; 'trupose record rebuild' makes it\n",
            path.display(),
            journal.lines.len()
        ))?;
        return Ok(false);
    }
    let (mut is_whole, mut is_foreign) = (files.len() == 1, false);
    let mut lines: BTreeSet<u64> = BTreeSet::new();
    for file in &files {
        let found = check(file)?;
        is_whole &= found.has_index && found.damaged == 0;
        let recorded = recording::read(file).map_err(|error| failure(&error))?.numbers;
        // The journal is ahead of the recording, also where a program goes on with both.
        journal = read_journal(path).map_err(|error| session_failure(&error))?;
        let foreign = recording::foreign_lines(file, &journal.lines).map_err(|error| failure(&error))?;
        lines.extend(recorded);
        console.print(&format!("{}: {}\n", file.display(), described(&found)))?;
        if let Some(first) = foreign.first() {
            is_foreign = true;
            console.print(&format!("{}\n", described_foreign(*first, foreign.len(), journal.lines.len())))?;
        }
    }
    let missing: Vec<String> = journal
        .lines
        .iter()
        .filter(|line| !lines.contains(&line.number))
        .map(|line| format!("{:>5} {}", line.number, crate::text::printable(&line.entry.describe())))
        .collect();
    if is_foreign {
        console.print(&format!(
            "'trupose record rebuild {}' makes the recording anew from the journal, in the place of what is there\n",
            path.display()
        ))?;
    } else if !missing.is_empty() {
        console.print(&format!(
            "missing of {} journal entries:\n{}\n'trupose record rebuild {}' makes the recording anew\n",
            journal.lines.len(),
            missing.join("\n"),
            path.display()
        ))?;
    } else if is_whole {
        console.print(&format!("all {} entries of the journal are recorded\n", journal.lines.len()))?;
    } else {
        console.print(&format!("'trupose record compact {}' makes one file with an index\n", path.display()))?;
    }
    Ok(is_whole && !is_foreign && missing.is_empty())
}

/// What entries of a recording mean that are not in the journal with `entries` entries; `first` is the number of the first of them.
fn described_foreign(first: i64, count: usize, entries: usize) -> String {
    if first == 1 {
        return "it is the recording of another session: its first entry is not that of the journal".to_owned();
    }
    let more = if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
    if usize::try_from(first).is_ok_and(|first| first <= entries) {
        format!("entry {first} of it differs from the journal{more}")
    } else {
        format!("entry {first} of it is not in the journal, which ends with entry {entries}{more}")
    }
}

fn check(path: &Path) -> Result<Check, Failure> {
    recording::check(path).map_err(|error| failure(&error))
}

fn described(check: &Check) -> String {
    let mut parts = vec![format!("{} bytes, {} journal entries, {} samples", check.bytes, check.lines, check.samples)];
    if !check.has_index {
        let why = if check.is_part { "still being written, or ended by a crash" } else { "its end is missing" };
        parts.push(format!("no index ({why})"));
    }
    if !check.missing.is_empty() {
        parts.push(format!("entries missing: {:?}", check.missing));
    }
    if check.damaged > 0 {
        parts.push(format!("{} messages cannot be read", check.damaged));
    }
    parts.join(", ")
}

/// What an error of a recording means to the operator.
pub(super) fn failure(error: &RecordingError) -> Failure {
    Failure::from_error(ExitStatus::Store, error)
}

/// Refuses to write a recording over something else, such as the measurements.
pub(super) fn check_target(path: &Path) -> Result<(), Failure> {
    let size = std::fs::metadata(path).map_or(0, |found| if found.is_file() { found.len() } else { 0 });
    if size == 0 || recording::read(path).is_ok() {
        return Ok(());
    }
    let message = format!("'{}' is there already and is no recording", path.display());
    Err(Failure::new(ExitStatus::Usage, message).hint("give '--record' another file"))
}

/// Writes a recording of an identification from files.
pub(super) fn identification(
    path: &Path,
    source: &str,
    request: &IdentifyRequest,
    identified: &Identified,
) -> Result<(), Failure> {
    let lines = identification_lines(path, source, request, identified);
    recording::write(path, &lines, false).map_err(|error| failure(&error))
}

/// What an identification from tables would be as a session: for its report.
pub(super) fn identification_session(
    folder: &Path,
    source: &str,
    request: &IdentifyRequest,
    identified: &Identified,
) -> Result<Session, Failure> {
    session(identification_lines(folder, source, request, identified))
}

/// What an identification without coordinates would be as a session: for its report.
pub(super) fn bare_session(
    folder: &Path,
    source: &str,
    profile_text: &str,
    summary: &IdentificationSummary,
    calibration: Option<&Calibration>,
) -> Result<Session, Failure> {
    let mut lines = Lines::new(folder, source, profile_text);
    lines.push(Entry::Identified(Box::new(IdentifiedText {
        samples: Vec::new(),
        summary: summary.clone(),
        calibration: calibration.cloned(),
        points: Vec::new(),
    })));
    session(lines.lines)
}

fn session(lines: Vec<Line>) -> Result<Session, Failure> {
    let journal = Journal { lines, ..Journal::default() };
    Session::of(&journal).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))
}

fn identification_lines(path: &Path, source: &str, request: &IdentifyRequest, identified: &Identified) -> Vec<Line> {
    let types = joint_types(&request.profile);
    let mut lines = Lines::new(path, source, &request.profile_text);
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
    lines.push(Entry::Plan(PlanText {
        origin: "the rows of the measured files".to_owned(),
        condition_number: summary.condition_number,
        predicted_error_sigma: None,
        minutes: None,
        search: Vec::new(),
        rows: rows.map(|row| PlannedText::new(&row, &types)).collect(),
    }));
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
        xyz_mm: to_xyz_mm(&sample.point, 9),
        factor: None,
        sigma_mm: sample.sigma.map(to_mm),
        scatter_mm: None,
        shots: 1,
        temperature_degc: named.temperature,
        seconds: 0.0,
        predicted_error_sigma: None,
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
    recording::write(path, &lines.lines, true).map_err(|error| failure(&error))
}

/// Journal lines of what was not a session.
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
