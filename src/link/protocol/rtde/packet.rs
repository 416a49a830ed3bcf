//! Packets of the real-time data exchange: big-endian, a size (u16, the three bytes of the header included), a type (u8) and
//! what belongs to it.

use thiserror::Error;

use super::super::unread::Unread;
use crate::text::printable;

/// The smallest packet: nothing but its header (bytes).
pub const MIN_PACKET: usize = 3;

/// Version of the protocol that is asked for.
pub const PROTOCOL_VERSION: u16 = 2;

/// Types of packets: the letters of the manual.
pub mod packet_type {
    /// `V`: asks for a version of the protocol.
    pub const REQUEST_PROTOCOL_VERSION: u8 = b'V';
    /// `v`: asks for the version of the controller.
    pub const GET_URCONTROL_VERSION: u8 = b'v';
    /// `M`: a message in words.
    pub const TEXT_MESSAGE: u8 = b'M';
    /// `U`: data of a recipe.
    pub const DATA_PACKAGE: u8 = b'U';
    /// `O`: sets up what the controller sends.
    pub const CONTROL_PACKAGE_SETUP_OUTPUTS: u8 = b'O';
    /// `I`: sets up what the controller takes.
    pub const CONTROL_PACKAGE_SETUP_INPUTS: u8 = b'I';
    /// `S`: starts the stream.
    pub const CONTROL_PACKAGE_START: u8 = b'S';
    /// `P`: pauses the stream.
    pub const CONTROL_PACKAGE_PAUSE: u8 = b'P';

    /// All of them.
    pub const ALL: [u8; 8] = [
        REQUEST_PROTOCOL_VERSION,
        GET_URCONTROL_VERSION,
        TEXT_MESSAGE,
        DATA_PACKAGE,
        CONTROL_PACKAGE_SETUP_OUTPUTS,
        CONTROL_PACKAGE_SETUP_INPUTS,
        CONTROL_PACKAGE_START,
        CONTROL_PACKAGE_PAUSE,
    ];
}

/// Why bytes are no packet.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PacketError {
    /// The header says what no header says.
    #[error("a packet of {0} bytes was announced; three are the least, so the stream is out of step")]
    Size(u16),
    /// The header names a type that a controller never sends.
    #[error("a packet of type {0:#04x} was announced, which no controller sends")]
    Type(u8),
    /// A packet does not have the size that its kind has.
    #[error("packet '{kind}' has {size} bytes behind its header, {least} are needed")]
    Short {
        /// Letter of its type.
        kind: char,
        /// Bytes behind the header.
        size: usize,
        /// Bytes that are needed.
        least: usize,
    },
}

/// Cuts a stream into packets. Never waits for more than the rest of one packet, so for no more than 64 KiB.
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

    /// Type and content of the next whole packet.
    ///
    /// # Errors
    /// [`PacketError::Size`]: nothing behind it can be trusted.
    pub fn next_packet(&mut self) -> Result<Option<(u8, Vec<u8>)>, PacketError> {
        let rest = self.unread.bytes();
        let Some(size) = rest.first_chunk::<2>().map(|field| u16::from_be_bytes(*field)) else { return Ok(None) };
        let length = usize::from(size);
        if length < MIN_PACKET {
            return Err(PacketError::Size(size));
        }
        let Some([kind, content @ ..]) = rest.get(2..length) else { return Ok(None) };
        let packet = (*kind, content.to_vec());
        self.unread.skip(length);
        Ok(Some(packet))
    }

    /// Whether what has arrived can be the beginning of a packet of a controller; one byte too few to say counts as yes.
    ///
    /// # Errors
    /// [`PacketError::Size`], [`PacketError::Type`].
    pub fn check_header(&self) -> Result<(), PacketError> {
        match *self.unread.bytes() {
            [high, low, ..] if usize::from(u16::from_be_bytes([high, low])) < MIN_PACKET => {
                Err(PacketError::Size(u16::from_be_bytes([high, low])))
            }
            [_, _, kind, ..] if !packet_type::ALL.contains(&kind) => Err(PacketError::Type(kind)),
            _ => Ok(()),
        }
    }

    /// Bytes that wait for the rest of their packet.
    pub fn pending(&self) -> usize {
        self.unread.bytes().len()
    }
}

/// A packet with its header. Content that does not fit is cut off; nothing that is sent comes near the limit.
pub fn encode(kind: u8, content: &[u8]) -> Vec<u8> {
    let size = u16::try_from(MIN_PACKET + content.len()).unwrap_or(u16::MAX);
    let content = content.iter().copied().take(usize::from(size) - MIN_PACKET);
    size.to_be_bytes().into_iter().chain([kind]).chain(content).collect()
}

/// Asks for the version of the protocol.
pub fn request_version() -> Vec<u8> {
    encode(packet_type::REQUEST_PROTOCOL_VERSION, &PROTOCOL_VERSION.to_be_bytes())
}

