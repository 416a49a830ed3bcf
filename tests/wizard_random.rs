//! The wizard under random events: whatever is wanted, answered, repeated, late, failed or forgotten, in whatever order, it does
//! not panic, always has a way on, and is the fold of what the store has acknowledged.
//!
//! `TRUPOSE_WIZARD_SEEDS` sets the number of streams; those of the first seeds stay the same.

#![expect(clippy::print_stderr, reason = "a failure names its seed")]

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use jiff::{SignedDuration, Timestamp};
use nalgebra::{Point3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use trupose::kinematics::ForwardKinematics;
use trupose::procedure::correct::ProgramFile;
use trupose::procedure::identify::identify;
use trupose::procedure::models::{Models, models};
use trupose::profile::{Profile, builtin};
use trupose::session::about::About;
use trupose::session::corrected::{CorrectedText, Points, ProgramChoice};
use trupose::session::journal::Line;
use trupose::session::measurements::NamedPoint;
use trupose::session::plan::{PlannedPose, PoseKind};
use trupose::session::reading::{MeasureRequest, Reading};
use trupose::session::set_up::{CoordinateUnit, InstrumentChoice, TargetChoice};
use trupose::session::simulation::Simulation;
use trupose::session::state::Session;
use trupose::units::{DEGREE, MICROMETRE, MILLIMETRE};
use trupose::wizard::{
    Answer, CircleConfigurations, Effect, Event, Intent, JointCheckStop, PlanSettings, Problem, Request, RequestId,
    RequestProgress, StoreEvent, Wizard,
};

/// Streams of events, where `TRUPOSE_WIZARD_SEEDS` does not ask for more.
const SEEDS: u64 = 4;
/// Events of a stream.
const EVENTS: usize = 10_000;

/// A wizard, what it waits for, and what is true about it.
struct Cell {
    wizard: Wizard,
    rng: ChaCha8Rng,
    profile: Profile,
    /// Effects that are not answered.
    open: Vec<Effect>,
    /// Events that were delivered, to be delivered again.
    past: Vec<Event>,
    /// The fold of the lines that were acknowledged.
    folded: Session,
    /// The append that the wizard waits for.
    writing: Option<(RequestId, Vec<Line>)>,
    exits: usize,
    sessions: usize,
    /// The first models of this cell.
    models: Option<Models>,
}

fn start() -> Timestamp {
    "2026-03-01T09:15:02Z".parse().unwrap()
}

impl Cell {
    fn new(seed: u64) -> Self {
        Self {
            wizard: Wizard::new(start()),
            rng: ChaCha8Rng::seed_from_u64(seed),
            profile: Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0,
            open: Vec::new(),
            past: Vec::new(),
            folded: Session::default(),
            writing: None,
            exits: 0,
            sessions: 0,
            models: None,
        }
    }

    fn chance(&mut self, percent: u32) -> bool {
        self.rng.random_range(0..100) < percent
    }

    fn pick(&mut self, count: usize) -> usize {
        self.rng.random_range(0..count.max(1))
    }

    /// Anything that may happen next.
    fn event(&mut self) -> Event {
        match self.rng.random_range(0..100) {
            // Mostly the outside does what it is asked for.
            0..48 if !self.open.is_empty() => self.due(),
            48..52 if !self.past.is_empty() => {
                let which = self.pick(self.past.len());
                self.past[which].clone()
            }
            52..55 => self.stranger(),
            55..57 => {
                let seconds = self.rng.random_range(-100_000..100_000);
                Event::Tick(start() + SignedDuration::from_secs(seconds))
            }
            57 if self.chance(10) => Event::Shutdown { cause: "SIGTERM".to_owned() },
            _ => Event::Intent(self.intent()),
        }
    }

    /// The answer to something that is open, often the newest.
    fn due(&mut self) -> Event {
        let which = if self.chance(70) { self.open.len() - 1 } else { self.pick(self.open.len()) };
        let effect = if self.chance(97) { self.open.remove(which) } else { self.open[which].clone() };
        match effect {
            Effect::Create { id, .. } if self.chance(10) => {
                Event::Store(StoreEvent::Failed { id, message: "no such device".to_owned() })
            }
            Effect::Create { id, name } => {
                Event::Store(StoreEvent::Created { id, folder: format!("sessions/{name}"), name })
            }
            Effect::Append { id, .. } if self.chance(3) => {
                Event::Store(StoreEvent::Failed { id, message: "no space left".to_owned() })
            }
            Effect::Append { id, .. } => Event::Store(StoreEvent::Written { id }),
            Effect::Start { id, request } if self.chance(10) => {
                let sweeping = matches!(request, Request::Plan { .. });
                self.open.push(Effect::Start { id, request });
                let search = trupose::procedure::plan::Progress::Unreachable { poses: usize::from(sweeping) };
                Event::Progress { id, progress: RequestProgress::Search(search) }
            }
            Effect::Start { id, request } => Event::Answer { id, answer: self.answer(&request) },
            Effect::Cancel(id) => {
                self.open.retain(|effect| !matches!(effect, Effect::Start { id: open, .. } if *open == id));
                Event::Answer { id, answer: Answer::Cancelled }
            }
            Effect::Exit => Event::Tick(start()),
        }
    }

    /// An event with an id that means nothing.
    fn stranger(&mut self) -> Event {
        let id = RequestId(self.rng.random_range(100_000_000..200_000_000));
        match self.rng.random_range(0..4) {
            0 => Event::Store(StoreEvent::Written { id }),
            1 => Event::Store(StoreEvent::Failed { id, message: "?".to_owned() }),
            2 => Event::Store(StoreEvent::Created { id, folder: "x".to_owned(), name: "x".to_owned() }),
            _ => Event::Answer { id, answer: Answer::Cancelled },
        }
    }

    fn intent(&mut self) -> Intent {
        let offers = self.wizard.intents();
        let enabled: Vec<Intent> =
            offers.iter().filter(|info| info.is_enabled()).map(|info| info.intent.clone()).collect();
        let default = offers.iter().find(|info| info.is_default).map(|info| info.intent.clone());
        let intent = match self.rng.random_range(0..100) {
            0..45 => default.unwrap_or(Intent::Measure),
            45..90 if !enabled.is_empty() => enabled[self.pick(enabled.len())].clone(),
            _ => {
                let all = every_intent();
                all[self.pick(all.len())].clone()
            }
        };
        // The end comes, but not at once.
        if intent == Intent::Quit && !self.chance(3) {
            return Intent::Dismiss;
        }
        self.with_argument(intent)
    }

    /// The same intent with another argument: a good one, or rubbish.
    fn with_argument(&mut self, intent: Intent) -> Intent {
        match intent {
            Intent::ChooseProfile(_) => {
                let name = ["soochow", "soochow", "soochow", "ur5", "epson_ls3_b401s", "nowhere"][self.pick(6)];
                Intent::ChooseProfile(name.to_owned())
            }
            Intent::NameSession(_) => Intent::NameSession(self.text()),
            Intent::ChooseInstrument(_) => Intent::ChooseInstrument(match self.pick(3) {
                0 => InstrumentChoice::Manual { unit: CoordinateUnit::ALL[self.pick(4)] },
                1 => InstrumentChoice::Simulated(Simulation::default()),
                _ => InstrumentChoice::Replay { sets: Vec::new() },
            }),
            Intent::ChooseTarget(_) => Intent::ChooseTarget(match self.pick(4) {
                0 => TargetChoice::Profile,
                1 => TargetChoice::Free { sigma_mm: [50.0, f64::NAN, -1.0][self.pick(3)] },
                2 => TargetChoice::Circles { xyz_mm: (1.0, 2.0, 3.0), sigma_mm: f64::INFINITY },
                _ => TargetChoice::Known { xyz_mm: (-1.5, [26.0, f64::NAN, 1e9][self.pick(3)], 72.0), sigma_mm: 0.0 },
            }),
            Intent::MakePlan(_) => Intent::MakePlan(PlanSettings {
                poses: [0, 14, usize::MAX][self.pick(3)],
                seed: self.rng.random(),
                ..PlanSettings::default()
            }),
            Intent::LoadPlan(_) => Intent::LoadPlan(self.text()),
            Intent::TypeReading(_) => Intent::TypeReading(self.coordinates()),
            Intent::GoToPose(_) if self.chance(80) => Intent::GoToPose(self.rng.random_range(0..40).to_string()),
            Intent::GoToPose(_) => Intent::GoToPose(self.text()),
            Intent::Note(_) => Intent::Note(self.text()),
            Intent::NotePose { .. } => {
                Intent::NotePose { pose: self.rng.random_range(0..20).to_string(), text: self.text() }
            }
            Intent::Exclude(_) => Intent::Exclude(self.rng.random_range(0..20).to_string()),
            Intent::Include(_) => Intent::Include(self.rng.random_range(0..20).to_string()),
            Intent::ReadPoints(_) => Intent::ReadPoints(self.text()),
            Intent::ShowPoints(_) => {
                let lines: Vec<String> = (0..self.pick(4)).map(|_| self.coordinates()).collect();
                Intent::ShowPoints(lines.join("\n"))
            }
            Intent::About(_) => Intent::About(Box::new(About {
                serial: self.text(),
                operator: self.text(),
                smr: self.text(),
                ..About::default()
            })),
            Intent::CorrectProgram(_) => Intent::CorrectProgram(Box::new(ProgramChoice {
                file: self.text() + ".mod",
                points: Points::ALL[self.pick(3)],
                tool: self.text(),
                ..ProgramChoice::default()
            })),
            Intent::SuggestPoses(_) => Intent::SuggestPoses([0, 1, 3, usize::MAX][self.pick(4)]),
            other => other,
        }
    }

    fn text(&mut self) -> String {
        let texts =
            ["", " ", "first", "..", "a/b", "\u{1b}[31mred\u{7}", "\"quoted\\", "ä€😀\u{202e}", "1, 2; 3", "plan.csv"];
        let text = texts[self.pick(texts.len())];
        if self.chance(3) { text.repeat(500) } else { text.to_owned() }
    }

    fn coordinates(&mut self) -> String {
        if self.chance(15) {
            return self.text();
        }
        let [x, y, z] = [(); 3].map(|()| self.rng.random_range(-2000.0..2000.0));
        match self.pick(6) {
            0 => "0 0 0".to_owned(),
            1 => format!("{x:.3},{y:.3},{z:.3}"),
            2 => "1 nan 3".to_owned(),
            3 => format!("{x:.1e}; {y:.1e}; 1e300"),
            _ => format!("x={x:.4} y={y:.4} z={z:.4} mm"),
        }
    }

    fn answer(&mut self, request: &Request) -> Answer {
        if self.chance(8) {
            return Answer::Cancelled;
        }
        if self.chance(8) {
            let message = self.text();
            return Answer::Failed(Problem::new(message).hint(self.text()));
        }
        match request {
            Request::LoadProfile { source } => {
                let text = builtin(source).unwrap_or("(broken").to_owned();
                Answer::Profile { source: source.clone(), text }
            }
            Request::Connect { instrument, profile } => {
                let is_recording = matches!(instrument, InstrumentChoice::Replay { .. });
                let joints = profile.chain().dof();
                let recorded = if is_recording { self.poses(1, 16, joints) } else { Vec::new() };
                Answer::Connected { identity: self.text(), warnings: Vec::new(), recorded }
            }
            Request::Measure(request) => Answer::Measured(self.reading(request)),
            Request::Turn { .. } => Answer::Turned,
            Request::Plan { profile, request, .. } => {
                let count = request.poses.min(14);
                let first = usize::try_from(request.numbered_after).unwrap() + 1;
                let rows = self.poses(first, count, profile.chain().dof());
                Answer::Planned { summary: None, rows, origin: "random".to_owned() }
            }
            Request::LoadPlan { profile, .. } => {
                // A defect outside: poses of another arm.
                let joints = profile.chain().dof() - usize::from(self.chance(10));
                Answer::Planned { summary: None, rows: self.poses(1, 16, joints), origin: self.text() }
            }
            Request::PlanCircles { profile, .. } => {
                let joints = profile.chain().dof();
                Answer::CirclesPlanned(vec![
                    CircleConfigurations { joint: joints - 1, configurations: self.circle(joints, joints - 1) },
                    CircleConfigurations { joint: joints - 2, configurations: self.circle(joints, joints - 2) },
                ])
            }
            Request::Correct(request) => Answer::Corrected(Box::new(ProgramFile {
                summary: CorrectedText {
                    source: request.choice.file.clone(),
                    file: self.text(),
                    ..CorrectedText::default()
                },
                bytes: vec![0xff],
            })),
            Request::WriteCorrected(program) => Answer::CorrectedWritten(Box::new(program.summary.clone())),
            Request::Program { .. } => {
                Answer::Programmed { files: vec![("calposes.src".to_owned(), self.text())], dangers: Vec::new() }
            }
            Request::PlanJointCheck { profile } => {
                let joints = profile.chain().dof();
                let mut configuration = vec![0.3; joints];
                let mut stops = vec![JointCheckStop { joint: None, configuration: configuration.clone() }];
                for joint in 0..joints {
                    configuration[joint] += 10.0 * DEGREE;
                    stops.push(JointCheckStop { joint: Some(joint), configuration: configuration.clone() });
                }
                Answer::JointCheckPlanned(stops)
            }
            Request::ReadPoints { file, .. } => {
                let point = |_| NamedPoint {
                    name: self.chance(50).then(|| self.rng.random_range(0..20).to_string()),
                    point: Point3::new(1.0, 2.0, self.rng.random_range(0.0..3.0)),
                };
                Answer::Points { file: file.clone(), points: (0..3).map(point).collect() }
            }
            Request::Identify(request) => match identify(request, &mut |_| ControlFlow::Continue(())) {
                Ok(identified) => Answer::Identified(Box::new(identified)),
                Err(error) => Answer::Failed(error.into()),
            },
            // Proving the models takes longer than a hundred other answers, and the wizard only passes them on.
            Request::Model(request) => {
                Answer::Modelled(Box::new(self.models.get_or_insert_with(|| models(request)).clone()))
            }
            Request::Deliver { files, left_out } => {
                let files = files.iter().map(|(name, _)| name.clone()).collect();
                Answer::Delivered { files, sums: Vec::new(), left_out: left_out.clone() }
            }
        }
    }

    fn poses(&mut self, first: usize, count: usize, joints: usize) -> Vec<PlannedPose> {
        let home = PlannedPose {
            pose: "home".to_owned(),
            kind: PoseKind::Home,
            configuration: vec![0.0; joints],
            point_in_base: None,
        };
        let mut rows = vec![home.clone()];
        for number in first..first + count {
            let kind = [PoseKind::Identification, PoseKind::Verification, PoseKind::Drift, PoseKind::Via];
            let kind = if self.chance(80) { PoseKind::Identification } else { kind[self.pick(4)] };
            let configuration = (0..joints).map(|_| self.rng.random_range(-1.2..1.2)).collect();
            rows.push(PlannedPose { pose: number.to_string(), kind, configuration, point_in_base: None });
        }
        rows.push(home);
        rows
    }

    fn circle(&mut self, joints: usize, turned: usize) -> Vec<Vec<f64>> {
        let at = |n: u8| {
            let mut q = vec![0.3; joints];
            q[turned] = (f64::from(n) - 1.5) * 50.0 * DEGREE;
            q
        };
        (0..3 + u8::from(self.chance(80))).map(at).collect()
    }

    /// Where the nominal arm has the SMR, a little off; now and then far off, or no reading at all.
    fn reading(&mut self, request: &MeasureRequest) -> Reading {
        let target = self.profile.targets()[0].position_in_flange;
        let fits = request.configuration.len() == self.profile.chain().dof();
        let nominal = if fits {
            ForwardKinematics::new(self.profile.chain()).point_in_base(&request.configuration, &target)
        } else {
            Point3::new(0.3, 0.2, 0.1)
        };
        let noise = Vector3::from_fn(|_, _| self.rng.random_range(-10.0..10.0) * MICROMETRE);
        let point = match self.pick(40) {
            0 => Point3::origin(),
            1 => Point3::new(f64::NAN, 0.0, f64::INFINITY),
            2 => nominal * 1e200,
            3 => nominal * 25.4,
            4 => Point3::new(-nominal.x, nominal.y, nominal.z),
            _ => nominal + noise,
        };
        let some = |value: f64, cell: &mut Self| if cell.chance(90) { Some(value) } else { None };
        let odd = [0.0, -1.0, f64::NAN, f64::INFINITY, 1.0][self.pick(5)];
        let odd = if self.chance(5) { Some(odd) } else { None };
        Reading {
            point,
            sigma: odd.or_else(|| some(10.0 * MICROMETRE, self)),
            scatter: odd.or_else(|| some(8.0 * MICROMETRE, self)),
            shots: request.shots,
            temperature: Some(20.0),
            pressure: None,
            humidity: None,
            configuration: if self.chance(10) { Some(vec![0.1; self.pick(8)]) } else { None },
            joint_scatter: None,
            remarks: Vec::new(),
            seconds: if self.chance(5) { 0.1 * MILLIMETRE } else { 10.0 },
        }
    }

    /// Delivers an event and checks everything that must be true before, between and after.
    fn step(&mut self) {
        let event = self.event();
        if self.past.len() < 200 {
            self.past.push(event.clone());
        } else {
            let which = self.pick(200);
            self.past[which] = event.clone();
        }
        // What the store acknowledges counts from now on, if the wizard still waited for it.
        if let Event::Store(StoreEvent::Written { id }) = &event
            && let Some((_, lines)) = self.writing.take_if(|(writing, _)| writing == id)
        {
            for line in &lines {
                assert_eq!(line.number, self.folded.lines + 1, "line numbers have no gaps");
                self.folded.apply(line).unwrap();
            }
        }
        if let Event::Store(StoreEvent::Failed { id, .. }) = &event {
            // It will be written again under another id, or never.
            self.writing.take_if(|(writing, _)| writing == id);
        }
        let had_ended = self.wizard.ended().is_some();
        let effects = self.wizard.update(event);
        self.check(had_ended, &effects);
        for effect in effects {
            match &effect {
                Effect::Append { id, lines } => self.writing = Some((*id, lines.clone())),
                Effect::Exit => self.exits += 1,
                Effect::Create { .. } | Effect::Start { .. } | Effect::Cancel(_) => {}
            }
            self.open.push(effect);
        }
        if self.exits > 0 {
            self.begin_again();
        }
    }

    fn check(&self, had_ended: bool, effects: &[Effect]) {
        // A line is applied only after it was acknowledged, and then at once.
        assert!(*self.wizard.session() == self.folded, "the session is not the fold of what is on disk");
        let view = self.wizard.view();
        assert!(!view.purpose.is_empty());
        assert_eq!(view.header.saved_entries, self.folded.lines);
        assert_eq!(view.header.samples, self.folded.counted().count());
        assert_eq!(view.intents, self.wizard.intents());
        let starts = effects.iter().filter(|effect| matches!(effect, Effect::Start { .. })).count();
        let writes = effects.iter().filter(|effect| matches!(effect, Effect::Append { .. } | Effect::Create { .. }));
        assert!(starts <= 1 && writes.count() <= 1, "one thing at a time");
        if self.wizard.ended().is_some() {
            assert!(view.intents.is_empty());
            let closing = |effect: &Effect| matches!(effect, Effect::Append { .. } | Effect::Exit | Effect::Cancel(_));
            assert!(!had_ended || effects.iter().all(closing), "nothing begins after the end");
            return;
        }
        assert!(view.intents.iter().any(trupose::wizard::IntentInfo::is_enabled), "no way on");
        assert!(view.intents.iter().filter(|info| info.is_default).count() <= 1, "two defaults");
        let offers = |name: &str| view.intents.iter().find(|info| info.intent.name() == name);
        assert!(offers("Quit").is_some_and(trupose::wizard::IntentInfo::is_enabled));
        // While the disk is full the only question is that one.
        let is_stuck = view.intents.len() == 2 && offers("Retry").is_some();
        if let (Some(busy), false) = (&view.busy, is_stuck) {
            let cancel = offers("Cancel").unwrap();
            assert!(cancel.is_enabled() != busy.is_cancelled);
        }
    }

    /// After the end: once more nothing happens, then the session is resumed, or another one begins.
    fn begin_again(&mut self) {
        for _ in 0..3 {
            let event = self.event();
            let effects = self.wizard.update(event);
            // Told to end a second time, it insists.
            let insists = effects.iter().all(|effect| matches!(effect, Effect::Exit));
            assert!(insists, "after the end: {effects:?}");
            assert!(*self.wizard.session() == self.folded);
        }
        self.sessions += 1;
        (self.exits, self.writing) = (0, None);
        self.open.clear();
        self.past.clear();
        if self.folded.opened.is_some() && self.chance(80) {
            let (wizard, effects) = Wizard::resume(self.folded.clone(), "sessions/x".to_owned(), 0, start());
            for effect in effects {
                if let Effect::Append { id, lines } = &effect {
                    self.writing = Some((*id, lines.clone()));
                }
                self.open.push(effect);
            }
            self.wizard = wizard;
        } else {
            (self.wizard, self.folded) = (Wizard::new(start()), Session::default());
        }
    }
}

/// One of each.
fn every_intent() -> Vec<Intent> {
    use Intent::{
        About, AcceptPlan, AcceptReading, ApplyRemedy, Back, Cancel, ChooseInstrument, ChooseProfile, ChooseTarget,
        CorrectProgram, Deliver, DiscardCircles, DiscardJointCheck, Dismiss, DropPoints, Exclude, GoToPose, Identify,
        Include, Keep, LeaveOut, LoadPlan, MakePlan, Measure, MeasureAgain, NameSession, Next, Note, NotePose,
        PlanFromRecording, Quit, ReadPoints, Redo, Retry, ShowPoints, Skip, StartCircles, StartJointCheck,
        SuggestPoses, TakeAllPoints, TakePoints, TypeReading, Undo, UseCircles,
    };
    vec![
        Next,
        Back,
        Cancel,
        Quit,
        Dismiss,
        Retry,
        ChooseProfile(String::new()),
        NameSession(String::new()),
        ChooseInstrument(InstrumentChoice::Manual { unit: CoordinateUnit::Metre }),
        ChooseTarget(TargetChoice::Profile),
        StartCircles,
        UseCircles,
        DiscardCircles,
        MakePlan(PlanSettings::default()),
        LoadPlan(String::new()),
        PlanFromRecording,
        AcceptPlan,
        Measure,
        TypeReading(String::new()),
        AcceptReading,
        Keep,
        LeaveOut,
        MeasureAgain,
        ApplyRemedy,
        Skip,
        Undo,
        Redo,
        Exclude(String::new()),
        Include(String::new()),
        ReadPoints(String::new()),
        ShowPoints(String::new()),
        TakePoints,
        TakeAllPoints,
        DropPoints,
        StartJointCheck,
        DiscardJointCheck,
        NotePose { pose: String::new(), text: String::new() },
        GoToPose(String::new()),
        Note(String::new()),
        SuggestPoses(1),
        Identify,
        About(Box::default()),
        Deliver,
        CorrectProgram(Box::default()),
    ]
}

fn seeds() -> u64 {
    let given = std::env::var_os("TRUPOSE_WIZARD_SEEDS");
    given.and_then(|text| text.to_str().and_then(|text| text.parse().ok())).unwrap_or(SEEDS)
}

/// Runs the streams of some seeds; the farthest step and the largest number of samples that any of them reached.
fn run(seeds: std::ops::Range<u64>) -> (usize, usize) {
    let (mut step, mut samples) = (0, 0);
    for seed in seeds {
        let mut cell = Cell::new(seed);
        for number in 0..EVENTS {
            let event = || {
                cell.step();
                // Writing a view takes longer than all other checks together.
                if number % 16 == 0 {
                    assert!(serde_json::to_string(&cell.wizard.view()).unwrap().len() > 100);
                }
            };
            if let Err(panic) = catch_unwind(AssertUnwindSafe(event)) {
                eprintln!("seed {seed}, event {number}, in the step {}", cell.folded.step);
                resume_unwind(panic);
            }
            step = step.max(cell.folded.step.number());
            samples = samples.max(cell.folded.samples.len());
        }
    }
    (step, samples)
}

#[test]
fn the_first_half_of_the_seeds_keeps_every_promise() {
    assert!(run(0..seeds() / 2) > (6, 20), "the streams do not reach far enough to say anything");
}

#[test]
fn the_second_half_of_the_seeds_keeps_every_promise() {
    assert!(run(seeds() / 2..seeds()) > (6, 20), "the streams do not reach far enough to say anything");
}
