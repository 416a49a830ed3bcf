//! Sessions under attack: the program killed, interrupted and starved of disk at any moment, and what it says about sessions.
//!
//! A run is paused where a test wants it by a `Say` that is longer than a pipe holds: nothing here waits for time to pass.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Output, Stdio};

use crate::support::place::{Place, script_of};
use crate::support::small_disk::SmallDisk;
use crate::support::{PROGRAM, text};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use trupose::session::journal::{Entry, Journal, Line, Sum, encode};
use trupose::session::set_up::Step;
use trupose::session::state::Session;
use trupose::store::session::{SessionFolder, read_journal};

/// Steps of the script by step of the wizard.
const STEPS: [(Step, &[&str]); 8] = [
    (Step::Profile, &["Do(ChooseProfile(\"soochow\"))", "Do(Next)"]),
    (Step::Instrument, &["Do(ChooseInstrument(Simulated((seed: 1, truth: Paper))))", "Do(Next)"]),
    (Step::Target, &["Do(ChooseTarget(Profile))", "Do(Next)"]),
    (Step::Plan, &["Do(LoadPlan(\"plan.csv\"))", "Do(AcceptPlan)"]),
    (Step::Capture, &["CaptureAll(Fail)", "Do(Next)"]),
    (Step::Identify, &["Do(Identify)", "Do(Next)"]),
    (Step::Verify, &["Do(Next)"]),
    (Step::Deliver, &["Do(Deliver)", "Expect(\"deliver.files\", Exists)"]),
];
const NAME: &str = "Do(NameSession(\"s\"))";
const POSES: usize = 18;

/// The script from a step of the wizard on.
fn from_step(first: Step) -> Vec<String> {
    STEPS
        .iter()
        .filter(|(step, _)| *step >= first)
        .flat_map(|(_, steps)| steps.iter().map(|step| (*step).to_owned()))
        .collect()
}

/// The script from the beginning.
fn whole() -> Vec<String> {
    std::iter::once(NAME.to_owned()).chain(from_step(Step::Profile)).collect()
}

/// The script with `inserted` in place of the capturing of all poses, which follows it.
fn paused(inserted: &[&str]) -> Vec<String> {
    whole()
        .into_iter()
        .flat_map(|step| {
            let before = if step.starts_with("CaptureAll") { inserted } else { &[] };
            before.iter().map(|step| (*step).to_owned()).chain([step]).collect::<Vec<_>>()
        })
        .collect()
}

/// More than a pipe holds.
fn long_say() -> String {
    format!("Say(\"{}\")", "x".repeat(200_000))
}

impl Place {
    /// Runs a script to its end.
    fn run_steps(&self, steps: &[String]) -> Output {
        let script = self.write_script("run.script.ron", &steps.join(", "));
        self.run(&["--script", &script, "--json", "--no-recording"])
    }

    /// Resumes a session with a script.
    fn resume(&self, folder: &str, steps: &[String]) -> Output {
        let script = self.write_script("rest.script.ron", &steps.join(", "));
        self.run(&["resume", folder, "--script", &script, "--json", "--no-recording"])
    }

    /// Resumes a session and completes it.
    fn complete(&self, folder: &str) -> Output {
        let session = Session::of(&read_journal(&self.path(folder)).unwrap()).unwrap();
        let output = self.resume(folder, &from_step(session.step));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        output
    }

    fn measurements(&self, folder: &str) -> String {
        fs::read_to_string(self.path(folder).join("measurements.csv")).unwrap()
    }

    /// A run that is paused behind `before`, with what it has written until then.
    fn pause(&self, before: &[&str]) -> Paused {
        let say = long_say();
        let script = self.write_script("run.script.ron", &paused(&[before, &[&say]].concat()).join(", "));
        Paused::start(self.command(&["--script", &script, "--json", "--no-recording"]))
    }
}

/// The lines of the journal, and that they make a session in which everything counts once.
fn checked(folder: &Path) -> (Journal, Session) {
    let journal = read_journal(folder).unwrap();
    let session = Session::of(&journal).unwrap();
    let numbers: Vec<u64> = journal
        .lines
        .iter()
        .filter_map(|line| match &line.entry {
            Entry::Sample(sample) => Some(sample.number),
            Entry::Refused { number, .. } => Some(*number),
            _ => None,
        })
        .collect();
    assert_eq!(numbers.iter().collect::<BTreeSet<_>>().len(), numbers.len(), "a number was used twice: {numbers:?}");
    let rows: Vec<usize> = session.counted().map(|sample| sample.row).collect();
    assert_eq!(rows.iter().collect::<BTreeSet<_>>().len(), rows.len(), "a row counts twice: {rows:?}");
    (journal, session)
}

/// Records of a transcript; a line that was cut is none.
fn records(bytes: &[u8]) -> Vec<Value> {
    bytes.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect()
}

