//! Packets: framing and contents.
//!
//! Little-endian, packed to 4 bytes: a header of total size and type (i32 each), then i32, f64 and UTF-16 fields at fixed
//! offsets. `long` in the public descriptions is 32 bits wide. A packet may be longer than known (newer firmware), but not
//! shorter.

use thiserror::Error;

use super::super::receive_buffer::ReceiveBuffer;
use super::status::{CommandId, MeasurementMode, PacketType, ResultStatus, SystemEvent};
use crate::text::printable;

/// Size of the smallest packet (bytes).
pub const MIN_PACKET: usize = 12;

/// Size of the largest packet (bytes); a larger one means that the stream is out of sync.
pub const MAX_PACKET: usize = 65_536;

/// Limit for type numbers; the known ones are below 20.
const MAX_TYPE: i32 = 1000;

/// Why bytes cannot be read as a packet.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PacketError {
    /// The header states an impossible size.
    #[error(
        "a packet of {0} bytes was announced; sizes are {MIN_PACKET} to {MAX_PACKET}, so the stream is out of sync"
    )]
    Size(i32),
    /// A packet ends before its last field.
    #[error("packet '{what}' has {size} bytes, at least {least} are needed")]
    Short {
        /// Name of the packet.
        what: &'static str,
        /// Size of the packet (bytes).
        size: usize,
        /// Size of all known fields (bytes).
        least: usize,
    },
}

/// Splits a stream into packets. Buffers at most one packet.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    received: ReceiveBuffer,
}

impl Framer {
    /// Discards all received bytes.
    pub fn clear(&mut self) {
        self.received.clear();
    }

    /// Appends received bytes.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.received.feed(bytes);
    }

    /// The next complete packet.
    ///
    /// # Errors
    /// [`PacketError::Size`]: the stream is out of sync.
    pub fn next_packet(&mut self) -> Result<Option<Vec<u8>>, PacketError> {
        let rest = self.received.unread();
        let Some(size) = i32_at(rest, 0) else { return Ok(None) };
        let length = usize::try_from(size).unwrap_or(0);
        if !(MIN_PACKET..=MAX_PACKET).contains(&length) {
            return Err(PacketError::Size(size));
        }
        let packet = rest.get(..length).map(<[u8]>::to_vec);
        if packet.is_some() {
            self.received.consume(length);
        }
        Ok(packet)
    }

    /// Whether the next packet has a size or a type that no tracker sends, whatever its firmware.
    pub fn announces_unknown(&self) -> bool {
        let rest = self.received.unread();
        let size = i32_at(rest, 0).map(|size| usize::try_from(size).unwrap_or(0));
        size.is_some_and(|size| !(MIN_PACKET..=MAX_PACKET).contains(&size))
            || i32_at(rest, 4).is_some_and(|kind| !(0..MAX_TYPE).contains(&kind))
    }

    /// The first unread bytes, at most this many.
    pub fn start(&self, most: usize) -> &[u8] {
        let rest = self.received.unread();
        rest.get(..most).unwrap_or(rest)
    }

    /// Bytes of an incomplete packet.
    pub fn pending(&self) -> usize {
        self.received.unread().len()
    }
}

/// A packet from the tracker.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Answer to a command.
    Reply(Reply),
    /// Error of a command, or an unrelated one.
    Error {
        /// The command that failed.
        command: CommandId,
        /// The error.
        status: ResultStatus,
    },
    /// One measured point.
    Single(SingleResult),
    /// Current position of the reflector in the tracker's units.
    ReflectorPosition {
        /// Coordinates in the tracker's coordinate type.
        values: [f64; 3],
        /// Bytes of the packet.
        raw: Vec<u8>,
    },
    /// A status change.
    Event(SystemEvent),
    /// A type that this program does not use or does not know.
    Skipped(PacketType),
}

impl Packet {
    /// Decodes one packet.
    ///
    /// # Errors
    /// [`PacketError::Short`].
    pub fn decode(bytes: &[u8]) -> Result<Self, PacketError> {
        let kind = PacketType::from_number(i32_at(bytes, 4).unwrap_or(-1));
        let known = |least: usize| at_least(bytes, kind.words(), least);
        Ok(match kind {
            PacketType::Command => {
                known(16)?;
                Self::Reply(Reply { bytes: bytes.to_vec() })
            }
            PacketType::Error => {
                known(16)?;
                Self::Error { command: command_of(bytes), status: status_of(bytes) }
            }
            PacketType::SingleMeasResult => {
                known(156)?;
                Self::Single(SingleResult::read(bytes, 132))
            }
            PacketType::SingleMeasResult2 => {
                known(204)?;
                Self::Single(SingleResult::read(bytes, 180))
            }
            PacketType::ReflectorPosResult => {
                known(36)?;
                Self::ReflectorPosition { values: three_at(bytes, 12), raw: bytes.to_vec() }
            }
            PacketType::SystemStatusChange => Self::Event(SystemEvent::from_number(i32_at(bytes, 8).unwrap_or(-1))),
            other => Self::Skipped(other),
        })
    }
}

