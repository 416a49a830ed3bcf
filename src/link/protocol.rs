//! What instruments and robots speak, without sockets: bytes in, events and bytes out.
//!
//! A [`Protocol`] has no clock and no wire. Its owner connects, calls [`Protocol::start`], hands it every byte that arrives and
//! every passing deadline, and carries away what it wants to send. So one and the same code talks over a serial port, TCP or a
//! list of bytes in a test, and splitting a stream at any byte changes nothing.
//!
//! Conversation: `start` runs the whole set-up (identity, units, frame, mode) and ends with [`ProtocolEvent::Ready`];
//! `trigger` asks for one shot and is answered by exactly one [`ProtocolEvent::Shot`] or [`ProtocolEvent::Failed`], or by the end
//! of the connection. After [`ProtocolEvent::Lost`] nothing is valid until the owner has connected again and called `start`. A point is given only on
//! an explicit success of the instrument.

#![warn(missing_docs)]

pub mod ascii;
pub mod crc;
pub mod emscon;
pub mod geocom;
pub mod lines;
pub mod ndi;
pub mod outbox;
pub mod patience;
pub mod rtde;
pub mod text;
pub mod unread;
pub mod unreadable;

use std::fmt::Debug;
use std::time::Duration;

use nalgebra::Point3;

/// Time since some start that the owner of the protocol chose; only differences matter.
pub type Moment = Duration;

/// One conversation with an instrument or a robot.
pub trait Protocol: Send + Debug {
    /// A new connection: forgets all that was received, what still waits to be fetched included, and begins the set-up.
    fn start(&mut self, now: Moment);

    /// Bytes as they arrived; any split of the stream gives the same events. A datagram is fed whole.
    fn feed(&mut self, bytes: &[u8], now: Moment);

    /// Time has passed: deadlines, retries, keep-alive.
    fn tick(&mut self, now: Moment);

    /// Asks for one shot. Not ready, or one is under way: answered by [`ProtocolEvent::Failed`].
    fn trigger(&mut self, now: Moment);

    /// Gives up the shot under way; what still comes of it is swallowed. Not answered.
    fn cancel(&mut self, now: Moment);

    /// The next bytes to send.
    fn next_output(&mut self) -> Option<Vec<u8>>;

    /// The next thing that happened.
    fn next_event(&mut self) -> Option<ProtocolEvent>;

    /// When [`Self::tick`] wants to be called at the latest.
    fn next_deadline(&self) -> Option<Moment>;

    /// Whether points are shown between shots: then something is heard from the other end all the time.
    fn shows_live(&self) -> bool {
        false
    }
}

/// Something that happened on the wire.
#[derive(Clone, Debug, PartialEq)]
pub enum ProtocolEvent {
    /// The set-up is complete and was read back; shots may be asked for.
    Ready(Identity),
    /// The shot that was asked for.
    Shot(Shot),
    /// The shot that was asked for did not come; the link goes on.
    Failed(Failure),
    /// A point that nobody asked for: a stream, or the position of the reflector. Never a measurement.
    Live(Shot),
    /// A complete measurement that somebody started at the instrument itself.
    Offered(Shot),
    /// Joint values that the robot reported.
    Joints(JointState),
    /// Something that the operator should know.
    Status(Status),
    /// The connection is of no use any more.
    Lost(Failure),
}

/// Who answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identity {
    /// Maker, model, serial number, version: in one line.
    pub name: String,
    /// Reflector in use with its surface offset, if the instrument says it.
    pub reflector: Option<Reflector>,
    /// What was checked in the set-up, one item each, such as `units: mm, rad (read back)`.
    pub checked: Vec<String>,
    /// What the operator should know before measuring, such as a frame that is not the instrument's own.
    pub warnings: Vec<String>,
    /// What holds for every instrument of this kind, such as how accurate it can be at all.
    pub notes: Vec<String>,
}

/// A reflector that the instrument knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflector {
    /// Number at the instrument.
    pub id: i32,
    /// Name.
    pub name: String,
    /// Distance of its centre from the surface that it touches (m).
    pub offset: f64,
}

/// One point.
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
    /// Said with the point, such as a name or `accuracy not guaranteed`.
    pub remark: Option<String>,
    /// The bytes that it was read from.
    pub raw: Vec<u8>,
}

/// Standard deviations (m) as an instrument states them; `None` where they are none: zero, negative or not finite stand for
/// "unknown".
pub fn known_sigma(stated: [f64; 3]) -> Option<[f64; 3]> {
    stated.iter().all(|value| value.is_finite() && *value > 0.0).then_some(stated)
}

impl Shot {
    /// A point with nothing said beside it.
    pub const fn bare(point: Point3<f64>) -> Self {
        Self {
            point,
            sigma: None,
            instrument_time: None,
            face: None,
            temperature: None,
            pressure: None,
            humidity: None,
            remark: None,
            raw: Vec::new(),
        }
    }
}

/// Joints of a robot at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Values (rad).
    pub positions: Vec<f64>,
    /// Speeds (rad/s), if the controller gives them.
    pub speeds: Option<Vec<f64>>,
    /// Time by the controller's clock (s).
    pub controller_time: f64,
    /// Why it is no time to measure, such as a protective stop.
    pub stopped: Option<String>,
}

/// How much a status matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Good to know.
    Info,
    /// Wants attention.
    Warning,
}

/// Something to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// How much it matters.
    pub severity: Severity,
    /// In words.
    pub text: String,
}

