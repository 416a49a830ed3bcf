//! The thread that keeps the recording up to date while a session is measured. The session neither waits for it nor depends on it.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::live::{Live, LiveView};
use super::{RecordingError, file};
use crate::session::journal::Line;
use crate::store;
use crate::text::causes;

/// Shortest pause between two files.
const PAUSE: Duration = Duration::from_secs(3);
/// Shortest pause as a multiple of the time that the last file took: even a long session costs at most a tenth of a core.
const PAUSE_PER_FILE: u32 = 9;
/// Longest wait for the final file: a hundred times what a long session takes.
const FINISH: Duration = Duration::from_secs(20);
/// Free bytes of the disk that are left to the session: many times the files of a long one.
const RESERVE: u64 = 16 << 20;

/// A problem of the recording that the operator should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecordingEvent {
    /// The file could not be written.
    Failed(String),
    /// The live view has stopped.
    LiveFailed(String),
}

/// Records a session.
#[derive(Debug)]
pub struct Recorder {
    messages: Option<Sender<Message>>,
}

#[derive(Debug)]
enum Message {
    /// Lines that are on disk.
    Lines(Vec<Line>),
    /// Write the final file, answer with the outcome, and end.
    Finish(SyncSender<Result<(), RecordingError>>),
}

impl Recorder {
    /// Records into `folder` a session whose journal has the lines `before` so far. `report` is called on the recorder's thread.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(
        folder: &Path,
        before: Vec<Line>,
        live: Option<Live>,
        report: impl Fn(RecordingEvent) + Send + 'static,
    ) -> io::Result<Self> {
        let (messages, received) = mpsc::channel();
        let mut work = Work {
            folder: folder.to_owned(),
            report,
            lines: Vec::new(),
            recorded: 0,
            next_file: now(),
            has_failed: false,
            live,
            view: None,
        };
        thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            work.add(before);
            work.run(&received);
        })?;
        Ok(Self { messages: Some(messages) })
    }

    /// Adds lines that are on disk. Never waits.
    ///
    /// # Errors
    /// The recorder has stopped because of a defect.
    pub fn add(&mut self, lines: &[Line]) -> Result<(), &'static str> {
        let Some(messages) = &self.messages else { return Ok(()) };
        messages.send(Message::Lines(lines.to_vec())).map_err(|_gone| {
            self.messages = None;
            DEFECT
        })
    }

    /// Writes the final file and waits for it, but not forever. A recorder that is dropped instead leaves the file as it is.
    ///
    /// # Errors
    /// The file lacks the last lines.
    pub fn finish(&mut self) -> Result<(), String> {
        let Some(messages) = self.messages.take() else { return Ok(()) };
        let (answer, outcome) = sync_channel(1);
        // If the thread is gone, the channel of the answer is closed as well.
        drop(messages.send(Message::Finish(answer)));
        match outcome.recv_timeout(FINISH) {
            Ok(outcome) => outcome.map_err(|error| causes(&error)),
            Err(RecvTimeoutError::Timeout) => Err("the disk is too slow".to_owned()),
            Err(RecvTimeoutError::Disconnected) => Err(DEFECT.to_owned()),
        }
    }
}

/// The message after a panic of the thread.
const DEFECT: &str = "a defect of this program has stopped it";

/// The state of the thread.
struct Work<R> {
    folder: PathBuf,
    report: R,
    /// All lines of the journal.
    lines: Vec<Line>,
    /// Number of lines in the file.
    recorded: usize,
    /// Earliest time of the next file.
    next_file: Instant,
    /// Writing has failed. Then it is tried only once more, at the end.
    has_failed: bool,
    /// The requested live view, until the first line starts it.
    live: Option<Live>,
    view: Option<LiveView>,
}

