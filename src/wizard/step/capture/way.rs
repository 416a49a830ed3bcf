//! The way from where the arm is to the pose shown: its stops, and whether its next move was checked for collisions.

use crate::procedure::way::{WayCheck, first_free, home};
use crate::session::plan::PoseKind;
use crate::session::state::{Row, Session, Stop};
use crate::wizard::live::AS_PLANNED;
use crate::wizard::view::MoveCheck;

/// A configuration to drive through.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Waypoint {
    /// Name in the plan, such as `home`.
    pub(super) name: String,
    /// Pendant values (rad, m).
    pub(super) configuration: Vec<f64>,
}

/// The way to a pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Way {
    /// Stops before the pose, in order.
    pub(super) stops: Vec<Waypoint>,
    /// Check of the next move.
    pub(super) check: MoveCheck,
    /// Whether it can be replaced by a way through home.
    pub(super) can_go_home: bool,
}

impl Way {
    /// The way to a row of the plan.
    pub(super) fn to(row: usize, session: &Session) -> Self {
        let Some(target) = session.rows.get(row).map(|row| &row.planned.configuration) else { return Self::default() };
        let before = unmeasured_before(row, session);
        let home = home_stop(session);
        let Some((from, arm)) = session.arm() else {
            // The program begins at home. Nobody knows what lies between there and where the arm is.
            let stops = if before.is_empty() { home.into_iter().collect() } else { before };
            let reason = "it is not known where the arm is now".to_owned();
            return Self { stops, check: MoveCheck::NotChecked { reason }, can_go_home: false };
        };
        if is_near(&arm, target) {
            return Self::default();
        }
        // After a break nobody knows that the arm is still there.
        let is_home = home.as_ref().is_none_or(|home| session.is_stop_certain && is_near(&arm, &home.configuration));
        let through_home = session.through_home == Some(row) && !is_home;
        let candidates = candidates(row, session, &arm, before, home.as_ref().filter(|_| !is_home), through_home);
        let Some(profile) = session.mounted_profile() else { return Self::default() };
        let ways: Vec<Vec<&[f64]>> = candidates
            .iter()
            .map(|stops| {
                let inner = stops.iter().map(|stop| stop.configuration.as_slice());
                std::iter::once(arm.as_slice()).chain(inner).chain([target.as_slice()]).collect()
            })
            .collect();
        let (index, check) = match first_free(&profile, &ways) {
            WayCheck::Free(index) => (index, MoveCheck::Free { from: from.clone() }),
            WayCheck::Blocked { obstruction } => {
                (0, MoveCheck::Blocked { from: from.clone(), obstruction: obstruction.to_string() })
            }
            WayCheck::NotChecked { reason } => (0, MoveCheck::NotChecked { reason }),
        };
        let check = match check {
            MoveCheck::Free { .. } if !session.is_stop_certain => MoveCheck::NotChecked {
                reason: "the program was not running, and the arm may have been moved".to_owned(),
            },
            check => check,
        };
        let stops = candidates.into_iter().nth(index).unwrap_or_default();
        let goes_home = stops.first().is_some_and(|stop| stop.name == PoseKind::Home.name());
        Self { stops, check, can_go_home: !is_home && !goes_home }
    }
}

/// Whether two configurations are the same to the driver of a pendant.
fn is_near(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| (one - other).abs() <= AS_PLANNED)
}

/// Possible ways, the preferred one first. Without free ways the first one is shown.
fn candidates(
    row: usize,
    session: &Session,
    arm: &[f64],
    before: Vec<Waypoint>,
    home: Option<&Waypoint>,
    through_home: bool,
) -> Vec<Vec<Waypoint>> {
    let after_arm = match session.last_stop {
        Some(Stop::Sample(number)) => {
            session.sample(number).map(|sample| unmeasured_after(sample.row, session)).unwrap_or_default()
        }
        Some(Stop::Passed { .. }) | None => Vec::new(),
    };
    let is_via = |stop: &Waypoint| home.is_none_or(|home| !is_near(&stop.configuration, &home.configuration));
    let vias = |stops: &[Waypoint]| stops.iter().filter(|stop| is_via(stop)).cloned().collect::<Vec<_>>();
    let (leaving, arriving) = (vias(&after_arm), vias(&before));
    let home = home.map(std::slice::from_ref).unwrap_or_default();
    let around =
        [home.to_vec(), [home, &arriving].concat(), [&leaving, home].concat(), [&leaving, home, &arriving].concat()];
    if through_home {
        return around.to_vec();
    }
    let planned = planned_stops(row, session, arm, &before);
    let direct = [Vec::new(), before];
    planned.into_iter().chain(direct).chain(around).collect()
}

/// The stops of the plan that lie between the arm and the row, if the arm is where the plan comes from.
fn planned_stops(row: usize, session: &Session, arm: &[f64], before: &[Waypoint]) -> Option<Vec<Waypoint>> {
    if let Some(passed) = before.iter().rposition(|stop| is_near(&stop.configuration, arm)) {
        return before.get(passed + 1..).map(<[_]>::to_vec);
    }
    let previous = row.checked_sub(before.len() + 1).and_then(|index| session.rows.get(index))?;
    is_near(&previous.planned.configuration, arm).then(|| before.to_vec())
}

/// The stops of the plan right before a row.
fn unmeasured_before(row: usize, session: &Session) -> Vec<Waypoint> {
    let before = session.rows.get(..row).unwrap_or_default();
    let mut stops: Vec<Waypoint> = before.iter().rev().take_while(|row| is_stop(row)).map(waypoint).collect();
    stops.reverse();
    stops
}

/// The stops of the plan right after a row.
fn unmeasured_after(row: usize, session: &Session) -> Vec<Waypoint> {
    let after = session.rows.get(row + 1..).unwrap_or_default();
    after.iter().take_while(|row| is_stop(row)).map(waypoint).collect()
}

const fn is_stop(row: &Row) -> bool {
    row.active && !row.planned.kind.is_measured()
}

fn waypoint(row: &Row) -> Waypoint {
    Waypoint { name: row.planned.pose.clone(), configuration: row.planned.configuration.clone() }
}

/// Home of the plan, or else of the profile.
fn home_stop(session: &Session) -> Option<Waypoint> {
    let planned = session.rows.iter().find(|row| row.active && row.planned.kind == PoseKind::Home).map(waypoint);
    planned.or_else(|| {
        let configuration = home(&session.mounted_profile()?)?;
        Some(Waypoint { name: PoseKind::Home.name().to_owned(), configuration })
    })
}