/// Everything that was said to be saved is in the journal.
fn everything_saved_is_there(transcript: &[u8], folder: &Path) -> usize {
    let saved: Vec<Value> = records(transcript).into_iter().filter(|record| record["event"] == "saved").collect();
    if saved.is_empty() {
        return 0;
    }
    let (journal, _) = checked(folder);
    for record in &saved {
        let number = record["entry"].as_u64().unwrap();
        let line = &journal.lines[usize::try_from(number).unwrap() - 1];
        let shown: Vec<String> = line.entry.describe().lines().map(str::to_owned).collect();
        assert_eq!(record["text"], shown.join(" | "));
        assert_eq!(record["time"], line.time.to_string());
    }
    saved.len()
}

/// A program that writes to a pipe.
struct Paused {
    child: Child,
    out: BufReader<ChildStdout>,
    err: ChildStderr,
    seen: Vec<u8>,
}

impl Paused {
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let err = child.stderr.take().unwrap();
        Self { child, out, err, seen: Vec::new() }
    }

    /// Reads so many lines; `false` if there are not so many.
    fn read_lines(&mut self, count: usize) -> bool {
        (0..count).all(|_| self.out.read_until(b'\n', &mut self.seen).unwrap() > 0)
    }

    /// Reads until a measurement has been saved.
    fn until_measured(mut self, measurement: usize) -> Self {
        let mark = format!("\"measurement {measurement}: ");
        while !text(&self.seen).contains(&mark) {
            assert!(self.read_lines(1), "the program ended: {}", text(&self.seen));
        }
        self
    }

    fn signal(&self, name: &str) {
        let process = self.child.id().to_string();
        let status = Command::new("kill").args(["-s", name, &process]).status().unwrap();
        assert!(status.success());
    }

    /// Reads what is left and waits for the end.
    fn end(mut self) -> Output {
        self.out.read_to_end(&mut self.seen).unwrap();
        let mut stderr = Vec::new();
        self.err.read_to_end(&mut stderr).unwrap();
        Output { status: self.child.wait().unwrap(), stdout: self.seen, stderr }
    }

    fn kill(mut self) -> Output {
        // It may already have ended.
        self.child.kill().unwrap();
        self.end()
    }
}

/// An uninterrupted run.
fn finished() -> Place {
    let place = Place::new();
    let output = place.run_steps(&whole());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(everything_saved_is_there(&output.stdout, &place.session()) > POSES);
    place
}

// ---------------------------------------------------------------------------------------------------------------- SIGKILL

/// Kills at random moments, several times in the life of a session, then completes it. Returns the number of kills and the
/// lengths of the journals at that time.
fn kill_at_random(seed: u64, kills: usize, expected: &str) -> (usize, BTreeSet<usize>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut killed, mut lengths) = (0, BTreeSet::new());
    while killed < kills {
        let place = Place::new();
        let chain = random.random_range(1..=6);
        for _ in 0..chain {
            let journal = read_journal(&place.session()).ok();
            let step = journal.as_ref().map_or(Step::Profile, |journal| Session::of(journal).unwrap().step);
            let before = journal.as_ref().map_or(0, |journal| journal.lines.len());
            let command = if journal.is_some() {
                let script = place.write_script("rest.script.ron", &from_step(step).join(", "));
                place.command(&["resume", "sessions/s", "--script", &script, "--json", "--no-recording"])
            } else {
                // Killed before anything was saved: there is nothing to go on with.
                drop(fs::remove_dir_all(place.session()));
                let script = place.write_script("run.script.ron", &whole().join(", "));
                place.command(&["--script", &script, "--json", "--no-recording"])
            };
            let mut running = Paused::start(command);
            let lines = random.random_range(0..60_usize.saturating_sub(before).max(6));
            let spin: u32 = random.random_range(0..300_000);
            running.read_lines(lines);
            for _ in 0..spin {
                std::hint::spin_loop();
            }
            let output = running.kill();
            if output.status.signal() == Some(9) {
                killed += 1;
            } else {
                assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
            }
            everything_saved_is_there(&output.stdout, &place.session());
            if let Ok(journal) = read_journal(&place.session()) {
                // What was there before is there still.
                assert!(journal.lines.len() >= before);
                checked(&place.session());
                lengths.insert(journal.lines.len());
            } else {
                assert_eq!(before, 0);
                lengths.insert(0);
            }
        }
        if read_journal(&place.session()).is_err() {
            let mut folder = "sessions/s";
            if place.session().exists() {
                folder = "sessions/s-2";
            }
            assert_eq!(place.run_steps(&whole()).status.code(), Some(0));
            assert_eq!(place.measurements(folder), expected);
            continue;
        }
        place.complete("sessions/s");
        checked(&place.session());
        assert_eq!(place.measurements("sessions/s"), expected, "seed {seed}");
    }
    (killed, lengths)
}

