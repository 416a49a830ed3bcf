//! One conversation cut in every way, and spoilt in many: the same events, and no panic.

use std::time::Duration;
use std::time::Instant;

use proptest::prelude::ProptestConfig;
use proptest::prelude::any;
use proptest::prop_assert_eq;
use proptest::proptest;
use proptest::sample::Index;
use rand::RngExt as _;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::Helix;
use super::Input;
use crate::link::protocol::Moment;
use crate::link::protocol::Protocol;
use crate::link::protocol::ProtocolEvent;
use crate::link::simulator::Simulator;

/// Most events that one input may leave.
const MAX_EVENTS: usize = 256;

/// What a protocol said and sent.
#[derive(Debug, Default, PartialEq)]
pub(in crate::link) struct Said {
    events: Vec<ProtocolEvent>,
    sent: Vec<Vec<u8>>,
}

impl Said {
    /// Takes all that waits; live points are compared too, but only the newest of each input is kept by the protocol.
    fn collect(&mut self, protocol: &mut impl Protocol) {
        self.events.extend(std::iter::from_fn(|| protocol.next_event()));
        self.sent.extend(std::iter::from_fn(|| protocol.next_output()));
    }
}

/// Gives a conversation again, each feed cut at the places given.
fn replay<P: Protocol>(mut protocol: P, tape: &[Input], cuts: &dyn Fn(usize, usize) -> Vec<usize>) -> Said {
    let mut said = Said::default();
    for (index, input) in tape.iter().enumerate() {
        match input {
            Input::Start(now) => protocol.start(*now),
            Input::Tick(now) => protocol.tick(*now),
            Input::Trigger(now) => protocol.trigger(*now),
            Input::Feed(bytes, now) => {
                let mut from = 0;
                for cut in cuts(index, bytes.len()) {
                    protocol.feed(&bytes[from..cut], *now);
                    from = cut;
                }
                protocol.feed(&bytes[from..], *now);
            }
        }
        said.collect(&mut protocol);
    }
    said
}

/// The conversation cut in two at every byte, and at random places, gives the same events and output.
pub(in crate::link) fn assert_splits_change_nothing<P: Protocol>(make: impl Fn() -> P, tape: &[Input]) {
    let whole = replay(make(), tape, &|_, _| Vec::new());
    assert!(whole.events.iter().any(|event| matches!(event, ProtocolEvent::Shot(_))), "the conversation has no shot");
    let lengths = tape.iter().map(|input| if let Input::Feed(bytes, _) = input { bytes.len() } else { 0 });
    // All feeds are cut at the same offset at once: every offset of every feed is tried.
    for at in 1..lengths.max().unwrap_or(0) {
        let split = replay(make(), tape, &|_, length| if at < length { vec![at] } else { Vec::new() });
        assert_eq!(split, whole, "cut after {at} bytes");
    }
    let bytewise = replay(make(), tape, &|_, length| (1..length).collect());
    assert_eq!(bytewise, whole, "byte by byte");
    proptest!(ProptestConfig::with_cases(32), |(places in proptest::collection::vec(any::<Index>(), 1..12))| {
        let cuts = |_: usize, length: usize| {
            let mut cuts: Vec<usize> = places.iter().map(|place| place.index(length.max(1))).collect();
            cuts.sort_unstable();
            cuts
        };
        prop_assert_eq!(&replay(make(), tape, &cuts), &whole);
    });
}