impl<R: Fn(RecordingEvent)> Work<R> {
    fn run(mut self, received: &Receiver<Message>) {
        loop {
            let until_due = self.next_file.saturating_duration_since(now());
            let next = match self.is_behind() && !self.has_failed {
                true if until_due.is_zero() => {
                    self.update();
                    continue;
                }
                true => received.recv_timeout(until_due),
                false => received.recv().map_err(RecvTimeoutError::from),
            };
            match next {
                Ok(Message::Lines(lines)) => self.add(lines),
                Ok(Message::Finish(answer)) => {
                    // The receiver may have given up.
                    let _gone = answer.send(self.write()).is_err();
                    break;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        if let Some(view) = self.view {
            view.end();
        }
    }

    /// Returns whether the file lacks lines.
    const fn is_behind(&self) -> bool {
        self.recorded < self.lines.len()
    }

    fn add(&mut self, lines: Vec<Line>) {
        if let Some(first) = lines.first()
            && let Some(live) = self.live.take()
        {
            match LiveView::start(live, first) {
                Ok(view) => self.view = Some(view),
                Err(error) => (self.report)(RecordingEvent::LiveFailed(causes(&error))),
            }
        }
        if let Some(view) = &mut self.view {
            view.show(&lines);
        }
        self.lines.extend(lines);
    }

    /// Writes the file and sets the time of the next one. A failure is reported once.
    fn update(&mut self) {
        let begun = now();
        if let Err(error) = self.write() {
            self.has_failed = true;
            (self.report)(RecordingEvent::Failed(causes(&error)));
        }
        let end = now();
        self.next_file = end + PAUSE.max(PAUSE_PER_FILE * (end - begun));
    }

    /// Writes the file if it lacks lines.
    fn write(&mut self) -> Result<(), RecordingError> {
        if !self.is_behind() {
            return Ok(());
        }
        if store::free_bytes(&self.folder).is_some_and(|free| free < RESERVE) {
            return Err(RecordingError::NoRoom { reserve: RESERVE });
        }
        file::rebuild(&self.folder, &self.lines)?;
        self.recorded = self.lines.len();
        Ok(())
    }
}

#[expect(clippy::disallowed_methods, reason = "the time of writing does not enter a calibration")]
fn now() -> Instant {
    Instant::now()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::mpsc::channel;

    use super::super::rrd;
    use super::*;
    use crate::session::journal::{Entry, SCHEMA};

    fn opened() -> Vec<Line> {
        let entry = Entry::Opened { schema: SCHEMA, program: "test".to_owned(), name: "s".to_owned() };
        vec![Line { number: 1, time: jiff::Timestamp::UNIX_EPOCH, entry }]
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_that_is_gone_is_reported_once_and_nobody_waits() {
        let folder = tempfile::tempdir().unwrap();
        let gone = folder.path().join("gone");
        let (report, reported) = channel();
        let mut recorder = Recorder::start(&gone, Vec::new(), None, move |event| drop(report.send(event))).unwrap();
        recorder.add(&opened()).unwrap();
        let event = reported.recv_timeout(Duration::from_secs(5)).unwrap();
        assert!(matches!(&event, RecordingEvent::Failed(cause) if cause.contains("No such file")), "{event:?}");
        for _ in 0..100 {
            recorder.add(&opened()).unwrap();
        }
        let cause = recorder.finish().unwrap_err();
        assert!(cause.contains("No such file"), "{cause}");
        assert!(reported.recv_timeout(Duration::from_secs(1)).is_err(), "it is reported once");
    }

    #[test]
    fn a_recorder_that_has_died_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (died, dead) = channel();
        let report = move |_event| {
            died.send(()).unwrap();
            std::panic::resume_unwind(Box::new("a defect"));
        };
        let mut recorder = Recorder::start(&folder.path().join("gone"), opened(), None, report).unwrap();
        dead.recv_timeout(Duration::from_secs(5)).unwrap();
        let begun = now();
        while recorder.add(&opened()).is_ok() {
            assert!(begun.elapsed() < Duration::from_secs(5));
        }
        recorder.finish().unwrap();
    }

    #[test]
    fn what_cannot_be_written_leaves_no_temporary_file_and_is_tried_again_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(file::FILE_NAME);
        fs::create_dir(&path).unwrap();
        let (report, reported) = channel();
        let mut recorder =
            Recorder::start(folder.path(), opened(), None, move |event| drop(report.send(event))).unwrap();
        let event = reported.recv_timeout(Duration::from_secs(5)).unwrap();
        assert!(matches!(&event, RecordingEvent::Failed(cause) if cause.contains(file::FILE_NAME)), "{event:?}");
        assert_eq!(names(folder.path()), [file::FILE_NAME]);
        fs::remove_dir(&path).unwrap();
        recorder.finish().unwrap();
        assert!(path.is_file());
    }

    #[test]
    fn the_file_comes_at_once_then_after_a_pause_and_always_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(file::FILE_NAME);
        let both = [opened().remove(0), Line { number: 2, ..opened().remove(0) }];
        let recorded = || {
            let found = fs::read(&path).unwrap_or_default();
            [1, 2].into_iter().find(|count| rrd::encode(&both[..*count], None).unwrap() == found).unwrap_or(0)
        };
        let begin = || {
            let mut recorder = Recorder::start(folder.path(), opened(), None, |_event| ()).unwrap();
            let begun = now();
            while recorded() != 1 {
                assert!(begun.elapsed() < Duration::from_secs(5));
            }
            recorder.add(&both[1..]).unwrap();
            thread::sleep(Duration::from_millis(200));
            assert_eq!(recorded(), 1, "the pause is not over");
            recorder
        };
        begin().finish().unwrap();
        assert_eq!(recorded(), 2);
        // A recorder that is dropped leaves the file as it is.
        drop(begin());
        thread::sleep(Duration::from_millis(200));
        assert_eq!(recorded(), 1);
    }
}
