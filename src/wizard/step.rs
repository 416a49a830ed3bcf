//! The steps: small state machines that own only what is not in the session.
//!
//! A step is created from the session alone whenever it is entered. Going back and forth, or resuming, therefore loses nothing but
//! a proposal that was not accepted. A step answers intents and results with [`Action`]s and never changes the session itself.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a step handles its own intents, answers and entries, and ignores all others"
)]

mod capture;
mod deliver;
mod identify;
mod instrument;
mod plan;
mod profile;
mod target;

use jiff::Timestamp;
pub(super) use plan::measuring_pace;

use super::effect::{Answer, Request};
use super::intent::{Intent, IntentInfo};
use super::notice::{Notice, Problem};
use super::view::{Content, SessionCard};
use crate::profile::Profile;
use crate::session::journal::Entry;
use crate::session::plan::PlannedPose;
use crate::session::set_up::Step;
use crate::session::state::{Robot, Session};
use crate::session::wire::KnownLinks;

/// What a step may read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cx<'a> {
    pub(super) session: &'a Session,
    pub(super) connection: Option<&'a Connection>,
    /// Why the link to the instrument is down, while it is being reconnected.
    pub(super) down: Option<&'a str>,
    pub(super) now: Timestamp,
    /// Sessions that can be continued instead of starting one.
    pub(super) sessions: &'a [SessionCard],
    /// Links that can be chosen from a list.
    pub(super) links: &'a KnownLinks,
}

impl Cx<'_> {
    /// The robot; every step after the first has one.
    pub(super) fn robot(&self) -> Option<&Robot> {
        self.session.robot.as_ref()
    }

    /// Notes a measurement at a pose that gave no sample, and says why.
    pub(super) fn refuse(&self, pose: String, problem: Problem) -> Vec<Action> {
        let number = self.session.measurements + 1;
        let entry = Entry::Refused { number, pose, reason: problem.message.clone(), xyz_mm: None };
        vec![Action::Write(vec![entry]), Action::Say(problem.into())]
    }

    /// The profile with the chosen target.
    pub(super) fn profile(&self) -> Option<Profile> {
        self.session.mounted_profile()
    }
}

/// An instrument that responds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Connection {
    /// Identity reported by the instrument.
    pub(super) identity: String,
    /// Poses of recorded measurements.
    pub(super) recorded: Vec<PlannedPose>,
}

/// Work that a step asks the wizard to do.
#[derive(Clone, Debug)]
pub(super) enum Action {
    /// Create the session folder, with these entries after the opening one.
    Create {
        name: String,
        entries: Vec<Entry>,
    },
    /// Write entries; later actions wait until they are on disk.
    Write(Vec<Entry>),
    Ask(Request),
    /// Drop the connection to the instrument.
    Disconnect,
    Say(Notice),
    Exit,
}

/// A condition for an intent: met, or the reason why the intent is not possible.
type Condition = Result<(), String>;

fn require(is_met: bool, reason: &str) -> Condition {
    if is_met { Ok(()) } else { Err(reason.to_owned()) }
}

/// Offers an intent that is possible if all conditions are met; the first one that is not gives the reason.
fn offer<const N: usize>(intent: Intent, label: &str, conditions: [Condition; N]) -> IntentInfo {
    IntentInfo::new(intent, label).unless(conditions.into_iter().find_map(Result::err))
}

/// Marks the sensible next action among `intents`, if it is possible.
fn with_default(mut intents: Vec<IntentInfo>, next: &Intent) -> Vec<IntentInfo> {
    for info in intents.iter_mut().filter(|info| info.intent == *next) {
        info.is_default = info.is_enabled();
    }
    intents
}

impl Action {
    /// The action that goes to a step.
    pub(super) fn go(step: Step) -> Self {
        Self::Write(vec![Entry::Step(step)])
    }
}

/// The current step with its state.
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

/// Calls a method of the step inside.
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
    /// Enters a step, from the session alone.
    pub(super) fn enter(step: Step, session: &Session) -> Self {
        match step {
            Step::Profile => Self::Profile(profile::ProfileStep::default()),
            Step::Instrument => Self::Instrument(instrument::InstrumentStep),
            Step::Target => Self::Target(target::TargetStep::enter(session)),
            Step::Plan => Self::Plan(plan::PlanStep::enter(session)),
            Step::Capture => Self::Capture(Box::new(capture::CaptureStep::enter(session))),
            Step::Identify => Self::Identify(identify::IdentifyStep::enter(session)),
            Step::Verify => Self::Verify(identify::VerifyStep),
            Step::Deliver => Self::Deliver(deliver::DeliverStep),
        }
    }

    /// Row of the plan that is shown, if any.
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

    /// Configuration of the stop on the way that is shown, if any.
    pub(super) fn shown_stop(&self) -> Option<&[f64]> {
        match self {
            Self::Capture(step) => step.next_stop(),
            Self::Profile(_)
            | Self::Instrument(_)
            | Self::Target(_)
            | Self::Plan(_)
            | Self::Identify(_)
            | Self::Verify(_)
            | Self::Deliver(_) => None,
        }
    }

    /// The name of the step.
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

    /// Intents that the step offers.
    pub(super) fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let mut intents = each!(self, step => step.intents(cx));
        if self.step() != Step::Profile {
            intents.push(IntentInfo::new(Intent::Back, "back"));
        }
        intents
    }

    /// Handles an intent that is on offer.
    pub(super) fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        if intent == Intent::Back {
            return self.step().previous().map(Action::go).into_iter().collect();
        }
        each!(self, step => step.on_intent(intent, cx))
    }

    /// Handles the answer to the running request.
    pub(super) fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        match answer {
            Answer::Failed(problem) => each!(self, step => step.on_failure(problem, cx)),
            Answer::Cancelled => {
                let problem = super::Problem::new("cancelled");
                each!(self, step => step.on_failure(problem, cx))
            }
            answer => each!(self, step => step.on_answer(answer, cx)),
        }
    }

    /// Called when an entry is on disk and in the session.
    pub(super) fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        each!(self, step => step.on_applied(entry, cx))
    }

    /// The step's part of the view.
    pub(super) fn content(&self, cx: &Cx<'_>) -> Content {
        each!(self, step => step.content(cx))
    }
}

/// Interface of a step.
pub(super) trait StepMachine {
    /// Intents that the step offers.
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo>;

    /// Handles an intent that is on offer.
    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action>;

    /// Handles an answer. An answer to a request of a step that was left meanwhile is ignored.
    fn on_answer(&mut self, _answer: Answer, _cx: &Cx<'_>) -> Vec<Action> {
        Vec::new()
    }

    /// Handles a request that failed or was cancelled.
    fn on_failure(&mut self, problem: super::Problem, _cx: &Cx<'_>) -> Vec<Action> {
        vec![Action::Say(problem.into())]
    }

    /// Called when an entry is on disk and in the session.
    fn on_applied(&mut self, _entry: &Entry, _cx: &Cx<'_>) -> Vec<Action> {
        Vec::new()
    }

    /// The step's part of the view.
    fn content(&self, cx: &Cx<'_>) -> Content;
}
