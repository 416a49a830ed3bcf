//! Entries of a journal. Everything is in edge units: mm, degrees (sliding joints mm), with the unit in the field's name.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::identification::triage::Cause;
use crate::kinematics::JointType;
use crate::planning::Figures;
use crate::profile::CellText;
use crate::session::about::About;
use crate::session::calibration::Calibration;
use crate::session::corrected::CorrectedText;
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::set_up::{InstrumentChoice, PayloadText, ProgramText, Step, TargetChoice};
use crate::session::summary::IdentificationSummary;
use crate::text::{names, written_as_text};
use crate::units::{from_mm, to_mm};

/// An entry of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry {
    /// The session begins. Always the first entry.
    Opened {
        /// Version of the layout.
        schema: u32,
        program: String,
        name: String,
    },
    /// The robot, with the whole text of its profile.
    Profile {
        /// Name or path that was given.
        source: String,
        /// SHA-256 of the text.
        sha256: String,
        text: String,
    },
    /// The wizard went to a step.
    Step(Step),
    /// Choice of the instrument.
    Instrument(InstrumentChoice),
    /// A connected instrument has identified itself.
    Connected {
        /// Identity reported by the instrument, with its reflector and any oddities.
        identity: String,
    },
    /// Position of the SMR on the flange.
    Target(TargetChoice),
    /// What the flange carries besides the SMR.
    Payload(PayloadText),
    /// What the operator states about the cell; it replaces what the profile says.
    Cell(CellText),
    /// A point of the circle-point analysis.
    CirclePoint(JointPointText<usize>),
    /// The points of the circle-point analysis are to be measured again.
    CirclesDiscarded,
    /// Poses to measure; those of an earlier plan that are not measured yet are dropped.
    Plan(PlanText),
    /// Additional poses after those of the plan.
    PlanExtended(PlanText),
    /// The robot program of the plan is on disk.
    RobotProgram(RobotProgramText),
    /// The operator confirms that the robot program was driven once by hand.
    ProgramDriven,
    /// A measured point.
    Sample(MeasuredText),
    /// A measurement that gave no sample.
    Refused {
        /// Number of the measurement in the session.
        number: u64,
        pose: String,
        reason: String,
        /// The reading, if there was one (mm).
        xyz_mm: Option<(f64, f64, f64)>,
    },
    /// Decision of the operator about a sample.
    Decision {
        /// Number of the measurement.
        sample: u64,
        decision: Decision,
    },
    /// Correction of a wrong entry.
    Correction(Correction),
    /// What was done in a line, and in those that belong to it, is undone.
    Undone {
        /// Line of the journal, from 1.
        line: u64,
        /// What that was, in words.
        what: String,
    },
    /// What was undone is done after all.
    Redone {
        /// Line of the journal, from 1.
        line: u64,
        /// What that was, in words.
        what: String,
    },
    /// A point of the joint check.
    JointCheckPoint(JointPointText<Option<usize>>),
    /// The joint check is to be measured again.
    JointCheckDiscarded,
    /// The operator selected this row of the plan, from 0.
    Row(usize),
    /// The operator has driven the arm through a configuration that is not measured, on the way to the next pose.
    Passed {
        /// Name of the stop, such as `home`.
        pose: String,
        /// Pendant joint values.
        joints: Vec<f64>,
    },
    /// The operator wants to go through home to this row of the plan, from 0.
    ThroughHome(usize),
    /// A row of the plan is skipped, or no longer skipped.
    Skipped {
        /// Row of the plan, from 0.
        row: usize,
        /// Whether it is skipped now.
        skipped: bool,
    },
    /// A remark of the operator.
    Note {
        /// Name of the pose it is about, if any.
        pose: Option<String>,
        /// The text of the note.
        text: String,
    },
    /// Serial number, operator and place, for the report.
    About(About),
    /// A result.
    Identified(Box<IdentifiedText>),
    /// Files were written.
    Delivered {
        /// Their names in the session's folder.
        files: Vec<String>,
        /// Models that cannot express this arm, with the reason.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        left_out: Vec<String>,
        /// Check sums of the files, in their order; none in journals of earlier versions.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        sums: Vec<String>,
    },
    /// A robot program was corrected with the result.
    Corrected(CorrectedText),
    /// The session was resumed.
    Resumed {
        program: String,
        /// Bytes of an incomplete last line that were dropped.
        torn_bytes: usize,
    },
    /// The program ended normally.
    Closed { reason: String },
}

