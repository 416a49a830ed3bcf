//! Identification of the arm from measured points or direct distances, and its verification.

use std::ops::ControlFlow;

use super::assess::{direct_verification, point_verification};
use super::checks::Unseen;
use super::recalibrate::{self, Beginning, Previous};
use super::result::{self, Context};
use super::summary::{Finished, SampleName};
use super::workspace::Workspace;
use super::{EstimationSettings, ProcedureError, checks, joint_errors, target_parameters};
use crate::identification::verification::{DirectErrors, FittedSetup, ModelErrors, fit_setup};
use crate::identification::{
    Identification, Iteration, LengthEnd, Observations, PointSample, Problem, SampleIndex, Selection, Settings, Shape,
    Stage, Terms, WithTerms, identify_with_belief, identify_with_terms,
};
use crate::kinematics::Place;
use crate::profile::{Level, Profile};
use crate::session::advice::Advice;
use crate::session::calibration::{self, Calibration, LoadsText, MountedText, SampleText};
use crate::session::measurements::Layout;
use crate::session::set_up::PayloadText;
use crate::session::summary::{
    FeatureSummary, IdentificationSummary, InputFile, Refit, VerificationMode, VerificationSummary, Warning,
    WarningCode,
};
use crate::units::to_mm;

/// Most numbers in the rows of one fit, and the bytes that a fit takes for each of them: its rows, those of the step that is tried, and
/// their factor.
const MOST_NUMBERS: usize = 1 << 27;
const BYTES_PER_NUMBER: usize = 32;

/// A measured point with the place where it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSample {
    pub pose: String,
    /// Line of the file, or number of the measurement.
    pub line: usize,
    /// Configuration (rad, sliding joints m) and point (m).
    pub sample: PointSample,
    /// Temperature during the measurement (°C), for the record only.
    pub temperature: Option<f64>,
}

/// Direct distances, measured without any coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distances {
    /// Shared points and lengths.
    pub observations: Observations,
    /// Names of their places, in the order of [`Observations::places`].
    pub names: Vec<SampleName>,
    /// Position of the plate that each shared point belongs to.
    pub positions: Vec<String>,
    /// Names of the features.
    pub features: Vec<String>,
}

/// Samples for one purpose: measured points, direct distances, or both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleSet {
    /// Measured points.
    pub samples: Vec<NamedSample>,
    /// Direct distances.
    pub distances: Distances,
    /// The file that warnings name; `None` if there is only one.
    pub file: Option<String>,
    /// Warnings from reading the samples.
    pub warnings: Vec<Warning>,
}

impl From<Vec<NamedSample>> for SampleSet {
    fn from(samples: Vec<NamedSample>) -> Self {
        Self { samples, ..Self::default() }
    }
}

impl SampleSet {
    fn observations(&self) -> Observations {
        let points = self.samples.iter().map(|named| named.sample.clone()).collect();
        Observations { points, ..self.distances.observations.clone() }
    }

    /// Names of the places, in the order of [`Observations::places`].
    fn names(&self) -> Vec<SampleName> {
        let of_points = self.samples.iter().map(|named| SampleName { pose: named.pose.clone(), line: named.line });
        of_points.chain(self.distances.names.iter().cloned()).collect()
    }
}

/// A request to identify an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifyRequest {
    /// The nominal robot in its cell.
    pub profile: Profile,
    /// The text of the profile, which the calibration contains.
    pub profile_text: String,
    /// Position of the first target, if it differs from the profile.
    pub mounted: Option<MountedText>,
    /// What the flange carries, if it differs from the profile.
    pub payload: Option<PayloadText>,
    /// Time of the request (RFC 3339, UTC).
    pub created: String,
    /// Files that the samples came from.
    pub inputs: Vec<InputFile>,
    /// How to identify.
    pub settings: EstimationSettings,
    /// Samples to identify from.
    pub identification: SampleSet,
    /// Samples to verify with, measured in the same set-up; without any there is no verification.
    pub verification: SampleSet,
    /// Where the verification samples come from, in words.
    pub basis: String,
    /// The kind of verification, as a setting of the summary.
    pub verification_mode: VerificationMode,
    /// Layout of the tables, if there was a choice.
    pub layout: Option<Layout>,
    /// Known distance between the two sockets of one position (mm) and its standard deviation, for the record only.
    pub socket_distance_mm: Option<(f64, f64)>,
    /// An earlier calibration to begin with.
    pub previous: Option<Previous>,
}

