//! Bytes that nobody means: random ones, and streams that were right before some bytes were changed, lost or doubled. Fixed
//! seeds; for about a second, or as long as `TRUPOSE_FUZZ_SECONDS` says.

use std::time::{Duration, Instant};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use super::Cell;
use crate::link::protocol::{Moment, Protocol, ProtocolEvent};
use crate::link::simulator::Simulator;

/// Outputs and events that one feed and one tick of fuzz may leave.
const MAX_WAITING: usize = 200_000;

/// Random bytes, a damaged copy of `valid`, or `valid` itself, so that the states behind it are reached too.
fn stream(rng: &mut ChaCha8Rng, valid: &[u8]) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    match rng.next_u32() % 4 {
        0 => {
            let length = rng.next_u32() as usize % 600;
            return (0..length).map(|_| rng.next_u32().to_le_bytes()[0]).collect();
        }
        1 => return bytes,
        _ => {}
    }
    for _ in 0..=rng.next_u32() % 4 {
        let place = rng.next_u32() as usize % bytes.len().max(1);
        let value = [0, 1, 0x7f, 0x80, 0xff, rng.next_u32().to_le_bytes()[0]][rng.next_u32() as usize % 6];
        match rng.next_u32() % 4 {
            0 => bytes.truncate(place),
            1 => bytes.insert(place.min(bytes.len()), value),
            2 => bytes.extend_from_within(place.min(bytes.len())..),
            _ => {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte = value;
                }
            }
        }
    }
    bytes
}

/// Runs rounds with numbers 0, 1, ... for the time that is set, at least 50 of them.
fn rounds(mut round: impl FnMut(&mut ChaCha8Rng)) {
    #[expect(clippy::disallowed_methods, reason = "how long to fuzz is the only thing that depends on the clock")]
    let (seconds, start) = (std::env::var("TRUPOSE_FUZZ_SECONDS").ok(), Instant::now());
    let limit = Duration::from_secs_f64(seconds.and_then(|text| text.parse().ok()).unwrap_or(0.5));
    let mut number = 0;
    while number < 50 || start.elapsed() < limit {
        round(&mut ChaCha8Rng::seed_from_u64(number));
        number += 1;
    }
}

/// Feeds fuzz in pieces, with triggers, cancels and deadlines in between. `check` looks at the buffers; no more than one answer
/// comes for a trigger.
///
/// # Panics
/// The test fails.
pub fn fuzz_protocol<P: Protocol>(make: impl Fn() -> P, valid: &[u8], check: impl Fn(&P)) {
    rounds(|rng| {
        let (mut protocol, mut now) = (make(), Moment::ZERO);
        let (mut triggers, mut answers) = (0, 0);
        protocol.start(now);
        for _ in 0..20 {
            let bytes = stream(rng, valid);
            let piece = 1 + rng.next_u32() as usize % 100;
            bytes.chunks(piece).for_each(|piece| protocol.feed(piece, now));
            check(&protocol);
            match rng.next_u32() % 8 {
                0 => protocol.start(now),
                1 => protocol.cancel(now),
                2 => {
                    triggers += 1;
                    protocol.trigger(now);
                }
                _ => {}
            }
            now = protocol.next_deadline().map_or(now, |deadline| deadline.max(now));
            protocol.tick(now);
            let outputs = std::iter::from_fn(|| protocol.next_output()).take(MAX_WAITING).count();
            let events: Vec<_> = std::iter::from_fn(|| protocol.next_event()).take(MAX_WAITING).collect();
            assert!(outputs < MAX_WAITING && events.len() < MAX_WAITING);
            let is_answer = |event: &&ProtocolEvent| matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_));
            answers += events.iter().filter(is_answer).count();
            assert!(answers <= triggers, "{answers} answers to {triggers} triggers");
        }
    });
}

/// Feeds fuzz to a simulator.
///
/// # Panics
/// The test fails.
pub fn fuzz_simulator<S: Simulator>(make: impl Fn() -> S, valid: &[u8], check: impl Fn(&S)) {
    rounds(|rng| {
        let (mut simulator, mut cell, mut now) = (make(), Cell::default(), Moment::ZERO);
        for _ in 0..20 {
            if rng.next_u32().is_multiple_of(3) {
                simulator.accept(now);
            }
            let bytes = stream(rng, valid);
            let piece = 1 + rng.next_u32() as usize % 100;
            bytes.chunks(piece).for_each(|piece| simulator.feed(piece, &mut cell, now));
            check(&simulator);
            cell.has_beam = rng.next_u32().is_multiple_of(2);
            now = simulator.next_deadline().map_or(now, |deadline| deadline.max(now));
            simulator.tick(&mut cell, now);
            let outputs = std::iter::from_fn(|| simulator.next_output()).take(MAX_WAITING).count();
            assert!(outputs < MAX_WAITING);
        }
    });
}

/// What the protocol makes of a stream: its outputs and events.
fn outcome<P: Protocol>(protocol: &mut P) -> (Vec<Vec<u8>>, Vec<ProtocolEvent>) {
    (std::iter::from_fn(|| protocol.next_output()).collect(), std::iter::from_fn(|| protocol.next_event()).collect())
}

/// What a stream gives that is fed in pieces.
fn fed<P: Protocol + Clone>(protocol: &P, pieces: &[&[u8]]) -> (Vec<Vec<u8>>, Vec<ProtocolEvent>) {
    let mut protocol = protocol.clone();
    for piece in pieces {
        protocol.feed(piece, Moment::ZERO);
    }
    outcome(&mut protocol)
}

/// Cuts a stream in two at every byte, and into single bytes. Returns what the whole stream gives.
///
/// # Panics
/// The test fails.
pub fn assert_same_at_every_cut<P: Protocol + Clone>(protocol: &P, stream: &[u8]) -> Vec<ProtocolEvent> {
    let whole = fed(protocol, &[stream]);
    for cut in 0..=stream.len() {
        let (head, tail) = stream.split_at(cut);
        assert_eq!(fed(protocol, &[head, tail]), whole, "cut at byte {cut}");
    }
    let single: Vec<&[u8]> = stream.chunks(1).collect();
    assert_eq!(fed(protocol, &single), whole);
    whole.1
}

/// Cuts a stream into pieces with these sizes, again and again.
///
/// # Panics
/// The test fails.
pub fn assert_same_in_pieces<P: Protocol + Clone>(protocol: &P, stream: &[u8], sizes: &[usize]) {
    let (mut rest, mut pieces) = (stream, Vec::new());
    for size in sizes.iter().cycle() {
        if rest.is_empty() {
            break;
        }
        let (head, tail) = rest.split_at((*size).min(rest.len()));
        pieces.push(head);
        rest = tail;
    }
    assert_eq!(fed(protocol, &pieces), fed(protocol, &[stream]));
}
