//! Answers, progress and words of the store that nobody waits for any more, and what is cancelled.

use super::bench::{Bench, answer, appended, failure, offers, started, state, texts};
use crate::session::set_up::Step;
use crate::wizard::{Answer, Effect, Event, Intent, PlanSettings, RequestId, RequestProgress, StoreEvent};

/// Events with an id that nobody waits for.
fn strangers(id: RequestId) -> Vec<Event> {
    vec![
        Event::Answer { id, answer: Answer::Cancelled },
        Event::Answer { id, answer: failure("too late") },
        Event::Answer {
            id,
            answer: Answer::Connected { identity: "another".to_owned(), warnings: Vec::new(), recorded: Vec::new() },
        },
        Event::Answer {
            id,
            answer: Answer::Delivered { files: vec!["x".to_owned()], sums: Vec::new(), left_out: Vec::new() },
        },
        Event::Progress { id, progress: RequestProgress::Search(crate::procedure::plan::Progress::Searching) },
        Event::Store(StoreEvent::Written { id }),
        Event::Store(StoreEvent::Failed { id, message: "late".to_owned() }),
        Event::Store(StoreEvent::Created { id, folder: "elsewhere".to_owned(), name: "x".to_owned() }),
    ]
}

#[track_caller]
fn ignores(bench: &mut Bench, id: RequestId) {
    let before = state(&bench.wizard);
    for event in strangers(id) {
        let text = format!("{event:?}");
        assert!(bench.wizard.update(event).is_empty(), "{text}");
        assert_eq!(state(&bench.wizard), before, "{text}");
    }
}

#[test]
fn answers_that_nobody_waits_for_change_nothing_in_any_step() {
    for &step in Step::ALL {
        let mut bench = Bench::at(step);
        for id in [0, 1, 2, 1000, u64::MAX] {
            ignores(&mut bench, RequestId(id));
        }
    }
}

#[test]
fn a_strange_word_of_the_store_does_not_answer_what_is_being_written() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Note("kept".to_owned()));
    let (id, lines) = appended(&effects);
    for stranger in [0, id.0 - 1, id.0 + 1] {
        ignores(&mut bench, RequestId(stranger));
    }
    // Nor does a word of the wrong kind.
    let before = state(&bench.wizard);
    let created = StoreEvent::Created { id, folder: "x".to_owned(), name: "x".to_owned() };
    assert!(bench.wizard.update(Event::Store(created)).is_empty());
    assert_eq!(state(&bench.wizard), before);
    bench.written(id, lines);
    assert_eq!(bench.wizard.session().notes.len(), 1);
    ignores(&mut bench, id);
}

#[test]
fn a_second_answer_changes_nothing() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (id, request) = started(&effects);
    ignores(&mut bench, RequestId(id.0 - 1));
    let effects = bench.answer(id, answer(&request));
    bench.settle(effects);
    let before = state(&bench.wizard);
    assert!(bench.wizard.update(Event::Answer { id, answer: answer(&request) }).is_empty());
    assert_eq!(state(&bench.wizard), before);
}

#[test]
fn an_answer_after_the_step_was_left_does_no_harm() {
    // The answer to an earlier request arrives once more, in every later step.
    let mut bench = Bench::at(Step::Plan);
    let effects = bench.intend(Intent::MakePlan(PlanSettings::default()));
    let (id, request) = started(&effects);
    bench.settle(effects);
    bench.does(Intent::AcceptPlan);
    for _ in 0..3 {
        let before = state(&bench.wizard);
        assert!(bench.wizard.update(Event::Answer { id, answer: answer(&request) }).is_empty());
        assert_eq!(state(&bench.wizard), before);
        bench.pass(&super::bench::simulated());
    }
    assert_eq!(bench.step(), Step::Deliver);
}

#[test]
fn progress_is_shown_while_it_lasts() {
    let mut bench = Bench::at(Step::Plan);
    let effects = bench.intend(Intent::MakePlan(PlanSettings::default()));
    let (id, _) = started(&effects);
    let progress = RequestProgress::Search(crate::procedure::plan::Progress::Unreachable { poses: 3 });
    assert!(bench.wizard.update(Event::Progress { id, progress }).is_empty());
    let busy = bench.wizard.view().busy.unwrap();
    assert_eq!(busy.what, "choosing poses");
    assert_eq!(busy.progress.unwrap(), "3 poses cannot be reached without a collision: choosing others");
    bench.settle(effects);
    assert_eq!(bench.wizard.view().busy, None);
}

