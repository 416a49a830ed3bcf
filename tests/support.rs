//! What the tests share: the program to run, folders, terminals, small disks, simulated robots.

use std::env;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread;

pub(crate) mod bench;
pub(crate) mod derivatives;
pub(crate) mod faulty_session;
pub(crate) mod invented;
pub(crate) mod paper_case;
pub(crate) mod place;
#[cfg(target_os = "linux")]
#[expect(dead_code, reason = "the benchmark of the terminal uses the rest")]
pub(crate) mod pty;
pub(crate) mod reference_case;
#[cfg(unix)]
pub(crate) mod small_disk;
#[cfg(target_os = "linux")]
pub(crate) mod technician;

/// Path of the program under test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_trupose");

/// The root of the project, where tests run.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The program with `arguments`, ready to start in `folder`.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(arguments);
    command
}

/// Runs the program with `arguments` in the root of the project.
pub(crate) fn trupose(arguments: &[&str]) -> Output {
    trupose_in(root(), arguments)
}

/// Runs the program with `arguments` in `folder`.
pub(crate) fn trupose_in(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Says that the running test is skipped, on the standard error that the test harness does not capture.
pub(crate) fn skip(reason: &str) {
    // The harness names the thread of a test after it.
    let thread = thread::current();
    let line = format!("SKIPPED {}: {reason}\n", thread.name().unwrap_or("a test"));
    io::stderr().write_all(line.as_bytes()).unwrap();
}

/// A file or folder of the measured data, in `TRUPOSE_MEASURED_DATA` or beside the project; where it is missing the test is skipped.
pub(crate) fn measured_data(path: &str) -> Option<PathBuf> {
    let folder = env::var_os("TRUPOSE_MEASURED_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let path = folder.join(path);
    if !path.exists() {
        skip(&format!("no measured data ({} is missing)", path.display()));
        return None;
    }
    Some(path)
}

/// Output of a program as text.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
