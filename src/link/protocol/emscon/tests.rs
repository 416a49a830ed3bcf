//! Tests of the emScon link: literal bytes, the conversation with a simulated tracker, faults, cut and damaged streams.

mod conversation;
mod events;
mod faults;
mod streams;
mod vectors;

use super::{Emscon, EmsconOptions, i32_at};
use crate::link::protocol::{Failure, ProtocolEvent};
use crate::link::simulator::bench::Bench;
use crate::link::simulator::emscon::{EmsconFault, EmsconSimulator};
use crate::link::simulator::fault::Planned;

type EmsconBench = Bench<Emscon, EmsconSimulator>;

/// A bench with faults, not connected.
fn bench(faults: &[Planned<EmsconFault>]) -> EmsconBench {
    Bench::new(Emscon::default(), EmsconSimulator::new(faults.to_vec()))
}

/// A bench with other options.
fn bench_with(options: EmsconOptions, faults: &[Planned<EmsconFault>]) -> EmsconBench {
    Bench::new(Emscon::new(options), EmsconSimulator::new(faults.to_vec()))
}

/// A bench whose link is ready.
fn ready(faults: &[Planned<EmsconFault>]) -> EmsconBench {
    let mut bench = bench(faults);
    let events = bench.settle();
    assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))), "{events:?}");
    bench
}

/// Numbers of the commands that were sent.
fn commands(bench: &EmsconBench) -> Vec<i32> {
    bench.sent.iter().map(|bytes| i32_at(bytes, 8).unwrap()).collect()
}

/// The failure that the last event carries.
fn failure(events: &[ProtocolEvent]) -> &Failure {
    match events.last() {
        Some(ProtocolEvent::Failed(failure) | ProtocolEvent::Lost(failure)) => failure,
        other => panic!("no failure: {other:?}"),
    }
}

/// Statuses as text.
fn statuses(events: &[ProtocolEvent]) -> Vec<&str> {
    let mut texts = Vec::new();
    for event in events {
        if let ProtocolEvent::Status(status) = event {
            texts.push(status.text.as_str());
        }
    }
    texts
}
