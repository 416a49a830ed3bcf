//! A cell without hardware: answers effects with what a known arm, a hand-made plan and the real identification give.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::LazyLock;

use jiff::{SignedDuration, Timestamp};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kinematics::{ForwardKinematics, KinematicChain, LinkParameter, ParameterId};
use crate::procedure;
use crate::procedure::identify::identify;
use crate::procedure::models::models;
use crate::profile::{Profile, builtin};
use crate::session::journal::{Entry, Journal, Line};
use crate::session::measurements::NamedPoint;
use crate::session::plan::{PlannedPose, PoseKind};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step, TargetChoice};
use crate::session::simulation::Simulation;
use crate::session::state::Session;
use crate::units::{DEGREE, MICROMETRE, MILLIMETRE};
use crate::wizard::view::{CaptureView, Content};
use crate::wizard::{
    Answer, CircleConfigurations, Effect, Event, Intent, JointCheckStop, PlanSettings, Problem, Request, RequestId,
    StoreEvent, ViewModel, Wizard,
};

/// A robot program, whatever its file is called.
const PROGRAM: &str = "MODULE M\n  PROC main()\n    MoveAbsJ [[10,20,-20,10,40,5],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n  ENDPROC\nENDMODULE\n";

/// Identification poses of the plan.
pub(super) const IDENTIFICATION: usize = 14;
/// Verification poses of the plan.
pub(super) const VERIFICATION: usize = 4;
/// Everything that the plan measures: the drift pose as well.
pub(super) const MEASURED: usize = IDENTIFICATION + VERIFICATION + 1;
/// Folder of the session.
pub(super) const FOLDER: &str = "sessions/first";

/// A wizard with its outside.
#[derive(Clone)]
pub(super) struct Bench {
    pub(super) wizard: Wizard,
    /// Lines that the store has acknowledged.
    pub(super) journal: Vec<Line>,
    /// What was to be seen after each acknowledgement, with the number of lines.
    pub(super) seen: Vec<(usize, ViewModel)>,
    /// How often the wizard wanted to end.
    pub(super) exits: usize,
    time: Timestamp,
}

pub(super) fn start() -> Timestamp {
    "2026-03-01T09:15:02Z".parse().unwrap()
}

/// The robot of the bench.
static PROFILE: LazyLock<Profile> = LazyLock::new(|| Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0);

/// The robot as it really is.
static TRUE_ARM: LazyLock<KinematicChain> = LazyLock::new(|| {
    let deviation = |joint, parameter, value| (ParameterId::Link { joint, parameter }, value);
    let deviations = [
        deviation(1, LinkParameter::Theta, 0.02 * DEGREE),
        deviation(2, LinkParameter::A, 0.3 * MILLIMETRE),
        deviation(4, LinkParameter::Theta, -0.03 * DEGREE),
    ];
    PROFILE.arm().with(deviations).unwrap().chain
});

/// The n-th of evenly spread configurations within the planning limits (rad).
pub(super) fn configuration(index: usize) -> Vec<f64> {
    // Fractional parts of multiples of the square roots of primes.
    let roots = [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0].map(f64::sqrt);
    let limits = PROFILE.joints().iter().map(|range| range.planning_limits.unwrap()).collect::<Vec<_>>();
    let spread = |(root, (low, high)): (f64, &(f64, f64))| low + (high - low) * (root * (index + 1) as f64).fract();
    roots.into_iter().zip(&limits).map(spread).collect()
}

pub(super) fn planned(pose: &str, kind: PoseKind, index: usize) -> PlannedPose {
    PlannedPose { pose: pose.to_owned(), kind, configuration: configuration(index), point_in_base: None }
}

