//! The summary of an identification: its numbers in mm and degree, with names and the verdict.

use super::identify::IdentifyRequest;
use super::{assess, provenance};
use crate::identification::{Estimate, Identification, Observability, Prior, RejectionReason, SampleIndex, Sigma};
use crate::profile::Profile;
use crate::report::number;
use crate::session::advice::Advice;
use crate::session::summary::{
    BlindGroupSummary, CorrelationSummary, IdentificationSettings, IdentificationSummary, IterationSummary,
    ParameterSummary, RejectedSummary, SCHEMA, SigmaSummary, Verdict, VerificationSummary, Warning,
};
use crate::units::to_mm;

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Smallest correlation that is listed.
const STRONG_CORRELATION: f64 = 0.9;

/// Name of a sample: its pose and where it was recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleName {
    pub pose: String,
    /// Line of the file, or number of the measurement.
    pub line: usize,
}

impl SampleName {
    /// The name in a message.
    pub(crate) fn text(&self) -> String {
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
                SampleIndex::Length(length) if !found.features.is_empty() => name(length),
                SampleIndex::Length(length) => {
                    let line = names.get(2 * length).filter(|name| name.pose == "from").map_or(0, |name| name.line);
                    SampleName { pose: format!("length {}", length + 1), line }
                }
            };
            let reason = match rejected.reason {
                RejectionReason::Outlier => format!("{:.0} times the scatter of the others", rejected.ratio),
                RejectionReason::Sign { axis } => {
                    format!("the sign of {} is wrong: the point fits with the other one", AXES[axis.min(2)])
                }
                RejectionReason::Digit { axis, by } => format!(
                    "one digit of {} is wrong: the point fits with {} mm less",
                    AXES[axis.min(2)],
                    number(to_mm(by), 3)
                ),
                RejectionReason::SwappedWith(other) => format!("looks swapped with {}", name(other).text()),
            };
            RejectedSummary { pose, line, residual_mm: to_mm(rejected.residual), ratio: rejected.ratio, reason }
        })
        .collect()
}

/// The identified parameters in edge units.
pub(super) fn parameter_summaries(found: &Identification, prior: Prior) -> Vec<ParameterSummary> {
    found
        .estimates
        .iter()
        .map(|estimate| {
            let unit = estimate.id.unit();
            ParameterSummary {
                id: estimate.id,
                unit,
                nominal: unit.to_edge(estimate.nominal),
                deviation: unit.to_edge(estimate.deviation),
                sigma: (estimate.identifiable || prior == Prior::Expected).then(|| unit.to_edge(estimate.sigma)),
                expected: unit.to_edge(estimate.expected),
                identifiable: estimate.identifiable,
            }
        })
        .collect()
}

/// Deviations of all parameters after a step of the solver, in the units of the parameters and rounded to 1 nm and 1 ndeg.
fn deviations(found: &Identification, step: usize) -> Vec<f64> {
    let Some(path) = found.path.get(step) else { return Vec::new() };
    let edge = |(estimate, value): (&Estimate, &f64)| (estimate.id.unit().to_edge(*value) * 1e9).round() / 1e9 + 0.0;
    found.estimates.iter().zip(path.iter()).map(edge).collect()
}

fn correlations(found: &Identification) -> Vec<CorrelationSummary> {
    let mut strong = Vec::new();
    // The errors of joints come last, and their terms are no findings of their own.
    let constants = found.estimates.iter().take_while(|estimate| !estimate.id.is_joint_error()).count();
    for (i, first) in found.estimates.iter().take(constants).enumerate() {
        for (j, second) in found.estimates.iter().take(constants).enumerate().skip(i + 1) {
            let correlation = found.correlation(i, j);
            if first.identifiable && second.identifiable && correlation.abs() > STRONG_CORRELATION {
                strong.push(CorrelationSummary { parameters: [first.id, second.id], correlation });
            }
        }
    }
    strong
}

fn sigma_summary(found: &Identification) -> SigmaSummary {
    let Sigma { used, source, from_residuals, normalised: _, instrument, shots, poses, confirmed: _ } = found.sigma;
    SigmaSummary {
        used_mm: to_mm(used),
        source,
        from_residuals_mm: from_residuals.map(to_mm),
        instrument_mm: instrument.map(to_mm),
        shots_mm: (shots > 0.0).then(|| to_mm(shots)),
        poses_mm: Some(to_mm(poses)),
    }
}

/// The record of the settings.
fn settings_summary(request: &IdentifyRequest) -> IdentificationSettings {
    IdentificationSettings {
        layout: request.layout,
        socket_distance_mm: request.socket_distance_mm.map(|(distance, _)| distance),
        socket_distance_sigma_mm: request.socket_distance_mm.map(|(_, sigma)| sigma),
        verification: request.verification_mode,
        ..request.settings.record()
    }
}

/// A finished identification, ready to be summed up.
pub(crate) struct Finished<'a> {
    /// The nominal robot with the target as it was mounted.
    pub(crate) profile: &'a Profile,
    pub(crate) request: &'a IdentifyRequest,
    pub(crate) found: &'a Identification,
    pub(crate) names: &'a [SampleName],
    pub(crate) warnings: Vec<Warning>,
    pub(crate) verification: Option<VerificationSummary>,
}

impl Finished<'_> {
    /// The summary with its verdict.
    pub(crate) fn summary(self) -> IdentificationSummary {
        let Self { profile, request, found, names, warnings, verification } = self;
        let settings = settings_summary(request);
        let Observability { rank, gap, condition_number, condition_number_raw, scored_points, groups, .. } =
            &found.observability;
        let has_points = !request.identification.samples.is_empty();
        let advice = if has_points { Advice::VerifyPoints } else { Advice::VerifyDistances };
        let sigma = sigma_summary(found);
        let verdict: Verdict =
            assess::verdict(profile.acceptance(), verification.as_ref().ok_or(advice), &warnings, &sigma);
        IdentificationSummary {
            schema: SCHEMA,
            provenance: provenance(profile, &request.profile_text, request.created.clone(), request.inputs.clone()),
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
            sigma,
            parameters: parameter_summaries(found, settings.prior),
            settings,
            blind_groups: groups
                .iter()
                .map(|group| BlindGroupSummary {
                    parameters: group.parameters.clone(),
                    blind: group.blind,
                    description: group.description.clone(),
                })
                .collect(),
            correlations: correlations(found),
            rejected: rejected(found, names),
            termination: found.termination,
            iterations: found
                .iterations
                .iter()
                .enumerate()
                .map(|(index, iteration)| IterationSummary {
                    cost: iteration.cost,
                    step: iteration.step,
                    deviations: deviations(found, index),
                })
                .collect(),
            written: Vec::new(),
            selection: None,
            joint_errors: Vec::new(),
            workspace: None,
            features: Vec::new(),
            earlier: None,
        }
    }
}
