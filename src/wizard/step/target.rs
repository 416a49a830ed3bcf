//! Target: where the SMR sits on the flange.

use nalgebra::Point3;

use super::{Action, Cx, StepMachine};
use crate::identification::circle_point::{CirclePointError, CircleSeries, TargetLocation, locate_target};
use crate::profile::{FREE_TARGET_UNCERTAINTY, Level};
use crate::session::journal::{CirclePointText, Entry, from_edge, target_text, to_edge, to_xyz_mm};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step, TargetChoice};
use crate::session::state::{Robot, Session};
use crate::units::{to_deg, to_mm};
use crate::wizard::effect::{Answer, CircleConfigurations, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::reading;
use crate::wizard::view::{CircleView, CirclesResult, CirclesView, Content, JointShown, TargetView};

/// Wait before the first shot (s).
const SETTLE: f64 = 2.0;
/// Shots per point.
const SHOTS: u32 = 3;

/// The target step: the circles to be measured. What is measured of them is in the session.
#[derive(Clone, Debug, Default)]
pub(in crate::wizard) struct TargetStep {
    plan: Vec<CircleConfigurations>,
}

/// A point of a circle that is to be measured.
struct Next<'a> {
    joint: usize,
    configuration: &'a [f64],
    following: Option<&'a [f64]>,
    index: usize,
}

impl TargetStep {
    /// Begins; circles that were begun are planned again when they are gone on with.
    pub(super) fn enter(_session: &Session) -> Self {
        Self::default()
    }

    /// All points of the plan, in order.
    fn points(&self) -> Vec<(usize, &[f64])> {
        self.plan.iter().flat_map(|circle| circle.configurations.iter().map(|q| (circle.joint, q.as_slice()))).collect()
    }

    /// The first point that is not measured.
    fn next<'a>(&'a self, session: &Session) -> Option<Next<'a>> {
        let index = session.circle_points.len();
        let points = self.points();
        let (joint, configuration) = *points.get(index)?;
        let following = points.get(index + 1).map(|(_, q)| *q);
        Some(Next { joint, configuration, following, index })
    }

    fn take(&self, reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
        let (Some(next), Some(robot)) = (self.next(cx.session), cx.robot()) else { return Vec::new() };
        let number = cx.session.measurements + 1;
        let previous = cx.session.circle_points.last().map(|point| crate::session::journal::from_xyz_mm(point.xyz_mm));
        let sigma = reading.sigma.or_else(|| robot.profile.instrument().map(|instrument| instrument.sigma));
        let limit = reading::scatter_limit(sigma);
        let shaky = reading.scatter.filter(|scatter| scatter.is_nan() || *scatter > limit);
        let shaky = shaky.map(|scatter| reading::scatter_message(scatter, limit));
        // As it will be noted: the one before was rounded as well.
        let xyz_mm = to_xyz_mm(&reading.point, 9);
        let gate = reading::gate(&crate::session::journal::from_xyz_mm(xyz_mm), previous.as_ref())
            .or_else(|| reading::foreign_joints(reading, robot.joint_types.len()));
        if let Some(reason) = gate.or(shaky) {
            let pose = pose_name(robot, next.joint, next.index);
            let notice = Notice::error(reason.clone()).hint("measure again");
            return vec![
                Action::Write(vec![Entry::Refused { number, pose, reason, xyz_mm: None }]),
                Action::Say(notice),
            ];
        }
        let joints = reading.configuration.as_deref().unwrap_or(next.configuration);
        vec![Action::Write(vec![Entry::CirclePoint(CirclePointText {
            number,
            joint: next.joint,
            joints: to_edge(joints, &robot.joint_types),
            xyz_mm,
        })])]
    }
}

/// Name of a point of a circle.
fn pose_name(robot: &Robot, joint: usize, index: usize) -> String {
    let name = robot.profile.chain().joints().get(joint).map_or("?", |joint| joint.name.as_str());
    format!("circle-{name}-{}", index + 1)
}

/// A joint with the configurations (rad) that turned it and the points (m) measured there.
type Measured = (usize, Vec<Vec<f64>>, Vec<Point3<f64>>);

