//! trupose: guided kinematic calibration of industrial robot arms from measured distances.

pub mod kinematics;
pub mod profile;
pub mod units;
