//! Packets that come unasked, at any time, and what they do to what is under way.

use std::time::Duration;

use super::super::exchange::{Due, Exchange};
use super::super::{Command, CommandId};
use super::{EmsconBench, bench, commands, ready, statuses};
use crate::link::protocol::{Failure, Moment, Protocol as _, ProtocolEvent};
use crate::link::simulator::emscon::EmsconFault;
use crate::link::simulator::fault::Planned;

/// A packet of integers, sized right.
fn packet(fields: &[i32]) -> Vec<u8> {
    let size = i32::try_from(4 + 4 * fields.len()).unwrap();
    [size].iter().chain(fields).flat_map(|field| field.to_le_bytes()).collect()
}

/// A status change.
fn event(number: i32) -> Vec<u8> {
    packet(&[8, number])
}

/// A reflector at (1, 1, 1) in the units that are set.
fn position() -> Vec<u8> {
    let values = [1.0_f64; 3].iter().flat_map(|value| value.to_le_bytes());
    [36_i32, 7, 0].iter().flat_map(|field| field.to_le_bytes()).chain(values).collect()
}

/// What a packet makes the link say at once.
fn said(bench: &mut EmsconBench, bytes: &[u8]) -> Vec<ProtocolEvent> {
    bench.protocol.feed(bytes, bench.now);
    std::iter::from_fn(|| bench.protocol.next_event()).collect()
}

/// A bench whose tracker has accepted a measurement.
fn measuring() -> EmsconBench {
    let mut bench = ready(&[]);
    bench.trigger();
    assert_eq!(bench.run_for(Duration::from_millis(100)), []);
    bench
}

#[test]
fn a_tracker_that_becomes_ready_again_says_so_once() {
    let mut bench = ready(&[]);
    assert_eq!(statuses(&said(&mut bench, &event(25))), ["the tracker is not ready: the beam may be broken"]);
    assert_eq!(said(&mut bench, &event(25)), []);
    assert_eq!(statuses(&said(&mut bench, &event(27))), ["the tracker is ready again"]);
    assert_eq!(said(&mut bench, &[event(27), event(26)].concat()), []);
}

#[test]
fn the_face_is_the_one_that_the_tracker_announced_last() {
    let mut bench = ready(&[]);
    for (announced, face) in [(None, None), (Some(30), Some(1)), (Some(31), Some(2)), (None, Some(2))] {
        if let Some(number) = announced {
            assert_eq!(said(&mut bench, &event(number)), []);
        }
        let events = bench.shoot();
        let Some(ProtocolEvent::Shot(shot)) = events.last() else { panic!("{events:?}") };
        assert_eq!(shot.face, face);
    }
}

#[test]
fn positions_are_shown_only_while_the_units_are_certain() {
    let mut bench = bench(&[]);
    bench.connect();
    assert_eq!(said(&mut bench, &position()), []);
    bench.run_until(|event| matches!(event, ProtocolEvent::Ready(_)));
    let live = said(&mut bench, &position());
    assert!(matches!(live.as_slice(), [ProtocolEvent::Live(shot)] if (shot.point.x - 0.001).abs() < 1e-15), "{live:?}");
    assert_eq!(said(&mut bench, &[event(6), position()].concat()), []);
    bench.run_for(Duration::from_secs(1));
    assert_eq!(said(&mut bench, &position()), live);
    let mut bench = measuring();
    let events = said(&mut bench, &[event(6), position()].concat());
    assert!(matches!(events.as_slice(), [ProtocolEvent::Failed(Failure::Settings(_))]), "{events:?}");
}

#[test]
fn an_error_of_the_measurement_ends_it_and_one_of_another_command_stops_it_too() {
    for (command, is_stopped) in [(49, false), (0, true), (2, true)] {
        let mut bench = measuring();
        let events = said(&mut bench, &packet(&[1, command, 10_009]));
        assert!(matches!(events.as_slice(), [ProtocolEvent::Failed(Failure::NoTarget(_))]), "{events:?}");
        let stop = Command::bare(CommandId::StopMeasurement).encode();
        assert_eq!(bench.protocol.next_output(), is_stopped.then_some(stop), "{command}");
    }
}

