//! Published messages, codes and the order of things.

use std::time::Duration;

use serde::Deserialize as _;
use serde::de::value::Error;
use serde::de::value::MapDeserializer;

use super::super::Failure;
use super::super::Protocol as _;
use super::super::ProtocolEvent;
use super::super::outbox::MAX_STATUSES;
use super::GeocomOptions;
use super::GeocomProtocol;
use super::Reply;
use super::Request;
use super::code_in_words;
use super::decode_reply;
use super::decode_request;
use super::encode_reply;
use super::encode_request;
use super::failure_of;

fn reply(transport: u32, transaction: u16, code: u32, parameters: &[&str]) -> Reply {
    let parameters = parameters.iter().map(|&text| text.to_owned()).collect();
    Reply { transport, transaction, checked: false, code, parameters }
}

#[test]
fn published_check_values_are_written_and_read() {
    let request = Request { rpc: 0, transaction: 11, parameters: String::new() };
    assert_eq!(encode_request(&request, true), "%R1Q,0,11,28925:");
    assert_eq!(encode_request(&request, false), "%R1Q,0,11:");
    assert_eq!(encode_reply(0, 11, 0, "", true), "%R1P,0,11,22896:0");
    assert_eq!(decode_request(b"%R1Q,0,11,28925:"), Ok((request, true)));
    assert_eq!(decode_reply(b"%R1P,0,11,22896:0"), Ok(Reply { checked: true, ..reply(0, 11, 0, &[]) }));
    assert!(decode_reply(b"%R1P,0,11,22897:0").is_err_and(|text| text.contains("22896")));
}

#[test]
fn replies_are_read_in_all_their_forms() {
    assert_eq!(decode_reply(b"%R1P,0:0"), Ok(reply(0, 0, 0, &[])));
    assert_eq!(decode_reply(b"\xFF~%R1P,0,7:0,362541"), Ok(reply(0, 7, 0, &["362541"])));
    assert_eq!(decode_reply(b"%R1P,0,7:0,\"TS30, 0.5\",'0a'"), Ok(reply(0, 7, 0, &["TS30, 0.5", "'0a'"])));
    let date = reply(0, 0, 0, &["1996", "'07'", "'19'", "'10'", "'13'", "'2f'"]);
    assert_eq!(decode_reply(b"%R1P,0,0:0,1996,'07','19','10','13','2f'"), Ok(date));
    assert_eq!(decode_reply(b"%R1P,3077,0:0"), Ok(reply(3077, 0, 0, &[])));
}

#[test]
fn what_is_no_reply_is_refused() {
    for line in [
        "",
        "%R1P",
        "%R1P:",
        "%R1P,0",
        "%R1P,0:",
        "%R1P,0,1:x",
        "%R1P,x,1:0",
        "%R1P,0,70000:0",
        "%R1P,0,1,2,3:0",
        "%R1P,-1,1:0",
        "%R1P,0,:0",
        "%R1P,0,1:9999999999",
    ] {
        assert!(decode_reply(line.as_bytes()).is_err(), "{line}");
    }
}

#[test]
fn every_code_of_the_manual_has_words() {
    let known = [
        0, 2, 3, 6, 8, 12, 13, 16, 21, 22, 25, 26, 27, 512, 530, 769, 770, 776, 786, 818, 823, 832, 1283, 1284, 1285,
        1288, 1289, 1290, 1291, 1292, 1293, 1294, 1792, 1810, 3074, 3075, 3077, 3078, 3080, 3081, 3093, 3101, 3102,
        3107, 3108, 3109, 3110, 8704, 8708, 8710, 8711, 8712, 8714, 8716,
    ];
    for code in known {
        assert_ne!(code_in_words(code), "unknown code", "{code}");
    }
    assert!(matches!(failure_of(1285), Failure::NoTarget(_)));
    assert!(matches!(failure_of(8716), Failure::Unstable(_)));
    assert!(matches!(failure_of(786), Failure::NotReady(_)));
    assert_eq!(failure_of(4711).to_string(), "the instrument refused: code 4711: unknown code");
}