/// home, 1 … 7, via, 8 … 14, 1 again for drift, 15 … 18 to verify, home.
pub(super) fn plan() -> Vec<PlannedPose> {
    let numbered = |range: std::ops::RangeInclusive<usize>, kind| {
        range.map(move |number| planned(&number.to_string(), kind, number)).collect::<Vec<_>>()
    };
    let last = IDENTIFICATION + VERIFICATION;
    [
        vec![planned("home", PoseKind::Home, 0)],
        numbered(1..=7, PoseKind::Identification),
        vec![planned("via1", PoseKind::Via, 40)],
        numbered(8..=IDENTIFICATION, PoseKind::Identification),
        vec![planned("1", PoseKind::Drift, 1)],
        numbered(IDENTIFICATION + 1..=last, PoseKind::Verification),
        vec![planned("home", PoseKind::Home, 0)],
    ]
    .concat()
}

/// Where the tracker sees the SMR of the true arm (m).
pub(super) fn seen_at(configuration: &[f64]) -> Point3<f64> {
    let target = PROFILE.targets()[0].position_in_flange;
    let base_from_tracker = Isometry3::new(Vector3::new(3.5, 0.0, 1.0), Vector3::new(0.0, 0.0, 3.0));
    base_from_tracker.inverse() * ForwardKinematics::new(&TRUE_ARM).point_in_base(configuration, &target)
}

/// What the instrument gives: a little different each time.
pub(super) fn reading(request: &MeasureRequest) -> Reading {
    let noise = |phase: f64| 5.0 * MICROMETRE * (7.1 * request.number as f64 + phase).sin();
    Reading {
        point: seen_at(&request.configuration) + Vector3::new(noise(0.0), noise(2.0), noise(4.0)),
        sigma: Some(10.0 * MICROMETRE),
        scatter: Some(8.0 * MICROMETRE),
        shots: request.shots,
        temperature: Some(21.5),
        pressure: Some(1012.5),
        humidity: Some(44.0),
        configuration: None,
        joint_scatter: None,
        remarks: Vec::new(),
        seconds: 12.0,
    }
}

/// What the outside says to a request.
pub(super) fn answer(request: &Request) -> Answer {
    match request {
        Request::LoadProfile { source } => match builtin(source) {
            Some(text) => Answer::Profile { source: source.clone(), text: text.to_owned() },
            None => failure(&format!("there is no profile or file '{source}'")),
        },
        Request::Connect { instrument, .. } => {
            let is_recording = matches!(instrument, InstrumentChoice::Replay { .. });
            let recorded = plan().into_iter().filter(|row| is_recording && row.kind.is_measured()).collect();
            Answer::Connected { identity: "bench instrument".to_owned(), warnings: Vec::new(), recorded }
        }
        Request::Measure(request) => Answer::Measured(reading(request)),
        Request::Turn { .. } => Answer::Turned,
        Request::Plan { request, .. } if request.included.is_empty() => {
            Answer::Planned { summary: None, rows: plan(), origin: "the plan of the bench".to_owned() }
        }
        Request::Plan { request, .. } => {
            let new = (1..=request.poses).map(|n| {
                let number = usize::try_from(request.numbered_after).unwrap() + n;
                planned(&number.to_string(), PoseKind::Identification, number)
            });
            let home = planned("home", PoseKind::Home, 0);
            let rows = std::iter::once(home.clone()).chain(new).chain([home]).collect();
            Answer::Planned { summary: None, rows, origin: "next best".to_owned() }
        }
        Request::LoadPlan { file, .. } => {
            Answer::Planned { summary: None, rows: plan(), origin: format!("the poses of '{file}'") }
        }
        Request::PlanCircles { is_whole: false, .. } => Answer::CirclesPlanned(circles()),
        Request::PlanCircles { profile, is_whole: true } => {
            let planned = crate::procedure::circles::plan_whole(profile).unwrap().into_iter();
            let planned = planned.map(|(joint, configurations)| CircleConfigurations { joint, configurations });
            Answer::CirclesPlanned(planned.collect())
        }
        Request::Program { settings, rows, .. } => Answer::Programmed {
            files: vec![(format!("calposes.{}", settings.dialect), format!("{} rows", rows.len()))],
            dangers: Vec::new(),
        },
        Request::PlanJointCheck { .. } => Answer::JointCheckPlanned(joint_check()),
        Request::ReadPoints { file, .. } if file == "points.csv" => {
            let named =
                |row: &PlannedPose| NamedPoint { name: Some(row.pose.clone()), point: seen_at(&row.configuration) };
            let rows: Vec<PlannedPose> =
                plan().into_iter().filter(|row| row.kind == PoseKind::Identification).collect();
            Answer::Points { file: file.clone(), points: rows.iter().map(named).collect() }
        }
        Request::ReadPoints { file, .. } => failure(&format!("cannot read '{file}'")),
        Request::Identify(request) => match identify(request, &mut |_| ControlFlow::Continue(())) {
            Ok(identified) => Answer::Identified(Box::new(identified)),
            Err(error) => failure(&error.to_string()),
        },
        Request::Model(request) => Answer::Modelled(Box::new(models(request))),
        Request::Correct(request) => {
            match procedure::correct::correct(request, PROGRAM.as_bytes().to_vec(), Vec::new()) {
                Ok(program) => Answer::Corrected(Box::new(program)),
                Err(error) => failure(&error.to_string()),
            }
        }
        Request::WriteCorrected(program) => Answer::CorrectedWritten(Box::new(program.summary.clone())),
        Request::Deliver { files, left_out } => {
            let files = files.iter().map(|(name, _)| name.clone()).collect();
            Answer::Delivered { files, sums: Vec::new(), left_out: left_out.clone() }
        }
    }
}

