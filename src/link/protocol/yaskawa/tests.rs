//! Tests of the Yaskawa link: literal bytes, faults, splits, noise.

use std::time::Duration;

use super::{Answer, HEADER, MAX_CONTENT, PULSES, Yaskawa, YaskawaOptions, request};
use crate::link::protocol::{Failure, ProtocolEvent};
use crate::link::simulator::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::bench::{Bench, hex};
use crate::link::simulator::fault::Planned;
use crate::link::simulator::yaskawa::{PULSES_PER_DEGREE, YaskawaFault, YaskawaSimulator};

type YaskawaBench = Bench<Yaskawa, YaskawaSimulator>;

fn driver() -> Yaskawa {
    Yaskawa::new(YaskawaOptions { pulses_per_degree: PULSES_PER_DEGREE.to_vec() }).unwrap()
}

fn bench(faults: &[Planned<YaskawaFault>]) -> YaskawaBench {
    Bench::new(driver(), YaskawaSimulator::new(faults.to_vec()))
}

/// The bytes that public clients send and expect.
#[test]
fn a_request_and_an_answer_have_their_bytes() {
    let expected =
        [b"YERC".to_vec(), hex("2000 0000 03 01 00 05 00000000"), b"99999999".to_vec(), hex("7500 0100 00 01 0000")];
    assert_eq!(request(5, PULSES), expected.concat());
    let answer = |part: &str, content: &[u8]| {
        let length = u8::try_from(content.len()).unwrap();
        let head = [b"YERC".to_vec(), hex("2000"), vec![length, 0], hex("03 01 01 05 00000080"), b"99999999".to_vec()];
        [head.concat(), hex(part), content.to_vec()].concat()
    };
    let good = answer("81 00 00 00 0000 0000", &[1, 2, 3, 4]);
    assert_eq!(Answer::read(&good), Ok(Some((Answer { id: 5, content: Ok(vec![1, 2, 3, 4]) }, HEADER + 4))));
    let refused = answer("81 1F 02 00 40B0 0000", &[]);
    assert_eq!(Answer::read(&refused), Ok(Some((Answer { id: 5, content: Err((0x1f, 0xb040)) }, HEADER))));
    for cut in 0..good.len() {
        assert_eq!(Answer::read(&good[..cut]), Ok(None), "{cut}");
    }
}

#[test]
fn pulses_become_angles_only_with_their_scale() {
    let error = Yaskawa::new(YaskawaOptions::default()).unwrap_err();
    assert!(error.contains("pulses_per_degree"), "{error}");
    assert!(Yaskawa::new(YaskawaOptions { pulses_per_degree: vec![1000.0, 0.0] }).is_err());
    let driver = Yaskawa::new(YaskawaOptions { pulses_per_degree: vec![1000.0, -500.0] }).unwrap();
    let content: Vec<u8> = [0, 0, 0, 0, 0, 90_000, 90_000, 7].into_iter().flat_map(i32::to_le_bytes).collect();
    let degrees: Vec<f64> =
        driver.positions(&content).unwrap().iter().map(|angle| angle.to_degrees().round()).collect();
    assert_eq!(degrees, [90.0, -180.0]);
}

#[test]
fn the_joints_of_the_robot_arrive_many_times_a_second() {
    let mut bench = bench(&[]);
    let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!() };
    assert_eq!(identity.name, "Yaskawa controller, SIMULATED");
    let events = bench.run_for(Duration::from_secs(2));
    let states = joint_states(&events);
    assert!((30..45).contains(&states.len()), "{}", states.len());
    for state in states {
        for ((a, b), scale) in state.positions.iter().zip(&bench.cell.joints.positions).zip(PULSES_PER_DEGREE) {
            // Half a pulse, and the rounding of the numbers.
            assert!((a - b).abs() <= (0.5001 / scale.abs()).to_radians(), "{state:?}");
        }
    }
}

#[test]
fn faults_are_said_and_a_new_connection_is_good() {
    for (fault, part) in [
        (YaskawaFault::Cartesian, "data of kind 16"),
        (YaskawaFault::Short, "4 axes"),
        (YaskawaFault::HugeAnswer, "65000 bytes"),
        (YaskawaFault::NoMagic, "does not begin with YERC"),
    ] {
        bench(&[Planned::at(fault, 10)]).assert_loss_is_said(&fault, part);
    }
    // What is lost on the way is asked for again, and only silence ends the link.
    for fault in [YaskawaFault::Lost, YaskawaFault::WrongNumber, YaskawaFault::Truncated] {
        let mut bench = bench(&[Planned::from(fault, 10, 2)]);
        bench.settle();
        let events = bench.run_for(Duration::from_secs(3));
        assert!(!format!("{events:?}").contains("Lost"), "{fault}: {events:?}");
        assert!(joint_states(&events).len() > 20, "{fault}");
    }
    let mut silent = bench(&[Planned::from(YaskawaFault::Lost, 5, 1000)]);
    silent.settle();
    let events = silent.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))), "{events:?}");
    let mut now_and_then = bench(&[Planned::from(YaskawaFault::Refused, 5, 3)]);
    now_and_then.settle();
    let events = now_and_then.run_for(Duration::from_secs(2));
    assert_eq!(format!("{events:?}").matches("status 1Fh, added status B040h").count(), 1);
    let mut never = bench(&[Planned::always(YaskawaFault::Refused)]);
    assert!(matches!(never.settle().last(), Some(ProtocolEvent::Lost(Failure::Refused(_)))));
    assert!(matches!(never.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

fn conversation() -> YaskawaBench {
    let faults = [YaskawaFault::Refused, YaskawaFault::WrongNumber].into_iter().zip(4..);
    let mut bench = bench(&faults.map(|(fault, at)| Planned::at(fault, at)).collect::<Vec<_>>());
    bench.settle();
    bench.run_for(Duration::from_millis(1500));
    bench
}

#[test]
fn splits_change_nothing() {
    let events = assert_splits_change_nothing(driver, &conversation().tape);
    assert!(joint_states(&events).len() > 3, "{events:?}");
}

#[test]
fn noise_breaks_nothing() {
    let bench = conversation();
    fuzz_protocol(driver, &bench.tape, Yaskawa::pending, Bounds::of_protocol(HEADER + MAX_CONTENT));
    let bounds = Bounds { pending: HEADER, outputs: 512 };
    fuzz_simulator(|| YaskawaSimulator::new([]), &bench.sent, YaskawaSimulator::pending, bounds);
}
