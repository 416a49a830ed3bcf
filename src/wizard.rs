//! The guided calibration as a pure state machine.
//!
//! ```text
//!            Event ──► Wizard::update ──► Effects        intents(): what the operator can do now
//!                          │                             view():    what the screen shows
//!              Session = fold of the journal
//! ```
//!
//! Steps: Profile → Instrument → Target → Plan → Capture → Identify → Verify → Deliver. Every step is a small machine of its own
//! (`step`) that owns only what is not in the session. It returns actions; only this module assigns ids to them, orders them
//! and turns them into [`Effect`]s.
//!
//! - **Journal first**: a change is an entry. It is applied to the [`Session`] once the store reports it on disk, and only then
//!   does anything that depends on it happen or show. Intents that arrive meanwhile wait in a short queue.
//! - **One request at a time**: planning, measuring, identifying. Its answer carries its id; any other answer is dropped. A
//!   request can always be cancelled.
//! - The session is all that survives: [`Wizard::resume`] with the fold of the journal continues where the journal ends.
//!
//! No clock, thread, file, key or terminal here, and no randomness: the same events give the same states and effects.

#![warn(clippy::wildcard_enum_match_arm)]

pub mod advice;
mod cell;
mod done;
mod effect;
mod faces;
pub mod intent;
mod live;
pub mod notice;
mod place;
mod pointing;
mod program;
pub mod reading;
mod step;
pub mod view;

use std::collections::VecDeque;

use jiff::Timestamp;

pub use crate::procedure::correct::check as check_program;
pub use effect::{
    Answer, CircleConfigurations, Effect, Event, JointCheckStop, Request, RequestId, RequestProgress, StoreEvent,
};
pub use intent::{Danger, Intent, IntentInfo, PlanSettings};
pub use notice::{Notice, Problem, Severity};
pub use view::ViewModel;

use view::SessionCard;

use crate::session::journal::{Entry, Line, SCHEMA};
use crate::session::reading::LiveReading;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::state::Session;
use crate::session::wire::KnownLinks;
use crate::text::{counted, counted_as};
use live::Live;
use step::{Action, Connection, Cx, Phase};

/// Limit of the intent queue while the journal is being written; more than a person can type in that time.
const MOST_WAITING: usize = 64;

/// Name and version of the program, for the journal.
pub fn program() -> String {
    format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))
}

/// What a driver can wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Neither a request nor a write is running.
    Idle,
    /// A request or a write is running, and will be answered.
    Working,
    /// A write has failed. Nothing happens before the operator retries or quits.
    Stuck,
}

/// The guided calibration.
#[derive(Clone, Debug)]
pub struct Wizard {
    session: Session,
    phase: Phase,
    connection: Option<Connection>,
    /// Folder of the session; `None` before the first entry is written.
    folder: Option<String>,
    now: Timestamp,
    last_id: u64,
    busy: Option<Busy>,
    writing: Option<Writing>,
    actions: VecDeque<Action>,
    waiting: VecDeque<Intent>,
    notice: Option<Notice>,
    live: Live,
    /// Sessions that can be continued instead of starting one.
    sessions: Vec<SessionCard>,
    cells: cell::KnownCells,
    programs: program::Programs,
    /// Links that can be chosen from a list.
    links: KnownLinks,
    /// Folder of the session to continue after the end.
    resumes: Option<String>,
    ended: Option<String>,
    /// Entries that were not on disk when the program ended.
    unsaved: Vec<Entry>,
}

#[derive(Clone, Debug)]
struct Busy {
    id: RequestId,
    what: &'static str,
    progress: Option<RequestProgress>,
    done: done::Done,
    cancelled: bool,
}

