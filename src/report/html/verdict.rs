//! The verdict, and the accuracy on poses that the identification did not see.

use super::charts::{LISTED, MOST, against_joints, norm, of_kind, per_pose, spread, worst};
use super::markup::{Column, NONE, add, escape, list, number, optional, paragraph, table};
use super::pair;
use super::views::views;
use crate::report::document::{DecisionPart, Details, Document, PointOrigin, PointPart, ResultState};
use crate::session::decision::{LimitDecision, Outcome};
use crate::session::joint_errors::workspace_sentence;
use crate::session::summary::{
    Figure, IdentificationSummary, LimitedQuantity, ModelSummary, ORIENTATION_SENTENCE, StatisticsSummary,
    VerificationMode, VerificationSummary, Warning, WorkspaceSummary,
};
use crate::text::{counted, counted_as, decimals_for};

/// Longest warning on the first page (characters).
const LONGEST: usize = 260;
/// Warnings on the first page.
const FIRST: usize = 2;

/// The verdict in a sentence, and what rules acceptance out.
pub(super) fn section(document: &Document) -> String {
    let report = &document.report;
    let Some(result) = &document.result else {
        return "<div class=\"verdict open\"><div class=\"word\">– NOT EVALUATED</div>\n<div>Nothing has been identified yet.</div></div>\n"
            .to_owned();
    };
    let outcome = report.decision.as_ref().map_or(Outcome::NotEvaluated, |decision| decision.outcome);
    let (class, word) = match outcome {
        Outcome::Pass => ("", "✓ ACCEPTED"),
        Outcome::Fail => (" bad", "✗ NOT ACCEPTED"),
        Outcome::Undecided => (" open", "? UNDECIDED"),
        Outcome::NotEvaluated => (" open", "– NOT EVALUATED"),
    };
    let simulated = if report.points_from == PointOrigin::Simulated { " (simulated)" } else { "" };
    let mut reasons: Vec<String> = result.verdict.reasons.iter().map(|reason| escape(reason)).collect();
    // Results of earlier versions do not say it themselves.
    if outcome == Outcome::Undecided && result.verdict.undecided.is_empty() {
        reasons.push("at least one limit is within the uncertainty of the figure".to_owned());
    }
    if report.state == ResultState::OutOfDate {
        reasons.insert(0, "samples have changed since the identification".to_owned());
    }
    let mut html = format!(
        "<div class=\"verdict{class}\"><div class=\"word\">{word}{simulated}</div>\n{}<div>{}.</div>\n{}</div>\n",
        headline(result),
        reasons.join("; "),
        belongs_to(document)
    );
    let mut blocking = result.warnings.iter().filter(|warning| warning.blocks_acceptance);
    html.push_str(&blocking.by_ref().take(FIRST).map(|blocks| warning(blocks, LONGEST)).collect::<String>());
    if blocking.next().is_some() {
        html.push_str(&paragraph("More warnings follow on the next page."));
    }
    html
}

/// The gain in a sentence.
fn headline(result: &IdentificationSummary) -> String {
    let Some(verification) = &result.verification else { return String::new() };
    let said = |name: &str, before: Option<StatisticsSummary>, after: Option<StatisticsSummary>| {
        let [before, after] = [before?, after?].map(|statistics| figure(statistics.figures()[0]));
        let poses = if verification.poses > 0 {
            counted(verification.poses, "pose")
        } else {
            counted(verification.samples, "sample")
        };
        let unseen = if verification.independent { "not used to identify" } else { "of the verification" };
        Some(format!(
            "<div class=\"headline\">{name}: <b>{before} mm → {after} mm</b> (mean of {poses} {unseen})</div>\n"
        ))
    };
    let (before, after) = (&verification.nominal, &verification.identified);
    said("Position error", before.position_mm, after.position_mm)
        .or_else(|| said("Distance from the shared point", before.seat_mm, after.seat_mm))
        .or_else(|| said("Distance error", before.distance_mm, after.distance_mm))
        .unwrap_or_default()
}

/// The arm that the verdict is about.
fn belongs_to(document: &Document) -> String {
    let serial = &document.report.about.serial;
    if serial.is_empty() {
        return "<div><b>No serial number was given: this verdict belongs to no arm.</b></div>\n".to_owned();
    }
    format!("<div>For the arm with serial number <b>{}</b></div>\n", escape(serial))
}

/// The warnings besides those of the first page: those that block acceptance come first, and very many are cut.
pub(super) fn warnings(document: &Document) -> String {
    let Some(result) = &document.result else { return String::new() };
    let is_whole = |warning: &Warning| warning.message.chars().count() <= LONGEST;
    let mut blocking = 0;
    let mut shown: Vec<&Warning> = result
        .warnings
        .iter()
        .filter(|warning| {
            blocking += usize::from(warning.blocks_acceptance);
            !(warning.blocks_acceptance && blocking <= FIRST && is_whole(warning))
        })
        .collect();
    if shown.is_empty() {
        return String::new();
    }
    let all = shown.len();
    shown.sort_by_key(|warning| !warning.blocks_acceptance);
    shown.truncate(MOST);
    let mut html = String::from("<h2>Warnings and notes</h2>\n");
    html.extend(shown.into_iter().map(|shown| warning(shown, usize::MAX)));
    if all > MOST {
        html.push_str(&paragraph(&format!("And {} more; all are in report.json.", all - MOST)));
    }
    html
}

