//! What every identifying command does the same way: settings from the command line, warnings, and the summary of a result.

use std::io::Write;

use nalgebra::Point3;

use super::load::{LoadedProfile, now, sha256};
use super::progress::Progress;
use super::{Console, assess};
use crate::cli::{EstimationArgs, EstimatorArg, ExpectedDeviation, LevelArg, PriorArg};
use crate::error::{ExitStatus, Failure};
use crate::identification::{
    Estimator, Identification, IdentificationError, Observability, Prior, Problem, RejectionReason, SampleIndex,
    Settings, SigmaSource, TerminationReason, Weighting, identify,
};
use crate::kinematics::{FreeParameter, ParameterId};
use crate::profile::{Level, Profile};
use crate::session::summary::{
    BlindGroupSummary, CorrelationSummary, EstimatorName, IdentificationSettings, IdentificationSummary, InputFile,
    IterationSummary, ParameterSummary, Provenance, RejectedSummary, SCHEMA, SigmaOrigin, SigmaSummary, Termination,
    Verdict, VerificationMode, Warning,
};
use crate::units::{Quantity, from_mm, to_deg, to_mm};

/// Correlations beyond this are listed.
const STRONG_CORRELATION: f64 = 0.9;

/// Name of the program in results.
pub(super) fn program() -> String {
    format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))
}

/// Provenance of results made now.
pub(super) fn provenance(profile: &Profile, profile_text: &str, inputs: Vec<InputFile>) -> Provenance {
    Provenance {
        program: program(),
        created: now(),
        profile: profile.name().to_owned(),
        robot: profile.title().to_owned(),
        profile_sha256: sha256(profile_text.as_bytes()),
        inputs,
    }
}

/// The free parameters that the command line asks for.
pub(super) fn parameters(args: &EstimationArgs, profile: &Profile) -> Vec<FreeParameter> {
    let level = match args.level {
        LevelArg::Offsets => Level::Offsets,
        LevelArg::Geometric => Level::Geometric,
    };
    parameters_of(level, args, profile)
}

/// The free parameters of a level with the expected deviations of the command line.
pub(super) fn parameters_of(level: Level, args: &EstimationArgs, profile: &Profile) -> Vec<FreeParameter> {
    let mut parameters = profile.free_parameters(level);
    expected_by(args.expected_deviation, &mut parameters);
    parameters
}

/// Replaces the expected deviations of the link constants by those of the command line, if it gives any.
pub(super) fn expected_by(expected: Option<ExpectedDeviation>, parameters: &mut [FreeParameter]) {
    let Some(ExpectedDeviation { length, angle }) = expected else { return };
    for parameter in parameters.iter_mut().filter(|parameter| matches!(parameter.id, ParameterId::Link { .. })) {
        parameter.expected = match parameter.id.quantity() {
            Quantity::Length => length,
            Quantity::Angle => angle,
        };
    }
}

/// The target coordinates among `parameters`.
pub(super) fn target_parameters(parameters: &[FreeParameter]) -> Vec<FreeParameter> {
    parameters.iter().filter(|parameter| matches!(parameter.id, ParameterId::Target { .. })).copied().collect()
}

/// Nominal target coordinates (m).
pub(super) fn nominal_targets(profile: &Profile) -> Vec<Point3<f64>> {
    profile.targets().iter().map(|target| target.position_in_flange).collect()
}

/// Settings of the solver; `distance` is the typical distance from the instrument (m), if there is one.
pub(super) fn settings(
    args: &EstimationArgs,
    weighting: Weighting,
    profile: &Profile,
    distance: Option<f64>,
) -> Settings {
    let option = args.sigma_mm.map(|sigma| (from_mm(sigma), SigmaSource::Option));
    let instrument = || {
        let instrument = profile.instrument()?;
        Some((instrument.sigma_at(distance?), SigmaSource::Instrument))
    };
    Settings {
        weighting,
        prior: match args.prior {
            PriorArg::Expected => Prior::Expected,
            PriorArg::None => Prior::None,
        },
        estimator: match args.estimator {
            EstimatorArg::Robust => Estimator::Robust,
            EstimatorArg::LeastSquares => Estimator::LeastSquares,
        },
        iterations: args.iterations,
        sigma: option.or_else(instrument),
    }
}

