//! `trupose --script`, `trupose demo` and `trupose resume DIR --script`: the wizard without a terminal.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use jiff::Timestamp;

use super::{Console, link, load, refused, wizard};
use crate::cli::{DemoArgs, RecordingArgs, ScriptArgs};
use crate::error::{ExitStatus, Failure};
use crate::recording::Live;
use crate::report;
use crate::runtime::{Clock, Engine, Options, recent, signals};
use crate::script::{Format, Outcome, Runner, Script, ScriptError, Transcript};
use crate::session::journal::JournalError;
use crate::session::state::Session;
use crate::store::session::{SessionError, SessionFolder};
use crate::store::{self, StoreError};
use crate::text::listed;

/// The script of `trupose demo`.
const DEMO: &str = include_str!("../../sessions/demo.script.ron");

/// Runs the script of a file.
pub(super) fn run<O: Write, E: Write>(
    file: &Path,
    args: &ScriptArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let text = load::text(file)?;
    let script = parse(&text, &file.display().to_string(), args)?;
    let engine = Engine::new(live_options(clock(&script), args, console)?).map_err(|error| refused(&error))?;
    play(engine, &script, args, console)
}

/// Runs the demo: the paper's robot, simulated.
pub(super) fn demo<O: Write, E: Write>(args: &DemoArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let mut script_args = args.script.clone();
    if let Some(seed) = args.seed {
        script_args.values.push(("seed".to_owned(), seed.to_string()));
    }
    if let Some(wires) = &args.over {
        let wires = ron::to_string(&wires.0).map_err(|error| internal(&error))?;
        script_args.values.push(("wires".to_owned(), wires));
    }
    let script = parse(DEMO, "demo", &script_args)?;
    if args.watch {
        return wizard::watch(script, &script_args, args.terminal, console);
    }
    let engine = Engine::new(live_options(clock(&script), &script_args, console)?).map_err(|error| refused(&error))?;
    play(engine, &script, &script_args, console)
}

/// Resumes a session and runs a script in it.
pub(super) fn resume<O: Write, E: Write>(
    folder: Option<&Path>,
    file: &Path,
    args: &ScriptArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let folder = &find(folder, &args.sessions)?;
    let text = load::text(file)?;
    let script = parse(&text, &file.display().to_string(), args)?;
    let engine = open(folder, live_options(clock(&script), args, console)?)?;
    play(engine, &script, args, console)
}

fn parse(text: &str, file: &str, args: &ScriptArgs) -> Result<Script, Failure> {
    let mut values = BTreeMap::new();
    for (name, value) in &args.values {
        if values.insert(name.clone(), value.clone()).is_some() {
            return Err(Failure::new(ExitStatus::Usage, format!("'{name}' is given twice")));
        }
    }
    Script::parse(text, &values).map_err(|error| {
        let failure = Failure::new(ExitStatus::Usage, format!("'{file}': {error}"));
        let set: Vec<String> = values.iter().map(|(name, value)| format!("{name}={value}")).collect();
        // A value of the wrong type makes the script around it unreadable.
        let may_be_a_value = matches!(error, ScriptError::Syntax { .. }) && !set.is_empty();
        if may_be_a_value {
            failure.hint(format!("does the value given with '--set' fit here? {}", set.join(", ")))
        } else {
            failure
        }
    })
}

fn clock(script: &Script) -> Clock {
    let start = script.clock.as_deref().and_then(|clock| clock.parse::<Timestamp>().ok());
    start.map_or(Clock::System, Clock::starting_at)
}

/// The settings of an engine, without a live view.
fn options(clock: Clock, args: &ScriptArgs) -> Result<Options, Failure> {
    Ok(Options {
        sessions: args.sessions.clone(),
        clock,
        is_recorded: !args.recording.no_recording,
        live: None,
        raw_log: link::raw_log(args.raw_log.as_deref())?,
    })
}