/// The limits with the decision about each, and the rule of the decision.
pub(super) fn limits(document: &Document) -> String {
    let Some(decision) = &document.report.decision else { return String::new() };
    if decision.limits.is_empty() {
        let has_limits = document.result.as_ref().is_some_and(|result| result.verification.is_some());
        let text = if has_limits {
            "The profile states no acceptance limits, so there is nothing to accept against."
        } else {
            "There are no verification poses, so no acceptance limit was compared."
        };
        return paragraph(text);
    }
    let rows: Vec<Vec<String>> = decision
        .limits
        .iter()
        .map(|limit| {
            let (found, uncertainty) = with_uncertainty(limit);
            let said = match limit.outcome {
                Outcome::Pass => "✓ pass",
                Outcome::Fail => "✗ <b>fail</b>",
                Outcome::Undecided => "? <b>undecided</b>",
                Outcome::NotEvaluated => "– not evaluated",
            };
            vec![quantity(limit.quantity).to_owned(), found, uncertainty, number(limit.limit_mm, 3), said.to_owned()]
        })
        .collect();
    let columns = [
        ("Limit", Column::Text),
        ("found (mm)", Column::Number),
        ("U, k = 2 (µm)", Column::Number),
        ("allowed (mm)", Column::Number),
        ("", Column::Word),
    ];
    table("", &columns, &rows, true) + &rule(decision)
}

/// A figure with the digits that its uncertainty justifies, and two digits of that in µm.
fn with_uncertainty(limit: &LimitDecision) -> (String, String) {
    match (limit.value_mm, limit.uncertainty_mm) {
        (Some(value), Some(uncertainty)) => {
            let decimals = decimals_for(uncertainty).min(4);
            (number(value, decimals), number(uncertainty * 1000.0, decimals.saturating_sub(3)))
        }
        (value, _) => (optional(value, 4), NONE.to_owned()),
    }
}

fn rule(decision: &DecisionPart) -> String {
    let sigma = decision.instrument_sigma_mm * 1000.0;
    paragraph(&format!(
        "<span class=\"small\">Decision rule (ISO 14253-1, JCGM 106): U is the expanded uncertainty of a figure, coverage factor k = 2, from the choice of the poses (bootstrap) and from the instrument ({} µm per coordinate, in full: as stated, or what the fit leaves if that is less), as a root sum of squares. <b>Pass:</b> found + U is within the limit. <b>Fail:</b> found − U is beyond it. <b>Undecided:</b> the limit lies in the guard band of U on either side of the figure. The arm is accepted if every limit is passed and no warning rules it out. The largest error is that of these poses, not a bound.</span>",
        number(sigma, usize::from(sigma < 10.0))
    ))
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

/// A warning of at most this many characters.
fn warning(warning: &Warning, most: usize) -> String {
    let (class, word) = if warning.blocks_acceptance { ("warn", "Warning") } else { ("note", "Note") };
    let (message, code) = (escape(&cut(&warning.message, most)), escape(warning.code.as_str()));
    format!("<div class=\"{class}\"><b>{word}.</b> {message} <span class=\"soft\">[{code}]</span></div>\n")
}

/// The beginning of a text, cut at a word.
fn cut(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => {
            let head = text.get(..end).unwrap_or_default();
            format!("{} … (in full on the next page)", head.rsplit_once(' ').map_or(head, |(head, _)| head))
        }
    }
}

