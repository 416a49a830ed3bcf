//! One line to one reading, or the reason why not.

use nalgebra::Point3;
use regex::bytes::Regex;
use thiserror::Error;

use super::super::Shot;
use super::super::crc::crc16_arc;
use super::super::crc::nmea_xor;
use super::super::known_sigma;
use super::super::text::shown;
use super::number::number;
use super::number::time;
use super::options::AsciiOptions;
use super::options::Checksum;
use super::options::Column;
use super::options::Layout;
use super::options::Separator;
use super::options::compile;

/// What a line said.
#[derive(Clone, Debug, PartialEq)]
pub enum Reading {
    /// A comment, or another line that was to be skipped.
    Skipped,
    /// A point.
    Point(Shot),
}

/// Why a line gives no point.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Rejection {
    /// It has another form: cut, joined, other separator, noise.
    #[error("{0}")]
    Garbled(String),
    /// It says that there is no point.
    #[error("{0}")]
    NoPoint(String),
    /// An error text of the instrument.
    #[error("{0}")]
    Instrument(String),
}

/// Reads lines by the settings.
#[derive(Debug)]
pub struct LineParser {
    options: AsciiOptions,
    layout: Option<Regex>,
    error: Option<Regex>,
    ignore: Option<Regex>,
}

impl LineParser {
    /// Fails like [`AsciiOptions::validate`].
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

    /// The settings.
    pub const fn options(&self) -> &AsciiOptions {
        &self.options
    }

    /// Reads a line without its end.
    pub fn read(&self, line: &[u8]) -> Result<Reading, Rejection> {
        let decoded = decode(line);
        let text = decoded.trim();
        if text.is_empty() || self.options.comment_prefix.as_ref().is_some_and(|prefix| text.starts_with(prefix)) {
            return Ok(Reading::Skipped);
        }
        // An error text may well come without the check value that points have.
        let is_error = |text: &str| self.error.as_ref().is_some_and(|error| error.is_match(text.as_bytes()));
        if is_error(text) {
            return Err(Rejection::Instrument(shown(text)));
        }
        let is_latin = std::str::from_utf8(line).is_err();
        let body = self.checked(text, is_latin)?;
        let read = self.fields(body).and_then(|fields| fields.into_shot(&self.options, line));
        match read {
            Err(Rejection::Garbled(_))
                if self.ignore.as_ref().is_some_and(|ignore| ignore.is_match(text.as_bytes())) =>
            {
                Ok(Reading::Skipped)
            }
            other => other.map(Reading::Point),
        }
    }

    /// The line without its check value.
    fn checked<'line>(&self, text: &'line str, is_latin: bool) -> Result<&'line str, Rejection> {
        let (body, stated, right) = match self.options.checksum {
            Checksum::None => return Ok(text),
            Checksum::Nmea => {
                let Some((body, stated)) = text.rsplit_once('*') else {
                    return Err(Rejection::Garbled("the check value after `*` is missing".to_owned()));
                };
                let body = body.strip_prefix('$').unwrap_or(body);
                (body, stated, format!("{:02X}", nmea_xor(&encoded(body, is_latin))))
            }
            Checksum::Crc16 => {
                let Some((body, stated)) = text.len().checked_sub(4).and_then(|at| text.split_at_checked(at)) else {
                    return Err(Rejection::Garbled("the line is too short for its check value".to_owned()));
                };
                (body, stated, format!("{:04X}", crc16_arc(&encoded(body, is_latin))))
            }
        };
        if stated.eq_ignore_ascii_case(&right) {
            return Ok(body.trim_end_matches([',', ';', ' ', '\t']));
        }
        Err(Rejection::Garbled(format!("the check value is `{}`, but the line gives {right}", shown(stated))))
    }

    fn fields<'line>(&self, text: &'line str) -> Result<Fields<'line>, Rejection> {
        match (&self.options.layout, &self.layout) {
            (Layout::Columns(columns), _) => separated(text, columns, self.options.separator),
            (Layout::Regex(_), Some(pattern)) => matched(text, pattern),
            (Layout::Regex(_), None) => Err(Rejection::Garbled("the pattern is missing".to_owned())),
        }
    }
}

/// UTF-8, or else Latin-1, where every byte is a character.
fn decode(line: &[u8]) -> String {
    std::str::from_utf8(line).map_or_else(|_| line.iter().copied().map(char::from).collect(), str::to_owned)
}

/// The bytes that [`decode`] made the text of.
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
        return Err(Rejection::Garbled(format!("{found} columns instead of {wanted} in `{}`", shown(text))));
    }
    let mut fields = Fields::default();
    for (column, &value) in columns.iter().zip(&values) {
        match column {
            Column::Literal(literal) if literal != value => {
                return Err(Rejection::Garbled(format!("`{}` stands where `{literal}` should", shown(value))));
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
        return Err(Rejection::Garbled(format!("`{}` does not match the pattern", shown(text))));
    };
    if all.next().is_some() {
        return Err(Rejection::Garbled(format!("`{}` matches the pattern twice", shown(text))));
    }
    let mut fields = Fields::default();
    for group in pattern.capture_names().flatten() {
        if let Some(value) = captures.name(group) {
            // A pattern of bytes may cut a character in two.
            let cut = || Rejection::Garbled(format!("`{group}` in `{}` is no text", shown(text)));
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
        // The status first: beside an invalid one the numbers may be anything.
        if let Some(status) = self.status
            && !options.valid_statuses.iter().any(|valid| valid == status)
        {
            return Err(Rejection::NoPoint(format!("the status of the point is `{}`", shown(status))));
        }
        let metres = options.unit.metres();
        let [x, y, z] = self.point.map(|text| coordinate(text, options));
        let point = Point3::new(x? * metres, y? * metres, z? * metres);
        check_point(&point, options.range_mm * 1e-3)?;
        let mut shot = Shot::bare(point);
        shot.sigma = self.stated_sigma(options)?;
        shot.instrument_time =
            self.time.map(|text| time(text, options.decimal_sign)).transpose().map_err(Rejection::Garbled)?;
        shot.remark = self.name.filter(|name| !name.is_empty()).map(shown);
        shot.raw = line.to_vec();
        Ok(shot)
    }

    /// Standard deviations (m). Zero or nothing means that the instrument does not know it.
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
        return Err(Rejection::NoPoint(format!("a coordinate is `{}`", shown(text))));
    }
    number(text, options.decimal_sign).map_err(Rejection::Garbled)
}

/// Refuses what no instrument measures: exactly its own origin, or farther than it can see.
fn check_point(point: &Point3<f64>, range: f64) -> Result<(), Rejection> {
    if point.coords.iter().all(|value| *value == 0.0) {
        return Err(Rejection::NoPoint("it is exactly 0, 0, 0, which means a failed measurement".to_owned()));
    }
    let distance = point.coords.norm();
    if distance <= range {
        return Ok(());
    }
    Err(Rejection::NoPoint(format!(
        "it is {distance:.1} m away, farther than the {range:.1} m set as the range; check the unit"
    )))
}
