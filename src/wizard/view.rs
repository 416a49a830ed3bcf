//! What there is to see: plain data, the same for screens, plain lines and script expectations.
//!
//! Units are in the names; nothing here is more than was measured, and no number of a fit stands as accuracy.

use serde::Serialize;

use super::intent::{IntentInfo, PlanSettings};
use super::notice::{Notice, Severity};
use super::{Progress, Wizard};
use crate::planning::{Figures, Stage};
use crate::procedure::plan;
use crate::profile::{Level, Profile};
use crate::session::journal::{FindingCause, PlanText};
use crate::session::plan::PoseKind;
use crate::session::plan_summary::PlanSummary;
use crate::session::set_up::{About, Step};
use crate::session::summary::{IdentificationSummary, Verdict, VerificationSummary, Warning};
use crate::session::wire::LinkChoice;
use crate::units::to_mm;

/// Everything on a screen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewModel {
    /// Where one is.
    pub header: Header,
    /// What this step is for, in one sentence.
    pub purpose: &'static str,
    /// The step's own part.
    pub content: Content,
    /// What the instrument sees while nothing is measured, if it shows that.
    pub live: Option<LiveView>,
    /// What is under way.
    pub busy: Option<BusyView>,
    /// What the operator is to be told.
    pub notice: Option<Notice>,
    /// What can be done.
    pub intents: Vec<IntentInfo>,
    /// Why the program ends, if it does.
    pub ended: Option<String>,
}

/// What the instrument sees while nothing is measured. Never a measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiveView {
    /// The SMR in the frame of the instrument, if it is seen.
    pub point_mm: Option<[f64; 3]>,
    /// The instrument shows nothing between measurements, whatever it sees.
    pub is_blind: bool,
    /// Nothing has been heard from the instrument for so long (s), where something is due all the time.
    pub silent_s: Option<f64>,
    /// How long it has rested where it is.
    pub rest_s: Option<f64>,
    /// How much it scattered meanwhile, root mean square.
    pub scatter_mm: Option<f64>,
    /// Its distance from where the pose shown should have it, once the samples tell where the tracker stands.
    pub from_predicted_mm: Option<f64>,
    /// Joints that the robot tells: pendant values (rad).
    pub joints: Option<Vec<f64>>,
    /// The joint that is farthest from the pose shown, from 0, and by how much (deg).
    pub joint_difference: Option<(usize, f64)>,
    /// Whether the robot rests, if it tells.
    pub is_still: Option<bool>,
    /// Why the instrument cannot be asked.
    pub down: Option<String>,
    /// The last seconds.
    pub track: Vec<LivePoint>,
}

/// Where the SMR was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LivePoint {
    /// When, counted back from the last one (s).
    pub seconds: f64,
    /// Distance from where it is now.
    pub offset_mm: f64,
}

/// Where one is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Header {
    /// Title of the robot.
    pub robot: Option<String>,
    /// Name of the session.
    pub session: Option<String>,
    /// Its folder.
    pub folder: Option<String>,
    /// The step.
    pub step: Step,
    /// Its number, from 1.
    pub number: usize,
    /// Number of steps.
    pub steps: usize,
    /// Who measures, if it answers.
    pub instrument: Option<String>,
    /// Samples that count.
    pub samples: usize,
    /// Minutes of work, breaks not counted.
    pub elapsed_min: f64,
    /// Entries of the journal that are safely on disk.
    pub saved_entries: u64,
    /// Whether an entry is on its way to the disk.
    pub is_saving: bool,
}

/// What is under way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BusyView {
    /// What.
    pub what: &'static str,
    /// How far it is, in words.
    pub progress: Option<String>,
    /// Part done, 0 … 1, where it can be told.
    pub part: Option<f64>,
    /// Figures of merit of the best pose set so far, while a search runs.
    pub figures: Option<Figures>,
    /// It is being cancelled.
    pub is_cancelled: bool,
}

/// A step's own part.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Content {
    /// Which robot.
    Profile(ProfileView),
    /// What measures.
    Instrument(InstrumentView),
    /// Where the SMR sits.
    Target(TargetView),
    /// Which poses.
    Plan(PlanView),
    /// Measuring.
    Capture(Box<CaptureView>),
    /// The result.
    Identify(IdentifyView),
    /// What it is worth.
    Verify(VerifyView),
    /// Files.
    Deliver(DeliverView),
}

