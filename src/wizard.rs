//! The guided calibration as a pure state machine.
//!
//! ```text
//!            Event ──► Wizard::update ──► Effects        intents(): what can be done now
//!                          │                             view():    what is shown
//!              Session = fold of the journal
//! ```
//!
//! Steps: Profile → Instrument → Target → Plan → Capture → Identify → Verify → Deliver. Every step is a small machine of its own
//! (`step`) that owns only what is not in the session. It answers with actions; only this module gives them ids, orders them
//! and turns them into [`Effect`]s.
//!
//! - **Journal first**: a change is an entry; it is applied to the [`Session`] when the store says that it is on disk, and only
//!   then does anything that depends on it happen or show. What the operator does meanwhile waits in a short queue.
//! - **One request at a time**: planning, measuring, identifying. Its answer carries its id; an answer to anything else is
//!   dropped. It can always be cancelled.
//! - The session is all that survives: [`Wizard::resume`] with the fold of the journal continues where the journal ends.
//!
//! No clock, thread, file, key or terminal here, and no randomness: the same events give the same states and effects.

#![warn(clippy::wildcard_enum_match_arm)]

pub mod advice;
mod effect;
pub mod intent;
mod live;
pub mod notice;
pub mod reading;
mod step;
pub mod view;

use std::collections::VecDeque;

use jiff::Timestamp;

pub use effect::{Answer, CircleConfigurations, Effect, Event, Progress, Request, RequestId, StoreEvent};
pub use intent::{Danger, Intent, IntentInfo, PlanSettings};
pub use notice::{Notice, Problem, Severity};
pub use view::ViewModel;

use crate::session::journal::{Entry, Line, SCHEMA};
use crate::session::reading::LiveReading;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::state::Session;
use live::Live;
use step::{Action, Connection, Cx, Phase};

/// Intents that wait while the journal is being written; more than a person can type in that time.
const MOST_WAITING: usize = 64;

/// Name and version of the program, for the journal.
pub fn program() -> String {
    format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))
}

/// The guided calibration.
#[derive(Clone, Debug)]
pub struct Wizard {
    session: Session,
    phase: Phase,
    connection: Option<Connection>,
    /// Where the session is on disk; none before it has a folder.
    folder: Option<String>,
    now: Timestamp,
    last_id: u64,
    busy: Option<Busy>,
    writing: Option<Writing>,
    actions: VecDeque<Action>,
    waiting: VecDeque<Intent>,
    notice: Option<Notice>,
    live: Live,
    ended: Option<String>,
}

/// The request that is under way.
#[derive(Clone, Debug)]
struct Busy {
    id: RequestId,
    what: &'static str,
    progress: Option<Progress>,
    cancelled: bool,
}

/// What the store is asked for.
#[derive(Clone, Debug)]
struct Writing {
    id: RequestId,
    what: Write,
    /// What the store said when it failed; it waits for [`Intent::Retry`].
    failed: Option<String>,
}

#[derive(Clone, Debug)]
enum Write {
    Folder { name: String, entries: Vec<Entry> },
    Lines(Vec<Line>),
}

impl Wizard {
    /// A new calibration at the time `now`.
    pub fn new(now: Timestamp) -> Self {
        let session = Session::default();
        Self {
            phase: Phase::enter(Step::Profile, &session),
            session,
            connection: None,
            folder: None,
            now,
            last_id: 0,
            busy: None,
            writing: None,
            actions: VecDeque::new(),
            waiting: VecDeque::new(),
            notice: None,
            live: Live::default(),
            ended: None,
        }
    }

    /// Goes on with a session that `folder` holds, and with which `torn_bytes` were lost at the end of its journal.
    pub fn resume(session: Session, folder: String, torn_bytes: usize, now: Timestamp) -> (Self, Vec<Effect>) {
        let mut wizard = Self::new(now);
        wizard.phase = Phase::enter(session.step, &session);
        wizard.folder = Some(folder);
        wizard.session = session;
        let mut notice = Notice::info(format!(
            "session '{}' goes on: {}",
            wizard.session.name,
            counted(wizard.session.counted().count(), "sample", "samples")
        ));
        if torn_bytes > 0 {
            notice = notice.hint(format!(
                "the end of the journal was incomplete or damaged ({torn_bytes} bytes): it was set aside as 'journal.torn-…'. An entry that was not completely on disk was never shown as saved"
            ));
        }
        wizard.actions.push_back(Action::Write(vec![Entry::Resumed { program: program(), torn_bytes }]));
        wizard.actions.push_back(Action::Say(notice));
        if let (Some(instrument), Some(robot)) = (&wizard.session.instrument, &wizard.session.robot) {
            let profile = Box::new(robot.profile.clone());
            wizard.actions.push_back(Action::Ask(Request::Connect { instrument: instrument.clone(), profile }));
        }
        let effects = wizard.run();
        (wizard, effects)
    }

