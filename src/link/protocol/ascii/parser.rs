//! Parses one line into a point, or returns why it contains none.

use nalgebra::Point3;
use regex::bytes::Regex;
use thiserror::Error;

use super::super::Severity;
use super::super::Shot;
use super::super::Status;
use super::super::crc::crc16_arc;
use super::super::crc::nmea_xor;
use super::super::excerpt::excerpt;
use super::super::known_sigma;
use super::number::number;
use super::number::time;
use super::options::AsciiOptions;
use super::options::Checksum;
use super::options::Column;
use super::options::Layout;
use super::options::Separator;
use super::options::compile;

/// Content of a line.
#[derive(Clone, Debug, PartialEq)]
pub enum ParsedLine {
    /// A comment or another line to skip.
    Skipped,
    /// A point.
    Point(Shot),
}

/// Why a line contains no point.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Rejection {
    /// The line has the wrong form: truncated, joined, with another separator, or noise.
    #[error("{0}")]
    Garbled(String),
    /// The line states that there is no point.
    #[error("{0}")]
    NoPoint(String),
    /// The line is an error message of the instrument.
    #[error("{0}")]
    Instrument(String),
}

/// Parses lines according to the options.
#[derive(Debug)]
pub struct LineParser {
    options: AsciiOptions,
    layout: Option<Regex>,
    error: Option<Regex>,
    ignore: Option<Regex>,
}

impl LineParser {
    /// Fails if [`AsciiOptions::validate`] does.
    pub fn new(options: AsciiOptions) -> Result<Self, String> {
        options.validate()?;
        let layout = match &options.layout {
            Layout::Regex(pattern) => Some(compile(pattern)?),
            Layout::Columns(_) => None,
        };
        let error = options.error_pattern.as_deref().map(compile).transpose()?;
        let ignore = options.ignore_pattern.as_deref().map(compile).transpose()?;
        Ok(Self { options, layout, error, ignore })
    }

    /// Options of the parser.
    pub const fn options(&self) -> &AsciiOptions {
        &self.options
    }

    /// Parses a line without its terminator.
    pub fn read(&self, line: &[u8]) -> Result<ParsedLine, Rejection> {
        let decoded = decode(line);
        let text = decoded.trim();
        if text.is_empty() || self.options.comment_prefix.as_ref().is_some_and(|prefix| text.starts_with(prefix)) {
            return Ok(ParsedLine::Skipped);
        }
        // Error messages may come without a check sum even if points have one.
        if self.error.as_ref().is_some_and(|error| error.is_match(text.as_bytes())) {
            return Err(Rejection::Instrument(excerpt(text)));
        }
        let is_latin = std::str::from_utf8(line).is_err();
        let body = self.checked(text, is_latin)?;
        let read = self.fields(body).and_then(|fields| fields.into_shot(&self.options, line));
        match read {
            Err(Rejection::Garbled(_))
                if self.ignore.as_ref().is_some_and(|ignore| ignore.is_match(text.as_bytes())) =>
            {
                Ok(ParsedLine::Skipped)
            }
            other => other.map(ParsedLine::Point),
        }
    }

    /// Checks the check sum and returns the line without it.
    fn checked<'line>(&self, text: &'line str, is_latin: bool) -> Result<&'line str, Rejection> {
        let (body, stated, right) = match self.options.checksum {
            Checksum::None => return Ok(text),
            Checksum::Nmea => {
                let Some((body, stated)) = text.rsplit_once('*') else {
                    return Err(Rejection::Garbled("the check sum after `*` is missing".to_owned()));
                };
                let body = body.strip_prefix('$').unwrap_or(body);
                (body, stated, format!("{:02X}", nmea_xor(&encoded(body, is_latin))))
            }
            Checksum::Crc16 => {
                let Some((body, stated)) = text.len().checked_sub(4).and_then(|at| text.split_at_checked(at)) else {
                    return Err(Rejection::Garbled("the line is too short for its check sum".to_owned()));
                };
                (body, stated, format!("{:04X}", crc16_arc(&encoded(body, is_latin))))
            }
        };
        if stated.eq_ignore_ascii_case(&right) {
            return Ok(body.trim_end_matches([',', ';', ' ', '\t']));
        }
        Err(Rejection::Garbled(format!("the check sum is `{}`, but that of the line is {right}", excerpt(stated))))
    }

    fn fields<'line>(&self, text: &'line str) -> Result<Fields<'line>, Rejection> {
        match (&self.options.layout, &self.layout) {
            (Layout::Columns(columns), _) => separated(text, columns, self.options.separator),
            (Layout::Regex(_), Some(pattern)) => matched(text, pattern),
            (Layout::Regex(_), None) => Err(Rejection::Garbled("the pattern is missing".to_owned())),
        }
    }
}

/// Decodes UTF-8, or else Latin-1, in which every byte is a character.
fn decode(line: &[u8]) -> String {
    std::str::from_utf8(line).map_or_else(|_| line.iter().copied().map(char::from).collect(), str::to_owned)
}

/// The bytes from which [`decode`] made the text.
fn encoded(text: &str, is_latin: bool) -> Vec<u8> {
    if is_latin { text.chars().filter_map(|c| u8::try_from(c).ok()).collect() } else { text.as_bytes().to_vec() }
}

