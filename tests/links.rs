//! Instruments on a wire, through the program itself: rehearsals over every wire, `simulate` against `link test`, a flood.

mod clients;

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::pty::{ENTER, Terminal};
use crate::support::{PROGRAM, text, trupose, trupose_in};
use tempfile::TempDir;
use trupose::report::{Document, PointOrigin};
use trupose::session::calibration::Calibration;
use trupose::session::journal::Entry;
use trupose::session::state::Session;
use trupose::session::summary::ParameterSummary;
use trupose::store::session::read_journal;

/// A folder with a plan of 18 poses.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.csv"), include_str!("sessions/plan.csv")).unwrap();
    folder
}

/// Runs a script whose instrument is the one given, up to the plan and on with `steps`.
fn run(folder: &Path, instrument: &str, steps: &str, more: &[&str]) -> Output {
    let script = format!(
        r#"(title: "test", clock: Some("2026-01-05T08:00:00Z"), steps: [
            Do(ChooseProfile("soochow")), Do(NameSession("s")), Do(Next),
            Do(ChooseInstrument({instrument})), Expect("instrument.identity", Exists), Do(Next),
            Do(ChooseTarget(Profile)), Do(Next), Do(LoadPlan("plan.csv")), Do(AcceptPlan), {steps}
        ])"#
    );
    fs::write(folder.join("test.script.ron"), script).unwrap();
    trupose_in(folder, &[&["--script", "test.script.ron", "--no-recording"], more].concat())
}

/// What a rehearsal ends with.
struct Ended {
    /// Measured points (mm).
    points: Vec<[f64; 3]>,
    calibration: Calibration,
    transcript: String,
    /// 0 or, for so few poses, 1: not accepted.
    code: Option<i32>,
}

/// The whole calibration on the simulated cell, over these wires.
fn rehearsed(wires: &str) -> Ended {
    let folder = folder();
    let instrument = format!("Simulated((seed: 1, truth: Paper, wires: [{wires}]))");
    let steps = "CaptureAll(Fail), Do(Next), Do(Identify), Do(Next), Do(Next), Do(Deliver)";
    let output = run(folder.path(), &instrument, steps, &[]);
    assert_eq!(text(&output.stderr), "", "{wires}: {}", text(&output.stdout));
    let session = folder.path().join("sessions/s");
    let table = fs::read_to_string(session.join("measurements.csv")).unwrap();
    let point = |line: &str| -> [f64; 3] {
        let fields: Vec<&str> = line.split(',').collect();
        [7, 8, 9].map(|field| fields[field].parse().unwrap())
    };
    let mark = table.lines().next().unwrap();
    assert!(mark.starts_with("# SIMULATED: the points come from the simulated cell (seed 1)"), "{mark}");
    let table: String = table.split_inclusive('\n').skip_while(|line| line.starts_with('#')).collect();
    assert!(table.starts_with("pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm"), "{table}");
    Ended {
        points: table.lines().skip(1).map(point).collect(),
        calibration: Calibration::parse(&fs::read_to_string(session.join("calibration.ron")).unwrap()).unwrap(),
        transcript: text(&output.stdout),
        code: output.status.code(),
    }
}

/// Largest difference of the deviations in a unit.
fn difference(one: &Calibration, other: &Calibration, unit: &str) -> f64 {
    let pairs = one.parameters.iter().zip(&other.parameters);
    let of_unit = pairs.filter(|(one, _)| one.unit.name() == unit);
    of_unit.map(|(one, other)| (one.deviation - other.deviation).abs()).fold(0.0, f64::max)
}

