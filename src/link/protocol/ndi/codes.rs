//! Meanings of error numbers.

use super::super::Failure;

/// Error number for a damaged command.
pub(super) const BAD_CRC: u8 = 0x04;

/// Meaning of an error number.
pub const fn error_in_words(code: u8) -> &'static str {
    match code {
        0x01 => "invalid command",
        0x02 => "the command is too long",
        0x03 => "the command is too short",
        0x04 => "the command arrived damaged",
        0x05 => "the command took too long",
        0x06 => "the new settings of the serial port failed",
        0x07 => "wrong number of parameters",
        0x08 => "the port handle is not valid",
        0x0C => "not possible in this mode",
        0x0D => "no tool at the port",
        0x0E => "the port is not initialised",
        0x0F => "the port is not enabled",
        0x10 => "the instrument is not initialised",
        0x11 => "tracking cannot be stopped",
        0x12 => "tracking cannot be started",
        0x13 => "the port cannot be initialised",
        0x15 => "the instrument cannot be initialised",
        _ => "unknown error",
    }
}

/// The failure for an error number.
pub fn failure_of_error(code: u8) -> Failure {
    let text = format!("ERROR{code:02X}: {}", error_in_words(code));
    match code {
        0x04 => Failure::Garbled(text),
        0x05 => Failure::NotReady(text),
        0x08 | 0x0C | 0x0E | 0x0F | 0x10 => Failure::Settings(text),
        0x0D => Failure::NoTarget(text),
        _ => Failure::Refused(text),
    }
}
