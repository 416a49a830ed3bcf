//! `trupose session list | show | export | report`: sessions on disk, without locking them.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::script::session_failure;
use super::{Console, identity, to_json};
use crate::checksum::{self, Finding};
use crate::cli::{IdentityArgs, SessionCommand};
use crate::error::{ExitStatus, Failure};
use crate::procedure::{deliver, models};
use crate::report::identification_text;
use crate::session::export;
use crate::session::journal::{self, Journal, instrument_text, target_text};
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::session::state::{SampleState, Session};
use crate::store::session::{SessionError, folders, hold, read_journal, tidy};
use crate::store::{self, Links};
use crate::text::{causes, counted, printable};

pub(super) fn run<O: Write, E: Write>(
    command: &SessionCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        SessionCommand::List { sessions } => list(sessions, console),
        SessionCommand::Show { folder, journal, json } => show(folder, *journal, *json, console),
        SessionCommand::Report { folder, text: true, .. } => print_report(folder, console),
        SessionCommand::Report { folder, out, identity, .. } => report(folder, out.as_deref(), identity, console),
        SessionCommand::Export { folder, csv, out } => export_tables(folder, *csv, out.as_deref(), console),
    }
}

/// The session of a folder. Says what is left out of an interrupted last write.
fn session<O: Write, E: Write>(folder: &Path, console: &mut Console<O, E>) -> Result<Session, Failure> {
    let (journal, session) = load(folder)?;
    if let Some(note) = torn(folder, &journal) {
        console.remark(&note);
    }
    Ok(session)
}

/// The note about an interrupted last write.
pub(super) fn torn(folder: &Path, journal: &Journal) -> Option<String> {
    (journal.torn_bytes > 0).then(|| {
        format!(
            "note: the last write to '{}' was interrupted: {} from line {} of {} on are left out",
            folder.display(),
            counted(journal.torn_bytes, "byte"),
            journal.lines.len() + 1,
            journal::FILE_NAME,
        )
    })
}

/// The session of a folder with its journal.
fn load(folder: &Path) -> Result<(Journal, Session), Failure> {
    tidy(folder);
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
            Ok((journal, session)) => {
                if let Some(note) = torn(&folder, &journal) {
                    console.remark(&note);
                }
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
            format!("{} bytes of an interrupted last write are set aside when it is resumed", journal.torn_bytes),
        );
    }
    for (name, value) in delivered_files(folder, &session) {
        line(name, value);
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

/// What `session show` says about the files that were delivered: whether they are as they were written.
fn delivered_files(folder: &Path, session: &Session) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    let (mut intact, mut without) = (0, 0);
    for (index, name) in session.delivered.iter().enumerate() {
        let said = |what: &str| ("file", format!("{name}: {what}"));
        let path = folder.join(name);
        // A pipe or a device would be read for ever.
        if path.symlink_metadata().is_ok_and(|metadata| !metadata.is_file()) {
            lines.push(said("NOT readable: it is no regular file"));
            continue;
        }
        let text = match store::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) => {
                lines.push(said(&format!("NOT readable: {}", causes(&error))));
                continue;
            }
        };
        let is_delivered = session.delivered_sums.get(index).map(|sum| *sum == checksum::sum(&text));
        match (is_delivered, checksum::check(&text)) {
            (_, Finding::Changed) => lines.push(said("CHANGED since it was written")),
            (Some(false), Finding::Intact) => lines.push(said("written again since it was delivered")),
            (Some(false), Finding::Missing) => lines.push(said("CHANGED since it was delivered")),
            (Some(true), _) | (None, Finding::Intact) => intact += 1,
            (None, Finding::Missing) => without += 1,
        }
    }
    if intact > 0 {
        lines.insert(0, ("files", format!("{} as written", counted(intact, "file"))));
    }
    if without > 0 {
        let of = "of an earlier version, without check sums: a change in them would not be noticed";
        lines.insert(0, ("files", format!("{} {of}", counted(without, "file"))));
    }
    lines
}

/// Writes the report of a session from its journal, also for sessions of earlier versions.
fn report<O: Write, E: Write>(
    folder: &Path,
    out: Option<&Path>,
    identity: &IdentityArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let mut session = session(folder, console)?;
    session.about = identity::about(identity, &session.about)?;
    let internal = |message: String| Failure::new(ExitStatus::Internal, message);
    let mut files = deliver::data_files(&session).map_err(internal)?;
    files.extend(models::delivered(&session));
    // The folder is held, so that no other program writes the same files.
    let (_held, links) = match out {
        Some(_) => (None, Links::Followed),
        None => (Some(hold(folder).map_err(|error| in_use(&error))?), Links::Refused),
    };
    let place = |(name, text): (String, String)| {
        let place = folder.join(name);
        match (out, place.extension()) {
            (Some(out), Some(extension)) => (out.with_extension(extension), text),
            _ => (place, text),
        }
    };
    let reports: Vec<_> = deliver::reports(&session, &files).map_err(internal)?.into_iter().map(place).collect();
    write_all(&reports, links, console)?;
    if session.identified.is_none() {
        console.remark("nothing has been identified in this session yet; the report says so");
    } else if !session.is_current() {
        console.remark("samples have changed since the identification; the report says so");
    }
    Ok(ExitStatus::Accepted)
}

/// The failure of a command that writes into a folder that another program may hold.
fn in_use(error: &SessionError) -> Failure {
    let failure = session_failure(error);
    match error {
        SessionError::Locked { .. } => failure.hint("or write to another place with '--out'"),
        SessionError::Store(_) | SessionError::Journal { .. } | SessionError::NotASession { .. } => failure,
    }
}

/// Writes all files or says which are missing.
fn write_all<O: Write, E: Write>(
    files: &[(PathBuf, String)],
    links: Links,
    console: &mut Console<O, E>,
) -> Result<(), Failure> {
    store::replace_all(files.iter().map(|(path, text)| (path.clone(), text.as_bytes())), links)
        .map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    for (path, _) in files {
        console.say_written(path)?;
    }
    Ok(())
}

/// Prints the report as text.
fn print_report<O: Write, E: Write>(folder: &Path, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let session = session(folder, console)?;
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
    let session = session(folder, console)?;
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
    let files: Vec<_> = tables.into_iter().chain(drift).map(|(name, text)| (out.join(name), text)).collect();
    write_all(&files, Links::Followed, console)?;
    Ok(ExitStatus::Accepted)
}
