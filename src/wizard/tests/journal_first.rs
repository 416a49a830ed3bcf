//! The journal is on disk before anything that depends on it is done or shown.

use super::bench::{Bench, appended, fold, offers, started, state, texts};
use crate::session::set_up::Step;
use crate::wizard::{Activity, Effect, Event, Intent, Severity, StoreEvent};

fn note(text: &str) -> Intent {
    Intent::Note(text.to_owned())
}

#[test]
fn nothing_is_shown_before_it_is_written() {
    let mut bench = Bench::at(Step::Capture);
    bench.does(Intent::Passed);
    let session = bench.wizard.session().clone();
    let content = bench.wizard.view().content;
    let mut effects = bench.intend(Intent::Measure);
    effects = bench.perform(effects.remove(0));
    let (id, lines) = appended(&effects);
    assert_eq!(effects.len(), 1);
    assert_eq!((lines.len(), lines[0].number), (1, session.lines + 1));
    let view = bench.wizard.view();
    assert_eq!((bench.wizard.session(), &view.content), (&session, &content));
    assert_eq!((view.header.samples, view.header.saved_entries, view.header.is_saving), (0, session.lines, true));
    assert_eq!(bench.wizard.activity(), Activity::Working);
    assert!(bench.written(id, lines).is_empty());
    let view = bench.wizard.view();
    assert_eq!((view.header.samples, view.header.saved_entries, view.header.is_saving), (1, session.lines + 1, false));
    assert_eq!(*bench.wizard.session(), fold(&bench.journal));
}

#[test]
fn a_chosen_instrument_takes_the_place_of_the_old_one_when_it_is_written() {
    let mut bench = Bench::at(Step::Target);
    bench.does(Intent::Back);
    let before = bench.wizard.view();
    let effects = bench.intend(Intent::ChooseInstrument(super::bench::MANUAL));
    let view = bench.wizard.view();
    assert_eq!((&view.content, &view.header.instrument), (&before.content, &before.header.instrument));
    let (id, lines) = appended(&effects);
    let effects = bench.written(id, lines);
    assert_eq!(texts(&effects), ["start connecting"]);
    assert_eq!(bench.wizard.view().header.instrument, None);
}

#[test]
fn what_is_wanted_meanwhile_is_done_in_order() {
    let mut bench = Bench::at(Step::Capture);
    let mut effects = bench.intend(note("first"));
    for intent in [note("second"), Intent::Skip, Intent::Measure, note("third"), Intent::Back] {
        assert!(bench.intend(intent).is_empty());
    }
    let mut done = Vec::new();
    while !effects.is_empty() {
        let effect = effects.remove(0);
        done.extend(texts(std::slice::from_ref(&effect)));
        // The measurement is not answered: so the step cannot be left.
        if !matches!(effect, Effect::Start { .. }) {
            effects.extend(bench.perform(effect));
        }
    }
    assert_eq!(
        done,
        [
            "append 10 note to pose 1: first",
            "append 11 note to pose 1: second",
            "append 12 row 2 of the plan skipped",
            "start measuring",
            "append 13 note to pose 2: third",
        ]
    );
    assert_eq!((bench.told().as_str(), bench.step()), ("not now: measuring is still running", Step::Capture));
}

#[test]
fn a_reading_waits_for_the_note_before_it() {
    let mut bench = Bench::at(Step::Capture);
    let measuring = bench.intend(Intent::Measure);
    let (id, request) = started(&measuring);
    let mut effects = bench.intend(note("shaky"));
    assert!(bench.answer(id, super::bench::answer(&request)).is_empty());
    effects = bench.perform(effects.remove(0));
    assert_eq!(appended(&effects).1[0].number, 11);
    bench.settle(effects);
    assert_eq!(bench.wizard.session().samples.len(), 1);
    assert_eq!(bench.wizard.session().notes.len(), 1);
}

