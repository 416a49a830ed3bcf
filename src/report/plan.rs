//! The report of `plan` on a terminal.

use super::tables::{paragraph, push_line};
use super::text::{title, warnings};
use crate::session::plan_summary::PlanSummary;
use crate::text::fixed;

/// The report of a plan: its quality compared with random sets, its time, and what stays weak.
pub fn plan_text(summary: &PlanSummary) -> String {
    let mut text = title("Pose plan", &summary.provenance);
    text.push_str(&warnings(&summary.warnings));
    if summary.interrupted {
        text.push_str(&paragraph("note    ", "the search was cut short; this is the best set found so far"));
        text.push('\n');
    }
    text.push_str(&figures(summary));
    text.push_str(&comparison(summary));
    text.push_str(&trade_off(summary));
    text.push_str(&joint_gaps(summary));
    text.push_str(&weak(summary));
    text.push_str(&candidates(summary));
    for file in &summary.written {
        push_line(&mut text, &format!("written: {file}"));
    }
    text
}

fn figures(summary: &PlanSummary) -> String {
    let objective = summary.objective.map_or_else(String::new, |objective| format!(", objective {objective}"));
    let mut text = paragraph(
        "",
        &format!(
            "{} poses to identify {} parameters (rank {}), {} to verify{objective}",
            summary.identification_poses, summary.parameter_count, summary.score.rank, summary.verification_poses
        ),
    );
    if let Some(rms) = summary.predicted_rms_mm {
        let sigma = summary.sigma_mm.unwrap_or_default();
        let line = format!(
            "  predicted position error of the identified robot, all over its joint ranges: {} mm rms (sigma {} mm, from the instrument alone)",
            fixed(rms, 4),
            fixed(sigma, 4)
        );
        text.push_str(&paragraph("  ", line.trim_start()));
    }
    if let Some(rms) = summary.predicted_level3_rms_mm {
        let line = format!(
            "where errors of the joints are identified too (level 3): {} mm rms, the arm's repeatability included",
            fixed(rms, 4)
        );
        text.push_str(&paragraph("  ", &line));
    }
    if let Some(rms) = summary.predicted_verification_rms_mm {
        let line =
            format!("the verification poses will then show about {} mm rms, tracker noise included", fixed(rms, 4));
        text.push_str(&paragraph("  ", &line));
    }
    if let Some(time) = &summary.time {
        push_line(
            &mut text,
            &format!(
                "  about {:.0} min: {:.0} min moving, {:.0} min measuring",
                time.total_min, time.moving_min, time.measuring_min
            ),
        );
    }
    push_line(&mut text, &format!("  planned in {:.1} s", summary.elapsed_s));
    text.push('\n');
    text
}

fn comparison(summary: &PlanSummary) -> String {
    let mut text = String::new();
    let random = &summary.random;
    push_line(&mut text, &format!("  {:<34}{:>12}{:>16}{:>14}", "", "this set", "random median", "random best"));
    let error = (summary.score.predicted_error, random.errors);
    let condition = (summary.score.condition_number, random.conditions);
    for (name, (own, random), decimals) in
        [("predicted error (sigma)", error, 3), ("condition number (expected dev.)", condition, 1)]
    {
        let [own, median, best] = [own, random.median, random.best].map(|value| fixed(value, decimals));
        push_line(&mut text, &format!("  {name:<34}{own:>12}{median:>16}{best:>14}"));
    }
    push_line(
        &mut text,
        &format!("  {:<34}{:>12}", "condition number (mm, rad)", fixed(summary.score.condition_number_raw, 0)),
    );
    let o = &summary.score.observability;
    push_line(
        &mut text,
        &format!("  observability O1 {:.3e}  O2 {:.3e}  O3 {:.3e}  O4 {:.3e}  O5 {:.3e}", o.o1, o.o2, o.o3, o.o4, o.o5),
    );
    push_line(
        &mut text,
        &format!("  D-efficiency {} % of the upper bound for these candidates", fixed(100.0 * summary.d_efficiency, 1)),
    );
    text.push('\n');
    text
}

fn trade_off(summary: &PlanSummary) -> String {
    let mut text = String::new();
    if summary.trade_off.is_empty() {
        return text;
    }
    push_line(&mut text, "What more or fewer poses would give (quick searches):");
    push_line(
        &mut text,
        &format!(
            "  {:>6}{:>16}{:>18}{:>20}{:>12}",
            "poses", "error (sigma)", "error rms (mm)", "level 3 rms (mm)", "time (min)"
        ),
    );
    for row in &summary.trade_off {
        let optional =
            |value: Option<f64>, decimals| value.map_or_else(|| "-".to_owned(), |value| fixed(value, decimals));
        push_line(
            &mut text,
            &format!(
                "  {:>6}{:>16}{:>18}{:>20}{:>12}",
                row.poses,
                fixed(row.predicted_error_sigma, 3),
                optional(row.predicted_rms_mm, 4),
                optional(row.predicted_level3_rms_mm, 4),
                optional(row.time_min, 0)
            ),
        );
    }
    text.push('\n');
    text
}

fn joint_gaps(summary: &PlanSummary) -> String {
    let mut text = String::new();
    if summary.joint_gaps.is_empty() {
        return text;
    }
    push_line(&mut text, "Largest gap between neighbouring values of each joint, the ends of its range included:");
    push_line(&mut text, &format!("  {:<12}{:>10}{:>12}{:>12}{:>16}", "joint", "gap", "from", "to", "evenly spread"));
    for gap in &summary.joint_gaps {
        let [size, from, to, even] = [gap.largest_gap, gap.from, gap.to, gap.even_gap].map(|value| fixed(value, 1));
        push_line(&mut text, &format!("  {:<12}{size:>10}{from:>12}{to:>12}{even:>16} {}", gap.joint, gap.unit));
    }
    text.push('\n');
    text
}

fn weak(summary: &PlanSummary) -> String {
    let mut text = String::new();
    if !summary.weak_parameters.is_empty() {
        push_line(&mut text, "Weakly determined (predicted sigma, expected deviation):");
        for weak in &summary.weak_parameters {
            push_line(
                &mut text,
                &format!("  {:<12}{:>10.4} {:>10.4} {}", weak.name, weak.predicted_sigma, weak.expected, weak.unit),
            );
        }
        text.push('\n');
    }
    if !summary.blind_groups.is_empty() {
        push_line(&mut text, "What no set of poses can tell:");
        for group in &summary.blind_groups {
            text.push_str(&paragraph("  - ", group));
        }
        text.push('\n');
    }
    text
}

fn candidates(summary: &PlanSummary) -> String {
    let candidates = &summary.candidates;
    let mut text =
        format!("Candidates: {} of {} configurations tried can be measured\n", candidates.kept, candidates.tried);
    if !candidates.rejections.is_empty() {
        push_line(&mut text, &format!("  {:<24}{:>12}{:>14}", "rule", "rejected", "by it alone"));
        for rejection in &candidates.rejections {
            push_line(&mut text, &format!("  {:<24}{:>12}{:>14}", rejection.rule, rejection.rejected, rejection.alone));
        }
    }
    text.push('\n');
    text
}
