//! Joint ranges narrowed on the command line.

use crate::cli::JointLimit;
use crate::error::{ExitStatus, Failure};
use crate::procedure::plan::limits;
use crate::profile::Profile;

/// The planning limits of a profile (rad or m), narrowed by the operator.
pub(super) fn narrowed(profile: &Profile, narrowed: &[JointLimit]) -> Result<Vec<(f64, f64)>, Failure> {
    let joints = profile.chain().joints();
    let mut limits = limits(profile)?;
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