/// Each joint moved by ten degrees.
fn joint_check() -> Vec<JointCheckStop> {
    let mut q = vec![0.3, 0.2, -0.4, 0.3, 0.6, 0.1];
    let mut stops = vec![JointCheckStop { joint: None, configuration: q.clone() }];
    for joint in 0..q.len() {
        q[joint] += 10.0 * DEGREE;
        stops.push(JointCheckStop { joint: Some(joint), configuration: q.clone() });
    }
    stops
}

/// The last two joints turned, six points each.
fn circles() -> Vec<CircleConfigurations> {
    [(5, 60.0), (4, 35.0)]
        .map(|(joint, step): (usize, f64)| {
            let at = |n: u8| {
                let mut q = vec![0.0, 0.2, -0.2, 0.3, 0.6, 0.1];
                q[joint] = (f64::from(n) - 2.5) * step * DEGREE;
                q
            };
            CircleConfigurations { joint, configurations: (0..6).map(at).collect() }
        })
        .to_vec()
}

pub(super) fn failure(message: &str) -> Answer {
    Answer::Failed(Problem::new(message))
}

/// The id and request of the only `Start` among the effects.
pub(super) fn started(effects: &[Effect]) -> (RequestId, Request) {
    let found = effects.iter().find_map(|effect| {
        let Effect::Start { id, request } = effect else { return None };
        Some((*id, request.clone()))
    });
    found.unwrap_or_else(|| panic!("nothing was started: {:?}", texts(effects)))
}

/// The id and lines of the only `Append` among the effects.
pub(super) fn appended(effects: &[Effect]) -> (RequestId, Vec<Line>) {
    let found = effects.iter().find_map(|effect| {
        let Effect::Append { id, lines } = effect else { return None };
        Some((*id, lines.clone()))
    });
    found.unwrap_or_else(|| panic!("nothing was appended: {:?}", texts(effects)))
}

