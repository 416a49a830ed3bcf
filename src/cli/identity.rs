//! Options that say which arm and instrument a report is about.

use std::path::PathBuf;

use clap::Args;

/// What only people know about a calibration.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "For the report")]
pub struct IdentityArgs {
    /// Serial number of the arm; without one the verdict belongs to no arm
    #[arg(long, value_name = "TEXT")]
    pub serial: Option<String>,
    /// Person who measured
    #[arg(long, value_name = "TEXT")]
    pub operator: Option<String>,
    /// Place and conditions of the measurement
    #[arg(long, value_name = "TEXT")]
    pub site: Option<String>,
    /// File with these and more: controller, options, speed, warm-up, instrument, certificate, field check, SMR, weather
    #[arg(long, value_name = "RON")]
    pub identity: Option<PathBuf>,
}
