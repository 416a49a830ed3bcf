//! Which column of a file is which column of a table, as people write it: `q1_deg=A1, x_mm=X, …`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::names::{self, Name};
use crate::session::orientation;
use crate::text::{printable, written_as_text};

/// A column of a file: its name, or its place counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The name in the file.
    Named(String),
    /// Its place, written `#3`.
    Place(usize),
}

/// The columns of a file under the names that a table gives them. A list of names alone is that of all columns in their order, with
/// `-` for those to leave out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Columns {
    /// Names of a table (`q1_deg`, `x_mm`, `pose`), each with its source.
    pub mapped: Vec<(String, Source)>,
    /// Number of columns, where all of them are listed.
    pub listed: Option<usize>,
}

written_as_text!(Columns);

/// A list of columns that cannot be understood.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ColumnsError {
    #[error(
        "'{0}' is not a column of a table; write pose, target, time, q1_deg …, x_mm, y_mm, z_mm, x1_mm … or sigma_mm, with the unit at the end"
    )]
    NoColumn(String),
    #[error("column '{0}' is given twice")]
    Twice(String),
    #[error("write either 'q1_deg=A1, …' with the name of every column, or the names of all columns in their order")]
    Mixed,
    #[error("no column is given")]
    Empty,
}

impl FromStr for Columns {
    type Err = ColumnsError;

    fn from_str(text: &str) -> Result<Self, ColumnsError> {
        let items = items(text);
        let with_source = items.iter().filter(|item| item.contains('=')).count();
        if items.is_empty() {
            return Err(ColumnsError::Empty);
        }
        if with_source != 0 && with_source != items.len() {
            return Err(ColumnsError::Mixed);
        }
        let mut mapped: Vec<(String, Source)> = Vec::new();
        for (index, item) in items.iter().enumerate() {
            let (name, source) = match item.split_once('=') {
                Some((name, source)) => (name.trim(), source_of(source.trim())),
                None => (item.as_str(), Source::Place(index + 1)),
            };
            if name == "-" && with_source == 0 {
                continue;
            }
            let name = canonical(name).ok_or_else(|| ColumnsError::NoColumn(printable(name)))?;
            if mapped.iter().any(|(known, _)| *known == name) {
                return Err(ColumnsError::Twice(name));
            }
            mapped.push((name, source));
        }
        Ok(Self { mapped, listed: (with_source == 0).then_some(items.len()) })
    }
}

impl fmt::Display for Columns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(count) = self.listed {
            let name = |index: usize| {
                let found = self.mapped.iter().find(|(_, source)| *source == Source::Place(index + 1));
                found.map_or("-", |(name, _)| name.as_str())
            };
            let names: Vec<&str> = (0..count).map(name).collect();
            return f.write_str(&names.join(","));
        }
        for (index, (name, source)) in self.mapped.iter().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            match source {
                Source::Place(place) => write!(f, "{comma}{name}=#{place}")?,
                Source::Named(source) if source.contains([',', '"', '=']) || source.starts_with('#') => {
                    write!(f, "{comma}{name}=\"{}\"", source.replace('"', "\"\""))?;
                }
                Source::Named(source) => write!(f, "{comma}{name}={source}")?,
            }
        }
        Ok(())
    }
}

/// The parts between the commas outside quotation marks.
fn items(text: &str) -> Vec<String> {
    let mut items = vec![String::new()];
    let mut quoted = false;
    for c in text.chars() {
        if c == '"' {
            quoted = !quoted;
        }
        match items.last_mut() {
            Some(item) if c != ',' || quoted => item.push(c),
            _ => items.push(String::new()),
        }
    }
    items.iter().map(|item| item.trim().to_owned()).filter(|item| !item.is_empty()).collect()
}

fn source_of(text: &str) -> Source {
    if let Some(place) = text.strip_prefix('#').and_then(|place| place.parse().ok()).filter(|place| *place > 0) {
        return Source::Place(place);
    }
    let inner = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    Source::Named(inner.map_or_else(|| text.to_owned(), |inner| inner.replace("\"\"", "\"")))
}

