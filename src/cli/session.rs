//! Arguments of `trupose session`.

use std::path::PathBuf;

use clap::Subcommand;

use super::identity::IdentityArgs;

/// Subcommands of `session`.
#[derive(Debug, Subcommand)]
pub enum SessionCommand {
    /// List the sessions of a folder
    List {
        /// Folder of the sessions
        #[arg(value_name = "DIR", default_value = "sessions")]
        sessions: PathBuf,
    },
    /// Show a session: robot, samples, result
    Show {
        /// Folder of the session
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Print all entries of the journal as well
        #[arg(long)]
        journal: bool,
        /// Print all entries as one JSON array
        #[arg(long, conflicts_with = "journal")]
        json: bool,
    },
    /// Write the report of a session again from its journal: report.html to read and print, report.json for programs
    Report {
        /// Folder of the session
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Name of the HTML file; the JSON file is written beside it [default: report.html in the session's folder]
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Print the report as plain text and write no file
        #[arg(long, conflicts_with = "out")]
        text: bool,
        /// What the report is about, where the session does not say it or says it otherwise.
        #[command(flatten)]
        identity: IdentityArgs,
    },
    /// Write the tables of a session
    Export {
        /// Folder of the session
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Measurements (and, with '--out', the plan) as CSV
        #[arg(long, required = true)]
        csv: bool,
        /// Folder for the files [default: print the measurements]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}
