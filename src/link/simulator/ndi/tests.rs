//! The driver against its other end: points, faults, splits, noise.

use std::time::Duration;

use super::super::bench::Bench;
use super::super::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use super::super::bench::streams::assert_splits_change_nothing;
use super::super::fault::Planned;
use super::NdiFault;
use super::NdiSimulator;
use crate::link::protocol::Failure;
use crate::link::protocol::Protocol as _;
use crate::link::protocol::ProtocolEvent;
use crate::link::protocol::Severity;
use crate::link::protocol::Shot;
use crate::link::protocol::ndi::MAX_TEXT;
use crate::link::protocol::ndi::NdiOptions;
use crate::link::protocol::ndi::NdiProtocol;
use crate::link::protocol::ndi::ReplyFormat;

type NdiBench = Bench<NdiProtocol, NdiSimulator>;

/// A tip that shows a forgotten or wrongly turned offset.
const TIP_MM: [f64; 3] = [12.5, -40.0, 151.0];

/// Largest error by the resolution of the replies (m): 0.01 mm and 0.0001 on a lever of 0.16 m, or single precision.
const fn resolution(reply: ReplyFormat) -> f64 {
    match reply {
        ReplyFormat::Text => 4e-5,
        ReplyFormat::Binary => 5e-7,
    }
}

fn options(reply: ReplyFormat) -> NdiOptions {
    NdiOptions { reply, tip_mm: TIP_MM, ..NdiOptions::default() }
}

fn bench(reply: ReplyFormat, faults: impl IntoIterator<Item = Planned<NdiFault>>) -> NdiBench {
    let mut bench = Bench::new(NdiProtocol::new(options(reply)).unwrap(), NdiSimulator::new(TIP_MM, faults));
    let events = bench.settle();
    assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))), "{events:?}");
    bench
}

/// A shot must show the point of a frame after the trigger: one that the source gave after it.
#[track_caller]
fn assert_fresh(shot: &Shot, before: u32, bench: &NdiBench, reply: ReplyFormat) {
    let error = bench.cell.error(&shot.point, before);
    assert!(error < resolution(reply), "{error} m from every fresh point");
}

#[track_caller]
fn shoot(bench: &mut NdiBench, reply: ReplyFormat) {
    let before = bench.cell.shots;
    match bench.shoot().pop() {
        Some(ProtocolEvent::Shot(shot)) => assert_fresh(&shot, before, bench, reply),
        other => panic!("no shot: {other:?}"),
    }
}

const BOTH: [ReplyFormat; 2] = [ReplyFormat::Text, ReplyFormat::Binary];

#[test]
fn the_tip_comes_back_in_both_formats() {
    for reply in BOTH {
        let mut bench = bench(reply, []);
        for _ in 0..10 {
            shoot(&mut bench, reply);
        }
    }
}

#[test]
fn the_identity_says_what_text_cannot() {
    for reply in BOTH {
        let mut bench = Bench::new(NdiProtocol::new(options(reply)).unwrap(), NdiSimulator::new(TIP_MM, []));
        let Some(ProtocolEvent::Ready(identity)) = bench.settle().pop() else { panic!("not ready") };
        assert_eq!(identity.name, "NDI tracker, version G.003.001 SIMULATED");
        assert_eq!(identity.notes.iter().any(|text| text.contains("0.01 mm")), reply == ReplyFormat::Text);
    }
}

#[test]
fn a_handle_that_is_not_there_ends_the_set_up() {
    let options = NdiOptions { handle: Some(3), ..options(ReplyFormat::Binary) };
    let mut bench = Bench::new(NdiProtocol::new(options).unwrap(), NdiSimulator::new(TIP_MM, []));
    let lost = bench.settle().pop();
    assert_eq!(lost, Some(ProtocolEvent::Lost(Failure::Settings("there is no tool 03; tools: 0A".to_owned()))));
}

#[test]
fn a_failed_initialisation_is_said() {
    let fault = Planned::at(NdiFault::InitialisationFails, 1);
    let mut bench =
        Bench::new(NdiProtocol::new(options(ReplyFormat::Text)).unwrap(), NdiSimulator::new(TIP_MM, [fault]));
    let lost = bench.settle().pop();
    let text = "ERROR15: the instrument cannot be initialised".to_owned();
    assert_eq!(lost, Some(ProtocolEvent::Lost(Failure::Refused(text))));
    bench.settle();
    shoot(&mut bench, ReplyFormat::Text);
}