#[test]
fn a_program_killed_at_any_moment_loses_nothing_that_was_saved() {
    let expected = finished().measurements("sessions/s");
    let threads: Vec<_> = (1..=2)
        .map(|seed| {
            let expected = expected.clone();
            let name = format!("kills-{seed}");
            std::thread::Builder::new().name(name).spawn(move || kill_at_random(seed, 105, &expected)).unwrap()
        })
        .collect();
    let (mut kills, mut lengths) = (0, BTreeSet::new());
    for thread in threads {
        let (more, at) = thread.join().unwrap();
        kills += more;
        lengths.extend(at);
    }
    assert!(kills >= 200, "{kills} kills");
    assert!(lengths.len() >= 15, "the kills are not spread: {lengths:?}");
}

#[test]
fn a_session_goes_on_from_every_line_of_its_journal() {
    let place = finished();
    let expected = place.measurements("sessions/s");
    let whole = fs::read(place.session().join("journal.ron")).unwrap();
    let ends: Vec<usize> = (1..=whole.len()).filter(|end| whole[end - 1] == b'\n').collect();
    for (lines, end) in (1..).zip(&ends) {
        // Whole lines, and a torn one after every second of them.
        let torn = if lines % 2 == 0 && *end < whole.len() { 7 } else { 0 };
        let name = format!("sessions/cut-{lines}");
        fs::create_dir(place.path(&name)).unwrap();
        fs::write(place.path(&name).join("journal.ron"), &whole[..end + torn]).unwrap();
        place.complete(&name);
        let (journal, session) = checked(&place.path(&name));
        assert_eq!(place.measurements(&name), expected, "after line {lines}");
        assert_eq!((session.resumed, session.closed, journal.torn_bytes), (1, true, 0));
        let resumed = &journal.lines[lines].entry;
        assert!(matches!(resumed, Entry::Resumed { torn_bytes, .. } if *torn_bytes == torn), "{resumed:?}");
    }
}

// ------------------------------------------------------------------------------------------------------------------- locks

#[test]
fn a_session_that_is_open_in_another_process_is_refused_with_its_number() {
    let place = Place::new();
    let paused = place.pause(&["Capture(3, Fail)"]).until_measured(3);
    let process = paused.child.id();
    let before = fs::read(place.session().join("journal.ron")).unwrap();
    let output = place.resume("sessions/s", &from_step(Step::Capture));
    assert_eq!(output.status.code(), Some(5));
    insta::assert_snapshot!(text(&output.stderr).replace(&process.to_string(), "PROCESS"), @r"
    error: session 'sessions/s' is open in another program (process PROCESS)
    hint: close the other program first, or continue there
    ");
    assert_eq!(fs::read(place.session().join("journal.ron")).unwrap(), before);
    // Looking at it is allowed.
    assert_eq!(place.run(&["session", "show", "sessions/s"]).status.code(), Some(0));
    assert_eq!(paused.kill().status.signal(), Some(9));
    // The lock of a program that was killed holds nobody up.
    place.complete("sessions/s");
    assert_eq!(place.measurements("sessions/s"), finished().measurements("sessions/s"));
}

#[test]
fn many_processes_at_once_work_on_a_session_one_after_the_other() {
    let place = Place::new();
    place.pause(&["Capture(2, Fail)"]).until_measured(2).kill();
    let script = place.write_script("rest.script.ron", "Capture(1, Fail)");
    let run =
        || Paused::start(place.command(&["resume", "sessions/s", "--script", &script, "--json", "--no-recording"]));
    let running: Vec<Paused> = (0..8).map(|_| run()).collect();
    let mut done = 0;
    for program in running {
        let output = program.end();
        match output.status.code() {
            Some(0) => done += 1,
            Some(5) => assert!(text(&output.stderr).contains("is open in another program"), "{}", text(&output.stderr)),
            code => panic!("{code:?}: {}", text(&output.stderr)),
        }
    }
    let (_, session) = checked(&place.session());
    assert!(done >= 1);
    assert_eq!((session.samples.len(), session.resumed), (2 + done, done));
}

#[test]
fn many_new_sessions_of_one_name_get_a_folder_each() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &whole()[..3].join(", "));
    let running: Vec<Paused> =
        (0..6).map(|_| Paused::start(place.command(&["--script", &script, "--json", "--no-recording"]))).collect();
    for program in running {
        let output = program.end();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    for name in ["s", "s-2", "s-3", "s-4", "s-5", "s-6"] {
        assert_eq!(checked(&place.path("sessions").join(name)).1.name, name);
    }
}

// ----------------------------------------------------------------------------------------------------------------- signals

const SIGNALS: [(&str, i32, &str); 3] = [
    ("INT", 2, "interrupted (SIGINT)"),
    ("TERM", 15, "terminated (SIGTERM)"),
    ("HUP", 1, "the terminal went away (SIGHUP)"),
];

