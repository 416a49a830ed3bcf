//! Recordings read back: against the journal, after crashes, on full disks, with viewers that do not behave.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a failure of a test is a panic; what is skipped is said; test files need no atomic writes"
)]
#![cfg(unix)]

#[path = "support/place.rs"]
mod place;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use place::Place;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rerun::external::arrow::array::Array as _;
use rerun::external::arrow::util::display::array_value_to_string;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use trupose::kinematics::{ForwardKinematics, KinematicChain};
use trupose::recording;
use trupose::session::journal::{Entry, IdentifiedText, Journal};
use trupose::session::plan::PoseKind;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

/// Positions are 32-bit floats in a recording (m).
const SINGLE: f64 = 1e-6;

// ------------------------------------------------------------------------------------------------------------------ running

impl Place {
    fn recording(&self) -> PathBuf {
        self.session().join(recording::FILE_NAME)
    }

    fn write_script(&self, name: &str, steps: &str) -> String {
        let script = format!("(title: \"test\", clock: Some(\"2026-01-05T08:00:00Z\"), steps: [{steps}])");
        fs::write(self.path(name), script).unwrap();
        name.to_owned()
    }

    /// Runs a script to its end.
    fn script(&self, steps: &str, more: &[&str]) -> Output {
        let script = self.write_script("run.script.ron", steps);
        self.run(&[&["--script", &script, "--json"], more].concat())
    }

    fn check(&self) -> (Option<i32>, String) {
        self.check_file("sessions/s")
    }

    fn check_file(&self, path: &str) -> (Option<i32>, String) {
        let output = self.run(&["record", "check", path]);
        (output.status.code(), text(&output.stdout))
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}\n{}", text(&output.stdout), text(&output.stderr));
}

/// The steps up to the capture of the poses in `plan.csv`.
fn begun(faults: &str) -> String {
    format!(
        "Do(NameSession(\"s\")), Do(ChooseProfile(\"soochow\")), Do(Next),
        Do(ChooseInstrument(Simulated((seed: 1, truth: Paper, faults: [{faults}])))), Do(Next),
        Do(ChooseTarget(Profile)), Do(Next), Do(LoadPlan(\"plan.csv\")), Do(AcceptPlan),"
    )
}

const RESULT: &str = "Do(Next), Do(Identify), Do(Next), Do(Next), Do(Deliver)";

/// A session without anything unusual.
fn plain() -> String {
    format!("{} CaptureAll(Fail), {RESULT}", begun(""))
}

/// A session in which something was measured again, left out, corrected, undone and skipped, and identified twice.
fn eventful() -> String {
    format!(
        "{} CaptureAll(Stop), Do(LeaveOut), CaptureAll(Stop), Do(MeasureAgain), CaptureAll(Stop), Do(ApplyRemedy),
        Capture(1, Fail), Do(Undo), Do(Skip), CaptureAll(Fail), Do(Next), Do(Identify), Do(Back),
        Do(GoToPose(\"3\")), Do(Measure), Do(Next), Do(Identify), Do(Next)",
        begun("\"outlier@6:9mm\", \"outlier@9:9mm\", \"wrong-pose@12\"")
    )
}

/// A SCARA: a joint that slides, and one that moves with another.
fn sliding() -> String {
    "Do(NameSession(\"s\")), Do(ChooseProfile(\"epson_ls3_b401s\")), Do(Next),
    Do(ChooseInstrument(Simulated((seed: 3, truth: Drawn)))), Do(Next), Do(ChooseTarget(Profile)), Do(Next),
    Do(MakePlan((poses: 16, verification: 5, candidates: 200, drift_every: 6))), Do(AcceptPlan),
    CaptureAll(Fail), Do(Next), Do(Identify), Do(Next)"
        .to_owned()
}

/// A session that was recorded while it ran.
fn recorded(steps: &str) -> Place {
    let place = Place::new();
    succeeded(&place.script(steps, &[]));
    place
}

fn session_of(folder: &Path) -> (Journal, Session) {
    let journal = read_journal(folder).unwrap();
    let session = Session::of(&journal).unwrap();
    (journal, session)
}

// ------------------------------------------------------------------------------------------------------------------ reading

fn messages(path: &Path) -> Vec<LogMsg> {
    DecoderApp::decode_lazy(BufReader::new(File::open(path).unwrap())).map(Result::unwrap).collect()
}

/// The chunks of the session's data, or of its layout.
fn chunks(path: &Path, of_layout: bool) -> Vec<Chunk> {
    let data = messages(path).into_iter().filter_map(|message| match message {
        LogMsg::ArrowMsg(store, arrow) if store.is_blueprint() == of_layout => Some(arrow),
        _ => None,
    });
    data.map(|arrow| Chunk::from_arrow_msg(&arrow).unwrap()).collect()
}

/// A row of a recording: its entity, when it is, and every component as text.
type Row = (String, BTreeMap<String, i64>, BTreeMap<String, String>);

/// All rows. Of what is shown always only the last is kept, as a viewer does.
fn rows(path: &Path, of_layout: bool) -> Vec<Row> {
    let mut rows: Vec<Row> = rows_in_order(path, of_layout).into_iter().map(|(_, row)| row).collect();
    rows.sort();
    rows
}

/// The same in the order in which they were written, with their numbers.
fn rows_in_order(path: &Path, of_layout: bool) -> Vec<(String, Row)> {
    let mut temporal = Vec::new();
    let mut lasting: BTreeMap<(String, String), (String, String)> = BTreeMap::new();
    for chunk in chunks(path, of_layout) {
        let entity = chunk.entity_path().to_string();
        for (row, id) in chunk.row_ids().enumerate() {
            let values: BTreeMap<String, String> = chunk
                .components()
                .iter()
                .filter(|(_, column)| !column.list_array.is_null(row))
                .map(|(name, column)| (name.to_string(), array_value_to_string(&column.list_array, row).unwrap()))
                .collect();
            if chunk.is_static() {
                for (name, value) in values {
                    let last = lasting.entry((entity.clone(), name)).or_default();
                    if id.to_string() >= last.0 {
                        *last = (id.to_string(), value);
                    }
                }
            } else {
                let times = chunk.timelines().iter();
                let times = times.map(|(name, column)| (name.to_string(), column.times_raw()[row])).collect();
                temporal.push((id.to_string(), (entity.clone(), times, values)));
            }
        }
    }
    temporal.extend(
        lasting
            .into_iter()
            .map(|((entity, name), (id, value))| (id, (entity, BTreeMap::new(), BTreeMap::from([(name, value)])))),
    );
    temporal.sort();
    temporal
}

/// The same without the time at which the file was begun.
fn content(path: &Path) -> Vec<Row> {
    rows(path, false).into_iter().filter(|(_, _, values)| !values.contains_key("RecordingInfo:start_time")).collect()
}

/// Numbers of a component on a timeline. Of several rows at one time the last counts, as in a viewer.
fn numbers(path: &Path, entity: &str, timeline: &str, component: &str) -> Vec<(i64, Vec<f64>)> {
    let mut found = BTreeMap::new();
    for (_, (of, times, values)) in rows_in_order(path, false) {
        if let (true, Some(time), Some(value)) = (of == entity, times.get(timeline), values.get(component)) {
            let digits = |c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | 'e' | 'E');
            let values = value.split(|c| !digits(c)).filter(|text| !text.is_empty());
            found.insert(*time, values.map(|text| text.parse().unwrap()).collect());
        }
    }
    found.into_iter().collect()
}

/// Frames of an arm by pose and name.
fn frames(path: &Path, entity: &str, timeline: &str) -> BTreeMap<(i64, String), Isometry3<f64>> {
    let mut found = BTreeMap::new();
    for (_, (of, times, values)) in rows_in_order(path, false) {
        let (true, Some(time)) = (of == entity, times.get(timeline)) else { continue };
        let list = |name: &str| -> Vec<f64> {
            let text = values[name].trim_matches(['[', ']']).to_owned();
            text.split(',').map(|number| number.trim().parse().unwrap()).collect()
        };
        let (t, q) = (list("Transform3D:translation"), list("Transform3D:quaternion"));
        assert_eq!(values["Transform3D:parent_frame"], "[tf#/world]");
        let frame = Isometry3::from_parts(
            Translation3::new(t[0], t[1], t[2]),
            UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2])),
        );
        let name = values["Transform3D:child_frame"].trim_matches(['[', ']']).to_owned();
        found.insert((*time, name), frame);
    }
    found
}