/// The profile step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileView {
    /// Names of the shipped profiles.
    pub profiles: Vec<String>,
    /// The one that is looked at.
    pub chosen: Option<ProfileCard>,
    /// Name that the session has or will have.
    pub session: String,
    /// The robot cannot be changed any more.
    pub is_fixed: bool,
}

/// A robot at a glance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileCard {
    /// Short name.
    pub name: String,
    /// Name for people.
    pub title: String,
    /// Where its numbers come from.
    pub source: String,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Parameters that will be identified.
    pub free_parameters: usize,
    /// Maker and type of the instrument.
    pub instrument: Option<String>,
    /// Nominal place of the SMR in the flange.
    pub target_mm: Option<[f64; 3]>,
    /// What is odd about it.
    pub warnings: Vec<String>,
}

impl ProfileCard {
    pub(super) fn new(profile: &Profile, warnings: Vec<String>) -> Self {
        Self {
            name: profile.name().to_owned(),
            title: profile.title().to_owned(),
            source: profile.source().to_owned(),
            joints: profile.chain().joints().iter().map(|joint| joint.name.clone()).collect(),
            free_parameters: profile.free_parameters(Level::Geometric).len(),
            instrument: profile.instrument().map(|instrument| instrument.name.clone()),
            target_mm: profile.targets().first().map(|target| {
                let point = target.position_in_flange;
                [to_mm(point.x), to_mm(point.y), to_mm(point.z)]
            }),
            warnings,
        }
    }
}

/// The instrument step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InstrumentView {
    /// Instrument on a wire that the profile names.
    pub link: Option<LinkChoice>,
    /// What was chosen.
    pub choice: Option<String>,
    /// Who answers.
    pub identity: Option<String>,
    /// Poses of recorded measurements.
    pub recorded_poses: usize,
    /// What the profile says about the instrument's uncertainty.
    pub stated_sigma: Option<String>,
}

/// The target step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetView {
    /// Where the profile has the SMR, in the flange frame.
    pub nominal_mm: [f64; 3],
    /// Its standard deviation there; zero: exact.
    pub nominal_sigma_mm: f64,
    /// What was chosen, in words.
    pub choice: Option<String>,
    /// The circle-point analysis, if it was begun.
    pub circles: Option<CirclesView>,
}

/// The circle-point analysis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CirclesView {
    /// Joint that is turned.
    pub joint: Option<String>,
    /// Configuration to go to.
    pub joints: Vec<JointShown>,
    /// Points measured.
    pub measured: usize,
    /// Points in all.
    pub of: usize,
    /// What each circle says.
    pub fits: Vec<CircleView>,
    /// Where the SMR is.
    pub result: Option<CirclesResult>,
    /// Why there is no result.
    pub problem: Option<String>,
    /// Unit of the coordinates, where they are typed in.
    pub typed_unit: Option<String>,
}

/// A fitted circle, in the tracker frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CircleView {
    /// Joint that was turned.
    pub joint: String,
    /// Points.
    pub points: usize,
    /// Centre.
    pub centre_mm: [f64; 3],
    /// Direction of the axis.
    pub axis: [f64; 3],
    /// Radius.
    pub radius_mm: f64,
    /// Root mean square distance of the points from the circle.
    pub residual_rms_mm: f64,
    /// Arc that the points cover.
    pub arc_deg: f64,
}

/// What the circles say about the SMR.
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
    /// How far it moves from the last sample.
    pub moves: f64,
    /// No other moves farther.
    pub moves_most: bool,
}

/// The plan step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanView {
    /// Settings for the next choice.
    pub settings: PlanSettings,
    /// What is proposed.
    pub proposal: Option<PlanFigures>,
    /// All numbers of the proposal, if poses were chosen.
    pub summary: Option<Box<PlanSummary>>,
    /// What is being measured.
    pub accepted: Option<PlanFigures>,
    /// Poses that wait to be measured.
    pub left: usize,
    /// Samples that count.
    pub measured: usize,
}

/// A plan in short.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanFigures {
    /// The plan without its rows.
    #[serde(flatten)]
    pub plan: PlanText,
    /// Poses to identify from.
    pub identification: usize,
    /// Poses to verify with.
    pub verification: usize,
}

