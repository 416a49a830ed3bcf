//! Packets: where one ends and the next begins, and what stands in it.
//!
//! Little-endian, packed to 4 bytes: a header of total size and type (i32 each), then i32, f64 and UTF-16 fields at fixed
//! offsets. `long` is 32 bits wide whatever the compiler of the day thinks. A packet may be longer than known (newer firmware),
//! never shorter.

use thiserror::Error;

use super::super::unread::Unread;
use super::status::{CommandId, MeasurementMode, PacketType, ResultStatus, SystemEvent};
use crate::text::printable;

/// The smallest packet that exists (bytes).
pub const MIN_PACKET: usize = 12;

/// A size above this is no size but lost synchronisation (bytes).
pub const MAX_PACKET: usize = 65_536;

/// Numbers of types are small; a dozen is known.
const MAX_TYPE: i32 = 1000;

/// Why bytes are no packet.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PacketError {
    /// The header says what no header says.
    #[error("a packet of {0} bytes was announced; sizes from 12 to 65536 exist, so the stream is out of step")]
    Size(i32),
    /// A packet ends before its last field.
    #[error("packet '{what}' has {size} bytes, at least {least} are needed")]
    Short {
        /// Which packet.
        what: &'static str,
        /// Its size (bytes).
        size: usize,
        /// The size with all known fields (bytes).
        least: usize,
    },
}

/// Cuts a stream into packets. Never waits for more than the rest of one packet.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    unread: Unread,
}

impl Framer {
    /// Forgets what is there.
    pub fn clear(&mut self) {
        self.unread.clear();
    }

    /// Adds bytes.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.unread.feed(bytes);
    }

    /// The next whole packet.
    ///
    /// # Errors
    /// [`PacketError::Size`]: nothing behind it can be trusted.
    pub fn next_packet(&mut self) -> Result<Option<Vec<u8>>, PacketError> {
        let rest = self.unread.bytes();
        let Some(size) = i32_at(rest, 0) else { return Ok(None) };
        let length = usize::try_from(size).unwrap_or(0);
        if !(MIN_PACKET..=MAX_PACKET).contains(&length) {
            return Err(PacketError::Size(size));
        }
        let packet = rest.get(..length).map(<[u8]>::to_vec);
        if packet.is_some() {
            self.unread.skip(length);
        }
        Ok(packet)
    }

    /// Whether the next packet has a size or a type that no tracker sends, of whatever firmware.
    pub fn announces_unknown(&self) -> bool {
        let rest = self.unread.bytes();
        let size = i32_at(rest, 0).map(|size| usize::try_from(size).unwrap_or(0));
        size.is_some_and(|size| !(MIN_PACKET..=MAX_PACKET).contains(&size))
            || i32_at(rest, 4).is_some_and(|kind| !(0..MAX_TYPE).contains(&kind))
    }

    /// The first bytes that wait, at most so many.
    pub fn start(&self, most: usize) -> &[u8] {
        let rest = self.unread.bytes();
        rest.get(..most).unwrap_or(rest)
    }

    /// Bytes that wait for the rest of their packet.
    pub fn pending(&self) -> usize {
        self.unread.bytes().len()
    }
}

/// What the tracker sends.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Answer to a command.
    Reply(Reply),
    /// Error of a command, or of none.
    Error {
        /// Which command.
        command: CommandId,
        /// What.
        status: ResultStatus,
    },
    /// One measured point.
    Single(SingleResult),
    /// Where the reflector is now, in the units that are set.
    ReflectorPosition {
        /// Values in the coordinate type that is set.
        values: [f64; 3],
        /// The packet.
        raw: Vec<u8>,
    },
    /// Something changed.
    Event(SystemEvent),
    /// A kind that this program has no use for, or does not know.
    Skipped(PacketType),
}

impl Packet {
    /// Reads one packet.
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

/// Answer to a command; what stands behind the status depends on the command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    bytes: Vec<u8>,
}

impl Reply {
    /// Which command is answered.
    pub fn command(&self) -> CommandId {
        command_of(&self.bytes)
    }

    /// How it went.
    pub fn status(&self) -> ResultStatus {
        status_of(&self.bytes)
    }

    /// Fields of an answer that has at least `least` bytes.
    ///
    /// # Errors
    /// [`PacketError::Short`].
    pub fn fields(&self, least: usize) -> Result<Fields<'_>, PacketError> {
        at_least(&self.bytes, self.command().words(), least)?;
        Ok(Fields { bytes: &self.bytes })
    }
}

/// Fields of a packet that was found long enough for them.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a> {
    bytes: &'a [u8],
}

impl Fields<'_> {
    /// An integer.
    pub fn i32(&self, offset: usize) -> i32 {
        i32_at(self.bytes, offset).unwrap_or_default()
    }

    /// Integers in a row.
    pub fn integers<const N: usize>(&self, offset: usize) -> [i32; N] {
        std::array::from_fn(|index| self.i32(offset + 4 * index))
    }

    /// A number; not a number where the packet has none.
    pub fn f64(&self, offset: usize) -> f64 {
        f64_at(self.bytes, offset)
    }

    /// Numbers in a row.
    pub fn numbers<const N: usize>(&self, offset: usize) -> [f64; N] {
        std::array::from_fn(|index| self.f64(offset + 8 * index))
    }

    /// A name of 32 UTF-16 units that ends at the first zero.
    pub fn name(&self, offset: usize) -> String {
        let field = self.bytes.get(offset..offset + 64).unwrap_or_default();
        let units = field.chunks_exact(2).map(|unit| unit.try_into().map_or(0, u16::from_le_bytes));
        let text: Vec<u16> = units.take_while(|unit| *unit != 0).collect();
        printable(String::from_utf16_lossy(&text).trim())
    }
}

/// One measured point, in the units that are set.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleResult {
    /// How the measurement went.
    pub status: ResultStatus,
    /// Mode in which it was taken.
    pub mode: MeasurementMode,
    /// Taken in try mode: a rehearsal, no measurement.
    pub is_try: bool,
    /// Coordinates.
    pub values: [f64; 3],
    /// Their standard deviations.
    pub sigma: [f64; 3],
    /// Temperature, pressure, humidity.
    pub weather: [f64; 3],
    /// The packet.
    pub raw: Vec<u8>,
}

impl SingleResult {
    /// The two kinds differ in where the weather stands.
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

/// The number at an offset; not a number where the bytes end before it.
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
