//! Framing of messages with their CRC.

use super::super::crc::crc16_arc;

/// Longest text reply (bytes): 255 handles of 70 characters, with a margin.
pub const MAX_TEXT: usize = 20_000;

/// Longest body of a binary reply (bytes): 255 handles of 42 bytes, with a margin.
pub const MAX_BINARY: usize = 16_384;

/// First bytes of a binary reply.
const START: [u8; 2] = [0xC4, 0xA5];

/// Size of the header: start, length and the CRC of these four bytes.
const HEADER: usize = 6;

/// A received message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// A text reply, without its CRC.
    Text(String),
    /// The body of a binary reply.
    Binary(Vec<u8>),
    /// An unreadable message, with the reason. Everything after it is discarded until [`FrameDecoder::resync`].
    Damaged(String),
}

/// Bytes of a text message.
pub fn encode_text(text: &str) -> Vec<u8> {
    format!("{text}{:04X}\r", crc16_arc(text.as_bytes())).into_bytes()
}

/// Bytes of a binary reply. A body longer than [`MAX_BINARY`] is cut off.
pub fn encode_binary(body: &[u8]) -> Vec<u8> {
    let body = body.get(..MAX_BINARY).unwrap_or(body);
    let length = u16::try_from(body.len()).unwrap_or(u16::MAX);
    let mut bytes = START.to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(crc16_arc(&bytes).to_le_bytes());
    bytes.extend(body);
    bytes.extend(crc16_arc(body).to_le_bytes());
    bytes
}

/// Splits the stream into messages.
#[derive(Clone, Debug, Default)]
pub struct FrameDecoder {
    buffer: Vec<u8>,
    skipping: bool,
}

impl FrameDecoder {
    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Frame> {
        // Some converters append a line feed to every CR.
        let is_stray = self.buffer.is_empty() && matches!(byte, b'\r' | b'\n');
        if self.skipping || is_stray {
            return None;
        }
        self.buffer.push(byte);
        let is_binary = START.starts_with(&self.buffer) || self.buffer.starts_with(&START);
        let frame = if is_binary { self.binary() } else { self.text(byte) };
        if frame.is_some() {
            self.buffer.clear();
        }
        self.skipping = matches!(frame, Some(Frame::Damaged(_)));
        frame
    }

    /// Discards received bytes after an idle time, so that the next byte starts a message.
    pub fn resync(&mut self) {
        *self = Self::default();
    }

    /// Bytes of an incomplete message.
    pub const fn pending(&self) -> usize {
        self.buffer.len()
    }

    fn binary(&self) -> Option<Frame> {
        let header = self.buffer.first_chunk::<HEADER>()?;
        let [start_0, start_1, low, high, crc @ ..] = *header;
        let length = usize::from(u16::from_le_bytes([low, high]));
        if crc16_arc(&[start_0, start_1, low, high]) != u16::from_le_bytes(crc) {
            return Some(Frame::Damaged("the CRC of a binary header is wrong".to_owned()));
        }
        if length > MAX_BINARY {
            return Some(Frame::Damaged(format!("a binary reply of {length} bytes is announced")));
        }
        let (body, crc) = self.buffer.get(HEADER..)?.split_at_checked(length)?;
        let crc = crc.first_chunk::<2>()?;
        if crc16_arc(body) == u16::from_le_bytes(*crc) {
            return Some(Frame::Binary(body.to_vec()));
        }
        Some(Frame::Damaged("the CRC of a binary reply is wrong".to_owned()))
    }

    fn text(&self, byte: u8) -> Option<Frame> {
        if byte != b'\r' {
            let is_long = self.buffer.len() > MAX_TEXT;
            return is_long.then(|| Frame::Damaged("a text reply does not end".to_owned()));
        }
        let line = self.buffer.strip_suffix(b"\r").unwrap_or(&self.buffer);
        let text = std::str::from_utf8(line).ok().filter(|text| text.is_ascii());
        let Some((text, crc)) = text.and_then(|text| text.split_at_checked(text.len().checked_sub(4)?)) else {
            return Some(Frame::Damaged("a reply is not plain text with a CRC".to_owned()));
        };
        let is_right = crc.bytes().all(|digit| digit.is_ascii_hexdigit())
            && u16::from_str_radix(crc, 16) == Ok(crc16_arc(text.as_bytes()));
        Some(if is_right {
            Frame::Text(text.to_owned())
        } else {
            Frame::Damaged("the CRC of a text reply is wrong".to_owned())
        })
    }
}
