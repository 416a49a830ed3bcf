//! Step Target: where the SMR sits on the flange.

mod arm;
mod joint_check;

use nalgebra::Point3;

use std::collections::BTreeSet;

use super::plan::measuring_pace;
use super::{Action, Condition, Cx, StepMachine, offer, require, with_default};
use crate::identification::circle_point::{CirclePointError, CircleSeries, MeasuredArm, TargetLocation, locate_target};
use crate::profile::{FREE_TARGET_UNCERTAINTY, Level};
use crate::session::journal::{Entry, JointPointText, from_edge, from_xyz_mm, target_text, to_edge, to_xyz_mm};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, PayloadText, Step, TargetChoice};
use crate::session::state::{Robot, Session};
use crate::units::{to_deg, to_mm};
use crate::wizard::effect::{Answer, CircleConfigurations, JointCheckStop, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::reading;
use crate::wizard::view::{CircleView, CirclesResult, CirclesView, Content, JointShown, TargetView};

/// The target step with the planned circles. The measured points of the circles are in the session.
#[derive(Clone, Debug, Default)]
pub(in crate::wizard) struct TargetStep {
    plan: Vec<CircleConfigurations>,
    /// The whole arm, once every joint was moved.
    arm: Option<Result<Box<MeasuredArm>, String>>,
    /// Stops of the joint check, once it was started.
    check: Vec<JointCheckStop>,
}

/// The next point of a circle to measure.
struct NextPoint<'a> {
    joint: usize,
    configuration: &'a [f64],
    following: Option<&'a [f64]>,
    index: usize,
}

impl TargetStep {
    /// Enters the step. Circles that were started are planned again when they are continued.
    pub(super) fn enter(session: &Session) -> Self {
        let is_complete = is_whole(session) && moved_joints(session) == dof(session);
        Self { arm: is_complete.then(|| arm::measured(session)), ..Self::default() }
    }

    /// All planned points, in order.
    fn points(&self) -> Vec<(usize, &[f64])> {
        self.plan.iter().flat_map(|circle| circle.configurations.iter().map(|q| (circle.joint, q.as_slice()))).collect()
    }

    /// The first point that has not been measured.
    fn next<'a>(&'a self, session: &Session) -> Option<NextPoint<'a>> {
        let index = session.circle_points.len();
        let points = self.points();
        let (joint, configuration) = *points.get(index)?;
        let following = points.get(index + 1).map(|(_, q)| *q);
        Some(NextPoint { joint, configuration, following, index })
    }

    /// Takes a reading for the joint check or for a circle, whichever is being measured.
    fn take_any(&self, reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
        if joint_check::next(&self.check, cx.session).is_some() {
            return joint_check::take(&self.check, reading, cx);
        }
        self.take(reading, cx)
    }

    fn take(&self, reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
        let (Some(next), Some(robot)) = (self.next(cx.session), cx.robot()) else { return Vec::new() };
        let number = cx.session.measurements + 1;
        let previous = cx.session.circle_points.last().map(|point| from_xyz_mm(point.xyz_mm));
        let sigma = reading.sigma.or_else(|| robot.profile.instrument().map(|instrument| instrument.sigma));
        let limit = reading::scatter_limit(sigma);
        let too_much = reading.scatter.filter(|scatter| scatter.is_nan() || *scatter > limit);
        // Compared as it will be written, because the previous point was rounded as well.
        let xyz_mm = to_xyz_mm(&reading.point, 9);
        let refusal = reading::gate(&from_xyz_mm(xyz_mm), previous.as_ref())
            .or_else(|| reading::foreign_joints(reading, robot.joint_types.len()))
            .or_else(|| too_much.map(|scatter| reading::scatter_message(scatter, limit)));
        if let Some(reason) = refusal {
            let pose = pose_name(robot, next.joint, next.index);
            let notice = Notice::error(reason.clone()).hint("measure again");
            return vec![
                Action::Write(vec![Entry::Refused { number, pose, reason, xyz_mm: None }]),
                Action::Say(notice),
            ];
        }
        let joints = reading.configuration.as_deref().unwrap_or(next.configuration);
        vec![Action::Write(vec![Entry::CirclePoint(JointPointText {
            number,
            joint: next.joint,
            joints: to_edge(joints, &robot.joint_types),
            xyz_mm,
        })])]
    }
}

