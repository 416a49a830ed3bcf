//! Options of the line driver: the meaning of a line and how it is requested.

use regex::bytes::Regex;
use regex::bytes::RegexBuilder;
use serde::Deserialize;
use serde::Serialize;

use super::escape::unescape;

/// Options of the generic line driver, as a profile states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AsciiOptions {
    /// How a point is requested.
    pub mode: Mode,
    /// Positions of the values in the line.
    pub layout: Layout,
    /// Unit of the coordinates and of their standard deviations.
    pub unit: LengthUnit,
    /// Separator of the columns.
    pub separator: Separator,
    /// Decimal sign.
    pub decimal_sign: DecimalSign,
    /// Lines that start with this text are skipped.
    pub comment_prefix: Option<String>,
    /// Check sum at the end of each line.
    pub checksum: Checksum,
    /// Lines that match this regular expression are error messages of the instrument.
    pub error_pattern: Option<String>,
    /// Lines that match this regular expression and contain no point are skipped, such as acknowledgements.
    pub ignore_pattern: Option<String>,
    /// Texts of the status column that mean a valid point.
    pub valid_statuses: Vec<String>,
    /// Longest possible distance from the instrument (mm).
    pub range_mm: f64,
    /// Whether consecutive shots may be identical to the last digit. A real instrument never repeats itself; one that is stuck
    /// does.
    pub allow_identical: bool,
    /// Time limit of a polled line, or of the next line of a stream (s).
    pub timeout_s: f64,
    /// Whether every packet is a whole line without a line end, as over UDP.
    pub datagrams: bool,
}

impl Default for AsciiOptions {
    fn default() -> Self {
        Self {
            mode: Mode::Streamed { lines: 1 },
            layout: Layout::Columns(vec![Column::X, Column::Y, Column::Z]),
            unit: LengthUnit::Millimetre,
            separator: Separator::Comma,
            decimal_sign: DecimalSign::Point,
            comment_prefix: None,
            checksum: Checksum::None,
            error_pattern: None,
            ignore_pattern: None,
            valid_statuses: vec!["0".to_owned()],
            range_mm: 80_000.0,
            allow_identical: false,
            timeout_s: 5.0,
            datagrams: false,
        }
    }
}

/// How a point is requested.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Bytes are sent, and one line is the answer.
    Polled {
        /// Bytes to send, with the escapes `\r`, `\n`, `\t`, `\0`, `\\` and `\x06`.
        trigger: String,
    },
    /// Lines arrive without a request.
    Streamed {
        /// Number of lines after the trigger that are averaged into one shot.
        lines: u32,
    },
}

/// Positions of the values in a line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Layout {
    /// Separated columns; a line must have exactly these.
    Columns(Vec<Column>),
    /// A regular expression with the named groups `x`, `y`, `z` and, if wanted, `name`, `sigma`, `sx`, `sy`, `sz`, `time` and
    /// `status`.
    Regex(String),
}

/// Meaning of a column.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Column {
    /// An ignored column.
    Skip,
    /// Exactly this text, such as `P` in front of every point.
    Literal(String),
    /// Name of the point.
    Name,
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
    /// Third coordinate.
    Z,
    /// Standard deviation of every coordinate.
    Sigma,
    /// Standard deviation of the first coordinate.
    SigmaX,
    /// Standard deviation of the second coordinate.
    SigmaY,
    /// Standard deviation of the third coordinate.
    SigmaZ,
    /// Time by the instrument's clock: seconds, or date and time.
    Time,
    /// Status of the point.
    Status,
}

impl Column {
    /// Name of the group of a regular expression with the same meaning.
    pub(super) const fn group(&self) -> Option<&'static str> {
        Some(match self {
            Self::Skip | Self::Literal(_) => return None,
            Self::Name => "name",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Sigma => "sigma",
            Self::SigmaX => "sx",
            Self::SigmaY => "sy",
            Self::SigmaZ => "sz",
            Self::Time => "time",
            Self::Status => "status",
        })
    }
}

/// Compiles a regular expression. Classes such as `\d` are ASCII only, so no Unicode tables are needed.
pub(super) fn compile(pattern: &str) -> Result<Regex, String> {
    let regex = RegexBuilder::new(pattern).unicode(false).size_limit(MAX_PATTERN).build();
    regex.map_err(|error| error.to_string())
}

/// Largest compiled regular expression (bytes).
const MAX_PATTERN: usize = 1 << 20;

/// Names of all groups that a regular expression may have.
const GROUPS: [&str; 10] = ["name", "x", "y", "z", "sigma", "sx", "sy", "sz", "time", "status"];

