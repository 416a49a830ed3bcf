//! Configurations for a circle-point analysis, in which the last two joints can turn far without touching anything.

use nalgebra::DMatrix;

use super::ProcedureError;
use super::cell::{cell, planning_limits};
use crate::identification::circle_point::{circle_plan, fit_circle};
use crate::kinematics::{ForwardKinematics, JointType};
use crate::planning::collision::{ArmShape, DEFAULT_CLEARANCE};
use crate::planning::{JointBox, low_discrepancy};
use crate::profile::Profile;
use crate::units::DEGREE;

/// Number of points per circle.
const POINTS: usize = 8;
/// Arcs to try (rad), the widest first: the wider the arc, the better the centre of its circle is known.
const ARCS: [f64; 4] = [300.0 * DEGREE, 200.0 * DEGREE, 120.0 * DEGREE, 80.0 * DEGREE];
/// Number of base configurations to try for each arc.
const TRIES: usize = 500;
/// Seed of the base configurations.
const SEED: u64 = 1;

/// A joint with the configurations that turn it.
pub type Circle = (usize, Vec<Vec<f64>>);

/// Configurations per joint: the last joint, then the one before it. The arm can go from each to the next.
///
/// # Errors
/// The arm cannot turn its last two joints freely anywhere, or they do not turn at all.
pub fn plan(profile: &Profile) -> Result<Vec<Circle>, ProcedureError> {
    let limits = planning_limits(profile)?;
    let cell = cell(profile, limits.clone(), None, true)?;
    let shape = ArmShape::new(profile.chain(), &cell, DEFAULT_CLEARANCE)?;
    let joints = profile.chain().dof();
    let turned = [joints.saturating_sub(1), joints.saturating_sub(2)];
    let joint_box = JointBox::new(limits.clone())?;
    // The middle of the limits first: measuring is easiest there.
    let middle: Vec<f64> = limits.iter().map(|(low, high)| f64::midpoint(*low, *high)).collect();
    let bases = || std::iter::once(middle.clone()).chain(low_discrepancy(&joint_box, SEED).take(TRIES));
    for (arc, base) in ARCS.into_iter().flat_map(|arc| bases().map(move |base| (arc, base))) {
        let around: Vec<(f64, f64)> = limits
            .iter()
            .zip(&base)
            .map(|((low, high), at)| (low.max(at - arc / 2.0), high.min(at + arc / 2.0)))
            .collect();
        let circle =
            |joint: usize| circle_plan(profile.chain(), &around, joint, &base, POINTS).map(|plan| (joint, plan));
        let circles = turned.iter().map(|joint| circle(*joint)).collect::<Result<Vec<_>, _>>()?;
        let visited: Vec<&Vec<f64>> = circles.iter().flat_map(|(_, plan)| plan).collect();
        let is_free = visited.iter().all(|q| shape.check(q).is_ok())
            && visited.windows(2).all(|pair| shape.check_move(pair[0], pair[1]).is_ok());
        if is_free {
            check_offset(profile, &circles)?;
            return Ok(circles);
        }
    }
    Err(ProcedureError::NoFreeCircles)
}

/// Arcs for each joint of the whole arm (rad): half of it to either side.
const WHOLE_ARCS: [f64; 5] = [150.0 * DEGREE, 120.0 * DEGREE, 90.0 * DEGREE, 70.0 * DEGREE, 50.0 * DEGREE];
/// Slides of joints that slide, as a part of an arc of one radian (m).
const SLIDE: f64 = 0.1;

