//! Published values.

use super::crc16_arc;
use super::nmea_xor;

#[test]
fn crc16_arc_gives_the_published_values() {
    let known: [(&str, u16); 17] = [
        ("123456789", 0xBB3D),
        ("%R1P,0,11:0", 22896),
        ("%R1Q,0,11:", 28925),
        ("RESET", 0xBE6F),
        ("OKAY", 0xA896),
        ("INIT:", 0xE3A5),
        ("TSTART:", 0x5423),
        ("TSTOP:", 0x2C14),
        ("TX:0001", 0x031A),
        ("BX:0001", 0xC26D),
        ("ERROR01", 0x6BC2),
        ("PHSR:00", 0x20FF),
        ("PINIT:0A", 0xD5EB),
        ("PENA:0AD", 0xAD1E),
        ("COMM:50000", 0x0048),
        ("APIREV:", 0x443E),
        ("", 0),
    ];
    for (text, crc) in known {
        assert_eq!(crc16_arc(text.as_bytes()), crc, "{text}");
    }
}

#[test]
fn nmea_xor_gives_the_published_values() {
    assert_eq!(nmea_xor(b"GPGLL,5300.97914,N,00259.98174,E,125926,A"), 0x28);
    assert_eq!(nmea_xor(b""), 0);
}
