//! The view model: plain data, the same for screens, plain lines and script expectations.
//!
//! Units are in the names. No residual of a fit is shown as an accuracy.

mod joint_check;
mod rows;
mod sessions;

use serde::Serialize;

use super::intent::{Intent, IntentInfo, PlanSettings};
use super::notice::{Notice, Severity};
use super::{Activity, RequestProgress, Wizard};
use crate::identification::{self, Iteration};
use crate::planning::{Figures, Stage};
use crate::procedure::plan;
use crate::profile::{Level, Profile};
use crate::session::about::About;
use crate::session::corrected::CorrectedText;
use crate::session::journal::{FindingCause, PlanText};
use crate::session::plan::PoseKind;
use crate::session::plan_summary::PlanSummary;
use crate::session::set_up::Step;
use crate::session::summary::{IdentificationSummary, Verdict, VerificationSummary, Warning, WorkspaceSummary};
use crate::session::wire::{KnownLinks, LinkChoice};
use crate::units::to_mm;
pub use joint_check::{JointCheckRow, JointCheckVerdict, JointCheckView};
pub use rows::{
    ExpectedView, MeasuredRow, ProposedPointView, ProposedState, ProposedView, RowState, RowView, SampleView,
};
pub use sessions::{SessionCard, SessionChoice};

/// Content of a screen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewModel {
    /// Session, step and progress.
    pub header: Header,
    /// Purpose of the step, in one sentence.
    pub purpose: &'static str,
    /// The part of the step.
    pub content: Content,
    /// Live reading of the instrument between measurements, if it has one.
    pub live: Option<LiveView>,
    /// The running request, if any.
    pub busy: Option<BusyView>,
    /// Message to the operator.
    pub notice: Option<Notice>,
    /// Intents that can be carried out.
    pub intents: Vec<IntentInfo>,
    /// Reason why the program ends, if it does.
    pub ended: Option<String>,
}

impl ViewModel {
    /// Whether such an intent is possible now.
    pub fn offers(&self, is_wanted: impl Fn(&Intent) -> bool) -> bool {
        self.intents.iter().any(|info| info.is_enabled() && is_wanted(&info.intent))
    }

    /// Whether the operator has to resolve something before continuing.
    pub fn is_stopped(&self) -> bool {
        self.notice.as_ref().is_some_and(|notice| notice.severity == Severity::Stop)
    }
}

impl Header {
    /// Whether everything so far is in the journal, in a word.
    pub const fn saving(&self) -> &'static str {
        match (self.is_unsaved, self.is_saving) {
            (true, _) => "NOT SAVED",
            (false, true) => "saving",
            (false, false) => "saved",
        }
    }
}

/// Live reading of the instrument between measurements. Never a measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiveView {
    /// Position of the SMR in the frame of the instrument, if it is seen.
    pub point_mm: Option<[f64; 3]>,
    /// Whether the instrument shows nothing between measurements, whatever it sees.
    pub is_blind: bool,
    /// Time without any message (s) from an instrument that sends continuously.
    pub silent_s: Option<f64>,
    /// Time that the SMR has been still.
    pub rest_s: Option<f64>,
    /// Root mean square scatter while it was still.
    pub scatter_mm: Option<f64>,
    /// Distance from the predicted point of the pose shown, once the samples locate the tracker.
    pub from_predicted_mm: Option<f64>,
    /// Joints that the robot reports: pendant values (rad).
    pub joints: Option<Vec<f64>>,
    /// The same as the pendant shows them (deg, sliding joints mm); empty where none are reported.
    pub joints_shown: Vec<f64>,
    /// Where the nominal arm has flange and SMR at these joints, in the base.
    pub flange_in_base_mm: Option<[f64; 3]>,
    pub smr_in_base_mm: Option<[f64; 3]>,
    /// Index (from 0) of the joint that is farthest from the pose shown, and its difference (deg).
    pub joint_difference: Option<(usize, f64)>,
    /// Whether the robot is at rest, if it reports that.
    pub is_still: Option<bool>,
    /// Pose at which the robot rests, if it is not the one shown.
    pub at_pose: Option<String>,
    /// Reason why the instrument cannot be used.
    pub down: Option<String>,
    /// Readings of the last seconds.
    pub track: Vec<LivePoint>,
}

/// Position of the SMR some time ago.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LivePoint {
    /// Time before the last reading (s).
    pub seconds: f64,
    /// Distance from the latest position.
    pub offset_mm: f64,
}

