//! Steps Identify and Verify: a result from the samples, and its accuracy at points that the identification did not use.

use super::{Action, Condition, Cx, StepMachine, offer, require, with_default};
use crate::identification::PointSample;
use crate::kinematics::Place;
use crate::procedure::EstimationSettings;
use crate::procedure::identify::{IdentifyRequest, NamedSample, SampleSet};
use crate::procedure::points::point_errors;
use crate::session::export::measurements_csv;
use crate::session::journal::{Entry, IdentifiedText};
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::session::sha256;
use crate::session::state::{Sample, SampleState, Session};
use crate::session::summary::{InputFile, InputRole, VerificationMode, Warning, WarningCode};
use crate::wizard::advice;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::Notice;
use crate::wizard::view::{Content, IdentifyView, VerifyView};

/// Fewest verification samples from which accuracy can be stated.
const FEWEST_VERIFICATION: usize = 3;

#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct IdentifyStep {
    /// Fewest identification samples, if known.
    fewest: Option<usize>,
}

impl IdentifyStep {
    pub(super) fn enter(session: &Session) -> Self {
        Self { fewest: super::capture::fewest_samples(session) }
    }
}

#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct VerifyStep;

/// The samples of a kind that count, as input of the identification.
pub(super) fn samples(session: &Session, kind: PoseKind) -> Vec<NamedSample> {
    session
        .counted_of(kind)
        .map(|sample| NamedSample {
            pose: session.pose_of(sample).to_owned(),
            line: usize::try_from(sample.noted.number).unwrap_or(usize::MAX),
            sample: PointSample {
                at: Place { configuration: session.configuration_of(sample), target: sample.noted.target },
                station: 0,
                point: session.point_of(sample),
                sigma: session.sigma_of(sample),
            },
            temperature: sample.noted.temperature_degc,
        })
        .collect()
}

fn request(cx: &Cx<'_>) -> Option<Request> {
    let robot = cx.robot()?;
    let verification = samples(cx.session, PoseKind::Verification);
    let mode = if verification.is_empty() { VerificationMode::None } else { VerificationMode::Session };
    Some(Request::Identify(Box::new(IdentifyRequest {
        profile: robot.profile.clone(),
        profile_text: robot.text.clone(),
        mounted: cx.session.mounted(),
        payload: cx.session.payload,
        created: cx.now.to_string(),
        inputs: vec![InputFile {
            role: InputRole::Session,
            file: "measurements.csv".to_owned(),
            sha256: sha256(measurements_csv(cx.session, robot).as_bytes()),
        }],
        settings: EstimationSettings::default(),
        identification: SampleSet {
            samples: samples(cx.session, PoseKind::Identification),
            warnings: remarks(cx.session),
            ..SampleSet::default()
        },
        verification: SampleSet {
            samples: verification,
            warnings: left_out(cx.session, PoseKind::Verification).into_iter().collect(),
            ..SampleSet::default()
        },
        basis: "the verification poses of this session, same set-up".to_owned(),
        verification_mode: mode,
        layout: None,
        socket_distance_mm: None,
        previous: None,
    })))
}

/// What a reader of the result must know about how the samples were measured.
fn remarks(session: &Session) -> Vec<Warning> {
    let simulated = session.simulation().map(|said| Warning::simulated(&said));
    let limits = session.limits_set.filter(|set| set.after_result).map(|set| {
        let message = format!("the acceptance limits were set at {}, after a result had been seen", set.time);
        Warning::new(WarningCode::LimitsSetLate, message, false)
    });
    simulated.into_iter().chain(left_out(session, PoseKind::Identification)).chain(limits).collect()
}

/// A warning about samples of a kind that the operator excluded and did not measure again.
fn left_out(session: &Session, kind: PoseKind) -> Option<Warning> {
    let is_left_out = |sample: &&Sample| sample.state == SampleState::LeftOut && session.kind_of(sample) == kind;
    let poses: Vec<&str> = session.samples.iter().filter(is_left_out).map(|sample| session.pose_of(sample)).collect();
    if poses.is_empty() {
        return None;
    }
    // Verification poses that were selected by their errors verify nothing.
    let is_verification = kind == PoseKind::Verification;
    let advice =
        if is_verification { "; measure them again, because a selection of poses verifies nothing" } else { "" };
    let message = format!("the operator excluded {} of the {kind} poses: {}{advice}", poses.len(), poses.join(", "));
    Some(Warning::new(WarningCode::LeftOut, message, is_verification))
}

