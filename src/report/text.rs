//! The reports of `identify`, `constraints` and `verify` on a terminal.

use super::document::Found;
use super::tables::{paragraph, push_line};
use crate::identification::{Estimator, Shape, SigmaSource, TerminationReason};
use crate::session::joint_errors::{CurveMarks, curve_drawn, curve_scale, shares_sentence, workspace_sentence};
use crate::session::summary::{
    FeatureSummary, IdentificationSummary, JointErrorSummary, JointSummary, ORIENTATION_SENTENCE, ParameterSummary,
    Provenance, SelectionSummary, StatisticsSummary, Verdict, VerificationReport, VerificationSummary, Warning,
};
use crate::text::{counted, decimals_for, fixed, printable};

/// Share of the expected deviation above which a standard deviation says that the data hardly determined a parameter.
const WEAK: f64 = 0.5;

/// Report of an identification.
pub fn identification_text(summary: &IdentificationSummary) -> String {
    let mut text = title("Identification", &summary.provenance);
    text.push_str(&warnings(&summary.warnings));
    text.push_str(&verdict(&summary.verdict, &summary.provenance));
    if let Some(verification) = &summary.verification {
        text.push_str(&verification_tables(verification));
    }
    if let Some(workspace) = &summary.workspace {
        text.push_str(&paragraph("  ", &workspace_sentence(workspace)));
        text.push('\n');
    }
    if let Some(earlier) = &summary.earlier {
        text.push_str(&paragraph("", &format!("{}.", earlier.sentence())));
        text.push('\n');
    }
    text.push_str(&fit_lines(summary));
    if let Some(selection) = &summary.selection {
        text.push_str(&selection_lines(selection));
    }
    text.push_str(&joint_error_lines(&summary.joint_errors));
    text.push_str(&parameter_table(summary.constants()));
    text.push_str(&feature_lines(&summary.features));
    text.push_str(&blind_lines(summary));
    text.push_str(&rejected_lines(summary));
    if let Some(verification) = &summary.verification {
        text.push_str(&joint_lines(&verification.residual_by_joint));
    }
    for file in &summary.written {
        push_line(&mut text, &format!("written: {file}"));
    }
    text
}

/// Report of a verification.
pub fn verification_text(report: &VerificationReport) -> String {
    let mut text = title("Verification", &report.provenance);
    text.push_str(&warnings(&report.warnings));
    text.push_str(&verdict(&report.verdict, &report.provenance));
    text.push_str(&verification_tables(&report.verification));
    text.push_str(&joint_lines(&report.verification.residual_by_joint));
    text
}

pub(super) fn title(what: &str, provenance: &Provenance) -> String {
    let mut text = paragraph("", &format!("{what} of {} ({})", provenance.robot, provenance.profile));
    for input in &provenance.inputs {
        push_line(&mut text, &format!("  {}: {}", input.role, input.file));
    }
    push_line(&mut text, &format!("  {}, {}", provenance.program, provenance.created));
    text.push('\n');
    text
}

pub(super) fn warnings(warnings: &[Warning]) -> String {
    let mut text = String::new();
    for warning in warnings {
        let mark = if warning.blocks_acceptance { "WARNING " } else { "note    " };
        text.push_str(&paragraph(mark, &format!("{} [{}]", warning.message, warning.code)));
    }
    if !warnings.is_empty() {
        text.push('\n');
    }
    text
}

fn verdict(verdict: &Verdict, provenance: &Provenance) -> String {
    let mut text = paragraph("", &format!("Verdict: {}: {}", verdict.word(), verdict.reasons.join("; ")));
    text.push_str(&paragraph("", &printable(&provenance.belongs_to())));
    for check in &verdict.checks {
        let (sign, result) = match check.met {
            Some(true) => ("<=", "met"),
            Some(false) => ("> ", "NOT MET"),
            None => ("  ", "NOT EVALUATED"),
        };
        let value = check.value_text();
        push_line(
            &mut text,
            &format!(
                "  {:<16}{:>9} mm  {sign} {:>7} mm  {result}",
                check.quantity.words(),
                value,
                fixed(check.limit_mm, 3)
            ),
        );
    }
    text.push('\n');
    text
}

