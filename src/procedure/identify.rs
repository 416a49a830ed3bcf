//! From measured points to an identified, verified arm.

use std::ops::ControlFlow;

use super::assess::point_verification;
use super::result::{self, Context};
use super::summary::{Finished, SampleName};
use super::{EstimationSettings, ProcedureError, checks, target_parameters};
use crate::identification::verification::{FittedSetup, ModelErrors, fit_setup};
use crate::identification::{Identification, Iteration, Observations, Places, PointSample, Problem, identify_while};
use crate::kinematics::Place;
use crate::profile::{Level, Profile};
use crate::session::advice::Advice;
use crate::session::calibration::{self, Calibration, MountedText, SampleText};
use crate::session::measurements::Layout;
use crate::session::summary::{
    IdentificationSettings, IdentificationSummary, InputFile, Refit, VerificationMode, VerificationSummary, Warning,
};
use crate::units::to_mm;

/// A sample with the place where it was written down.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSample {
    /// Name of the pose.
    pub pose: String,
    /// Line of the file, or number of the measurement.
    pub line: usize,
    /// What was measured: configuration (rad, sliding joints m) and point (m).
    pub sample: PointSample,
    /// Temperature when it was measured (°C), for the record only.
    pub temperature: Option<f64>,
}

/// Samples that serve one purpose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleSet {
    /// The samples.
    pub samples: Vec<NamedSample>,
    /// The file that warnings name; `None` where there is only one.
    pub file: Option<String>,
    /// What is already known to be odd about them.
    pub warnings: Vec<Warning>,
}

impl From<Vec<NamedSample>> for SampleSet {
    fn from(samples: Vec<NamedSample>) -> Self {
        Self { samples, ..Self::default() }
    }
}

impl SampleSet {
    /// Line and configuration of the samples.
    fn configurations(&self) -> impl Iterator<Item = (usize, &[f64])> {
        self.samples.iter().map(|named| (named.line, named.sample.at.configuration.as_slice()))
    }

    /// The samples without their names.
    fn points(&self) -> Vec<PointSample> {
        self.samples.iter().map(|named| named.sample.clone()).collect()
    }
}

/// What is to be identified, and from what.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifyRequest {
    /// The nominal robot in its cell.
    pub profile: Profile,
    /// The text of the profile, which the calibration carries along.
    pub profile_text: String,
    /// Where the first target is mounted, if not where the profile has it.
    pub mounted: Option<MountedText>,
    /// When this is asked for (RFC 3339, UTC).
    pub created: String,
    /// Files that the samples came from.
    pub inputs: Vec<InputFile>,
    /// How to identify.
    pub settings: EstimationSettings,
    /// What to identify from.
    pub identification: SampleSet,
    /// What to verify with, measured in the same set-up; without samples nothing is verified.
    pub verification: SampleSet,
    /// Where the verification samples come from, in words.
    pub basis: String,
    /// The same as a setting of the summary.
    pub verification_mode: VerificationMode,
    /// Layout of the tables, where there was a choice.
    pub layout: Option<Layout>,
}

/// An identified arm.
#[derive(Clone, Debug)]
pub struct Identified {
    /// Everything about it in mm and degree, with the verdict.
    pub summary: IdentificationSummary,
    /// What is kept of it; none if there is no usable solution.
    pub calibration: Option<Calibration>,
    /// The identified arm with the pose of the instrument in its base (rad, m).
    pub found: Identification,
    /// The nominal arm in the same set-up: instrument and free target fitted to it.
    pub nominal: FittedSetup,
}

impl Identified {
    /// Puts all advice into `words`, in the summary and in what the calibration keeps of it.
    pub fn put_into_words(&mut self, words: impl Fn(Advice) -> String) {
        let Self { summary, calibration, .. } = self;
        let of_calibration = calibration.iter_mut().flat_map(|calibration| &mut calibration.warnings);
        summary.warnings.iter_mut().chain(of_calibration).for_each(|warning| warning.put_into_words(&words));
        summary.verdict.put_into_words(&words);
        if let Some(calibration) = calibration {
            calibration.verdict.put_into_words(&words);
        }
    }
}

