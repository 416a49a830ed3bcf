//! Instrument, tracker and shapes of a cell. Metres and radians.

use nalgebra::Point3;

use crate::units::{DEGREE, MICROMETRE};

/// A measuring instrument: standard deviation of one reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Instrument {
    /// Manufacturer and type.
    pub name: String,
    /// Constant part of the standard deviation per coordinate (m).
    pub sigma: f64,
    /// Part that grows with the distance (m per m).
    pub sigma_per_metre: f64,
}

impl Instrument {
    /// Standard deviation (m) at a distance from the instrument (m): the sum of both parts, as manufacturers state them
    /// (`15 µm + 6 µm/m`).
    pub const fn sigma_at(&self, distance: f64) -> f64 {
        self.sigma + self.sigma_per_metre * distance
    }

    /// Both parts as manufacturers state them.
    pub fn sigma_text(&self) -> String {
        format!("{:.1} µm + {:.1} µm/m", self.sigma / MICROMETRE, self.sigma_per_metre / MICROMETRE)
    }
}

/// A capsule fixed to a link, which encloses a part of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// Link frame: 0 is the fixed base, i the frame after joint i (entry i of `ForwardKinematics::base_from_links`).
    pub link: usize,
    /// One end of the line in that frame (m).
    pub from: Point3<f64>,
    /// The other end (m); the same point makes a sphere.
    pub to: Point3<f64>,
    /// Distance from line to surface (m).
    pub radius: f64,
}

/// A box parallel to the axes of the robot base, which the arm must not enter.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOut {
    /// Name in messages.
    pub name: String,
    /// Corner with the smallest coordinates, in the base (m).
    pub min: Point3<f64>,
    /// Corner with the largest coordinates, in the base (m).
    pub max: Point3<f64>,
}

/// Position of the tracker and limits of its line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracker {
    /// Approximate position in the robot base (m), for planning only, never for identification.
    pub position_in_base: Point3<f64>,
    /// Largest angle between beam and SMR axis (rad).
    pub acceptance_angle: f64,
    /// Shortest and longest distance of a target (m).
    pub range: (f64, f64),
}

/// 3 m in front of the arm and 1 m up; ±30° of a 1.5 inch SMR; 0.5 m to 20 m.
impl Default for Tracker {
    fn default() -> Self {
        Self { position_in_base: Point3::new(3.0, 0.0, 1.0), acceptance_angle: 30.0 * DEGREE, range: (0.5, 20.0) }
    }
}
