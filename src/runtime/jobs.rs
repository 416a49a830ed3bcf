//! Long-running jobs, one thread each.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::events::Events;
use crate::procedure;
use crate::procedure::correct::{CorrectError, CorrectRequest, several};
use crate::procedure::joint_check::Stop;
use crate::profile::{Profile, builtin, builtin_names};
use crate::program::motion::Companion;
use crate::program::{self, Dialect};
use crate::session::measurements::{self, Expected};
use crate::session::plan::{self, PlannedPose};
use crate::session::set_up::{CoordinateUnit, ProgramText};
use crate::session::workbook;
use crate::store;
use crate::text::causes;
use crate::wizard::{
    self, Answer, CircleConfigurations, Event, JointCheckStop, Problem, Request, RequestId, RequestProgress,
};

/// Starts a request. Returns `false` if the system refuses a thread.
pub(super) fn start(id: RequestId, request: Request, cancelled: Arc<AtomicBool>, events: Events) -> bool {
    let name = match &request {
        Request::Plan { .. } => "plan",
        Request::Identify(_) => "identify",
        Request::Model(_) => "model",
        Request::Correct(_) => "correct",
        _ => "read",
    };
    let work = move || {
        let job = Job { id, cancelled, events: events.clone() };
        let answer = catch_unwind(AssertUnwindSafe(|| job.run(request))).unwrap_or_else(|_panic| {
            let what = "a defect of this program has stopped the work; the session is intact";
            Answer::Failed(Problem::new(what).hint("please report it with the files of the session"))
        });
        events.send(Event::Answer { id, answer });
    };
    thread::Builder::new().name(name.to_owned()).spawn(work).is_ok()
}

struct Job {
    id: RequestId,
    cancelled: Arc<AtomicBool>,
    events: Events,
}

impl Job {
    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    fn run(&self, request: Request) -> Answer {
        // A search that is stopped still has a plan: the best so far.
        let is_search = matches!(request, Request::Plan { .. });
        let answer = match request {
            Request::LoadProfile { source } => load_profile(source),
            Request::Plan { profile, profile_text, request } => self.plan(&profile, &profile_text, &request),
            Request::LoadPlan { file, profile } => load_plan(&file, &profile),
            Request::PlanCircles { profile, is_whole } => circles(&profile, is_whole),
            Request::Program { profile, rows, settings, created } => robot_program(&profile, &rows, &settings, created),
            Request::PlanJointCheck { profile } => joint_check(&profile),
            Request::ReadPoints { file, profile, unit } => points(file, &profile, unit),
            Request::Identify(request) => self.identify(&request),
            Request::Model(request) => Ok(Answer::Modelled(Box::new(procedure::models::models(&request)))),
            Request::Correct(request) => correct(&request),
            // Other threads carry these out.
            Request::Connect { .. }
            | Request::Measure(_)
            | Request::Turn { .. }
            | Request::Deliver { .. }
            | Request::WriteCorrected(_) => Ok(Answer::Cancelled),
        };
        match answer {
            Ok(answer) if is_search || !self.is_cancelled() => answer,
            _ if self.is_cancelled() => Answer::Cancelled,
            Ok(answer) => answer,
            Err(problem) => Answer::Failed(problem),
        }
    }

    fn plan(&self, profile: &Profile, text: &str, request: &procedure::plan::PlanRequest) -> Result<Answer, Problem> {
        let keep_going = || !self.is_cancelled();
        let report = |progress: procedure::plan::Progress| {
            self.events.offer(Event::Progress { id: self.id, progress: RequestProgress::Search(progress) });
        };
        let summary = procedure::plan::plan(profile, text, request, &keep_going, &report).map_err(Problem::from)?;
        let rows = procedure::plan::rows(&summary, &procedure::joint_types(profile));
        // The set that a search has when it is stopped depends on the machine, so the seed does not reproduce it.
        let end = if self.is_cancelled() { "; the search was stopped before its end" } else { "" };
        let origin = format!("chosen from {} candidates, seed {}{end}", request.candidates, request.seed);
        Ok(Answer::Planned { summary: Some(Box::new(summary)), rows, origin })
    }

