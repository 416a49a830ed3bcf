//! Runs a script with the wizard and its threads.

use std::io::{self, Write};
use std::time::Duration;

use super::expectation::Check;
use super::grammar::{OnFinding, Script, ScriptStep};
use super::transcript::Transcript;
use crate::runtime::{Engine, Output};
use crate::session::journal::Entry;
use crate::session::state::Session;
use crate::session::summary::IdentificationSummary;
use crate::text::shortened;
use crate::wizard::{Activity, Intent, IntentInfo, Severity, ViewModel};

/// Longest time without any event while a request is running. A search reports far more often.
const PATIENCE: Duration = Duration::from_mins(5);
/// Attempts at a measurement that fails.
const TRIES: usize = 3;
/// Cause of the wizard's end when the script quits.
const QUIT: &str = "quit";
/// Columns of an intent in the transcript.
const LONGEST_INTENT: usize = 121;

/// How a script ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// All steps succeeded.
    Done,
    /// A step failed, or an expectation was not met.
    Failed {
        /// Number of the step, from 1.
        step: usize,
        /// What was expected and what was seen.
        message: String,
        /// Whether the session could not be written. What was measured before is safe.
        not_saved: bool,
    },
    /// The program was ended by a signal or by `Quit`.
    Ended { cause: String },
}

/// Why a step ends the script.
enum Stop {
    Failed(String),
    NotSaved(String),
    Ended(String),
    Output(io::Error),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

/// Runs a script with an engine.
pub struct Runner<'a, W: Write> {
    engine: Engine,
    transcript: Transcript<'a, W>,
    reopen: &'a dyn Fn(&str) -> Result<Engine, String>,
    done: Vec<ScriptStep>,
}

impl<W: Write> std::fmt::Debug for Runner<'_, W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Runner").field("engine", &self.engine).finish_non_exhaustive()
    }
}

impl<'a, W: Write> Runner<'a, W> {
    pub fn new(
        engine: Engine,
        transcript: Transcript<'a, W>,
        reopen: &'a dyn Fn(&str) -> Result<Engine, String>,
    ) -> Self {
        Self { engine, transcript, reopen, done: Vec::new() }
    }

    /// The session as it is on disk.
    pub fn session(&self) -> &Session {
        self.engine.wizard().session()
    }

    /// Folder of the session.
    pub fn folder(&self) -> Option<&str> {
        self.engine.wizard().folder()
    }

    /// What was not saved before the end, one description for each entry.
    pub fn unsaved(&self) -> Vec<String> {
        self.engine.wizard().unsaved().iter().map(Entry::describe).collect()
    }

    /// Intents that were executed, in order, as steps of a script.
    pub fn done(&self) -> &[ScriptStep] {
        &self.done
    }

    /// The latest identification result.
    pub fn summary(&self) -> Option<&IdentificationSummary> {
        self.session().identified.as_ref().map(|result| &result.summary)
    }

    /// Runs the steps, then closes the session cleanly in any case.
    ///
    /// # Errors
    /// The transcript cannot be written.
    pub fn run(&mut self, script: &Script) -> io::Result<Outcome> {
        let outcome = self.steps(script);
        self.end();
        self.report()?;
        if let Some(remark) = self.engine.end_recording() {
            self.transcript.event("recording", &remark)?;
        }
        outcome
    }

