//! The verdict, and the accuracy on poses that the identification did not see.

use super::charts::{MOST, against_joints, histogram, norm, of_kind, per_pose, worst};
use super::markup::{Column, NONE, add, escape, list, number, optional, paragraph, table};
use super::views::views;
use crate::report::document::{Details, Document, PointOrigin, PointPart, ResultState};
use crate::session::joint_errors::workspace_sentence;
use crate::session::summary::{
    Figure, IdentificationSummary, LimitCheck, LimitedQuantity, ModelSummary, StatisticsSummary, VerdictStatus,
    VerificationMode, VerificationSummary, Warning, WorkspaceSummary,
};
use crate::text::{counted, counted_as};

/// The verdict with every limit, and the warnings.
pub(super) fn section(document: &Document) -> String {
    let Some(result) = &document.result else {
        return "<div class=\"verdict open\"><div class=\"word\">– NOT EVALUATED</div>\n<div>Nothing has been identified yet.</div></div>\n"
            .to_owned();
    };
    let state = document.report.state;
    let status = if state == ResultState::OutOfDate { VerdictStatus::NotEvaluated } else { result.verdict.status };
    let (class, word) = match status {
        VerdictStatus::Accepted => ("", "✓ ACCEPTED"),
        VerdictStatus::NotAccepted => (" bad", "✗ NOT ACCEPTED"),
        VerdictStatus::NotEvaluated => (" open", "– NOT EVALUATED"),
    };
    let simulated = if document.report.points_from == PointOrigin::Simulated { " (simulated)" } else { "" };
    let mut reasons: Vec<String> = result.verdict.reasons.iter().map(|reason| escape(reason)).collect();
    if state == ResultState::OutOfDate {
        reasons.insert(0, "samples have changed since the identification".to_owned());
    }
    let mut html = format!(
        "<div class=\"verdict{class}\"><div class=\"word\">{word}{simulated}</div>\n<div>{}</div></div>\n",
        reasons.join("; ")
    );
    html.push_str(&limits(&result.verdict.checks));
    html.push_str(&warnings(&result.warnings));
    html
}

/// The warnings. If there are very many, those that block acceptance come first and the rest is cut.
fn warnings(all: &[Warning]) -> String {
    let mut shown: Vec<&Warning> = all.iter().collect();
    if all.len() <= MOST {
        return shown.into_iter().map(warning).collect();
    }
    shown.sort_by_key(|warning| !warning.blocks_acceptance);
    shown.truncate(MOST);
    let more = paragraph(&format!("And {} more; all are in report.json.", all.len() - MOST));
    shown.into_iter().map(warning).collect::<String>() + &more
}

fn limits(checks: &[LimitCheck]) -> String {
    if checks.is_empty() {
        return paragraph("The profile states no acceptance limits, so there is nothing to accept against.");
    }
    let rows: Vec<Vec<String>> = checks
        .iter()
        .map(|check| {
            let met = match check.met {
                Some(true) => "✓ met",
                Some(false) => "✗ <b>not met</b>",
                None => "– not evaluated",
            };
            vec![
                quantity(check.quantity).to_owned(),
                if check.interval_mm.is_some() { check.value_text() } else { optional(check.value_mm, 4) },
                number(check.limit_mm, 4),
                met.to_owned(),
            ]
        })
        .collect();
    let columns =
        [("Limit", Column::Text), ("found (mm)", Column::Number), ("allowed (mm)", Column::Number), ("", Column::Word)];
    table("", &columns, &rows, true)
}

const fn quantity(quantity: LimitedQuantity) -> &'static str {
    match quantity {
        LimitedQuantity::PositionMean => "position error, mean",
        LimitedQuantity::PositionRms => "position error, root mean square",
        LimitedQuantity::PositionMax => "position error, largest",
        LimitedQuantity::DistanceMean => "distance error, mean",
        LimitedQuantity::DistanceRms => "distance error, root mean square",
        LimitedQuantity::DistanceMax => "distance error, largest",
    }
}

fn warning(warning: &Warning) -> String {
    let (class, word) = if warning.blocks_acceptance { ("warn", "Warning") } else { ("note", "Note") };
    let (message, code) = (escape(&warning.message), escape(warning.code.as_str()));
    format!("<div class=\"{class}\"><b>{word}.</b> {message} <span class=\"soft\">[{code}]</span></div>\n")
}

