//! Tests of the robot link: literal bytes, the stream, faults, cut and damaged streams.

use std::time::Duration;

use super::packet::{
    Field, Framer, Packet, PacketError, Record, TextMessage, encode, packet_type, request_version, set_up_outputs,
};
use super::{Rtde, RtdeOptions};
use crate::link::protocol::outbox::MAX_JOINTS;
use crate::link::protocol::rest::RestDetector;
use crate::link::protocol::{Failure, Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::fuzz::{Bounds, assert_hangs_up_once, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::robots::joint_states;
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::bench::{Bench, START, Tape};
use crate::link::simulator::fault::Planned;
use crate::link::simulator::rtde::{RtdeFault, RtdeSimulator};

type RtdeBench = Bench<Rtde, RtdeSimulator>;

fn bench(faults: &[Planned<RtdeFault>]) -> RtdeBench {
    Bench::new(Rtde::default(), RtdeSimulator::new(faults.to_vec()))
}

/// A bench whose stream has been started.
fn ready(faults: &[Planned<RtdeFault>]) -> RtdeBench {
    let mut bench = bench(faults);
    let events = bench.settle();
    assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))), "{events:?}");
    bench
}

fn decode(bytes: &[u8]) -> Packet {
    let mut framer = Framer::default();
    framer.feed(bytes);
    let (kind, content) = framer.next_packet().unwrap().unwrap();
    assert_eq!(framer.pending(), 0);
    Packet::decode(kind, &content).unwrap()
}

#[test]
fn requests_have_the_bytes_of_the_published_examples() {
    assert_eq!(request_version(), [0x00, 0x05, 0x56, 0x00, 0x02]);
    let head = [0x00, 0x1d, 0x4f, 0x40, 0x5f, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00];
    assert_eq!(set_up_outputs(125.0, &["timestamp", "actual_q"]), [&head[..], b"timestamp,actual_q"].concat());
    assert_eq!(encode(packet_type::CONTROL_PACKAGE_START, &[]), [0x00, 0x03, 0x53]);
}

#[test]
fn answers_read_as_published() {
    assert_eq!(decode(&[0x00, 0x04, 0x56, 0x01]), Packet::ProtocolVersion(true));
    assert_eq!(decode(&[0x00, 0x04, 0x56, 0x00]), Packet::ProtocolVersion(false));
    assert_eq!(decode(&[0x00, 0x04, 0x53, 0x01]), Packet::Started(true));
    let outputs = [&[0x00, 0x13, 0x4f, 0x01][..], b"DOUBLE,VECTOR6D"].concat();
    assert_eq!(
        decode(&outputs),
        Packet::Outputs { recipe: 1, types: vec!["DOUBLE".to_owned(), "VECTOR6D".to_owned()] }
    );
    let values: Vec<u8> = (0..7).flat_map(|number| f64::from(number).to_be_bytes()).collect();
    let data = [&[0x00, 0x3c, 0x55, 0x01][..], &values].concat();
    assert_eq!(data.len(), 60);
    assert_eq!(decode(&data), Packet::Data { recipe: 1, values });
    let version = [0, 19, 118, 0, 0, 0, 5, 0, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0, 108];
    assert_eq!(decode(&version), Packet::ControllerVersion([5, 11, 0, 108]));
    let text = [0, 10, 77, 3, b'a', 0x1b, b'c', 1, b'x', 1];
    let expected = TextMessage { text: "a\u{fffd}c".to_owned(), source: "x".to_owned(), level: 1 };
    assert_eq!(decode(&text), Packet::Text(expected));
}

#[test]
fn packets_that_cannot_be_are_errors() {
    for size in 0..3_u8 {
        let mut framer = Framer::default();
        framer.feed(&[0, size]);
        assert_eq!(framer.next_packet(), Err(PacketError::Size(u16::from(size))));
    }
    for (kind, content) in
        [(b'V', &[][..]), (b'v', &[0; 15]), (b'M', &[5, b'a']), (b'O', &[]), (b'U', &[]), (b'S', &[])]
    {
        assert!(matches!(Packet::decode(kind, content), Err(PacketError::Short { .. })), "{kind}");
    }
    assert_eq!(Record::decode(&Record::FIELDS, &[0; 63]), None);
    assert_eq!(Record::decode(&Record::FIELDS, &[0; 65]), None);
}

