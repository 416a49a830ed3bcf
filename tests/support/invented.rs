//! Calibrations of shipped arms with invented errors, for what comes after an identification.

use std::fs;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::profile::{Level, Profile, builtin};
use trupose::session::calibration::Calibration;
use trupose::session::sha256;
use trupose::session::summary::ParameterSummary;
use trupose::units::to_mm;

use super::root;

/// A calibration of the arm with this name. Its errors are about half of those that its profile expects.
pub(crate) fn calibration(arm: &str) -> Calibration {
    // INFORM counts pulses, which no shipped profile states.
    let text = builtin(arm).unwrap().replace("max_speed_deg_s:", "pulses_per_degree: 1000.0, max_speed_deg_s:");
    let profile = Profile::parse(&text, arm).unwrap().0;
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let parameters = profile.parameters(Level::Geometric).into_iter().map(|free| {
        let unit = free.id.unit();
        let expected = unit.to_edge(free.expected);
        ParameterSummary {
            id: free.id,
            unit,
            nominal: 0.0,
            deviation: 0.5 * expected * random.random_range(-1.0..1.0),
            sigma: Some(0.01 * expected),
            expected,
            identifiable: true,
        }
    });
    let example = fs::read_to_string(root().join("sessions/example/calibration.ron")).unwrap();
    let mut calibration = Calibration::parse(&example).unwrap();
    calibration.parameters = parameters.collect();
    arm.clone_into(&mut calibration.provenance.profile);
    calibration.provenance.profile_sha256 = sha256(text.as_bytes());
    calibration.profile = text;
    calibration.samples.clear();
    calibration.warnings.clear();
    calibration.geometric.clear();
    calibration.joint_errors.clear();
    (calibration.selection, calibration.workspace, calibration.loads) = (None, None, None);
    let point = |target: &trupose::profile::Target| {
        let point = target.position_in_flange.map(to_mm);
        (point.x, point.y, point.z)
    };
    calibration.nominal_targets_mm = profile.targets().iter().map(point).collect();
    calibration
}
