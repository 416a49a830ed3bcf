//! `calibration.ron`: the result of an identification, complete enough to be used without any other file.
//!
//! It carries the text of the profile it was made with, so the nominal robot cannot drift away from its deviations.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::set_up::PayloadText;
use super::sha256;
use super::summary::{
    IdentificationSettings, JointErrorSummary, ParameterSummary, Provenance, SelectionSummary, SigmaSummary, Verdict,
    Warning, WorkspaceSummary,
};
use crate::checksum::{self, Finding};
use crate::kinematics::{Arm, JointTerm, KinematicChain, KinematicsError, LoadScale, ParameterId, ParameterUnit};
use crate::profile::{Profile, Target};
use crate::units::{from_mm, to_mm};

/// Version of the layout.
///
/// 2: the file carries a check sum of its content, and may have errors of joints. 1: without a sum.
pub const SCHEMA: u32 = 2;

/// Last version of the layout whose files have no check sum.
const LAST_WITHOUT_SUM: u32 = 1;

/// Largest deviation of a parameter, in its unit: a hundred metres, or many turns.
const LARGEST_DEVIATION: f64 = 1e5;

/// A pose in the file: position in mm, unit quaternion as (x, y, z, w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseText {
    /// Position.
    pub xyz_mm: (f64, f64, f64),
    /// Orientation.
    pub quaternion_xyzw: (f64, f64, f64, f64),
}

/// How far from 1 the length of a quaternion may be in a file.
const QUATERNION_TOLERANCE: f64 = 1e-6;

impl PoseText {
    /// Whether it is finite and its quaternion of length 1.
    fn is_usable(self) -> bool {
        let (x, y, z) = self.xyz_mm;
        let (i, j, k, w) = self.quaternion_xyzw;
        let length = Quaternion::new(w, i, j, k).norm();
        [x, y, z].into_iter().all(f64::is_finite) && (length - 1.0).abs() < QUATERNION_TOLERANCE
    }
}

impl From<&Isometry3<f64>> for PoseText {
    fn from(pose: &Isometry3<f64>) -> Self {
        let position = pose.translation.vector.map(to_mm);
        let q = pose.rotation.coords;
        Self { xyz_mm: (position.x, position.y, position.z), quaternion_xyzw: (q.x, q.y, q.z, q.w) }
    }
}

impl From<&PoseText> for Isometry3<f64> {
    fn from(text: &PoseText) -> Self {
        let (x, y, z) = text.xyz_mm;
        let (i, j, k, w) = text.quaternion_xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Self::from_parts(Translation3::new(from_mm(x), from_mm(y), from_mm(z)), rotation)
    }
}

/// An identification sample: what `verify` must know to tell independent samples from these. In the file it is one text,
/// `1: 10.5 -20 30`: number of the target, from 1, and the pendant joint values (deg, sliding joints mm).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct SampleText {
    /// Index of the target.
    pub target: usize,
    /// Pendant joint values (deg, sliding joints mm), rounded to 0.0001.
    pub joints: Vec<f64>,
}

impl SampleText {
    /// A sample from joint values in deg and mm.
    pub fn new(target: usize, joints: impl IntoIterator<Item = f64>) -> Self {
        Self { target, joints: joints.into_iter().map(|value| (value * 1e4).round() / 1e4).collect() }
    }
}

impl From<SampleText> for String {
    fn from(sample: SampleText) -> Self {
        let joints: Vec<Self> = sample.joints.iter().map(|value| (value + 0.0).to_string()).collect();
        format!("{}: {}", sample.target + 1, joints.join(" "))
    }
}

impl TryFrom<String> for SampleText {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let wrong = || format!("'{text}' is not a sample; it reads like '1: 10.5 -20 30'");
        let (target, joints) = text.split_once(':').ok_or_else(wrong)?;
        let target: usize = target.trim().parse().map_err(|error| format!("{}: {error}", wrong()))?;
        let joints: Vec<f64> = joints
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|error: std::num::ParseFloatError| format!("{}: {error}", wrong()))?;
        let usable = target > 0 && joints.iter().all(|value| value.is_finite());
        if usable { Ok(Self { target: target - 1, joints }) } else { Err(wrong()) }
    }
}