/// Texts of the values of a line.
#[derive(Debug, Default)]
struct Fields<'line> {
    name: Option<&'line str>,
    point: [Option<&'line str>; 3],
    sigma: Option<&'line str>,
    sigmas: [Option<&'line str>; 3],
    time: Option<&'line str>,
    status: Option<&'line str>,
}

fn separated<'line>(text: &'line str, columns: &[Column], separator: Separator) -> Result<Fields<'line>, Rejection> {
    let values: Vec<&str> = match separator {
        Separator::Comma => text.split(',').map(str::trim).collect(),
        Separator::Semicolon => text.split(';').map(str::trim).collect(),
        Separator::Tab => text.split('\t').map(str::trim).collect(),
        Separator::Spaces => text.split_whitespace().collect(),
    };
    if values.len() != columns.len() {
        let (found, wanted) = (values.len(), columns.len());
        return Err(Rejection::Garbled(format!("{found} columns instead of {wanted} in `{}`", excerpt(text))));
    }
    let mut fields = Fields::default();
    for (column, &value) in columns.iter().zip(&values) {
        match column {
            Column::Literal(literal) if literal != value => {
                return Err(Rejection::Garbled(format!("`{}` instead of `{literal}`", excerpt(value))));
            }
            _ => {
                if let Some(group) = column.group() {
                    fields.set(group, value);
                }
            }
        }
    }
    Ok(fields)
}

fn matched<'line>(text: &'line str, pattern: &Regex) -> Result<Fields<'line>, Rejection> {
    let mut all = pattern.captures_iter(text.as_bytes());
    let Some(captures) = all.next() else {
        return Err(Rejection::Garbled(format!("`{}` does not match the pattern", excerpt(text))));
    };
    if all.next().is_some() {
        return Err(Rejection::Garbled(format!("`{}` matches the pattern twice", excerpt(text))));
    }
    let mut fields = Fields::default();
    for group in pattern.capture_names().flatten() {
        if let Some(value) = captures.name(group) {
            // A pattern on bytes may split a character.
            let cut = || Rejection::Garbled(format!("`{group}` in `{}` is not text", excerpt(text)));
            let value = text.get(value.range()).ok_or_else(cut)?;
            fields.set(group, value.trim());
        }
    }
    Ok(fields)
}

impl<'line> Fields<'line> {
    fn set(&mut self, group: &str, value: &'line str) {
        let [x, y, z] = &mut self.point;
        let [sx, sy, sz] = &mut self.sigmas;
        let field = match group {
            "name" => &mut self.name,
            "x" => x,
            "y" => y,
            "z" => z,
            "sigma" => &mut self.sigma,
            "sx" => sx,
            "sy" => sy,
            "sz" => sz,
            "time" => &mut self.time,
            "status" => &mut self.status,
            _ => return,
        };
        *field = Some(value);
    }

    fn into_shot(self, options: &AsciiOptions, line: &[u8]) -> Result<Shot, Rejection> {
        // Check the status first: with an invalid one the numbers may be anything.
        if let Some(status) = self.status
            && !options.valid_statuses.iter().any(|valid| valid == status)
        {
            return Err(Rejection::NoPoint(format!("the status of the point is `{}`", excerpt(status))));
        }
        let metres = options.unit.metres();
        let [x, y, z] = self.point.map(|text| coordinate(text, options));
        let point = Point3::new(x? * metres, y? * metres, z? * metres);
        check_point(&point, options.range_mm * 1e-3)?;
        let mut shot = Shot::bare(point);
        shot.sigma = self.stated_sigma(options)?;
        shot.instrument_time =
            self.time.map(|text| time(text, options.decimal_sign)).transpose().map_err(Rejection::Garbled)?;
        let name = self.name.filter(|name| !name.is_empty()).map(excerpt);
        shot.remarks.extend(name.map(|text| Status { severity: Severity::Info, text }));
        shot.raw = line.to_vec();
        Ok(shot)
    }

    /// Standard deviations (m); `None` for zero or an empty field, which mean unknown.
    fn stated_sigma(&self, options: &AsciiOptions) -> Result<Option<[f64; 3]>, Rejection> {
        let texts = if self.sigma.is_some() { [self.sigma; 3] } else { self.sigmas };
        let mut sigmas = [0.0; 3];
        for (sigma, text) in sigmas.iter_mut().zip(texts) {
            match text {
                None | Some("") => return Ok(None),
                Some(text) => {
                    *sigma = number(text, options.decimal_sign).map_err(Rejection::Garbled)? * options.unit.metres();
                }
            }
        }
        if sigmas.iter().any(|sigma| *sigma < 0.0) {
            return Err(Rejection::Garbled("a standard deviation is negative".to_owned()));
        }
        Ok(known_sigma(sigmas))
    }
}

/// One coordinate in the unit of the lines.
fn coordinate(text: Option<&str>, options: &AsciiOptions) -> Result<f64, Rejection> {
    let text = text.ok_or_else(|| Rejection::Garbled("a coordinate is missing".to_owned()))?;
    let word = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    if word.starts_with("nan") || word.starts_with("inf") || word.starts_with("1.#") {
        return Err(Rejection::NoPoint(format!("a coordinate is `{}`", excerpt(text))));
    }
    number(text, options.decimal_sign).map_err(Rejection::Garbled)
}

/// Rejects points that no instrument measures: exactly at its origin, or out of range.
fn check_point(point: &Point3<f64>, range: f64) -> Result<(), Rejection> {
    if point.coords.iter().all(|value| *value == 0.0) {
        return Err(Rejection::NoPoint("it is exactly 0, 0, 0, as after a failed measurement".to_owned()));
    }
    let distance = point.coords.norm();
    if distance <= range {
        return Ok(());
    }
    Err(Rejection::NoPoint(format!("it is {distance:.1} m away, beyond the range of {range:.1} m; check the unit")))
}
