//! Tests of the KUKA link: literal bytes, faults, splits, noise.

use std::time::Duration;

use super::{Answer, Kuka, MAX_ANSWER, joint_angles, read_request};
use crate::link::protocol::{Failure, ProtocolEvent};
use crate::link::simulator::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::bench::{Bench, hex};
use crate::link::simulator::fault::Planned;
use crate::link::simulator::kuka::{KukaFault, KukaSimulator};

type KukaBench = Bench<Kuka, KukaSimulator>;

fn bench(faults: &[Planned<KukaFault>]) -> KukaBench {
    Bench::new(Kuka::default(), KukaSimulator::new(faults.to_vec()))
}

#[test]
fn a_request_and_an_answer_have_the_bytes_that_public_clients_send_and_expect() {
    // Number 1, 12 bytes, mode 0, a name of 9 bytes.
    assert_eq!(read_request(1, "$AXIS_ACT"), [hex("0001 000C 00 0009"), b"$AXIS_ACT".to_vec()].concat());
    let answer = [hex("00 0003"), b"100".to_vec(), hex("00 01 01")].concat();
    assert_eq!(Answer::read(7, &answer), Some(Answer { id: 7, value: Some("100".to_owned()) }));
    let refused = hex("00 0000 00 00 00");
    assert_eq!(Answer::read(7, &refused), Some(Answer { id: 7, value: None }));
    assert_eq!(Answer::read(7, &hex("00 0005 31")), None);
}

#[test]
fn values_of_the_axes_are_read_in_their_forms() {
    let value = "{E6AXIS: A1 10.0, A2 -90.0, A3 9.000000E+01, A4 0.0, A5 0.5, A6 -1, E1 0.0, E2 0.0}";
    let expected = [10.0, -90.0, 90.0, 0.0, 0.5, -1.0].map(f64::to_radians);
    assert_eq!(joint_angles(value), Ok(expected.to_vec()));
    assert_eq!(joint_angles(&value.replace("E6AXIS: ", "")), Ok(expected.to_vec()));
    for bad in
        ["", "{}", "A1 10.0", &value.replace("A6", "A7"), &value.replace("0.5", "1.#INF"), &value.replace('}', "")]
    {
        assert!(joint_angles(bad).is_err(), "{bad}");
    }
}

#[test]
fn the_joints_of_the_robot_arrive_twenty_times_a_second() {
    let mut bench = bench(&[]);
    let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!() };
    assert_eq!(identity.name, "KUKA controller, #KR_SIMULATED");
    let events = bench.run_for(Duration::from_secs(2));
    let states = joint_states(&events);
    assert!((30..45).contains(&states.len()), "{}", states.len());
    bench.assert_joints(&states, 1e-8);
}

#[test]
fn faults_are_said_and_a_new_connection_is_good() {
    for (fault, part) in [
        (KukaFault::WrongNumber, "no answer"),
        (KukaFault::MissingAxis, "not a value of $AXIS_ACT"),
        (KukaFault::NotANumber, "not a value of $AXIS_ACT"),
        (KukaFault::ShortValue, "too short"),
        (KukaFault::HugeAnswer, "65000 bytes"),
        (KukaFault::Silent, "no answer"),
        (KukaFault::DisconnectMidAnswer, "connection was lost"),
    ] {
        bench(&[Planned::at(fault, 10)]).assert_loss_is_said(&fault, part);
    }
    let mut halves = bench(&[Planned::at(KukaFault::Halves, 5)]);
    halves.settle();
    assert!(joint_states(&halves.run_for(Duration::from_secs(2))).len() > 15);
    let mut now_and_then = bench(&[Planned::from(KukaFault::Unreadable, 5, 3)]);
    now_and_then.settle();
    let events = now_and_then.run_for(Duration::from_secs(2));
    assert_eq!(format!("{events:?}").matches("cannot be read now").count(), 1);
    assert!(joint_states(&events).len() > 15);
    let mut never = bench(&[Planned::always(KukaFault::Unreadable)]);
    assert!(matches!(never.settle().last(), Some(ProtocolEvent::Lost(Failure::Refused(_)))));
    assert!(matches!(never.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

fn conversation() -> KukaBench {
    let faults = [KukaFault::Halves, KukaFault::Unreadable].into_iter().zip(4..);
    let mut bench = bench(&faults.map(|(fault, at)| Planned::at(fault, at)).collect::<Vec<_>>());
    bench.settle();
    bench.run_for(Duration::from_millis(1500));
    bench
}

#[test]
fn splits_change_nothing() {
    let events = assert_splits_change_nothing(Kuka::default, &conversation().tape);
    assert!(joint_states(&events).len() > 3, "{events:?}");
}

#[test]
fn noise_breaks_nothing() {
    let bench = conversation();
    fuzz_protocol(Kuka::default, &bench.tape, Kuka::pending, Bounds::of_protocol(MAX_ANSWER + 4));
    let bounds = Bounds { pending: 4096, outputs: 512 };
    fuzz_simulator(|| KukaSimulator::new([]), &bench.sent, KukaSimulator::pending, bounds);
}
