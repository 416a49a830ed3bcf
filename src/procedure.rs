//! The procedure of a calibration on data in memory: samples in, summary and calibration out ([`identify`]); wishes in, a plan
//! out ([`plan`]). The commands and the wizard run the very same one.
//!
//! It knows no file, clock or terminal: the time of creation, names of files and their hashes come in as data, and what is said
//! on the way goes to a callback. Errors are typed; what can be done about them and about warnings is typed [`Advice`], which
//! whoever runs a procedure puts into words.
//!
//! [`Advice`]: crate::session::advice::Advice

pub(crate) mod assess;
pub(crate) mod cell;
pub(crate) mod checks;
pub mod circles;
pub mod deliver;
mod error;
pub mod identify;
pub mod models;
pub mod plan;
pub mod points;
mod provenance;
pub(crate) mod result;
mod settings;
pub(crate) mod summary;

pub use error::{ErrorKind, ProcedureError};
pub use provenance::input_file;
pub(crate) use provenance::provenance;
pub use settings::EstimationSettings;
pub(crate) use settings::target_parameters;

use crate::kinematics::JointType;
use crate::profile::Profile;

/// The joint types of a profile's arm.
pub fn joint_types(profile: &Profile) -> Vec<JointType> {
    profile.chain().joints().iter().map(|joint| joint.joint_type).collect()
}