fn dof(session: &Session) -> usize {
    session.robot.as_ref().map_or(0, |robot| robot.profile.chain().dof())
}

/// Number of joints of which there are points.
fn moved_joints(session: &Session) -> usize {
    session.circle_points.iter().map(|point| point.joint).collect::<BTreeSet<_>>().len()
}

/// Whether the circles are those of the whole arm, which begin with the first joint and not with the last.
fn is_whole(session: &Session) -> bool {
    session.circle_points.first().is_some_and(|point| point.joint + 2 < dof(session))
}

/// Pose name of a point of a circle.
fn pose_name(robot: &Robot, joint: usize, index: usize) -> String {
    let name = robot.profile.chain().joints().get(joint).map_or("?", |joint| joint.name.as_str());
    format!("circle-{name}-{}", index + 1)
}

/// The measured part of a circle.
struct MeasuredCircle {
    /// Joint that was turned.
    joint: usize,
    /// Configurations (rad).
    configurations: Vec<Vec<f64>>,
    /// Points measured there (m).
    points: Vec<Point3<f64>>,
}

impl MeasuredCircle {
    fn series(&self) -> CircleSeries<'_> {
        CircleSeries { joint: self.joint, configurations: &self.configurations, points: &self.points }
    }
}

/// Locates the SMR from the measured circles; `None` before both are complete.
fn locate(session: &Session) -> Option<Result<TargetLocation, CirclePointError>> {
    let robot = session.robot.as_ref()?;
    let mut circles: Vec<MeasuredCircle> = Vec::new();
    for point in &session.circle_points {
        let configuration = from_edge(&point.joints, &robot.joint_types);
        let measured = session.point_of_circle(point);
        match circles.iter_mut().find(|circle| circle.joint == point.joint) {
            Some(circle) => {
                circle.configurations.push(configuration);
                circle.points.push(measured);
            }
            None => circles.push(MeasuredCircle {
                joint: point.joint,
                configurations: vec![configuration],
                points: vec![measured],
            }),
        }
    }
    let [first, second] = circles.as_slice() else { return None };
    let profile = &robot.profile;
    let distance = profile.tracker().position_in_base.coords.norm();
    let sigma = profile.instrument().map(|instrument| instrument.sigma_at(distance));
    Some(locate_target(
        profile.chain(),
        &first.series(),
        &second.series(),
        sigma,
        &profile.parameters(Level::Geometric),
    ))
}

/// Whether the circles have a result that can be used.
fn has_result(step: &TargetStep, session: &Session) -> Condition {
    let is_complete = step.next(session).is_none();
    if is_whole(session) {
        return match &step.arm {
            Some(Ok(_)) => Ok(()),
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("the circles are not complete".to_owned()),
        };
    }
    match locate(session) {
        _ if session.circle_points.is_empty() => Err("no circle has been measured".to_owned()),
        Some(Ok(_)) if is_complete => Ok(()),
        Some(Err(error)) if is_complete => Err(error.to_string()),
        _ => Err("the circles are not complete".to_owned()),
    }
}

/// Whether the numbers of a choice are plausible.
fn is_plausible(choice: &TargetChoice) -> bool {
    let is_near = |(x, y, z): (f64, f64, f64)| [x, y, z].iter().all(|value| value.abs() < 5000.0);
    match *choice {
        TargetChoice::Profile => true,
        TargetChoice::Known { xyz_mm, sigma_mm } | TargetChoice::Circles { xyz_mm, sigma_mm } => {
            is_near(xyz_mm) && (0.0..=1000.0).contains(&sigma_mm)
        }
        TargetChoice::Free { sigma_mm } => sigma_mm > 0.0 && sigma_mm <= 1000.0,
    }
}