fn assert_near(found: &Isometry3<f64>, expected: &Isometry3<f64>, what: &str) {
    let apart = (found.translation.vector - expected.translation.vector).norm();
    let turned = found.rotation.angle_to(&expected.rotation);
    assert!(apart < SINGLE && turned < SINGLE, "{what}: {apart} m, {turned} rad");
}

fn assert_points(found: &[f64], expected: impl Iterator<Item = Point3<f64>>, tolerance: f64, what: &str) {
    let expected: Vec<f64> = expected.flat_map(|point| point.coords.iter().copied().collect::<Vec<_>>()).collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found - expected).abs() < tolerance, "{what}: {found} instead of {expected}");
    }
}

fn results(journal: &Journal) -> Vec<IdentifiedText> {
    let entries = journal.lines.iter();
    entries
        .filter_map(|line| match &line.entry {
            Entry::Identified(identified) => Some((**identified).clone()),
            _ => None,
        })
        .collect()
}

// ------------------------------------------------------------------------------------------------------- against the journal

/// Every frame of `chain` at every sample.
fn compare_frames(path: &Path, session: &Session, entity: &str, arm: &str, chain: &KinematicChain) {
    let found = frames(path, entity, "pose");
    let forward = ForwardKinematics::new(chain);
    for sample in &session.samples {
        let number = i64::try_from(sample.noted.number).unwrap();
        let expected = forward.base_from_links(&session.configuration_of(sample));
        assert_eq!(found.keys().filter(|(pose, _)| *pose == number).count(), expected.len());
        for (index, expected) in expected.iter().enumerate() {
            assert_near(&found[&(number, format!("{arm}/{index}"))], expected, &format!("{arm}, pose {number}"));
        }
    }
    // Pose 0 stands for the time before the first measurement.
    let poses: std::collections::BTreeSet<i64> = found.keys().map(|(pose, _)| *pose).filter(|pose| *pose > 0).collect();
    assert_eq!(poses.len(), session.samples.len());
}

/// How many times larger errors of an arm are drawn, as the picture says it.
fn enlarged(path: &Path, before: &str) -> f64 {
    let note = rows(path, false)
        .into_iter()
        .find(|(entity, _, values)| entity == "/world/scale_note" && values.contains_key("Points3D:labels"))
        .unwrap();
    let text = &note.2["Points3D:labels"];
    text.split_once(before).unwrap().1.split_whitespace().next().unwrap().parse().unwrap()
}

