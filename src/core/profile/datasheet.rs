//! A profile from the dimensions of a data sheet: six axes with a wrist whose axes meet, as most industrial arms have.
//!
//! The makers draw the same seven dimensions but count joints from different positions and in different senses. Where the flange is
//! at all zeros tells whether both were read correctly: the pendant shows the same numbers.

use std::fmt::Write as _;
use std::str::FromStr;

use clap::ValueEnum;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{JointRange, Profile, ProfileErrors};
use crate::kinematics::{ForwardKinematics, JointType};
use crate::text::{names_of_option, printable, written_as_text};
use crate::units::to_mm;

/// Number of joints.
const JOINTS: usize = 6;
/// Longest dimension and longest name that are taken for one.
const LONGEST_MM: f64 = 10_000.0;
const LONGEST_NAME: usize = 60;
/// The pendant rounds: nearer positions agree (mm).
const AGREES_MM: f64 = 1.0;

/// Whose zero position and senses of rotation an arm has. The comments on the values are the help of the options.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Maker {
    /// Zero: upper arm up, forearm forward; all joints count the same way
    #[default]
    Abb,
    /// Zero: upper arm up, forearm forward; J3 is the slope of the forearm, J3 to J6 count the other way
    Fanuc,
    /// Zero: the arm stretched forward; A1, A4 and A6 count the other way
    Kuka,
    /// Zero: the arm straight up
    Staubli,
}

names_of_option!(Maker);
written_as_text!(Maker);

impl Maker {
    /// All makers.
    pub const ALL: [Self; 4] = [Self::Abb, Self::Fanuc, Self::Kuka, Self::Staubli];

    /// Whether the controller counts z from axis 2 instead of the mounting face.
    const fn counts_from_axis_2(self) -> bool {
        match self {
            Self::Fanuc | Self::Staubli => true,
            Self::Abb | Self::Kuka => false,
        }
    }

    /// Letter before the number of a joint.
    const fn letter(self) -> char {
        match self {
            Self::Kuka => 'A',
            Self::Abb | Self::Fanuc | Self::Staubli => 'J',
        }
    }

    /// α, θ (degree) and sense of each joint, as in the shipped profiles.
    const fn joints(self) -> [(f64, f64, i8); JOINTS] {
        match self {
            Self::Abb => {
                [(-90.0, 0.0, 1), (0.0, -90.0, 1), (-90.0, 0.0, 1), (90.0, 0.0, 1), (-90.0, 0.0, 1), (0.0, 180.0, 1)]
            }
            Self::Fanuc => {
                [(-90.0, 0.0, 1), (0.0, -90.0, 1), (-90.0, 0.0, -1), (90.0, 0.0, -1), (-90.0, 0.0, -1), (0.0, 0.0, -1)]
            }
            Self::Kuka => {
                [(-90.0, 0.0, -1), (0.0, 0.0, 1), (-90.0, -90.0, 1), (90.0, 0.0, -1), (-90.0, 0.0, 1), (0.0, 180.0, -1)]
            }
            Self::Staubli => {
                [(-90.0, 0.0, 1), (0.0, -90.0, 1), (90.0, 90.0, 1), (-90.0, 0.0, 1), (90.0, 0.0, 1), (0.0, 0.0, 1)]
            }
        }
    }
}

/// A dimension of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dimension {
    Base,
    Shoulder,
    UpperArm,
    Elbow,
    Forearm,
    Flange,
    Side,
}

impl Dimension {
    /// All seven, from the base to the flange.
    pub const ALL: [Self; 7] =
        [Self::Base, Self::Shoulder, Self::UpperArm, Self::Elbow, Self::Forearm, Self::Flange, Self::Side];

    /// Its name in forms and questions.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Base => "base height",
            Self::Shoulder => "shoulder offset",
            Self::UpperArm => "upper arm",
            Self::Elbow => "elbow offset",
            Self::Forearm => "forearm",
            Self::Flange => "flange",
            Self::Side => "side offset",
        }
    }

    /// Where it is on the drawing.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Base => "mounting face to axis 2, upwards",
            Self::Shoulder => "axis 1 to axis 2, forwards",
            Self::UpperArm => "axis 2 to axis 3",
            Self::Elbow => {
                "axis 3 to axis 4, across the forearm: above axis 3 while the forearm points forwards is positive"
            }
            Self::Forearm => "axis 3 to the middle of the wrist, along the forearm",
            Self::Flange => "middle of the wrist to the face of the flange",
            Self::Side => "axis 1 to the forearm, sideways; 0 for most arms",
        }
    }
}