/// Session, step and progress.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Header {
    pub robot: Option<String>,
    pub session: Option<String>,
    pub folder: Option<String>,
    /// The folder with its whole path, for a copy from another computer.
    #[serde(skip)]
    pub folder_from_root: Option<String>,
    pub step: Step,
    /// Number of the step, from 1.
    pub number: usize,
    pub steps: usize,
    /// Identity of the instrument, if it is connected.
    pub instrument: Option<String>,
    /// Samples that count.
    pub samples: usize,
    /// Minutes of work, without breaks.
    pub elapsed_min: f64,
    /// Journal entries that are safely on disk.
    pub saved_entries: u64,
    /// Whether an entry is being written.
    pub is_saving: bool,
    /// Whether the last change could not be saved.
    pub is_unsaved: bool,
}

/// The running request, if any.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BusyView {
    pub what: &'static str,
    /// Progress in words.
    pub progress: Option<String>,
    /// Completed fraction, 0 … 1, where it is known; it never decreases, and reaches 1 only with the answer.
    pub part: Option<f64>,
    /// Figures of merit of the best pose set so far, while a search runs.
    pub figures: Option<Figures>,
    /// Whether it is being cancelled.
    pub is_cancelled: bool,
}

/// The part of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Content {
    /// Choice of the robot.
    Profile(ProfileView),
    /// Choice of the instrument.
    Instrument(InstrumentView),
    /// Position of the SMR on the flange.
    Target(Box<TargetView>),
    /// Choice of the poses.
    Plan(PlanView),
    /// Measurement.
    Capture(Box<CaptureView>),
    /// The identified arm.
    Identify(IdentifyView),
    /// Accuracy on the verification poses.
    Verify(VerifyView),
    /// The result files.
    Deliver(DeliverView),
}

/// The view of the profile step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileView {
    /// Names of the bundled profiles.
    pub profiles: Vec<String>,
    /// The selected profile.
    pub chosen: Option<ProfileCard>,
    /// Name of the session, or the proposed one.
    pub session: String,
    /// Whether the robot can no longer be changed.
    pub is_fixed: bool,
    /// Sessions that can be continued instead: folder, name, and what is known about them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<SessionChoice>,
}

/// Summary of a robot profile.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileCard {
    pub name: String,
    pub title: String,
    /// Origin of its numbers.
    pub source: String,
    pub joints: Vec<String>,
    /// Number of parameters to identify.
    pub free_parameters: usize,
    /// Maker and type of the instrument.
    pub instrument: Option<String>,
    /// Nominal position of the SMR in the flange frame.
    pub target_mm: Option<[f64; 3]>,
    /// Where the flange is at all zeros, as the pendant shows it.
    pub flange_at_zero_mm: [f64; 3],
    /// Oddities found when the profile was read.
    pub warnings: Vec<String>,
    /// The robot itself, to be drawn.
    #[serde(skip)]
    pub profile: Option<Box<Profile>>,
}

impl ProfileCard {
    pub(super) fn new(profile: &Profile, warnings: Vec<String>) -> Self {
        Self {
            name: profile.name().to_owned(),
            title: profile.title().to_owned(),
            source: profile.source().to_owned(),
            joints: profile.chain().joints().iter().map(|joint| joint.name.clone()).collect(),
            free_parameters: profile.parameters(Level::Geometric).len(),
            instrument: profile.instrument().map(|instrument| instrument.name.clone()),
            target_mm: profile.targets().first().map(|target| {
                let point = target.position_in_flange;
                [to_mm(point.x), to_mm(point.y), to_mm(point.z)]
            }),
            flange_at_zero_mm: profile.flange_at_zero(),
            warnings,
            profile: Some(Box::new(profile.clone())),
        }
    }
}

/// The view of the instrument step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InstrumentView {
    /// Link described in the profile.
    pub link: Option<LinkChoice>,
    /// Links of earlier sessions and serial ports.
    #[serde(skip)]
    pub known: KnownLinks,
    /// The choice in words.
    pub choice: Option<String>,
    /// Identity of the connected instrument.
    pub identity: Option<String>,
    /// Poses of recorded measurements.
    pub recorded_poses: usize,
    /// Uncertainty of the instrument as the profile states it.
    pub stated_sigma: Option<String>,
    /// The cell in words: instrument, tracker, acceptance, limits and boxes.
    pub cell: Option<String>,
}

