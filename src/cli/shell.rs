//! Commands for the shell: completions and manual pages.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `completions`.
#[derive(Args, Clone, Copy, Debug)]
pub struct CompletionsArgs {
    /// Shell to complete commands and options for
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(Args, Clone, Debug)]
pub struct ManArgs {
    /// Folder for the pages of all commands; created if it is missing
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}