/// The name of a column of a table as the table writes it, if it is one.
fn canonical(name: &str) -> Option<String> {
    let lower = name.to_lowercase();
    let is_text = matches!(lower.as_str(), "pose" | "target" | "time");
    if is_text || orientation::is_column(&lower) || matches!(lower.as_str(), "sigma_rot_deg" | "sigma_rot_rad") {
        return Some(lower);
    }
    let (base, unit) = lower.split_once('_')?;
    let known = names::unit(unit, false).filter(|known| *known == unit)?;
    let is_numbered =
        |letter: &str| base.strip_prefix(letter).is_some_and(|number| matches!(number.parse::<usize>(), Ok(1..=99)));
    let is_length = matches!(known, "mm" | "m" | "um" | "in" | "cm");
    let fits = match base {
        "x" | "y" | "z" | "sigma" => is_length,
        "temperature" => known == "degc",
        _ if ["x", "y", "z"].iter().any(|letter| is_numbered(letter)) => is_length,
        _ => is_numbered("q") && known != "degc",
    };
    fits.then_some(lower)
}

/// Units of columns whose names state none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Units {
    /// `deg` or `rad`.
    pub angle: Option<&'static str>,
    /// `mm`, `m`, `um`, `in` or `cm`.
    pub length: Option<&'static str>,
}

written_as_text!(Units);

impl Units {
    /// The units in a text such as `deg, mm`, `Units: Millimeters` or `[rad; m]`; `None` if it names two of a kind.
    pub(super) fn in_text(text: &str) -> Option<Self> {
        let mut units = Self::default();
        for word in text.to_lowercase().split(|c: char| c.is_whitespace() || ",;:=[]()/".contains(c)) {
            let Some(unit) = names::unit(word, false) else { continue };
            let slot = match unit {
                "deg" | "rad" => &mut units.angle,
                "degc" => continue,
                _ => &mut units.length,
            };
            if slot.is_some_and(|known| known != unit) {
                return None;
            }
            *slot = Some(unit);
        }
        Some(units)
    }
}

impl FromStr for Units {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words = text.split(',').map(str::trim).filter(|word| !word.is_empty());
        let known = words.clone().all(|word| names::unit(word, false).is_some_and(|unit| unit != "degc"));
        let units = Self::in_text(text).filter(|units| known && *units != Self::default());
        units.ok_or_else(|| {
            format!("'{}' are no units; write one for angles and one for lengths, such as 'deg,mm'", printable(text))
        })
    }
}

impl fmt::Display for Units {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units: Vec<&str> = [self.angle, self.length].into_iter().flatten().collect();
        f.write_str(&units.join(","))
    }
}

/// Whether the name states a unit other than that of the column it shall be.
pub(super) fn other_unit(source: &Name, canonical: &str) -> Option<&'static str> {
    let stated = source.unit?;
    let asked = canonical.rsplit_once('_').map_or("", |(_, unit)| unit);
    (!asked.is_empty() && stated != asked).then_some(stated)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_written_as_they_are_read() {
        for text in [
            "q1_deg=A1, q2_deg=A2, x_mm=X, y_mm=\"Y, tracker\", z_mm=#9, pose=Name",
            "pose,q1_rad,-,x_m,y_m,z_m",
            "x1_mm=X1, x2_mm=X2",
        ] {
            let columns: Columns = text.parse().unwrap();
            assert_eq!(columns.to_string(), text);
            assert_eq!(columns.to_string().parse(), Ok(columns));
        }
    }

    #[test]
    fn what_is_no_column_is_refused() {
        for text in
            ["", "q1=A1", "q1_mmm=A1", "q1_deg=A1, x_mm", "q1_deg=A1, q1_deg=A2", "speed=V", "x_deg=X", "sigma_deg=S"]
        {
            assert!(text.parse::<Columns>().is_err(), "{text}");
        }
    }

    #[test]
    fn units_are_named_once() {
        assert_eq!("deg, mm".parse(), Ok(Units { angle: Some("deg"), length: Some("mm") }));
        assert_eq!(Units::in_text("Units: Millimeters"), Some(Units { angle: None, length: Some("mm") }));
        assert_eq!(Units::in_text("mm and inches"), None);
        assert!("furlong".parse::<Units>().is_err() && "".parse::<Units>().is_err());
    }
}
