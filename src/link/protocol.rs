//! Protocols of instruments and robots, without sockets: bytes in, events and bytes out.
//!
//! A [`Protocol`] has no clock and no wire. Its owner connects, calls [`Protocol::start`], passes in every byte that arrives
//! and every deadline that expires, and sends the bytes that the protocol queues. The same code therefore runs over a serial
//! port, over TCP or on a list of bytes in a test, and it does not matter where a stream is split.
//!
//! Conversation: `start` runs the whole set-up (identity, units, frame, mode) and ends with [`ProtocolEvent::Ready`];
//! `trigger` requests one shot and is answered by exactly one [`ProtocolEvent::Shot`] or [`ProtocolEvent::Failed`], or by the
//! end of the connection. After [`ProtocolEvent::Lost`] nothing is valid until the owner has reconnected and called `start`.
//! A point is reported only when the instrument explicitly reports success.

#![warn(missing_docs)]

pub mod abb;
pub mod ascii;
pub mod backoff;
pub mod crc;
pub mod emscon;
pub mod error_streak;
mod excerpt;
pub mod fanuc;
pub mod geocom;
pub mod http;
pub mod joints;
pub mod kuka;
pub mod lines;
pub mod md5;
pub mod ndi;
pub mod outbox;
pub mod receive_buffer;
pub mod rest;
pub mod rtde;
pub mod yaskawa;

use std::fmt::Debug;
use std::time::Duration;

use nalgebra::Point3;

use outbox::Outbox;

/// Time since an arbitrary start chosen by the owner of the protocol; only differences matter.
pub type Moment = Duration;

/// One conversation with an instrument or a robot.
pub trait Protocol: Send + Debug {
    /// Begins the set-up on a new connection. Discards everything received before, including events that were not fetched.
    fn start(&mut self, now: Moment);

    /// Takes bytes as they arrive. Any split of the stream gives the same events; a datagram is passed in one piece.
    fn feed(&mut self, bytes: &[u8], now: Moment);

    /// Handles deadlines, retries and keep-alives that are due.
    fn tick(&mut self, now: Moment);

    /// The queues of what is to be sent and of the events.
    fn outbox(&mut self) -> &mut Outbox;

    /// Requests one shot. Answered by [`ProtocolEvent::Failed`] if the link is not ready or another shot is in progress, and by
    /// robots, which take none.
    fn trigger(&mut self, _now: Moment) {
        self.outbox().refuse_shot();
    }

    /// Turns the instrument to a place in its own frame (m), where it searches for the reflector; answered by
    /// [`ProtocolEvent::Pointed`] or [`ProtocolEvent::Failed`]. Returns `false` if the instrument cannot be turned.
    fn point(&mut self, _at: &Point3<f64>, _now: Moment) -> bool {
        false
    }

    /// Cancels the shot in progress without an answer; a late result of it is discarded.
    fn cancel(&mut self, _now: Moment) {}

    /// The next bytes to send.
    fn next_output(&mut self) -> Option<Vec<u8>> {
        self.outbox().next_output()
    }

    /// The TCP port at which the conversation continues: the connection is closed, and another one opened there, before anything
    /// more is sent.
    fn next_redirect(&mut self) -> Option<u16> {
        None
    }

    /// The next change of the serial line, due once everything to send has been sent. Only protocols of serial lines have any.
    fn next_line_change(&mut self) -> Option<LineChange> {
        None
    }

    /// The next event.
    fn next_event(&mut self) -> Option<ProtocolEvent> {
        self.outbox().next_event()
    }

    /// The latest time for the next call of [`Self::tick`].
    fn next_deadline(&self) -> Option<Moment>;

    /// Whether points arrive between shots, so that silence means a lost connection.
    fn shows_live(&self) -> bool {
        false
    }
}

/// A change of a serial line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineChange {
    /// Sets the speed of this side (baud).
    Speed(u32),
    /// Sends a break, which some instruments take as a reset.
    Break,
}

/// An event of a protocol.
#[derive(Clone, Debug, PartialEq)]
pub enum ProtocolEvent {
    /// The set-up is complete and was read back; shots may be requested.
    Ready(Identity),
    /// The requested shot.
    Shot(Shot),
    /// The requested shot failed; the link stays usable.
    Failed(Failure),
    /// An unrequested point of a stream, or the current position of the reflector. Never a measurement.
    Live(Shot),
    /// A complete measurement that was started at the instrument itself.
    Offered(Shot),
    /// Joint values reported by the robot.
    Joints(JointState),
    /// The instrument has turned to where it was sent, and has found the reflector there.
    Pointed,
    /// A message for the operator.
    Status(Status),
    /// The connection is lost.
    Lost(Failure),
}

