//! The robot program of the plan, offered wherever there is a plan.

use jiff::Timestamp;

use super::effect::{Answer, Request};
use super::intent::{Intent, IntentInfo};
use super::notice::Notice;
use super::step::Action;
use super::view::ProgramView;
use crate::planning::order::Pace;
use crate::program::Dialect;
use crate::session::journal::{Entry, RobotProgramText};
use crate::session::plan::PlannedPose;
use crate::session::set_up::{ProgramText, Step};
use crate::session::state::Session;
use crate::text::{counted, listed};

/// The program that is being written.
#[derive(Clone, Debug, Default)]
pub(super) struct Programs {
    asked: Option<ProgramText>,
    /// What is said of the program once its files are on disk.
    pending: Option<(RobotProgramText, Vec<String>)>,
}

impl Programs {
    /// The offers to write the program, and to confirm that it was driven once.
    pub(super) fn offers(step: Step, session: &Session) -> Vec<IntentInfo> {
        let has_plan = session.rows.iter().any(|row| row.active);
        if !matches!(step, Step::Plan | Step::Capture) || !has_plan {
            return Vec::new();
        }
        let written = session.robot_program.as_ref();
        let label = match written {
            None => "robot program of the plan",
            Some(_) => "robot program again",
        };
        let settings = written.map_or_else(|| usual(session), |written| written.settings.clone());
        let mut offers = vec![IntentInfo::new(Intent::WriteProgram(settings), label)];
        if written.is_some_and(|written| !written.was_driven) {
            offers.push(IntentInfo::new(Intent::ProgramDriven, "the program was driven once by hand"));
        }
        offers
    }

    /// Asks for the program.
    pub(super) fn write(&mut self, settings: ProgramText, session: &Session, created: Timestamp) -> Vec<Action> {
        if settings.dialect.parse::<Dialect>().is_err() {
            return vec![Action::Say(Notice::error(format!(
                "'{}' is no language of a robot; there are {}",
                crate::text::printable(&settings.dialect),
                listed(Dialect::NAMES)
            )))];
        }
        let (Some(profile), rows) = (session.mounted_profile(), rows(session)) else { return Vec::new() };
        self.asked = Some(settings.clone());
        vec![Action::Ask(Request::Program { profile: Box::new(profile), rows, settings, created })]
    }

    /// Takes the answers that belong to the program; `None` if it is another one.
    pub(super) fn on_answer(&mut self, answer: &Answer) -> Option<Vec<Action>> {
        if let Answer::Programmed { files, dangers } = answer {
            let settings = self.asked.take()?;
            let names = files.iter().map(|(name, _)| name.clone()).collect();
            let written = RobotProgramText { settings, files: names, was_driven: false };
            self.pending = Some((written, dangers.clone()));
            return Some(vec![Action::Ask(Request::Deliver { files: files.clone(), left_out: Vec::new() })]);
        }
        if let Answer::Delivered { .. } = answer {
            let (written, dangers) = self.pending.take()?;
            let said = notice(&written, &dangers);
            return Some(vec![Action::Write(vec![Entry::RobotProgram(written)]), Action::Say(said)]);
        }
        if let Answer::Failed(problem) = answer {
            let notice = Notice::error(format!("no robot program: {}", problem.message));
            let notice = problem.hints.iter().fold(notice, |notice, hint| notice.hint(hint.clone()));
            return self.was_running().then(|| vec![Action::Say(notice)]);
        }
        (matches!(answer, Answer::Cancelled) && self.was_running()).then(Vec::new)
    }

    /// Whether a program was being written, which has ended now.
    fn was_running(&mut self) -> bool {
        self.asked.take().is_some() | self.pending.take().is_some()
    }
}

/// What is said about a program on disk.
fn notice(written: &RobotProgramText, dangers: &[String]) -> Notice {
    let files: Vec<&str> = written.files.iter().map(String::as_str).collect();
    let what = format!("the robot program is in the folder of the session: {}", listed(&files));
    let driven = "drive it once by hand at reduced speed and watch every move before you measure, then confirm it here";
    if dangers.is_empty() {
        return Notice::info(what).hint(driven);
    }
    let dangers = dangers.iter().map(|danger| format!("COLLISION predicted: {danger}"));
    dangers.fold(Notice::attention(what), Notice::hint).hint(driven)
}

/// The rows of the current plan, in the order of the program.
fn rows(session: &Session) -> Vec<PlannedPose> {
    session.rows.iter().filter(|row| row.active).map(|row| row.planned.clone()).collect()
}

/// Language of the robot's maker, and the pace at which the plan was timed.
fn usual(session: &Session) -> ProgramText {
    let pace = super::step::measuring_pace();
    let names = session.robot.as_ref().map(|robot| format!("{} {}", robot.profile.name(), robot.profile.title()));
    let dialect = Dialect::of_robot(&names.unwrap_or_default()).unwrap_or(Dialect::Rapid);
    ProgramText {
        dialect: dialect.to_string(),
        dwell_s: Some((pace.measuring_time() + 1.0).ceil()),
        speed_percent: 100.0 * Pace::default().speed,
    }
}

/// The program for a screen.
pub(super) fn view(session: &Session) -> Option<ProgramView> {
    let RobotProgramText { settings, files, was_driven } = session.robot_program.as_ref()?;
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let ProgramText { dialect, dwell_s, speed_percent } = settings;
    let wait = match dwell_s {
        Some(seconds) => format!("waits {seconds} s"),
        None => "waits for the operator".to_owned(),
    };
    let poses = counted(rows(session).iter().filter(|row| row.kind.is_measured()).count(), "pose");
    let text = format!("{}: {dialect}, {poses}, {speed_percent} % speed, {wait}", listed(&files));
    Some(ProgramView { text, was_driven: *was_driven })
}
