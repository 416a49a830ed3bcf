//! The joint check: each joint is moved by a few degrees and measured, before a plan is made.

use super::{Action, Condition, Cx, require};
use crate::identification::joint_check::{CheckedStop, JointCheck, JointFault, JointSeen, check_joints};
use crate::kinematics::Joint;
use crate::profile::{FREE_TARGET_UNCERTAINTY, Profile, builtin};
use crate::session::journal::{Entry, JointPointText, from_edge, from_xyz_mm, to_edge, to_xyz_mm};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice};
use crate::session::state::{Robot, Session};
use crate::text::listed;
use crate::units::{MILLIMETRE, to_mm};
use crate::wizard::effect::JointCheckStop;
use crate::wizard::notice::Notice;
use crate::wizard::reading;
use crate::wizard::step::plan::measuring_pace;
use crate::wizard::view::{JointCheckRow, JointCheckVerdict, JointCheckView, JointShown};

/// σ of a coordinate (m) if the profile states no instrument.
const UNKNOWN_SIGMA: f64 = 0.05 * MILLIMETRE;

/// Whether the joint check is advisable: the profile is no shipped one, and nothing was measured yet.
pub(super) fn is_advisable(session: &Session) -> bool {
    let is_new = session.robot.as_ref().is_some_and(|robot| builtin(&robot.source).is_none());
    is_new && session.joint_check.is_empty() && session.samples.is_empty()
}

/// The next stop of a check.
pub(super) fn next<'a>(plan: &'a [JointCheckStop], session: &Session) -> Option<&'a JointCheckStop> {
    plan.get(session.joint_check.len())
}

/// Name of the stop for the instrument and the journal.
pub(super) fn stop_name(robot: &Robot, stop: &JointCheckStop) -> String {
    let joint = stop.joint.and_then(|joint| robot.profile.chain().joints().get(joint));
    joint.map_or_else(|| "check-start".to_owned(), |joint| format!("check-{}", joint.name))
}

/// The request to measure the next stop.
pub(super) fn request(plan: &[JointCheckStop], cx: &Cx<'_>) -> Option<MeasureRequest> {
    let stop = next(plan, cx.session)?;
    let pace = measuring_pace();
    Some(MeasureRequest {
        number: cx.session.measurements + 1,
        pose: stop_name(cx.robot()?, stop),
        target: 0,
        configuration: stop.configuration.clone(),
        following: plan.get(cx.session.joint_check.len() + 1).map(|stop| stop.configuration.clone()),
        settle: pace.settle,
        shots: pace.shots,
    })
}

/// Takes a reading of the next stop.
pub(super) fn take(plan: &[JointCheckStop], reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
    let (Some(stop), Some(robot)) = (next(plan, cx.session), cx.robot()) else { return Vec::new() };
    let number = cx.session.measurements + 1;
    let xyz_mm = to_xyz_mm(&reading.point, 9);
    let previous = cx.session.joint_check.last().map(|point| from_xyz_mm(point.xyz_mm));
    let sigma = reading.sigma.or_else(|| robot.profile.instrument().map(|instrument| instrument.sigma));
    let limit = reading::scatter_limit(sigma);
    let too_much = reading.scatter.filter(|scatter| scatter.is_nan() || *scatter > limit);
    let refusal = reading::gate(&from_xyz_mm(xyz_mm), previous.as_ref())
        .or_else(|| reading::foreign_joints(reading, robot.joint_types.len()))
        .or_else(|| too_much.map(|scatter| reading::scatter_message(scatter, limit)));
    if let Some(reason) = refusal {
        let pose = stop_name(robot, stop);
        let notice = Notice::error(reason.clone()).hint("measure again");
        return vec![Action::Write(vec![Entry::Refused { number, pose, reason, xyz_mm: None }]), Action::Say(notice)];
    }
    let joints = reading.configuration.as_deref().unwrap_or(&stop.configuration);
    vec![Action::Write(vec![Entry::JointCheckPoint(JointPointText {
        number,
        joint: stop.joint,
        joints: to_edge(joints, &robot.joint_types),
        xyz_mm,
    })])]
}

