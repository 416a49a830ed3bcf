//! The driver against its other end: points, faults, splits, noise.

use std::time::Duration;

use super::super::bench::fuzz::{Bounds, fuzz_protocol, fuzz_simulator};
use super::super::bench::streams::assert_splits_change_nothing;
use super::super::bench::{Bench, MockCell};
use super::super::fault::Planned;
use super::AsciiFault;
use super::AsciiSimulator;
use crate::link::protocol::Failure;
use crate::link::protocol::ProtocolEvent;
use crate::link::protocol::Shot;
use crate::link::protocol::ascii::AsciiOptions;
use crate::link::protocol::ascii::AsciiProtocol;
use crate::link::protocol::ascii::Checksum;
use crate::link::protocol::ascii::DecimalSign;
use crate::link::protocol::ascii::LengthUnit;
use crate::link::protocol::ascii::Mode;
use crate::link::protocol::ascii::Preset;
use crate::link::protocol::ascii::Separator;
use crate::link::protocol::lines::MAX_LINE;

type AsciiBench = Bench<AsciiProtocol, AsciiSimulator>;

fn bench(options: &AsciiOptions, faults: impl IntoIterator<Item = Planned<AsciiFault>>) -> AsciiBench {
    let protocol = AsciiProtocol::new(options.clone()).unwrap();
    let mut bench = Bench::new(protocol, AsciiSimulator::new(options.clone(), faults).unwrap());
    bench.settle();
    bench
}

/// A polled source with NMEA check values.
fn polled() -> AsciiOptions {
    AsciiOptions {
        mode: Mode::Polled { trigger: "R\\r".to_owned() },
        checksum: Checksum::Nmea,
        error_pattern: Some("^.?ERR".to_owned()),
        ..AsciiOptions::default()
    }
}

fn streamed(lines: u32) -> AsciiOptions {
    AsciiOptions { mode: Mode::Streamed { lines }, error_pattern: Some("^ERR".to_owned()), ..AsciiOptions::default() }
}

/// The source's newest point, within a nanometre.
#[track_caller]
fn assert_newest(shot: &Shot, bench: &AsciiBench) {
    let error = (shot.point - bench.cell.newest()).norm();
    assert!(error < 1e-9, "{error} m from the newest point");
}

#[track_caller]
fn shot(bench: &mut AsciiBench) -> Shot {
    match bench.shoot().pop() {
        Some(ProtocolEvent::Shot(shot)) => shot,
        other => panic!("no shot: {other:?}"),
    }
}

#[track_caller]
fn failure(bench: &mut AsciiBench) -> Failure {
    match bench.shoot().pop() {
        Some(ProtocolEvent::Failed(failure)) => failure,
        other => panic!("no failure: {other:?}"),
    }
}

#[test]
fn a_point_comes_back_in_every_format() {
    let units = [LengthUnit::Metre, LengthUnit::Millimetre, LengthUnit::Micrometre, LengthUnit::Inch];
    let separators = [Separator::Comma, Separator::Semicolon, Separator::Tab, Separator::Spaces];
    for (unit, separator) in units.into_iter().flat_map(|unit| separators.map(|separator| (unit, separator))) {
        for checksum in [Checksum::None, Checksum::Nmea, Checksum::Crc16] {
            for decimal_sign in [DecimalSign::Point, DecimalSign::Comma] {
                let options = AsciiOptions { unit, separator, decimal_sign, checksum, ..polled() };
                if options.validate().is_ok() {
                    let mut bench = bench(&options, []);
                    let shot = shot(&mut bench);
                    assert_newest(&shot, &bench);
                }
            }
        }
    }
}

#[test]
fn every_preset_but_the_gauge_gives_points() {
    for &preset in Preset::ALL {
        let options = preset.options();
        if preset == Preset::Mitutoyo {
            assert!(options.validate().is_err_and(|text| text.contains("one dimension")));
            continue;
        }
        let mut bench = bench(&options, []);
        for _ in 0..3 {
            let shot = shot(&mut bench);
            assert_newest(&shot, &bench);
        }
    }
}

