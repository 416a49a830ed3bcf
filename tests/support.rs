//! What the tests share: the program to run, folders, terminals, small disks, simulated robots.

use std::path::Path;
use std::process::{Command, Output};

pub(crate) mod paper_case;
pub(crate) mod place;
pub(crate) mod point_cloud;
#[cfg(target_os = "linux")]
#[expect(dead_code, reason = "the benchmark of the terminal uses the rest")]
pub(crate) mod pty;
#[cfg(unix)]
pub(crate) mod small_disk;

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

/// Output of a program as text.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