impl TargetStep {
    /// The offer to measure circles of the last two joints, or of the whole arm.
    fn start_of_circles(&self, of_whole_arm: bool, is_checking: bool, cx: &Cx<'_>) -> IntentInfo {
        let session = cx.session;
        let has_circles = !session.circle_points.is_empty();
        let (intent, label) = match (of_whole_arm, has_circles) {
            (false, false) => (Intent::StartCircles, "find it by circles"),
            (false, true) => (Intent::StartCircles, "continue the circles"),
            (true, false) => (Intent::StartWholeArm, "measure the whole arm"),
            (true, true) => (Intent::StartWholeArm, "continue the whole arm"),
        };
        offer(
            intent,
            label,
            [
                require(
                    session.samples.is_empty(),
                    "samples were measured with this SMR; a different mounting needs a new session",
                ),
                require(
                    !has_circles || is_whole(session) == of_whole_arm,
                    "circles of another kind are measured: restart them first",
                ),
                require(self.plan.is_empty(), "the circles are already being measured"),
                require(!is_checking, "the joint check is being measured"),
                require(cx.connection.is_some(), "the instrument is not responding"),
            ],
        )
    }

    /// Whether the whole arm is measured.
    fn has_arm(&self) -> Condition {
        match &self.arm {
            Some(Ok(_)) => Ok(()),
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("the whole arm is not measured".to_owned()),
        }
    }
}