#[test]
fn an_error_that_nobody_waits_for_is_said() {
    let mut bench = ready(&[]);
    assert_eq!(statuses(&said(&mut bench, &packet(&[1, 58, 41]))), ["unlisted number (58): module timed out (41)"]);
    let events = said(&mut bench, &packet(&[1, 0, 10_011]));
    assert!(matches!(events.as_slice(), [ProtocolEvent::Lost(Failure::InUse(_))]), "{events:?}");
}

#[test]
fn events_that_change_what_points_mean_are_followed_by_a_reading_and_others_are_not() {
    for number in [6, 7, 8, 12, 15, 16, 17, 18] {
        let mut bench = ready(&[]);
        let before = bench.sent.len();
        assert_eq!(said(&mut bench, &event(number)), [], "{number}");
        let events = bench.run_for(Duration::from_secs(1));
        assert_eq!(statuses(&events), ["the settings of the tracker were checked again and are right"]);
        assert_eq!(commands(&bench).split_off(before), [6, 27, 48, 15, 13, 41, 25, 29, 2], "{number}");
        let mut bench = measuring();
        let events = said(&mut bench, &event(number));
        assert!(matches!(events.as_slice(), [ProtocolEvent::Failed(Failure::Settings(_))]), "{number}: {events:?}");
    }
    for number in [0, 2, 24, 27, 26, 4711, -1] {
        let mut bench = ready(&[]);
        assert_eq!(said(&mut bench, &event(number)), [], "{number}");
        assert_eq!(bench.protocol.next_output(), None, "{number}");
    }
}

#[test]
fn an_unusable_point_that_nobody_asked_for_is_not_offered_and_has_the_settings_read() {
    let mut bench = ready(&[]);
    let events = said(&mut bench, &packet(&[&[2][..], &[0; 37]].concat()));
    let words = "ignored an unrequested point: the reading is not a measurement: the point is 0.000000 m from the \
                 tracker, which measures from 0.1 m to 80 m";
    assert_eq!(statuses(&events), [words]);
    assert_eq!(events.len(), 1);
    assert_eq!(bench.protocol.next_output(), Some(Command::bare(CommandId::GetUnits).encode()));
}

#[test]
fn what_the_tracker_does_not_know_is_not_read_again() {
    let mut bench = ready(&[Planned::always(EmsconFault::NoStationary)]);
    let before = bench.sent.len();
    said(&mut bench, &event(6));
    bench.run_for(Duration::from_secs(1));
    assert_eq!(commands(&bench).split_off(before), [6, 27, 48, 15, 13, 41, 25, 2]);
}

#[test]
fn a_set_up_without_a_beam_ends_with_a_warning() {
    let mut bench = bench(&[]);
    bench.cell.has_beam = false;
    let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!() };
    assert_eq!(identity.warnings, ["tracker status: not ready (0)"]);
}

#[test]
fn a_busy_tracker_is_asked_again_at_growing_pauses_up_to_two_seconds() {
    let mut now = Moment::ZERO;
    let mut exchange = Exchange::new(Command::bare(CommandId::GetUnits), now);
    let mut pauses = Vec::new();
    while exchange.retry(now) {
        assert!(!exchange.is_answered_by(CommandId::GetUnits), "it is not sent again yet");
        pauses.push(exchange.deadline().saturating_sub(now).as_millis());
        now = exchange.deadline();
        assert!(matches!(exchange.due(now), Due::Resend(_)));
    }
    assert_eq!(pauses, [200, 400, 800, 1600, 2000, 2000, 2000, 2000, 2000, 2000]);
}
