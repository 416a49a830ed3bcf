//! Deliver: the results as files in the session's folder.

use super::{Action, Cx, StepMachine};
use crate::procedure::models::{Models, ModelsRequest};
use crate::session::export;
use crate::session::journal::Entry;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::view::{Content, DeliverView};

/// The deliver step.
#[derive(Clone, Copy, Debug)]
pub(in crate::wizard) struct DeliverStep;

/// The request for the models of the identified arm; none without a usable result.
fn models_request(cx: &Cx<'_>) -> Option<ModelsRequest> {
    let calibration = cx.session.identified.as_deref()?.calibration.clone()?;
    Some(ModelsRequest { calibration, profile: cx.robot()?.profile.clone() })
}

/// Asks for all files to be written.
fn deliver(cx: &Cx<'_>, models: Models) -> Action {
    match files(cx, models.files) {
        Ok(files) => Action::Ask(Request::Deliver { files, left_out: models.left_out }),
        Err(message) => Action::Say(Notice::error(message)),
    }
}

/// The files of a session with their names.
fn files(cx: &Cx<'_>, models: Vec<(String, String)>) -> Result<Vec<(String, String)>, String> {
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
    files.extend(models);
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
        match models_request(cx) {
            Some(request) => vec![Action::Ask(Request::Model(Box::new(request)))],
            None => vec![deliver(cx, Models::default())],
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        match answer {
            // The step may have been left meanwhile, and entered again with other samples.
            Answer::Modelled(models) if cx.session.is_current() => vec![deliver(cx, *models)],
            Answer::Delivered { files, left_out } => {
                let notice = (!left_out.is_empty()).then(|| {
                    let hint = "all other files are written; 'trupose export --help' shows what can be done";
                    Action::Say(Notice::info(format!("left out: {}", left_out.join("; "))).hint(hint))
                });
                let write = Action::Write(vec![Entry::Delivered { files, left_out }]);
                std::iter::once(write).chain(notice).collect()
            }
            _ => Vec::new(),
        }
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
            left_out: cx.session.left_out.clone(),
            verdict: result.map(|result| Box::new(result.summary.verdict.clone())),
            is_current: cx.session.is_current(),
        })
    }
}
