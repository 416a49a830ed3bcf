//! Texts of the recording: headline, chapters, guide and report. They are in plain Latin letters, because some viewers cannot draw
//! others.

use jiff::Timestamp;
use rerun::{AnyValues, TextDocument};

use super::result::Judged;
use super::sample::text;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::{latin::plain, names};
use crate::session::joint_errors::{shares_sentence, workspace_sentence};
use crate::session::journal::IdentifiedText;
use crate::session::plan::PoseKind;
use crate::session::plan_summary::PlanSummary;
use crate::session::state::Session;
use crate::session::summary::{ModelSummary, StatisticsSummary};
use crate::text::{counted, fixed};
use crate::units::to_mm;

/// The guide to the picture.
const GUIDE: &str = "\
# How to read this recording

Press play at the bottom, or drag the time cursor: **story** tells the calibration from the search for poses to the verdict,
**time** is the clock. Everything is on both.

| in the picture | what it is |
|---|---|
| orange | nominal arm, as the maker describes it, and its errors in charts |
| blue | identified arm, true to scale, and its errors in charts |
| arrows and points | errors of the position, measured less predicted. Before and after are drawn equally magnified and with the same colours, from blue for none to red for the largest; the scale is between the views |
| white, green points | measured for identification, for verification |
| yellow points | next pose, or a questioned sample |
| brown points | skipped poses, excluded samples |
| violet | tracker and beam: as planned, from the fourth point on as measured |
| three axes | origin of the measured coordinates, where it is no instrument |

The tab **Residual** shows the errors of the identified arm much larger, so that their pattern is seen. Wireframes are one
standard deviation of the predicted position, equally magnified.

While the arrows shrink, the picture runs evenly from the nominal to the identified arm.

Errors at poses of the identification are residuals, not accuracy. Accuracy is what the verification poses show.

Numbers for tables are in the entities **data/sample**, **data/error** and **data/limit**.
";

/// Draws the texts that a session starts with.
pub(super) fn opening(canvas: &mut Canvas, program: &str, name: &str, opened: Timestamp) {
    let about = AnyValues::default()
        .with_component_from_data("program", text(program))
        .with_component_from_data("session", text(name))
        .with_component_from_data("opened", text(&opened.to_string()));
    canvas.draw_static(names::SESSION_PROPERTIES, &about);
    canvas.draw_static(names::GUIDE, &TextDocument::from_markdown(GUIDE));
    headline(canvas, &format!("# {name}\n"));
}

/// Draws the line above the picture.
pub(super) fn headline(canvas: &mut Canvas, markdown: &str) {
    canvas.draw_static(names::HEADLINE, &TextDocument::from_markdown(plain(markdown)));
}

/// Draws the chapter of the story that begins at `moment`.
pub(super) fn caption(canvas: &mut Canvas, moment: Moment, chapter: &str, what: &str) {
    let page = format!("### {chapter}\n{what}\n");
    canvas.draw(moment, names::CAPTION, &TextDocument::from_markdown(plain(&page)));
}

/// Returns the title of the robot without what is in parentheses.
fn robot(session: &Session) -> String {
    let title = session.robot.as_ref().map_or("", |robot| robot.profile.title());
    title.split('(').next().unwrap_or(title).trim_end().to_owned()
}

/// Returns a warning if nothing about a session is real.
fn simulated(session: &Session) -> &'static str {
    if session.is_simulated() { "**SIMULATED.** " } else { "" }
}

/// Returns the headline of a session without a result.
pub(super) fn waiting(session: &Session) -> String {
    let planned = session.rows.iter().filter(|row| row.planned.kind.is_measured() && !row.skipped).count();
    let measured = session.counted().count();
    let state = match (planned, measured) {
        (0, 0) => "no poses yet".to_owned(),
        (_, 0) => format!("plan of {}", counted(planned, "pose")),
        _ => format!("{measured} of {planned} poses measured"),
    };
    format!("# {}: {state}\n{}{}\n", robot(session), simulated(session), plan_in_words(session))
}

