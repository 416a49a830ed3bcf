//! The end, asked for or forced, at any time.

use super::bench::{Bench, appended, fold, started, state, texts};
use crate::session::journal::Entry;
use crate::session::set_up::Step;
use crate::wizard::{Activity, Answer, Effect, Event, Intent, PlanSettings, StoreEvent};

fn shut_down(bench: &mut Bench) -> Vec<Effect> {
    bench.wizard.update(Event::Shutdown { cause: "SIGTERM".to_owned() })
}

/// After the end nothing happens any more.
fn is_over(bench: &mut Bench) {
    assert_eq!(bench.wizard.ended(), Some("SIGTERM"));
    assert_eq!(bench.wizard.activity(), Activity::Idle);
    assert!(bench.wizard.intents().is_empty());
    let before = state(&bench.wizard);
    assert_eq!(texts(&shut_down(bench)), ["exit"], "told again, it does not wait");
    for intent in [Intent::Quit, Intent::Retry, Intent::Measure, Intent::Next, Intent::Cancel] {
        assert!(bench.intend(intent).is_empty());
    }
    for id in (1..100).map(crate::wizard::RequestId) {
        let created = StoreEvent::Created { id, folder: "x".to_owned(), name: "x".to_owned() };
        for event in [created, StoreEvent::Written { id }, StoreEvent::Failed { id, message: "x".to_owned() }] {
            assert!(bench.wizard.update(Event::Store(event)).is_empty());
        }
        assert!(bench.wizard.update(Event::Answer { id, answer: Answer::Cancelled }).is_empty());
    }
    assert_eq!(state(&bench.wizard), before);
}

#[test]
fn every_step_closes_the_journal_and_ends() {
    for &step in Step::ALL.iter().skip(1) {
        let mut bench = Bench::at(step);
        let effects = shut_down(&mut bench);
        assert_eq!(texts(&effects), [format!("append {} closed: SIGTERM", bench.journal.len() + 1)], "{step}");
        bench.settle(effects);
        assert_eq!(bench.exits, 1, "{step}");
        assert_eq!(*bench.last_entry(), Entry::Closed { reason: "SIGTERM".to_owned() });
        assert_eq!(*bench.wizard.session(), fold(&bench.journal));
        assert!(bench.wizard.session().closed);
        is_over(&mut bench);
    }
}

#[test]
fn without_a_session_there_is_nothing_to_close() {
    let mut bench = Bench::new();
    let effects = shut_down(&mut bench);
    assert_eq!(texts(&effects), ["exit"]);
    is_over(&mut bench);
}

#[test]
fn quitting_is_the_same_in_good_order() {
    let mut bench = Bench::at(Step::Capture);
    bench.does(Intent::Quit);
    assert_eq!((bench.exits, bench.wizard.ended()), (1, Some("quit")));
    assert_eq!(*bench.last_entry(), Entry::Closed { reason: "quit".to_owned() });
}

#[test]
fn what_is_under_way_is_cancelled() {
    let mut bench = Bench::at(Step::Plan);
    bench.intend(Intent::MakePlan(PlanSettings::default()));
    let effects = shut_down(&mut bench);
    assert_eq!(texts(&effects), ["cancel", "append 8 closed: SIGTERM"]);
    bench.settle(effects);
    is_over(&mut bench);
}

#[test]
fn what_is_being_written_is_finished_first() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (id, request) = started(&effects);
    let effects = bench.answer(id, super::bench::answer(&request));
    assert!(bench.intend(Intent::Measure).is_empty());
    assert!(shut_down(&mut bench).is_empty());
    bench.settle(effects);
    assert_eq!((bench.exits, bench.wizard.session().samples.len()), (1, 1));
    assert!(bench.wizard.session().closed);
    is_over(&mut bench);
}

#[test]
fn a_reading_that_waits_to_be_written_is_not_lost() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (id, request) = started(&effects);
    let effects = bench.intend(Intent::Note("slow disk".to_owned()));
    assert!(bench.answer(id, super::bench::answer(&request)).is_empty());
    assert!(shut_down(&mut bench).is_empty());
    bench.settle(effects);
    let session = bench.wizard.session();
    assert_eq!((session.notes.len(), session.samples.len(), session.closed), (1, 1, true));
    is_over(&mut bench);
}

#[test]
fn a_disk_that_fails_at_the_end_does_not_hold_it_up() {
    let mut bench = Bench::at(Step::Capture);
    let effects = shut_down(&mut bench);
    let (id, _) = appended(&effects);
    assert_eq!(texts(&bench.failed(id)), ["exit"]);
    is_over(&mut bench);
}

#[test]
fn a_disk_that_has_failed_before_does_not_hold_it_up() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Note("x".to_owned()));
    let (id, _) = appended(&effects);
    bench.failed(id);
    assert_eq!(texts(&shut_down(&mut bench)), ["exit"]);
    is_over(&mut bench);
}

#[test]
fn a_folder_that_is_just_being_made_is_opened_and_closed() {
    let mut bench = Bench::new();
    bench.does(Intent::ChooseProfile("soochow".to_owned()));
    let effects = bench.intend(Intent::Next);
    assert_eq!(texts(&effects).len(), 1);
    assert!(shut_down(&mut bench).is_empty());
    bench.settle(effects);
    assert_eq!(bench.exits, 1);
    assert!(bench.wizard.session().closed);
    is_over(&mut bench);
}

#[test]
fn leaving_while_a_note_is_written_happens_after_it() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Note("x".to_owned()));
    assert!(bench.intend(Intent::Quit).is_empty());
    bench.settle(effects);
    assert_eq!((bench.exits, bench.wizard.session().notes.len()), (1, 1));
}

#[test]
fn told_twice_while_something_is_written_it_writes_nothing_more() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Note("warm".to_owned()));
    let (id, _) = appended(&effects);
    assert!(shut_down(&mut bench).is_empty(), "the note is waited for");
    assert_eq!(texts(&shut_down(&mut bench)), ["exit"]);
    assert!(bench.wizard.update(Event::Store(StoreEvent::Written { id })).is_empty());
    is_over(&mut bench);
}
