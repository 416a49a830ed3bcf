//! NDI Polaris and Aurora by the combined API, over a serial port or TCP.
//!
//! Commands and text replies end with four hexadecimal digits of CRC-16/ARC and CR; `BX` answers in binary. A shot is the first
//! frame after the one that was current at the trigger.

mod codes;
mod driver;
mod line;
mod options;
mod set_up;
mod tools;
mod wire;

pub use codes::error_in_words;
pub use codes::failure_of_error;
pub use driver::NdiProtocol;
pub use options::NdiOptions;
pub use options::ReplyFormat;
pub use tools::Positions;
pub use tools::Tool;
pub use tools::ToolState;
pub use tools::decode_bx;
pub use tools::decode_tx;
pub use wire::Frame;
pub use wire::FrameDecoder;
pub use wire::MAX_BINARY;
pub use wire::MAX_TEXT;
pub use wire::encode_binary;
pub use wire::encode_text;

#[cfg(test)]
mod tests;