/// Answer to a command; the fields after the status depend on the command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    bytes: Vec<u8>,
}

impl Reply {
    /// The answered command.
    pub fn command(&self) -> CommandId {
        command_of(&self.bytes)
    }

    /// Result of the command.
    pub fn status(&self) -> ResultStatus {
        status_of(&self.bytes)
    }

    /// Fields of the answer, which must have at least `least` bytes.
    ///
    /// # Errors
    /// [`PacketError::Short`].
    pub fn fields(&self, least: usize) -> Result<Fields<'_>, PacketError> {
        at_least(&self.bytes, self.command().words(), least)?;
        Ok(Fields { bytes: &self.bytes })
    }
}

/// Fields of a packet whose length was checked.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a> {
    bytes: &'a [u8],
}

impl Fields<'_> {
    /// The integer at an offset.
    pub fn i32(&self, offset: usize) -> i32 {
        i32_at(self.bytes, offset).unwrap_or_default()
    }

    /// Consecutive integers from an offset.
    pub fn integers<const N: usize>(&self, offset: usize) -> [i32; N] {
        std::array::from_fn(|index| self.i32(offset + 4 * index))
    }

    /// The number at an offset; NaN beyond the end of the packet.
    pub fn f64(&self, offset: usize) -> f64 {
        f64_at(self.bytes, offset)
    }

    /// Consecutive numbers from an offset.
    pub fn numbers<const N: usize>(&self, offset: usize) -> [f64; N] {
        std::array::from_fn(|index| self.f64(offset + 8 * index))
    }

    /// The name at an offset: 32 UTF-16 units, ended by the first zero.
    pub fn name(&self, offset: usize) -> String {
        let field = self.bytes.get(offset..offset + 64).unwrap_or_default();
        let units = field.chunks_exact(2).map(|unit| unit.try_into().map_or(0, u16::from_le_bytes));
        let text: Vec<u16> = units.take_while(|unit| *unit != 0).collect();
        printable(String::from_utf16_lossy(&text).trim())
    }
}

/// One measured point, in the tracker's units.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleResult {
    /// Result of the measurement.
    pub status: ResultStatus,
    /// Measurement mode of the result.
    pub mode: MeasurementMode,
    /// Whether it was taken in try mode and is not a real measurement.
    pub is_try: bool,
    /// Coordinates of the point.
    pub values: [f64; 3],
    /// Standard deviations of the coordinates.
    pub sigma: [f64; 3],
    /// Temperature, pressure and humidity.
    pub weather: [f64; 3],
    /// Bytes of the packet.
    pub raw: Vec<u8>,
}

impl SingleResult {
    /// Reads a result. The two kinds of packet differ in the offset of the weather values.
    fn read(bytes: &[u8], weather: usize) -> Self {
        let int = |offset| i32_at(bytes, offset).unwrap_or(-1);
        Self {
            status: ResultStatus::from_number(int(8)),
            mode: MeasurementMode::from_number(int(12)),
            is_try: int(16) != 0,
            values: three_at(bytes, 20),
            sigma: three_at(bytes, 44),
            weather: three_at(bytes, weather),
            raw: bytes.to_vec(),
        }
    }
}

/// The integer at an offset.
pub fn i32_at(bytes: &[u8], offset: usize) -> Option<i32> {
    let field = bytes.get(offset..)?.first_chunk::<4>()?;
    Some(i32::from_le_bytes(*field))
}

/// The number at an offset; NaN beyond the end of the bytes.
pub fn f64_at(bytes: &[u8], offset: usize) -> f64 {
    bytes.get(offset..).and_then(<[u8]>::first_chunk::<8>).map_or(f64::NAN, |field| f64::from_le_bytes(*field))
}

fn three_at(bytes: &[u8], offset: usize) -> [f64; 3] {
    std::array::from_fn(|index| f64_at(bytes, offset + 8 * index))
}

fn command_of(bytes: &[u8]) -> CommandId {
    CommandId::from_number(i32_at(bytes, 8).unwrap_or(-1))
}

fn status_of(bytes: &[u8]) -> ResultStatus {
    ResultStatus::from_number(i32_at(bytes, 12).unwrap_or(-1))
}

fn at_least(bytes: &[u8], what: &'static str, least: usize) -> Result<(), PacketError> {
    let size = bytes.len();
    if size < least { Err(PacketError::Short { what, size, least }) } else { Ok(()) }
}