/// Nominal and identified side by side: tables III and IV of the method paper, with root mean square and 95 %.
fn verification_tables(verification: &VerificationSummary) -> String {
    let VerificationSummary { samples, basis, independent, nominal, identified, .. } = verification;
    let which =
        if *independent { "that the identification did not see" } else { "that the identification saw in part or all" };
    let mut text = paragraph("", &format!("Accuracy on {} {which}: {basis}", counted(*samples, "sample")));
    push_line(&mut text, &format!("  {:<34}{:>12}{:>14}{:>18}", "mm", "nominal", "identified", "95 % interval"));
    for ((name, nominal), (_, identified)) in nominal.errors().into_iter().zip(identified.errors()) {
        if let (Some(nominal), Some(identified)) = (nominal, identified) {
            text.push_str(&statistics_rows(name, &nominal, &identified));
        }
    }
    let orientations = nominal.orientation_mrad.zip(identified.orientation_mrad);
    if let Some((nominal, identified)) = &orientations {
        text.push_str(&statistics_rows("orientation (mrad)", nominal, identified));
    }
    if let (Some(nominal), Some(identified)) = (&nominal.axis_mm, &identified.axis_mm) {
        for (axis, name) in ["X", "Y", "Z"].iter().enumerate() {
            row(
                &mut text,
                &format!("along {name}, mean of absolute values"),
                nominal.mean[axis],
                identified.mean[axis],
            );
            row(&mut text, &format!("along {name}, largest"), nominal.max[axis], identified.max[axis]);
        }
    }
    if orientations.is_some() {
        text.push_str(&paragraph("  ", &format!("{ORIENTATION_SENTENCE}.")));
    }
    if let Some(sentence) = verification.sample_sentence() {
        text.push_str(&paragraph("  ", &format!("{sentence}.")));
    }
    text.push('\n');
    text
}

fn statistics_rows(name: &str, nominal: &StatisticsSummary, identified: &StatisticsSummary) -> String {
    let mut text = String::new();
    let names =
        [format!("{name}, mean of {}", identified.count), "  rms".to_owned(), "  95 %".to_owned(), "  max".to_owned()];
    for ((name, before), after) in names.iter().zip(nominal.figures()).zip(identified.figures()) {
        let interval = after.interval_text().map_or_else(String::new, |interval| format!("{interval:>18}"));
        push_line(&mut text, &format!("  {name:<34}{:>12}{:>14}{interval}", before.text(), after.text()));
    }
    text
}

fn row(text: &mut String, name: &str, nominal: f64, identified: f64) {
    push_line(text, &format!("  {name:<34}{:>12}{:>14}", fixed(nominal, 4), fixed(identified, 4)));
}

/// The gap in the singular values. Beyond a million the rest is rounding noise, and its size means nothing.
pub(super) fn gap(ratio: f64) -> String {
    if ratio > 1e6 { "gap over 1e6".to_owned() } else { format!("gap {ratio:.0e}") }
}

fn fit_lines(summary: &IdentificationSummary) -> String {
    let sigma = &summary.sigma;
    let source = sigma_origin(sigma.source);
    let mut text = paragraph(
        "",
        &format!(
            "Identified from {} samples, {} ({}), {} weighting, prior {}, {} estimator",
            summary.samples,
            parameters_counted(summary),
            summary.settings.level,
            summary.settings.weighting,
            summary.settings.prior,
            match summary.settings.estimator {
                Estimator::Robust => "robust",
                Estimator::LeastSquares => "least-squares",
            }
        ),
    );
    let residual = match sigma.from_residuals_mm {
        Some(residual) if sigma.source != SigmaSource::Residuals => {
            format!("; the residuals give {} mm", fixed(residual, 4))
        }
        _ => String::new(),
    };
    push_line(&mut text, &format!("  sigma {} mm, {source}{residual}", fixed(sigma.stated_mm(), 4)));
    let rank = summary.rank.map_or_else(
        || "rank not clear".to_owned(),
        |rank| format!("rank {rank} of {} ({})", summary.constants().count(), gap(summary.singular_value_gap)),
    );
    push_line(&mut text, &format!("  {rank}"));
    if let (Some(scaled), Some(raw)) = (summary.condition_number, summary.condition_number_mm_rad) {
        let line =
            format!("  condition number {} in expected deviations, {} in mm and rad", fixed(scaled, 1), fixed(raw, 0));
        push_line(&mut text, &line);
    }
    push_line(
        &mut text,
        &format!("  {} after {} solver steps", termination(summary.termination), summary.iterations.len()),
    );
    text.push('\n');
    text
}

