//! Runs a command: loads its files, calls the maths, writes the results.

mod assess;
mod cell;
mod checks;
mod constraints;
mod estimate;
mod identify;
mod load;
mod plan;
mod profile;
mod program;
mod progress;
mod result;
mod verify;

use std::io::{self, Write};

use crate::cli::{Cli, Command};
use crate::error::{ExitStatus, Failure};
use crate::session::printable;

/// Where a command prints: data to `out`, everything else to `err`.
#[derive(Debug)]
pub struct Console<O: Write, E: Write> {
    /// Data.
    pub out: O,
    /// Progress, warnings and failures.
    pub err: E,
}

impl<O: Write, E: Write> Console<O, E> {
    /// Prints data. A reader that went away is not a failure.
    fn print(&mut self, text: &str) -> Result<(), Failure> {
        match self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(Failure::new(ExitStatus::Store, format!("cannot write the output: {error}")))
            }
            _ => Ok(()),
        }
    }

    /// Prints a remark. Nobody may be listening, and nothing depends on it.
    fn remark(&mut self, text: &str) {
        let lines: Vec<String> = text.split('\n').map(printable).collect();
        drop(writeln!(self.err, "{}", lines.join("\n")));
    }
}

/// Runs what was typed.
///
/// # Errors
/// The command could not be done.
pub fn run<O: Write, E: Write>(cli: Cli, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    match cli.command {
        Command::Identify(args) => identify::run(&args, console),
        Command::Verify(args) => verify::run(&args, console),
        Command::Constraints(args) => constraints::run(&args, console),
        Command::Plan(args) => plan::run(&args, console),
        Command::Program(args) => program::run(&args, console),
        Command::Profile(command) => profile::run(&command, console),
    }
}

/// A JSON object as printed: indented, with a line break at the end.
fn to_json<T: serde::Serialize>(value: &T) -> Result<String, Failure> {
    let text =
        serde_json::to_string_pretty(value).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    Ok(text + "\n")
}
