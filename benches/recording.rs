//! What a recording costs: the wizard's thread, the disk, and the reader. The session of the demo, drawn from its journal.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark stops when its case is broken, and prints"
)]

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use divan::Bencher;
use divan::counter::ItemsCount;
use tempfile::TempDir;
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

/// Bytes of the files of a recording.
fn size(folder: &Path) -> u64 {
    recording::files(folder).iter().map(|file| fs::metadata(file).unwrap().len()).sum()
}

/// A recorder that has written these lines, batch by batch, as a session that is measured does.
fn recorded<'a>(folder: &TempDir, batches: impl Iterator<Item = &'a [Line]>) -> Recorder {
    let mut recorder = Recorder::start(folder.path(), Vec::new(), None, |event| println!("{event:?}")).unwrap();
    batches.for_each(|batch| take_and_wait(&mut recorder, folder, batch));
    recorder
}

/// Waits until it is written: the next pose is measured seconds later.
fn take_and_wait(recorder: &mut Recorder, folder: &TempDir, batch: &[Line]) {
    let before = size(folder.path());
    recorder.take(batch).unwrap();
    while size(folder.path()) == before {
        std::thread::yield_now();
    }
    // All messages of a batch are written before the next can be taken; this one may still be at it.
    let mut settled = size(folder.path());
    loop {
        std::thread::sleep(std::time::Duration::from_millis(20));
        let now = size(folder.path());
        if now == settled {
            return;
        }
        settled = now;
    }
}

/// Sizes per pose, printed: they are not times.
fn sizes() {
    for poses in [56, 180] {
        let lines = demo(poses);
        let folder = tempfile::tempdir().unwrap();
        let places = places(&lines);
        let (first, last) = (places[0], *places.last().unwrap());
        let mut recorder = recorded(&folder, std::iter::once(&lines[..first]));
        let before = size(folder.path());
        for line in lines[first..=last].chunks(1) {
            take_and_wait(&mut recorder, &folder, line);
        }
        let growth = size(folder.path()) - before;
        drop(recorder);
        // The same content as that of the parts joined, however slow the disk is.
        let folder = tempfile::tempdir().unwrap();
        recording::rebuild(folder.path(), &lines).unwrap();
        let (count, whole) = (samples(&lines), size(folder.path()));
        println!(
            "{count} samples: {} bytes per pose while recording; {whole} bytes compacted, {} per pose",
            growth / count as u64,
            whole / count as u64
        );
    }
}

/// What a pose costs the thread that measures.
#[divan::bench(sample_size = 1, sample_count = 200)]
fn take_a_pose(bencher: Bencher<'_, '_>) {
    let lines = session();
    let place = places(lines)[0];
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorded(&folder, std::iter::once(&lines[..place]));
    bencher.bench_local(|| recorder.take(&lines[place..=place]).unwrap());
}

/// A recording made anew from its journal.
#[divan::bench(sample_count = 10)]
fn rebuild(bencher: Bencher<'_, '_>) {
    let lines = session();
    let folder = tempfile::tempdir().unwrap();
    bencher.counter(ItemsCount::new(samples(lines))).bench_local(|| recording::rebuild(folder.path(), lines).unwrap());
}

/// The journal read out of a recording, as a replay does.
#[divan::bench(sample_count = 20)]
fn replay_scan(bencher: Bencher<'_, '_>) {
    let lines = session();
    let folder = tempfile::tempdir().unwrap();
    let path = recording::rebuild(folder.path(), lines).unwrap();
    bencher.counter(ItemsCount::new(samples(lines))).bench_local(|| recording::read(&path).unwrap().lines().unwrap());
}
