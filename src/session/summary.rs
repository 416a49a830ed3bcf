//! The numbers of an identification or verification as they leave the program: plain data in mm and degree, the same for the
//! text, the JSON object and later reports.
//!
//! Field names are part of the interface of scripts: units are in the names, nothing is renamed or removed within a schema
//! version.

use serde::{Deserialize, Serialize};

use super::advice::Advice;
use super::measurements::Layout;
use crate::identification::{Estimator, Prior, SigmaSource, TerminationReason, Terms, Weighting};
use crate::kinematics::{ParameterId, ParameterUnit};
use crate::profile::Level;
use crate::text::{counted, decimals_for, fixed, names, written_as_text};

mod beside;
mod refit;

pub use super::warning::{Warning, WarningCode};
pub use beside::{EarlierSummary, FeatureSummary, MovedSummary};
pub use refit::Refit;

/// Version of the layout of these objects.
pub const SCHEMA: u32 = 1;

/// Origin of the numbers of a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    pub program: String,
    /// When, RFC 3339 in UTC.
    pub created: String,
    pub profile: String,
    pub robot: String,
    /// SHA-256 of the profile's text.
    pub profile_sha256: String,
    /// Files that were read.
    pub inputs: Vec<InputFile>,
    /// Serial number of the arm; empty: not given.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub serial: String,
    /// Serial number of the instrument; empty: not given.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub instrument_serial: String,
}

impl Provenance {
    /// Says which arm a verdict is about.
    pub fn belongs_to(&self) -> String {
        if self.serial.is_empty() {
            return "No serial number was given: this verdict belongs to no arm.".to_owned();
        }
        let instrument = if self.instrument_serial.is_empty() {
            String::new()
        } else {
            format!(", measured with the instrument {}", self.instrument_serial)
        };
        format!("For the arm with serial number {}{instrument}.", self.serial)
    }
}

/// Role of an input file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputRole {
    /// Points to identify from.
    Identification,
    /// Points to verify with.
    Verification,
    /// An earlier result.
    Calibration,
    Plan,
    /// The points of a guided session.
    Session,
}

names!(InputRole {
    Identification = "identification",
    Verification = "verification",
    Calibration = "calibration",
    Plan = "plan",
    Session = "session",
});

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFile {
    pub role: InputRole,
    /// Its path as given.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdentificationSettings {
    pub level: Level,
    pub weighting: Weighting,
    pub prior: Prior,
    pub estimator: Estimator,
    pub iterations: usize,
    /// Condition that picked the identification rows.
    pub filter: Option<String>,
    /// Expected deviation of every length, where the command line replaced the profile's.
    pub expected_length_mm: Option<f64>,
    /// Expected deviation of every angle, likewise.
    pub expected_angle_deg: Option<f64>,
    /// Layout of the tables, where there is a choice.
    pub layout: Option<Layout>,
    /// Known distance between two sockets.
    pub socket_distance_mm: Option<f64>,
    /// Standard deviation of the known distance.
    pub socket_distance_sigma_mm: Option<f64>,
    pub verification: VerificationMode,
}

/// Origin of the verification samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerificationMode {
    /// No verification samples.
    #[default]
    None,
    /// Another file.
    File,
    /// The rows that the condition leaves out.
    Rest,
    /// Each position of the plate in turn.
    LeaveOneOut,
    /// The verification poses of a guided session.
    Session,
}

/// Outcome of the comparison with the acceptance limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictStatus {
    /// Every limit was checked and is met, and nothing speaks against it.
    Accepted,
    /// A limit is not met, or a warning rules acceptance out.
    NotAccepted,
    /// There was nothing to compare, or not for every limit.
    NotEvaluated,
}

/// Measurement σ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SigmaSummary {
    /// Value that balanced data and prior, per coordinate: all parts together.
    pub used_mm: f64,
    /// Where the part of the instrument comes from; how the whole was found where nothing is stated.
    pub source: SigmaSource,
    /// Estimate from the residuals.
    pub from_residuals_mm: Option<f64>,
    /// Part of the instrument, as stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument_mm: Option<f64>,
    /// Part of readings of one pose among each other, beyond the instrument.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shots_mm: Option<f64>,
    /// Part of what a pose has in common: repeatability, and what the model lacks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses_mm: Option<f64>,
}