#[test]
fn a_full_disk_stops_everything_but_trying_again_and_leaving() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(3);
    let session = bench.wizard.session().clone();
    let measured = bench.intend(Intent::Measure);
    let (id, request) = started(&measured);
    let effects = bench.answer(id, super::bench::answer(&request));
    let (id, lines) = appended(&effects);
    assert!(bench.intend(Intent::Skip).is_empty());
    assert!(bench.failed(id).is_empty());
    let notice = bench.wizard.notice().unwrap();
    assert_eq!((notice.severity, notice.what.as_str()), (Severity::Stop, "could not save: no space left"));
    assert_eq!(notice.hints[0], "3 samples are already saved; this change is kept until it can be saved too");
    assert!(bench.wizard.view().is_stopped());
    assert_eq!(offers(&bench.wizard), ["Retry*", "Quit"]);
    assert_eq!(*bench.wizard.session(), session);
    // Nothing else has any meaning now, not even late words of the store.
    let stuck = state(&bench.wizard);
    for intent in [Intent::Measure, Intent::Back, Intent::Dismiss, Intent::Cancel, note("x")] {
        assert!(bench.intend(intent).is_empty());
    }
    assert!(bench.wizard.update(Event::Store(StoreEvent::Written { id })).is_empty());
    assert!(bench.failed(id).is_empty());
    assert_eq!(state(&bench.wizard), stuck);
    // It fails again, then there is room.
    let effects = bench.intend(Intent::Retry);
    let (second, again) = appended(&effects);
    assert_ne!(second, id);
    assert!(bench.failed(second).is_empty());
    let effects = bench.intend(Intent::Retry);
    let (third, once_more) = appended(&effects);
    let entries = |lines: &[crate::session::journal::Line]| {
        lines.iter().map(|line| (line.number, line.entry.clone())).collect::<Vec<_>>()
    };
    assert_eq!((entries(&again), entries(&once_more)), (entries(&lines), entries(&lines)));
    assert!(bench.written(third, once_more).is_empty(), "what waited is forgotten");
    assert_eq!((bench.wizard.session().samples.len(), bench.told().as_str()), (4, ""));
    assert_eq!(*bench.wizard.session(), fold(&bench.journal));
    bench.measure(1);
    assert_eq!(bench.wizard.session().samples.len(), 5);
}

#[test]
fn leaving_with_a_full_disk_ends() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(note("lost"));
    let (id, _) = appended(&effects);
    bench.failed(id);
    assert_eq!(texts(&bench.intend(Intent::Quit)), ["exit"]);
    assert_eq!(bench.wizard.ended(), Some("quit; the last change was not saved"));
    let ended = state(&bench.wizard);
    assert!(bench.wizard.update(Event::Store(StoreEvent::Written { id })).is_empty());
    assert!(bench.intend(Intent::Retry).is_empty());
    assert_eq!(state(&bench.wizard), ended);
}

#[test]
fn a_full_disk_while_measuring_keeps_the_reading_for_later() {
    let mut bench = Bench::at(Step::Capture);
    let measuring = bench.intend(Intent::Measure);
    let (measurement, request) = started(&measuring);
    let noted = bench.intend(note("before"));
    let (id, _) = appended(&noted);
    bench.failed(id);
    assert!(bench.answer(measurement, super::bench::answer(&request)).is_empty());
    let effects = bench.intend(Intent::Retry);
    assert_eq!(texts(&effects), ["append 10 note to pose 1: before"]);
    bench.settle(effects);
    assert_eq!(bench.wizard.session().samples.len(), 1);
    assert_eq!(*bench.wizard.session(), fold(&bench.journal));
}

#[test]
fn a_folder_that_cannot_be_made_can_be_tried_again() {
    let mut bench = Bench::new();
    bench.does(Intent::ChooseProfile("soochow".to_owned()));
    let effects = bench.intend(Intent::Next);
    let Some(Effect::Create { id, .. }) = effects.first() else { panic!() };
    assert!(bench.failed(*id).is_empty());
    assert_eq!(offers(&bench.wizard), ["Retry*", "Quit"]);
    let effects = bench.intend(Intent::Retry);
    assert_eq!(texts(&effects), ["create soochow-20260301-0915"]);
    bench.settle(effects);
    assert_eq!((bench.step(), bench.wizard.session().lines), (Step::Instrument, 3));
}

#[test]
fn more_intents_than_a_person_can_type_are_dropped() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(note("0"));
    for number in 1..200 {
        assert!(bench.intend(note(&number.to_string())).is_empty());
    }
    bench.settle(effects);
    assert_eq!(bench.wizard.session().notes.len(), 65);
    assert_eq!(bench.wizard.session().notes[64].text, "64");
}
