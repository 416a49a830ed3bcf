//! Deliver: the results as files in the session's folder.

use super::{Action, Cx, StepMachine};
use crate::session::export;
use crate::session::journal::Entry;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::view::{Content, DeliverView};

/// The deliver step.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct DeliverStep;

/// The files of a session with their names.
fn files(cx: &Cx<'_>) -> Result<Vec<(String, String)>, String> {
    let session = cx.session;
    let robot = session.robot.as_ref().ok_or("there is no robot")?;
    let result = session.identified.as_deref().ok_or("there is no result")?;
    let mut files = vec![
        ("plan.csv".to_owned(), export::plan_csv(session, robot)),
        ("measurements.csv".to_owned(), export::measurements_csv(session, robot)),
    ];
    files.extend(export::drift_csv(session, robot).map(|text| ("drift.csv".to_owned(), text)));
    if let Some(calibration) = &result.calibration {
        files.push(("calibration.ron".to_owned(), calibration.to_text().map_err(|error| error.to_string())?));
    }
    let mut summary = result.summary.clone();
    summary.written = files.iter().map(|(name, _)| name.clone()).collect();
    summary.written.push("report.json".to_owned());
    let json = serde_json::to_string_pretty(&summary).map_err(|error| error.to_string())?;
    files.push(("report.json".to_owned(), json + "\n"));
    Ok(files)
}

impl StepMachine for DeliverStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let stale = (!cx.session.is_current()).then(|| "the samples have changed since: identify again".to_owned());
        let deliver = IntentInfo::new(Intent::Deliver, "write the files").unless(stale);
        vec![if cx.session.delivered.is_empty() { deliver.default_action() } else { deliver }]
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        if intent != Intent::Deliver {
            return Vec::new();
        }
        match files(cx) {
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
        })
    }
}
