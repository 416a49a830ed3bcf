//! Lines out of a stream of bytes.

/// Longest line that is kept (bytes); no instrument writes longer ones.
pub const MAX_LINE: usize = 4096;

/// Byte order mark of UTF-8, which some programs put before their first line.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// What a splitter found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// A line without its end, never empty.
    Line(Vec<u8>),
    /// More than [`MAX_LINE`] bytes without an end; all up to the next end are thrown away.
    Overlong,
}

/// Cuts a stream at CR, LF or CR LF, drops NUL bytes and a byte order mark, and keeps a part of a line until the rest comes.
///
/// Empty lines are not reported, so CR LF is simply two ends, wherever the stream is split.
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

    /// The line ends here, though no end was sent: for datagrams.
    pub fn end(&mut self) -> Option<Piece> {
        let line = std::mem::take(&mut self.partial);
        if std::mem::take(&mut self.skipping) {
            return None;
        }
        let line = line.strip_prefix(BYTE_ORDER_MARK).map(<[u8]>::to_vec).unwrap_or(line);
        (!line.is_empty()).then_some(Piece::Line(line))
    }

    /// Throws away the line that has begun, up to its end, wherever that comes: its rest must not pass for a line.
    pub fn discard_partial(&mut self) {
        if !self.partial.is_empty() {
            self.partial.clear();
            self.skipping = true;
        }
    }

    /// Forgets everything: a new connection.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Bytes of the line that has begun.
    pub const fn pending(&self) -> usize {
        self.partial.len()
    }

    /// Number of lines thrown away for their length.
    pub const fn overlong(&self) -> u64 {
        self.overlong
    }
}

#[cfg(test)]
mod tests;
