//! Collisions of a list of poses, and of the moves between them, as the bodies of a profile predict them.

use std::f64::consts::PI;

use super::ProcedureError;
use super::cell::cell;
use crate::kinematics::{Joint, JointType};
use crate::planning::collision::ArmShape;
use crate::profile::Profile;
use crate::session::plan::PlannedPose;

/// Collisions that are named; of more, only the number is given.
const NAMED: usize = 5;

/// The first few collisions in words, and the number of all others last. Nothing without bodies.
///
/// # Errors
/// The profile describes no cell.
pub fn dangers(profile: &Profile, rows: &[PlannedPose]) -> Result<Vec<String>, ProcedureError> {
    if profile.bodies().is_empty() {
        return Ok(Vec::new());
    }
    let wide = |joint: &Joint, limits: Option<(f64, f64)>| {
        limits.unwrap_or(match joint.joint_type {
            JointType::Revolute => (-2.0 * PI, 2.0 * PI),
            JointType::Prismatic => (-10.0, 10.0),
        })
    };
    let joints = profile.chain().joints().iter().zip(profile.joints());
    let limits = joints.map(|(joint, range)| wide(joint, range.limits)).collect();
    let cell = cell(profile, limits, None, true)?;
    let shape = ArmShape::new(profile.chain(), &cell, 0.0)?;
    let poses = rows.iter().filter_map(|row| {
        let obstruction = shape.check(&row.configuration).err()?;
        Some(format!("in pose {} {obstruction}", row.pose))
    });
    let moves = rows.windows(2).filter_map(|pair| {
        let [from, to] = pair else { return None };
        let obstruction = shape.check_move(&from.configuration, &to.configuration).err()?;
        Some(format!("on the way from {} to {} {obstruction}", from.pose, to.pose))
    });
    let mut found: Vec<String> = poses.chain(moves).collect();
    let more = found.len().saturating_sub(NAMED);
    found.truncate(NAMED);
    if more > 0 {
        found.push(format!("and {more} more"));
    }
    Ok(found)
}