/// What a shot says when all its positions have the fault; `None`: it succeeds all the same, or the fault is no matter.
const fn expected(fault: NdiFault, reply: ReplyFormat) -> &'static str {
    match (fault, reply) {
        (NdiFault::BadCrc, ReplyFormat::Text) => "CRC of a text reply",
        (NdiFault::BadCrc, ReplyFormat::Binary) => "CRC of a binary reply",
        (NdiFault::Missing, _) => "sees no reflector (tool 0A is not seen)",
        (NdiFault::Disabled, _) => "tool 0A is disabled",
        (NdiFault::WrongMode, _) => "ERROR0C: not possible in this mode",
        (NdiFault::CommandDamaged, _) => "ERROR04: the command arrived damaged",
        (NdiFault::CommandTimeout, _) => "ERROR05: the command took too long",
        (NdiFault::WrongBody | NdiFault::WrongLength, ReplyFormat::Text) => "characters too many",
        (NdiFault::WrongBody, ReplyFormat::Binary) => "length is wrong",
        (NdiFault::LateReply | NdiFault::Cut | NdiFault::Silent, _) | (NdiFault::WrongLength, ReplyFormat::Binary) => {
            "no answer from the instrument for 2 s while waiting for a position"
        }
        (NdiFault::OutOfVolume, _) => "tool 0A is outside the measurement volume",
        (NdiFault::HardwareFailure, _) => "failure of its hardware",
        (NdiFault::Halves | NdiFault::PartlyOutOfVolume | NdiFault::Infrared, _) => "",
        (NdiFault::FrozenFrame, _) => "there is no new frame",
        (NdiFault::NotANumber, ReplyFormat::Text) => "not a signed number",
        (NdiFault::NotANumber, ReplyFormat::Binary) => "is out of range",
        (NdiFault::NoRotation, _) => "rotation of the tool is invalid",
        (NdiFault::Origin, _) => "0, 0, 0",
        (NdiFault::Reset | NdiFault::DisconnectMidPacket | NdiFault::InitialisationFails | NdiFault::SlowStart, _) => {
            "lost"
        }
    }
}

/// The first position answers a live question; the fault lasts for the whole shot after it.
fn faulty_shot(fault: NdiFault, reply: ReplyFormat, times: u32) {
    let mut bench = bench(reply, [Planned::from(fault, 3, times)]);
    shoot(&mut bench, reply);
    let before = bench.cell.shots;
    match bench.shoot().pop() {
        Some(ProtocolEvent::Shot(shot)) => assert_fresh(&shot, before, &bench, reply),
        Some(ProtocolEvent::Failed(failure)) => {
            let text = expected(fault, reply);
            assert!(!text.is_empty() && failure.to_string().contains(text), "{fault} {reply:?}: {failure}");
        }
        Some(ProtocolEvent::Lost(_)) if expected(fault, reply) == "lost" => {
            bench.settle();
        }
        other => panic!("{fault} {reply:?}: {other:?}"),
    }
    for _ in 0..20 {
        let before = bench.cell.shots;
        match bench.shoot().pop() {
            Some(ProtocolEvent::Shot(shot)) => assert_fresh(&shot, before, &bench, reply),
            Some(ProtocolEvent::Failed(_)) => {}
            Some(ProtocolEvent::Lost(_)) if expected(fault, reply) == "lost" => bench.connect(),
            other => panic!("{fault} {reply:?}: {other:?}"),
        }
        bench.run_for(Duration::from_millis(300));
    }
    shoot(&mut bench, reply);
}

#[test]
fn every_fault_is_said_and_passes() {
    for reply in BOTH {
        let of_positions = |fault: &&NdiFault| !matches!(fault, NdiFault::InitialisationFails | NdiFault::SlowStart);
        for &fault in NdiFault::ALL.iter().filter(of_positions) {
            for times in [1, 2, 4] {
                faulty_shot(fault, reply, times);
            }
        }
    }
}

#[test]
fn a_lasting_fault_is_said_in_its_words() {
    for reply in BOTH {
        for &fault in NdiFault::ALL {
            if matches!(expected(fault, reply), "" | "lost") {
                continue;
            }
            let mut bench = bench(reply, [Planned::from(fault, 2, 1000)]);
            match bench.shoot().pop() {
                Some(ProtocolEvent::Failed(failure)) => {
                    assert!(failure.to_string().contains(expected(fault, reply)), "{fault} {reply:?}: {failure}");
                }
                other => panic!("{fault} {reply:?}: {other:?}"),
            }
        }
    }
}

