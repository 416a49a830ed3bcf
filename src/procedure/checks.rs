//! What `identify`, `verify` and `constraints` check about their data in the same way: odd rows, joint limits, mistakes in a
//! whole table, and whether the verification samples are independent, enough, and where the identification samples are.

use super::{identification_failure, warning};
use crate::error::{ExitStatus, Failure};
use crate::identification::plausibility::compare_with_nominal;
use crate::identification::verification::{CoverageGap, coverage_gaps};
use crate::identification::{Problem, TargetAt};
use crate::kinematics::Joint;
use crate::profile::Profile;
use crate::report::number;
use crate::session::TableProblem;
use crate::session::summary::Warning;
use crate::units::{Quantity, to_mm};

/// Verification samples that were also identification samples.
pub(crate) const NOT_INDEPENDENT: &str = "not_independent";
/// Fewer verification samples than this rule acceptance out.
const TOO_FEW_SAMPLES: usize = 5;
/// Fewer verification samples than this say little about the largest error.
const FEW_SAMPLES: usize = 10;
/// Joint values closer than this (deg, sliding joints mm) are the same configuration, written down once more.
const SAME_JOINT_VALUE: f64 = 0.01;
/// Problems of one kind that a warning lists.
const SHOWN: usize = 3;

/// What the reader of a table found odd; `file` names it where there are several.
pub(crate) fn table_warnings(file: Option<&str>, problems: &[TableProblem]) -> Vec<Warning> {
    let place = file.map_or_else(String::new, |file| format!("'{file}', "));
    problems.iter().map(|problem| warning("table", format!("{place}{problem}"), false)).collect()
}

/// Rows, as line and configuration, whose joints are outside the limits of the profile.
pub(crate) fn limit_warning<'a>(
    profile: &Profile,
    file: Option<&str>,
    rows: impl IntoIterator<Item = (usize, &'a [f64])>,
) -> Option<Warning> {
    let joints = profile.chain().joints();
    let mut outside = Vec::new();
    for (line, configuration) in rows {
        for ((joint, range), value) in joints.iter().zip(profile.joints()).zip(configuration) {
            let quantity = joint.joint_type.quantity();
            if let Some((low, high)) = range.limits
                && !(low - 1e-9..=high + 1e-9).contains(value)
            {
                outside.push(format!(
                    "line {line}: {} at {} {unit}, allowed {}…{} {unit}",
                    joint.name,
                    number(quantity.to_edge(*value), 2),
                    number(quantity.to_edge(low), 2),
                    number(quantity.to_edge(high), 2),
                    unit = quantity.unit()
                ));
            }
        }
    }
    let more = outside.len().saturating_sub(SHOWN);
    let list = outside.iter().take(SHOWN).cloned().collect::<Vec<_>>().join("; ");
    let tail = if more > 0 { format!("; and {more} more") } else { String::new() };
    let place = file.map_or_else(String::new, |file| format!(" in '{file}'"));
    let message = format!(
        "joint values outside the limits of the profile{place} (degrees and radians mixed up, or another robot?): {list}{tail}"
    );
    (!outside.is_empty()).then(|| warning("joint_limits", message, false))
}

/// What a comparison with the nominal robot says.
#[derive(Debug)]
pub(crate) struct Compared {
    /// Root mean square residual that the expected deviations explain (m).
    pub(crate) expected: f64,
    pub(crate) warning: Option<Warning>,
}

/// Refuses points that a known mistake explains better than this robot does. `problem` frees all that the robot may deviate in,
/// whatever is to be identified.
pub(crate) fn check_plausibility(problem: &Problem<'_>) -> Result<Compared, Failure> {
    let plausibility = compare_with_nominal(problem).map_err(|error| identification_failure(&error))?;
    let expected = plausibility.expected;
    if plausibility.is_plausible() {
        return Ok(Compared { expected, warning: None });
    }
    let joints = problem.chain.joints();
    let gap = format!(
        "the measured points are typically {} mm off the nominal robot, {} mm can be expected",
        number(to_mm(plausibility.nominal), 1),
        number(to_mm(expected), 1)
    );
    if let Some(mistake) = &plausibility.mistake {
        let text = mistake.describe(|joint| joints[joint].name.clone());
        return Err(Failure::new(ExitStatus::Usage, format!("{gap}: {text}")));
    }
    let message =
        format!("{gap}, and no single mistake explains it (rows in another order, another robot, two joints wrong?)");
    Ok(Compared { expected, warning: Some(warning("implausible", message, true)) })
}

