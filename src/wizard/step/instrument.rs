//! Step Instrument: what measures.

use super::{Action, Cx, StepMachine};
use crate::profile::{CellText, Profile};
use crate::session::journal::{Entry, instrument_text};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step};
use crate::session::wire::LinkChoice;
use crate::wizard::effect::Request;
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::view::{Content, InstrumentView};

/// The instrument step. All of its state is in the session and the connection.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct InstrumentStep;

/// Connects the instrument of the session.
fn connect(cx: &Cx<'_>) -> Vec<Action> {
    let (Some(instrument), Some(robot)) = (&cx.session.instrument, cx.robot()) else { return Vec::new() };
    vec![Action::Ask(Request::Connect { instrument: instrument.clone(), profile: Box::new(robot.profile.clone()) })]
}

fn joint_names(profile: &Profile) -> Vec<&str> {
    profile.chain().joints().iter().map(|joint| joint.name.as_str()).collect()
}

/// The link that the profile describes.
fn link(cx: &Cx<'_>) -> Option<LinkChoice> {
    cx.robot().and_then(|robot| robot.profile.link()).map(LinkChoice::from)
}

impl StepMachine for InstrumentStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let none = match (&cx.session.instrument, cx.connection) {
            (None, _) => Some("choose an instrument first".to_owned()),
            (Some(_), None) => Some("the instrument is not responding: reconnect, or choose another".to_owned()),
            (Some(_), Some(_)) => None,
        };
        let nothing_to_retry = match (&cx.session.instrument, cx.connection) {
            (Some(_), None) => None,
            _ => Some("there is nothing to reconnect".to_owned()),
        };
        let fixed = cx.session.has_measurements().then(|| {
            "points from another instrument cannot be mixed with those already measured; start another session"
                .to_owned()
        });
        let proposal =
            link(cx).map_or(InstrumentChoice::Manual { unit: CoordinateUnit::Millimetre }, InstrumentChoice::Linked);
        vec![
            IntentInfo::new(Intent::Next, "use this instrument").unless(none).default_action(),
            IntentInfo::new(Intent::ChooseInstrument(proposal), "choose an instrument").unless(fixed),
            IntentInfo::new(Intent::FindLinks, "look for serial ports again"),
            IntentInfo::new(Intent::Retry, "reconnect").unless(nothing_to_retry),
        ]
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::ChooseInstrument(instrument) => {
                vec![Action::Write(vec![Entry::Instrument(instrument)]), Action::Disconnect]
            }
            Intent::Retry => connect(cx),
            Intent::Next => vec![Action::go(Step::Target)],
            _ => Vec::new(),
        }
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        match entry {
            Entry::Instrument(_) => connect(cx),
            // A simulated instrument stands and scatters as the cell says.
            Entry::Cell(_) if !cx.session.has_measurements() => connect(cx),
            _ => Vec::new(),
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let profile = cx.robot().map(|robot| &robot.profile);
        Content::Instrument(InstrumentView {
            link: link(cx),
            known: cx.links.clone(),
            choice: cx.session.instrument.as_ref().map(instrument_text),
            identity: cx.connection.map(|connection| connection.identity.clone()),
            recorded_poses: cx.connection.map_or(0, |connection| connection.recorded.len()),
            cell: profile.map(|profile| cx.session.cell.or(&CellText::of(profile), &joint_names(profile)).to_string()),
            stated_sigma: profile
                .and_then(|profile| profile.instrument())
                .map(|instrument| format!("{}: {}", instrument.name, instrument.sigma_text())),
        })
    }
}
