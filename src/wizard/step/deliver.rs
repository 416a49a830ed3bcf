//! Deliver: the results as files in the session's folder.

use super::{Action, Cx, StepMachine};
use crate::procedure::deliver;
use crate::session::journal::Entry;
use crate::session::set_up::About;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::view::{Content, DeliverView};

/// The deliver step.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct DeliverStep;

impl StepMachine for DeliverStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let stale = (!cx.session.is_current()).then(|| "the samples have changed since: identify again".to_owned());
        let deliver = IntentInfo::new(Intent::Deliver, "write the files").unless(stale);
        let about = IntentInfo::new(Intent::About(cx.session.about.clone()), "serial number, operator, place");
        vec![if cx.session.delivered.is_empty() { deliver.default_action() } else { deliver }, about]
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        if let Intent::About(about) = intent {
            let about = about.trimmed();
            if !about.is_usable() {
                let hint = format!("each of them may have up to {} characters", About::LONGEST);
                return vec![Action::Say(Notice::error("that is too long for a report").hint(hint))];
            }
            return vec![Action::Write(vec![Entry::About(about)])];
        }
        if intent != Intent::Deliver {
            return Vec::new();
        }
        match deliver::files(cx.session) {
            Ok(files) => vec![Action::Ask(Request::Deliver { files })],
            Err(message) => vec![Action::Say(Notice::error(message))],
        }
    }

    fn on_answer(&mut self, answer: Answer, _cx: &Cx<'_>) -> Vec<Action> {
        let Answer::Delivered(files) = answer else { return Vec::new() };
        vec![Action::Write(vec![Entry::Delivered { files }])]
    }

    fn on_failure(&mut self, problem: Problem, _cx: &Cx<'_>) -> Vec<Action> {
        let notice: Notice = problem.into();
        vec![Action::Say(
            notice.hint("everything measured is safe in the journal; make room and write the files again"),
        )]
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let result = cx.session.identified.as_deref();
        Content::Deliver(DeliverView {
            files: cx.session.delivered.clone(),
            verdict: result.map(|result| Box::new(result.summary.verdict.clone())),
            is_current: cx.session.is_current(),
            about: cx.session.about.clone(),
        })
    }
}
