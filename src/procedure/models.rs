//! The models that a session delivers: the identified arm in every suitable format and the corrections of its joints, each read back
//! and checked.

use std::path::Path;

use crate::kinematics::{JointType, KinematicChain, Link};
use crate::model::{CalibratedArm, ExportOptions, Format, export};
use crate::profile::Profile;
use crate::session::calibration::Calibration;
use crate::session::state::Session;
use crate::units::{DEGREE, MICROMETRE};

/// A request for the models of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelsRequest {
    /// The identified arm.
    pub calibration: Calibration,
    /// The nominal robot, without the target as it was mounted for the session.
    pub profile: Profile,
}

/// The models of an identified arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Models {
    /// Name and text of each file; each was read back and equals the arm that it is about within 1 µm and 1 µrad.
    pub files: Vec<(String, String)>,
    /// The files that cannot carry this arm, with the reason: `NAME: REASON`.
    pub left_out: Vec<String>,
}

impl ModelsRequest {
    /// The request for the models of a session's result; none without a usable one.
    pub fn of(session: &Session) -> Option<Self> {
        let calibration = session.identified.as_deref()?.calibration.clone()?;
        Some(Self { calibration, profile: session.robot.as_ref()?.profile.clone() })
    }
}

/// The models that were delivered with the result of a session, written again.
pub fn delivered(session: &Session) -> Vec<(String, String)> {
    if session.delivered.is_empty() {
        return Vec::new();
    }
    let mut files = ModelsRequest::of(session).map(|request| models(&request)).unwrap_or_default().files;
    files.retain(|(name, _)| session.delivered.iter().any(|file| Path::new(file).file_name() == Some(name.as_ref())));
    files
}

/// Writes the models and checks them.
pub fn models(request: &ModelsRequest) -> Models {
    let mut models = Models::default();
    let mut formats = vec![Format::CorrectedProfile, Format::Urdf, Format::DhCsv];
    if is_like_universal_robots(request.profile.chain()) {
        formats.push(Format::UrKinematics);
    }
    if !request.calibration.joint_errors.is_empty() {
        formats.push(Format::JointCorrections);
    }
    match CalibratedArm::new(&request.calibration, &request.profile) {
        Ok(arm) => {
            for format in formats {
                match export(&arm, format, &ExportOptions::default()) {
                    Ok(done) => models.files.push((format.file_name().to_owned(), done.text)),
                    Err(error) => models.left_out.push(format!("{}: {error}", format.file_name())),
                }
            }
        }
        Err(error) => models.left_out.extend(formats.iter().map(|format| format!("{}: {error}", format.file_name()))),
    }
    models
}

/// Whether the nominal arm is built like those of Universal Robots: six turning joints, axes 2 to 4 parallel, all others
/// perpendicular to their neighbours, wrist axes 5 and 6 without lateral offset.
fn is_like_universal_robots(chain: &KinematicChain) -> bool {
    let is = |angle: f64, degrees: f64| (angle.abs() - degrees * DEGREE).abs() < 1e-6;
    let links: Vec<Link> = chain.joints().iter().map(|joint| joint.link).collect();
    let [first, second, third, fourth, fifth, _] = links[..] else { return false };
    chain.joints().iter().all(|joint| joint.joint_type == JointType::Revolute)
        && is(first.alpha, 90.0)
        && is(second.alpha, 0.0)
        && is(third.alpha, 0.0)
        && is(fourth.alpha, 90.0)
        && is(fifth.alpha, 90.0)
        && [first, fourth, fifth].iter().all(|link| link.a.abs() < MICROMETRE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{builtin, builtin_names};

    #[test]
    fn the_arms_of_universal_robots_are_known_by_their_axes() {
        let named = |name: &&str| {
            let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
            is_like_universal_robots(profile.chain())
        };
        assert_eq!(builtin_names().filter(named).collect::<Vec<_>>(), ["ur10", "ur10e", "ur5", "ur5e"]);
    }
}
