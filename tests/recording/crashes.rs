//! Programs that are killed, and what they leave.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::recording;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

use super::content::{compare_with_journal, compare_with_rebuilt};
use super::running::{RESULT, begun, succeeded};
use crate::support::place::Place;

pub(super) struct Running {
    child: Child,
    out: BufReader<ChildStdout>,
}

impl Running {
    pub(super) fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Self { child, out }
    }

    /// Kills the program a moment after it has said so many long things; `false` if it had ended by itself.
    pub(super) fn kill_after(mut self, said: usize, spin: u32) -> bool {
        self.hear(said);
        for _ in 0..spin {
            std::hint::spin_loop();
        }
        self.kill()
    }

    /// Reads until the program has said so many long things, or has ended.
    pub(super) fn hear(&mut self, said: usize) {
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
    pub(super) fn kill(mut self) -> bool {
        self.child.kill().unwrap();
        drop(self.out);
        self.child.wait().unwrap().signal() == Some(9)
    }
}

/// What a program leaves that runs `script` and is killed once samples are in its recording.
pub(super) fn torn_part(place: &Place, script: &str) -> PathBuf {
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
pub(super) const LONG: usize = 100_000;

/// Steps that measure poses one by one, with a pause after each.
pub(super) fn one_by_one(poses: usize) -> String {
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
            let held: BTreeSet<u64> = recording::files(&place.session())
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