/// The capture step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaptureView {
    /// Row of the plan that is shown.
    pub row: Option<usize>,
    /// Its pose.
    pub pose: Option<String>,
    /// What it is for.
    pub kind: Option<PoseKind>,
    /// Configuration to go to, pendant convention.
    pub joints: Vec<JointShown>,
    /// Poses to pass through on the way.
    pub on_the_way: Vec<String>,
    /// Where the nominal arm has the SMR there, in the robot base.
    pub predicted_point_in_base_mm: Option<[f64; 3]>,
    /// Samples that count.
    pub measured: usize,
    /// Poses that wait to be measured.
    pub open: usize,
    /// Poses that are skipped.
    pub skipped: usize,
    /// Identification samples that count.
    pub identification: usize,
    /// Verification samples that count.
    pub verification: usize,
    /// Time for the rest at the pace so far.
    pub minutes_left: Option<f64>,
    /// The last sample.
    pub last: Option<SampleView>,
    /// Why a reading is held back.
    pub held: Option<String>,
    /// What is in question.
    pub finding: Option<FindingView>,
    /// The pose that is measured again.
    pub drift: Vec<DriftView>,
    /// How good a calibration from the samples so far would be.
    pub prediction: Option<PredictionView>,
    /// Unit of the coordinates, where they are typed in.
    pub typed_unit: Option<String>,
    /// Why it is too early to identify.
    pub too_few: Option<String>,
    /// All measured rows of the plan.
    pub rows: Vec<RowView>,
    /// Remarks with their poses.
    pub notes: Vec<(Option<String>, String)>,
    /// Measurements that gave no sample, with their poses and reasons.
    pub refused: Vec<(String, String)>,
}

/// A sample in short.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleView {
    /// Number of the measurement.
    pub measurement: u64,
    /// Its pose.
    pub pose: String,
    /// Measured point in the tracker frame.
    pub xyz_mm: [f64; 3],
    /// Scatter of its shots.
    pub scatter_mm: Option<f64>,
    /// Whether it counts.
    pub counts: bool,
}

/// What is in question.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingView {
    /// Pose of the sample.
    pub pose: String,
    /// Number of its measurement.
    pub measurement: u64,
    /// The likely cause.
    pub cause: FindingCause,
    /// In words.
    pub message: String,
    /// Whether a correction is proposed.
    pub has_remedy: bool,
    /// The distances from this sample that fit least, worst first.
    pub worst: Vec<PairView>,
}

/// A measured distance against its prediction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairView {
    /// Pose at the other end.
    pub pose: String,
    /// The other end is a later measurement of the pose, to see drift.
    pub is_drift: bool,
    /// As it was measured.
    pub measured_mm: f64,
    /// As the nominal arm and the points before let expect.
    pub predicted_mm: f64,
    /// Measured less predicted.
    pub difference_mm: f64,
    /// Standard deviation that the difference should have.
    pub expected_mm: f64,
}

/// How far a pose has moved since it was measured first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftView {
    /// The pose.
    pub pose: String,
    /// Number of the measurement.
    pub measurement: u64,
    /// How far.
    pub moved_mm: f64,
}

/// How good a calibration would be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictionView {
    /// Predicted error per σ after so many identification samples.
    pub curve_sigma: Vec<(usize, f64)>,
    /// With the samples so far, per σ.
    pub now_sigma: f64,
    /// The same for the instrument of the profile: what it causes, without what no kinematic model can express.
    pub now_mm: Option<f64>,
    /// With the rest of the plan, per σ.
    pub with_all_sigma: Option<f64>,
    /// The same for the instrument of the profile.
    pub with_all_mm: Option<f64>,
    /// The rest is not worth its time.
    pub is_enough: bool,
}

/// What has become of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RowState {
    /// Waits.
    Open,
    /// Its sample counts.
    Measured,
    /// Its sample does not count.
    LeftOut,
    /// Not to be measured.
    Skipped,
}

/// A row of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowView {
    /// Row of the plan, from 0.
    pub row: usize,
    /// Its pose.
    pub pose: String,
    /// What it is for.
    pub kind: PoseKind,
    /// What has become of it.
    pub state: RowState,
}

