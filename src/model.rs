//! Models of an arm in other formats: import of URDF, export of corrected models.
//!
//! An export is written, read back from its own text, and compared with the identified arm at 1,000 random configurations
//! ([`proof`]); a text that is off by more than 1 µm or 1 µrad anywhere is refused. Text in, text out: this module knows no files.

mod corrections;
mod export;
mod factory;
mod import;
mod profile_text;
pub mod proof;
mod tables;
mod transforms;
mod urdf;
mod urdf_text;
mod urdf_write;

use thiserror::Error;

pub use export::{CalibratedArm, Export, ExportOptions, Format, GivenUrdf, export};
pub use factory::{FactoryArm, read_factory};
pub use import::{Coupling, ImportedArm, import, import_coupled};
pub use profile_text::{Arm, Heading, complete, geometry_only};
pub use transforms::{from_roll_pitch_yaw, link_values, roll_pitch_yaw};
pub use urdf::{Urdf, UrdfChain, UrdfError, UrdfJoint, UrdfJointType};
pub use urdf_text::decode_xml;
pub use urdf_write::fresh as urdf_text;

use crate::kinematics::KinematicsError;

/// Why there is no model.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ModelError {
    /// The written model differs from the arm.
    #[error("the written model differs from the arm by {position_mm:.6} mm and {angle_deg:.6} deg; nothing is written")]
    Differs {
        /// Distance between the two flanges (mm).
        position_mm: f64,
        /// Angle between them (degree).
        angle_deg: f64,
    },
    /// An unusable URDF.
    #[error(transparent)]
    Urdf(#[from] UrdfError),
    /// A geometry without a valid chain.
    #[error(transparent)]
    Geometry(#[from] KinematicsError),
    /// A flange that the UR kinematics file cannot carry.
    #[error(
        "the file cannot express the flange offset from axis 6: {offset} (alpha6, a6). Let the tool carry it, or fix alpha6 and a6 \
         in the profile and identify again"
    )]
    FlangeOffset {
        /// Pose of the flange beside axis 6, in words.
        offset: String,
    },
    /// The arm does not fit the format.
    #[error("{0}")]
    Unsuitable(String),
    /// A written text that cannot be read back.
    #[error("the written model cannot be read back: {0}; nothing is written")]
    ReadBack(String),
}