/// Whether a calibration is as this program wrote it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrity {
    /// Its check sum fits, or it was never a file.
    #[default]
    Intact,
    /// An earlier version wrote it, without a check sum.
    Unchecked,
    /// It has changed since.
    Changed(Change),
}

/// How a changed calibration shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Change {
    #[error("its content does not fit its check sum")]
    Content,
    #[error("its check sum is missing")]
    SumIsMissing,
    #[error("the profile inside is not the one whose SHA-256 it states")]
    Profile,
}

/// An identified robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this layout.
    pub schema: u32,
    /// Where it comes from.
    pub provenance: Provenance,
    /// How it was identified.
    pub settings: IdentificationSettings,
    /// Measurement σ.
    pub sigma: SigmaSummary,
    /// The verdict at that time.
    pub verdict: Verdict,
    /// What had to be known about the identification itself; a later verification carries it on.
    pub warnings: Vec<Warning>,
    /// Independent combinations that the data determined.
    pub rank: Option<usize>,
    /// Nominal, deviation and σ of every free parameter.
    pub parameters: Vec<ParameterSummary>,
    /// Pose of the instrument in the base of the identified arm; none for data without coordinates.
    pub base_from_station: Option<PoseText>,
    /// Pose of the instrument in the base of the nominal arm with its own registration.
    pub nominal_base_from_station: Option<PoseText>,
    /// Target coordinates in the flange of the nominal arm with its own fit (mm), one per target.
    pub nominal_targets_mm: Vec<(f64, f64, f64)>,
    /// The identification samples: a verification on the same ones would say nothing.
    pub samples: Vec<SampleText>,
    /// Where the first target was said to be mounted, if not where the profile has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mounted: Option<MountedText>,
    /// The geometry identified alone from the same samples, where the parameters contain errors of joints: what formats that know
    /// only geometry get, because the geometry of the joint fit is wrong without the rest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub geometric: Vec<ParameterSummary>,
    /// Which errors of the joints were kept, and against what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<SelectionSummary>,
    /// The error of each joint where it was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_errors: Vec<JointErrorSummary>,
    /// The error predicted over the workspace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub workspace: Option<WorkspaceSummary>,
    /// What the flange carried, if not what the profile says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<PayloadText>,
    /// What the coefficients of compliance and tilt are relative to; none if there are no such terms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loads: Option<LoadsText>,
    /// Data of earlier calibrations that this one began with, the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub earlier: Vec<EarlierText>,
    /// The profile, as it was read.
    pub profile: String,
    /// Whether the file was as this program wrote it.
    #[serde(skip)]
    pub integrity: Integrity,
}

/// The data of an earlier calibration, and how far parameters may have changed after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarlierText {
    /// When that calibration was made.
    pub created: String,
    /// Its samples.
    pub samples: Vec<SampleText>,
    /// Standard deviation of a coordinate of a reading, and the part that all readings of a pose share.
    pub used_mm: f64,
    pub poses_mm: Option<f64>,
    /// Standard deviations, in the unit of each parameter, of what may have changed since. Parameters that are missing may not have.
    pub widened: Vec<(ParameterId, f64)>,
}

impl EarlierText {
    /// How far a parameter may have changed after it ((m) or (rad)).
    pub fn widened(&self, id: ParameterId) -> f64 {
        let own = self.widened.iter().find(|(known, _)| *known == id);
        own.map_or(0.0, |(id, width)| id.unit().from_edge(*width))
    }
}

/// The largest loads over the joint ranges at the payload of the identification: a coefficient of compliance or tilt is the angle at
/// these loads, whatever the arm carries later.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadsText {
    /// Largest gravity torque about each joint.
    pub torques_nm: Vec<f64>,
    /// Largest gravity moment of the arm.
    pub moment_nm: f64,
}

