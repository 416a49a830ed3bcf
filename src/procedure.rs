//! The procedure of a calibration on data in memory: samples in, summary and calibration out ([`identify`]); wishes in, a plan
//! out ([`plan`]). The commands and the wizard run the very same one.
//!
//! It knows no file, clock or terminal: the time of creation, names of files and their hashes come in as data, and what is said
//! on the way goes to a callback. Failures are told as an operator reads them.

pub(crate) mod assess;
pub(crate) mod cell;
pub(crate) mod checks;
pub mod circles;
pub mod deliver;
pub mod identify;
pub mod models;
pub mod plan;
pub mod points;
mod provenance;
pub(crate) mod result;
mod settings;
pub(crate) mod summary;

pub use provenance::input_file;
pub(crate) use provenance::provenance;
pub use settings::EstimationSettings;
pub(crate) use settings::target_parameters;

use crate::error::{ExitStatus, Failure};
use crate::identification::IdentificationError;
use crate::kinematics::JointType;
use crate::profile::Profile;
use crate::session::summary::Warning;

/// The joint types of a profile's arm.
pub fn joint_types(profile: &Profile) -> Vec<JointType> {
    profile.chain().joints().iter().map(|joint| joint.joint_type).collect()
}

/// A warning.
pub(crate) fn warning(code: &str, message: String, blocks_acceptance: bool) -> Warning {
    Warning { code: code.to_owned(), message, blocks_acceptance }
}

/// What an identification error means to the operator.
pub(crate) fn identification_failure(error: &IdentificationError) -> Failure {
    let (status, hint) = match error {
        IdentificationError::RankUnclear { .. } => {
            (ExitStatus::Numerical, "use '--prior expected' (the default), or measure a planned pose set")
        }
        IdentificationError::Mirrored { .. } => (
            ExitStatus::Usage,
            "the instrument's frame is left-handed: reverse the sign of one coordinate axis, or swap two",
        ),
        IdentificationError::Diverged => {
            (ExitStatus::Numerical, "check units, joint signs and row order; use '--prior expected'")
        }
        IdentificationError::NoData => (ExitStatus::Usage, "check '--use': which rows does it leave?"),
        IdentificationError::Cancelled => return Failure::from_error(ExitStatus::Numerical, error),
        _ => (ExitStatus::Usage, "check that profile and table belong to the same robot"),
    };
    Failure::from_error(status, error).hint(hint)
}