/// Asks for some values at a frequency (Hz).
pub fn set_up_outputs(frequency: f64, names: &[&str]) -> Vec<u8> {
    let content = [&frequency.to_be_bytes()[..], names.join(",").as_bytes()].concat();
    encode(packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS, &content)
}

/// What the controller sends.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Whether the version of the protocol is accepted.
    ProtocolVersion(bool),
    /// Version of the controller: major, minor, bug fix, build.
    ControllerVersion([u32; 4]),
    /// A message in words.
    Text(TextMessage),
    /// Answer to the set-up of the outputs.
    Outputs {
        /// Number of the recipe.
        recipe: u8,
        /// Types of the values, or why there is none.
        types: Vec<String>,
    },
    /// Whether the stream was started.
    Started(bool),
    /// Data of a recipe.
    Data {
        /// Number of the recipe.
        recipe: u8,
        /// The values.
        values: Vec<u8>,
    },
    /// Another kind.
    Other(u8),
}

impl Packet {
    /// Reads type and content.
    ///
    /// # Errors
    /// [`PacketError::Short`].
    pub fn decode(kind: u8, content: &[u8]) -> Result<Self, PacketError> {
        let short = |least| PacketError::Short { kind: char::from(kind), size: content.len(), least };
        let first = || content.split_first().ok_or_else(|| short(1));
        Ok(match kind {
            packet_type::REQUEST_PROTOCOL_VERSION => Self::ProtocolVersion(*first()?.0 == 1),
            packet_type::CONTROL_PACKAGE_START => Self::Started(*first()?.0 == 1),
            packet_type::GET_URCONTROL_VERSION => {
                let numbers = content.as_chunks::<4>().0.first_chunk::<4>().ok_or_else(|| short(16))?;
                Self::ControllerVersion(numbers.map(u32::from_be_bytes))
            }
            packet_type::TEXT_MESSAGE => Self::Text(TextMessage::decode(content).ok_or_else(|| short(3))?),
            packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS => {
                let (recipe, types) = first()?;
                let types = String::from_utf8_lossy(types);
                Self::Outputs { recipe: *recipe, types: types.split(',').map(|name| name.trim().to_owned()).collect() }
            }
            packet_type::DATA_PACKAGE => {
                let (recipe, values) = first()?;
                Self::Data { recipe: *recipe, values: values.to_vec() }
            }
            other => Self::Other(other),
        })
    }
}

/// A message of the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextMessage {
    /// What.
    pub text: String,
    /// Who says it.
    pub source: String,
    /// 0 exception, 1 error, 2 warning, 3 information.
    pub level: u8,
}

impl TextMessage {
    /// A length and a text, a length and a source, a level.
    fn decode(content: &[u8]) -> Option<Self> {
        let (text, rest) = counted(content)?;
        let (source, rest) = counted(rest)?;
        Some(Self { text, source, level: *rest.first()? })
    }
}

/// A text behind its length, and what follows.
fn counted(bytes: &[u8]) -> Option<(String, &[u8])> {
    let (length, rest) = bytes.split_first()?;
    let (text, rest) = rest.split_at_checked(usize::from(*length))?;
    Some((printable(String::from_utf8_lossy(text).trim()), rest))
}

/// The values that are asked for, in their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Time by the controller (s).
    pub timestamp: f64,
    /// Joint values (rad).
    pub actual_q: [f64; 6],
    /// Joint speeds (rad/s).
    pub actual_qd: [f64; 6],
    /// What the robot is doing; see [`super::mode`].
    pub robot_mode: i32,
    /// What the safety system says; see [`super::mode`].
    pub safety_status: i32,
}

impl Record {
    /// Names of the values with their types.
    pub const FIELDS: [(&'static str, &'static str); 5] = [
        ("timestamp", "DOUBLE"),
        ("actual_q", "VECTOR6D"),
        ("actual_qd", "VECTOR6D"),
        ("robot_mode", "INT32"),
        ("safety_status", "INT32"),
    ];

    /// Bytes of all values.
    pub const SIZE: usize = 13 * 8 + 2 * 4;

    /// Reads the values; `None`: the size is another one.
    pub fn decode(values: &[u8]) -> Option<Self> {
        if values.len() != Self::SIZE {
            return None;
        }
        let (numbers, integers) = values.split_at_checked(13 * 8)?;
        let number =
            |index: usize| numbers.as_chunks::<8>().0.get(index).map_or(f64::NAN, |field| f64::from_be_bytes(*field));
        let integer = |index: usize| integers.as_chunks::<4>().0.get(index).map(|field| i32::from_be_bytes(*field));
        Some(Self {
            timestamp: number(0),
            actual_q: std::array::from_fn(|joint| number(1 + joint)),
            actual_qd: std::array::from_fn(|joint| number(7 + joint)),
            robot_mode: integer(0)?,
            safety_status: integer(1)?,
        })
    }

    /// True where every number is finite.
    pub fn is_finite(&self) -> bool {
        self.timestamp.is_finite() && self.actual_q.iter().chain(&self.actual_qd).all(|value| value.is_finite())
    }
}
