//! What a simulated instrument looks at in tests.

use nalgebra::Point3;

use super::super::PointSource;
use crate::link::protocol::{JointState, Shot};

/// A reflector that the robot carries in front of the instrument: every shot is at another place, so that a stale one cannot
/// pass for a fresh one.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Shots so far.
    pub shots: u32,
    /// The beam reaches the reflector.
    pub has_beam: bool,
    /// Standard deviation of each coordinate that is stated (m).
    pub sigma: Option<[f64; 3]>,
    /// What the robot reports.
    pub joints: JointState,
}

impl Cell {
    /// The point of a shot, counted from 0 (m): in every direction round the instrument, above and below it, 1.4 m to 3 m away.
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

    /// How far a point is from the nearest of the shots since there were `before` of them (m).
    pub fn error(&self, point: &Point3<f64>, before: u32) -> f64 {
        (before..self.shots).map(|shot| (point - Self::point(shot)).norm()).fold(f64::INFINITY, f64::min)
    }
}

impl Default for Cell {
    fn default() -> Self {
        let positions = vec![0.1, -1.2, 1.3, -0.4, 0.5, -0.6];
        let joints = JointState { positions, speeds: Some(vec![0.0; 6]), controller_time: 0.0, stopped: None };
        Self { shots: 0, has_beam: true, sigma: Some([4e-6, 5e-6, 6e-6]), joints }
    }
}

impl PointSource for Cell {
    fn shot(&mut self) -> Option<Shot> {
        let point = Self::point(self.shots);
        self.has_beam.then(|| {
            self.shots += 1;
            Shot { sigma: self.sigma, ..Shot::bare(point) }
        })
    }

    fn look(&mut self) -> Option<Shot> {
        self.has_beam.then(|| Shot::bare(Self::point(self.shots)))
    }

    fn joints(&mut self) -> JointState {
        self.joints.clone()
    }
}
