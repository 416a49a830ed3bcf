//! Annex: the words of ISO 9283, for those who must fill in a form.

use super::markup::{Column, paragraph, table};
use super::verdict::figure;
use crate::report::document::Document;
use crate::session::summary::StatisticsSummary;
use crate::text::counted;

/// What the standard asks for and this report cannot say.
const NOT_MEASURED: [(&str, &str); 7] = [
    ("Pose repeatability, RP", "30 approaches of the same pose are needed; here each pose was approached once"),
    ("Multi-directional pose accuracy variation, vAP", "needs approaches from three directions"),
    ("Distance repeatability, RD", "needs the same two poses 30 times"),
    ("Orientation accuracy (a, b, c of AP)", "a reflector is a point: it says nothing about orientation"),
    (
        "Drift of pose characteristics, dAP and dRP",
        "needs 8 hours of cycles; the repeated pose above shows the set-up only",
    ),
    ("Path accuracy and repeatability, AT and RT", "nothing was measured in motion"),
    ("Pose stabilization time, overshoot, static compliance", "not measured"),
];

/// The annex; empty before a verification.
pub(super) fn section(document: &Document) -> String {
    let Some(verification) = document.result.as_ref().and_then(|result| result.verification.as_ref()) else {
        return String::new();
    };
    let figures = |statistics: StatisticsSummary| {
        let [mean, _, _, max] = statistics.figures();
        format!("mean {} mm, largest {} mm", figure(mean), figure(max))
    };
    let nearest = |name: &str, statistics: Option<StatisticsSummary>, what: &str| {
        let statistics = statistics?;
        let over =
            format!("nearest figure here: {what} of the identified arm over {}", counted(statistics.count, "value"));
        Some(vec![name.to_owned(), format!("{}; {over}", figures(statistics))])
    };
    let found = &verification.identified;
    let mut rows: Vec<Vec<String>> = [
        nearest("Position accuracy, AP", found.position_mm, "position error after the fit of the set-up"),
        nearest("Distance accuracy, AD", found.distance_mm, "error of distances between different poses"),
    ]
    .into_iter()
    .flatten()
    .collect();
    rows.extend(NOT_MEASURED.iter().map(|(name, why)| vec![(*name).to_owned(), format!("not measured: {why}")]));
    let columns = [("ISO 9283", Column::Text), ("this calibration", Column::Text)];
    let intro = "This is a calibration, not a test after ISO 9283: no test cube, no 30 cycles, no rated load were asked for. For a form that uses the words of the standard, this is what may be written. <code>trupose iso9283</code> plans and evaluates the test itself.";
    format!("<h2>Annex: in the words of ISO 9283</h2>\n{}{}", paragraph(intro), table("", &columns, &rows, false))
}