/// The identify step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifyView {
    /// Identification samples that count.
    pub samples: usize,
    /// Whether the result rests on exactly the samples that count now.
    pub is_current: bool,
    /// The result, without its verification.
    pub summary: Option<Box<IdentificationSummary>>,
    /// Whether there is a usable solution.
    pub is_usable: bool,
}

/// The verify step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyView {
    /// Verification samples that count.
    pub samples: usize,
    /// Whether the result rests on exactly the samples that count now.
    pub is_current: bool,
    /// Why nothing can be said.
    pub too_few: Option<String>,
    /// Errors on points that the identification did not see.
    pub verification: Option<Box<VerificationSummary>>,
    /// Against the acceptance limits.
    pub verdict: Option<Box<Verdict>>,
    /// What must be known before the numbers are used.
    pub warnings: Vec<Warning>,
}

/// The deliver step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeliverView {
    /// Files that were written.
    pub files: Vec<String>,
    /// Models that this arm does not fit into, with the reason.
    pub left_out: Vec<String>,
    /// Against the acceptance limits.
    pub verdict: Option<Box<Verdict>>,
    /// Whether the result rests on exactly the samples that count now.
    pub is_current: bool,
    /// Serial number, operator and place, as the report will have them.
    pub about: About,
}

/// The view of a wizard.
pub(super) fn build(wizard: &Wizard) -> ViewModel {
    let session = &wizard.session;
    let step = wizard.phase.step();
    let elapsed = session.worked / 60.0;
    ViewModel {
        header: Header {
            robot: session.robot.as_ref().map(|robot| robot.profile.title().to_owned()),
            session: wizard.folder.is_some().then(|| session.name.clone()),
            folder: wizard.folder.clone(),
            step,
            number: step.number(),
            steps: Step::ALL.len(),
            instrument: wizard.connection.as_ref().map(|connection| connection.identity.clone()),
            samples: session.counted().count(),
            elapsed_min: elapsed,
            saved_entries: session.lines,
            is_saving: wizard.writing.is_some(),
        },
        purpose: purpose(step),
        content: wizard.phase.content(&wizard.cx()),
        live: wizard.live.view(session, wizard.phase.shown_row()),
        busy: wizard.busy.as_ref().map(|busy| BusyView {
            what: busy.what,
            progress: busy.progress.as_ref().map(progress_text),
            part: busy.progress.as_ref().and_then(part_done),
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

fn progress_text(progress: &Progress) -> String {
    match progress {
        Progress::Search(plan::Progress::Searching) => "the candidates are known".to_owned(),
        Progress::Search(plan::Progress::Unreachable { poses }) => {
            format!("{poses} poses cannot be reached without a collision: choosing again")
        }
        Progress::Search(plan::Progress::Sweep { found, starts, .. }) => {
            let stage = match found.stage {
                Stage::Prediction => "predicting",
                Stage::Objective { .. } => "choosing",
            };
            format!(
                "{stage}, start {} of {starts}: condition {:.1}, predicted error {:.3} sigma",
                found.start + 1,
                found.figures.condition_number,
                found.figures.predicted_error
            )
        }
        Progress::Solver(iteration) => {
            format!("cost {:.6e}, largest change {:.1e} expected deviations", iteration.cost, iteration.step)
        }
    }
}

/// Figures of merit of the best pose set after a sweep of a search.
const fn figures(progress: &Progress) -> Option<Figures> {
    match progress {
        Progress::Search(plan::Progress::Sweep { found, .. }) => Some(found.figures),
        Progress::Search(_) | Progress::Solver(_) => None,
    }
}

/// Part of the stage of a search that is done.
fn part_done(progress: &Progress) -> Option<f64> {
    match progress {
        Progress::Search(plan::Progress::Sweep { done, sweeps, .. }) => {
            Some((*done as f64 / (*sweeps).max(1) as f64).min(1.0))
        }
        Progress::Search(plan::Progress::Searching | plan::Progress::Unreachable { .. }) | Progress::Solver(_) => None,
    }
}

impl ViewModel {
    /// Whether the operator has to resolve something before going on.
    pub fn is_stopped(&self) -> bool {
        self.notice.as_ref().is_some_and(|notice| notice.severity == Severity::Stop)
    }
}
