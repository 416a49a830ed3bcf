//! The wizard with its threads: what both drivers, script and terminal, run.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use super::clock::Clock;
use super::events::{Events, Message};
use super::jobs;
use super::links::LinkThread;
use super::store_thread::{Command, StoreThread};
use crate::link::RawLog;
use crate::recording::{self, Live, Recorder, RecordingEvent};
use crate::session::journal::{Journal, Line};
use crate::session::state::Session;
use crate::store::session::SessionFolder;
use crate::text::counted;
use crate::wizard::{Answer, Effect, Event, Intent, Notice, Request, RequestId, Severity, StoreEvent, Wizard};

/// Events that wait; answers wait at their thread when it is full, progress reports are dropped.
const WAITING: usize = 256;

/// How an engine is set up.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder in which sessions are made.
    pub sessions: PathBuf,
    /// What time it is.
    pub clock: Clock,
    /// Whether sessions are recorded for a 3D viewer.
    pub is_recorded: bool,
    /// Where a viewer may look on.
    pub live: Option<Live>,
    /// What takes every byte of instruments on a wire.
    pub raw_log: Option<RawLog>,
}

impl Options {
    /// Sessions in this folder, without a recording.
    pub const fn unrecorded(sessions: PathBuf, clock: Clock) -> Self {
        Self { sessions, clock, is_recorded: false, live: None, raw_log: None }
    }
}

/// What a driver may want to show.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// Lines of the journal are on disk.
    Written(Vec<Line>),
    /// There is a message to the operator.
    Told(Notice),
}

/// An intent that was carried out.
#[derive(Clone, Debug, PartialEq)]
pub struct Deed {
    /// The intent.
    pub intent: Intent,
    /// What was said if it failed.
    pub failure: Option<String>,
}

/// The recording for a 3D viewer, if one is wanted.
#[derive(Debug)]
struct Recording {
    is_wanted: bool,
    live: Option<Live>,
    recorder: Option<Recorder>,
}

/// The wizard with its threads.
#[derive(Debug)]
pub struct Engine {
    wizard: Wizard,
    clock: Clock,
    sender: Events,
    events: Receiver<Message>,
    store: StoreThread,
    link: LinkThread,
    recording: Recording,
    /// Flags of the requests under way.
    cancelled: BTreeMap<RequestId, Arc<AtomicBool>>,
    /// Lines that the store works on.
    writing: BTreeMap<RequestId, Vec<Line>>,
    happenings: VecDeque<Happening>,
    told: Option<Notice>,
    deeds: Vec<Deed>,
    /// The last intent, until it is known whether it failed.
    pending: Option<Intent>,
    has_exited: bool,
}

