//! Proof that a written model is correct: its forward kinematics after reading it back, compared with the arm at random
//! configurations.

use std::f64::consts::PI;

use nalgebra::Isometry3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::ModelError;
use crate::kinematics::{ForwardKinematics, JointType, KinematicChain};
use crate::units::{MICROMETRE, to_deg, to_mm};

/// Number of random configurations of a proof.
pub const CONFIGURATIONS: usize = 1000;

/// Seed of the configurations: the same ones each time.
const SEED: u64 = 0x5eed;

/// Range of a joint without limits, to both sides (rad, m).
const UNLIMITED: (f64, f64) = (PI, 1.0);

/// Agreement of two models.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Largest difference of the flange's position (m).
    pub position: f64,
    /// Largest angle between the flanges (rad).
    pub angle: f64,
}

/// Largest tolerated differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Position (m).
    pub position: f64,
    /// Angle (rad).
    pub angle: f64,
}

/// Tolerance of exports: 1 µm and 1 µrad.
pub const EXPORT: Tolerance = Tolerance { position: MICROMETRE, angle: 1e-6 };

/// Tolerance of imports: 1 nm and 1 nrad.
pub const IMPORT: Tolerance = Tolerance { position: 1e-9, angle: 1e-9 };

/// Configurations of a chain, evenly random within `limits` ((rad) or (m), one entry per joint).
pub fn configurations(chain: &KinematicChain, limits: &[Option<(f64, f64)>], count: usize) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let ranges: Vec<(f64, f64)> = chain
        .joints()
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let wide = match joint.joint_type {
                JointType::Revolute => UNLIMITED.0,
                JointType::Prismatic => UNLIMITED.1,
            };
            limits.get(index).copied().flatten().filter(|(low, high)| low < high).unwrap_or((-wide, wide))
        })
        .collect();
    (0..count).map(|_| ranges.iter().map(|&(low, high)| random.random_range(low..high)).collect()).collect()
}

/// Compares `written` with `meant` at random configurations within the limits.
///
/// # Errors
/// They differ by more than `tolerance`, or `written` is not a number somewhere.
pub fn prove(
    meant: &KinematicChain,
    limits: &[Option<(f64, f64)>],
    tolerance: Tolerance,
    written: impl Fn(&[f64]) -> Isometry3<f64>,
) -> Result<Agreement, ModelError> {
    let arm = ForwardKinematics::new(meant);
    let mut worst = Agreement::default();
    for q in configurations(meant, limits, CONFIGURATIONS) {
        let (meant, written) = (arm.base_from_flange(&q), written(&q));
        let position = (meant.translation.vector - written.translation.vector).norm();
        let angle = meant.rotation.angle_to(&written.rotation);
        // A comparison with NaN is never true.
        if !(position <= tolerance.position && angle <= tolerance.angle) {
            return Err(ModelError::Differs { position_mm: to_mm(position), angle_deg: to_deg(angle) });
        }
        worst.position = worst.position.max(position);
        worst.angle = worst.angle.max(angle);
    }
    Ok(worst)
}