/// The write that the store is working on.
#[derive(Clone, Debug)]
struct Writing {
    id: RequestId,
    what: Write,
    /// Error of a failed write, which waits for [`Intent::Retry`].
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
            sessions: Vec::new(),
            cells: cell::KnownCells::default(),
            programs: program::Programs::default(),
            links: KnownLinks::default(),
            resumes: None,
            ended: None,
            unsaved: Vec::new(),
        }
    }

    /// Resumes the session in `folder`, whose journal lost `torn_bytes` at its end.
    pub fn resume(session: Session, folder: String, torn_bytes: usize, now: Timestamp) -> (Self, Vec<Effect>) {
        let mut wizard = Self::new(now);
        wizard.phase = Phase::enter(session.step, &session);
        wizard.folder = Some(folder);
        wizard.session = session;
        let mut notice = Notice::info(format!(
            "Resumed session '{}' ({})",
            wizard.session.name,
            counted(wizard.session.counted().count(), "sample")
        ));
        if torn_bytes > 0 {
            notice = notice.hint(format!(
                "the last write to the journal was interrupted: {torn_bytes} bytes were set aside as 'journal.torn-…'. An entry that was not completely on disk was never shown as saved"
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

    /// Folder of the session.
    pub fn folder(&self) -> Option<&str> {
        self.folder.as_deref()
    }

    /// What is going on. Only an intent, a tick or a shutdown ends [`Activity::Idle`] and [`Activity::Stuck`].
    pub fn activity(&self) -> Activity {
        match (&self.writing, &self.busy) {
            (Some(writing), _) if writing.failed.is_some() => Activity::Stuck,
            (Some(_), _) | (None, Some(_)) => Activity::Working,
            (None, None) => Activity::Idle,
        }
    }

    /// Entries that are not known to be on disk although the program has ended: a write that failed, or that was not waited for.
    pub fn unsaved(&self) -> &[Entry] {
        &self.unsaved
    }

    /// Why the program ends, if it does.
    pub fn ended(&self) -> Option<&str> {
        self.ended.as_deref()
    }

    /// Folder of the session that the operator wants to continue instead.
    pub fn resumes(&self) -> Option<&str> {
        self.resumes.as_deref()
    }

    /// The current message to the operator.
    pub const fn notice(&self) -> Option<&Notice> {
        self.notice.as_ref()
    }

    /// Handles an event and returns the effects to carry out.
    pub fn update(&mut self, event: Event) -> Vec<Effect> {
        match event {
            // A clock can be set back. Time is taken as it comes: nothing here depends on its order.
            Event::Tick(now) => {
                self.now = now;
                Vec::new()
            }
            Event::Intent(intent) => self.on_intent(intent),
            Event::Store(event) => self.on_store(event),
            Event::Answer { id, answer } => self.on_answer(id, answer),
            Event::Progress { id, progress } => {
                if let Some(busy) = self.busy.as_mut().filter(|busy| busy.id == id) {
                    busy.done.take(&progress);
                    busy.progress = Some(progress);
                }
                Vec::new()
            }
            Event::Live(reading) => self.on_live(reading),
            Event::Sessions(sessions) => {
                self.sessions = sessions;
                Vec::new()
            }
            Event::Cell(cell) => {
                self.cells.earlier = cell;
                Vec::new()
            }
            Event::Links(links) => {
                self.links = links;
                Vec::new()
            }
            Event::Remark(notice) => {
                self.notice = Some(notice);
                Vec::new()
            }
            Event::Shutdown { cause } => self.shut_down(cause),
        }
    }

    /// Handles a live reading, which may trigger an automatic measurement.
    fn on_live(&mut self, reading: LiveReading) -> Vec<Effect> {
        let last_sample = self.session.samples.last().map(|sample| self.session.point_of(sample));
        self.live.take(reading, last_sample);
        let has_passed = self.phase.shown_stop().is_some_and(|stop| self.live.rests_at(stop));
        let is_free = self.activity() == Activity::Idle && self.ended.is_none();
        if has_passed && is_free {
            return self.on_intent(Intent::Passed);
        }
        let is_wanted =
            matches!(&self.session.instrument, Some(InstrumentChoice::Linked(choice)) if choice.is_automatic);
        let Some(row) = self.phase.shown_row().filter(|_| is_wanted && is_free) else {
            return Vec::new();
        };
        let can_measure =
            self.phase.intents(&self.cx()).iter().any(|info| info.intent == Intent::Measure && info.is_enabled());
        if !can_measure {
            return Vec::new();
        }
        if let Some(found) = self.live.recognised(&self.session, row) {
            return self.show_recognised(row, found);
        }
        if !self.live.is_time(&self.session, row) {
            return Vec::new();
        }
        self.on_intent(Intent::Measure)
    }

    /// Shows the row where the robot really is instead of the one awaited, which then comes at the end.
    fn show_recognised(&mut self, awaited: usize, found: usize) -> Vec<Effect> {
        let pose = |row: usize| self.session.rows.get(row).map_or("?", |row| row.planned.pose.as_str());
        let notice = Notice::info(format!("the robot is at pose {}, not at {}", pose(found), pose(awaited)))
            .hint("it is measured there; poses that were passed over come at the end");
        self.actions.push_back(Action::Write(vec![Entry::Row(found)]));
        self.actions.push_back(Action::Say(notice));
        self.run()
    }

    /// All intents of this moment; those that are not possible carry the reason.
    pub fn intents(&self) -> Vec<IntentInfo> {
        if self.ended.is_some() {
            return Vec::new();
        }
        let quit = IntentInfo::new(Intent::Quit, "quit").with_danger(Danger::Leaves);
        if self.activity() == Activity::Stuck {
            return vec![IntentInfo::new(Intent::Retry, "retry").default_action(), quit];
        }
        let mut intents = Vec::new();
        let busy = self.busy.as_ref().map(|busy| format!("{} is still running", busy.what));
        if let Some(busy) = &self.busy {
            let blocked = busy.cancelled.then(|| "already being cancelled".to_owned());
            intents.push(IntentInfo::new(Intent::Cancel, format!("cancel {}", busy.what)).unless(blocked));
        }
        let step = self.phase.step();
        let cell = self.cells.offers(step, &self.session);
        let programs = program::Programs::offers(step, &self.session);
        let turn = pointing::offer(step, &self.session, self.phase.shown_row(), self.connection.is_some());
        for mut info in self
            .phase
            .intents(&self.cx())
            .into_iter()
            .chain(cell)
            .chain(programs)
            .chain(faces::offer(step, &self.session))
            .chain(turn)
        {
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

    pub fn view(&self) -> ViewModel {
        view::build(self)
    }

    fn cx(&self) -> Cx<'_> {
        Cx {
            session: &self.session,
            connection: self.connection.as_ref(),
            down: self.live.down(),
            now: self.now,
            sessions: &self.sessions,
            links: &self.links,
        }
    }

    /// The step, mutable, beside what it may read.
    fn phase_and_cx(&mut self) -> (&mut Phase, Cx<'_>) {
        let cx = Cx {
            session: &self.session,
            connection: self.connection.as_ref(),
            down: self.live.down(),
            now: self.now,
            sessions: &self.sessions,
            links: &self.links,
        };
        (&mut self.phase, cx)
    }

    fn on_intent(&mut self, intent: Intent) -> Vec<Effect> {
        if self.ended.is_some() {
            return Vec::new();
        }
        if self.activity() == Activity::Stuck {
            return if intent == Intent::Retry {
                self.retry_write()
            } else if intent == Intent::Quit {
                self.end("quit; the last change was not saved".to_owned())
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
        // `intents` alone decides what is possible, so that footer, help and scripts agree with what happens.
        let blocked = match self.intents().into_iter().find(|info| info.intent.name() == intent.name()) {
            None => Some(format!("'{}' is not available in the step {}", intent.name(), self.phase.step())),
            Some(info) => info.blocked,
        };
        if let Some(reason) = blocked {
            self.notice = Some(Notice::info(format!("not now: {reason}")));
            return Vec::new();
        }
        self.notice = None;
        if let Intent::ResumeSession(folder) = intent {
            let cause = format!("continuing the session in {folder}");
            self.resumes = Some(folder);
            return self.end(cause);
        }
        if let Some(actions) = self.everywhere(&intent) {
            self.actions.extend(actions);
            return self.run();
        }
        if matches!(intent, Intent::Measure | Intent::MeasureAgain | Intent::Undo | Intent::Redo) {
            self.live.hold_until_moved();
        }
        let (phase, cx) = self.phase_and_cx();
        let actions = phase.on_intent(intent, &cx);
        self.actions.extend(actions);
        self.run()
    }

    /// Handles an intent that is the same in every step that offers it; `None` if it belongs to the step.
    #[expect(clippy::wildcard_enum_match_arm, reason = "all others belong to the steps")]
    fn everywhere(&mut self, intent: &Intent) -> Option<Vec<Action>> {
        Some(match intent {
            Intent::DescribeCell(cell) => self.cells.state((**cell).clone(), &self.session),
            Intent::PlaceTracker(points) => self.cells.place(points.clone(), &self.session),
            Intent::PlaceTrackerByPoses => self.cells.place_by_poses(&self.session),
            Intent::LimitJoints(limits) => self.cells.limit(limits, &self.session),
            Intent::AddBox(obstacle) => self.cells.add_box(obstacle.clone(), &self.session),
            Intent::TurnTracker => pointing::turn(&self.session, self.phase.shown_row()),
            Intent::CheckFaces(pair) => faces::check(pair, &self.session),
            Intent::WriteProgram(settings) => self.programs.write(settings.clone(), &self.session, self.now),
            Intent::ProgramDriven => vec![Action::Write(vec![Entry::ProgramDriven])],
            _ => return None,
        })
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
        if matches!(answer, Answer::Turned) {
            self.notice = Some(pointing::turned());
            return self.run();
        }
        if let Some(actions) = self.programs.on_answer(&answer) {
            self.actions.extend(actions);
            return self.run();
        }
        if let Answer::Connected { identity, warnings, recorded } = &answer {
            if !warnings.is_empty() {
                // All warnings go into one message: a second one would replace the first.
                let notice = Notice::attention(format!("check the instrument: {}", warnings.join("; ")))
                    .hint("The instrument works. Fix this before the first point, or continue if it is intended");
                self.actions.push_back(Action::Say(notice));
            }
            self.connection = Some(Connection { identity: identity.clone(), recorded: recorded.clone() });
            let is_linked = matches!(self.session.instrument, Some(InstrumentChoice::Linked(_)));
            if is_linked && self.session.identities.last() != Some(identity) {
                self.actions.push_back(Action::Write(vec![Entry::Connected { identity: identity.clone() }]));
            }
        }
        let (phase, cx) = self.phase_and_cx();
        let actions = phase.on_answer(answer, &cx);
        self.actions.extend(actions);
        self.run()
    }

    fn on_store(&mut self, event: StoreEvent) -> Vec<Effect> {
        let id = match &event {
            StoreEvent::Created { id, .. } | StoreEvent::Written { id } | StoreEvent::Failed { id, .. } => *id,
        };
        // A failed write waits for the operator; a late event about it changes nothing.
        let is_awaited = |writing: &mut Writing| writing.id == id && writing.failed.is_none();
        let Some(mut writing) = self.writing.take_if(is_awaited) else { return Vec::new() };
        match (event, writing.what) {
            (StoreEvent::Failed { message, .. }, what) => {
                if self.ended.is_some() {
                    self.writing = Some(Writing { what, ..writing });
                    self.drop_everything();
                    return vec![Effect::Exit];
                }
                self.waiting.clear();
                let saved = counted_as(self.session.samples.len(), "sample is", "samples are");
                self.notice = Some(
                    Notice::stop(format!("could not save: {message}"))
                        .hint(format!("{saved} already saved; this change is kept until it can be saved too"))
                        .hint("free some disk space and retry, or quit and resume the session later"),
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
            // An event of the wrong kind does not complete the write.
            (StoreEvent::Created { .. } | StoreEvent::Written { .. }, what) => {
                self.writing = Some(Writing { what, ..writing });
                Vec::new()
            }
        }
    }

    /// Applies a line that is on disk to the session.
    fn apply(&mut self, line: &Line) {
        if let Err(error) = self.session.apply(line) {
            // The wizard only writes entries that fit. If one ever does not, the operator must know.
            self.notice = Some(Notice::stop(format!("the journal is inconsistent: {error}")));
            return;
        }
        if let Entry::Step(step) = line.entry {
            self.phase = Phase::enter(step, &self.session);
        } else {
            let (phase, cx) = self.phase_and_cx();
            let actions = phase.on_applied(&line.entry, &cx);
            if self.ended.is_none() {
                self.actions.extend(actions);
            }
        }
    }

    fn retry_write(&mut self) -> Vec<Effect> {
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

    /// Carries out queued actions until one has to wait for the disk.
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
                    self.busy = Some(Busy {
                        id,
                        what: request.what(),
                        progress: None,
                        done: done::Done::default(),
                        cancelled: false,
                    });
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

    /// The message about lines that do not fit the session. They are never written: a journal with them could not be read.
    fn misfit(&self, lines: &[Line]) -> Option<Notice> {
        let mut session = self.session.clone();
        let error = lines.iter().find_map(|line| session.apply(line).err())?;
        Some(
            Notice::stop(format!("not done: {error}"))
                .hint("nothing was written and the session is intact; please report this with its journal"),
        )
    }

    fn next_id(&mut self) -> RequestId {
        self.last_id += 1;
        RequestId(self.last_id)
    }

    /// Shuts down cleanly: cancels the running request and closes the journal.
    fn shut_down(&mut self, cause: String) -> Vec<Effect> {
        if self.ended.is_some() {
            // A second shutdown waits for nothing, and answers that still arrive are ignored.
            self.drop_everything();
            return vec![Effect::Exit];
        }
        // A pending write is awaited, so that an opened session is closed cleanly.
        let has_session = self.session.opened.is_some() || self.writing.is_some();
        if !has_session || self.activity() == Activity::Stuck {
            return self.end(cause);
        }
        let mut effects = self.cancel();
        self.busy = None;
        self.waiting.clear();
        // Entries that wait behind a pending write are still written: a reading among them must not be lost.
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

    /// Forgets all pending work, so that answers that still arrive are ignored. Entries that were not written are remembered.
    fn drop_everything(&mut self) {
        self.busy = None;
        self.waiting.clear();
        let writing = self.writing.take().map(|writing| match writing.what {
            Write::Folder { entries, .. } => entries,
            Write::Lines(lines) => lines.into_iter().map(|line| line.entry).collect(),
        });
        let queued = self.actions.drain(..).filter_map(|action| match action {
            Action::Write(entries) | Action::Create { entries, .. } => Some(entries),
            Action::Ask(_) | Action::Disconnect | Action::Say(_) | Action::Exit => None,
        });
        // The closing entry tells nothing that the operator could miss.
        let is_missed = |entry: &Entry| !matches!(entry, Entry::Closed { .. });
        self.unsaved.extend(writing.into_iter().chain(queued).flatten().filter(is_missed));
    }
}

#[cfg(test)]
mod tests;
