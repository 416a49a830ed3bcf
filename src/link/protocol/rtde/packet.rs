//! Packets of the real-time data exchange: big-endian; a size (u16, including the three bytes of the header), a type (u8) and
//! the content.

use thiserror::Error;

use super::super::receive_buffer::ReceiveBuffer;
use crate::text::printable;

/// Size of the smallest packet, which is only a header (bytes).
pub const MIN_PACKET: usize = 3;

/// Requested version of the protocol.
pub const PROTOCOL_VERSION: u16 = 2;

/// Types of packets, by the letters of the manual.
pub mod packet_type {
    /// `V`: requests a version of the protocol.
    pub const REQUEST_PROTOCOL_VERSION: u8 = b'V';
    /// `v`: requests the version of the controller.
    pub const GET_URCONTROL_VERSION: u8 = b'v';
    /// `M`: a text message.
    pub const TEXT_MESSAGE: u8 = b'M';
    /// `U`: data of a recipe.
    pub const DATA_PACKAGE: u8 = b'U';
    /// `O`: sets up the values that the controller sends.
    pub const CONTROL_PACKAGE_SETUP_OUTPUTS: u8 = b'O';
    /// `I`: sets up the values that the controller accepts.
    pub const CONTROL_PACKAGE_SETUP_INPUTS: u8 = b'I';
    /// `S`: starts the stream.
    pub const CONTROL_PACKAGE_START: u8 = b'S';
    /// `P`: pauses the stream.
    pub const CONTROL_PACKAGE_PAUSE: u8 = b'P';

    /// All types.
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

/// Why bytes cannot be read as a packet.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PacketError {
    /// The header states an impossible size.
    #[error("a packet of {0} bytes was announced; the smallest has three, so the stream is out of sync")]
    Size(u16),
    /// The header states a type that no controller sends.
    #[error("a packet of type {0:#04x} was announced, which no controller sends")]
    Type(u8),
    /// The packet is too short for its type.
    #[error("packet '{kind}' has {size} bytes after its header, {least} are needed")]
    Short {
        /// Letter of its type.
        kind: char,
        /// Bytes after the header.
        size: usize,
        /// Required bytes after the header.
        least: usize,
    },
}

/// Splits a stream into packets. Buffers at most one packet, that is 64 KiB.
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

    /// Type and content of the next complete packet.
    ///
    /// # Errors
    /// [`PacketError::Size`]: the stream is out of sync.
    pub fn next_packet(&mut self) -> Result<Option<(u8, Vec<u8>)>, PacketError> {
        let rest = self.received.unread();
        let Some(size) = rest.first_chunk::<2>().map(|field| u16::from_be_bytes(*field)) else { return Ok(None) };
        let length = usize::from(size);
        if length < MIN_PACKET {
            return Err(PacketError::Size(size));
        }
        let Some([kind, content @ ..]) = rest.get(2..length) else { return Ok(None) };
        let packet = (*kind, content.to_vec());
        self.received.consume(length);
        Ok(Some(packet))
    }

    /// Checks whether the received bytes can be the start of a controller's packet. Too few bytes to decide are accepted.
    ///
    /// # Errors
    /// [`PacketError::Size`], [`PacketError::Type`].
    pub fn check_header(&self) -> Result<(), PacketError> {
        match *self.received.unread() {
            [high, low, ..] if usize::from(u16::from_be_bytes([high, low])) < MIN_PACKET => {
                Err(PacketError::Size(u16::from_be_bytes([high, low])))
            }
            [_, _, kind, ..] if !packet_type::ALL.contains(&kind) => Err(PacketError::Type(kind)),
            _ => Ok(()),
        }
    }

    /// Bytes of an incomplete packet.
    pub fn pending(&self) -> usize {
        self.received.unread().len()
    }
}

/// A packet with its header. Content beyond 64 KiB is cut off; no packet sent here comes near that.
pub fn encode(kind: u8, content: &[u8]) -> Vec<u8> {
    let size = u16::try_from(MIN_PACKET + content.len()).unwrap_or(u16::MAX);
    let content = content.iter().copied().take(usize::from(size) - MIN_PACKET);
    size.to_be_bytes().into_iter().chain([kind]).chain(content).collect()
}

/// Request for [`PROTOCOL_VERSION`].
pub fn request_version() -> Vec<u8> {
    encode(packet_type::REQUEST_PROTOCOL_VERSION, &PROTOCOL_VERSION.to_be_bytes())
}

/// Request for the named values at a frequency (Hz).
pub fn set_up_outputs(frequency: f64, names: &[&str]) -> Vec<u8> {
    let content = [&frequency.to_be_bytes()[..], names.join(",").as_bytes()].concat();
    encode(packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS, &content)
}

