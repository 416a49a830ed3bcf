//! Identify and Verify: from samples to a result, and what it is worth on points that it never saw.

use super::{Action, Cx, StepMachine};
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
use crate::session::summary::{InputFile, InputRole, VerificationMode, Warning};
use crate::wizard::advice;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::Notice;
use crate::wizard::view::{Content, IdentifyView, VerifyView};

/// Fewer verification samples than this say nothing.
const FEWEST_VERIFICATION: usize = 3;

/// The identify step.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct IdentifyStep {
    /// Fewest identification samples.
    fewest: Option<usize>,
}

impl IdentifyStep {
    pub(super) fn enter(session: &Session) -> Self {
        Self { fewest: super::capture::fewest_samples(session) }
    }
}

/// The verify step.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct VerifyStep;

/// The samples of a kind that count, as the maths takes them.
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
        created: cx.now.to_string(),
        inputs: vec![InputFile {
            role: InputRole::Session,
            file: "measurements.csv".to_owned(),
            sha256: sha256(measurements_csv(cx.session, robot).as_bytes()),
        }],
        settings: EstimationSettings::default(),
        identification: SampleSet {
            samples: samples(cx.session, PoseKind::Identification),
            file: None,
            warnings: remarks(cx.session),
        },
        verification: SampleSet {
            samples: verification,
            file: None,
            warnings: left_out(cx.session, PoseKind::Verification).into_iter().collect(),
        },
        basis: "the verification poses of this session, same set-up".to_owned(),
        verification_mode: mode,
        layout: None,
    })))
}

/// What a reader of the result must know about how it was measured.
fn remarks(session: &Session) -> Vec<Warning> {
    let simulated = session.simulation().map(|said| Warning::simulated(&said));
    simulated.into_iter().chain(left_out(session, PoseKind::Identification)).collect()
}

/// The samples of a kind that the operator left out and did not measure again.
fn left_out(session: &Session, kind: PoseKind) -> Option<Warning> {
    let is_left_out = |sample: &&Sample| sample.state == SampleState::LeftOut && session.kind_of(sample) == kind;
    let poses: Vec<&str> = session.samples.iter().filter(is_left_out).map(|sample| session.pose_of(sample)).collect();
    if poses.is_empty() {
        return None;
    }
    // An arm that is only verified where it is good is not verified.
    let is_verification = kind == PoseKind::Verification;
    let advice = if is_verification { "; measure them again, or the verification is a choice" } else { "" };
    let message = format!("the operator left out {} of the {kind} poses: {}{advice}", poses.len(), poses.join(", "));
    Some(Warning::new("left_out", message, is_verification))
}

fn result<'a>(cx: &Cx<'a>) -> Option<&'a IdentifiedText> {
    cx.session.identified.as_deref()
}

impl StepMachine for IdentifyStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let few = super::capture::too_few(cx.session, self.fewest);
        let is_current = cx.session.is_current();
        let stale = match result(cx) {
            None => Some("identify first".to_owned()),
            Some(_) if !is_current => Some("the samples have changed since: identify again".to_owned()),
            Some(result) if result.calibration.is_none() => {
                Some("there is no usable solution: see the warnings, go back and measure what is wrong".to_owned())
            }
            Some(_) => None,
        };
        let identify = IntentInfo::new(Intent::Identify, "identify the arm").unless(few);
        let next = IntentInfo::new(Intent::Next, "go on to verify").unless(stale);
        if is_current { vec![next.default_action(), identify] } else { vec![identify.default_action(), next] }
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::Identify => request(cx).map(Action::Ask).into_iter().collect(),
            Intent::Next => vec![Action::go(Step::Verify)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        let Answer::Identified(identified) = answer else { return Vec::new() };
        let mut identified = identified;
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

    fn content(&self, cx: &Cx<'_>) -> Content {
        Content::Identify(IdentifyView {
            samples: cx.session.counted_of(PoseKind::Identification).count(),
            is_current: cx.session.is_current(),
            // What the verification says is for the next step.
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
        let stale = match result(cx) {
            None => Some("identify first".to_owned()),
            Some(_) if !cx.session.is_current() => {
                Some("the samples have changed since: go back and identify again".to_owned())
            }
            Some(_) => None,
        };
        vec![IntentInfo::new(Intent::Next, "go on to deliver").unless(stale).default_action()]
    }

    fn on_intent(&mut self, intent: Intent, _cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::Next => vec![Action::go(Step::Deliver)],
            _ => Vec::new(),
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let samples = cx.session.counted_of(PoseKind::Verification).count();
        Content::Verify(VerifyView {
            samples,
            is_current: cx.session.is_current(),
            too_few: (samples < FEWEST_VERIFICATION).then(|| {
                "there are no or too few verification poses: nothing can be said about accuracy; go back to measure some".to_owned()
            }),
            verification: result(cx).and_then(|result| result.summary.verification.clone()).map(Box::new),
            verdict: result(cx).map(|result| Box::new(result.summary.verdict.clone())),
            warnings: result(cx).map(|result| result.summary.warnings.clone()).unwrap_or_default(),
        })
    }
}