/// A robot program of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotProgramText {
    pub settings: ProgramText,
    /// Names of its files in the session's folder.
    pub files: Vec<String>,
    /// Whether the operator has confirmed that it was driven once by hand.
    #[serde(default)]
    pub was_driven: bool,
}

/// A point measured while one joint is turned: `J` is that joint, from 0, or none where all are at their start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointPointText<J> {
    /// Number of the measurement in the session.
    pub number: u64,
    /// Joint that is turned.
    pub joint: J,
    /// Pendant joint values.
    pub joints: Vec<f64>,
    /// Measured point in the tracker frame.
    pub xyz_mm: (f64, f64, f64),
}

/// Poses to measure, with the predicted quality of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanText {
    /// Origin of the plan, in words.
    pub origin: String,
    /// Condition number of the identification poses, if it was computed.
    pub condition_number: Option<f64>,
    /// Predicted RMS position error at fresh poses, per σ.
    pub predicted_error_sigma: Option<f64>,
    /// Time that the program takes.
    pub minutes: Option<f64>,
    /// Progress of the search for it, sweep by sweep.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub search: Vec<Figures>,
    /// The rows, in the order of the program.
    pub rows: Vec<PlannedText>,
}

impl PlanText {
    /// A plan for an arm with these joints; without a summary, of poses that were not scored.
    pub fn new(origin: String, summary: Option<&PlanSummary>, rows: &[PlannedPose], joints: &[JointType]) -> Self {
        Self {
            origin,
            condition_number: summary.map(|summary| summary.score.condition_number),
            predicted_error_sigma: summary.map(|summary| summary.score.predicted_error),
            minutes: summary.and_then(|summary| summary.time).map(|time| time.total_min),
            search: summary.map(|summary| summary.search.clone()).unwrap_or_default(),
            rows: rows.iter().map(|row| PlannedText::new(row, joints)).collect(),
        }
    }

    /// The plan without its rows, for those that keep the rows elsewhere.
    #[must_use]
    pub fn without_rows(&self) -> Self {
        Self { origin: self.origin.clone(), search: self.search.clone(), rows: Vec::new(), ..*self }
    }

    /// Number of rows of a kind.
    pub fn count(&self, kind: PoseKind) -> usize {
        self.rows.iter().filter(|row| row.kind == kind).count()
    }
}

/// A row of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedText {
    pub pose: String,
    pub kind: PoseKind,
    /// Pendant joint values.
    pub joints: Vec<f64>,
    /// Point of the SMR in the robot base, from the nominal arm.
    pub xyz_mm: Option<(f64, f64, f64)>,
}

impl PlannedText {
    /// From a row of a plan for an arm with these joints. Joint values are rounded to nine decimals, as in `plan.csv`.
    pub fn new(row: &PlannedPose, joints: &[JointType]) -> Self {
        let point = row.point_in_base.map(|point| to_xyz_mm(&point, 3));
        Self { pose: row.pose.clone(), kind: row.kind, joints: to_edge(&row.configuration, joints), xyz_mm: point }
    }

    /// The row of the plan.
    pub fn planned(&self, joints: &[JointType]) -> PlannedPose {
        PlannedPose {
            pose: self.pose.clone(),
            kind: self.kind,
            configuration: from_edge(&self.joints, joints),
            point_in_base: self.xyz_mm.map(from_xyz_mm),
        }
    }
}

