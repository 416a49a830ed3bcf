//! `trupose completions SHELL` and `trupose man`: completion scripts and manual pages of the command line.

use std::io::Write;

use clap::CommandFactory as _;
use clap_mangen::Man;

use super::Console;
use crate::cli::{Cli, CompletionsArgs, ManArgs};
use crate::error::{ExitStatus, Failure};
use crate::store;

pub(super) fn completions<O: Write, E: Write>(
    args: CompletionsArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "trupose", &mut script);
    console.print_bytes(&script)?;
    Ok(ExitStatus::Accepted)
}

/// Prints the first page; with a folder, writes the pages of all commands into it.
pub(super) fn man<O: Write, E: Write>(args: &ManArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let mut command = Cli::command();
    // Completes the full names of subcommands.
    command.build();
    let Some(folder) = &args.out else {
        console.print_bytes(&page(command)?.1)?;
        return Ok(ExitStatus::Accepted);
    };
    let store_failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
    store::create_folder(folder).map_err(store_failure)?;
    let mut commands = vec![command];
    let mut written = 0;
    while let Some(command) = commands.pop() {
        let is_shown = |inside: &&clap::Command| !inside.is_hide_set() && inside.get_name() != "help";
        commands.extend(command.get_subcommands().filter(is_shown).cloned());
        let (name, text) = page(command)?;
        store::replace_bytes(&folder.join(name), &text).map_err(store_failure)?;
        written += 1;
    }
    console.say(&format!("written: {written} pages into {}\n", folder.display()))?;
    Ok(ExitStatus::Accepted)
}

/// File name and text of the page of a command.
fn page(command: clap::Command) -> Result<(String, Vec<u8>), Failure> {
    let page = Man::new(command);
    let mut text = Vec::new();
    page.render(&mut text).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    Ok((page.get_filename(), text))
}
