//! The comparison of calibrations as a page, in the style of the report.

use super::markup::{Column, add, escape, number, page, paragraph, table};
use super::plot::{Plot, Scale, WIDTH};
use crate::report::comparison::{cause_text, letter};
use crate::session::comparison::{ComparisonSummary, CurveDifference, PairSummary};
use crate::text::decimals_for;

/// Height of the drawing of two curves.
const HEIGHT: f64 = 150.0;

/// The comparison as a page that needs nothing else.
pub fn comparison_html(summary: &ComparisonSummary) -> String {
    let mut html = String::new();
    for warning in &summary.warnings {
        add(&mut html, &format!("<p class=\"warn\">{}</p>\n", escape(&warning.message)));
    }
    for pair in &summary.pairs {
        html.push_str(&verdict(pair));
    }
    html.push_str("<h2>The calibrations</h2>\n");
    let rows: Vec<Vec<String>> = summary
        .calibrations
        .iter()
        .enumerate()
        .map(|(index, part)| {
            vec![
                letter(index),
                escape(&part.created),
                part.poses.to_string(),
                number(part.sigma_mm, 4),
                number(part.open_mm, 3),
                escape(&part.file),
            ]
        })
        .collect();
    let columns = [
        ("", Column::Word),
        ("made", Column::Word),
        ("poses", Column::Number),
        ("sigma (mm)", Column::Number),
        ("open (mm)", Column::Number),
        ("file", Column::Text),
    ];
    html.push_str(&table("", &columns, &rows, true));
    html.push_str(&paragraph("<span class=\"small\">Sigma: scatter of a coordinate of a reading. Open: position error (rms over the workspace) that the poses leave open.</span>"));
    for pair in &summary.pairs {
        html.push_str(&section(pair));
    }
    let origin = format!("{}, {}", summary.program, summary.created);
    page("Comparison of calibrations", &summary.robot, &html, &origin)
}

fn names(pair: &PairSummary) -> String {
    format!("{} to {}", letter(pair.from), letter(pair.to))
}

fn verdict(pair: &PairSummary) -> String {
    let (class, word) = if pair.has_changed { (" bad", "CHANGED") } else { ("", "NO CHANGE") };
    let mut lines = vec![format!(
        "Positions differ by <b>{} mm</b> rms over the workspace ({} mm at 95 %, {} mm at most). Two calibrations of an unchanged arm would differ by {} mm.",
        number(pair.rms_mm, 3),
        number(pair.p95_mm, 3),
        number(pair.max_mm, 3),
        number(pair.sigma_mm, 3)
    )];
    lines.extend(pair.causes.iter().map(|cause| escape(&cause_text(cause))));
    if !pair.is_explained {
        lines.push("Beside that there is something that no single parameter explains.".to_owned());
    }
    let lines = lines.iter().fold(String::new(), |text, line| text + "<p>" + line + "</p>\n");
    format!("<div class=\"verdict{class}\"><span class=\"word\">{}: {word}</span>\n{lines}</div>\n", names(pair))
}

fn section(pair: &PairSummary) -> String {
    if pair.parameters.is_empty() && pair.curves.is_empty() {
        return String::new();
    }
    let mut html = format!("<h2>{}</h2>\n", names(pair));
    let rows: Vec<Vec<String>> = pair
        .parameters
        .iter()
        .map(|parameter| {
            let decimals = decimals_for(parameter.sigma);
            vec![
                parameter.parameter.to_string(),
                number(parameter.difference, decimals),
                number(parameter.sigma, decimals),
                parameter.unit.to_string(),
                number(parameter.ratio.abs(), 1),
            ]
        })
        .collect();
    let columns = [
        ("parameter", Column::Word),
        ("difference", Column::Number),
        ("sigma", Column::Number),
        ("unit", Column::Word),
        ("in sigma", Column::Number),
    ];
    if !rows.is_empty() {
        let caption = "Parameters beyond three standard deviations; parameters of a blind combination share a change";
        html.push_str(&table(caption, &columns, &rows, true));
    }
    if !pair.curves.is_empty() {
        let (before, after) = (letter(pair.from), letter(pair.to));
        html.push_str("<h3>Angle errors of the joints, over each other</h3>\n");
        html.push_str(&paragraph(&format!(
            "Line: {after}, with plus and minus one standard deviation in grey; dashed: {before}."
        )));
        let values = pair.curves.iter().flat_map(|curve| curve.before.iter().chain(&curve.after));
        let largest = values.map(|(_, error, sigma)| error.abs() + sigma).fold(1.0, f64::max);
        let drawn: String = pair.curves.iter().map(|curve| curves(curve, largest)).collect();
        add(&mut html, &format!("<div class=\"grid\">\n{drawn}</div>\n"));
    }
    html
}

fn curves(curve: &CurveDifference, largest: f64) -> String {
    let values = || curve.before.iter().chain(&curve.after).map(|(value, ..)| *value);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let y = Scale::linear(-1.05 * largest, 1.05 * largest);
    let mut plot = Plot::new((WIDTH, HEIGHT), (Scale::linear(low, high), "deg"), (y, "µrad"));
    plot.band("bnd", curve.after.iter().map(|(value, error, sigma)| (*value, error - sigma, error + sigma)));
    plot.curve("ax", [(low, 0.0), (high, 0.0)].into_iter());
    plot.curve("nl", curve.before.iter().map(|(value, error, _)| (*value, *error)));
    plot.curve("il", curve.after.iter().map(|(value, error, _)| (*value, *error)));
    let caption = format!("{} µrad rms apart, {} sigma", number(curve.rms_urad, 0), number(curve.ratio, 1));
    plot.figure(&curve.joint, &caption)
}
