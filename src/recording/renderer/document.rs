//! Texts of the recording: what the session is, how to read the picture, and the result. Plain Latin letters only: some viewers
//! cannot draw others.

use jiff::Timestamp;
use rerun::{AnyValues, TextDocument};

use crate::recording::canvas::Canvas;
use crate::recording::{latin::plain, names};
use crate::session::journal::IdentifiedText;
use crate::session::state::Session;
use crate::session::summary::{ModelSummary, StatisticsSummary, VerdictStatus};

/// How to read the picture.
const GUIDE: &str = "\
# How to read this recording

Drag the time cursor along **pose**: the arm goes from measurement to measurement. The timeline counts measurements: a pose that
is measured again has several. Which pose of the plan it was says the log, and the name of the measured point.

| in the picture | what it is |
|---|---|
| grey arm | nominal arm, as the maker describes it |
| green glassy arm | identified arm, its deviations enlarged |
| red arrows | errors of the nominal arm, enlarged |
| green arrows | errors of the identified arm, enlarged much more |
| white, blue points | measured for identification, for verification |
| yellow points | next pose, or a sample in doubt |
| small grey points | poses of the plan that wait |
| brown points | skipped, or left out |
| violet | tracker and beam: as planned, from the fourth point on as measured |

How much is enlarged stands above the robot. Errors are measured less predicted, in the robot base, after the tracker was
registered to each arm.

Choose the timeline **solver_iteration** to see the arm bend from nominal to identified while the errors shrink, and
**plan_iteration** to see the search for poses; **time** is the clock. The worst pairs and the uncertainty of positions are
switched on in the list of entities on the left (open it with the button at the top right).

The maps of all pairs show the size of every distance error: row and column are samples, the brighter the larger.

*fit* marks samples that the identification has used: their errors are residuals, not accuracy. Accuracy is what
*verification* shows.
";

/// The first texts of a session.
pub(super) fn opening(canvas: &mut Canvas, program: &str, name: &str, opened: Timestamp) {
    let about = AnyValues::default()
        .with_component_from_data("program", text(program))
        .with_component_from_data("session", text(name))
        .with_component_from_data("opened", text(&opened.to_string()));
    canvas.fix(names::SESSION_PROPERTIES, &about);
    canvas.fix(names::GUIDE, &TextDocument::from_markdown(GUIDE));
    let waiting = format!("# {}\n\nNot identified yet.\n", plain(name));
    canvas.fix(names::REPORT, &TextDocument::from_markdown(waiting));
}

/// A text as the library stores it.
fn text(value: &str) -> std::sync::Arc<dyn rerun::external::arrow::array::Array> {
    std::sync::Arc::new(rerun::external::arrow::array::StringArray::from(vec![plain(value)]))
}

/// The result.
pub(super) fn report(canvas: &mut Canvas, session: &Session, identified: &IdentifiedText, time: Timestamp) {
    let summary = &identified.summary;
    let about = AnyValues::default()
        .with_component_from_data("robot", text(&summary.provenance.robot))
        .with_component_from_data("profile", text(&summary.provenance.profile))
        .with_component_from_data("profile_sha256", text(&summary.provenance.profile_sha256))
        .with_component_from_data("verdict", text(verdict(summary.verdict.status)))
        .with_component_from_data("identified", text(&time.to_string()));
    canvas.fix(names::RESULT_PROPERTIES, &about);
    canvas.fix(names::REPORT, &TextDocument::from_markdown(plain(&markdown(session, identified, time))));
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
    line("\n## Parameters\n".to_owned());
    line("| bar | | nominal | deviation | sigma | unit | |".to_owned());
    line("|---|---|---|---|---|---|---|".to_owned());
    for (bar, parameter) in summary.parameters.iter().enumerate() {
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
        line("\n## Samples left out\n".to_owned());
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
