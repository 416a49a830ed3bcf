//! Instruments and robots that answer like the real ones: the other end of every [`super::protocol`], for rehearsals and tests.
//!
//! As sans-IO as the protocols: a [`Simulator`] gets bytes and gives bytes. What it measures comes from a [`PointSource`], so
//! the same simulated cell is behind each of them. Faults are named and counted, never random, so a test can rely on them.

pub mod ascii;
#[cfg(test)]
pub mod bench;
pub mod emscon;
pub mod fault;
pub mod geocom;
pub mod ndi;
pub mod rtde;
mod schedule;
mod writes;

use std::fmt::Debug;

use super::protocol::{JointState, Moment, Shot};

/// What the simulated instrument looks at.
pub trait PointSource: Send + Debug {
    /// One shot at the reflector, noise included; `None`: the beam is broken.
    fn shot(&mut self) -> Option<Shot>;

    /// Where the reflector is now, for live display; takes no noise from the sequence of the shots.
    fn look(&mut self) -> Option<Shot>;

    /// The joints of the robot as its controller reports them.
    fn joints(&mut self) -> JointState;
}

/// The other end of a wire.
pub trait Simulator: Send + Debug {
    /// Somebody connected.
    fn accept(&mut self, now: Moment);

    /// Bytes from the other side.
    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment);

    /// Time has passed.
    fn tick(&mut self, source: &mut dyn PointSource, now: Moment);

    /// What it does next.
    fn next_output(&mut self) -> Option<Output>;

    /// When [`Self::tick`] wants to be called at the latest.
    fn next_deadline(&self) -> Option<Moment>;
}

/// What a simulator does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Sends these bytes in one write.
    Bytes(Vec<u8>),
    /// Hangs up.
    Close,
}