    fn steps(&mut self, script: &Script) -> io::Result<Outcome> {
        self.transcript.event("script", &script.title)?;
        // A resumed session settles before the first step, and a signal after the last step is still handled.
        let steps = std::iter::once(None).chain(script.steps.iter().map(Some)).chain(std::iter::once(None));
        for (index, step) in steps.enumerate() {
            let result = match step {
                None => self.settle(),
                Some(step) => self.step(step),
            };
            let (message, not_saved) = match result {
                Ok(()) => continue,
                Err(Stop::Output(error)) => return Err(error),
                Err(Stop::Ended(cause)) if cause == QUIT && index < script.steps.len() => {
                    (format!("the program has ended ('{cause}'), {} steps are left", script.steps.len() - index), false)
                }
                Err(Stop::Ended(cause)) => return Ok(Outcome::Ended { cause }),
                Err(Stop::Failed(message)) => (message, false),
                Err(Stop::NotSaved(message)) => (message, true),
            };
            let text =
                step.map_or_else(String::new, |step| format!(" ({})", shortened(&format!("{step:?}"), LONGEST_INTENT)));
            self.transcript.event("failed", &format!("step {index}{text}: {message}"))?;
            return Ok(Outcome::Failed { step: index, message, not_saved });
        }
        Ok(Outcome::Done)
    }

