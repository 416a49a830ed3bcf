//! The engine that both drivers, script and terminal, run: the wizard with its threads.

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
use super::recent;
use super::store_thread::{Command, StoreThread};
use crate::link::RawLog;
use crate::recording::{self, Live, Recorder, RecordingEvent};
use crate::session::advice::Advice;
use crate::session::journal::{Journal, Line, from_xyz_mm};
use crate::session::set_up::Step;
use crate::session::state::Session;
use crate::store::session::SessionFolder;
use crate::text::counted;
use crate::wizard::{
    Activity, Answer, Effect, Event, Intent, Notice, Request, RequestId, Severity, StoreEvent, Wizard,
};

/// Capacity of the channel of events. When it is full, a thread waits with its answer, and progress reports are dropped.
const EVENT_CAPACITY: usize = 256;

/// Settings of an engine.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder in which new sessions are created.
    pub sessions: PathBuf,
    pub clock: Clock,
    /// Record sessions for a 3D viewer.
    pub is_recorded: bool,
    /// Port on which viewers can watch the recording grow.
    pub live: Option<Live>,
    /// Log of every byte from and to instruments.
    pub raw_log: Option<RawLog>,
}

impl Options {
    /// Returns settings for sessions in this folder, without a recording.
    pub const fn unrecorded(sessions: PathBuf, clock: Clock) -> Self {
        Self { sessions, clock, is_recorded: false, live: None, raw_log: None }
    }
}

/// An output of the engine that a driver may show.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// Lines of the journal that are on disk now.
    Saved(Vec<Line>),
    /// A new message to the operator.
    Notice(Notice),
}

/// An intent that was carried out.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletedIntent {
    pub intent: Intent,
    /// The error message, if it failed.
    pub failure: Option<String>,
}

/// The recording for a 3D viewer.
#[derive(Debug)]
struct Recording {
    /// The session is to be recorded once it has a folder.
    is_wanted: bool,
    live: Option<Live>,
    recorder: Option<Recorder>,
}

/// Runs the wizard and its threads.
#[derive(Debug)]
pub struct Engine {
    wizard: Wizard,
    clock: Clock,
    sender: Events,
    events: Receiver<Message>,
    store: StoreThread,
    link: LinkThread,
    recording: Recording,
    /// Flags that cancel running requests.
    cancelled: BTreeMap<RequestId, Arc<AtomicBool>>,
    /// Lines that the store thread is writing.
    writing: BTreeMap<RequestId, Vec<Line>>,
    outputs: VecDeque<Output>,
    last_notice: Option<Notice>,
    completed: Vec<CompletedIntent>,
    /// The last intent, until its outcome is known.
    pending: Option<Intent>,
    has_exited: bool,
    /// Folder of the sessions whose links are on offer; `None`: none are.
    links_in: Option<PathBuf>,
}