/// What the measured circles say; `None` before both are complete.
fn locate(session: &Session) -> Option<Result<TargetLocation, CirclePointError>> {
    let robot = session.robot.as_ref()?;
    let mut series: Vec<Measured> = Vec::new();
    for point in &session.circle_points {
        let configuration = from_edge(&point.joints, &robot.joint_types);
        let measured = session.point_of_circle(point);
        match series.iter_mut().find(|(joint, ..)| *joint == point.joint) {
            Some((_, configurations, points)) => {
                configurations.push(configuration);
                points.push(measured);
            }
            None => series.push((point.joint, vec![configuration], vec![measured])),
        }
    }
    let [(first, a, a_points), (second, b, b_points)] = series.as_slice() else { return None };
    let profile = &robot.profile;
    let distance = profile.tracker().position_in_base.coords.norm();
    let sigma = profile.instrument().map(|instrument| instrument.sigma_at(distance));
    Some(locate_target(
        profile.chain(),
        &CircleSeries { joint: *first, configurations: a, points: a_points },
        &CircleSeries { joint: *second, configurations: b, points: b_points },
        sigma,
        &profile.free_parameters(Level::Geometric),
    ))
}

/// Why the circles cannot be used yet.
fn unusable(step: &TargetStep, session: &Session) -> Option<String> {
    if session.circle_points.is_empty() {
        return Some("no circle is measured".to_owned());
    }
    if step.next(session).is_some() || step.plan.is_empty() && locate(session).is_none() {
        return Some("the circles are not complete".to_owned());
    }
    match locate(session) {
        Some(Ok(_)) => None,
        Some(Err(error)) => Some(error.to_string()),
        None => Some("the circles are not complete".to_owned()),
    }
}

/// Whether a choice has numbers that can be meant.
fn is_sensible(choice: &TargetChoice) -> bool {
    let near = |(x, y, z): (f64, f64, f64)| [x, y, z].iter().all(|value| value.abs() < 5000.0);
    match *choice {
        TargetChoice::Profile => true,
        TargetChoice::Known { xyz_mm, sigma_mm } | TargetChoice::Circles { xyz_mm, sigma_mm } => {
            near(xyz_mm) && (0.0..=1000.0).contains(&sigma_mm)
        }
        TargetChoice::Free { sigma_mm } => sigma_mm > 0.0 && sigma_mm <= 1000.0,
    }
}

