//! A comparison of calibrations as text.

use super::tables::{paragraph, push_line};
use super::text::warnings;
use crate::kinematics::ParameterId;
use crate::session::comparison::{CauseSummary, ComparisonSummary, PairSummary};
use crate::text::{alternatives, decimals_for, fixed};

/// The comparison.
pub fn comparison_text(summary: &ComparisonSummary) -> String {
    let mut text = paragraph("", &format!("Comparison of calibrations of {} ({})", summary.robot, summary.profile));
    push_line(&mut text, &format!("  {}, {}", summary.program, summary.created));
    text.push('\n');
    text.push_str(&warnings(&summary.warnings));
    push_line(&mut text, &format!("  {:<4}{:<22}{:>6}{:>10}{:>10}  {}", "", "made", "poses", "sigma", "open", "file"));
    for (index, part) in summary.calibrations.iter().enumerate() {
        let line = format!(
            "  {:<4}{:<22}{:>6}{:>7} mm{:>7} mm  {}",
            letter(index),
            part.created,
            part.poses,
            fixed(part.sigma_mm, 3),
            fixed(part.open_mm, 3),
            part.file
        );
        push_line(&mut text, &line);
    }
    text.push_str(&paragraph("  ", "open: position error (rms over the workspace) that the poses leave open"));
    for pair in &summary.pairs {
        text.push('\n');
        text.push_str(&pair_text(pair));
    }
    text
}

/// The letter of a calibration: `A`, `B`, …
pub(super) fn letter(index: usize) -> String {
    u8::try_from(index)
        .ok()
        .filter(|index| *index < 26)
        .map_or_else(|| format!("#{}", index + 1), |index| char::from(b'A' + index).to_string())
}

fn pair_text(pair: &PairSummary) -> String {
    let (from, to) = (letter(pair.from), letter(pair.to));
    let verdict = if pair.has_changed { "CHANGED" } else { "NO CHANGE that these data can show" };
    let mut text = paragraph("", &format!("{from} to {to}: {verdict}"));
    text.push_str(&paragraph(
        "  ",
        &format!(
            "positions differ by {} mm rms over the workspace ({} mm at 95 %, {} mm at most); two calibrations of an unchanged arm would by {} mm. Programs taught on one arm are off by this much on the other",
            fixed(pair.rms_mm, 3),
            fixed(pair.p95_mm, 3),
            fixed(pair.max_mm, 3),
            fixed(pair.sigma_mm, 3)
        ),
    ));
    if !pair.causes.is_empty() {
        push_line(&mut text, "  what explains it:");
        for cause in &pair.causes {
            text.push_str(&paragraph("  - ", &cause_text(cause)));
        }
        if !pair.is_explained {
            text.push_str(&paragraph("  - ", "and something that no single parameter explains"));
        }
    }
    if !pair.parameters.is_empty() {
        push_line(&mut text, "  parameters beyond three standard deviations (blind combinations share a change):");
        for parameter in &pair.parameters {
            let decimals = decimals_for(parameter.sigma);
            push_line(
                &mut text,
                &format!(
                    "  {:<18}{:>12} {:<5}sigma {:>9}{:>8} sigma",
                    parameter.parameter.to_string(),
                    signed(parameter.difference, decimals),
                    parameter.unit.to_string(),
                    fixed(parameter.sigma, decimals),
                    fixed(parameter.ratio.abs(), 1)
                ),
            );
        }
    }
    if !pair.curves.is_empty() {
        push_line(&mut text, "  joint curves, over each other:");
        for curve in &pair.curves {
            let (rms, ratio) = (fixed(curve.rms_urad, 0), fixed(curve.ratio, 1));
            push_line(&mut text, &format!("  {:<8}{rms:>6} urad rms apart, {ratio} sigma", curve.joint));
        }
    }
    text
}

fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if text.starts_with('-') { text } else { format!("+{text}") }
}

/// A change with its size.
pub(super) fn cause_text(cause: &CauseSummary) -> String {
    let decimals = decimals_for(cause.sigma);
    let change = format!("{} {} ± {}", signed(cause.change, decimals), cause.unit, fixed(cause.sigma, decimals));
    let names: Vec<String> = cause.parameters.iter().map(ParameterId::to_string).collect();
    match names.as_slice() {
        [only] => format!("{only} ({}) by {change}", cause.meaning),
        several => format!(
            "{}, which explain it equally well; {} ({}) by {change}",
            alternatives(several),
            several.first().map_or("", String::as_str),
            cause.meaning
        ),
    }
}
