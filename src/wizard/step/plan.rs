//! Plan: which poses to measure.

use super::{Action, Cx, StepMachine};
use crate::procedure::plan::PlanRequest;
use crate::session::journal::{Entry, PlanText};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::plan_summary::PlanSummary;
use crate::session::set_up::Step;
use crate::wizard::advice;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo, PlanSettings};
use crate::wizard::notice::Notice;
use crate::wizard::view::{Content, PlanFigures, PlanView};

/// The plan step: a proposal that is not accepted yet.
#[derive(Clone, Debug, Default)]
pub(in crate::wizard) struct PlanStep {
    settings: PlanSettings,
    /// The file that was asked for last.
    file: Option<String>,
    proposal: Option<Proposal>,
}

#[derive(Clone, Debug)]
struct Proposal {
    plan: PlanText,
    /// All its numbers, if poses were chosen.
    summary: Option<Box<PlanSummary>>,
}

/// A plan for the journal.
pub(super) fn plan_text(cx: &Cx<'_>, summary: Option<&PlanSummary>, rows: &[PlannedPose], origin: String) -> PlanText {
    PlanText::new(origin, summary, rows, cx.robot().map_or(&[][..], |robot| &robot.joint_types))
}

/// Poses that are measured and count, for a plan that continues from them.
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
        ..PlanRequest::default()
    };
    Some(Request::Plan {
        profile: Box::new(cx.profile()?),
        profile_text: robot.text.clone(),
        request: Box::new(request),
    })
}

/// The highest number that is the name of a pose in any plan: new poses continue from there.
fn highest_pose_number(cx: &Cx<'_>) -> u64 {
    cx.session.rows.iter().filter_map(|row| row.planned.pose.parse().ok()).max().unwrap_or(0)
}

impl StepMachine for PlanStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let no_proposal = self.proposal.is_none().then(|| "there is no new plan to accept".to_owned());
        let no_plan = (!cx.session.rows.iter().any(|row| row.active)).then(|| "accept a plan first".to_owned());
        let not_recorded = cx
            .connection
            .is_none_or(|connection| connection.recorded.is_empty())
            .then(|| "the instrument plays no recorded measurements".to_owned());
        let has_proposal = self.proposal.is_some();
        let has_plan = no_plan.is_none();
        let mut intents = vec![
            IntentInfo::new(Intent::AcceptPlan, "measure this plan").unless(no_proposal),
            IntentInfo::new(Intent::MakePlan(self.settings), "choose poses"),
            IntentInfo::new(
                Intent::LoadPlan(self.file.clone().unwrap_or_else(|| "plan.csv".to_owned())),
                "take the poses of a file",
            ),
            IntentInfo::new(Intent::PlanFromRecording, "take the recorded poses").unless(not_recorded),
            IntentInfo::new(Intent::Next, "go on to measuring").unless(no_plan),
        ];
        let default = match (has_proposal, has_plan) {
            (true, _) => 0,
            (false, true) => 4,
            (false, false) => 1,
        };
        if let Some(info) = intents.get_mut(default) {
            info.is_default = info.is_enabled();
        }
        intents
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
        match warnings.split_first() {
            None => Vec::new(),
            Some((first, rest)) => {
                let notice =
                    rest.iter().fold(Notice::attention(first.clone()), |notice, more| notice.hint(more.clone()));
                vec![Action::Say(notice)]
            }
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
            settings: self.settings,
            proposal,
            summary,
            accepted,
            left: cx.session.open_rows().count(),
            measured: cx.session.counted().count(),
        })
    }
}

/// What is wrong with settings that no search should begin with.
fn out_of_range(settings: &PlanSettings) -> Option<String> {
    const MOST_POSES: usize = 10_000;
    const MOST_CANDIDATES: usize = 1_000_000;
    let PlanSettings { poses, verification, candidates, .. } = *settings;
    if poses == 0 || poses.saturating_add(verification) > MOST_POSES {
        return Some(format!("{poses} and {verification} poses cannot be planned; give 1 to {MOST_POSES} in all"));
    }
    (!(10..=MOST_CANDIDATES).contains(&candidates))
        .then(|| format!("{candidates} candidates: give 10 to {MOST_CANDIDATES}"))
}

/// Rows of the present plan of a kind.
fn count(cx: &Cx<'_>, kind: PoseKind) -> usize {
    cx.session.rows.iter().filter(|row| row.active && row.planned.kind == kind).count()
}
