//! `trupose replay DIR`: shows a session entry by entry, without holding or changing it.

use std::io::Write;
use std::path::Path;

use super::script::session_failure;
use super::{Console, session, wizard};
use crate::cli::{ReplayArgs, TerminalEnvironment};
use crate::error::{ExitStatus, Failure};
use crate::report;
use crate::session::export;
use crate::session::journal::Journal;
use crate::session::state::{SampleState, Session};
use crate::store::session::{read_journal, tidy};
use crate::text::printable;
use crate::tui::replay::{self, Replay};
use crate::units::to_mm;

pub(super) fn run<O: Write, E: Write>(args: &ReplayArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let mut journal = journal(&args.folder)?;
    if let Some(note) = session::torn(&args.folder, &journal) {
        console.remark(&note);
    }
    let damaged = |error: &dyn std::error::Error| {
        Failure::new(ExitStatus::Store, format!("session '{}': {error}", args.folder.display()))
    };
    let count = journal.lines.len();
    let place = match args.entry {
        None => None,
        Some(entry) => {
            Some(usize::try_from(entry).ok().filter(|entry| (1..=count).contains(entry)).ok_or_else(|| {
                Failure::new(
                    ExitStatus::Usage,
                    format!("the session has no entry {entry}: its entries are 1 to {count}"),
                )
            })?)
        }
    };
    if args.print || args.csv {
        journal.lines.truncate(place.unwrap_or(count));
        let session = Session::of(&journal).map_err(|error| damaged(&error))?;
        if args.print {
            console.print(&entries_and_points(&journal, &session))?;
        } else {
            let robot = session.robot.as_ref().ok_or_else(|| {
                Failure::new(
                    ExitStatus::Usage,
                    format!("session '{}' has no robot at that entry", args.folder.display()),
                )
            })?;
            console.print(&export::measurements_csv(&session, robot))?;
        }
        return Ok(ExitStatus::Accepted);
    }
    let options = wizard::screen(args.terminal, &TerminalEnvironment::read()).map_err(|failure| {
        Failure::new(failure.status, "a replay needs a terminal that can move its cursor")
            .hint("without one: 'trupose replay DIR --print' or '--csv'")
    })?;
    let mut shown =
        Replay::new(journal, report::identification_text, options.theme).map_err(|error| damaged(&error))?;
    shown.go(place.map_or(0, |place| place - 1));
    let signal = replay::run(shown, options)
        .map_err(|error| Failure::new(ExitStatus::Store, format!("the terminal cannot be used: {error}")))?;
    signal.map_or(Ok(ExitStatus::Accepted), |signal| {
        Err(Failure::new(ExitStatus::Signal(signal), format!("ended by signal {signal}")))
    })
}

/// Reads the journal of a session's folder. A file in it means the folder: its recording is only a picture of the journal.
fn journal(path: &Path) -> Result<Journal, Failure> {
    let folder = path.parent().filter(|_| path.is_file()).unwrap_or(path);
    tidy(folder);
    read_journal(folder).map_err(|error| session_failure(&error))
}

/// Lists the entries, then the measured points with the errors of both arms once these are known.
fn entries_and_points(journal: &Journal, session: &Session) -> String {
    let entries = journal.lines.iter();
    let mut lines: Vec<String> =
        entries.map(|line| format!("{:>5} {} {}", line.number, line.time, printable(&line.entry.describe()))).collect();
    lines.push(String::new());
    lines.push(format!(
        "{:>5} {:<12} {:>11} {:>11} {:>11} {:>12} {:>12}  kind",
        "no.", "pose", "x mm", "y mm", "z mm", "nominal mm", "identified mm"
    ));
    let errors = |number: u64| {
        let result = session.identified.as_deref()?;
        let index = result.samples.iter().position(|sample| *sample == number)?;
        let norm = |(x, y, z): (f64, f64, f64)| x.hypot(y).hypot(z);
        result.points.get(index).map(|point| (norm(point.nominal_mm), norm(point.identified_mm)))
    };
    lines.extend(session.samples.iter().map(|sample| {
        let [x, y, z] = session.point_of(sample).coords.map(to_mm).into();
        let state = match sample.state {
            SampleState::Counts => String::new(),
            state => format!("  {state}"),
        };
        let pose = printable(session.pose_of(sample));
        let (nominal, identified) = errors(sample.noted.number).map_or_else(
            || ("-".to_owned(), "-".to_owned()),
            |(nominal, identified)| (format!("{nominal:.4}"), format!("{identified:.4}")),
        );
        let kind = session.kind_of(sample);
        format!(
            "{:>5} {pose:<12} {x:>11.4} {y:>11.4} {z:>11.4} {nominal:>12} {identified:>13}  {kind}{state}",
            sample.noted.number
        )
    }));
    lines.join("\n") + "\n"
}