/// The settings of an engine, with the live view if there is to be one.
pub(super) fn live_options<O: Write, E: Write>(
    clock: Clock,
    args: &ScriptArgs,
    console: &mut Console<O, E>,
) -> Result<Options, Failure> {
    Ok(Options { live: live(args.recording, console)?, ..options(clock, args)? })
}

/// Opens the port of the live view, if there is to be one.
fn live<O: Write, E: Write>(args: RecordingArgs, console: &mut Console<O, E>) -> Result<Option<Live>, Failure> {
    let Some(port) = args.live else { return Ok(None) };
    let live = Live::on(port).map_err(|error| {
        Failure::from_error(ExitStatus::Usage, &error).hint("another program listens there; give '--live' another port")
    })?;
    let port = live.port();
    console.remark(&format!(
        "live view: 'rerun --connect {}', through 'ssh -L {port}:127.0.0.1:{port}' from elsewhere",
        live.url()
    ));
    Ok(Some(live))
}

/// Finds the session to resume: by its folder, by its name or the beginning of it, or the one that was written to last.
pub(super) fn find(wanted: Option<&Path>, root: &Path) -> Result<PathBuf, Failure> {
    let Some(wanted) = wanted else {
        return recent::by_age(root).into_iter().next().ok_or_else(|| {
            Failure::new(ExitStatus::Usage, format!("there is no session in '{}' to resume", root.display()))
                .hint("'trupose' starts one; '--sessions DIR' looks in another folder")
        });
    };
    if wanted.exists() || wanted.components().count() != 1 {
        return Ok(wanted.to_owned());
    }
    let name =
        |folder: &PathBuf| folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let beginning = wanted.to_string_lossy();
    let mut found = recent::by_age(root);
    found.retain(|folder| name(folder).starts_with(&*beginning));
    if let Some(exact) = found.iter().find(|folder| name(folder) == beginning) {
        return Ok(exact.clone());
    }
    match found.as_slice() {
        // The message about a missing folder says it best.
        [] => Ok(wanted.to_owned()),
        [only] => Ok(only.clone()),
        several => {
            let names: Vec<String> = several.iter().map(name).collect();
            let message = format!("'{}' begins the names of several sessions: {}", wanted.display(), listed(&names));
            Err(Failure::new(ExitStatus::Usage, message).hint("type more of the name"))
        }
    }
}

/// Opens a session to resume it.
pub(super) fn open(folder: &Path, options: Options) -> Result<Engine, Failure> {
    let (held, journal) = SessionFolder::open(folder).map_err(|error| session_failure(&error))?;
    let session = Session::of(&journal)
        .map_err(|error| Failure::new(ExitStatus::Store, format!("session '{}': {error}", folder.display())))?;
    Engine::resume(held, session, journal, options).map_err(|error| refused(&error))
}

/// The failure that a session error means, with hints.
pub(super) fn session_failure(error: &SessionError) -> Failure {
    let failure = Failure::from_error(ExitStatus::Store, error);
    match error {
        SessionError::Locked { .. } => failure.hint("close the other program first, or continue there"),
        SessionError::NotASession { .. } => failure.hint("'trupose session list' shows the sessions of a folder"),
        SessionError::Journal { source: JournalError::Newer { .. }, .. } => failure.hint("use the program that wrote it"),
        SessionError::Journal { source: JournalError::Empty, .. } => {
            failure.hint("the program stopped before anything was saved: the folder can be deleted")
        }
        SessionError::Journal { source: JournalError::NotAJournal, .. } => failure.hint("is this the right folder?"),
        SessionError::Journal { source: JournalError::Damaged { line, .. }, .. } => failure
            .hint("nothing was changed; take an intact copy of the journal if there is one")
            .hint(format!(
                "to continue without this line and those after it, copy the folder and keep the lines before it: 'head -n {} journal.ron > journal.new'",
                line.saturating_sub(1)
            )),
        SessionError::Store(StoreError::Write { source, .. })
            if matches!(source.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem) =>
        {
            failure.hint(
                "it belongs to another user or is read-only: run as that user, or copy the folder and resume the copy",
            )
        }
        SessionError::Store(StoreError::NotOwn { .. }) => failure.hint("a folder that comes from elsewhere may lead to other files: remove the link"),
        SessionError::Journal { .. } | SessionError::Store(_) => failure,
    }
}

