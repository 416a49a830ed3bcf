//! Options for common sources.

use super::options::AsciiOptions;
use super::options::Layout;
use super::options::Mode;
use super::options::{Column, DecimalSign, Separator};
use crate::text::names;

/// Both forms of the answer. No comma may follow the third value: with decimal commas there would be six values.
const ANSWER_OF_T2SA: &str =
    r"(?:\bresult\s+|;X:\s*)(?<x>[^\s,;]+)(?:,|;Y:\s*)(?<y>[^\s,;]+)(?:,|;Z:\s*)(?<z>[^\s,;]+)(?:[\s;]|$)";

/// Line of a gauge: its number, a letter, the value.
const GAUGE_LINE: &str = r"^\d\dA(?<x>[+-]\d+\.\d+)$";

/// A named set of options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// A stream of `x,y,z`.
    Xyz,
    /// A stream of `name,x,y,z`.
    NameXyz,
    /// `SpatialAnalyzer` behind the T2SA server: polled, answers in sentences with `ACK` and `ERR`.
    T2sa,
    /// A Mitutoyo gauge with one dimension. [`AsciiOptions::validate`] refuses it with the reason.
    Mitutoyo,
    /// UDP datagrams of `x,y,z,time`.
    UdpXyzTime,
    /// A stream of `name x y z`, separated by blanks.
    Blanks,
    /// A stream of name, x, y, z, separated by tabulators.
    Tabs,
    /// A stream of `name;x;y;z` with decimal commas.
    Semicolons,
    /// The line recommended for bridge programs.
    Bridge,
    /// The same from a program that measures when it receives a line.
    BridgeAsked,
}

names!(Preset {
    Xyz = "xyz",
    NameXyz = "name,x,y,z",
    T2sa = "T2SA",
    Mitutoyo = "Mitutoyo 1-D",
    UdpXyzTime = "UDP xyz+time",
    Blanks = "name x y z",
    Tabs = "tabs",
    Semicolons = "semicolons",
    Bridge = "bridge",
    BridgeAsked = "bridge, asked",
});

impl Preset {
    /// Options of the preset.
    pub fn options(self) -> AsciiOptions {
        let columns =
            |columns: &[Column]| AsciiOptions { layout: Layout::Columns(columns.to_vec()), ..AsciiOptions::default() };
        let named = columns(&[Column::Name, Column::X, Column::Y, Column::Z]);
        match self {
            Self::Xyz => AsciiOptions::default(),
            Self::NameXyz => named,
            Self::T2sa => t2sa(),
            Self::Mitutoyo => AsciiOptions { layout: Layout::Regex(GAUGE_LINE.to_owned()), ..AsciiOptions::default() },
            Self::UdpXyzTime => {
                AsciiOptions { datagrams: true, ..columns(&[Column::X, Column::Y, Column::Z, Column::Time]) }
            }
            Self::Blanks => AsciiOptions { separator: Separator::Spaces, ..named },
            Self::Tabs => AsciiOptions { separator: Separator::Tab, ..named },
            Self::Semicolons => {
                AsciiOptions { separator: Separator::Semicolon, decimal_sign: DecimalSign::Comma, ..named }
            }
            Self::Bridge => columns(&bridge_columns()),
            Self::BridgeAsked => AsciiOptions {
                mode: Mode::Polled { trigger: "M\\n".to_owned() },
                timeout_s: 30.0,
                ..columns(&bridge_columns())
            },
        }
    }
}

fn bridge_columns() -> [Column; 10] {
    [
        Column::Literal("P".to_owned()),
        Column::Name,
        Column::X,
        Column::Y,
        Column::Z,
        Column::SigmaX,
        Column::SigmaY,
        Column::SigmaZ,
        Column::Status,
        Column::Time,
    ]
}

/// The answer contains a time too, but in whole seconds. It cannot distinguish two shots, so it is not used.
fn t2sa() -> AsciiOptions {
    AsciiOptions {
        mode: Mode::Polled { trigger: "!MEAS_SINGLE_POINT:calibration;points;p\\r\\n".to_owned() },
        layout: Layout::Regex(ANSWER_OF_T2SA.to_owned()),
        error_pattern: Some(r"^ERR-\d+".to_owned()),
        ignore_pattern: Some(r"^ACK-\d+".to_owned()),
        timeout_s: 30.0,
        ..AsciiOptions::default()
    }
}
