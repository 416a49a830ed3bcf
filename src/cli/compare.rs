//! Arguments of `compare`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Calibrations, or folders of sessions or results that contain one, the oldest first
    #[arg(value_name = "RON|DIR", required = true, num_args = 2..)]
    pub calibrations: Vec<PathBuf>,
    /// The SMR was still in its place at the flange
    #[arg(long)]
    pub same_smr: bool,
    /// Write the comparison as a page
    #[arg(long, value_name = "HTML")]
    pub html: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Use calibrations although they have changed since this program wrote them, because the changes were made on purpose
    #[arg(long)]
    pub edited: bool,
}