#[test]
fn a_signal_closes_the_session_in_good_order() {
    let expected = finished().measurements("sessions/s");
    // Behind a restart it is another engine that must be told.
    for before in [&["Capture(3, Fail)"][..], &["Capture(3, Fail)", "Restart"]] {
        for (name, number, cause) in SIGNALS {
            let place = Place::new();
            let paused = place.pause(before).until_measured(3);
            paused.signal(name);
            let output = paused.end();
            assert_eq!(output.status.code(), Some(128 + number), "{name}: {}", text(&output.stderr));
            assert_eq!(text(&output.stderr).trim(), format!("error: {cause}; the session is saved"));
            everything_saved_is_there(&output.stdout, &place.session());
            let (journal, session) = checked(&place.session());
            assert_eq!(journal.lines.last().unwrap().entry, Entry::Closed { reason: cause.to_owned() });
            assert!(session.closed && session.samples.len() < POSES, "{}", session.samples.len());
            place.complete("sessions/s");
            assert_eq!(place.measurements("sessions/s"), expected);
        }
    }
}

#[test]
fn a_signal_at_any_moment_leaves_a_session_that_goes_on() {
    let expected = finished().measurements("sessions/s");
    for (index, (name, number, _)) in (0..24).zip(SIGNALS.into_iter().cycle()) {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &whole().join(", "));
        let mut running = Paused::start(place.command(&["--script", &script, "--json", "--no-recording"]));
        // The first line comes when signals are watched.
        running.read_lines(1 + index * 2);
        running.signal(name);
        let output = running.end();
        everything_saved_is_there(&output.stdout, &place.session());
        match output.status.code() {
            Some(0) => {}
            code => assert_eq!(code, Some(128 + number), "after line {}: {}", 1 + index * 2, text(&output.stderr)),
        }
        let Ok(journal) = read_journal(&place.session()) else { continue };
        if output.status.code() != Some(0) && journal.lines.len() > 3 {
            assert!(matches!(journal.lines.last().unwrap().entry, Entry::Closed { .. }), "{:?}", journal.lines.last());
        }
        place.complete("sessions/s");
        assert_eq!(place.measurements("sessions/s"), expected);
    }
}

// --------------------------------------------------------------------------------------------------------------- full disk

/// A run that can no longer write its journal must say so, and continue once it can.
fn says_what_is_safe(place: &Place, output: &Output, reason: &str) {
    let errors = text(&output.stderr).replace("\n  ", " ");
    assert_ne!(output.status.code(), Some(0));
    assert!(output.status.code().is_some(), "{:?}", output.status);
    assert!(
        errors.contains("could not save: cannot write") && errors.contains("journal.ron") && errors.contains(reason),
        "{errors}"
    );
    let notices: Vec<String> = records(&output.stdout)
        .iter()
        .filter(|record| record["event"] == "notice")
        .map(|record| record["text"].as_str().unwrap().to_owned())
        .collect();
    let told = notices.last().unwrap();
    let Ok(journal) = read_journal(&place.session()) else { return };
    let saved = everything_saved_is_there(&output.stdout, &place.session());
    assert_eq!(journal.lines.len(), saved, "what was not acknowledged is cut off");
    let count = checked(&place.session()).1.samples.len();
    let safe = if count == 1 { "1 sample is".to_owned() } else { format!("{count} samples are") };
    assert!(told.contains(&format!("{safe} already saved")), "{told}");
}

/// A limit of the size of a file is a disk that is full at exactly that byte, and needs no rights.
#[test]
fn a_journal_that_cannot_grow_stops_the_run_and_goes_on_later() {
    let whole_run = finished();
    let expected = whole_run.measurements("sessions/s");
    let full = fs::metadata(whole_run.session().join("journal.ron")).unwrap().len();
    let mut stopped = 0;
    // In blocks of 512 bytes. The files of a result are smaller than the journal.
    for blocks in (1..full / 512).step_by(3) {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &whole().join(", "));
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec '{PROGRAM}' --script {script} --json");
        let output = Command::new("sh").args(["-c", &limited]).current_dir(place.0.path()).output().unwrap();
        says_what_is_safe(&place, &output, "File too large");
        stopped += 1;
        if read_journal(&place.session()).is_ok() {
            place.complete("sessions/s");
            assert_eq!(place.measurements("sessions/s"), expected, "{blocks} blocks");
        }
    }
    assert!(stopped > 5);
}