impl Engine {
    /// Starts a new calibration.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn new(options: Options) -> io::Result<Self> {
        let wizard = Wizard::new(options.clock.now());
        Self::with(wizard, None, options)
    }

    /// Resumes a session.
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
        let (sender, events) = sync_channel(EVENT_CAPACITY);
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
            outputs: VecDeque::new(),
            last_notice: None,
            completed: Vec::new(),
            pending: None,
            has_exited: false,
            links_in: None,
        })
    }

    /// Looks for sessions in a folder that can be continued, and offers them on the first screen.
    pub fn offer_sessions(&mut self, root: PathBuf) {
        recent::look(root.clone(), self.sender.clone());
        self.links_in = Some(root);
    }

    /// Looks for serial ports and for the links of the sessions in a folder, now and whenever an instrument is chosen.
    pub fn offer_links(&mut self, root: PathBuf) {
        recent::look_for_links(root.clone(), self.sender.clone());
        self.links_in = Some(root);
    }

    pub const fn wizard(&self) -> &Wizard {
        &self.wizard
    }

    /// Returns a sender of events for other threads, such as those of keys and signals.
    pub fn sender(&self) -> Events {
        self.sender.clone()
    }

    /// Shows a message that does not concern the calibration itself.
    pub fn remark(&mut self, notice: Notice) {
        self.handle(Event::Remark(notice));
    }

    /// Returns whether the wizard has ended, so that the program may end.
    pub const fn has_exited(&self) -> bool {
        self.has_exited
    }

    /// Carries out an intent of the operator.
    pub fn intend(&mut self, intent: Intent) {
        self.note(&intent);
        self.handle(Event::Intent(intent));
    }

    /// Returns the intents that were carried out, in order; refused ones, cancellations and quit are not among them.
    pub fn completed_intents(&mut self) -> &[CompletedIntent] {
        self.complete_pending();
        &self.completed
    }

    /// Remembers an intent that will be carried out.
    fn note(&mut self, intent: &Intent) {
        let offers = self.wizard.intents();
        let is_possible = offers.iter().any(|offer| offer.intent.name() == intent.name() && offer.is_enabled());
        if is_possible && !matches!(intent, Intent::Cancel | Intent::Quit) {
            self.complete_pending();
            self.pending = Some(intent.clone());
            return;
        }
        match self.wizard.activity() {
            // The next notice is about this intent, which is refused or only stops something.
            Activity::Idle => self.complete_pending(),
            // It was not carried out, because its entry is not on disk and never will be.
            Activity::Stuck if *intent == Intent::Quit => self.pending = None,
            Activity::Working | Activity::Stuck => {}
        }
    }

    fn complete_pending(&mut self) {
        if let Some(intent) = self.pending.take() {
            let notice = self.wizard.notice().filter(|notice| notice.severity == Severity::Error);
            self.completed.push(CompletedIntent { intent, failure: notice.map(|notice| notice.what.clone()) });
        }
    }

    /// Closes the session because the program has to end, without the operator having asked for it.
    pub fn shut_down(&mut self, cause: &str) {
        self.handle(Event::Shutdown { cause: cause.to_owned() });
    }

    /// Waits for an event and handles it, or until it is woken. Returns `false` after `timeout` without either.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        match self.events.recv_timeout(timeout) {
            Ok(Message::Event(event)) => {
                self.handle(*event);
                true
            }
            Ok(Message::Wake) => true,
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => false,
        }
    }

    /// Finishes all writes and releases the session's folder.
    pub fn release(&mut self) {
        drop(self.end_recording());
        self.store.finish();
    }

    /// Leaves the recording as it is, so that the program ends without delay. Resuming the session makes it again.
    pub fn abandon_recording(&mut self) {
        self.recording.recorder = None;
    }

    /// Writes the final recording while the session's folder is still held. Returns a message to the operator if that fails.
    pub fn end_recording(&mut self) -> Option<String> {
        let mut recorder = self.recording.recorder.take()?;
        let cause = recorder.finish().err()?;
        Some(format!("the 3D recording is not complete: {cause}; {}", Advice::RebuildRecording))
    }

    /// Returns the outputs since the last call.
    pub fn outputs(&mut self) -> impl Iterator<Item = Output> + '_ {
        self.outputs.drain(..)
    }

    /// Starts to record into a session's folder, whose journal has the lines `before`.
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
        // The wizard never waits for the recorder, nor the recorder for the wizard.
        let report = move |event: RecordingEvent| events.offer(Event::Remark(remark(&event)));
        match Recorder::start(folder, before, self.recording.live.take(), report) {
            Ok(recorder) => self.recording.recorder = Some(recorder),
            Err(error) => self.sender.offer(Event::Remark(remark(&RecordingEvent::Failed(error.to_string())))),
        }
    }

    /// Passes lines that are on disk to the recorder.
    fn record_lines(&mut self, lines: &[Line]) {
        let Some(recorder) = &mut self.recording.recorder else { return };
        if let Err(cause) = recorder.add(lines) {
            self.recording.recorder = None;
            self.sender.offer(Event::Remark(remark(&RecordingEvent::Failed(cause.to_owned()))));
        }
    }

    /// Gives an event to the wizard and performs its effects.
    fn handle(&mut self, event: Event) {
        let mut saved = None;
        match &event {
            Event::Store(StoreEvent::Created { folder, .. }) => {
                let folder = PathBuf::from(folder);
                self.begin_recording(&folder, Vec::new());
            }
            Event::Store(StoreEvent::Written { id } | StoreEvent::Failed { id, .. }) => {
                let lines = self.writing.remove(id);
                if matches!(event, Event::Store(StoreEvent::Written { .. })) {
                    saved = lines;
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
        let (is_asked, before) = (matches!(event, Event::Intent(Intent::FindLinks)), self.wizard.session().step);
        effects.extend(self.wizard.update(event));
        let is_entered = before != Step::Instrument && self.wizard.session().step == Step::Instrument;
        if let Some(root) = self.links_in.as_ref().filter(|_| is_asked || is_entered) {
            recent::look_for_links(root.clone(), self.sender.clone());
        }
        if let Some(lines) = saved {
            self.record_lines(&lines);
            self.outputs.push_back(Output::Saved(lines));
        }
        let notice = self.wizard.notice();
        if notice != self.last_notice.as_ref() {
            self.last_notice = notice.cloned();
            self.outputs.extend(notice.cloned().map(Output::Notice));
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
            Request::Turn { at_mm } => self.link.turn(id, from_xyz_mm(at_mm), flag),
            Request::Deliver { files, left_out } => self.store.ask(Command::Replace { id, files, left_out }),
            Request::WriteCorrected(program) => self.store.ask(Command::Program { id, program }),
            request => jobs::start(id, request, flag, self.sender.clone()),
        };
        if !is_started {
            let problem = crate::wizard::Problem::new("the program cannot start a thread")
                .hint("the system may be out of memory or processes");
            self.sender.offer(Event::Answer { id, answer: Answer::Failed(problem) });
        }
    }
}

/// Returns the message to the operator about an event of the recording.
fn remark(event: &RecordingEvent) -> Notice {
    match event {
        RecordingEvent::Failed(cause) => Notice::attention(format!(
            "the 3D recording has stopped: {cause}; the session itself is complete and continues"
        ))
        .hint(Advice::RebuildRecording.to_string()),
        RecordingEvent::LiveFailed(cause) => {
            Notice::attention(format!("the live view has stopped: {cause}; recording and session continue"))
        }
    }
}

/// Tells all threads to stop.
impl Drop for Engine {
    fn drop(&mut self) {
        for flag in self.cancelled.values() {
            flag.store(true, Ordering::Relaxed);
        }
        // Make room in the channel for threads that still want to answer.
        while self.events.try_recv().is_ok() {}
        // Only then can the writing threads end and release the folder.
        self.release();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::set_up::InstrumentChoice;
    use crate::session::wire::LinkChoice;

    #[test]
    fn completed_intents_are_known_and_refused_ones_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut engine = Engine::new(Options::unrecorded(folder.path().to_owned(), Clock::System)).unwrap();
        // There is no robot to continue with; then a robot that does not exist, and one that does.
        engine.intend(Intent::Next);
        for profile in ["missing", "soochow"] {
            engine.intend(Intent::ChooseProfile(profile.to_owned()));
            while engine.wizard().activity() == Activity::Working {
                assert!(engine.wait(Duration::from_mins(1)));
            }
        }
        engine.intend(Intent::Quit);
        let completed: Vec<(&str, bool)> =
            engine.completed_intents().iter().map(|one| (one.intent.name(), one.failure.is_some())).collect();
        assert_eq!(completed, [("ChooseProfile", true), ("ChooseProfile", false)]);
    }

    #[test]
    fn connecting_can_be_cancelled_while_nobody_answers() {
        let folder = tempfile::tempdir().unwrap();
        let mut engine = Engine::new(Options::unrecorded(folder.path().to_owned(), Clock::System)).unwrap();
        let settle = |engine: &mut Engine| {
            while engine.wizard().activity() == Activity::Working {
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