impl LoadsText {
    /// The loads that terms among `parameters` need, if any does.
    pub fn of(chain: &KinematicChain, parameters: &[ParameterSummary]) -> Option<Self> {
        let is_loaded = |id| match id {
            ParameterId::Joint { term, .. } => matches!(term, JointTerm::Compliance | JointTerm::Tilt(_)),
            ParameterId::Link { .. } | ParameterId::Target { .. } => false,
        };
        let scale = chain.loads().filter(|_| parameters.iter().any(|parameter| is_loaded(parameter.id)))?.scale();
        Some(Self { torques_nm: scale.torques.clone(), moment_nm: scale.moment })
    }

    fn scale(&self) -> LoadScale {
        LoadScale { torques: self.torques_nm.clone(), moment: self.moment_nm }
    }

    fn is_usable(&self) -> bool {
        self.torques_nm.iter().chain([&self.moment_nm]).all(|value| value.is_finite() && *value >= 0.0)
    }
}

/// A target that is mounted elsewhere than the profile says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountedText {
    /// Centre of the SMR in the flange frame.
    pub xyz_mm: (f64, f64, f64),
    /// Standard deviation of each coordinate; zero: exact.
    pub sigma_mm: f64,
}

impl MountedText {
    /// The robot of `profile` with its first target mounted so.
    pub fn on(&self, profile: &Profile) -> Profile {
        let (x, y, z) = self.xyz_mm;
        let mounted = profile.targets().first().map(|target| Target {
            position_in_flange: Point3::new(from_mm(x), from_mm(y), from_mm(z)),
            uncertainty: from_mm(self.sigma_mm),
            ..target.clone()
        });
        mounted.map_or_else(|| profile.clone(), |target| profile.with_target(0, target))
    }

    /// Whether its numbers can be meant.
    fn is_usable(&self) -> bool {
        let (x, y, z) = self.xyz_mm;
        [x, y, z].into_iter().all(f64::is_finite) && self.sigma_mm.is_finite() && self.sigma_mm >= 0.0
    }
}

/// The robot of `profile` with its first target and its payload as they are mounted, where that is not as the profile says.
pub fn mounted_on(profile: &Profile, target: Option<&MountedText>, payload: Option<&PayloadText>) -> Profile {
    let profile = target.map_or_else(|| profile.clone(), |mounted| mounted.on(profile));
    payload.map_or_else(|| profile.clone(), |payload| profile.with_payload(payload.mass()))
}

/// A calibration file that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Not RON, or not a calibration.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// Written by a newer program.
    #[error(
        "schema {found} is newer than this program understands ({SCHEMA}); use the version that wrote it: {program}"
    )]
    Schema {
        /// Version found.
        found: u32,
        /// Program that wrote it.
        program: String,
    },
    /// A number that is not finite.
    #[error("parameter '{parameter}' has a number that is not finite")]
    NotFinite { parameter: ParameterId },
    /// A number that no robot has.
    #[error("parameter '{parameter}' deviates by {deviation:e}, which no arm does")]
    Absurd { parameter: ParameterId, deviation: f64 },
    /// A unit that a parameter cannot have.
    #[error("parameter '{parameter}' has the unit '{unit}'; it must be '{}'", parameter.unit())]
    Unit { parameter: ParameterId, unit: ParameterUnit },
    /// A standard or expected deviation that is not a positive number.
    #[error("parameter '{parameter}' has a standard or expected deviation that is negative or not finite")]
    Sigma { parameter: ParameterId },
    /// A pose whose numbers are not finite, or whose quaternion is not of length 1.
    #[error("'{field}' is not a pose: its numbers must be finite and its quaternion of length 1")]
    Pose {
        /// Name of the field.
        field: &'static str,
    },
    /// Nominal coordinates of another number of targets than the robot has.
    #[error("it has the nominal coordinates of {found} targets; its robot has {expected}")]
    Targets {
        /// Number of targets in the file.
        found: usize,
        /// Number of targets of the robot.
        expected: usize,
    },
    /// A payload that is no payload.
    #[error("'payload' needs a mass of at least 0 kg and a centre, all finite")]
    Payload,
    /// Loads that are no loads.
    #[error("'loads' has a number that is negative or not finite")]
    Loads,
    /// Target coordinates that are not finite.
    #[error("the nominal coordinates of target {target} are not finite")]
    Target {
        /// Number of the target, from 1.
        target: usize,
    },
}