impl Engine {
    /// A new calibration.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn new(options: Options) -> io::Result<Self> {
        let wizard = Wizard::new(options.clock.now());
        Self::with(wizard, None, options)
    }

    /// Goes on with a session.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn resume(folder: SessionFolder, session: Session, journal: Journal, options: Options) -> io::Result<Self> {
        if let (Clock::Virtual(_), Some(latest)) = (&options.clock, session.latest) {
            let seconds = latest.duration_since(options.clock.now()).as_secs_f64();
            options.clock.pass(seconds);
        }
        let path = folder.path().to_owned();
        let shown = path.display().to_string();
        let (wizard, effects) = Wizard::resume(session, shown, journal.torn_bytes, options.clock.now());
        let mut engine = Self::with(wizard, Some(folder), options)?;
        engine.begin_recording(&path, journal.lines);
        engine.perform(effects);
        Ok(engine)
    }

    fn with(wizard: Wizard, folder: Option<SessionFolder>, options: Options) -> io::Result<Self> {
        let (sender, events) = sync_channel(WAITING);
        let sender = Events(sender);
        Ok(Self {
            wizard,
            clock: options.clock,
            store: StoreThread::start(options.sessions, folder, sender.clone())?,
            link: LinkThread::start(sender.clone(), options.raw_log)?,
            recording: Recording { is_wanted: options.is_recorded, live: options.live, recorder: None },
            sender,
            events,
            cancelled: BTreeMap::new(),
            writing: BTreeMap::new(),
            happenings: VecDeque::new(),
            told: None,
            deeds: Vec::new(),
            pending: None,
            has_exited: false,
        })
    }

    /// The wizard.
    pub const fn wizard(&self) -> &Wizard {
        &self.wizard
    }

    /// Where other threads (keys, signals) send events.
    pub fn sender(&self) -> Events {
        self.sender.clone()
    }

    /// Whether the wizard has ended and the program may go.
    pub const fn has_exited(&self) -> bool {
        self.has_exited
    }

    /// The operator wants something.
    pub fn intend(&mut self, intent: Intent) {
        self.record(&intent);
        self.take(Event::Intent(intent));
    }

    /// What the operator had done, in order. Without what was refused, what only stopped something, and the end.
    pub fn deeds(&mut self) -> &[Deed] {
        self.settle_deed();
        &self.deeds
    }

    /// Takes note of an intent that will be carried out.
    fn record(&mut self, intent: &Intent) {
        let offers = self.wizard.intents();
        let is_possible = offers.iter().any(|offer| offer.intent.name() == intent.name() && offer.is_enabled());
        if is_possible && !matches!(intent, Intent::Cancel | Intent::Quit) {
            self.settle_deed();
            self.pending = Some(intent.clone());
        } else if self.wizard.is_idle() {
            // What is said next is about an intent that is no deed.
            self.settle_deed();
        }
    }

    fn settle_deed(&mut self) {
        if let Some(intent) = self.pending.take() {
            let notice = self.wizard.notice().filter(|notice| notice.severity == Severity::Error);
            self.deeds.push(Deed { intent, failure: notice.map(|notice| notice.what.clone()) });
        }
    }

    /// The program is to end, for a reason that is not the operator's wish.
    pub fn shut_down(&mut self, cause: &str) {
        self.take(Event::Shutdown { cause: cause.to_owned() });
    }

    /// Waits for an event and takes it, or to be woken; `false` after `timeout` without either.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        match self.events.recv_timeout(timeout) {
            Ok(Message::Event(event)) => {
                self.take(event);
                true
            }
            Ok(Message::Wake) => true,
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => false,
        }
    }

    /// Gives the session's folder back, with everything written that was asked for.
    pub fn release(&mut self) {
        drop(self.end_recording());
        self.store.finish();
    }

    /// Leaves the recording as it is, because there is little time to end. Resuming the session makes it again.
    pub fn abandon_recording(&mut self) {
        self.recording.recorder = None;
    }

    /// Writes the last recording while the session's folder is still held. Returns what the operator should know if that fails.
    pub fn end_recording(&mut self) -> Option<String> {
        let mut recorder = self.recording.recorder.take()?;
        let cause = recorder.finish().err()?;
        Some(format!("the 3D recording is not complete: {cause}; 'trupose record rebuild' makes it from the journal"))
    }

    /// What has happened since it was asked last.
    pub fn happenings(&mut self) -> impl Iterator<Item = Happening> + '_ {
        self.happenings.drain(..)
    }

    /// Begins to record into a session's folder, which has these lines already.
    fn begin_recording(&mut self, folder: &Path, before: Vec<Line>) {
        if !std::mem::take(&mut self.recording.is_wanted) {
            return;
        }
        let parts = recording::remove_old_parts(folder);
        if parts > 0 {
            let notice =
                format!("the 3D recording is made again: {} of an earlier version removed", counted(parts, "part"));
            self.sender.offer(Event::Remark(Notice::info(notice)));
        }
        let events = self.sender.clone();
        // Nobody waits for the recorder, and the recorder does not wait for the wizard.
        let tell = move |event: RecordingEvent| events.offer(Event::Remark(remark(&event)));
        match Recorder::start(folder, before, self.recording.live.take(), tell) {
            Ok(recorder) => {
                self.recording.recorder = Some(recorder);
            }
            Err(error) => self.sender.offer(Event::Remark(remark(&RecordingEvent::Failed(error.to_string())))),
        }
    }

    /// Lines that are on disk go on to the recording.
    fn record_lines(&mut self, lines: &[Line]) {
        let Some(recorder) = &mut self.recording.recorder else { return };
        if let Err(cause) = recorder.take(lines) {
            self.recording.recorder = None;
            self.sender.offer(Event::Remark(remark(&RecordingEvent::Failed(cause.to_owned()))));
        }
    }

    /// An event goes in, its effects are done.
    fn take(&mut self, event: Event) {
        let mut written = None;
        match &event {
            Event::Store(StoreEvent::Created { folder, .. }) => {
                let folder = PathBuf::from(folder);
                self.begin_recording(&folder, Vec::new());
            }
            Event::Store(StoreEvent::Written { id } | StoreEvent::Failed { id, .. }) => {
                let lines = self.writing.remove(id);
                if matches!(event, Event::Store(StoreEvent::Written { .. })) {
                    written = lines;
                }
            }
            Event::Answer { id, answer } => {
                self.cancelled.remove(id);
                if let Answer::Measured(reading) = answer {
                    self.clock.pass(reading.seconds);
                }
            }
            _ => {}
        }
        let mut effects = self.wizard.update(Event::Tick(self.clock.now()));
        effects.extend(self.wizard.update(event));
        if let Some(lines) = written {
            self.record_lines(&lines);
            self.happenings.push_back(Happening::Written(lines));
        }
        let notice = self.wizard.notice();
        if notice != self.told.as_ref() {
            self.told = notice.cloned();
            self.happenings.extend(notice.cloned().map(Happening::Told));
        }
        self.perform(effects);
    }

    fn perform(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Create { id, name } => {
                    self.store.ask(Command::Create { id, name });
                }
                Effect::Append { id, lines } => {
                    self.writing.insert(id, lines.clone());
                    self.store.ask(Command::Append { id, lines });
                }
                Effect::Start { id, request } => self.start(id, request),
                Effect::Cancel(id) => {
                    if let Some(flag) = self.cancelled.get(&id) {
                        flag.store(true, Ordering::Relaxed);
                    }
                }
                Effect::Exit => self.has_exited = true,
            }
        }
    }

    fn start(&mut self, id: RequestId, request: Request) {
        let flag = Arc::new(AtomicBool::new(false));
        self.cancelled.insert(id, Arc::clone(&flag));
        let is_started = match request {
            Request::Connect { instrument, profile } => self.link.connect(id, instrument, profile, flag),
            Request::Measure(request) => self.link.measure(id, request, flag),
            Request::Deliver { files, left_out } => self.store.ask(Command::Replace { id, files, left_out }),
            request => jobs::start(id, request, flag, self.sender.clone()),
        };
        if !is_started {
            let answer = Answer::Failed(crate::wizard::Problem {
                message: "the program cannot start a thread".to_owned(),
                hints: vec!["the system may be out of memory or processes".to_owned()],
            });
            self.sender.offer(Event::Answer { id, answer });
        }
    }
}