/// What a data sheet says. Lengths in mm, angles in degrees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Datasheet {
    /// Name of the arm.
    pub name: String,
    pub maker: Maker,
    /// In the order of [`Dimension::ALL`] (mm).
    pub dimensions_mm: [f64; 7],
    /// Lowest and highest pendant value of each joint (degree).
    pub limits_deg: Limits,
}

/// Half a turn to each side.
impl Default for Limits {
    fn default() -> Self {
        Self([(-180.0, 180.0); JOINTS])
    }
}

/// Limits of six joints (degree), written `165, -110..110, …`: a single number is meant to both sides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits(pub [(f64, f64); JOINTS]);

/// Why a data sheet makes no profile.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DatasheetError {
    /// A dimension that no arm has.
    #[error("the {} of {value} mm is not between -{LONGEST_MM} and {LONGEST_MM} mm", dimension.label())]
    Dimension { dimension: Dimension, value: f64 },
    /// Parts without a length.
    #[error("{} and {} cannot both be 0", Dimension::UpperArm.label(), Dimension::Forearm.label())]
    NoLength,
    /// Not six ranges.
    #[error("{given} limits; six are needed, such as '165, -110..110, -110..70, 160, 120, 400'")]
    Count { given: usize },
    /// A range that is none.
    #[error("'{text}' is no limit: write 165 for -165 to 165, or -110..70")]
    Limit { text: String },
    /// Empty or endless.
    #[error("the name has 1 to {LONGEST_NAME} characters")]
    Name,
    /// The written profile cannot be read.
    #[error("{0}")]
    Profile(String),
}

impl FromStr for Limits {
    type Err = DatasheetError;

    fn from_str(text: &str) -> Result<Self, DatasheetError> {
        let ranges = ranges(text)?;
        let given = ranges.len();
        <[(f64, f64); JOINTS]>::try_from(ranges).map(Self).ok().ok_or(DatasheetError::Count { given })
    }
}

/// Ranges in a text, whatever separates them.
fn ranges(text: &str) -> Result<Vec<(f64, f64)>, DatasheetError> {
    text.split([',', ';', ' ']).map(str::trim).filter(|word| !word.is_empty()).map(range).collect()
}

impl JointRange {
    /// Limits of all joints from a text as for [`Limits`], in degrees, of sliding joints in mm: in (rad) and (m).
    ///
    /// # Errors
    /// Not one range per joint.
    pub fn limits_from_text(text: &str, types: &[JointType]) -> Result<Vec<(f64, f64)>, String> {
        let ranges = ranges(text).map_err(|error| error.to_string())?;
        if ranges.len() != types.len() {
            return Err(format!("{} limits for {} joints", ranges.len(), types.len()));
        }
        let inside = |((low, high), joint_type): ((f64, f64), &JointType)| {
            let quantity = joint_type.quantity();
            (quantity.from_edge(low), quantity.from_edge(high))
        };
        Ok(ranges.into_iter().zip(types).map(inside).collect())
    }
}

impl std::fmt::Display for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ranges = self.0.map(|(low, high)| format!("{low}..{high}"));
        f.write_str(&ranges.join(", "))
    }
}

/// A range of a joint (degree).
fn range(text: &str) -> Result<(f64, f64), DatasheetError> {
    let wrong = || DatasheetError::Limit { text: printable(text) };
    let number = |text: &str| text.trim_start_matches(['±', '+']).parse::<f64>().ok().ok_or_else(wrong);
    let (low, high) = match text.split_once("..").or_else(|| text.split_once('/')) {
        Some((low, high)) => (number(low)?, number(high)?),
        None => number(text).map(|both| (-both, both))?,
    };
    if low < high && low >= -3600.0 && high <= 3600.0 { Ok((low, high)) } else { Err(wrong()) }
}

impl Datasheet {
    /// A dimension (mm).
    pub fn dimension(&self, dimension: Dimension) -> f64 {
        let place = Dimension::ALL.iter().position(|one| *one == dimension);
        place.and_then(|place| self.dimensions_mm.get(place)).copied().unwrap_or_default()
    }

