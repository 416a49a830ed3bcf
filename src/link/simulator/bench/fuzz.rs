//! Fuzzing with random bytes and with damaged conversations, in which bytes were changed, dropped or doubled. Checks for panics,
//! bounded memory and at most one answer per trigger. Runs with fixed seeds for half a second, or for `TRUPOSE_FUZZ_SECONDS`.

use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::{Input, MockCell, START, Tape, is_answer};
use crate::link::protocol::outbox::{MAX_JOINTS, MAX_OFFERED, MAX_OUTPUTS, MAX_STATUSES};
use crate::link::protocol::{Protocol, ProtocolEvent};
use crate::link::simulator::{Output, Simulator};

/// Fewest rounds of each kind.
const ROUNDS: u64 = 50;

/// Inputs of a round that does not follow a tape.
const INPUTS: u32 = 20;

/// Most queued events besides answers and ends: statuses of both severities, offered points, a live point and joints.
const MAX_EVENTS: usize = 2 * MAX_STATUSES + MAX_OFFERED + MAX_JOINTS + 1;

/// Most bytes that a simulator may queue for a peer that does not read.
const MAX_BYTES: usize = 2 << 20;

/// Limits on the queues after one input.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Bytes of an incomplete message.
    pub pending: usize,
    /// Number of writes.
    pub outputs: usize,
}

impl Bounds {
    /// Limits of a protocol with this limit for incomplete messages (bytes).
    pub const fn of_protocol(pending: usize) -> Self {
        Self { pending, outputs: MAX_OUTPUTS }
    }
}

/// Runs rounds with seeds 0, 1, ... for the configured time.
fn rounds(mut round: impl FnMut(&mut ChaCha8Rng)) {
    #[expect(clippy::disallowed_methods, reason = "how long to fuzz is the only thing that depends on the clock")]
    let (seconds, start) = (std::env::var("TRUPOSE_FUZZ_SECONDS").ok(), Instant::now());
    let limit = Duration::from_secs_f64(seconds.and_then(|text| text.parse().ok()).unwrap_or(0.5));
    let mut seed = 0;
    while seed < ROUNDS || start.elapsed() < limit {
        round(&mut ChaCha8Rng::seed_from_u64(seed));
        seed += 1;
    }
}

/// Random bytes of any value, or of characters that occur in lines.
fn noise(random: &mut ChaCha8Rng) -> Vec<u8> {
    let alphabet = b"0123456789.,;:+-%R1QP\r\n \tNaNeE*$\xC4\xA5\x00\xFF";
    let length = random.random_range(0..6000);
    let is_any = random.random_bool(0.5);
    (0..length)
        .map(|_| if is_any { random.random() } else { alphabet[random.random_range(0..alphabet.len())] })
        .collect()
}

/// Changes, drops, doubles and inserts single bytes at random.
fn sprinkled(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
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

/// Cuts off or doubles the end, or inserts or changes a byte, a few times, so that most of the bytes stay valid.
fn damaged(mut bytes: Vec<u8>, random: &mut ChaCha8Rng) -> Vec<u8> {
    for _ in 0..random.random_range(1..=4) {
        let place = random.random_range(0..bytes.len().max(1)).min(bytes.len());
        let value = [0, 1, 0x7f, 0x80, 0xff, random.random()][random.random_range(0..6)];
        match random.random_range(0..4) {
            0 => bytes.truncate(place),
            1 => bytes.insert(place, value),
            2 => bytes.extend_from_within(place..),
            _ => bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte = value),
        }
    }
    bytes
}

/// Noise, or valid bytes with or without damage, so that the later states of a conversation are reached too.
fn stream(valid: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    match random.random_range(0..5) {
        0 => noise(random),
        1 => valid.to_vec(),
        2 => sprinkled(valid, random),
        _ => damaged(valid.to_vec(), random),
    }
}

/// A protocol under test, with counts of its inputs and events.
struct Watched<'a, P> {
    protocol: P,
    pending: &'a dyn Fn(&P) -> usize,
    bounds: Bounds,
    triggers: usize,
    answers: usize,
    starts: usize,
    /// Number of completed set-ups and of lost connections.
    ends: [usize; 2],
}

