//! Lines, settings and the order of things.

use std::time::Duration;

use nalgebra::Point3;
use serde::Deserialize as _;
use serde::de::value::Error;
use serde::de::value::MapDeserializer;

use super::super::Failure;
use super::super::Protocol as _;
use super::super::ProtocolEvent;
use super::super::outbox::MAX_OFFERED;
use super::super::outbox::MAX_STATUSES;
use super::AsciiOptions;
use super::AsciiProtocol;
use super::Checksum;
use super::Column;
use super::DecimalSign;
use super::Layout;
use super::LengthUnit;
use super::LineParser;
use super::Mode;
use super::ParsedLine;
use super::Preset;
use super::Rejection;
use super::Separator;
use super::number::number;
use super::number::time;
use super::unescape;

fn read(options: &AsciiOptions, line: &str) -> Result<ParsedLine, Rejection> {
    LineParser::new(options.clone()).unwrap().read(line.as_bytes())
}

#[track_caller]
fn assert_point(options: &AsciiOptions, line: &str, metres: [f64; 3]) {
    match read(options, line) {
        Ok(ParsedLine::Point(shot)) => {
            assert!((shot.point - Point3::from(metres)).norm() < 1e-12, "{}", shot.point);
            assert_eq!(shot.raw, line.as_bytes());
        }
        other => panic!("{line}: {other:?}"),
    }
}

#[track_caller]
fn assert_garbled(options: &AsciiOptions, line: &str) {
    assert!(matches!(read(options, line), Err(Rejection::Garbled(_))), "{line}: {:?}", read(options, line));
}

#[test]
fn units_are_converted_to_metres() {
    for (unit, metres) in [
        (LengthUnit::Metre, 1.0),
        (LengthUnit::Millimetre, 1e-3),
        (LengthUnit::Micrometre, 1e-6),
        (LengthUnit::Inch, 0.0254),
    ] {
        let options = AsciiOptions { unit, ..AsciiOptions::default() };
        assert_point(&options, "1,-2.5,+3e0", [metres, -2.5 * metres, 3.0 * metres]);
    }
}

#[test]
fn what_can_be_read_in_two_ways_is_refused() {
    let comma = AsciiOptions::default();
    for line in
        ["1,234.5", "1,5,2,5,3,5", "1 2 3", "1;2;3", "1,2", "1,2,", ",2,3", "1,2,3,4", "0x1,2,3", "1,2,3mm", "1,2,--3"]
    {
        assert_garbled(&comma, line);
    }
    let spaces = AsciiOptions { separator: Separator::Spaces, ..AsciiOptions::default() };
    assert_garbled(&spaces, "1,5 2,5 3,5");
    assert_garbled(&spaces, "1,234.5 2 3");
    let decimal_comma = AsciiOptions { decimal_sign: DecimalSign::Comma, ..spaces };
    assert_point(&decimal_comma, "1,5 2,5  3,5", [1.5e-3, 2.5e-3, 3.5e-3]);
    assert_garbled(&decimal_comma, "1.234,5 2 3");
    assert_garbled(&decimal_comma, "1.5 2.5 3.5");
    assert_garbled(&Preset::T2sa.options(), "ERROR result 1,5,2,5,3,5");
}

#[test]
fn what_is_no_measurement_is_refused() {
    let options = AsciiOptions::default();
    for line in ["NaN,1,2", "1,-inf,2", "1,2,1.#QNAN", "0,0,0", "0.000,-0.0,+0", "90000,0,0"] {
        assert!(matches!(read(&options, line), Err(Rejection::NoPoint(_))), "{line}");
    }
}

#[test]
fn check_values_are_checked() {
    let nmea = AsciiOptions { checksum: Checksum::Nmea, ..AsciiOptions::default() };
    assert_point(&nmea, "$1,2,3*30", [0.001, 0.002, 0.003]);
    assert_garbled(&nmea, "$1,2,4*30");
    assert_garbled(&nmea, "1,2,3");
    let crc = AsciiOptions { checksum: Checksum::Crc16, ..AsciiOptions::default() };
    let sum = super::super::crc::crc16_arc(b"1,2,3");
    assert_point(&crc, &format!("1,2,3{sum:04x}"), [0.001, 0.002, 0.003]);
    assert_garbled(&crc, &format!("1,2,4{sum:04x}"));
    assert_garbled(&crc, "1,2");
    assert_garbled(&crc, "\u{e4}\u{f6}\u{fc}");
}