/// Returns what the plan consists of and what it promises.
pub(super) fn plan_in_words(session: &Session) -> String {
    let Some(plan) = &session.plan else { return String::new() };
    let of = |kind: PoseKind| session.rows.iter().filter(|row| row.planned.kind == kind).count();
    let mut parts = vec![
        format!("{} to identify from", counted(of(PoseKind::Identification), "pose")),
        format!("{} to verify with", of(PoseKind::Verification)),
    ];
    let sigma = session.robot.as_ref().and_then(|robot| robot.profile.instrument()).map(|instrument| instrument.sigma);
    if let (Some(per_sigma), Some(sigma)) = (plan.predicted_error_sigma, sigma) {
        parts.push(format!("predicted error {} mm", significant(to_mm(per_sigma * sigma))));
    }
    if let Some(minutes) = plan.minutes {
        parts.push(format!("{} min", fixed(minutes, 0)));
    }
    parts.join(", ")
}

/// Returns a number with two significant digits.
pub(in crate::recording) fn significant(value: f64) -> String {
    if value.abs() < 1e-6 {
        return "0".to_owned();
    }
    let power = value.abs().log10().floor();
    let decimals = (0..=6).find(|decimals| f64::from(*decimals) >= 1.0 - power).unwrap_or(6);
    fixed(value, usize::try_from(decimals).unwrap_or(0))
}