/// Everything that the picture shows of a session is what its journal says.
fn compare_with_journal(folder: &Path) {
    let path = folder.join(recording::FILE_NAME);
    let (journal, session) = session_of(folder);
    let profile = session.mounted_profile().unwrap();
    assert_eq!(recording::read(&path).unwrap().journal, fs::read(folder.join("journal.ron")).unwrap());
    let check = recording::check(&path).unwrap();
    assert!(check.is_whole(), "{check:?}");
    assert_eq!((check.lines, check.samples), (journal.lines.len(), session.samples.len()));

    compare_frames(&path, &session, "/world/nominal/frames", "nominal", profile.chain());
    let readings = numbers(&path, "/reading/xyz_mm", "pose", "Scalars:scalars");
    let expected = session.samples.iter().map(|sample| {
        let (x, y, z) = sample.noted.xyz_mm;
        (i64::try_from(sample.noted.number).unwrap(), vec![x, y, z])
    });
    assert_eq!(readings, expected.collect::<Vec<_>>());
    assert_eq!(numbers(&path, "/world/measured", "pose", "Points3D:positions").len(), session.samples.len());
    let logged = rows(&path, false).iter().filter(|(entity, ..)| entity == "/log").count();
    assert_eq!(logged, journal.lines.len());

    let results = results(&journal);
    assert_eq!(results.len(), session.runs_in(&journal));
    let Some(last) = results.last() else { return };
    let calibration = last.calibration.as_ref().unwrap();
    let chain = calibration.identified_chain(&profile).unwrap();
    compare_frames(&path, &session, "/world/identified/frames", "identified", &chain);
    for (run, result) in (1..).zip(&results) {
        let samples = || result.samples.iter().zip(&result.points);
        for (arm, pick) in [("nominal", 0), ("identified", 1)] {
            let error = |text: &trupose::session::journal::PointErrorText| {
                let (x, y, z) = [text.nominal_mm, text.identified_mm][pick];
                Point3::new(x, y, z)
            };
            for (suffix, is_verification) in [("fit", false), ("verification", true)] {
                let entity = format!("/errors_mm/position_{arm}/{suffix}_{run}");
                let found = numbers(&path, &entity, "pose", "Scalars:scalars");
                let mut expected: Vec<(i64, f64)> = samples()
                    .filter(|(number, _)| {
                        let kind = session.kind_of(session.sample(**number).unwrap());
                        (kind == PoseKind::Verification) == is_verification
                    })
                    .map(|(number, text)| (i64::try_from(*number).unwrap(), error(text).coords.norm()))
                    .collect();
                expected.sort_by_key(|(number, _)| *number);
                assert_eq!(found.len(), expected.len(), "{entity}");
                for ((at, values), (number, length)) in found.iter().zip(&expected) {
                    assert_eq!(at, number);
                    assert!((values[0] - length).abs() < 1e-9, "{entity}: {values:?} instead of {length}");
                }
            }
        }
    }
    for (arm, label) in [("nominal", "(nominal) "), ("identified", "(identified) ")] {
        let entity = format!("/world/errors/{arm}");
        let scale = enlarged(&path, label);
        assert!(scale >= 1.0);
        let vectors = numbers(&path, &entity, "pose", "Arrows3D:vectors");
        assert_eq!(vectors.len(), 1);
        let expected = last.points.iter().map(|text| {
            let (x, y, z) = if arm == "nominal" { text.nominal_mm } else { text.identified_mm };
            Point3::new(x, y, z) * (scale * 1e-3)
        });
        assert_points(&vectors[0].1, expected, 1e-6, &entity);
        let origins = numbers(&path, &entity, "pose", "Arrows3D:origins");
        let at = last.points.iter().map(|text| Point3::new(text.at_mm.0, text.at_mm.1, text.at_mm.2) * 1e-3);
        assert_points(&origins.last().unwrap().1, at, SINGLE, &entity);
    }
    // The animation ends at the result.
    let steps = last.summary.iterations.len();
    let solved = numbers(&path, "/world/identified/enlarged", "solver_iteration", "Capsules3D:translations");
    assert_eq!(solved.len(), steps + 1);
    assert_eq!(usize::try_from(solved.last().unwrap().0).unwrap(), steps);
    assert_eq!(solved.last().unwrap().1.len(), 3 * profile.bodies().len());
}

/// Where the tracker is drawn at last, and its label.
fn tracker(path: &Path) -> (Point3<f64>, String) {
    let of = |component: &str| {
        let mut rows = rows(path, false).into_iter();
        rows.find_map(|(entity, _, mut values)| (entity == "/world/tracker/body").then(|| values.remove(component))?)
            .unwrap()
    };
    let centre: Vec<f64> = of("Boxes3D:centers")
        .trim_matches(['[', ']'])
        .split(',')
        .map(|number| number.trim().parse().unwrap())
        .collect();
    (Point3::new(centre[0], centre[1], centre[2]), of("Boxes3D:labels"))
}

