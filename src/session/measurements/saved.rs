//! A layout under a name, so that the next table of the same program needs no list of columns.

use serde::{Deserialize, Serialize};

use super::columns::{Columns, Units};
use super::foreign::Reading;

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
}

impl SavedLayout {
    /// Present version of the format.
    const SCHEMA: u32 = 1;

    /// What a person said about a table.
    pub fn new(reading: &Reading) -> Self {
        let Reading { columns, units, skip_missing } = reading.clone();
        let units = Some(units).filter(|units| *units != Units::default());
        Self { schema: Self::SCHEMA, columns, units, skip_missing }
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
        Ok(Reading { columns: saved.columns, units: saved.units.unwrap_or_default(), skip_missing: saved.skip_missing })
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
        };
        for reading in [reading, Reading::default()] {
            let text = SavedLayout::new(&reading).to_text().unwrap();
            assert_eq!(SavedLayout::parse(&text), Ok(reading), "{text}");
        }
        assert!(SavedLayout::parse("(schema: 2)").is_err() && SavedLayout::parse("(schema: 1, colums: None)").is_err());
    }
}