impl<P: Protocol> Watched<'_, P> {
    fn pass(&mut self, input: &Input) {
        self.triggers += usize::from(matches!(input, Input::Trigger(_)));
        self.starts += usize::from(matches!(input, Input::Start(_)));
        input.pass_to(&mut self.protocol);
        let pending = (self.pending)(&self.protocol);
        assert!(pending <= self.bounds.pending, "{pending} bytes are kept");
    }

    /// Fetches everything in the queues.
    fn fetch(&mut self) {
        let (mut outputs, mut others) = (0, 0);
        while self.protocol.next_output().is_some() {
            outputs += 1;
            assert!(outputs <= self.bounds.outputs, "more than {} writes are queued", self.bounds.outputs);
        }
        while let Some(event) = self.protocol.next_event() {
            match event {
                event if is_answer(&event) => self.answers += 1,
                ProtocolEvent::Ready(_) => self.ends[0] += 1,
                ProtocolEvent::Lost(_) => self.ends[1] += 1,
                _ => others += 1,
            }
            assert!(self.ends.iter().all(|ends| *ends <= self.starts), "{:?} of {} starts", self.ends, self.starts);
            assert!(self.answers <= self.triggers, "{} answers to {} triggers", self.answers, self.triggers);
            assert!(others <= MAX_EVENTS, "more than {MAX_EVENTS} events are queued");
        }
    }
}

/// Replays a tape with damaged bytes, random pauses and cancelled shots; and separately feeds its bytes in pieces with starts,
/// triggers, cancels and deadlines between them. `pending` returns the bytes of an incomplete message.
///
/// # Panics
/// The test fails.
pub fn fuzz_protocol<P: Protocol>(make: impl Fn() -> P, tape: &Tape, pending: impl Fn(&P) -> usize, bounds: Bounds) {
    let watched = || {
        let protocol = make();
        Watched { protocol, pending: &pending, bounds, triggers: 0, answers: 0, starts: 0, ends: [0; 2] }
    };
    let valid = tape.bytes();
    rounds(|random| {
        replay_damaged(watched(), tape, random);
        feed_freely(watched(), &valid, random);
    });
}

fn replay_damaged<P: Protocol>(mut watched: Watched<'_, P>, tape: &Tape, random: &mut ChaCha8Rng) {
    let mut late = Duration::ZERO;
    // With damage to every feed, only few states would be reached.
    let share = [1.0, 0.2, 0.02][random.random_range(0..3)];
    for input in &tape.0 {
        let now = input.time() + late;
        watched.pass(&match input {
            Input::Start(_) => Input::Start(now),
            Input::Tick(_) => Input::Tick(now),
            Input::Trigger(_) => Input::Trigger(now),
            Input::Cancel(_) => Input::Cancel(now),
            Input::Feed(bytes, _) if !random.random_bool(share) => Input::Feed(bytes.clone(), now),
            Input::Feed(_, _) if random.random_bool(0.1) => Input::Feed(noise(random), now),
            Input::Feed(bytes, _) => Input::Feed(sprinkled(bytes, random), now),
        });
        if random.random_bool(0.05) {
            late += Duration::from_millis(random.random_range(0..20_000));
        }
        if random.random_bool(0.02) {
            watched.pass(&Input::Cancel(input.time() + late));
        }
        watched.fetch();
    }
}

fn feed_freely<P: Protocol>(mut watched: Watched<'_, P>, valid: &[u8], random: &mut ChaCha8Rng) {
    let mut now = START;
    watched.pass(&Input::Start(now));
    for _ in 0..INPUTS {
        let piece = random.random_range(1..=100);
        for piece in stream(valid, random).chunks(piece) {
            watched.pass(&Input::Feed(piece.to_vec(), now));
        }
        match random.random_range(0..8) {
            0 => watched.pass(&Input::Start(now)),
            1 => watched.pass(&Input::Cancel(now)),
            2 => watched.pass(&Input::Trigger(now)),
            _ => {}
        }
        now = watched.protocol.next_deadline().map_or(now, |deadline| deadline.max(now));
        watched.pass(&Input::Tick(now));
        // Fetch only after several inputs, as a slow owner would.
        watched.fetch();
    }
}