#[test]
fn values_stand_in_the_order_in_which_they_were_asked_for() {
    let mut bytes: Vec<u8> = (0..7).flat_map(|number| f64::from(number).to_be_bytes()).collect();
    bytes.extend([0, 0, 0, 7, 0xff, 0xff, 0xff, 0xfe]);
    let expected = Record {
        timestamp: 0.0,
        actual_q: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        robot_mode: Some(7),
        safety_status: Some(-2),
    };
    assert_eq!(Record::decode(&Record::FIELDS, &bytes), Some(expected));
    let without_mode = [Field::ActualQ, Field::SafetyMode, Field::Timestamp];
    let bytes = [&bytes[8..56], &[0, 0, 0, 5], &1.5_f64.to_be_bytes()].concat();
    let expected = Record { timestamp: 1.5, robot_mode: None, safety_status: Some(5), ..expected };
    assert_eq!(Record::decode(&without_mode, &bytes), Some(expected));
}

#[test]
fn the_stream_brings_the_joints_of_the_robot_at_the_frequency_that_was_asked_for() {
    let mut bench = ready(&[]);
    let events = bench.run_for(Duration::from_secs(2));
    let states = joint_states(&events);
    assert_eq!((events.len(), states.len()), (50, 50));
    for state in states {
        assert_eq!(state.positions, bench.cell.joints.positions);
        assert_eq!((&state.stopped, &state.remark), (&None, &None));
    }
    let name = "Universal Robots controller, version 5.11.0.108";
    let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!() };
    assert_eq!(identity.name, name);
}

#[test]
fn a_frequency_beyond_the_limits_is_taken_to_the_limit() {
    for (asked, used) in [(500.0, 25.0), (0.0, 1.0), (f64::NAN, 1.0), (8.0, 8.0)] {
        let rtde = Rtde::new(RtdeOptions { frequency: asked, ..RtdeOptions::default() });
        assert!((rtde.options.frequency - used).abs() < 1e-12, "{asked}");
    }
    let slow = Rtde::new(RtdeOptions { frequency: 1.0, ..RtdeOptions::default() });
    let mut bench = Bench::new(slow, RtdeSimulator::new(Vec::new()));
    bench.settle();
    assert_eq!(joint_states(&bench.run_for(Duration::from_secs(10))).len(), 10);
}

#[test]
fn a_robot_has_no_shots() {
    let mut bench = ready(&[]);
    assert!(matches!(bench.shoot().last(), Some(ProtocolEvent::Failed(Failure::Refused(_)))));
}

#[test]
fn refusals_end_the_set_up_with_the_reason_and_a_new_connection_is_good() {
    let cases = [
        (
            RtdeFault::OldProtocol,
            "the instrument refused: version 2 of the interface, which PolyScope has from 3.4 on; update the software of the \
             controller",
        ),
        (RtdeFault::NotFound, "the instrument refused: the controller does not know actual_q"),
        (RtdeFault::InUse, "the instrument is in use by another program (another program uses actual_q)"),
        (
            RtdeFault::WrongType,
            "cannot read the data from the instrument: unexpected types of the values: \
             DOUBLE,VECTOR6INT32,INT32,INT32",
        ),
        (RtdeFault::StartRefused, "the instrument refused: the controller does not start the stream"),
    ];
    for (fault, words) in cases {
        let mut bench = bench(&[Planned::once(fault)]);
        let events = bench.settle();
        let [ProtocolEvent::Lost(failure)] = events.as_slice() else { panic!("{fault}: {events:?}") };
        assert_eq!(failure.to_string(), words);
        assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))), "{fault}");
    }
}

#[test]
fn faults_of_the_stream_lose_the_link_and_a_new_connection_is_good() {
    let cases = [
        (RtdeFault::Silence, "no answer from the instrument for 1 s while waiting for joint values"),
        (RtdeFault::Cut, "the connection was lost: closed by the other side"),
        (
            RtdeFault::SizeZero,
            "cannot read the data from the instrument: a packet of 0 bytes was announced; the smallest has three, so the stream is out \
             of sync",
        ),
        (
            RtdeFault::ShortData,
            "cannot read the data from the instrument: a data packet has 60 bytes of values instead of 64",
        ),
    ];
    for (fault, words) in cases {
        let mut bench = ready(&[Planned::from(fault, 10, 1)]);
        let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
        let Some(ProtocolEvent::Lost(failure)) = events.last() else { panic!("{fault}: {events:?}") };
        assert_eq!(failure.to_string(), words);
        assert_eq!(joint_states(&events).len(), 9, "{fault}");
        assert!(matches!(bench.settle().last(), Some(ProtocolEvent::Ready(_))), "{fault}");
        assert_eq!(joint_states(&bench.run_for(Duration::from_secs(1))).len(), 25, "{fault}");
    }
}

#[test]
fn data_of_another_recipe_are_skipped_and_count_as_silence() {
    let mut bench = ready(&[Planned::always(RtdeFault::WrongRecipe)]);
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    assert_eq!(joint_states(&events).len(), 0);
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))));
    let mut bench = ready(&[Planned::from(RtdeFault::WrongRecipe, 2, 1)]);
    assert_eq!(joint_states(&bench.run_for(Duration::from_secs(1))).len(), 24);
}

