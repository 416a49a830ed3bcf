//! Turning the tracker to where the SMR will be, once the measured points tell where the tracker is. Turning by hand is the default.

use nalgebra::{Isometry3, Point3};

use super::effect::Request;
use super::intent::{Danger, Intent, IntentInfo};
use super::notice::Notice;
use super::step::Action;
use crate::kinematics::ForwardKinematics;
use crate::session::journal::to_xyz_mm;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::state::Session;
use crate::session::station;
use crate::session::wire::{WireAddress, WireProtocol};
use crate::units::{DEGREE, to_deg};

/// Largest angle by which the tracker is turned at once (rad).
const LARGEST_TURN: f64 = 60.0 * DEGREE;
/// Nearest place to which it is turned (m).
const NEAREST: f64 = 0.3;

/// Where the SMR will be at a pose, in the frame of the tracker.
struct Aim {
    at: Point3<f64>,
    /// Angle from where the SMR was seen last (rad).
    turn: f64,
}

/// Whether the instrument can be turned from here.
fn can_turn(session: &Session) -> bool {
    let of = |protocol: WireProtocol| protocol.can_be_turned();
    match &session.instrument {
        Some(InstrumentChoice::Linked(choice)) => {
            choice.address.parse::<WireAddress>().is_ok_and(|address| of(address.protocol))
        }
        Some(InstrumentChoice::Simulated(simulation)) => simulation.wires.iter().any(|wire| of(wire.protocol())),
        Some(InstrumentChoice::Manual { .. } | InstrumentChoice::Replay { .. }) | None => false,
    }
}

fn aim(session: &Session, row: usize) -> Result<Aim, String> {
    let found = station::registration(session)
        .ok_or_else(|| format!("where the tracker is shows after {} measured poses", station::FEWEST))?;
    let tracker_from_base: Isometry3<f64> = found.to_from_from.inverse();
    let profile = session.mounted_profile().ok_or("there is no robot")?;
    let planned = session.rows.get(row).ok_or("there is no pose")?;
    let target = profile.targets().first().ok_or("the profile has no SMR")?.position_in_flange;
    let place = ForwardKinematics::new(profile.chain()).point_in_base(&planned.planned.configuration, &target);
    let at = tracker_from_base * place;
    let last = session.samples.last().ok_or("nothing was measured")?;
    let turn = session.point_of(last).coords.angle(&at.coords);
    if at.coords.norm() < NEAREST {
        return Err("the SMR will be too near to the tracker".to_owned());
    }
    if turn > LARGEST_TURN {
        return Err(format!(
            "the tracker would turn by {:.0} deg, at most {:.0} deg are allowed at once: turn it by hand",
            to_deg(turn),
            to_deg(LARGEST_TURN)
        ));
    }
    Ok(Aim { at, turn })
}

/// The offer to turn the tracker to the SMR at the pose that is shown.
pub(super) fn offer(step: Step, session: &Session, row: Option<usize>, is_connected: bool) -> Option<IntentInfo> {
    if step != Step::Capture || !can_turn(session) {
        return None;
    }
    let row = row?;
    let pose = session.rows.get(row).map_or("", |row| row.planned.pose.as_str());
    let info = match aim(session, row) {
        Ok(aim) => {
            let label = format!("turn the tracker by {:.0} deg to the SMR at pose {pose}", to_deg(aim.turn));
            IntentInfo::new(Intent::TurnTracker, label)
                .unless((!is_connected).then(|| "the instrument is not responding".to_owned()))
        }
        Err(reason) => IntentInfo::new(Intent::TurnTracker, "turn the tracker to the SMR").unless(Some(reason)),
    };
    Some(info.with_danger(Danger::Turns))
}

/// Turns the tracker.
pub(super) fn turn(session: &Session, row: Option<usize>) -> Vec<Action> {
    match row.ok_or_else(|| "no pose is shown".to_owned()).and_then(|row| aim(session, row)) {
        Ok(aim) => vec![Action::Ask(Request::Turn { at_mm: to_xyz_mm(&aim.at, 3) })],
        Err(reason) => vec![Action::Say(Notice::error(reason))],
    }
}

/// What is said once the tracker has found the SMR.
pub(super) fn turned() -> Notice {
    Notice::info("the tracker has turned and has found the SMR").hint("measure when the robot rests")
}