/// Configurations that move each joint in turn, from the base to the flange, with all others at one place: for the constants of the
/// whole arm. The arm can go from each to the next.
///
/// # Errors
/// The arm cannot move all its joints far enough anywhere in its cell, or one of them draws no circle.
pub fn plan_whole(profile: &Profile) -> Result<Vec<Circle>, ProcedureError> {
    let limits = planning_limits(profile)?;
    let cell = cell(profile, limits.clone(), None, true)?;
    let shape = ArmShape::new(profile.chain(), &cell, DEFAULT_CLEARANCE)?;
    let joint_box = JointBox::new(limits.clone())?;
    let middle: Vec<f64> = limits.iter().map(|(low, high)| f64::midpoint(*low, *high)).collect();
    let bases = || std::iter::once(middle.clone()).chain(low_discrepancy(&joint_box, SEED).take(TRIES));
    let moves = alone(profile);
    let mut no_circle = None;
    for (arc, base) in WHOLE_ARCS.into_iter().flat_map(|arc| bases().map(move |base| (arc, base))) {
        let circles: Vec<Circle> =
            moves.iter().enumerate().map(|(joint, alone)| (joint, moved(profile, joint, alone, &base, arc))).collect();
        let visited: Vec<&Vec<f64>> = circles.iter().flat_map(|(_, plan)| plan).collect();
        let is_within = |q: &[f64]| q.iter().zip(&limits).all(|(value, (low, high))| (*low..=*high).contains(value));
        let is_free = visited.iter().all(|q| is_within(q) && shape.check(q).is_ok())
            && visited.windows(2).all(|pair| shape.check_move(pair[0], pair[1]).is_ok());
        if !is_free {
            continue;
        }
        let turning: Vec<Circle> = circles
            .iter()
            .filter(|(joint, _)| {
                profile.chain().joints().get(*joint).is_some_and(|joint| joint.joint_type == JointType::Revolute)
            })
            .cloned()
            .collect();
        match check_offset(profile, &turning) {
            Ok(()) => return Ok(circles),
            Err(error) => drop(no_circle.get_or_insert(error)),
        }
    }
    Err(no_circle.unwrap_or(ProcedureError::NoFreeCircles))
}

/// Per joint, the change of the pendant values that moves this joint alone by one: elsewhere than on coupled arms, itself.
fn alone(profile: &Profile) -> Vec<Vec<f64>> {
    let joints = profile.chain().joints();
    let by_pendant = DMatrix::from_fn(joints.len(), joints.len(), |joint, other| {
        joints.get(joint).map_or(0.0, |one| one.variable_by_pendant(joint, other))
    });
    let inverse = by_pendant.try_inverse().unwrap_or_else(|| DMatrix::identity(joints.len(), joints.len()));
    inverse.column_iter().map(|column| column.iter().copied().collect()).collect()
}

/// Configurations that move one joint about its place in `base`.
fn moved(profile: &Profile, joint: usize, alone: &[f64], base: &[f64], arc: f64) -> Vec<Vec<f64>> {
    let slides = profile.chain().joints().get(joint).is_some_and(|joint| joint.joint_type == JointType::Prismatic);
    let reach = if slides { SLIDE * arc } else { arc };
    (0..POINTS)
        .map(|point| {
            let part = point as f64 / (POINTS - 1) as f64 - 0.5;
            base.iter().zip(alone).map(|(value, change)| value + part * reach * change).collect()
        })
        .collect()
}

/// Checks before anything is measured that the SMR is beside the turned axes: on an axis it draws no circle.
fn check_offset(profile: &Profile, circles: &[Circle]) -> Result<(), ProcedureError> {
    let Some(target) = profile.targets().first() else { return Ok(()) };
    let kinematics = ForwardKinematics::new(profile.chain());
    for (joint, plan) in circles {
        let points: Vec<_> = plan.iter().map(|q| kinematics.point_in_base(q, &target.position_in_flange)).collect();
        if let Err(source) = fit_circle(&points, None) {
            let joint = profile.chain().joints().get(*joint).map_or("?", |joint| joint.name.as_str()).to_owned();
            return Err(ProcedureError::NoCircle { joint, source });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::builtin;

    #[test]
    fn the_last_two_joints_are_turned_and_nothing_else() {
        for name in ["soochow"] {
            let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
            let joints = profile.chain().dof();
            let circles = plan(&profile).unwrap();
            assert_eq!(circles.iter().map(|(joint, _)| *joint).collect::<Vec<_>>(), [joints - 1, joints - 2], "{name}");
            for (joint, plan) in &circles {
                assert_eq!(plan.len(), POINTS);
                let still = (0..joints).filter(|other| other != joint);
                for other in still {
                    assert!(plan.iter().all(|q| (q[other] - plan[0][other]).abs() < 1e-12), "{name}: {other}");
                }
            }
        }
    }

    #[test]
    fn an_smr_on_the_axis_is_known_before_it_is_measured() {
        for name in ["franka_panda", "ur5"] {
            let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
            let error = plan(&profile).unwrap_err();
            assert!(matches!(error, ProcedureError::NoCircle { .. }), "{error}");
            // Beside the axis it can be found.
            let target = &profile.targets()[0];
            let mut beside = target.clone();
            beside.position_in_flange.x += 0.03;
            assert!(plan(&profile.with_target(0, beside)).is_ok(), "{name}");
        }
    }

    #[test]
    fn parallel_last_axes_have_no_circles_to_offer() {
        let (profile, _) = Profile::parse(builtin("epson_ls3_b401s").unwrap(), "scara").unwrap();
        assert!(plan(&profile).is_err());
    }
}
