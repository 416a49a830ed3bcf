//! Intents: what the operator can ask for. Keys, menus and scripts all send these.

use serde::{Deserialize, Serialize};

use crate::procedure::plan::{INTERACTIVE_CANDIDATES, PlanRequest};
use crate::profile::datasheet::Datasheet;
use crate::profile::{BoxText, CellText};
use crate::session::about::About;
use crate::session::corrected::ProgramChoice;
use crate::session::set_up::{
    FacePair, InstrumentChoice, JointLimitsText, PayloadText, ProgramText, TargetChoice, TrackerPoints,
};

/// A command of the operator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Intent {
    /// Continue to the next step.
    Next,
    /// Go back to the previous step; nothing measured is lost.
    Back,
    /// Stop what is running.
    Cancel,
    /// Quit the program; the session can be resumed.
    Quit,
    Dismiss,
    Retry,

    /// Choose a robot by the name of a bundled profile or the path of a file.
    ChooseProfile(String),
    /// Describe a robot that is not in the list, by its data sheet.
    DescribeRobot(Box<Datasheet>),
    NameSession(String),
    /// Continue another session, by its folder.
    ResumeSession(String),
    ChooseInstrument(InstrumentChoice),
    /// Look for serial ports and the links of earlier sessions again.
    FindLinks,
    /// Choose where the SMR sits on the flange.
    ChooseTarget(TargetChoice),
    /// State what the flange carries besides the SMR.
    StatePayload(PayloadText),
    /// State instrument, tracker, limits, boxes and acceptance of this cell.
    DescribeCell(Box<CellText>),
    /// State where the tracker is by points that are known in the base and that it sees.
    PlaceTracker(TrackerPoints),
    /// State where the tracker is by the poses measured so far.
    PlaceTrackerByPoses,
    /// Compare one SMR in both faces of the instrument.
    CheckFaces(FacePair),
    /// State the joint limits of this cell.
    LimitJoints(JointLimitsText),
    /// Add a box that the arm must not touch.
    AddBox(BoxText),
    /// Locate the SMR by circle-point analysis.
    StartCircles,
    /// Measure the constants of the whole arm by circles of every joint.
    StartWholeArm,
    /// Save the measured arm as a profile.
    SaveArm,
    /// Use the result of the circle-point analysis.
    UseCircles,
    /// Discard the measured circles and start again.
    DiscardCircles,
    /// Move each joint by a few degrees and measure, to check its sign, zero, unit and coupling.
    StartJointCheck,
    /// Measure the joint check again.
    DiscardJointCheck,

    MakePlan(PlanSettings),
    /// Load the poses from a file.
    LoadPlan(String),
    /// Use the poses of the recorded measurements that are played back.
    PlanFromRecording,
    /// Accept the proposed plan for measuring.
    AcceptPlan,
    /// Write the robot program of the plan.
    WriteProgram(ProgramText),
    /// Confirm that the robot program was driven once by hand.
    ProgramDriven,

    /// Measure at the pose shown.
    Measure,
    /// Enter the coordinates shown by the instrument, typed or pasted.
    TypeReading(String),
    /// Accept a reading that the checks have held back.
    AcceptReading,
    /// Keep the questioned sample as it is.
    Keep,
    /// Exclude the questioned sample.
    LeaveOut,
    /// Measure the pose of the questioned sample again.
    MeasureAgain,
    /// Apply the proposed correction.
    ApplyRemedy,
    /// The arm is at the stop on the way that is shown.
    Passed,
    /// Go through home to the pose shown.
    ThroughHome,
    /// Turn the tracker to where the SMR is at the pose shown.
    TurnTracker,
    /// Skip the pose shown.
    Skip,
    /// Undo what was done last.
    Undo,
    /// Redo what was undone last.
    Redo,
    /// Exclude a pose of the plan, by name.
    Exclude(String),
    /// Let an excluded pose of the plan count again, by name.
    Include(String),
    /// Read points for this plan from a file of the tracker, to be looked at before they are taken.
    ReadPoints(String),
    /// Show points that were pasted, one per line, to be looked at before they are taken.
    ShowPoints(String),
    /// Take the points that are shown and fit.
    TakePoints,
    /// Take all points that are shown, and ask about those that do not fit.
    TakeAllPoints,
    /// Take none of the points that are shown.
    DropPoints,
    /// Go to another pose of the plan, by name.
    GoToPose(String),
    /// Attach a note to the pose shown.
    Note(String),
    /// Attach a note to another pose of the plan.
    NotePose {
        /// Name of the pose.
        pose: String,
        text: String,
    },
    /// Add this many poses, the most informative ones after those measured.
    SuggestPoses(usize),

    /// Identify the arm from the samples.
    Identify,
    /// Set serial number, operator and place for the report.
    About(Box<About>),
    /// Write the result files.
    Deliver,
    /// Correct a robot program with the result.
    CorrectProgram(Box<ProgramChoice>),
}

