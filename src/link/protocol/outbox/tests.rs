//! Bounds of the queues, and what is kept.

use nalgebra::Point3;

use super::super::{Failure, Identity, JointState, ProtocolEvent, Severity, Shot, Status};
use super::{MAX_FIRST_STATUSES, MAX_JOINTS, MAX_NEWEST_STATUSES, MAX_OFFERED, MAX_OUTPUTS, MAX_STATUSES, Outbox};

/// A flood.
const MANY: u32 = 1000;

fn shot(x: u32) -> Shot {
    Shot::bare(Point3::new(f64::from(x), 0.0, 0.0))
}

fn joints(controller_time: f64) -> ProtocolEvent {
    ProtocolEvent::Joints(JointState { controller_time, ..JointState::at(Vec::new()) })
}

fn said(severity: Severity, text: &impl ToString) -> ProtocolEvent {
    ProtocolEvent::Status(Status { severity, text: text.to_string() })
}

fn failed() -> ProtocolEvent {
    ProtocolEvent::Failed(Failure::TooEarly(String::new()))
}

/// What comes out of an outbox into which these events went.
fn kept(events: impl IntoIterator<Item = ProtocolEvent>) -> Vec<ProtocolEvent> {
    let mut outbox = Outbox::default();
    for event in events {
        outbox.push(event);
    }
    std::iter::from_fn(|| outbox.next_event()).collect()
}

#[test]
fn of_live_points_the_newest_is_kept_behind_what_came_before_it() {
    let events = kept([ProtocolEvent::Live(shot(1)), failed(), ProtocolEvent::Live(shot(2)), failed()]);
    assert_eq!(events, [failed(), ProtocolEvent::Live(shot(2)), failed()]);
}

#[test]
fn of_joint_states_the_newest_are_kept_for_their_mean_and_live_points_are_none_of_their_business() {
    let events = kept([joints(1.0), ProtocolEvent::Live(shot(1)), joints(2.0), joints(3.0)]);
    assert_eq!(events, [joints(1.0), ProtocolEvent::Live(shot(1)), joints(2.0), joints(3.0)]);
    let events = kept((0..MANY).map(|number| joints(f64::from(number))));
    let first = MANY - u32::try_from(MAX_JOINTS).unwrap();
    assert_eq!(events, (first..MANY).map(|number| joints(f64::from(number))).collect::<Vec<_>>());
}

#[test]
fn of_offered_points_the_newest_are_kept() {
    let events = kept((0..MANY).map(|x| ProtocolEvent::Offered(shot(x))));
    let newest: Vec<u32> = (MANY - u32::try_from(MAX_OFFERED).unwrap()..MANY).collect();
    assert_eq!(events, newest.iter().map(|x| ProtocolEvent::Offered(shot(*x))).collect::<Vec<_>>());
}

#[test]
fn of_statuses_the_first_which_name_the_cause_and_the_newest_are_kept() {
    let events = kept((0..MANY).map(|number| said(Severity::Warning, &number)));
    let (first, newest) = (MAX_FIRST_STATUSES, MAX_NEWEST_STATUSES);
    let numbers = (0..MANY).filter(|number| {
        let number = *number as usize;
        number < first || number >= MANY as usize - newest
    });
    assert_eq!(events, numbers.map(|number| said(Severity::Warning, &number)).collect::<Vec<_>>());
}

#[test]
fn a_flood_of_information_leaves_every_warning() {
    let flood = |from: u32| (from..from + MANY).map(|number| said(Severity::Info, &number));
    let warnings = || (0..20).map(|number| said(Severity::Warning, &number));
    let events = kept(warnings().take(10).chain(flood(0)).chain(warnings().skip(10)).chain(flood(MANY)));
    let is_warning =
        |event: &&ProtocolEvent| matches!(event, ProtocolEvent::Status(s) if s.severity == Severity::Warning);
    assert_eq!(events.iter().filter(is_warning).cloned().collect::<Vec<_>>(), warnings().collect::<Vec<_>>());
    assert_eq!(events.len(), 20 + MAX_STATUSES);
}

#[test]
fn a_status_that_comes_again_and_again_waits_once_or_where_others_are_between_first_and_last() {
    let [a, b, c] = ["a", "b", "c"].map(|text| said(Severity::Info, &text));
    assert_eq!(kept((0..MANY).map(|_| a.clone())).as_slice(), std::slice::from_ref(&a));
    // How things are now is said last.
    assert_eq!(kept([&a, &b, &a].map(Clone::clone)), [&a, &b, &a].map(Clone::clone));
    let flood = std::iter::repeat_n([&a, &b], MANY as usize).flatten().chain([&a]);
    assert_eq!(kept([&c].into_iter().chain(flood).cloned()), [&c, &a, &b, &b, &a].map(Clone::clone));
    // The same words of another weight are another status.
    let warning = said(Severity::Warning, &"a");
    assert_eq!(kept([a.clone(), warning.clone()]), [a, warning]);
}

#[test]
fn answers_and_ends_are_all_kept_in_any_flood() {
    let mut outbox = Outbox::default();
    for x in 0..MANY {
        outbox.push(ProtocolEvent::Shot(shot(x)));
        outbox.fail(Failure::TooEarly(x.to_string()));
        outbox.lose(Failure::Disconnected(x.to_string()));
        outbox.push(ProtocolEvent::Ready(Identity::default()));
        outbox.report(Severity::Info, x.to_string());
        outbox.push(ProtocolEvent::Offered(shot(x)));
        outbox.push(ProtocolEvent::Live(shot(x)));
    }
    let events: Vec<ProtocolEvent> = std::iter::from_fn(|| outbox.next_event()).collect();
    let answers = events.iter().filter(|event| {
        !matches!(event, ProtocolEvent::Status(_) | ProtocolEvent::Offered(_) | ProtocolEvent::Live(_))
    });
    let expected = (0..MANY).flat_map(|x| {
        [
            ProtocolEvent::Shot(shot(x)),
            ProtocolEvent::Failed(Failure::TooEarly(x.to_string())),
            ProtocolEvent::Lost(Failure::Disconnected(x.to_string())),
            ProtocolEvent::Ready(Identity::default()),
        ]
    });
    assert_eq!(answers.cloned().collect::<Vec<_>>(), expected.collect::<Vec<_>>());
}

#[test]
fn outputs_are_bounded_and_go_with_the_connection() {
    let mut outbox = Outbox::default();
    outbox.send(Vec::new());
    assert_eq!(outbox.next_output(), None);
    for number in 0..MANY {
        outbox.send(number.to_le_bytes().to_vec());
    }
    assert_eq!(outbox.next_output(), Some(vec![0; 4]));
    assert_eq!(std::iter::from_fn(|| outbox.next_output()).count(), MAX_OUTPUTS - 1);
    outbox.send(vec![1]);
    outbox.lose(Failure::Disconnected(String::new()));
    assert_eq!(outbox.next_output(), None);
    assert!(matches!(outbox.next_event(), Some(ProtocolEvent::Lost(_))));
    outbox.send(vec![1]);
    outbox.report(Severity::Info, "old");
    outbox.clear();
    assert_eq!((outbox.next_output(), outbox.next_event()), (None, None));
}
