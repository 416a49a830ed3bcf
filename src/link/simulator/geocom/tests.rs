//! The driver against its other end: points, faults, splits, noise.

use std::time::Duration;

use super::super::bench::Bench;
use super::super::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use super::super::bench::streams::assert_splits_change_nothing;
use super::super::fault::Planned;
use super::GeocomFault;
use super::GeocomSimulator;
use super::MAX_RECEIVED;
use crate::link::protocol::Failure;
use crate::link::protocol::Identity;
use crate::link::protocol::ProtocolEvent;
use crate::link::protocol::Shot;
use crate::link::protocol::geocom::GeocomOptions;
use crate::link::protocol::geocom::GeocomProtocol;
use crate::link::protocol::geocom::Measurement;
use crate::link::protocol::lines::MAX_LINE;

type GeocomBench = Bench<GeocomProtocol, GeocomSimulator>;

fn unconnected(options: &GeocomOptions, faults: impl IntoIterator<Item = Planned<GeocomFault>>) -> GeocomBench {
    Bench::new(GeocomProtocol::new(options.clone()).unwrap(), GeocomSimulator::new(faults))
}

#[track_caller]
fn identity(bench: &mut GeocomBench) -> Identity {
    match bench.settle().pop() {
        Some(ProtocolEvent::Ready(identity)) => identity,
        other => panic!("not ready: {other:?}"),
    }
}

fn bench(faults: impl IntoIterator<Item = Planned<GeocomFault>>) -> GeocomBench {
    let mut bench = unconnected(&GeocomOptions::default(), faults);
    identity(&mut bench);
    bench
}

#[track_caller]
fn shot(bench: &mut GeocomBench) -> Shot {
    match bench.shoot().pop() {
        Some(ProtocolEvent::Shot(shot)) => {
            let error = (shot.point - bench.cell.newest()).norm();
            assert!(error < 1e-9, "{error} m from the newest point");
            shot
        }
        other => panic!("no shot: {other:?}"),
    }
}

#[test]
fn a_point_comes_back_by_every_way_of_measuring() {
    for measurement in [Measurement::FineAdjust, Measurement::DistanceAngle, Measurement::Simple] {
        for checksum in [false, true] {
            let mut bench = unconnected(&GeocomOptions { measurement, checksum, ..GeocomOptions::default() }, []);
            identity(&mut bench);
            for _ in 0..10 {
                assert_eq!(shot(&mut bench).face, Some(1));
            }
        }
    }
}

#[test]
fn the_set_up_says_who_answers_and_what_it_cannot_do() {
    let identity = identity(&mut unconnected(&GeocomOptions::default(), []));
    assert_eq!(identity.name, "TS30 SIMULATED, serial number 362541, GeoCOM 1.50.3");
    assert!(identity.notes.iter().any(|text| text.contains("0.5 to 1 mm")));
    assert!(identity.checked.iter().any(|text| text == "prism constant: -34.40 mm (read back)"), "{identity:?}");
    assert_eq!(identity.reflector.map(|reflector| reflector.offset), Some(-0.0344));
}

#[test]
fn what_is_set_is_read_back() {
    let options = GeocomOptions {
        target_recognition: Some(true),
        edm_mode: Some(7),
        prism_constant_mm: Some(-17.5),
        ..GeocomOptions::default()
    };
    let identity = identity(&mut unconnected(&options, []));
    assert_eq!(
        identity.checked.get(2..),
        Some(
            [
                "decimals: 15 (read back)",
                "target recognition: on",
                "EDM mode: 7 (read back)",
                "prism constant: -17.50 mm (read back)",
                "face: 1",
                "correction of distances: 8.40 ppm for the air, no scale",
            ]
            .map(str::to_owned)
            .as_slice()
        )
    );
}

/// What a shot with the fault says; `None`: it succeeds all the same.
const fn expected(fault: GeocomFault) -> Option<&'static str> {
    Some(match fault {
        GeocomFault::CrcError
        | GeocomFault::HalfLine
        | GeocomFault::CarriageReturnOnly
        | GeocomFault::Busy
        | GeocomFault::AccuracyNotGuaranteed
        | GeocomFault::NoFullCorrection
        | GeocomFault::TransportTimeout
        | GeocomFault::Echo
        | GeocomFault::Asleep => return None,
        GeocomFault::WrongTransaction | GeocomFault::LateReply | GeocomFault::Silent | GeocomFault::Noise => {
            "no answer from the instrument for 60 s while measuring"
        }
        GeocomFault::AngleOnly => "code 1285: only angles",
        GeocomFault::NoTarget => "no reflector (code 8710",
        GeocomFault::LicenceMissing => "licence is missing",
        GeocomFault::StaleRepeat => "identical to the previous point",
        GeocomFault::NotANumber => "angle",
        GeocomFault::EmptyAnswer => "success but sends no values",
        GeocomFault::Scaled | GeocomFault::FewDecimals | GeocomFault::OldSoftware | GeocomFault::Unnumbered => {
            return None;
        }
        GeocomFault::CorrectionsChanged | GeocomFault::DisconnectMidLine | GeocomFault::Dead => "",
    })
}

