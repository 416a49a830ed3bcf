//! What every identifying command does the same way: settings from the command line, warnings, and the summary of a result.

use std::io::Write;

use nalgebra::Point3;

use super::load::{LoadedProfile, now, sha256};
use super::progress::Progress;
use super::{Console, assess};
use crate::cli::{EstimationArgs, EstimatorArg, ExpectedDeviation, LevelArg, PriorArg};
use crate::error::{ExitStatus, Failure};
use crate::identification::plausibility::weaknesses;
use crate::identification::{
    Estimator, Identification, IdentificationError, Observability, Prior, Problem, RejectionReason, SampleIndex,
    Settings, SigmaSource, TerminationReason, Weighting, identify,
};
use crate::kinematics::{FreeParameter, ParameterId};
use crate::profile::{Level, Profile};
use crate::session::summary::{
    BlindGroupSummary, CorrelationSummary, IdentificationSettings, IdentificationSummary, InputFile, IterationSummary,
    ParameterSummary, Provenance, RejectedSummary, SCHEMA, SigmaSummary, Verdict, Warning,
};
use crate::units::{MILLIMETRE, Quantity, from_mm, to_mm};

/// A parameter further from nominal than this many expected deviations is called out.
const RAN_AWAY: f64 = 5.0;
/// Residuals larger than stated by this factor are called out.
const SIGMA_EXCESS: f64 = 1.5;
/// Residuals beyond this (m) after identification mean that the data are not this robot's.
const NONSENSE_RESIDUAL: f64 = MILLIMETRE;
/// A larger share of rejected samples means that there is no consistent majority to trust.
const MANY_REJECTED: f64 = 0.2;
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

/// What the result itself gives reason to warn about.
pub(super) fn result_warnings(problem: &Problem<'_>, found: &Identification, settings: &Settings) -> Vec<Warning> {
    let joints = problem.chain.joints();
    let mut warnings: Vec<Warning> = weaknesses(problem, found)
        .iter()
        .map(|weakness| {
            let text = weakness.describe(|joint| joints[joint].name.clone(), |joint| joints[joint].joint_type);
            warning("poor_data", text, true)
        })
        .collect();
    let residual = found.sigma.from_residuals.unwrap_or(0.0);
    if residual > NONSENSE_RESIDUAL {
        let message = format!(
            "the identified robot misses the measured points by {:.3} mm per coordinate: the data do not describe this robot (wrong profile, wrong joint signs, several mistakes at once?)",
            to_mm(residual)
        );
        warnings.push(warning("does_not_fit", message, true));
    }
    warnings.extend(run_away(found, settings));
    if found.sigma.excess() > SIGMA_EXCESS {
        let message = format!(
            "the residuals ({:.4} mm per coordinate) are {:.1} times the stated sigma ({:.4} mm): something besides geometry and instrument moves the points (flexure, backlash, temperature, a moved SMR). The standard deviations below are widened by that factor",
            to_mm(residual),
            found.sigma.excess(),
            to_mm(found.sigma.used)
        );
        warnings.push(warning("sigma_excess", message, false));
    }
    let judged = problem.observations.places().count();
    let share = found.rejected.len() as f64 / judged.max(1) as f64;
    if share > MANY_REJECTED {
        let message = format!(
            "{} of {judged} samples were rejected: there is no consistent majority to trust; look for rows in a wrong order or a moved instrument",
            found.rejected.len()
        );
        warnings.push(warning("many_rejected", message, true));
    }
    match found.termination {
        TerminationReason::Converged => {}
        TerminationReason::IterationLimit => {
            let message = format!("stopped after {} solver steps without having converged", found.iterations.len());
            warnings.push(warning("not_converged", message, true));
        }
        TerminationReason::NoImprovement | TerminationReason::NonFinite => {
            warnings.push(warning(
                "not_converged",
                "the solver could not improve the fit any further".to_owned(),
                true,
            ));
        }
    }
    warnings
}

/// Parameters that are further from nominal than any robot of this make should be.
fn run_away(found: &Identification, settings: &Settings) -> Option<Warning> {
    let listed: Vec<String> = found
        .estimates
        .iter()
        .filter(|estimate| estimate.deviation.abs() > RAN_AWAY * estimate.expected)
        .map(|estimate| {
            let quantity = estimate.id.quantity();
            format!(
                "{} by {:+.3} {} ({:.0} times the expected deviation)",
                estimate.id,
                quantity.to_edge(estimate.deviation),
                quantity.unit(),
                estimate.deviation.abs() / estimate.expected
            )
        })
        .collect();
    if listed.is_empty() {
        return None;
    }
    let list = listed.join(", ");
    Some(match settings.prior {
        Prior::None => warning(
            "ran_away",
            format!(
                "parameters ran away: {list}. Without a prior, badly determined combinations take any value that lowers the residual; the robot may be worse than nominal in another part of its workspace, and a hold-out from the same series does not show it. Use '--prior expected'"
            ),
            true,
        ),
        Prior::Expected => warning(
            "large_deviation",
            format!(
                "far from nominal: {list}. Check the profile (is it this robot?), or state larger expected deviations"
            ),
            false,
        ),
    })
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
fn parameter_summaries(found: &Identification) -> Vec<ParameterSummary> {
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
                sigma: quantity.to_edge(estimate.sigma),
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
        SigmaSource::Readings => "readings",
        SigmaSource::Option => "option",
        SigmaSource::Instrument => "instrument",
        SigmaSource::Residuals => "residuals",
        SigmaSource::Assumed => "assumed",
    };
    SigmaSummary {
        used_mm: to_mm(found.sigma.used),
        source: source.to_owned(),
        from_residuals_mm: found.sigma.from_residuals.map(to_mm),
    }
}

fn settings_summary(args: &EstimationArgs, settings: &Settings) -> IdentificationSettings {
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
        estimator: name(match settings.estimator {
            Estimator::Robust => "robust",
            Estimator::LeastSquares => "least-squares",
        }),
        iterations: settings.iterations,
        filter: args.filter.clone(),
    }
}

/// A finished identification, ready to be summed up.
pub(super) struct Finished<'a> {
    pub(super) args: &'a EstimationArgs,
    pub(super) loaded: &'a LoadedProfile,
    pub(super) inputs: Vec<InputFile>,
    pub(super) settings: &'a Settings,
    pub(super) found: &'a Identification,
    pub(super) names: &'a [SampleName],
    pub(super) warnings: Vec<Warning>,
    pub(super) verification: Option<crate::session::summary::VerificationSummary>,
}

impl Finished<'_> {
    /// The summary with its verdict.
    pub(super) fn summary(self) -> IdentificationSummary {
        let Self { args, loaded, inputs, settings, found, names, warnings, verification } = self;
        let Observability { rank, gap, condition_number, condition_number_raw, scored_points, groups, .. } =
            &found.observability;
        let verdict: Verdict = assess::verdict(loaded.profile.acceptance(), verification.as_ref(), &warnings);
        let termination = match found.termination {
            TerminationReason::Converged => "converged",
            TerminationReason::IterationLimit => "iteration_limit",
            TerminationReason::NoImprovement => "no_improvement",
            TerminationReason::NonFinite => "non_finite",
        };
        IdentificationSummary {
            schema: SCHEMA,
            provenance: provenance(&loaded.profile, &loaded.text, inputs),
            settings: settings_summary(args, settings),
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
            parameters: parameter_summaries(found),
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
            termination: termination.to_owned(),
            iterations: found
                .iterations
                .iter()
                .map(|iteration| IterationSummary { cost: iteration.cost, step: iteration.step })
                .collect(),
            written: Vec::new(),
        }
    }
}