impl Calibration {
    /// The robot of `profile` with its first target and its payload as they were mounted for this calibration.
    pub fn mounted_on(&self, profile: &Profile) -> Profile {
        mounted_on(profile, self.mounted.as_ref(), self.payload.as_ref())
    }

    /// The nominal arm with the targets that its own fit placed.
    ///
    /// # Errors
    /// Another number of targets than the robot of `profile` has.
    pub fn nominal(&self, profile: &Profile) -> Result<Arm, CalibrationError> {
        let point = |&(x, y, z): &(f64, f64, f64)| Point3::new(from_mm(x), from_mm(y), from_mm(z));
        let targets: Vec<Point3<f64>> = self.nominal_targets_mm.iter().map(point).collect();
        if targets.len() != profile.targets().len() {
            return Err(CalibrationError::Targets { found: targets.len(), expected: profile.targets().len() });
        }
        Ok(Arm { chain: profile.chain().clone(), targets })
    }

    /// The identified arm of the robot of `profile`, with the payload of the identification; for another one see
    /// [`Arm::with_payload`].
    ///
    /// # Errors
    /// A parameter that this robot does not have.
    pub fn identified(&self, profile: &Profile) -> Result<Arm, KinematicsError> {
        self.identified_with(profile, self.parameters.iter().map(|parameter| parameter.deviation))
    }

    /// The arm of the robot of `profile` with the best geometry and no errors of joints.
    ///
    /// # Errors
    /// A parameter that this robot does not have.
    pub fn identified_geometry(&self, profile: &Profile) -> Result<Arm, KinematicsError> {
        let parameters = if self.geometric.is_empty() { &self.parameters } else { &self.geometric };
        let inside = |parameter: &ParameterSummary| (parameter.id, parameter.unit.from_edge(parameter.deviation));
        self.mounted_on(profile).arm().with(parameters.iter().map(inside))
    }

    /// The arm with other deviations than the identified ones, in the order and the units of [`Self::parameters`].
    ///
    /// # Errors
    /// A parameter that this robot does not have.
    pub fn identified_with(
        &self,
        profile: &Profile,
        deviations: impl IntoIterator<Item = f64>,
    ) -> Result<Arm, KinematicsError> {
        let inside =
            |(parameter, deviation): (&ParameterSummary, f64)| (parameter.id, parameter.unit.from_edge(deviation));
        let mut arm = self.mounted_on(profile).arm();
        if let Some(loads) = &self.loads {
            arm.chain = arm.chain.with_load_scale(loads.scale());
        }
        arm.with(self.parameters.iter().zip(deviations).map(inside))
    }

    /// That it was changed after it was written, in words; none if it was not, or if that cannot be known.
    pub fn edited(&self) -> Option<String> {
        match self.integrity {
            Integrity::Changed(change) => Some(format!("this calibration was changed after it was written: {change}")),
            Integrity::Intact | Integrity::Unchecked => None,
        }
    }