#[test]
fn what_the_flags_say_is_a_remark_on_the_point() {
    for reply in BOTH {
        for (fault, words) in [
            (NdiFault::PartlyOutOfVolume, "the tool is partly outside the measurement volume"),
            (NdiFault::Infrared, "too much infrared light around the instrument"),
        ] {
            let mut bench = bench(reply, [Planned::always(fault)]);
            let Some(ProtocolEvent::Shot(shot)) = bench.shoot().pop() else { panic!("{fault}") };
            let warnings: Vec<&str> = shot
                .remarks
                .iter()
                .filter(|remark| remark.severity == Severity::Warning)
                .map(|remark| remark.text.as_str())
                .collect();
            assert_eq!(warnings, [words], "{reply:?}");
        }
    }
}

#[test]
fn hardware_that_starts_slowly_is_waited_for() {
    let mut bench = bench(ReplyFormat::Binary, [Planned::always(NdiFault::SlowStart)]);
    assert!(bench.elapsed() > Duration::from_secs(18));
    shoot(&mut bench, ReplyFormat::Binary);
}

/// A bench on a serial line: the wanted speed, and the one of the instrument.
fn serial(wanted: u32, instrument: u32) -> NdiBench {
    let protocol = NdiProtocol::new(options(ReplyFormat::Binary)).unwrap().on_serial_line(wanted);
    Bench::new(protocol, NdiSimulator::new(TIP_MM, []).on_serial_line(instrument, wanted))
}

#[test]
fn a_serial_line_gets_the_wanted_speed_whatever_it_was() {
    for (wanted, instrument, resets) in
        [(115_200, 115_200, 0), (115_200, 9600, 0), (9600, 9600, 0), (115_200, 57_600, 1), (9600, 115_200, 1)]
    {
        let mut bench = serial(wanted, instrument);
        let events = bench.settle();
        assert!(matches!(events.last(), Some(ProtocolEvent::Ready(_))), "{wanted} {instrument}: {events:?}");
        assert_eq!(bench.simulator.speed(), Some(wanted));
        assert_eq!(bench.simulator.resets(), resets, "a reset unloads the tools: {wanted} {instrument}");
        shoot(&mut bench, ReplyFormat::Binary);
    }
}

#[test]
fn a_serial_line_without_an_instrument_is_given_up() {
    let mut bench = serial(115_200, 9600);
    bench.unplug();
    bench.protocol.start(bench.now);
    let events = bench.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))), "{events:?}");
    assert!(bench.elapsed() < Duration::from_secs(20), "{:?}", bench.elapsed());
}

#[test]
fn a_silent_instrument_is_lost_when_idle() {
    let mut bench = bench(ReplyFormat::Binary, [Planned::from(NdiFault::Silent, 2, 1000)]);
    let events = bench.run_for(Duration::from_secs(30));
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))), "{events:?}");
}

#[test]
fn a_cancelled_shot_is_swallowed() {
    for reply in BOTH {
        let mut bench = bench(reply, []);
        bench.trigger();
        bench.cancel();
        let events = bench.run_for(Duration::from_secs(3));
        assert!(events.iter().all(|event| matches!(event, ProtocolEvent::Live(_))), "{events:?}");
        shoot(&mut bench, reply);
    }
}

fn conversation(reply: ReplyFormat) -> NdiBench {
    let is_left_out = |fault: NdiFault| {
        matches!(
            fault,
            NdiFault::DisconnectMidPacket | NdiFault::Reset | NdiFault::InitialisationFails | NdiFault::SlowStart
        )
    };
    let faults = NdiFault::ALL.iter().filter(|fault| !is_left_out(**fault)).zip(1..);
    let mut bench = bench(reply, faults.map(|(&fault, at)| Planned::at(fault, 4 * at)));
    for _ in 0..20 {
        bench.shoot();
    }
    bench
}

#[test]
fn splits_change_nothing() {
    for reply in BOTH {
        let make = || NdiProtocol::new(options(reply)).unwrap();
        let events = assert_splits_change_nothing(make, &conversation(reply).tape);
        assert!(events.iter().any(|event| matches!(event, ProtocolEvent::Shot(_))), "{events:?}");
        let mut plain = bench(reply, []);
        shoot(&mut plain, reply);
        // Without pauses nothing is asked for after the set-up.
        let events = assert_splits_change_nothing(make, &plain.tape.joined());
        assert!(matches!(events.as_slice(), [ProtocolEvent::Ready(_)]), "{events:?}");
    }
}

#[test]
fn noise_breaks_nothing() {
    for reply in BOTH {
        let bench = conversation(reply);
        let make = || NdiProtocol::new(options(reply)).unwrap();
        fuzz_protocol(make, &bench.tape, NdiProtocol::pending, Bounds::of_protocol(MAX_TEXT));
        let bounds = Bounds { pending: MAX_TEXT, outputs: 512 };
        fuzz_simulator(|| NdiSimulator::new(TIP_MM, []), &bench.sent, NdiSimulator::pending, bounds);
    }
}