/// An identified arm.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The summary in mm and degree, with the verdict.
    pub summary: IdentificationSummary,
    /// The calibration; none if there is no usable solution.
    pub calibration: Option<Calibration>,
    /// The identified arm with the pose of the instrument in its base (rad, m).
    pub found: Identification,
    /// The nominal arm in the same set-up: instrument and free target fitted to it.
    pub nominal: FittedSetup,
}

impl Identified {
    /// Puts all advice into `words`, in the summary and in the calibration.
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

/// Identifies the arm and verifies it. `progress` sees every step of the solver and every model that is tried, and may ask to stop
/// there.
///
/// # Errors
/// The samples do not fit this robot, nothing can be identified from them, or `progress` has asked to stop.
pub fn identify(
    request: &IdentifyRequest,
    progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
) -> Result<Identified, ProcedureError> {
    let IdentifyRequest { identification, mounted, payload, .. } = request;
    let profile = &calibration::mounted_on(&request.profile, mounted.as_ref(), payload.as_ref());
    let observations = identification.observations();
    let beginning = request
        .previous
        .as_ref()
        .map(|previous| Beginning::new(previous, profile, &identification.samples, request.settings.sigma))
        .transpose()?;
    let (arm, parameters) = match &beginning {
        Some(beginning) => (beginning.arm.clone(), beginning.parameters.clone()),
        None => (profile.arm(), request.settings.parameters(profile)),
    };
    let problem = Problem { arm: &arm, parameters: &parameters, observations: &observations };
    let all_constants = request.settings.parameters_of(Level::Geometric, profile);
    let plausible = Problem { parameters: &all_constants, ..problem };

    let mut warnings = set_warnings(identification, &observations, profile);
    let mut expected = None;
    if !observations.points.is_empty() {
        let compared = checks::check_plausibility(&plausible, "")?;
        warnings.extend(compared.warning);
        expected = Some(compared.expected);
    } else if !observations.features.is_empty() && !shows_size(&observations) {
        let message = "contacts without any measured length leave the size of the robot to the prior; a ball bar, a draw wire, or planes touched over gauge blocks give it";
        warnings.push(Warning::new(WarningCode::NoScale, message, true));
    } else if observations.lengths.is_empty() && !observations.shared.is_empty() {
        let message = "shared points without any known length leave the size of the robot to the prior";
        warnings.push(Warning::new(WarningCode::NoScale, message, true).with_advice(Advice::StateSocketDistance));
    }
    let settings = request.settings.solver(profile, typical_distance(&observations));
    let candidates = if beginning.is_some() { Vec::new() } else { request.settings.candidates() };
    let of_joints = candidates.iter().flatten().map(|terms| terms.parameters(&arm.chain).len()).max().unwrap_or(0);
    check_size(observations.places().count(), parameters.len() + of_joints)?;
    let with_terms = match &beginning {
        Some(beginning) => {
            warnings.extend(beginning.warning());
            let mut told = |step: &Iteration| progress(Stage::Step(*step));
            let found = identify_with_belief(&problem, &settings, &beginning.belief, &mut told)?;
            WithTerms { geometric: found.clone(), found, selection: Selection::default() }
        }
        None => identify_with_terms(&problem, &settings, &candidates, progress)?,
    };
    let found = &with_terms.found;
    let nominal = nominal_setup(&problem, found)?;
    let nominal_rms = joint_errors::nominal_rms(&problem, found, &nominal);
    let workspace = Workspace::new(profile, &problem, &with_terms, nominal_rms);
    let context = Context {
        level: request.settings.level,
        expected,
        nominal: nominal_rms,
        is_workspace_known: workspace.is_some(),
    };
    warnings.extend(result::result_warnings(&problem, found, &settings, context));
    warnings.extend(workspace.as_ref().and_then(|workspace| workspace.weak_combinations(profile)));
    warnings.extend(joint_errors::warnings(&problem, found));
    let of_identification = warnings.clone();

    let Verified { verification, warnings: doubts } = match request.verification_mode {
        VerificationMode::LeaveOneOut => {
            // Every position left out decides again between what was kept and the geometry alone.
            let kept = with_terms.selection.terms();
            let candidates = if kept.is_geometry() { Vec::new() } else { vec![vec![Terms::default()], vec![kept]] };
            leave_one_out(&problem, &settings, &candidates, &identification.distances.positions, progress)?
        }
        _ => verify(request, &plausible, &nominal, found)?,
    };
    warnings.extend(doubts);
    warnings.extend(workspace.as_ref().and_then(|workspace| workspace.warning(profile, verification.as_ref())));
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    let is_usable = !result::is_unusable(&warnings, found, &settings);
    let names = identification.names();
    let mut summary = Finished { profile, request, found, names: &names, warnings, verification }.summary();
    if !candidates.is_empty() {
        summary.selection = joint_errors::selection(&problem, &with_terms, &nominal);
    }
    summary.joint_errors = joint_errors::summaries(profile, &problem, found);
    summary.features = features(identification, found);
    let begun = request.previous.as_ref().zip(beginning.as_ref());
    if let Some((previous, beginning)) = begun {
        summary.earlier = Some(beginning.summary(previous, found));
        summary.parameters.extend(recalibrate::kept_errors(previous).cloned());
        summary.joint_errors.clone_from(&previous.calibration.joint_errors);
    }
    summary.workspace = workspace.map(|workspace| workspace.summary);
    let calibration = is_usable.then(|| Calibration {
        mounted: *mounted,
        payload: *payload,
        geometric: match &request.previous {
            Some(previous) => recalibrate::geometric(previous, &summary.parameters),
            None => joint_errors::geometric(&with_terms, &settings),
        },
        earlier: begun.map_or_else(Vec::new, |(previous, beginning)| beginning.earlier(previous)),
        ..calibration(&summary, &request.profile_text, &nominal, &problem, of_identification, found)
    });
    Ok(Identified { summary, calibration, found: with_terms.found, nominal })
}

/// Refuses a fit that would take more memory than a computer should give: where the system refuses it, the program ends without a word
/// about the cause.
fn check_size(samples: usize, parameters: usize) -> Result<(), ProcedureError> {
    let numbers = samples.saturating_mul(3 * parameters);
    let gigabytes = |numbers: usize| numbers as f64 * BYTES_PER_NUMBER as f64 / 1e9;
    if numbers <= MOST_NUMBERS {
        return Ok(());
    }
    Err(ProcedureError::TooLarge { samples, parameters, gigabytes: gigabytes(numbers), most: gigabytes(MOST_NUMBERS) })
}

/// Warnings about a set of samples as such.
fn set_warnings(set: &SampleSet, observations: &Observations, profile: &Profile) -> Vec<Warning> {
    let names = set.names();
    let rows = names.iter().zip(observations.places()).map(|(name, place)| (name.line, place.configuration.as_slice()));
    set.warnings.iter().cloned().chain(checks::limit_warning(profile, set.file.as_deref(), rows)).collect()
}

/// The features of unknown place where they were found.
fn features(set: &SampleSet, found: &Identification) -> Vec<FeatureSummary> {
    let places = set.distances.features.iter().zip(&found.features).zip(&found.feature_covariances).enumerate();
    places
        .filter_map(|(index, ((name, feature), covariance))| {
            let feature = feature.as_ref()?;
            let has_axis = !matches!(feature.shape, Shape::Point | Shape::Wire | Shape::Sphere);
            let has_size = !matches!(feature.shape, Shape::Point | Shape::Plane | Shape::Line | Shape::KnownCircle);
            let lengths = &set.distances.observations.lengths;
            let own = lengths.iter().filter(|length| length.feature() == Some((index, 0)));
            Some(FeatureSummary {
                name: name.clone(),
                shape: feature.shape,
                contacts: own.count(),
                at_mm: std::array::from_fn(|axis| to_mm(feature.at[axis])),
                sigma_mm: (!has_axis).then(|| to_mm((covariance.trace().max(0.0)).sqrt())),
                axis: has_axis.then(|| std::array::from_fn(|axis| feature.axis[axis])),
                size_mm: has_size.then(|| to_mm(feature.size)),
            })
        })
        .collect()
}

/// Whether any measured length shows how large the robot is: one between two points, or to a feature that has a size.
fn shows_size(observations: &Observations) -> bool {
    let gauged = |feature: usize| {
        let own = observations.lengths.iter().filter(|length| length.feature().is_some_and(|(own, _)| own == feature));
        let (low, high) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), length| {
            (low.min(length.length), high.max(length.length))
        });
        high > low
    };
    observations.lengths.iter().any(|length| match length.feature() {
        None => true,
        Some((feature, _)) => observations.features.get(feature).is_some_and(|shape| match shape {
            Shape::Plane => gauged(feature),
            shape => shape.shows_size(),
        }),
    })
}

