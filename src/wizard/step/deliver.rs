//! Step Deliver: the results as files in the session folder.

use super::{Action, Cx, StepMachine, offer, require};
use crate::procedure::correct::CorrectRequest;
use crate::procedure::models::{Models, ModelsRequest};
use crate::procedure::{self, deliver};
use crate::session::corrected::ProgramChoice;
use crate::session::journal::Entry;
use crate::session::summary::VerdictStatus;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::view::{Content, DeliverView};

#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct DeliverStep;

/// The action that writes all files.
fn write_files(cx: &Cx<'_>, models: Models) -> Action {
    match deliver::files(cx.session, models.files) {
        Ok(files) => Action::Ask(Request::Deliver { files, left_out: models.left_out }),
        Err(message) => Action::Say(Notice::error(message)),
    }
}

/// Lines of a program that a message names; the screen has more.
const REASONS: usize = 3;

/// Why no program can be corrected now.
fn cannot_correct(cx: &Cx<'_>) -> Option<String> {
    let result = cx.session.identified.as_deref();
    let is_accepted = result.is_some_and(|result| result.summary.verdict.status == VerdictStatus::Accepted);
    let conditions = [
        require(cx.session.is_current(), "the samples have changed since then: identify again"),
        require(is_accepted, "the result is not accepted: see the step Verify"),
    ];
    conditions.into_iter().find_map(Result::err)
}

/// The action that corrects a program.
fn correct(choice: ProgramChoice, cx: &Cx<'_>) -> Action {
    match (procedure::correct::check(&choice), ModelsRequest::of(cx.session)) {
        (Err(error), _) => Action::Say(Notice::error(error.to_string())),
        (Ok(()), Some(arm)) => Action::Ask(Request::Correct(Box::new(CorrectRequest { arm, choice }))),
        (Ok(()), None) => Action::Say(Notice::error("there is no result")),
    }
}

impl StepMachine for DeliverStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let is_current = require(cx.session.is_current(), "the samples have changed since then: identify again");
        let deliver = offer(Intent::Deliver, "write the files", [is_current]);
        let about =
            IntentInfo::new(Intent::About(Box::new(cx.session.about.clone())), "serial number, operator, place");
        let correct = IntentInfo::new(Intent::CorrectProgram(Box::default()), "correct a program");
        let correct = correct.unless(cannot_correct(cx));
        vec![if cx.session.delivered.is_empty() { deliver.default_action() } else { deliver }, correct, about]
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        if let Intent::About(about) = intent {
            return vec![match about.checked() {
                Ok(about) => Action::Write(vec![Entry::About(about)]),
                Err(error) => Action::Say(Notice::error(error.to_string())),
            }];
        }
        if let Intent::CorrectProgram(choice) = intent {
            return vec![correct(*choice, cx)];
        }
        if intent != Intent::Deliver {
            return Vec::new();
        }
        match ModelsRequest::of(cx.session) {
            Some(request) => vec![Action::Ask(Request::Model(Box::new(request)))],
            None => vec![write_files(cx, Models::default())],
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        match answer {
            // The step may have been left meanwhile and entered again with other samples.
            Answer::Modelled(models) if cx.session.is_current() => vec![write_files(cx, *models)],
            Answer::Corrected(program) if cx.session.is_current() => {
                vec![Action::Ask(Request::WriteCorrected(program))]
            }
            Answer::CorrectedWritten(program) => {
                let notice =
                    program.reasons.iter().take(REASONS).cloned().fold(Notice::info(program.line()), Notice::hint);
                vec![Action::Write(vec![Entry::Corrected(*program)]), Action::Say(notice)]
            }
            Answer::Delivered { files, sums, left_out } => {
                let notice = (!left_out.is_empty()).then(|| {
                    let hint = "all other files were written";
                    Action::Say(Notice::info(format!("left out: {}", left_out.join("; "))).hint(hint))
                });
                let write = Action::Write(vec![Entry::Delivered { files, left_out, sums }]);
                std::iter::once(write).chain(notice).collect()
            }
            _ => Vec::new(),
        }
    }

    fn on_failure(&mut self, problem: Problem, _cx: &Cx<'_>) -> Vec<Action> {
        let is_unwritten = problem.is_unwritten;
        let notice: Notice = problem.into();
        vec![Action::Say(if is_unwritten {
            notice.hint("all measurements are safe in the journal; free some disk space and write the files again")
        } else {
            notice
        })]
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let result = cx.session.identified.as_deref();
        Content::Deliver(DeliverView {
            files: cx.session.delivered.clone(),
            left_out: cx.session.left_out.clone(),
            verdict: result.map(|result| Box::new(result.summary.verdict.clone())),
            is_current: cx.session.is_current(),
            about: cx.session.about.clone(),
            corrected: cx.session.corrected.clone(),
        })
    }
}