/// Solves, with progress on stderr.
pub(super) fn solve<O: Write, E: Write>(
    problem: &Problem<'_>,
    settings: &Settings,
    console: &mut Console<O, E>,
) -> Result<Identification, Failure> {
    let mut progress = Progress::new(&mut console.err);
    identify(problem, settings, &mut |iteration| progress.step(iteration))
        .map_err(|error| identification_failure(&error))
}

/// What an identification error means to the operator.
pub(super) fn identification_failure(error: &IdentificationError) -> Failure {
    let (status, hint) = match error {
        IdentificationError::RankUnclear { .. } => {
            (ExitStatus::Numerical, "use '--prior expected' (the default), or measure a planned pose set")
        }
        IdentificationError::Mirrored { .. } => (
            ExitStatus::Usage,
            "the instrument's frame is left-handed: reverse the sign of one coordinate axis, or swap two",
        ),
        IdentificationError::Diverged => {
            (ExitStatus::Numerical, "check units, joint signs and row order; use '--prior expected'")
        }
        IdentificationError::NoData => (ExitStatus::Usage, "check '--use': which rows does it leave?"),
        _ => (ExitStatus::Usage, "check that profile and table belong to the same robot"),
    };
    Failure::from_error(status, error).hint(hint)
}

/// A warning.
pub(super) fn warning(code: &str, message: String, blocks_acceptance: bool) -> Warning {
    Warning { code: code.to_owned(), message, blocks_acceptance }
}

/// Where the samples of an identification were written down.
#[derive(Clone, Debug)]
pub(super) struct SampleName {
    pub(super) pose: String,
    pub(super) line: usize,
}

impl SampleName {
    /// As it reads in a message.
    pub(super) fn text(&self) -> String {
        format!("pose {} (line {})", self.pose, self.line)
    }
}

/// The rejected samples with their names.
fn rejected(found: &Identification, names: &[SampleName]) -> Vec<RejectedSummary> {
    let name =
        |place: usize| names.get(place).cloned().unwrap_or_else(|| SampleName { pose: place.to_string(), line: 0 });
    found
        .rejected
        .iter()
        .map(|rejected| {
            let SampleName { pose, line } = match rejected.sample {
                SampleIndex::Place(place) => name(place),
                // Rows of a table of lengths name both ends; a known distance between sockets has no row.
                SampleIndex::Length(length) => {
                    let line = names.get(2 * length).filter(|name| name.pose == "from").map_or(0, |name| name.line);
                    SampleName { pose: format!("length {}", length + 1), line }
                }
            };
            let reason = match rejected.reason {
                RejectionReason::Outlier => format!("{:.0} times the scatter of the others", rejected.ratio),
                RejectionReason::SwappedWith(other) => format!("looks swapped with {}", name(other).text()),
            };
            RejectedSummary { pose, line, residual_mm: to_mm(rejected.residual), ratio: rejected.ratio, reason }
        })
        .collect()
}

/// The identified parameters in edge units.
fn parameter_summaries(found: &Identification, prior: Prior) -> Vec<ParameterSummary> {
    found
        .estimates
        .iter()
        .map(|estimate| {
            let quantity = estimate.id.quantity();
            ParameterSummary {
                name: estimate.id.to_string(),
                unit: quantity.unit().to_owned(),
                nominal: quantity.to_edge(estimate.nominal),
                deviation: quantity.to_edge(estimate.deviation),
                sigma: (estimate.identifiable || prior == Prior::Expected).then(|| quantity.to_edge(estimate.sigma)),
                expected: quantity.to_edge(estimate.expected),
                identifiable: estimate.identifiable,
            }
        })
        .collect()
}

fn correlations(found: &Identification) -> Vec<CorrelationSummary> {
    let mut strong = Vec::new();
    for (i, first) in found.estimates.iter().enumerate() {
        for (j, second) in found.estimates.iter().enumerate().skip(i + 1) {
            let correlation = found.correlation(i, j);
            if first.identifiable && second.identifiable && correlation.abs() > STRONG_CORRELATION {
                strong.push(CorrelationSummary {
                    parameters: [first.id.to_string(), second.id.to_string()],
                    correlation,
                });
            }
        }
    }
    strong
}

