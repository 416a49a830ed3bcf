//! Messages, tools and errors.

use std::time::Duration;

use nalgebra::Point3;
use nalgebra::Vector3;
use serde::Deserialize as _;
use serde::de::value::Error;
use serde::de::value::MapDeserializer;

use super::super::Protocol as _;
use super::super::outbox::MAX_OUTPUTS;
use super::super::outbox::MAX_STATUSES;
use super::Frame;
use super::FrameDecoder;
use super::MAX_BINARY;
use super::MAX_TEXT;
use super::NdiOptions;
use super::NdiProtocol;
use super::Tool;
use super::ToolState;
use super::decode_bx;
use super::decode_tx;
use super::encode_binary;
use super::encode_text;
use super::error_in_words;
use super::tools::tip_in_instrument;

fn frames(bytes: &[u8]) -> Vec<Frame> {
    let mut decoder = FrameDecoder::default();
    bytes.iter().filter_map(|&byte| decoder.push(byte)).collect()
}

#[test]
fn published_messages_are_written_and_read() {
    for (text, bytes) in [
        ("OKAY", "OKAYA896\r"),
        ("RESET", "RESETBE6F\r"),
        ("INIT:", "INIT:E3A5\r"),
        ("TSTART:", "TSTART:5423\r"),
        ("TSTOP:", "TSTOP:2C14\r"),
        ("TX:0001", "TX:0001031A\r"),
        ("BX:0001", "BX:0001C26D\r"),
        ("ERROR01", "ERROR016BC2\r"),
        ("PHSR:00", "PHSR:0020FF\r"),
        ("PINIT:0A", "PINIT:0AD5EB\r"),
        ("PENA:0AD", "PENA:0ADAD1E\r"),
        ("COMM:50000", "COMM:500000048\r"),
        ("APIREV:", "APIREV:443E\r"),
    ] {
        assert_eq!(encode_text(text), bytes.as_bytes());
        assert_eq!(frames(bytes.as_bytes()), [Frame::Text(text.to_owned())]);
    }
}

#[test]
fn texts_and_packets_follow_one_another() {
    let body = [0_u8, 0, 0];
    let stream = [encode_text("OKAY"), b"\n".to_vec(), encode_binary(&body), encode_text("OKAY")].concat();
    let okay = Frame::Text("OKAY".to_owned());
    assert_eq!(frames(&stream), [okay.clone(), Frame::Binary(body.to_vec()), okay]);
}

#[test]
fn damage_is_said_and_all_after_it_waits_for_a_new_begin() {
    let good = encode_binary(&[1, 2, 3, 4]);
    for at in 2..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        let frames = frames(&[bad, encode_text("OKAY")].concat());
        assert!(matches!(frames.as_slice(), [Frame::Damaged(_)]), "{at}: {frames:?}");
    }
    let mut decoder = FrameDecoder::default();
    assert_eq!(b"OKAYA897\rOKAYA896\r".iter().filter_map(|&byte| decoder.push(byte)).count(), 1);
    decoder.resync();
    assert_eq!(b"OKAYA896\r".iter().find_map(|&byte| decoder.push(byte)), Some(Frame::Text("OKAY".to_owned())));
}

#[test]
fn memory_is_bounded() {
    for byte in [b'x', 0xC4, 0xA5] {
        let mut decoder = FrameDecoder::default();
        let damaged = (0..100_000).filter_map(|_| decoder.push(byte)).count();
        assert_eq!((damaged, decoder.pending()), (1, 0));
    }
    let announced = [0xC4, 0xA5, 0xFF, 0xFF];
    let crc = super::super::crc::crc16_arc(&announced).to_le_bytes();
    assert!(matches!(frames(&[announced.as_slice(), &crc].concat()).as_slice(), [Frame::Damaged(_)]));
    const { assert!(MAX_BINARY > 255 * 42 && MAX_TEXT > 255 * 72) };
    assert_eq!(encode_binary(&vec![0; 100_000]).len(), MAX_BINARY + 8);
}