/// Joint values at the edge (deg, mm), rounded to nine decimals.
pub fn to_edge(configuration: &[f64], joints: &[JointType]) -> Vec<f64> {
    joints.iter().zip(configuration).map(|(joint, value)| rounded(joint.quantity().to_edge(*value), 9)).collect()
}

/// Joint values inside (rad, m).
pub fn from_edge(values: &[f64], joints: &[JointType]) -> Vec<f64> {
    joints.iter().zip(values).map(|(joint, value)| joint.quantity().from_edge(*value)).collect()
}

/// A point (m) in mm, rounded to this many decimals.
pub fn to_xyz_mm(point: &Point3<f64>, decimals: i32) -> (f64, f64, f64) {
    let edge = |value: f64| rounded(to_mm(value), decimals);
    (edge(point.x), edge(point.y), edge(point.z))
}

/// A length (m) in mm, rounded to 0.1 µm.
pub fn to_length_mm(length: f64) -> f64 {
    rounded(to_mm(length), 4)
}

/// A point (m) from mm.
pub const fn from_xyz_mm((x, y, z): (f64, f64, f64)) -> Point3<f64> {
    Point3::new(from_mm(x), from_mm(y), from_mm(z))
}

/// Rounded to this many decimals, without a negative zero.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10.0_f64.powi(decimals);
    (value * scale).round() / scale + 0.0
}

/// A measured point, as it was recorded at the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredText {
    /// Number of the measurement in the session.
    pub number: u64,
    /// Row of the plan, from 0.
    pub row: usize,
    pub pose: String,
    pub kind: PoseKind,
    /// Index of the target.
    pub target: usize,
    /// Pendant joint values that were shown.
    pub joints: Vec<f64>,
    /// Pendant joint values that the robot reported, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reported_joints: Option<Vec<f64>>,
    /// Standard deviation of a single reported value of each joint, where several were averaged. Not in journals of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reported_scatter: Option<Vec<f64>>,
    /// Number of reported values that were averaged. Not in journals of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reported_count: Option<u32>,
    /// Measured point in the tracker frame, as the instrument or the operator gave it.
    pub xyz_mm: (f64, f64, f64),
    /// Factor of the coordinates: they fit only in the other unit that the measurement before was corrected to. Not in
    /// journals of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Standard deviation of a coordinate, if the instrument states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_mm: Option<f64>,
    /// Scatter of the shots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter_mm: Option<f64>,
    pub shots: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_degc: Option<f64>,
    /// Pressure and relative humidity of the air. Not in journals of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_hpa: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub humidity_percent: Option<f64>,
    /// Time that the measurement took, motion included (s).
    pub seconds: f64,
    /// Predicted RMS position error at fresh poses, per σ, from this sample and all before it, once they determine the arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_error_sigma: Option<f64>,
    /// Remarks of the instrument and the robot. Not in journals of earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
    /// Findings of the checks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<FindingText>,
}

/// Finding of a check about a sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindingText {
    /// Number of the measurement it is about: this one or an earlier one.
    pub about: u64,
    pub cause: FindingCause,
    /// Deviation in standard deviations.
    pub ratio: f64,
    pub message: String,
    /// Correction that would resolve it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remedy: Option<Correction>,
    /// The distances that fit least, worst first. Not in journals of earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub worst: Vec<PairText>,
}

/// Likely cause of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingCause {
    /// Coordinates in another unit.
    Unit,
    /// A joint turns the other way than the profile says.
    JointSign,
    /// A joint value that was noted wrongly.
    MistypedJoint,
    /// The robot was at another planned pose.
    WrongPose,
    /// The robot was still at the pose before.
    StayedAtPrevious,
    /// The points of two poses are exchanged.
    SwappedRows,
    /// The SMR has moved on the flange.
    TargetMoved,
    /// The tracker has moved.
    InstrumentMoved,
    /// The robot still moved.
    NotAtRest,
    /// A repeated pose is not where it was.
    Drift,
    /// None of the known ones.
    Unexplained,
}

