//! `trupose session list | show | export | report`: sessions on disk, without locking them.

use std::io::Write;
use std::path::Path;

use super::script::session_failure;
use super::{Console, to_json};
use crate::cli::SessionCommand;
use crate::error::{ExitStatus, Failure};
use crate::procedure::{deliver, models};
use crate::report::identification_text;
use crate::session::export;
use crate::session::journal::{Journal, instrument_text, target_text};
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::session::state::{SampleState, Session};
use crate::store;
use crate::store::session::{folders, read_journal};
use crate::text::printable;

pub(super) fn run<O: Write, E: Write>(
    command: &SessionCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        SessionCommand::List { sessions } => list(sessions, console),
        SessionCommand::Show { folder, journal, json } => show(folder, *journal, *json, console),
        SessionCommand::Report { folder, text: true, .. } => print_report(folder, console),
        SessionCommand::Report { folder, out, .. } => report(folder, out.as_deref(), console),
        SessionCommand::Export { folder, csv, out } => export_tables(folder, *csv, out.as_deref(), console),
    }
}

/// The session of a folder with its journal.
pub(super) fn load(folder: &Path) -> Result<(Journal, Session), Failure> {
    let journal = read_journal(folder).map_err(|error| session_failure(&error))?;
    let session = Session::of(&journal)
        .map_err(|error| Failure::new(ExitStatus::Store, format!("session '{}': {error}", folder.display())))?;
    Ok((journal, session))
}

fn list<O: Write, E: Write>(root: &Path, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let found = if root.exists() { folders(root) } else { Ok(Vec::new()) };
    let found = found.map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    if found.is_empty() {
        console.remark(&format!("no session in '{}'", root.display()));
        return Ok(ExitStatus::Accepted);
    }
    let mut table =
        vec![format!("{:<32} {:<20} {:<10} {:>7}  last entry (UTC)", "session", "robot", "step", "samples")];
    for folder in found {
        let name = folder.file_name().map_or_else(String::new, |name| printable(&name.to_string_lossy()));
        match load(&folder) {
            Ok((_, session)) => {
                let robot = session.robot.as_ref().map_or("-", |robot| robot.profile.name());
                let latest = session.latest.map_or_else(String::new, |time| time.to_string());
                let step = session.step.to_string();
                let samples = session.counted().count();
                table.push(format!("{name:<32} {robot:<20} {step:<10} {samples:>7}  {latest}"));
            }
            Err(failure) => {
                table.push(format!("{name:<32} cannot be read"));
                console.remark(&failure.to_string());
            }
        }
    }
    console.print(&(table.join("\n") + "\n"))?;
    Ok(ExitStatus::Accepted)
}

fn show<O: Write, E: Write>(
    folder: &Path,
    with_journal: bool,
    json: bool,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let (journal, session) = load(folder)?;
    if json {
        let entries: Vec<_> = journal
            .lines
            .iter()
            .map(|line| serde_json::json!({ "number": line.number, "time": line.time.to_string(), "text": line.entry.describe() }))
            .collect();
        console.print(&to_json(&entries)?)?;
        return Ok(ExitStatus::Accepted);
    }
    let mut lines = Vec::new();
    let mut line = |name: &str, value: String| lines.push(format!("{name:<14} {}", printable(&value)));
    line("session", session.name.clone());
    line("opened", session.opened.map_or_else(|| "-".to_owned(), |time| format!("{time} by {}", session.program)));
    line(
        "robot",
        session
            .robot
            .as_ref()
            .map_or_else(|| "-".to_owned(), |robot| format!("{} ({})", robot.profile.title(), robot.profile.name())),
    );
    line("instrument", session.instrument.as_ref().map_or_else(|| "-".to_owned(), instrument_text));
    line("SMR", session.target.as_ref().map_or_else(|| "-".to_owned(), target_text));
    line("step", format!("{} of {}: {}", session.step.number(), Step::ALL.len(), session.step));
    let count = |kind| session.counted_of(kind).count();
    line(
        "samples",
        format!(
            "{} identification, {} verification, {} drift; {} poses wait",
            count(PoseKind::Identification),
            count(PoseKind::Verification),
            count(PoseKind::Drift),
            session.open_rows().count()
        ),
    );
    let in_state = |state| session.samples.iter().filter(|sample| sample.state == state).count();
    line(
        "not counted",
        format!(
            "{} excluded, {} remeasured, {} undone, {} without a reading",
            in_state(SampleState::LeftOut),
            in_state(SampleState::Superseded),
            in_state(SampleState::Undone),
            session.refused.len()
        ),
    );
    let result = match &session.identified {
        None => "not identified yet".to_owned(),
        Some(_) if !session.is_current() => "out of date: samples have changed since".to_owned(),
        Some(result) => result.summary.verdict.reasons.first().cloned().unwrap_or_else(|| "accepted".to_owned()),
    };
    line("result", result);
    line(
        "ended",
        if session.closed {
            "in good order".to_owned()
        } else {
            "not closed: open in a program, or interrupted".to_owned()
        },
    );
    if journal.torn_bytes > 0 {
        line(
            "note",
            format!("{} bytes of an incomplete last entry will be dropped when it is resumed", journal.torn_bytes),
        );
    }
    for note in &session.notes {
        line(
            "note",
            note.pose.as_ref().map_or_else(|| note.text.clone(), |pose| format!("pose {pose}: {}", note.text)),
        );
    }
    if with_journal {
        lines.push(String::new());
        let entries = journal.lines.iter();
        lines.extend(
            entries.map(|line| format!("{:>5} {} {}", line.number, line.time, printable(&line.entry.describe()))),
        );
    }
    console.print(&(lines.join("\n") + "\n"))?;
    Ok(ExitStatus::Accepted)
}