#[test]
fn every_fault_is_said_and_passes() {
    for &fault in GeocomFault::ALL.iter().filter(|fault| **fault != GeocomFault::Dead) {
        // Tested on its own: it shows at the measurement after it.
        if fault == GeocomFault::CorrectionsChanged {
            continue;
        }
        let from = if fault == GeocomFault::Asleep { 1 } else { 2 };
        let mut bench = bench([Planned::at(fault, from)]);
        shot(&mut bench);
        match (expected(fault), bench.shoot().pop()) {
            (Some(""), Some(ProtocolEvent::Lost(Failure::Disconnected(_)))) => bench.connect(),
            (None, Some(ProtocolEvent::Shot(shot))) => {
                assert!((shot.point - bench.cell.newest()).norm() < 1e-9, "{fault}");
                let is_doubtful = matches!(fault, GeocomFault::AccuracyNotGuaranteed | GeocomFault::NoFullCorrection);
                assert_eq!(!shot.remarks.is_empty(), is_doubtful, "{fault}");
            }
            (Some(text), Some(ProtocolEvent::Failed(failure))) => {
                assert!(failure.to_string().contains(text), "{fault}: {failure}");
            }
            (_, answer) => panic!("{fault}: {answer:?}"),
        }
        bench.run_for(Duration::from_secs(3));
        shot(&mut bench);
        shot(&mut bench);
    }
}

#[test]
fn a_scale_refuses_the_link() {
    let mut bench = unconnected(&GeocomOptions::default(), [Planned::once(GeocomFault::Scaled)]);
    let Some(ProtocolEvent::Lost(failure @ Failure::Scaled(_))) = bench.settle().pop() else { panic!() };
    assert!(failure.to_string().contains("by the scale 1.0004"), "{failure}");
    assert!(failure.hint().contains("map projection"), "{}", failure.hint());
    identity(&mut bench);
    shot(&mut bench);
}

#[test]
fn a_station_that_rounds_is_refused_in_the_set_up_and_at_a_shot() {
    let mut bench = unconnected(&GeocomOptions::default(), [Planned::once(GeocomFault::FewDecimals)]);
    let Some(ProtocolEvent::Lost(failure)) = bench.settle().pop() else { panic!() };
    assert!(failure.to_string().contains("only 3 decimals"), "{failure}");
    identity(&mut bench);
    // Another program sets fewer decimals afterwards.
    bench.simulator_gets(b"%R1Q,107,1:3\r\n");
    let Some(ProtocolEvent::Lost(Failure::Settings(text))) = bench.shoot().pop() else { panic!() };
    assert!(text.contains("corrections"), "{text}");
    // The next set-up sets them again.
    identity(&mut bench);
    shot(&mut bench);
}

#[test]
fn corrections_that_another_program_changes_refuse_the_next_shot() {
    let mut bench = bench([Planned::once(GeocomFault::CorrectionsChanged)]);
    shot(&mut bench);
    let Some(ProtocolEvent::Lost(Failure::Settings(text))) = bench.shoot().pop() else { panic!() };
    assert_eq!(
        text,
        "the corrections of the distance were 8.40 ppm and -34.40 mm at the set-up and are 50.00 ppm and -34.40 mm now"
    );
    identity(&mut bench);
    shot(&mut bench);
}

#[test]
fn a_station_that_cannot_tell_its_corrections_is_warned_of() {
    let mut bench = unconnected(&GeocomOptions::default(), [Planned::once(GeocomFault::OldSoftware)]);
    let warnings = identity(&mut bench).warnings.join("; ");
    assert!(warnings.contains("does not report its corrections"), "{warnings}");
    assert!(warnings.contains("reading the number of decimals failed"), "{warnings}");
    shot(&mut bench);
}

#[test]
fn answers_without_numbers_are_said_to_be_so() {
    let mut bench = unconnected(&GeocomOptions::default(), [Planned::once(GeocomFault::Unnumbered)]);
    let Some(ProtocolEvent::Lost(failure)) = bench.settle().pop() else { panic!() };
    assert!(failure.to_string().contains("without the number of the request"), "{failure}");
    identity(&mut bench);
}

#[test]
fn three_times_busy_costs_patience_only() {
    let mut bench = bench([Planned::from(GeocomFault::Busy, 1, 3)]);
    let before = bench.now;
    shot(&mut bench);
    assert!(bench.now < before + Duration::from_secs(10));
}

