//! One line of text per point: for any source that prints coordinates, directly or through a bridge program.
//!
//! *Polled*: trigger bytes are sent and one line is returned. *Streamed*: lines arrive without a request; a shot is the mean of
//! the lines that arrive after the trigger. [`AsciiOptions`] define the meaning of a line, and nothing is guessed: a line that
//! can be read in two ways is refused.
//!
//! Recommended line for a bridge program, in millimetres, status 0 for a valid point ([`Preset::Bridge`]):
//!
//! ```text
//! P,<id>,<x>,<y>,<z>,<sx>,<sy>,<sz>,<status>,<ISO 8601>
//! ```

mod driver;
mod escape;
mod number;
mod options;
mod parser;
mod preset;

pub use driver::AsciiProtocol;
pub use escape::unescape;
pub use options::AsciiOptions;
pub use options::Checksum;
pub use options::Column;
pub use options::DecimalSign;
pub use options::Layout;
pub use options::LengthUnit;
pub use options::Mode;
pub use options::Separator;
pub use parser::LineParser;
pub use parser::ParsedLine;
pub use parser::Rejection;
pub use preset::Preset;

#[cfg(test)]
mod tests;