    /// The session as it is on disk.
    pub const fn session(&self) -> &Session {
        &self.session
    }

    /// Where the session is on disk.
    pub fn folder(&self) -> Option<&str> {
        self.folder.as_deref()
    }

    /// Whether nothing is under way: every further change needs an intent, a tick or a shutdown.
    pub const fn is_idle(&self) -> bool {
        self.busy.is_none() && self.writing.is_none()
    }

    /// Whether the program is to end, and why.
    pub fn ended(&self) -> Option<&str> {
        self.ended.as_deref()
    }

    /// What the operator is to be told.
    pub const fn notice(&self) -> Option<&Notice> {
        self.notice.as_ref()
    }

    /// Takes note of an event.
    pub fn update(&mut self, event: Event) -> Vec<Effect> {
        match event {
            // Clocks are set; time that runs backwards is taken as it is, nothing here depends on its order.
            Event::Tick(now) => {
                self.now = now;
                Vec::new()
            }
            Event::Intent(intent) => self.on_intent(intent),
            Event::Store(event) => self.on_store(event),
            Event::Answer { id, answer } => self.on_answer(id, answer),
            Event::Progress { id, progress } => {
                if let Some(busy) = self.busy.as_mut().filter(|busy| busy.id == id) {
                    busy.progress = Some(progress);
                }
                Vec::new()
            }
            Event::Live(reading) => self.on_live(reading),
            Event::Remark(notice) => {
                self.notice = Some(notice);
                Vec::new()
            }
            Event::Shutdown { cause } => self.shut_down(cause),
        }
    }

    /// A look through the instrument. It may be time to measure.
    fn on_live(&mut self, reading: LiveReading) -> Vec<Effect> {
        let last_sample = self.session.samples.last().map(|sample| self.session.point_of(sample));
        self.live.take(reading, last_sample);
        let is_wanted =
            matches!(&self.session.instrument, Some(InstrumentChoice::Linked(choice)) if choice.is_automatic);
        let Some(row) = self.phase.shown_row().filter(|_| is_wanted && self.is_idle() && self.ended.is_none()) else {
            return Vec::new();
        };
        let can_measure =
            self.phase.intents(&self.cx()).iter().any(|info| info.intent == Intent::Measure && info.is_enabled());
        if !can_measure || !self.live.is_time(&self.session, row) {
            return Vec::new();
        }
        self.on_intent(Intent::Measure)
    }

    /// What can be done now, with what cannot and why.
    pub fn intents(&self) -> Vec<IntentInfo> {
        if self.ended.is_some() {
            return Vec::new();
        }
        let quit = IntentInfo::new(Intent::Quit, "quit").with_danger(Danger::Leaves);
        if self.is_stuck() {
            return vec![IntentInfo::new(Intent::Retry, "write again").default_action(), quit];
        }
        let mut intents = Vec::new();
        let busy = self.busy.as_ref().map(|busy| format!("{} is under way", busy.what));
        if let Some(busy) = &self.busy {
            let blocked = busy.cancelled.then(|| "it is being cancelled".to_owned());
            intents.push(IntentInfo::new(Intent::Cancel, format!("cancel {}", busy.what)).unless(blocked));
        }
        for mut info in self.phase.intents(&self.cx()) {
            if let Some(busy) = &busy
                && !matches!(info.intent, Intent::Note(_))
            {
                info.blocked.get_or_insert_with(|| busy.clone());
                info.is_default = false;
            }
            intents.push(info);
        }
        if self.notice.is_some() {
            intents.push(IntentInfo::new(Intent::Dismiss, "dismiss the message"));
        }
        intents.push(quit);
        intents
    }

    /// What there is to see.
    pub fn view(&self) -> ViewModel {
        view::build(self)
    }

