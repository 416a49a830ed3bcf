//! The cell of a profile as planning sees it.

use nalgebra::Point3;

use crate::cli::{BoxMm, JointLimit, PlanArgs};
use crate::error::{ExitStatus, Failure};
use crate::planning::order::Pace;
use crate::planning::{Body, BoxInBase, Cell, KeepOutBox, MountedTarget, TrackerStand};
use crate::profile::Profile;
use crate::units::from_mm;

/// The planning limits of a profile (rad or m), narrowed by the operator.
pub(super) fn limits(profile: &Profile, narrowed: &[JointLimit]) -> Result<Vec<(f64, f64)>, Failure> {
    let joints = profile.chain().joints();
    let mut limits = Vec::with_capacity(joints.len());
    for (joint, range) in joints.iter().zip(profile.joints()) {
        limits.push(range.planning_limits.or(range.limits).ok_or_else(|| {
            Failure::new(
                ExitStatus::Usage,
                format!("joint '{}' has no limits in profile '{}'", joint.name, profile.name()),
            )
            .hint("poses are drawn from the joint ranges: give 'limits_deg' (or 'limits_mm') in the profile")
        })?);
    }
    for JointLimit { joint: name, low, high } in narrowed {
        let by_number = |number: usize| (1..=joints.len()).contains(&number).then(|| number - 1);
        let index = joints
            .iter()
            .position(|joint| joint.name.eq_ignore_ascii_case(name))
            .or_else(|| name.to_lowercase().strip_prefix('j')?.parse().ok().and_then(by_number))
            .ok_or_else(|| {
                let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
                Failure::new(ExitStatus::Usage, format!("the robot has no joint '{name}'")).hint(format!(
                    "joints of '{}': {}",
                    profile.name(),
                    names.join(", ")
                ))
            })?;
        let quantity = joints[index].joint_type.quantity();
        let (known, narrow) = (limits[index], (quantity.from_edge(*low), quantity.from_edge(*high)));
        let common = (known.0.max(narrow.0), known.1.min(narrow.1));
        if common.0 >= common.1 {
            let edge = |value: f64| quantity.to_edge(value);
            return Err(Failure::new(
                ExitStatus::Usage,
                format!(
                    "'--limit {name}={low}..{high}' leaves nothing of the range {:.1}..{:.1} {} of the profile",
                    edge(known.0),
                    edge(known.1),
                    quantity.unit()
                ),
            ));
        }
        limits[index] = common;
    }
    Ok(limits)
}

/// The cell of a profile with these joint limits; without filters an empty one.
pub(super) fn cell(
    profile: &Profile,
    limits: Vec<(f64, f64)>,
    region: Option<&BoxMm>,
    no_filters: bool,
) -> Result<Cell, Failure> {
    let target =
        profile.targets().first().ok_or_else(|| Failure::new(ExitStatus::Usage, "the profile has no target"))?;
    let target = MountedTarget { position_in_flange: target.position_in_flange, axis_in_flange: target.axis_in_flange };
    let region = region.map(box_in_base);
    if no_filters {
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

fn box_in_base(space: &BoxMm) -> BoxInBase {
    let [x, y, z] = space.ranges;
    BoxInBase {
        min: Point3::new(from_mm(x.0), from_mm(y.0), from_mm(z.0)),
        max: Point3::new(from_mm(x.1), from_mm(y.1), from_mm(z.1)),
    }
}

/// How fast the program will be.
pub(super) fn pace(profile: &Profile, args: &PlanArgs) -> Pace {
    Pace {
        max_speeds: profile.joints().iter().map(|joint| joint.max_speed).collect(),
        speed: args.speed_percent / 100.0,
        settle: args.settle_s,
        shots: args.shots,
        ..Pace::default()
    }
}
