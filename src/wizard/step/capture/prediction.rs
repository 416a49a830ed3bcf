//! The error predicted for a calibration from the samples so far, and whether more samples are worth the time.

use crate::identification::Terms;
use crate::identification::predicted::Forecast;
use crate::kinematics::Place;
use crate::planning::{JointBox, REPEATABILITY, fewest_poses, findable, random};
use crate::profile::{Level, Profile};
use crate::session::plan::PoseKind;
use crate::session::state::Session;

/// Fresh poses over which the prediction is averaged.
const FRESH_POSES: usize = 200;
/// Seed of the fresh poses: the same for every session, so that figures can be compared.
const FRESH_SEED: u64 = 0x5eed;
/// Share of the acceptance limit that a prediction may reach. It knows nothing of what the model of the arm lacks.
const MARGIN: f64 = 0.5;
/// Relative improvement below which the rest of the plan is not worth the time.
const WORTHWHILE: f64 = 0.05;

/// Predicted RMS position error at fresh poses of an arm with smooth errors of its joints.
#[derive(Clone, Debug, Default)]
pub(super) struct Prediction {
    /// Error by number of identification samples (m), from the first number that determines the geometry.
    pub(super) curve: Vec<(usize, f64)>,
    /// Error with the rest of the plan included (m).
    pub(super) with_all: Option<f64>,
    /// Standard deviation of a measured coordinate (m): instrument and repeatability.
    pub(super) sigma: f64,
    /// State before the first sample.
    start: Option<Forecast>,
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
        // Without the curves, which have six hundred parameters and would change little of what is worth measuring.
        let terms = Terms { curves: None, ..Terms::all(1.0) };
        parameters.extend(terms.parameters(&arm.chain));
        let distance = profile.tracker().position_in_base.coords.norm();
        let instrument = profile.instrument().map_or(0.0, |instrument| instrument.sigma_at(distance));
        let sigma = instrument.hypot(REPEATABILITY);
        let start = Forecast::new(&arm, &parameters, &fresh(profile)?, sigma);
        let mut prediction = Self { sigma, start: Some(start), fewest: fewest?, ..Self::default() };
        prediction.restart(session);
        Some(prediction)
    }

    /// Predicts again from all samples of a session with the same robot.
    pub(super) fn restart(&mut self, session: &Session) {
        self.curve.clear();
        self.forecast = self.start.clone().map(|start| (start, 0));
        for place in measured(session) {
            self.append(&place);
        }
        self.with_all = self.forecast.clone().map(|(mut with_all, _)| {
            let open = session.open_rows().filter_map(|row| session.rows.get(row));
            for row in open.filter(|row| row.planned.kind == PoseKind::Identification) {
                with_all.measure(&at(row.planned.configuration.clone()));
            }
            with_all.error()
        });
    }

    /// The same with the measurement of this number, which `session` has as its last one.
    pub(super) fn follow(&mut self, session: &Session, number: u64) {
        let counted = || session.counted_of(PoseKind::Identification);
        let Some(last) = counted().last().filter(|last| last.noted.number == number) else { return };
        if self.forecast.as_ref().is_some_and(|(_, known)| known + 1 == counted().count()) {
            self.append(&at(session.configuration_of(last)));
        } else {
            self.restart(session);
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

    /// Whether the error is well below the limit (m), or the rest of the plan improves it too little to be worth the time.
    pub(super) fn is_enough(&self, limit: Option<f64>) -> bool {
        let Some(now) = self.now() else { return false };
        match limit {
            Some(limit) => now <= MARGIN * limit,
            None => self.with_all.is_some_and(|with_all| with_all > (1.0 - WORTHWHILE) * now),
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
