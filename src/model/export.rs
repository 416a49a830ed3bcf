//! Exports of the identified arm in each format, each checked by reading it back.

use clap::ValueEnum;
use nalgebra::{Isometry3, Vector3};

use super::profile_text::{Heading, complete};
use super::proof::{self, Agreement, prove};
use super::tables::{read_csv, read_json, read_ur, write_csv, write_json, write_ur};
use super::transforms::{is_coupled, link_values, motion, number, roll_pitch_yaw};
use super::urdf::Urdf;
use super::{ModelError, corrections, urdf_write};
use crate::checksum;
use crate::kinematics::{Arm, ForwardKinematics, JointType, KinematicChain, ParameterId};
use crate::profile::{Profile, Target};
use crate::session::calibration::Calibration;
use crate::session::joint_errors::millimetres;
use crate::session::summary::{JointErrorSummary, SelectionSummary, VerdictStatus, WarningCode};
use crate::units::{to_deg, to_mm};

/// A format of a model. The comments on the values are the help of `--format`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Format {
    /// Robot profile with the identified geometry
    CorrectedProfile,
    /// URDF
    Urdf,
    /// default_kinematics.yaml of the ROS description of Universal Robots
    UrKinematics,
    /// Table of link constants
    DhCsv,
    /// Link constants for programs
    Json,
    /// Table of corrections for the angle of each joint
    JointCorrections,
}

