//! Configurations inside a box of joint limits: evenly spread or plainly random, both fixed by a seed.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::PlanningError;

/// Lowest and highest pendant value of every joint (rad) or (m).
#[derive(Clone, Debug, PartialEq)]
pub struct JointBox {
    ranges: Vec<(f64, f64)>,
}

impl JointBox {
    /// From one range per joint.
    ///
    /// # Errors
    /// No joint at all, a limit that is not finite, or limits that are crossed.
    pub fn new(ranges: Vec<(f64, f64)>) -> Result<Self, PlanningError> {
        if ranges.is_empty() {
            return Err(PlanningError::NoJoints);
        }
        for (index, &(low, high)) in ranges.iter().enumerate() {
            check_range(&format!("{}", index + 1), low, high)?;
        }
        Ok(Self { ranges })
    }

    /// The same box with the range of joint `joint` (from 0) replaced by its common part with `low` … `high`.
    ///
    /// # Errors
    /// A joint that the box does not have, crossed limits, or nothing in common.
    pub fn narrowed(mut self, joint: usize, low: f64, high: f64) -> Result<Self, PlanningError> {
        let joints = self.ranges.len();
        let name = format!("{}", joint + 1);
        check_range(&name, low, high)?;
        let range = self.ranges.get_mut(joint).ok_or(PlanningError::UnknownJoint { joint: joint + 1, joints })?;
        let common = (range.0.max(low), range.1.min(high));
        if common.0 > common.1 {
            return Err(PlanningError::OutsideLimits { joint: name, low, high, limits: *range });
        }
        *range = common;
        Ok(self)
    }

    /// One range per joint.
    pub fn ranges(&self) -> &[(f64, f64)] {
        &self.ranges
    }

    /// Number of joints.
    pub const fn dof(&self) -> usize {
        self.ranges.len()
    }

    /// Whether a configuration is inside, limits included.
    pub fn contains(&self, q: &[f64]) -> bool {
        q.len() == self.dof() && q.iter().zip(&self.ranges).all(|(value, (low, high))| (low..=high).contains(&value))
    }

    /// The configuration at `unit` ∈ [0, 1)ⁿ of the box.
    fn at(&self, unit: impl Iterator<Item = f64>) -> Vec<f64> {
        self.ranges.iter().zip(unit).map(|((low, high), unit)| (low + unit * (high - low)).clamp(*low, *high)).collect()
    }
}

fn check_range(joint: &str, low: f64, high: f64) -> Result<(), PlanningError> {
    if low.is_finite() && high.is_finite() && low <= high {
        Ok(())
    } else {
        Err(PlanningError::CrossedLimits { joint: joint.to_owned(), low, high })
    }
}

/// Endless sequence of evenly spread configurations: `frac(shift + k·(φ⁻¹, φ⁻², …, φ⁻ⁿ))` scaled to the box, φ the positive
/// root of `φⁿ⁺¹ = φ + 1` (the R_d sequence of Roberts 2018), the shift random from `seed`.
///
/// Any stretch of the sequence is evenly spread, so that a filter may take as many as it needs.
pub fn low_discrepancy(joint_box: &JointBox, seed: u64) -> impl Iterator<Item = Vec<f64>> {
    let dof = joint_box.dof();
    let root = (0..64).fold(2.0_f64, |phi, _| (1.0 + phi).powf(1.0 / (dof as f64 + 1.0)));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let shift: Vec<f64> = (0..dof).map(|_| rng.random_range(0.0..1.0)).collect();
    let steps: Vec<f64> = (1..=dof).map(|power| root.powf(-(power as f64))).collect();
    (1_u32..)
        .map(move |k| joint_box.at(shift.iter().zip(&steps).map(|(shift, step)| (shift + f64::from(k) * step).fract())))
}

/// Endless sequence of uniformly random configurations.
pub fn random(joint_box: &JointBox, seed: u64) -> impl Iterator<Item = Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    std::iter::repeat_with(move || {
        let unit: Vec<f64> = (0..joint_box.dof()).map(|_| rng.random_range(0.0..1.0)).collect();
        joint_box.at(unit.into_iter())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box(dof: usize) -> JointBox {
        JointBox::new(vec![(0.0, 1.0); dof]).unwrap()
    }

    /// Largest distance from a random place to its nearest sample, over many places.
    fn largest_hole(samples: &[Vec<f64>], dof: usize) -> f64 {
        let distance = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).map(|d| d.min(1.0 - d).powi(2)).sum::<f64>().sqrt()
        };
        random(&unit_box(dof), 99)
            .take(300)
            .map(|place| samples.iter().map(|sample| distance(&place, sample)).fold(f64::INFINITY, f64::min))
            .fold(0.0, f64::max)
    }

    #[test]
    fn samples_stay_in_the_box_and_follow_the_seed() {
        let joint_box = JointBox::new(vec![(-2.0, -1.0), (0.0, 0.0), (0.5, 3.0)]).unwrap();
        for q in low_discrepancy(&joint_box, 3).take(500).chain(random(&joint_box, 3).take(500)) {
            assert!(joint_box.contains(&q), "{q:?}");
        }
        let first = |seed| low_discrepancy(&joint_box, seed).next();
        assert_eq!(first(1), first(1));
        assert_ne!(first(1), first(2));
    }

    #[test]
    fn low_discrepancy_leaves_smaller_holes_than_random() {
        let even: Vec<_> = low_discrepancy(&unit_box(3), 1).take(500).collect();
        let plain: Vec<_> = random(&unit_box(3), 1).take(500).collect();
        assert!(largest_hole(&even, 3) < 0.75 * largest_hole(&plain, 3));
        // The mean of every coordinate is far nearer to the middle than 500 random numbers get (0.013).
        for joint in 0..3 {
            let mean = even.iter().map(|q| q[joint]).sum::<f64>() / 500.0;
            assert!((mean - 0.5).abs() < 0.005, "{mean}");
        }
    }

    #[test]
    fn crossed_limits_and_unknown_joints_are_refused() {
        assert_eq!(
            JointBox::new(vec![(0.0, 1.0), (2.0, 1.0)]).unwrap_err(),
            PlanningError::CrossedLimits { joint: "2".into(), low: 2.0, high: 1.0 }
        );
        let joint_box = unit_box(2);
        assert_eq!(joint_box.clone().narrowed(1, -1.0, 0.5).unwrap().ranges(), [(0.0, 1.0), (0.0, 0.5)]);
        assert!(matches!(joint_box.clone().narrowed(2, 0.0, 0.5), Err(PlanningError::UnknownJoint { .. })));
        assert!(matches!(joint_box.narrowed(0, 2.0, 3.0), Err(PlanningError::OutsideLimits { .. })));
    }
}
