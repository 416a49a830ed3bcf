//! A health check as text.

use super::tables::{paragraph, push_line};
use super::text::{title, warnings};
use crate::session::health::{ForecastSummary, HealthSummary, HealthVerdict};
use crate::text::{alternatives, counted, decimals_for, fixed};

/// The verdict with its numbers.
fn verdict(summary: &HealthSummary) -> String {
    let limit = summary.limit_mm.map_or_else(String::new, |limit| format!(", limit {}", fixed(limit, 2)));
    let error = fixed(summary.error_mm, 2);
    match &summary.verdict {
        HealthVerdict::StillValid => format!("STILL VALID ({error} mm{limit})"),
        HealthVerdict::ZeroMoved { joint, by, sigma, unit } => {
            let decimals = decimals_for(*sigma);
            format!(
                "CHANGED: the zero of joint {joint} has moved by {} {unit} ± {} {unit} (position error {error} mm{limit})",
                fixed(*by, decimals),
                fixed(*sigma, decimals)
            )
        }
        HealthVerdict::Changed { candidates } if candidates.is_empty() => {
            format!(
                "CHANGED: something that no single zero explains, calibrate again (position error {error} mm{limit})"
            )
        }
        HealthVerdict::Changed { candidates } => format!(
            "CHANGED: the zero of {}, which these poses cannot tell apart; calibrate again (position error {error} mm{limit})",
            alternatives(candidates)
        ),
        HealthVerdict::MeasureAgain { pose } => {
            format!("NOT DECIDED: pose {pose} contradicts all others; measure it again")
        }
        HealthVerdict::Undecided { reason } => format!("NOT DECIDED: {reason} ({error} mm{limit})"),
    }
}

/// The result of a health check.
pub fn health_text(summary: &HealthSummary) -> String {
    let mut text = title("Health check", &summary.provenance);
    text.push_str(&warnings(&summary.warnings));
    text.push_str(&paragraph("", &format!("Verdict: {}", verdict(summary))));
    let after = summary
        .decided_after
        .map_or_else(String::new, |after| format!("; the verdict was the same from pose {after} on"));
    text.push_str(&paragraph(
        "  ",
        &format!("{} after the calibration of {}{after}", counted(summary.poses, "pose"), summary.calibrated),
    ));
    if let Some(hidden) = summary.hidden_mm {
        let sentence = format!(
            "zeros may have moved as far as these poses can tell: {} mm rms over the workspace",
            fixed(hidden, 3)
        );
        text.push_str(&paragraph("  ", &sentence));
    }
    if summary.limit_mm.is_none() {
        text.push_str(&paragraph("  ", "no limit is known: only changes are judged ('acceptance' of the profile)"));
    }
    text.push('\n');
    push_line(&mut text, "Zeros of the joints, each as if it alone had moved:");
    push_line(&mut text, &format!("  {:<8}{:>10}{:>10}{:>5}{:>8}", "joint", "moved", "sigma", "", "ratio"));
    for zero in &summary.zeros {
        let line = if zero.is_visible {
            let decimals = decimals_for(zero.sigma);
            format!(
                "  {:<8}{:>10}{:>10} {:<4}{:>8}",
                zero.joint,
                fixed(zero.moved, decimals),
                fixed(zero.sigma, decimals),
                zero.unit,
                fixed(zero.ratio, 1)
            )
        } else {
            format!("  {:<8}{:>10}{:>10}     cannot be seen by these poses", zero.joint, "-", "-")
        };
        push_line(&mut text, &line);
    }
    text.push('\n');
    text
}

/// What a planned check will be able to see.
pub fn forecast_text(poses: usize, minutes: Option<f64>, zeros: &[ForecastSummary], written: &str) -> String {
    let time = minutes.map_or_else(String::new, |minutes| format!(", about {minutes:.0} min"));
    let mut text = format!("Health check: {}{time}\n\n", counted(poses, "pose"));
    push_line(&mut text, "Zeros of the joints: what the check will find");
    push_line(&mut text, &format!("  {:<8}{:>10}  {}", "joint", "sigma", "found in nine of ten checks"));
    for zero in zeros {
        let line = match (zero.sigma, zero.found) {
            (Some(sigma), Some(found)) => {
                let decimals = decimals_for(sigma);
                let unit = &zero.unit;
                format!("  {:<8}{:>10}  from {} {unit}", zero.joint, fixed(sigma, decimals), fixed(found, decimals))
            }
            _ => format!("  {:<8}{:>10}  cannot be seen", zero.joint, "-"),
        };
        push_line(&mut text, &line);
    }
    text.push('\n');
    push_line(&mut text, &format!("written: {written}"));
    text
}
