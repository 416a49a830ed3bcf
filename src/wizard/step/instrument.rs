//! Instrument: what measures.

use super::{Action, Cx, StepMachine};
use crate::session::journal::Entry;
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step};
use crate::session::simulation::Simulation;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::Problem;
use crate::wizard::view::{Content, InstrumentView};

/// The instrument step. What it waits for is in the session: a choice without a connection.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct InstrumentStep;

/// Connects what the session has chosen.
fn connect(cx: &Cx<'_>) -> Vec<Action> {
    let (Some(instrument), Some(robot)) = (&cx.session.instrument, cx.robot()) else { return Vec::new() };
    vec![Action::Ask(Request::Connect { instrument: instrument.clone(), profile: Box::new(robot.profile.clone()) })]
}

/// In one line.
pub(in crate::wizard) fn describe(instrument: &InstrumentChoice) -> String {
    match instrument {
        InstrumentChoice::Manual { unit } => format!("typed in by hand, in {}", unit.sign()),
        InstrumentChoice::Simulated(Simulation { seed, faults, .. }) => {
            let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
            let faults = if faults.is_empty() { String::new() } else { format!(", with {}", faults.join(", ")) };
            format!("simulated cell, seed {seed}{faults}")
        }
        InstrumentChoice::Replay { sets, .. } => {
            let files: Vec<&str> = sets.iter().map(|set| set.file.as_str()).collect();
            format!("recorded measurements: {}", files.join(", "))
        }
    }
}

impl StepMachine for InstrumentStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let none = match (&cx.session.instrument, cx.connection) {
            (None, _) => Some("choose an instrument first".to_owned()),
            (Some(_), None) => Some("the instrument does not answer yet".to_owned()),
            (Some(_), Some(_)) => None,
        };
        let nothing_to_retry = match (&cx.session.instrument, cx.connection) {
            (Some(_), None) => None,
            _ => Some("there is nothing to connect again".to_owned()),
        };
        let fixed = cx
            .session
            .has_measurements()
            .then(|| "points of another instrument cannot be mixed with those measured; start another session".to_owned());
        let proposal = InstrumentChoice::Manual { unit: CoordinateUnit::Millimetre };
        vec![
            IntentInfo::new(Intent::Next, "measure with this").unless(none).default_action(),
            IntentInfo::new(Intent::ChooseInstrument(proposal), "choose an instrument").unless(fixed),
            IntentInfo::new(Intent::Retry, "connect again").unless(nothing_to_retry),
        ]
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::ChooseInstrument(instrument) => {
                vec![Action::Disconnect, Action::Write(vec![Entry::Instrument(instrument)])]
            }
            Intent::Retry => connect(cx),
            Intent::Next => vec![Action::go(Step::Target)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, _answer: Answer, _cx: &Cx<'_>) -> Vec<Action> {
        Vec::new()
    }

    fn on_failure(&mut self, problem: Problem, _cx: &Cx<'_>) -> Vec<Action> {
        vec![Action::Say(problem.into())]
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        if matches!(entry, Entry::Instrument(_)) { connect(cx) } else { Vec::new() }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let profile = cx.robot().map(|robot| &robot.profile);
        Content::Instrument(InstrumentView {
            choice: cx.session.instrument.as_ref().map(describe),
            identity: cx.connection.map(|connection| connection.identity.clone()),
            recorded_poses: cx.connection.map_or(0, |connection| connection.recorded.len()),
            stated_sigma: profile.and_then(|profile| profile.instrument()).map(|instrument| {
                format!("{}: {}", instrument.name, instrument.sigma_text())
            }),
        })
    }
}