    fn cx(&self) -> Cx<'_> {
        Cx { session: &self.session, connection: self.connection.as_ref(), down: self.live.down(), now: self.now }
    }

    /// Whether the store has failed and the operator must decide.
    fn is_stuck(&self) -> bool {
        self.writing.as_ref().is_some_and(|writing| writing.failed.is_some())
    }

    fn on_intent(&mut self, intent: Intent) -> Vec<Effect> {
        if self.ended.is_some() {
            return Vec::new();
        }
        if self.is_stuck() {
            return if intent == Intent::Retry {
                self.write_again()
            } else if intent == Intent::Quit {
                self.end("quit; the last change could not be saved".to_owned())
            } else {
                Vec::new()
            };
        }
        if self.writing.is_some() {
            if self.waiting.len() < MOST_WAITING {
                self.waiting.push_back(intent);
            }
            return Vec::new();
        }
        if intent == Intent::Quit {
            return self.shut_down("quit".to_owned());
        }
        if intent == Intent::Cancel {
            return self.cancel();
        }
        if intent == Intent::Dismiss {
            self.notice = None;
            return Vec::new();
        }
        // The offers are the one place that decides what can be done.
        let blocked = match self.intents().into_iter().find(|info| info.intent.name() == intent.name()) {
            None => Some(format!("'{}' has no meaning in the step {}", intent.name(), self.phase.step())),
            Some(info) => info.blocked,
        };
        if let Some(reason) = blocked {
            self.notice = Some(Notice::info(format!("not now: {reason}")));
            return Vec::new();
        }
        self.notice = None;
        if matches!(intent, Intent::Measure | Intent::MeasureAgain | Intent::Undo) {
            self.live.stays();
        }
        let cx =
            Cx { session: &self.session, connection: self.connection.as_ref(), down: self.live.down(), now: self.now };
        let actions = self.phase.on_intent(intent, &cx);
        self.actions.extend(actions);
        self.run()
    }

    fn cancel(&mut self) -> Vec<Effect> {
        match &mut self.busy {
            Some(busy) if !busy.cancelled => {
                busy.cancelled = true;
                vec![Effect::Cancel(busy.id)]
            }
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, id: RequestId, answer: Answer) -> Vec<Effect> {
        if self.busy.as_ref().is_none_or(|busy| busy.id != id) || self.ended.is_some() {
            return Vec::new();
        }
        self.busy = None;
        if let Answer::Connected { identity, warnings, recorded } = &answer {
            if !warnings.is_empty() {
                // One message: of several only the last would be seen.
                let notice =
                    Notice::attention(format!("the instrument is not as it should be: {}", warnings.join("; ")))
                        .hint("it measures; mend this before the first point, or go on if it is meant so");
                self.actions.push_back(Action::Say(notice));
            }
            self.connection = Some(Connection { identity: identity.clone(), recorded: recorded.clone() });
            let is_linked = matches!(self.session.instrument, Some(InstrumentChoice::Linked(_)));
            if is_linked && self.session.identities.last() != Some(identity) {
                self.actions.push_back(Action::Write(vec![Entry::Connected { identity: identity.clone() }]));
            }
        }
        let cx =
            Cx { session: &self.session, connection: self.connection.as_ref(), down: self.live.down(), now: self.now };
        let actions = self.phase.on_answer(answer, &cx);
        self.actions.extend(actions);
        self.run()
    }

    fn on_store(&mut self, event: StoreEvent) -> Vec<Effect> {
        let id = match &event {
            StoreEvent::Created { id, .. } | StoreEvent::Written { id } | StoreEvent::Failed { id, .. } => *id,
        };
        // What has failed waits for the operator: a late word about it changes nothing.
        let is_awaited = |writing: &mut Writing| writing.id == id && writing.failed.is_none();
        let Some(mut writing) = self.writing.take_if(is_awaited) else { return Vec::new() };
        match (event, writing.what) {
            (StoreEvent::Failed { message, .. }, what) => {
                if self.ended.is_some() {
                    self.drop_everything();
                    return vec![Effect::Exit];
                }
                self.waiting.clear();
                let on_disk = counted(self.session.samples.len(), "sample is", "samples are");
                self.notice = Some(
                    Notice::stop(format!("not saved: {message}"))
                        .hint(format!("{on_disk} safely on disk; nothing of that is lost"))
                        .hint("make room or mend the disk, then write again; or quit, and resume the session later"),
                );
                writing.failed = Some(message);
                self.writing = Some(Writing { what, ..writing });
                Vec::new()
            }
            (StoreEvent::Created { folder, name, .. }, Write::Folder { mut entries, .. }) => {
                self.folder = Some(folder);
                entries.insert(0, Entry::Opened { schema: SCHEMA, program: program(), name });
                self.actions.push_front(Action::Write(entries));
                self.run()
            }
            (StoreEvent::Written { .. }, Write::Lines(lines)) => {
                for line in lines {
                    self.apply(&line);
                }
                let mut effects = self.run();
                while self.writing.is_none() && self.ended.is_none() {
                    let Some(intent) = self.waiting.pop_front() else { break };
                    effects.extend(self.on_intent(intent));
                }
                effects
            }
            // An answer of the wrong kind answers nothing.
            (StoreEvent::Created { .. } | StoreEvent::Written { .. }, what) => {
                self.writing = Some(Writing { what, ..writing });
                Vec::new()
            }
        }
    }

    /// Takes a line that is on disk into the session.
    fn apply(&mut self, line: &Line) {
        if let Err(error) = self.session.apply(line) {
            // The wizard writes only what fits; if it ever does not, the operator must know.
            self.notice = Some(Notice::stop(format!("the journal does not fit together: {error}")));
            return;
        }
        if let Entry::Step(step) = line.entry {
            self.phase = Phase::enter(step, &self.session);
        } else {
            let cx = Cx {
                session: &self.session,
                connection: self.connection.as_ref(),
                down: self.live.down(),
                now: self.now,
            };
            let actions = self.phase.on_applied(&line.entry, &cx);
            if self.ended.is_none() {
                self.actions.extend(actions);
            }
        }
    }

    fn write_again(&mut self) -> Vec<Effect> {
        let Some(writing) = self.writing.take() else { return Vec::new() };
        self.notice = None;
        match writing.what {
            Write::Folder { name, entries } => self.actions.push_front(Action::Create { name, entries }),
            Write::Lines(lines) => {
                self.actions.push_front(Action::Write(lines.into_iter().map(|line| line.entry).collect()));
            }
        }
        self.run()
    }

    /// Does what is to be done, until something has to be waited for.
    fn run(&mut self) -> Vec<Effect> {
        let mut effects = Vec::new();
        while self.writing.is_none()
            && let Some(action) = self.actions.pop_front()
        {
            match action {
                Action::Create { name, entries } => {
                    let id = self.next_id();
                    effects.push(Effect::Create { id, name: name.clone() });
                    self.writing = Some(Writing { id, what: Write::Folder { name, entries }, failed: None });
                }
                Action::Write(entries) => {
                    let first = self.session.lines + 1;
                    let lines: Vec<Line> = entries
                        .into_iter()
                        .zip(first..)
                        .map(|(entry, number)| Line { number, time: self.now, entry })
                        .collect();
                    if let Some(misfit) = self.misfit(&lines) {
                        self.notice = Some(misfit);
                        continue;
                    }
                    let id = self.next_id();
                    effects.push(Effect::Append { id, lines: lines.clone() });
                    self.writing = Some(Writing { id, what: Write::Lines(lines), failed: None });
                }
                Action::Ask(request) => {
                    let id = self.next_id();
                    self.busy = Some(Busy { id, what: request.what(), progress: None, cancelled: false });
                    effects.push(Effect::Start { id, request });
                }
                Action::Disconnect => {
                    self.connection = None;
                    self.live.clear();
                }
                Action::Say(notice) => self.notice = Some(notice),
                Action::Exit => {
                    effects.push(Effect::Exit);
                    self.actions.clear();
                }
            }
        }
        effects
    }

    /// What to say about lines that do not fit the session: they are never written, a journal with them could not be read.
    fn misfit(&self, lines: &[Line]) -> Option<Notice> {
        let mut session = self.session.clone();
        let error = lines.iter().find_map(|line| session.apply(line).err())?;
        Some(
            Notice::stop(format!("not done: {error}"))
                .hint("nothing was written, the session is intact; please report this with its journal"),
        )
    }

    fn next_id(&mut self) -> RequestId {
        self.last_id += 1;
        RequestId(self.last_id)
    }

    /// Ends in good order: what is under way is cancelled, the journal is closed.
    fn shut_down(&mut self, cause: String) -> Vec<Effect> {
        if self.ended.is_some() {
            // Told a second time, nothing is waited for any more: nor is anything done with what is still answered.
            self.drop_everything();
            return vec![Effect::Exit];
        }
        // What is on its way to the disk is waited for: an opened session is closed in good order.
        let has_session = self.session.opened.is_some() || self.writing.is_some();
        if !has_session || self.is_stuck() {
            return self.end(cause);
        }
        let mut effects = self.cancel();
        self.busy = None;
        self.waiting.clear();
        // A reading that waits for a note to be on disk is not lost.
        self.actions.retain(|action| matches!(action, Action::Write(_)));
        self.actions.push_back(Action::Write(vec![Entry::Closed { reason: cause.clone() }]));
        self.actions.push_back(Action::Exit);
        effects.extend(self.run());
        self.ended = Some(cause);
        effects
    }

    fn end(&mut self, cause: String) -> Vec<Effect> {
        let mut effects = self.cancel();
        self.ended = Some(cause);
        self.drop_everything();
        effects.push(Effect::Exit);
        effects
    }

    /// Nothing is under way any more, and whatever is still answered means nothing.
    fn drop_everything(&mut self) {
        self.busy = None;
        self.writing = None;
        self.waiting.clear();
        self.actions.clear();
    }
}

/// `1 sample`, `2 samples`.
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests;
