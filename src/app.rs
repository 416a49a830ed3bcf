//! Runs a command: loads its files, calls the procedure, writes the results.

mod advice;
mod check;
mod compare;
mod compensate;
mod constraints;
mod export;
mod identify;
mod identity;
mod import;
mod iso9283;
mod link;
mod load;
mod manual;
mod plan;
mod profile;
mod program;
mod progress;
mod record;
mod replay;
mod script;
mod session;
mod simulate;
mod verify;
mod watch;
mod wizard;

use std::io::{self, Write};
use std::path::Path;

use crate::cli::{Cli, Command, EstimationArgs, PayloadArgs, ScriptArgs};
use crate::error::{ExitStatus, Failure};
use crate::identification::Weighting;
use crate::procedure::EstimationSettings;
use crate::profile::Profile;
use crate::session::set_up::PayloadText;
use crate::text::printable;
use crate::units::from_mm;

/// The output of a command: data to `out`, everything else to `err`.
#[derive(Debug)]
pub struct Console<O: Write, E: Write> {
    /// Data.
    pub out: O,
    /// Progress, warnings and failures.
    pub err: E,
}

impl<O: Write, E: Write> Console<O, E> {
    /// Prints data. A closed pipe is not a failure.
    fn print(&mut self, text: &str) -> Result<(), Failure> {
        self.print_bytes(text.as_bytes())
    }

    /// Prints data that may not be UTF-8.
    fn print_bytes(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        match self.out.write_all(bytes).and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(Failure::new(ExitStatus::Store, format!("cannot write the output: {error}")))
            }
            _ => Ok(()),
        }
    }

    /// Prints lines for people. Names of files and texts from elsewhere in them cannot disturb a terminal.
    fn say(&mut self, text: &str) -> Result<(), Failure> {
        let lines: Vec<String> = text.split('\n').map(printable).collect();
        self.print(&lines.join("\n"))
    }

    /// Prints the name of a file that was written.
    fn say_written(&mut self, path: &Path) -> Result<(), Failure> {
        self.say(&format!("written: {}\n", path.display()))
    }

    /// Prints a remark. A closed stderr is not a failure.
    fn remark(&mut self, text: &str) {
        let lines: Vec<String> = text.split('\n').map(printable).collect();
        drop(writeln!(self.err, "{}", lines.join("\n")));
    }
}

/// Runs the command that was typed.
///
/// # Errors
/// The command could not be done.
pub fn run<O: Write, E: Write>(cli: Cli, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let Some(command) = cli.command else {
        return match &cli.script {
            Some(file) => script::run(file, &cli.script_args, console),
            None => wizard::run(None, &cli.script_args, cli.terminal, console),
        };
    };
    match command {
        Command::Demo(args) => script::demo(&args, console),
        Command::Resume(args) => match &args.script {
            Some(file) => script::resume(args.folder.as_deref(), file, &args.script_args, console),
            None => wizard::resume(args.folder.as_deref(), &args.script_args, args.terminal, console),
        },
        Command::Wizard(args) => {
            let place = ScriptArgs {
                values: Vec::new(),
                sessions: args.sessions,
                json: false,
                record_script: args.record_script,
                raw_log: args.raw_log,
                recording: args.recording,
            };
            wizard::run(args.profile.as_deref(), &place, args.terminal, console)
        }
        Command::Replay(args) => replay::run(&args, console),
        Command::Session(command) => session::run(&command, console),
        Command::Import(args) => import::run(&args, console),
        Command::Identify(args) => identify::run(&args, console),
        Command::Verify(args) => verify::run(&args, console),
        Command::Constraints(args) => constraints::run(&args, console),
        Command::Plan(args) => plan::run(&args, console),
        Command::Iso9283(command) => iso9283::run(&command, console),
        Command::Check(command) => check::run(&command, console),
        Command::Compare(args) => compare::run(&args, console),
        Command::Program(args) => program::run(&args, console),
        Command::Record(command) => record::run(&command, console),
        Command::Compensate(args) => compensate::run(&args, console),
        Command::Export(args) => export::run(&args, console),
        Command::Profile(command) => profile::run(&command, console),
        Command::Link(command) => link::run(&command, console),
        Command::Simulate(args) => simulate::run(&args, console),
        Command::Completions(args) => manual::completions(args, console),
        Command::Man(args) => manual::man(&args, console),
    }
}

/// The estimation settings of the command line.
fn estimation_settings(args: &EstimationArgs, weighting: Weighting) -> EstimationSettings {
    EstimationSettings {
        level: args.level,
        terms: args.terms.clone(),
        weighting,
        prior: args.prior,
        estimator: args.estimator,
        iterations: args.iterations,
        sigma: args.sigma_mm.map(from_mm),
        expected_deviation: args.expected_deviation,
        filter: args.filter.clone(),
    }
}

/// The payload that the options state for the arm of `profile`.
///
/// # Errors
/// The masses of that arm are unknown: a payload would change nothing.
fn payload_of(args: &PayloadArgs, profile: &Profile) -> Result<Option<PayloadText>, Failure> {
    let payload = args.text();
    if payload.is_some() && profile.chain().loads().is_none() {
        let text = format!("a payload changes nothing: the profile '{}' gives no masses of the arm", profile.name());
        return Err(Failure::new(ExitStatus::Usage, text)
            .hint("add 'weight_kg', or 'mass_kg' and 'centre_mm' of the joints, to the profile"));
    }
    Ok(payload)
}

/// The failure if the system refuses a thread, a signal handler or an open file: no defect of this program.
fn refused(error: &io::Error) -> Failure {
    Failure::new(ExitStatus::Store, format!("the system refuses what the program needs: {error}"))
        .hint("close other programs, or raise the limits of processes and open files ('ulimit -a' shows them)")
}

/// A JSON object as printed: indented, with a line break at the end.
fn to_json<T: serde::Serialize>(value: &T) -> Result<String, Failure> {
    let text =
        serde_json::to_string_pretty(value).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    #[test]
    fn without_options_the_command_identifies_by_default() {
        let words = ["trupose", "identify", "--profile", "soochow", "--measurements", "points.csv"];
        let Some(Command::Identify(args)) = Cli::parse_from(words).command else { panic!("not the command") };
        let asked = estimation_settings(&args.estimation, args.weighting);
        assert_eq!(asked, EstimationSettings::default());
    }
}