#[test]
fn the_tracker_is_drawn_as_planned_until_points_tell_where_it_stands() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let (_, session) = session_of(&place.session());
    let profile = session.mounted_profile().unwrap();
    let planned = profile.tracker().position_in_base;
    let truth = trupose::link::SimulatedCell::new(
        &profile,
        &trupose::session::simulation::Simulation { seed: 1, ..Default::default() },
    )
    .unwrap();
    let stands = Point3::from(truth.truth().base_from_tracker.translation.vector);
    assert!((stands - planned).norm() > 0.05, "the test needs one that stands elsewhere: {stands} {planned}");
    let beams = |from: &Point3<f64>, count: usize| {
        let beams = numbers(&place.recording(), "/world/tracker/beam", "pose", "LineStrips3D:strips");
        // Also that before the first measurement.
        assert_eq!(beams.len(), 1 + count);
        for (pose, beam) in beams {
            assert_points(&beam[..3], std::iter::once(*from), SINGLE, &format!("beam at {pose}"));
        }
    };
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker (as planned)]");
    assert_points(&[drawn.x, drawn.y, drawn.z], std::iter::once(planned), SINGLE, "planned");
    beams(&drawn, 3);
    // The fourth point tells; the nominal arm is off by centimetres.
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker]");
    assert!((drawn - stands).norm() < 0.1 && (drawn - planned).norm() > 0.02, "{drawn} instead of {stands}");
    beams(&drawn, 4);
    let rest = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker]");
    // The identified arm tells it to a millimetre; what is less than 20 mm off is not drawn anew.
    assert!((drawn - stands).norm() < 0.021, "{drawn} instead of {stands}");
    let (_, session) = session_of(&place.session());
    beams(&drawn, session.samples.len());
    compare_with_rebuilt(&place);
    // Measurements and poses of the plan are counted apart: the name is at the point.
    let names: BTreeMap<i64, String> = rows(&place.recording(), false)
        .into_iter()
        .filter(|(entity, times, _)| entity == "/world/measured" && !times.is_empty())
        .map(|(_, times, values)| (times["pose"], values["Points3D:labels"].clone()))
        .collect();
    assert_eq!(names.len(), session.samples.len());
    for sample in &session.samples {
        let number = i64::try_from(sample.noted.number).unwrap();
        assert_eq!(names[&number], format!("[pose {}]", session.pose_of(sample)));
    }
}

/// What the journal says about results.
trait Runs {
    fn runs_in(&self, journal: &Journal) -> usize;
}

impl Runs for Session {
    fn runs_in(&self, journal: &Journal) -> usize {
        journal.lines.iter().filter(|line| matches!(line.entry, Entry::Identified(_))).count()
    }
}

/// The file that grew with the session has what one has that is made from its journal, row by row.
fn compare_with_rebuilt(place: &Place) {
    let live = content(&place.recording());
    succeeded(&place.run(&["record", "rebuild", "sessions/s"]));
    let rebuilt = content(&place.recording());
    assert_eq!(live.len(), rebuilt.len());
    for (one, other) in live.iter().zip(&rebuilt) {
        assert_eq!(one, other);
    }
}

#[test]
fn a_recording_shows_what_the_journal_says_and_is_rebuilt_the_same() {
    let place = recorded(&plain());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
    // Whoever may read the other results may read this one.
    fs::write(place.path("plain"), "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&place.recording()), mode(&place.path("plain")));
    assert_eq!(mode(&place.recording()), mode(&place.session().join("report.json")));
}

#[test]
fn what_was_measured_again_left_out_corrected_or_skipped_is_shown_as_it_is() {
    let place = recorded(&eventful());
    let (journal, session) = session_of(&place.session());
    assert_eq!(results(&journal).len(), 2);
    assert!(session.rows.iter().any(|row| row.skipped));
    compare_with_journal(&place.session());
    let unused = numbers(&place.recording(), "/world/plan/unused", "pose", "Points3D:positions");
    let out = session.samples.iter().filter(|sample| {
        use trupose::session::state::SampleState;
        matches!(sample.state, SampleState::LeftOut | SampleState::Undone)
    });
    let skipped = session.rows.iter().filter(|row| row.skipped).count();
    assert_eq!(unused.last().unwrap().1.len(), 3 * (out.count() + skipped));
    compare_with_rebuilt(&place);
}

#[test]
fn an_arm_with_a_sliding_and_a_coupled_joint_is_drawn_as_it_stands() {
    let place = recorded(&sliding());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
}

#[test]
fn a_recording_carries_one_layout_that_opens_on_the_poses() {
    let place = recorded(&plain());
    let activations: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::BlueprintActivationCommand(command) => Some(command.blueprint_id),
            _ => None,
        })
        .collect();
    assert_eq!(activations.len(), 1);
    let stores: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::SetStoreInfo(info) if info.info.store_id.is_blueprint() => Some(info.info.store_id),
            _ => None,
        })
        .collect();
    assert_eq!(stores, activations);
    assert_eq!(opens_on(&place.recording()), "[pose]");
    let errors = "[Position error, identified arm (mm)]".to_owned();
    assert!(views(&place.recording()).contains(&errors));
    // While there is no result there is no room for it.
    let place = recorded(&format!("{} Capture(2, Fail)", begun("")));
    let shown = views(&place.recording());
    assert!(!shown.contains(&errors) && !shown.contains(TEMPERATURES), "{shown:?}");
}

/// The plot that is there where temperatures were measured.
const TEMPERATURES: &str = "[Temperature (degC)]";

/// Names of what a viewer shows.
fn views(path: &Path) -> std::collections::BTreeSet<String> {
    let layout = rows(path, true).into_iter();
    layout.filter_map(|(_, _, values)| values.get("ViewBlueprint:display_name").cloned()).collect()
}

/// The timeline that a viewer shows first.
fn opens_on(path: &Path) -> String {
    let layout = rows(path, true);
    let panel = layout.iter().find(|(_, _, values)| values.contains_key("TimePanelBlueprint:timeline")).unwrap();
    panel.2["TimePanelBlueprint:timeline"].clone()
}

// ------------------------------------------------------------------------------------------------------------------ crashes

struct Running {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
}

