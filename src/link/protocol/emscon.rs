//! Leica emScon: the binary interface over TCP that the AT901 speaks, and the AT401 and AT402 with some of their firmware.
//! The tracker listens, usually at port 700.
//!
//! The set-up asserts units, coordinate type, frame, reflector, mode and system settings and reads all of them back.
//! One shot is: ask whether the tracker is ready, start, wait for the acceptance, wait for the result. Only a result that comes
//! after the acceptance, says success and passes the gates (finite, in range, stationary, no rehearsal) is a point. An error, or *not ready*, in between ends it:
//! which number a broken beam has is not known publicly, so none is relied on. A change of the settings in the middle rejects
//! the shot, then everything is read again.
//!
//! What is sent and understood comes from public descriptions and was tried against simulated trackers only.

pub mod command;
mod exchange;
pub mod packet;
mod session;
mod setup;
mod shot;
pub mod status;
mod step;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub use command::{Command, SystemSettings, Units};
pub use packet::{Fields, Framer, MAX_PACKET, MIN_PACKET, Packet, PacketError, Reply, SingleResult, f64_at, i32_at};
pub use status::{
    CommandId, CoordinateType, LaserStatus, LengthUnit, MeasurementMode, PacketType, ProcessorStatus, ResultStatus,
    SystemEvent, TrackerStatus,
};

use self::session::Session;
use super::{Moment, Protocol, ProtocolEvent};

/// TCP port at which trackers listen unless they were set otherwise.
pub const PORT: u16 = 700;

/// How the tracker is to be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmsconOptions {
    /// Duration of a stationary measurement (ms); trackers take 500 to 2000 and more.
    pub measure_ms: i32,
    /// The absolute distance meter takes part, so that a broken beam needs no return to the nest.
    pub use_adm: bool,
    /// Number of the reflector that is to be chosen; `None` keeps the tracker's choice.
    pub reflector: Option<i32>,
    /// Initialises the tracker in every set-up: its head turns for up to a minute and more.
    pub initialize: bool,
    /// Asks for the position of the reflector all the time, for live display.
    pub reflector_positions: bool,
    /// A point nearer or farther than this cannot be one (m).
    pub distances: (f64, f64),
    /// An idle link asks for the status after this.
    pub keep_alive: Duration,
    /// A result comes within the duration of the measurement and this.
    pub result_margin: Duration,
}

impl Default for EmsconOptions {
    fn default() -> Self {
        Self {
            measure_ms: 1000,
            use_adm: true,
            reflector: None,
            initialize: false,
            reflector_positions: false,
            distances: (0.1, 80.0),
            keep_alive: Duration::from_secs(5),
            result_margin: Duration::from_secs(10),
        }
    }
}

/// The conversation with an emScon tracker.
#[derive(Clone, Debug)]
pub struct Emscon {
    session: Session,
}

impl Emscon {
    /// A conversation that has not begun.
    pub fn new(options: EmsconOptions) -> Self {
        Self { session: Session::new(options) }
    }
}

impl Default for Emscon {
    fn default() -> Self {
        Self::new(EmsconOptions::default())
    }
}

impl Protocol for Emscon {
    fn start(&mut self, now: Moment) {
        self.session.start(now);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        self.session.feed(bytes, now);
    }

    fn tick(&mut self, now: Moment) {
        self.session.tick(now);
    }

    fn trigger(&mut self, now: Moment) {
        self.session.trigger(now);
    }

    fn cancel(&mut self, now: Moment) {
        self.session.cancel(now);
    }

    fn next_output(&mut self) -> Option<Vec<u8>> {
        self.session.outbox.next_output()
    }

    fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.session.outbox.next_event()
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.session.next_deadline()
    }

    fn shows_live(&self) -> bool {
        self.session.shows_live()
    }
}

#[cfg(test)]
impl Emscon {
    /// Bytes that wait for the rest of a packet.
    pub(in crate::link) fn pending(&self) -> usize {
        self.session.pending()
    }
}
