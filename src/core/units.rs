//! Conversions between the inside of the program (metre, radian) and its edge (millimetre, degree).
//!
//! Every profile, table, screen and report carries its unit in the name of the field; nothing but this module
//! multiplies by 1000 or by π/180.

use std::f64::consts::PI;

/// One millimetre (m).
pub const MILLIMETRE: f64 = 1e-3;
/// One micrometre (m).
pub const MICROMETRE: f64 = 1e-6;
/// One centimetre (m).
pub const CENTIMETRE: f64 = 1e-2;
/// One inch (m), exact (ISO 31-1).
pub const INCH: f64 = 25.4e-3;
/// One degree (rad).
pub const DEGREE: f64 = PI / 180.0;
/// One milliradian (rad).
pub const MILLIRADIAN: f64 = 1e-3;
/// A microradian in rad.
pub const MICRORADIAN: f64 = 1e-6;

/// Metres of a length in millimetres.
pub const fn from_mm(length_mm: f64) -> f64 {
    length_mm * MILLIMETRE
}

/// Millimetres of a length in metres.
pub const fn to_mm(length: f64) -> f64 {
    length / MILLIMETRE
}

/// Radians of an angle in degrees.
pub const fn from_deg(angle_deg: f64) -> f64 {
    angle_deg * DEGREE
}

/// Degrees of an angle in radians.
pub const fn to_deg(angle: f64) -> f64 {
    angle / DEGREE
}

/// What a number measures: decides the unit at the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Inside metre, outside millimetre.
    Length,
    /// Inside radian, outside degree.
    Angle,
}

impl Quantity {
    /// One edge unit (1 mm, 1°) in the unit of the inside (m, rad).
    pub const fn edge_unit(self) -> f64 {
        match self {
            Self::Length => MILLIMETRE,
            Self::Angle => DEGREE,
        }
    }

    /// Value at the edge (mm or degree) of a value of the inside (m or rad).
    pub const fn to_edge(self, value: f64) -> f64 {
        value / self.edge_unit()
    }

    /// Value of the inside (m or rad) of a value at the edge (mm or degree).
    pub const fn from_edge(self, value: f64) -> f64 {
        value * self.edge_unit()
    }

    /// Unit at the edge as written in tables: `mm` or `deg`.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Length => "mm",
            Self::Angle => "deg",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edge_and_inside_are_inverse() {
        for quantity in [Quantity::Length, Quantity::Angle] {
            for value in [0.0, 1.0, -33.25, 1e-7] {
                let back = quantity.to_edge(quantity.from_edge(value));
                assert!((back - value).abs() <= 1e-15 * value.abs(), "{quantity:?} {value} {back}");
            }
        }
        assert!((from_mm(25.4) - INCH).abs() < 1e-18);
        assert!((from_deg(180.0) - PI).abs() < 1e-15);
    }
}
