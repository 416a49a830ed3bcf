//! How good a calibration from the samples so far would be, and whether more of them are worth the time.

use crate::kinematics::Place;
use crate::planning::{Information, JointBox, fewest_poses, findable, random};
use crate::profile::{Level, Profile};
use crate::session::plan::PoseKind;
use crate::session::state::Session;

/// Fresh poses over which the prediction is averaged.
const FRESH_POSES: usize = 200;
/// Seed of the fresh poses: the same for every session, so that figures can be compared.
const FRESH_SEED: u64 = 0x5eed;
/// The rest of the plan is not worth its time if it improves the prediction by less than this part.
const WORTHWHILE: f64 = 0.05;

/// Predicted RMS position error at fresh poses, per σ of the instrument.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Prediction {
    /// After so many identification samples; from the first number on with which all that can be found is determined.
    pub(super) curve: Vec<(usize, f64)>,
    /// With the rest of the plan as well.
    pub(super) with_all: Option<f64>,
}

impl Prediction {
    /// Of the samples of a session.
    pub(super) fn of(session: &Session) -> Self {
        Self::try_of(session).unwrap_or_default()
    }

    fn try_of(session: &Session) -> Option<Self> {
        let profile = &session.mounted_profile()?;
        let measured: Vec<Place> =
            session.counted_of(PoseKind::Identification).map(|sample| at(session.configuration_of(sample))).collect();
        let open = session
            .open_rows()
            .filter_map(|row| session.rows.get(row))
            .filter(|row| row.planned.kind == PoseKind::Identification)
            .map(|row| at(row.planned.configuration.clone()));
        let pool: Vec<Place> = measured.iter().cloned().chain(open).collect();
        let parameters = profile.free_parameters(Level::Geometric);
        let information = Information::new(&profile.arm(), &parameters, &pool, &fresh(profile)?).ok()?;
        let of_first = |count: usize| information.predicted_error(&(0..count).collect::<Vec<_>>());
        let curve = (information.fewest_poses()..=measured.len()).filter_map(|n| Some((n, of_first(n)?))).collect();
        Some(Self { curve, with_all: of_first(pool.len()) })
    }

    /// Of the samples so far.
    pub(super) fn now(&self) -> Option<f64> {
        self.curve.last().map(|(_, error)| *error)
    }

    /// Whether the rest of the plan would improve it by too little to be worth its time.
    pub(super) fn is_enough(&self) -> bool {
        match (self.now(), self.with_all) {
            (Some(now), Some(with_all)) => with_all > (1.0 - WORTHWHILE) * now,
            _ => false,
        }
    }
}

/// Fewest identification samples that can determine what distances can find, by the same rule as planning. Where that is not
/// clear all free parameters count.
pub(in crate::wizard::step) fn fewest_samples(session: &Session) -> Option<usize> {
    let profile = &session.mounted_profile()?;
    let parameters = profile.free_parameters(Level::Geometric);
    let rank = fresh(profile).and_then(|fresh| findable(&profile.arm(), &parameters, &fresh));
    Some(fewest_poses(rank.unwrap_or(parameters.len())))
}

fn at(configuration: Vec<f64>) -> Place {
    Place { configuration, target: 0 }
}

/// Poses all over the range in which the robot is to be accurate.
fn fresh(profile: &Profile) -> Option<Vec<Place>> {
    Some(random(&joint_box(profile)?, FRESH_SEED).take(FRESH_POSES).map(at).collect())
}

/// The range in which the robot is to be accurate.
fn joint_box(profile: &Profile) -> Option<JointBox> {
    let limits: Option<Vec<(f64, f64)>> =
        profile.joints().iter().map(|range| range.planning_limits.or(range.limits)).collect();
    JointBox::new(limits?).ok()
}