/// Identity and settings of the instrument at the other end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identity {
    /// Maker, model, serial number and version, in one line.
    pub name: String,
    /// Reflector in use with its surface offset, if the instrument reports it.
    pub reflector: Option<Reflector>,
    /// Settings that were checked in the set-up, such as `units: mm, rad (read back)`.
    pub checked: Vec<String>,
    /// Problems to resolve before measuring, such as a frame that is not the instrument's own.
    pub warnings: Vec<String>,
    /// Remarks that hold for every instrument of this kind, such as its achievable accuracy.
    pub notes: Vec<String>,
}

/// A reflector in the instrument's list.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflector {
    /// Number of the reflector in that list.
    pub id: i32,
    /// Name of the reflector in that list.
    pub name: String,
    /// Distance of its centre from the surface it touches (m).
    pub offset: f64,
}

/// One measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Centre of the reflector in the frame of the instrument (m).
    pub point: Point3<f64>,
    /// Standard deviation of each coordinate (m), if the instrument states it.
    pub sigma: Option<[f64; 3]>,
    /// Time by the instrument's clock (s).
    pub instrument_time: Option<f64>,
    /// Face of the telescope, 1 or 2.
    pub face: Option<u8>,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// Pressure (hPa).
    pub pressure: Option<f64>,
    /// Relative humidity (%).
    pub humidity: Option<f64>,
    /// Number of the measurement, where the instrument counts them: a new number proves that the point is new, even if it equals
    /// the previous one.
    pub sequence: Option<u32>,
    /// Remarks of the instrument on this point: warnings, such as `the accuracy is not guaranteed`, and information, such as a
    /// name.
    pub remarks: Vec<Status>,
    /// The bytes from which the point was read.
    pub raw: Vec<u8>,
}

/// The stated standard deviations (m), or `None` if one of them is zero, negative or not finite: instruments use such values
/// for "unknown".
pub fn known_sigma(stated: [f64; 3]) -> Option<[f64; 3]> {
    stated.iter().all(|value| value.is_finite() && *value > 0.0).then_some(stated)
}

impl Shot {
    /// A point without any further information.
    pub const fn bare(point: Point3<f64>) -> Self {
        Self {
            point,
            sigma: None,
            instrument_time: None,
            face: None,
            temperature: None,
            pressure: None,
            humidity: None,
            sequence: None,
            remarks: Vec::new(),
            raw: Vec::new(),
        }
    }

    /// Adds a remark.
    #[must_use]
    pub fn with_remark(mut self, severity: Severity, text: impl Into<String>) -> Self {
        self.remarks.push(Status { severity, text: text.into() });
        self
    }
}

/// Joint state of a robot at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Joint values (rad, sliding joints m).
    pub positions: Vec<f64>,
    /// Time by the controller's clock (s).
    pub controller_time: f64,
    /// A state in which nothing is measured even if the robot is at rest, such as a protective stop.
    pub stopped: Option<String>,
    /// A state that is kept with the measurement, such as a reduced mode.
    pub remark: Option<String>,
}

impl JointState {
    /// Joint values without any further information.
    pub const fn at(positions: Vec<f64>) -> Self {
        Self { positions, controller_time: 0.0, stopped: None, remark: None }
    }
}

/// Severity of a status message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// For information.
    Info,
    /// Needs attention.
    Warning,
}

/// A message for the operator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// Severity of the message.
    pub severity: Severity,
    /// Text of the message.
    pub text: String,
}

/// Why a shot or a link failed. Every variant's message says what happened; [`Failure::hint`] says what to do.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Failure {
    /// The instrument sees no reflector.
    NoTarget(String),
    /// The reading was not stable.
    Unstable(String),
    /// The instrument is busy: warm-up, motion or another command.
    NotReady(String),
    /// No answer arrived in time.
    Silent {
        /// What the program was doing.
        what: String,
        /// How long it waited (s).
        seconds: f64,
    },
    /// The instrument refused a command.
    Refused(String),
    /// Units, frame, mode or reflector differ from the requested ones.
    Settings(String),
    /// The instrument multiplies its points by this scale, so all distances are wrong.
    Scaled(f64),
    /// The other end is not the selected kind of instrument.
    Foreign(String),
    /// The reading cannot be a measured point.
    Unusable(String),
    /// The point equals the previous one exactly. A real instrument hardly ever repeats every digit; one that is stuck does.
    Repeated,
    /// The received data cannot be read.
    Garbled(String),
    /// Another program uses the instrument.
    InUse(String),
    /// No connection could be made.
    Unreachable(String),
    /// The connection was lost.
    Disconnected(String),
    /// The shot was requested during another one, or before the set-up was complete.
    TooEarly(String),
}

