//! Measurement tables as text.

use super::names::{Name, Place};
use super::{Measurements, Row, joint_names};
use crate::kinematics::JointType;
use crate::session::orientation::is_column;
use crate::text::{decimal, printable};
use crate::units::{Quantity, to_mm};

/// Decimals of an angle in degrees: 0.02 nrad.
const ANGLE_DECIMALS: usize = 9;
/// Decimals of a length in millimetres: 1 nm.
const LENGTH_DECIMALS: usize = 6;

/// A table that [`read`](super::read) reads back: joints in degrees with nine decimals (sliding joints in mm), points and
/// σ in mm with six. The columns `target`, `sigma_mm` and `temperature_degc` stand there when a row has them.
/// [`Row::fields`] are not written: they belong to the file they were read from. Control characters in names are replaced.
pub fn write(rows: &[Row], joints: &[JointType]) -> String {
    let has_target = rows.iter().any(|row| row.target.is_some());
    let has_sigma = rows.iter().any(|row| row.sigma.is_some());
    let has_temperature = rows.iter().any(|row| row.temperature.is_some());

    let mut names = vec!["pose".to_owned()];
    names.extend(has_target.then(|| "target".to_owned()));
    names.extend(joint_names("", joints));
    names.extend(["x_mm", "y_mm", "z_mm"].map(str::to_owned));
    names.extend(has_sigma.then(|| "sigma_mm".to_owned()));
    names.extend(has_temperature.then(|| "temperature_degc".to_owned()));

    let mut text = names.join(",");
    text.push('\n');
    for row in rows {
        let mut cells = vec![quoted(&row.pose)];
        if has_target {
            cells.push(row.target.as_deref().map_or_else(String::new, quoted));
        }
        cells.extend(joint_cells(&row.configuration, joints));
        cells.extend(row.point.iter().map(|&coordinate| decimal(to_mm(coordinate), LENGTH_DECIMALS)));
        if has_sigma {
            cells.push(row.sigma.map_or_else(String::new, |sigma| decimal(to_mm(sigma), LENGTH_DECIMALS)));
        }
        if has_temperature {
            cells.push(row.temperature.map_or_else(String::new, |temperature| temperature.to_string()));
        }
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// The rows of a table without copies, as [`write()`] does, with the columns that are text for filters.
pub fn write_with_text(table: &Measurements, joints: &[JointType]) -> String {
    let rows: Vec<Row> = table.distinct_rows().cloned().collect();
    // A name that could be taken for a joint, a point or a tool would be a second one in the written table.
    let is_text = |name: &&String| {
        let name = Name::new(name, false);
        !name.is_of_tool() && matches!(name.place(), None | Some(Place::Time))
    };
    let is_ours = |name: &&String| name.starts_with("sigma") || name.starts_with("temperature");
    // The points carry the orientation already.
    let is_used = table.understood.orientation.is_some() && !table.understood.lacks_orientation_error;
    let is_turn = |name: &&String| is_used && is_column(&name.to_lowercase());
    let kept: Vec<usize> = (0..table.columns.len())
        .filter(|index| {
            table.columns.get(*index).is_some_and(|name| is_text(&name) && !is_ours(&name) && !is_turn(&name))
        })
        .collect();
    if kept.is_empty() {
        return write(&rows, joints);
    }
    let picked = |cells: &[String]| -> String {
        let cells: Vec<String> =
            kept.iter().map(|index| cells.get(*index).map_or_else(String::new, |cell| quoted(cell))).collect();
        format!(",{}", cells.join(","))
    };
    let text = write(&rows, joints);
    let mut lines = text.lines();
    let mut whole = format!("{}{}\n", lines.next().unwrap_or_default(), picked(&table.columns));
    for (line, row) in lines.zip(&rows) {
        whole.push_str(line);
        whole.push_str(&picked(&row.fields));
        whole.push('\n');
    }
    whole
}

/// Joint values in degrees, sliding joints in mm.
pub(in crate::session) fn joint_cells(configuration: &[f64], joints: &[JointType]) -> impl Iterator<Item = String> {
    configuration.iter().zip(joints).map(|(&value, joint)| {
        let quantity = joint.quantity();
        let decimals = match quantity {
            Quantity::Angle => ANGLE_DECIMALS,
            Quantity::Length => LENGTH_DECIMALS,
        };
        decimal(quantity.to_edge(value), decimals)
    })
}

/// A cell in quotation marks where the text could be taken for something else.
pub(in crate::session) fn quoted(text: &str) -> String {
    let text = printable(text);
    if text.starts_with('#') || text.contains([',', ';', '"']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text
    }
}
