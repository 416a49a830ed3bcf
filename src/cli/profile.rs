//! Arguments of `profile new`.

use std::path::PathBuf;

use clap::Args;

use super::positive;
use crate::profile::datasheet::{Dimension, Maker};

pub(super) const NEW_EXAMPLES: &str = "\
Examples:
  trupose profile new --from abb_irb120 --out my-robot.ron
  trupose profile new --data-sheet abb --name \"My arm\" --base 445 --shoulder 150 --upper-arm 700 \\
      --elbow 115 --forearm 795 --flange 85 --limits '180, -95..155, -180..75, 180, 120, 180' \\
      --pendant 1030,0,1260 --out my-robot.ron
  trupose profile new --circles circles.csv --compare my-robot.ron --out measured.ron";

/// Arguments of `profile new`.
#[derive(Args, Clone, Debug)]
#[group(id = "source", required = true, multiple = false, args = ["from", "data_sheet", "circles"])]
pub struct NewProfileArgs {
    /// Profile to copy: the name of a shipped one ('trupose profile list'), or a file
    #[arg(long, value_name = "NAME|FILE")]
    pub from: Option<String>,
    /// Six axes from the dimensions below, with the zero position and the senses of rotation of this maker; what is missing is asked for
    #[arg(long, value_enum, value_name = "MAKER")]
    pub data_sheet: Option<Maker>,
    /// Measured: joint values and SMR positions while each joint was moved in turn; CSV with units in the column names
    #[arg(long, value_name = "CSV")]
    pub circles: Option<PathBuf>,
    /// The seven dimensions of the data sheet.
    #[command(flatten)]
    pub dimensions: DimensionArgs,
    /// Lowest and highest value of each joint in degrees, such as '165, -110..110, -110..70, 160, 120, 400' (mm for joints that slide)
    #[arg(long, value_name = "RANGES", allow_hyphen_values = true)]
    pub limits: Option<String>,
    /// What the pendant shows for the flange at all zeros, to be compared with the data sheet
    #[arg(long, value_name = "X,Y,Z", requires = "data_sheet", value_parser = place, allow_hyphen_values = true)]
    pub pendant: Option<Place>,
    /// Profile to compare the measured constants with; everything that is not measured is taken from it
    #[arg(long, value_name = "NAME|FILE", requires = "circles")]
    pub compare: Option<String>,
    /// Standard deviation of a measured coordinate [default: of the residuals]
    #[arg(long, value_name = "MM", value_parser = positive, requires = "circles")]
    pub sigma_mm: Option<f64>,
    /// Name of the arm
    #[arg(long, value_name = "NAME", conflicts_with = "from")]
    pub name: Option<String>,
    /// New file [default: print the text]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// A place that the pendant shows (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub [f64; 3]);

fn place(text: &str) -> Result<Place, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    let place = <[f64; 3]>::try_from(numbers).ok().filter(|place| place.iter().all(|value| value.is_finite()));
    place.map(Place).ok_or_else(|| format!("'{text}' is no place: write three numbers such as 374,0,630"))
}

/// Dimensions of a data sheet (mm).
#[derive(Args, Clone, Debug)]
pub struct DimensionArgs {
    /// Mounting face to axis 2, upwards
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    base: Option<f64>,
    /// Axis 1 to axis 2, forwards
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    shoulder: Option<f64>,
    /// Axis 2 to axis 3
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    upper_arm: Option<f64>,
    /// Axis 3 to axis 4, across the forearm
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    elbow: Option<f64>,
    /// Axis 3 to the middle of the wrist, along the forearm
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    forearm: Option<f64>,
    /// Middle of the wrist to the face of the flange
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    flange: Option<f64>,
    /// Axis 1 to the forearm, sideways [default: 0]
    #[arg(long, value_name = "MM", requires = "data_sheet", allow_hyphen_values = true)]
    side: Option<f64>,
}

impl DimensionArgs {
    /// The value given for a dimension.
    pub const fn value(&self, dimension: Dimension) -> Option<f64> {
        match dimension {
            Dimension::Base => self.base,
            Dimension::Shoulder => self.shoulder,
            Dimension::UpperArm => self.upper_arm,
            Dimension::Elbow => self.elbow,
            Dimension::Forearm => self.forearm,
            Dimension::Flange => self.flange,
            Dimension::Side => self.side,
        }
    }
}