impl SigmaSummary {
    /// What [`Self::source`] tells the origin of: the part of the instrument, or the whole where nothing is stated.
    pub fn stated_mm(&self) -> f64 {
        self.instrument_mm.unwrap_or(self.used_mm)
    }
}

/// One identified parameter. Numbers are in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterSummary {
    /// Which one; in files its name, such as `a2` or `target1.x`.
    #[serde(rename = "name")]
    pub id: ParameterId,
    /// Unit of the numbers.
    pub unit: ParameterUnit,
    pub nominal: f64,
    /// Identified − nominal.
    pub deviation: f64,
    /// Standard deviation of the deviation; none where neither data nor prior say anything about it.
    pub sigma: Option<f64>,
    /// Deviation expected before measuring, one standard deviation.
    pub expected: f64,
    /// Whether the parameter can be found on its own.
    pub identifiable: bool,
}

/// Two parameters that the data tie together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CorrelationSummary {
    pub parameters: [ParameterId; 2],
    /// Correlation, −1 … 1.
    pub correlation: f64,
}

/// Parameters of which only combinations can be found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlindGroupSummary {
    pub parameters: Vec<ParameterId>,
    /// Number of directions that the data do not see.
    pub blind: usize,
    pub description: String,
}

/// A sample that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedSummary {
    pub pose: String,
    pub line: usize,
    /// Distance from the prediction of the model fitted without it.
    pub residual_mm: f64,
    /// The same in robust standard deviations of the accepted samples.
    pub ratio: f64,
    pub reason: String,
}

/// Statistics of a non-negative error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatisticsSummary {
    pub count: usize,
    pub mean: f64,
    pub rms: f64,
    /// 95 % of the values are at most this.
    pub p95: f64,
    pub max: f64,
    /// Interval of 95 % of the mean over other sets of as many poses; none where there are too few.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_interval: Option<[f64; 2]>,
    /// The same of the root mean square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_interval: Option<[f64; 2]>,
    /// The same of the largest; its upper end says nothing about larger errors at other poses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_interval: Option<[f64; 2]>,
}

impl StatisticsSummary {
    /// The figures with their intervals: mean, root mean square, 95 % and largest.
    pub const fn figures(&self) -> [Figure; 4] {
        [
            Figure { value: self.mean, interval: self.mean_interval },
            Figure { value: self.rms, interval: self.rms_interval },
            Figure { value: self.p95, interval: None },
            Figure { value: self.max, interval: self.max_interval },
        ]
    }
}

/// A figure in mm with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    pub value: f64,
    pub interval: Option<[f64; 2]>,
}

/// Decimals of a figure of which no interval is known.
const DECIMALS: usize = 4;

impl Figure {
    /// Decimals that show two digits of the standard deviation behind the interval, and no more than are measured.
    fn decimals(&self) -> usize {
        let sigma = self.interval.map_or(0.0, |[low, high]| (high - low) / 4.0);
        if sigma > 0.0 { decimals_for(sigma).min(DECIMALS) } else { DECIMALS }
    }

    /// The figure with as many digits as its interval justifies.
    pub fn text(&self) -> String {
        fixed(self.value, self.decimals())
    }

    /// The interval with the same digits.
    pub fn interval_text(&self) -> Option<String> {
        let [low, high] = self.interval?;
        Some(format!("{} .. {}", fixed(low, self.decimals()), fixed(high, self.decimals())))
    }

    /// The figure with enough digits to be on the right side of a limit.
    pub fn text_beside(&self, limit: f64) -> String {
        let side = |decimals: usize| {
            let shown: f64 = fixed(self.value, decimals).parse().unwrap_or(self.value);
            (shown <= limit) == (self.value <= limit)
        };
        let decimals = (self.decimals()..DECIMALS).find(|decimals| side(*decimals)).unwrap_or(DECIMALS);
        fixed(self.value, decimals)
    }
}

/// Per-axis absolute errors in the robot base, as table IV of the method paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisSummary {
    /// Mean of the absolute error along x, y, z.
    pub mean: [f64; 3],
    /// Largest absolute error along x, y, z.
    pub max: [f64; 3],
}

