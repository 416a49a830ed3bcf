//! Arguments of the health check.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::positive;
use crate::procedure::health::POSES;

/// What to do about the check.
#[derive(Debug, Subcommand)]
pub enum CheckCommand {
    /// Choose the poses that show best what may have moved
    Plan(CheckPlanArgs),
    /// Say from the measured points whether the calibration still holds
    Evaluate(CheckArgs),
}

/// Arguments of `check plan`.
#[derive(Args, Debug)]
pub struct CheckPlanArgs {
    /// Calibration to check (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Number of poses
    #[arg(long, value_name = "N", default_value_t = POSES, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(8..=100))]
    pub poses: usize,
    /// The SMR is still where it was at the calibration
    #[arg(long)]
    pub same_smr: bool,
    /// File for the plan; 'trupose program --plan' makes the robot's program of it
    #[arg(long, value_name = "CSV")]
    pub out: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Use the calibration although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
}

/// Arguments of `check evaluate`.
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Calibration to check (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Measured points, in the order in which they were measured; the tracker may stand anywhere
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// The SMR is still where it was at the calibration
    #[arg(long)]
    pub same_smr: bool,
    /// Position error that must not be exceeded [default: the limit of the profile]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub limit_mm: Option<f64>,
    /// Standard deviation of a measured coordinate [default: as at the calibration]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sigma_mm: Option<f64>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Use the calibration although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
}
