//! What the instrument sees while nothing is measured: is the SMR still, is it where it should be, does the robot stand as
//! planned. From it the wizard may measure by itself.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use crate::kinematics::ForwardKinematics;
use crate::session::reading::LiveReading;
use crate::session::state::Session;
use crate::session::station;
use crate::units::{DEGREE, MILLIMETRE, to_deg, to_mm};

use super::view::{LivePoint, LiveView};

/// Points are kept for this long (s).
const KEPT: f64 = 5.0;
/// Most points kept.
const MOST: usize = 128;
/// The SMR rests if it stays within this of where it is now (m).
const REST: f64 = 0.1 * MILLIMETRE;
/// It has to rest so long before the wizard measures by itself (s).
pub(super) const REST_TIME: f64 = 2.0;
/// It has to move by so much before the wizard measures by itself again (m).
const MOVED: f64 = 5.0 * MILLIMETRE;
/// The SMR is near if it is within this of its predicted place (m), or within [`NEAR_SPREADS`] of what samples miss.
const NEAR: f64 = 30.0 * MILLIMETRE;
const NEAR_SPREADS: f64 = 4.0;
/// The robot stands as planned if no joint is off by more (rad).
pub(super) const AS_PLANNED: f64 = 0.05 * DEGREE;

/// The last seconds of a link.
#[derive(Clone, Debug, Default)]
pub(super) struct Live {
    latest: Option<LiveReading>,
    points: VecDeque<(f64, Point3<f64>)>,
    /// Where was measured last, or where a sample was taken back, until the SMR is seen elsewhere.
    measured_at: Option<Point3<f64>>,
    /// Something was seen since the link is there.
    has_seen: bool,
}

impl Live {
    /// Takes a look. `last_sample`: where the session measured last (m).
    pub(super) fn take(&mut self, reading: LiveReading, last_sample: Option<Point3<f64>>) {
        let restarted = self.latest.as_ref().is_some_and(|before| reading.seconds < before.seconds);
        if restarted || reading.point.is_none() {
            self.points.clear();
        }
        if let Some(point) = reading.point.filter(|point| point.coords.iter().all(|value| value.is_finite())) {
            self.points.push_back((reading.seconds, point));
            if !std::mem::replace(&mut self.has_seen, true) {
                self.measured_at = last_sample;
            }
            self.measured_at = self.measured_at.filter(|before| (point - before).norm() <= MOVED);
        }
        let oldest = reading.seconds - KEPT;
        while self.points.front().is_some_and(|(at, _)| *at < oldest) || self.points.len() > MOST {
            self.points.pop_front();
        }
        self.latest = Some(reading);
    }

    /// Why the link cannot be asked now.
    pub(super) fn down(&self) -> Option<&str> {
        self.latest.as_ref()?.down.as_deref()
    }

    /// Nothing is seen any more.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// How long the SMR has rested where it is (s), and how much it scattered meanwhile (m, root mean square).
    fn rest(&self) -> Option<(f64, f64)> {
        let (now, here) = *self.points.back()?;
        let still: Vec<(f64, Point3<f64>)> =
            self.points.iter().rev().take_while(|(_, point)| (point - here).norm() <= REST).copied().collect();
        let since = still.last()?.0;
        let count = still.len() as f64;
        let mean = still.iter().map(|(_, point)| point.coords).sum::<Vector3<f64>>() / count;
        let square = still.iter().map(|(_, point)| (point.coords - mean).norm_squared()).sum::<f64>() / count;
        Some((now - since, square.sqrt()))
    }

    /// Distance of the SMR from where it should be at row `row` (m).
    fn off_predicted(&self, session: &Session, row: usize) -> Option<(f64, f64)> {
        let (_, here) = *self.points.back()?;
        let registered = station::registration(session)?;
        let predicted = predicted(session, &session.rows.get(row)?.planned.configuration)?;
        Some(((registered.to_from_from * here - predicted).norm(), registered.rms))
    }

    /// Largest difference of a joint from the plan (rad), and which joint.
    fn joint_difference(&self, session: &Session, row: usize) -> Option<(usize, f64)> {
        let joints = self.latest.as_ref()?.joints.as_ref()?;
        let planned = &session.rows.get(row)?.planned.configuration;
        if joints.len() != planned.len() {
            return None;
        }
        let differences = joints.iter().zip(planned).map(|(joint, planned)| (joint - planned).abs());
        differences.enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other))
    }

    /// Whether the wizard should measure row `row` by itself now.
    pub(super) fn is_time(&self, session: &Session, row: usize) -> bool {
        let is_up = self.latest.as_ref().is_some_and(|latest| latest.down.is_none());
        let rests = self.rest().is_some_and(|(seconds, _)| seconds >= REST_TIME);
        let stands = self.latest.as_ref().and_then(|latest| latest.is_still) != Some(false);
        let by_joints = self.joint_difference(session, row).map(|(_, difference)| difference <= AS_PLANNED);
        let by_place = self.off_predicted(session, row).map(|(distance, rms)| distance <= NEAR.max(NEAR_SPREADS * rms));
        // Without the robot's joints and before the tracker's place is known, nobody can tell which pose this is.
        let is_there =
            by_joints.unwrap_or(true) && by_place.unwrap_or(true) && (by_joints.is_some() || by_place.is_some());
        is_up && self.measured_at.is_none() && rests && stands && is_there
    }

    /// Here is measured, or a sample taken back: the wizard does not measure by itself until the SMR has moved.
    pub(super) fn stays(&mut self) {
        self.measured_at = self.points.back().map(|(_, point)| *point).or(self.measured_at);
    }

    /// What there is to see, at row `row` of the plan.
    pub(super) fn view(&self, session: &Session, row: Option<usize>) -> Option<LiveView> {
        let latest = self.latest.as_ref()?;
        let rest = self.rest();
        let centre = self.points.back().map(|(_, point)| *point);
        let last = self.points.back().map_or(0.0, |(at, _)| *at);
        let row_view = |pick: &dyn Fn(usize) -> Option<f64>| row.and_then(pick);
        Some(LiveView {
            point_mm: latest.point.map(|point| point.coords.map(to_mm).into()),
            is_blind: latest.is_blind,
            silent_s: latest.silent,
            rest_s: rest.map(|(seconds, _)| seconds),
            scatter_mm: rest.map(|(_, scatter)| to_mm(scatter)),
            from_predicted_mm: row_view(&|row| self.off_predicted(session, row).map(|(distance, _)| to_mm(distance))),
            joints: latest.joints.clone(),
            joint_difference: row.and_then(|row| {
                self.joint_difference(session, row).map(|(joint, difference)| (joint, to_deg(difference)))
            }),
            is_still: latest.is_still,
            down: latest.down.clone(),
            track: self
                .points
                .iter()
                .map(|(at, point)| LivePoint {
                    seconds: at - last,
                    offset_mm: centre.map_or(0.0, |centre| to_mm((point - centre).norm())),
                })
                .collect(),
        })
    }
}

/// Where the nominal arm has the reflector (m).
fn predicted(session: &Session, q: &[f64]) -> Option<Point3<f64>> {
    let profile = session.mounted_profile()?;
    let target = profile.targets().first()?.position_in_flange;
    (q.len() == profile.chain().dof()).then(|| ForwardKinematics::new(profile.chain()).point_in_base(q, &target))
}
