//! The arm and its maths: what needs no file, clock, thread or instrument.
//!
//! Kinematics with their parameters, identification from distances, choice of poses, inverse kinematics and compensation, the profile of a
//! robot, and words for people. The library `trupose` builds on this one and offers its modules under the same names.

pub mod checksum;
pub mod compensation;
pub mod geometry;
pub mod identification;
pub mod inverse;
pub mod iso9283;
pub mod kinematics;
pub mod planning;
pub mod profile;
pub mod text;
pub mod units;