impl Running {
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Self { child, out }
    }

    /// Kills the program a moment after it has said so many long things; `false` if it had ended by itself.
    fn kill_after(mut self, said: usize, spin: u32) -> bool {
        self.hear(said);
        for _ in 0..spin {
            std::hint::spin_loop();
        }
        self.kill()
    }

    /// Reads until the program has said so many long things, or has ended.
    fn hear(&mut self, said: usize) {
        let (mut line, mut heard) = (Vec::new(), 0);
        while heard < said {
            line.clear();
            if self.out.read_until(b'\n', &mut line).unwrap() == 0 {
                break;
            }
            heard += usize::from(line.len() > LONG);
        }
    }

    /// `false` if it had ended by itself.
    fn kill(mut self) -> bool {
        self.child.kill().unwrap();
        drop(self.out);
        self.child.wait().unwrap().signal() == Some(9)
    }
}

/// What a program leaves that runs `script` and is killed once samples are in its recording.
fn torn_part(place: &Place, script: &str) -> PathBuf {
    let mut running = Running::start(place.command(&["--script", script, "--json"]));
    running.hear(3);
    // The recording comes a little later than the journal.
    let begun = Instant::now();
    let has_samples = |file: &PathBuf| recording::check(file).is_ok_and(|check| check.samples > 0);
    loop {
        if let Some(part) = recording::files(&place.session()).into_iter().find(has_samples) {
            assert!(running.kill());
            return part;
        }
        assert!(begun.elapsed() < Duration::from_mins(1));
    }
}

/// More than a pipe holds: the program waits until it is read.
const LONG: usize = 100_000;

/// Steps that measure poses one by one, with a pause after each.
fn one_by_one(poses: usize) -> String {
    let pause = format!("Capture(1, Fail), Say(\"{}\"),", "x".repeat(2 * LONG));
    pause.repeat(poses)
}

#[test]
fn after_kills_at_any_moment_the_recording_is_completed_or_says_what_is_missing() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let (mut killed, mut incomplete) = (0, 0);
    for round in 0..3 {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
        let mut command = place.command(&["--script", &script, "--json"]);
        for _ in 0..3 {
            let (said, spin) = (random.random_range(1..4), random.random_range(0..30_000_000));
            killed += u32::from(Running::start(command).kill_after(said, spin));
            let journal = read_journal(&place.session()).unwrap();
            let held: std::collections::BTreeSet<u64> = recording::files(&place.session())
                .iter()
                .flat_map(|file| recording::read(file).unwrap().numbers)
                .collect();
            let (status, said) = place.check();
            for line in journal.lines.iter().filter(|line| !held.contains(&line.number)) {
                assert!(said.contains(&format!("{:>5} ", line.number)), "line {} is not named: {said}", line.number);
                incomplete += 1;
            }
            if killed > 0 && held.len() < journal.lines.len() {
                assert_eq!(status, Some(1), "{said}");
            }
            let step = Session::of(&journal).unwrap().step;
            assert!(step <= trupose::session::set_up::Step::Capture, "{step:?}");
            let script = place.write_script("more.script.ron", &one_by_one(6));
            command = place.command(&["resume", "sessions/s", "--script", &script, "--json"]);
        }
        if round == 0 {
            // Not gone on with: made anew from the journal.
            succeeded(&place.run(&["record", "rebuild", "sessions/s"]));
        } else {
            let script = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
            succeeded(&place.run(&["resume", "sessions/s", "--script", &script, "--json"]));
            compare_with_journal(&place.session());
        }
        assert_eq!(recording::files(&place.session()), [place.recording()]);
        let (status, said) = place.check();
        assert_eq!(status, Some(0), "{said}");
        compare_with_rebuilt(&place);
    }
    assert_eq!(killed, 9);
    writeln!(io::stderr(), "{killed} kills, {incomplete} lines were missing and named").unwrap();
}

#[test]
fn parts_that_a_crash_left_become_one_file() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
    assert!(Running::start(place.command(&["--script", &script, "--json"])).kill_after(3, 0));
    assert!(!place.recording().exists());
    fs::write(place.session().join(".recording-left.tmp"), "half").unwrap();
    succeeded(&place.run(&["record", "compact", "sessions/s"]));
    let (status, said) = place.check();
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(recording::files(&place.session()), [place.recording()]);
    assert!(!place.session().join(".recording-left.tmp").exists());
}

// ------------------------------------------------------------------------------------------------------------------- damage

#[test]
fn torn_and_damaged_files_are_named_and_never_stop_the_program() {
    let place = Place::new();
    // Always the same bytes: one flipped bit of thousands asks the library for more memory than there is, and ends the program.
    let whole = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/example/recording.rrd")).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let file = place.path("damaged.rrd");
    let mut unwhole = 0;
    for case in 0..16 {
        let mut bytes = whole.clone();
        if case % 2 == 0 {
            bytes.truncate(random.random_range(0..whole.len()));
        } else {
            for _ in 0..20 {
                let at = random.random_range(0..whole.len());
                bytes[at] ^= random.random_range(1..=255_u8);
            }
        }
        fs::write(&file, &bytes).unwrap();
        for arguments in [["record", "check"].as_slice(), &["replay", "--print"], &["record", "compact"]] {
            // Compacting takes seconds where the library is not optimised.
            if arguments == ["record", "compact"] && case % 4 > 1 {
                continue;
            }
            let output = place.run(&[arguments, &["damaged.rrd"]].concat());
            let code = output.status.code().unwrap_or_else(|| panic!("{arguments:?}, case {case}: no exit code"));
            assert!([0, 1, 5].contains(&code), "{arguments:?}: {code} {}", text(&output.stderr));
            assert!(!text(&output.stderr).contains("panicked"), "{}", text(&output.stderr));
            if arguments == ["record", "check"] {
                unwhole += u32::from(code != 0);
            }
        }
    }
    assert!(unwhole >= 14, "only {unwhole} of 16 damaged files were noticed");
    for (name, bytes, said) in [
        ("empty.rrd", Vec::new(), "is no recording of trupose"),
        ("garbage.rrd", b"not a recording at all".to_vec(), "is no recording of trupose"),
    ] {
        fs::write(place.path(name), bytes).unwrap();
        let output = place.run(&["record", "check", name]);
        assert_eq!(output.status.code(), Some(5));
        assert!(text(&output.stderr).contains(said), "{}", text(&output.stderr));
    }
}