/// Errors of one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelSummary {
    /// Norm of the position error after registration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<StatisticsSummary>,
    /// The same per axis of the base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_mm: Option<AxisSummary>,
    /// Distance error over pairs of samples, or of measured lengths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_mm: Option<StatisticsSummary>,
    /// Distance of the target from the mean of its shared point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seat_mm: Option<StatisticsSummary>,
    /// Orientation error of the flange (mrad), from at least three points in one pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_mrad: Option<StatisticsSummary>,
}

/// Why points can have an orientation error.
pub const ORIENTATION_SENTENCE: &str = "The orientation error is that of the flange, from all points measured in one pose: the distances between points of a rigid body carry its orientation";

impl ModelSummary {
    /// The kinds of error, each with its name.
    pub const fn errors(&self) -> [(&'static str, Option<StatisticsSummary>); 3] {
        [
            ("position error", self.position_mm),
            ("distance error", self.distance_mm),
            ("off the shared point", self.seat_mm),
        ]
    }
}

/// Mean error over a part of a joint's range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointBin {
    /// Lower end, in `unit` of the joint.
    pub from: f64,
    pub to: f64,
    pub count: usize,
    pub mean_mm: f64,
}

/// Error of the identified model against one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointSummary {
    pub joint: String,
    /// `deg` or `mm`.
    pub unit: String,
    /// Share of the square error that follows this joint, 0 … 1.
    pub explained: f64,
    pub bins: Vec<JointBin>,
}

impl JointBin {
    /// The mean error (mm), or a dash without samples.
    fn mean(&self) -> String {
        let decimals = if self.mean_mm < 100.0 { 3 } else { 1 };
        if self.count == 0 { "-".to_owned() } else { fixed(self.mean_mm, decimals) }
    }
}

/// Least share of the square error that a joint must explain to be named.
const WORTH_NAMING: f64 = 0.1;
/// Least share times number of samples: about four standard deviations of what chance explains.
const CHANCE: f64 = 4.0;

impl JointSummary {
    /// Whether more of the error follows the joint than chance explains.
    pub fn is_worth_naming(&self) -> bool {
        let count: usize = self.bins.iter().map(|bin| bin.count).sum();
        self.explained >= WORTH_NAMING.max(CHANCE / count.max(1) as f64)
    }

    /// The share of the square error, if it is worth naming.
    pub fn share(&self) -> Option<String> {
        self.is_worth_naming().then(|| format!("{:.0} %", 100.0 * self.explained))
    }

    /// The mean errors over the parts of the range, each in this many columns.
    pub fn means(&self, columns: usize) -> String {
        let cells: Vec<String> = self.bins.iter().map(|bin| format!("{:>columns$}", bin.mean())).collect();
        cells.concat()
    }

    /// The range of the joint with its unit, if there are samples.
    pub fn range(&self) -> Option<String> {
        let (first, last) = (self.bins.first()?, self.bins.last()?);
        Some(format!("{:>5.0} ..{:>5.0} {}", first.from, last.to, self.unit))
    }
}

/// Accuracy on verification samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerificationSummary {
    pub samples: usize,
    /// Different poses among them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub poses: usize,
    /// Samples at poses that were also identified, which do not count.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub left_out: usize,
    /// Origin of the samples, and what was fitted to them.
    pub basis: String,
    /// Whether the identification saw none of them.
    pub independent: bool,
    /// What was fitted to the verification samples themselves.
    pub refit: Refit,
    /// The nominal model with its own registration.
    pub nominal: ModelSummary,
    pub identified: ModelSummary,
    /// Error of the identified model against each joint.
    pub residual_by_joint: Vec<JointSummary>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde calls")]
const fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl VerificationSummary {
    /// What intervals and the largest error mean; nothing for reports that do not count their poses.
    pub fn sample_sentence(&self) -> Option<String> {
        let largest = (self.poses > 0).then(|| {
            format!(
                "The largest error is that of these poses, a sample: about 1 of {} other poses is expected to be worse",
                self.poses + 1
            )
        })?;
        let found = &self.identified;
        let mut statistics = [&found.position_mm, &found.distance_mm, &found.seat_mm].into_iter().flatten();
        if statistics.any(|statistics| statistics.rms_interval.is_some()) {
            let poses = counted(self.poses, "pose");
            return Some(format!(
                "Intervals (95 %) say what other sets of as many poses could have shown (bootstrap over {poses}). {largest}"
            ));
        }
        Some(largest)
    }
}

/// What an acceptance limit is about. For shared points the position error is the distance from the shared point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedQuantity {
    PositionMean,
    PositionRms,
    PositionMax,
    DistanceMean,
    DistanceRms,
    DistanceMax,
}

names!(LimitedQuantity {
    PositionMean = "position_mean",
    PositionRms = "position_rms",
    PositionMax = "position_max",
    DistanceMean = "distance_mean",
    DistanceRms = "distance_rms",
    DistanceMax = "distance_max",
});
written_as_text!(InputRole, Refit, LimitedQuantity);

impl LimitedQuantity {
    /// The name in a sentence: `position rms`.
    pub fn words(self) -> String {
        self.name().replace('_', " ")
    }
}

/// One comparison with an acceptance limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitCheck {
    pub quantity: LimitedQuantity,
    /// Value found; none if the data do not determine it.
    pub value_mm: Option<f64>,
    /// Interval of 95 % of the value, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_mm: Option<[f64; 2]>,
    pub limit_mm: f64,
    /// Whether it is met; none where it could not be evaluated.
    pub met: Option<bool>,
}

impl LimitCheck {
    /// The value with as many digits as its interval justifies; a dash without one.
    pub fn value_text(&self) -> String {
        let figure = self.value_mm.map(|value| Figure { value, interval: self.interval_mm });
        figure.map_or_else(|| "-".to_owned(), |figure| figure.text_beside(self.limit_mm))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    pub status: VerdictStatus,
    pub reasons: Vec<String>,
    pub checks: Vec<LimitCheck>,
    /// Limits that are met, but not with the uncertainty of the figure; none unless everything else is accepted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undecided: Vec<LimitedQuantity>,
    /// Advice on how to get another verdict; taken by [`Verdict::put_into_words`].
    #[serde(skip)]
    pub advice: Option<Advice>,
}

impl Verdict {
    /// The verdict in capitals, the same wherever it is shown.
    pub const fn word(&self) -> &'static str {
        match self.status {
            VerdictStatus::Accepted if self.undecided.is_empty() => "ACCEPTED",
            VerdictStatus::Accepted => "UNDECIDED",
            VerdictStatus::NotAccepted => "NOT ACCEPTED",
            VerdictStatus::NotEvaluated => "NOT EVALUATED",
        }
    }

    /// Appends the advice to the reasons in the words of the module that shows it.
    pub fn put_into_words(&mut self, words: impl Fn(Advice) -> String) {
        if let (Some(advice), Some(reason)) = (self.advice.take(), self.reasons.last_mut()) {
            *reason = format!("{reason}; {}", words(advice));
        }
    }
}

/// One step of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IterationSummary {
    /// Weighted square sum of residuals plus the prior's share, dimensionless.
    pub cost: f64,
    /// Largest change of a parameter, in expected deviations.
    pub step: f64,
    /// Deviations of all parameters after it, in the order and units of the parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<f64>,
}

/// A model that was tried: the geometry with some errors of the joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CandidateSummary {
    pub terms: Terms,
    /// Root mean square error at poses that were left out in turn.
    pub left_out_rms_mm: f64,
    /// What is left per coordinate with all poses; no accuracy.
    pub residual_mm: f64,
}

/// What explains a part of the nominal arm's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Lengths and angles of the links, zeros of the joints.
    Geometry,
    /// Joints and bearings that give under the arm's weight.
    Gravity,
    /// Angle errors that follow the value of a joint.
    JointCurves,
}

names!(Cause {
    Geometry = "geometry",
    Gravity = "gravity",
    JointCurves = "joint curves",
});
written_as_text!(Cause);

/// Part of the nominal arm's error that a cause explains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShareSummary {
    pub cause: Cause,
    pub percent: f64,
}