fn internal(error: &dyn std::error::Error) -> Failure {
    Failure::from_error(ExitStatus::Internal, error)
}

fn play<O: Write, E: Write>(
    engine: Engine,
    script: &Script,
    args: &ScriptArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let received = signals::watch(engine.sender()).map_err(|error| refused(&error))?;
    let format = if args.json { Format::Json } else { Format::Text };
    let transcript = Transcript::new(&mut console.out, format, script.clock.is_some());
    let reopen = |folder: &str| {
        let engine = options(clock(script), args)
            .and_then(|options| open(Path::new(folder), options))
            .map_err(|failure| failure.message)?;
        received.redirect(engine.sender());
        Ok(engine)
    };
    let mut runner = Runner::new(engine, transcript, &reopen);
    let outcome = runner.run(script);
    let unsaved = runner.unsaved();
    let saved = match (unsaved.is_empty(), runner.session().opened) {
        (false, _) => wizard::not_saved(&unsaved),
        (true, Some(_)) => "the session is saved".to_owned(),
        (true, None) => "no session was started".to_owned(),
    };
    let signalled = |cause: &str| {
        received.signal().map(|signal| Failure::new(ExitStatus::Signal(signal), format!("{cause}; {saved}")))
    };
    // A closed terminal sends SIGHUP: that is the cause, not the failed write.
    let output = |error: std::io::Error| {
        let cause = received.signal().map_or_else(String::new, |signal| format!("ended by signal {signal}"));
        signalled(&cause).unwrap_or_else(|| match error.kind() {
            std::io::ErrorKind::BrokenPipe => Failure::new(
                ExitStatus::Store,
                format!("the reader of the transcript has gone, so the script was stopped; {saved}"),
            ),
            _ => Failure::new(ExitStatus::Store, format!("cannot write the transcript: {error}; {saved}")),
        })
    };
    let outcome = outcome.map_err(output)?;
    if let Some(file) = &args.record_script {
        let title = format!("recorded: {}", script.title);
        let recorded = Script { title, clock: script.clock.clone(), steps: runner.done().to_vec() };
        let text = recorded.to_text().map_err(|error| internal(&error))?;
        store::replace(file, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    }
    if outcome == Outcome::Done
        && let Some(summary) = runner.summary()
    {
        let text = report::identification_text(summary);
        runner.print_table(&text).map_err(output)?;
    }
    if let Some(folder) = runner.folder().map(str::to_owned) {
        runner.print("session", &folder).map_err(output)?;
    }
    match outcome {
        Outcome::Done => Ok(ExitStatus::Accepted),
        Outcome::Failed { step, message, not_saved } => {
            let status = if not_saved { ExitStatus::Store } else { ExitStatus::NotAccepted };
            Err(Failure::new(status, format!("script step {step}: {message}")))
        }
        Outcome::Ended { cause } => signalled(&cause).map_or(Ok(ExitStatus::Accepted), Err),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_that_may_not_be_written_says_what_to_do() {
        let failure = |kind: io::ErrorKind| {
            session_failure(&StoreError::Write { path: "s/.lock".into(), source: kind.into() }.into())
        };
        for kind in [io::ErrorKind::PermissionDenied, io::ErrorKind::ReadOnlyFilesystem] {
            let hints = failure(kind).hints;
            assert!(hints.iter().any(|hint| hint.contains("read-only")), "{hints:?}");
        }
        assert!(failure(io::ErrorKind::StorageFull).hints.is_empty());
    }
}