/// Before and after: the arm with its errors, and how large they are against the limits.
pub(super) fn before_and_after(document: &Document) -> String {
    let verification = document.result.as_ref().and_then(|result| result.verification.as_ref());
    let mut html = pair::pair(&document.report, verification);
    let tested = of_kind(&document.report, true);
    if !tested.is_empty() {
        let checks = document.result.iter().flat_map(|result| &result.verdict.checks);
        let of_positions = checks.filter_map(|check| {
            let name = match check.quantity {
                LimitedQuantity::PositionMean => "mean",
                LimitedQuantity::PositionRms => "root mean square",
                LimitedQuantity::PositionMax => "largest",
                LimitedQuantity::DistanceMean | LimitedQuantity::DistanceRms | LimitedQuantity::DistanceMax => {
                    return None;
                }
            };
            Some((name.to_owned(), check.limit_mm))
        });
        html.push_str(&spread(&tested, &of_positions.collect::<Vec<_>>()));
    }
    html
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
pub(super) fn figure(figure: Figure) -> String {
    let is_known = figure.interval.is_some() && figure.value.is_finite();
    if is_known { figure.text() } else { number(figure.value, 4) }
}

/// A value with the digits that the interval of another one justifies.
fn like(value: f64, interval: Option<[f64; 2]>) -> String {
    figure(Figure { value, interval })
}

fn statistics(before: &StatisticsSummary, after: &StatisticsSummary) -> Vec<Vec<String>> {
    let figures = before.figures().into_iter().zip(after.figures());
    let row = |(name, (before, after)): (&&str, (Figure, Figure))| {
        let interval = after.interval_text().unwrap_or_else(|| NONE.to_owned());
        vec![(*name).to_owned(), figure(before), figure(after), interval]
    };
    let mut rows: Vec<Vec<String>> = FIGURES.iter().zip(figures).map(row).collect();
    // Of the 95 % no interval is known: they have the digits of the root mean square.
    if let (Some(row), (before, after)) =
        (rows.get_mut(2), (like(before.p95, before.rms_interval), like(after.p95, after.rms_interval)))
    {
        row.splice(1..3, [before, after]);
    }
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
    let positions = [before.position_mm, after.position_mm];
    if let (Some(before), Some(after)) = (&before.axis_mm, &after.axis_mm) {
        let columns = [
            ("mm, in the robot base", Column::Text),
            ("ΔX", Column::Number),
            ("ΔY", Column::Number),
            ("ΔZ", Column::Number),
        ];
        let row = |name: &str, values: &[f64; 3], interval: Option<[f64; 2]>| {
            std::iter::once(name.to_owned()).chain(values.map(|value| like(value, interval))).collect::<Vec<_>>()
        };
        let [of_before, of_after] = positions.map(|statistics| statistics.and_then(|found| found.mean_interval));
        let rows = [
            row("nominal (before), largest absolute value", &before.max, of_before),
            row("nominal (before), mean absolute value", &before.mean, of_before),
            row("identified (after), largest absolute value", &after.max, of_after),
            row("identified (after), mean absolute value", &after.mean, of_after),
        ];
        html.push_str(&table("Position error per axis", &columns, &rows, true));
    }
    if let (Some(before), Some(after)) = (&before.position_mm, &after.position_mm) {
        let caption = format!("Position error (length of the vector), {}", counted(after.count, "pose"));
        html.push_str(&table(&caption, &COLUMNS, &statistics(before, after), true));
    }
    if let (Some(before), Some(after)) = (&before.orientation_mrad, &after.orientation_mrad) {
        let caption = format!("Orientation error of the flange, {}", counted(after.count, "pose"));
        let mut columns = COLUMNS;
        columns[0].0 = "mrad";
        html.push_str(&table(&caption, &columns, &statistics(before, after), true));
        html.extend([format!("<p>{ORIENTATION_SENTENCE}.</p>\n")]);
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
    html.push_str("</div>\n");
    if let Some(robot) = &report.robot {
        html.push_str("<h3>What is left, against each joint</h3>\n");
        html.push_str(&paragraph("Position error of the identified arm (mm) over the pendant value of each joint. Full dots are verification poses; open dots are residuals of the fit. A pattern means that something besides the link constants moves the points, such as flexure or a gear."));
        add(&mut html, &format!("<div class=\"grid three\">\n{}</div>\n", against_joints(robot, &report.points)));
        html.push_str(&joints_named(document));
    }
    html.push_str("<h3>What is left, in space</h3>\n");
    html.push_str(&paragraph("Measured places of the reflector in the robot base with the errors of the identified arm, drawn much longer than in the pictures of the first page, and the arm at its first pose. Full dots are verification poses."));
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
        ("nominal (µm)", Column::Number),
        ("identified (µm)", Column::Number),
        ("ΔX", Column::Number),
        ("ΔY", Column::Number),
        ("ΔZ", Column::Number),
    ];
    let listed: Vec<usize> = worst(points).into_iter().take(LISTED).collect();
    let largest = listed.first().and_then(|index| points.get(*index)).map_or(0.0, |point| norm(point.identified_mm));
    // Three digits of the largest; more are noise.
    let decimals = usize::from(largest < 0.1);
    let rows: Vec<Vec<String>> = listed
        .iter()
        .filter_map(|index| points.get(*index))
        .map(|point| {
            let pose = if point.pose.is_empty() { NONE.to_owned() } else { escape(&point.pose) };
            let lengths =
                [norm(point.nominal_mm), norm(point.identified_mm)].map(|value| number(value * 1000.0, decimals));
            let axes = point.identified_mm.map(|value| number(value * 1000.0, decimals));
            [point.number.to_string(), pose].into_iter().chain(lengths).chain(axes).collect()
        })
        .collect();
    let which = match points.len() {
        count if count > LISTED => format!("The {LISTED} worst of {count} verification poses; all are in report.json"),
        _ => "Verification poses, the worst first".to_owned(),
    };
    table(&format!("{which}. Δ of the identified arm (µm)"), &columns, &rows, false)
}
