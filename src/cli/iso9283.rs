//! Arguments of the test after ISO 9283.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{one_of, positive};
use crate::iso9283::{CYCLES, MeasuringPlane};

/// What to do about the test.
#[derive(Debug, Subcommand)]
pub enum Iso9283Command {
    /// Choose the cube and the five poses, and write the rows of the program
    Plan(TestPlanArgs),
    /// Accuracy and repeatability from the points that were attained
    Evaluate(EvaluateArgs),
    /// The same figures as a page
    Report(ReportArgs),
}

/// Arguments of `iso9283 plan`.
#[derive(Args, Debug)]
pub struct TestPlanArgs {
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Edge of the cube [default: the longest of 1000, 630, 400 and 250 mm that fits]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub edge_mm: Option<f64>,
    /// Centre of the cube in the robot base [default: where the arm is farthest from its limits]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub centre_mm: Option<[f64; 3]>,
    /// Diagonal plane of the cube that the poses are on
    #[arg(long, value_parser = one_of::<MeasuringPlane>(MeasuringPlane::NAMES), ignore_case = true, default_value_t)]
    pub plane: MeasuringPlane,
    /// Number of cycles
    #[arg(long, value_name = "N", default_value_t = CYCLES, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(3..=1000))]
    pub cycles: usize,
    /// Approach P1, P2 and P4 from three directions too
    #[arg(long)]
    pub multi_directional: bool,
    /// File for the plan; 'trupose program --plan' makes the robot's program of it
    #[arg(long, value_name = "CSV")]
    pub out: PathBuf,
}

/// A measured test.
#[derive(Args, Debug)]
pub struct TestArgs {
    /// Measured points; the column 'pose' has the names of the plan, such as 'c07-P3'
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Robot profile, where there is no calibration: a file, or the name of a shipped one
    #[arg(long, value_name = "NAME|FILE", required_unless_present = "calibration", conflicts_with = "calibration")]
    pub profile: Option<String>,
    /// Calibration (calibration.ron): the identified arm is shown beside the nominal one
    #[arg(long, value_name = "RON")]
    pub calibration: Option<PathBuf>,
    /// The tracker stands where it stood at the identification: take its place from the calibration instead of fitting it
    #[arg(long, requires = "calibration")]
    pub same_set_up: bool,
    /// What the flange carried, in words, such as '5 kg, 100 %'
    #[arg(long, value_name = "TEXT")]
    pub load: Option<String>,
    /// The speed of the test, in words, such as '100 % of the rated speed'
    #[arg(long, value_name = "TEXT")]
    pub speed: Option<String>,
    /// Use the calibration although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long, requires = "calibration")]
    pub edited: bool,
}

/// Arguments of `iso9283 evaluate`.
#[derive(Args, Debug)]
pub struct EvaluateArgs {
    #[command(flatten)]
    pub test: TestArgs,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `iso9283 report`.
#[derive(Args, Debug)]
pub struct ReportArgs {
    #[command(flatten)]
    pub test: TestArgs,
    /// File for the page
    #[arg(long, value_name = "HTML")]
    pub out: PathBuf,
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let wrong = || format!("'{text}' is not a point; write for example '900,0,600' (mm, x,y,z)");
    let numbers: Vec<f64> =
        text.split(',').map(|number| number.trim().parse()).collect::<Result<_, _>>().map_err(|_not_one| wrong())?;
    let point: [f64; 3] = numbers.try_into().map_err(|_count| wrong())?;
    point.iter().all(|value| value.abs() < 100_000.0).then_some(point).ok_or_else(wrong)
}