/// Mean distance of the measured points from the instrument (m).
fn typical_distance(observations: &Observations) -> Option<f64> {
    let distances = observations.points.iter().map(|sample| sample.point.coords.norm());
    let count = observations.points.len();
    (count > 0).then(|| distances.sum::<f64>() / count as f64)
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

/// A verification, if there are samples for it, with warnings about it.
struct Verified {
    verification: Option<VerificationSummary>,
    warnings: Vec<Warning>,
}

/// Verifies with the verification samples, if there are any. `plausible` frees all parameters that may deviate.
fn verify(
    request: &IdentifyRequest,
    plausible: &Problem<'_>,
    nominal: &FittedSetup,
    found: &Identification,
) -> Result<Verified, ProcedureError> {
    let set = &request.verification;
    let all = set.observations();
    let joints = plausible.arm.chain.joints();
    let mut warnings = set_warnings(set, &all, &request.profile);
    check_targets(&request.profile, plausible.observations, &all)?;
    // In a session every reading was checked as it was measured.
    if request.verification_mode != VerificationMode::Session {
        warnings.extend(checks::check_verification(plausible, &all.points)?);
    }
    let known: Vec<Place> = plausible.observations.places().cloned().collect();
    let unseen = Unseen::new(joints, &known, all.places());
    let tested = unseen_observations(&all, &unseen);
    let basis = request.basis.clone();
    let errors = |arm: &FittedSetup| ModelErrors::new(&arm.arm, &arm.base_from_station, &tested.points);
    let identified = FittedSetup {
        arm: found.arm.clone(),
        base_from_station: found.base_from_station.clone(),
        features: found.features.clone(),
    };
    let (mut summary, vectors) = if let (Some(nominal), Some(identified)) = (errors(nominal), errors(&identified)) {
        let summary = point_verification(joints, &tested.points, &nominal, &identified, basis, Refit::None);
        (summary, identified.vectors)
    } else if tested.places().next().is_some() {
        let [nominal, identified] =
            [nominal, &identified].map(|setup| DirectErrors::new(&setup.arm, &setup.features, &tested));
        (direct_verification(joints, &nominal, &identified, &tested, basis), Vec::new())
    } else {
        return Ok(Verified { verification: None, warnings });
    };
    summary.left_out = unseen.left_out();
    let named = set.samples.iter().zip(&unseen.counts).filter(|(_, counts)| **counts).map(|(named, _)| named);
    let named = named.zip(&vectors);
    let far = checks::far_warning(named.map(|(named, error)| (named.pose.as_str(), named.line, error)));
    warnings.extend(unseen.warning);
    summary.independent = checks::is_independent(&warnings);
    warnings.extend(checks::set_warnings(&request.profile, &known, &tested.places().cloned().collect::<Vec<_>>()));
    warnings.extend(checks::few_warning(summary.samples, tested.distinct(joints).min(summary.samples)));
    warnings.extend(far);
    warnings.extend(checks::better_warning(&summary));
    Ok(Verified { verification: Some(summary), warnings })
}

/// The samples that count. A length does where one of its ends does, or where both are shared points.
fn unseen_observations(all: &Observations, unseen: &Unseen) -> Observations {
    let seats = all.points.len() + all.shared.iter().map(|shared| shared.at.len()).sum::<usize>();
    let mut ends = unseen.counts.iter().skip(seats);
    let lengths: Vec<bool> = all
        .lengths
        .iter()
        .map(|length| {
            let targets = [&length.from, &length.to].into_iter().filter(|end| matches!(end, LengthEnd::Target(_)));
            let counts: Vec<bool> = targets.filter_map(|_| ends.next().copied()).collect();
            counts.is_empty() || counts.contains(&true)
        })
        .collect();
    all.of_samples(|sample| match sample {
        SampleIndex::Place(place) => unseen.counts.get(place).copied().unwrap_or(true),
        SampleIndex::Length(length) => lengths.get(length).copied().unwrap_or(true),
    })
}

/// Refuses targets that only the verification has, and whose position nobody knows exactly: they would be judged at a guess.
fn check_targets(profile: &Profile, known: &Observations, tested: &Observations) -> Result<(), ProcedureError> {
    let unknown = checks::unknown_targets(profile, known.places(), tested.places());
    if unknown.is_empty() { Ok(()) } else { Err(ProcedureError::UnknownTargets(unknown)) }
}

/// Identifies once per position of the plate without it, and pools the errors on the positions left out. `positions` has the
/// position of every shared point.
fn leave_one_out(
    problem: &Problem<'_>,
    settings: &Settings,
    candidates: &[Vec<Terms>],
    positions: &[String],
    progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
) -> Result<Verified, ProcedureError> {
    let mut distinct: Vec<&String> = Vec::new();
    for position in positions {
        if !distinct.contains(&position) {
            distinct.push(position);
        }
    }
    if distinct.len() < 2 {
        return Err(ProcedureError::OnePosition);
    }
    let empty = || DirectErrors::new(problem.arm, &[], &Observations::default());
    let (mut nominal, mut identified, mut tested) = (empty(), empty(), Observations::default());
    for position in &distinct {
        let kept = problem.observations.of_shared(|index| positions.get(index) != Some(*position));
        let left_out = problem.observations.of_shared(|index| positions.get(index) == Some(*position));
        let without = Problem { observations: &kept, ..*problem };
        let WithTerms { found, .. } = identify_with_terms(&without, settings, candidates, progress)?;
        let of_nominal = nominal_setup(&without, &found)?;
        nominal = nominal.pooled_with(&DirectErrors::new(&of_nominal.arm, &of_nominal.features, &left_out));
        identified = identified.pooled_with(&DirectErrors::new(&found.arm, &found.features, &left_out));
        tested.shared.extend(left_out.shared);
    }
    let joints = problem.arm.chain.joints();
    let basis = format!("leaving out each of {} positions in turn", distinct.len());
    let summary = direct_verification(joints, &nominal, &identified, &tested, basis);
    let poses = problem.observations.distinct(joints).min(summary.samples);
    let few = checks::few_warning(summary.samples, poses);
    let warnings = few.into_iter().chain(checks::better_warning(&summary)).collect();
    Ok(Verified { verification: Some(summary), warnings })
}

/// The calibration of a result; `warnings` are those about the identification itself.
fn calibration(
    summary: &IdentificationSummary,
    profile_text: &str,
    nominal: &FittedSetup,
    problem: &Problem<'_>,
    warnings: Vec<Warning>,
    found: &Identification,
) -> Calibration {
    let joints = problem.arm.chain.joints();
    let sample = |at: &Place| {
        let values = at.configuration.iter().zip(joints);
        SampleText::new(at.target, values.map(|(value, joint)| joint.joint_type.quantity().to_edge(*value)))
    };
    Calibration {
        schema: calibration::SCHEMA,
        integrity: calibration::Integrity::Intact,
        provenance: summary.provenance.clone(),
        settings: summary.settings.clone(),
        sigma: summary.sigma.clone(),
        verdict: summary.verdict.clone(),
        warnings,
        rank: summary.rank,
        parameters: summary.parameters.clone(),
        base_from_station: found.base_from_station.first().map(Into::into),
        nominal_base_from_station: nominal.base_from_station.first().map(Into::into),
        nominal_targets_mm: nominal
            .arm
            .targets
            .iter()
            .map(|point| (to_mm(point.x), to_mm(point.y), to_mm(point.z)))
            .collect(),
        samples: problem.observations.places().map(sample).collect(),
        mounted: None,
        payload: None,
        loads: LoadsText::of(&found.arm.chain, &summary.parameters),
        geometric: Vec::new(),
        selection: summary.selection.clone(),
        joint_errors: summary.joint_errors.clone(),
        workspace: summary.workspace.clone(),
        earlier: Vec::new(),
        profile: profile_text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_that_take_all_the_memory_are_refused() {
        assert!(check_size(250_000, 28).is_ok() && check_size(150_000, 240).is_ok());
        let refused = check_size(250_000, 240).unwrap_err().to_string();
        assert!(refused.contains("would take about 6 GB of memory, and at most 4 GB are used"), "{refused}");
    }
}