#[test]
fn busy_for_ever_is_said_and_the_link_stays() {
    let mut bench = bench([Planned::from(GeocomFault::Busy, 1, 40)]);
    match bench.shoot().pop() {
        Some(ProtocolEvent::Failed(Failure::NotReady(text))) => assert_eq!(text, "code 1293: a measurement is busy"),
        other => panic!("{other:?}"),
    }
    assert_eq!(bench.run_for(Duration::from_secs(30)), []);
}

#[test]
fn a_damaged_link_is_said_after_three_attempts() {
    let mut bench = bench([Planned::from(GeocomFault::CrcError, 1, 3)]);
    let mut said = bench.shoot();
    let answer = said.pop();
    assert!(matches!(answer, Some(ProtocolEvent::Failed(Failure::Garbled(_)))), "{answer:?}");
    assert!(format!("{said:?}").contains("check baud rate"), "{said:?}");
    bench.run_for(Duration::from_secs(3));
    shot(&mut bench);
}

#[test]
fn a_late_answer_is_thrown_away_and_said() {
    let mut bench = bench([Planned::at(GeocomFault::LateReply, 1)]);
    assert!(matches!(bench.shoot().pop(), Some(ProtocolEvent::Failed(Failure::Silent { .. }))));
    let said = format!("{:?}", bench.run_for(Duration::from_secs(3)));
    assert!(said.contains("late or foreign answer") && said.contains("answers again"), "{said}");
    shot(&mut bench);
}

#[test]
fn a_dead_instrument_is_given_up_and_found_again() {
    let mut bench = unconnected(&GeocomOptions::default(), [Planned::from(GeocomFault::Dead, 1, 16)]);
    let events = bench.settle();
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))), "{events:?}");
    identity(&mut bench);
}

#[test]
fn a_pulled_cable_is_noticed_when_idle() {
    let mut bench = bench([Planned::from(GeocomFault::Dead, 12, 1000)]);
    let events = bench.run_for(Duration::from_mins(1));
    assert!(matches!(events.last(), Some(ProtocolEvent::Lost(Failure::Silent { .. }))), "{events:?}");
}

#[test]
fn a_shot_asked_for_during_the_keep_alive_is_taken_after_it() {
    let mut bench = bench([]);
    bench.run_for(Duration::from_millis(5010));
    shot(&mut bench);
}

#[test]
fn a_cancelled_shot_is_swallowed() {
    let mut bench = bench([]);
    bench.trigger();
    bench.run_for(Duration::from_millis(500));
    bench.cancel();
    let events = bench.run_for(Duration::from_secs(4));
    assert!(events.iter().all(|event| matches!(event, ProtocolEvent::Status(_))), "{events:?}");
    shot(&mut bench);
}

#[test]
fn a_broken_beam_gives_no_point() {
    let mut bench = bench([]);
    shot(&mut bench);
    bench.cell.has_beam = false;
    assert!(matches!(bench.shoot().pop(), Some(ProtocolEvent::Failed(Failure::NoTarget(_)))));
    bench.cell.has_beam = true;
    shot(&mut bench);
}

fn conversation(checksum: bool) -> GeocomBench {
    let faults = GeocomFault::ALL.iter().filter(|fault| {
        !matches!(fault, GeocomFault::DisconnectMidLine | GeocomFault::Dead | GeocomFault::CorrectionsChanged)
    });
    let faults = faults.zip(2..).map(|(&fault, at)| Planned::at(fault, at));
    let mut bench = unconnected(&GeocomOptions { checksum, ..GeocomOptions::default() }, faults);
    identity(&mut bench);
    for _ in 0..24 {
        bench.shoot();
        bench.run_for(Duration::from_secs(2));
    }
    bench
}

#[test]
fn splits_change_nothing() {
    for checksum in [false, true] {
        let options = GeocomOptions { checksum, ..GeocomOptions::default() };
        let make = || GeocomProtocol::new(options.clone()).unwrap();
        let mut plain = unconnected(&options, []);
        identity(&mut plain);
        shot(&mut plain);
        for tape in [conversation(checksum).tape, plain.tape.joined()] {
            let events = assert_splits_change_nothing(make, &tape);
            assert!(events.iter().any(|event| matches!(event, ProtocolEvent::Shot(_))), "{events:?}");
        }
    }
}

#[test]
fn noise_breaks_nothing() {
    for checksum in [false, true] {
        let options = GeocomOptions { checksum, ..GeocomOptions::default() };
        let bench = conversation(checksum);
        let make = || GeocomProtocol::new(options.clone()).unwrap();
        fuzz_protocol(make, &bench.tape, GeocomProtocol::pending, Bounds::of_protocol(MAX_LINE));
        let bounds = Bounds { pending: MAX_RECEIVED, outputs: 512 };
        fuzz_simulator(|| GeocomSimulator::new([]), &bench.sent, GeocomSimulator::pending, bounds);
    }
}