/// Returns the mean errors of both arms at some of the poses.
pub(super) fn errors_in_words(judged: &[Judged<'_>], of_verification: bool) -> String {
    let counts: Vec<_> =
        judged.iter().filter(|one| one.is_verification == of_verification && !one.text.rejected).collect();
    let mean =
        |of: fn(&Judged<'_>) -> f64| to_mm(counts.iter().map(|one| of(one)).sum::<f64>() / counts.len().max(1) as f64);
    let nominal = significant(mean(|one| one.nominal.norm()));
    let poses = counted(counts.len(), "pose");
    if of_verification {
        let identified = significant(mean(|one| one.identified.norm()));
        format!("{poses} that the identification never saw: mean error {nominal} mm before, {identified} mm after")
    } else {
        format!("the nominal arm misses {poses} by {nominal} mm on average")
    }
}

/// Draws the report on a plan: which rules rejected how many candidates.
pub(super) fn plan_report(canvas: &mut Canvas, plan: &PlanSummary) {
    let found = &plan.candidates;
    let mut page =
        format!("# What was rejected\n\nOf {} configurations {} can be measured.\n\n", found.tried, found.kept);
    page.push_str("| rule | rejected | that no other rule rejected |\n|---|---|---|\n");
    let rejections =
        found.rejections.iter().map(|one| format!("| {} | {} | {} |\n", one.rule, one.rejected, one.alone));
    let warnings = plan.warnings.iter().map(|warning| format!("\n* **{}**", warning.message));
    page.extend(rejections.chain(warnings));
    canvas.draw_static(names::REPORT, &TextDocument::from_markdown(plain(&page)));
}

/// Returns the verdict and its first reason.
pub(super) fn verdict_in_words(identified: &IdentifiedText) -> String {
    let verdict = &identified.summary.verdict;
    let reason = verdict.reasons.first().map_or_else(String::new, |reason| format!(": {reason}"));
    format!("**{}**{reason}", verdict.word())
}

/// Returns the result in one line, and below it what the figures are about.
fn result_headline(session: &Session, identified: &IdentifiedText) -> String {
    let summary = &identified.summary;
    let verdict = summary.verdict.word();
    let figures = summary.verification.as_ref().and_then(|verification| {
        let mean =
            |model: &ModelSummary| model.errors().into_iter().find_map(|(name, found)| Some((name, found?.mean)));
        Some((mean(&verification.nominal)?, mean(&verification.identified)?.1, verification))
    });
    let Some(((name, before), after, verification)) = figures else {
        return format!("# {}: {verdict}\nNothing was verified: there is no figure of accuracy.\n", robot(session));
    };
    let limits = summary.verdict.checks.iter().map(|check| {
        let met = if check.met == Some(true) { "" } else { ", not met" };
        format!("{} {} mm (limit {}{met})", check.quantity.words(), check.value_text(), fixed(check.limit_mm, 2))
    });
    let limits = limits.collect::<Vec<_>>().join(", ");
    format!(
        "# {}: {} mm → {} mm, {verdict}\n{}Mean {name} at {} that the identification never saw. {limits}\n",
        robot(session),
        significant(before),
        significant(after),
        simulated(session),
        counted(verification.samples, "sample"),
    )
}

/// Draws headline, properties and report of a result.
pub(super) fn result(canvas: &mut Canvas, session: &Session, identified: &IdentifiedText, time: Timestamp) {
    let summary = &identified.summary;
    let about = AnyValues::default()
        .with_component_from_data("robot", text(&summary.provenance.robot))
        .with_component_from_data("profile", text(&summary.provenance.profile))
        .with_component_from_data("profile_sha256", text(&summary.provenance.profile_sha256))
        .with_component_from_data("verdict", text(&summary.verdict.word().to_lowercase()))
        .with_component_from_data("identified", text(&time.to_string()));
    canvas.draw_static(names::RESULT_PROPERTIES, &about);
    headline(canvas, &result_headline(session, identified));
    canvas.draw_static(names::REPORT, &TextDocument::from_markdown(plain(&markdown(session, identified, time))));
}

fn markdown(session: &Session, identified: &IdentifiedText, time: Timestamp) -> String {
    let summary = &identified.summary;
    let mut page = String::new();
    let mut line = |text: String| {
        page.push_str(&text);
        page.push('\n');
    };
    line(format!("# {}: {}\n", robot(session), summary.verdict.word()));
    line(format!("{}, {time}\n", summary.provenance.robot));
    for reason in &summary.verdict.reasons {
        line(format!("* {reason}"));
    }
    for warning in &summary.warnings {
        line(format!("* **{}**", warning.message));
    }
    if let Some(verification) = &summary.verification {
        line(format!("\n## Accuracy on {} poses that the identification never saw\n", verification.samples));
        line("| mm | mean | RMS | 95 % | max |".to_owned());
        line("|---|---|---|---|---|".to_owned());
        let arms = [("nominal", &verification.nominal), ("identified", &verification.identified)];
        for (arm, errors) in arms {
            rows(arm, errors, &mut line);
        }
    } else {
        line("\nNothing was verified: there is no figure of accuracy.".to_owned());
    }
    if let Some(workspace) = &summary.workspace {
        line(format!("\n{}", workspace_sentence(workspace)));
    }
    if let Some(selection) = &summary.selection {
        line(format!("\n## What the error consists of\n\n{}\n", shares_sentence(selection)));
    }
    if !summary.joint_errors.is_empty() {
        line("| joint | measured (deg) | curve rms (urad) | gives way under gravity |".to_owned());
        line("|---|---|---|---|".to_owned());
    }
    for joint in &summary.joint_errors {
        let gives_way = joint.gravity_words().unwrap_or_else(|| "-".to_owned());
        let (from, to) = joint.measured_deg;
        line(format!("| {} | {from:.0} .. {to:.0} | {:.0} | {gives_way} |", joint.joint, joint.curve_rms_urad));
    }
    line("\n## Parameters\n".to_owned());
    line("| | nominal | deviation | sigma | unit | |".to_owned());
    line("|---|---|---|---|---|---|".to_owned());
    for parameter in summary.constants() {
        let sigma = parameter.sigma.map_or_else(|| "-".to_owned(), |sigma| format!("{sigma:.4}"));
        let note = if parameter.identifiable { "" } else { "only with others" };
        line(format!(
            "| {} | {:.3} | {:+.4} | {sigma} | {} | {note} |",
            parameter.id, parameter.nominal, parameter.deviation, parameter.unit
        ));
    }
    if !summary.blind_groups.is_empty() {
        line("\n## What distances cannot tell apart\n".to_owned());
        for group in &summary.blind_groups {
            line(format!("* {}", group.description));
        }
    }
    if !summary.rejected.is_empty() {
        line("\n## Samples that do not count\n".to_owned());
        for rejected in &summary.rejected {
            line(format!("* pose {}: {:.3} mm off, {}", rejected.pose, rejected.residual_mm, rejected.reason));
        }
    }
    page
}

fn rows(arm: &str, errors: &ModelSummary, line: &mut impl FnMut(String)) {
    let quantities = [("position", &errors.position_mm), ("distance", &errors.distance_mm)];
    for (quantity, statistics) in quantities {
        if let Some(StatisticsSummary { mean, rms, p95, max, .. }) = statistics {
            line(format!("| {quantity}, {arm} | {mean:.3} | {rms:.3} | {p95:.3} | {max:.3} |"));
        }
    }
}
