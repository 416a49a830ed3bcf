//! Checks of the data that `identify`, `verify` and `constraints` share: odd rows, joint limits, mistakes in a whole table, and
//! whether the verification samples are independent, numerous enough, and in the same range as the identification samples.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{ProcedureError, poses};
use crate::identification::plausibility::compare_with_nominal;
use crate::identification::verification::{CoverageGap, coverage_gaps};
use crate::identification::{Observations, Places, PointSample, Problem};
use crate::kinematics::{Joint, JointType, Place};
use crate::profile::Profile;
use crate::report::number;
use crate::session::TableProblem;
use crate::session::advice::Advice;
use crate::session::summary::{VerificationSummary, Warning, WarningCode};
use crate::text::{counted, listed};
use crate::units::{MICROMETRE, Quantity, to_mm};

/// Joint values (deg, sliding joints mm) up to which a pose that is visited again is the same: joints that a controller reports scatter.
const SAME_POSE: f64 = 0.1;
/// Errors (mm) that nobody can tell apart.
const SAME_ERROR: f64 = 0.001;
/// Acceptance needs at least this many verification poses.
const TOO_FEW_POSES: usize = 5;
/// Fewer verification poses than this say little about the largest error.
const FEW_POSES: usize = 10;
/// Fewer points than this cannot show a mistake in a whole table.
const ENOUGH_TO_COMPARE: usize = 4;
/// A verification sample is far off if its error is this many times the median of all.
const FAR: f64 = 10.0;
/// Most problems of one kind that a warning lists.
const SHOWN: usize = 3;

/// Warnings about what the reader of a table found odd; they name `file` if it is given.
pub(crate) fn table_warnings(file: Option<&str>, problems: &[TableProblem]) -> Vec<Warning> {
    let place = file.map_or_else(String::new, |file| format!("'{file}', "));
    let warning = |problem: &TableProblem| {
        let (code, blocks) =
            if problem.is_change() { (WarningCode::ChangedTable, true) } else { (WarningCode::Table, false) };
        Warning::new(code, format!("{place}{problem}"), blocks)
    };
    problems.iter().map(warning).collect()
}

/// The first `shown` of many findings, with the number of the others.
pub(super) fn first_of(findings: &[String], shown: usize) -> String {
    let list = findings.iter().take(shown).cloned().collect::<Vec<_>>().join("; ");
    let more = findings.len().saturating_sub(shown);
    if more > 0 { format!("{list}; and {more} more") } else { list }
}

