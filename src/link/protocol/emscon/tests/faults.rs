//! Every fault of the simulated tracker: the right words, no wrong point, and the link continues or reports why not.

use std::time::Duration;

use proptest::prelude::*;

use super::super::{Emscon, EmsconOptions, ResultStatus};
use super::{EmsconBench, bench, bench_with, failure, ready, statuses};
use crate::link::protocol::{Failure, Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::MockCell;
use crate::link::simulator::emscon::EmsconFault;
use crate::link::simulator::fault::Planned;

/// The next shot is the point of the cell.
#[track_caller]
fn assert_recovered(bench: &mut EmsconBench) {
    bench.run_for(Duration::from_secs(2));
    let number = bench.cell.shots;
    let events = bench.shoot();
    let Some(ProtocolEvent::Shot(shot)) = events.last() else { panic!("{events:?}") };
    assert!((shot.point - MockCell::point(number)).norm() < 1e-12, "{}", shot.point);
}

/// A shot with a fault fails with words, and the next one is right without a new connection.
#[track_caller]
fn assert_fails_then_recovers(fault: EmsconFault, words: &str) {
    let mut bench = ready(&[Planned::once(fault)]);
    let events = bench.shoot();
    let Some(ProtocolEvent::Failed(failure)) = events.last() else { panic!("{fault}: {events:?}") };
    assert_eq!(failure.to_string(), words, "{fault}");
    assert!(!events.iter().any(|event| matches!(event, ProtocolEvent::Shot(_))), "{fault}");
    assert_recovered(&mut bench);
}

/// A shot with a fault loses the link, with these words for the shot; a new connection is good.
#[track_caller]
fn assert_loses_then_reconnects(fault: EmsconFault, words: &str) {
    let mut bench = ready(&[Planned::once(fault)]);
    let events = bench.shoot();
    assert_eq!(failure(&events).to_string(), words, "{fault}");
    let rest = bench.run_for(Duration::from_secs(1));
    let is_lost = events.iter().chain(&rest).any(|event| matches!(event, ProtocolEvent::Lost(_)));
    assert!(is_lost, "{fault}: {events:?} {rest:?}");
    assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))), "{fault}");
    assert_recovered(&mut bench);
}

#[test]
fn harmless_faults_change_nothing() {
    for fault in [
        EmsconFault::Drip,
        EmsconFault::Joined,
        EmsconFault::ExtendedResult,
        EmsconFault::LongResult,
        EmsconFault::UnknownType,
        EmsconFault::Busy,
        EmsconFault::Flood,
    ] {
        let mut bench = ready(&[Planned::always(fault)]);
        if fault == EmsconFault::Busy {
            bench = ready(&[Planned::from(fault, 1, 3)]);
        }
        assert_recovered(&mut bench);
        assert_recovered(&mut bench);
    }
}

#[test]
fn a_flood_of_positions_leaves_the_newest_and_the_shot() {
    let mut bench = ready(&[Planned::once(EmsconFault::Flood)]);
    let events = bench.shoot();
    assert!(matches!(events.last(), Some(ProtocolEvent::Shot(_))));
    assert!(events[..events.len() - 1].iter().all(|event| matches!(event, ProtocolEvent::Live(_))));
}

#[test]
fn a_tracker_that_stays_busy_is_not_asked_for_ever() {
    let mut bench = ready(&[Planned::always(EmsconFault::Busy)]);
    let events = bench.shoot();
    assert_eq!(failure(&events), &Failure::NotReady("starting the measurement: the server is busy (1)".to_owned()));
    let elapsed = bench.elapsed();
    assert!(elapsed > Duration::from_secs(12) && elapsed <= Duration::from_secs(15), "{elapsed:?}");
}

