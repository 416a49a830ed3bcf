//! Bounds of the queues.

use nalgebra::Point3;

use super::super::ProtocolEvent;
use super::super::Severity;
use super::super::Shot;
use super::MAX_OFFERED;
use super::MAX_OUTPUT;
use super::MAX_STATUS;
use super::Outbox;

fn shot(x: f64) -> Shot {
    Shot::bare(Point3::new(x, 0.0, 0.0))
}

#[test]
fn of_live_points_only_the_newest_waits() {
    let mut outbox = Outbox::default();
    for x in [1.0, 2.0, 3.0] {
        outbox.live(shot(x));
    }
    assert_eq!(outbox.next_event(), Some(ProtocolEvent::Live(shot(3.0))));
    assert_eq!(outbox.next_event(), None);
}

#[test]
fn of_offered_measurements_the_newest_wait() {
    let mut outbox = Outbox::default();
    for x in 0_u8..40 {
        outbox.offered(shot(f64::from(x)));
    }
    assert_eq!(outbox.waiting(), MAX_OFFERED);
    assert_eq!(outbox.next_event(), Some(ProtocolEvent::Offered(shot(24.0))));
}

#[test]
fn status_texts_and_output_are_bounded() {
    let mut outbox = Outbox::default();
    for number in 0..1000 {
        outbox.status(Severity::Info, format!("{number}"));
        outbox.send(vec![1]);
    }
    assert_eq!(outbox.waiting(), MAX_STATUS);
    assert_eq!(std::iter::from_fn(|| outbox.next_output()).count(), MAX_OUTPUT);
}
