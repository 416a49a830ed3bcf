//! Leica emScon: the binary interface over TCP that the AT901 speaks, and the AT401 and AT402 with some of their firmware.
//! The tracker listens, usually at port 700.
//!
//! The set-up asserts units, coordinate type, frame, reflector, mode and system settings and reads all of them back.
//! One shot is: ask whether the tracker is ready, start, wait for the acceptance, wait for the result. Only a result that
//! arrives after the acceptance, reports success and passes the checks (finite, in range, stationary, not in try mode) is a
//! point. An error, or *not ready*, in between ends the shot; the error number of a broken beam is not known publicly, so the
//! program does not rely on one. A change of the settings during a shot rejects it, and then everything is read again.
//!
//! The commands and packets come from public descriptions and were tested only against simulated trackers.

pub mod command;
mod conversation;
mod exchange;
pub mod packet;
mod setup;
mod shot;
pub mod status;
mod step;
#[cfg(test)]
mod tests;

use std::time::Duration;

use nalgebra::Point3;

pub use command::{Command, SystemSettings, Units};
pub use packet::{Fields, Framer, MAX_PACKET, MIN_PACKET, Packet, PacketError, Reply, SingleResult, f64_at, i32_at};
pub use status::{
    CommandId, CoordinateType, LaserStatus, LengthUnit, MeasurementMode, PacketType, ProcessorStatus, ResultStatus,
    SystemEvent, TrackerStatus,
};

use self::conversation::Conversation;
use super::outbox::Outbox;
use super::{Moment, Protocol};

/// TCP port at which trackers listen by default.
pub const PORT: u16 = 700;

/// Options of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmsconOptions {
    /// Duration of a stationary measurement (ms); trackers accept 500 to 2000 and more.
    pub measure_ms: i32,
    /// Use the absolute distance meter, so that the SMR need not return to the nest after a broken beam.
    pub use_adm: bool,
    /// Number of the reflector to select; `None` keeps the tracker's selection.
    pub reflector: Option<i32>,
    /// Initialise the tracker in every set-up; its head turns for a minute or more.
    pub initialize: bool,
    /// Let the tracker send the position of the reflector continuously, for the live view.
    pub reflector_positions: bool,
    /// Shortest possible distance of a point (m).
    pub nearest: f64,
    /// Longest possible distance of a point (m).
    pub farthest: f64,
    /// Interval at which an idle link asks for the tracker's status.
    pub keep_alive: Duration,
    /// Longest wait for a result, in addition to the duration of the measurement.
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
            nearest: 0.1,
            farthest: 80.0,
            keep_alive: Duration::from_secs(5),
            result_margin: Duration::from_secs(10),
        }
    }
}

/// Protocol driver of an emScon tracker.
#[derive(Clone, Debug)]
pub struct Emscon {
    conversation: Conversation,
}

impl Emscon {
    /// A driver that is not connected yet.
    pub fn new(options: EmsconOptions) -> Self {
        Self { conversation: Conversation::new(options) }
    }
}

impl Default for Emscon {
    fn default() -> Self {
        Self::new(EmsconOptions::default())
    }
}

impl Protocol for Emscon {
    fn start(&mut self, now: Moment) {
        self.conversation.start(now);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        self.conversation.feed(bytes, now);
    }

    fn tick(&mut self, now: Moment) {
        self.conversation.tick(now);
    }

    fn trigger(&mut self, now: Moment) {
        self.conversation.trigger(now);
    }

    fn point(&mut self, at: &Point3<f64>, now: Moment) -> bool {
        self.conversation.point(at, now);
        true
    }

    fn cancel(&mut self, now: Moment) {
        self.conversation.cancel(now);
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.conversation.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.conversation.next_deadline()
    }

    fn shows_live(&self) -> bool {
        self.conversation.shows_live()
    }
}

#[cfg(test)]
impl Emscon {
    /// Bytes of an incomplete packet.
    pub(in crate::link) fn pending(&self) -> usize {
        self.conversation.pending()
    }
}
