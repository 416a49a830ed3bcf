//! Which rows of a table move which joint.

use super::super::STILL;
use super::{Template, WholeArmError};
use crate::kinematics::JointType;
use crate::text::listed;

/// The rows in which one joint moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Series {
    pub(super) joint: usize,
    /// First row and the one after the last.
    pub(super) rows: (usize, usize),
}

impl Series {
    /// The part of all rows that belongs to it.
    pub(super) fn of<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        all.get(self.rows.0..self.rows.1).unwrap_or_default()
    }
}

/// Whether a joint has moved between two configurations.
fn has_moved(joint_type: JointType, from: f64, to: f64) -> bool {
    let tolerance = match joint_type {
        JointType::Revolute => STILL.0,
        JointType::Prismatic => STILL.1,
    };
    (from - to).abs() > tolerance
}

/// Joints that differ between two rows.
fn moved(template: &Template, from: &[f64], to: &[f64]) -> Vec<usize> {
    let pairs = from.iter().zip(to).enumerate();
    pairs.filter(|(joint, (a, b))| has_moved(template.joint_type(*joint), **a, **b)).map(|(joint, _)| joint).collect()
}

/// Splits the rows into series, one per joint, from the base to the flange.
pub(super) fn series(template: &Template, variables: &[Vec<f64>]) -> Result<Vec<Series>, WholeArmError> {
    let mut found: Vec<Series> = Vec::new();
    let mut start = 0;
    while start < variables.len() {
        let mut joint = None;
        let mut end = start + 1;
        while let (Some(first), Some(row)) = (variables.get(start), variables.get(end)) {
            match (moved(template, first, row).as_slice(), joint) {
                ([], _) => {}
                ([one], None) => joint = Some(*one),
                ([one], Some(same)) if *one == same => {}
                (several, None) => {
                    let names: Vec<String> = several.iter().map(|joint| template.name(*joint)).collect();
                    return Err(WholeArmError::Together { row: end + 1, joints: listed(&names) });
                }
                (_, Some(_)) => break,
            }
            end += 1;
        }
        let joint = joint.ok_or(WholeArmError::NothingMoves { row: start + 1 })?;
        if let Some(other) = found.iter().find(|other| other.joint == joint) {
            let (first, second) = (other.rows.0 + 1, start + 1);
            return Err(WholeArmError::Twice { joint: template.name(joint), first, second });
        }
        found.push(Series { joint, rows: (start, end) });
        start = end;
    }
    found.sort_by_key(|series| series.joint);
    match (0..template.chain.dof()).find(|joint| found.iter().all(|series| series.joint != *joint)) {
        Some(joint) => Err(WholeArmError::Missing { joint: template.name(joint) }),
        None => Ok(found),
    }
}

/// The common value of each joint while those after it move. The last one needs none.
pub(super) fn reference(
    template: &Template,
    variables: &[Vec<f64>],
    series: &[Series],
) -> Result<Vec<f64>, WholeArmError> {
    let first_row = |series: &Series| series.of(variables).first().cloned().unwrap_or_default();
    let Some(last) = series.last() else { return Ok(Vec::new()) };
    let reference = first_row(last);
    for one in series {
        let own = first_row(one);
        if let Some(moved) = moved(template, &reference, &own).into_iter().find(|joint| *joint < one.joint) {
            let (moved, series) = (template.name(moved), template.name(one.joint));
            return Err(WholeArmError::NotReturned { moved, series, last: template.name(last.joint) });
        }
    }
    Ok(reference)
}