/// What the operator is told about the recording.
fn remark(event: &RecordingEvent) -> Notice {
    match event {
        RecordingEvent::Failed(cause) => Notice::attention(format!(
            "the 3D recording has stopped: {cause}; the session itself is complete and continues"
        ))
        .hint("'trupose record rebuild' makes the recording from the journal, at any time"),
        RecordingEvent::LiveFailed(cause) => {
            Notice::attention(format!("the live view has stopped: {cause}; recording and session continue"))
        }
    }
}

/// Whoever works for the engine is told to stop.
impl Drop for Engine {
    fn drop(&mut self) {
        for flag in self.cancelled.values() {
            flag.store(true, Ordering::Relaxed);
        }
        // Room for threads that still want to answer.
        while self.events.try_recv().is_ok() {}
        // The folder is given back when nobody writes into it any more.
        self.release();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::set_up::InstrumentChoice;
    use crate::session::wire::LinkChoice;

    #[test]
    fn what_was_done_is_known_and_what_was_refused_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut engine = Engine::new(Options::unrecorded(folder.path().to_owned(), Clock::System)).unwrap();
        // No robot to go on with; a robot that is not there; one that is.
        engine.intend(Intent::Next);
        for profile in ["missing", "soochow"] {
            engine.intend(Intent::ChooseProfile(profile.to_owned()));
            while !engine.wizard().is_idle() {
                assert!(engine.wait(Duration::from_mins(1)));
            }
        }
        engine.intend(Intent::Quit);
        let deeds: Vec<(&str, bool)> =
            engine.deeds().iter().map(|deed| (deed.intent.name(), deed.failure.is_some())).collect();
        assert_eq!(deeds, [("ChooseProfile", true), ("ChooseProfile", false)]);
    }

    #[test]
    fn connecting_can_be_cancelled_while_nobody_answers() {
        let folder = tempfile::tempdir().unwrap();
        let mut engine = Engine::new(Options::unrecorded(folder.path().to_owned(), Clock::System)).unwrap();
        let settle = |engine: &mut Engine| {
            while !engine.wizard().is_idle() {
                assert!(engine.wait(Duration::from_mins(1)));
            }
        };
        for intent in [Intent::ChooseProfile("soochow".to_owned()), Intent::Next] {
            engine.intend(intent);
            settle(&mut engine);
        }
        let address = "emscon:listen:127.0.0.1:0".to_owned();
        let choice = LinkChoice { address, ..LinkChoice::default() };
        engine.intend(Intent::ChooseInstrument(InstrumentChoice::Linked(choice)));
        let can_cancel = |engine: &Engine| engine.wizard().intents().iter().any(|offer| offer.intent == Intent::Cancel);
        while !can_cancel(&engine) {
            assert!(engine.wait(Duration::from_mins(1)));
        }
        engine.intend(Intent::Cancel);
        settle(&mut engine);
        let offers = engine.wizard().intents();
        assert!(offers.iter().any(|offer| offer.intent == Intent::Retry && offer.is_enabled()), "{offers:?}");
        assert_eq!(engine.wizard().notice().map(|notice| notice.what.as_str()), Some("cancelled"));
    }

    #[test]
    fn a_driver_can_be_woken_without_an_event() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options::unrecorded(folder.path().to_owned(), Clock::System);
        let mut engine = Engine::new(options).unwrap();
        let before = engine.wizard().view();
        assert!(!engine.wait(Duration::ZERO));
        assert!(engine.sender().wake());
        assert!(engine.wait(Duration::from_mins(1)));
        assert_eq!(engine.wizard().view(), before);
        let sender = engine.sender();
        drop(engine);
        assert!(!sender.wake());
    }
}
