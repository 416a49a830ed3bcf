//! Stops of the joint check, and its result for a session.

use nalgebra::Point3;

use super::ProcedureError;
use super::cell::{cell, planning_limits};
use crate::identification::joint_check::distinction;
use crate::kinematics::{ForwardKinematics, JointType};
use crate::planning::collision::{ArmShape, DEFAULT_CLEARANCE};
use crate::planning::{JointBox, low_discrepancy};
use crate::profile::Profile;
use crate::units::{DEGREE, MILLIMETRE};

/// Moves of turning joints to try (rad), the smallest first. A joint is moved farther if the reflector hardly moves with it.
const TURNS: [f64; 3] = [10.0 * DEGREE, 20.0 * DEGREE, 30.0 * DEGREE];
/// Move of a sliding joint (m).
const SLIDE: f64 = 30.0 * MILLIMETRE;
/// The reflector should move this far (m).
const WANTED: f64 = 10.0 * MILLIMETRE;
/// Number of configurations to begin with that are tried.
const TRIES: usize = 300;
/// Number of free ones among them that are compared.
const COMPARED: usize = 10;
/// Part of the range of a joint, around its middle, in which the check begins: an easy configuration.
const MIDDLE: f64 = 0.5;
/// Seed of the configurations.
const SEED: u64 = 1;

/// A stop of the check.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Joint that is moved to get there, from 0; `None` for the first stop.
    pub joint: Option<usize>,
    /// Pendant values (rad, sliding joints m).
    pub configuration: Vec<f64>,
}

/// Stops that move each joint once, the first joint first. The arm can go from each to the next, and faults are as easy to tell
/// from each other as in any of the configurations compared.
///
/// # Errors
/// The joints cannot be moved freely anywhere.
pub fn plan(profile: &Profile) -> Result<Vec<Stop>, ProcedureError> {
    let limits = planning_limits(profile)?;
    let cell = cell(profile, limits.clone(), None, true)?;
    let target = cell.target.position_in_flange;
    let shape = ArmShape::new(profile.chain(), &cell, DEFAULT_CLEARANCE)?;
    let middle = |(low, high): &(f64, f64)| {
        let (centre, half) = (f64::midpoint(*low, *high), MIDDLE * (high - low) / 2.0);
        (centre - half, centre + half)
    };
    let joint_box = JointBox::new(limits.iter().map(middle).collect())?;
    let mut best: Option<(f64, Vec<Stop>)> = None;
    let free = low_discrepancy(&joint_box, SEED)
        .take(TRIES)
        .filter_map(|base| stops(profile, &shape, base, target))
        .take(COMPARED);
    for stops in free {
        let configurations: Vec<_> = stops.iter().map(|stop| (stop.joint, stop.configuration.clone())).collect();
        let score = distinction(profile.chain(), &configurations, target);
        if best.as_ref().is_none_or(|(before, _)| score > *before) {
            best = Some((score, stops));
        }
    }
    best.map(|(_, stops)| stops).ok_or(ProcedureError::NoFreeMoves)
}

/// The stops from a configuration, if the arm can go there.
fn stops(profile: &Profile, shape: &ArmShape<'_>, base: Vec<f64>, target: Point3<f64>) -> Option<Vec<Stop>> {
    shape.check(&base).ok()?;
    let forward = ForwardKinematics::new(profile.chain());
    let mut stops = vec![Stop { joint: None, configuration: base }];
    for (joint, described) in profile.chain().joints().iter().enumerate() {
        let here = stops.last()?.configuration.clone();
        let from = forward.point_in_base(&here, &target);
        let sizes: &[f64] = if described.joint_type == JointType::Revolute { &TURNS } else { &[SLIDE] };
        let to = |size: &f64, way: f64| {
            let mut q = here.clone();
            *q.get_mut(joint)? += way * size;
            // Towards the middle if there is a choice.
            (shape.is_within_limits(&q) && shape.check_move(&here, &q).is_ok()).then_some(q)
        };
        let can_go = |size: &f64| to(size, 1.0).or_else(|| to(size, -1.0));
        let found: Vec<Vec<f64>> = sizes.iter().filter_map(can_go).collect();
        let is_seen = |q: &&Vec<f64>| (forward.point_in_base(q, &target) - from).norm() >= WANTED;
        let configuration = found.iter().find(is_seen).or_else(|| found.last())?.clone();
        stops.push(Stop { joint: Some(joint), configuration });
    }
    Some(stops)
}