/// Whether the check can be started or continued.
pub(super) fn can_start(plan: &[JointCheckStop], session: &Session) -> Condition {
    let joints = session.robot.as_ref().map_or(0, |robot| robot.joint_types.len());
    let is_complete = session.joint_check.len() > joints;
    require(next(plan, session).is_none(), "the joint check is already being measured")
        .and_then(|()| require(!is_complete, "the joints are checked; measure the check again to repeat it"))
}

/// What the points of the check say.
enum Outcome {
    /// Points are missing.
    Incomplete,
    /// No arm fits them.
    Undetermined,
    Checked(JointCheck),
}

fn outcome(session: &Session) -> Outcome {
    let Some((profile, robot)) = session.mounted_profile().zip(session.robot.as_ref()) else {
        return Outcome::Incomplete;
    };
    let Some(target) = profile.targets().first() else { return Outcome::Incomplete };
    if session.joint_check.len() <= profile.chain().dof() {
        return Outcome::Incomplete;
    }
    let stops: Vec<CheckedStop> = session
        .joint_check
        .iter()
        .map(|point| CheckedStop {
            joint: point.joint,
            configuration: from_edge(&point.joints, &robot.joint_types),
            point: from_xyz_mm(point.xyz_mm),
        })
        .collect();
    let distance = profile.tracker().position_in_base.coords.norm();
    let sigma = profile.instrument().map_or(UNKNOWN_SIGMA, |instrument| instrument.sigma_at(distance));
    let expected = (target.position_in_flange, target.uncertainty.max(FREE_TARGET_UNCERTAINTY));
    check_joints(profile.chain(), &stops, expected, sigma).map_or(Outcome::Undetermined, Outcome::Checked)
}

/// A fault in words, with what to change in the profile.
fn fault_text(fault: &JointFault, joints: &[Joint]) -> String {
    let name = |joint: usize| joints.get(joint).map_or("?", |joint| joint.name.as_str());
    let quantity = |joint: usize| joints.get(joint).map(|joint| joint.joint_type.quantity());
    match *fault {
        JointFault::Reversed { joint } => {
            let name = name(joint);
            format!("{name} moves the other way than the profile says: reverse 'direction' of {name} in the profile")
        }
        JointFault::Unit { joint, factor } => {
            let unit = quantity(joint).map_or("deg", |quantity| quantity.unit());
            let name = name(joint);
            format!(
                "{name} moves {factor:.4} times as far as shown: its values are not in {unit}; check the unit of {name} on the pendant, or its gear ratio"
            )
        }
        JointFault::Zero { joint, offset } => {
            let (offset, unit) =
                quantity(joint).map_or((offset, "rad"), |quantity| (quantity.to_edge(offset), quantity.unit()));
            let name = name(joint);
            format!(
                "the zero of {name} is elsewhere: the points fit with {offset:+.1} {unit} added to its value; check the mastering of {name}, or its zero in the profile"
            )
        }
        JointFault::Coupled { joint, with, factor } => {
            let (name, with) = (name(joint), name(with));
            format!(
                "{name} moves with {with}, or the profile says so and the robot does not: the points fit with {factor:+.0} times {with} added to {name}; change 'coupling' of {name} in the profile"
            )
        }
        JointFault::Mirrored => {
            "the points fit only when mirrored: the frame of the instrument is left-handed; reverse one of its axes"
                .to_owned()
        }
    }
}