impl Intent {
    /// Name of the intent, as in scripts.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Next => "Next",
            Self::Back => "Back",
            Self::Cancel => "Cancel",
            Self::Quit => "Quit",
            Self::Dismiss => "Dismiss",
            Self::Retry => "Retry",
            Self::ChooseProfile(_) => "ChooseProfile",
            Self::DescribeRobot(_) => "DescribeRobot",
            Self::NameSession(_) => "NameSession",
            Self::ResumeSession(_) => "ResumeSession",
            Self::ChooseInstrument(_) => "ChooseInstrument",
            Self::FindLinks => "FindLinks",
            Self::ChooseTarget(_) => "ChooseTarget",
            Self::StatePayload(_) => "StatePayload",
            Self::DescribeCell(_) => "DescribeCell",
            Self::PlaceTracker(_) => "PlaceTracker",
            Self::PlaceTrackerByPoses => "PlaceTrackerByPoses",
            Self::CheckFaces(_) => "CheckFaces",
            Self::LimitJoints(_) => "LimitJoints",
            Self::AddBox(_) => "AddBox",
            Self::WriteProgram(_) => "WriteProgram",
            Self::ProgramDriven => "ProgramDriven",
            Self::StartCircles => "StartCircles",
            Self::StartWholeArm => "StartWholeArm",
            Self::SaveArm => "SaveArm",
            Self::UseCircles => "UseCircles",
            Self::DiscardCircles => "DiscardCircles",
            Self::StartJointCheck => "StartJointCheck",
            Self::DiscardJointCheck => "DiscardJointCheck",
            Self::MakePlan(_) => "MakePlan",
            Self::LoadPlan(_) => "LoadPlan",
            Self::PlanFromRecording => "PlanFromRecording",
            Self::AcceptPlan => "AcceptPlan",
            Self::Measure => "Measure",
            Self::TypeReading(_) => "TypeReading",
            Self::AcceptReading => "AcceptReading",
            Self::Keep => "Keep",
            Self::LeaveOut => "LeaveOut",
            Self::MeasureAgain => "MeasureAgain",
            Self::ApplyRemedy => "ApplyRemedy",
            Self::Passed => "Passed",
            Self::ThroughHome => "ThroughHome",
            Self::TurnTracker => "TurnTracker",
            Self::Skip => "Skip",
            Self::Undo => "Undo",
            Self::Redo => "Redo",
            Self::Exclude(_) => "Exclude",
            Self::Include(_) => "Include",
            Self::ReadPoints(_) => "ReadPoints",
            Self::ShowPoints(_) => "ShowPoints",
            Self::TakePoints => "TakePoints",
            Self::TakeAllPoints => "TakeAllPoints",
            Self::DropPoints => "DropPoints",
            Self::GoToPose(_) => "GoToPose",
            Self::Note(_) => "Note",
            Self::NotePose { .. } => "NotePose",
            Self::SuggestPoses(_) => "SuggestPoses",
            Self::Identify => "Identify",
            Self::About(_) => "About",
            Self::Deliver => "Deliver",
            Self::CorrectProgram(_) => "CorrectProgram",
        }
    }
}

/// Settings of a pose search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanSettings {
    /// Number of identification poses.
    pub poses: usize,
    /// Number of verification poses.
    pub verification: usize,
    /// Number of candidates to choose from.
    pub candidates: usize,
    pub seed: u64,
    /// The first pose is measured again after this many poses; 0: never.
    pub drift_every: usize,
}

impl Default for PlanSettings {
    fn default() -> Self {
        let PlanRequest { poses, verification, seed, drift_every, .. } = PlanRequest::default();
        Self { poses, verification, candidates: INTERACTIVE_CANDIDATES, seed, drift_every }
    }
}

/// Consequence of an intent that needs a confirmation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Danger {
    /// No confirmation needed.
    #[default]
    None,
    /// Removes a sample from the result; it stays in the journal.
    DropsData,
    /// Moves the head of the tracker.
    Turns,
    /// Ends the program.
    Leaves,
}

/// An intent on offer, from which footer, help and script checks are made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntentInfo {
    /// The intent itself; an argument carries a proposed value.
    pub intent: Intent,
    /// Effect of the intent in two or three words.
    pub label: String,
    /// Reason why it is not possible now; `None` if it is.
    pub blocked: Option<String>,
    pub danger: Danger,
    /// Whether this is the sensible next action.
    pub is_default: bool,
}

impl IntentInfo {
    /// An intent that is possible.
    pub fn new(intent: Intent, label: impl Into<String>) -> Self {
        Self { intent, label: label.into(), blocked: None, danger: Danger::None, is_default: false }
    }

    /// Blocks the intent if there is a reason.
    #[must_use]
    pub fn unless(mut self, reason: Option<String>) -> Self {
        self.blocked = reason;
        self
    }

    /// Marks the intent as the sensible next action, if it is possible.
    #[must_use]
    pub const fn default_action(mut self) -> Self {
        self.is_default = self.blocked.is_none();
        self
    }

    /// Sets the danger level.
    #[must_use]
    pub const fn with_danger(mut self, danger: Danger) -> Self {
        self.danger = danger;
        self
    }

    /// Whether the intent is possible now.
    pub const fn is_enabled(&self) -> bool {
        self.blocked.is_none()
    }
}
