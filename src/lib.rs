//! trupose: guided kinematic calibration of industrial robot arms from measured distances.

pub mod geometry;
pub mod identification;
pub mod kinematics;
pub mod planning;
pub mod profile;
pub mod runtime;
pub mod session;
pub mod units;