/// The view of the target step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetView {
    /// Position of the SMR in the flange frame, from the profile.
    pub nominal_mm: [f64; 3],
    /// Standard deviation of that position; zero: exact.
    pub nominal_sigma_mm: f64,
    /// The choice in words.
    pub choice: Option<String>,
    /// The payload that was stated, in words.
    pub payload: Option<String>,
    /// The circle-point analysis, once it has begun.
    pub circles: Option<CirclesView>,
    /// The joint check, once it has begun.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_check: Option<JointCheckView>,
    /// Whether the joint check is advisable: the profile is new, and nothing has shown yet that it fits the robot.
    pub advises_joint_check: bool,
}

/// The view of the circle-point analysis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CirclesView {
    /// Joint that is turned.
    pub joint: Option<String>,
    /// Configuration to go to.
    pub joints: Vec<JointShown>,
    /// Number of points measured.
    pub measured: usize,
    /// Number of points to measure.
    pub of: usize,
    /// The circle of each joint.
    pub fits: Vec<CircleView>,
    /// Position of the SMR.
    pub result: Option<CirclesResult>,
    /// The whole arm, if every joint was moved.
    pub arm: Option<ArmView>,
    /// Reason why there is no result.
    pub problem: Option<String>,
    /// Unit of the coordinates, if they are typed.
    pub typed_unit: Option<String>,
}

/// A whole arm from circles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmView {
    pub constants: Vec<ConstantView>,
    /// Centre of the SMR in the flange frame.
    pub smr_mm: [f64; 3],
    /// Where the tracker is in the base.
    pub tracker_mm: [f64; 3],
    /// Largest distance of a point from where the measured arm puts it.
    pub worst_mm: f64,
}

/// A constant of a measured arm (mm, degree).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConstantView {
    pub name: String,
    pub unit: String,
    pub measured: f64,
    pub sigma: f64,
    pub nominal: Option<f64>,
    pub difference: Option<f64>,
    /// Whether the difference is too large for an assembly error.
    pub is_astonishing: bool,
}

/// A fitted circle, in the tracker frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CircleView {
    /// Joint that was turned.
    pub joint: String,
    pub points: usize,
    pub centre_mm: [f64; 3],
    /// Direction of the axis.
    pub axis: [f64; 3],
    pub radius_mm: f64,
    /// Root mean square distance of the points from the circle.
    pub residual_rms_mm: f64,
    /// Arc that the points cover.
    pub arc_deg: f64,
}

/// Position of the SMR, from the circles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CirclesResult {
    /// Centre of the SMR in the flange frame.
    pub xyz_mm: [f64; 3],
    /// Standard deviation of each coordinate.
    pub sigma_mm: [f64; 3],
    /// Root mean square distance of the points from the adjusted circles.
    pub residual_rms_mm: f64,
}

/// A joint of the configuration to go to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointShown {
    /// Name on the pendant.
    pub name: String,
    /// Pendant value, in `unit`.
    pub value: f64,
    /// `deg` or `mm`.
    pub unit: String,
    /// Distance from the value at the last sample, in `unit`.
    pub moves: f64,
    /// Whether no other joint moves farther.
    pub moves_most: bool,
}

/// The robot program of a plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProgramView {
    /// Files, language and waits.
    pub text: String,
    /// Whether the operator has confirmed that it was driven once by hand.
    pub was_driven: bool,
}

/// The view of the plan step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanView {
    /// The robot program of the accepted plan, if it was written.
    pub program: Option<ProgramView>,
    /// Settings of the next search.
    pub settings: PlanSettings,
    /// The proposed plan.
    pub proposal: Option<PlanFigures>,
    /// All figures of the proposal, if poses were chosen.
    pub summary: Option<Box<PlanSummary>>,
    /// The plan that is being measured.
    pub accepted: Option<PlanFigures>,
    /// Poses still to be measured.
    pub left: usize,
    /// Samples that count.
    pub measured: usize,
}

/// A summary of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanFigures {
    /// The plan without its rows.
    #[serde(flatten)]
    pub plan: PlanText,
    /// Number of identification poses.
    pub identification: usize,
    /// Number of verification poses.
    pub verification: usize,
}