#[test]
fn a_stop_a_mode_and_a_broken_number_are_said_and_the_stream_goes_on() {
    let cases = [
        (RtdeFault::ProtectiveStop, vec!["safety status: protective stop (3)", "safety status: normal (1)"], 50),
        (RtdeFault::PowerOff, vec!["robot mode: power off (3)", "robot mode: running (7)"], 50),
        (RtdeFault::NotFinite, vec!["the controller reported a joint value that is not a finite number"; 5], 45),
    ];
    for (fault, expected, states) in cases {
        let mut bench = ready(&[Planned::from(fault, 10, 5)]);
        let events = bench.run_for(Duration::from_secs(2));
        let said = events.iter().filter_map(|event| match event {
            ProtocolEvent::Status(status) => Some(status.text.as_str()),
            _ => None,
        });
        assert_eq!(said.collect::<Vec<_>>(), expected);
        let stopped = joint_states(&events).iter().filter(|state| state.stopped.is_some()).count();
        assert_eq!(stopped, if fault == RtdeFault::ProtectiveStop { 5 } else { 0 });
        assert_eq!(joint_states(&events).len(), states, "{fault}");
    }
}

#[test]
fn drip_and_a_flood_of_messages_change_nothing() {
    for fault in [RtdeFault::Drip, RtdeFault::TextFlood] {
        let mut bench = ready(&[Planned::once(fault)]);
        assert_eq!(joint_states(&bench.run_for(Duration::from_secs(2))).len(), 50, "{fault}");
    }
}

#[test]
fn a_robot_is_at_rest_half_a_second_after_it_stopped() {
    let mut bench = ready(&[Planned::from(RtdeFault::Moving, 11, 10), Planned::always(RtdeFault::NoisySpeeds)]);
    let events = bench.run_for(Duration::from_secs(3));
    let mut rest_detector = RestDetector::default();
    let states = joint_states(&events);
    let rests: Vec<bool> = states.iter().map(|state| rest_detector.feed(state)).collect();
    // 25 Hz: ten states at rest, ten moving, number 19 is the first that stays, and 13 intervals are more than 0.5 s.
    assert_eq!(rests.iter().position(|rest| *rest), Some(32));
    assert!(rests[32..].iter().all(|rest| *rest));
    assert!((states[74].positions[0] - states[0].positions[0] - 10.0 * 0.2 * 0.04).abs() < 1e-12);
}

#[test]
fn states_with_a_person_in_the_cell_can_be_measured_and_are_kept_as_a_remark() {
    for (fault, words) in [
        (RtdeFault::Reduced, "reduced (2)"),
        (RtdeFault::Safeguard, "safeguard stop (5)"),
        (RtdeFault::EnablingSwitch, "enabling switch released (13)"),
    ] {
        let mut bench = ready(&[Planned::always(fault)]);
        let events = bench.run_for(Duration::from_secs(1));
        for state in joint_states(&events) {
            assert_eq!((&state.stopped, state.remark.as_deref()), (&None, Some(words)));
        }
        let said = format!("safety status: {words}");
        assert!(events.iter().any(|event| matches!(event, ProtocolEvent::Status(status) if status.text == said)));
    }
    for (status, forbidden) in (0..30).zip([
        false, false, false, true, false, false, true, true, true, true, false, false, false, false, false, true,
        false, false, false, false, true, false, false, false, false, false, false, false, false, false,
    ]) {
        assert_eq!(super::mode::forbids_measuring(status), forbidden, "{status}");
    }
}

#[test]
fn older_controllers_are_asked_for_less_and_their_safety_mode_serves_as_well() {
    let asked = |bench: &RtdeBench| {
        let text: Vec<String> = bench.sent.iter().map(|sent| String::from_utf8_lossy(sent).into_owned()).collect();
        text.iter().filter_map(|sent| Some(sent.get(sent.find("timestamp")?..)?.to_owned())).collect::<Vec<_>>()
    };
    let mut old = ready(&[Planned::always(RtdeFault::NoSafetyStatus), Planned::always(RtdeFault::Reduced)]);
    let first = "timestamp,actual_q,robot_mode,safety_status";
    assert_eq!(asked(&old), [first, "timestamp,actual_q,robot_mode,safety_mode"]);
    let events = old.run_for(Duration::from_secs(1));
    assert!(joint_states(&events).iter().all(|state| state.remark.as_deref() == Some("reduced (2)")), "{events:?}");
    let mut bench = bench(&[Planned::always(RtdeFault::NoModes), Planned::always(RtdeFault::Safeguard)]);
    let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!() };
    assert_eq!(asked(&bench), [first, "timestamp,actual_q,safety_mode", "timestamp,actual_q"]);
    assert!(identity.notes.iter().any(|note| note.contains("does not report its safety state")), "{identity:?}");
    assert_eq!(identity.checked[1], "values of the controller: timestamp, actual_q");
    let events = bench.run_for(Duration::from_secs(1));
    assert_eq!(joint_states(&events).len(), 25);
}