#[test]
fn failures_of_one_shot_say_what_happened_and_the_next_one_is_right() {
    use EmsconFault as Fault;
    let cases = [
        (
            Fault::NotReady,
            "the instrument is not ready (starting the measurement: the measurement status is not ready (10004))",
        ),
        (
            Fault::LateError,
            "the instrument sees no reflector (the measurement ended: no result of the stationary measurement (10009))",
        ),
        (
            Fault::UnlistedError,
            "the instrument sees no reflector (the measurement ended with error 4242, as after a broken beam)",
        ),
        (
            Fault::LostBeam,
            "the instrument sees no reflector (the tracker reported 'not ready' before the result: the beam is broken)",
        ),
        (Fault::Silence, "no answer from the instrument for 11 s while waiting for the result of the measurement"),
        (
            Fault::TryMode,
            "the instrument has a wrong setting: the tracker is in try mode, which does not take real measurements",
        ),
        (
            Fault::WrongMode,
            "the instrument has a wrong setting: the measurement mode is sphere centre (4), not stationary",
        ),
        (Fault::BadStatus, "the reading was not stable (the measurement ended: the sensor is not stable (10013))"),
        (
            Fault::ZeroPoint,
            "the reading is not a measurement: the point is 0.000000 m from the tracker, which measures from 0.1 m to 80 m",
        ),
        (
            Fault::SilentMetres,
            "the reading is not a measurement: the point is 0.001411 m from the tracker, which measures from 0.1 m to 80 m",
        ),
        (Fault::NotFinite, "the reading is not a measurement: a coordinate is not a finite number"),
        (
            Fault::ShortResult,
            "cannot read the data from the instrument: packet 'single measurement result' has 100 bytes, at least 156 are needed",
        ),
        (
            Fault::UnitsChanged,
            "the instrument has a wrong setting: the units were changed while a point was being measured",
        ),
        (
            Fault::TypeChanged,
            "the instrument has a wrong setting: the coordinate type was changed while a point was being measured",
        ),
    ];
    for (fault, words) in cases {
        assert_fails_then_recovers(fault, words);
    }
}

#[test]
fn every_number_that_a_tracker_refuses_with_has_its_kind_and_its_words() {
    let kind = |number: i32| match ResultStatus::from_number(number).failure("measuring") {
        Failure::NoTarget(text) => ("no target", text),
        Failure::Unstable(text) => ("unstable", text),
        Failure::NotReady(text) => ("not ready", text),
        Failure::Settings(text) => ("settings", text),
        Failure::InUse(text) => ("in use", text),
        Failure::Refused(text) => ("refused", text),
        other => panic!("{number}: {other:?}"),
    };
    for (number, wanted, part) in [
        (37, "no target", "the beam was interrupted"),
        (10009, "no target", "no result"),
        (10013, "unstable", "not stable"),
        (1, "not ready", "busy"),
        (39, "not ready", "not initialised"),
        (10004, "not ready", "not ready"),
        (10005, "not ready", "starting up"),
        (10012, "not ready", "not warmed up"),
        (10014, "not ready", "not ready"),
        (23, "settings", "reflector"),
        (27, "settings", "enter temperature, pressure and humidity"),
        (57, "settings", "weather values out of range"),
        (94, "settings", "enter temperature, pressure and humidity"),
        (95, "settings", "enter temperature, pressure and humidity"),
        (96, "settings", "enter temperature, pressure and humidity"),
        (10003, "settings", "pressure sensor"),
        (35, "in use", "usage conflict"),
        (10011, "in use", "another program"),
        (2, "refused", "not implemented"),
        (38, "refused", "no tracker connected"),
        (10010, "refused", "not levelled"),
        (10015, "refused", "cannot reach the sensor"),
        (10016, "refused", "battery"),
        (10020, "refused", "hardware problem"),
        (7, "refused", "wrong parameter (7)"),
        (15, "refused", "parameter out of range (15)"),
        (4242, "refused", "4242"),
    ] {
        let (found, text) = kind(number);
        assert_eq!(found, wanted, "{number}: {text}");
        assert!(text.contains(part) && text.contains(&number.to_string()), "{number}: {text}");
    }
}