/// What is doubtful about a pair of identification and verification sets.
pub(crate) fn set_warnings(joints: &[Joint], known: &[TargetAt], tested: &[TargetAt]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let shared = shared_samples(joints, known, tested);
    if shared > 0 {
        let verb = if shared == 1 { "is" } else { "are" };
        let message = format!(
            "{shared} of {} {verb} of a pose that is also in the identification set: the figures below say nothing about other poses and are no independent verification; '--use' picks rows, such as \"kind == 'verification'\"",
            counted(tested.len())
        );
        warnings.push(warning(NOT_INDEPENDENT, message, true));
    }
    let known: Vec<&[f64]> = known.iter().map(|at| at.configuration.as_slice()).collect();
    let tested: Vec<&[f64]> = tested.iter().map(|at| at.configuration.as_slice()).collect();
    warnings.extend(coverage_gaps(joints, &known, &tested).iter().map(|gap| coverage_warning(joints, gap)));
    warnings
}

/// Whether `warnings` say that the verification samples are not independent.
pub(crate) fn is_independent(warnings: &[Warning]) -> bool {
    warnings.iter().all(|warning| warning.code != NOT_INDEPENDENT)
}

/// Too few verification samples.
pub(crate) fn few_warning(samples: usize) -> Option<Warning> {
    (samples < FEW_SAMPLES).then(|| {
        let message = format!("only {}: the largest error is hardly known", counted(samples));
        warning("few_verification_samples", message, samples < TOO_FEW_SAMPLES)
    })
}

fn counted(samples: usize) -> String {
    let noun = if samples == 1 { "sample" } else { "samples" };
    format!("{samples} verification {noun}")
}

/// How many of `tested` repeat a configuration and target of `known`. Sorted by one number per configuration, so that only few
/// candidates are compared joint by joint.
fn shared_samples(joints: &[Joint], known: &[TargetAt], tested: &[TargetAt]) -> usize {
    let tolerances: Vec<f64> =
        joints.iter().map(|joint| joint.joint_type.quantity().from_edge(SAME_JOINT_VALUE)).collect();
    // Joint values in tolerances, with weights between 1 and 2 that no regular grid of configurations has.
    let weights: Vec<f64> = (0..joints.len()).map(|index| 1.0 + (0.618_034 * index as f64).fract()).collect();
    let key = |at: &TargetAt| -> f64 {
        at.configuration
            .iter()
            .zip(&tolerances)
            .zip(&weights)
            .map(|((value, size), weight)| value / size * weight)
            .sum()
    };
    let reach: f64 = weights.iter().sum();
    let mut sorted: Vec<(f64, &TargetAt)> = known.iter().map(|at| (key(at), at)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let same = |a: &TargetAt, b: &TargetAt| {
        a.target == b.target
            && a.configuration
                .iter()
                .zip(&b.configuration)
                .zip(&tolerances)
                .all(|((a, b), size)| (a - b).abs() <= *size)
    };
    let is_known = |at: &&TargetAt| {
        let key = key(at);
        let first = sorted.partition_point(|(other, _)| *other < key - reach);
        sorted[first..].iter().take_while(|(other, _)| *other <= key + reach).any(|(_, other)| same(other, at))
    };
    tested.iter().filter(is_known).count()
}

fn coverage_warning(joints: &[Joint], gap: &CoverageGap) -> Warning {
    let joint = &joints[gap.joint];
    let quantity: Quantity = joint.joint_type.quantity();
    let range = |(low, high): (f64, f64)| {
        format!("{}…{} {}", number(quantity.to_edge(low), 0), number(quantity.to_edge(high), 0), quantity.unit())
    };
    let (known, tested) = (range(gap.identification), range(gap.verification));
    let message = if gap.extrapolates {
        format!("verification reaches outside the identification set: {} {tested}, identified on {known}", joint.name)
    } else {
        format!(
            "verification covers a part only: {} {tested}, identified on {known}; the rest is not verified",
            joint.name
        )
    };
    warning("coverage", message, false)
}
