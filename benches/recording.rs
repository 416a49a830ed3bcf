//! What a recording costs: the wizard's thread, and the disk. The session of the demo, drawn from its journal.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark stops when its case is broken, and prints"
)]

use std::fs;
use std::process::Command;
use std::sync::OnceLock;

use divan::Bencher;
use divan::counter::ItemsCount;
use trupose::recording::{self, Recorder};
use trupose::session::journal::{Entry, Line};
use trupose::store::session::read_journal;

fn main() {
    sizes();
    divan::main();
}

/// The demo, with so many poses to identify from.
fn demo(poses: usize) -> Vec<Line> {
    let folder = tempfile::tempdir().unwrap();
    let script = include_str!("../sessions/demo.script.ron")
        .replace("poses: 56", &format!("poses: {poses}"))
        // Which poses they are does not matter here.
        .replace("candidates: 1500", "candidates: 400")
        .replace("Is(\"56\")", &format!("Is(\"{poses}\")"));
    fs::write(folder.path().join("demo.script.ron"), script).unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_trupose"))
        .current_dir(folder.path())
        .args(["--script", "demo.script.ron", "--no-recording", "--json"])
        .output()
        .unwrap()
        .status;
    assert!(status.success());
    read_journal(&folder.path().join("sessions/demo")).unwrap().lines
}

fn session() -> &'static [Line] {
    static LINES: OnceLock<Vec<Line>> = OnceLock::new();
    LINES.get_or_init(|| demo(56))
}

fn samples(lines: &[Line]) -> usize {
    lines.iter().filter(|line| matches!(line.entry, Entry::Sample(_))).count()
}

/// Places of the samples among the lines.
fn places(lines: &[Line]) -> Vec<usize> {
    (0..lines.len()).filter(|place| matches!(lines[*place].entry, Entry::Sample(_))).collect()
}

/// Sizes, printed: they are not times.
fn sizes() {
    let size = |lines: &[Line]| {
        let folder = tempfile::tempdir().unwrap();
        recording::rebuild(folder.path(), lines).unwrap().bytes
    };
    for poses in [56, 180] {
        let lines = demo(poses);
        let places = places(&lines);
        let (first, last) = (places[0], *places.last().unwrap());
        let count = samples(&lines);
        let (before, measured, whole) = (size(&lines[..first]), size(&lines[..=last]), size(&lines));
        println!(
            "{count} samples: {before} bytes before the first pose, {} per pose while measuring; {whole} bytes with the \
             result, {} per pose",
            (measured - before) / count,
            whole / count
        );
    }
}

/// What a pose costs the thread that measures.
#[divan::bench(sample_size = 1, sample_count = 200)]
fn take_a_pose(bencher: Bencher<'_, '_>) {
    let lines = session();
    let place = places(lines)[0];
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::start(folder.path(), lines[..place].to_vec(), None, |_event| ()).unwrap();
    bencher.bench_local(|| recorder.add(&lines[place..=place]).unwrap());
}

/// A recording made from its journal.
#[divan::bench(sample_count = 10)]
fn rebuild(bencher: Bencher<'_, '_>) {
    let lines = session();
    let folder = tempfile::tempdir().unwrap();
    bencher.counter(ItemsCount::new(samples(lines))).bench_local(|| recording::rebuild(folder.path(), lines).unwrap());
}
