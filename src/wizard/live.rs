//! Live readings between measurements: whether the SMR is at rest and where it should be, and whether the robot is at the planned
//! configuration. They can trigger an automatic measurement.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use crate::kinematics::ForwardKinematics;
use crate::session::journal::to_edge;
use crate::session::plan::PoseKind;
use crate::session::reading::LiveReading;
use crate::session::state::Session;
use crate::session::station;
use crate::units::{DEGREE, MILLIMETRE, to_deg, to_mm};

use super::view::{LivePoint, LiveView};

/// Time for which points are kept (s).
const KEPT: f64 = 5.0;
/// Largest number of points kept.
const MOST: usize = 128;
/// Radius around the present position within which the SMR counts as being at rest (m).
const REST: f64 = 0.1 * MILLIMETRE;
/// Rest time that triggers an automatic measurement (s).
pub(super) const REST_TIME: f64 = 2.0;
/// Distance that the SMR has to move before the next automatic measurement (m).
const MOVED: f64 = 5.0 * MILLIMETRE;
/// Distance from its predicted position within which the SMR is at the pose shown (m).
const NEAR: f64 = 30.0 * MILLIMETRE;
/// The same as a multiple of the registration residual, if that is larger.
const NEAR_SPREADS: f64 = 4.0;
/// How much farther away than the nearest predicted position the next one has to be, so that a pose is recognised by it.
const UNIQUE: f64 = 3.0;
/// Largest difference of a joint from the plan at which the robot is at the planned configuration (rad).
pub(super) const AS_PLANNED: f64 = 0.05 * DEGREE;

/// The last seconds of live readings.
#[derive(Clone, Debug, Default)]
pub(super) struct Live {
    latest: Option<LiveReading>,
    points: VecDeque<(f64, Point3<f64>)>,
    /// Position of the last measurement or undo, until the SMR is seen elsewhere.
    measured_at: Option<Point3<f64>>,
    /// Whether the SMR was seen since the link was established.
    has_seen: bool,
}

impl Live {
    /// Takes a reading. `last_sample` is the last point of the session (m).
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