/// A packet from the controller.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Whether the version of the protocol is accepted.
    ProtocolVersion(bool),
    /// Version of the controller: major, minor, bug fix, build.
    ControllerVersion([u32; 4]),
    /// A text message.
    Text(TextMessage),
    /// Answer to the set-up of the outputs.
    Outputs {
        /// Number of the recipe.
        recipe: u8,
        /// Types of the values, or the reason why a value is not available.
        types: Vec<String>,
    },
    /// Whether the stream was started.
    Started(bool),
    /// Data of a recipe.
    Data {
        /// Number of the recipe.
        recipe: u8,
        /// Encoded values, see [`Record`].
        values: Vec<u8>,
    },
    /// A packet of another type.
    Other(u8),
}

impl Packet {
    /// Decodes a packet from its type and content.
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

/// A text message of the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextMessage {
    /// Text of the message.
    pub text: String,
    /// Component that sent the message.
    pub source: String,
    /// Level: 0 exception, 1 error, 2 warning, 3 information.
    pub level: u8,
}

impl TextMessage {
    /// Decodes a length and a text, a length and a source, and a level.
    fn decode(content: &[u8]) -> Option<Self> {
        let (text, rest) = split_text(content)?;
        let (source, rest) = split_text(rest)?;
        Some(Self { text, source, level: *rest.first()? })
    }
}

/// Splits off a text that is preceded by its length.
fn split_text(bytes: &[u8]) -> Option<(String, &[u8])> {
    let (length, rest) = bytes.split_first()?;
    let (text, rest) = rest.split_at_checked(usize::from(*length))?;
    Some((printable(String::from_utf8_lossy(text).trim()), rest))
}

/// A value of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Time by the controller's clock.
    Timestamp,
    /// Measured joint values.
    ActualQ,
    /// Robot mode.
    RobotMode,
    /// Safety status; controllers have it since 3.10 and 5.4.
    SafetyStatus,
    /// Safety mode, with the same numbers, of older controllers.
    SafetyMode,
}

impl Field {
    /// Name in requests.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Timestamp => "timestamp",
            Self::ActualQ => "actual_q",
            Self::RobotMode => "robot_mode",
            Self::SafetyStatus => "safety_status",
            Self::SafetyMode => "safety_mode",
        }
    }

    /// Type that controllers announce.
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Timestamp => "DOUBLE",
            Self::ActualQ => "VECTOR6D",
            Self::RobotMode | Self::SafetyStatus | Self::SafetyMode => "INT32",
        }
    }

    /// Encoded size (bytes).
    const fn size(self) -> usize {
        match self {
            Self::Timestamp => 8,
            Self::ActualQ => 6 * 8,
            Self::RobotMode | Self::SafetyStatus | Self::SafetyMode => 4,
        }
    }

    /// Whether the link is of no use without this value.
    pub const fn is_required(self) -> bool {
        matches!(self, Self::Timestamp | Self::ActualQ)
    }

    /// The value that older controllers have instead.
    pub const fn older(self) -> Option<Self> {
        match self {
            Self::SafetyStatus => Some(Self::SafetyMode),
            _ => None,
        }
    }
}

/// Values of one data packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Time by the controller's clock (s).
    pub timestamp: f64,
    /// Joint values (rad).
    pub actual_q: [f64; 6],
    /// Robot mode, see [`super::mode`]; `None` if the controller does not report it.
    pub robot_mode: Option<i32>,
    /// Safety status or mode, see [`super::mode`]; `None` if the controller does not report it.
    pub safety_status: Option<i32>,
}

impl Record {
    /// The values to request first.
    pub const FIELDS: [Field; 4] = [Field::Timestamp, Field::ActualQ, Field::RobotMode, Field::SafetyStatus];

    /// Encoded size of these values (bytes).
    pub fn size(fields: &[Field]) -> usize {
        fields.iter().map(|field| field.size()).sum()
    }

    /// Decodes the values of a recipe; `None` if the size is wrong.
    pub fn decode(fields: &[Field], values: &[u8]) -> Option<Self> {
        if values.len() != Self::size(fields) {
            return None;
        }
        let nowhere = f64::NAN;
        let mut record = Self { timestamp: nowhere, actual_q: [nowhere; 6], robot_mode: None, safety_status: None };
        let mut rest = values;
        for field in fields {
            let (value, after) = rest.split_at_checked(field.size())?;
            rest = after;
            let numbers = value.as_chunks::<8>().0;
            let number = |index: usize| numbers.get(index).map_or(nowhere, |bytes| f64::from_be_bytes(*bytes));
            let integer = value.first_chunk::<4>().map(|bytes| i32::from_be_bytes(*bytes));
            match field {
                Field::Timestamp => record.timestamp = number(0),
                Field::ActualQ => record.actual_q = std::array::from_fn(number),
                Field::RobotMode => record.robot_mode = integer,
                Field::SafetyStatus | Field::SafetyMode => record.safety_status = integer,
            }
        }
        Some(record)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.timestamp.is_finite() && self.actual_q.iter().all(|value| value.is_finite())
    }
}