/// The view of the capture step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaptureView {
    /// Row of the plan that is shown.
    pub row: Option<usize>,
    pub pose: Option<String>,
    pub kind: Option<PoseKind>,
    /// Configuration to go to next, in pendant values.
    pub joints: Vec<JointShown>,
    /// Stops on the way to the pose; the configuration is that of the first one.
    pub on_the_way: Vec<String>,
    /// Check of the move to that configuration.
    pub move_check: MoveCheck,
    /// Point of the SMR in the robot base, from the nominal arm.
    pub predicted_point_in_base_mm: Option<[f64; 3]>,
    /// Samples that count.
    pub measured: usize,
    /// Poses still to be measured.
    pub open: usize,
    /// Number of skipped poses.
    pub skipped: usize,
    /// Identification samples that count.
    pub identification: usize,
    /// Verification samples that count.
    pub verification: usize,
    /// Time for the open poses at the pace so far.
    pub minutes_left: Option<f64>,
    pub last: Option<SampleView>,
    /// Reason why a reading is held back.
    pub held: Option<String>,
    /// The finding to decide about.
    pub finding: Option<FindingView>,
    /// Repeated measurements of the drift pose.
    pub drift: Vec<DriftView>,
    /// Predicted quality of a calibration from the samples so far.
    pub prediction: Option<PredictionView>,
    /// Unit of the coordinates, if they are typed.
    pub typed_unit: Option<String>,
    /// Reason why it is too early to identify.
    pub too_few: Option<String>,
    /// All rows of the plan that are to be measured.
    pub rows: Vec<RowView>,
    /// Where the instrument will see the SMR at the pose shown, once the samples say where it stands.
    pub expected: Option<ExpectedView>,
    /// Whether the fit of the rows is to the nominal arm, because no result is of the samples that count now.
    pub fit_is_nominal: bool,
    /// Points that are shown before they are taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proposed: Option<ProposedView>,
    /// Notes with their poses.
    pub notes: Vec<(Option<String>, String)>,
    /// Refused measurements: pose and reason.
    pub refused: Vec<(String, String)>,
}

/// Check of the move to the next configuration.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MoveCheck {
    /// It is free of collisions.
    Free {
        /// Name of the stop where the arm is.
        from: String,
    },
    /// Something is in the way, and no free way is known.
    Blocked {
        /// Name of the stop where the arm is.
        from: String,
        obstruction: String,
    },
    /// Nothing can be said.
    NotChecked { reason: String },
    /// The arm is there.
    #[default]
    Arrived,
}

/// The finding to decide about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingView {
    /// Pose of the sample.
    pub pose: String,
    pub measurement: u64,
    pub cause: FindingCause,
    pub message: String,
    /// Whether a correction is proposed.
    pub has_remedy: bool,
    /// The distances from this sample that fit worst, the worst first.
    pub worst: Vec<PairView>,
}

/// A measured distance and its prediction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairView {
    /// Pose at the other end.
    pub pose: String,
    /// Whether the other end is a repeated measurement of its pose, to detect drift.
    pub is_drift: bool,
    /// Measured distance.
    pub measured_mm: f64,
    /// Distance predicted from the nominal arm and the points before.
    pub predicted_mm: f64,
    /// Measured − predicted.
    pub difference_mm: f64,
    /// Expected standard deviation of the difference.
    pub expected_mm: f64,
}

/// Distance that a pose has moved since it was first measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftView {
    pub pose: String,
    /// Number of the measurement.
    pub measurement: u64,
    pub moved_mm: f64,
}

/// Predicted quality of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictionView {
    /// Predicted error against the number of identification samples.
    pub curve_mm: Vec<(usize, f64)>,
    /// Predicted error with the samples so far.
    pub now_mm: f64,
    /// Predicted error with the rest of the plan.
    pub with_all_mm: Option<f64>,
    /// Largest error that the profile accepts, if it states one: RMS or mean.
    pub limit_mm: Option<f64>,
    /// Number of identification poses that are still open.
    pub open: usize,
    /// Whether the remaining poses are not worth their time: the error is well below the limit, or they hardly change it.
    pub is_enough: bool,
}

/// The view of the identify step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifyView {
    /// Identification samples that count.
    pub samples: usize,
    /// Whether the result is based on exactly the samples that count now.
    pub is_current: bool,
    /// The result, without its verification.
    pub summary: Option<Box<IdentificationSummary>>,
    /// Whether there is a usable solution.
    pub is_usable: bool,
}

