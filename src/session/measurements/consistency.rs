//! What rows say about each other: one pose in two configurations, copies, stale readings.

use std::collections::BTreeMap;

use super::Row;
use crate::kinematics::JointType;
use crate::session::table::{Defect, TableProblem};
use crate::units::Quantity;

/// Joint values of one pose may differ by this much, encoder readings at the same pose do (rad). A swapped row or a
/// mistyped pose differs by far more.
const SAME_POSE_ANGLE: f64 = 1e-3;
/// The same for a sliding joint (m).
const SAME_POSE_LENGTH: f64 = 1e-3;

/// Reports poses with two configurations in `problems`, copies and stale readings in `warnings`. Returns the places of
/// the copies, ascending.
pub(super) fn check(
    rows: &[Row],
    joints: &[JointType],
    problems: &mut Vec<TableProblem>,
    warnings: &mut Vec<TableProblem>,
) -> Vec<usize> {
    let mut poses: BTreeMap<(&str, Option<&str>), &Row> = BTreeMap::new();
    let mut points: BTreeMap<[u64; 3], &Row> = BTreeMap::new();
    let mut readings: BTreeMap<(Vec<u64>, Option<&str>), &Row> = BTreeMap::new();
    let mut duplicates = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let target = row.target.as_deref();
        let first = *poses.entry((&row.pose, target)).or_insert(row);
        problems.extend(other_configuration(first, row, joints));

        let point: [u64; 3] = row.point.coords.map(digits).into();
        let first = *points.entry(point).or_insert(row);
        if first.line == row.line {
            continue;
        }
        // Only rows that share their point are compared as a whole: in a sound table that is none.
        readings.entry(reading(first)).or_insert(first);
        let copied = *readings.entry(reading(row)).or_insert(row);
        if copied.line != row.line {
            duplicates.push(index);
            warnings.push(Defect::Repeats { first_line: copied.line }.at(row.line));
        } else if first.target != row.target
            || farthest_joint(&first.configuration, &row.configuration, joints).is_some()
        {
            let other_target = first.target != row.target;
            warnings.push(Defect::StalePoint { first_line: first.line, other_target }.at(row.line));
        }
    }
    duplicates
}

/// What makes two rows copies of each other: point, joint values, target.
fn reading(row: &Row) -> (Vec<u64>, Option<&str>) {
    let values = row.point.iter().chain(&row.configuration);
    (values.map(|&value| digits(value)).collect(), row.target.as_deref())
}

fn other_configuration(first: &Row, row: &Row, joints: &[JointType]) -> Option<TableProblem> {
    let (joint, quantity, before, here) = farthest_joint(&first.configuration, &row.configuration, joints)?;
    let defect = Defect::OtherConfiguration {
        pose: row.pose.clone(),
        target: row.target.clone(),
        first_line: first.line,
        joint: joint + 1,
        first: rounded(quantity.to_edge(before)),
        here: rounded(quantity.to_edge(here)),
        unit: quantity.unit(),
    };
    Some(defect.at(row.line))
}

/// The joint that differs most, in units of what is tolerated, if any differs by more: place, quantity, both values.
pub(in crate::session) fn farthest_joint(
    first: &[f64],
    here: &[f64],
    joints: &[JointType],
) -> Option<(usize, Quantity, f64, f64)> {
    let pairs = first.iter().zip(here).zip(joints).enumerate();
    let excess = pairs.map(|(index, ((&before, &here), joint))| {
        let tolerance = match joint.quantity() {
            Quantity::Angle => SAME_POSE_ANGLE,
            Quantity::Length => SAME_POSE_LENGTH,
        };
        ((before - here).abs() / tolerance, (index, joint.quantity(), before, here))
    });
    excess.filter(|(excess, _)| *excess > 1.0).max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, joint)| joint)
}

/// Bits of a value, the same for both zeros.
fn digits(value: f64) -> u64 {
    (value + 0.0).to_bits()
}

/// Three decimals: enough to tell two configurations apart.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