/// Which errors of the joints were kept, and against what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SelectionSummary {
    /// All models that were tried, from simple to rich.
    pub candidates: Vec<CandidateSummary>,
    /// The one that was kept.
    pub kept: Terms,
    /// Why.
    pub reason: String,
    /// Root mean square error of the nominal arm at the same poses.
    pub nominal_rms_mm: f64,
    /// What explains it.
    pub shares: Vec<ShareSummary>,
    /// Root mean square error that is left at poses that were left out in turn.
    pub left_rms_mm: f64,
}

/// The position error predicted over the range of the joints in which the arm has to be accurate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorkspaceSummary {
    /// Random configurations that it was predicted at.
    pub configurations: usize,
    /// Root mean square.
    pub rms_mm: f64,
    /// 95 % of the configurations have less.
    pub p95_mm: f64,
    pub max_mm: f64,
    /// Root mean square distance between this model and the best one of geometry alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside_geometry_rms_mm: Option<f64>,
}

/// The angle error of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointErrorSummary {
    pub joint: String,
    /// Smallest and largest value that was measured (deg).
    pub measured_deg: (f64, f64),
    /// Turn at the largest gravity torque, with its standard deviation (µrad).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliance_urad: Option<(f64, f64)>,
    /// Largest gravity torque (N·m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_nm: Option<f64>,
    /// Root mean square of the curve where it was measured (µrad).
    pub curve_rms_urad: f64,
    /// Value of the joint (deg), its error and the error's standard deviation (µrad), over the joint's range.
    pub curve: Vec<(f64, f64, f64)>,
}

/// Everything about an identification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdentificationSummary {
    pub schema: u32,
    /// Origin of the numbers.
    pub provenance: Provenance,
    /// Settings of the identification.
    pub settings: IdentificationSettings,
    /// Warnings to read before the numbers are used.
    pub warnings: Vec<Warning>,
    pub verdict: Verdict,
    /// Accuracy on samples that the identification did not see.
    pub verification: Option<VerificationSummary>,
    /// Number of identification samples, rejected ones included.
    pub samples: usize,
    pub parameter_count: usize,
    /// Independent combinations that the data determine.
    pub rank: Option<usize>,
    /// Ratio of the singular values at the rank.
    pub singular_value_gap: f64,
    /// Condition number of `A·S` on the identifiable subspace: parameters in units of their expected deviation.
    pub condition_number: Option<f64>,
    /// Condition number of A with parameters in mm and rad.
    pub condition_number_mm_rad: Option<f64>,
    /// Number of points whose pairs entered the condition numbers.
    pub condition_number_points: usize,
    pub sigma: SigmaSummary,
    pub parameters: Vec<ParameterSummary>,
    /// Groups of parameters of which only combinations can be found.
    pub blind_groups: Vec<BlindGroupSummary>,
    /// Pairs of identifiable parameters correlated beyond ±0.9.
    pub correlations: Vec<CorrelationSummary>,
    pub rejected: Vec<RejectedSummary>,
    pub termination: TerminationReason,
    pub iterations: Vec<IterationSummary>,
    pub written: Vec<String>,
    /// Which errors of the joints were kept; none where only the geometry was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<SelectionSummary>,
    /// The error of each joint, where joints have any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_errors: Vec<JointErrorSummary>,
    /// The error predicted over the workspace; none for data without points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub workspace: Option<WorkspaceSummary>,
    /// The earlier calibration that it began with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub earlier: Option<EarlierSummary>,
    /// Features of unknown place that were found along with the arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub features: Vec<FeatureSummary>,
}

impl IdentificationSummary {
    /// The parameters of geometry and targets, without the terms of joint errors.
    pub fn constants(&self) -> impl Iterator<Item = &ParameterSummary> {
        self.parameters.iter().filter(|parameter| !parameter.id.is_joint_error())
    }
}

/// The verification of a calibration on other data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerificationReport {
    pub schema: u32,
    /// Origin of the numbers.
    pub provenance: Provenance,
    /// Warnings to read before the numbers are used.
    pub warnings: Vec<Warning>,
    pub verdict: Verdict,
    pub verification: VerificationSummary,
}