    fn with(&self, dimension: Dimension, value: f64) -> Self {
        let mut changed = self.clone();
        for (one, place) in Dimension::ALL.iter().zip(&mut changed.dimensions_mm) {
            if *one == dimension {
                *place = value;
            }
        }
        changed
    }

    /// The text of the profile and what it says.
    ///
    /// # Errors
    /// A dimension or a name that cannot be meant.
    pub fn profile(&self) -> Result<(String, Profile), DatasheetError> {
        let name = self.name.trim();
        if name.is_empty() || name.chars().count() > LONGEST_NAME {
            return Err(DatasheetError::Name);
        }
        for (dimension, value) in Dimension::ALL.into_iter().zip(self.dimensions_mm) {
            if !(-LONGEST_MM..=LONGEST_MM).contains(&value) {
                return Err(DatasheetError::Dimension { dimension, value });
            }
        }
        let length = |dimension| self.dimension(dimension).abs();
        if length(Dimension::UpperArm) <= 0.0 && length(Dimension::Forearm) <= 0.0 {
            return Err(DatasheetError::NoLength);
        }
        let text = self.text();
        let unread = |errors: ProfileErrors| DatasheetError::Profile(errors.to_string());
        let (profile, _) = Profile::parse(&text, name).map_err(unread)?;
        Ok((text, profile))
    }

    fn text(&self) -> String {
        let quoted = |text: &str| {
            let clean = printable(text).replace(['"', '\\'], "'");
            format!("\"{}\"", clean.trim())
        };
        let short: String = self.name.trim().to_lowercase().chars().map(allowed).collect();
        let dimensions: Vec<String> = Dimension::ALL
            .into_iter()
            .map(|dimension| format!("{} {} mm", dimension.label(), self.dimension(dimension)))
            .collect();
        let mut text = format!(
            "// From the dimensions of a data sheet, with the zero position and the senses of rotation of {}.\n(\n    schema: 1,\n    name: {},\n    title: {},\n    source: {},\n    convention: Standard,\n",
            self.maker,
            quoted(&short),
            quoted(&self.name),
            quoted(&format!("data sheet: {}", dimensions.join(", ")))
        );
        if self.maker.counts_from_axis_2() {
            let height = self.dimension(Dimension::Base);
            _ = writeln!(
                text,
                "    // The controller counts z from axis 2.\n    controller_world: (xyz_mm: (0.0, 0.0, {height:?})),"
            );
        }
        text.push_str("    joints: [\n");
        let letter = self.maker.letter();
        let rows = self.maker.joints().into_iter().zip(self.limits_deg.0).enumerate();
        for (index, ((alpha, theta, sense), (low, high))) in rows {
            let (a, d) = self.lengths(index);
            _ = write!(
                text,
                "        (name: \"{letter}{}\", type: Revolute, alpha_deg: {alpha:?}, a_mm: {a:?}, d_mm: {d:?}, theta_deg: {theta:?}",
                index + 1
            );
            if index == 1 {
                text.push_str(", beta_deg: 0.0");
            }
            if sense < 0 {
                text.push_str(", direction: -1");
            }
            if index == 2 && self.maker == Maker::Fanuc {
                text.push_str(", coupling: {\"J2\": 1}");
            }
            _ = writeln!(text, ",\n            limits_deg: ({low:?}, {high:?})),");
        }
        text.push_str(
            "    ],\n    // Where the SMR is to sit, roughly: beside the last axis.\n    targets: [\n        (name: \"smr\", position_mm: (40.0, 0.0, 40.0)),\n    ],\n    floor_mm: 0.0,\n)\n",
        );
        text
    }

    /// a and d of a joint (mm).
    fn lengths(&self, joint: usize) -> (f64, f64) {
        let of = |dimension| self.dimension(dimension);
        match joint {
            0 => (of(Dimension::Shoulder), of(Dimension::Base)),
            1 => (of(Dimension::UpperArm), of(Dimension::Side)),
            2 => (of(Dimension::Elbow), 0.0),
            3 => (0.0, of(Dimension::Forearm)),
            5 => (0.0, of(Dimension::Flange)),
            _ => (0.0, 0.0),
        }
    }

    /// Where the flange is at all zeros, as the pendant gives it (mm).
    ///
    /// # Errors
    /// As [`Self::profile`].
    pub fn flange_at_zero(&self) -> Result<[f64; 3], DatasheetError> {
        self.profile().map(|(_, profile)| profile.flange_at_zero())
    }