#[test]
fn faults_that_end_the_connection_say_so_and_a_new_one_is_good() {
    use EmsconFault as Fault;
    let size = |size: i32| {
        format!(
            "cannot read the data from the instrument: a packet of {size} bytes was announced; sizes are 12 to 65536, so the \
             stream is out of sync"
        )
    };
    assert_loses_then_reconnects(Fault::SizeZero, &size(0));
    assert_loses_then_reconnects(Fault::SizeNegative, &size(-1));
    assert_loses_then_reconnects(Fault::SizeHuge, &size(i32::MAX));
    assert_loses_then_reconnects(Fault::CutAfter20, "the connection was lost: closed by the other side");
    assert_loses_then_reconnects(Fault::Closing, "the connection was lost: the server closes (998)");
}

#[test]
fn units_that_somebody_changed_are_set_again() {
    let mut bench = ready(&[Planned::once(EmsconFault::UnitsChanged)]);
    bench.shoot();
    let rest = bench.run_for(Duration::from_secs(1));
    assert!(statuses(&rest).contains(&"the settings of the tracker were checked again and are right"));
    assert_recovered(&mut bench);
}

#[test]
fn a_shot_during_the_re_check_may_be_asked_for_again_at_once() {
    let mut bench = ready(&[Planned::once(EmsconFault::TryMode)]);
    bench.shoot();
    bench.trigger();
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Failed(_)));
    let words = "its settings were changed and are being checked".to_owned();
    assert_eq!(failure(&events), &Failure::NotReady(words));
    assert!(failure(&events).is_transient());
    assert_recovered(&mut bench);
}

#[test]
fn a_frame_or_a_reflector_that_somebody_changed_ends_the_link_because_points_no_longer_fit_together() {
    for (fault, words) in [
        (
            EmsconFault::FrameChanged,
            "the station orientation was changed; points before and after the change do not fit together",
        ),
        (
            EmsconFault::ReflectorChanged,
            "reflector: expected 'SIMULATED RRR 1.5in' (0), surface offset 19.0500 mm, the tracker uses 'SIMULATED RRR 0.5in' (1), surface offset \
             6.3500 mm; points with different reflectors do not fit together",
        ),
    ] {
        let mut bench = ready(&[Planned::once(fault)]);
        assert!(matches!(failure(&bench.shoot()), Failure::Settings(_)));
        let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
        assert_eq!(failure(&events), &Failure::Settings(words.to_owned()));
    }
}

#[test]
fn settings_that_do_not_stick_end_the_set_up() {
    for (fault, words) in [
        (EmsconFault::Metres, "units: requested mm, rad, \u{b0}C, mbar, %RH, read back m, rad, \u{b0}C, mbar, %RH"),
        (EmsconFault::TryStuck, "the try mode cannot be switched off"),
    ] {
        let mut bench = bench(&[Planned::once(fault)]);
        let events = bench.settle();
        assert_eq!(events, [ProtocolEvent::Lost(Failure::Settings(words.to_owned()))]);
        assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))));
        assert_recovered(&mut bench);
    }
}

#[test]
fn a_second_program_is_told_that_the_tracker_is_in_use() {
    let mut bench = bench(&[Planned::once(EmsconFault::InUse)]);
    let events = bench.settle();
    assert!(matches!(failure(&events), Failure::InUse(_)), "{events:?}");
    assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))));
}

#[test]
fn a_laser_that_warms_up_is_waited_for() {
    let mut bench = bench(&[Planned::from(EmsconFault::WarmingUp, 1, 3)]);
    let events = bench.settle();
    assert_eq!(statuses(&events), ["the laser is warming up; waiting until it is ready"; 3]);
    assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))));
    assert_eq!(bench.elapsed(), Duration::from_secs(15));
}

