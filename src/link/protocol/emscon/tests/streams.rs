//! Streams that are cut anywhere, damaged, or far too long.

use proptest::prelude::*;

use super::super::{Emscon, MAX_PACKET};
use super::ready;
use crate::link::protocol::mailbox::{MAX_OFFERED, MAX_STATUSES};
use crate::link::protocol::{Moment, Protocol as _, ProtocolEvent};
use crate::link::simulator::Simulator as _;
use crate::link::simulator::bench::Cell;
use crate::link::simulator::bench::fuzz::{
    assert_same_at_every_cut, assert_same_in_pieces, fuzz_protocol, fuzz_simulator,
};
use crate::link::simulator::emscon::{EmsconFault, EmsconSimulator};
use crate::link::simulator::fault::Planned;

/// A link that has started, and the bytes that bring it to ready.
fn starting() -> (Emscon, Vec<u8>) {
    let mut emscon = Emscon::default();
    emscon.start(Moment::ZERO);
    (emscon, ready(&[]).received)
}

/// A link that asked for a shot, and the bytes that answer, with other packets in between.
fn shooting() -> (Emscon, Vec<u8>) {
    let faults = [Planned::once(EmsconFault::UnknownType), Planned::once(EmsconFault::Early)];
    let mut bench = ready(&faults);
    let mut emscon = bench.protocol.clone();
    emscon.trigger(Moment::ZERO);
    bench.received.clear();
    bench.shoot();
    (emscon, bench.received)
}

#[test]
fn every_cut_of_a_set_up_gives_the_same() {
    let (emscon, stream) = starting();
    let events = assert_same_at_every_cut(&emscon, &stream);
    assert!(matches!(events.as_slice(), [ProtocolEvent::Ready(_)]), "{events:?}");
}

#[test]
fn every_cut_of_a_shot_gives_the_same() {
    let (emscon, stream) = shooting();
    let events = assert_same_at_every_cut(&emscon, &stream);
    let [ProtocolEvent::Offered(_), ProtocolEvent::Status(_), ProtocolEvent::Shot(_)] = events.as_slice() else {
        panic!("{events:?}")
    };
}

proptest! {
    #[test]
    fn any_pieces_give_the_same(sizes in prop::collection::vec(1_usize..400, 1..20)) {
        for (emscon, stream) in [starting(), shooting()] {
            assert_same_in_pieces(&emscon, &stream, &sizes);
        }
    }
}

#[test]
fn ten_thousand_packets_in_one_feed_leave_short_queues() {
    let mut bench = ready(&[]);
    bench.shoot();
    let result = bench.received.split_off(bench.received.len() - 156 - 12);
    let position = [&[36, 0, 0, 0, 7, 0, 0, 0][..], &[0; 28]].concat();
    let changed = [[0x0c, 0, 0, 0], [8, 0, 0, 0], [6, 0, 0, 0]].concat();
    let unknown: Vec<Vec<u8>> =
        (0..100_u8).map(|number| [&[12, 0, 0, 0, 100 + number, 0, 0, 0][..], &[0; 4]].concat()).collect();
    for packet in [result, position, changed, unknown.concat()] {
        let mut emscon = bench.protocol.clone();
        emscon.feed(&packet.repeat(10_000), Moment::ZERO);
        let (pending, outputs, events) = emscon.buffered();
        assert!(pending == 0 && outputs <= 1, "{pending} {outputs}");
        assert!((0..=MAX_STATUSES.max(MAX_OFFERED)).contains(&events), "{events}");
    }
}

#[test]
fn a_simulated_tracker_hangs_up_on_who_does_not_read() {
    let mut simulator = EmsconSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let request = [[0x0c, 0, 0, 0], [0; 4], [1, 0, 0, 0]].concat();
    simulator.feed(&request.repeat(100_000), &mut Cell::default(), Moment::ZERO);
    let (pending, waiting) = simulator.buffered();
    assert!(pending == 0 && waiting < 2 << 20, "{pending} {waiting}");
}

#[test]
fn no_bytes_make_the_link_panic_or_hoard() {
    let (_, set_up) = starting();
    let (_, shot) = shooting();
    for valid in [&set_up[..], &shot[..], &[set_up.clone(), shot.clone()].concat()] {
        fuzz_protocol(Emscon::default, valid, |emscon| {
            let (pending, outputs, events) = emscon.buffered();
            assert!(pending <= MAX_PACKET && outputs <= 200 && events <= 200, "{pending} {outputs} {events}");
        });
    }
}

#[test]
fn no_bytes_make_the_simulated_tracker_panic_or_hoard() {
    let mut bench = ready(&[]);
    bench.shoot();
    let valid = bench.sent.concat();
    fuzz_simulator(
        || EmsconSimulator::new(EmsconFault::ALL.iter().map(|fault| Planned::from(*fault, 2, 1)).collect()),
        &valid,
        |simulator| {
            let (pending, waiting) = simulator.buffered();
            assert!(pending <= MAX_PACKET && waiting < 2 << 20, "{pending} {waiting}");
        },
    );
}
