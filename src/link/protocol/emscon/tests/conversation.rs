//! The conversation with a tracker that does what it should.

use std::time::Duration;

use nalgebra::Point3;

use super::super::{Command, CommandId, EmsconOptions, i32_at};
use super::{bench, bench_with, commands, failure, ready};
use crate::link::protocol::{Failure, Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::MockCell;

#[test]
fn the_set_up_writes_and_reads_back_everything_that_a_point_depends_on() {
    let bench = ready(&[]);
    let expected = [1, 2, 5, 6, 26, 27, 48, 47, 48, 15, 13, 42, 41, 24, 25, 28, 29, 2];
    assert_eq!(commands(&bench), expected);
}

#[test]
fn the_identity_says_who_answers_what_was_checked_and_which_reflector_is_in_use() {
    let events = bench(&[]).settle();
    let Some(ProtocolEvent::Ready(identity)) = events.last() else { panic!("{events:?}") };
    assert_eq!(identity.name, "Leica emScon tracker, serial 4711, version 3.6.0");
    let reflector = identity.reflector.clone().unwrap();
    assert_eq!((reflector.id, reflector.name.as_str()), (0, "SIMULATED RRR 1.5in"));
    assert!((reflector.offset - 0.019_05).abs() < 1e-12);
    assert_eq!(identity.warnings, Vec::<String>::new());
    assert!(identity.checked.iter().any(|line| line == "units: mm, rad, \u{b0}C, mbar, %RH (read back)"));
    assert!(identity.checked.iter().any(|line| line == "coordinates: right-handed x, y, z (0) (read back)"));
    let settings = "system settings: weather monitor 2, messages 1, positions 0, try mode 0 (read back)";
    assert!(identity.checked.iter().any(|line| line == settings), "{:?}", identity.checked);
}

#[test]
fn fields_of_the_system_settings_that_are_none_of_our_business_are_kept() {
    let bench = ready(&[]);
    let set = bench.sent.iter().find(|bytes| i32_at(bytes, 8) == Some(47)).unwrap();
    let fields: Vec<i32> = (0..9).map(|index| i32_at(set, 12 + 4 * index).unwrap()).collect();
    assert_eq!(fields, [2, 0, 0, 1, 1, 0, 0, 0, 1]);
}

#[test]
fn a_shot_is_the_point_of_the_cell_in_metres() {
    let mut bench = ready(&[]);
    for number in 0..3 {
        let events = bench.shoot();
        let Some(ProtocolEvent::Shot(shot)) = events.last() else { panic!("{events:?}") };
        assert!((shot.point - MockCell::point(number)).norm() < 1e-12);
        assert!(shot.sigma.unwrap().iter().zip([4e-6, 5e-6, 6e-6]).all(|(a, b)| (a - b).abs() < 1e-15));
        assert_eq!((shot.temperature, shot.pressure, shot.humidity), (Some(20.0), Some(1013.25), Some(50.0)));
        assert_eq!(shot.raw.len(), 156);
    }
    let tail = commands(&bench).split_off(18);
    assert_eq!(tail, [2, 49, 2, 49, 2, 49]);
}

#[test]
fn a_reflector_that_was_asked_for_is_set_and_read_back() {
    let mut bench = bench_with(EmsconOptions { reflector: Some(1), ..EmsconOptions::default() }, &[]);
    let events = bench.settle();
    let Some(ProtocolEvent::Ready(identity)) = events.last() else { panic!("{events:?}") };
    assert_eq!(identity.reflector.as_ref().unwrap().name, "SIMULATED RRR 0.5in");
    let mut bench = bench_with(EmsconOptions { reflector: Some(9), ..EmsconOptions::default() }, &[]);
    assert_eq!(
        bench.settle().last(),
        Some(&ProtocolEvent::Lost(Failure::Refused("selecting the reflector: invalid input data (98)".to_owned())))
    );
}

#[test]
fn the_initialisation_has_its_own_patience() {
    let mut bench = bench_with(EmsconOptions { initialize: true, ..EmsconOptions::default() }, &[]);
    let events = bench.settle();
    assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))), "{events:?}");
    assert_eq!(bench.elapsed(), Duration::from_secs(20));
    assert!(commands(&bench).contains(&CommandId::Initialize.number()));
}

