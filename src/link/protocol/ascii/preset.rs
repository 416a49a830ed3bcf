//! Settings for what is commonly met.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::options::AsciiOptions;
use super::options::Column;
use super::options::Layout;
use super::options::Mode;

/// Both forms of the answer. After the third value no comma may stand: with decimal commas there would be six values.
const ANSWER_OF_T2SA: &str =
    r"(?:\bresult\s+|;X:\s*)(?<x>[^\s,;]+)(?:,|;Y:\s*)(?<y>[^\s,;]+)(?:,|;Z:\s*)(?<z>[^\s,;]+)(?:[\s;]|$)";

/// A gauge's line: number of the gauge, a letter, the value.
const GAUGE_LINE: &str = r"^\d\dA(?<x>[+-]\d+\.\d+)$";

/// Named settings to start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// A stream of `x,y,z`.
    Xyz,
    /// A stream of `name,x,y,z`.
    NameXyz,
    /// `SpatialAnalyzer` behind the T2SA server: polled, answers in sentences with `ACK` and `ERR`.
    T2sa,
    /// A Mitutoyo gauge: one dimension. Refused by [`AsciiOptions::validate`], and said why.
    Mitutoyo,
    /// UDP datagrams of `x,y,z,time`.
    UdpXyzTime,
    /// The line that is recommended to whoever writes a bridge.
    Bridge,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Xyz, Self::NameXyz, Self::T2sa, Self::Mitutoyo, Self::UdpXyzTime, Self::Bridge];

    /// Its name in profiles and on screens.
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

    /// Its settings.
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

/// The answer carries a time too, but in whole seconds: it cannot tell two shots apart, so it is not used.
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
#[error("no preset is called `{0}`; there are: xyz | name,x,y,z | T2SA | Mitutoyo 1-D | UDP xyz+time | bridge")]
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
