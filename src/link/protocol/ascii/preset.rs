//! Options for common sources.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::options::AsciiOptions;
use super::options::Column;
use super::options::Layout;
use super::options::Mode;

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
    /// The line recommended for bridge programs.
    Bridge,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 6] = [Self::Xyz, Self::NameXyz, Self::T2sa, Self::Mitutoyo, Self::UdpXyzTime, Self::Bridge];

    /// Name in profiles and on screens.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xyz => "xyz",
            Self::NameXyz => "name,x,y,z",
            Self::T2sa => "T2SA",
            Self::Mitutoyo => "Mitutoyo 1-D",
            Self::UdpXyzTime => "UDP xyz+time",
            Self::Bridge => "bridge",
        }
    }

    /// Options of the preset.
    pub fn options(self) -> AsciiOptions {
        let columns =
            |columns: &[Column]| AsciiOptions { layout: Layout::Columns(columns.to_vec()), ..AsciiOptions::default() };
        match self {
            Self::Xyz => AsciiOptions::default(),
            Self::NameXyz => columns(&[Column::Name, Column::X, Column::Y, Column::Z]),
            Self::T2sa => t2sa(),
            Self::Mitutoyo => AsciiOptions { layout: Layout::Regex(GAUGE_LINE.to_owned()), ..AsciiOptions::default() },
            Self::UdpXyzTime => {
                AsciiOptions { datagrams: true, ..columns(&[Column::X, Column::Y, Column::Z, Column::Time]) }
            }
            Self::Bridge => columns(&bridge_columns()),
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

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// No preset has this name.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no preset `{}`; presets: {}", .0, Preset::ALL.map(Preset::name).join(" | "))]
pub struct UnknownPreset(String);

impl FromStr for Preset {
    type Err = UnknownPreset;

    fn from_str(name: &str) -> Result<Self, UnknownPreset> {
        Self::ALL
            .into_iter()
            .find(|preset| preset.name().eq_ignore_ascii_case(name))
            .ok_or_else(|| UnknownPreset(name.to_owned()))
    }
}