/// The view of the verify step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyView {
    /// Verification samples that count.
    pub samples: usize,
    /// Whether the result is based on exactly the samples that count now.
    pub is_current: bool,
    /// Reason why nothing can be verified.
    pub too_few: Option<String>,
    /// The error predicted over the workspace, for data with points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace: Option<WorkspaceSummary>,
    /// Errors at points that the identification did not use.
    pub verification: Option<Box<VerificationSummary>>,
    /// Comparison with the acceptance limits.
    pub verdict: Option<Box<Verdict>>,
    /// Warnings to read before the numbers are used.
    pub warnings: Vec<Warning>,
}

/// The view of the deliver step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeliverView {
    pub files: Vec<String>,
    /// Models that cannot express this arm, with the reason.
    pub left_out: Vec<String>,
    /// Comparison with the acceptance limits.
    pub verdict: Option<Box<Verdict>>,
    /// Whether the result is based on exactly the samples that count now.
    pub is_current: bool,
    /// Serial number, operator and place for the report.
    pub about: About,
    /// Robot programs that were corrected with the result.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub corrected: Vec<CorrectedText>,
}

/// A folder with its whole path.
fn from_root(folder: &str) -> Option<String> {
    std::path::absolute(folder).ok().map(|folder| folder.display().to_string())
}

/// Builds the view of a wizard.
pub(super) fn build(wizard: &Wizard) -> ViewModel {
    let session = &wizard.session;
    let step = wizard.phase.step();
    let elapsed = session.worked / 60.0;
    ViewModel {
        header: Header {
            robot: session.robot.as_ref().map(|robot| robot.profile.title().to_owned()),
            session: wizard.folder.is_some().then(|| session.name.clone()),
            folder: wizard.folder.clone(),
            folder_from_root: wizard.folder.as_deref().and_then(from_root),
            step,
            number: step.number(),
            steps: Step::ALL.len(),
            instrument: wizard.connection.as_ref().map(|connection| connection.identity.clone()),
            samples: session.counted().count(),
            elapsed_min: elapsed,
            saved_entries: session.lines,
            is_saving: wizard.activity() == Activity::Working && wizard.writing.is_some(),
            is_unsaved: wizard.activity() == Activity::Stuck,
        },
        purpose: purpose(step),
        content: wizard.phase.content(&wizard.cx()),
        live: wizard.live.view(session, wizard.phase.shown_row()),
        busy: wizard.busy.as_ref().map(|busy| BusyView {
            what: busy.what,
            progress: busy.progress.as_ref().map(progress_text),
            part: busy.done.part(),
            figures: busy.progress.as_ref().and_then(figures),
            is_cancelled: busy.cancelled,
        }),
        notice: wizard.notice.clone(),
        intents: wizard.intents(),
        ended: wizard.ended.clone(),
    }
}

pub(crate) const fn purpose(step: Step) -> &'static str {
    match step {
        Step::Profile => "Choose the robot to calibrate.",
        Step::Instrument => "Choose what measures the reflector (SMR).",
        Step::Target => "Say where the reflector (SMR) sits on the flange.",
        Step::Plan => "Choose the poses to measure.",
        Step::Capture => "Move the robot to the configuration shown, then measure.",
        Step::Identify => "Identify the kinematic errors of the arm.",
        Step::Verify => "See how accurate the arm is at points not used so far.",
        Step::Deliver => "Write the results.",
    }
}

fn progress_text(progress: &RequestProgress) -> String {
    match progress {
        RequestProgress::Search(plan::Progress::Searching) => "the candidates are known".to_owned(),
        RequestProgress::Search(plan::Progress::Unreachable { poses }) => {
            format!("{poses} poses cannot be reached without a collision: choosing others")
        }
        RequestProgress::Search(plan::Progress::Sweep { found, starts, .. }) => {
            let stage = match found.stage {
                Stage::Prediction => "predicting",
                Stage::Objective { .. } => "choosing",
            };
            format!("{stage}, start {} of {starts}", found.start + 1)
        }
        RequestProgress::Identify(identification::Stage::Step(Iteration { cost, step, .. })) => {
            format!("cost {cost:.6e}, largest change {step:.1e} expected deviations")
        }
        RequestProgress::Identify(identification::Stage::Candidate { number, of, terms }) => {
            format!("model {number} of {of}: {terms}")
        }
    }
}

/// Figures of merit of the best pose set after a sweep of a search.
const fn figures(progress: &RequestProgress) -> Option<Figures> {
    match progress {
        RequestProgress::Search(plan::Progress::Sweep { found, .. }) => Some(found.figures),
        RequestProgress::Search(_) | RequestProgress::Identify(_) => None,
    }
}
