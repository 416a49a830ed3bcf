//! Inputs of the wizard ([`Event`]) and the work that it asks for ([`Effect`]).

use jiff::Timestamp;

use super::intent::Intent;
use super::notice::{Notice, Problem};
use super::view::SessionCard;
use crate::identification::Stage;
use crate::procedure;
use crate::procedure::correct::{CorrectRequest, ProgramFile};
use crate::procedure::identify::{Identified, IdentifyRequest};
use crate::procedure::models::{Models, ModelsRequest};
use crate::procedure::plan::PlanRequest;
use crate::profile::{CellText, Profile};
use crate::session::corrected::CorrectedText;
use crate::session::journal::Line;
use crate::session::measurements::NamedPoint;
use crate::session::plan::PlannedPose;
use crate::session::plan_summary::PlanSummary;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, ProgramText};
use crate::session::wire::KnownLinks;

/// Identifies a request, so that an answer to anything but the running one can be dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RequestId(pub u64);

/// An input of the wizard.
#[derive(Clone, Debug)]
pub enum Event {
    Intent(Intent),
    /// The time. The wizard has no clock of its own.
    Tick(Timestamp),
    Store(StoreEvent),
    /// A request has ended.
    Answer {
        id: RequestId,
        answer: Answer,
    },
    /// A running request reports how far it is.
    Progress {
        id: RequestId,
        progress: RequestProgress,
    },
    /// The link's reading between measurements.
    Live(LiveReading),
    /// Sessions that can be continued, the latest first.
    Sessions(Vec<SessionCard>),
    /// The cell of an earlier session.
    Cell(CellText),
    /// Links that can be chosen from a list.
    Links(KnownLinks),
    /// A message that does not concern the calibration itself, such as a recording that stopped.
    Remark(Notice),
    /// The program has to end.
    Shutdown {
        /// Reason in words, such as `SIGTERM`.
        cause: String,
    },
}

/// A report of the session store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StoreEvent {
    /// The session folder was created and locked.
    Created {
        id: RequestId,
        folder: String,
        /// Name of the session, which may have a number appended.
        name: String,
    },
    /// The lines are on disk.
    Written { id: RequestId },
    /// Nothing was written.
    Failed {
        id: RequestId,
        /// Reason and place.
        message: String,
    },
}

/// How a request ended.
#[derive(Clone, Debug)]
pub enum Answer {
    /// The text of a profile.
    Profile {
        /// Name or path that was asked for.
        source: String,
        text: String,
    },
    /// The instrument responds.
    Connected {
        /// Identity reported by the instrument.
        identity: String,
        /// Problems to see before measuring, such as a frame that is not the instrument's own.
        warnings: Vec<String>,
        /// Poses of recorded measurements.
        recorded: Vec<PlannedPose>,
    },
    Measured(Reading),
    /// The instrument has turned to where it was sent, and has found the reflector.
    Turned,
    /// Poses to measure.
    Planned {
        /// Figures of the plan; `None` for a plan from a file.
        summary: Option<Box<PlanSummary>>,
        rows: Vec<PlannedPose>,
        /// Source of the plan in words.
        origin: String,
    },
    /// Configurations for the circle-point analysis, one list per joint turned.
    CirclesPlanned(Vec<CircleConfigurations>),
    /// Stops of the joint check.
    JointCheckPlanned(Vec<JointCheckStop>),
    /// Points of a file, to be looked at before they are taken.
    Points {
        /// Name of the file.
        file: String,
        points: Vec<NamedPoint>,
    },
    Identified(Box<Identified>),
    /// The models are written and verified, in memory.
    Modelled(Box<Models>),
    /// A robot program is corrected and verified, in memory.
    Corrected(Box<ProgramFile>),
    /// The corrected program is on disk.
    CorrectedWritten(Box<CorrectedText>),
    /// The robot program of a plan is made, in memory.
    Programmed {
        /// Name and text of each file.
        files: Vec<(String, String)>,
        /// Collisions that the bodies of the profile predict.
        dangers: Vec<String>,
    },
    /// The result files are on disk.
    Delivered {
        /// Names of the files.
        files: Vec<String>,
        /// Check sums of the files, in their order.
        sums: Vec<String>,
        /// Models that were left out, with the reason.
        left_out: Vec<String>,
    },
    Failed(Problem),
    Cancelled,
}

