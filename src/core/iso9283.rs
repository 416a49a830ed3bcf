//! The position part of ISO 9283 (1998): figures of a robot's accuracy and repeatability, and the cube they are measured in.
//!
//! Attained points come from a tracker, commanded points from a model of the arm, both in the base (m). Figures that compare
//! attained points with each other (repeatability, variation with the direction, distances) need no frame: they are the same
//! wherever the tracker stands.
//!
//! Every estimate has a 95 % interval: percentiles of a bootstrap over the cycles (Efron 1979), with a fixed seed.

#![warn(missing_docs)]

mod cube;
mod figures;
mod label;

pub use cube::{Cube, EDGES, MeasuringPlane, POSES};
pub use figures::{
    DistanceFigures, Estimate, FEWEST, PoseFigures, barycentre, distance_figures, drift, multi_directional_variation,
    pose_figures,
};
pub use label::{DIRECTIONS, Label, UnknownLabel};

/// Cycles of a test.
pub const CYCLES: usize = 30;
