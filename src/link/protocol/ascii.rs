//! One line of text per point: the way in for whatever prints coordinates, by itself or through a bridge program.
//!
//! *Polled*: trigger bytes go out, one line comes back. *Streamed*: lines come by themselves; a shot is the mean of the lines that
//! arrive after it was asked for. What a line means is said by [`AsciiOptions`], never guessed: a line that can be read in two
//! ways is refused.
//!
//! Recommended to whoever writes a bridge, in millimetres, status 0 for a valid point ([`Preset::Bridge`]):
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
pub use parser::Reading;
pub use parser::Rejection;
pub use preset::Preset;
pub use preset::UnknownPreset;

#[cfg(test)]
mod tests;