#[test]
fn what_is_damaged_is_not_made_compact() {
    let place = Place::new();
    let whole = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/example/recording.rrd")).unwrap();
    let cut = whole[..whole.len() * 3 / 5].to_vec();
    assert!(cut.len() > 200_000, "it has lines of the journal");
    let mut flipped = whole.clone();
    // In the head of a piece: elsewhere the library may ask for more memory than there is.
    let mut at = 12;
    for _ in 0..20 {
        at += 16 + usize::try_from(u64::from_le_bytes(*whole[at + 8..].first_chunk().unwrap())).unwrap();
    }
    flipped[at + 3] ^= 0x55;
    let mut lengthened = whole;
    lengthened.extend_from_slice(b"more");
    for (name, bytes) in [("cut.rrd", cut), ("flipped.rrd", flipped), ("lengthened.rrd", lengthened)] {
        fs::write(place.path(name), &bytes).unwrap();
        let (status, said) = place.check_file(name);
        assert_eq!(status, Some(1), "{name}: {said}");
        let output = place.run(&["record", "compact", name]);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {error}");
        assert!(error.contains("is not whole and stays as it is"), "{name}: {error}");
        assert!(error.contains("trupose record rebuild DIR"), "{name}: {error}");
        assert_eq!(fs::read(place.path(name)).unwrap(), bytes, "{name}");
        assert_eq!(place.check_file(name), (status, said), "{name}");
    }
    // Beside the journal there is no need for what is damaged.
    let session = place.session();
    fs::create_dir_all(&session).unwrap();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/example");
    fs::copy(example.join("journal.ron"), session.join("journal.ron")).unwrap();
    fs::copy(place.path("cut.rrd"), place.recording()).unwrap();
    assert_eq!(place.check().0, Some(1));
    succeeded(&place.run(&["record", "compact", "sessions/s"]));
    compare_with_journal(&session);
}

#[test]
fn what_a_crash_left_alone_is_made_compact_and_is_said_to_be_torn() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
    let bytes = fs::read(torn_part(&place, &script)).unwrap();
    // Wherever it is torn: also within the picture of the last entry.
    for (name, length) in
        [("one.rrd", bytes.len()), ("two.rrd", bytes.len() - 1000), ("three.rrd", bytes.len() * 4 / 5)]
    {
        fs::write(place.path(name), &bytes[..length]).unwrap();
        let found = recording::check(&place.path(name)).unwrap();
        assert!(found.is_unfinished() && found.lines > 2, "{name}: {found:?}");
        let output = place.run(&["record", "compact", name]);
        succeeded(&output);
        let said = text(&output.stdout);
        assert!(said.contains(&format!("its end was torn: all {} entries", found.lines)), "{said}");
        let (status, said) = place.check_file(name);
        assert_eq!(status, Some(0), "{said}");
        // Everything is drawn, as if the journal had these lines only.
        let then = place.path("then");
        fs::create_dir_all(&then).unwrap();
        let journal = fs::read(place.session().join("journal.ron")).unwrap();
        let lines: Vec<u8> =
            journal.split_inclusive(|byte| *byte == b'\n').take(found.lines).flatten().copied().collect();
        fs::write(then.join("journal.ron"), lines).unwrap();
        succeeded(&place.run(&["record", "rebuild", "then"]));
        assert_eq!(content(&place.path(name)), content(&then.join(recording::FILE_NAME)));
        // It is a whole now: where its end is missing again, anything may be missing.
        let compact = fs::read(place.path(name)).unwrap();
        fs::write(place.path(name), &compact[..compact.len() - 1000]).unwrap();
        assert_eq!(place.run(&["record", "compact", name]).status.code(), Some(1));
    }
}

#[test]
fn the_recording_of_another_session_is_noticed_and_not_gone_on_with() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let own = fs::read(place.recording()).unwrap();
    // As many lines, other points.
    let other = recorded(&format!("{} Capture(3, Fail)", begun("\"outlier@2:9mm\"")));
    let lines = |place: &Place| read_journal(&place.session()).unwrap().lines.len();
    assert_eq!(lines(&place), lines(&other));
    let differs = read_journal(&place.session())
        .unwrap()
        .lines
        .iter()
        .zip(&read_journal(&other.session()).unwrap().lines)
        .position(|(one, other)| one != other)
        .unwrap();
    fs::copy(other.recording(), place.recording()).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains(&format!("entry {} of it differs from the journal", differs + 1)), "{said}");
    assert!(said.contains("trupose record rebuild"), "{said}");
    succeeded(&place.run(&["record", "compact", "sessions/s"]));
    assert_eq!(place.check().0, Some(0));
    // A session that goes on draws it anew.
    fs::copy(other.recording(), place.recording()).unwrap();
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
    // Another name, another session.
    let mut named = begun("");
    named = named.replacen("NameSession(\"s\")", "NameSession(\"t\")", 1);
    succeeded(&other.script(&format!("{named} Capture(3, Fail)"), &[]));
    fs::copy(other.path("sessions/t").join(recording::FILE_NAME), place.recording()).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("it is the recording of another session"), "{said}");
    // An older one of the same session lacks something, and is not another's.
    fs::write(place.recording(), own).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("missing of") && !said.contains("differs"), "{said}");
}

