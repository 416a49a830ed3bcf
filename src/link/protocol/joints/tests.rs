//! Tests of joint lines: what is read, what is refused, faults, splits, noise.

use std::time::Duration;

use super::{AngleUnit, JointLine, JointLines};
use crate::link::protocol::lines::MAX_LINE;
use crate::link::protocol::{Failure, Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::Bench;
use crate::link::simulator::bench::fuzz::{Bounds, fuzz_protocol};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::fault::Planned;
use crate::link::simulator::joints::{JointsFault, JointsSimulator};

type JointsBench = Bench<JointLines, JointsSimulator>;

fn bench(faults: &[Planned<JointsFault>]) -> JointsBench {
    Bench::new(JointLines::default(), JointsSimulator::new(faults.to_vec()))
}

fn close(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-8)
}

#[test]
fn lines_as_documented_are_read() {
    let line = JointLine::read(b"J,10.0,-20.0,30.0,-40.0,50.0,60.0,deg,0").unwrap();
    assert!(close(&line.positions, &[10.0, -20.0, 30.0, -40.0, 50.0, 60.0].map(f64::to_radians)));
    assert_eq!((line.unit, line.stopped, line.time), (AngleUnit::Degree, None, None));
    let line = JointLine::read(b"J, 0.1 ,-0.2,0.3,1e-1,0,6,rad , 0,12.345").unwrap();
    assert!(close(&line.positions, &[0.1, -0.2, 0.3, 0.1, 0.0, 6.0]));
    assert_eq!(line.time, Some(12.345));
    let line = JointLine::read(b"J,1200.5mm,10,0,0,0,0,0,deg,protective stop").unwrap();
    assert!((line.positions[0] - 1.2005).abs() < 1e-12 && line.positions.len() == 7);
    assert_eq!(line.stopped.as_deref(), Some("protective stop"));
}

#[test]
fn what_is_ambiguous_or_broken_is_refused() {
    for (line, part) in [
        (&b"10,20,30,40,50,60,deg,0"[..], "begin with"),
        (b"J,10,20,30,40,50,60,0", "'deg' or 'rad'"),
        (b"J,10,20,30,40,50,60,deg", "the status"),
        (b"J,10,20,30,40,50,60,deg,", "status is empty"),
        (b"J,10,20,30,40,50,60,deg,0,1,2", "perhaps a time"),
        (b"J,10,20,30,40,50,60,deg,0,noon", "not a number"),
        (b"J,10,20,30,40,50,nan,deg,0", "not a number"),
        (b"J,10,20,30,40,50,inf,deg,0", "not a number"),
        (b"J,1;0,20,30,40,50,60,deg,0", "not a number"),
        (b"J,,20,30,40,50,60,deg,0", "not a number"),
        (b"J,10,20,30,40,50,60,rad,0", "not a joint value in rad"),
        (b"J,10,deg,0", "1 joint values"),
        (b"J,\xff,deg,0", "not plain text"),
    ] {
        let error = JointLine::read(line).unwrap_err();
        assert!(error.contains(part), "{}: {error}", String::from_utf8_lossy(line));
    }
}

#[test]
fn the_joints_of_the_robot_arrive_and_the_source_is_named() {
    for fault in [None, Some(JointsFault::Radians), Some(JointsFault::Untimed), Some(JointsFault::Halves)] {
        let faults: Vec<_> = fault.into_iter().map(|fault| Planned::from(fault, 1, 3)).collect();
        let mut bench = bench(&faults);
        let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!("{fault:?}") };
        assert_eq!(identity.name, "SIMULATED controller");
        let events = bench.run_for(Duration::from_secs(1));
        assert!(joint_states(&events).len() >= 5, "{events:?}");
        assert!(joint_states(&events).iter().all(|state| close(&state.positions, &bench.cell.joints.positions)));
    }
}

#[test]
fn a_status_stops_and_broken_lines_are_skipped() {
    let mut stopped = bench(&[Planned::from(JointsFault::Stopped, 3, 2)]);
    stopped.settle();
    let events = stopped.run_for(Duration::from_secs(1));
    let words: Vec<Option<&str>> = joint_states(&events).iter().map(|state| state.stopped.as_deref()).collect();
    assert_eq!(words.iter().flatten().collect::<Vec<_>>(), [&"protective stop"; 2]);
    for fault in
        [JointsFault::Cut, JointsFault::NotANumber, JointsFault::WrongUnit, JointsFault::NoUnit, JointsFault::Noise]
    {
        let mut bench = bench(&[Planned::from(fault, 3, 4)]);
        bench.settle();
        let events = bench.run_for(Duration::from_secs(2));
        assert_eq!(joint_states(&events).len(), 17, "{fault}: {events:?}");
        assert!(
            joint_states(&events).iter().all(|state| close(&state.positions, &bench.cell.joints.positions)),
            "{fault}"
        );
        assert!(format!("{events:?}").contains("3 lines in a row cannot be read"), "{fault}: {events:?}");
    }
}

#[test]
fn another_number_of_joints_or_silence_loses_the_link() {
    for (fault, part) in
        [(JointsFault::MissingJoint, "5 joint values, those before had 6"), (JointsFault::Silent, "no answer")]
    {
        let mut bench = bench(&[Planned::from(fault, 5, 60)]);
        bench.settle();
        let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
        let Some(ProtocolEvent::Lost(failure)) = events.last() else { panic!("{fault}: {events:?}") };
        assert!(failure.to_string().contains(part), "{fault}: {failure}");
    }
    let mut bench = bench(&[Planned::always(JointsFault::Silent)]);
    assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))));
    assert!(matches!(bench.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

fn conversation() -> JointsBench {
    let faults = JointsFault::ALL.iter().zip(2..).filter(|(fault, _)| **fault != JointsFault::MissingJoint);
    let mut bench = bench(&faults.map(|(fault, at)| Planned::at(*fault, at)).collect::<Vec<_>>());
    bench.settle();
    bench.run_for(Duration::from_secs(2));
    bench
}

#[test]
fn splits_change_nothing() {
    for tape in [conversation().tape, conversation().tape.joined()] {
        let events = assert_splits_change_nothing(JointLines::default, &tape);
        assert!(!joint_states(&events).is_empty(), "{events:?}");
    }
}

#[test]
fn noise_breaks_nothing() {
    let bounds = Bounds::of_protocol(MAX_LINE);
    fuzz_protocol(JointLines::default, &conversation().tape, JointLines::pending, bounds);
}

#[test]
fn nothing_is_ever_sent() {
    assert_eq!(conversation().sent, Vec::<Vec<u8>>::new());
    let mut lines = JointLines::default();
    lines.start(Duration::ZERO);
    assert_eq!(lines.next_output(), None);
}