    /// Why the link is down, if it is.
    pub(super) fn down(&self) -> Option<&str> {
        self.latest.as_ref()?.down.as_deref()
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// How long the SMR has been at rest (s), and its scatter during that time (m, RMS).
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

    /// Distance of the SMR from its predicted position at `row`, and the registration residual (m, RMS).
    fn off_predicted(&self, session: &Session, row: usize) -> Option<(f64, f64)> {
        let (_, here) = *self.points.back()?;
        let registered = station::registration(session)?;
        let predicted = predicted(session, &session.rows.get(row)?.planned.configuration)?;
        Some(((registered.to_from_from * here - predicted).norm(), registered.rms))
    }

    /// Whether the robot reports that it is at rest in a configuration.
    pub(super) fn rests_at(&self, configuration: &[f64]) -> bool {
        let Some(LiveReading { joints: Some(joints), is_still, .. }) = &self.latest else { return false };
        let is_near = |(joint, wanted): (&f64, &f64)| (joint - wanted).abs() <= AS_PLANNED;
        *is_still != Some(false) && joints.len() == configuration.len() && joints.iter().zip(configuration).all(is_near)
    }

    /// The joint that is farthest from the plan, and its difference (rad).
    fn joint_difference(&self, session: &Session, row: usize) -> Option<(usize, f64)> {
        let joints = self.latest.as_ref()?.joints.as_ref()?;
        let planned = &session.rows.get(row)?.planned.configuration;
        if joints.len() != planned.len() {
            return None;
        }
        let differences = joints.iter().zip(planned).map(|(joint, planned)| (joint - planned).abs());
        differences.enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other))
    }

    /// Whether SMR and robot have come to rest since the last measurement.
    fn has_arrived(&self) -> bool {
        let Some(latest) = self.latest.as_ref().filter(|latest| latest.down.is_none()) else { return false };
        let smr_rests = self.rest().is_some_and(|(seconds, _)| seconds >= REST_TIME);
        let robot_rests = latest.is_still != Some(false);
        self.measured_at.is_none() && smr_rests && robot_rests
    }

    /// Whether to measure `row` automatically now.
    pub(super) fn is_time(&self, session: &Session, row: usize) -> bool {
        self.has_arrived() && self.is_at(session, row)
    }

    /// The open row at which the robot has come to rest, if that is not `shown`: by the joints that the robot reports, or else by
    /// where the SMR is. A repeated pose is only expected where the plan has it.
    pub(super) fn recognised(&self, session: &Session, shown: usize) -> Option<usize> {
        if !self.has_arrived() || self.is_at(session, shown) {
            return None;
        }
        let is_candidate = |row: &usize| {
            let kind = session.rows.get(*row).map(|row| row.planned.kind);
            *row != shown && kind.is_some_and(|kind| kind != PoseKind::Drift)
        };
        let (before, after): (Vec<usize>, Vec<usize>) =
            session.open_rows().filter(is_candidate).partition(|row| *row < shown);
        let mut rows = after.into_iter().chain(before);
        if self.latest.as_ref().is_some_and(|latest| latest.joints.is_some()) {
            let by_joints = |row: &usize| {
                self.joint_difference(session, *row).is_some_and(|(_, difference)| difference <= AS_PLANNED)
            };
            return rows.find(by_joints).filter(|row| self.is_at(session, *row));
        }
        self.nearest(session, rows)
    }

    /// The row whose predicted position the SMR is at, if no other one is nearly as close.
    fn nearest(&self, session: &Session, rows: impl Iterator<Item = usize>) -> Option<usize> {
        let (_, here) = *self.points.back()?;
        let registered = station::registration(session)?;
        let here = registered.to_from_from * here;
        let mut distances: Vec<(f64, usize)> = rows
            .filter_map(|row| {
                Some(((predicted(session, &session.rows.get(row)?.planned.configuration)? - here).norm(), row))
            })
            .collect();
        distances.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        let limit = NEAR.max(NEAR_SPREADS * registered.rms);
        let (nearest, row) = *distances.first()?;
        let is_unique = distances.get(1).is_none_or(|(second, _)| *second > limit + UNIQUE * nearest);
        (nearest <= limit && is_unique).then_some(row)
    }

    /// Whether the robot is at the pose of `row`. Without joint values, and before the tracker is registered, nothing tells
    /// which pose this is.
    fn is_at(&self, session: &Session, row: usize) -> bool {
        let by_joints = self.joint_difference(session, row).map(|(_, difference)| difference <= AS_PLANNED);
        let by_point = self.off_predicted(session, row).map(|(distance, rms)| distance <= NEAR.max(NEAR_SPREADS * rms));
        match (by_joints, by_point) {
            (Some(joints), Some(point)) => joints && point,
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => false,
        }
    }

    /// Suspends automatic measuring until the SMR has moved, after a measurement or an undo at this position.
    pub(super) fn hold_until_moved(&mut self) {
        self.measured_at = self.points.back().map(|(_, point)| *point).or(self.measured_at);
    }

    /// The view at `row` of the plan.
    pub(super) fn view(&self, session: &Session, row: Option<usize>) -> Option<LiveView> {
        let latest = self.latest.as_ref()?;
        let rest = self.rest();
        let centre = self.points.back().map(|(_, point)| *point);
        let last = self.points.back().map_or(0.0, |(at, _)| *at);
        Some(LiveView {
            point_mm: latest.point.map(|point| point.coords.map(to_mm).into()),
            is_blind: latest.is_blind,
            silent_s: latest.silent,
            rest_s: rest.map(|(seconds, _)| seconds),
            scatter_mm: rest.map(|(_, scatter)| to_mm(scatter)),
            from_predicted_mm: row
                .and_then(|row| self.off_predicted(session, row))
                .map(|(distance, _)| to_mm(distance)),
            joints: latest.joints.clone(),
            joints_shown: latest.joints.as_deref().map(|joints| shown(session, joints)).unwrap_or_default(),
            flange_in_base_mm: latest.joints.as_deref().and_then(|joints| in_base(session, joints, false)),
            smr_in_base_mm: latest.joints.as_deref().and_then(|joints| in_base(session, joints, true)),
            joint_difference: row
                .and_then(|row| self.joint_difference(session, row))
                .map(|(joint, difference)| (joint, to_deg(difference))),
            is_still: latest.is_still,
            at_pose: row
                .and_then(|row| self.recognised(session, row))
                .and_then(|row| session.rows.get(row))
                .map(|row| row.planned.pose.clone()),
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

/// Joint values as the pendant shows them.
fn shown(session: &Session, q: &[f64]) -> Vec<f64> {
    session.robot.as_ref().map(|robot| to_edge(q, &robot.joint_types)).unwrap_or_default()
}

/// Where the nominal arm has the flange, or the SMR on it, in the base (mm).
fn in_base(session: &Session, q: &[f64], has_smr: bool) -> Option<[f64; 3]> {
    if has_smr {
        return predicted(session, q).map(|point| point.coords.map(to_mm).into());
    }
    let profile = &session.robot.as_ref()?.profile;
    let flange = (q.len() == profile.chain().dof())
        .then(|| ForwardKinematics::new(profile.chain()).point_in_base(q, &Point3::origin()));
    flange.map(|point| point.coords.map(to_mm).into())
}

/// Position of the SMR as predicted by the nominal arm (m).
fn predicted(session: &Session, q: &[f64]) -> Option<Point3<f64>> {
    let profile = session.mounted_profile()?;
    let target = profile.targets().first()?.position_in_flange;
    (q.len() == profile.chain().dof()).then(|| ForwardKinematics::new(profile.chain()).point_in_base(q, &target))
}
