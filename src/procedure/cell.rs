//! The cell of a profile in the form that planning takes.

use super::ProcedureError;
use crate::planning::{Body, BoxInBase, Cell, KeepOutBox, MountedTarget, TrackerStand};
use crate::profile::Profile;

/// The joint ranges (rad, sliding joints m) for plans, as the profile states them.
///
/// # Errors
/// A joint without limits.
pub fn planning_limits(profile: &Profile) -> Result<Vec<(f64, f64)>, ProcedureError> {
    let joints = profile.chain().joints().iter().zip(profile.joints());
    joints
        .map(|(joint, range)| {
            range.planning_limits.or(range.limits).ok_or_else(|| ProcedureError::NoLimits {
                joint: joint.name.clone(),
                profile: profile.name().to_owned(),
            })
        })
        .collect()
}

/// The cell of a profile with these joint limits; without filters an empty one.
pub(crate) fn cell(
    profile: &Profile,
    limits: Vec<(f64, f64)>,
    region: Option<BoxInBase>,
    filters: bool,
) -> Result<Cell, ProcedureError> {
    let target = profile.targets().first().ok_or(ProcedureError::NoTarget)?;
    let target = MountedTarget { position_in_flange: target.position_in_flange, axis_in_flange: target.axis_in_flange };
    if !filters {
        return Ok(Cell {
            limits,
            bodies: Vec::new(),
            floor: None,
            keep_out: Vec::new(),
            tracker: None,
            target,
            region,
        });
    }
    let body =
        |body: &crate::profile::Capsule| Body { link: body.link, from: body.from, to: body.to, radius: body.radius };
    let zone = |zone: &crate::profile::KeepOut| KeepOutBox {
        name: zone.name.clone(),
        space: BoxInBase { min: zone.min, max: zone.max },
    };
    let tracker = profile.tracker();
    Ok(Cell {
        limits,
        bodies: profile.bodies().iter().map(body).collect(),
        floor: profile.floor(),
        keep_out: profile.keep_out().iter().map(zone).collect(),
        tracker: Some(TrackerStand {
            position_in_base: tracker.position_in_base,
            acceptance_angle: tracker.acceptance_angle,
            range: tracker.range,
        }),
        target,
        region,
    })
}
