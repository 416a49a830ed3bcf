//! The `trupose` program: parses the command line, runs it, and turns its end into an exit code.

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::Parser as _;
use trupose::app::{Console, run};
use trupose::cli::Cli;

fn main() -> ExitCode {
    let mut console = Console { out: io::stdout(), err: io::stderr() };
    match run(Cli::parse(), &mut console) {
        Ok(status) => status.into(),
        Err(failure) => {
            // With stderr gone as well there is nobody left to tell; the exit code still says it.
            drop(writeln!(console.err, "{failure}"));
            failure.status.into()
        }
    }
}
