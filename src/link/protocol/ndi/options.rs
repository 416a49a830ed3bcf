//! Options of the NDI driver.

use serde::Deserialize;
use serde::Serialize;

/// Options of the NDI driver, as a profile states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NdiOptions {
    /// Format of the positions.
    pub reply: ReplyFormat,
    /// Port handle of the tool; required if there are several tools.
    pub handle: Option<u8>,
    /// Measured point in the frame of the tool (mm).
    pub tip_mm: [f64; 3],
    /// Time limit of an answer, or of a new frame (s).
    pub timeout_s: f64,
}

impl Default for NdiOptions {
    fn default() -> Self {
        Self { reply: ReplyFormat::Binary, handle: None, tip_mm: [0.0; 3], timeout_s: 2.0 }
    }
}

/// Format of the positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReplyFormat {
    /// `TX`: text, to 0.01 mm.
    Text,
    /// `BX`: binary, in single precision.
    Binary,
}

impl NdiOptions {
    /// Fails with the reason if the driver cannot use these options.
    pub fn validate(&self) -> Result<(), String> {
        if self.tip_mm.iter().any(|value| !(-10_000.0..=10_000.0).contains(value)) {
            return Err("tip_mm: every coordinate must be within -10000 to 10000".to_owned());
        }
        if !(0.1..=60.0).contains(&self.timeout_s) {
            return Err(format!("timeout_s is {}: use 0.1 to 60", self.timeout_s));
        }
        Ok(())
    }
}
