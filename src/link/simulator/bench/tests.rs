//! The bench and its checks find what they are made to find.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use nalgebra::Point3;

use super::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use super::streams::assert_splits_change_nothing;
use super::{Bench, Input, MockCell, START, Tape};
use crate::link::protocol::outbox::Outbox;
use crate::link::protocol::{Failure, Moment, Protocol, ProtocolEvent, Severity, Shot};
use crate::link::simulator::{Output, PointSource, Simulator};

/// What is wrong with a toy.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    None,
    /// Every feed is answered.
    Chatters,
    /// Its deadline never passes.
    Stuck,
    /// Says how long the pieces were.
    SeesPieces,
    /// Answers what nobody asked for.
    AnswersTwice,
    /// Keeps all that came.
    Hoards,
    /// Has no bound for what waits.
    Floods,
}

/// Answers a trigger by a shot as soon as an `s` comes. As a simulator it sends one for every `?`, and hangs up on a `!`.
#[derive(Debug)]
struct Toy {
    flaw: Flaw,
    outbox: Outbox,
    writes: Vec<Output>,
    is_triggered: bool,
    kept: usize,
}

impl Toy {
    fn new(flaw: Flaw) -> Self {
        Self { flaw, outbox: Outbox::default(), writes: Vec::new(), is_triggered: false, kept: 0 }
    }

    const fn kept(&self) -> usize {
        self.kept
    }
}

impl Protocol for Toy {
    fn start(&mut self, _now: Moment) {
        self.outbox.clear();
        self.is_triggered = false;
        if self.flaw == Flaw::Chatters {
            self.outbox.send(b"?".to_vec());
        }
    }

    fn feed(&mut self, bytes: &[u8], _now: Moment) {
        match self.flaw {
            Flaw::Chatters => self.outbox.send(b"?".to_vec()),
            Flaw::SeesPieces => self.outbox.report(Severity::Info, bytes.len().to_string()),
            Flaw::Hoards => self.kept += bytes.len(),
            Flaw::Floods => self.writes.extend(bytes.iter().map(|byte| Output::Bytes(vec![*byte]))),
            _ => {}
        }
        if bytes.contains(&b's') && (std::mem::take(&mut self.is_triggered) || self.flaw == Flaw::AnswersTwice) {
            self.outbox.push(ProtocolEvent::Shot(Shot::bare(Point3::origin())));
        }
    }

    fn tick(&mut self, _now: Moment) {}

    fn trigger(&mut self, _now: Moment) {
        if std::mem::replace(&mut self.is_triggered, true) {
            self.outbox.fail(Failure::TooEarly(String::new()));
        }
        self.outbox.send(b"?".to_vec());
    }

    fn cancel(&mut self, _now: Moment) {
        self.is_triggered = false;
    }

    fn next_output(&mut self) -> Option<Vec<u8>> {
        match self.writes.pop() {
            Some(Output::Bytes(bytes)) => Some(bytes),
            _ => self.outbox.next_output(),
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        (self.flaw == Flaw::Stuck).then_some(START)
    }
}

/// The far end of it.
#[derive(Debug)]
struct Peer(Toy);

impl Simulator for Peer {
    fn accept(&mut self, _now: Moment) {
        self.0.writes.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, _now: Moment) {
        self.0.kept += if self.0.flaw == Flaw::Hoards { bytes.len() } else { 0 };
        for byte in bytes {
            match byte {
                b'?' if source.shot().is_some() => self.0.writes.push(Output::Bytes(b"s".to_vec())),
                b'!' => self.0.writes.push(Output::Close),
                _ if self.0.flaw == Flaw::Floods => self.0.writes.push(Output::Bytes(vec![0])),
                _ => {}
            }
        }
    }

    fn tick(&mut self, _source: &mut dyn PointSource, _now: Moment) {}

    fn next_output(&mut self) -> Option<Output> {
        if self.0.writes.is_empty() { None } else { Some(self.0.writes.remove(0)) }
    }

