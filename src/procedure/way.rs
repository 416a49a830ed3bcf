//! Whether the arm can go from one configuration to the next, in any order.

use super::cell::{cell, planning_limits};
use crate::planning::collision::{ArmShape, DEFAULT_CLEARANCE, Obstruction};
use crate::planning::order::home_pose;
use crate::profile::Profile;

/// The check of several ways between the same configurations.
#[derive(Clone, Debug, PartialEq)]
pub enum WayCheck {
    /// Every move of this way is free; its index.
    Free(usize),
    /// Every way is blocked.
    Blocked {
        /// What blocks the first way.
        obstruction: Obstruction,
    },
    /// Nothing can be said.
    NotChecked {
        /// Why not, in words.
        reason: String,
    },
}

/// Finds the first of several ways whose every move is free. A way is a list of configurations (rad, sliding joints m) from where
/// the arm is to where it is to go.
pub fn first_free(profile: &Profile, ways: &[Vec<&[f64]>]) -> WayCheck {
    if profile.bodies().is_empty() {
        return WayCheck::NotChecked { reason: "the profile has no bodies".to_owned() };
    }
    let checked = with_shape(profile, |shape| {
        let blocked = |way: &Vec<&[f64]>| way.windows(2).find_map(|pair| shape.check_move(pair[0], pair[1]).err());
        let mut obstructions = ways.iter().map(blocked);
        match obstructions.next() {
            Some(Some(obstruction)) => match obstructions.position(|blocked| blocked.is_none()) {
                Some(index) => WayCheck::Free(index + 1),
                None => WayCheck::Blocked { obstruction },
            },
            Some(None) | None => WayCheck::Free(0),
        }
    });
    checked.unwrap_or_else(|reason| WayCheck::NotChecked { reason })
}

/// A configuration from which most others can be reached, if the profile allows to find one.
pub fn home(profile: &Profile) -> Option<Vec<f64>> {
    with_shape(profile, |shape| home_pose(shape, [])).ok().flatten()
}

/// Calls `use_shape` with the arm in its cell, or says why that cannot be made.
fn with_shape<T>(profile: &Profile, use_shape: impl FnOnce(&ArmShape<'_>) -> T) -> Result<T, String> {
    let limits = planning_limits(profile).map_err(|error| error.to_string())?;
    let cell = cell(profile, limits, None, true).map_err(|error| error.to_string())?;
    let shape = ArmShape::new(profile.chain(), &cell, DEFAULT_CLEARANCE).map_err(|error| error.to_string())?;
    Ok(use_shape(&shape))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::builtin;
    use crate::units::DEGREE;

    fn degrees(values: [f64; 6]) -> Vec<f64> {
        values.iter().map(|value| value * DEGREE).collect()
    }

    #[test]
    fn the_first_free_way_is_found() {
        let (profile, _) = Profile::parse(builtin("ur10e").unwrap(), "ur10e").unwrap();
        let up = degrees([0.0, -90.0, 0.0, -90.0, 0.0, 0.0]);
        let side = degrees([40.0, -90.0, 30.0, -90.0, 0.0, 0.0]);
        let below = degrees([0.0, 60.0, 0.0, 0.0, 0.0, 0.0]);
        let direct = vec![up.as_slice(), &side];
        let through_floor = vec![up.as_slice(), &below, &side];
        assert_eq!(first_free(&profile, std::slice::from_ref(&direct)), WayCheck::Free(0));
        assert_eq!(first_free(&profile, &[through_floor.clone(), direct]), WayCheck::Free(1));
        let check = first_free(&profile, &[through_floor]);
        assert!(matches!(check, WayCheck::Blocked { obstruction: Obstruction::Floor { .. } }), "{check:?}");
    }

    #[test]
    fn an_arm_without_bodies_is_not_checked() {
        let text = builtin("ur10e").unwrap();
        let (before, _) = text.split_once("    bodies: [").unwrap();
        let (profile, _) = Profile::parse(&format!("{before})"), "bare").unwrap();
        let at = degrees([0.0, -90.0, 0.0, -90.0, 0.0, 0.0]);
        let check = first_free(&profile, &[vec![&at, &at]]);
        assert_eq!(check, WayCheck::NotChecked { reason: "the profile has no bodies".to_owned() });
    }
}
