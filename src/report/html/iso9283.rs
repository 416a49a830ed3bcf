//! The figures of a test after ISO 9283 as a page, in the style of the report.

use super::markup::{Column, NONE, add, escape, facts, number, page, paragraph, table};
use crate::report::iso9283::{cycles, frame};
use crate::session::iso9283::{AccuracyMm, DirectionRow, DistanceRow, EstimateMm, PoseRow, TestSummary};

/// The result of a test as a page that needs nothing else.
pub fn test_html(summary: &TestSummary) -> String {
    let provenance = &summary.provenance;
    let stated = |text: &Option<String>| text.as_deref().map_or_else(|| "not stated".to_owned(), escape);
    let inputs: Vec<String> = provenance.inputs.iter().map(|input| escape(&input.file)).collect();
    let mut html = extremes(summary);
    html.push_str(&facts(&[
        ("profile", escape(&provenance.profile)),
        ("data", inputs.join("<br>")),
        ("load", stated(&summary.load)),
        ("speed", stated(&summary.speed)),
        ("place of the instrument", frame(summary).to_owned()),
        ("test", format!("{} poses, {}", summary.poses.len(), cycles(summary))),
    ]));
    html.push_str("<h2>Poses</h2>\n");
    html.push_str(&poses(summary));
    html.push_str("<h2>Distances</h2>\n");
    html.push_str(&paragraph("Distances do not depend on where the instrument stands."));
    html.push_str(&distances(summary));
    html.push_str(&variations(summary));
    html.push_str("<h2>What differs from the procedure of the standard</h2>\n");
    html.push_str("<ul>\n");
    for deviation in &summary.deviations {
        add(&mut html, &format!("<li>{}</li>\n", escape(deviation)));
    }
    html.push_str("</ul>\n");
    html.push_str("<h2>Definitions</h2>\n");
    html.push_str(&facts(&DEFINITIONS.map(|(name, meaning)| (name, meaning.to_owned()))));
    let origin = format!("{}, {}", provenance.program, provenance.created);
    page("Accuracy and repeatability with the definitions of ISO 9283:1998", &provenance.robot, &html, &origin)
}

/// What the figures mean.
const DEFINITIONS: [(&str, &str); 8] = [
    ("AP", "distance from the commanded point to the barycentre of the attained points"),
    ("RP", "mean distance from that barycentre plus three standard deviations of the distance"),
    ("AD", "mean distance between two poses, cycle by cycle, less the commanded distance"),
    ("RD", "plus and minus three standard deviations of that distance"),
    ("vAP", "largest distance between the barycentres of the directions of approach"),
    ("dAP", "largest change of AP of P1 since the first ten cycles, in blocks of ten"),
    ("corrected", "what is left when the identified arm corrects the commands"),
    ("in brackets", "95 % interval from a bootstrap over the cycles"),
];

/// The largest figure of each kind, which is what limits are compared with.
fn extremes(summary: &TestSummary) -> String {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).reduce(f64::max);
    let value = |accuracy: &AccuracyMm| accuracy.accuracy.value;
    let (poses, distances) = (&summary.poses, &summary.distances);
    let rows = [
        (
            "pose accuracy AP",
            largest(&mut poses.iter().map(|row| value(&row.nominal_mm))),
            largest(&mut poses.iter().filter_map(|row| row.identified_mm.as_ref().map(value))),
        ),
        ("pose repeatability RP", largest(&mut poses.iter().map(|row| row.repeatability_mm.value)), None),
        (
            "distance accuracy AD",
            largest(&mut distances.iter().map(|row| value(&row.nominal_mm))),
            largest(&mut distances.iter().filter_map(|row| row.identified_mm.as_ref().map(value))),
        ),
        ("distance repeatability RD", largest(&mut distances.iter().map(|row| row.repeatability_mm.value)), None),
    ];
    let of = |(name, before, after): (&str, Option<f64>, Option<f64>)| {
        let before = before?;
        let after = after.map_or_else(String::new, |after| format!(", corrected <b>{} mm</b>", number(after, 3)));
        Some(format!("<p>Largest {name}: <b>{} mm</b>{after}</p>\n", number(before, 3)))
    };
    let lines: String = rows.into_iter().filter_map(of).collect();
    format!("<div class=\"verdict\">\n{lines}</div>\n")
}

fn poses(summary: &TestSummary) -> String {
    let columns = [
        ("", Column::Word),
        ("cycles", Column::Number),
        ("AP (mm)", Column::Number),
        ("AP, corrected (mm)", Column::Number),
        ("RP (mm)", Column::Number),
    ];
    let row = |pose: &PoseRow| {
        vec![
            escape(&pose.pose),
            pose.cycles.to_string(),
            accuracy(Some(&pose.nominal_mm)),
            accuracy(pose.identified_mm.as_ref()),
            estimate(&pose.repeatability_mm),
        ]
    };
    table("", &columns, &summary.poses.iter().map(row).collect::<Vec<_>>(), true)
}

fn distances(summary: &TestSummary) -> String {
    let columns = [
        ("", Column::Word),
        ("commanded (mm)", Column::Number),
        ("AD (mm)", Column::Number),
        ("AD, corrected (mm)", Column::Number),
        ("RD (±mm)", Column::Number),
    ];
    let row = |distance: &DistanceRow| {
        vec![
            format!("{} to {}", escape(&distance.from), escape(&distance.to)),
            number(distance.commanded_mm, 3),
            accuracy(Some(&distance.nominal_mm)),
            accuracy(distance.identified_mm.as_ref()),
            estimate(&distance.repeatability_mm),
        ]
    };
    table("", &columns, &summary.distances.iter().map(row).collect::<Vec<_>>(), true)
}

/// Variation with the direction of approach, and drift.
fn variations(summary: &TestSummary) -> String {
    let direction = |row: &DirectionRow| {
        let name = format!("vAP of {}, {} directions", escape(&row.pose), row.directions);
        vec![name, number(row.variation_mm, 3)]
    };
    let mut rows: Vec<Vec<String>> = summary.directions.iter().map(direction).collect();
    rows.extend(summary.drift_mm.map(|drift| vec!["dAP of P1".to_owned(), number(drift, 3)]));
    if rows.is_empty() {
        return String::new();
    }
    let columns = [("", Column::Text), ("mm", Column::Number)];
    "<h2>Variation and drift</h2>\n".to_owned() + &table("", &columns, &rows, true)
}

fn accuracy(of: Option<&AccuracyMm>) -> String {
    of.map_or_else(|| NONE.to_owned(), |of| estimate(&of.accuracy))
}

fn estimate(of: &EstimateMm) -> String {
    format!("{} [{}, {}]", number(of.value, 3), number(of.low, 3), number(of.high, 3))
}