/// Identifies the arm and verifies it. `progress` sees every step of the solver and may ask to stop there.
///
/// # Errors
/// The samples cannot be of this robot, or nothing can be identified from them; or `progress` has asked to stop.
pub fn identify(
    request: &IdentifyRequest,
    progress: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Identified, ProcedureError> {
    let IdentifyRequest { identification, verification, mounted, .. } = request;
    let profile = &mounted.map_or_else(|| request.profile.clone(), |mounted| mounted.on(&request.profile));
    let parameters = request.settings.parameters(profile);
    let arm = profile.arm();
    let observations = Observations { points: identification.points(), ..Observations::default() };
    let problem = Problem { arm: &arm, parameters: &parameters, observations: &observations };

    let file = identification.file.as_deref();
    let mut warnings = identification.warnings.clone();
    warnings.extend(checks::limit_warning(profile, file, identification.configurations()));
    let expected = request.settings.parameters_of(Level::default(), profile);
    let expected = Problem { parameters: &expected, ..problem };
    let compared = checks::check_plausibility(&expected, "")?;
    warnings.extend(compared.warning);

    let distance = observations.points.iter().map(|sample| sample.point.coords.norm()).sum::<f64>()
        / observations.points.len().max(1) as f64;
    let settings = request.settings.solver(profile, Some(distance));
    let found = identify_while(&problem, &settings, progress)?;
    let context = Context { level: request.settings.level, expected: Some(compared.expected) };
    warnings.extend(result::result_warnings(&problem, &found, &settings, context));

    let nominal = nominal_setup(&problem, &found)?;
    let of_identification = warnings.clone();
    warnings.extend(verification.warnings.iter().cloned());
    warnings.extend(checks::limit_warning(profile, verification.file.as_deref(), verification.configurations()));
    let tested = verification.points();
    // In a session every reading was looked at by itself.
    if request.verification_mode != VerificationMode::Session {
        warnings.extend(checks::check_verification(&expected, &tested)?);
    }
    let verified = verify(profile, &nominal, &found, &tested, request.basis.clone());
    let verified = verified.map(|(mut verified, errors)| {
        let places = |samples: &[PointSample]| samples.iter().map(|sample| sample.at.clone()).collect::<Vec<_>>();
        let (known, tested) = (places(&observations.points), places(&tested));
        let joints = profile.chain().joints();
        let doubts = checks::set_warnings(joints, &known, &tested);
        verified.independent = checks::is_independent(&doubts);
        warnings.extend(doubts);
        warnings.extend(checks::few_warning(verified.samples, Places::new(joints, &tested).distinct()));
        let named = verification.samples.iter().zip(&errors.vectors);
        warnings.extend(checks::far_warning(named.map(|(named, error)| (named.pose.as_str(), named.line, error))));
        verified
    });
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    let unusable = result::is_unusable(&warnings, &found, &settings);
    let name = |named: &NamedSample| SampleName { pose: named.pose.clone(), line: named.line };
    let names: Vec<SampleName> = identification.samples.iter().map(name).collect();
    let finished = Finished {
        profile,
        profile_text: &request.profile_text,
        created: request.created.clone(),
        inputs: request.inputs.clone(),
        settings: IdentificationSettings {
            layout: request.layout,
            verification: request.verification_mode,
            ..request.settings.record()
        },
        found: &found,
        names: &names,
        warnings,
        verification: verified,
    };
    let summary = finished.summary();
    let calibration = (!unusable).then(|| Calibration {
        mounted: *mounted,
        ..calibration(&summary, &request.profile_text, &nominal, &problem, of_identification, Some(&found))
    });
    Ok(Identified { summary, calibration, found, nominal })
}

/// The nominal arm with frame and free target fitted to the accepted identification samples.
fn nominal_setup(problem: &Problem<'_>, found: &Identification) -> Result<FittedSetup, ProcedureError> {
    let points: Vec<PointSample> = problem
        .observations
        .points
        .iter()
        .enumerate()
        .filter(|(index, _)| !found.is_rejected(*index))
        .map(|(_, sample)| sample.clone())
        .collect();
    let accepted = Observations { points, ..problem.observations.clone() };
    Ok(fit_setup(problem.arm, &target_parameters(problem.parameters), &accepted)?)
}

fn verify(
    profile: &Profile,
    nominal: &FittedSetup,
    found: &Identification,
    samples: &[PointSample],
    basis: String,
) -> Option<(VerificationSummary, ModelErrors)> {
    let nominal = ModelErrors::new(&nominal.arm, &nominal.base_from_station, samples)?;
    let identified = ModelErrors::new(&found.arm, &found.base_from_station, samples)?;
    let summary = point_verification(profile.chain().joints(), samples, &nominal, &identified, basis, Refit::None);
    Some((summary, identified))
}

/// The calibration file of a result; `warnings` are those about the identification itself.
pub(crate) fn calibration(
    summary: &IdentificationSummary,
    profile_text: &str,
    nominal: &FittedSetup,
    problem: &Problem<'_>,
    warnings: Vec<Warning>,
    found: Option<&Identification>,
) -> Calibration {
    let station = found.and_then(|found| found.base_from_station.first());
    let joints = problem.arm.chain.joints();
    let sample = |at: &Place| {
        let values = at.configuration.iter().zip(joints);
        SampleText::new(at.target, values.map(|(value, joint)| joint.joint_type.quantity().to_edge(*value)))
    };
    Calibration {
        schema: calibration::SCHEMA,
        provenance: summary.provenance.clone(),
        settings: summary.settings.clone(),
        sigma: summary.sigma.clone(),
        verdict: summary.verdict.clone(),
        warnings,
        rank: summary.rank,
        parameters: summary.parameters.clone(),
        base_from_station: station.map(Into::into),
        nominal_base_from_station: nominal.base_from_station.first().map(Into::into),
        nominal_targets_mm: nominal
            .arm
            .targets
            .iter()
            .map(|point| (to_mm(point.x), to_mm(point.y), to_mm(point.z)))
            .collect(),
        samples: problem.observations.places().map(sample).collect(),
        mounted: None,
        profile: profile_text.to_owned(),
    }
}
