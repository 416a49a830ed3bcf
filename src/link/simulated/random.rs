//! Random numbers of a simulated cell: each purpose has its own sequence, determined by the seed.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::session::simulation::FaultKind;

/// Purpose of random numbers. Purposes are independent: an additional fault does not change the noise.
#[derive(Clone, Copy, Debug)]
pub(super) enum Use {
    /// Deviations of the arm.
    Arm,
    /// Errors of its joints.
    JointErrors,
    /// Pose of the tracker.
    Tracker,
    /// Noise of the measurement with this number.
    Noise(u64),
    /// A fault of this kind at the measurement with this number.
    Fault(FaultKind, u64),
}

impl Use {
    /// Number of the random stream: the purpose in the highest byte, the measurement below.
    const fn stream(self) -> u64 {
        let (purpose, number) = match self {
            Self::Arm => (0, 0),
            Self::Tracker => (1, 0),
            Self::Noise(number) => (2, number),
            Self::Fault(FaultKind::WrongPose, number) => (3, number),
            Self::Fault(FaultKind::TargetBumped { .. }, number) => (4, number),
            Self::Fault(FaultKind::NotAtRest { .. }, number) => (5, number),
            Self::Fault(FaultKind::Outlier { .. }, number) => (6, number),
            Self::Fault(FaultKind::Drift { .. }, number) => (7, number),
            Self::Fault(_, number) => (8, number),
            Self::JointErrors => (9, 0),
        };
        (purpose << 56) ^ number
    }
}

/// One sequence of random numbers.
#[derive(Debug)]
pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64, of: Use) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(of.stream());
        Self(rng)
    }

    /// Evenly distributed from `low` to `high`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit: f64 = self.0.random_range(0.0..1.0);
        low + (high - low) * unit
    }

    /// Standard normal (Box & Muller 1958).
    pub(super) fn normal(&mut self) -> f64 {
        // 1 − u is never zero.
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * self.between(0.0, TAU).cos()
    }

    /// Three independent standard normal numbers.
    pub(super) fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// Evenly distributed over all directions.
    pub(super) fn direction(&mut self) -> Vector3<f64> {
        Unit::try_new(self.normals(), f64::MIN_POSITIVE).map_or_else(Vector3::x, Unit::into_inner)
    }

    /// A frame with a random orientation, within about `spread` (m) of `place`.
    pub(super) fn frame_near(&mut self, place: &Point3<f64>, spread: f64) -> Isometry3<f64> {
        let origin = place.coords + self.normals() * spread;
        let vector = self.normals();
        let turn = Quaternion::from_parts(self.normal(), vector);
        let rotation = UnitQuaternion::try_new(turn, f64::MIN_POSITIVE).unwrap_or_default();
        Isometry3::from_parts(Translation3::from(origin), rotation)
    }
}