/// Over a wire that tells the standard deviations of its points, the same calibration comes out to the last digit that the wire
/// carries. Others leave it to the profile's instrument; so the prior weighs a little differently.
#[test]
fn a_rehearsal_over_every_wire_ends_with_the_calibration_of_one_in_process() {
    let wires = [
        ("Tcp(Emscon)", 1e-9),
        ("Tcp(Ascii)", 1e-3),
        ("Tcp(Geocom)", 0.05),
        ("Tcp(Ndi)", 0.05),
        ("Tcp(Emscon), Tcp(Rtde)", 1e-9),
        // Seven decimals of a degree.
        ("Tcp(Emscon), Tcp(Joints)", 1e-6),
        ("Tcp(Emscon), Tcp(Kuka)", 1e-6),
        ("Tcp(Emscon), Tcp(Abb)", 1e-6),
        ("Tcp(Emscon), Tcp(Fanuc)", 1e-6),
        // Half a pulse of a thousandth of a degree.
        ("Tcp(Emscon), Tcp(Yaskawa)", 0.05),
        ("Serial(Ascii)", 1e-3),
        ("Serial(Geocom)", 0.05),
        ("Serial(Ndi)", 0.05),
    ];
    thread::scope(|scope| {
        let in_process = scope.spawn(|| rehearsed(""));
        let over = wires.map(|(wires, tolerance)| (wires, tolerance, scope.spawn(move || rehearsed(wires))));
        let in_process = in_process.join().unwrap();
        assert!(in_process.points.len() >= 18);
        for (wires, tolerance, run) in over {
            let found = run.join().unwrap();
            assert_eq!(found.points.len(), in_process.points.len(), "{wires}");
            let pairs = found.points.iter().zip(&in_process.points);
            let off = pairs.flat_map(|(one, other)| [0, 1, 2].map(|axis| (one[axis] - other[axis]).abs()));
            let off = off.fold(0.0, f64::max);
            // NDI tells single precision; the shots of every other wire are exact to 0.1 um.
            assert!(off <= if wires.contains("Ndi") { 3e-4 } else { 1e-4 }, "{wires}: points are off by {off} mm");
            assert_eq!(found.calibration.rank, in_process.calibration.rank, "{wires}");
            assert_eq!(found.calibration.verdict.status, in_process.calibration.verdict.status, "{wires}");
            for unit in ["mm", "deg"] {
                let difference = difference(&found.calibration, &in_process.calibration, unit);
                assert!(difference <= tolerance, "{wires}: {difference} {unit}");
            }
            assert_eq!(found.code, in_process.code, "{wires}");
            assert!(found.transcript.contains("simulated cell, seed 1, over "), "{wires}: {}", found.transcript);
        }
    });
}

/// Differences of the parameters in their stated standard deviations: root mean square, and the largest.
fn differences_in_sigma(one: &Calibration, other: &Calibration) -> (f64, f64) {
    let pairs = one.parameters.iter().zip(&other.parameters);
    let ratio = |(one, other): (&ParameterSummary, &ParameterSummary)| {
        Some((one.deviation - other.deviation).abs() / one.sigma.filter(|sigma| *sigma > 0.0)?)
    };
    let ratios: Vec<f64> = pairs.filter_map(ratio).collect();
    let squares: f64 = ratios.iter().map(|ratio| ratio * ratio).sum();
    ((squares / ratios.len() as f64).sqrt(), ratios.into_iter().fold(0.0, f64::max))
}

/// Each instrument and each robot at least once; all pairs where `TRUPOSE_ALL_WIRES` is set.
#[test]
fn an_instrument_beside_a_robot_ends_with_the_calibration_of_one_in_process_within_its_sigma() {
    let robots = ["Rtde", "Joints", "Kuka", "Abb", "Fanuc", "Yaskawa"];
    let instruments = ["Emscon", "Ascii", "Geocom", "Ndi"];
    let has_all = std::env::var_os("TRUPOSE_ALL_WIRES").is_some();
    let pairs = robots.iter().enumerate().flat_map(|(number, robot)| {
        let usual = number % instruments.len();
        let chosen = if has_all { &instruments[..] } else { &instruments[usual..=usual] };
        chosen.iter().map(move |instrument| (*instrument, *robot))
    });
    thread::scope(|scope| {
        let in_process = scope.spawn(|| rehearsed(""));
        let over = pairs.map(|(instrument, robot)| {
            (instrument, robot, scope.spawn(move || rehearsed(&format!("Tcp({instrument}), Tcp({robot})"))))
        });
        // All are started before the first is waited for: they wait for simulated seconds, not for the processor.
        let over: Vec<_> = over.collect();
        let in_process = in_process.join().unwrap();
        for (instrument, robot, run) in over {
            let found = run.join().unwrap();
            let (rms, largest) = differences_in_sigma(&found.calibration, &in_process.calibration);
            println!("{instrument} with {robot}: {rms:.3} sigma rms, at most {largest:.3}");
            assert_eq!(found.calibration.rank, in_process.calibration.rank, "{instrument} with {robot}");
            // The pulses of a Yaskawa controller are about as coarse as the tracker: they are noise of their own.
            let limit = if robot == "Yaskawa" { 1.0 } else { 0.2 };
            assert!(largest < limit, "{instrument} with {robot}: {rms} rms, at most {largest}");
        }
    });
}

/// `trupose simulate`, until this is dropped.
struct Simulator {
    child: Child,
    address: String,
    options: Option<String>,
    robot: Option<String>,
}

