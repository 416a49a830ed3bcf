//! Simulated instruments and robots: the other end of every [`super::protocol`], for rehearsals and tests.
//!
//! Like the protocols they do no I/O: a [`Simulator`] takes bytes and returns bytes. Its measurements come from a
//! [`PointSource`], so that one simulated cell serves all of them. Faults are named and counted, never random, so that tests can
//! rely on them.

pub mod abb;
pub mod ascii;
#[cfg(test)]
pub mod bench;
pub mod emscon;
pub mod fanuc;
pub mod fault;
pub mod geocom;
pub mod joints;
pub mod kuka;
pub mod ndi;
pub mod rtde;
mod schedule;
mod writes;
pub mod yaskawa;

use std::fmt::Debug;

use super::protocol::{JointState, LineChange, Moment, Shot};

/// The source of a simulated instrument's measurements.
pub trait PointSource: Send + Debug {
    /// One shot at the reflector with noise; `None` if the beam is broken.
    fn shot(&mut self) -> Option<Shot>;

    /// Current position of the reflector for the live view. Does not affect the noise of the shots.
    fn position(&mut self) -> Option<Shot>;

    /// Joint state of the robot as its controller reports it.
    fn joints(&mut self) -> JointState;
}

/// The other end of a wire.
pub trait Simulator: Send + Debug {
    /// Starts a new connection.
    fn accept(&mut self, now: Moment);

    /// Handles a change of the serial line by the other side.
    fn change_line(&mut self, _change: LineChange, _now: Moment) {}

    /// Whether the conversation continues at a second TCP port.
    fn wants_second_port(&self) -> bool {
        false
    }

    /// Takes the number of the second port.
    fn second_port(&mut self, _port: u16) {}

    /// Takes bytes from the other side.
    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment);

    /// Handles everything that is due.
    fn tick(&mut self, source: &mut dyn PointSource, now: Moment);

    fn next_output(&mut self) -> Option<Output>;

    /// The latest time for the next call of [`Self::tick`].
    fn next_deadline(&self) -> Option<Moment>;
}

/// An output of a simulator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Bytes to send in one write.
    Bytes(Vec<u8>),
    /// Closes the connection.
    Close,
}
