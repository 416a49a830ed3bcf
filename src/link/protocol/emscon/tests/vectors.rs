//! Literal bytes: both ends could agree on a wrong layout, so neither is tested against the other here.

use super::super::shot::shot_of;
use super::super::*;
use crate::link::protocol::Failure;
use crate::link::simulator::bench::hex;

/// A result with 1234.5, -678.25, 90.125 and zeros behind.
fn result(kind: &str, size: usize) -> Vec<u8> {
    let values = "00000000004A9340 00000000003285C0 0000000000885640";
    let size_field = u32::try_from(size).unwrap().to_le_bytes();
    let mut bytes = [&size_field[..], &hex(kind), &hex("00000000 00000000 00000000"), &hex(values)].concat();
    bytes.resize(size, 0);
    bytes
}

#[test]
fn commands_have_the_bytes_of_the_published_examples() {
    let cases = [
        (Command::bare(CommandId::Initialize), "0C000000 00000000 07000000"),
        (
            Command::set_units(Units { angle: 1, ..Units::WANTED }),
            "20000000 00000000 05000000 01000000 01000000 00000000 00000000 00000000",
        ),
        (Command::set_units(Units::WANTED), "20000000 00000000 05000000 01000000 00000000 00000000 00000000 00000000"),
        (Command::set_coordinate_type(CoordinateType::RightHanded), "10000000 00000000 1A000000 00000000"),
        (Command::set_measurement_mode(MeasurementMode::Stationary), "10000000 00000000 18000000 00000000"),
        (Command::set_stationary_params(500, true), "14000000 00000000 1C000000 F4010000 01000000"),
        (Command::bare(CommandId::StartMeasurement), "0C000000 00000000 31000000"),
    ];
    for (command, bytes) in cases {
        assert_eq!(command.encode(), hex(bytes), "{command:?}");
    }
}

#[test]
fn system_settings_keep_their_order_and_size() {
    let settings = SystemSettings::from_numbers([1, 2, 3, 4, 5, 6, 7, 8, 9]);
    let bytes = Command::set_system_settings(settings).encode();
    assert_eq!(bytes.len(), 48);
    let fields = "01000000 02000000 03000000 04000000 05000000 06000000 07000000 08000000 09000000";
    assert_eq!(bytes, hex(&format!("30000000 00000000 2F000000 {fields}")));
    assert_eq!(settings.numbers(), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
    assert_eq!(settings.try_measurement_mode, 7);
}

#[test]
fn answers_read_as_published() {
    let reply = Packet::decode(&hex("10000000 00000000 31000000 00000000")).unwrap();
    let Packet::Reply(reply) = reply else { panic!("{reply:?}") };
    assert_eq!((reply.command(), reply.status()), (CommandId::StartMeasurement, ResultStatus::AllOk));
    assert_eq!(
        Packet::decode(&hex("10000000 01000000 31000000 14270000")),
        Ok(Packet::Error { command: CommandId::StartMeasurement, status: ResultStatus::MeasurementStatusNotReady })
    );
    assert_eq!(Packet::decode(&hex("0C000000 08000000 1B000000")), Ok(Packet::Event(SystemEvent::MeasStatusReady)));
    assert_eq!(Packet::decode(&hex("0C000000 2A000000 00000000")), Ok(Packet::Skipped(PacketType::Other(42))));
}

#[test]
fn both_results_give_the_published_point_in_metres() {
    for (kind, size) in [("02000000", 156), ("02000000", 172), ("09000000", 204), ("09000000", 220)] {
        let bytes = result(kind, size);
        let Ok(Packet::Single(result)) = Packet::decode(&bytes) else { panic!("{kind} {size}") };
        let shot = shot_of(result, &EmsconOptions::default(), Some(1)).unwrap();
        assert!((shot.point - Point3::new(1.2345, -0.678_25, 0.090_125)).norm() < 1e-15);
        assert_eq!(shot.sigma, None, "0 is stated where nothing is known");
        assert_eq!((shot.face, shot.raw), (Some(1), bytes));
    }
}

#[test]
fn fields_behind_the_point_stand_at_their_offsets() {
    for (kind, size, weather) in [("02000000", 156, 132), ("09000000", 204, 180)] {
        let mut bytes = result(kind, size);
        for (offset, value) in [(44, 0.004), (52, 0.005), (60, 0.006), (weather, 21.5), (weather + 8, 990.0)] {
            bytes[offset..offset + 8].copy_from_slice(&f64::to_le_bytes(value));
        }
        let Ok(Packet::Single(result)) = Packet::decode(&bytes) else { panic!("{kind}") };
        let found = [result.sigma, result.weather].concat();
        let expected = [0.004, 0.005, 0.006, 21.5, 990.0, 0.0];
        assert!(found.iter().zip(expected).all(|(a, b)| a.to_bits() == f64::to_bits(b)), "{found:?}");
    }
}

#[test]
fn a_packet_that_ends_before_its_last_field_is_an_error() {
    for (kind, size) in [("02000000", 155), ("09000000", 203), ("07000000", 35), ("00000000", 15), ("01000000", 12)] {
        let bytes = result(kind, 204).into_iter().take(size).collect::<Vec<_>>();
        assert!(
            matches!(Packet::decode(&bytes), Err(PacketError::Short { size: found, .. }) if found == size),
            "{kind}"
        );
    }
}

#[test]
fn sizes_that_no_packet_has_are_lost_synchronisation() {
    for size in [0, -1, 11, 65_537, i32::MIN, i32::MAX] {
        let mut framer = Framer::default();
        framer.feed(&size.to_le_bytes());
        assert_eq!(framer.next_packet(), Err(PacketError::Size(size)));
    }
    for size in [12, 65_536] {
        let mut framer = Framer::default();
        framer.feed(&i32::to_le_bytes(size));
        assert_eq!(framer.next_packet(), Ok(None), "{size}");
    }
}

#[test]
fn names_are_utf16_up_to_the_first_zero_without_control_characters() {
    let mut bytes = hex("64000000 00000000 2A000000 00000000 01000000 07000000 05000000");
    bytes.extend(19.05_f64.to_le_bytes());
    bytes.extend("R\u{e9}f\u{1b}x\0y".encode_utf16().flat_map(u16::to_le_bytes));
    bytes.resize(100, 0);
    let Ok(Packet::Reply(reply)) = Packet::decode(&bytes) else { panic!() };
    let fields = reply.fields(100).unwrap();
    assert_eq!((fields.i32(20), fields.f64(28), fields.name(36)), (7, 19.05, "R\u{e9}f\u{fffd}x".to_owned()));
    assert!(reply.fields(101).is_err());
}

#[test]
fn numbers_that_are_not_listed_stay_numbers() {
    assert_eq!(ResultStatus::from_number(777), ResultStatus::Other(777));
    assert_eq!(ResultStatus::Other(777).number(), 777);
    assert_eq!(ResultStatus::Other(777).described(), "unlisted number (777)");
    assert_eq!(ResultStatus::from_number(5).described(), "wrong parameter (5)");
    assert_eq!(ResultStatus::from_number(12).described(), "parameter out of range (12)");
    assert!(matches!(ResultStatus::Other(777).measurement_failure(), Failure::NoTarget(_)));
    assert!(matches!(ResultStatus::Other(5).measurement_failure(), Failure::Refused(_)));
    for number in -2..1000 {
        assert_eq!(SystemEvent::from_number(number).number(), number);
        assert_eq!(CommandId::from_number(number).number(), number);
    }
}
