//! Bytes of a stream of packets that have arrived and were not read yet.

/// Keeps what has arrived until it is a whole packet.
#[derive(Clone, Debug, Default)]
pub struct Unread {
    buffer: Vec<u8>,
    /// Bytes of `buffer` that were read.
    read: usize,
}

impl Unread {
    /// Adds bytes. What was read is dropped here, once per feed and not once per packet, so that a large feed stays linear.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.read);
        self.read = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// All that was not read.
    pub fn bytes(&self) -> &[u8] {
        self.buffer.get(self.read..).unwrap_or_default()
    }

    /// So many more bytes were read.
    pub fn skip(&mut self, count: usize) {
        self.read = (self.read + count).min(self.buffer.len());
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.buffer.clear();
        self.read = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_is_gone_and_what_was_not_waits() {
        let mut unread = Unread::default();
        unread.feed(b"abcd");
        unread.skip(3);
        assert_eq!(unread.bytes(), b"d");
        unread.feed(b"ef");
        assert_eq!((unread.bytes(), unread.buffer.len()), (&b"def"[..], 3));
        unread.skip(9);
        assert_eq!(unread.bytes(), b"");
        unread.feed(b"g");
        unread.clear();
        assert_eq!(unread.bytes(), b"");
    }
}