/// How long a random test runs: a short time, or what the environment says (s).
#[expect(clippy::disallowed_methods, reason = "the length of a test")]
fn fuzz_time() -> Duration {
    let seconds = std::env::var("TRUPOSE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    Duration::from_secs_f64(seconds.unwrap_or(0.4))
}

#[expect(clippy::disallowed_methods, reason = "the length of a test")]
fn for_a_time(mut round: impl FnMut(u64)) {
    let start = Instant::now();
    let mut seed = 0;
    while start.elapsed() < fuzz_time() || seed < 2 {
        round(seed);
        seed += 1;
    }
}

/// Changes, drops, doubles and inserts some bytes.
fn spoil(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut spoilt = Vec::new();
    for &byte in bytes {
        match random.random_range(0..60) {
            0 => spoilt.push(random.random()),
            1 => {}
            2 => spoilt.extend([byte, byte]),
            3 => spoilt.extend([byte, random.random()]),
            4 => spoilt.push(byte ^ (1 << random.random_range(0..8))),
            _ => spoilt.push(byte),
        }
    }
    spoilt
}

/// Bytes of any kind, with ends of lines now and then.
fn noise(random: &mut ChaCha8Rng) -> Vec<u8> {
    let alphabet = b"0123456789.,;:+-%R1QP\r\n \tNaNeE*$\xC4\xA5\x00\xFF";
    let length = random.random_range(0..6000);
    let is_any = random.random_bool(0.5);
    (0..length)
        .map(|_| if is_any { random.random() } else { alphabet[random.random_range(0..alphabet.len())] })
        .collect()
}

/// Noise and spoilt conversations: no panic, bounded memory, and a shot is never answered twice.
pub(in crate::link) fn fuzz_protocol<P: Protocol>(
    make: impl Fn() -> P,
    tape: &[Input],
    pending: impl Fn(&P) -> usize,
    bound: usize,
) {
    for_a_time(|seed| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut protocol = make();
        let mut triggers = 0_usize;
        let mut answers = 0_usize;
        let mut late = Duration::ZERO;
        for input in tape {
            match input {
                Input::Start(now) => protocol.start(*now + late),
                Input::Tick(now) => protocol.tick(*now + late),
                Input::Trigger(now) => {
                    triggers += 1;
                    protocol.trigger(*now + late);
                }
                Input::Feed(bytes, now) => {
                    let bytes = if random.random_bool(0.1) { noise(&mut random) } else { spoil(bytes, &mut random) };
                    protocol.feed(&bytes, *now + late);
                }
            }
            if random.random_bool(0.05) {
                late += Duration::from_millis(random.random_range(0..20_000));
            }
            if random.random_bool(0.02) {
                protocol.cancel(input_time(input) + late);
            }
            assert!(pending(&protocol) <= bound, "{} bytes are kept", pending(&protocol));
            let events: Vec<ProtocolEvent> = std::iter::from_fn(|| protocol.next_event()).collect();
            assert!(events.len() <= MAX_EVENTS, "{} events at once", events.len());
            answers += events
                .iter()
                .filter(|event| matches!(event, ProtocolEvent::Shot(_) | ProtocolEvent::Failed(_)))
                .count();
            assert!(std::iter::from_fn(|| protocol.next_output()).count() <= MAX_EVENTS);
            assert!(answers <= triggers, "{answers} answers to {triggers} triggers");
        }
    });
}

const fn input_time(input: &Input) -> Moment {
    match input {
        Input::Start(now) | Input::Feed(_, now) | Input::Tick(now) | Input::Trigger(now) => *now,
    }
}

/// Noise and spoilt requests: no panic, bounded memory.
pub(in crate::link) fn fuzz_simulator<S: Simulator>(
    make: impl Fn() -> S,
    sent: &[Vec<u8>],
    pending: impl Fn(&S) -> usize,
    bound: usize,
) {
    for_a_time(|seed| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut simulator = make();
        let mut source = Helix::default();
        let mut now = Duration::ZERO;
        simulator.accept(now);
        for bytes in sent {
            let bytes = if random.random_bool(0.1) { noise(&mut random) } else { spoil(bytes, &mut random) };
            simulator.feed(&bytes, &mut source, now);
            now += Duration::from_millis(random.random_range(0..3000));
            simulator.tick(&mut source, now);
            assert!(pending(&simulator) <= bound, "{} bytes are kept", pending(&simulator));
            let outputs = std::iter::from_fn(|| simulator.next_output()).count();
            assert!(outputs <= 2 * MAX_EVENTS, "{outputs} outputs at once");
        }
    });
}