/// The report does not fit any more, the journal does.
#[test]
fn a_delivery_that_does_not_fit_leaves_no_part_of_itself_and_can_be_repeated() {
    let whole_run = finished();
    let size = |name: &str| fs::metadata(whole_run.session().join(name)).unwrap().len();
    let blocks = (size("report.html") - 1) / 512;
    assert!(512 * blocks > size("journal.ron") + 4096, "the report is the largest file");
    let place = Place::new();
    let before: Vec<String> = whole().into_iter().filter(|step| !step.contains("eliver")).collect();
    assert_eq!(place.run_steps(&before).status.code(), Some(0));
    let files = || {
        let names =
            fs::read_dir(place.session()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name != ".lock").collect::<BTreeSet<_>>()
    };
    let without = files();
    let script = place.write_script("rest.script.ron", "Do(Deliver)");
    let limited = format!(
        "trap '' XFSZ; ulimit -f {blocks}; exec '{PROGRAM}' resume sessions/s --script {script} --json --no-recording"
    );
    let output = Command::new("sh").args(["-c", &limited]).current_dir(place.0.path()).output().unwrap();
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(said.contains("report.html") && said.contains("File too large"), "{said}");
    assert_eq!(files(), without, "a part of the result is there");
    assert_eq!(place.resume("sessions/s", &["Do(Deliver)".to_owned()]).status.code(), Some(0));
    assert!(files().contains("report.html") && files().contains("calibration.ron"));
}

/// With a virtual clock nothing of a run is left to chance, the recording included.
#[test]
fn a_run_with_a_virtual_clock_makes_the_same_files_again() {
    let files = || {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &whole().join(", "));
        assert_eq!(place.run(&["--script", &script, "--json"]).status.code(), Some(0));
        let names = fs::read_dir(place.session()).unwrap().map(|entry| entry.unwrap().file_name());
        let names = names.filter(|name| name != ".lock");
        names.map(|name| (name.clone(), fs::read(place.session().join(name)).unwrap())).collect::<BTreeMap<_, _>>()
    };
    let (once, again) = (files(), files());
    assert!(
        once.keys().eq(again.keys()) && once.contains_key("recording.rrd".as_ref() as &std::ffi::OsStr),
        "{:?}",
        once.keys()
    );
    for (name, bytes) in &once {
        assert!(again[name] == *bytes, "{} differs", name.display());
    }
}

/// The system refuses memory, and the program ends as it does then: not as after a defect, and with all that was saved.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_gets_no_memory_loses_nothing_that_was_saved() {
    let expected = finished().measurements("sessions/s");
    for kilobytes in [60_000, 150_000, 200_000, 230_000, 260_000, 300_000, 350_000] {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &whole().join(", "));
        let limited = format!("ulimit -v {kilobytes}; exec '{PROGRAM}' --script {script} --json");
        let output = Command::new("sh").args(["-c", &limited]).current_dir(place.0.path()).output().unwrap();
        assert!(!matches!(output.status.code(), Some(70 | 101)), "{kilobytes}: {}", text(&output.stderr));
        everything_saved_is_there(&output.stdout, &place.session());
        let Ok(journal) = read_journal(&place.session()) else { continue };
        if !Session::of(&journal).unwrap().closed {
            place.complete("sessions/s");
        }
        assert_eq!(place.measurements("sessions/s"), expected, "{kilobytes} kB");
    }
}

/// A digit or byte of any file of a result: also of those that have no place for a check sum of their own.
#[test]
fn a_change_of_any_delivered_file_is_named() {
    let place = finished();
    let show = || text(&place.run(&["session", "show", "sessions/s"]).stdout);
    let Some(Entry::Delivered { files, .. }) = read_journal(&place.session())
        .unwrap()
        .lines
        .into_iter()
        .rev()
        .map(|line| line.entry)
        .find(|entry| matches!(entry, Entry::Delivered { .. }))
    else {
        panic!("nothing was delivered")
    };
    assert!(
        ["corrected.urdf", "dh.csv", "corrected.ron"].iter().all(|name| files.iter().any(|file| file == name)),
        "{files:?}"
    );
    assert!(!show().contains("CHANGED"), "{}", show());
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for name in &files {
        let file = place.session().join(name);
        let whole = fs::read(&file).unwrap();
        for _ in 0..3 {
            let mut bytes = whole.clone();
            let digits: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at].is_ascii_digit()).collect();
            let at = digits[random.random_range(0..digits.len())];
            bytes[at] = b'0' + (bytes[at] - b'0' + random.random_range(1..10)) % 10;
            fs::write(&file, bytes).unwrap();
            assert!(show().contains(&format!("{name}: CHANGED since it was")), "{name}, byte {at}: {}", show());
        }
        fs::remove_file(&file).unwrap();
        assert!(show().contains(&format!("{name}: NOT readable")), "{}", show());
        fs::write(&file, whole).unwrap();
    }
    assert!(!show().contains("CHANGED"), "{}", show());
}