#[test]
fn zeros_between_joint_values_are_dropped_and_a_robot_at_zero_is_believed() {
    let mut bench = ready(&[Planned::from(RtdeFault::Dropout, 10, 3)]);
    let events = bench.run_for(Duration::from_secs(1));
    let here = &bench.cell.joints.positions;
    assert_eq!(joint_states(&events).len(), 22);
    assert!(joint_states(&events).iter().all(|state| state.positions == *here), "{events:?}");
    let mut bench = ready(&[Planned::from(RtdeFault::Dropout, 10, u32::MAX)]);
    let events = bench.run_for(Duration::from_secs(3));
    let states = joint_states(&events);
    assert_eq!(states.len(), 75 - 25);
    assert!(states[49].positions.iter().all(|value| *value == 0.0));
}

/// A set-up, some data, and a trigger that is refused.
fn tape() -> Tape {
    let mut bench = ready(&[Planned::from(RtdeFault::ProtectiveStop, 2, 1)]);
    bench.run_for(Duration::from_millis(130));
    bench.shoot();
    bench.tape
}

#[test]
fn splits_change_nothing() {
    for tape in [tape().joined(), tape()] {
        let events = assert_splits_change_nothing(Rtde::default, &tape);
        assert!(matches!(events.first(), Some(ProtocolEvent::Ready(_))));
        assert!(!joint_states(&events).is_empty(), "{events:?}");
        assert!(matches!(events.last(), Some(ProtocolEvent::Failed(_))));
    }
}

#[test]
fn splits_change_nothing_of_faults() {
    let faults = [
        RtdeFault::ProtectiveStop,
        RtdeFault::PowerOff,
        RtdeFault::Moving,
        RtdeFault::NotFinite,
        RtdeFault::WrongRecipe,
        RtdeFault::TextFlood,
        RtdeFault::ShortData,
    ];
    let mut bench = ready(&faults.into_iter().zip(2..).map(|(fault, at)| Planned::at(fault, at)).collect::<Vec<_>>());
    bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    let events = assert_splits_change_nothing(Rtde::default, &bench.tape);
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Garbled(_)))), "{events:?}");
}

#[test]
fn ten_thousand_packets_in_one_feed_leave_the_newest_ones() {
    let stream = tape().bytes();
    let mut rtde = Rtde::default();
    rtde.start(START);
    rtde.feed(&stream, START);
    let data = stream[stream.len() - 68..].repeat(10_000);
    rtde.feed(&data, START);
    let events = std::iter::from_fn(|| rtde.next_event()).count();
    assert!(rtde.pending() == 0 && events <= MAX_JOINTS + 5, "{} {events}", rtde.pending());
}

#[test]
fn a_simulated_controller_hangs_up_once_on_who_does_not_read() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    assert_hangs_up_once(&mut simulator, &request_version().repeat(1_000_000));
    assert_eq!(simulator.pending(), 0);
}

#[test]
fn no_bytes_make_the_link_panic_or_hoard() {
    fuzz_protocol(Rtde::default, &tape(), Rtde::pending, Bounds { pending: (1 << 16) - 1, outputs: 10 });
}

#[test]
fn no_bytes_make_the_simulated_controller_panic_or_hoard() {
    let all = || RtdeSimulator::new(RtdeFault::ALL.iter().map(|fault| Planned::from(*fault, 2, 1)).collect());
    let bounds = Bounds { pending: (1 << 16) - 1, outputs: 200_000 };
    fuzz_simulator(all, &ready(&[]).sent, RtdeSimulator::pending, bounds);
}

#[test]
fn what_is_no_controller_is_told_by_its_first_bytes() {
    for first in [&b"HTTP/1.1 400 Bad Request\r\n"[..], b"SSH-2.0-OpenSSH", &[0x10, 0, 0, 0, 0, 0, 0, 0], &[0, 2]] {
        let mut protocol = Rtde::default();
        protocol.start(Duration::ZERO);
        protocol.feed(first, Duration::ZERO);
        let lost = std::iter::from_fn(|| protocol.next_event()).last();
        let Some(ProtocolEvent::Lost(failure @ Failure::Foreign(_))) = &lost else { panic!("{first:?}: {lost:?}") };
        assert!(failure.controller_hint().contains("30004"), "{}", failure.controller_hint());
    }
}
