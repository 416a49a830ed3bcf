//! Arguments about recordings for a 3D viewer.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Default port of the live view: the one that viewers expect.
const DEFAULT_PORT: &str = "9876";

/// Options of the recording while a session is measured.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct RecordingArgs {
    /// Serve the recording while it grows, on this port of this machine [default port: 9876]
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = DEFAULT_PORT)]
    pub live: Option<u16>,
    /// Write no recording for the 3D viewer ('trupose record rebuild' makes one later)
    #[arg(long, conflicts_with = "live")]
    pub no_recording: bool,
}

/// The option `--record` of a command without a session.
#[derive(Args, Clone, Debug, Default)]
pub struct RecordArgs {
    /// Write a recording of the result for the 3D viewer
    #[arg(long, value_name = "FILE.rrd")]
    pub record: Option<PathBuf>,
}

/// Subcommands of `record`.
#[derive(Debug, Subcommand)]
pub enum RecordCommand {
    /// Make the recording of a session again from its journal
    Rebuild {
        /// Folder of the session
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}
