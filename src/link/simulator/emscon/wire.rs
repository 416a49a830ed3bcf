//! Packets of the simulated tracker. They are written independently of the protocol's decoder, so that a mistake in one does not
//! cancel a mistake in the other.

use crate::link::protocol::emscon::{CommandId, PacketType, ResultStatus, SystemEvent};

/// A packet being written. Its first field, the size, is set at the end.
#[derive(Clone, Debug)]
pub(super) struct PacketWriter {
    bytes: Vec<u8>,
}

impl PacketWriter {
    /// Starts a packet of a type.
    pub(super) fn new(kind: PacketType) -> Self {
        Self { bytes: vec![0; 4] }.i32(kind.number())
    }

    /// Starts the answer to a command.
    pub(super) fn reply(command: CommandId, status: ResultStatus) -> Self {
        Self::new(PacketType::Command).i32(command.number()).i32(status.number())
    }

    /// Starts an error of a command.
    pub(super) fn error(command: CommandId, status: ResultStatus) -> Self {
        Self::new(PacketType::Error).i32(command.number()).i32(status.number())
    }

    /// Starts a status change.
    pub(super) fn event(event: SystemEvent) -> Self {
        Self::new(PacketType::SystemStatusChange).i32(event.number())
    }

    pub(super) fn i32(mut self, value: i32) -> Self {
        self.bytes.extend(value.to_le_bytes());
        self
    }

    pub(super) fn integers(self, values: &[i32]) -> Self {
        values.iter().fold(self, |packet, value| packet.i32(*value))
    }

    pub(super) fn numbers(mut self, values: &[f64]) -> Self {
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    /// Appends a name in 32 UTF-16 units.
    pub(super) fn name(mut self, name: &str) -> Self {
        let units = name.encode_utf16().chain(std::iter::repeat(0)).take(32);
        self.bytes.extend(units.flat_map(u16::to_le_bytes));
        self
    }

    pub(super) fn zeros(mut self, count: usize) -> Self {
        self.bytes.resize(self.bytes.len() + count, 0);
        self
    }

    /// The packet as bytes.
    pub(super) fn finish(self) -> Vec<u8> {
        let size = i32::try_from(self.bytes.len()).unwrap_or(i32::MAX);
        self.finish_with_size(size)
    }

    /// The packet as bytes, with a size field that may be wrong.
    pub(super) fn finish_with_size(mut self, size: i32) -> Vec<u8> {
        for (field, byte) in self.bytes.iter_mut().zip(size.to_le_bytes()) {
            *field = byte;
        }
        self.bytes
    }
}
