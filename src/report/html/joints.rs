//! The errors of the joints: what explains the error of the nominal arm, the models that were tried, and the curve of each joint.

use super::markup::{Column, NONE, add, escape, number, optional, paragraph, table};
use super::plot::{Plot, Scale};
use crate::report::document::Document;
use crate::session::joint_errors::shares_sentence;
use crate::session::summary::{JointErrorSummary, SelectionSummary};

/// Size of the drawing of a curve.
const SIZE: (f64, f64) = (236.0, 130.0);

/// The section; empty if only geometry was asked for.
pub(super) fn section(document: &Document) -> String {
    let Some(result) = &document.result else { return String::new() };
    let Some(selection) = &result.selection else { return String::new() };
    let mut html = String::from("<h2>What the error consists of</h2>\n");
    html.push_str(&causes(selection));
    if result.joint_errors.is_empty() {
        return html;
    }
    html.push_str("<h3>Angle errors of the joints</h3>\n");
    html.push_str(&paragraph("The angle by which each joint turns beside its pendant value, at every value of the joint (positive: farther in the direction of its axis). It belongs to gear and encoder and moves with them. Line: the curve where it was measured; grey area: plus and minus one standard deviation; dashed: not measured, where the curve is only expected to be as large as elsewhere."));
    html.push_str(&sizes(&result.joint_errors));
    let largest = result.joint_errors.iter().flat_map(ends).map(f64::abs).fold(1.0, f64::max);
    let drawn: String = result.joint_errors.iter().map(|joint| curve(joint, largest)).collect();
    add(&mut html, &format!("<div class=\"grid three\">\n{drawn}</div>\n"));
    html
}

fn causes(selection: &SelectionSummary) -> String {
    let mut sentence = escape(&shares_sentence(selection));
    if let Some(first) = sentence.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    let mut html = paragraph(&format!(
        "<b>{sentence}.</b> Left is the root mean square error at poses that were left out in turn."
    ));
    let rows: Vec<Vec<String>> = selection
        .candidates
        .iter()
        .map(|candidate| {
            vec![
                escape(&candidate.terms.to_string()),
                number(candidate.left_out_rms_mm, 4),
                number(candidate.residual_mm, 4),
                if candidate.terms == selection.kept { "✓ <b>kept</b>" } else { "" }.to_owned(),
            ]
        })
        .collect();
    let columns = [
        ("Model that was tried", Column::Text),
        ("left out (mm)", Column::Number),
        ("residual (mm)", Column::Number),
        ("", Column::Word),
    ];
    html.push_str(&table("", &columns, &rows, true));
    html.push_str(&paragraph(&format!(
        "<span class=\"small\">Left out: root mean square error at poses that were left out in turn. Residual: per coordinate with all poses, no accuracy. Why: {}.</span>",
        escape(&selection.reason)
    )));
    html
}

fn sizes(joints: &[JointErrorSummary]) -> String {
    let rows: Vec<Vec<String>> = joints
        .iter()
        .map(|joint| {
            let (from, to) = joint.measured_deg;
            vec![
                escape(&joint.joint),
                format!("{} … {}", number(from, 0), number(to, 0)),
                number(joint.curve_rms_urad, 0),
                optional(joint.sigma_urad(), 0),
                joint.compliance_urad.map_or_else(
                    || NONE.to_owned(),
                    |(turn, sigma)| format!("{} ± {}", number(turn, 0), number(sigma, 0)),
                ),
                optional(joint.torque_nm, 1),
            ]
        })
        .collect();
    let columns = [
        ("joint", Column::Word),
        ("measured (deg)", Column::Number),
        ("curve rms (µrad)", Column::Number),
        ("sigma (µrad)", Column::Number),
        ("gives way (µrad)", Column::Number),
        ("at (N·m)", Column::Number),
    ];
    let caption = "Size where it was measured; how far each joint gives way at its largest gravity torque";
    table(caption, &columns, &rows, true)
}

/// Ends of the band of a joint where it was measured, and its curve elsewhere (µrad).
fn ends(joint: &JointErrorSummary) -> impl Iterator<Item = f64> + '_ {
    joint.curve.iter().flat_map(|(value, error, sigma)| {
        let sigma = if joint.is_measured_at(*value) { *sigma } else { 0.0 };
        [error - sigma, error + sigma]
    })
}

fn curve(joint: &JointErrorSummary, largest: f64) -> String {
    let (Some((first, ..)), Some((last, ..))) = (joint.curve.first(), joint.curve.last()) else {
        return String::new();
    };
    let y = Scale::linear(-1.05 * largest, 1.05 * largest);
    let mut plot = Plot::new(SIZE, (Scale::linear(*first, *last), "deg"), (y, "µrad"));
    plot.band("bnd", joint.curve.iter().map(|(value, error, sigma)| (*value, error - sigma, error + sigma)));
    plot.curve("ax", [(*first, 0.0), (*last, 0.0)].into_iter());
    let (from, to) = joint.measured_deg;
    let ends = || [from, to].into_iter().filter_map(|value| Some((value, joint.at(value)?.0)));
    let within = |low: f64, high: f64| {
        let inside = joint.curve.iter().filter(move |(value, ..)| (low..=high).contains(value));
        let ends = ends().filter(move |(value, _)| (low..=high).contains(value));
        let mut values: Vec<(f64, f64)> = inside.map(|(value, error, _)| (*value, *error)).chain(ends).collect();
        values.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        values.into_iter()
    };
    plot.curve("out", within(*first, from));
    plot.curve("out", within(to, *last));
    plot.curve("il", within(from, to));
    let gives_way =
        joint.gravity_words().map_or_else(String::new, |words| format!("; gives way by {}", escape(&words)));
    let (from, to) = (number(from, 0), number(to, 0));
    plot.figure(
        &joint.joint,
        &format!("measured from {from} to {to} deg, {} µrad rms{gives_way}", number(joint.curve_rms_urad, 0)),
    )
}