#[test]
fn the_recommended_line_is_read_whole() {
    let line = "P,A7,1,2,3,0.01,0.02,0.03,0,2026-05-04T12:30:05.250+02:00";
    let Ok(ParsedLine::Point(shot)) = read(&Preset::Bridge.options(), line) else {
        panic!("{:?}", read(&Preset::Bridge.options(), line));
    };
    assert_eq!(shot.remarks.iter().map(|remark| remark.text.as_str()).collect::<Vec<_>>(), ["A7"]);
    assert_eq!(shot.sigma, Some([0.01, 0.02, 0.03].map(|sigma: f64| sigma * 1e-3)));
    assert_eq!(shot.instrument_time, Some(1_777_890_605.25));
    let invalid = line.replace(",0,2026", ",3,2026");
    assert!(matches!(read(&Preset::Bridge.options(), &invalid), Err(Rejection::NoPoint(_))));
    assert_garbled(&Preset::Bridge.options(), &line.replace("P,", "Q,"));
}

#[test]
fn t2sa_is_understood_in_both_forms() {
    let options = Preset::T2sa.options();
    let metres = [-1.25, 0.002, 3e-3];
    assert_point(&options, "ACK-300 Measured p result -1250.0,2.0,3 05/04/2026 12:30:05", metres);
    assert_point(&options, "ACK-300 POS p;X:-1250.0;Y:2;Z:3.0;Rx:0.1;Ry:0;Rz:0;", metres);
    assert_eq!(read(&options, "ACK-300 command accepted"), Ok(ParsedLine::Skipped));
    assert_eq!(read(&options, "ERR-342 no lock"), Err(Rejection::Instrument("ERR-342 no lock".to_owned())));
    assert_garbled(&options, "result 1,2,3 result 4,5,6");
}

#[test]
fn times_are_seconds_or_dates() {
    let seconds = |text| time(text, DecimalSign::Point);
    assert_eq!(seconds("12.5"), Ok(12.5));
    assert_eq!(seconds("1970-01-01T00:00:00Z"), Ok(0.0));
    assert_eq!(seconds("2000-03-01 00:00:00"), Ok(951_868_800.0));
    assert_eq!(seconds("03/01/2000 00:00:01"), Ok(951_868_801.0));
    assert_eq!(seconds("2000-03-01T01:00:00+01:00"), Ok(951_868_800.0));
    for text in ["", "T", "2000-13-01T00:00:00", "2000-01-01", "2000-01-01T25:00:00", "2000-01-01T00:00", "yesterday"] {
        assert!(seconds(text).is_err(), "{text}");
    }
    assert!(number("1e999", DecimalSign::Point).is_err());
}

#[test]
fn escapes_become_bytes() {
    assert_eq!(unescape("R\\r\\n\\t\\0\\\\\\x06\u{e9}"), Ok(b"R\r\n\t\0\\\x06\xC3\xA9".to_vec()));
    for text in ["\\", "\\q", "\\x0", "\\xgg"] {
        assert!(unescape(text).is_err(), "{text}");
    }
}

#[test]
fn settings_that_cannot_work_are_refused_with_all_reasons() {
    let bad = AsciiOptions {
        mode: Mode::Polled { trigger: String::new() },
        layout: Layout::Columns(vec![Column::X, Column::X, Column::SigmaX]),
        decimal_sign: DecimalSign::Comma,
        range_mm: f64::NAN,
        timeout_s: 0.0,
        comment_prefix: Some(String::new()),
        error_pattern: Some("(".to_owned()),
        ..AsciiOptions::default()
    };
    let reasons = bad.validate().unwrap_err();
    for reason in [
        "trigger is empty",
        "occurs twice",
        "one coordinate",
        "all of sx",
        "comma",
        "range_mm",
        "timeout_s",
        "comment_prefix",
        "error_pattern",
    ] {
        assert!(reasons.contains(reason), "{reason}: {reasons}");
    }
    let unknown =
        AsciiOptions { layout: Layout::Regex("(?<x>.)(?<y>.)(?<z>.)(?<w>.)".to_owned()), ..AsciiOptions::default() };
    assert!(unknown.validate().unwrap_err().contains("unknown group `w`"));
    let many = AsciiOptions { mode: Mode::Streamed { lines: 0 }, ..AsciiOptions::default() };
    assert!(many.validate().is_err());
}

