//! The cube of the test, its measuring plane, and the poses on it.

use nalgebra::{Point3, Vector3};

use crate::text::names;

/// Edges that the standard prefers, longest first (m).
pub const EDGES: [f64; 4] = [1.0, 0.63, 0.4, 0.25];

/// Number of poses on the measuring plane.
pub const POSES: usize = 5;

/// Distance of the outer poses from the ends of a diagonal, as a share of the diagonal.
const INSET: f64 = 0.1;

/// A cube along the axes of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cube {
    /// Its centre, in the base (m).
    pub centre: Point3<f64>,
    /// Length of an edge (m).
    pub edge: f64,
}

/// A diagonal plane of the cube, named by the direction in which it rises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum MeasuringPlane {
    /// It rises along +x of the base, away from the robot.
    #[default]
    RisesAlongX,
    /// It falls along +x.
    FallsAlongX,
    /// It rises along +y.
    RisesAlongY,
    /// It falls along +y.
    FallsAlongY,
}

names!(MeasuringPlane {
    RisesAlongX = "rises-along-x",
    FallsAlongX = "falls-along-x",
    RisesAlongY = "rises-along-y",
    FallsAlongY = "falls-along-y",
});

impl Cube {
    /// The corners (m).
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let half = self.edge / 2.0;
        std::array::from_fn(|corner| {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -half } else { half };
            self.centre + Vector3::new(sign(0), sign(1), sign(2))
        })
    }

    /// P1, the centre, and P2 to P5 around it on the diagonals of the plane (m): P2 and P4 are on one diagonal.
    pub fn poses(&self, plane: MeasuringPlane) -> [Point3<f64>; POSES] {
        let half = self.edge / 2.0;
        let (level, steep) = match plane {
            MeasuringPlane::RisesAlongX => (Vector3::y(), Vector3::new(1.0, 0.0, 1.0)),
            MeasuringPlane::FallsAlongX => (Vector3::y(), Vector3::new(1.0, 0.0, -1.0)),
            MeasuringPlane::RisesAlongY => (Vector3::x(), Vector3::new(0.0, 1.0, 1.0)),
            MeasuringPlane::FallsAlongY => (Vector3::x(), Vector3::new(0.0, 1.0, -1.0)),
        };
        // Half a diagonal is to the corner of the rectangle; the poses are inset by a share of the whole diagonal.
        let reach = half * (1.0 - 2.0 * INSET);
        let at = |along: f64, up: f64| self.centre + reach * (along * level + up * steep);
        [self.centre, at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_inset_by_a_tenth_of_the_diagonal() {
        let cube = Cube { centre: Point3::new(0.8, 0.1, 0.5), edge: 0.63 };
        for plane in [
            MeasuringPlane::RisesAlongX,
            MeasuringPlane::FallsAlongX,
            MeasuringPlane::RisesAlongY,
            MeasuringPlane::FallsAlongY,
        ] {
            let [centre, p2, p3, p4, p5] = cube.poses(plane);
            assert_eq!(centre, cube.centre);
            let corners = cube.corners();
            // The diagonal of a plane through two opposite edges is a diagonal of the cube.
            let diagonal = 0.63 * 3.0_f64.sqrt();
            for pose in [p2, p3, p4, p5] {
                let nearest = corners.iter().map(|corner| (corner - pose).norm()).fold(f64::INFINITY, f64::min);
                assert!((nearest - 0.1 * diagonal).abs() < 1e-12, "{plane:?}");
            }
            assert!(((p4 - p2).norm() - 0.8 * diagonal).abs() < 1e-12);
            assert!(((p5 - p3).norm() - 0.8 * diagonal).abs() < 1e-12);
        }
    }
}
