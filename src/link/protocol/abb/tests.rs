//! Tests of the ABB link: the maker's published answer, digest and cookies, faults, splits, noise.

use std::time::Duration;

use super::super::http::MAX_RESPONSE;
use super::{Abb, AbbOptions, joint_angles};
use crate::link::protocol::{Failure, ProtocolEvent};
use crate::link::simulator::abb::{AbbFault, AbbSimulator};
use crate::link::simulator::bench::Bench;
use crate::link::simulator::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::fault::Planned;

type AbbBench = Bench<Abb, AbbSimulator>;

fn abb() -> Abb {
    Abb::new(AbbOptions::default()).unwrap()
}

fn bench(faults: &[Planned<AbbFault>]) -> AbbBench {
    Bench::new(abb(), AbbSimulator::new(faults.to_vec()))
}

#[test]
fn an_answer_in_the_published_form_is_read() {
    let content = "<li class=\"ms-jointtarget\" title=\"ROB_1\"><span class=\"rax_1\">10</span><span class=\"rax_2\">-15.5</span>\
                   <span class=\"rax_3\">1e1</span><span class=\"rax_4\"> 20 </span><span class=\"rax_5\">30</span>\n\
                   <span class=\"rax_6\">45</span><span class=\"eax_a\">8.9999998E+09</span></li>";
    assert_eq!(joint_angles(content), Ok([10.0, -15.5, 10.0, 20.0, 30.0, 45.0].map(f64::to_radians).to_vec()));
    for bad in ["", &content.replace("rax_6", "rax_7"), &content.replace("45", "NaN"), &content.replace("45", "")] {
        assert!(joint_angles(bad).is_err(), "{bad}");
    }
}

#[test]
fn options_that_would_break_a_request_are_refused() {
    let of = |user: &str, unit: &str| {
        Abb::new(AbbOptions { user: user.to_owned(), unit: unit.to_owned(), ..AbbOptions::default() })
    };
    assert!(of("operator", "ROB_2").is_ok());
    for (user, unit) in [("a\"b", "ROB_1"), ("a\r\nb", "ROB_1"), ("a", ""), ("a", "ROB_1/../x"), ("a", "ROB 1")] {
        assert!(of(user, unit).is_err(), "{user} {unit}");
    }
}

#[test]
fn the_joints_of_the_robot_arrive_within_one_session() {
    let mut bench = bench(&[]);
    assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))));
    let events = bench.run_for(Duration::from_secs(4));
    assert!(joint_states(&events).len() >= 18, "{}", joint_states(&events).len());
    bench.assert_joints(&joint_states(&events), 1e-8);
    bench.settle();
    assert_eq!(bench.simulator.sessions(), 1, "a new connection continues the session");
}

#[test]
fn faults_are_survived_or_said_and_a_new_connection_is_good() {
    for fault in [AbbFault::Halves, AbbFault::Chunked, AbbFault::NewChallenge, AbbFault::Busy] {
        let mut bench = bench(&[Planned::at(fault, 4)]);
        bench.settle();
        let events = bench.run_for(Duration::from_secs(4));
        assert!(joint_states(&events).len() >= 12, "{fault}: {events:?}");
        assert!(!events.iter().any(|event| matches!(event, ProtocolEvent::Lost(_))), "{fault}: {events:?}");
    }
    for (fault, part) in [
        (AbbFault::Unknown, "no mechanical unit 'ROB_1'"),
        (AbbFault::MissingAxis, "rax_1 to rax_6"),
        (AbbFault::NotANumber, "rax_1 to rax_6"),
        (AbbFault::Silent, "no answer"),
        (AbbFault::Closes, "closed the connection"),
        (AbbFault::DisconnectMidAnswer, "connection was lost"),
    ] {
        bench(&[Planned::at(fault, 4)]).assert_loss_is_said(&fault, part);
    }
}

#[test]
fn a_user_that_is_not_accepted_is_said_and_not_tried_for_ever() {
    let mut refused = bench(&[Planned::always(AbbFault::Refused)]);
    let Some(ProtocolEvent::Lost(Failure::Refused(why))) = refused.settle().pop() else { panic!() };
    assert_eq!(why, "the user 'Default User' or its password is not accepted");
    let options = AbbOptions { password: "other".to_owned(), ..AbbOptions::default() };
    let mut wrong = Bench::new(Abb::new(options).unwrap(), AbbSimulator::new([]));
    assert!(matches!(wrong.settle().pop(), Some(ProtocolEvent::Lost(Failure::Refused(_)))));
    assert!(matches!(wrong.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

fn conversation() -> AbbBench {
    let faults = [AbbFault::Halves, AbbFault::Chunked, AbbFault::NewChallenge].into_iter().zip(3..);
    let mut bench = bench(&faults.map(|(fault, at)| Planned::at(fault, at)).collect::<Vec<_>>());
    bench.settle();
    bench.run_for(Duration::from_secs(3));
    bench
}

#[test]
fn splits_change_nothing() {
    let events = assert_splits_change_nothing(abb, &conversation().tape);
    assert!(joint_states(&events).len() > 3, "{events:?}");
}

#[test]
fn noise_breaks_nothing() {
    let bench = conversation();
    fuzz_protocol(abb, &bench.tape, Abb::pending, Bounds::of_protocol(2 * MAX_RESPONSE));
    let bounds = Bounds { pending: 8192, outputs: 512 };
    fuzz_simulator(|| AbbSimulator::new([]), &bench.sent, AbbSimulator::pending, bounds);
}