/// Unit of lengths in the lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LengthUnit {
    /// 1 m.
    Metre,
    /// 0.001 m.
    Millimetre,
    /// 0.000001 m.
    Micrometre,
    /// 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// Length of one unit (m).
    pub const fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Millimetre => 1e-3,
            Self::Micrometre => 1e-6,
            Self::Inch => 25.4e-3,
        }
    }

    /// Symbol of the unit.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Millimetre => "mm",
            Self::Micrometre => "um",
            Self::Inch => "in",
        }
    }
}

/// Separator of columns. Spaces around commas, semicolons and tabs are ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Separator {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tab.
    Tab,
    /// One or more spaces or tabs.
    Spaces,
}

/// Decimal sign of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DecimalSign {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
}

/// Check sum at the end of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Checksum {
    /// No check sum.
    None,
    /// `*` and two hexadecimal digits: XOR of all bytes before the `*`, without a leading `$`.
    Nmea,
    /// Four hexadecimal digits: CRC-16/ARC of all bytes before them.
    Crc16,
}

impl AsciiOptions {
    /// Fails with all reasons in one text if the driver cannot use these options.
    pub fn validate(&self) -> Result<(), String> {
        let mut problems = Vec::new();
        self.check_mode(&mut problems);
        self.check_layout(&mut problems);
        self.check_limits(&mut problems);
        for (field, pattern) in [("error_pattern", &self.error_pattern), ("ignore_pattern", &self.ignore_pattern)] {
            if let Some(Err(error)) = pattern.as_ref().map(|pattern| compile(pattern)) {
                problems.push(format!("{field} is not a regular expression: {error}"));
            }
        }
        if problems.is_empty() { Ok(()) } else { Err(problems.join("; ")) }
    }

    fn check_mode(&self, problems: &mut Vec<String>) {
        match &self.mode {
            Mode::Polled { trigger } => match unescape(trigger) {
                Ok(bytes) if bytes.is_empty() => {
                    problems.push("trigger is empty: a polled instrument needs one".to_owned());
                }
                Ok(_) => {}
                Err(error) => problems.push(format!("trigger: {error}")),
            },
            Mode::Streamed { lines } if !(1..=1000).contains(lines) => {
                problems.push(format!("lines is {lines}: use 1 to 1000"));
            }
            Mode::Streamed { .. } => {}
        }
    }

    fn check_layout(&self, problems: &mut Vec<String>) {
        let groups: Vec<String> = match &self.layout {
            Layout::Columns(columns) => columns.iter().filter_map(Column::group).map(str::to_owned).collect(),
            Layout::Regex(pattern) => match compile(pattern) {
                Ok(regex) => regex.capture_names().flatten().map(str::to_owned).collect(),
                Err(error) => return problems.push(format!("layout is not a regular expression: {error}")),
            },
        };
        let has = |group: &str| groups.iter().any(|known| known == group);
        for group in groups.iter().filter(|group| !GROUPS.contains(&group.as_str())) {
            problems.push(format!("layout: unknown group `{group}`; known are {}", GROUPS.join(", ")));
        }
        for group in GROUPS.iter().filter(|group| groups.iter().filter(|known| known == *group).count() > 1) {
            problems.push(format!("layout: `{group}` occurs twice"));
        }
        match ["x", "y", "z"].iter().filter(|axis| has(axis)).count() {
            3 => {}
            1 => {
                problems.push("layout has one coordinate: a gauge of one dimension gives no point in space".to_owned());
            }
            _ => problems.push("layout needs x, y and z".to_owned()),
        }
        let sigmas = ["sx", "sy", "sz"].iter().filter(|axis| has(axis)).count();
        if !matches!(sigmas, 0 | 3) || (sigmas == 3 && has("sigma")) {
            problems.push("layout: give sigma, or all of sx, sy and sz".to_owned());
        }
        let is_columns = matches!(self.layout, Layout::Columns(_));
        if is_columns && self.separator == Separator::Comma && self.decimal_sign == DecimalSign::Comma {
            problems.push("a comma cannot be both separator and decimal sign".to_owned());
        }
    }

    fn check_limits(&self, problems: &mut Vec<String>) {
        if !(self.range_mm > 0.0 && self.range_mm.is_finite()) {
            problems.push(format!("range_mm is {}: it must be above 0", self.range_mm));
        }
        if !(0.05..=600.0).contains(&self.timeout_s) {
            problems.push(format!("timeout_s is {}: use 0.05 to 600", self.timeout_s));
        }
        if self.comment_prefix.as_ref().is_some_and(String::is_empty) {
            problems.push("comment_prefix is empty: every line would be a comment".to_owned());
        }
    }
}
