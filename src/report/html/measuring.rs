//! Sections about planning, measuring and fitting, about samples that do not count, and about findings with their decisions.

use super::charts::{MOST, drift, norm, prediction, search};
use super::markup::{Column, add, escape, facts, number, optional, paragraph, table, time};
use crate::identification::Estimator;
use crate::report::document::{Details, Document};
use crate::report::text::{gap, sigma_origin, termination};
use crate::session::journal::PlanText;
use crate::session::state::Refused;
use crate::session::summary::{IdentificationSummary, RejectedSummary};
use crate::text::{counted, counted_as};

/// Plan, fit and drift.
pub(super) fn section(document: &Document) -> String {
    let report = &document.report;
    let mut html = String::new();
    if let Some(result) = &document.result {
        add(&mut html, &format!("<h2>The fit</h2>\n{}", facts(&fit(result))));
        html.push_str(&paragraph(
            "Residuals of the fit show how well the model describes the poses it was fitted to. They are not an accuracy.",
        ));
    }
    html.push_str("<h2>Poses and measuring</h2>\n");
    match &report.plan {
        Some(plan) => html.push_str(&facts(&plan_facts(plan, report))),
        None => html.push_str(&paragraph("No plan was accepted.")),
    }
    let mut drawings = String::new();
    let steps = report.plan.as_ref().map_or(&[][..], |plan| &plan.search);
    if steps.len() > 1 {
        drawings.push_str(&search(steps));
    }
    if report.prediction.len() > 1 {
        drawings.push_str(&prediction(&report.prediction));
    }
    if !report.drift.is_empty() {
        drawings.push_str(&drift(&report.drift));
    }
    if !drawings.is_empty() {
        add(&mut html, &format!("<div class=\"grid\">\n{drawings}</div>\n"));
    }
    html.push_str(&drift_table(report));
    html
}

fn fit(result: &IdentificationSummary) -> Vec<(&'static str, String)> {
    let settings = &result.settings;
    let estimator = match settings.estimator {
        Estimator::Robust => "robust: outliers are detected, named and excluded",
        Estimator::LeastSquares => "least squares: every sample counts",
    };
    let residuals = result
        .sigma
        .from_residuals_mm
        .map_or_else(String::new, |residual| format!("{} mm per coordinate (not an accuracy)", number(residual, 4)));
    let rank = result.rank.map_or_else(
        || "not clear".to_owned(),
        |rank| format!("{rank} of {} parameters ({})", result.parameter_count, escape(&gap(result.singular_value_gap))),
    );
    let condition = result.condition_number.map_or_else(String::new, |scaled| {
        let raw = optional(result.condition_number_mm_rad, 0);
        format!("{} in expected deviations, {raw} in mm and rad", number(scaled, 1))
    });
    let steps = counted(result.iterations.len(), "solver step");
    vec![
        ("Identification samples", format!("{}, {} of them rejected", result.samples, result.rejected.len())),
        (
            "Standard deviation used",
            format!("{} mm per coordinate, {}", number(result.sigma.stated_mm(), 4), sigma_origin(result.sigma.source)),
        ),
        ("Residuals of the fit", residuals),
        ("Weighting, prior", format!("{}, {}", settings.weighting, settings.prior)),
        ("Estimator", estimator.to_owned()),
        ("Rank", rank),
        ("Condition number", condition),
        ("Solver", format!("{} after {steps}", termination(result.termination))),
    ]
}

fn plan_facts(plan: &PlanText, report: &Details) -> Vec<(&'static str, String)> {
    let mut missing = Vec::new();
    if report.counts.open > 0 {
        missing.push(counted_as(report.counts.open, "pose was not measured", "poses were not measured"));
    }
    if report.counts.skipped > 0 {
        missing.push(counted_as(report.counts.skipped, "pose was skipped", "poses were skipped"));
    }
    vec![
        ("Plan", escape(&plan.origin)),
        ("Condition number of the plan", plan.condition_number.map_or_else(String::new, |value| number(value, 1))),
        (
            "Predicted error of the plan",
            plan.predicted_error_sigma.map_or_else(String::new, |value| {
                format!("{} times the standard deviation of the instrument (RMS at fresh poses)", number(value, 3))
            }),
        ),
        ("Planned time", plan.minutes.map_or_else(String::new, |minutes| format!("{} min", number(minutes, 0)))),
        ("Left undone", missing.join(", ")),
    ]
}

