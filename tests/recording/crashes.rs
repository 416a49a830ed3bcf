//! Programs that are killed, and what they leave.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, ChildStdout, Command, Stdio};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

use super::content::{compare_with_journal, compare_with_rebuilt, made_of};
use super::reading::whole;
use super::running::{RESULT, begun, recorded, succeeded};
use crate::support::place::Place;
use crate::support::text;

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

    /// Kills the program a moment after it has said so many long things; `false` if it had already ended.
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

    /// `false` if it had already ended.
    pub(super) fn kill(mut self) -> bool {
        self.child.kill().unwrap();
        drop(self.out);
        self.child.wait().unwrap().signal() == Some(9)
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
fn after_kills_at_any_moment_the_recording_is_whole_and_is_made_again() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let (mut killed, mut found) = (0, 0);
    for round in 0..3 {
        let place = Place::new();
        let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
        let mut command = place.command(&["--script", &script, "--json"]);
        for _ in 0..3 {
            let (said, spin) = (random.random_range(1..4), random.random_range(0..30_000_000));
            killed += u32::from(Running::start(command).kill_after(said, spin));
            let journal = read_journal(&place.session()).unwrap();
            if place.recording().exists() {
                // The old one or the new one, but a whole one.
                let lines = whole(&place.recording());
                assert!(fs::read(place.recording()).unwrap() == made_of(&journal.lines[..lines]), "{lines} lines");
                found += 1;
            }
            let step = Session::of(&journal).unwrap().step;
            assert!(step <= trupose::session::set_up::Step::Capture, "{step:?}");
            let script = place.write_script("more.script.ron", &one_by_one(6));
            command = place.command(&["resume", "sessions/s", "--script", &script, "--json"]);
        }
        // What a program leaves that is killed while it writes.
        fs::write(place.session().join(".trupose-left"), "half").unwrap();
        if round == 0 {
            // Not resumed: made again from the journal.
            succeeded(&place.run(&["record", "rebuild", "sessions/s"]));
        } else {
            let script = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
            succeeded(&place.run(&["resume", "sessions/s", "--script", &script, "--json"]));
            compare_with_journal(&place.session());
        }
        assert_eq!(whole(&place.recording()), read_journal(&place.session()).unwrap().lines.len());
        assert!(!place.session().join(".trupose-left").exists());
        compare_with_rebuilt(&place);
    }
    assert_eq!(killed, 9);
    assert!(found > 0);
}

#[test]
fn a_recording_in_parts_of_an_earlier_version_becomes_one_file() {
    let place = recorded(&format!("{} Capture(2, Fail)", begun("")));
    let part = place.session().join("recording.part-001.rrd");
    fs::rename(place.recording(), &part).unwrap();
    let script = place.write_script("rest.script.ron", "Capture(1, Fail)");
    let output = place.run(&["resume", "sessions/s", "--script", &script, "--json"]);
    succeeded(&output);
    assert!(
        text(&output.stdout).contains("the 3D recording is made again: 1 part of an earlier version removed"),
        "{}",
        text(&output.stdout)
    );
    assert!(!part.exists());
    compare_with_journal(&place.session());
    fs::write(&part, "").unwrap();
    let output = place.run(&["record", "rebuild", "sessions/s"]);
    assert!(text(&output.stdout).contains("removed: 1 part of an earlier version"), "{}", text(&output.stdout));
    assert!(!part.exists());
}
