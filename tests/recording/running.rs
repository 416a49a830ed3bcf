//! Sessions that are run and recorded.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::text;
use trupose::recording;
use trupose::session::journal::Journal;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

use crate::support::place::Place;

impl Place {
    pub(super) fn recording(&self) -> PathBuf {
        self.session().join(recording::FILE_NAME)
    }

    /// Runs a script to its end.
    pub(super) fn script(&self, steps: &str, more: &[&str]) -> Output {
        let script = self.write_script("run.script.ron", steps);
        self.run(&[&["--script", &script, "--json"], more].concat())
    }
}

pub(super) fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}\n{}", text(&output.stdout), text(&output.stderr));
}

/// The steps up to the capture of the poses in `plan.csv`.
pub(super) fn begun(faults: &str) -> String {
    format!(
        "Do(NameSession(\"s\")), Do(ChooseProfile(\"soochow\")), Do(Next),
        Do(ChooseInstrument(Simulated((seed: 1, truth: Paper, faults: [{faults}])))), Do(Next),
        Do(ChooseTarget(Profile)), Do(Next), Do(LoadPlan(\"plan.csv\")), Do(AcceptPlan),"
    )
}

pub(super) const RESULT: &str = "Do(Next), Do(Identify), Do(Next), Do(Next), Do(Deliver)";

/// A session without anything unusual.
pub(super) fn plain() -> String {
    format!("{} CaptureAll(Fail), {RESULT}", begun(""))
}

/// A session in which something was remeasured, excluded, corrected, undone and skipped, and identified twice.
pub(super) fn eventful() -> String {
    format!(
        "{} CaptureAll(Stop), Do(LeaveOut), CaptureAll(Stop), Do(MeasureAgain), CaptureAll(Stop), Do(ApplyRemedy),
        Capture(1, Fail), Do(Undo), Do(Skip), CaptureAll(Fail), Do(Next), Do(Identify), Do(Back),
        Do(GoToPose(\"3\")), Do(Measure), Do(Next), Do(Identify), Do(Next)",
        begun("\"outlier@6:9mm\", \"outlier@9:9mm\", \"wrong-pose@12\"")
    )
}

/// A SCARA: a joint that slides, and one that moves with another.
pub(super) fn sliding() -> String {
    "Do(NameSession(\"s\")), Do(ChooseProfile(\"epson_ls3_b401s\")), Do(Next),
    Do(ChooseInstrument(Simulated((seed: 3, truth: Drawn)))), Do(Next), Do(ChooseTarget(Profile)), Do(Next),
    Do(MakePlan((poses: 16, verification: 5, candidates: 200, drift_every: 6))), Do(AcceptPlan),
    CaptureAll(Fail), Do(Next), Do(Identify), Do(Next)"
        .to_owned()
}

/// A session that was recorded while it ran.
pub(super) fn recorded(steps: &str) -> Place {
    let place = Place::new();
    succeeded(&place.script(steps, &[]));
    place
}

pub(super) fn session_of(folder: &Path) -> (Journal, Session) {
    let journal = read_journal(folder).unwrap();
    let session = Session::of(&journal).unwrap();
    (journal, session)
}