impl Simulator {
    fn start(arguments: &[&str]) -> Self {
        let mut command = Command::new(PROGRAM);
        command.arg("simulate").args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
        let told = |line: String, what: &str| line.strip_prefix(what).map(str::to_owned);
        let address = told(lines.next().unwrap(), "listening: ").unwrap();
        let options = address.starts_with("ascii").then(|| told(lines.next().unwrap(), "options: ").unwrap());
        let mut robot = None;
        if arguments.contains(&"--robot") {
            while robot.is_none() {
                robot = told(lines.next().unwrap(), "robot: ");
            }
        }
        Self { child, address, options, robot }
    }

    /// `trupose link test` against it: exit code, output, errors.
    fn tested(&self, more: &[&str]) -> (Option<i32>, String, String) {
        let mut arguments = vec!["link", "test", self.address.as_str()];
        if let Some(options) = &self.options {
            arguments.extend(["--options", options.as_str()]);
        }
        if let Some(robot) = &self.robot {
            arguments.extend(["--robot", robot.as_str()]);
        }
        arguments.extend(more);
        let output = trupose(&arguments);
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

const LISTEN: [&str; 2] = ["--listen", "127.0.0.1:0"];

#[test]
fn every_simulated_instrument_passes_the_test_of_its_link() {
    for (protocol, listen, said) in [
        ("emscon", &LISTEN[..], "units: mm, rad"),
        ("ascii", &LISTEN, "unit: mm (as set)"),
        ("geocom", &LISTEN, "prism constant"),
        ("ndi", &LISTEN, "tool: 0A"),
        ("ascii", &["--pty"], "unit: mm (as set)"),
        ("geocom", &["--pty"], "prism constant"),
        ("ndi", &["--pty"], "tool: 0A"),
    ] {
        let simulator = Simulator::start(&[&[protocol], listen].concat());
        let (code, output, errors) = simulator.tested(&["--shots", "2", "--seconds", "0.3"]);
        assert_eq!((code, errors.as_str()), (Some(0), ""), "{protocol}: {output}");
        for part in ["connected: ", said, "shot 2: x -", "scatter of 2 shots", "the link works"] {
            assert!(output.contains(part), "{protocol}: '{part}' is missing: {output}");
        }
    }
}

#[test]
fn a_robot_is_tested_with_its_instrument_and_alone() {
    let simulator = Simulator::start(&["emscon", "--listen", "127.0.0.1:0", "--robot", "127.0.0.1:0"]);
    let (code, output, errors) = simulator.tested(&["--shots", "1", "--seconds", "1.5"]);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{output}");
    assert!(output.contains("robot at rest at 0.000 15.000 -5.000"), "{output}");
    let alone = trupose(&["link", "test", simulator.robot.as_deref().unwrap(), "--seconds", "1.5"]);
    let output = text(&alone.stdout);
    assert!(alone.status.success(), "{output}{}", text(&alone.stderr));
    assert!(
        output.contains("robot at rest at 0.000 15.000 -5.000") && output.contains("their signs with the pendant"),
        "{output}"
    );
}

#[test]
fn a_controller_that_reports_pulses_is_tested_with_the_profile_that_states_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut profile = include_str!("../profiles/soochow.ron").to_owned();
    for (joint, pulses) in trupose::link::simulator::yaskawa::PULSES_PER_DEGREE.iter().enumerate() {
        let name = format!(r#"(name: "J{}", type: Revolute,"#, joint + 1);
        assert!(profile.contains(&name));
        profile = profile.replace(&name, &format!("{name} pulses_per_degree: {pulses:?},"));
    }
    let file = folder.path().join("arm.ron");
    fs::write(&file, profile).unwrap();
    let file = file.to_str().unwrap();
    let simulator = Simulator::start(&["emscon", "--listen", "127.0.0.1:0", "--robot", "yaskawa:127.0.0.1:0"]);
    let alone = |more: &[&str]| {
        let robot = simulator.robot.as_deref().unwrap();
        let output = trupose(&[&["link", "test", robot, "--seconds", "1.5"], more].concat());
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, output, errors) = alone(&["--profile", file]);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{output}");
    assert!(output.contains("robot at rest at 0.000 15.000 -5.000"), "{output}");
    let (code, output, errors) = simulator.tested(&["--shots", "1", "--seconds", "1", "--profile", file]);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{output}");
    assert!(output.contains("robot at rest at 0.000 15.000 -5.000"), "{output}");
    // Given options count before the profile. A profile without pulses does not help.
    let (code, output, errors) = alone(&["--profile", file, "--options", "(pulses_per_degree: [100.0])"]);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{output}");
    assert!(!output.contains("15.000"), "{output}");
    for (more, said) in [(&["--profile", "soochow"][..], "reports pulses"), (&[], "reports pulses")] {
        let (code, _, errors) = alone(more);
        assert_eq!(code, Some(2), "{errors}");
        assert!(errors.contains(said), "{errors}");
    }
}

#[test]
fn the_test_of_a_link_says_what_is_wrong_and_what_to_do() {
    for (protocol, fault, said, hint) in [
        ("emscon", "metres@1x*", "the instrument has a wrong setting: units", "reconnect"),
        ("emscon", "in-use@1x*", "in use by another program", "close the other program"),
        ("emscon", "lost-beam@1x*", "sees no reflector", "return the SMR to the nest"),
        ("emscon", "scaled@1x*", "by the scale 1.0001, so all distances", "ppm) to 1, then reconnect"),
        ("emscon", "moved@1x*", "but with warnings", "fix the warnings"),
        ("geocom", "no-target@1x*", "sees no reflector", "return the SMR to the nest"),
        ("ascii", "wrong-unit@1x*", "beyond the range of 80.0 m", "settings of the instrument"),
        ("ndi", "missing@1x*", "sees no reflector", "return the SMR to the nest"),
    ] {
        let simulator = Simulator::start(&[protocol, "--listen", "127.0.0.1:0", "--fault", fault]);
        let (code, output, errors) = simulator.tested(&["--shots", "1", "--seconds", "0"]);
        assert_eq!(code, Some(3), "{protocol} {fault}: {output}{errors}");
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [said, hint] {
            assert!(words(&errors).contains(part), "{protocol} {fault}: '{part}' is missing: {errors}");
        }
    }
    let refused = trupose(&["simulate", "ndi", "--listen", "127.0.0.1:0", "--fault", "earthquake"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("there is no fault 'earthquake'"), "{}", text(&refused.stderr));
}

#[test]
fn the_wizard_measures_at_an_instrument_on_a_wire_and_logs_every_byte() {
    let simulator = Simulator::start(&["emscon", "--listen", "127.0.0.1:0", "--plan", "tests/sessions/plan.csv"]);
    let folder = folder();
    let instrument = format!("Linked((address: \"{}\", options: Some(\"(measure_ms: 50)\")))", simulator.address);
    let output = run(folder.path(), &instrument, "Capture(1, Fail)", &["--raw-log", "raw.log"]);
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    let log = fs::read_to_string(folder.path().join("raw.log")).unwrap();
    // StartMeasurement as the tracker gets it, and its acceptance.
    assert!(
        log.lines().any(|line| line.contains(" emscon out ") && line.contains("0c0000000000000031000000")),
        "{log}"
    );
    assert!(log.lines().any(|line| line.contains(" emscon in ") && line.contains("3100000000000000")), "{log}");
}

/// What was rehearsed over a wire like a real instrument's is never taken for measured.
#[test]
fn a_session_over_a_simulator_says_in_its_report_that_it_is_simulated() {
    thread::scope(|scope| {
        // Lines of points carry no name.
        for (protocol, origin) in [
            ("emscon", PointOrigin::Simulated),
            ("geocom", PointOrigin::Simulated),
            ("ndi", PointOrigin::Simulated),
            ("ascii", PointOrigin::Instrument),
        ] {
            scope.spawn(move || {
                let simulator = Simulator::start(&[&[protocol][..], &LISTEN].concat());
                let folder = folder();
                let (address, options) = (&simulator.address, &simulator.options);
                let options =
                    options.as_ref().map_or_else(String::new, |options| format!(", options: Some({options:?})"));
                let instrument = format!("Linked((address: {address:?}{options}))");
                let output = run(folder.path(), &instrument, "Capture(1, Fail)", &[]);
                assert!(output.status.success(), "{protocol}: {}{}", text(&output.stdout), text(&output.stderr));
                let session = Session::of(&read_journal(&folder.path().join("sessions/s")).unwrap()).unwrap();
                assert_eq!(
                    Document::new(&session, &[]).report.points_from,
                    origin,
                    "{protocol}: {:?}",
                    session.identities
                );
            });
        }
    });
}

#[test]
fn where_the_robot_fails_the_instrument_is_not_blamed_for_it() {
    let tracker = Simulator::start(&["emscon", "--listen", "127.0.0.1:0"]);
    let controller = Simulator::start(&["rtde", "--listen", "127.0.0.1:0", "--fault", "old-protocol@1x*"]);
    let (code, output, errors) = tracker.tested(&["--robot", &controller.address, "--shots", "1", "--seconds", "0"]);
    assert_eq!(code, Some(3), "{output}{errors}");
    assert!(output.contains("connected: Leica"), "{output}");
    let words = errors.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("the robot: the controller refused"), "{errors}");
    assert!(words.contains("PolyScope has from 3.4 on") && words.contains("check the version"), "{errors}");
    assert!(!errors.contains("does not connect") && !errors.contains("bring the robot to rest"), "{errors}");
}

#[test]
fn a_simulator_that_cannot_tell_shots_from_looks_does_not_go_on_by_itself() {
    let refused = trupose(&["simulate", "ndi", "--listen", "127.0.0.1:0", "--shots", "3"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("type 'next'"), "{}", text(&refused.stderr));
}

#[test]
fn what_the_profile_says_about_the_link_is_proposed_and_stays_in_the_session() {
    let folder = folder();
    let profile = include_str!("../profiles/soochow.ron");
    let (head, _) = profile.trim_end().rsplit_once(')').unwrap();
    let link = "link: (address: \"emscon:192.168.0.2\", robot: \"rtde:192.168.0.10\", automatic: true),";
    fs::write(folder.path().join("cell.ron"), format!("{head}{link}\n)\n")).unwrap();
    let proposed = "Expect(\"instrument.link.address\", Is(\"emscon:tcp:192.168.0.2:700\")),
        Expect(\"instrument.link.robot\", Is(\"rtde:tcp:192.168.0.10:30004\"))";
    let begin = format!("Do(ChooseProfile(\"cell.ron\")), Do(NameSession(\"s\")), Do(Next), {proposed}");
    for (arguments, steps) in [(vec![], begin.as_str()), (vec!["resume", "sessions/s"], proposed)] {
        fs::write(folder.path().join("test.script.ron"), format!("(title: \"test\", steps: [{steps}])")).unwrap();
        let output =
            trupose_in(folder.path(), &[&arguments[..], &["--script", "test.script.ron", "--no-recording"]].concat());
        assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    }
}

/// A source that prints so many lines a second to everybody, for ever.
fn flood(lines_per_second: u32) -> u16 {
    const TURNS: u32 = 100;
    fn print(mut stream: TcpStream, lines: u32) {
        let mut number = 0_u32;
        let start = Instant::now();
        for turn in 1_u32.. {
            let mut text = String::new();
            for _ in 0..lines {
                number += 1;
                writeln!(text, "{:.4},-678.25,90.125", 1000.0 + 1e-6 * f64::from(number)).unwrap();
            }
            if stream.write_all(text.as_bytes()).is_err() {
                return;
            }
            thread::park_timeout((Duration::from_secs(1) / TURNS * turn).saturating_sub(start.elapsed()));
        }
    }
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            thread::spawn(move || print(stream, lines_per_second / TURNS));
        }
    });
    port
}

/// From the key to the frame that shows it, in a real terminal, while ten thousand lines a second arrive.
#[test]
fn ten_thousand_lines_a_second_leave_the_wizard_responsive() {
    const KEYS: usize = 15;
    const HELP: &str = "any key back";
    let folder = folder();
    let instrument = format!("Linked((address: \"ascii:tcp:127.0.0.1:{}\"))", flood(10_000));
    let output = run(folder.path(), &instrument, "Capture(1, Fail)", &[]);
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    let mut terminal = Terminal::start(folder.path(), &["resume", "sessions/s"], (80, 24));
    terminal.wait_for_step(5);
    // The link is up again, and measures what comes after the key.
    terminal.send_until(ENTER, "a sample", |shown| shown.samples() >= 2);
    let mut times: Vec<Duration> = (0..KEYS)
        .map(|_| {
            let start = Instant::now();
            terminal.send("?");
            terminal.wait_for("the help", |shown| shown.has(HELP));
            let time = start.elapsed();
            terminal.send("?");
            terminal.wait_for("the end of the help", |shown| !shown.has(HELP));
            time
        })
        .collect();
    times.sort();
    println!("key to frame: median {:?}, largest {:?}", times[KEYS / 2], times[KEYS - 1]);
    assert!(times[KEYS / 2] <= Duration::from_millis(50), "{times:?}");
    drop(terminal);
    let journal = read_journal(&folder.path().join("sessions/s")).unwrap();
    let samples = journal.lines.iter().filter_map(|line| match &line.entry {
        Entry::Sample(noted) => Some(noted),
        _ => None,
    });
    assert!(samples.clone().count() >= 2);
    for noted in samples {
        let (x, y, z) = noted.xyz_mm;
        assert!((1000.0..1100.0).contains(&x) && (y + 678.25).abs() < 1e-9 && (z - 90.125).abs() < 1e-9, "{noted:?}");
    }
}
