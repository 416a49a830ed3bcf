//! A mock of the cell for tests.

use nalgebra::Point3;

use super::super::PointSource;
use crate::link::protocol::{JointState, Shot};

/// A reflector on a robot in front of the instrument. Every shot is at another position, so that a stale one cannot be taken for
/// a new one.
#[derive(Clone, Debug)]
pub struct MockCell {
    /// Number of shots so far.
    pub shots: u32,
    /// Whether the beam reaches the reflector.
    pub has_beam: bool,
    /// Stated standard deviation of each coordinate (m).
    pub sigma: Option<[f64; 3]>,
    /// Joint state that the robot reports.
    pub joints: JointState,
}

impl MockCell {
    /// Point of a shot, counted from 0 (m): in all directions around the instrument, above and below it, 1.4 m to 3 m away.
    pub fn point(shot: u32) -> Point3<f64> {
        const FIRST: f64 = -0.5;
        let turn = 0.7 * f64::from(shot);
        Point3::new(
            1.2345 + 2.0 * ((FIRST + turn).cos() - FIRST.cos()),
            -0.67825 + 2.0 * ((FIRST + turn).sin() - FIRST.sin()),
            0.090_125 + (0.3 * turn).sin(),
        )
    }

    /// The point of the newest shot (m).
    pub fn newest(&self) -> Point3<f64> {
        Self::point(self.shots.saturating_sub(1))
    }

    /// Distance of a point from the nearest shot after the first `before` ones (m).
    pub fn error(&self, point: &Point3<f64>, before: u32) -> f64 {
        (before..self.shots).map(|shot| (point - Self::point(shot)).norm()).fold(f64::INFINITY, f64::min)
    }
}

impl Default for MockCell {
    fn default() -> Self {
        let positions = vec![0.1, -1.2, 1.3, -0.4, 0.5, -0.6];
        Self { shots: 0, has_beam: true, sigma: Some([4e-6, 5e-6, 6e-6]), joints: JointState::at(positions) }
    }
}

impl PointSource for MockCell {
    fn shot(&mut self) -> Option<Shot> {
        let point = Self::point(self.shots);
        self.has_beam.then(|| {
            self.shots += 1;
            Shot { sigma: self.sigma, ..Shot::bare(point) }
        })
    }

    fn position(&mut self) -> Option<Shot> {
        self.has_beam.then(|| Shot::bare(Self::point(self.shots)))
    }

    fn joints(&mut self) -> JointState {
        self.joints.clone()
    }
}
