//! A layout under a name, so that the next table of the same program needs no list of columns.

use serde::{Deserialize, Serialize};

use super::columns::{Columns, Units};
use super::foreign::Reading;
use crate::units::{from_deg, from_mm, to_deg, to_mm};

/// End of the names of layout files.
const ENDING: &str = ".layout.ron";

/// A layout file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedLayout {
    /// Version of the format.
    schema: u32,
    /// Which column is which.
    #[serde(default)]
    columns: Option<Columns>,
    /// Units of columns whose names state none, such as `deg,mm`.
    #[serde(default)]
    units: Option<Units>,
    /// Whether readings without a point are left out.
    #[serde(default)]
    skip_missing: bool,
    /// Standard deviation of each coordinate where a pose states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_mm: Option<f64>,
    /// Standard deviation of the orientation about each axis where a pose states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_rot_deg: Option<f64>,
}

impl SavedLayout {
    /// Present version of the format.
    const SCHEMA: u32 = 1;

    /// What a person said about a table.
    pub fn new(reading: &Reading) -> Self {
        let Reading { columns, units, skip_missing, sigma, sigma_rotation } = reading.clone();
        Self {
            schema: Self::SCHEMA,
            columns,
            units: Some(units).filter(|units| *units != Units::default()),
            skip_missing,
            sigma_mm: sigma.map(to_mm),
            sigma_rot_deg: sigma_rotation.map(to_deg),
        }
    }

    /// The name of the file of a layout.
    pub fn file_name(name: &str) -> String {
        format!("{name}{ENDING}")
    }

    /// The layout as text.
    ///
    /// # Errors
    /// Nothing that is known.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let text = ron::ser::to_string_pretty(self, ron::ser::PrettyConfig::default())?;
        Ok(format!("// Columns of a measurement table, for 'trupose'.\n{text}\n"))
    }

    /// Reads such a text.
    ///
    /// # Errors
    /// Not a layout of this version.
    pub fn parse(text: &str) -> Result<Reading, String> {
        let saved: Self = ron::from_str(text).map_err(|error| error.to_string())?;
        if saved.schema != Self::SCHEMA {
            return Err(format!("it is of version {}, and this program reads version {}", saved.schema, Self::SCHEMA));
        }
        let positive = |value: Option<f64>| value.is_none_or(|value| value.is_finite() && value > 0.0);
        if !positive(saved.sigma_mm) || !positive(saved.sigma_rot_deg) {
            return Err("a standard deviation must be positive".to_owned());
        }
        Ok(Reading {
            columns: saved.columns,
            units: saved.units.unwrap_or_default(),
            skip_missing: saved.skip_missing,
            sigma: saved.sigma_mm.map(from_mm),
            sigma_rotation: saved.sigma_rot_deg.map(from_deg),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_is_read_as_it_was_written() {
        let reading = Reading {
            columns: Some("q1_deg=A1, x_mm=\"X, mm\"".parse().unwrap()),
            units: "deg,mm".parse().unwrap(),
            skip_missing: true,
            sigma: Some(25e-6),
            sigma_rotation: Some(0.5),
        };
        for reading in [reading, Reading::default()] {
            let text = SavedLayout::new(&reading).to_text().unwrap();
            assert_eq!(SavedLayout::parse(&text), Ok(reading), "{text}");
        }
        assert!(SavedLayout::parse("(schema: 2)").is_err() && SavedLayout::parse("(schema: 1, colums: None)").is_err());
    }
}
