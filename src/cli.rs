//! The command line: what was typed. The only reader of the environment is clap.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::session::measurements::Layout;
use crate::units::{DEGREE, MICROMETRE, MILLIMETRE, MILLIRADIAN};

/// Makes an industrial arm accurate: identifies its kinematic errors from distances between measured points.
#[derive(Debug, Parser)]
#[command(name = "trupose", version, about, max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Identify the kinematic errors of a robot from measured points
    Identify(IdentifyArgs),
    /// Verify a calibration on other measured points
    Verify(VerifyArgs),
    /// Identify from direct distances: shared points (ball and sockets) or measured lengths, no coordinates
    Constraints(ConstraintsArgs),
    /// List, show or check robot profiles
    #[command(subcommand)]
    Profile(ProfileCommand),
}

/// What to do with profiles.
#[derive(Debug, Subcommand)]
pub enum ProfileCommand {
    /// List the profiles that come with the program
    List,
    /// Show a profile: geometry, limits, targets, what will be identified
    Show {
        /// Name of a shipped profile, or path of a profile file
        profile: String,
    },
    /// Check a profile file and show every problem with its place
    Check {
        /// Path of the profile file
        file: PathBuf,
    },
}

/// How to identify; shared by all commands that do.
#[derive(Args, Clone, Debug)]
pub struct EstimationArgs {
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Rows to identify from, such as 'pose % 17 == 0' or "position != 'left'"
    #[arg(long = "use", value_name = "CONDITION")]
    pub filter: Option<String>,
    /// How samples are trusted
    #[arg(long, value_enum, default_value_t)]
    pub estimator: EstimatorArg,
    /// What is assumed about deviations: those the profile expects, or nothing (the paper's minimum-norm solution)
    #[arg(long, value_enum, default_value_t)]
    pub prior: PriorArg,
    /// What is identified: joint offsets only, or all geometric parameters
    #[arg(long, value_enum, default_value_t)]
    pub level: LevelArg,
    /// Largest number of solver steps; 1 is the paper's single linear step
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=100_000))]
    pub iterations: usize,
    /// Standard deviation of a measured coordinate [default: of the readings, else of the profile's instrument, else estimated]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sigma_mm: Option<f64>,
    /// Expected deviation of every length and every angle instead of the profile's, such as '1mm,0.1deg'
    #[arg(long, value_name = "LENGTH,ANGLE")]
    pub expected_deviation: Option<ExpectedDeviation>,
    /// Folder for the results (calibration.ron, report.json); made if it is missing
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `identify`.
#[derive(Args, Debug)]
pub struct IdentifyArgs {
    /// How to identify.
    #[command(flatten)]
    pub estimation: EstimationArgs,
    /// Measured points: CSV with units in the column names
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Layout of the tables
    #[arg(long, value_parser = Layout::from_str, default_value = "named", value_name = "named|robodk|delmia")]
    pub layout: Layout,
    /// Verify on the points of another file measured in the same set-up
    #[arg(long, value_name = "CSV", conflicts_with = "verify_rest")]
    pub verify: Option<PathBuf>,
    /// Verify on the rows that '--use' leaves out
    #[arg(long, requires = "filter")]
    pub verify_rest: bool,
    /// Weighting of the distances: with their true covariance, or all pairs alike as in the paper
    #[arg(long, value_enum, default_value_t)]
    pub weighting: WeightingArg,
}

/// Arguments of `verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// Calibration to verify (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Measured points: CSV with units in the column names
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Layout of the table
    #[arg(long, value_parser = Layout::from_str, default_value = "named", value_name = "named|robodk|delmia")]
    pub layout: Layout,
    /// Rows to verify on, such as 'pose < 20'
    #[arg(long = "use", value_name = "CONDITION")]
    pub filter: Option<String>,
    /// What to fit to these points because the set-up changed: nothing, the tracker's place, or also the SMR's mounting
    #[arg(long, value_enum, default_value_t)]
    pub refit: RefitArg,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `constraints`.