impl StepMachine for TargetStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let session = cx.session;
        let manual = matches!(session.instrument, Some(InstrumentChoice::Manual { .. }));
        let fixed = (!session.samples.is_empty())
            .then(|| "samples are measured with this SMR; another mounting is another session".to_owned());
        let no_choice = session.target.is_none().then(|| "say where the SMR is first".to_owned());
        let no_point = self.next(session).is_none().then(|| "start the circles first".to_owned());
        let no_instrument = cx.connection.is_none().then(|| "the instrument does not answer".to_owned());
        let by_hand = manual.then(|| "the coordinates are typed in".to_owned());
        let not_by_hand = (!manual).then(|| "the instrument measures by itself".to_owned());
        let blocked = no_point.clone().or_else(|| no_instrument.clone());
        let started = (!self.plan.is_empty()).then(|| "the circles are under way".to_owned());
        let start = if session.circle_points.is_empty() { "find it by circles" } else { "go on with the circles" };
        let no_circles = session.circle_points.is_empty().then(|| "no circle is measured".to_owned());
        let free = TargetChoice::Free { sigma_mm: to_mm(FREE_TARGET_UNCERTAINTY) };
        let in_circles = no_point.is_none();
        let has_choice = no_choice.is_none();
        let mut intents = vec![
            IntentInfo::new(Intent::Next, "go on to the plan").unless(no_choice),
            IntentInfo::new(Intent::ChooseTarget(TargetChoice::Profile), "as the profile says").unless(fixed.clone()),
            IntentInfo::new(Intent::ChooseTarget(free), "leave it free").unless(fixed.clone()),
            IntentInfo::new(Intent::StartCircles, start).unless(fixed.clone().or(started).or(no_instrument)),
            IntentInfo::new(Intent::Measure, "measure").unless(blocked.clone().or(by_hand)),
            IntentInfo::new(Intent::TypeReading(String::new()), "type the coordinates").unless(blocked.or(not_by_hand)),
            IntentInfo::new(Intent::UseCircles, "take the result of the circles")
                .unless(fixed.clone().or_else(|| unusable(self, session))),
            IntentInfo::new(Intent::DiscardCircles, "measure the circles anew").unless(fixed.or(no_circles)),
        ];
        let default = match (in_circles, manual, has_choice) {
            (true, false, _) => 4,
            (true, true, _) => 5,
            (false, _, true) => 0,
            (false, _, false) => 1,
        };
        if let Some(info) = intents.get_mut(default) {
            info.is_default = info.is_enabled();
        }
        intents
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        let session = cx.session;
        match intent {
            Intent::ChooseTarget(choice) if is_sensible(&choice) => vec![Action::Write(vec![Entry::Target(choice)])],
            Intent::ChooseTarget(_) => {
                let notice = Notice::error("the SMR cannot be there")
                    .hint("give coordinates below 5 m and a standard deviation of 0 to 1000 mm");
                vec![Action::Say(notice)]
            }
            Intent::StartCircles => {
                let Some(profile) = cx.profile() else { return Vec::new() };
                vec![Action::Ask(Request::PlanCircles { profile: Box::new(profile) })]
            }
            Intent::Measure => {
                let (Some(next), Some(robot)) = (self.next(session), cx.robot()) else { return Vec::new() };
                vec![Action::Ask(Request::Measure(MeasureRequest {
                    number: session.measurements + 1,
                    pose: pose_name(robot, next.joint, next.index),
                    target: 0,
                    configuration: next.configuration.to_vec(),
                    following: next.following.map(<[f64]>::to_vec),
                    settle: SETTLE,
                    shots: SHOTS,
                }))]
            }
            Intent::TypeReading(text) => {
                let unit = match session.instrument {
                    Some(InstrumentChoice::Manual { unit }) => unit,
                    _ => CoordinateUnit::default(),
                };
                match reading::parse(&text, unit) {
                    Ok(point) => self.take(&reading::typed(point), cx),
                    Err(message) => vec![Action::Say(Notice::error(message))],
                }
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
            Answer::Measured(reading) => self.take(&reading, cx),
            _ => Vec::new(),
        }
    }

    fn on_failure(&mut self, problem: Problem, cx: &Cx<'_>) -> Vec<Action> {
        let (Some(next), Some(robot)) = (self.next(cx.session), cx.robot()) else {
            return vec![Action::Say(problem.into())];
        };
        let pose = pose_name(robot, next.joint, next.index);
        let number = cx.session.measurements + 1;
        let entry = Entry::Refused { number, pose, reason: problem.message.clone(), xyz_mm: None };
        vec![Action::Write(vec![entry]), Action::Say(problem.into())]
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        match entry {
            // The last point of the last circle shows whether the result can be used.
            Entry::CirclePoint(_) if self.next(cx.session).is_none() => match locate(cx.session) {
                Some(Ok(found)) => vec![Action::Say(verdict(&found, cx.session))],
                Some(Err(error)) => {
                    vec![Action::Say(
                        Notice::error(error.to_string()).hint("measure the circles anew, or leave the SMR free"),
                    )]
                }
                None => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let target = cx.robot().and_then(|robot| robot.profile.targets().first());
        Content::Target(TargetView {
            nominal_mm: target.map_or([0.0; 3], |target| {
                let point = target.position_in_flange;
                [to_mm(point.x), to_mm(point.y), to_mm(point.z)]
            }),
            nominal_sigma_mm: target.map_or(0.0, |target| to_mm(target.uncertainty)),
            choice: cx.session.target.as_ref().map(target_text),
            circles: self.circles(cx),
        })
    }
}

/// What to say about complete circles.
fn verdict(found: &TargetLocation, session: &Session) -> Notice {
    /// Residuals larger than expected by this factor are called out.
    const TOO_LARGE: f64 = 3.0;
    let (rms, expected) = (to_mm(found.rms), to_mm(found.expected_rms));
    if found.rms > TOO_LARGE * found.expected_rms {
        return Notice::attention(format!(
            "the points miss the circles by {rms:.3} mm (RMS), {expected:.3} mm can be expected: a joint value may be wrong, or the SMR has moved"
        ))
        .hint("measure the circles anew");
    }
    // With perpendicular last axes a reversed joint leaves no residual: only the expected place shows it.
    let target = session.robot.as_ref().and_then(|robot| robot.profile.targets().first());
    if let Some(target) = target {
        let off = (found.point_in_flange - target.position_in_flange).norm();
        let allowed = FREE_TARGET_UNCERTAINTY.max(target.uncertainty);
        if off > allowed {
            return Notice::attention(format!(
                "the SMR comes out {:.0} mm away from where the profile has it, {:.0} mm can be expected: another mounting, a joint that turns the other way, or a left-handed frame",
                to_mm(off),
                to_mm(allowed)
            ))
            .hint("look at the flange: is the SMR where the result says? If not, check the joint signs and the frame of the tracker");
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
        let located = locate(session);
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
            problem: located.and_then(Result::err).map(|error| error.to_string()),
        })
    }
}