/// Why there is no point, or no link. Every variant's message says what happened; [`Failure::hint`] says what to do.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Failure {
    /// No reflector is seen.
    NoTarget(String),
    /// The reflector or the air is not steady.
    Unstable(String),
    /// Not now: warm-up, motion, another command.
    NotReady(String),
    /// It said nothing in time.
    Silent {
        /// What was waited for.
        what: String,
        /// How long.
        seconds: f64,
    },
    /// It refused.
    Refused(String),
    /// It is set in another way than asked for: units, frame, mode, reflector.
    Settings(String),
    /// It multiplies its points by a scale, so that all distances are wrong.
    Scaled(f64),
    /// What answers, or does not, is something else than the instrument that was chosen.
    Foreign(String),
    /// A point came that cannot be one.
    Unusable(String),
    /// What came cannot be understood.
    Garbled(String),
    /// Somebody else uses it.
    InUse(String),
    /// There is no connection.
    Unreachable(String),
    /// The connection ended.
    Disconnected(String),
    /// The shot was asked for while another was under way, or before the set-up was complete.
    TooEarly(String),
}

/// Who is at the other end of a robot's wire, in messages.
pub const CONTROLLER: &str = "the controller";

impl std::error::Error for Failure {}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.words("the instrument"))
    }
}

impl Failure {
    /// What happened, where `who` is at the other end, such as `the controller`.
    pub fn words(&self, who: &str) -> String {
        match self {
            Self::NoTarget(why) => format!("{who} sees no reflector ({why})"),
            Self::Unstable(why) => format!("the reading was not stable ({why})"),
            Self::NotReady(why) => format!("{who} is not ready ({why})"),
            Self::Silent { what, seconds } => format!("{who} said nothing for {seconds:.0} s while {what}"),
            Self::Refused(why) => format!("{who} refused: {why}"),
            Self::Settings(why) => format!("{who} is set differently: {why}"),
            Self::Scaled(scale) => {
                format!(
                    "{who} multiplies its points by the scale {scale} of its transformation: all distances would be wrong"
                )
            }
            Self::Foreign(why) => format!("this does not look like what was chosen: {why}"),
            Self::Unusable(why) => format!("the reading is no measurement: {why}"),
            Self::Garbled(why) => format!("cannot read what {who} sends: {why}"),
            Self::InUse(why) => format!("{who} is in use by another program ({why})"),
            Self::Unreachable(why) => format!("there is no connection: {why}"),
            Self::Disconnected(why) => format!("the connection is lost: {why}"),
            Self::TooEarly(why) => format!("a shot was asked for too early: {why}"),
        }
    }

    /// A point came that is the one before again: no real instrument measures the same twice, a stuck one does.
    pub fn repeated() -> Self {
        Self::Unusable("it is equal to the point before to the last digit, so it was not measured anew".to_owned())
    }

    /// What the operator can do.
    pub const fn hint(&self) -> &'static str {
        match self {
            Self::NoTarget(_) => "return the SMR to the nest until the instrument has it again, then measure again",
            Self::Unstable(_) => "wait until the robot and the SMR are at rest, then measure again",
            Self::NotReady(_) => "wait until the instrument shows that it is ready, then measure again",
            Self::Silent { .. } => "look whether the instrument is on and the cable or network is in place",
            Self::Refused(_) => "look at the instrument's own display for what it wants",
            Self::Settings(_) => "set the instrument as said, or connect again to let the set-up do it",
            Self::Scaled(_) => "set the scale of the instrument's transformation to 1, then connect again",
            Self::Foreign(_) => "is it this kind of instrument, and the right port, and is it on? then connect again",
            Self::Unusable(_) => "measure again; if it stays, check the beam and the settings of the instrument",
            Self::Garbled(_) => "check baud rate, line ending and the kind of instrument that was chosen",
            Self::InUse(_) => "close the other program; then connect again",
            Self::Unreachable(_) => {
                "check address, cable and network, and whether the instrument is on; then connect again"
            }
            Self::Disconnected(_) => "check the cable or network; the link connects again by itself",
            Self::TooEarly(_) => "wait for the reading under way",
        }
    }

    /// What the operator can do where a robot's controller is at the other end.
    pub const fn controller_hint(&self) -> &'static str {
        match self {
            Self::Silent { .. } => {
                "look whether the controller is on and the network is in place, and whether the port is that of RTDE, 30004"
            }
            Self::Refused(_) => "the controller needs PolyScope 3.4 or newer; look at its version on the pendant",
            Self::Garbled(_) | Self::Foreign(_) => {
                "is it the controller's address, and the port of RTDE, 30004? correct it, then connect again"
            }
            Self::InUse(_) => "end the other program that uses RTDE of this controller; then connect again",
            Self::Unreachable(_) => {
                "check address and network, whether the controller is on, and whether its security settings allow RTDE"
            }
            Self::Disconnected(_) => "check the network; the link connects again by itself",
            Self::NoTarget(_)
            | Self::Unstable(_)
            | Self::NotReady(_)
            | Self::Settings(_)
            | Self::Scaled(_)
            | Self::Unusable(_)
            | Self::TooEarly(_) => "look at the pendant for the state of the robot, then try again",
        }
    }

    /// True where asking again at once has a chance.
    pub const fn is_transient(&self) -> bool {
        matches!(self, Self::Unstable(_) | Self::NotReady(_))
    }
}