impl StepMachine for TargetStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let session = cx.session;
        let is_manual = matches!(session.instrument, Some(InstrumentChoice::Manual { .. }));
        let is_checking = joint_check::next(&self.check, session).is_some();
        let is_measuring_circles = self.next(session).is_some() && !is_checking;
        let is_measuring = is_measuring_circles || is_checking;
        let has_circles = !session.circle_points.is_empty();
        let can_change = || {
            require(
                session.samples.is_empty(),
                "samples were measured with this SMR; a different mounting needs a new session",
            )
        };
        let has_choice = || require(session.target.is_some(), "choose where the SMR is first");
        let has_point = || require(is_measuring, "start the circles or the joint check first");
        let is_connected = || require(cx.connection.is_some(), "the instrument is not responding");

        let has_masses = cx.profile().is_some_and(|profile| profile.chain().loads().is_some());

        let as_profile = Intent::ChooseTarget(TargetChoice::Profile);
        let free = Intent::ChooseTarget(TargetChoice::Free { sigma_mm: to_mm(FREE_TARGET_UNCERTAINTY) });
        let type_in = Intent::TypeReading(String::new());
        let check = if session.joint_check.is_empty() { "check the joints" } else { "continue the joint check" };
        let next = match (is_measuring, is_manual) {
            (true, false) => &Intent::Measure,
            (true, true) => &type_in,
            (false, _) if session.target.is_some() && joint_check::is_advisable(session) => &Intent::StartJointCheck,
            (false, _) if session.target.is_some() => &Intent::Next,
            (false, _) => &as_profile,
        };
        let intents = vec![
            offer(Intent::Next, "continue to Plan", [has_choice()]),
            offer(as_profile.clone(), "as the profile says", [can_change()]),
            offer(free, "leave it free", [can_change()]),
            offer(
                Intent::StatePayload(session.payload.unwrap_or_default()),
                "payload",
                [
                    can_change(),
                    require(
                        has_masses,
                        "the profile gives no masses of the arm: without them a payload changes nothing",
                    ),
                ],
            ),
            self.start_of_circles(false, is_checking, cx),
            offer(
                Intent::StartJointCheck,
                check,
                [
                    require(
                        session.samples.is_empty(),
                        "poses are measured already: their distances show wrong joints",
                    ),
                    require(!is_measuring_circles, "the circles are being measured"),
                    joint_check::can_start(&self.check, session),
                    is_connected(),
                ],
            ),
            offer(
                Intent::DiscardJointCheck,
                "restart the joint check",
                [require(!session.joint_check.is_empty(), "no joint has been checked")],
            ),
            self.start_of_circles(true, is_checking, cx),
            offer(Intent::SaveArm, "save the measured arm as a profile", [self.has_arm()]),
            offer(
                Intent::Measure,
                "measure",
                [has_point(), is_connected(), require(!is_manual, "the coordinates are typed in")],
            ),
            offer(
                type_in.clone(),
                "type the coordinates",
                [has_point(), is_connected(), require(is_manual, "the instrument supplies the coordinates")],
            ),
            offer(Intent::UseCircles, "use the result of the circles", [can_change(), has_result(self, session)]),
            offer(
                Intent::DiscardCircles,
                "restart the circles",
                [can_change(), require(has_circles, "no circle has been measured")],
            ),
        ];
        with_default(intents, next)
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        let session = cx.session;
        match intent {
            Intent::ChooseTarget(choice) if is_plausible(&choice) => vec![Action::Write(vec![Entry::Target(choice)])],
            Intent::ChooseTarget(_) => {
                let notice = Notice::error("this is not a plausible SMR position")
                    .hint("coordinates must be below 5 m, and the standard deviation from 0 to 1000 mm");
                vec![Action::Say(notice)]
            }
            Intent::StatePayload(payload) if payload.is_usable() => {
                vec![Action::Write(vec![Entry::Payload(payload)])]
            }
            Intent::StatePayload(_) => {
                let heaviest = PayloadText::HEAVIEST;
                let notice = Notice::error("this is not a plausible payload")
                    .hint(format!("its mass is from 0 to {heaviest} kg, its centre within 10 m of the flange"));
                vec![Action::Say(notice)]
            }
            Intent::StartCircles => {
                let Some(profile) = cx.profile() else { return Vec::new() };
                vec![Action::Ask(Request::PlanCircles { profile: Box::new(profile), is_whole: false })]
            }
            Intent::StartWholeArm => {
                let Some(profile) = cx.profile() else { return Vec::new() };
                vec![Action::Ask(Request::PlanCircles { profile: Box::new(profile), is_whole: true })]
            }
            Intent::SaveArm => {
                let Some(Ok(found)) = &self.arm else { return Vec::new() };
                let file = arm::file(session, found);
                file.map(|file| Action::Ask(Request::Deliver { files: vec![file], left_out: Vec::new() }))
                    .into_iter()
                    .collect()
            }
            Intent::StartJointCheck => {
                let Some(profile) = cx.profile() else { return Vec::new() };
                vec![Action::Ask(Request::PlanJointCheck { profile: Box::new(profile) })]
            }
            Intent::DiscardJointCheck => vec![Action::Write(vec![Entry::JointCheckDiscarded])],
            Intent::Measure if joint_check::next(&self.check, session).is_some() => {
                let request = joint_check::request(&self.check, cx);
                request.map(|request| Action::Ask(Request::Measure(request))).into_iter().collect()
            }
            Intent::Measure => {
                let (Some(next), Some(robot)) = (self.next(session), cx.robot()) else { return Vec::new() };
                let pace = measuring_pace();
                vec![Action::Ask(Request::Measure(MeasureRequest {
                    number: session.measurements + 1,
                    pose: pose_name(robot, next.joint, next.index),
                    target: 0,
                    configuration: next.configuration.to_vec(),
                    following: next.following.map(<[f64]>::to_vec),
                    settle: pace.settle,
                    shots: pace.shots,
                }))]
            }
            Intent::TypeReading(text) => {
                let unit = match session.instrument {
                    Some(InstrumentChoice::Manual { unit }) => unit,
                    _ => CoordinateUnit::default(),
                };
                match reading::parse(&text, unit) {
                    Ok(point) => self.take_any(&reading::typed(point), cx),
                    Err(message) => vec![Action::Say(Notice::error(message))],
                }
            }
            Intent::UseCircles if is_whole(session) => {
                let Some(Ok(found)) = &self.arm else { return Vec::new() };
                let sigma_mm = (to_mm(found.point_sigma.max()).max(1.0) * 1e4).ceil() / 1e4;
                let choice = TargetChoice::Circles { xyz_mm: to_xyz_mm(&found.point_in_flange, 4), sigma_mm };
                vec![Action::Write(vec![Entry::Target(choice)])]
            }
            Intent::UseCircles => {
                let Some(Ok(found)) = locate(session) else { return Vec::new() };
                let sigma_mm = (to_mm(found.sigma().max()) * 1e4).ceil() / 1e4;
                let choice = TargetChoice::Circles { xyz_mm: to_xyz_mm(&found.point_in_flange, 4), sigma_mm };
                vec![Action::Write(vec![Entry::Target(choice)])]
            }
            Intent::DiscardCircles => vec![Action::Write(vec![Entry::CirclesDiscarded])],
            Intent::Next => vec![Action::go(Step::Plan)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        match answer {
            Answer::CirclesPlanned(plan) => {
                self.plan = plan;
                Vec::new()
            }
            Answer::JointCheckPlanned(stops) => {
                self.check = stops;
                Vec::new()
            }
            Answer::Measured(reading) => self.take_any(&reading, cx),
            Answer::Delivered { .. } => vec![Action::Say(
                Notice::info(format!("the measured arm is saved as {} in the folder of the session", arm::ARM_FILE))
                    .hint("choose this file as the robot of a new session"),
            )],
            _ => Vec::new(),
        }
    }

    fn on_failure(&mut self, problem: Problem, cx: &Cx<'_>) -> Vec<Action> {
        if problem.is_unwritten {
            return vec![Action::Say(problem.into())];
        }
        let Some(robot) = cx.robot() else { return vec![Action::Say(problem.into())] };
        if let Some(stop) = joint_check::next(&self.check, cx.session) {
            return cx.refuse(joint_check::stop_name(robot, stop), problem);
        }
        let Some(next) = self.next(cx.session) else { return vec![Action::Say(problem.into())] };
        let pose = pose_name(robot, next.joint, next.index);
        cx.refuse(pose, problem)
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        match entry {
            Entry::CirclesDiscarded => {
                *self = Self { check: std::mem::take(&mut self.check), ..Self::default() };
                Vec::new()
            }
            Entry::CirclePoint(_) if is_whole(cx.session) && self.next(cx.session).is_none() => {
                let found = arm::measured(cx.session);
                let said = match &found {
                    Ok(found) => arm::verdict(found),
                    Err(reason) => Notice::error(reason.clone()).hint("restart the circles and measure them again"),
                };
                self.arm = Some(found);
                vec![Action::Say(said)]
            }
            Entry::JointCheckPoint(_) => joint_check::conclusion(cx.session).map(Action::Say).into_iter().collect(),
            // Only the last point of the last circle shows whether the result can be used.
            Entry::CirclePoint(_) if self.next(cx.session).is_none() => match locate(cx.session) {
                Some(Ok(found)) => vec![Action::Say(verdict(&found, cx.session))],
                Some(Err(error)) => {
                    vec![Action::Say(
                        Notice::error(error.to_string()).hint("measure the circles again, or leave the SMR free"),
                    )]
                }
                None => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let target = cx.robot().and_then(|robot| robot.profile.targets().first());
        Content::Target(Box::new(TargetView {
            nominal_mm: target.map_or([0.0; 3], |target| {
                let point = target.position_in_flange;
                [to_mm(point.x), to_mm(point.y), to_mm(point.z)]
            }),
            nominal_sigma_mm: target.map_or(0.0, |target| to_mm(target.uncertainty)),
            choice: cx.session.target.as_ref().map(target_text),
            payload: cx.session.payload.map(|payload| payload.to_string()),
            circles: self.circles(cx),
            joint_check: joint_check::view(&self.check, cx),
            advises_joint_check: joint_check::is_advisable(cx.session),
        }))
    }
}

/// The message about complete circles.
fn verdict(found: &TargetLocation, session: &Session) -> Notice {
    /// Ratio to the expected residual from which the residual is reported.
    const TOO_LARGE: f64 = 3.0;
    let (rms, expected) = (to_mm(found.rms), to_mm(found.expected_rms));
    if found.rms > TOO_LARGE * found.expected_rms {
        return Notice::attention(format!(
            "the points are {rms:.3} mm (RMS) off the circles, {expected:.3} mm can be expected: a joint value may be wrong, or the SMR has moved"
        ))
        .hint("measure the circles again");
    }
    // With perpendicular last axes a reversed joint leaves no residual. Only the expected position reveals it.
    let target = session.robot.as_ref().and_then(|robot| robot.profile.targets().first());
    if let Some(target) = target {
        let off = (found.point_in_flange - target.position_in_flange).norm();
        let allowed = FREE_TARGET_UNCERTAINTY.max(target.uncertainty);
        if off > allowed {
            return Notice::attention(format!(
                "the SMR is {:.0} mm away from the position in the profile, {:.0} mm can be expected: a different mounting, a joint that turns the other way, or a left-handed frame",
                to_mm(off),
                to_mm(allowed)
            ))
            .hint("look at the flange: is the SMR where the result says? If not, check the joint signs and the tracker frame");
        }
    }
    Notice::info(format!(
        "the circles fit to {rms:.3} mm (RMS); the SMR is known to {:.3} mm",
        to_mm(found.sigma().max())
    ))
}

impl TargetStep {
    fn circles(&self, cx: &Cx<'_>) -> Option<CirclesView> {
        let session = cx.session;
        if self.plan.is_empty() && session.circle_points.is_empty() {
            return None;
        }
        let joints = cx.robot()?.profile.chain().joints();
        let name = |joint: usize| joints.get(joint).map_or_else(String::new, |joint| joint.name.clone());
        let next = self.next(session);
        let shown = next.as_ref().map_or(&[][..], |next| next.configuration);
        let located = if is_whole(session) { None } else { locate(session) };
        let found = located.as_ref().and_then(|result| result.as_ref().ok());
        let mut order: Vec<usize> = session.circle_points.iter().map(|point| point.joint).collect();
        order.dedup();
        let fits = found.map(|found| {
            found.circles.iter().zip(order).map(|(fit, joint)| CircleView {
                joint: name(joint),
                points: session.circle_points.iter().filter(|point| point.joint == joint).count(),
                centre_mm: [fit.centre.x, fit.centre.y, fit.centre.z].map(to_mm),
                axis: [fit.normal.x, fit.normal.y, fit.normal.z],
                radius_mm: to_mm(fit.radius),
                residual_rms_mm: to_mm(fit.rms),
                arc_deg: to_deg(fit.arc),
            })
        });
        Some(CirclesView {
            joint: next.as_ref().map(|next| name(next.joint)),
            joints: joints
                .iter()
                .zip(shown)
                .enumerate()
                .map(|(index, (joint, value))| {
                    let quantity = joint.joint_type.quantity();
                    JointShown {
                        name: joint.name.clone(),
                        value: quantity.to_edge(*value),
                        unit: quantity.unit().to_owned(),
                        moves: 0.0,
                        moves_most: next.as_ref().is_some_and(|next| next.joint == index),
                    }
                })
                .collect(),
            measured: session.circle_points.len(),
            of: self.points().len(),
            fits: fits.map(Iterator::collect).unwrap_or_default(),
            result: found.map(|found| CirclesResult {
                xyz_mm: [found.point_in_flange.x, found.point_in_flange.y, found.point_in_flange.z].map(to_mm),
                sigma_mm: [found.sigma().x, found.sigma().y, found.sigma().z].map(to_mm),
                residual_rms_mm: to_mm(found.rms),
            }),
            typed_unit: match session.instrument {
                Some(InstrumentChoice::Manual { unit }) => Some(unit.sign().to_owned()),
                _ => None,
            },
            arm: self.arm.as_ref().and_then(|found| found.as_ref().ok()).map(|found| arm::view(found)),
            problem: match &self.arm {
                Some(found) => found.as_ref().err().cloned(),
                None => located.and_then(Result::err).map(|error| error.to_string()),
            },
        })
    }
}