    /// Prints a table after the last line, in the text format only.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn print_table(&mut self, text: &str) -> io::Result<()> {
        self.transcript.table(text)
    }

    /// Prints a line of the transcript.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn print(&mut self, event: &str, text: &str) -> io::Result<()> {
        self.transcript.event(event, text)
    }

    /// Quits the wizard and waits until its last entry is on disk. A running request is cancelled.
    fn end(&mut self) {
        if self.engine.wizard().ended().is_none() {
            self.engine.intend(Intent::Quit);
        }
        while !self.engine.has_exited() {
            if self.engine.wizard().activity() == Activity::Stuck {
                // The entry before the end cannot be written, so quitting would wait for it forever.
                self.engine.shut_down("the session cannot be written");
            } else if !self.engine.wait(PATIENCE) {
                break;
            }
        }
    }

    fn step(&mut self, step: &ScriptStep) -> Result<(), Stop> {
        match step {
            ScriptStep::Do(intent) => match self.perform(intent)? {
                None => Ok(()),
                Some(failure) if self.engine.wizard().notice().is_some_and(|notice| notice.is_unwritten) => {
                    Err(Stop::NotSaved(failure))
                }
                Some(failure) => Err(Stop::Failed(failure)),
            },
            ScriptStep::Fails(intent, text) => self.check_failure(intent, text),
            ScriptStep::Blocked(intent, reason) => self.check_blocked(intent, reason),
            ScriptStep::Expect(path, check) => self.expect(path, check),
            ScriptStep::CaptureAll(on_finding) => self.capture(usize::MAX, *on_finding),
            ScriptStep::Capture(count, on_finding) => self.capture(*count, *on_finding),
            ScriptStep::CaptureCircles => self.capture_circles(),
            ScriptStep::Restart => self.restart(),
            ScriptStep::Say(text) => Ok(self.transcript.event("say", text)?),
        }
    }

    /// The wizard's offer for an intent.
    fn offer(&self, intent: &Intent) -> Option<IntentInfo> {
        self.engine.wizard().intents().into_iter().find(|info| info.intent.name() == intent.name())
    }

    /// Sends an intent, which must be possible, and waits until it is finished. Returns the reason if it failed.
    fn perform(&mut self, intent: &Intent) -> Result<Option<String>, Stop> {
        match self.offer(intent) {
            None => {
                let (name, offered) = (intent.name(), self.offered());
                return Err(Stop::Failed(format!("{name} is not offered here; offered: {offered}")));
            }
            Some(IntentInfo { blocked: Some(reason), .. }) => {
                return Err(Stop::Failed(format!("{} is not possible now: {reason}", intent.name())));
            }
            Some(_) => {}
        }
        let text = ron::to_string(intent).unwrap_or_else(|_error| intent.name().to_owned());
        self.transcript.event("do", &shortened(&text, LONGEST_INTENT))?;
        Ok(self.act(intent)?.map(|message| format!("{} failed: {message}", intent.name())))
    }

    fn check_failure(&mut self, intent: &Intent, text: &str) -> Result<(), Stop> {
        match self.perform(intent)? {
            Some(failure) if failure.contains(text) => {
                Ok(self.transcript.event("expect", &format!("{} fails with '{text}'", intent.name()))?)
            }
            Some(failure) => Err(Stop::Failed(format!("expected a failure with '{text}'; seen: {failure}"))),
            None => Err(Stop::Failed(format!("expected {} to fail with '{text}'; it succeeded", intent.name()))),
        }
    }

    /// Like [`Self::perform`], without a line in the transcript.
    fn act(&mut self, intent: &Intent) -> Result<Option<String>, Stop> {
        self.engine.intend(intent.clone());
        self.settle()?;
        // An intent clears the previous message, so an error belongs to this intent.
        let notice = self.engine.wizard().notice().filter(|notice| notice.severity == Severity::Error);
        let error = notice.map(|notice| notice.what.clone());
        self.done.push(match &error {
            None => ScriptStep::Do(intent.clone()),
            Some(message) => ScriptStep::Fails(intent.clone(), message.clone()),
        });
        Ok(error)
    }

    fn offered(&self) -> String {
        let infos = self.engine.wizard().intents();
        infos.iter().filter(|info| info.is_enabled()).map(|info| info.intent.name()).collect::<Vec<_>>().join(", ")
    }

    /// Waits until the wizard is idle, and prints events meanwhile.
    fn settle(&mut self) -> Result<(), Stop> {
        // Signals also arrive while the wizard is idle.
        while self.engine.wait(Duration::ZERO) {}
        loop {
            self.report()?;
            if let Some(cause) = self.engine.wizard().ended() {
                return Err(Stop::Ended(cause.to_owned()));
            }
            match self.engine.wizard().activity() {
                Activity::Idle => return Ok(()),
                Activity::Stuck => return Err(Stop::NotSaved(self.notice_text())),
                Activity::Working => {}
            }
            if !self.engine.wait(PATIENCE) {
                return Err(Stop::Failed(format!("nothing happened for {} s", PATIENCE.as_secs())));
            }
        }
    }

    /// The current message with its hints.
    fn notice_text(&self) -> String {
        let notice = self.engine.wizard().notice();
        let parts =
            notice.map(|notice| std::iter::once(&notice.what).chain(&notice.hints).cloned().collect::<Vec<_>>());
        parts.unwrap_or_default().join("; ")
    }

    fn report(&mut self) -> io::Result<()> {
        let outputs: Vec<Output> = self.engine.outputs().collect();
        for output in outputs {
            match output {
                Output::Saved(lines) => {
                    for line in lines {
                        self.transcript.entry(line.number, line.time, &line.entry.describe())?;
                    }
                }
                Output::Notice(notice) => {
                    let hints: Vec<String> = notice.hints.iter().map(|hint| format!(" | hint: {hint}")).collect();
                    self.transcript.event("notice", &format!("{}{}", notice.what, hints.concat()))?;
                }
            }
        }
        Ok(())
    }

    fn view(&self) -> ViewModel {
        self.engine.wizard().view()
    }

    fn expect(&mut self, path: &str, check: &Check) -> Result<(), Stop> {
        check.test(&self.view(), path).map_err(Stop::Failed)?;
        Ok(self.transcript.event("expect", &format!("{path}: {check:?}"))?)
    }

    fn check_blocked(&mut self, intent: &Intent, reason: &str) -> Result<(), Stop> {
        let seen = match self.offer(intent) {
            Some(IntentInfo { blocked: Some(blocked), .. }) if blocked.contains(reason) => {
                return Ok(self.transcript.event("expect", &format!("{} is blocked: {blocked}", intent.name()))?);
            }
            Some(IntentInfo { blocked: Some(blocked), .. }) => format!("it is blocked because: {blocked}"),
            Some(_) => "it is possible".to_owned(),
            None => "it is not offered at all".to_owned(),
        };
        Err(Stop::Failed(format!("expected {} to be blocked because '{reason}'; {seen}", intent.name())))
    }

    /// Measures open poses, up to `count`.
    fn capture(&mut self, count: usize, on_finding: OnFinding) -> Result<(), Stop> {
        let mut taken = 0;
        let mut failed = 0;
        while self.resolve(on_finding)? && taken < count && self.session().open_rows().next().is_some() {
            let before = self.session().samples.len();
            let next = match self.offer(&Intent::Measure) {
                Some(info) if info.is_enabled() => Intent::Measure,
                info => {
                    let reason =
                        info.and_then(|info| info.blocked).unwrap_or_else(|| "it is not offered here".to_owned());
                    return Err(Stop::Failed(format!("cannot measure: {reason}")));
                }
            };
            self.act(&next)?;
            if self.session().samples.len() == before {
                failed += 1;
                if failed >= TRIES {
                    let what = self.engine.wizard().notice().map_or_else(String::new, |notice| notice.what.clone());
                    return Err(Stop::Failed(format!("no sample after {TRIES} attempts: {what}")));
                }
                continue;
            }
            failed = 0;
            taken += 1;
        }
        // A finding may end capturing early; too few open poses must not.
        let is_short = count != usize::MAX && taken < count && self.session().open_rows().next().is_none();
        if is_short { Err(Stop::Failed(format!("only {taken} of {count} poses were open"))) } else { Ok(()) }
    }

    /// Resolves questioned samples. Returns `false` if capturing has to stop.
    fn resolve(&mut self, on_finding: OnFinding) -> Result<bool, Stop> {
        let mut again = 0;
        while let Some(info) = self.offer(&Intent::Keep).filter(IntentInfo::is_enabled) {
            let has_remedy = self.offer(&Intent::ApplyRemedy).is_some_and(|info| info.is_enabled());
            let intent = match on_finding {
                OnFinding::Stop => return Ok(false),
                OnFinding::Fail => {
                    let what = self.engine.wizard().notice().map_or_else(String::new, |notice| notice.what.clone());
                    return Err(Stop::Failed(format!("a check found something: {what}")));
                }
                OnFinding::Keep => info.intent,
                OnFinding::LeaveOut => Intent::LeaveOut,
                OnFinding::Remedy if has_remedy => Intent::ApplyRemedy,
                OnFinding::MeasureAgain | OnFinding::Remedy if again < TRIES => {
                    again += 1;
                    Intent::MeasureAgain
                }
                OnFinding::MeasureAgain | OnFinding::Remedy => {
                    return Err(Stop::Failed(format!("still in question after {TRIES} more measurements")));
                }
            };
            if let Some(failure) = self.perform(&intent)?
                && intent != Intent::MeasureAgain
            {
                return Err(Stop::Failed(failure));
            }
        }
        Ok(true)
    }

    fn capture_circles(&mut self) -> Result<(), Stop> {
        let mut failed = 0;
        while self.offer(&Intent::Measure).is_some_and(|info| info.is_enabled()) {
            let before = self.session().circle_points.len();
            self.act(&Intent::Measure)?;
            failed = if self.session().circle_points.len() == before { failed + 1 } else { 0 };
            if failed >= TRIES {
                return Err(Stop::Failed(format!("no point after {TRIES} attempts")));
            }
        }
        let has = |what: &str| Check::Exists.test(&self.view(), what).is_ok();
        let is_complete = has("target.circles.result") || has("target.circles.arm");
        if is_complete { Ok(()) } else { Err(Stop::Failed("the circles have no result".to_owned())) }
    }

    /// Ends the program and resumes the session from disk.
    fn restart(&mut self) -> Result<(), Stop> {
        let folder =
            self.folder().ok_or_else(|| Stop::Failed("there is no session to resume yet".to_owned()))?.to_owned();
        self.end();
        self.report()?;
        self.transcript.event("restart", "the program ends and resumes the session")?;
        // The lock must be released before it is acquired again.
        self.engine.release();
        self.engine = (self.reopen)(&folder).map_err(Stop::Failed)?;
        self.settle()
    }
}