#[test]
fn a_reader_that_goes_away_costs_nothing_that_was_saved() {
    let expected = finished().measurements("sessions/s");
    for lines in [1, 12, 20, 30] {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &whole().join(", "));
        let mut running = Paused::start(place.command(&["--script", &script, "--json", "--no-recording"]));
        assert!(running.read_lines(lines));
        let Paused { mut child, out, seen, .. } = running;
        drop(out);
        let code = child.wait().unwrap().code();
        // All may have been in the pipe already.
        assert!(matches!(code, Some(0 | 5)), "{code:?}");
        everything_saved_is_there(&seen, &place.session());
        if read_journal(&place.session()).is_ok() {
            place.complete("sessions/s");
            assert_eq!(place.measurements("sessions/s"), expected, "after {lines} lines");
        }
    }
}

#[test]
fn a_full_disk_stops_the_run_and_goes_on_when_there_is_room() {
    let expected = finished().measurements("sessions/s");
    for room in [4, 12, 16, 20, 24] {
        let place = Place::new();
        let Some(disk) = SmallDisk::mount(place.path("sessions"), 1024) else { return };
        let ballast = disk.0.join("ballast");
        fs::write(&ballast, vec![0; (1024 - room) * 1024]).unwrap();
        let output = place.run_steps(&whole());
        says_what_is_safe(&place, &output, "No space left on device");
        fs::remove_file(&ballast).unwrap();
        if read_journal(&place.session()).is_err() {
            // Nothing was measured: started again, under the same name if the folder could not be created either.
            assert_eq!(place.run_steps(&whole()).status.code(), Some(0));
            continue;
        }
        place.complete("sessions/s");
        assert_eq!(place.measurements("sessions/s"), expected, "{room} KiB");
    }
}

// ------------------------------------------------------------------------------------------------------------------- clocks

/// The session with other times.
fn retimed(place: &Place, name: &str, lines: usize, time: impl Fn(i64) -> i64) {
    let journal = read_journal(&place.session()).unwrap();
    let (mut bytes, mut sum) = (String::new(), Sum::default());
    for (index, line) in (0..).zip(&journal.lines[..lines]) {
        let time = jiff::Timestamp::from_second(time(index)).unwrap();
        let (encoded, next) = encode(&Line { time, ..line.clone() }, &sum).unwrap();
        bytes += &encoded;
        sum = next;
    }
    fs::create_dir(place.path(name)).unwrap();
    fs::write(place.path(name).join("journal.ron"), bytes).unwrap();
}

