//! `calibration.ron`: the result of an identification, complete enough to be used without any other file.
//!
//! It carries the text of the profile it was made with, so the nominal robot cannot drift away from its deviations.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::summary::{IdentificationSettings, ParameterSummary, Provenance, SigmaSummary, Verdict};
use crate::units::{from_mm, to_mm};

/// Version of the layout.
pub const SCHEMA: u32 = 1;

/// A pose in the file: position in mm, unit quaternion as (x, y, z, w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseText {
    /// Position.
    pub xyz_mm: (f64, f64, f64),
    /// Orientation.
    pub quaternion_xyzw: (f64, f64, f64, f64),
}

impl From<&Isometry3<f64>> for PoseText {
    fn from(pose: &Isometry3<f64>) -> Self {
        let position = pose.translation.vector.map(to_mm);
        let q = pose.rotation.coords;
        Self { xyz_mm: (position.x, position.y, position.z), quaternion_xyzw: (q.x, q.y, q.z, q.w) }
    }
}

impl From<&PoseText> for Isometry3<f64> {
    fn from(text: &PoseText) -> Self {
        let (x, y, z) = text.xyz_mm;
        let (i, j, k, w) = text.quaternion_xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Self::from_parts(Translation3::new(from_mm(x), from_mm(y), from_mm(z)), rotation)
    }
}

/// An identified robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this layout.
    pub schema: u32,
    /// Where it comes from.
    pub provenance: Provenance,
    /// How it was identified.
    pub settings: IdentificationSettings,
    /// Measurement σ.
    pub sigma: SigmaSummary,
    /// The verdict at that time.
    pub verdict: Verdict,
    /// Independent combinations that the data determined.
    pub rank: Option<usize>,
    /// Nominal, deviation and σ of every free parameter.
    pub parameters: Vec<ParameterSummary>,
    /// Pose of the instrument in the base of the identified arm; none for data without coordinates.
    pub base_from_station: Option<PoseText>,
    /// Pose of the instrument in the base of the nominal arm with its own registration.
    pub nominal_base_from_station: Option<PoseText>,
    /// Target coordinates in the flange of the nominal arm with its own fit (mm), one per target.
    pub nominal_targets_mm: Vec<(f64, f64, f64)>,
    /// The profile, as it was read.
    pub profile: String,
}

/// A calibration file that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Not RON, or not a calibration.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// Written by a newer program.
    #[error(
        "schema {found} is newer than this program understands ({SCHEMA}); use the version that wrote it: {program}"
    )]
    Schema {
        /// Version found.
        found: u32,
        /// Program that wrote it.
        program: String,
    },
    /// A number that is not finite.
    #[error("parameter '{parameter}' has a number that is not finite")]
    NotFinite {
        /// Name of the parameter.
        parameter: String,
    },
}

impl Calibration {
    /// The text of the file.
    ///
    /// # Errors
    /// The serialiser refuses; this is a defect.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        // Raw strings keep the profile readable inside the calibration.
        let layout = ron::ser::PrettyConfig::new().indentor("    ".to_owned()).escape_strings(false);
        let text = ron::ser::to_string_pretty(self, layout)?;
        Ok(format!("// Calibration of '{}' by {}.\n{text}\n", self.provenance.profile, self.provenance.program))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// Not a calibration, of a newer schema, or with numbers that are not finite.
    pub fn parse(text: &str) -> Result<Self, CalibrationError> {
        let calibration: Self = ron::from_str(text).map_err(|error| CalibrationError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            message: error.code.to_string(),
        })?;
        if calibration.schema > SCHEMA {
            let program = calibration.provenance.program.clone();
            return Err(CalibrationError::Schema { found: calibration.schema, program });
        }
        for parameter in &calibration.parameters {
            if !(parameter.nominal.is_finite() && parameter.deviation.is_finite()) {
                return Err(CalibrationError::NotFinite { parameter: parameter.name.clone() });
            }
        }
        Ok(calibration)
    }
}
