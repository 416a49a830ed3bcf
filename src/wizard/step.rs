//! The steps: each a small machine that owns only what is not in the session.
//!
//! A step is made anew whenever it is entered, from the session alone: going back and forth, or resuming, loses nothing but a
//! proposal that was not accepted. It answers intents and results with [`Action`]s and never touches the session itself.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a step answers its own intents, answers and entries; all others mean nothing to it"
)]

mod capture;
mod deliver;
mod identify;
mod instrument;
mod plan;
mod profile;
mod target;

use jiff::Timestamp;

use super::effect::{Answer, Request};
use super::intent::{Intent, IntentInfo};
use super::notice::Notice;
use super::view::Content;
use crate::profile::Profile;
use crate::session::journal::Entry;
use crate::session::plan::PlannedPose;
use crate::session::set_up::Step;
use crate::session::state::{Robot, Session};

/// What a step may look at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cx<'a> {
    pub(super) session: &'a Session,
    pub(super) connection: Option<&'a Connection>,
    /// Why the link to the instrument cannot be asked now, while it is being connected again.
    pub(super) down: Option<&'a str>,
    pub(super) now: Timestamp,
}

impl Cx<'_> {
    /// The robot; a step behind the first one always has it.
    pub(super) fn robot(&self) -> Option<&Robot> {
        self.session.robot.as_ref()
    }

    /// The profile with the target as it was chosen.
    pub(super) fn profile(&self) -> Option<Profile> {
        self.session.mounted_profile()
    }
}

/// An instrument that answers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Connection {
    /// Who it says it is.
    pub(super) identity: String,
    /// The poses of recorded measurements.
    pub(super) recorded: Vec<PlannedPose>,
}

/// What a step wants done.
#[derive(Clone, Debug)]
pub(super) enum Action {
    /// Make the session's folder, with these entries after the opening one.
    Create { name: String, entries: Vec<Entry> },
    /// Write entries; what comes after waits until they are on disk.
    Write(Vec<Entry>),
    /// Start something that takes time.
    Ask(Request),
    /// Forget the instrument.
    Disconnect,
    /// Tell the operator.
    Say(Notice),
    /// End the program.
    Exit,
}

impl Action {
    /// Goes to a step.
    pub(super) fn go(step: Step) -> Self {
        Self::Write(vec![Entry::Step(step)])
    }
}

/// The step that the wizard is in.
#[derive(Clone, Debug)]
pub(super) enum Phase {
    Profile(profile::ProfileStep),
    Instrument(instrument::InstrumentStep),
    Target(target::TargetStep),
    Plan(plan::PlanStep),
    Capture(Box<capture::CaptureStep>),
    Identify(identify::IdentifyStep),
    Verify(identify::VerifyStep),
    Deliver(deliver::DeliverStep),
}

/// Calls the step inside, whichever it is.
macro_rules! each {
    ($phase:expr, $step:ident => $call:expr) => {
        match $phase {
            Phase::Profile($step) => $call,
            Phase::Instrument($step) => $call,
            Phase::Target($step) => $call,
            Phase::Plan($step) => $call,
            Phase::Capture($step) => $call,
            Phase::Identify($step) => $call,
            Phase::Verify($step) => $call,
            Phase::Deliver($step) => $call,
        }
    };
}

impl Phase {
    /// Begins a step from the session alone.
    pub(super) fn enter(step: Step, session: &Session) -> Self {
        match step {
            Step::Profile => Self::Profile(profile::ProfileStep::default()),
            Step::Instrument => Self::Instrument(instrument::InstrumentStep),
            Step::Target => Self::Target(target::TargetStep::enter(session)),
            Step::Plan => Self::Plan(plan::PlanStep::default()),
            Step::Capture => Self::Capture(Box::new(capture::CaptureStep::enter(session))),
            Step::Identify => Self::Identify(identify::IdentifyStep::enter(session)),
            Step::Verify => Self::Verify(identify::VerifyStep),
            Step::Deliver => Self::Deliver(deliver::DeliverStep),
        }
    }

    /// Row of the plan that is shown, where there is one.
    pub(super) const fn shown_row(&self) -> Option<usize> {
        match self {
            Self::Capture(step) => step.shown_row(),
            Self::Profile(_)
            | Self::Instrument(_)
            | Self::Target(_)
            | Self::Plan(_)
            | Self::Identify(_)
            | Self::Verify(_)
            | Self::Deliver(_) => None,
        }
    }

    /// Which one it is.
    pub(super) const fn step(&self) -> Step {
        match self {
            Self::Profile(_) => Step::Profile,
            Self::Instrument(_) => Step::Instrument,
            Self::Target(_) => Step::Target,
            Self::Plan(_) => Step::Plan,
            Self::Capture(_) => Step::Capture,
            Self::Identify(_) => Step::Identify,
            Self::Verify(_) => Step::Verify,
            Self::Deliver(_) => Step::Deliver,
        }
    }

    /// What can be done in it.
    pub(super) fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let mut intents = each!(self, step => step.intents(cx));
        if self.step() != Step::Profile {
            intents.push(IntentInfo::new(Intent::Back, "back"));
        }
        intents
    }

    /// The operator wants something that is on offer.
    pub(super) fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        if intent == Intent::Back {
            return self.step().previous().map(Action::go).into_iter().collect();
        }
        each!(self, step => step.on_intent(intent, cx))
    }

    /// The open request has ended.
    pub(super) fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        match answer {
            Answer::Failed(problem) => each!(self, step => step.on_failure(problem, cx)),
            Answer::Cancelled => {
                let problem = super::Problem { message: "cancelled".to_owned(), hints: Vec::new() };
                each!(self, step => step.on_failure(problem, cx))
            }
            answer => each!(self, step => step.on_answer(answer, cx)),
        }
    }

    /// An entry is on disk and in the session.
    pub(super) fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        each!(self, step => step.on_applied(entry, cx))
    }

    /// What it shows.
    pub(super) fn content(&self, cx: &Cx<'_>) -> Content {
        each!(self, step => step.content(cx))
    }
}

/// What every step does.
pub(super) trait StepMachine {
    /// What can be done.
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo>;

    /// The operator wants something that is on offer.
    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action>;

    /// A request has been answered. Answers that another step asked for (it was left meanwhile) mean nothing here.
    fn on_answer(&mut self, _answer: Answer, _cx: &Cx<'_>) -> Vec<Action> {
        Vec::new()
    }

    /// A request has failed or was cancelled.
    fn on_failure(&mut self, problem: super::Problem, _cx: &Cx<'_>) -> Vec<Action> {
        vec![Action::Say(problem.into())]
    }

    /// An entry is on disk and in the session.
    fn on_applied(&mut self, _entry: &Entry, _cx: &Cx<'_>) -> Vec<Action> {
        Vec::new()
    }

    /// What there is to see.
    fn content(&self, cx: &Cx<'_>) -> Content;
}
