//! Splits the packets of a simulated instrument into writes.

use std::collections::VecDeque;

use super::Output;

/// The connection of a peer with more unread bytes than this is closed.
const MAX_BYTES: usize = 1 << 20;

/// Writes that were not fetched yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Writes {
    /// Packets that will go out in one write.
    joined: Vec<u8>,
    outputs: VecDeque<Output>,
    bytes: usize,
    /// Whether every byte is written on its own.
    pub(super) is_dripping: bool,
    /// Whether all packets of one step are written together.
    pub(super) is_joining: bool,
}

impl Writes {
    /// Queues a packet.
    pub(super) fn send(&mut self, packet: Vec<u8>) {
        self.bytes += packet.len();
        if self.is_dripping {
            self.outputs.extend(packet.into_iter().map(|byte| Output::Bytes(vec![byte])));
        } else if self.is_joining {
            self.joined.extend(packet);
        } else {
            self.outputs.push_back(Output::Bytes(packet));
        }
    }

    /// Ends a joined write.
    pub(super) fn flush(&mut self) {
        if !self.joined.is_empty() {
            self.outputs.push_back(Output::Bytes(std::mem::take(&mut self.joined)));
        }
    }

    /// Closes the connection after the queued bytes.
    pub(super) fn close(&mut self) {
        self.flush();
        self.outputs.push_back(Output::Close);
    }

    /// Whether the other side does not read.
    pub(super) const fn is_overfull(&self) -> bool {
        self.bytes > MAX_BYTES
    }

    /// The next write.
    pub(super) fn next(&mut self) -> Option<Output> {
        let output = self.outputs.pop_front()?;
        if let Output::Bytes(bytes) = &output {
            self.bytes = self.bytes.saturating_sub(bytes.len());
        }
        Some(output)
    }
}