    fn next_deadline(&self) -> Option<Moment> {
        None
    }
}

fn bench(flaw: Flaw) -> Bench<Toy, Peer> {
    Bench::new(Toy::new(flaw), Peer(Toy::new(Flaw::None)))
}

/// A conversation with two shots.
fn tape() -> Tape {
    let mut bench = bench(Flaw::None);
    bench.connect();
    bench.shoot();
    bench.run_for(Duration::from_secs(1));
    bench.shoot();
    bench.tape
}

/// True where a check finds something.
fn fails(check: impl FnOnce()) -> bool {
    catch_unwind(AssertUnwindSafe(check)).is_err()
}

#[test]
fn two_ends_that_go_on_for_ever_are_found() {
    for flaw in [Flaw::Chatters, Flaw::Stuck] {
        let mut bench = bench(flaw);
        bench.connect();
        assert!(fails(|| drop(bench.run_for(Duration::from_secs(1)))), "{flaw:?}");
    }
}

#[test]
fn a_hang_up_is_told_once_and_nothing_arrives_behind_it() {
    let mut bench = bench(Flaw::None);
    bench.connect();
    bench.simulator_gets(b"!?");
    let lost = ProtocolEvent::Lost(Failure::Disconnected("closed by the other side".to_owned()));
    assert_eq!(bench.run_for(Duration::from_secs(1)), [lost]);
    assert_eq!(bench.shoot(), []);
    assert_eq!((bench.tape.bytes(), bench.sent.concat()), (Vec::new(), b"?".to_vec()));
    bench.connect();
    assert!(matches!(bench.shoot().as_slice(), [ProtocolEvent::Shot(_)]));
}

#[test]
fn what_was_given_is_on_the_tape_and_can_be_joined() {
    let is = |tape: &Tape| tape.0.iter().map(|input| format!("{input:?}")).collect::<Vec<_>>();
    let start = "Start(100s)";
    let tape = tape();
    assert_eq!(is(&tape)[..4], [start, "Trigger(100s)", "Feed([115], 100s)", "Tick(101s)"]);
    assert_eq!(is(&tape)[4..], ["Trigger(101s)", "Feed([115], 101s)"]);
    let twice = Tape([&tape.0[..4], &[Input::Feed(b"x".to_vec(), START)]].concat());
    assert_eq!(is(&twice.joined()), [start, "Trigger(100s)", "Feed([115, 120], 100s)"]);
    assert_eq!((twice.bytes(), twice.joined().bytes()), (b"sx".to_vec(), b"sx".to_vec()));
}

#[test]
fn who_sees_the_pieces_of_a_stream_is_found() {
    let tape = Tape([&tape().0[..], &[Input::Feed(b"abc".to_vec(), START)]].concat());
    let events = assert_splits_change_nothing(|| Toy::new(Flaw::None), &tape);
    assert!(matches!(events.as_slice(), [ProtocolEvent::Shot(_), ProtocolEvent::Shot(_)]));
    assert!(fails(|| drop(assert_splits_change_nothing(|| Toy::new(Flaw::SeesPieces), &tape))));
}

#[test]
fn who_answers_twice_hoards_or_floods_is_found() {
    let bounds = Bounds { pending: 100, outputs: 64 };
    let fuzz = |flaw| fuzz_protocol(|| Toy::new(flaw), &tape(), Toy::kept, bounds);
    fuzz(Flaw::None);
    for flaw in [Flaw::AnswersTwice, Flaw::Hoards, Flaw::Floods] {
        assert!(fails(|| fuzz(flaw)), "{flaw:?}");
    }
    let sent = vec![b"?!".to_vec(); 10];
    let bounds = Bounds { pending: 100, outputs: 512 };
    let fuzz = |flaw| fuzz_simulator(|| Peer(Toy::new(flaw)), &sent, |peer: &Peer| peer.0.kept(), bounds);
    fuzz(Flaw::None);
    for flaw in [Flaw::Hoards, Flaw::Floods] {
        assert!(fails(|| fuzz(flaw)), "{flaw:?}");
    }
}

#[test]
fn no_two_shots_of_the_cell_are_near_each_other_and_all_are_within_reach() {
    let points: Vec<Point3<f64>> = (0..500).map(MockCell::point).collect();
    for (index, point) in points.iter().enumerate() {
        assert!((1.4..3.0).contains(&point.coords.norm()), "{point}");
        assert!(points[..index].iter().all(|other| (other - point).norm() > 1e-3), "shot {index}");
    }
    // In every quarter round the instrument, above it and below it.
    for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
        let is_there = |point: &&Point3<f64>| point.x * signs[0] > 0.5 && point.y * signs[1] > 0.5;
        let there: Vec<_> = points.iter().filter(is_there).collect();
        assert!(there.iter().any(|point| point.z > 0.2) && there.iter().any(|point| point.z < -0.2), "{signs:?}");
    }
}