fn result<'a>(cx: &Cx<'a>) -> Option<&'a IdentifiedText> {
    cx.session.identified.as_deref()
}

/// Whether there is a result from exactly the samples that count now.
fn has_current_result(cx: &Cx<'_>) -> Condition {
    match result(cx) {
        None => Err("identify first".to_owned()),
        Some(_) if !cx.session.is_current() => Err("the samples have changed since then: identify again".to_owned()),
        Some(_) => Ok(()),
    }
}

/// Whether the result has a solution that can be applied.
fn has_solution(cx: &Cx<'_>) -> Condition {
    let is_usable = result(cx).is_some_and(|result| result.calibration.is_some());
    require(is_usable, "no usable solution found; check the warnings, then go back and remeasure the affected poses")
}

/// Writes a result that has arrived.
fn take_result(answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
    let Answer::Identified(mut identified) = answer else { return Vec::new() };
    identified.put_into_words(advice::words);
    let blocking = identified.summary.warnings.iter().find(|warning| warning.blocks_acceptance);
    let notice = blocking.map(|warning| Notice::attention(warning.message.clone()));
    let of = |kind| samples(cx.session, kind);
    let points = point_errors(&identified, &of(PoseKind::Identification), &of(PoseKind::Verification));
    let text = IdentifiedText {
        points,
        samples: cx.session.basis(),
        summary: identified.summary,
        calibration: identified.calibration,
    };
    let write = Action::Write(vec![Entry::Identified(Box::new(text))]);
    std::iter::once(write).chain(notice.map(Action::Say)).collect()
}

impl StepMachine for IdentifyStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let has_enough = super::capture::has_enough(cx.session, self.fewest);
        let identify = offer(Intent::Identify, "identify the arm", [has_enough]);
        let next = offer(Intent::Next, "continue to Verify", [has_current_result(cx), has_solution(cx)]);
        if cx.session.is_current() {
            with_default(vec![next, identify], &Intent::Next)
        } else {
            with_default(vec![identify, next], &Intent::Identify)
        }
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::Identify => request(cx).map(Action::Ask).into_iter().collect(),
            Intent::Next => vec![Action::go(Step::Verify)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        take_result(answer, cx)
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        Content::Identify(IdentifyView {
            samples: cx.session.counted_of(PoseKind::Identification).count(),
            is_current: cx.session.is_current(),
            // The verification belongs to the next step.
            summary: result(cx).map(|result| {
                let mut summary = result.summary.clone();
                summary.verification = None;
                Box::new(summary)
            }),
            is_usable: result(cx).is_some_and(|result| result.calibration.is_some()),
        })
    }
}

impl StepMachine for VerifyStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        vec![offer(Intent::Next, "continue to Deliver", [has_current_result(cx)]).default_action()]
    }

    fn on_intent(&mut self, intent: Intent, _cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::Next => vec![Action::go(Step::Deliver)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        take_result(answer, cx)
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        // The verdict is that of the limits now.
        let is_cell = matches!(entry, Entry::Cell(_));
        if is_cell { request(cx).map(Action::Ask).into_iter().collect() } else { Vec::new() }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let samples = cx.session.counted_of(PoseKind::Verification).count();
        Content::Verify(VerifyView {
            samples,
            is_current: cx.session.is_current(),
            too_few: (samples < FEWEST_VERIFICATION).then(|| {
                "there are too few verification poses to state the accuracy; go back and measure some".to_owned()
            }),
            workspace: result(cx).and_then(|result| result.summary.workspace.clone()),
            verification: result(cx).and_then(|result| result.summary.verification.clone()).map(Box::new),
            verdict: result(cx).map(|result| Box::new(result.summary.verdict.clone())),
            warnings: result(cx).map(|result| result.summary.warnings.clone()).unwrap_or_default(),
        })
    }
}