    /// Whether the pendant shows the same, and what would explain it if not.
    ///
    /// # Errors
    /// As [`Self::profile`].
    pub fn compared(&self, pendant_mm: [f64; 3]) -> Result<Agreement, DatasheetError> {
        let here = self.flange_at_zero()?;
        if distance(here, pendant_mm) < AGREES_MM {
            return Ok(Agreement::Agrees);
        }
        let mut causes = Vec::new();
        for maker in Maker::ALL.into_iter().filter(|maker| *maker != self.maker) {
            if distance(Self { maker, ..self.clone() }.flange_at_zero()?, pendant_mm) < AGREES_MM {
                causes.push(Cause::Zero(maker));
            }
        }
        let base = self.dimension(Dimension::Base);
        let [x, y, z] = here;
        let other = if self.maker.counts_from_axis_2() { z + base } else { z - base };
        if base != 0.0 && distance([x, y, other], pendant_mm) < AGREES_MM {
            causes.push(Cause::World);
        }
        for dimension in Dimension::ALL {
            let value = self.dimension(dimension);
            // The place depends linearly on each dimension.
            let moved = self.with(dimension, value + 1.0).flange_at_zero()?;
            let per_mm: Vec<f64> = moved.iter().zip(here).map(|(moved, here)| moved - here).collect();
            let square: f64 = per_mm.iter().map(|part| part * part).sum();
            let along: f64 =
                per_mm.iter().zip(pendant_mm).zip(here).map(|((part, there), here)| part * (there - here)).sum();
            if square < 1e-9 {
                continue;
            }
            let other = value + along / square;
            if distance(self.with(dimension, other).flange_at_zero()?, pendant_mm) < AGREES_MM {
                causes.push(Cause::Dimension(dimension, (other * 10.0).round() / 10.0));
            }
        }
        Ok(Agreement::Differs { by_mm: distance(here, pendant_mm), causes })
    }
}

/// Whether a data sheet and a pendant say the same.
#[derive(Clone, Debug, PartialEq)]
pub enum Agreement {
    Agrees,
    /// They do not; what alone would explain it.
    Differs {
        by_mm: f64,
        causes: Vec<Cause>,
    },
}

/// What alone would explain a difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The zero position of another maker.
    Zero(Maker),
    /// The controller counts z from the other place: mounting face or axis 2.
    World,
    /// Another value of a dimension (mm).
    Dimension(Dimension, f64),
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Zero(maker) => write!(f, "the zero position of {maker}"),
            Self::World => f.write_str("a pendant that counts z from the other place: mounting face or axis 2"),
            Self::Dimension(dimension, value) => write!(f, "a {} of {value} mm", dimension.label()),
        }
    }
}

fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// A character that the short name of a profile may have.
const fn allowed(character: char) -> char {
    if character.is_ascii_lowercase() || character.is_ascii_digit() || matches!(character, '_' | '-') {
        character
    } else {
        '_'
    }
}