/// Configurations that turn one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleConfigurations {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Pendant values (rad, sliding joints m), in order.
    pub configurations: Vec<Vec<f64>>,
}

/// A stop of the joint check.
#[derive(Clone, Debug, PartialEq)]
pub struct JointCheckStop {
    /// Index of the joint that is moved to get there, from 0; none for the first stop.
    pub joint: Option<usize>,
    /// Pendant values (rad, sliding joints m).
    pub configuration: Vec<f64>,
}

/// Progress of a running request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RequestProgress {
    /// Progress of a pose search.
    Search(procedure::plan::Progress),
    /// Progress of an identification.
    Identify(Stage),
}

/// Work for the outside world.
#[derive(Clone, Debug)]
pub enum Effect {
    /// Create the folder of a session and lock it.
    Create {
        id: RequestId,
        name: String,
    },
    /// Append lines to the journal and force them to disk.
    Append {
        id: RequestId,
        lines: Vec<Line>,
    },
    Start {
        id: RequestId,
        request: Request,
    },
    /// Cancel a request, which still ends with an answer.
    Cancel(RequestId),
    Exit,
}

/// A task that takes time.
#[derive(Clone, Debug)]
pub enum Request {
    LoadProfile {
        source: String,
    },
    Connect {
        instrument: InstrumentChoice,
        /// Profile of the robot in front of the instrument.
        profile: Box<Profile>,
    },
    Measure(MeasureRequest),
    /// Turn the instrument to a place in its own frame.
    Turn {
        at_mm: (f64, f64, f64),
    },
    Plan {
        /// Profile with the target as chosen.
        profile: Box<Profile>,
        profile_text: String,
        request: Box<PlanRequest>,
    },
    /// Read the poses of a file.
    LoadPlan {
        file: String,
        profile: Box<Profile>,
    },
    /// Make the robot program of these poses.
    Program {
        profile: Box<Profile>,
        rows: Vec<PlannedPose>,
        settings: ProgramText,
        /// For the header.
        created: Timestamp,
    },
    /// Find configurations for the circle-point analysis.
    PlanCircles {
        profile: Box<Profile>,
        /// Of every joint, not of the last two only.
        is_whole: bool,
    },
    /// Find a configuration around which each joint can be moved by a few degrees.
    PlanJointCheck {
        profile: Box<Profile>,
    },
    /// Read points for the plan from a file.
    ReadPoints {
        file: String,
        profile: Box<Profile>,
        /// Unit of coordinates whose columns state none.
        unit: CoordinateUnit,
    },
    /// Identify the arm, and verify it if there are verification samples.
    Identify(Box<IdentifyRequest>),
    /// Write the identified arm in other formats, and verify each.
    Model(Box<ModelsRequest>),
    /// Correct a robot program.
    Correct(Box<CorrectRequest>),
    /// Write a corrected program into the session folder.
    WriteCorrected(Box<ProgramFile>),
    /// Replace the result files in the session folder.
    Deliver {
        /// Name and text of each file.
        files: Vec<(String, String)>,
        /// Models that were left out, with the reason.
        left_out: Vec<String>,
    },
}

impl Request {
    /// The activity in words, for a busy line.
    pub const fn what(&self) -> &'static str {
        match self {
            Self::LoadProfile { .. } => "reading the profile",
            Self::Connect { .. } => "connecting",
            Self::Measure(_) => "measuring",
            Self::Turn { .. } => "turning the tracker",
            Self::Plan { .. } => "choosing poses",
            Self::LoadPlan { .. } => "reading the plan",
            Self::Program { .. } => "writing the robot program",
            Self::PlanCircles { .. } => "choosing circles",
            Self::PlanJointCheck { .. } => "choosing where the joints are moved",
            Self::ReadPoints { .. } => "reading the points",
            Self::Identify(_) => "identifying",
            Self::Model(_) => "writing and checking the models",
            Self::Correct(_) => "correcting the program",
            Self::WriteCorrected(_) => "writing the corrected program",
            Self::Deliver { .. } => "writing files",
        }
    }
}