impl Format {
    /// Usual name of the file.
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::CorrectedProfile => "corrected.ron",
            Self::Urdf => "corrected.urdf",
            Self::UrKinematics => "default_kinematics.yaml",
            Self::DhCsv => "dh.csv",
            Self::Json => "corrected.json",
            Self::JointCorrections => "joint-corrections.csv",
        }
    }

    /// Whether the format carries the positions of the targets on the flange.
    const fn has_targets(self) -> bool {
        match self {
            Self::CorrectedProfile | Self::Json => true,
            Self::Urdf | Self::UrKinematics | Self::DhCsv | Self::JointCorrections => false,
        }
    }

    /// Whether the format carries geometry, and nothing else of the arm.
    pub const fn is_geometry(self) -> bool {
        match self {
            Self::CorrectedProfile | Self::Urdf | Self::UrKinematics | Self::DhCsv | Self::Json => true,
            Self::JointCorrections => false,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct CalibratedArm {
    /// The nominal robot with the targets as they were mounted.
    pub profile: Profile,
    /// The identified arm, with the errors of its joints.
    pub identified: Arm,
    /// The arm that was identified as geometry alone: what formats get that know nothing else. The identified arm where its joints
    /// have no errors; never its geometric part, which is wrong without the rest.
    pub geometry: Arm,
    /// What geometry alone loses, in words; none where the joints have no errors.
    pub lost: Option<String>,
    /// The errors of the joints.
    pub joint_errors: Vec<JointErrorSummary>,
    /// A few lines about the origin of the result and its verdict.
    pub about: Vec<String>,
    /// Reasons not to apply it: it was changed or not accepted, or nothing was measured.
    pub cautions: Vec<String>,
    /// That the calibration was changed after it was written, in words.
    pub edited: Option<String>,
    /// Constants of the last link that the data determine only in combination with others, with their standard deviations.
    /// Orientations, and tool points away from the measured target, are as uncertain.
    pub untold: Vec<String>,
}

impl CalibratedArm {
    /// The arm of a calibration; `profile` is the one that the calibration carries.
    ///
    /// # Errors
    /// The calibration has a parameter that this robot does not have.
    pub fn new(calibration: &Calibration, profile: &Profile) -> Result<Self, ModelError> {
        let profile = calibration.mounted_on(profile);
        let unsuitable = |error| ModelError::Unsuitable(format!("the calibration does not fit its profile: {error}"));
        let identified = calibration.identified(&profile).map_err(unsuitable)?;
        let geometry = calibration.identified_geometry(&profile).map_err(unsuitable)?;
        let provenance = &calibration.provenance;
        let cautions = cautions(calibration);
        let mut about = vec![
            format!("Identified geometry of '{}'", profile.title()),
            format!("profile {}, calibrated with {}", profile.name(), provenance.program),
            format!("verdict on the calibration: {}", calibration.verdict.word().to_lowercase()),
        ];
        about.extend(cautions.iter().map(|caution| format!("WARNING: {caution}")));
        let untold = untold(calibration, profile.chain().dof());
        let lost = (!calibration.geometric.is_empty()).then(|| lost(calibration));
        let joint_errors = calibration.joint_errors.clone();
        let edited = calibration.edited();
        Ok(Self { profile, identified, geometry, lost, joint_errors, about, cautions, edited, untold })
    }

    /// The targets at the positions that were identified with the geometry alone.
    fn targets(&self) -> Vec<Target> {
        let identified = self.profile.targets().iter().zip(&self.geometry.targets);
        identified.map(|(target, place)| Target { position_in_flange: *place, ..target.clone() }).collect()
    }

    /// The same arm; what `format` loses is among the lines about it.
    fn for_format(&self, format: Format) -> Self {
        let mut arm = self.clone();
        arm.about.extend(self.lost.clone().filter(|_| format.is_geometry()));
        arm
    }

    fn limits(&self) -> Vec<Option<(f64, f64)>> {
        self.profile.joints().iter().map(|range| range.limits).collect()
    }
}

/// Reasons not to apply a calibration.
fn cautions(calibration: &Calibration) -> Vec<String> {
    let verdict = &calibration.verdict;
    let refused = (verdict.status == VerdictStatus::NotAccepted)
        .then(|| format!("this calibration was not accepted: {}", verdict.reasons.join("; ")));
    let warnings = calibration.warnings.iter();
    let serious = warnings.filter(|warning| warning.blocks_acceptance || warning.code == WarningCode::Simulated);
    calibration.edited().into_iter().chain(refused).chain(serious.map(|warning| warning.message.clone())).collect()
}

/// What the formats of geometry lose of a calibration with errors of joints.
fn lost(calibration: &Calibration) -> String {
    let of_selection = |selection: &SelectionSummary| {
        let geometry = selection.candidates.iter().find(|candidate| candidate.terms.is_geometry())?;
        let (geometry, whole) = (millimetres(geometry.left_out_rms_mm), millimetres(selection.left_rms_mm));
        Some(format!(": at poses left out in turn it is {geometry} mm rms off, the whole model {whole} mm"))
    };
    let alone = calibration.selection.as_ref().and_then(of_selection).unwrap_or_default();
    let apart = calibration.workspace.as_ref().and_then(|workspace| workspace.beside_geometry_rms_mm);
    let apart = apart.map_or_else(String::new, |apart| {
        format!("; over the whole range of the joints the two are {} mm rms apart", millimetres(apart))
    });
    format!("geometry only, identified without the errors of the joints{alone}{apart}")
}

/// Constants of the last of `joints` links that the data determine only in combination with others.
fn untold(calibration: &Calibration, joints: usize) -> Vec<String> {
    let is_of_last_link = |id: ParameterId| !id.is_joint_error() && id.joint().is_some_and(|joint| joint + 1 == joints);
    let parameters = calibration.parameters.iter();
    parameters
        .filter(|parameter| !parameter.identifiable && is_of_last_link(parameter.id))
        .filter_map(|parameter| {
            let sigma = parameter.sigma.filter(|sigma| *sigma > 0.0)?;
            Some(format!("{} ({:.2} {})", parameter.id, sigma, parameter.unit))
        })
        .collect()
}

/// A URDF that is to take the identified geometry.
#[derive(Clone, Copy, Debug)]
pub struct GivenUrdf<'a> {
    pub text: &'a str,
    /// Link that is the base of the profile.
    pub base: &'a str,
    /// Link at the end of the chain.
    pub tip: &'a str,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct ExportOptions<'a> {
    /// URDF only: put the geometry into this URDF.
    pub into: Option<GivenUrdf<'a>>,
    /// UR kinematics only: leave to the tool what the format cannot express about the flange.
    pub with_tool_offset: bool,
}

/// A written model that was read back and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    pub text: String,
    /// Its agreement after reading it back: with the identified geometry, or of a table of corrections with the curves of the joints,
    /// interpolated linearly between its rows.
    pub agreement: Agreement,
    /// Remarks for its use.
    pub remarks: Vec<String>,
}

/// Writes a model, reads it back and compares it with the identified geometry, or the table of corrections with the curves.
///
/// # Errors
/// The arm does not fit the format, or the text does not agree with it to 1 µm and 1 µrad at 1,000 random configurations.
pub fn export(arm: &CalibratedArm, format: Format, options: &ExportOptions<'_>) -> Result<Export, ModelError> {
    let (identified, limits) = (&arm.geometry.chain, arm.limits());
    let arm = &arm.for_format(format);
    let proven = |chain: &KinematicChain| {
        let written = ForwardKinematics::new(chain);
        prove(identified, &limits, proof::EXPORT, |q| written.base_from_flange(q))
    };
    let mut remarks = Vec::new();
    let (text, agreement) = match format {
        Format::CorrectedProfile => {
            let text = corrected_profile(arm);
            let (read, _) =
                Profile::parse(&text, format.file_name()).map_err(|errors| ModelError::ReadBack(errors.to_string()))?;
            let agreement = proven(read.chain())?;
            (checksum::with_sum(&text, checksum::Syntax::Ron), agreement)
        }
        Format::DhCsv => {
            let text = write_csv(&arm.about, identified)?;
            let agreement = proven(&read_csv(&text)?)?;
            (text, agreement)
        }
        Format::Json => {
            let text = write_json(arm.profile.name(), &arm.about, arm.profile.chain(), identified, &arm.targets())?;
            let agreement = proven(&read_json(&text)?)?;
            (text, agreement)
        }
        Format::UrKinematics => ur_kinematics(arm, options, &mut remarks)?,
        Format::Urdf => urdf(arm, options, &mut remarks)?,
        Format::JointCorrections => corrections::write(arm)?,
    };
    if let Some(lost) = arm.lost.as_ref().filter(|_| format.is_geometry()) {
        remarks.push(lost.clone());
    }
    if format.is_geometry() && !format.has_targets() {
        remarks.push("the place of the target on the flange is not part of this format".to_owned());
    }
    Ok(Export { text, agreement, remarks })
}

fn corrected_profile(arm: &CalibratedArm) -> String {
    let profile = &arm.profile;
    let mut comments = arm.about.clone();
    comments.push(
        "The constants are the identified ones. Targets stand where they were identified: mount them again,".to_owned(),
    );
    comments.push("and measure them.".to_owned());
    let heading = Heading {
        comments: &comments,
        name: &format!("{}-corrected", profile.name()),
        title: &format!("{}, corrected", profile.title()),
        source: &format!("identified; nominal: {}", profile.source()),
    };
    complete(&heading, profile, &arm.geometry.chain, &arm.targets())
}

fn ur_kinematics(
    arm: &CalibratedArm,
    options: &ExportOptions<'_>,
    remarks: &mut Vec<String>,
) -> Result<(String, Agreement), ModelError> {
    let written = write_ur(&arm.about, &arm.geometry.chain)?;
    let rest = written.flange_in_wrist_3;
    let offset = offset_text(&rest);
    let is_small =
        rest.translation.vector.norm() <= proof::EXPORT.position && rest.rotation.angle() <= proof::EXPORT.angle;
    if !is_small && !options.with_tool_offset {
        return Err(ModelError::FlangeOffset { offset });
    }
    if !is_small {
        remarks.push(format!("the tool must carry what the file cannot express: in front of every tool {offset}"));
    }
    let origins = read_ur(&written.text)?;
    let agreement = prove(&arm.geometry.chain, &arm.limits(), proof::EXPORT, |q| {
        let joints =
            origins.iter().zip(q).map(|(origin, q)| origin * motion(JointType::Revolute, &Vector3::z_axis(), *q));
        joints.fold(Isometry3::identity(), |pose, joint| pose * joint) * rest
    })?;
    Ok((written.text, agreement))
}

fn offset_text(pose: &Isometry3<f64>) -> String {
    format!(
        "x y z {} mm, roll pitch yaw {} deg",
        pose.translation.vector.iter().map(|value| rounded(to_mm(*value), 1e4)).collect::<Vec<_>>().join(" "),
        roll_pitch_yaw(&pose.rotation).map(|value| rounded(to_deg(value), 1e6)).join(" ")
    )
}

/// A number for a message, in parts of `scale`.
fn rounded(value: f64, scale: f64) -> String {
    number((value * scale).round() / scale)
}

fn urdf(
    arm: &CalibratedArm,
    options: &ExportOptions<'_>,
    remarks: &mut Vec<String>,
) -> Result<(String, Agreement), ModelError> {
    let (nominal, identified, limits) = (arm.profile.chain(), &arm.geometry.chain, arm.limits());
    let coupled: Vec<&str> =
        identified.joints().iter().filter(|joint| is_coupled(joint)).map(|joint| joint.name.as_str()).collect();
    let mut comments = arm.about.clone();
    if !coupled.is_empty() {
        let note = format!(
            "Joint values of {} turn one link against the one before: the pendant shows other values where joints are coupled.",
            coupled.join(", ")
        );
        comments.push(note.clone());
        remarks.push(note);
    }
    let (text, base, tip, flange_from_tip) = match options.into {
        None => {
            let text = urdf_write::fresh(arm.profile.name(), &comments, identified, arm.profile.joints())?;
            (text, urdf_write::BASE, urdf_write::FLANGE, Isometry3::identity())
        }
        Some(GivenUrdf { text, base, tip }) => {
            let patched = urdf_write::patch(text, base, tip, nominal, identified, &limits)?;
            remarks.push(format!("origins replaced: {}", patched.joints.join(", ")));
            if patched.flange_from_tip != Isometry3::identity() {
                let offset = offset_text(&patched.flange_from_tip);
                remarks.push(format!("link '{tip}' keeps its position on the flange of the profile: {offset}"));
            }
            (patched.text, base, tip, patched.flange_from_tip)
        }
    };
    let read = Urdf::parse(&text).map_err(|error| ModelError::ReadBack(error.to_string()))?;
    let chain = read.chain(base, tip).map_err(|error| ModelError::ReadBack(error.to_string()))?;
    let tip_from_flange = flange_from_tip.inverse();
    let agreement = prove(identified, &limits, proof::EXPORT, |q| {
        chain.base_from_tip(&link_values(identified, q)) * tip_from_flange
    })?;
    Ok((text, agreement))
}
