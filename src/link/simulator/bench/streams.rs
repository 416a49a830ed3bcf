//! One conversation cut in every way: the same events, and the same is sent.

use proptest::prelude::any;
use proptest::sample::Index;
use proptest::{prop_assert_eq, proptest};

use crate::link::protocol::{Moment, Protocol, ProtocolEvent};

/// Something that a protocol is given.
#[derive(Clone, Debug)]
pub enum Input {
    /// A new connection.
    Start(Moment),
    /// Bytes.
    Feed(Vec<u8>, Moment),
    /// Time has passed.
    Tick(Moment),
    /// A shot is asked for.
    Trigger(Moment),
    /// The shot under way is given up.
    Cancel(Moment),
}

impl Input {
    /// Gives it to a protocol.
    pub fn give_to(&self, protocol: &mut impl Protocol) {
        match self {
            Self::Start(now) => protocol.start(*now),
            Self::Feed(bytes, now) => protocol.feed(bytes, *now),
            Self::Tick(now) => protocol.tick(*now),
            Self::Trigger(now) => protocol.trigger(*now),
            Self::Cancel(now) => protocol.cancel(*now),
        }
    }

    /// When.
    pub const fn time(&self) -> Moment {
        match self {
            Self::Start(now) | Self::Feed(_, now) | Self::Tick(now) | Self::Trigger(now) | Self::Cancel(now) => *now,
        }
    }

    /// Bytes that are fed.
    pub fn bytes(&self) -> &[u8] {
        if let Self::Feed(bytes, _) = self { bytes } else { &[] }
    }
}

/// All that a protocol was given, to be given again in another way.
#[derive(Clone, Debug, Default)]
pub struct Tape(pub Vec<Input>);

impl Tape {
    /// All bytes that were fed.
    pub fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(Input::bytes).copied().collect()
    }

    /// The same without pauses: everything between two orders comes in one piece and at one moment.
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

/// What a protocol said and sent.
#[derive(Debug, Default, PartialEq)]
struct Said {
    events: Vec<ProtocolEvent>,
    sent: Vec<Vec<u8>>,
}

/// Plays a tape, each feed cut at the places that `cuts` gives for its length. All is fetched after each input, not after each
/// piece: of live points only the newest waits.
fn replay<P: Protocol>(mut protocol: P, tape: &Tape, cuts: impl Fn(usize) -> Vec<usize>) -> Said {
    let mut said = Said::default();
    for input in &tape.0 {
        if let Input::Feed(bytes, now) = input {
            let mut from = 0;
            for cut in cuts(bytes.len()).into_iter().chain([bytes.len()]) {
                protocol.feed(&bytes[from..cut], *now);
                from = cut;
            }
        } else {
            input.give_to(&mut protocol);
        }
        said.events.extend(std::iter::from_fn(|| protocol.next_event()));
        said.sent.extend(std::iter::from_fn(|| protocol.next_output()));
    }
    said
}

/// A conversation cut in two at every byte, into single bytes, at random places and into random pieces gives the same. Returns
/// its events.
///
/// # Panics
/// The test fails.
pub fn assert_splits_change_nothing<P: Protocol>(make: impl Fn() -> P, tape: &Tape) -> Vec<ProtocolEvent> {
    let whole = replay(make(), tape, |_| Vec::new());
    // All feeds are cut at the same offset at once: every offset of every feed is tried.
    let longest = tape.0.iter().map(|input| input.bytes().len()).max().unwrap_or(0);
    for at in 0..=longest {
        let split = replay(make(), tape, |length| if at <= length { vec![at] } else { Vec::new() });
        assert_eq!(split, whole, "cut after {at} bytes");
    }
    assert_eq!(replay(make(), tape, |length| (1..length).collect()), whole, "byte by byte");
    proptest!(|(
        places in proptest::collection::vec(any::<Index>(), 1..12),
        sizes in proptest::collection::vec(1_usize..400, 1..20),
    )| {
        let at_places = |length: usize| {
            let mut cuts: Vec<usize> = places.iter().map(|place| place.index(length.max(1))).collect();
            cuts.sort_unstable();
            cuts
        };
        prop_assert_eq!(&replay(make(), tape, at_places), &whole);
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