#[test]
fn settings_are_read_strictly_and_have_defaults() {
    let of = |pairs: Vec<(&str, f64)>| AsciiOptions::deserialize(MapDeserializer::<_, Error>::new(pairs.into_iter()));
    assert_eq!(of(vec![]), Ok(AsciiOptions::default()));
    assert!(of(vec![("range", 3.0)]).is_err_and(|error| error.to_string().contains("unknown field")));
}

#[test]
fn a_source_that_never_rests_cannot_be_drained() {
    let mut protocol =
        started(AsciiOptions { mode: Mode::Polled { trigger: "R".to_owned() }, ..AsciiOptions::default() });
    protocol.trigger(Duration::ZERO);
    protocol.tick(Duration::from_secs(5));
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::Silent { .. }))));
    protocol.feed(b"x", Duration::from_secs(5));
    protocol.trigger(Duration::from_secs(5));
    for step in 0..60 {
        let now = Duration::from_secs(5) + Duration::from_millis(100 * step);
        protocol.feed(b"x", now);
        protocol.tick(now);
    }
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::NotReady(_)))));
}

#[test]
fn presets_are_found_by_name() {
    for &preset in Preset::ALL {
        assert_eq!(preset.to_string().parse(), Ok(preset));
    }
    assert!("none".parse::<Preset>().is_err());
}

fn started(options: AsciiOptions) -> AsciiProtocol {
    let mut protocol = AsciiProtocol::new(options).unwrap();
    protocol.start(Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Ready(_))));
    protocol
}

#[test]
fn a_line_begun_before_the_trigger_is_not_its_answer() {
    let mut protocol = started(AsciiOptions::default());
    protocol.feed(b"1,2,", Duration::ZERO);
    protocol.trigger(Duration::ZERO);
    protocol.feed(b"3\n4,5,6\n", Duration::ZERO);
    match protocol.next_event() {
        Some(ProtocolEvent::Shot(shot)) => assert_eq!(shot.raw, b"4,5,6"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_line_with_an_old_time_is_passed_over() {
    let mut protocol = started(Preset::UdpXyzTime.options());
    protocol.feed(b"1,2,3,10", Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Live(_))));
    protocol.trigger(Duration::ZERO);
    protocol.feed(b"4,5,6,10", Duration::ZERO);
    protocol.feed(b"4,5,6,9.5", Duration::ZERO);
    assert_eq!(protocol.next_event(), None);
    protocol.feed(b"7,8,9,10.5", Duration::ZERO);
    match protocol.next_event() {
        Some(ProtocolEvent::Shot(shot)) => assert_eq!(shot.instrument_time, Some(10.5)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_average_never_spans_a_failure() {
    let mut protocol = started(AsciiOptions { mode: Mode::Streamed { lines: 2 }, ..AsciiOptions::default() });
    protocol.trigger(Duration::ZERO);
    protocol.feed(b"1,1,1\nnoise\n3,3,3\n", Duration::ZERO);
    assert_eq!(protocol.next_event(), None);
    protocol.feed(b"5,5,5\n", Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Shot(shot)) if (shot.point.x - 4e-3).abs() < 1e-12));
    protocol.trigger(Duration::ZERO);
    protocol.feed(b"1,1,1\n0,0,0\n", Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::Unusable(_)))));
}

#[test]
fn equal_readings_are_allowed_only_where_it_is_said() {
    for allow_identical in [false, true] {
        let mut protocol = started(AsciiOptions { allow_identical, ..AsciiOptions::default() });
        for shot in 0..2 {
            protocol.trigger(Duration::ZERO);
            protocol.feed(b"1,2,3\n", Duration::ZERO);
            let is_shot = matches!(protocol.next_event(), Some(ProtocolEvent::Shot(_)));
            assert_eq!(is_shot, shot == 0 || allow_identical);
        }
    }
}

