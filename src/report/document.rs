//! Content of a report, as plain data in mm and degree. `report.json` is this object; `report.html` shows it and nothing else,
//! so the two cannot disagree.
//!
//! Field names are part of the interface of scripts: units are in the names, nothing is renamed or removed within a schema
//! version. `docs/report-schema.md` describes them.

mod build;
mod decision;
mod decisions;

pub(super) use decision::DecisionPart;
use serde::ser::SerializeStruct as _;
use serde::{Serialize, Serializer};

use crate::session::about::{About, Day};
use crate::session::journal::{FindingCause, PlanText};
use crate::session::sha256;
use crate::session::state::{Note, Refused};
use crate::session::summary::IdentificationSummary;

/// Version of the layout of [`Details`].
const SCHEMA: u32 = 1;

/// A report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Document {
    /// The result, whose fields are at the top level of the object; none before the first identification.
    #[serde(flatten)]
    pub result: Option<IdentificationSummary>,
    /// Everything besides the result.
    pub report: Details,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ResultState {
    /// Nothing was identified.
    None,
    /// Samples have changed since.
    OutOfDate,
    /// There is no usable solution.
    Unusable,
    /// Based on exactly the samples that count.
    Current,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PointOrigin {
    /// Typed in at the cell.
    Typed,
    /// Sent by a connected instrument.
    Instrument,
    /// The simulated cell: nothing was measured.
    Simulated,
    /// Replayed from an earlier recording.
    Recorded,
    /// Read from tables, or not known.
    Tables,
}

/// Content of a report besides the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Details {
    pub schema: u32,
    /// Number of the document, see [`Document::numbered`]; empty before it has one.
    pub number: String,
    /// Whether the result can be used.
    pub state: ResultState,
    pub points_from: PointOrigin,
    pub session: SessionPart,
    /// Serial number, operator and place; empty: not given.
    pub about: About,
    /// The robot; none before one was chosen.
    pub robot: Option<RobotPart>,
    /// The instrument, in words.
    pub instrument: Option<String>,
    /// Position of the SMR on the flange, in words.
    pub target: Option<String>,
    /// What the flange carried, in words; none if neither the session nor the profile states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload: Option<String>,
    /// The decision about the acceptance limits with the uncertainty of the figures; none before the first identification.
    pub decision: Option<DecisionPart>,
    /// The day by which the certificate of the instrument had expired when it was used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate_expired: Option<Day>,
    /// Temperature over the samples that count.
    pub temperature: Option<TemperaturePart>,
    /// The air, where the instrument measures it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air: Option<AirPart>,
    /// Numbers of samples by kind.
    pub counts: Counts,
    /// Meaning of each parameter, in the order of `parameters`.
    pub parameter_notes: Vec<ParameterNote>,
    /// Every sample of the result against both models.
    pub points: Vec<PointPart>,
    /// Links of the nominal arm at the pose that the views show, base to SMR, in the base (mm).
    pub arm_mm: Vec<[f64; 3]>,
    /// The castings of the arm at that pose, as the profile describes them.
    pub bodies: Vec<BodyPart>,
    /// The plan without its rows; none before one was accepted.
    #[serde(serialize_with = "plan")]
    pub plan: Option<PlanText>,
    /// Predicted error against the number of identification samples, as measured.
    pub prediction: Vec<PredictionPart>,
    /// Repeated measurements of the drift pose.
    pub drift: Vec<DriftPart>,
    /// Samples that do not count, with the reason.
    pub not_counted: Vec<Refused>,
    /// Measurements that gave no sample.
    pub refused: Vec<Refused>,
    /// Findings of the checks, with the decisions.
    pub findings: Vec<FindingPart>,
    /// Corrections in words, oldest first.
    pub corrections: Vec<String>,
    pub notes: Vec<Note>,
    /// Remarks that instrument and robot made about samples that count, each once.
    pub remarks: Vec<RemarkPart>,
    /// Files beside the report.
    pub files: Vec<FilePart>,
}

/// Hex digits of a document's number.
const NUMBER: usize = 10;

impl Document {
    /// The document with its number: the first digits of the SHA-256 of its content with an empty number.
    #[must_use]
    pub fn numbered(mut self) -> Self {
        self.report.number.clear();
        // A document that cannot be written gets no number, and is refused when it is written.
        let sum = serde_json::to_string(&self).map(|text| sha256(text.as_bytes())).unwrap_or_default();
        self.report.number = sum.chars().take(NUMBER).collect();
        self
    }
}

/// Writes a plan without its rows, but with its search even if that is empty.
#[expect(clippy::ref_option, reason = "the signature that serde asks for")]
fn plan<S: Serializer>(plan: &Option<PlanText>, serializer: S) -> Result<S::Ok, S::Error> {
    let Some(PlanText { origin, condition_number, predicted_error_sigma, minutes, search, rows: _ }) = plan else {
        return serializer.serialize_none();
    };
    let mut fields = serializer.serialize_struct("PlanText", 5)?;
    fields.serialize_field("origin", origin)?;
    fields.serialize_field("condition_number", condition_number)?;
    fields.serialize_field("predicted_error_sigma", predicted_error_sigma)?;
    fields.serialize_field("minutes", minutes)?;
    fields.serialize_field("search", search)?;
    fields.end()
}