/// Answers everything with code 0 and these parameters until it is ready; the next request is the answer to the trigger.
fn ready(options: &GeocomOptions) -> GeocomProtocol {
    let mut protocol = GeocomProtocol::new(options.clone()).unwrap();
    protocol.start(Duration::ZERO);
    while let Some(bytes) = protocol.next_output() {
        answer(&mut protocol, &bytes, "0,15");
    }
    assert!(matches!(protocol.next_event(), Some(ProtocolEvent::Ready(_))));
    protocol
}

fn answer(protocol: &mut GeocomProtocol, request: &[u8], body: &str) {
    let line: Vec<u8> = request.iter().copied().filter(|byte| !byte.is_ascii_control()).collect();
    let (request, _) = decode_request(&line).unwrap();
    protocol.feed(format!("%R1P,0,{}:{body}\r\n", request.transaction).as_bytes(), Duration::ZERO);
}

fn measured(body: &str) -> Option<ProtocolEvent> {
    let options = GeocomOptions { measurement: super::Measurement::DistanceAngle, ..GeocomOptions::default() };
    let mut protocol = ready(&options);
    protocol.trigger(Duration::ZERO);
    let request = protocol.next_output().unwrap();
    assert!(request.starts_with(b"%R1Q,17017,"), "{}", String::from_utf8_lossy(&request));
    answer(&mut protocol, &request, body);
    protocol.next_event()
}