/// Effects in words, without their ids.
pub(super) fn texts(effects: &[Effect]) -> Vec<String> {
    let text = |effect: &Effect| match effect {
        Effect::Create { name, .. } => format!("create {name}"),
        Effect::Append { lines, .. } => {
            let lines: Vec<String> =
                lines.iter().map(|line| format!("{} {}", line.number, line.entry.describe())).collect();
            format!("append {}", lines.join(" | "))
        }
        Effect::Start { request, .. } => format!("start {}", request.what()),
        Effect::Cancel(_) => "cancel".to_owned(),
        Effect::Exit => "exit".to_owned(),
    };
    effects.iter().map(text).collect()
}

/// Everything about a wizard: two with the same text are the same.
pub(super) fn state(wizard: &Wizard) -> String {
    format!("{wizard:?}")
}

/// The offers in words: `*` marks the default, what follows `--` is the reason why not.
pub(super) fn offers(wizard: &Wizard) -> Vec<String> {
    let text = |info: crate::wizard::IntentInfo| {
        let mark = if info.is_default { "*" } else { "" };
        let blocked = info.blocked.map_or_else(String::new, |reason| format!(" -- {reason}"));
        format!("{}{mark}{blocked}", info.intent.name())
    };
    wizard.intents().into_iter().map(text).collect()
}

/// The reason why an intent cannot be done; panics if it is not on offer or can be done.
pub(super) fn blocked(wizard: &Wizard, name: &str) -> String {
    let info = wizard.intents().into_iter().find(|info| info.intent.name() == name);
    info.unwrap_or_else(|| panic!("{name} is not on offer")).blocked.unwrap_or_else(|| panic!("{name} can be done"))
}

/// The fold of lines.
pub(super) fn fold(lines: &[Line]) -> Session {
    Session::of(&Journal { lines: lines.to_vec(), ..Journal::default() }).unwrap()
}

pub(super) const MANUAL: InstrumentChoice = InstrumentChoice::Manual { unit: CoordinateUnit::Millimetre };

pub(super) fn simulated() -> InstrumentChoice {
    InstrumentChoice::Simulated(Simulation::default())
}

impl Bench {
    pub(super) fn new() -> Self {
        Self { wizard: Wizard::new(start()), journal: Vec::new(), seen: Vec::new(), exits: 0, time: start() }
    }

    /// In a step, reached on the straight way with an instrument that measures automatically.
    pub(super) fn at(step: Step) -> Self {
        Self::with(&simulated(), step)
    }

    pub(super) fn with(instrument: &InstrumentChoice, step: Step) -> Self {
        let mut bench = Self::new();
        while bench.step() < step {
            bench.pass(instrument);
        }
        assert_eq!(bench.step(), step);
        bench
    }

    /// Completes a step and continues.
    pub(super) fn pass(&mut self, instrument: &InstrumentChoice) {
        match self.step() {
            Step::Profile => {
                if !self.wizard.session().has_measurements() {
                    self.does(Intent::ChooseProfile("soochow".to_owned()));
                }
            }
            Step::Instrument => {
                if self.wizard.session().instrument.is_none() {
                    self.does(Intent::ChooseInstrument(instrument.clone()));
                }
            }
            Step::Target => {
                if self.wizard.session().target.is_none() {
                    self.does(Intent::ChooseTarget(TargetChoice::Profile));
                }
            }
            Step::Plan => {
                if self.wizard.session().rows.is_empty() {
                    self.does(Intent::MakePlan(PlanSettings::default()));
                    self.does(Intent::AcceptPlan);
                    return;
                }
            }
            Step::Capture => {
                self.measure(usize::MAX);
            }
            Step::Identify => {
                if !self.wizard.session().is_current() {
                    self.does(Intent::Identify);
                }
            }
            Step::Verify => {}
            Step::Deliver => return self.does(Intent::Deliver),
        }
        self.does(Intent::Next);
    }

