//! trupose: guided kinematic calibration of industrial robot arms from measured distances.

pub mod app;
pub mod cli;
pub mod error;
pub mod geometry;
pub mod identification;
pub mod kinematics;
pub mod profile;
pub mod report;
pub mod session;
pub mod store;
pub mod units;
