//! What the wizard hears ([`Event`]) and what it wants done ([`Effect`]).

use jiff::Timestamp;

use super::intent::Intent;
use super::notice::{Notice, Problem};
use crate::identification::Iteration;
use crate::procedure;
use crate::procedure::identify::{Identified, IdentifyRequest};
use crate::procedure::models::{Models, ModelsRequest};
use crate::procedure::plan::PlanRequest;
use crate::profile::Profile;
use crate::session::journal::Line;
use crate::session::plan::PlannedPose;
use crate::session::plan_summary::PlanSummary;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::set_up::InstrumentChoice;

/// Tells answers apart: an answer to anything but the open request is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RequestId(pub u64);

/// Something that happened.
#[derive(Clone, Debug)]
pub enum Event {
    /// The operator wants something.
    Intent(Intent),
    /// The time. The wizard has no clock of its own.
    Tick(Timestamp),
    /// About the journal.
    Store(StoreEvent),
    /// A request has ended.
    Answer {
        /// Which.
        id: RequestId,
        /// How.
        answer: Answer,
    },
    /// A request goes on.
    Progress {
        /// Which.
        id: RequestId,
        /// How far it is.
        progress: Progress,
    },
    /// What the link sees while nothing is measured.
    Live(LiveReading),
    /// Something beside the calibration that the operator should know, such as a recording that stopped.
    Remark(Notice),
    /// The program has to end.
    Shutdown {
        /// Why, such as `SIGTERM`.
        cause: String,
    },
}

/// What the store says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StoreEvent {
    /// The session's folder was made and is held.
    Created {
        /// Which request.
        id: RequestId,
        /// Where it is.
        folder: String,
        /// Its name, which may carry a number.
        name: String,
    },
    /// The lines are on disk.
    Written {
        /// Which request.
        id: RequestId,
    },
    /// Nothing was written.
    Failed {
        /// Which request.
        id: RequestId,
        /// Why, and where.
        message: String,
    },
}

/// How a request ended.
#[derive(Clone, Debug)]
pub enum Answer {
    /// A profile's text.
    Profile {
        /// Name or path that was asked for.
        source: String,
        /// Its text.
        text: String,
    },
    /// The instrument answers.
    Connected {
        /// Who it says it is.
        identity: String,
        /// What the operator has to see before measuring, such as a frame that is not the instrument's own.
        warnings: Vec<String>,
        /// The poses of recorded measurements.
        recorded: Vec<PlannedPose>,
    },
    /// A reading.
    Measured(Reading),
    /// Poses to measure.
    Planned {
        /// The numbers; none for a plan from a file.
        summary: Option<Box<PlanSummary>>,
        /// The rows.
        rows: Vec<PlannedPose>,
        /// Where they come from.
        origin: String,
    },
    /// Configurations for the circle-point analysis, one list per joint turned.
    CirclesPlanned(Vec<CircleConfigurations>),
    /// A result.
    Identified(Box<Identified>),
    /// The models are written and proven, in memory.
    Modelled(Box<Models>),
    /// Files were written.
    Delivered {
        /// Their names.
        files: Vec<String>,
        /// Models that were left out, with the reason.
        left_out: Vec<String>,
    },
    /// It could not be done.
    Failed(Problem),
    /// It was cancelled.
    Cancelled,
}

/// Configurations that turn one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleConfigurations {
    /// Which joint, from 0.
    pub joint: usize,
    /// Pendant values (rad, sliding joints m), in order.
    pub configurations: Vec<Vec<f64>>,
}

/// How far a request is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// A pose search.
    Search(procedure::plan::Progress),
    /// An identification.
    Solver(Iteration),
}

/// Something to be done outside.
#[derive(Clone, Debug)]
pub enum Effect {
    /// Make the folder of a session and hold it.
    Create {
        /// Answered with this.
        id: RequestId,
        /// Its name.
        name: String,
    },
    /// Write lines of the journal and force them to disk.
    Append {
        /// Answered with this.
        id: RequestId,
        /// The lines.
        lines: Vec<Line>,
    },
    /// Start something that takes time.
    Start {
        /// Answered with this.
        id: RequestId,
        /// What.
        request: Request,
    },
    /// Stop it; it is answered all the same.
    Cancel(RequestId),
    /// The end.
    Exit,
}

/// Something that takes time.
#[derive(Clone, Debug)]
pub enum Request {
    /// Read a profile by name or path.
    LoadProfile {
        /// Name or path.
        source: String,
    },
    /// Connect the instrument.
    Connect {
        /// What measures.
        instrument: InstrumentChoice,
        /// The robot that it looks at.
        profile: Box<Profile>,
    },
    /// Measure.
    Measure(MeasureRequest),
    /// Choose poses.
    Plan {
        /// The robot, with the target as chosen.
        profile: Box<Profile>,
        /// Text of the profile.
        profile_text: String,
        /// How many poses, and so on.
        request: Box<PlanRequest>,
    },
    /// Read the poses of a file.
    LoadPlan {
        /// Its path.
        file: String,
        /// The robot.
        profile: Box<Profile>,
    },
    /// Find configurations for the circle-point analysis.
    PlanCircles {
        /// The robot.
        profile: Box<Profile>,
    },
    /// Identify, and verify where there are verification samples.
    Identify(Box<IdentifyRequest>),
    /// Write the identified arm in the formats of others, and prove each.
    Model(Box<ModelsRequest>),
    /// Replace result files in the session's folder.
    Deliver {
        /// Name and text of each.
        files: Vec<(String, String)>,
        /// Models that were left out, with the reason.
        left_out: Vec<String>,
    },
}

impl Request {
    /// What it does, for a busy line.
    pub const fn what(&self) -> &'static str {
        match self {
            Self::LoadProfile { .. } => "reading the profile",
            Self::Connect { .. } => "connecting",
            Self::Measure(_) => "measuring",
            Self::Plan { .. } => "choosing poses",
            Self::LoadPlan { .. } => "reading the plan",
            Self::PlanCircles { .. } => "choosing circles",
            Self::Identify(_) => "identifying",
            Self::Model(_) => "writing and checking the models",
            Self::Deliver { .. } => "writing files",
        }
    }
}