fn verdict(check: &JointCheck, profile: &Profile) -> JointCheckVerdict {
    let joints = profile.chain().joints();
    let mut faults: Vec<String> = check.faults.iter().map(|fault| fault_text(fault, joints)).collect();
    if check.is_unexplained {
        faults.push(format!(
            "the points are {:.1} mm (rms) from where the arm should have them, and no single cause explains it: measure the check again; if it stays, check the dimensions in the profile",
            to_mm(check.rms)
        ));
    }
    let row = |(index, (joint, seen)): (usize, (&Joint, &JointSeen))| {
        let quantity = joint.joint_type.quantity();
        let edge = |(value, sigma): (f64, f64)| (quantity.to_edge(value), quantity.to_edge(sigma));
        JointCheckRow {
            name: joint.name.clone(),
            unit: quantity.unit().to_owned(),
            asked: quantity.to_edge(seen.asked),
            seen: seen.seen.map(edge),
            zero: seen.zero.map(edge),
            is_right: seen.is_right() && check.faults.iter().all(|fault| fault.joint() != Some(index)),
        }
    };
    let (point, sigma) = (check.point_in_flange, check.sigma);
    JointCheckVerdict {
        faults,
        joints: joints.iter().zip(&check.joints).enumerate().map(row).collect(),
        smr_mm: [point.x, point.y, point.z].map(to_mm),
        smr_sigma_mm: [sigma.x, sigma.y, sigma.z].map(to_mm),
        rms_mm: to_mm(check.rms),
    }
}

/// The message about a complete check.
pub(super) fn conclusion(session: &Session) -> Option<Notice> {
    let profile = session.mounted_profile()?;
    let check = match outcome(session) {
        Outcome::Incomplete => return None,
        Outcome::Undetermined => {
            return Some(Notice::error("the points of the joint check determine nothing").hint("measure them again"));
        }
        Outcome::Checked(check) => check,
    };
    let verdict = verdict(&check, &profile);
    let Some(first) = verdict.faults.first() else {
        return Some(
            Notice::info(format!(
                "all joints are as the profile says: sign, zero, unit and coupling; the points fit to {:.2} mm",
                verdict.rms_mm
            ))
            .hint("continue with the plan"),
        );
    };
    let wrong: Vec<&str> =
        verdict.joints.iter().filter(|joint| !joint.is_right).map(|joint| joint.name.as_str()).collect();
    let what = if wrong.is_empty() { first.clone() } else { format!("check {}: {first}", listed(&wrong)) };
    Some(Notice::attention(what).hint("do not measure a plan with this profile: correct it and start again with it"))
}

/// The view of the check; `None` before it has begun.
pub(super) fn view(plan: &[JointCheckStop], cx: &Cx<'_>) -> Option<JointCheckView> {
    let session = cx.session;
    if plan.is_empty() && session.joint_check.is_empty() {
        return None;
    }
    let profile = session.mounted_profile()?;
    let joints = profile.chain().joints();
    let next = next(plan, session);
    let before = session.joint_check.last().map(|point| &point.joints);
    let shown = next.map_or(&[][..], |stop| stop.configuration.as_slice());
    let moved = next.and_then(|stop| stop.joint);
    let outcome = outcome(session);
    Some(JointCheckView {
        joint: moved.and_then(|joint| joints.get(joint)).map(|joint| joint.name.clone()),
        joints: joints
            .iter()
            .zip(shown)
            .enumerate()
            .map(|(index, (joint, value))| {
                let quantity = joint.joint_type.quantity();
                let value = quantity.to_edge(*value);
                let from = before.and_then(|before| before.get(index)).copied().unwrap_or(value);
                JointShown {
                    name: joint.name.clone(),
                    value,
                    unit: quantity.unit().to_owned(),
                    moves: (value - from).abs(),
                    moves_most: moved == Some(index),
                }
            })
            .collect(),
        measured: session.joint_check.len(),
        of: joints.len() + 1,
        problem: matches!(outcome, Outcome::Undetermined)
            .then(|| "the points determine nothing: measure them again".to_owned()),
        verdict: if let Outcome::Checked(check) = outcome { Some(verdict(&check, &profile)) } else { None },
        typed_unit: match session.instrument {
            Some(InstrumentChoice::Manual { unit }) => Some(CoordinateUnit::sign(unit).to_owned()),
            _ => None,
        },
    })
}