/// The source of the measurement σ in words.
pub(super) const fn sigma_origin(origin: SigmaSource) -> &'static str {
    match origin {
        SigmaSource::Readings => "given with the readings",
        SigmaSource::Option => "given on the command line",
        SigmaSource::Instrument => "of the profile's instrument",
        SigmaSource::Residuals => "estimated from the residuals",
        SigmaSource::Assumed => "assumed, because there are too few data to estimate it",
    }
}

/// The reason why the solver stopped, in words.
pub(super) const fn termination(reason: TerminationReason) -> &'static str {
    match reason {
        TerminationReason::Converged => "converged",
        TerminationReason::IterationLimit => "iteration limit",
        TerminationReason::NoImprovement => "no improvement",
        TerminationReason::NonFinite => "numbers that are not finite",
    }
}

/// `29 parameters`, and the errors of joints beside them.
pub(super) fn parameters_counted(summary: &IdentificationSummary) -> String {
    let constants = summary.constants().count();
    match summary.parameter_count.saturating_sub(constants) {
        0 => counted(constants, "parameter"),
        errors => format!("{} and {} of joint errors", counted(constants, "parameter"), counted(errors, "term")),
    }
}

/// What explains the error of the nominal arm, and the models that were tried.
fn selection_lines(selection: &SelectionSummary) -> String {
    let mut text = paragraph("", &format!("Causes: {}", shares_sentence(selection)));
    if selection.candidates.len() > 1 {
        push_line(&mut text, "Models that were tried, with their error (rms) at poses left out in turn:");
        for candidate in &selection.candidates {
            let mark = if candidate.terms == selection.kept { "kept" } else { "" };
            push_line(
                &mut text,
                &format!("{mark:>6}{:>7} mm  {}", fixed(candidate.left_out_rms_mm, 3), candidate.terms),
            );
        }
    }
    text.push_str(&paragraph("  why: ", &selection.reason));
    text.push('\n');
    text
}

/// Columns of a drawn curve.
const CURVE: usize = 54;

/// The error of each joint: its size, and its curve over the joint's range.
fn joint_error_lines(joints: &[JointErrorSummary]) -> String {
    let mut text = String::new();
    if joints.is_empty() {
        return text;
    }
    push_line(&mut text, "Angle errors of the joints, and how far each gives way under gravity at most:");
    push_line(
        &mut text,
        &format!("  {:<7}{:<22}{:>10}{:>10}  {}", "joint", "measured", "curve rms", "sigma", "gives way"),
    );
    let urad = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{} urad", fixed(value, 0)));
    for joint in joints {
        let (from, to) = joint.measured_deg;
        push_line(
            &mut text,
            &format!(
                "  {:<7}{:<22}{:>10}{:>10}  {}",
                joint.joint,
                format!("{from:>5.0} ..{to:>5.0} deg"),
                urad(Some(joint.curve_rms_urad)),
                urad(joint.sigma_urad()),
                joint.gravity_words().unwrap_or_else(|| "-".to_owned())
            ),
        );
    }
    let scale = curve_scale(joints);
    for joint in joints {
        if let (Some((first, ..)), Some((last, ..))) = (joint.curve.first(), joint.curve.last()) {
            let drawn = curve_drawn(joint, CURVE, scale, CurveMarks::Blocks);
            push_line(&mut text, &format!("  {:<7}{first:>5.0} {drawn} {last:.0} deg", joint.joint));
        }
    }
    text.push_str(&paragraph("  ", &CurveMarks::Blocks.legend(scale)));
    text.push('\n');
    text
}

/// The table of geometry and targets; the errors of joints have a part of their own.
fn parameter_table<'a>(parameters: impl Iterator<Item = &'a ParameterSummary>) -> String {
    let mut text = String::new();
    push_line(
        &mut text,
        &format!(
            "{:<11}{:>4}{:>12}{:>12}{:>12}{:>10}  {}",
            "parameter", "unit", "nominal", "deviation", "identified", "sigma", "found"
        ),
    );
    for parameter in parameters {
        let decimals = parameter.sigma.map_or(4, decimals_for);
        let found = found(parameter).words();
        push_line(
            &mut text,
            &format!(
                "{:<11}{:>4}{:>12}{:>12}{:>12}{:>10}  {found}",
                parameter.id,
                parameter.unit,
                fixed(parameter.nominal, 4),
                fixed(parameter.deviation, decimals),
                fixed(parameter.nominal + parameter.deviation, decimals),
                parameter.sigma.map_or_else(|| "-".to_owned(), |sigma| fixed(sigma, decimals))
            ),
        );
    }
    text.push('\n');
    text
}

