//! Texts of the recording: the session, a guide to the picture, and the result. They are in plain Latin letters, because some
//! viewers cannot draw others.

use jiff::Timestamp;
use rerun::{AnyValues, TextDocument};

use crate::recording::canvas::Canvas;
use crate::recording::{latin::plain, names};
use crate::session::joint_errors::{shares_sentence, workspace_sentence};
use crate::session::journal::IdentifiedText;
use crate::session::state::Session;
use crate::session::summary::{ModelSummary, StatisticsSummary, VerdictStatus};

/// The guide to the picture.
const GUIDE: &str = "\
# How to read this recording

Drag the time cursor along **pose**: the arm goes from measurement to measurement. The timeline counts measurements: a pose that
is measured again appears several times. The log and the name of the measured point say which pose of the plan it is.

| in the picture | what it is |
|---|---|
| grey arm | nominal arm, as the maker describes it |
| green glassy arm | identified arm, its deviations enlarged |
| red arrows | errors of the nominal arm, enlarged |
| green arrows | errors of the identified arm, enlarged much more |
| white, blue points | measured for identification, for verification |
| yellow points | next pose, or a questioned sample |
| small grey points | poses of the plan that are not measured yet |
| brown points | skipped poses, excluded samples |
| violet | tracker and beam: as planned, from the fourth point on as measured |

The factors of enlargement are shown above the robot. Errors are measured less predicted, in the robot base, after the tracker was
registered to each arm.

Choose the timeline **solver_iteration** to see the arm bend from nominal to identified while the errors shrink, and
**plan_iteration** to see the search for poses; **time** is the clock. The worst pairs and the uncertainty of positions are
switched on in the list of entities on the left (open it with the button at the top right).

The maps of all pairs show the size of every distance error: rows and columns are samples, brighter means larger.

*fit* marks samples that the identification used: their errors are residuals, not accuracy. Accuracy is what
*verification* shows.
";

/// Draws the texts that a session starts with.
pub(super) fn opening(canvas: &mut Canvas, program: &str, name: &str, opened: Timestamp) {
    let about = AnyValues::default()
        .with_component_from_data("program", text(program))
        .with_component_from_data("session", text(name))
        .with_component_from_data("opened", text(&opened.to_string()));
    canvas.draw_static(names::SESSION_PROPERTIES, &about);
    canvas.draw_static(names::GUIDE, &TextDocument::from_markdown(GUIDE));
    let waiting = format!("# {}\n\nNot identified yet.\n", plain(name));
    canvas.draw_static(names::REPORT, &TextDocument::from_markdown(waiting));
}

/// Returns a text as an array of the library.
fn text(value: &str) -> std::sync::Arc<dyn rerun::external::arrow::array::Array> {
    std::sync::Arc::new(rerun::external::arrow::array::StringArray::from(vec![plain(value)]))
}

/// Draws the report on a result.
pub(super) fn report(canvas: &mut Canvas, session: &Session, identified: &IdentifiedText, time: Timestamp) {
    let summary = &identified.summary;
    let about = AnyValues::default()
        .with_component_from_data("robot", text(&summary.provenance.robot))
        .with_component_from_data("profile", text(&summary.provenance.profile))
        .with_component_from_data("profile_sha256", text(&summary.provenance.profile_sha256))
        .with_component_from_data("verdict", text(verdict(summary.verdict.status)))
        .with_component_from_data("identified", text(&time.to_string()));
    canvas.draw_static(names::RESULT_PROPERTIES, &about);
    canvas.draw_static(names::REPORT, &TextDocument::from_markdown(plain(&markdown(session, identified, time))));
}

const fn verdict(status: VerdictStatus) -> &'static str {
    match status {
        VerdictStatus::Accepted => "accepted",
        VerdictStatus::NotAccepted => "not accepted",
        VerdictStatus::NotEvaluated => "not evaluated",
    }
}

fn markdown(session: &Session, identified: &IdentifiedText, time: Timestamp) -> String {
    let summary = &identified.summary;
    let mut page = String::new();
    let mut line = |text: String| {
        page.push_str(&text);
        page.push('\n');
    };
    line(format!("# {}: {}\n", session.name, verdict(summary.verdict.status)));
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
    line("| bar | | nominal | deviation | sigma | unit | |".to_owned());
    line("|---|---|---|---|---|---|---|".to_owned());
    for (bar, parameter) in summary.constants().enumerate() {
        let sigma = parameter.sigma.map_or_else(|| "-".to_owned(), |sigma| format!("{sigma:.4}"));
        let note = if parameter.identifiable { "" } else { "only with others" };
        line(format!(
            "| {bar} | {} | {:.3} | {:+.4} | {sigma} | {} | {note} |",
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
