//! Splits a stream of bytes into lines.

/// Longest accepted line (bytes); no instrument writes longer ones.
pub const MAX_LINE: usize = 4096;

/// Byte order mark of UTF-8, which some programs write before their first line.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// A piece of the stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// A line without its terminator, never empty.
    Line(Vec<u8>),
    /// More than [`MAX_LINE`] bytes without a terminator; everything up to the next terminator is discarded.
    Overlong,
}

/// Splits a stream at CR, LF or CR LF, drops NUL bytes and a byte order mark, and buffers a partial line until it is complete.
///
/// Empty lines are not reported, so CR LF simply counts as two terminators, wherever the stream is split.
#[derive(Clone, Debug, Default)]
pub struct LineSplitter {
    partial: Vec<u8>,
    skipping: bool,
    overlong: u64,
}

impl LineSplitter {
    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Piece> {
        match byte {
            b'\r' | b'\n' => self.end(),
            0 => None,
            _ if self.skipping => None,
            _ if self.partial.len() >= MAX_LINE => {
                self.skipping = true;
                self.overlong += 1;
                self.partial = Vec::new();
                Some(Piece::Overlong)
            }
            _ => {
                self.partial.push(byte);
                None
            }
        }
    }

    /// Ends the line without a terminator: a datagram is a whole line.
    pub fn end(&mut self) -> Option<Piece> {
        let line = std::mem::take(&mut self.partial);
        if std::mem::take(&mut self.skipping) {
            return None;
        }
        let line = line.strip_prefix(BYTE_ORDER_MARK).map(<[u8]>::to_vec).unwrap_or(line);
        (!line.is_empty()).then_some(Piece::Line(line))
    }

    /// Discards the partial line up to its terminator, even if that arrives later: the rest must not be taken for a line.
    pub fn discard_partial(&mut self) {
        if !self.partial.is_empty() {
            self.partial.clear();
            self.skipping = true;
        }
    }

    /// Resets the splitter for a new connection.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Bytes of the partial line.
    pub const fn pending(&self) -> usize {
        self.partial.len()
    }

    /// Number of lines discarded for their length.
    pub const fn overlong(&self) -> u64 {
        self.overlong
    }
}

#[cfg(test)]
mod tests;