    /// Measures at most so many poses that wait.
    pub(super) fn measure(&mut self, most: usize) {
        for _ in 0..most {
            if self.wizard.session().open_rows().next().is_none() {
                break;
            }
            match self.wizard.session().instrument {
                Some(InstrumentChoice::Manual { .. }) => {
                    let row = self.capture().row.unwrap();
                    let point = seen_at(&self.wizard.session().rows[row].planned.configuration).coords / MILLIMETRE;
                    // Typed with six decimals, a little different each time.
                    let noise = 1e-3 * (self.wizard.session().measurements % 7) as f64;
                    let text = format!("{:.6} {:.6} {:.6}", point.x + noise, point.y, point.z);
                    self.does(Intent::TypeReading(text));
                }
                _ => self.does(Intent::Measure),
            }
        }
    }

    pub(super) fn step(&self) -> Step {
        self.wizard.view().header.step
    }

    pub(super) fn capture(&self) -> CaptureView {
        let Content::Capture(view) = self.wizard.view().content else { panic!("not in the capture step") };
        *view
    }

    /// The message on the screen.
    pub(super) fn told(&self) -> String {
        self.wizard.notice().map_or_else(String::new, |notice| notice.what.clone())
    }

    pub(super) fn last_entry(&self) -> &Entry {
        &self.journal.last().unwrap().entry
    }

    /// An intent that nothing is answered to.
    pub(super) fn intend(&mut self, intent: Intent) -> Vec<Effect> {
        self.wizard.update(Event::Intent(intent))
    }

    /// An intent that can be done, with everything that follows from it.
    pub(super) fn does(&mut self, intent: Intent) {
        let info = self.wizard.intents().into_iter().find(|info| info.intent.name() == intent.name());
        let blocked = info.unwrap_or_else(|| panic!("{intent:?} is not on offer in {}", self.step())).blocked;
        assert_eq!(blocked, None, "{intent:?}");
        let effects = self.intend(intent);
        self.settle(effects);
    }

    /// Answers effects until nothing is left to be answered.
    pub(super) fn settle(&mut self, effects: Vec<Effect>) {
        let mut open = VecDeque::from(effects);
        while let Some(effect) = open.pop_front() {
            open.extend(self.perform(effect));
        }
    }

    /// Does one effect and tells the wizard.
    pub(super) fn perform(&mut self, effect: Effect) -> Vec<Effect> {
        match effect {
            Effect::Create { id, name } => {
                self.wizard.update(Event::Store(StoreEvent::Created { id, folder: FOLDER.to_owned(), name }))
            }
            Effect::Append { id, lines } => self.written(id, lines),
            Effect::Start { id, request } => self.answer(id, answer(&request)),
            Effect::Cancel(_) => Vec::new(),
            Effect::Exit => {
                self.exits += 1;
                Vec::new()
            }
        }
    }

    pub(super) fn written(&mut self, id: RequestId, lines: Vec<Line>) -> Vec<Effect> {
        self.journal.extend(lines);
        let effects = self.wizard.update(Event::Store(StoreEvent::Written { id }));
        self.seen.push((self.journal.len(), self.wizard.view()));
        effects
    }

    pub(super) fn failed(&mut self, id: RequestId) -> Vec<Effect> {
        self.wizard.update(Event::Store(StoreEvent::Failed { id, message: "no space left".to_owned() }))
    }

    /// Answers a request, twenty seconds later.
    pub(super) fn answer(&mut self, id: RequestId, answer: Answer) -> Vec<Effect> {
        self.time += SignedDuration::from_secs(20);
        assert!(self.wizard.update(Event::Tick(self.time)).is_empty());
        self.wizard.update(Event::Answer { id, answer })
    }

    /// Goes on with what the journal holds, as after a crash.
    pub(super) fn resumed(&self, lines: usize) -> (Self, Vec<Effect>) {
        let journal = self.journal[..lines].to_vec();
        let (wizard, effects) = Wizard::resume(fold(&journal), FOLDER.to_owned(), 0, self.time);
        (Self { wizard, journal, seen: Vec::new(), exits: 0, time: self.time }, effects)
    }
}
