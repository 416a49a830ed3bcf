//! Links to instruments: whatever can be asked for the place of the SMR.
//!
//! A link knows wires, files or a simulation, never why it is asked. It gives a reading only on an explicit success; everything
//! else is a [`LinkError`]. Points are in the frame of the instrument (m), configurations are pendant values (rad, sliding
//! joints m).

mod build;
mod cell_view;
pub mod protocol;
mod rehearsal;
mod replay;
mod robot;
mod serve;
mod simulated;
pub mod simulator;
#[cfg(test)]
mod tests;
mod transport;
mod wire;
mod wired;

use std::time::Duration;

use thiserror::Error;

pub use rehearsal::Rehearsal;
pub use replay::{Replay, ReplayRow};
pub use robot::WiredRobot;
pub use serve::Served;
pub use simulated::{HiddenArm, SimulatedCell};
pub use wire::RawLog;
pub use wired::Wired;

use crate::session::reading::{LiveReading, MeasureRequest, Reading};

/// Something that measures.
pub trait Link: Send {
    /// What answers at the other end, in one line.
    ///
    /// # Errors
    /// Nothing usable answers.
    fn connect(&mut self) -> Result<String, LinkError>;

    /// Measures the target. Blocks; `keep_going` is asked at least ten times a second of real time and ends it with
    /// [`LinkError::Cancelled`] once it says no.
    ///
    /// # Errors
    /// There is no reading.
    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError>;

    /// What there is to see while nothing is measured, and what has happened; takes up to `wait`. `None`: this link has nothing
    /// to show between measurements, and does not wait.
    fn watch(&mut self, _wait: Duration) -> Option<(LiveReading, Vec<LinkNews>)> {
        None
    }

    /// A look at the same while something is measured, by whoever is asked whether to go on.
    fn eye(&self) -> Option<Look> {
        None
    }
}

/// What there is to see now.
pub type Look = Box<dyn Fn() -> LiveReading>;

/// Something that happened at a link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkNews {
    /// It is set up, for the first time or again: who answers.
    Up(String),
    /// It is lost and will be tried again: why.
    Down(String),
    /// The operator should know.
    Status(String),
}

/// Why there is no reading.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LinkError {
    /// The instrument sees no reflector.
    #[error("the beam is broken: the tracker sees no SMR")]
    BeamBroken,
    /// Recorded data have no reading for the pose.
    #[error("'{file}' has no reading for pose {pose}")]
    NoReading {
        /// Which file.
        file: String,
        /// Name of the pose.
        pose: String,
    },
    /// The instrument gave no point, or cannot be asked.
    #[error(transparent)]
    Instrument(#[from] protocol::Failure),
    /// The robot is not ready for a measurement.
    #[error("the robot: {0}")]
    Robot(String),
    /// The robot's controller cannot be asked.
    #[error("the robot: {}", .0.words(protocol::CONTROLLER))]
    Controller(protocol::Failure),
    /// The set-up cannot be simulated or played.
    #[error("{0}")]
    SetUp(String),
    /// The operator cancelled.
    #[error("cancelled")]
    Cancelled,
}