/// A warning about rows (line and configuration) whose joints are outside the limits of the profile.
pub(crate) fn limit_warning<'a>(
    profile: &Profile,
    file: Option<&str>,
    rows: impl IntoIterator<Item = (usize, &'a [f64])>,
) -> Option<Warning> {
    let joints = profile.chain().joints();
    let mut outside = Vec::new();
    let mut by_a_turn = 0;
    for (line, configuration) in rows {
        for ((joint, range), value) in joints.iter().zip(profile.joints()).zip(configuration) {
            let quantity = joint.joint_type.quantity();
            if let Some((low, high)) = range.limits
                && !(low - 1e-9..=high + 1e-9).contains(value)
            {
                let turned = [*value - TAU, *value + TAU];
                let is_a_turn = joint.joint_type == JointType::Revolute;
                by_a_turn +=
                    usize::from(is_a_turn && turned.iter().any(|value| (low - 1e-9..=high + 1e-9).contains(value)));
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
    let list = first_of(&outside, SHOWN);
    let place = file.map_or_else(String::new, |file| format!(" in '{file}'"));
    let cause = if by_a_turn == outside.len() {
        "they count from 0 to 360 deg, and a full turn less is inside: the point is the same, but errors that follow a joint and programs need the pendant's values"
    } else {
        "degrees and radians mixed up, or another robot?"
    };
    let message = format!("joint values outside the limits of the profile{place} ({cause}): {list}");
    (!outside.is_empty()).then(|| Warning::new(WarningCode::JointLimits, message, false))
}

/// The result of a comparison with the nominal robot.
#[derive(Debug)]
pub(crate) struct Compared {
    /// Root mean square residual that the expected deviations explain (m).
    pub(crate) expected: f64,
    pub(crate) warning: Option<Warning>,
}

/// Refuses points that a known mistake explains better than this robot does. `problem` frees all parameters that may deviate, not
/// only those to identify; `what` is the beginning of the message.
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
    let name = |joint: usize| joints[joint].name.clone();
    let mistakes: Vec<String> = plausibility.mistakes.iter().map(|mistake| mistake.describe(name)).collect();
    match mistakes.as_slice() {
        [] => {}
        [mistake] => return Err(ProcedureError::Mistaken { gap, mistake: mistake.clone() }),
        several => {
            let numbered: Vec<String> =
                several.iter().enumerate().map(|(index, mistake)| format!("({}) {mistake}", index + 1)).collect();
            let mistake = format!(
                "these explain it equally well, the likeliest first: {}. Only one of them is true, and correcting another one would leave a wrong robot that fits: compare the joint values of one pose with the pendant before you correct anything",
                numbered.join("; ")
            );
            return Err(ProcedureError::Mistaken { gap, mistake });
        }
    }
    let hint = zero_columns(problem).map_or_else(String::new, |hint| format!("; {hint}"));
    let message = format!("{gap}, and no single mistake explains it (another robot, several mistakes at once?){hint}");
    Ok(Compared { expected, warning: Some(Warning::new(WarningCode::Implausible, message, true)) })
}

/// That the last joints are zero in all rows: with the first joints lost no fit can show that the columns are shifted.
fn zero_columns(problem: &Problem<'_>) -> Option<String> {
    let joints = problem.arm.chain.joints();
    let samples = &problem.observations.points;
    let is_zero = |joint: usize| samples.iter().all(|sample| sample.at.configuration.get(joint) == Some(&0.0));
    let zeros = (0..joints.len()).rev().take_while(|joint| is_zero(*joint)).count();
    let names: Vec<&str> = joints.iter().skip(joints.len() - zeros).map(|joint| joint.name.as_str()).collect();
    let first = joints.get(zeros).filter(|_| zeros > 0)?;
    let (columns, hold) = if zeros == 1 { ("column", "holds") } else { ("columns", "hold") };
    Some(format!(
        "the {columns} of {} {hold} only zeros: are the columns shifted, so that the first one holds {}?",
        listed(&names),
        first.name
    ))
}

/// Looks for the same mistakes in the verification points of a table. Very few points are left to other checks. The
/// observations of `problem` are not used.
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

/// A warning about verification samples that are far worse than the others, which a mean would hide. `named` has pose, line and
/// error of each.
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
            "verification samples far off (the others typically by {} mm): {}{more}; a bumped SMR, another unit, rows in another order? A verification leaves nothing out",
            number(to_mm(typical), 3),
            worst.join(", ")
        );
        Warning::new(WarningCode::FarVerificationSamples, message, false)
    })
}

/// The verification samples that the identification did not see.
#[derive(Debug)]
pub(crate) struct Unseen {
    /// Whether each place counts: all do where the identification saw every one.
    pub(crate) counts: Vec<bool>,
    pub(crate) warning: Option<Warning>,
}

impl Unseen {
    /// Of the places `tested`, where `known` were identified. The SMR that was measured there makes no difference: the error of a
    /// pose is in all of them.
    pub(crate) fn new<'a>(joints: &[Joint], known: &[Place], tested: impl IntoIterator<Item = &'a Place>) -> Self {
        let pose = |at: &Place| Place { configuration: within_a_turn(joints, &at.configuration), target: 0 };
        let known: Vec<Place> = known.iter().map(pose).collect();
        let places = Places::within(SAME_POSE, joints, &known);
        let counts: Vec<bool> = tested.into_iter().map(|at| !places.contains(&pose(at))).collect();
        let seen = counts.iter().filter(|counts| !**counts).count();
        let samples = counted(counts.len(), "verification sample");
        if seen == 0 {
            return Self { counts, warning: None };
        }
        if seen == counts.len() {
            let message = format!(
                "all {samples} are at poses that were also identified: the figures below say nothing about other poses and are no independent verification"
            );
            let warning =
                Warning::new(WarningCode::NotIndependent, message, true).with_advice(Advice::SeparateVerification);
            return Self { counts: vec![true; seen], warning: Some(warning) };
        }
        let message = format!(
            "{seen} of {samples} {} at poses that were also identified: {} left out, and the figures below are those of the other {}",
            if seen == 1 { "is" } else { "are" },
            if seen == 1 { "it is" } else { "they are" },
            counts.len() - seen
        );
        Self { counts, warning: Some(Warning::new(WarningCode::SeenBefore, message, false)) }
    }

    /// How many samples do not count.
    pub(crate) fn left_out(&self) -> usize {
        self.counts.iter().filter(|counts| !**counts).count()
    }
}