#[test]
fn a_clock_that_jumps_back_holds_nothing_up() {
    let place = finished();
    let expected = place.measurements("sessions/s");
    let future = 4_000_000_000;
    let measured = 15; // lines, of which the last ones are measurements
    // Backwards all the time; forth and back by a day, which is a pause; and all in the future of the clock that it continues with.
    retimed(&place, "back", measured, |index| 1_700_000_000 - 60 * index);
    retimed(&place, "zigzag", measured, |index| 1_700_000_000 + if index % 2 == 0 { 60 * index } else { -86_400 });
    retimed(&place, "future", measured, |index| future + 10 * index);
    for (name, left) in [("back", "Absent"), ("zigzag", "Absent"), ("future", "Above(0.0)")] {
        let expect = format!("Expect(\"capture.minutes_left\", {left})");
        let steps: Vec<String> = std::iter::once(expect).chain(from_step(Step::Capture)).collect();
        // By the clock of the system, which is neither.
        fs::write(place.path("now.script.ron"), script_of(None, &steps.join(", "))).unwrap();
        let output = place.run(&["resume", name, "--script", "now.script.ron", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{name}: {}", text(&output.stderr));
        let (journal, session) = checked(&place.path(name));
        assert_eq!(place.measurements(name), expected);
        let latest = journal.lines.iter().map(|line| line.time).max();
        assert_eq!(session.latest, latest);
        assert_eq!(place.run(&["session", "show", name]).status.code(), Some(0));
    }
    // A clock of a script does not go back behind what is there.
    retimed(&place, "virtual", measured, |index| future + 10 * index);
    place.complete("virtual");
    let (journal, _) = checked(&place.path("virtual"));
    assert!(journal.lines.windows(2).all(|pair| pair[0].time <= pair[1].time));
}

// ---------------------------------------------------------------------------------------------------------------- commands

/// What a command prints, with the version taken out.
fn shown(place: &Place, arguments: &[&str]) -> String {
    let output = place.run(arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout).replace(env!("CARGO_PKG_VERSION"), "VERSION")
}

#[test]
fn a_session_is_shown_in_a_few_lines() {
    let place = finished();
    insta::assert_snapshot!("finished", shown(&place, &["session", "show", "sessions/s"]));
    let journal = shown(&place, &["session", "show", "sessions/s", "--journal"]);
    insta::assert_snapshot!("journal", journal);
    let entries: Vec<Value> =
        serde_json::from_str(&shown(&place, &["session", "show", "sessions/s", "--json"])).unwrap();
    let lines = read_journal(&place.session()).unwrap().lines;
    assert_eq!(entries.len(), lines.len());
    for (entry, line) in entries.iter().zip(&lines) {
        assert_eq!(entry["number"], line.number);
        assert_eq!(entry["time"], line.time.to_string());
        assert_eq!(entry["text"], line.entry.describe().replace(env!("CARGO_PKG_VERSION"), "VERSION"));
    }
    // One that was interrupted, with notes, a skipped pose, and a torn end.
    let place = Place::new();
    let actions = ["Do(Note(\"draught from the gate\"))", "Do(Skip)", "Capture(3, Fail)", "Do(Undo)"];
    place.pause(&actions).until_measured(3).kill();
    let path = place.session().join("journal.ron");
    // The kill may come before or after the undo is on disk: it is cut off.
    let bytes = fs::read(&path).unwrap();
    let lines = checked(&place.session()).0.lines;
    let keep =
        lines.iter().position(|line| matches!(&line.entry, Entry::Sample(sample) if sample.number == 3)).unwrap();
    let end = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(keep).unwrap().0 + 1;
    fs::write(&path, [&bytes[..end], b"(\"0123"].concat()).unwrap();
    insta::assert_snapshot!("interrupted", shown(&place, &["session", "show", "sessions/s"]));
}

#[test]
fn a_damaged_session_does_not_hide_the_others() {
    let place = finished();
    let copy = |name: &str, change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = fs::read(place.session().join("journal.ron")).unwrap();
        change(&mut bytes);
        fs::create_dir(place.path("sessions").join(name)).unwrap();
        fs::write(place.path("sessions").join(name).join("journal.ron"), bytes).unwrap();
    };
    copy("damaged", &|bytes| bytes[200] ^= 1);
    copy("empty", &Vec::clear);
    copy("other", &|bytes| *bytes = b"not a journal\n".to_vec());
    copy("torn", &|bytes| bytes.truncate(bytes.len() - 3));
    fs::create_dir(place.path("sessions/no-session")).unwrap();
    let output = place.run(&["session", "list"]);
    assert_eq!(output.status.code(), Some(0));
    insta::assert_snapshot!("list", text(&output.stdout));
    insta::assert_snapshot!("list_problems", text(&output.stderr));
    for (name, what) in [
        ("damaged", "line 2 of the journal is damaged"),
        ("empty", "the journal is empty"),
        ("other", "this is not a session of trupose"),
        ("no-session", "it has no journal.ron"),
        ("missing", "it has no journal.ron"),
    ] {
        let folder = format!("sessions/{name}");
        let script = place.write_script("rest.script.ron", "");
        for arguments in [
            &["session", "show", &folder][..],
            &["session", "show", &folder, "--json"],
            &["session", "export", &folder, "--csv"],
            &["resume", &folder, "--script", &script],
        ] {
            let output = place.run(arguments);
            assert_eq!(output.status.code(), Some(5), "{arguments:?}");
            let message = text(&output.stderr).replace("\n  ", " ");
            assert!(message.contains(what) && message.contains("hint: "), "{arguments:?}: {message}");
            assert!(output.stdout.is_empty());
        }
    }
    // Nothing of that has changed anything.
    assert_eq!(fs::read(place.path("sessions/empty/journal.ron")).unwrap(), b"");
    assert!(!place.path("sessions/missing").exists());
}

/// Deviations of the parameters of a report by name.
fn deviations(report: &Value) -> BTreeMap<String, f64> {
    let parameters = report["parameters"].as_array().unwrap();
    parameters
        .iter()
        .map(|parameter| (parameter["name"].as_str().unwrap().to_owned(), parameter["deviation"].as_f64().unwrap()))
        .collect()
}

#[test]
fn exported_tables_are_those_of_the_session_and_identify_the_same_arm() {
    let place = finished();
    let delivered = place.measurements("sessions/s");
    assert_eq!(shown(&place, &["session", "export", "sessions/s", "--csv"]), delivered);
    insta::assert_snapshot!(
        shown(&place, &["session", "export", "sessions/s", "--csv", "--out", "new/tables"]),
        @r"
    written: new/tables/plan.csv
    written: new/tables/measurements.csv
    "
    );
    assert_eq!(fs::read_to_string(place.path("new/tables/measurements.csv")).unwrap(), delivered);
    let plan = fs::read_to_string(place.path("new/tables/plan.csv")).unwrap();
    assert_eq!(plan, fs::read_to_string(place.session().join("plan.csv")).unwrap());
    // Without anything to export, and without a robot.
    assert_eq!(place.run(&["session", "export", "sessions/s"]).status.code(), Some(2));
    let bytes = fs::read(place.session().join("journal.ron")).unwrap();
    let first = bytes.iter().position(|byte| *byte == b'\n').unwrap();
    fs::create_dir(place.path("bare")).unwrap();
    fs::write(place.path("bare/journal.ron"), &bytes[..=first]).unwrap();
    let output = place.run(&["session", "export", "bare", "--csv"]);
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(text(&output.stderr), @"error: session 'bare' has no robot yet");

    let table = "new/tables/measurements.csv";
    let use_rows = ["--use", "kind == 'identification'", "--json"];
    let output = place.run(&[&["identify", "--profile", "soochow", "--measurements", table][..], &use_rows].concat());
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)));
    let session: Value =
        serde_json::from_str(&fs::read_to_string(place.session().join("report.json")).unwrap()).unwrap();
    assert_eq!(report["samples"], session["samples"]);
    let (found, expected) = (deviations(&report), deviations(&session));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, value) in &expected {
        // The table has nanometres, the journal all digits.
        assert!((found[name] - value).abs() < 1e-5, "{name}: {} and {value}", found[name]);
    }
}