/// Where the features of unknown place were found.
fn feature_lines(features: &[FeatureSummary]) -> String {
    let mut text = String::new();
    if features.is_empty() {
        return text;
    }
    push_line(&mut text, "Found along with the arm, in its base (mm):");
    push_line(
        &mut text,
        &format!("  {:<14}{:<9}{:>9}{:>10}{:>10}{:>10}{:>8}", "feature", "shape", "contacts", "x", "y", "z", "sigma"),
    );
    for feature in features {
        let [x, y, z] = feature.at_mm.map(|value| fixed(value, 2));
        let sigma = feature.sigma_mm.map_or_else(|| "-".to_owned(), |sigma| fixed(sigma, 3));
        let shape = if feature.shape == Shape::KnownCircle { Shape::Circle } else { feature.shape };
        let mut line =
            format!("  {:<14}{shape:<9}{:>9}{x:>10}{y:>10}{z:>10}{sigma:>8}", feature.name, feature.contacts);
        if let Some(axis) = feature.axis {
            let [x, y, z] = axis.map(|value| fixed(value, 4));
            line = format!("{line}  axis {x} {y} {z}");
        }
        if let Some(size) = feature.size_mm {
            let what = if feature.shape == Shape::Wire { "reads less by" } else { "radius" };
            line = format!("{line}  {what} {}", fixed(size, 3));
        }
        push_line(&mut text, line.trim_end());
    }
    text.push('\n');
    text
}

/// How well a parameter was found.
pub(super) fn found(parameter: &ParameterSummary) -> Found {
    if !parameter.identifiable {
        Found::OnlyCombined
    } else if parameter.sigma.is_none_or(|sigma| sigma > WEAK * parameter.expected) {
        Found::Weakly
    } else {
        Found::Yes
    }
}

fn blind_lines(summary: &IdentificationSummary) -> String {
    let mut text = String::new();
    if !summary.blind_groups.is_empty() {
        push_line(&mut text, "What these data cannot tell:");
        for group in &summary.blind_groups {
            text.push_str(&paragraph("  - ", &group.description));
        }
        text.push('\n');
    }
    if !summary.correlations.is_empty() {
        push_line(&mut text, "Strongly correlated:");
        for pair in &summary.correlations {
            let [first, second] = &pair.parameters;
            push_line(&mut text, &format!("  - {first} and {second}: {:+.2}", pair.correlation));
        }
        text.push('\n');
    }
    text
}

fn rejected_lines(summary: &IdentificationSummary) -> String {
    if summary.settings.estimator != Estimator::Robust {
        return String::new();
    }
    if summary.rejected.is_empty() {
        return "Rejected samples: none\n\n".to_owned();
    }
    let mut text = format!("Rejected samples, {} of {}:\n", summary.rejected.len(), summary.samples);
    for rejected in &summary.rejected {
        let line = format!(
            "pose {} (line {}): {} mm off, {}",
            rejected.pose,
            rejected.line,
            fixed(rejected.residual_mm, 3),
            rejected.reason
        );
        text.push_str(&paragraph("  - ", &line));
    }
    text.push('\n');
    text
}

/// Mean error over each joint's range, which shows patterns, and the joints that the errors follow.
fn joint_lines(joints: &[JointSummary]) -> String {
    let mut text = String::new();
    if joints.iter().all(|joint| joint.bins.is_empty()) {
        return text;
    }
    push_line(&mut text, "Mean error of the identified model over fifths of each joint's range (mm), and");
    push_line(&mut text, "how much of the square error follows the joint:");
    for joint in joints {
        let Some(range) = joint.range() else { continue };
        let bins = joint.means(8);
        let share = joint.share().unwrap_or_else(|| "-".to_owned());
        push_line(&mut text, &format!("  {:<6}{range:<18}{bins}{share:>7}", joint.joint));
    }
    text.push('\n');
    text
}
