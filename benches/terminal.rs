//! What the terminal costs: bytes per key, time from key to frame, time to the first frame, processor time when idle.
//!
//! Measured from outside, on the program in a real pseudo-terminal: `cargo bench --bench terminal`.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark that fails should say so; it measures time, and prints"
)]

#[path = "../tests/support/pty.rs"]
#[expect(dead_code, clippy::panic, reason = "some of it is for the tests; what does not come is a panic")]
mod pty;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use pty::{Terminal, processor_seconds};

/// No output for so long: the frame is complete, and the next one is not held back.
const QUIET: Duration = Duration::from_millis(80);
const SCRIPT: &str = "(title: \"to the capture step\", steps: [Do(ChooseProfile(\"soochow\")), Do(NameSession(\"s\")), \
    Do(Next), Do(ChooseInstrument(Simulated((seed: 1, truth: Paper)))), Do(Next), Do(ChooseTarget(Profile)), Do(Next), \
    Do(LoadPlan(\"plan.csv\")), Do(AcceptPlan), Capture(3, Fail)])";

fn resumed(folder: &Path, size: (u16, u16)) -> Terminal {
    let terminal = Terminal::start(folder, &["resume", "sessions/s"], size);
    terminal.wait_for_step(5);
    thread::park_timeout(3 * QUIET);
    terminal
}

/// Bytes and milliseconds of each key, sorted.
fn keys(terminal: &mut Terminal, keys: &[&str]) -> (Vec<f64>, Vec<f64>) {
    let (mut bytes, mut times) = (Vec::new(), Vec::new());
    for key in keys {
        let before = terminal.written();
        let pressed = Instant::now();
        terminal.send(key);
        let (count, last) = terminal.burst(before, QUIET);
        bytes.push(count as f64);
        times.push(1e3 * (last - pressed).as_secs_f64());
    }
    bytes.sort_by(f64::total_cmp);
    times.sort_by(f64::total_cmp);
    (bytes, times)
}

fn row(what: &str, values: &[f64], unit: &str, goal: &str) {
    let (median, most) = (values[values.len() / 2], values[values.len() - 1]);
    println!("{what:<46} {median:>9.1} {most:>9.1} {unit:<6} {goal}");
}

fn main() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.csv"), include_str!("../tests/sessions/plan.csv")).unwrap();
    fs::write(folder.path().join("to.script.ron"), SCRIPT).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_trupose"));
    assert!(command.current_dir(folder.path()).args(["--script", "to.script.ron"]).output().unwrap().status.success());

    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    println!("{:<46} {:>9} {:>9} {:<6} goal", format!("profile: {profile}"), "median", "largest", "");
    let mut starts: Vec<f64> = (0..10)
        .map(|_| {
            let terminal = Terminal::start(folder.path(), &["wizard"], (80, 24));
            terminal.wait_for_step(1);
            1e3 * terminal.started.elapsed().as_secs_f64()
        })
        .collect();
    starts.sort_by(f64::total_cmp);
    row("start to first frame, 80x24", &starts, "ms", "<= 100");

    let mut terminal = resumed(folder.path(), (80, 24));
    let (bytes, times) = keys(&mut terminal, &["m"; 8]);
    row("measure, 80x24: output", &bytes, "bytes", "<= 2048");
    row("measure, 80x24: key to last byte", &times, "ms", "");
    // From "Go to" through the other views and back.
    let (bytes, times) = keys(&mut terminal, &["\t"; 10]);
    row("next view, 80x24: output", &bytes, "bytes", "<= 2048");
    row("next view, 80x24: key to last byte", &times, "ms", "<= 20");
    let turns = ["\u{1b}[C"; 20];
    let (bytes, _) = keys(&mut terminal, &turns);
    row("turn the picture where it is not shown, 80x24", &bytes, "bytes", "<= 2048");
    let before = processor_seconds(terminal.process());
    thread::sleep(Duration::from_secs(3));
    let used = 100.0 * (processor_seconds(terminal.process()) - before) / 3.0;
    row("idle for 3 s: processor", &[used], "%", "< 1");
    drop(terminal);

    let mut terminal = resumed(folder.path(), (200, 50));
    let (bytes, times) = keys(&mut terminal, &turns);
    row("turn the picture, 200x50: output", &bytes, "bytes", "");
    row("turn the picture, 200x50: key to last byte", &times, "ms", "<= 20");
}
