//! The `trupose` program: parses the command line, runs it, and turns its end into an exit code.

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::Parser as _;
use trupose::app::{Console, run};
use trupose::cli::Cli;
use trupose::error::ExitStatus;
use trupose::runtime::signals;
use trupose::text::printable;

fn main() -> ExitCode {
    let mut console = Console { out: io::stdout(), err: io::stderr() };
    let cli = match Cli::try_parse_from(Cli::in_order(std::env::args_os())) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // The message repeats what was typed, which must not disturb the terminal.
            let lines: Vec<String> = error.render().to_string().trim_end().split('\n').map(printable).collect();
            drop(writeln!(console.err, "{}", lines.join("\n")));
            return ExitStatus::Usage.into();
        }
        Err(help) => help.exit(),
    };
    signals::keep_large_files_an_error();
    match run(cli, &mut console) {
        Ok(status) => status.into(),
        Err(failure) => {
            // With stderr gone as well there is nobody left to tell; the exit code still says it.
            drop(writeln!(console.err, "{failure}"));
            failure.status.into()
        }
    }
}