impl Profile {
    /// Where the flange is at all zeros, in the frame in which the controller gives positions (mm).
    pub fn flange_at_zero(&self) -> [f64; 3] {
        let zeros = vec![0.0; self.chain().dof()];
        let flange = ForwardKinematics::new(self.chain()).base_from_flange(&zeros);
        let point = self.base_from_world().inverse() * (flange * Point3::origin());
        // Rounded to the nanometre: -0.0 and the last bits of the sines are no news.
        [point.x, point.y, point.z].map(|value| (to_mm(value) * 1e6).round() / 1e6 + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::builtin;

    fn sheet(maker: Maker, dimensions_mm: [f64; 7]) -> Datasheet {
        Datasheet {
            name: "My Arm 7".to_owned(),
            maker,
            dimensions_mm,
            limits_deg: "165, -110..110, -110/70, ±160; 120 400".parse().unwrap(),
        }
    }

    /// The shipped arms with their seven dimensions.
    const SHIPPED: [(&str, Maker, [f64; 7]); 4] = [
        ("abb_irb120", Maker::Abb, [290.0, 0.0, 270.0, 70.0, 302.0, 72.0, 0.0]),
        ("fanuc_lrmate200id", Maker::Fanuc, [330.0, 50.0, 330.0, 35.0, 335.0, 80.0, 0.0]),
        ("kuka_kr6_r900", Maker::Kuka, [400.0, 25.0, 455.0, 35.0, 420.0, 80.0, 0.0]),
        ("staubli_tx2_60", Maker::Staubli, [375.0, 0.0, 290.0, 0.0, 310.0, 70.0, 20.0]),
    ];

    #[test]
    fn seven_dimensions_make_the_shipped_arms() {
        for (name, maker, dimensions) in SHIPPED {
            let (text, made) = sheet(maker, dimensions).profile().unwrap();
            let (shipped, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
            let made_kinematics = ForwardKinematics::new(made.chain());
            let kinematics = ForwardKinematics::new(shipped.chain());
            for q in [[0.0; 6], [0.3, -0.4, 0.5, 0.7, -0.9, 1.1], [-1.0, 0.8, -0.6, 2.0, 1.2, -3.0]] {
                let of_made = made.base_from_world().inverse() * made_kinematics.base_from_flange(&q);
                let of_shipped = shipped.base_from_world().inverse() * kinematics.base_from_flange(&q);
                let apart = (of_made.translation.vector - of_shipped.translation.vector).norm();
                assert!(apart < 1e-9, "{name} {apart}\n{text}");
                assert!(of_made.rotation.angle_to(&of_shipped.rotation) < 1e-9, "{name}");
            }
            assert_eq!(made.name(), "my_arm_7");
            assert_eq!(made.beta_joints(), [1]);
        }
    }

    #[test]
    fn the_flange_at_zero_is_what_the_pendant_shows() {
        let places = SHIPPED.map(|(_, maker, dimensions)| sheet(maker, dimensions).flange_at_zero());
        let shown = [[374.0, 0.0, 630.0], [465.0, 0.0, 365.0], [980.0, 0.0, 435.0], [0.0, 20.0, 670.0]];
        assert_eq!(places, shown.map(Ok));
    }

    #[test]
    fn what_would_explain_another_pendant_is_named() {
        let abb = sheet(Maker::Abb, SHIPPED[0].2);
        let causes = |pendant| match abb.compared(pendant).unwrap() {
            Agreement::Agrees => Vec::new(),
            Agreement::Differs { causes, .. } => causes.iter().map(ToString::to_string).collect(),
        };
        assert!(causes([374.3, 0.0, 629.8]).is_empty());
        assert_eq!(causes([644.0, 0.0, 360.0]), ["the zero position of kuka"]);
        assert!(
            causes([374.0, 0.0, 340.0])
                .contains(&"a pendant that counts z from the other place: mounting face or axis 2".to_owned())
        );
        assert_eq!(
            causes([412.0, 0.0, 630.0]),
            ["a shoulder offset of 38 mm", "a forearm of 340 mm", "a flange of 110 mm"]
        );
        assert!(
            matches!(abb.compared([1.0, 2.0, 3.0]).unwrap(), Agreement::Differs { causes, .. } if causes.is_empty())
        );
    }

    #[test]
    fn limits_are_read_in_the_ways_they_are_written() {
        let limits: Limits = "165, -110..110, -110/70, ±160; 120 400".parse().unwrap();
        assert_eq!(limits.0[1..4], [(-110.0, 110.0), (-110.0, 70.0), (-160.0, 160.0)]);
        assert_eq!(limits.to_string().parse::<Limits>(), Ok(limits));
        for wrong in ["", "165", "1 2 3 4 5 x", "1 2 3 4 5 9..3", "1 2 3 4 5 6 7", "1 2 3 4 5 0"] {
            assert!(wrong.parse::<Limits>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn senseless_data_sheets_are_refused() {
        let good = SHIPPED[0].2;
        let refused = |change: &dyn Fn(&mut Datasheet)| {
            let mut changed = sheet(Maker::Abb, good);
            change(&mut changed);
            changed.profile().unwrap_err()
        };
        assert_eq!(refused(&|sheet| sheet.name = " ".to_owned()), DatasheetError::Name);
        assert_eq!(refused(&|sheet| sheet.dimensions_mm = [0.0; 7]), DatasheetError::NoLength);
        assert!(matches!(refused(&|sheet| sheet.dimensions_mm[4] = f64::NAN), DatasheetError::Dimension { .. }));
        let hostile = Datasheet { name: "a\"b\\\u{1b}[31m".to_owned(), ..sheet(Maker::Kuka, good) };
        assert!(hostile.profile().is_ok());
    }
}
