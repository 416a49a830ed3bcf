//! The thread that writes the journal and the result files of a session.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::events::Events;
use crate::checksum;
use crate::procedure::correct::{FOLDER, ProgramFile};
use crate::session::journal::{Entry, Line};
use crate::store;
use crate::store::session::{SessionError, SessionFolder};
use crate::text::causes;
use crate::wizard::{Answer, Event, Problem, RequestId, StoreEvent};

/// File with the cell of the last session, beside the folders of the sessions.
pub(super) const CELL: &str = "cell.ron";
/// Capacity of the channel of commands; the wizard never has more than one request running.
const COMMAND_CAPACITY: usize = 4;

/// A request to the thread.
#[derive(Debug)]
pub(super) enum Command {
    Create { id: RequestId, name: String },
    Append { id: RequestId, lines: Vec<Line> },
    Replace { id: RequestId, files: Vec<(String, String)>, left_out: Vec<String> },
    Program { id: RequestId, program: Box<ProgramFile> },
}

/// The store thread with its channel.
#[derive(Debug)]
pub(super) struct StoreThread {
    commands: Option<SyncSender<Command>>,
    thread: Option<JoinHandle<()>>,
}

impl StoreThread {
    /// Starts with a folder that is already held, or creates one below `root` on request.
    pub(super) fn start(root: PathBuf, folder: Option<SessionFolder>, events: Events) -> io::Result<Self> {
        let (commands, received) = sync_channel(COMMAND_CAPACITY);
        let thread =
            thread::Builder::new().name("store".to_owned()).spawn(move || work(&root, folder, &received, &events))?;
        Ok(Self { commands: Some(commands), thread: Some(thread) })
    }

    /// Sends a request. Returns `false` if the thread is gone.
    pub(super) fn ask(&self, command: Command) -> bool {
        self.commands.as_ref().is_some_and(|commands| commands.send(command).is_ok())
    }

    /// Carries out all requests, releases the folder and ends.
    pub(super) fn finish(&mut self) {
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            // A panic there was reported when it happened.
            drop(thread.join());
        }
    }
}

impl Drop for StoreThread {
    fn drop(&mut self) {
        self.finish();
    }
}

fn work(root: &Path, mut held: Option<SessionFolder>, commands: &Receiver<Command>, events: &Events) {
    while let Ok(command) = commands.recv() {
        let event = match command {
            Command::Create { id, name } => Event::Store(match SessionFolder::create(root, &name) {
                Ok(folder) => {
                    let path = folder.path().display().to_string();
                    let name = folder.path().file_name().map_or(name, |name| name.to_string_lossy().into_owned());
                    held = Some(folder);
                    StoreEvent::Created { id, folder: path, name }
                }
                Err(error) => StoreEvent::Failed { id, message: causes(&error) },
            }),
            Command::Append { id, lines } => {
                let written = held.as_mut().map(|folder| folder.append(&lines));
                if matches!(written, Some(Ok(()))) {
                    keep_cell(root, &lines);
                }
                Event::Store(match written {
                    Some(Ok(())) => StoreEvent::Written { id },
                    Some(Err(error)) => StoreEvent::Failed { id, message: causes(&SessionError::from(error)) },
                    None => StoreEvent::Failed { id, message: "the session has no folder".to_owned() },
                })
            }
            Command::Replace { id, files, left_out } => {
                Event::Answer { id, answer: replace(held.as_ref(), &files, left_out) }
            }
            Command::Program { id, program } => Event::Answer { id, answer: write_program(held.as_ref(), *program) },
        };
        if !events.send(event) {
            break;
        }
    }
}

/// Keeps the cell for the next session. Without the file it has to be typed again, which is no reason to stop.
fn keep_cell(root: &Path, lines: &[Line]) {
    for line in lines {
        if let Entry::Cell(cell) = &line.entry
            && let Ok(text) = ron::ser::to_string_pretty(cell, ron::ser::PrettyConfig::default())
        {
            drop(store::replace(&root.join(CELL), &(text + "\n")));
        }
    }
}

fn replace(held: Option<&SessionFolder>, files: &[(String, String)], left_out: Vec<String>) -> Answer {
    let Some(folder) = held else {
        return Answer::Failed(Problem::unwritten("the session has no folder"));
    };
    match folder.replace(files) {
        Ok(()) => Answer::Delivered {
            files: files.iter().map(|(name, _)| name.clone()).collect(),
            sums: files.iter().map(|(_, text)| checksum::sum(text)).collect(),
            left_out,
        },
        Err(error) => Answer::Failed(Problem::unwritten(causes(&error))),
    }
}

/// Writes a corrected program, unless that would replace the program itself.
fn write_program(held: Option<&SessionFolder>, program: ProgramFile) -> Answer {
    let Some(folder) = held else {
        return Answer::Failed(Problem::unwritten("the session has no folder"));
    };
    let ProgramFile { summary, bytes } = program;
    let path = folder.path().join(&summary.file);
    let source = Path::new(&summary.source).canonicalize();
    if source.is_ok_and(|source| path.canonicalize().is_ok_and(|path| path == source)) {
        let problem = Problem::new(format!("'{}' is corrected already", summary.source));
        return Answer::Failed(
            problem.hint("give the program as it was: corrected targets must not be corrected a second time"),
        );
    }
    let written = store::create_folder(&folder.path().join(FOLDER)).and_then(|()| store::replace_bytes(&path, &bytes));
    match written {
        Ok(()) => Answer::CorrectedWritten(Box::new(summary)),
        Err(error) => Answer::Failed(Problem::unwritten(causes(&error))),
    }
}
