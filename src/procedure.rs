//! The procedures of a calibration on data in memory, shared by the commands and the wizard: [`identify`] turns samples into a
//! summary and a calibration, [`plan`] turns a request into a plan.
//!
//! They know no file, clock or terminal: the time of creation, file names and hashes come in as data, and progress goes to a
//! callback. Errors are typed, and so is the [`Advice`] about errors and warnings; the caller puts it into words.
//!
//! [`Advice`]: crate::session::advice::Advice

pub(crate) mod assess;
pub mod bodies;
pub(crate) mod cell;
pub(crate) mod checks;
pub mod circles;
pub mod compare;
pub mod correct;
pub mod dangers;
pub mod deliver;
mod error;
pub mod health;
pub mod identify;
mod intervals;
pub mod iso9283;
pub mod joint_check;
mod joint_errors;
pub mod known;
pub mod measured_arm;
pub mod models;
pub mod plan;
pub mod points;
mod poses;
mod provenance;
pub mod recalibrate;
mod result;
mod settings;
mod summary;
pub mod way;
mod workspace;

pub use error::{ErrorKind, ProcedureError};
pub use provenance::input_file;
pub(crate) use provenance::provenance;
pub use settings::EstimationSettings;
pub(crate) use settings::target_parameters;
pub use summary::SampleName;

use crate::kinematics::JointType;
use crate::profile::Profile;

/// The joint types of a profile's arm.
pub fn joint_types(profile: &Profile) -> Vec<JointType> {
    profile.chain().joints().iter().map(|joint| joint.joint_type).collect()
}
