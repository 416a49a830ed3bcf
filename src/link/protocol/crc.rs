//! Check sums of messages.

/// CRC-16/ARC: polynomial 0x8005 reflected, initial value 0; used by GeoCOM, NDI and many gauges.
pub fn crc16_arc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc, &byte| (0..8).fold(crc ^ u16::from(byte), |crc, _| (crc >> 1) ^ (0xA001 * (crc & 1))))
}

/// XOR of all bytes, which NMEA 0183 writes as two hexadecimal digits after `*`.
pub fn nmea_xor(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

#[cfg(test)]
mod tests;
