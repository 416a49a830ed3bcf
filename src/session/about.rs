//! What only people know about a calibration, for the report: which arm, in which state, measured with which instrument, by whom.

use std::fmt;
use std::str::FromStr;

use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::text::{names, printable, written_as_text};

/// Details for the report that only people know. Empty: not given.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct About {
    /// Serial number of the arm.
    pub serial: String,
    /// Name of the person who measured.
    pub operator: String,
    /// Place and conditions of the measurement.
    pub site: String,
    /// Controller: type, serial number, software version.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub controller: String,
    /// Options of the controller that change the accuracy, and whether they were on while measuring.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub options: String,
    /// Speed between the poses, and the wait before each reading.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub speed: String,
    /// Motion before the first reading.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub warm_up: String,
    /// Serial number of the instrument.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub instrument_serial: String,
    /// Number of the instrument's calibration certificate, and its laboratory.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub certificate: String,
    /// Last day on which the certificate is valid.
    #[serde(skip_serializing_if = "Option::is_none", with = "day_or_nothing")]
    pub certificate_due: Option<Day>,
    /// Check of the instrument on the day: what was measured, and the result.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub field_check: String,
    /// Reflector: type, serial number, radius.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub smr: String,
    /// Temperature, pressure and humidity that the instrument corrected for.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub weather: String,
}

/// A field of [`About`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    Serial,
    Operator,
    Site,
    Controller,
    Options,
    Speed,
    WarmUp,
    InstrumentSerial,
    Certificate,
    CertificateDue,
    FieldCheck,
    Smr,
    Weather,
}

names!(Detail {
    Serial = "serial",
    Operator = "operator",
    Site = "site",
    Controller = "controller",
    Options = "options",
    Speed = "speed",
    WarmUp = "warm_up",
    InstrumentSerial = "instrument_serial",
    Certificate = "certificate",
    CertificateDue = "certificate_due",
    FieldCheck = "field_check",
    Smr = "smr",
    Weather = "weather",
});

impl Detail {
    /// The name on screens and in reports.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Serial => "serial number",
            Self::Operator => "operator",
            Self::Site => "place and conditions",
            Self::Controller => "controller and software",
            Self::Options => "accuracy options",
            Self::Speed => "speed",
            Self::WarmUp => "warm-up",
            Self::InstrumentSerial => "instrument serial",
            Self::Certificate => "certificate",
            Self::CertificateDue => "certificate valid until",
            Self::FieldCheck => "field check",
            Self::Smr => "reflector (SMR)",
            Self::Weather => "weather",
        }
    }
}

/// Why a text cannot be a detail.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DetailError {
    #[error("{}: at most {} characters", _0.label(), About::LONGEST)]
    TooLong(Detail),
    #[error("{}: {_1}", _0.label())]
    NoDay(Detail, NoDay),
}

impl About {
    /// Longest text (characters).
    pub const LONGEST: usize = 200;

    /// A detail as text; empty: not given.
    pub fn text(&self, detail: Detail) -> String {
        match detail {
            Detail::CertificateDue => self.certificate_due.map_or_else(String::new, |day| day.to_string()),
            Detail::Serial => self.serial.clone(),
            Detail::Operator => self.operator.clone(),
            Detail::Site => self.site.clone(),
            Detail::Controller => self.controller.clone(),
            Detail::Options => self.options.clone(),
            Detail::Speed => self.speed.clone(),
            Detail::WarmUp => self.warm_up.clone(),
            Detail::InstrumentSerial => self.instrument_serial.clone(),
            Detail::Certificate => self.certificate.clone(),
            Detail::FieldCheck => self.field_check.clone(),
            Detail::Smr => self.smr.clone(),
            Detail::Weather => self.weather.clone(),
        }
    }

    /// Changes a detail to a text, without the blanks around it.
    pub fn set(&mut self, detail: Detail, text: &str) -> Result<(), DetailError> {
        let text = text.trim();
        if text.chars().count() > Self::LONGEST {
            return Err(DetailError::TooLong(detail));
        }
        let place = match detail {
            Detail::CertificateDue => {
                let day = if text.is_empty() { None } else { Some(text.parse()) };
                self.certificate_due = day.transpose().map_err(|error| DetailError::NoDay(detail, error))?;
                return Ok(());
            }
            Detail::Serial => &mut self.serial,
            Detail::Operator => &mut self.operator,
            Detail::Site => &mut self.site,
            Detail::Controller => &mut self.controller,
            Detail::Options => &mut self.options,
            Detail::Speed => &mut self.speed,
            Detail::WarmUp => &mut self.warm_up,
            Detail::InstrumentSerial => &mut self.instrument_serial,
            Detail::Certificate => &mut self.certificate,
            Detail::FieldCheck => &mut self.field_check,
            Detail::Smr => &mut self.smr,
            Detail::Weather => &mut self.weather,
        };
        text.clone_into(place);
        Ok(())
    }