/// A simulator under test.
struct WatchedSimulator<'a, S> {
    simulator: S,
    pending: &'a dyn Fn(&S) -> usize,
    bounds: Bounds,
    cell: MockCell,
}

impl<S: Simulator> WatchedSimulator<'_, S> {
    fn feed(&mut self, bytes: &[u8], now: Duration) {
        self.simulator.feed(bytes, &mut self.cell, now);
        let pending = (self.pending)(&self.simulator);
        assert!(pending <= self.bounds.pending, "{pending} bytes are kept");
    }

    fn tick(&mut self, now: Duration) {
        self.simulator.tick(&mut self.cell, now);
        let (mut outputs, mut bytes) = (0, 0);
        while let Some(output) = self.simulator.next_output() {
            outputs += 1;
            if let Output::Bytes(written) = output {
                bytes += written.len();
            }
            assert!(outputs <= self.bounds.outputs && bytes < MAX_BYTES, "{outputs} writes, {bytes} bytes");
        }
    }
}

/// Feeds a simulator with the bytes a protocol sent: request by request with damage, and in pieces with new connections and broken
/// beams between them. `pending` returns the bytes of an incomplete request.
///
/// # Panics
/// The test fails.
pub fn fuzz_simulator<S: Simulator>(
    make: impl Fn() -> S,
    sent: &[Vec<u8>],
    pending: impl Fn(&S) -> usize,
    bounds: Bounds,
) {
    let watched = || WatchedSimulator { simulator: make(), pending: &pending, bounds, cell: MockCell::default() };
    let valid = sent.concat();
    rounds(|random| {
        feed_requests(watched(), sent, random);
        feed_simulator_freely(watched(), &valid, random);
    });
}

fn feed_requests<S: Simulator>(mut watched: WatchedSimulator<'_, S>, sent: &[Vec<u8>], random: &mut ChaCha8Rng) {
    let mut now = START;
    watched.simulator.accept(now);
    for bytes in sent {
        let bytes = if random.random_bool(0.1) { noise(random) } else { sprinkled(bytes, random) };
        watched.feed(&bytes, now);
        now += Duration::from_millis(random.random_range(0..3000));
        watched.tick(now);
    }
}

fn feed_simulator_freely<S: Simulator>(mut watched: WatchedSimulator<'_, S>, valid: &[u8], random: &mut ChaCha8Rng) {
    let mut now = START;
    for _ in 0..INPUTS {
        if random.random_bool(1.0 / 3.0) {
            watched.simulator.accept(now);
        }
        let piece = random.random_range(1..=100);
        for piece in stream(valid, random).chunks(piece) {
            watched.feed(piece, now);
        }
        watched.cell.has_beam = random.random();
        now = watched.simulator.next_deadline().map_or(now, |deadline| deadline.max(now));
        watched.tick(now);
    }
}

/// Asserts that a simulator flooded with requests, whose answers are never read, keeps a bounded number of bytes and closes the
/// connection once.
///
/// # Panics
/// The test fails.
pub fn assert_hangs_up_once<S: Simulator>(simulator: &mut S, requests: &[u8]) {
    simulator.accept(START);
    simulator.feed(requests, &mut MockCell::default(), START);
    (0..10).for_each(|_| simulator.tick(&mut MockCell::default(), START));
    let outputs: Vec<Output> = std::iter::from_fn(|| simulator.next_output()).collect();
    let bytes: usize =
        outputs.iter().map(|output| if let Output::Bytes(bytes) = output { bytes.len() } else { 0 }).sum();
    assert!(bytes < 2 << 20, "{bytes}");
    let closes = outputs.iter().filter(|output| **output == Output::Close).count();
    assert_eq!((closes, outputs.last()), (1, Some(&Output::Close)));
}