    /// The text of the file.
    ///
    /// # Errors
    /// The serialiser refuses; this is a defect.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        // Raw strings keep the profile readable inside the calibration.
        let layout = ron::ser::PrettyConfig::new().indentor("    ".to_owned()).escape_strings(false);
        let text = ron::ser::to_string_pretty(self, layout)?;
        let text = format!("// Calibration of '{}' by {}.\n{text}\n", self.provenance.profile, self.provenance.program);
        Ok(checksum::with_sum(&text, checksum::Syntax::Ron))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// Not a calibration, of a newer schema, or with numbers that are not finite.
    pub fn parse(text: &str) -> Result<Self, CalibrationError> {
        // A newer file may have parameters and fields that are unknown here: its version comes first.
        if let Ok(Heading { schema, provenance }) = ron::from_str(text)
            && schema > SCHEMA
        {
            return Err(CalibrationError::Schema { found: schema, program: provenance.program });
        }
        let mut calibration: Self = ron::from_str(text).map_err(|error| CalibrationError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            message: error.code.to_string(),
        })?;
        calibration.integrity = calibration.integrity_in(text);
        for parameter in calibration.parameters.iter().chain(&calibration.geometric) {
            check_parameter(parameter)?;
        }
        let stations = [
            ("base_from_station", calibration.base_from_station),
            ("nominal_base_from_station", calibration.nominal_base_from_station),
        ];
        for (field, pose) in stations {
            if pose.is_some_and(|pose| !pose.is_usable()) {
                return Err(CalibrationError::Pose { field });
            }
        }
        if calibration.mounted.is_some_and(|mounted| !mounted.is_usable()) {
            return Err(CalibrationError::Target { target: 1 });
        }
        if calibration.payload.is_some_and(|payload| !payload.is_usable()) {
            return Err(CalibrationError::Payload);
        }
        if calibration.loads.as_ref().is_some_and(|loads| !loads.is_usable()) {
            return Err(CalibrationError::Loads);
        }
        for (index, (x, y, z)) in calibration.nominal_targets_mm.iter().enumerate() {
            if ![x, y, z].into_iter().all(|value| value.is_finite()) {
                return Err(CalibrationError::Target { target: index + 1 });
            }
        }
        Ok(calibration)
    }
}

impl Calibration {
    /// What the check sums of the file `text` say.
    fn integrity_in(&self, text: &str) -> Integrity {
        match checksum::check(text) {
            Finding::Intact => Integrity::Intact,
            Finding::Changed => Integrity::Changed(Change::Content),
            Finding::Missing if self.schema > LAST_WITHOUT_SUM => Integrity::Changed(Change::SumIsMissing),
            // At least the profile has had a sum in every version.
            Finding::Missing if !self.has_its_profile() => Integrity::Changed(Change::Profile),
            Finding::Missing => Integrity::Unchecked,
        }
    }

    /// Whether the profile inside is the one of the stated SHA-256, also if an editor has changed the line breaks of the file.
    fn has_its_profile(&self) -> bool {
        let unix = self.profile.replace("\r\n", "\n");
        let windows = unix.replace('\n', "\r\n");
        [&self.profile, &unix, &windows].iter().any(|text| sha256(text.as_bytes()) == self.provenance.profile_sha256)
    }
}

/// What every version of the file begins with.
#[derive(Deserialize)]
struct Heading {
    schema: u32,
    provenance: Provenance,
}

/// Finite numbers, the unit of the parameter, and deviations that can be standard deviations.
fn check_parameter(parameter: &ParameterSummary) -> Result<(), CalibrationError> {
    let ParameterSummary { id, unit, .. } = *parameter;
    if !(parameter.nominal.is_finite() && parameter.deviation.is_finite()) {
        return Err(CalibrationError::NotFinite { parameter: id });
    }
    if parameter.deviation.abs() > LARGEST_DEVIATION {
        return Err(CalibrationError::Absurd { parameter: id, deviation: parameter.deviation });
    }
    if unit != id.unit() {
        return Err(CalibrationError::Unit { parameter: id, unit });
    }
    let usable = |value: f64| value.is_finite() && value >= 0.0;
    if !(parameter.sigma.is_none_or(usable) && usable(parameter.expected)) {
        return Err(CalibrationError::Sigma { parameter: id });
    }
    Ok(())
}
