//! Settings of the GeoCOM driver.

use serde::Deserialize;
use serde::Serialize;

/// Settings, as a profile carries them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GeocomOptions {
    /// Which calls make a measurement.
    pub measurement: Measurement,
    /// Whether every message carries a CRC.
    pub checksum: bool,
    /// Switches automatic target recognition on or off; without it the instrument is left as it is.
    pub target_recognition: Option<bool>,
    /// EDM mode to set, by the instrument's own number; without it the instrument is left as it is.
    pub edm_mode: Option<u16>,
    /// Prism constant to set (mm); without it the instrument is left as it is.
    pub prism_constant_mm: Option<f64>,
    /// How far the fine adjustment searches to each side (degree).
    pub search_deg: f64,
    /// How long a measurement may take (s).
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

/// Which calls make a measurement.
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
    /// Whether a driver can work with these settings; if not, why.
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
