//! The error predicted for a calibration from the samples so far, and whether more samples are worth the time.

use crate::identification::Terms;
use crate::identification::predicted::Forecast;
use crate::kinematics::Place;
use crate::planning::{EXPECTED_CURVES, JointBox, REPEATABILITY, fewest_poses, findable, random};
use crate::profile::{Level, Profile};
use crate::session::plan::PoseKind;
use crate::session::state::Session;

/// Fresh poses over which the prediction is averaged.
const FRESH_POSES: usize = 200;
/// Seed of the fresh poses: the same for every session, so that figures can be compared.
const FRESH_SEED: u64 = 0x5eed;
/// Relative improvement below which the rest of the plan is not worth the time.
const WORTHWHILE: f64 = 0.05;

/// Predicted RMS position error at fresh poses of an arm with errors of its joints.
#[derive(Clone, Debug, Default)]
pub(super) struct Prediction {
    /// Error by number of identification samples (m), from the first number that determines the geometry.
    pub(super) curve: Vec<(usize, f64)>,
    /// Error with the rest of the plan included (m).
    pub(super) with_all: Option<f64>,
    /// Standard deviation of a measured coordinate (m): instrument and repeatability.
    pub(super) sigma: f64,
    /// State after the samples so far, and their number.
    forecast: Option<(Forecast, usize)>,
    /// Fewest samples that determine the geometry.
    fewest: usize,
}

impl Prediction {
    /// Predicts from the samples of a session.
    pub(super) fn of(session: &Session, fewest: Option<usize>) -> Self {
        Self::try_of(session, fewest).unwrap_or_default()
    }

    fn try_of(session: &Session, fewest: Option<usize>) -> Option<Self> {
        let profile = &session.mounted_profile()?;
        let arm = profile.arm();
        let mut parameters = profile.parameters(Level::Geometric);
        parameters.extend(Terms::all(EXPECTED_CURVES).parameters(&arm.chain));
        let distance = profile.tracker().position_in_base.coords.norm();
        let instrument = profile.instrument().map_or(0.0, |instrument| instrument.sigma_at(distance));
        let sigma = instrument.hypot(REPEATABILITY);
        let forecast = Forecast::new(&arm, &parameters, &fresh(profile)?, sigma);
        let mut prediction =
            Self { curve: Vec::new(), with_all: None, sigma, forecast: Some((forecast, 0)), fewest: fewest? };
        for place in measured(session) {
            prediction.append(&place);
        }
        let mut with_all = prediction.forecast.clone()?.0;
        let open = session.open_rows().filter_map(|row| session.rows.get(row));
        for row in open.filter(|row| row.planned.kind == PoseKind::Identification) {
            with_all.measure(&at(row.planned.configuration.clone()));
        }
        prediction.with_all = Some(with_all.error());
        Some(prediction)
    }

    /// The same with the samples of `session`, which has one more than before or others.
    pub(super) fn follow(&mut self, session: &Session) {
        let known = self.forecast.as_ref().map(|(_, known)| *known);
        let now = session.counted_of(PoseKind::Identification).count();
        match session.counted_of(PoseKind::Identification).last() {
            Some(last) if known.is_some_and(|known| known + 1 == now) => {
                self.append(&at(session.configuration_of(last)));
            }
            _ => *self = Self::of(session, Some(self.fewest)),
        }
    }

    fn append(&mut self, place: &Place) {
        let Some((forecast, known)) = &mut self.forecast else { return };
        forecast.measure(place);
        *known += 1;
        if *known >= self.fewest {
            self.curve.push((*known, forecast.error()));
        }
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

fn measured(session: &Session) -> impl Iterator<Item = Place> {
    session.counted_of(PoseKind::Identification).map(|sample| at(session.configuration_of(sample)))
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
