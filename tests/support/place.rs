//! A folder in which the program runs, with a plan to load.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use super::command;

/// A script with these steps, which are separated by commas.
pub(crate) fn script_of(clock: Option<&str>, steps: &str) -> String {
    format!("(title: \"test\", clock: {clock:?}, steps: [{steps}])")
}

/// A folder in which the program runs; `plan.csv` is in it.
pub(crate) struct Place(pub(crate) tempfile::TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("plan.csv"), include_str!("../sessions/plan.csv")).unwrap();
        Self(folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Where the session `s` is.
    pub(crate) fn session(&self) -> PathBuf {
        self.path("sessions/s")
    }

    /// Writes a script with a virtual clock and returns its name.
    pub(crate) fn write_script(&self, name: &str, steps: &str) -> String {
        fs::write(self.path(name), script_of(Some("2026-01-05T08:00:00Z"), steps)).unwrap();
        name.to_owned()
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = command(self.0.path(), arguments);
        command.stdin(Stdio::null());
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }
}
