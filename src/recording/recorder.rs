//! The thread that records while a session is worked on. Nobody waits for it, and nothing depends on it.

use std::io;
use std::iter;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Weak};
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
/// Longest time for the recording to give its room back.
const GIVE_BACK: Duration = Duration::from_secs(2);
/// Longest time to wait at the end for the parts to become one file: a hundred times what a long session takes.
const FINISH: Duration = Duration::from_secs(20);

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

    /// The port.
    pub const fn port(&self) -> u16 {
        self.port
    }

    /// What a viewer connects to.
    pub fn url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }

    /// A stream to whoever connects, early or late. The server's own limit of 1 GiB is a hundred times a long session.
    #[cfg(feature = "live")]
    fn stream(self, identity: &Identity) -> Result<RecordingStream, RecordingError> {
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

/// What the thread is told.
#[derive(Debug)]
enum Message {
    /// Lines that are on disk.
    Lines(Vec<Line>),
    /// The disk is full and the session needs the room. The answer comes when it is given back.
    GiveRoom(SyncSender<()>),
}

/// Lets whoever writes the session have the room of its recording. The recorder ends without waiting for it.
#[derive(Clone, Debug)]
pub struct Room(Weak<SyncSender<Message>>);

impl Room {
    /// Ends the recording and gives its room back. Does not wait for long.
    pub fn give_back(&self) {
        let Some(recorder) = self.0.upgrade() else { return };
        let (answer, given) = sync_channel(1);
        if recorder.try_send(Message::GiveRoom(answer)).is_ok() {
            // What is not given back by then is missed by a write that fails once more, and says so.
            let _given_or_not = given.recv_timeout(GIVE_BACK).is_ok();
        }
    }
}

/// Records a session.
#[derive(Debug)]
pub struct Recorder {
    lines: Option<Arc<SyncSender<Message>>>,
    finished: Receiver<Result<(), String>>,
    is_hurried: Arc<AtomicBool>,
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
        let (lines, received) = sync_channel(WAITING);
        let (done, finished) = sync_channel(1);
        let folder = folder.to_owned();
        let is_hurried = Arc::new(AtomicBool::new(false));
        let hurried = Arc::clone(&is_hurried);
        thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            let mut work = Work { folder, live, tell, file: None, path: None, view: None, failure: None };
            if !before.is_empty() {
                work.begin(&before);
            }
            while let Ok(first) = received.recv() {
                // What has piled up is written at once.
                let mut lines = Vec::new();
                for message in iter::once(first).chain(received.try_iter()) {
                    match message {
                        Message::Lines(more) => lines.extend(more),
                        Message::GiveRoom(answer) => {
                            work.give_room();
                            // Nobody may be waiting any more.
                            let _nobody = answer.try_send(()).is_err();
                        }
                    }
                }
                work.take(&lines);
            }
            // Nobody may be waiting any more.
            let _nobody = done.send(work.end(&hurried));
        })?;
        Ok(Self { lines: Some(Arc::new(lines)), finished, is_hurried })
    }

    /// Takes lines that are on disk. Never waits.
    ///
    /// # Errors
    /// The recorder cannot take them, and nothing after them.
    pub fn take(&mut self, lines: &[Line]) -> Result<(), &'static str> {
        let Some(sender) = &self.lines else { return Ok(()) };
        let refused = match sender.try_send(Message::Lines(lines.to_vec())) {
            Ok(()) => return Ok(()),
            Err(TrySendError::Full(_)) => "the disk is too slow for it",
            Err(TrySendError::Disconnected(_)) => "an internal error ended it",
        };
        self.lines = None;
        Err(refused)
    }

    /// What gives its room back when the disk is full.
    pub fn room(&self) -> Option<Room> {
        self.lines.as_ref().map(|lines| Room(Arc::downgrade(lines)))
    }

    /// There is no time to make one file of the parts: they stay, and whoever goes on with the session joins them.
    pub fn hurry(&self) {
        self.is_hurried.store(true, Ordering::Relaxed);
    }

    /// Makes one file of the parts. Waits for it, but not for ever.
    ///
    /// # Errors
    /// It was not done; the parts are still there.
    pub fn finish(&mut self) -> Result<(), String> {
        if self.lines.take().is_none() {
            return Ok(());
        }
        match self.finished.recv_timeout(FINISH) {
            Ok(result) => result,
            Err(RecvTimeoutError::Timeout) => Err("the disk is too slow to make one file of it".to_owned()),
            Err(RecvTimeoutError::Disconnected) => Err("an internal error ended it".to_owned()),
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // Whoever wants to know has asked before.
        drop(self.finish());
    }
}