#[test]
fn positions_of_the_reflector_are_live_points_and_never_shots() {
    let mut bench = bench_with(EmsconOptions { reflector_positions: true, ..EmsconOptions::default() }, &[]);
    bench.settle();
    let events = bench.run_for(Duration::from_secs(3));
    assert_eq!(events.len(), 11);
    for event in events {
        let ProtocolEvent::Live(shot) = event else { panic!("{event:?}") };
        assert!((shot.point - MockCell::point(0)).norm() < 1e-12);
    }
}

#[test]
fn an_idle_link_asks_for_the_status_every_five_seconds() {
    let mut bench = ready(&[]);
    let before = bench.sent.len();
    assert_eq!(bench.run_for(Duration::from_secs(51)), []);
    assert_eq!(bench.sent.split_off(before), vec![Command::bare(CommandId::GetTrackerStatus).encode(); 10]);
}

#[test]
fn a_cancelled_shot_is_swallowed_and_the_next_one_is_right() {
    let mut bench = ready(&[]);
    bench.trigger();
    assert_eq!(bench.run_for(Duration::from_millis(500)), []);
    bench.cancel();
    bench.trigger();
    let too_early = bench.run_until(|_| true);
    assert!(matches!(failure(&too_early), Failure::TooEarly(_)));
    assert_eq!(bench.run_for(Duration::from_millis(400)), []);
    let events = bench.shoot();
    let Some(ProtocolEvent::Shot(shot)) = events.last() else { panic!("{events:?}") };
    assert!((shot.point - MockCell::point(0)).norm() < 1e-12);
}

#[test]
fn a_result_that_overtakes_the_answer_to_the_stop_is_swallowed() {
    let mut bench = ready(&[]);
    bench.trigger();
    bench.run_for(Duration::from_millis(500));
    bench.cancel();
    // The stop is on the way while the result comes.
    let stop = bench.protocol.next_output().unwrap();
    assert_eq!(stop, Command::bare(CommandId::StopMeasurement).encode());
    assert_eq!(bench.run_for(Duration::from_secs(1)), []);
    assert_eq!(bench.cell.shots, 1);
    bench.simulator_gets(&stop);
    assert_eq!(bench.run_for(Duration::from_secs(1)), []);
    let events = bench.shoot();
    let Some(ProtocolEvent::Shot(shot)) = events.last() else { panic!("{events:?}") };
    assert!((shot.point - MockCell::point(1)).norm() < 1e-12);
}

#[test]
fn a_shot_before_the_set_up_or_beside_another_is_too_early() {
    let mut bench = bench(&[]);
    assert!(matches!(failure(&bench.shoot()), Failure::TooEarly(_)));
    bench.connect();
    assert!(matches!(failure(&bench.shoot()), Failure::TooEarly(_)));
    bench.run_until(|event| matches!(event, ProtocolEvent::Ready(_)));
    bench.trigger();
    assert!(matches!(failure(&bench.shoot()), Failure::TooEarly(_)));
    let events = bench.run_until(|_| true);
    let [ProtocolEvent::Shot(shot)] = events.as_slice() else { panic!("{events:?}") };
    assert!((shot.point - Point3::new(1.2345, -0.678_25, 0.090_125)).norm() < 1e-12);
}

#[test]
fn a_broken_beam_is_no_target_and_the_next_shot_may_succeed() {
    let mut bench = ready(&[]);
    bench.cell.has_beam = false;
    assert!(matches!(failure(&bench.shoot()), Failure::NoTarget(_)));
    bench.cell.has_beam = true;
    bench.trigger();
    bench.run_for(Duration::from_millis(300));
    bench.cell.has_beam = false;
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Failed(_)));
    assert!(matches!(failure(&events), Failure::NoTarget(_)));
    bench.cell.has_beam = true;
    bench.run_for(Duration::from_millis(1));
    assert!(matches!(bench.shoot().last(), Some(ProtocolEvent::Shot(_))));
}

#[test]
fn a_new_start_forgets_everything_of_the_connection_before() {
    let mut bench = ready(&[]);
    bench.trigger();
    bench.protocol.feed(&[0x9c, 0, 0], bench.now);
    let events = bench.settle();
    assert!(matches!(events.as_slice(), [ProtocolEvent::Ready(_)]), "{events:?}");
    assert!(matches!(bench.shoot().last(), Some(ProtocolEvent::Shot(_))));
}
