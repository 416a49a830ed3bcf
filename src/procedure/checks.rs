//! What `identify`, `verify` and `constraints` check about their data in the same way: odd rows, joint limits, mistakes in a
//! whole table, and whether the verification samples are independent, enough, and where the identification samples are.

use nalgebra::Vector3;

use super::ProcedureError;
use crate::identification::plausibility::compare_with_nominal;
use crate::identification::verification::{CoverageGap, coverage_gaps};
use crate::identification::{Observations, Places, PointSample, Problem};
use crate::kinematics::{Joint, Place};
use crate::profile::Profile;
use crate::report::number;
use crate::session::TableProblem;
use crate::session::advice::Advice;
use crate::session::summary::Warning;
use crate::units::{MICROMETRE, Quantity, to_mm};

/// Verification samples that were also identification samples.
pub(crate) const NOT_INDEPENDENT: &str = "not_independent";
/// Fewer verification poses than this rule acceptance out.
const TOO_FEW_POSES: usize = 5;
/// Fewer verification poses than this say little about the largest error.
const FEW_POSES: usize = 10;
/// Fewer points than this cannot show a mistake in a whole table.
const ENOUGH_TO_COMPARE: usize = 4;
/// A verification sample is far off if its error is so many times the median of all.
const FAR: f64 = 10.0;
/// Problems of one kind that a warning lists.
const SHOWN: usize = 3;

/// What the reader of a table found odd; `file` names it where there are several.
pub(crate) fn table_warnings(file: Option<&str>, problems: &[TableProblem]) -> Vec<Warning> {
    let place = file.map_or_else(String::new, |file| format!("'{file}', "));
    problems.iter().map(|problem| Warning::new("table", format!("{place}{problem}"), false)).collect()
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
    (!outside.is_empty()).then(|| Warning::new("joint_limits", message, false))
}

/// What a comparison with the nominal robot says.
#[derive(Debug)]
pub(crate) struct Compared {
    /// Root mean square residual that the expected deviations explain (m).
    pub(crate) expected: f64,
    pub(crate) warning: Option<Warning>,
}

/// Refuses points that a known mistake explains better than this robot does. `problem` frees all that the robot may deviate in,
/// whatever is to be identified; `what` comes before the message.
pub(crate) fn check_plausibility(problem: &Problem<'_>, what: &str) -> Result<Compared, ProcedureError> {
    let plausibility = compare_with_nominal(problem)?;
    let expected = plausibility.expected;
    if plausibility.is_plausible() {
        return Ok(Compared { expected, warning: None });
    }
    let joints = problem.arm.chain.joints();
    let gap = format!(
        "{what}the measured points are typically {} mm off the nominal robot, {} mm can be expected",
        number(to_mm(plausibility.nominal), 1),
        number(to_mm(expected), 1)
    );
    if let Some(mistake) = &plausibility.mistake {
        let mistake = mistake.describe(|joint| joints[joint].name.clone());
        return Err(ProcedureError::Mistaken { gap, mistake });
    }
    let message =
        format!("{gap}, and no single mistake explains it (rows in another order, another robot, two joints wrong?)");
    Ok(Compared { expected, warning: Some(Warning::new("implausible", message, true)) })
}

/// Looks for the same mistakes in the verification points of a table. Too few to tell are left to other checks. The other
/// observations of `problem` do not matter.
pub(crate) fn check_verification(
    problem: &Problem<'_>,
    tested: &[PointSample],
) -> Result<Option<Warning>, ProcedureError> {
    if tested.len() < ENOUGH_TO_COMPARE {
        return Ok(None);
    }
    let observations = Observations { points: tested.to_vec(), ..Observations::default() };
    let problem = Problem { observations: &observations, ..*problem };
    check_plausibility(&problem, "verification: ").map(|compared| compared.warning)
}

/// Verification samples that are far worse than the others: what they have in common hides in a mean. `named` are the samples,
/// as pose and line, with their errors.
pub(crate) fn far_warning<'a>(named: impl IntoIterator<Item = (&'a str, usize, &'a Vector3<f64>)>) -> Option<Warning> {
    let mut samples: Vec<(&str, usize, f64)> =
        named.into_iter().map(|(pose, line, error)| (pose, line, error.norm())).collect();
    samples.sort_by(|(.., one), (.., other)| other.total_cmp(one));
    let typical = samples.get(samples.len() / 2)?.2;
    let far = samples.partition_point(|(.., error)| *error > FAR * typical.max(MICROMETRE));
    let worst: Vec<String> = samples
        .iter()
        .take(far.min(SHOWN))
        .map(|(pose, line, error)| format!("pose {pose} (line {line}) by {} mm", number(to_mm(*error), 3)))
        .collect();
    let more = if far > SHOWN { format!(" and {} more", far - SHOWN) } else { String::new() };
    (far > 0).then(|| {
        let message = format!(
            "verification samples far off where others are off by {} mm: {}{more}; a bumped SMR, another unit, a row in another place? Nothing is left out of a verification",
            number(to_mm(typical), 3),
            worst.join(", ")
        );
        Warning::new("far_verification_samples", message, false)
    })
}

/// What is doubtful about a pair of identification and verification sets.
pub(crate) fn set_warnings(joints: &[Joint], known: &[Place], tested: &[Place]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let places = Places::new(joints, known);
    let shared = tested.iter().filter(|at| places.contains(at)).count();
    if shared > 0 {
        let verb = if shared == 1 { "is" } else { "are" };
        let message = format!(
            "{shared} of {} {verb} of a pose that is also in the identification set: the figures below say nothing about other poses and are no independent verification",
            counted(tested.len())
        );
        warnings.push(Warning::new(NOT_INDEPENDENT, message, true).with_advice(Advice::SeparateVerification));
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

/// Too few verification poses: `samples` show `poses`. One that is measured again tells nothing new.
pub(crate) fn few_warning(samples: usize, poses: usize) -> Option<Warning> {
    (poses < FEW_POSES).then(|| {
        let mut what = counted(samples);
        if poses < samples {
            let noun = if poses == 1 { "pose" } else { "poses" };
            what = format!("{poses} {noun} in {what}");
        }
        let message = format!("only {what}: the largest error is hardly known");
        Warning::new("few_verification_samples", message, poses < TOO_FEW_POSES)
    })
}

fn counted(samples: usize) -> String {
    let noun = if samples == 1 { "sample" } else { "samples" };
    format!("{samples} verification {noun}")
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
    Warning::new("coverage", message, false)
}