/// Writes the report of a session from its journal, also for sessions of earlier versions.
fn report<O: Write, E: Write>(
    folder: &Path,
    out: Option<&Path>,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let (_, session) = load(folder)?;
    let internal = |message: String| Failure::new(ExitStatus::Internal, message);
    let mut files = deliver::data_files(&session).map_err(internal)?;
    files.extend(models::delivered(&session));
    let failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
    for (name, text) in deliver::reports(&session, &files).map_err(internal)? {
        let place = folder.join(&name);
        let file = match (out, place.extension()) {
            (Some(out), Some(extension)) => out.with_extension(extension),
            _ => place,
        };
        store::replace(&file, &text).map_err(failure)?;
        console.print(&format!("written: {}\n", file.display()))?;
    }
    if session.identified.is_none() {
        console.remark("nothing has been identified in this session yet; the report says so");
    } else if !session.is_current() {
        console.remark("samples have changed since the identification; the report says so");
    }
    Ok(ExitStatus::Accepted)
}

/// Prints the report as text.
fn print_report<O: Write, E: Write>(folder: &Path, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let (_, session) = load(folder)?;
    let Some(result) = &session.identified else {
        let message = format!("nothing has been identified in session '{}' yet", folder.display());
        return Err(Failure::new(ExitStatus::Numerical, message)
            .hint("'trupose session show DIR' shows what it has; 'trupose resume DIR' resumes it"));
    };
    if !session.is_current() {
        console.print("OUT OF DATE: samples have changed since this result; identify again\n\n")?;
    }
    console.print(&identification_text(&result.summary))?;
    Ok(ExitStatus::Accepted)
}

fn export_tables<O: Write, E: Write>(
    folder: &Path,
    csv: bool,
    out: Option<&Path>,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let (_, session) = load(folder)?;
    let robot = session
        .robot
        .as_ref()
        .ok_or_else(|| Failure::new(ExitStatus::Usage, format!("session '{}' has no robot yet", folder.display())))?;
    if !csv {
        return Err(Failure::new(ExitStatus::Usage, "nothing was selected for export").hint("give '--csv'"));
    }
    let Some(out) = out else {
        console.print(&export::measurements_csv(&session, robot))?;
        return Ok(ExitStatus::Accepted);
    };
    let failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
    store::create_folder(out).map_err(failure)?;
    let tables = [
        ("plan.csv", export::plan_csv(&session, robot)),
        ("measurements.csv", export::measurements_csv(&session, robot)),
    ];
    let drift = export::drift_csv(&session, robot).map(|text| ("drift.csv", text));
    for (name, text) in tables.into_iter().chain(drift) {
        let file = out.join(name);
        store::replace(&file, &text).map_err(failure)?;
        console.print(&format!("written: {}\n", file.display()))?;
    }
    Ok(ExitStatus::Accepted)
}