#[test]
fn polar_results_become_east_north_height() {
    // Zenith angle of a right angle, Hz clockwise: a quarter turn from north is east.
    let Some(ProtocolEvent::Shot(east)) = measured("0,1.5707963267948966,1.5707963267948966,2.0,2") else {
        panic!("no shot");
    };
    assert!((east.point - nalgebra::Point3::new(2.0, 0.0, 0.0)).norm() < 1e-12, "{}", east.point);
    let Some(ProtocolEvent::Shot(up)) = measured("0,0,0.7853981633974483,1.0,2") else {
        panic!("no shot");
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!((up.point - nalgebra::Point3::new(0.0, half, half)).norm() < 1e-12, "{}", up.point);
    // The same point in the second face.
    let Some(ProtocolEvent::Shot(second)) = measured("0,3.141592653589793,5.497787143782138,1.0,2") else {
        panic!("no shot");
    };
    assert!((second.point - up.point).norm() < 1e-12);
    assert_eq!((up.face, second.face), (Some(1), Some(2)));
}

#[test]
fn numbers_beside_an_error_are_never_a_point() {
    for code in [1285, 1288, 1289, 1290, 1291, 1292, 1294, 8710, 2, 27, 770] {
        let event = measured(&format!("{code},0.5,1.5,2.5,2"));
        assert!(matches!(event, Some(ProtocolEvent::Failed(_))), "{code}: {event:?}");
    }
    for body in [
        "0",
        "0,1",
        "0,0.5,1.5",
        "0,0.5,1.5,0,2",
        "0,0.5,1.5,-1,2",
        "0,0.5,1.5,inf,2",
        "0,nan,1.5,2.5,2",
        "0,99,1.5,2.5,2",
    ] {
        assert!(matches!(measured(body), Some(ProtocolEvent::Failed(_))), "{body}");
    }
}

#[test]
fn what_the_instrument_says_is_shown_without_control_characters_and_short() {
    let mut protocol = GeocomProtocol::new(GeocomOptions::default()).unwrap();
    protocol.start(Duration::ZERO);
    let nasty = format!("0,\"TS\u{1b}[31m\u{202e}{}\"", "x".repeat(1000));
    while let Some(bytes) = protocol.next_output() {
        let is_name = ["%R1Q,5003,", "%R1Q,5004,", "%R1Q,110,", "%R1Q,2021,"]
            .iter()
            .any(|name| bytes.windows(name.len()).any(|window| window == name.as_bytes()));
        answer(&mut protocol, &bytes, if is_name { &nasty } else { "0,15" });
    }
    let Some(ProtocolEvent::Ready(identity)) = protocol.next_event() else { panic!("not ready") };
    let Some(ProtocolEvent::Failed(failure)) = measured(&format!("0,\u{1b}[2J,{},1,2", "9".repeat(1000))) else {
        panic!("no failure")
    };
    let is_plain = |text: &str| !text.chars().any(|c| c.is_control() || c == '\u{202e}');
    for text in identity.checked.iter().chain([&identity.name, &failure.to_string()]) {
        assert!(is_plain(text) && text.len() < 300, "{text:?}");
    }
    assert!(identity.name.contains("TS\u{fffd}[31m"), "{}", identity.name);
}

#[test]
fn a_flood_of_lines_keeps_the_queues_short() {
    let mut protocol = ready(&GeocomOptions::default());
    protocol.trigger(Duration::ZERO);
    protocol.feed("%R1P,0,30000:0\r\nnoise\r\n".repeat(10_000).as_bytes(), Duration::ZERO);
    assert!(std::iter::from_fn(|| protocol.next_event()).count() <= 2 * MAX_STATUSES);
}

#[test]
fn settings_are_read_strictly_and_have_defaults() {
    let of = |pairs: Vec<(&str, f64)>| GeocomOptions::deserialize(MapDeserializer::<_, Error>::new(pairs.into_iter()));
    assert_eq!(of(vec![]), Ok(GeocomOptions::default()));
    assert!(of(vec![("search", 3.0)]).is_err_and(|error| error.to_string().contains("unknown field")));
    for bad in [
        GeocomOptions { search_deg: 0.0, ..GeocomOptions::default() },
        GeocomOptions { timeout_s: f64::NAN, ..GeocomOptions::default() },
        GeocomOptions { prism_constant_mm: Some(2000.0), ..GeocomOptions::default() },
    ] {
        assert!(GeocomProtocol::new(bad).is_err());
    }
}

#[test]
fn transaction_numbers_wrap_and_skip_none_and_zero() {
    let mut protocol = ready(&GeocomOptions::default());
    let mut now = Duration::ZERO;
    let mut last = None;
    for _ in 0..33_000 {
        now += Duration::from_secs(5);
        protocol.tick(now);
        let request = protocol.next_output().unwrap();
        let (parsed, _) = decode_request(request.strip_suffix(b"\r\n").unwrap()).unwrap();
        if let Some(last) = last {
            assert_eq!(parsed.transaction, if last == 32_767 { 1 } else { last + 1 });
        }
        last = Some(parsed.transaction);
        protocol.feed(format!("%R1P,0,{}:0\r\n", parsed.transaction).as_bytes(), now);
    }
}

#[test]
fn every_code_has_its_kind_and_its_words() {
    let kind = |code: u32| match failure_of(code) {
        Failure::NoTarget(text) => ("no target", text),
        Failure::Unstable(text) => ("unstable", text),
        Failure::NotReady(text) => ("not ready", text),
        Failure::Settings(text) => ("settings", text),
        Failure::Unusable(text) => ("unusable", text),
        Failure::Garbled(text) => ("garbled", text),
        Failure::Refused(text) => ("refused", text),
        other => panic!("{code}: {other:?}"),
    };
    for (code, wanted, part) in [
        (1285, "no target", "only angles"),
        (1292, "no target", "no distance"),
        (770, "no target", "no signal"),
        (8710, "no target", "no target"),
        (8708, "unstable", "moves"),
        (8716, "unstable", "accuracy"),
        (776, "unstable", "turbulent"),
        (22, "unstable", "not level"),
        (13, "not ready", "busy"),
        (786, "not ready", "busy"),
        (1293, "not ready", "busy"),
        (16, "not ready", "battery"),
        (3108, "not ready", "asleep"),
        (823, "unusable", "several targets"),
        (8711, "unusable", "several targets"),
        (8714, "settings", "not switched on"),
        (3074, "garbled", "could not read"),
        (3078, "garbled", "malformed"),
        (3093, "garbled", "transaction"),
        (3101, "garbled", "CRC"),
        (27, "refused", "licence"),
        (2, "refused", "parameter"),
        (4242, "refused", "unknown code"),
    ] {
        let (found, text) = kind(code);
        assert_eq!(found, wanted, "{code}: {text}");
        assert!(text.contains(part) && text.contains(&code.to_string()), "{code}: {text}");
    }
}
