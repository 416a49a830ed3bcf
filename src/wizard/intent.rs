//! What the operator wants. Keys, menus and scripts all come down to these.

use serde::{Deserialize, Serialize};

use crate::session::set_up::{About, InstrumentChoice, TargetChoice};

/// Something the operator wants done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Intent {
    /// Go on to the next step.
    Next,
    /// Back to the step before; nothing measured is lost.
    Back,
    /// Stop what is running.
    Cancel,
    /// Leave the program; the session can be resumed.
    Quit,
    /// Take note of the message.
    Dismiss,
    /// Try again what failed.
    Retry,

    /// Take this robot: name of a shipped profile, or path of a file.
    ChooseProfile(String),
    /// Give the session this name.
    NameSession(String),
    /// Measure with this.
    ChooseInstrument(InstrumentChoice),
    /// Take the SMR to be here.
    ChooseTarget(TargetChoice),
    /// Find the SMR by circle-point analysis.
    StartCircles,
    /// Take the result of the circle-point analysis.
    UseCircles,
    /// Measure the circles again from the start.
    DiscardCircles,

    /// Choose poses.
    MakePlan(PlanSettings),
    /// Take the poses of a file.
    LoadPlan(String),
    /// Take the poses of the recorded measurements that are played.
    PlanFromRecording,
    /// Measure this plan.
    AcceptPlan,

    /// Measure at the pose shown.
    Measure,
    /// The coordinates that the instrument shows, typed or pasted.
    TypeReading(String),
    /// Take a reading that the gates have held back.
    AcceptReading,
    /// The sample in question counts as it is.
    Keep,
    /// The sample in question does not count.
    LeaveOut,
    /// Measure the pose in question again.
    MeasureAgain,
    /// Set right what was found, as proposed.
    ApplyRemedy,
    /// Do not measure the pose shown.
    Skip,
    /// Take the last sample back.
    Undo,
    /// Show another pose of the plan, by name.
    GoToPose(String),
    /// Write a remark to the pose shown.
    Note(String),
    /// Add so many more poses that tell most after those measured.
    SuggestPoses(usize),

    /// Identify the arm from what is measured.
    Identify,
    /// Say serial number, operator and place for the report.
    About(About),
    /// Write the result files.
    Deliver,
}

impl Intent {
    /// Its name, as in scripts.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Next => "Next",
            Self::Back => "Back",
            Self::Cancel => "Cancel",
            Self::Quit => "Quit",
            Self::Dismiss => "Dismiss",
            Self::Retry => "Retry",
            Self::ChooseProfile(_) => "ChooseProfile",
            Self::NameSession(_) => "NameSession",
            Self::ChooseInstrument(_) => "ChooseInstrument",
            Self::ChooseTarget(_) => "ChooseTarget",
            Self::StartCircles => "StartCircles",
            Self::UseCircles => "UseCircles",
            Self::DiscardCircles => "DiscardCircles",
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
            Self::Skip => "Skip",
            Self::Undo => "Undo",
            Self::GoToPose(_) => "GoToPose",
            Self::Note(_) => "Note",
            Self::SuggestPoses(_) => "SuggestPoses",
            Self::Identify => "Identify",
            Self::About(_) => "About",
            Self::Deliver => "Deliver",
        }
    }
}

/// How many poses, and of what kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanSettings {
    /// Poses to identify from.
    pub poses: usize,
    /// Poses to verify with.
    pub verification: usize,
    /// Candidates to choose from.
    pub candidates: usize,
    /// Seed of all random decisions.
    pub seed: u64,
    /// The first pose is measured again after so many; 0: never.
    pub drift_every: usize,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self { poses: 56, verification: 20, candidates: 5000, seed: 1, drift_every: 20 }
    }
}

/// What doing something would mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Danger {
    /// Nothing to fear.
    #[default]
    None,
    /// It takes a sample out of the result; it stays in the journal.
    DropsData,
    /// It ends the program.
    Leaves,
}

/// An intent on offer: the one source of footer, help and script checks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntentInfo {
    /// The intent; one with an argument carries a proposal for it.
    pub intent: Intent,
    /// What it does, in two or three words.
    pub label: String,
    /// Why it cannot be done now; `None`: it can.
    pub blocked: Option<String>,
    /// What it would mean.
    pub danger: Danger,
    /// The sensible thing to do next.
    pub is_default: bool,
}

impl IntentInfo {
    /// An intent that can be done.
    pub fn new(intent: Intent, label: impl Into<String>) -> Self {
        Self { intent, label: label.into(), blocked: None, danger: Danger::None, is_default: false }
    }

    /// Only possible where `reason` is `None`.
    #[must_use]
    pub fn unless(mut self, reason: Option<String>) -> Self {
        self.blocked = reason;
        self
    }

    /// Marks it as the sensible next thing, if it can be done.
    #[must_use]
    pub const fn default_action(mut self) -> Self {
        self.is_default = self.blocked.is_none();
        self
    }

    /// With what it would mean.
    #[must_use]
    pub const fn with_danger(mut self, danger: Danger) -> Self {
        self.danger = danger;
        self
    }

    /// Whether it can be done now.
    pub const fn is_enabled(&self) -> bool {
        self.blocked.is_none()
    }
}