// ------------------------------------------------------------------------------------------------------------------- links

/// A folder that comes from elsewhere, in a zip or on a stick, must not lead the program to another file of the user.
#[cfg(unix)]
#[test]
fn links_in_a_session_are_never_written_through() {
    use std::os::unix::fs::symlink;
    const PRECIOUS: &str = "precious\n";
    let place = finished();
    let victim = place.path("victim");
    fs::write(&victim, PRECIOUS).unwrap();
    assert_eq!(place.run(&["record", "rebuild", "sessions/s"]).status.code(), Some(0));
    for (name, arguments) in [
        (".lock", &["record", "rebuild", "sessions/s"][..]),
        (".lock", &["resume", "sessions/s", "--plain"]),
        (".lock", &["session", "report", "sessions/s"]),
        ("journal.ron", &["resume", "sessions/s", "--plain"]),
        ("recording.rrd", &["record", "rebuild", "sessions/s"]),
        ("report.html", &["session", "report", "sessions/s"]),
        ("report.json", &["session", "report", "sessions/s"]),
    ] {
        let (own, kept) = (place.session().join(name), place.path("kept"));
        fs::rename(&own, &kept).unwrap();
        // The linked journal is a good one: it must not grow.
        let to = if name == "journal.ron" { &kept } else { &victim };
        let before = fs::read(to).unwrap();
        symlink(to, &own).unwrap();
        let output = place.run(arguments);
        let errors = text(&output.stderr).replace("\n  ", " ");
        assert_eq!(output.status.code(), Some(5), "{name} {arguments:?}: {errors}");
        assert!(errors.contains(name) && errors.contains("is not a file but a link"), "{errors}");
        assert_eq!(fs::read(to).unwrap(), before, "{name} {arguments:?}");
        assert!(fs::symlink_metadata(&own).unwrap().is_symlink());
        fs::rename(&kept, &own).unwrap();
    }
    // A hard link cannot be told from a file, but what it holds can.
    let lock = place.session().join(".lock");
    fs::remove_file(&lock).unwrap();
    fs::hard_link(&victim, &lock).unwrap();
    assert_eq!(place.run(&["record", "rebuild", "sessions/s"]).status.code(), Some(0));
    assert_eq!(fs::read_to_string(&victim).unwrap(), PRECIOUS);
    // The end of a journal that is set aside does not follow a link either, and is not lost because of it.
    fs::remove_file(&lock).unwrap();
    symlink(place.path("new"), place.session().join("journal.torn-1")).unwrap();
    fs::OpenOptions::new()
        .append(true)
        .open(place.session().join("journal.ron"))
        .unwrap()
        .write_all(b"(\"torn")
        .unwrap();
    assert_eq!(place.run(&["record", "rebuild", "sessions/s"]).status.code(), Some(0));
    assert!(!place.path("new").exists());
    assert_eq!(fs::read(place.session().join("journal.torn-2")).unwrap(), b"(\"torn");
}

#[test]
fn a_report_is_not_written_while_another_program_holds_the_session() {
    let place = finished();
    let (held, _) = SessionFolder::open(&place.session()).unwrap();
    let output = place.run(&["session", "report", "sessions/s"]);
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{errors}");
    assert!(errors.contains("is open in another program") && errors.contains("--out"), "{errors}");
    assert_eq!(place.run(&["session", "report", "sessions/s", "--out", "r.html"]).status.code(), Some(0));
    drop(held);
}

#[test]
fn temporary_files_of_a_killed_run_go_with_the_next_command() {
    let place = finished();
    let left = place.session().join(".trupose-x1y2z3");
    for arguments in [&["session", "show", "sessions/s"][..], &["session", "list"], &["replay", "sessions/s", "--csv"]]
    {
        fs::write(&left, "half a report").unwrap();
        let (held, _) = SessionFolder::open(&place.session()).unwrap();
        fs::write(&left, "of a program that runs").unwrap();
        place.run(arguments);
        assert!(left.exists(), "{arguments:?}");
        drop(held);
        assert_eq!(place.run(arguments).status.code(), Some(0));
        assert!(!left.exists(), "{arguments:?}");
    }
}
