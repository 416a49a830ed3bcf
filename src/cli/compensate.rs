//! Arguments of the commands that apply a calibration: `compensate`, `export`, and `profile import-urdf`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{PayloadArgs, one_of};
use crate::correction::settings::NamedPose;
use crate::kinematics::Convention;
use crate::model::{Coupling, Format};
use crate::program::Dialect;

/// Arguments of `compensate`.
#[derive(Args, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub struct CompensateArgs {
    /// Calibration to apply (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Use it although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
    /// Targets: joint values, or positions with an orientation; CSV with units in the column names
    #[arg(long, value_name = "CSV", required_unless_present_any = ["program", "stream"], conflicts_with_all = ["program", "stream"])]
    pub targets: Option<PathBuf>,
    /// Robot program whose motion targets are corrected, everything else in it is kept; several that belong together are corrected in one call
    #[arg(long, value_name = "FILE", requires = "dialect")]
    pub program: Vec<PathBuf>,
    /// Language of the program
    #[arg(long, value_parser = one_of::<Dialect>(Dialect::NAMES), ignore_case = true)]
    pub dialect: Option<Dialect>,
    /// Program: whether its points were computed (offline programming, CAD) or taught on the robot; taught points are not corrected
    #[arg(long, value_enum, requires = "program")]
    pub points: Option<Points>,
    /// Tool of Cartesian targets in the flange, mm and degrees about the fixed x, y, z; without a name for all that the program does not state
    #[arg(long, value_name = "[NAME=]X,Y,Z,RX,RY,RZ", requires = "program", allow_hyphen_values = true)]
    pub tool: Vec<NamedPose>,
    /// Frame of Cartesian targets in the world of the controller, written as '--tool'
    #[arg(long, value_name = "[NAME=]X,Y,Z,RX,RY,RZ", requires = "program", allow_hyphen_values = true)]
    pub frame: Vec<NamedPose>,
    /// File that belongs to the program and is only read: declarations, or the moves that use them
    #[arg(long, value_name = "FILE", requires = "program")]
    pub companion: Vec<PathBuf>,
    /// Write the program even if corrected and uncorrected moves belong to one path
    #[arg(long, requires = "program")]
    pub partial: bool,
    /// Put points into linear moves until their path deviates by no more than this (RAPID, KRL and URScript)
    #[arg(long, value_name = "MM", requires = "program", value_parser = positive)]
    pub insert: Option<f64>,
    /// External axes carry neither the arm nor the workpiece: correct targets that state their positions
    #[arg(long, requires = "program")]
    pub ignore_external_axes: bool,
    /// ROS: names of the joints in the trajectory, from base to flange [default: those of the profile]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub joint_names: Vec<String>,
    /// File for the table of commands, or the program [default: print it]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Answer targets one by one: JSON lines on the standard input, one answer per line on the standard output
    #[arg(long, conflicts_with_all = ["program", "out", "json"])]
    pub stream: bool,
    /// Largest predicted error of the identified arm at which a target is still corrected
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = positive)]
    pub largest_uncertainty_mm: f64,
    /// Write a picture of the targets, nominal and corrected, for the Rerun viewer
    #[arg(long, value_name = "RRD", conflicts_with = "stream")]
    pub record: Option<PathBuf>,
    /// Print what happened to each target as JSON instead of a table
    #[arg(long)]
    pub json: bool,
    /// Reach the position only and ignore the orientation
    #[arg(long)]
    pub position_only: bool,
    /// What the flange carries when these commands run.
    #[command(flatten)]
    pub payload: PayloadArgs,
    /// Point to bring to the targets: a target (SMR) of the profile [default: the flange]
    #[arg(long, value_name = "NAME")]
    pub target: Option<String>,
}

/// Where the points of a program come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Points {
    /// By an offline programming system, from CAD or by calculation
    Computed,
    /// On the robot, with its pendant or by hand
    Taught,
}

/// Arguments of `export`.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// Calibration to export (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Use it although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
    /// Format of the model
    #[arg(long, value_enum)]
    pub format: Format,
    /// URDF to write the geometry into; only the origins of its chain change
    #[arg(long, value_name = "URDF")]
    pub into: Option<PathBuf>,
    /// Link of that URDF at the base of the profile
    #[arg(long, value_name = "LINK", default_value = "base_link", requires = "into")]
    pub base: String,
    /// Link of that URDF at the end of the arm
    #[arg(long, value_name = "LINK", default_value = "tool0", requires = "into")]
    pub tip: String,
    /// UR kinematics: let the tool carry what the file cannot express about the flange
    #[arg(long)]
    pub with_tool_offset: bool,
    /// File to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Arguments of `profile import-urdf`.
#[derive(Args, Debug)]
pub struct ImportUrdfArgs {
    /// The robot description (xacro expanded)
    pub file: PathBuf,
    /// Link that is the robot base
    #[arg(long, value_name = "LINK")]
    pub base: String,
    /// Link that is the flange
    #[arg(long, value_name = "LINK")]
    pub tip: String,
    /// Order of the link constants
    #[arg(long, value_enum, default_value_t)]
    pub convention: Convention,
    /// A joint that the pendant counts together with another (FANUC J3, parallel linkages), such as 'joint_3=joint_2' or 'joint_3=-joint_2'; may be repeated
    #[arg(long = "coupling", value_name = "JOINT=JOINT")]
    pub couplings: Vec<Coupling>,
    /// File for the profile [default: print it]
    #[arg(long, value_name = "RON")]
    pub out: Option<PathBuf>,
}

/// Arguments of `profile import-ur`.
#[derive(Args, Debug)]
pub struct ImportUrArgs {
    /// 'calibration.conf' of the controller, or the kinematics file of the ROS description
    pub file: PathBuf,
    /// Profile of the model, such as 'ur10e'
    #[arg(long, value_name = "NAME|FILE")]
    pub model: String,
    /// File for the profile [default: print it]
    #[arg(long, value_name = "RON")]
    pub out: Option<PathBuf>,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("'{text}' is not a positive number")),
    }
}
