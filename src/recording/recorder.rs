//! The thread that records while a session is worked on. Nobody waits for it, and nothing depends on it.

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::Duration;

use rerun::RecordingStream;

use super::RecordingError;
use super::blueprint::Purpose;
use super::scribe::Scribe;
use super::segments::{self, Identity};
use crate::session::journal::Line;

/// Batches of lines that wait. A technician makes a few a minute; a disk that is this far behind has failed.
const WAITING: usize = 1024;
/// Longest time for a batch to reach the disk.
const FLUSH: Duration = Duration::from_secs(5);
/// Longest time to wait at the end for the parts to become one file.
const FINISH: Duration = Duration::from_secs(30);

/// What the recorder has to say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecordingEvent {
    /// The recording has stopped; the journal has everything.
    Failed(String),
    /// The live view has stopped; the recording goes on.
    LiveFailed(String),
}

/// A port on this machine on which viewers may look at the recording while it grows.
#[derive(Clone, Copy, Debug)]
pub struct Live {
    port: u16,
}

impl Live {
    /// Makes sure that the port can be had.
    ///
    /// # Errors
    /// It is taken, or this program was built without the live view.
    pub fn on(port: u16) -> Result<Self, RecordingError> {
        if cfg!(not(feature = "live")) {
            let message = "this program was built without the live view".to_owned();
            return Err(RecordingError::Port { port, message });
        }
        // The library says nothing about a port that is taken.
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .map_err(|error| RecordingError::Port { port, message: error.to_string() })?;
        let port = listener.local_addr().map_or(port, |address| address.port());
        Ok(Self { port })
    }

    /// What a viewer connects to.
    pub fn url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }

    /// A stream to whoever connects, early or late. The server's own limit of 1 GiB is a hundred times a long session.
    #[cfg(feature = "live")]
    fn stream(&self, identity: &Identity) -> Result<RecordingStream, RecordingError> {
        identity
            .builder()
            .serve_grpc_opts("127.0.0.1", self.port, rerun::external::re_grpc_server::ServerOptions::default())
            .map_err(|error| RecordingError::library("beginning the live view", error))
    }

    #[cfg(not(feature = "live"))]
    fn stream(&self, _identity: &Identity) -> Result<RecordingStream, RecordingError> {
        let message = "this program was built without the live view".to_owned();
        Err(RecordingError::Port { port: self.port, message })
    }
}

/// Records a session.
#[derive(Debug)]
pub struct Recorder {
    lines: Option<SyncSender<Vec<Line>>>,
    finished: Receiver<()>,
    /// Lines were dropped: the recording has a gap.
    has_lost: bool,
}

impl Recorder {
    /// Records into `folder` a session that has the lines `before` so far. `tell` hears of failures, on the recorder's thread.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(
        folder: &Path,
        before: Vec<Line>,
        live: Option<Live>,
        tell: impl Fn(RecordingEvent) + Send + 'static,
    ) -> io::Result<Self> {
        let (lines, received) = sync_channel::<Vec<Line>>(WAITING);
        let (done, finished) = sync_channel(1);
        let folder = folder.to_owned();
        thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            let mut work = Work { folder, live, tell, file: None, view: None, has_failed: false };
            if !before.is_empty() {
                work.begin(&before);
            }
            while let Ok(mut lines) = received.recv() {
                // What has piled up is written at once.
                lines.extend(received.try_iter().flatten());
                work.take(&lines);
            }
            work.end();
            // Nobody may be waiting any more.
            let _nobody = done.send(());
        })?;
        Ok(Self { lines: Some(lines), finished, has_lost: false })
    }

    /// Takes lines that are on disk. Never waits; `false` once the recording has a gap.
    pub fn take(&mut self, lines: &[Line]) -> bool {
        if let (Some(sender), false) = (&self.lines, self.has_lost) {
            self.has_lost = matches!(sender.try_send(lines.to_vec()), Err(TrySendError::Full(_)));
        }
        !self.has_lost
    }

    /// Makes one file of the parts. Waits for it, but not for ever; `false` if it was not done in time.
    pub fn finish(&mut self) -> bool {
        if self.lines.take().is_none() {
            return true;
        }
        !matches!(self.finished.recv_timeout(FINISH), Err(RecvTimeoutError::Timeout))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.finish();
    }
}

struct Work<T: Fn(RecordingEvent)> {
    folder: PathBuf,
    live: Option<Live>,
    tell: T,
    file: Option<Scribe>,
    view: Option<Scribe>,
    has_failed: bool,
}

impl<T: Fn(RecordingEvent)> Work<T> {
    /// Begins a part, and draws what earlier parts lack.
    fn begin(&mut self, before: &[Line]) {
        let Some(first) = before.first() else { return };
        let identity = Identity::of(first);
        if let Some(live) = self.live.take() {
            match live.stream(&identity) {
                Ok(stream) => {
                    let mut scribe = Scribe::new(stream, Purpose::Session, &[]);
                    before.iter().for_each(|line| scribe.take(line));
                    self.view = Some(scribe);
                }
                Err(error) => (self.tell)(RecordingEvent::LiveFailed(text(&error))),
            }
        }
        match self.part(&identity, before) {
            Ok(scribe) => self.file = Some(scribe),
            Err(error) => self.fail(text(&error)),
        }
        self.flush();
    }

    /// A part that goes on where the files of the folder end.
    fn part(&self, identity: &Identity, before: &[Line]) -> Result<Scribe, RecordingError> {
        let recorded = segments::recorded_lines(&self.folder).filter(|count| *count <= before.len());
        if recorded.is_none() {
            segments::remove(&self.folder)?;
        }
        let (drawn, missing) = before.split_at(recorded.unwrap_or(0));
        let stream = identity.file(&segments::next_part(&self.folder))?;
        let mut scribe = Scribe::new(stream, Purpose::Session, drawn);
        missing.iter().for_each(|line| scribe.take(line));
        Ok(scribe)
    }

    fn take(&mut self, lines: &[Line]) {
        if self.file.is_none() && self.view.is_none() {
            // The first lines of a session, or all has failed.
            if !self.has_failed {
                self.begin(lines);
            }
            return;
        }
        for scribe in self.file.iter_mut().chain(&mut self.view) {
            lines.iter().for_each(|line| scribe.take(line));
        }
        self.flush();
    }

    /// Forces the file to disk.
    fn flush(&mut self) {
        let flushed = self.file.as_ref().map(|scribe| scribe.stream().flush_with_timeout(FLUSH));
        if let Some(Err(error)) = flushed {
            self.fail(error.to_string());
        }
    }

    fn fail(&mut self, message: String) {
        self.has_failed = true;
        self.file = None;
        (self.tell)(RecordingEvent::Failed(message));
    }

    /// Ends the part and makes one file of all.
    fn end(&mut self) {
        if let Some(view) = self.view.take() {
            // It may wait for a viewer that does not answer.
            drop(thread::Builder::new().name("live-end".to_owned()).spawn(move || drop(view)));
        }
        if self.file.take().is_some()
            && let Err(error) = segments::merge(&self.folder)
        {
            self.fail(text(&error));
        }
    }
}

/// An error with its cause.
fn text(error: &RecordingError) -> String {
    let cause = std::error::Error::source(error).map(|cause| format!(": {cause}")).unwrap_or_default();
    format!("{error}{cause}")
}
