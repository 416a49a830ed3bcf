//! Recordings for a 3D viewer.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Port of the live view: the one that viewers expect.
const DEFAULT_PORT: &str = "9876";

/// What is recorded while a session is worked on.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct RecordingArgs {
    /// Show the recording while it grows: viewers connect to this port of this machine [default port: 9876]
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = DEFAULT_PORT)]
    pub live: Option<u16>,
    /// Write no recording for the 3D viewer ('trupose record rebuild' makes one later)
    #[arg(long, conflicts_with = "live")]
    pub no_recording: bool,
}

/// `--record` of a command without a session.
#[derive(Args, Clone, Debug, Default)]
pub struct RecordArgs {
    /// Write a recording of it for the 3D viewer
    #[arg(long, value_name = "FILE.rrd")]
    pub record: Option<PathBuf>,
}

/// What to do with recordings.
#[derive(Debug, Subcommand)]
pub enum RecordCommand {
    /// Make the recording of a session again from its journal
    Rebuild {
        /// Folder of the session
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}