/// Tables III and IV of the method paper for this robot.
pub(super) fn accuracy(document: &Document) -> String {
    let title = "<h2>Accuracy on poses that the identification did not see</h2>\n";
    let Some(result) = &document.result else { return String::new() };
    let Some(verification) = &result.verification else {
        let text = "No verification poses were measured, so nothing can be said about the accuracy. The residuals of the fit below are not an accuracy: the parameters were chosen to make them small.";
        return format!("<h2>Accuracy</h2>\n{}", paragraph(text));
    };
    let mut html = if verification.independent {
        title.to_owned()
    } else {
        "<h2>Errors on verification poses</h2>\n<div class=\"warn\"><b>Not independent.</b> The identification saw these poses in part or all; the numbers may be too good.</div>\n".to_owned()
    };
    html.push_str(&paragraph(&procedure(result, verification, &document.report)));
    let (before, after) = (&verification.nominal, &verification.identified);
    html.push_str(&distances(before, after));
    html.push_str(&positions(before, after));
    html.push_str(&verification.sample_sentence().map_or_else(String::new, |said| paragraph(&format!("{said}."))));
    if let Some(workspace) = &result.workspace {
        html.push_str(&predicted(workspace));
    }
    html
}

/// The error predicted where nothing was measured.
fn predicted(workspace: &WorkspaceSummary) -> String {
    let mut sentence = escape(&workspace_sentence(workspace));
    if let Some(first) = sentence.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    paragraph(&format!(
        "{sentence}. The tables above tell what the arm does near the measured poses; this prediction includes what is not known elsewhere."
    ))
}

/// The verification procedure in words.
fn procedure(result: &IdentificationSummary, verification: &VerificationSummary, report: &Details) -> String {
    let samples = counted(verification.samples, "verification pose");
    let pairs = verification.identified.distance_mm.map(|distance| counted(distance.count, "distance"));
    let visits = match (result.settings.verification, report.counts.repeats) {
        (VerificationMode::File | VerificationMode::Rest, 0) => "no pose occurs twice in the tables".to_owned(),
        (VerificationMode::Session, 0) => "each pose was visited once".to_owned(),
        (VerificationMode::Session | VerificationMode::File | VerificationMode::Rest, repeats) => {
            format!("{} at a pose that was measured before", counted_as(repeats, "sample is", "samples are"))
        }
        (VerificationMode::LeaveOneOut, _) => "each position of the plate was left out in turn".to_owned(),
        (VerificationMode::None, _) => String::new(),
    };
    let shots = match (report.counts.fewest_shots, report.counts.most_shots) {
        (0, _) => String::new(),
        (1, 1) => ", one reading each".to_owned(),
        (fewest, most) if fewest == most => format!(", {fewest} readings averaged at each"),
        (fewest, most) => format!(", {fewest} to {most} readings averaged at each"),
    };
    let distances = pairs.map_or_else(String::new, |pairs| {
        format!(" Distance errors are measured less predicted length, over {pairs}.")
    });
    let positions = if verification.identified.position_mm.is_some() {
        " Position errors are after the place of the instrument was fitted on the identification poses only, for each model separately."
    } else {
        ""
    };
    let basis = escape(&verification.basis);
    let basis = if basis.is_empty() { String::new() } else { format!(" ({basis})") };
    let visits = if visits.is_empty() { visits } else { format!("; {visits}{shots}") };
    format!(
        "{samples}{basis}{visits}.{distances}{positions} The test cycles of ISO 9283 (given poses, approached 30 times) were not run: these are not its distance and pose accuracy."
    )
}

const FIGURES: [&str; 4] = ["mean", "root mean square", "95 % are at most", "largest"];

const COLUMNS: [(&str, Column); 4] = [
    ("mm", Column::Text),
    ("nominal (before)", Column::Number),
    ("identified (after)", Column::Number),
    ("95 % interval (after)", Column::Number),
];

/// A figure with as many digits as its interval justifies, or the mark for none.
fn figure(figure: Figure) -> String {
    if figure.interval.is_some() { figure.text() } else { number(figure.value, 4) }
}

fn statistics(before: &StatisticsSummary, after: &StatisticsSummary) -> Vec<Vec<String>> {
    let figures = before.figures().into_iter().zip(after.figures());
    let row = |(name, (before, after)): (&&str, (Figure, Figure))| {
        let interval = after.interval_text().unwrap_or_else(|| NONE.to_owned());
        vec![(*name).to_owned(), figure(before), figure(after), interval]
    };
    let mut rows: Vec<Vec<String>> = FIGURES.iter().zip(figures).map(row).collect();
    // The largest comes first, as in table III of the method paper.
    rows.rotate_right(1);
    rows
}

fn distances(before: &ModelSummary, after: &ModelSummary) -> String {
    let mut html = String::new();
    if let (Some(before), Some(after)) = (&before.distance_mm, &after.distance_mm) {
        let caption = format!("Distance error of {} distances", after.count);
        html.push_str(&table(&caption, &COLUMNS, &statistics(before, after), true));
    }
    if let (Some(before), Some(after)) = (&before.seat_mm, &after.seat_mm) {
        let caption = format!("Distance from the shared point, {} samples", after.count);
        html.push_str(&table(&caption, &COLUMNS, &statistics(before, after), true));
    }
    html
}

