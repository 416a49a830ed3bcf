//! The error predicted for a calibration from the samples so far, and whether more samples are worth the time.

use crate::kinematics::Place;
use crate::planning::{Information, JointBox, fewest_poses, findable, random};
use crate::profile::{Level, Profile};
use crate::session::plan::PoseKind;
use crate::session::state::Session;

/// Fresh poses over which the prediction is averaged.
const FRESH_POSES: usize = 200;
/// Seed of the fresh poses: the same for every session, so that figures can be compared.
const FRESH_SEED: u64 = 0x5eed;
/// Relative improvement below which the rest of the plan is not worth the time.
const WORTHWHILE: f64 = 0.05;

/// Predicted RMS position error at fresh poses, per σ of the instrument.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Prediction {
    /// Error by number of identification samples, from the first number that determines all identifiable parameters.
    pub(super) curve: Vec<(usize, f64)>,
    /// Error with the rest of the plan included.
    pub(super) with_all: Option<f64>,
}

impl Prediction {
    /// Predicts from the samples of a session.
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
        let parameters = profile.parameters(Level::Geometric);
        let information = Information::new(&profile.arm(), &parameters, &pool, &fresh(profile)?).ok()?;
        let of_first = |count: usize| information.predicted_error(&(0..count).collect::<Vec<_>>());
        let curve = (information.fewest_poses()..=measured.len()).filter_map(|n| Some((n, of_first(n)?))).collect();
        Some(Self { curve, with_all: of_first(pool.len()) })
    }

    /// Error with the samples so far.
    pub(super) fn now(&self) -> Option<f64> {
        self.curve.last().map(|(_, error)| *error)
    }

    /// Whether the rest of the plan improves the error too little to be worth the time.
    pub(super) fn is_enough(&self) -> bool {
        match (self.now(), self.with_all) {
            (Some(now), Some(with_all)) => with_all > (1.0 - WORTHWHILE) * now,
            _ => false,
        }
    }
}

/// Fewest identification samples that can determine all identifiable parameters, by the same rule as planning. If the rank is
/// unclear, all free parameters count.
pub(in crate::wizard::step) fn fewest_samples(session: &Session) -> Option<usize> {
    let profile = &session.mounted_profile()?;
    let parameters = profile.parameters(Level::Geometric);
    let rank = fresh(profile).and_then(|fresh| findable(&profile.arm(), &parameters, &fresh));
    Some(fewest_poses(rank.unwrap_or(parameters.len())))
}

fn at(configuration: Vec<f64>) -> Place {
    Place { configuration, target: 0 }
}

/// Random poses over the range in which the robot has to be accurate.
fn fresh(profile: &Profile) -> Option<Vec<Place>> {
    Some(random(&joint_box(profile)?, FRESH_SEED).take(FRESH_POSES).map(at).collect())
}

/// The range in which the robot has to be accurate.
fn joint_box(profile: &Profile) -> Option<JointBox> {
    let limits: Option<Vec<(f64, f64)>> =
        profile.joints().iter().map(|range| range.planning_limits.or(range.limits)).collect();
    JointBox::new(limits?).ok()
}