/// Runs the rest of a session over what is in the way of its recording, and returns the transcript.
fn goes_on_over(obstacle: impl Fn(&Place)) -> (Place, String) {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    obstacle(&place);
    let script = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
    let output = place.run(&["resume", "sessions/s", "--script", &script, "--json"]);
    succeeded(&output);
    let (_, session) = session_of(&place.session());
    assert!(session.closed && session.identified.is_some());
    (place, text(&output.stdout))
}

#[test]
fn garbage_in_place_of_a_recording_is_replaced() {
    let (place, _) = goes_on_over(|place| fs::write(place.recording(), "garbage").unwrap());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
}

#[test]
fn a_folder_in_place_of_the_recording_is_told_and_holds_nobody_up() {
    let (_place, transcript) = goes_on_over(|place| {
        fs::remove_file(place.recording()).unwrap();
        fs::create_dir(place.recording()).unwrap();
    });
    // At once, or at the end where that is sooner.
    assert!(transcript.contains("the 3D recording is not complete: "), "{transcript}");
}

#[test]
fn a_folder_that_may_not_be_written_to_is_told() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let folder = place.session();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    let is_refused = fs::write(folder.join("probe"), "").is_err();
    let output = place.run(&["record", "rebuild", "sessions/s"]);
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).unwrap();
    if !is_refused {
        writeln!(io::stderr(), "SKIPPED a_folder_that_may_not_be_written_to_is_told: root may write anywhere").unwrap();
        return;
    }
    assert_eq!(output.status.code(), Some(5));
    assert!(text(&output.stderr).contains("cannot write the recording"), "{}", text(&output.stderr));
}

/// A small file system in memory; none where that is not allowed.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(path: PathBuf, size: &str) -> Option<Self> {
        fs::create_dir(&path).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"]).arg(&path);
        mount.output().is_ok_and(|output| output.status.success()).then_some(Self(path))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        drop(Command::new("umount").arg(&self.0).output());
    }
}

#[test]
fn a_full_disk_ends_the_recording_with_a_message_and_not_the_session() {
    let place = Place::new();
    let Some(_disk) = SmallDisk::mount(place.path("sessions"), "256k") else {
        let skipped =
            "SKIPPED a_full_disk_ends_the_recording_with_a_message_and_not_the_session: no right to mount a tmpfs";
        writeln!(io::stderr(), "{skipped}").unwrap();
        return;
    };
    let start = Instant::now();
    // What is delivered waits: the recording gives its room back a little later than the disk is full.
    let output = place.script(&format!("{} CaptureAll(Fail), Do(Next), Do(Identify), Do(Next)", begun("")), &[]);
    succeeded(&output);
    assert!(start.elapsed() < Duration::from_mins(1), "{:?}", start.elapsed());
    let transcript = text(&output.stdout);
    assert!(transcript.contains("the 3D recording is not complete: "), "{transcript}");
    assert!(transcript.contains("No space left on device"), "{transcript}");
    let (_, session) = session_of(&place.session());
    assert!(session.closed && session.identified.is_some());
    // The session needs the room more.
    assert_eq!(recording::files(&place.session()), [] as [PathBuf; 0]);
    let rest = place.write_script("rest.script.ron", "Do(Next), Do(Deliver)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json", "--no-recording"]));
    assert!(place.session().join("report.html").exists());
}

// --------------------------------------------------------------------------------------------------------------------- live

