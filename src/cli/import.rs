//! Arguments of `import`.

use std::path::PathBuf;

use clap::Args;

use super::{one_of, positive};
use crate::session::measurements::{Columns, JoinBy, Units};

/// Arguments of `import`.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// Tables with joint values and points: text with any separator, or .xlsx; several are put one behind the other
    #[arg(value_name = "FILE", required_unless_present = "joints", conflicts_with = "joints")]
    pub files: Vec<PathBuf>,
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Table with the joint values alone
    #[arg(long, value_name = "FILE", requires = "points")]
    pub joints: Option<PathBuf>,
    /// Table with the points alone, for a target of the profile; may be repeated
    #[arg(long, value_name = "[TARGET=]FILE", requires = "joints")]
    pub points: Vec<String>,
    /// What makes rows of the two tables belong together [default: the name of the pose, if both have it, else the number of the row]
    #[arg(long, value_parser = one_of::<JoinBy>(JoinBy::NAMES), ignore_case = true, requires = "joints")]
    pub join: Option<JoinBy>,
    /// Which column is which: 'q1_deg=A1, x_mm=X, …', with '#3' for the third; or the names of all columns in order, '-' to leave one out
    #[arg(long, value_name = "COLUMNS")]
    pub columns: Option<Columns>,
    /// The same for the tables of '--points' [default: that of '--columns']
    #[arg(long, value_name = "COLUMNS", requires = "points")]
    pub point_columns: Option<Columns>,
    /// Units of columns whose names state none, such as 'deg,mm'
    #[arg(long, value_name = "ANGLE,LENGTH")]
    pub units: Option<Units>,
    /// Layout of the tables: 'named', 'robodk', 'delmia', or a saved one
    #[arg(long, value_name = "NAME", default_value = "named")]
    pub layout: String,
    /// Save columns and units as a layout of this name, beside the profile
    #[arg(long, value_name = "NAME")]
    pub save_layout: Option<String>,
    /// Leave out readings without a point (empty, 0 0 0) instead of refusing the table
    #[arg(long)]
    pub skip_missing: bool,
    /// Error of measured orientations about each axis (standard deviation, degree), where the table has no column sigma_rot_deg; uses the orientation beside the point
    #[arg(long, value_name = "DEG", value_parser = positive)]
    pub sigma_rot_deg: Option<f64>,
    /// Error of each coordinate (standard deviation, mm) for rows with an orientation, where the table has no column sigma_mm
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sigma_mm: Option<f64>,
    /// Sheet of an .xlsx [default: the only one that has cells]
    #[arg(long, value_name = "NAME")]
    pub sheet: Option<String>,
    /// Show every row as it was read
    #[arg(long)]
    pub rows: bool,
    /// File for the table as 'identify' and the wizard read it [default: only show what was understood]
    #[arg(long, value_name = "CSV")]
    pub out: Option<PathBuf>,
    /// File for the profile whose targets are the points that stand for measured orientations, for the wizard
    #[arg(long, value_name = "RON")]
    pub out_profile: Option<PathBuf>,
}
