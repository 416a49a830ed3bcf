//! Measurement tables as text.

use super::{Row, joint_names};
use crate::kinematics::JointType;
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