/// Joint values with those of turning joints between minus and plus half a turn: full turns make no other pose.
fn within_a_turn(joints: &[Joint], configuration: &[f64]) -> Vec<f64> {
    let values = configuration.iter().zip(joints);
    values
        .map(|(value, joint)| match joint.joint_type {
            JointType::Revolute => value - TAU * (value / TAU).round(),
            JointType::Prismatic => *value,
        })
        .collect()
}

/// Names of the targets that are only `tested`, and whose position is a guess of the profile.
pub(crate) fn unknown_targets<'a>(
    profile: &Profile,
    known: impl Iterator<Item = &'a Place>,
    tested: impl Iterator<Item = &'a Place>,
) -> Vec<String> {
    let known: BTreeSet<usize> = known.map(|at| at.target).collect();
    let tested: BTreeSet<usize> = tested.map(|at| at.target).collect();
    let targets = tested.difference(&known).filter_map(|target| profile.targets().get(*target));
    targets.filter(|target| target.is_free()).map(|target| format!("'{}'", target.name)).collect()
}

/// Warnings about the poses of a pair of identification and verification sets.
pub(crate) fn set_warnings(profile: &Profile, known: &[Place], tested: &[Place]) -> Vec<Warning> {
    let joints = profile.chain().joints();
    let known: Vec<&[f64]> = known.iter().map(|at| at.configuration.as_slice()).collect();
    let tested: Vec<&[f64]> = tested.iter().map(|at| at.configuration.as_slice()).collect();
    let gaps = coverage_gaps(joints, &known, &tested);
    let mut warnings: Vec<Warning> = gaps.iter().map(|gap| coverage_warning(joints, gap)).collect();
    warnings.extend(poses::warnings(profile, &known, &tested));
    warnings
}

/// A warning that blocks acceptance where the nominal arm is as good as the identified one.
pub(crate) fn better_warning(verification: &VerificationSummary) -> Option<Warning> {
    let VerificationSummary { nominal, identified, .. } = verification;
    let worse: Vec<String> = nominal
        .errors()
        .into_iter()
        .zip(identified.errors())
        .filter_map(|((name, before), (_, after))| Some((name, before?.rms, after?.rms)))
        .filter(|(_, before, after)| *after >= *before && *after > SAME_ERROR)
        .map(|(name, before, after)| {
            format!("{name} (rms) {} mm identified, {} mm nominal", number(after, 4), number(before, 4))
        })
        .collect();
    if worse.is_empty() {
        return None;
    }
    let message = format!(
        "the identified arm is no better than the nominal one at the verification poses: {}. Keep the nominal model, and look for what has changed between the two sets (payload, temperature, a moved SMR or tracker) or for poses that the identification does not cover",
        worse.join("; ")
    );
    Some(Warning::new(WarningCode::NotBetter, message, true))
}

/// Whether no warning says that the verification samples depend on the identification samples.
pub(crate) fn is_independent(warnings: &[Warning]) -> bool {
    warnings.iter().all(|warning| warning.code != WarningCode::NotIndependent)
}

/// A warning about too few verification poses: `samples` show `poses`. A pose that is measured again adds nothing new.
pub(crate) fn few_warning(samples: usize, poses: usize) -> Option<Warning> {
    (poses < FEW_POSES).then(|| {
        let mut what = counted(samples, "verification sample");
        if poses < samples {
            what = format!("{} in {what}", counted(poses, "pose"));
        }
        let message = format!("only {what}: they say little about the largest error");
        Warning::new(WarningCode::FewVerificationSamples, message, poses < TOO_FEW_POSES)
    })
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
            "verification covers only a part: {} {tested}, identified on {known}; the rest is not verified",
            joint.name
        )
    };
    Warning::new(WarningCode::Coverage, message, false)
}
