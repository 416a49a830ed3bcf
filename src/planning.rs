//! Pose planning: which configurations are worth measuring, which of them can be measured, and in which order.
//!
//! Metres and radians; points in the robot base unless a name says otherwise; a configuration is the pendant joint vector.
//! Nothing here reads a file or a clock, draws unseeded random numbers or knows robot profiles: the cell comes in as the
//! plain [`Cell`].

pub mod candidates;
mod cell;
pub mod collision;
pub mod order;
pub mod verification_set;
pub mod visibility;

pub use cell::{Body, BoxInBase, Cell, CellError, KeepOutBox, MountedTarget, TrackerStand};