struct Work<T: Fn(RecordingEvent)> {
    folder: PathBuf,
    live: Option<Live>,
    tell: T,
    file: Option<Scribe>,
    /// Where it writes.
    path: Option<PathBuf>,
    view: Option<Scribe>,
    /// Why it has stopped.
    failure: Option<String>,
}

impl<T: Fn(RecordingEvent)> Work<T> {
    /// Begins a part, and draws what earlier parts lack.
    fn begin(&mut self, before: &[Line]) {
        let Some(first) = before.first() else { return };
        let identity = Identity::of(first);
        if let Some(live) = self.live.take() {
            match live.stream(&identity) {
                Ok(stream) => {
                    let mut scribe = Scribe::new(stream, Purpose::Capture, &[]);
                    for line in before {
                        scribe.take(line);
                    }
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

    /// A part that goes on where the files of the folder end. What a crash left is drawn anew, and removed once that is on disk.
    fn part(&mut self, identity: &Identity, before: &[Line]) -> Result<Scribe, RecordingError> {
        segments::clean(&self.folder);
        let earlier = segments::earlier(&self.folder, before);
        let (drawn, missing) = before.split_at(earlier.lines.min(before.len()));
        let path = segments::next_part(&self.folder);
        let stream = identity.file(self.path.insert(path))?;
        let mut scribe = Scribe::new(stream, Purpose::Capture, drawn);
        for line in missing {
            scribe.take(line);
        }
        if !earlier.void.is_empty() {
            scribe
                .stream()
                .flush_with_timeout(FLUSH)
                .map_err(|error| RecordingError::library("writing the recording", error))?;
            segments::remove(&earlier.void)?;
        }
        Ok(scribe)
    }

    fn take(&mut self, lines: &[Line]) {
        if lines.is_empty() {
            return;
        }
        if self.file.is_none() && self.view.is_none() {
            // The first lines of a session, or all has failed.
            if self.failure.is_none() {
                self.begin(lines);
            }
            return;
        }
        for scribe in self.file.iter_mut().chain(&mut self.view) {
            for line in lines {
                scribe.take(line);
            }
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
        self.failure = Some(message.clone());
        self.file = None;
        if let Some(path) = self.path.take() {
            // It has a gap, and the journal may need the room.
            drop(std::fs::remove_file(path));
        }
        (self.tell)(RecordingEvent::Failed(message));
    }

    /// Ends the recording, whose room the session needs.
    fn give_room(&mut self) {
        if self.failure.is_none() {
            self.fail("the disk is full, and the session needs its room".to_owned());
        }
        // Also those of earlier programs.
        segments::remove_parts(&self.folder);
    }

    /// Ends the part and makes one file of all.
    fn end(&mut self, is_hurried: &AtomicBool) -> Result<(), String> {
        if let Some(view) = self.view.take() {
            // It may wait for a viewer that does not answer.
            drop(thread::Builder::new().name("live-end".to_owned()).spawn(move || drop(view)));
        }
        match self.file.take() {
            // The next program goes on from its parts.
            None => self.failure.take().map_or(Ok(()), Err),
            Some(file) => {
                drop(file);
                if is_hurried.load(Ordering::Relaxed) {
                    return Ok(());
                }
                segments::merge(&self.folder).map(drop).map_err(|error| text(&error))
            }
        }
    }
}

/// An error with its cause.
fn text(error: &RecordingError) -> String {
    let cause = std::error::Error::source(error).map(|cause| format!(": {cause}")).unwrap_or_default();
    format!("{error}{cause}")
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "deadlines of tests")]

    use std::sync::mpsc::channel;

    use super::*;
    use crate::session::journal::{Entry, SCHEMA};

    fn opened() -> Vec<Line> {
        let entry = Entry::Opened { schema: SCHEMA, program: "test".to_owned(), name: "s".to_owned() };
        vec![Line { number: 1, time: jiff::Timestamp::UNIX_EPOCH, entry }]
    }

    #[test]
    fn a_folder_that_is_gone_is_told_within_a_second_and_nobody_waits() {
        let folder = tempfile::tempdir().unwrap();
        let gone = folder.path().join("gone");
        let (told, heard) = channel();
        let mut recorder = Recorder::start(&gone, Vec::new(), None, move |event| drop(told.send(event))).unwrap();
        recorder.take(&opened()).unwrap();
        let event = heard.recv_timeout(Duration::from_secs(1)).unwrap();
        assert!(matches!(&event, RecordingEvent::Failed(cause) if cause.contains("No such file")), "{event:?}");
        // What comes later is taken and dropped.
        for _ in 0..2 * WAITING {
            if recorder.take(&opened()).is_err() {
                break;
            }
        }
        // Why it has stopped, if the channel never was full.
        let ended = recorder.finish();
        assert!(ended.is_ok() || ended.as_ref().is_err_and(|cause| cause.contains("No such file")), "{ended:?}");
        assert!(heard.recv_timeout(Duration::from_secs(1)).is_err(), "it is told once");
    }

    #[test]
    fn a_recorder_that_has_died_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let tell = |_event| std::panic::resume_unwind(Box::new("a defect"));
        let mut recorder = Recorder::start(&folder.path().join("gone"), Vec::new(), None, tell).unwrap();
        recorder.take(&opened()).unwrap();
        let died = recorder.finished.recv_timeout(Duration::from_secs(5));
        assert_eq!(died, Err(RecvTimeoutError::Disconnected));
        assert_eq!(recorder.take(&opened()), Err("an internal error ended it"));
        recorder.finish().unwrap();
    }

    #[test]
    fn the_session_gets_the_room_of_its_recording() {
        let folder = tempfile::tempdir().unwrap();
        let (told, heard) = channel();
        let mut recorder =
            Recorder::start(folder.path(), Vec::new(), None, move |event| drop(told.send(event))).unwrap();
        recorder.take(&opened()).unwrap();
        let room = recorder.room().unwrap();
        room.give_back();
        assert!(segments::files(folder.path()).is_empty());
        let event = heard.recv_timeout(Duration::from_secs(1)).unwrap();
        assert!(matches!(&event, RecordingEvent::Failed(cause) if cause.contains("the disk is full")), "{event:?}");
        room.give_back();
        recorder.take(&opened()).unwrap();
        assert!(recorder.finish().unwrap_err().contains("the disk is full"));
        assert!(segments::files(folder.path()).is_empty());
        assert!(heard.recv_timeout(Duration::from_secs(1)).is_err(), "it is told once");
        // Nobody is there any more.
        room.give_back();
    }

    #[test]
    fn what_cannot_be_joined_stays_in_parts_and_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::start(folder.path(), Vec::new(), None, |_event| ()).unwrap();
        recorder.take(&opened()).unwrap();
        let begun = std::time::Instant::now();
        while segments::files(folder.path()).is_empty() {
            assert!(begun.elapsed() < Duration::from_secs(5));
            thread::yield_now();
        }
        // In the way of the one file.
        std::fs::create_dir(folder.path().join(segments::FILE_NAME)).unwrap();
        let cause = recorder.finish().unwrap_err();
        assert!(cause.contains(segments::FILE_NAME), "{cause}");
        assert!(segments::files(folder.path()).len() > 1);
    }
}