/// Name of the other end of a robot's wire in messages.
pub const CONTROLLER: &str = "the controller";

impl std::error::Error for Failure {}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message("the instrument"))
    }
}

impl Failure {
    /// The message, with `subject` as the name of the other end, such as `the controller`.
    pub fn message(&self, subject: &str) -> String {
        match self {
            Self::NoTarget(why) => format!("{subject} sees no reflector ({why})"),
            Self::Unstable(why) => format!("the reading was not stable ({why})"),
            Self::NotReady(why) => format!("{subject} is not ready ({why})"),
            Self::Silent { what, seconds } => format!("no answer from {subject} for {seconds:.0} s while {what}"),
            Self::Refused(why) => format!("{subject} refused: {why}"),
            Self::Settings(why) => format!("{subject} has a wrong setting: {why}"),
            Self::Scaled(scale) => {
                format!("{subject} multiplies its points by the scale {scale}, so all distances would be wrong")
            }
            Self::Foreign(why) => format!("this does not look like the selected instrument: {why}"),
            Self::Unusable(why) => format!("the reading is not a measurement: {why}"),
            Self::Repeated => {
                "the reading is not a measurement: identical to the previous point to the last digit, so it is \
                               not a new measurement"
                    .to_owned()
            }
            Self::Garbled(why) => format!("cannot read the data from {subject}: {why}"),
            Self::InUse(why) => format!("{subject} is in use by another program ({why})"),
            Self::Unreachable(why) => format!("no connection: {why}"),
            Self::Disconnected(why) => format!("the connection was lost: {why}"),
            Self::TooEarly(why) => format!("the shot was requested too early: {why}"),
        }
    }

    /// Advice for the operator.
    pub const fn hint(&self) -> &'static str {
        match self {
            Self::NoTarget(_) => {
                "return the SMR to the nest until the instrument has locked on to it, then measure again"
            }
            Self::Unstable(_) => "wait until the robot and the SMR are at rest, then measure again",
            Self::NotReady(_) => "wait until the instrument is ready, then measure again",
            Self::Silent { .. } => {
                "check that the instrument is switched on and that the cable or network is connected"
            }
            Self::Refused(_) => "check the instrument's own display",
            Self::Settings(_) => "correct the setting at the instrument, or reconnect and let the set-up do it",
            Self::Scaled(_) => {
                "set the scale of the instrument (transformation, map projection, ppm) to 1, then reconnect"
            }
            Self::Foreign(_) => "check the kind of instrument and the port, and that it is switched on; then reconnect",
            Self::Unusable(_) | Self::Repeated => {
                "measure again; if this persists, check the beam and the settings of the instrument"
            }
            Self::Garbled(_) => "check the baud rate, the line ending and the selected kind of instrument",
            Self::InUse(_) => "close the other program, then reconnect",
            Self::Unreachable(_) => {
                "check address, cable and network, and that the instrument is switched on; then reconnect"
            }
            Self::Disconnected(_) => "check the cable or network; the link reconnects automatically",
            Self::TooEarly(_) => "wait for the current reading",
        }
    }

    /// Advice for the operator if a robot's controller is at the other end.
    pub const fn controller_hint(&self) -> &'static str {
        match self {
            Self::Silent { .. } => {
                "check that the controller is switched on, that the network is connected and that the port is right (RTDE: 30004)"
            }
            Self::Refused(_) => {
                "check the version, the options and the user of the controller's interface; then reconnect"
            }
            Self::Garbled(_) | Self::Foreign(_) => {
                "check the controller's address, the protocol and its port (RTDE: 30004); then reconnect"
            }
            Self::InUse(_) => "close the other program that uses this interface of the controller, then reconnect",
            Self::Unreachable(_) => {
                "check address and network, that the controller is switched on and that its security settings allow this interface"
            }
            Self::Disconnected(_) => "check the network; the link reconnects automatically",
            Self::NoTarget(_)
            | Self::Unstable(_)
            | Self::NotReady(_)
            | Self::Settings(_)
            | Self::Scaled(_)
            | Self::Unusable(_)
            | Self::Repeated
            | Self::TooEarly(_) => "check the state of the robot on the pendant, then try again",
        }
    }

    /// Whether an immediate retry may succeed.
    pub const fn is_transient(&self) -> bool {
        matches!(self, Self::Unstable(_) | Self::NotReady(_) | Self::Repeated)
    }
}
