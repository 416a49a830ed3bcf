//! Tests of the FANUC link: literal lines, faults, splits, noise.

use std::time::Duration;

use super::{Fanuc, FanucOptions, Message};
use crate::link::protocol::lines::MAX_LINE;
use crate::link::protocol::{Failure, Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::bench::{Bench, START};
use crate::link::simulator::fanuc::{FanucFault, FanucSimulator};
use crate::link::simulator::fault::Planned;

type FanucBench = Bench<Fanuc, FanucSimulator>;

fn bench(faults: &[Planned<FanucFault>]) -> FanucBench {
    Bench::new(Fanuc::default(), FanucSimulator::new(faults.to_vec()))
}

/// Forms of lines that public clients send and expect.
#[test]
fn the_conversation_is_that_of_public_clients() {
    let mut driver = Fanuc::default();
    driver.start(START);
    assert_eq!(driver.next_output().unwrap(), b"{\"Communication\":\"FRC_Connect\"}\r\n");
    driver.feed(b"{\"Communication\":\"FRC_Connect\",\"ErrorID\":0,\"PortNumber\":16002,\"MajorVersion\":6,\"MinorVersion\":1}\r\n", START);
    assert_eq!((driver.next_redirect(), driver.next_redirect()), (Some(16002), None));
    assert_eq!(driver.next_output().unwrap(), b"{\"Command\":\"FRC_ReadJointAngles\",\"Group\":1}\r\n");
    driver.feed(b"{ \"Command\" : \"FRC_ReadJointAngles\", \"ErrorID\" : 0, \"TimeTag\" : 7, \"JointAngle\" : { \"J1\" : 63.252, \"J2\": 31.5, \"J3\": -35.6, \"J4\": 18.5, \"J5\": -101.3, \"J6\": 108.65, \"J7\": 0.0, \"J8\": 0, \"J9\": 0 }, \"Group\" : 1 }\n", START);
    let Some(ProtocolEvent::Ready(identity)) = driver.next_event() else { panic!() };
    assert_eq!(identity.name, "FANUC controller, RMI 6.1");
    let Some(ProtocolEvent::Joints(state)) = driver.next_event() else { panic!() };
    let expected = [63.252, 31.5, -35.6, 18.5, -101.3, 108.65].map(f64::to_radians);
    assert_eq!(state.positions, expected);
}

#[test]
fn j3_is_converted_only_where_the_controller_counts_it_from_the_upper_arm() {
    let line =
        br#"{"Command":"FRC_ReadJointAngles","ErrorID":0,"JointAngles":{"J1":1,"J2":20,"J3":5,"J4":4,"J5":5,"J6":6}}"#;
    let message = Message::read(line).unwrap();
    let degrees = |options| {
        let angles = message.joint_angles(options).unwrap();
        angles.iter().map(|angle: &f64| (angle.to_degrees() * 1e9).round() / 1e9).collect::<Vec<_>>()
    };
    assert_eq!(degrees(FanucOptions::default()), [1.0, 20.0, 5.0, 4.0, 5.0, 6.0]);
    let relative = FanucOptions { j3_from_upper_arm: true, ..FanucOptions::default() };
    assert_eq!(degrees(relative), [1.0, 20.0, -15.0, 4.0, 5.0, 6.0]);
    for bad in [&b"{}"[..], b"[1]", b"null", b"{\"Command\":7}", b"\xff"] {
        assert!(Message::read(bad).is_err());
    }
}

#[test]
fn the_joints_of_the_robot_arrive_many_times_a_second() {
    let mut bench = bench(&[]);
    assert!(matches!(bench.settle().pop(), Some(ProtocolEvent::Ready(_))));
    let events = bench.run_for(Duration::from_secs(2));
    let states = joint_states(&events);
    assert!((30..45).contains(&states.len()), "{}", states.len());
    bench.assert_joints(&states, 1e-12);
}

#[test]
fn faults_are_said_and_a_new_connection_is_good() {
    for (fault, part) in [
        (FanucFault::MissingJoint, "no angles J1 to J6"),
        (FanucFault::NotANumber, "no angles J1 to J6"),
        (FanucFault::NoJson, "is not a message"),
        (FanucFault::Terminate, "has ended the connection"),
        (FanucFault::Silent, "no answer"),
        (FanucFault::DisconnectMidAnswer, "connection was lost"),
    ] {
        bench(&[Planned::at(fault, 10)]).assert_loss_is_said(&fault, part);
    }
    for (fault, part) in [
        (FanucFault::Refused, "FRC_Connect: error"),
        (FanucFault::NoPort, "has no port"),
        (FanucFault::NoJson, "does not answer like the Remote Motion Interface"),
    ] {
        let mut bench = bench(&[Planned::at(fault, 1)]);
        let Some(ProtocolEvent::Lost(failure)) = bench.settle().pop() else { panic!("{fault}") };
        assert!(failure.to_string().contains(part), "{fault}: {failure}");
    }
    let mut halves = bench(&[Planned::at(FanucFault::Halves, 5), Planned::at(FanucFault::OldName, 6)]);
    halves.settle();
    assert!(joint_states(&halves.run_for(Duration::from_secs(2))).len() > 15);
    let mut now_and_then = bench(&[Planned::from(FanucFault::Refused, 5, 3), Planned::at(FanucFault::SystemFault, 9)]);
    now_and_then.settle();
    let events = now_and_then.run_for(Duration::from_secs(2));
    let said = format!("{events:?}");
    assert_eq!((said.matches("cannot be read now").count(), said.matches("reports a fault").count()), (1, 1));
    assert!(joint_states(&events).len() > 15);
    assert!(matches!(now_and_then.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

fn conversation() -> FanucBench {
    let faults = [FanucFault::Halves, FanucFault::OldName, FanucFault::SystemFault].into_iter().zip(4..);
    let mut bench = bench(&faults.map(|(fault, at)| Planned::at(fault, at)).collect::<Vec<_>>());
    bench.settle();
    bench.run_for(Duration::from_millis(1500));
    bench
}

#[test]
fn splits_change_nothing() {
    let events = assert_splits_change_nothing(Fanuc::default, &conversation().tape);
    assert!(joint_states(&events).len() > 3, "{events:?}");
}

#[test]
fn noise_breaks_nothing() {
    let bench = conversation();
    fuzz_protocol(Fanuc::default, &bench.tape, Fanuc::pending, Bounds::of_protocol(MAX_LINE));
    let bounds = Bounds { pending: MAX_LINE, outputs: 512 };
    fuzz_simulator(|| FanucSimulator::new([]), &bench.sent, FanucSimulator::pending, bounds);
}