/// Starts something, cancels it twice; the id that waits for its answer.
fn cancelled(bench: &mut Bench, intent: Intent) -> RequestId {
    let effects = bench.intend(intent);
    let (id, _) = started(&effects);
    assert_eq!(offers(&bench.wizard)[0], "Cancel");
    let effects = bench.intend(Intent::Cancel);
    assert!(matches!(effects[..], [Effect::Cancel(cancelled)] if cancelled == id));
    assert!(bench.wizard.view().busy.unwrap().is_cancelled);
    assert_eq!(offers(&bench.wizard)[0], "Cancel -- already being cancelled");
    assert!(bench.intend(Intent::Cancel).is_empty());
    id
}

#[test]
fn planning_can_be_cancelled() {
    let mut bench = Bench::at(Step::Plan);
    let id = cancelled(&mut bench, Intent::MakePlan(PlanSettings::default()));
    assert!(bench.answer(id, Answer::Cancelled).is_empty());
    assert_eq!(bench.told(), "cancelled");
    assert!(offers(&bench.wizard).contains(&"MakePlan*".to_owned()));
    ignores(&mut bench, id);
}

#[test]
fn a_search_that_is_cancelled_may_give_the_best_plan_so_far() {
    let mut bench = Bench::at(Step::Plan);
    let id = cancelled(&mut bench, Intent::MakePlan(PlanSettings::default()));
    let rows = super::bench::plan();
    bench.answer(id, Answer::Planned { summary: None, rows, origin: "interrupted".to_owned() });
    assert!(offers(&bench.wizard).contains(&"AcceptPlan*".to_owned()));
}

#[test]
fn identifying_can_be_cancelled() {
    let mut bench = Bench::at(Step::Identify);
    let id = cancelled(&mut bench, Intent::Identify);
    assert!(bench.answer(id, Answer::Cancelled).is_empty());
    assert_eq!(bench.wizard.session().identified, None);
    bench.does(Intent::Identify);
    assert!(bench.wizard.session().is_current());
}

#[test]
fn a_cancelled_measurement_is_noted_and_its_number_is_used_up() {
    let mut bench = Bench::at(Step::Capture);
    let id = cancelled(&mut bench, Intent::Measure);
    let effects = bench.answer(id, Answer::Cancelled);
    assert_eq!(texts(&effects), ["append 10 measurement 1: pose 1: no sample: cancelled"]);
    bench.settle(effects);
    assert_eq!(bench.capture().refused, [("1".to_owned(), "cancelled".to_owned())]);
    let effects = bench.intend(Intent::Measure);
    let (_, request) = started(&effects);
    let crate::wizard::Request::Measure(request) = request else { panic!() };
    assert_eq!((request.number, request.pose.as_str()), (2, "1"));
}

#[test]
fn a_reading_that_comes_in_spite_of_cancelling_counts() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (id, request) = started(&effects);
    bench.intend(Intent::Cancel);
    let effects = bench.answer(id, answer(&request));
    bench.settle(effects);
    assert_eq!(bench.wizard.session().samples.len(), 1);
}

#[test]
fn a_search_that_fails_while_capturing_is_no_refused_measurement() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(12);
    let lines = bench.journal.len();
    for answered in [Answer::Cancelled, failure("no candidates")] {
        let effects = bench.intend(Intent::SuggestPoses(5));
        let (id, _) = started(&effects);
        assert!(bench.answer(id, answered).is_empty());
    }
    assert_eq!(bench.told(), "no candidates");
    assert_eq!((bench.journal.len(), bench.capture().refused.len()), (lines, 0));
}

#[test]
fn an_instrument_that_is_gone_after_resuming_is_no_refused_measurement() {
    let (mut bench, mut effects) = Bench::at(Step::Capture).resumed(9);
    effects = bench.perform(effects.remove(0));
    let (id, _) = started(&effects);
    assert!(bench.answer(id, failure("no route to host")).is_empty());
    assert_eq!((bench.told().as_str(), bench.capture().refused.len()), ("no route to host", 0));
    assert_eq!(
        super::bench::blocked(&bench.wizard, "Measure"),
        "the instrument is not responding; go back to the instrument step"
    );
}
