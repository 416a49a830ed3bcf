//! Warnings on a readable profile: parallel axes without β, β without parallel axes, missing limits.

use super::diagnostic::{Findings, Span};
use super::{PARALLEL_TOLERANCE, Profile};
use crate::kinematics::{Convention, JointType, KinematicChain, LinkParameter, ParameterId};

/// Adds the warnings; `joints` are the spans of the joints.
pub(super) fn check(profile: &Profile, joints: &[Span], findings: &mut Findings<'_>) {
    let chain = &profile.chain;
    let parallel = chain.parallel_axes(PARALLEL_TOLERANCE);
    for &first in &parallel {
        let joint = chain.beta_joint(first);
        if !profile.beta_joints.contains(&joint)
            && let Some(span) = joints.get(joint)
        {
            warn_missing_beta(profile, first, joint, *span, findings);
        }
    }
    for &joint in &profile.beta_joints {
        if !has_parallel_neighbour(chain, joint)
            && let (Some(name), Some(span)) = (joint_name(chain, joint), joints.get(joint))
        {
            findings.warning(
                *span,
                format!("'{name}' has 'beta_deg', but its axis is not parallel to its neighbour's"),
                "remove 'beta_deg': here it cannot be distinguished from alpha, a, d and theta".to_owned(),
            );
        }
    }
    for ((joint, range), span) in chain.joints().iter().zip(&profile.joints).zip(joints) {
        if range.limits.is_none() {
            let unit = joint.joint_type.quantity().unit();
            let hint = format!("add 'limits_{unit}: (..., ...)': poses can only be planned inside limits");
            findings.warning(*span, format!("joint '{}' has no limits", joint.name), hint);
        }
    }
}

fn warn_missing_beta(profile: &Profile, first: usize, joint: usize, span: Span, findings: &mut Findings<'_>) {
    let chain = &profile.chain;
    let (Some(one), Some(other), Some(name)) =
        (joint_name(chain, first), joint_name(chain, first + 1), joint_name(chain, joint))
    else {
        return;
    };
    let free_offsets: Vec<String> = [first, first + 1]
        .map(|joint| ParameterId::Link { joint, parameter: LinkParameter::D })
        .into_iter()
        .filter(|id| !profile.fixed_parameters.contains(id))
        .map(|id| format!("'{id}'"))
        .collect();
    let mut hint = format!("add 'beta_deg: 0.0' to '{name}'");
    // If one of the two offsets is fixed, only their sum is identified and none can diverge.
    if free_offsets.len() > 1 {
        let both = free_offsets.join(" and ");
        hint.push_str("; ");
        hint.push_str(&both);
        hint.push_str(
            " are free here: the common normal of parallel axes is undefined, and without beta identification may move \
             it by hundreds of metres along them",
        );
    }
    findings.warning(
        span,
        format!("the axes of '{one}' and '{other}' are parallel, but '{name}' has no 'beta_deg'"),
        hint,
    );
}

fn joint_name(chain: &KinematicChain, joint: usize) -> Option<&str> {
    chain.joints().get(joint).map(|joint| joint.name.as_str())
}

/// Whether the β of this joint's link is between two parallel axes. A sliding axis counts too: α and θ alone determine its
/// direction as poorly as that of a turning one.
fn has_parallel_neighbour(chain: &KinematicChain, joint: usize) -> bool {
    let Some(own) = chain.joints().get(joint) else { return false };
    let neighbour = match chain.convention() {
        Convention::Standard => chain.joints().get(joint + 1),
        Convention::Modified => joint.checked_sub(1).and_then(|before| chain.joints().get(before)),
    };
    let turns = |joint_type| joint_type == JointType::Revolute;
    let cosine = own.link.alpha.cos() * own.link.beta.cos();
    neighbour.is_some_and(|neighbour| turns(own.joint_type) || turns(neighbour.joint_type))
        && cosine.abs() > PARALLEL_TOLERANCE.cos()
}
