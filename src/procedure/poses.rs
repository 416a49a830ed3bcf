//! Patterns of poses whose figures do not carry over to other poses, although every joint covers its range.

use nalgebra::Matrix6;

use super::workspace::ranges;
use crate::kinematics::{ForwardKinematics, Joint};
use crate::planning::{JointBox, random};
use crate::profile::Profile;
use crate::report::number;
use crate::session::summary::{Warning, WarningCode};

/// Fewer poses are no pattern.
const FEWEST_POSES: usize = 5;
/// A joint that is no further from its usual value than this (deg, sliding joints mm) has not moved.
const STAYS: f64 = 1.0;
/// Share of the poses that makes a pattern.
const MOST: f64 = 0.8;
/// Random poses by which the arm's configurations are counted, and their seed.
const RANDOM_POSES: usize = 300;
const SEED: u64 = 0xa1;
/// Configurations of the arm that fewer of the random poses have are rare.
const RARE: f64 = 0.15;
/// Poses of the rarer configuration that a set of that size should have, so that none is no chance.
const EXPECTED: f64 = 8.0;
/// A set with less of it than this has none to speak of.
const NONE: f64 = 0.02;
/// Change of a joint for a derivative ((rad) or (m)).
const STEP: f64 = 1e-6;

/// Warnings about what the configurations `known` from the identification, and those `tested`, have in common.
pub(super) fn warnings(profile: &Profile, known: &[&[f64]], tested: &[&[f64]]) -> Vec<Warning> {
    let joints = profile.chain().joints();
    let mut warnings = Vec::new();
    let of_verification = moves_one_joint_at_a_time(joints, tested);
    if of_verification {
        let message = "the verification poses move one joint at a time: the figures below do not carry over to poses that move several joints, because errors of joints that multiply do not show; verify with poses that move all joints";
        warnings.push(Warning::new(WarningCode::OneJointAtATime, message, true));
    }
    if moves_one_joint_at_a_time(joints, known) {
        let message = "the identification poses move one joint at a time: what joints do to each other is not measured, and other poses may be worse than predicted; add poses that move all joints";
        warnings.push(Warning::new(WarningCode::OneJointAtATime, message, of_verification));
    }
    if let Some(other) = rarer_configuration(profile) {
        let sets = [("identification", known), ("verification", tested)];
        let single = sets.into_iter().filter(|(_, set)| has_one_configuration(profile, set, other));
        let names: Vec<&str> = single.map(|(name, _)| name).collect();
        if !names.is_empty() {
            let message = format!(
                "all {} poses have one arm configuration (shoulder, elbow and wrist stay on their sides), but {} % of the poses within the planning limits have another one: the figures need not carry over to those. Add poses there, or narrow the planning limits",
                names.join(" and "),
                number(100.0 * other, 0)
            );
            warnings.push(Warning::new(WarningCode::OneArmConfiguration, message, false));
        }
    }
    warnings
}

/// Whether most configurations differ in at most one joint from a common one.
fn moves_one_joint_at_a_time(joints: &[Joint], configurations: &[&[f64]]) -> bool {
    let count = configurations.len();
    if joints.len() < 3 || count < FEWEST_POSES {
        return false;
    }
    let still = |joint: usize| joints[joint].joint_type.quantity().from_edge(STAYS);
    let common: Vec<f64> = (0..joints.len())
        .map(|joint| {
            let mut values: Vec<f64> = configurations.iter().map(|configuration| configuration[joint]).collect();
            let (_, median, _) = values.select_nth_unstable_by(count / 2, f64::total_cmp);
            *median
        })
        .collect();
    let moved = |configuration: &[f64]| {
        let away = |joint: &usize| (configuration[*joint] - common[*joint]).abs() > still(*joint);
        (0..joints.len()).filter(away).count()
    };
    let moved: Vec<usize> = configurations.iter().map(|configuration| moved(configuration)).collect();
    let one_at_a_time = moved.iter().filter(|moved| **moved <= 1).count();
    moved.iter().any(|moved| *moved > 0) && one_at_a_time as f64 >= MOST * count as f64
}

/// Share of the rarer side of the arm's singularities within the planning limits, if it is not rare; only arms of six joints have
/// sides.
fn rarer_configuration(profile: &Profile) -> Option<f64> {
    let joint_box = JointBox::new(ranges(profile)?).ok()?;
    if joint_box.dof() != 6 {
        return None;
    }
    let forward = ForwardKinematics::new(profile.chain());
    let poses = random(&joint_box, SEED).take(RANDOM_POSES);
    let positive = poses.filter(|q| is_positive(&forward, q)).count() as f64 / RANDOM_POSES as f64;
    Some(positive.min(1.0 - positive)).filter(|share| *share > RARE)
}

fn has_one_configuration(profile: &Profile, configurations: &[&[f64]], rarer: f64) -> bool {
    let count = configurations.len() as f64;
    if count * rarer < EXPECTED {
        return false;
    }
    let forward = ForwardKinematics::new(profile.chain());
    let positive = configurations.iter().filter(|q| is_positive(&forward, q)).count() as f64 / count;
    positive.min(1.0 - positive) < NONE
}

/// Sign of the determinant of the Jacobian: it changes where shoulder, elbow or wrist pass a singularity.
fn is_positive(forward: &ForwardKinematics<'_>, q: &[f64]) -> bool {
    let from = forward.base_from_flange(q);
    let mut jacobian = Matrix6::zeros();
    let mut moved = q.to_vec();
    for (joint, mut column) in jacobian.column_iter_mut().enumerate() {
        moved[joint] += STEP;
        let to = forward.base_from_flange(&moved);
        moved[joint] = q[joint];
        column.fixed_rows_mut::<3>(0).copy_from(&((to.translation.vector - from.translation.vector) / STEP));
        column.fixed_rows_mut::<3>(3).copy_from(&((to.rotation * from.rotation.inverse()).scaled_axis() / STEP));
    }
    jacobian.determinant() > 0.0
}
