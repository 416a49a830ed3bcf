//! Links to instruments: anything that can return an SMR position.
//!
//! A link knows wires, files or a simulation, but not the purpose of a reading. It returns a reading only on an explicit
//! success; everything else is a [`LinkError`]. Points are in the frame of the instrument (m), configurations are pendant values (rad, sliding
//! joints m).

mod build;
mod cell_view;
mod ports;
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

pub use ports::{SerialPortName, serial_ports};
pub use rehearsal::Rehearsal;
pub use replay::{Replay, ReplayRow};
pub use robot::WiredRobot;
pub use serve::Served;
pub use simulated::{HiddenArm, SimulatedCell};
pub use wire::RawLog;
pub use wired::Wired;

use nalgebra::Point3;

use crate::session::reading::{LiveReading, MeasureRequest, Reading};

/// A source of measured points.
pub trait Link: Send {
    /// Connects and describes the other end in one line.
    ///
    /// # Errors
    /// The other end does not answer or cannot be used.
    fn connect(&mut self) -> Result<String, LinkError>;

    /// Measures the target and blocks until it is done. Calls `keep_going` at least ten times per second of real time, and
    /// fails with [`LinkError::Cancelled`] once it returns `false`.
    ///
    /// # Errors
    /// No reading could be taken.
    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError>;

    /// Turns the instrument to a place in its own frame (m), where it searches for the reflector. Calls `keep_going` like
    /// [`Self::measure`].
    ///
    /// # Errors
    /// It cannot be turned, or has found nothing there.
    fn point(&mut self, _at: Point3<f64>, _keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        Err(LinkError::SetUp("this instrument cannot be turned from here".to_owned()))
    }

    /// The live view between measurements and the events since the last call; waits up to `wait`. A link without a live view
    /// returns `None` at once.
    fn watch(&mut self, _wait: Duration) -> Option<(LiveReading, Vec<LinkEvent>)> {
        None
    }

    /// Reads the live view during a measurement, for the `keep_going` callback.
    fn live_poll(&self) -> Option<LivePoll> {
        None
    }
}

/// Returns the current live view.
pub type LivePoll = Box<dyn Fn() -> LiveReading>;

/// An event of a link between measurements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkEvent {
    /// The set-up is complete, for the first time or after a reconnect; carries the identity of the other end.
    Up(String),
    /// The link was lost, with the reason; it will be retried.
    Down(String),
    /// A message for the operator.
    Notice(String),
}

/// Why there is no reading.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LinkError {
    /// The instrument sees no reflector.
    #[error("the beam is broken: the tracker sees no SMR")]
    BeamBroken,
    /// The table has no reading for the pose.
    #[error("'{file}' has no reading for pose {pose}")]
    NoReading { file: String, pose: String },
    /// The instrument returned no point, or the link is down.
    #[error(transparent)]
    Instrument(#[from] protocol::Failure),
    /// The robot is not ready for a measurement.
    #[error("the robot: {0}")]
    Robot(String),
    /// The link to the robot's controller is down.
    #[error("the robot: {}", .0.message(protocol::CONTROLLER))]
    Controller(protocol::Failure),
    /// The link cannot be set up as requested.
    #[error("{0}")]
    SetUp(String),
    /// The operator cancelled.
    #[error("cancelled")]
    Cancelled,
}
