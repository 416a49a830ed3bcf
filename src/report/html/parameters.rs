//! The parameters with their uncertainty, and what the data cannot determine.

use super::markup::{Column, aligned, escape, list, number, paragraph, table};
use crate::kinematics::ParameterId;
use crate::report::document::{Document, Found};
use crate::session::summary::{IdentificationSummary, ParameterSummary};
use crate::text::counted;
use crate::text::decimals_for;

/// Decimals where there is no standard deviation.
const PLAIN: usize = 4;

/// The section; empty before the first identification.
pub(super) fn section(document: &Document) -> String {
    let Some(result) = &document.result else { return String::new() };
    let mut html = String::from("<h2>Identified parameters</h2>\n");
    let rank = result.rank.map_or_else(|| "an unclear number".to_owned(), |rank| rank.to_string());
    html.push_str(&paragraph(&format!(
        "{} (level {}), of which the data determine {rank} independent combinations. Sigma is one standard deviation of the deviation. <b>Found:</b> <i>yes</i>; <i>weakly</i>: sigma is more than half of the expected deviation; <i>only combined</i>: not on its own, see below.",
        counted(result.constants().count(), "parameter"),
        result.settings.level
    )));
    if !result.joint_errors.is_empty() {
        html.push_str(&paragraph("These constants belong together with the errors of the joints above, and are wrong without them. Programs that know only link constants need others, identified without errors of joints: <code>dh.csv</code>, or <code>trupose export</code>."));
    }
    html.push_str(&parameter_table(document, &result.parameters));
    html.push_str(&blind(result));
    html
}

fn parameter_table(document: &Document, parameters: &[ParameterSummary]) -> String {
    let decimals = |parameter: &ParameterSummary| parameter.sigma.map_or(PLAIN, decimals_for);
    let constants = || parameters.iter().enumerate().filter(|(_, parameter)| !parameter.id.is_joint_error());
    let most = constants().map(|(_, parameter)| decimals(parameter)).max().unwrap_or(PLAIN).max(PLAIN);
    let columns = [
        ("parameter", Column::Word),
        ("what it is", Column::Word),
        ("unit", Column::Word),
        ("nominal", Column::Number),
        ("deviation", Column::Number),
        ("sigma", Column::Number),
        ("identified", Column::Number),
        ("found", Column::Word),
    ];
    let rows: Vec<Vec<String>> = constants()
        .map(|(index, parameter)| {
            let digits = decimals(parameter);
            let note = document.report.parameter_notes.get(index);
            let group = group_of(document, parameter.id).map_or_else(String::new, |group| format!(" ({group})"));
            let found = note.map_or("", |note| note.found.words());
            let found = if note.is_some_and(|note| note.found == Found::Yes) {
                found.to_owned()
            } else {
                format!("<i>{found}</i>{group}")
            };
            vec![
                escape(&parameter.id.to_string()),
                note.map_or_else(String::new, |note| escape(&note.meaning)),
                escape(parameter.unit.name()),
                aligned(Some(parameter.nominal), PLAIN, most),
                aligned(Some(parameter.deviation), digits, most),
                aligned(parameter.sigma, digits, most),
                aligned(Some(parameter.nominal + parameter.deviation), digits, most),
                found,
            ]
        })
        .collect();
    table("", &columns, &rows, false)
}

/// Number, from 1, of the group of parameters that are only known together.
fn group_of(document: &Document, id: ParameterId) -> Option<usize> {
    let groups = &document.result.as_ref()?.blind_groups;
    groups.iter().position(|group| group.parameters.contains(&id)).map(|index| index + 1)
}

fn blind(result: &IdentificationSummary) -> String {
    let mut html = String::new();
    if !result.blind_groups.is_empty() {
        html.push_str("<h3>What these data cannot tell</h3>\n");
        html.push_str(&paragraph(
            "The parameters of a group are correct together, not one by one: apply all of a group, or none.",
        ));
        let groups = result.blind_groups.iter().enumerate();
        let groups: Vec<String> =
            groups.map(|(index, group)| format!("({}) {}", index + 1, escape(&group.description))).collect();
        html.push_str(&list(&groups));
    }
    if !result.correlations.is_empty() {
        html.push_str("<h3>Strongly correlated parameters</h3>\n");
        let pairs: Vec<String> = result
            .correlations
            .iter()
            .map(|pair| {
                let [one, other] = &pair.parameters;
                let sign = if pair.correlation > 0.0 { "+" } else { "" };
                format!(
                    "{} and {}: {sign}{}",
                    escape(&one.to_string()),
                    escape(&other.to_string()),
                    number(pair.correlation, 2)
                )
            })
            .collect();
        html.push_str(&list(&pairs));
    }
    html
}