#[test]
fn standard_deviations_are_those_of_the_source_or_none() {
    let mut bench = bench(&Preset::Bridge.options(), []);
    let stated = bench.cell.sigma.unwrap();
    let sigma = shot(&mut bench).sigma.unwrap();
    assert!(sigma.iter().zip(stated).all(|(found, stated)| (found - stated).abs() < 1e-12), "{sigma:?}");
    bench.cell.sigma = None;
    assert_eq!(shot(&mut bench).sigma, None);
}

#[test]
fn a_stream_is_averaged_over_lines_after_the_trigger() {
    let mut bench = bench(&streamed(4), []);
    let live = bench.run_for(Duration::from_secs(1));
    assert!(live.iter().any(|event| matches!(event, ProtocolEvent::Live(_))));
    let before = bench.cell.shots;
    let shot = shot(&mut bench);
    let mean = (0..4).map(|n| MockCell::point(before + n).coords).sum::<nalgebra::Vector3<f64>>() / 4.0;
    assert!((shot.point.coords - mean).norm() < 1e-9);
    assert!(shot.remarks.iter().any(|remark| remark.text.starts_with("mean of 4 lines")), "{shot:?}");
}

/// What a polled shot with the fault says; `None`: it succeeds all the same.
const fn expected(fault: AsciiFault) -> Option<&'static str> {
    Some(match fault {
        AsciiFault::Halves | AsciiFault::TwoInOne | AsciiFault::CarriageReturnOnly | AsciiFault::EmptyLines => {
            return None;
        }
        AsciiFault::Cut | AsciiFault::Noise | AsciiFault::Joined | AsciiFault::BitError => "check sum",
        AsciiFault::DecimalComma | AsciiFault::Thousands => "columns",
        AsciiFault::NotANumber => "NaN",
        AsciiFault::LongLine => "without a line end",
        AsciiFault::ErrorText => "refused: $ERR-305",
        AsciiFault::StaleRepeat => "identical to the previous point",
        AsciiFault::DisconnectMidLine => "",
        AsciiFault::Origin => "0, 0, 0",
        AsciiFault::WrongUnit => "check the unit",
        AsciiFault::Silent | AsciiFault::Late => "no answer from the instrument for 5 s while waiting for a line",
    })
}

#[test]
fn every_fault_of_a_polled_source_is_said_and_passes() {
    for &fault in AsciiFault::ALL {
        let mut bench = bench(&polled(), [Planned::at(fault, 2)]);
        shot(&mut bench);
        match (expected(fault), bench.shoot().pop()) {
            (Some(""), Some(ProtocolEvent::Lost(Failure::Disconnected(_)))) => {
                bench.settle();
            }
            (None, Some(ProtocolEvent::Shot(shot))) => assert_newest(&shot, &bench),
            (Some(text), Some(ProtocolEvent::Failed(failure))) => {
                assert!(failure.to_string().contains(text), "{fault}: {failure}");
            }
            (_, answer) => panic!("{fault}: {answer:?}"),
        }
        for _ in 0..2 {
            let shot = shot(&mut bench);
            assert_newest(&shot, &bench);
        }
    }
}

#[test]
fn every_fault_of_a_stream_gives_no_wrong_point() {
    for &fault in AsciiFault::ALL {
        // Without a check value a changed digit cannot be seen.
        if matches!(fault, AsciiFault::BitError) {
            continue;
        }
        for at in 1..6 {
            let mut bench = bench(&streamed(1), [Planned::at(fault, at)]);
            for _ in 0..8 {
                match bench.shoot().pop() {
                    Some(ProtocolEvent::Shot(shot)) => {
                        let error = bench.cell.error(&shot.point, 0);
                        assert!(error < 1e-9, "{fault}: {error} m from every point");
                    }
                    Some(ProtocolEvent::Failed(_)) => assert_ne!(expected(fault), None, "{fault}"),
                    Some(ProtocolEvent::Lost(_)) if fault == AsciiFault::DisconnectMidLine => bench.connect(),
                    other => panic!("{fault}: {other:?}"),
                }
            }
        }
    }
}

