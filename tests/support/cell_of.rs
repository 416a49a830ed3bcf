//! The whole cell of a shipped profile, without a region of interest.

use trupose::planning::{Body, BoxInBase, Cell, KeepOutBox, MountedTarget, TrackerStand};
use trupose::profile::Profile;

pub(crate) fn cell(profile: &Profile) -> Cell {
    let target = &profile.targets()[0];
    let tracker = profile.tracker();
    Cell {
        limits: profile.joints().iter().map(|joint| joint.planning_limits.unwrap()).collect(),
        bodies: profile
            .bodies()
            .iter()
            .map(|body| Body { link: body.link, from: body.from, to: body.to, radius: body.radius })
            .collect(),
        floor: profile.floor(),
        keep_out: profile
            .keep_out()
            .iter()
            .map(|zone| KeepOutBox { name: zone.name.clone(), space: BoxInBase { min: zone.min, max: zone.max } })
            .collect(),
        tracker: Some(TrackerStand {
            position_in_base: tracker.position_in_base,
            acceptance_angle: tracker.acceptance_angle,
            range: tracker.range,
        }),
        target: MountedTarget { position_in_flange: target.position_in_flange, axis_in_flange: target.axis_in_flange },
        region: None,
    }
}
