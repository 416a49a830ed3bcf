//! Receive buffer for a stream of packets.

/// Received bytes that do not form a whole packet yet.
#[derive(Clone, Debug, Default)]
pub struct ReceiveBuffer {
    buffer: Vec<u8>,
    /// Number of bytes at the start of `buffer` that were consumed.
    consumed: usize,
}

impl ReceiveBuffer {
    /// Appends bytes. Consumed bytes are removed here, once per feed instead of once per packet, so that a feed of many
    /// packets takes linear time.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.consumed);
        self.consumed = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// The bytes that were not consumed yet.
    pub fn unread(&self) -> &[u8] {
        self.buffer.get(self.consumed..).unwrap_or_default()
    }

    /// Consumes the next `count` bytes.
    pub fn consume(&mut self, count: usize) {
        self.consumed = (self.consumed + count).min(self.buffer.len());
    }

    /// Empties the buffer.
    pub fn clear(&mut self) {
        self.buffer.clear();
        self.consumed = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consumed_bytes_are_removed_and_unread_bytes_are_kept() {
        let mut received = ReceiveBuffer::default();
        received.feed(b"abcd");
        received.consume(3);
        assert_eq!(received.unread(), b"d");
        received.feed(b"ef");
        assert_eq!((received.unread(), received.buffer.len()), (&b"def"[..], 3));
        received.consume(9);
        assert_eq!(received.unread(), b"");
        received.feed(b"g");
        received.clear();
        assert_eq!(received.unread(), b"");
    }
}