/// The session; for a result from tables everything but the program is empty or zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SessionPart {
    pub name: String,
    /// Program and version that opened it.
    pub program: String,
    /// Time of opening (RFC 3339, UTC).
    pub opened: Option<String>,
    /// Time of the first sample that counts.
    pub first_sample: Option<String>,
    /// Time of the last sample that counts.
    pub last_sample: Option<String>,
    /// Time of work, without breaks.
    pub worked_min: f64,
    /// Number of times it was resumed.
    pub resumed: usize,
    /// Number of journal entries that this report is based on.
    pub journal_entries: u64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotPart {
    pub title: String,
    pub profile: String,
    /// Origin of the nominal numbers.
    pub source: String,
    /// SHA-256 of the profile's text.
    pub profile_sha256: String,
    pub joints: Vec<String>,
    /// Unit of each joint: `deg` or `mm`.
    pub joint_units: Vec<&'static str>,
    /// The instrument that the profile names, with the standard deviation that it states.
    pub instrument: Option<String>,
}

/// Temperatures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TemperaturePart {
    pub lowest_degc: f64,
    pub highest_degc: f64,
    /// Number of samples with a temperature.
    pub samples: usize,
}

/// The air during the measurements: the lowest and the highest value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AirPart {
    pub pressure_hpa: Option<(f64, f64)>,
    pub humidity_percent: Option<(f64, f64)>,
    /// Largest change of a distance since the first sample, if the instrument did not correct for the air (ppm).
    pub change_ppm: f64,
}

/// A part of the arm: all points within a distance of a line, in the base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(clippy::struct_field_names, reason = "the unit is in the name of every field")]
pub struct BodyPart {
    pub from_mm: [f64; 3],
    pub to_mm: [f64; 3],
    pub radius_mm: f64,
}

/// A remark of the instrument or the robot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RemarkPart {
    pub text: String,
    /// Number of the first measurement that has it.
    pub first: u64,
    /// Number of measurements that have it.
    pub samples: usize,
}

/// Numbers of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Identification samples that count.
    pub identification: usize,
    /// Verification samples that count.
    pub verification: usize,
    /// Repetitions of the drift pose.
    pub drift: usize,
    /// Samples of identification and verification that count, taken at a pose where another one counts.
    pub repeats: usize,
    /// Fewest shots that were averaged for a sample.
    pub fewest_shots: u32,
    /// Most shots that were averaged for a sample.
    pub most_shots: u32,
    /// Poses of the plan that were not measured.
    pub open: usize,
    /// Poses that were skipped.
    pub skipped: usize,
}

/// How well a parameter was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Well determined.
    Yes,
    /// The standard deviation is more than half of the expected deviation.
    Weakly,
    /// Only a combination with others.
    OnlyCombined,
}

/// A parameter in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ParameterNote {
    pub name: String,
    /// Description of the parameter.
    pub meaning: String,
    pub found: Found,
}

/// A sample against the models, in the robot base of each model's own registration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointPart {
    /// Number of the measurement.
    pub number: u64,
    pub pose: String,
    /// Whether the identification did not see it. Only then its errors are an accuracy; else they are residuals of the fit.
    pub verification: bool,
    /// The identification left it out as an outlier.
    pub rejected: bool,
    /// Pendant joint values, in the joints' units.
    pub joints: Vec<f64>,
    /// Point of the SMR according to the identified arm.
    pub at_mm: [f64; 3],
    /// Measured − predicted by the nominal arm.
    pub nominal_mm: [f64; 3],
    /// Measured − predicted by the identified arm.
    pub identified_mm: [f64; 3],
}

/// Predicted error for a number of samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PredictionPart {
    /// Number of identification samples.
    pub samples: usize,
    /// Predicted RMS position error at fresh poses, per σ of the instrument.
    pub predicted_error_sigma: f64,
}

/// A repetition of an earlier pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftPart {
    /// Number of the measurement.
    pub number: u64,
    pub pose: String,
    /// Number of the measurement that it is compared with.
    pub since: u64,
    /// Minutes since that measurement.
    pub minutes: f64,
    /// Displacement of the point in the tracker frame.
    pub moved_mm: [f64; 3],
}

/// A finding of a check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingPart {
    /// Number of the measurement that raised it.
    pub raised_at: u64,
    /// Number of the measurement it is about.
    pub about: u64,
    /// Pose of the measurement it is about.
    pub pose: String,
    pub cause: FindingCause,
    /// Deviation in standard deviations.
    pub ratio: f64,
    pub message: String,
    /// Decision about the sample, in words.
    pub decision: String,
}

/// A file beside the report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FilePart {
    pub name: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
}