fn positions(before: &ModelSummary, after: &ModelSummary) -> String {
    let mut html = String::new();
    if let (Some(before), Some(after)) = (&before.axis_mm, &after.axis_mm) {
        let columns = [
            ("mm, in the robot base", Column::Text),
            ("ΔX", Column::Number),
            ("ΔY", Column::Number),
            ("ΔZ", Column::Number),
        ];
        let row = |name: &str, values: &[f64; 3]| {
            std::iter::once(name.to_owned()).chain(values.map(|value| number(value, 4))).collect::<Vec<_>>()
        };
        let rows = [
            row("nominal (before), largest absolute value", &before.max),
            row("nominal (before), mean absolute value", &before.mean),
            row("identified (after), largest absolute value", &after.max),
            row("identified (after), mean absolute value", &after.mean),
        ];
        html.push_str(&table("Position error per axis", &columns, &rows, true));
    }
    if let (Some(before), Some(after)) = (&before.position_mm, &after.position_mm) {
        let caption = format!("Position error (length of the vector), {}", counted(after.count, "pose"));
        html.push_str(&table(&caption, &COLUMNS, &statistics(before, after), true));
    }
    html
}

/// Errors as drawings.
pub(super) fn drawings(document: &Document) -> String {
    let report = &document.report;
    if report.points.is_empty() {
        return String::new();
    }
    let (tested, judged) = (of_kind(report, true), of_kind(report, false));
    let mut html = String::from("<h2>Errors as drawings</h2>\n<div class=\"grid\">\n");
    if !tested.is_empty() {
        html.push_str(&per_pose(
            &tested,
            "Verification poses: position error",
            "not seen by the identification; logarithmic scale",
        ));
    }
    if !judged.is_empty() {
        html.push_str(&per_pose(
            &judged,
            "Identification poses: residual of the fit",
            "<strong>not an accuracy</strong>: fitted to these very poses",
        ));
    }
    let errors = |pick: fn(&PointPart) -> [f64; 3]| tested.iter().map(|point| norm(pick(point))).collect::<Vec<_>>();
    if !tested.is_empty() {
        html.push_str(&histogram(&errors(|point| point.nominal_mm), false));
        html.push_str(&histogram(&errors(|point| point.identified_mm), true));
    }
    html.push_str("</div>\n");
    if let Some(robot) = &report.robot {
        html.push_str("<h3>What is left, against each joint</h3>\n");
        html.push_str(&paragraph("Position error of the identified arm (mm) over the pendant value of each joint. Full dots are verification poses; open dots are residuals of the fit. A pattern means that something besides the link constants moves the points, such as flexure or a gear."));
        add(&mut html, &format!("<div class=\"grid three\">\n{}</div>\n", against_joints(robot, &report.points)));
        html.push_str(&joints_named(document));
    }
    html.push_str("<h3>Poses in space</h3>\n");
    html.push_str(&paragraph("Measured places of the reflector in the robot base with their errors (measured less predicted, drawn longer), and the arm at its first pose. Full dots are verification poses."));
    add(&mut html, &format!("<div class=\"grid\">\n{}</div>\n", views(report)));
    html.push_str(&poses(&tested));
    html
}

/// Share of the error that follows each joint, according to the verification.
fn joints_named(document: &Document) -> String {
    let joints = document.result.iter().filter_map(|result| result.verification.as_ref());
    let named: Vec<String> = joints
        .flat_map(|verification| &verification.residual_by_joint)
        .filter(|joint| joint.is_worth_naming())
        .map(|joint| format!("{}: {} %", escape(&joint.joint), number(100.0 * joint.explained, 0)))
        .collect();
    if named.is_empty() {
        return paragraph("No joint stands out on the verification poses.");
    }
    let intro = paragraph("Share of the square error on the verification poses that follows a joint:");
    intro + &list(&named)
}

/// The verification poses one by one.
fn poses(points: &[&PointPart]) -> String {
    if points.is_empty() {
        return String::new();
    }
    let columns = [
        ("No.", Column::Number),
        ("pose", Column::Text),
        ("nominal (mm)", Column::Number),
        ("identified (mm)", Column::Number),
        ("ΔX", Column::Number),
        ("ΔY", Column::Number),
        ("ΔZ", Column::Number),
    ];
    let mut listed: Vec<usize> = worst(points).into_iter().take(MOST).collect();
    listed.sort_unstable();
    let rows: Vec<Vec<String>> = listed
        .iter()
        .filter_map(|index| points.get(*index))
        .map(|point| {
            let pose = if point.pose.is_empty() { NONE.to_owned() } else { escape(&point.pose) };
            let lengths = [norm(point.nominal_mm), norm(point.identified_mm)].map(|value| number(value, 4));
            let axes = point.identified_mm.map(|value| number(value, 4));
            [point.number.to_string(), pose].into_iter().chain(lengths).chain(axes).collect()
        })
        .collect();
    let some = match points.len() {
        count if count > MOST => format!(". The {MOST} worst of {count}; all are in report.json"),
        _ => String::new(),
    };
    table(&format!("Verification poses one by one; Δ of the identified arm (mm){some}"), &columns, &rows, false)
}
