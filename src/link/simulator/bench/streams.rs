//! Replays of one conversation with its stream split in every way: events and outputs must stay the same.

use proptest::prelude::any;
use proptest::sample::Index;
use proptest::{prop_assert_eq, proptest};

use crate::link::protocol::{Moment, Protocol, ProtocolEvent};

/// An input of a protocol.
#[derive(Clone, Debug)]
pub enum Input {
    /// A new connection.
    Start(Moment),
    /// Received bytes.
    Feed(Vec<u8>, Moment),
    /// A tick.
    Tick(Moment),
    /// A trigger.
    Trigger(Moment),
    /// A cancellation of the shot.
    Cancel(Moment),
}

impl Input {
    /// Passes the input to a protocol.
    pub fn pass_to(&self, protocol: &mut impl Protocol) {
        match self {
            Self::Start(now) => protocol.start(*now),
            Self::Feed(bytes, now) => protocol.feed(bytes, *now),
            Self::Tick(now) => protocol.tick(*now),
            Self::Trigger(now) => protocol.trigger(*now),
            Self::Cancel(now) => protocol.cancel(*now),
        }
    }

    /// Time of the input.
    pub const fn time(&self) -> Moment {
        match self {
            Self::Start(now) | Self::Feed(_, now) | Self::Tick(now) | Self::Trigger(now) | Self::Cancel(now) => *now,
        }
    }

    /// Received bytes, if any.
    pub fn bytes(&self) -> &[u8] {
        if let Self::Feed(bytes, _) = self { bytes } else { &[] }
    }
}

/// All inputs of a protocol, for a replay.
#[derive(Clone, Debug, Default)]
pub struct Tape(pub Vec<Input>);

impl Tape {
    /// All received bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(Input::bytes).copied().collect()
    }

    /// The tape without pauses: all bytes between two commands arrive in one piece at one time.
    #[must_use]
    pub fn joined(&self) -> Self {
        let mut joined: Vec<Input> = Vec::new();
        for input in &self.0 {
            match (input, joined.last_mut()) {
                (Input::Tick(_), _) => {}
                (Input::Feed(more, _), Some(Input::Feed(bytes, _))) => bytes.extend(more),
                (Input::Feed(bytes, _), Some(before)) => {
                    let now = before.time();
                    joined.push(Input::Feed(bytes.clone(), now));
                }
                _ => joined.push(input.clone()),
            }
        }
        Self(joined)
    }
}

/// Events and outputs of a protocol.
#[derive(Debug, Default, PartialEq)]
struct Transcript {
    events: Vec<ProtocolEvent>,
    sent: Vec<Vec<u8>>,
}

/// Replays a tape with each feed split at the offsets that `cuts` returns for its length. Events are fetched after each input
/// instead of each piece, because the queue keeps only the newest live point.
fn replay<P: Protocol>(mut protocol: P, tape: &Tape, cuts: impl Fn(usize) -> Vec<usize>) -> Transcript {
    let mut said = Transcript::default();
    for input in &tape.0 {
        if let Input::Feed(bytes, now) = input {
            let mut from = 0;
            for cut in cuts(bytes.len()).into_iter().chain([bytes.len()]) {
                protocol.feed(&bytes[from..cut], *now);
                from = cut;
            }
        } else {
            input.pass_to(&mut protocol);
        }
        said.events.extend(std::iter::from_fn(|| protocol.next_event()));
        said.sent.extend(std::iter::from_fn(|| protocol.next_output()));
    }
    said
}

/// Asserts that a conversation gives the same results when it is split in two at every byte, into single bytes, at random offsets
/// and into random pieces. Returns its events.
///
/// # Panics
/// A split changes a result.
pub fn assert_splits_change_nothing<P: Protocol>(make: impl Fn() -> P, tape: &Tape) -> Vec<ProtocolEvent> {
    let whole = replay(make(), tape, |_| Vec::new());
    // All feeds are split at the same offset at once, which covers every offset of every feed.
    let longest = tape.0.iter().map(|input| input.bytes().len()).max().unwrap_or(0);
    for at in 0..=longest {
        let split = replay(make(), tape, |length| if at <= length { vec![at] } else { Vec::new() });
        assert_eq!(split, whole, "cut after {at} bytes");
    }
    assert_eq!(replay(make(), tape, |length| (1..length).collect()), whole, "byte by byte");
    proptest!(|(
        offsets in proptest::collection::vec(any::<Index>(), 1..12),
        sizes in proptest::collection::vec(1_usize..400, 1..20),
    )| {
        let at_offsets = |length: usize| {
            let mut cuts: Vec<usize> = offsets.iter().map(|offset| offset.index(length.max(1))).collect();
            cuts.sort_unstable();
            cuts
        };
        prop_assert_eq!(&replay(make(), tape, at_offsets), &whole);
        let in_pieces = |length: usize| {
            let ends = sizes.iter().cycle().scan(0, |end, size| {
                *end += size;
                Some(*end)
            });
            ends.take_while(|end| *end < length).collect()
        };
        prop_assert_eq!(&replay(make(), tape, in_pieces), &whole);
    });
    whole.events
}