#[test]
fn a_text_reply_gives_every_tool() {
    let seen = "0A+10000-00000+00000+00000-012345+006789-123456+00250";
    let text = format!("03{seen}000000B100000ABC\n0BMISSING0000007100000ABC\n0CDISABLED0000000000000000\n0000");
    assert_eq!(decode_tx(&text.replace("\n0000", "\n0012")).unwrap().system, 0x12);
    let origin = Point3::new(-0.12345, 0.06789, -1.23456);
    let tools = decode_tx(&text).unwrap().tools;
    match tools.as_slice() {
        [
            Tool {
                handle: 0x0A,
                state: ToolState::Seen { quaternion, origin: found, error },
                frame: 0xABC,
                port: 0xB1,
            },
            Tool { handle: 0x0B, state: ToolState::Missing, frame: 0xABC, port: 0x71 },
            Tool { handle: 0x0C, state: ToolState::Disabled, frame: 0, port: 0 },
        ] => {
            assert_eq!(tools.iter().map(|tool| tool.flags().count()).collect::<Vec<_>>(), [1, 1, 0]);
            assert!((found - origin).norm() < 1e-12 && (error - 25e-6).abs() < 1e-12);
            assert!((quaternion[0] - 1.0).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(decode_tx("010AUNOCCUPIED\n0000").unwrap().tools[0].state, ToolState::Unoccupied);
    let cut = text.strip_suffix('0').unwrap();
    for bad in [cut, &format!("{text}0"), "", "01", "010A", "FF0000", "010AMISSING00000031\n0000"] {
        assert!(decode_tx(bad).is_err(), "{bad}");
    }
    assert!(decode_tx(&text.replace("+10000", "+1.000")).is_err());
}

fn body(status: u8, values: &[f32], has_frame: bool, has_system_status: bool) -> Vec<u8> {
    let mut body = vec![1, 0x0A, status];
    body.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    if has_frame {
        body.extend([0x31, 0, 0, 0, 7, 0, 0, 0]);
    }
    if has_system_status {
        body.extend([0, 0]);
    }
    body
}

#[test]
fn a_binary_reply_is_read_with_and_without_what_instruments_leave_out() {
    let values = [1.0, 0.0, 0.0, 0.0, 1.5, -2.5, 1024.0, 0.25];
    for has_system_status in [false, true] {
        let seen = ToolState::Seen {
            quaternion: [1.0, 0.0, 0.0, 0.0],
            origin: Point3::new(1.5e-3, -2.5e-3, 1.024),
            error: 0.25e-3,
        };
        let tools = decode_bx(&body(1, &values, true, has_system_status)).unwrap().tools;
        assert_eq!(tools, [Tool { handle: 10, state: seen, frame: 7, port: 0x31 }]);
        let tools = decode_bx(&body(2, &[], true, has_system_status)).unwrap().tools;
        assert_eq!(tools, [Tool { handle: 10, state: ToolState::Missing, frame: 7, port: 0x31 }]);
        for (has_frame, frame, port) in [(true, 7, 0x31), (false, 0, 0)] {
            let tools = decode_bx(&body(4, &[], has_frame, has_system_status)).unwrap().tools;
            assert_eq!(tools, [Tool { handle: 10, state: ToolState::Disabled, frame, port }]);
        }
    }
    let whole = body(1, &values, true, true);
    for length in (0..whole.len()).filter(|length| *length != whole.len() - 2) {
        assert!(decode_bx(&whole[..length]).is_err(), "{length}");
    }
    assert!(decode_bx(&body(3, &values, true, true)).is_err_and(|text| text.contains("status 3")));
    assert!(decode_bx(&[whole, vec![0; 3]].concat()).is_err_and(|text| text.contains("length is wrong")));
}

#[test]
fn a_flood_of_replies_keeps_the_queues_short() {
    let mut protocol = NdiProtocol::new(NdiOptions::default()).unwrap();
    protocol.start(Duration::ZERO);
    let texts = ["OKAY", "WARNING", "G.003", "010A001", "ERROR0C"].map(encode_text).concat();
    protocol.feed(&texts.repeat(10_000), Duration::ZERO);
    assert!(std::iter::from_fn(|| protocol.next_event()).count() <= MAX_STATUSES + 1);
    assert!(std::iter::from_fn(|| protocol.next_output()).count() <= MAX_OUTPUTS);
}

#[test]
fn settings_are_read_strictly_and_have_defaults() {
    let of = |pairs: Vec<(&str, f64)>| NdiOptions::deserialize(MapDeserializer::<_, Error>::new(pairs.into_iter()));
    assert_eq!(of(vec![]), Ok(NdiOptions::default()));
    assert_eq!(of(vec![("timeout_s", 3.0)]).map(|options| options.timeout_s.to_bits()), Ok(3.0_f64.to_bits()));
    assert!(of(vec![("timeout", 3.0)]).is_err_and(|error| error.to_string().contains("unknown field")));
    assert!(NdiOptions { timeout_s: 0.0, ..NdiOptions::default() }.validate().is_err());
    assert!(NdiOptions { tip_mm: [f64::NAN; 3], ..NdiOptions::default() }.validate().is_err());
}

#[test]
fn the_tip_turns_with_the_tool() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let point =
        tip_in_instrument([half, 0.0, 0.0, half], Point3::new(1.0, 0.0, 0.0), Vector3::new(0.1, 0.0, 0.0)).unwrap();
    assert!((point - Point3::new(1.0, 0.1, 0.0)).norm() < 1e-12);
    let origin = Point3::new(1.0, 0.0, 0.0);
    assert!(tip_in_instrument([0.5, 0.0, 0.0, 0.0], origin, Vector3::zeros()).is_err());
    assert!(tip_in_instrument([f64::NAN; 4], origin, Vector3::zeros()).is_err());
    assert!(tip_in_instrument([1.0, 0.0, 0.0, 0.0], Point3::new(f64::INFINITY, 0.0, 0.0), Vector3::zeros()).is_err());
}

#[test]
fn every_error_of_the_manual_has_words() {
    for code in [1, 2, 3, 4, 5, 6, 7, 8, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x11, 0x12, 0x13, 0x15] {
        assert_ne!(error_in_words(code), "unknown error", "{code:02X}");
    }
}