    /// The details that are given, with their names.
    pub fn given(&self) -> impl Iterator<Item = (Detail, String)> + '_ {
        Detail::ALL.iter().map(|detail| (*detail, self.text(*detail))).filter(|(_, text)| !text.is_empty())
    }

    /// The same without blanks around the texts. An error names a text that is too long.
    pub fn checked(&self) -> Result<Self, DetailError> {
        let mut checked = Self::default();
        for (detail, text) in self.given() {
            checked.set(detail, &text)?;
        }
        Ok(checked)
    }
}

/// A day of the calendar, written `2027-03-31`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Day(Date);

/// A text that is no [`Day`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{_0}' is no day; write for example 2027-03-31")]
pub struct NoDay(String);

impl Day {
    /// The day of a time in UTC.
    pub fn of(time: jiff::Timestamp) -> Self {
        Self(jiff::tz::TimeZone::UTC.to_datetime(time).date())
    }
}

impl fmt::Display for Day {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0.to_string())
    }
}

impl FromStr for Day {
    type Err = NoDay;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.trim().parse().map(Self).map_err(|_not_one| NoDay(printable(text)))
    }
}

written_as_text!(Day);

/// A day as the text that people write, without the `Some` of the file format; an empty text is none.
mod day_or_nothing {
    use std::borrow::Cow;

    use serde::de::{Deserialize as _, Deserializer, Error as _};
    use serde::{Serialize as _, Serializer};

    use super::Day;

    #[expect(clippy::ref_option, clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
    pub(super) fn serialize<S: Serializer>(day: &Option<Day>, serializer: S) -> Result<S::Ok, S::Error> {
        day.map_or_else(String::new, |day| day.to_string()).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Day>, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        if text.trim().is_empty() { Ok(None) } else { text.parse().map(Some).map_err(D::Error::custom) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_detail_is_set_and_read_by_its_name() {
        let mut about = About::default();
        for detail in Detail::ALL {
            let text = if *detail == Detail::CertificateDue { "2027-03-31".to_owned() } else { detail.to_string() };
            about.set(*detail, &format!(" {text} ")).unwrap();
            assert_eq!(about.text(*detail), text);
        }
        assert_eq!(about.given().count(), Detail::ALL.len());
        let written = ron::to_string(&about).unwrap();
        for detail in Detail::ALL {
            assert!(written.contains(&format!("{detail}:")), "{detail} is no field: {written}");
        }
        assert_eq!(ron::from_str(&written), Ok(about));
    }

    #[test]
    fn details_of_earlier_versions_are_read_and_written_alike() {
        let text = r#"(serial:"R-17",operator:"",site:"cell 4")"#;
        let about: About = ron::from_str(text).unwrap();
        assert_eq!((about.serial.as_str(), about.certificate_due), ("R-17", None));
        assert_eq!(ron::to_string(&about).unwrap(), text);
        let with_day: About = ron::from_str(r#"(certificate_due: "2027-03-31")"#).unwrap();
        assert_eq!(with_day.certificate_due.unwrap().to_string(), "2027-03-31");
        assert_eq!(ron::from_str::<About>(r#"(certificate_due: "")"#), Ok(About::default()));
    }

    #[test]
    fn a_day_is_checked_and_a_long_text_refused() {
        let mut about = About::default();
        let error = about.set(Detail::CertificateDue, "next year").unwrap_err();
        assert_eq!(error.to_string(), "certificate valid until: 'next year' is no day; write for example 2027-03-31");
        assert!(about.set(Detail::CertificateDue, "2027-02-30").is_err());
        let error = about.set(Detail::Smr, &"x".repeat(About::LONGEST + 1)).unwrap_err();
        assert_eq!(error.to_string(), "reflector (SMR): at most 200 characters");
        about.set(Detail::CertificateDue, "").unwrap();
        assert_eq!(about, About::default());
    }

    #[test]
    fn days_are_in_order() {
        let due: Day = "2026-01-05".parse().unwrap();
        let at = |time: &str| Day::of(time.parse().unwrap());
        assert!(at("2026-01-05T23:59:00Z") <= due && at("2026-01-06T00:00:00Z") > due);
    }
}
