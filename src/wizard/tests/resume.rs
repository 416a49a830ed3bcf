//! A session resumes from whatever its journal holds.

use super::bench::{Bench, FOLDER, fold, offers, simulated, start, started, texts};
use crate::session::journal::Entry;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::wire::LinkChoice;
use crate::wizard::view::{Content, ViewModel};
use crate::wizard::{Answer, Intent, Request, Wizard};

/// A session with everything in it, up to the end.
fn full_run() -> Bench {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(2);
    bench.does(Intent::Skip);
    bench.does(Intent::Note("draught from the door".to_owned()));
    bench.measure(3);
    bench.does(Intent::Undo);
    bench.measure(usize::MAX);
    bench.does(Intent::SuggestPoses(2));
    bench.measure(usize::MAX);
    bench.does(Intent::Next);
    bench.does(Intent::Identify);
    bench.does(Intent::Back);
    bench.does(Intent::Next);
    bench.does(Intent::Next);
    bench.does(Intent::Next);
    bench.does(Intent::Deliver);
    bench.does(Intent::Quit);
    assert_eq!(bench.exits, 1);
    bench
}

/// A view without what lives only as long as the program.
fn lasting(mut view: ViewModel) -> ViewModel {
    view.busy = None;
    view.notice = None;
    view.ended = None;
    view.intents.clear();
    view.header.instrument = None;
    view.header.is_saving = false;
    match &mut view.content {
        Content::Instrument(instrument) => {
            instrument.identity = None;
            instrument.recorded_poses = 0;
        }
        Content::Plan(plan) => {
            plan.proposal = None;
            plan.settings = crate::wizard::PlanSettings::default();
        }
        Content::Profile(_)
        | Content::Target(_)
        | Content::Capture(_)
        | Content::Identify(_)
        | Content::Verify(_)
        | Content::Deliver(_) => {}
    }
    view
}

#[test]
fn after_every_acknowledged_line_the_view_is_that_of_a_resumed_session() {
    let bench = full_run();
    for (lines, seen) in &bench.seen {
        let (resumed, _) = bench.resumed(*lines);
        assert_eq!(lasting(resumed.wizard.view()), lasting(seen.clone()), "after {lines} lines");
    }
}

#[test]
fn every_prefix_can_be_brought_to_the_end() {
    let full = full_run();
    // An identification takes a while: not from every single pose.
    let lines = full.journal.len();
    for kept in (1..=lines).filter(|kept| *kept < 10 || *kept > lines - 7 || kept % 9 == 0) {
        let (mut bench, effects) = full.resumed(kept);
        assert_eq!(texts(&effects).len(), 1, "{kept}");
        bench.settle(effects);
        for _ in 0..10 {
            if bench.wizard.session().delivered.is_empty() {
                bench.pass(&simulated());
            }
        }
        assert_eq!(bench.wizard.session().delivered.len(), 9, "{kept} lines");
        assert_eq!(*bench.wizard.session(), fold(&bench.journal), "{kept} lines");
        bench.does(Intent::Quit);
        assert_eq!(bench.exits, 1);
    }
}

#[test]
fn resuming_is_journaled_then_said_then_the_instrument_is_connected() {
    let full = Bench::at(Step::Capture);
    let (mut bench, mut effects) = full.resumed(9);
    assert_eq!(texts(&effects), [format!("append 10 resumed by {}", crate::wizard::program())]);
    assert_eq!(bench.wizard.notice(), None);
    effects = bench.perform(effects.remove(0));
    assert_eq!(texts(&effects), ["start connecting"]);
    assert_eq!(bench.told(), "Resumed session 'soochow-20260301-0915' (0 samples)");
    bench.settle(effects);
    assert_eq!(bench.wizard.view().header.instrument.as_deref(), Some("bench instrument"));
    assert_eq!(bench.wizard.session().resumed, 1);
    // Each shows a message of its own.
    let without_message =
        |wizard: &Wizard| -> Vec<String> { offers(wizard).into_iter().filter(|offer| offer != "Dismiss").collect() };
    assert_eq!(without_message(&bench.wizard), without_message(&full.wizard));
    bench.measure(1);
    assert_eq!(bench.wizard.session().samples.len(), 1);
}

#[test]
fn bytes_that_were_lost_are_said() {
    let bench = Bench::at(Step::Plan);
    let (mut wizard, effects) = Wizard::resume(fold(&bench.journal), FOLDER.to_owned(), 37, start());
    assert!(texts(&effects)[0].contains("37 bytes of an incomplete last entry dropped"));
    let (id, _) = super::bench::appended(&effects);
    wizard.update(crate::wizard::Event::Store(crate::wizard::StoreEvent::Written { id }));
    assert!(wizard.notice().unwrap().hints[0].contains("37 bytes were set aside"));
}

#[test]
fn a_session_without_a_robot_asks_for_one() {
    let (mut bench, effects) = Bench::at(Step::Instrument).resumed(1);
    bench.settle(effects);
    assert_eq!(bench.step(), Step::Profile);
    bench.does(Intent::ChooseProfile("soochow".to_owned()));
    let effects = bench.intend(Intent::Next);
    assert!(texts(&effects)[0].starts_with("append 3 profile 'soochow'"));
    bench.settle(effects);
    assert_eq!(bench.step(), Step::Instrument);
}

#[test]
fn who_the_instrument_said_it_is_is_noted_once_and_again_when_it_is_another() {
    let choice = LinkChoice { address: "emscon:192.168.0.2".to_owned(), ..LinkChoice::default() };
    let bench = Bench::with(&InstrumentChoice::Linked(choice), Step::Capture);
    let noted = |bench: &Bench| {
        let entries = bench.journal.iter().map(|line| line.entry.clone());
        entries.filter(|entry| matches!(entry, Entry::Connected { .. })).collect::<Vec<_>>()
    };
    let named = |identity: &str| Entry::Connected { identity: identity.to_owned() };
    assert_eq!(noted(&bench), [named("bench instrument")]);
    // The same one again, and another in its place.
    let (mut same, effects) = bench.resumed(bench.journal.len());
    same.settle(effects);
    assert_eq!(noted(&same), [named("bench instrument")]);
    let (mut other, effects) = bench.resumed(bench.journal.len());
    let written = effects.into_iter().flat_map(|effect| other.perform(effect)).collect::<Vec<_>>();
    let (id, request) = started(&written);
    assert!(matches!(request, Request::Connect { .. }));
    let identity = "a SIMULATED instrument".to_owned();
    let effects =
        other.answer(id, Answer::Connected { identity: identity.clone(), recorded: Vec::new(), warnings: Vec::new() });
    other.settle(effects);
    assert_eq!(noted(&other), [named("bench instrument"), named(&identity)]);
    assert_eq!((bench.wizard.session().is_simulated(), other.wizard.session().is_simulated()), (false, true));
}
