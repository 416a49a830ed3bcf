//! How the packets of a simulated instrument are cut into writes.

use std::collections::VecDeque;

use super::Output;

/// A peer that lets this many bytes pile up is hung up on.
const MAX_BYTES: usize = 1 << 20;

/// Writes that wait.
#[derive(Clone, Debug, Default)]
pub(super) struct Writes {
    /// Packets that are to go out in one write.
    joined: Vec<u8>,
    outputs: VecDeque<Output>,
    bytes: usize,
    /// Every byte goes in a write of its own.
    pub(super) is_dripping: bool,
    /// All packets of a moment go in one write.
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

    /// Hangs up behind what was sent.
    pub(super) fn close(&mut self) {
        self.flush();
        self.outputs.push_back(Output::Close);
    }

    /// True where the other side does not read.
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