#[test]
fn what_an_instrument_does_not_know_is_a_warning_where_points_do_not_depend_on_it() {
    let mut bench = bench(&[Planned::always(EmsconFault::NoStationary)]);
    let events = bench.settle();
    let Some(ProtocolEvent::Ready(identity)) = events.last() else { panic!("{events:?}") };
    let words = "setting the measurement time: not implemented in this instrument (2); continued without it";
    assert_eq!(identity.warnings, [words]);
    assert_recovered(&mut bench);
}

#[test]
fn a_tracker_that_keeps_its_own_duration_is_no_cause_for_a_warning() {
    let mut bench = bench(&[Planned::always(EmsconFault::OwnTime)]);
    let events = bench.settle();
    let Some(ProtocolEvent::Ready(identity)) = events.last() else { panic!("{events:?}") };
    assert_eq!(identity.warnings, Vec::<String>::new());
    let said = "measurement time: 2500 ms, distance meter 0 (read back), which the tracker chooses";
    assert!(identity.checked.iter().any(|text| text == said), "{identity:?}");
    assert_recovered(&mut bench);
}

#[test]
fn a_scale_of_the_tracker_ends_the_set_up_and_a_shift_is_a_warning() {
    let mut unused = ready(&[Planned::once(EmsconFault::UnusedScale)]);
    let Some(ProtocolEvent::Ready(identity)) = unused.settle().pop() else { panic!() };
    assert_eq!(identity.warnings, Vec::<String>::new());
    assert_recovered(&mut unused);
    let mut scaled = bench(&[Planned::once(EmsconFault::Scaled)]);
    let events = scaled.settle();
    let failure = failure(&events);
    assert_eq!(*failure, Failure::Scaled(1.0001));
    assert!(failure.to_string().contains("scale 1.0001"), "{failure}");
    assert!(failure.hint().contains("map projection, ppm) to 1"), "{}", failure.hint());
    let mut moved = bench(&[Planned::once(EmsconFault::Moved)]);
    let events = moved.settle();
    let Some(ProtocolEvent::Ready(identity)) = events.last() else { panic!("{events:?}") };
    let warning =
        "the tracker transforms its points (scale 1): distances stay right, but points are not in its own frame";
    assert_eq!(identity.warnings, [warning]);
}

#[test]
fn a_scale_that_is_applied_later_ends_the_link() {
    let mut bench = ready(&[Planned::once(EmsconFault::UnusedScale)]);
    // What another program does: the settings with the transformation applied, and the announcement of it.
    bench.simulator.apply_transformation();
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    let Failure::Settings(why) = failure(&events) else { panic!("{events:?}") };
    assert!(why.contains("another frame is applied"), "{why}");
}

#[test]
fn a_result_that_nobody_asked_for_is_offered_and_never_the_shot() {
    let mut bench = ready(&[Planned::once(EmsconFault::Early)]);
    let events = bench.shoot();
    let [ProtocolEvent::Offered(offered), ProtocolEvent::Shot(shot)] = events.as_slice() else { panic!("{events:?}") };
    assert!((offered.point - MockCell::point(0)).norm() < 1e-12);
    assert!((shot.point - MockCell::point(1)).norm() < 1e-12);
}

#[test]
fn a_tracker_that_says_nothing_any_more_fails_the_shot_and_then_the_link() {
    let mut bench = ready(&[Planned::once(EmsconFault::Mute)]);
    let events = bench.shoot();
    assert_eq!(events, [ProtocolEvent::Failed(Failure::Silent { what: "measuring".to_owned(), seconds: 30.0 })]);
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    assert_eq!(events.len(), 1);
    assert_eq!(bench.elapsed(), Duration::from_mins(1));
    assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))));
}

