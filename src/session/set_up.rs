//! Choices made before measuring: instrument, target, and the steps of the wizard.

use std::fmt;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::plan::PoseKind;
use super::simulation::Simulation;
use super::wire::LinkChoice;
use crate::kinematics::LinkMass;
use crate::text::names;
use crate::units::{INCH, MICROMETRE, MILLIMETRE, to_mm};

/// A step of the wizard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Step {
    /// The robot.
    #[default]
    Profile,
    /// Choice of the instrument.
    Instrument,
    /// Position of the SMR on the flange.
    Target,
    /// Which poses to measure.
    Plan,
    /// Measurement.
    Capture,
    /// Identifying the arm.
    Identify,
    /// Verifying it on points that the identification did not see.
    Verify,
    /// Writing the results.
    Deliver,
}

names!(Step {
    Profile = "Profile",
    Instrument = "Instrument",
    Target = "Target",
    Plan = "Plan",
    Capture = "Capture",
    Identify = "Identify",
    Verify = "Verify",
    Deliver = "Deliver",
});

impl Step {
    /// From 1.
    pub fn number(self) -> usize {
        Self::ALL.iter().position(|step| *step == self).map_or(1, |index| index + 1)
    }

    /// The step after this one.
    pub fn next(self) -> Option<Self> {
        Self::ALL.get(self.number()).copied()
    }

    /// The step before this one.
    pub fn previous(self) -> Option<Self> {
        self.number().checked_sub(2).and_then(|index| Self::ALL.get(index)).copied()
    }
}

/// Unit of measured coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CoordinateUnit {
    #[default]
    Millimetre,
    Metre,
    Inch,
    Micrometre,
}

impl CoordinateUnit {
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Metre, Self::Inch, Self::Micrometre];

    /// One unit (m).
    pub const fn size(self) -> f64 {
        match self {
            Self::Millimetre => MILLIMETRE,
            Self::Metre => 1.0,
            Self::Inch => INCH,
            Self::Micrometre => MICROMETRE,
        }
    }

    /// As it is written behind a number.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Metre => "m",
            Self::Inch => "in",
            Self::Micrometre => "um",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum InstrumentChoice {
    /// The operator types or pastes coordinates.
    Manual { unit: CoordinateUnit },
    /// A simulated cell, to rehearse on.
    Simulated(Simulation),
    /// An instrument that answers over a wire.
    Linked(LinkChoice),
    /// Measurements of earlier days, played as if they were captured.
    Replay {
        /// The tables, in the order in which their poses are played.
        sets: Vec<RecordedSet>,
    },
}

/// Rows of a table of real measurements.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedSet {
    /// Path of the table.
    pub file: String,
    /// Purpose of the rows: `identification` or `verification`.
    #[serde(default)]
    pub kind: PoseKind,
    /// Which rows, such as `pose % 17 == 0`; none: all.
    #[serde(default)]
    pub rows: Option<String>,
    /// Layout of the table: `named`, `robodk`, `delmia`, or one that was saved beside the table or in the current folder.
    #[serde(default = "named")]
    pub layout: String,
}

fn named() -> String {
    "named".to_owned()
}

/// Position of the SMR on the flange.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TargetChoice {
    /// As the profile says.
    Profile,
    /// Coordinates in the flange frame, known to some uncertainty.
    Known {
        /// Centre of the SMR.
        xyz_mm: (f64, f64, f64),
        /// Standard deviation of each coordinate; zero: exact and not identified.
        sigma_mm: f64,
    },
    /// Identified together with the arm, with a wide prior about the place that the profile gives.
    Free {
        /// Standard deviation of each coordinate.
        sigma_mm: f64,
    },
    /// Found by circle-point analysis.
    Circles {
        /// Centre of the SMR.
        xyz_mm: (f64, f64, f64),
        /// Standard deviation of each coordinate.
        sigma_mm: f64,
    },
}

/// What the flange carries besides the SMR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadText {
    /// Mass.
    pub mass_kg: f64,
    /// Centre of mass in the flange frame.
    pub centre_mm: (f64, f64, f64),
}

impl PayloadText {
    /// Heaviest payload (kg): arms that carry more do not exist.
    pub const HEAVIEST: f64 = 5000.0;

    /// The record of a mass on the flange.
    pub fn of(mass: LinkMass) -> Self {
        let [x, y, z] = mass.centre.coords.map(|value| (to_mm(value) * 1e6).round() / 1e6).into();
        Self { mass_kg: mass.mass, centre_mm: (x, y, z) }
    }

    /// The mass on the flange.
    pub fn mass(&self) -> LinkMass {
        let (x, y, z) = self.centre_mm;
        LinkMass { mass: self.mass_kg, centre: Point3::new(x, y, z) * MILLIMETRE }
    }

    /// Whether its numbers can be meant.
    pub fn is_usable(&self) -> bool {
        let (x, y, z) = self.centre_mm;
        (0.0..=Self::HEAVIEST).contains(&self.mass_kg) && [x, y, z].into_iter().all(|value| value.abs() < 10_000.0)
    }
}

/// `2.5 kg, centre (0, 0, 60) mm in the flange`.
impl fmt::Display for PayloadText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (x, y, z) = self.centre_mm;
        write!(f, "{} kg, centre ({x}, {y}, {z}) mm in the flange", self.mass_kg)
    }
}

/// Coordinates of a point (mm).
pub type PointMm = (f64, f64, f64);

/// Points in the base and as the tracker sees them (mm).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TrackerPoints(pub Vec<(PointMm, PointMm)>);

/// One SMR as the instrument sees it in its two faces (mm).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FacePair {
    pub first_mm: (f64, f64, f64),
    pub second_mm: (f64, f64, f64),
}

/// Range of a plan per joint (degree, sliding joints mm); `None` is the robot's own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct JointLimitsText(pub Vec<(String, Option<(f64, f64)>)>);

/// How the robot program of a plan is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProgramText {
    /// Name of the language.
    pub dialect: String,
    /// Rest at each measured pose (s); `None`: until the operator acknowledges.
    pub dwell_s: Option<f64>,
    /// Part of the full joint speed.
    pub speed_percent: f64,
}