#[test]
fn a_late_answer_is_never_taken_for_the_next_one() {
    let mut bench = bench(&polled(), [Planned::at(AsciiFault::Late, 1)]);
    assert!(matches!(failure(&mut bench), Failure::Silent { .. }));
    // Shots before, around and after the time at which the late line comes.
    for _ in 0..12 {
        let before = bench.cell.shots;
        let shot = shot(&mut bench);
        assert!(bench.cell.error(&shot.point, before) < 1e-9);
        bench.run_for(Duration::from_secs(4));
    }
}

#[test]
fn a_cancelled_shot_is_swallowed() {
    let mut bench = bench(&polled(), []);
    bench.trigger();
    bench.run_for(Duration::from_millis(100));
    bench.cancel();
    assert_eq!(bench.run_for(Duration::from_secs(3)), []);
    let shot = shot(&mut bench);
    assert_newest(&shot, &bench);
}

#[test]
fn a_broken_beam_is_the_instruments_own_words() {
    let mut bench = bench(&Preset::T2sa.options(), []);
    bench.cell.has_beam = false;
    let failure = failure(&mut bench);
    assert_eq!(failure, Failure::Refused("ERR-305 point measurement failed".to_owned()));
}

#[test]
fn a_wrong_baud_rate_is_said_after_three_lines() {
    let mut bench = bench(&streamed(1), [Planned::from(AsciiFault::Noise, 1, 100)]);
    let events = bench.run_for(Duration::from_secs(1));
    let hints: Vec<_> = events.iter().filter(|event| matches!(event, ProtocolEvent::Status(_))).collect();
    assert!(format!("{hints:?}").contains("check baud rate, line ending"));
    assert_eq!(hints.len(), 1, "{hints:?}");
}

#[test]
fn a_stream_that_stops_is_said_once() {
    let options = AsciiOptions { timeout_s: 2.0, ..streamed(1) };
    let mut bench = bench(&options, [Planned::from(AsciiFault::Silent, 5, 1000)]);
    let events = bench.run_for(Duration::from_secs(20));
    let said = events.iter().filter(|event| matches!(event, ProtocolEvent::Status(_))).count();
    assert_eq!(said, 1, "{events:?}");
    assert!(matches!(failure(&mut bench), Failure::Silent { seconds: 2.0, .. }));
}

fn conversation(options: &AsciiOptions) -> AsciiBench {
    let faults =
        AsciiFault::ALL.iter().filter(|fault| !matches!(fault, AsciiFault::DisconnectMidLine | AsciiFault::Late));
    let mut bench = bench(options, faults.zip(2..).map(|(&fault, at)| Planned::at(fault, at)));
    for _ in 0..24 {
        bench.shoot();
    }
    bench
}

#[test]
fn splits_change_nothing() {
    for options in [polled(), streamed(2), Preset::T2sa.options(), Preset::Bridge.options()] {
        let mut tape = conversation(&options).tape;
        // 10 kB cut at every byte would take long and show nothing more than 20 bytes do.
        tape.0.retain(|input| input.bytes().len() <= MAX_LINE);
        for tape in [tape.joined(), tape] {
            let events = assert_splits_change_nothing(|| AsciiProtocol::new(options.clone()).unwrap(), &tape);
            assert!(events.iter().any(|event| matches!(event, ProtocolEvent::Shot(_))), "{events:?}");
        }
    }
}

#[test]
fn noise_breaks_nothing() {
    for options in [polled(), streamed(2), Preset::T2sa.options(), Preset::UdpXyzTime.options()] {
        let bench = conversation(&options);
        let make = || AsciiProtocol::new(options.clone()).unwrap();
        fuzz_protocol(make, &bench.tape, AsciiProtocol::pending, Bounds::of_protocol(MAX_LINE));
        let make = || AsciiSimulator::new(options.clone(), []).unwrap();
        fuzz_simulator(make, &bench.sent, AsciiSimulator::pending, Bounds { pending: MAX_LINE, outputs: 512 });
    }
}
