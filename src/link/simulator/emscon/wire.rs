//! Packets that the simulated tracker sends, written field by field and apart from the reader on the other side, so that a
//! mistake in one of them does not hide in the other.

use crate::link::protocol::emscon::{CommandId, PacketType, ResultStatus, SystemEvent};

/// A packet that is being written. The size stands in its first field once it is finished.
#[derive(Clone, Debug)]
pub(super) struct PacketWriter {
    bytes: Vec<u8>,
}

impl PacketWriter {
    /// A packet of a type.
    pub(super) fn new(kind: PacketType) -> Self {
        Self { bytes: vec![0; 4] }.i32(kind.number())
    }

    /// The answer to a command.
    pub(super) fn reply(command: CommandId, status: ResultStatus) -> Self {
        Self::new(PacketType::Command).i32(command.number()).i32(status.number())
    }

    /// An error of a command.
    pub(super) fn error(command: CommandId, status: ResultStatus) -> Self {
        Self::new(PacketType::Error).i32(command.number()).i32(status.number())
    }

    /// A status change.
    pub(super) fn event(event: SystemEvent) -> Self {
        Self::new(PacketType::SystemStatusChange).i32(event.number())
    }

    /// An integer.
    pub(super) fn i32(mut self, value: i32) -> Self {
        self.bytes.extend(value.to_le_bytes());
        self
    }

    /// Integers in a row.
    pub(super) fn integers(self, values: &[i32]) -> Self {
        values.iter().fold(self, |packet, value| packet.i32(*value))
    }

    /// Numbers in a row.
    pub(super) fn numbers(mut self, values: &[f64]) -> Self {
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    /// A name in 32 UTF-16 units.
    pub(super) fn name(mut self, name: &str) -> Self {
        let units = name.encode_utf16().chain(std::iter::repeat(0)).take(32);
        self.bytes.extend(units.flat_map(u16::to_le_bytes));
        self
    }

    /// Zeros.
    pub(super) fn zeros(mut self, count: usize) -> Self {
        self.bytes.resize(self.bytes.len() + count, 0);
        self
    }

    /// The bytes of the wire.
    pub(super) fn finish(self) -> Vec<u8> {
        let size = i32::try_from(self.bytes.len()).unwrap_or(i32::MAX);
        self.finish_with_size(size)
    }

    /// The bytes of the wire with a size field that may be wrong.
    pub(super) fn finish_with_size(mut self, size: i32) -> Vec<u8> {
        for (place, byte) in self.bytes.iter_mut().zip(size.to_le_bytes()) {
            *place = byte;
        }
        self.bytes
    }
}