#[derive(Args, Debug)]
pub struct ConstraintsArgs {
    /// How to identify.
    #[command(flatten)]
    pub estimation: EstimationArgs,
    /// Shared points (position, socket, joints) or lengths (from_q1_deg …, to_q1_deg …, length_mm): CSV with units
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Known distance between the two sockets of one position
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub socket_distance_mm: Option<f64>,
    /// Standard deviation of that distance
    #[arg(long, value_name = "MM", default_value_t = 0.05, value_parser = positive)]
    pub socket_distance_sigma_mm: f64,
    /// Verify on the rows that '--use' leaves out
    #[arg(long, requires = "filter", conflicts_with = "leave_one_out")]
    pub verify_rest: bool,
    /// Verify by leaving out each value of this column in turn, such as 'position'
    #[arg(long, value_name = "COLUMN", value_parser = ["position"])]
    pub leave_one_out: Option<String>,
}

/// `--estimator`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EstimatorArg {
    /// Find outliers, name them and leave them out
    #[default]
    Robust,
    /// Every sample counts
    LeastSquares,
}

/// `--prior`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum PriorArg {
    /// Deviations as the profile expects them
    #[default]
    Expected,
    /// Nothing; badly determined parameters may run away
    None,
}

/// `--level`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LevelArg {
    /// Level 1: joint offsets
    Offsets,
    /// Level 2: all link constants
    #[default]
    Geometric,
}

/// `--weighting`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum WeightingArg {
    /// With the covariance that distances really have
    #[default]
    Covariance,
    /// All pairs alike, as in the paper
    Uniform,
}

/// `--refit`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RefitArg {
    /// Same tracker position and SMR mounting as at the identification
    #[default]
    None,
    /// The tracker was moved
    Frame,
    /// The tracker was moved and the SMR mounted anew
    #[value(name = "frame+target")]
    FrameAndTarget,
}

/// Expected deviation of all lengths (m) and all angles (rad).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedDeviation {
    /// Of every length (m).
    pub length: f64,
    /// Of every angle (rad).
    pub angle: f64,
}

impl FromStr for ExpectedDeviation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        const LENGTHS: [(&str, f64); 3] = [("mm", MILLIMETRE), ("um", MICROMETRE), ("m", 1.0)];
        const ANGLES: [(&str, f64); 3] = [("deg", DEGREE), ("mrad", MILLIRADIAN), ("rad", 1.0)];
        let expected =
            || format!("'{text}' is not a length and an angle; write for example '1mm,0.1deg' (mm, um; deg, mrad)");
        let quantity = |text: &str, units: &[(&str, f64)]| {
            units.iter().find_map(|(unit, size)| {
                let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
                (number.is_finite() && number > 0.0).then_some(number * size)
            })
        };
        let (length, angle) = text.split_once(',').ok_or_else(expected)?;
        match (quantity(length, &LENGTHS), quantity(angle, &ANGLES)) {
            (Some(length), Some(angle)) => Ok(Self { length, angle }),
            _ => Err(expected()),
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("'{text}' is not a positive number")),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn expected_deviations_have_units() {
        let parsed: ExpectedDeviation = "1mm,0.1deg".parse().unwrap();
        assert_eq!(parsed, ExpectedDeviation { length: MILLIMETRE, angle: 0.1 * DEGREE });
        let parsed: ExpectedDeviation = "500 um, 5mrad".parse().unwrap();
        assert_eq!(parsed, ExpectedDeviation { length: 500.0 * MICROMETRE, angle: 5.0 * MILLIRADIAN });
        for wrong in ["1,0.1", "1mm", "1deg,1mm", "-1mm,1deg", "nanmm,1deg", "1mm,0deg"] {
            assert!(wrong.parse::<ExpectedDeviation>().is_err(), "{wrong}");
        }
    }
}
