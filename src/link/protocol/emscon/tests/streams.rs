//! Streams that are cut anywhere, damaged, or far too long.

use super::super::{Emscon, MAX_PACKET};
use super::{EmsconBench, ready};
use crate::link::protocol::outbox::{MAX_OFFERED, MAX_STATUSES};
use crate::link::protocol::{Protocol as _, ProtocolEvent};
use crate::link::simulator::bench::START;
use crate::link::simulator::bench::fuzz::{Bounds, assert_hangs_up_once, fuzz_protocol, fuzz_simulator};
use crate::link::simulator::bench::streams::assert_splits_change_nothing;
use crate::link::simulator::emscon::{EmsconFault, EmsconSimulator};
use crate::link::simulator::fault::Planned;

/// A set-up and a shot, with other packets before its result.
fn conversation() -> EmsconBench {
    let mut bench = ready(&[Planned::once(EmsconFault::UnknownType), Planned::once(EmsconFault::Early)]);
    bench.shoot();
    bench
}

#[test]
fn splits_change_nothing() {
    let tape = conversation().tape;
    for tape in [tape.joined(), tape] {
        let events = assert_splits_change_nothing(Emscon::default, &tape);
        let [ProtocolEvent::Ready(_), ProtocolEvent::Offered(_), ProtocolEvent::Status(_), ProtocolEvent::Shot(_)] =
            events.as_slice()
        else {
            panic!("{events:?}")
        };
    }
}

#[test]
fn splits_change_nothing_of_faults() {
    let faults = EmsconFault::ALL.iter().filter(|fault| {
        // They end the conversation, or make it long.
        !matches!(
            fault,
            EmsconFault::InUse
                | EmsconFault::Metres
                | EmsconFault::TryStuck
                | EmsconFault::FrameChanged
                | EmsconFault::ReflectorChanged
                | EmsconFault::Mute
                | EmsconFault::CutAfter20
                | EmsconFault::SizeZero
                | EmsconFault::SizeNegative
                | EmsconFault::SizeHuge
                | EmsconFault::Closing
                | EmsconFault::Flood
        )
    });
    let mut bench = ready(&faults.zip(1..).map(|(fault, at)| Planned::at(*fault, at)).collect::<Vec<_>>());
    for _ in 0..30 {
        bench.shoot();
    }
    let events = assert_splits_change_nothing(Emscon::default, &bench.tape);
    assert!(events.iter().filter(|event| matches!(event, ProtocolEvent::Shot(_))).count() > 5, "{events:?}");
}

#[test]
fn ten_thousand_packets_in_one_feed_leave_short_queues() {
    let mut bench = ready(&[]);
    bench.shoot();
    let mut received = bench.tape.bytes();
    let result = received.split_off(received.len() - 156 - 12);
    let position = [&[36, 0, 0, 0, 7, 0, 0, 0][..], &[0; 28]].concat();
    let changed = [[0x0c, 0, 0, 0], [8, 0, 0, 0], [6, 0, 0, 0]].concat();
    let unknown: Vec<Vec<u8>> =
        (0..100_u8).map(|number| [&[12, 0, 0, 0, 100 + number, 0, 0, 0][..], &[0; 4]].concat()).collect();
    for packet in [result, position, changed, unknown.concat()] {
        let mut emscon = bench.protocol.clone();
        emscon.feed(&packet.repeat(10_000), START);
        let outputs = std::iter::from_fn(|| emscon.next_output()).count();
        let events = std::iter::from_fn(|| emscon.next_event()).count();
        assert!(emscon.pending() == 0 && outputs <= 1, "{} {outputs}", emscon.pending());
        assert!((0..=MAX_OFFERED.max(MAX_STATUSES)).contains(&events), "{events}");
    }
}

#[test]
fn a_simulated_tracker_hangs_up_once_on_who_does_not_read() {
    let mut simulator = EmsconSimulator::new(Vec::new());
    let request = [[0x0c, 0, 0, 0], [0; 4], [1, 0, 0, 0]].concat();
    assert_hangs_up_once(&mut simulator, &request.repeat(100_000));
    assert_eq!(simulator.pending(), 0);
}

#[test]
fn no_bytes_make_the_link_panic_or_hoard() {
    fuzz_protocol(Emscon::default, &conversation().tape, Emscon::pending, Bounds::of_protocol(MAX_PACKET));
}

#[test]
fn no_bytes_make_the_simulated_tracker_panic_or_hoard() {
    let all = || EmsconSimulator::new(EmsconFault::ALL.iter().map(|fault| Planned::from(*fault, 2, 1)).collect());
    let bounds = Bounds { pending: MAX_PACKET, outputs: 200_000 };
    fuzz_simulator(all, &conversation().sent, EmsconSimulator::pending, bounds);
}