#[test]
fn an_idle_link_notices_a_peer_that_is_gone() {
    let mut bench = ready(&[]);
    bench.unplug();
    let events = bench.run_for(Duration::from_secs(36));
    let what = "reading the tracker status".to_owned();
    assert_eq!(events, [ProtocolEvent::Lost(Failure::Silent { what, seconds: 30.0 })]);
}

#[test]
fn a_change_that_never_ends_is_said() {
    let mut bench = bench_with(EmsconOptions::default(), &[]);
    bench.settle();
    let changed = [[0x0c, 0, 0, 0], [8, 0, 0, 0], [6, 0, 0, 0]].concat();
    for _ in 0..40 {
        bench.protocol.feed(&changed, bench.now);
        // Units are read first, so the second change comes when they were read already.
        bench.step();
        bench.step();
    }
    let events = bench.run_for(Duration::from_secs(1));
    let words = "another program keeps changing the settings of the tracker".to_owned();
    assert_eq!(events.last(), Some(&ProtocolEvent::Lost(Failure::Settings(words))));
}

/// Faults in any order and number. A shift is no fault of the link but a setting that it warns of.
fn any_faults() -> impl Strategy<Value = Vec<Planned<EmsconFault>>> {
    let fault = prop::sample::select(EmsconFault::ALL).prop_filter("warned of", |fault| *fault != EmsconFault::Moved);
    let planned = (fault, 1_u32..6, 1_u32..3).prop_map(|(fault, first, times)| Planned::from(fault, first, times));
    prop::collection::vec(planned, 0..8)
}

proptest! {
    #[test]
    fn whatever_goes_wrong_a_shot_is_the_point_that_was_measured_for_it(faults in any_faults()) {
        let mut bench = bench(&faults);
        let mut is_ready = false;
        for _ in 0..12 {
            if !is_ready {
                is_ready = matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_)));
                continue;
            }
            let events = bench.shoot();
            let answers = events.iter().filter(|event| matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_)));
            prop_assert!(answers.count() <= 1);
            if let Some(ProtocolEvent::Shot(shot)) = events.last() {
                let error = (shot.point - MockCell::point(bench.cell.shots - 1)).norm();
                prop_assert!(error < 1e-12, "{error} m beside the point");
            }
            let rest = bench.run_for(Duration::from_mins(1));
            is_ready = !events.iter().chain(&rest).any(|event| matches!(event, ProtocolEvent::Lost(_)));
        }
    }
}

#[test]
fn what_is_no_tracker_is_told_by_its_first_bytes() {
    for (first, part) in [
        (&b"HTTP/1.1 400 Bad Request\r\n"[..], "begin with `HTTP/1.1 400 Bad`"),
        (b"SSH-2.0-OpenSSH", "begin with `SSH-2.0"),
        // A refused version of RTDE.
        (&[0, 4, b'V', 0], "does not use emScon"),
        // A size that may be, a type that no firmware has.
        (&[0x20, 0, 0, 0, b't', b'e', b'x', b't'], "does not use emScon"),
    ] {
        let mut protocol = Emscon::default();
        protocol.start(Duration::ZERO);
        protocol.feed(first, Duration::ZERO);
        let lost = std::iter::from_fn(|| protocol.next_event()).last();
        let Some(ProtocolEvent::Lost(failure @ Failure::Foreign(why))) = &lost else { panic!("{lost:?}") };
        assert!(why.contains(part), "{why}");
        assert!(failure.hint().contains("check the kind of instrument and the port"), "{}", failure.hint());
    }
}

#[test]
fn what_takes_the_connection_and_says_nothing_is_told_soon() {
    let mut protocol = Emscon::default();
    protocol.start(Duration::ZERO);
    protocol.tick(Duration::from_secs(8));
    let lost = std::iter::from_fn(|| protocol.next_event()).last();
    let Some(ProtocolEvent::Lost(Failure::Foreign(why))) = lost else { panic!("{lost:?}") };
    assert_eq!(why, "it accepted the connection but did not answer the first command within 8 s");
}
