//! Step Plan: which poses to measure.

use super::{Action, Cx, StepMachine, offer, require, with_default};
use crate::planning::order::Pace;
use crate::procedure::plan::PlanRequest;
use crate::session::export::plan_csv;
use crate::session::journal::{Entry, PlanText};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::state::Session;
use crate::wizard::advice;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo, PlanSettings};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::program;
use crate::wizard::view::{Content, PlanFigures, PlanView};

/// The plan step with a proposal that is not yet accepted.
#[derive(Clone, Debug, Default)]
pub(in crate::wizard) struct PlanStep {
    settings: PlanSettings,
    /// The file that was requested last.
    file: Option<String>,
    proposal: Option<Proposal>,
}

#[derive(Clone, Debug)]
struct Proposal {
    plan: PlanText,
    /// All its numbers, if poses were chosen.
    summary: Option<Box<PlanSummary>>,
}

impl PlanStep {
    /// Enters the step with the numbers of the plan that is being measured, if there is one.
    pub(super) fn enter(session: &Session) -> Self {
        let count = |kind| session.rows.iter().filter(|row| row.active && row.planned.kind == kind).count();
        let (poses, verification) = (count(PoseKind::Identification), count(PoseKind::Verification));
        let usual = PlanSettings::default();
        let settings = if poses > 0 { PlanSettings { poses, verification, ..usual } } else { usual };
        Self { settings, ..Self::default() }
    }
}

/// A plan as it is written to the journal.
pub(super) fn plan_text(cx: &Cx<'_>, summary: Option<&PlanSummary>, rows: &[PlannedPose], origin: String) -> PlanText {
    PlanText::new(origin, summary, rows, cx.robot().map_or(&[][..], |robot| &robot.joint_types))
}

/// Poses whose samples count, for a plan that builds on them.
pub(super) fn measured_poses(cx: &Cx<'_>) -> Vec<PlannedPose> {
    let session = cx.session;
    session
        .counted_of(PoseKind::Identification)
        .map(|sample| PlannedPose {
            pose: session.pose_of(sample).to_owned(),
            kind: PoseKind::Identification,
            configuration: session.configuration_of(sample),
            point_in_base: None,
        })
        .collect()
}

/// How the wizard measures; the time of a plan is predicted with it. The mean of three shots scatters less than one, and shows
/// whether the robot was at rest.
pub(in crate::wizard) fn measuring_pace() -> Pace {
    Pace { shots: 3, ..Pace::default() }
}

/// Time (s) to drive the arm to a pose by hand, read the instrument and type the coordinates.
const BY_HAND: f64 = 50.0;

/// How fast the operator of a session measures: coordinates that are typed take their time.
fn pace(session: &Session) -> Pace {
    match session.instrument {
        Some(InstrumentChoice::Manual { .. }) => Pace { settle: BY_HAND, shots: 1, ..Pace::default() },
        _ => measuring_pace(),
    }
}

/// Name of the file with the plan in the session's folder.
pub(super) const PLAN_FILE: &str = "plan.csv";

/// Writes the plan beside the journal: robot programs are made from it before anything is measured.
pub(super) fn write_plan(session: &Session) -> Option<Action> {
    let robot = session.robot.as_ref()?;
    let files = vec![(PLAN_FILE.to_owned(), plan_csv(session, robot))];
    Some(Action::Ask(Request::Deliver { files, left_out: Vec::new() }))
}

/// What is said where the table of the plan cannot be written: the journal has the plan, the table is a convenience.
pub(super) fn plan_not_saved(problem: Problem) -> Notice {
    let notice = Notice::attention(format!("the plan is not saved as {PLAN_FILE}: {}", problem.message));
    problem.hints.into_iter().fold(notice, Notice::hint)
}

/// The request for a plan with these settings.
pub(super) fn plan_request(cx: &Cx<'_>, settings: &PlanSettings) -> Option<Request> {
    let robot = cx.robot()?;
    let request = PlanRequest {
        poses: settings.poses,
        verification: settings.verification,
        candidates: settings.candidates,
        seed: settings.seed,
        drift_every: settings.drift_every,
        included: measured_poses(cx),
        numbered_after: highest_pose_number(cx),
        created: cx.now.to_string(),
        pace: pace(cx.session),
        ..PlanRequest::default()
    };
    Some(Request::Plan {
        profile: Box::new(cx.profile()?),
        profile_text: robot.text.clone(),
        request: Box::new(request),
    })
}

/// The highest number that names a pose of any plan. New poses are numbered from there.
fn highest_pose_number(cx: &Cx<'_>) -> u64 {
    cx.session.rows.iter().filter_map(|row| row.planned.pose.parse().ok()).max().unwrap_or(0)
}

