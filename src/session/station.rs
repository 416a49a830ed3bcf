//! Position of the tracker, as far as the measured points determine it.

use nalgebra::Point3;

use super::state::{Sample, Session};
use crate::geometry::{Registration, register};
use crate::kinematics::ForwardKinematics;

/// Fewest samples that determine it.
pub const FEWEST: usize = 4;

/// The measured coordinates registered to the base: the samples that count, to where the nominal arm has the reflector. `None` before
/// there are [`FEWEST`] of them. The tracker stands at the origin of its coordinates.
pub fn registration(session: &Session) -> Option<Registration> {
    let profile = session.mounted_profile()?;
    let target = profile.targets().first().map_or_else(Point3::origin, |target| target.position_in_flange);
    let forward = ForwardKinematics::new(profile.chain());
    let predicted = |sample: &Sample| {
        let mut q = session.configuration_of(sample);
        q.resize(profile.chain().dof(), 0.0);
        forward.point_in_base(&q, &target)
    };
    let pairs: Vec<(Point3<f64>, Point3<f64>)> =
        session.counted().map(|sample| (session.point_of(sample), predicted(sample))).collect();
    registered(&pairs)
}

/// The rigid motion that brings points as measured (m) to where they are in the base (m), from at least [`FEWEST`] pairs.
pub fn registered(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Registration> {
    if pairs.len() < FEWEST {
        return None;
    }
    let found = register(pairs.iter().map(|(from, to)| (1.0, *from, *to)))?;
    found.to_from_from.to_matrix().iter().all(|value| value.is_finite()).then_some(found)
}