fn sigma_summary(found: &Identification) -> SigmaSummary {
    let source = match found.sigma.source {
        SigmaSource::Readings => SigmaOrigin::Readings,
        SigmaSource::Option => SigmaOrigin::Option,
        SigmaSource::Instrument => SigmaOrigin::Instrument,
        SigmaSource::Residuals => SigmaOrigin::Residuals,
        SigmaSource::Assumed => SigmaOrigin::Assumed,
    };
    SigmaSummary { used_mm: to_mm(found.sigma.used), source, from_residuals_mm: found.sigma.from_residuals.map(to_mm) }
}

fn settings_summary(args: &EstimationArgs, settings: &Settings, special: Special) -> IdentificationSettings {
    let Special { layout, socket_distance_mm, socket_distance_sigma_mm, verification } = special;
    let name = |text: &str| text.to_owned();
    IdentificationSettings {
        level: name(match args.level {
            LevelArg::Offsets => "offsets",
            LevelArg::Geometric => "geometric",
        }),
        weighting: name(match settings.weighting {
            Weighting::Covariance => "covariance",
            Weighting::Uniform => "uniform",
        }),
        prior: name(match settings.prior {
            Prior::Expected => "expected",
            Prior::None => "none",
        }),
        estimator: match settings.estimator {
            Estimator::Robust => EstimatorName::Robust,
            Estimator::LeastSquares => EstimatorName::LeastSquares,
        },
        iterations: settings.iterations,
        filter: args.filter.clone(),
        expected_length_mm: args.expected_deviation.map(|expected| to_mm(expected.length)),
        expected_angle_deg: args.expected_deviation.map(|expected| to_deg(expected.angle)),
        layout,
        socket_distance_mm,
        socket_distance_sigma_mm,
        verification,
    }
}

/// Settings that only one command has.
#[derive(Clone, Debug, Default)]
pub(super) struct Special {
    pub(super) layout: Option<String>,
    pub(super) socket_distance_mm: Option<f64>,
    pub(super) socket_distance_sigma_mm: Option<f64>,
    pub(super) verification: VerificationMode,
}

/// A finished identification, ready to be summed up.
pub(super) struct Finished<'a> {
    pub(super) args: &'a EstimationArgs,
    pub(super) loaded: &'a LoadedProfile,
    pub(super) inputs: Vec<InputFile>,
    pub(super) settings: &'a Settings,
    pub(super) special: Special,
    pub(super) found: &'a Identification,
    pub(super) names: &'a [SampleName],
    pub(super) warnings: Vec<Warning>,
    pub(super) verification: Option<crate::session::summary::VerificationSummary>,
}

impl Finished<'_> {
    /// The summary with its verdict.
    pub(super) fn summary(self) -> IdentificationSummary {
        let Self { args, loaded, inputs, settings, special, found, names, warnings, verification } = self;
        let Observability { rank, gap, condition_number, condition_number_raw, scored_points, groups, .. } =
            &found.observability;
        let verdict: Verdict = assess::verdict(loaded.profile.acceptance(), verification.as_ref(), &warnings);
        let termination = match found.termination {
            TerminationReason::Converged => Termination::Converged,
            TerminationReason::IterationLimit => Termination::IterationLimit,
            TerminationReason::NoImprovement => Termination::NoImprovement,
            TerminationReason::NonFinite => Termination::NonFinite,
        };
        IdentificationSummary {
            schema: SCHEMA,
            provenance: provenance(&loaded.profile, &loaded.text, inputs),
            settings: settings_summary(args, settings, special),
            warnings,
            verdict,
            verification,
            samples: names.len(),
            parameter_count: found.estimates.len(),
            rank: *rank,
            singular_value_gap: *gap,
            condition_number: *condition_number,
            condition_number_mm_rad: *condition_number_raw,
            condition_number_points: *scored_points,
            sigma: sigma_summary(found),
            parameters: parameter_summaries(found, settings.prior),
            blind_groups: groups
                .iter()
                .map(|group| BlindGroupSummary {
                    parameters: group.parameters.iter().map(ToString::to_string).collect(),
                    blind: group.blind,
                    description: group.description.clone(),
                })
                .collect(),
            correlations: correlations(found),
            rejected: rejected(found, names),
            termination,
            iterations: found
                .iterations
                .iter()
                .map(|iteration| IterationSummary { cost: iteration.cost, step: iteration.step })
                .collect(),
            written: Vec::new(),
        }
    }
}