impl StepMachine for PlanStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let has_proposal = self.proposal.is_some();
        let has_plan = cx.session.rows.iter().any(|row| row.active);
        let has_recorded = cx.connection.is_some_and(|connection| !connection.recorded.is_empty());
        let make = Intent::MakePlan(self.settings);
        let file = self.file.clone().unwrap_or_else(|| "plan.csv".to_owned());
        let next = match (has_proposal, has_plan) {
            (true, _) => &Intent::AcceptPlan,
            (false, true) => &Intent::Next,
            (false, false) => &make,
        };
        let intents = vec![
            offer(Intent::AcceptPlan, "measure this plan", [require(has_proposal, "there is no new plan to accept")]),
            offer(make.clone(), "choose poses", []),
            offer(Intent::LoadPlan(file), "load poses from a file", []),
            offer(
                Intent::PlanFromRecording,
                "use the recorded poses",
                [require(has_recorded, "the instrument does not play back recorded measurements")],
            ),
            offer(Intent::Next, "continue to Capture", [require(has_plan, "accept a plan first")]),
        ];
        with_default(intents, next)
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::MakePlan(settings) => {
                if let Some(problem) = out_of_range(&settings) {
                    return vec![Action::Say(Notice::error(problem))];
                }
                self.settings = settings;
                plan_request(cx, &settings).map(Action::Ask).into_iter().collect()
            }
            Intent::LoadPlan(file) => {
                let Some(profile) = cx.profile() else { return Vec::new() };
                self.file = Some(file.clone());
                vec![Action::Ask(Request::LoadPlan { file, profile: Box::new(profile) })]
            }
            Intent::PlanFromRecording => {
                let Some(connection) = cx.connection else { return Vec::new() };
                let origin = "the poses of the recorded measurements".to_owned();
                let plan = plan_text(cx, None, &connection.recorded, origin);
                self.proposal = Some(Proposal { plan, summary: None });
                Vec::new()
            }
            Intent::AcceptPlan => {
                let Some(Proposal { plan, .. }) = self.proposal.take() else { return Vec::new() };
                vec![Action::Write(vec![Entry::Plan(plan), Entry::Step(Step::Capture)])]
            }
            Intent::Next => vec![Action::go(Step::Capture)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        let Answer::Planned { mut summary, rows, origin } = answer else { return Vec::new() };
        for warning in summary.iter_mut().flat_map(|summary| &mut summary.warnings) {
            warning.put_into_words(advice::words);
        }
        let warnings: Vec<String> = summary
            .as_deref()
            .map(|summary| summary.warnings.iter().map(|warning| warning.message.clone()).collect())
            .unwrap_or_default();
        let plan = plan_text(cx, summary.as_deref(), &rows, origin);
        self.proposal = Some(Proposal { plan, summary });
        let Some((first, rest)) = warnings.split_first() else { return Vec::new() };
        vec![Action::Say(Notice { hints: rest.to_vec(), ..Notice::attention(first) })]
    }

    fn on_failure(&mut self, problem: Problem, _cx: &Cx<'_>) -> Vec<Action> {
        let notice = if problem.is_unwritten { plan_not_saved(problem) } else { problem.into() };
        vec![Action::Say(notice)]
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        match entry {
            Entry::Plan(_) => write_plan(cx.session).into_iter().collect(),
            _ => Vec::new(),
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let accepted = cx.session.plan.as_ref().map(|plan| PlanFigures {
            plan: plan.clone(),
            identification: count(cx, PoseKind::Identification),
            verification: count(cx, PoseKind::Verification),
        });
        let proposal = self.proposal.as_ref().map(|Proposal { plan, .. }| PlanFigures {
            plan: plan.without_rows(),
            identification: plan.count(PoseKind::Identification),
            verification: plan.count(PoseKind::Verification),
        });
        let summary = self.proposal.as_ref().and_then(|proposal| proposal.summary.clone());
        Content::Plan(PlanView {
            program: program::view(cx.session),
            settings: self.settings,
            proposal,
            summary,
            accepted,
            left: cx.session.open_rows().count(),
            measured: cx.session.counted().count(),
        })
    }
}

/// Why a search cannot be started with these settings.
fn out_of_range(settings: &PlanSettings) -> Option<String> {
    const MOST_POSES: usize = 10_000;
    const MOST_CANDIDATES: usize = 1_000_000;
    let PlanSettings { poses, verification, candidates, .. } = *settings;
    if poses == 0 || poses.saturating_add(verification) > MOST_POSES {
        return Some(format!("{poses} and {verification} poses cannot be planned; use 1 to {MOST_POSES} in total"));
    }
    (!(10..=MOST_CANDIDATES).contains(&candidates))
        .then(|| format!("{candidates} candidates cannot be searched; use 10 to {MOST_CANDIDATES}"))
}

/// Number of rows of a kind in the current plan.
fn count(cx: &Cx<'_>, kind: PoseKind) -> usize {
    cx.session.rows.iter().filter(|row| row.active && row.planned.kind == kind).count()
}