names!(FindingCause {
    Unit = "unit",
    JointSign = "joint_sign",
    MistypedJoint = "mistyped_joint",
    WrongPose = "wrong_pose",
    StayedAtPrevious = "stayed_at_previous",
    SwappedRows = "swapped_rows",
    TargetMoved = "target_moved",
    InstrumentMoved = "instrument_moved",
    NotAtRest = "not_at_rest",
    Drift = "drift",
    Unexplained = "unexplained",
});
written_as_text!(FindingCause);

impl From<&Cause> for FindingCause {
    fn from(cause: &Cause) -> Self {
        match cause {
            Cause::Unit { .. } => Self::Unit,
            Cause::JointSign { .. } => Self::JointSign,
            Cause::MistypedJoint { .. } => Self::MistypedJoint,
            Cause::WrongPose { .. } => Self::WrongPose,
            Cause::StayedAtPrevious => Self::StayedAtPrevious,
            Cause::SwappedRows { .. } => Self::SwappedRows,
            Cause::TargetMoved { .. } => Self::TargetMoved,
            Cause::InstrumentMoved { .. } => Self::InstrumentMoved,
            Cause::NotAtRest { .. } => Self::NotAtRest,
            Cause::Unexplained => Self::Unexplained,
        }
    }
}

/// A measured distance and its prediction from the earlier points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairText {
    /// Number of the measurement at the other end.
    pub other: u64,
    /// Measured distance.
    pub measured_mm: f64,
    /// Predicted distance.
    pub predicted_mm: f64,
    /// Standard deviation that the difference should have.
    pub expected_mm: f64,
}

/// Decision of the operator about a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decision {
    /// It counts in spite of any finding.
    Keep,
    /// It does not count.
    LeaveOut,
    /// It was taken by mistake; its pose is measured again.
    Undo,
}

/// Correction of a wrong entry. The measured values stay unchanged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Correction {
    /// From a measurement on, coordinates were in another unit than assumed.
    Scale {
        /// First measurement.
        since: u64,
        /// Factor for the recorded coordinates.
        factor: f64,
        /// Last measurement. None in journals of earlier versions: all that follow as well.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<u64>,
    },
    /// Two measurements belong to each other's poses.
    Swap {
        /// One measurement.
        first: u64,
        /// The other.
        second: u64,
    },
    /// A measurement belongs to another row of the plan.
    Row {
        /// Number of the measurement.
        sample: u64,
        /// The row, from 0.
        row: usize,
    },
    /// The robot was not at the configuration shown.
    Joints {
        /// Number of the measurement.
        sample: u64,
        /// True pendant joint values.
        joints: Vec<f64>,
    },
    /// An earlier correction is withdrawn, because the measurement that led to it is taken back.
    TakenBack {
        /// Line of the journal that has it, from 1.
        line: u64,
    },
}

/// A result with everything needed to deliver it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdentifiedText {
    /// Numbers of the measurements that went in, identification first, then verification.
    pub samples: Vec<u64>,
    /// The numbers.
    pub summary: IdentificationSummary,
    /// The result file; none where there is no usable solution.
    pub calibration: Option<Calibration>,
    /// Errors of both models at each sample, in the order of `samples`.
    #[serde(default)]
    pub points: Vec<PointErrorText>,
}

/// A sample against the models, in the robot base of each model's own registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointErrorText {
    /// Point of the SMR according to the identified arm.
    pub at_mm: (f64, f64, f64),
    /// Measured − predicted by the nominal arm.
    pub nominal_mm: (f64, f64, f64),
    /// Measured − predicted by the identified arm. For identification samples it is a residual, never an accuracy.
    pub identified_mm: (f64, f64, f64),
    /// Covariance of the position that the identified arm predicts there, after registration (µm²): xx, xy, xz, yy, yz, zz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_um2: Option<(f64, f64, f64, f64, f64, f64)>,
    /// Whether the identification rejected the sample.
    pub rejected: bool,
}