#[test]
fn a_second_trigger_and_one_before_the_start_are_too_early() {
    let mut protocol = AsciiProtocol::new(AsciiOptions::default()).unwrap();
    protocol.trigger(Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::TooEarly(_)))));
    let mut protocol = started(AsciiOptions::default());
    protocol.trigger(Duration::ZERO);
    protocol.trigger(Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::TooEarly(_)))));
    protocol.feed(b"1,2,3\n", Duration::ZERO);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Shot(_))));
}

#[test]
fn a_flood_of_lines_keeps_the_queues_short() {
    let flood: String =
        (1..=10_000).map(|n| if n % 3 == 0 { "noise\n".to_owned() } else { format!("{n},2,3\n") }).collect();
    let polled = AsciiOptions { mode: Mode::Polled { trigger: "R".to_owned() }, ..AsciiOptions::default() };
    for options in [AsciiOptions::default(), polled] {
        let mut protocol = started(options);
        protocol.feed(flood.as_bytes(), Duration::ZERO);
        let events: Vec<ProtocolEvent> = std::iter::from_fn(|| protocol.next_event()).collect();
        assert!(events.len() <= MAX_OFFERED + MAX_STATUSES + 1, "{}", events.len());
        let last = events.iter().rev().find_map(|event| match event {
            ProtocolEvent::Live(shot) | ProtocolEvent::Offered(shot) => Some(shot.raw.clone()),
            _ => None,
        });
        assert_eq!(last, Some(b"10000,2,3".to_vec()));
    }
}

#[test]
fn latin_1_names_do_not_spoil_a_line() {
    let parser = LineParser::new(Preset::NameXyz.options()).unwrap();
    match parser.read(b"Pr\xFCfpunkt,1,2,3") {
        Ok(ParsedLine::Point(shot)) => {
            assert!(shot.remarks.iter().any(|remark| remark.text == "Pr\u{fc}fpunkt"), "{shot:?}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_line_that_may_answer_an_earlier_trigger_is_not_taken() {
    let mut protocol =
        started(AsciiOptions { mode: Mode::Polled { trigger: "R".to_owned() }, ..AsciiOptions::default() });
    let second = Duration::from_secs(1);
    protocol.trigger(Duration::ZERO);
    protocol.tick(5 * second);
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Failed(Failure::Silent { .. }))));
    protocol.trigger(6 * second);
    assert_eq!(std::iter::from_fn(|| protocol.next_output()).count(), 2);
    protocol.feed(b"1,2,3\n", 7 * second);
    assert_eq!(protocol.next_event(), None);
    assert_eq!(protocol.next_output(), Some(b"R".to_vec()));
    protocol.feed(b"4,5,6\n", 7 * second);
    match protocol.next_event() {
        Some(ProtocolEvent::Shot(shot)) => assert_eq!(shot.raw, b"4,5,6"),
        other => panic!("{other:?}"),
    }
}

/// How programs write the same point.
#[test]
fn the_forms_of_programs_are_read() {
    for (preset, line) in [
        (Preset::Xyz, "1.5,-2.25,3000"),
        (Preset::NameXyz, "p 7,1.5,-2.25,3000.0"),
        (Preset::Blanks, "p7   1.5 -2.25   3000.0"),
        (Preset::Tabs, "p 7\t1.5\t-2.25\t3000.0"),
        (Preset::Semicolons, "p7;1,5;-2,25;3000,0"),
        (Preset::BridgeAsked, "P,p7,1.5,-2.25,3000.0,0.01,0.01,0.02,0,2026-01-05T08:00:00Z"),
    ] {
        let Ok(ParsedLine::Point(shot)) = read(&preset.options(), line) else {
            panic!("{preset:?}: {:?}", read(&preset.options(), line));
        };
        assert!((shot.point - Point3::new(0.0015, -0.00225, 3.0)).norm() < 1e-12, "{preset:?}: {shot:?}");
    }
}