    fn identify(&self, request: &procedure::identify::IdentifyRequest) -> Result<Answer, Problem> {
        let identified = procedure::identify::identify(request, &mut |stage| {
            self.events.offer(Event::Progress { id: self.id, progress: RequestProgress::Identify(stage) });
            if self.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        Ok(Answer::Identified(Box::new(identified.map_err(Problem::from)?)))
    }
}

/// Reads a text file.
fn read(path: &Path) -> Result<String, Problem> {
    let bytes = store::read(path).map_err(|error| Problem::new(causes(&error)))?;
    String::from_utf8(bytes)
        .map_err(|_error| Problem::new(format!("'{}' is not UTF-8 text", path.display())).hint("save it as UTF-8"))
}

fn load_profile(source: String) -> Result<Answer, Problem> {
    let text = match builtin(&source) {
        Some(text) => text.to_owned(),
        None if Path::new(&source).is_file() => read(Path::new(&source))?,
        None => {
            let names: Vec<&str> = builtin_names().collect();
            return Err(Problem::new(format!("there is no profile or file '{source}'"))
                .hint(format!("shipped profiles: {}", names.join(", "))));
        }
    };
    Ok(Answer::Profile { source, text })
}

fn load_plan(file: &str, profile: &Profile) -> Result<Answer, Problem> {
    let text = read(Path::new(file))?;
    let listed =
        plan::read(&text, file, &procedure::joint_types(profile)).map_err(|errors| Problem::new(errors.to_string()))?;
    Ok(Answer::Planned { summary: None, rows: listed.rows, origin: format!("the poses of '{file}'") })
}

/// Corrects a program with its companions.
fn correct(request: &CorrectRequest) -> Result<Answer, Problem> {
    let read = |file: &str| store::read(Path::new(file)).map_err(|error| Problem::new(causes(&error)));
    let companion = |file: &str| -> Result<Companion, Problem> {
        let name = Path::new(file).file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Companion { name, text: read(file)? })
    };
    let file = read(&request.choice.file)?;
    let companions = several(&request.choice.companions).map(companion).collect::<Result<_, Problem>>()?;
    match procedure::correct::correct(request, file, companions) {
        Ok(program) => Ok(Answer::Corrected(Box::new(program))),
        Err(error @ CorrectError::Torn { .. }) => {
            let problem = Problem::new(format!("{error}; nothing is written"));
            Err(problem.hint("state what is missing: the tool, the frame, the files that belong to the program"))
        }
        Err(error) => Err(Problem::new(causes(&error))),
    }
}

/// The robot program of a plan.
fn robot_program(
    profile: &Profile,
    rows: &[PlannedPose],
    settings: &ProgramText,
    created: Timestamp,
) -> Result<Answer, Problem> {
    let dialect = settings.dialect.parse::<Dialect>().map_err(|error| Problem::new(error.to_string()))?;
    let dangers = procedure::dangers::dangers(profile, rows).map_err(Problem::from)?;
    let max_speeds: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.max_speed).collect();
    let pulses: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    let robot = program::Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &max_speeds,
        pulses_per_degree: &pulses,
        joint_aliases: profile.joint_aliases(),
    };
    let options = program::Options {
        name: "calposes".to_owned(),
        pause: settings.dwell_s.map_or(program::Pause::Acknowledge, program::Pause::Dwell),
        speed: settings.speed_percent / 100.0,
        created: created.to_zoned(TimeZone::UTC).datetime(),
        dangers: dangers.clone(),
    };
    let written = program::write(dialect, &robot, rows, &options).map_err(|error| Problem::new(causes(&error)))?;
    let files = written.files.into_iter().map(|file| (file.file_name, file.text)).collect();
    Ok(Answer::Programmed { files, dangers })
}

/// Reads the points of a file: a table as `trupose import` reads it, or lines as they are pasted.
fn points(file: String, profile: &Profile, unit: CoordinateUnit) -> Result<Answer, Problem> {
    let bytes = store::read(Path::new(&file)).map_err(|error| Problem::new(causes(&error)))?;
    let text = if workbook::is_workbook(&bytes) {
        workbook::sheet_text(&bytes, &file, None).map_err(|errors| Problem::new(errors.to_string()))?.into_bytes()
    } else {
        bytes
    };
    let joints = procedure::joint_types(profile);
    let points = match measurements::points_alone(&Expected::of(profile, &joints), unit.sign(), &text, &file) {
        Ok(points) => points,
        Err(errors) => wizard::reading::parse_named(&String::from_utf8_lossy(&text), unit).map_err(|_not_lines| {
            Problem::new(errors.to_string()).hint(format!(
                "a table needs titles such as 'pose, x_mm, y_mm, z_mm'; without titles, write one point per line: name x y z in {}",
                unit.sign()
            ))
        })?,
    };
    Ok(Answer::Points { file, points })
}

fn joint_check(profile: &Profile) -> Result<Answer, Problem> {
    let stops = procedure::joint_check::plan(profile).map_err(Problem::from)?;
    let stop = |stop: Stop| JointCheckStop { joint: stop.joint, configuration: stop.configuration };
    Ok(Answer::JointCheckPlanned(stops.into_iter().map(stop).collect()))
}

fn circles(profile: &Profile, is_whole: bool) -> Result<Answer, Problem> {
    let plan = if is_whole { procedure::circles::plan_whole } else { procedure::circles::plan };
    let circles = plan(profile).map_err(Problem::from)?;
    let configurations = |(joint, configurations)| CircleConfigurations { joint, configurations };
    Ok(Answer::CirclesPlanned(circles.into_iter().map(configurations).collect()))
}