fn drift_table(report: &Details) -> String {
    if report.drift.is_empty() {
        return paragraph("No pose was measured again, so a drift of instrument or robot would not have been seen.");
    }
    let columns = [
        ("No.", Column::Number),
        ("pose", Column::Text),
        ("minutes later", Column::Number),
        ("moved (mm)", Column::Number),
        ("x", Column::Number),
        ("y", Column::Number),
        ("z", Column::Number),
    ];
    let rows: Vec<Vec<String>> = report
        .drift
        .iter()
        .map(|part| {
            let moved = part.moved_mm.map(|value| number(value, 4));
            let first =
                [part.number.to_string(), escape(&part.pose), number(part.minutes, 0), number(norm(part.moved_mm), 4)];
            first.into_iter().chain(moved).collect()
        })
        .collect();
    table(
        "Drift: a pose measured again, against its first measurement, in the frame of the instrument",
        &columns,
        &rows,
        true,
    )
}

/// Samples that do not count, findings, corrections, remarks.
pub(super) fn samples(document: &Document) -> String {
    let report = &document.report;
    let mut html = String::from("<h2>Samples that do not count, findings, remarks</h2>\n");
    html.push_str(&rejected(document));
    let columns = [("No.", Column::Number), ("pose", Column::Text), ("why", Column::Text)];
    for (title, measurements) in
        [("Measured, but not counted", &report.not_counted), ("Readings that were refused", &report.refused)]
    {
        let row = |one: &Refused| vec![one.number.to_string(), escape(&one.pose), escape(&one.reason)];
        let rows: Vec<_> = measurements.iter().map(row).collect();
        if !rows.is_empty() {
            html.push_str(&table(title, &columns, &rows, false));
        }
    }
    if !report.findings.is_empty() {
        let columns = [
            ("No.", Column::Number),
            ("pose", Column::Text),
            ("what was found", Column::Text),
            ("what was decided", Column::Text),
        ];
        let rows: Vec<Vec<String>> = report
            .findings
            .iter()
            .map(|finding| {
                let found = format!("{} (at measurement {})", escape(&finding.message), finding.raised_at);
                vec![finding.about.to_string(), escape(&finding.pose), found, escape(&finding.decision)]
            })
            .collect();
        html.push_str(&table("What the checks found while measuring", &columns, &rows, false));
    }
    if !report.corrections.is_empty() {
        let rows: Vec<Vec<String>> = report.corrections.iter().map(|text| vec![escape(text)]).collect();
        html.push_str(&table("", &[("Corrections", Column::Text)], &rows, false));
    }
    let is_quiet = report.not_counted.is_empty() && report.refused.is_empty() && report.findings.is_empty();
    if is_quiet {
        html.push_str(&paragraph(
            "The operator excluded nothing, no reading was refused, and the checks found nothing while measuring.",
        ));
    }
    if !report.remarks.is_empty() {
        let columns = [
            ("remark of the instrument or the robot", Column::Text),
            ("first at No.", Column::Number),
            ("samples", Column::Number),
        ];
        let rows: Vec<Vec<String>> = report
            .remarks
            .iter()
            .take(MOST)
            .map(|remark| vec![escape(&remark.text), remark.first.to_string(), remark.samples.to_string()])
            .collect();
        html.push_str(&table("", &columns, &rows, false));
    }
    if !report.notes.is_empty() {
        let columns = [("time", Column::Word), ("pose", Column::Text), ("remark of the operator", Column::Text)];
        let rows: Vec<Vec<String>> = report
            .notes
            .iter()
            .map(|note| {
                vec![
                    time(&note.time.to_string()),
                    note.pose.as_deref().map_or_else(String::new, escape),
                    escape(&note.text),
                ]
            })
            .collect();
        html.push_str(&table("", &columns, &rows, false));
    }
    html
}

fn rejected(document: &Document) -> String {
    let Some(result) = &document.result else { return String::new() };
    if result.settings.estimator != Estimator::Robust {
        return paragraph("The fit did not look for outliers: every identification sample counts.");
    }
    if result.rejected.is_empty() {
        return paragraph("The identification rejected no sample.");
    }
    let columns = [
        ("pose", Column::Text),
        ("off by (mm)", Column::Number),
        ("times the scatter", Column::Number),
        ("why", Column::Text),
    ];
    let mut listed: Vec<&RejectedSummary> = result.rejected.iter().collect();
    let mut some = String::new();
    if listed.len() > MOST {
        listed.sort_by(|one, other| other.residual_mm.total_cmp(&one.residual_mm));
        listed.truncate(MOST);
        some = format!("; the {MOST} that are farthest off are listed, all are in report.json");
    }
    let rows: Vec<Vec<String>> = listed
        .iter()
        .map(|one| vec![escape(&one.pose), number(one.residual_mm, 3), number(one.ratio, 0), escape(&one.reason)])
        .collect();
    let caption =
        format!("Rejected by the identification: {} of {} samples{some}", result.rejected.len(), result.samples);
    table(&caption, &columns, &rows, false)
}
