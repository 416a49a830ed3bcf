//! Options of the GeoCOM driver.

use serde::Deserialize;
use serde::Serialize;

/// Options of the GeoCOM driver, as a profile states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GeocomOptions {
    /// The calls that make a measurement.
    pub measurement: Measurement,
    /// Whether every message has a CRC.
    pub checksum: bool,
    /// Switch automatic target recognition on or off; `None` leaves the instrument unchanged.
    pub target_recognition: Option<bool>,
    /// EDM mode to set, by the instrument's number; `None` leaves the instrument unchanged.
    pub edm_mode: Option<u16>,
    /// Prism constant to set (mm); `None` leaves the instrument unchanged.
    pub prism_constant_mm: Option<f64>,
    /// Search range of the fine adjustment to each side (degree).
    pub search_deg: f64,
    /// Time limit of a measurement (s).
    pub timeout_s: f64,
}

impl Default for GeocomOptions {
    fn default() -> Self {
        Self {
            measurement: Measurement::FineAdjust,
            checksum: false,
            target_recognition: None,
            edm_mode: None,
            prism_constant_mm: None,
            search_deg: 1.0,
            timeout_s: 60.0,
        }
    }
}

/// The calls that make a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measurement {
    /// `AUT_FineAdjust`, then `BAP_MeasDistanceAngle`: needs target recognition.
    FineAdjust,
    /// `BAP_MeasDistanceAngle` alone.
    DistanceAngle,
    /// `TMC_DoMeasure`, then `TMC_GetSimpleMea`: for instruments without motors.
    Simple,
}

impl GeocomOptions {
    /// Fails with the reason if the driver cannot use these options.
    pub fn validate(&self) -> Result<(), String> {
        if !(self.search_deg > 0.0 && self.search_deg <= 90.0) {
            return Err(format!("search_deg is {}: use above 0 to 90", self.search_deg));
        }
        if !(1.0..=600.0).contains(&self.timeout_s) {
            return Err(format!("timeout_s is {}: use 1 to 600", self.timeout_s));
        }
        match self.prism_constant_mm {
            Some(constant) if !(-1000.0..=1000.0).contains(&constant) => {
                Err(format!("prism_constant_mm is {constant}: use -1000 to 1000"))
            }
            _ => Ok(()),
        }
    }
}