/// A port that was free a moment ago.
fn free_port() -> u16 {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

#[test]
fn a_busy_port_is_refused_before_anything_is_begun() {
    let place = Place::new();
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    let output = place.script(&plain(), &["--live", &port]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains(&format!("cannot listen on 127.0.0.1:{port}")), "{}", text(&output.stderr));
    assert!(!place.path("sessions").exists());
}

#[test]
fn neither_a_missing_viewer_nor_one_that_never_reads_is_noticed() {
    let without = Instant::now();
    let place = recorded(&plain());
    let without = without.elapsed();
    let expected = content(&place.recording());

    let place = Place::new();
    let port = free_port();
    let alone = Instant::now();
    succeeded(&place.script(&plain(), &["--live", &port.to_string()]));
    let alone = alone.elapsed();
    assert_eq!(content(&place.recording()), expected);
    assert!(alone < without * 2 + Duration::from_secs(2), "{alone:?} with the live view, {without:?} without");

    let place = Place::new();
    let port = free_port();
    let script = place.write_script("run.script.ron", &plain());
    let mut child = place
        .command(&["--script", &script, "--json", "--live", &port.to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It is there before the session has begun, asks for everything, and reads nothing of it. Another goes away at once.
    let (mut viewers, mut gone) = (Vec::new(), 0);
    while child.try_wait().unwrap().is_none() && viewers.len() < 4 {
        if let Ok(mut viewer) = TcpStream::connect((Ipv4Addr::LOCALHOST, port)) {
            drop(viewer.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0"));
            if gone < viewers.len() {
                gone += 1;
            } else {
                viewers.push(viewer);
            }
        }
        std::thread::yield_now();
    }
    let (mut out, mut err) = (Vec::new(), Vec::new());
    child.stdout.take().unwrap().read_to_end(&mut out).unwrap();
    child.stderr.take().unwrap().read_to_end(&mut err).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{}", text(&err));
    assert!(!viewers.is_empty() && gone > 0);
    assert_eq!(content(&place.recording()), expected);
}

#[test]
fn the_environment_does_not_silence_the_recording() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} Capture(2, Fail)", begun("")));
    let output = place.command(&["--script", &script]).env("RERUN", "off").output().unwrap();
    succeeded(&output);
    assert!(recording::check(&place.recording()).unwrap().is_whole());
    // Who wants none says so; the journal does not know of recordings.
    let journal = fs::read(place.session().join("journal.ron")).unwrap();
    let place = Place::new();
    succeeded(&place.script(&format!("{} Capture(2, Fail)", begun("")), &["--no-recording"]));
    assert_eq!(recording::files(&place.session()), [] as [PathBuf; 0]);
    assert_eq!(fs::read(place.session().join("journal.ron")).unwrap(), journal);
}

// ------------------------------------------------------------------------------------------------------ without a session

#[test]
fn an_identification_from_files_is_recorded() {
    let place = recorded(&format!("{} CaptureAll(Fail)", begun("")));
    let table = place.run(&["replay", "sessions/s", "--csv"]);
    succeeded(&table);
    fs::write(place.path("measured.csv"), &table.stdout).unwrap();
    let output =
        place.run(&["identify", "--profile", "soochow", "--measurements", "measured.csv", "--record", "out.rrd"]);
    assert!([0, 1].contains(&output.status.code().unwrap()), "{}", text(&output.stderr));
    let path = place.path("out.rrd");
    let journal = recording::read(&path).unwrap().lines().unwrap();
    let session = Session::of(&journal).unwrap();
    assert!(recording::check(&path).unwrap().is_whole());
    let (_, measured) = session_of(&place.session());
    assert_eq!(session.samples.len(), measured.counted().count());
    let profile = session.mounted_profile().unwrap();
    compare_frames(&path, &session, "/world/nominal/frames", "nominal", profile.chain());
    assert_eq!(results(&journal).len(), 1);
    assert!(!views(&path).contains(TEMPERATURES));
    // An instrument that knows the temperature.
    let rows = text(&table.stdout);
    let lines = rows.lines().map(str::to_owned).enumerate();
    let warm: Vec<String> =
        lines.map(|(row, line)| if row == 0 { line + ",temperature_degc" } else { line + ",21.5" }).collect();
    fs::write(place.path("warm.csv"), warm.join("\n")).unwrap();
    let output = place.run(&["identify", "--profile", "soochow", "--measurements", "warm.csv", "--record", "warm.rrd"]);
    assert!([0, 1].contains(&output.status.code().unwrap()), "{}", text(&output.stderr));
    let path = place.path("warm.rrd");
    assert!(views(&path).contains(TEMPERATURES));
    let temperatures = numbers(&path, "/capture/temperature_degc", "pose", "Scalars:scalars");
    assert_eq!(temperatures.len(), session.samples.len());
    assert!(temperatures.iter().all(|(_, values)| values == &[21.5]), "{temperatures:?}");
}

#[test]
fn a_recording_is_replayed_like_its_session_also_when_it_is_half_written() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
    let half = &torn_part(&place, &script);
    assert!(!recording::check(half).unwrap().has_index);
    let last = recording::read(half).unwrap().numbers.last().unwrap().to_string();
    let rest = place.write_script("rest.script.ron", "CaptureAll(Fail)");
    // The file goes when the session goes on.
    fs::copy(half, place.path("half.rrd")).unwrap();
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    fs::copy(place.recording(), place.path("whole.rrd")).unwrap();
    for format in ["--print", "--csv"] {
        for (file, more) in [("whole.rrd", &[] as &[&str]), ("half.rrd", &["--entry", &last])] {
            let (shown, expected) =
                (place.run(&["replay", file, format]), place.run(&[&["replay", "sessions/s", format], more].concat()));
            succeeded(&shown);
            succeeded(&expected);
            assert!(shown.stdout.len() > 200);
            assert_eq!(text(&shown.stdout), text(&expected.stdout), "{file} {format}");
        }
    }
}

#[test]
fn a_plan_is_recorded_and_opens_on_its_search() {
    let place = Place::new();
    let output = place.run(&[
        "plan",
        "--profile",
        "soochow",
        "--poses",
        "16",
        "--verification",
        "4",
        "--candidates",
        "150",
        "--record",
        "p.rrd",
    ]);
    succeeded(&output);
    let path = place.path("p.rrd");
    assert!(recording::check(&path).unwrap().is_whole());
    assert_eq!(opens_on(&path), "[plan_iteration]");
    let search = numbers(&path, "/search/condition_number", "plan_iteration", "Scalars:scalars");
    assert!(search.len() > 1, "{search:?}");
    let steps: Vec<i64> = search.iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, (1..).take(steps.len()).collect::<Vec<i64>>());
    let journal = recording::read(&path).unwrap().lines().unwrap();
    let planned = rows(&path, false)
        .into_iter()
        .find(|(entity, _, values)| entity == "/world/plan/poses" && values.contains_key("Points3D:positions"));
    let rows = Session::of(&journal).unwrap().rows.len();
    assert_eq!(planned.unwrap().2["Points3D:positions"].matches('[').count(), rows + 1);
}
