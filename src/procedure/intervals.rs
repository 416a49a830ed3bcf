//! Intervals of the figures of a verification: what other sets of as many poses could have shown (bootstrap over poses).

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Sets of poses that are drawn, and the seed of the draw: the same figures have the same intervals.
const RESAMPLES: usize = 1000;
const SEED: u64 = 0xb007;
/// Fewer poses say nothing about the scatter among poses.
const FEWEST_POSES: usize = 5;
/// Largest errors among which the largest of a set is looked up.
const LARGEST: usize = 2000;
/// Share of the sets below, and above, an interval.
const TAIL: f64 = 0.025;

/// A non-negative error with the poses that it depends on, counted from zero: twice the same one for an error of one pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPoses {
    pub(super) poses: [usize; 2],
    pub(super) error: f64,
}

/// Intervals of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Intervals {
    pub(super) mean: [f64; 2],
    pub(super) rms: [f64; 2],
    /// Never beyond the largest error itself: a sample says nothing about what is larger.
    pub(super) max: [f64; 2],
}

/// What the errors of one pose add to the sums.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    count: f64,
    /// Sum of the errors less as many means.
    sum: f64,
    /// Likewise of their squares.
    squares: f64,
}

impl Intervals {
    /// Of errors at so many poses; `None` where there are too few.
    pub(super) fn new(errors: &[OfPoses], poses: usize) -> Option<Self> {
        if poses < FEWEST_POSES || errors.is_empty() || errors.iter().any(|of| !of.error.is_finite()) {
            return None;
        }
        let count = errors.len() as f64;
        let mean = errors.iter().map(|of| of.error).sum::<f64>() / count;
        let square = errors.iter().map(|of| of.error * of.error).sum::<f64>() / count;
        let is_of_pairs = errors.iter().any(|of| of.poses[0] != of.poses[1]);
        let mut shares = vec![Share::default(); poses];
        for of in errors {
            let of_each = if is_of_pairs { &of.poses[..] } else { &of.poses[..1] };
            for pose in of_each {
                let share = shares.get_mut(*pose)?;
                share.count += 1.0;
                share.sum += of.error - mean;
                share.squares += of.error * of.error - square;
            }
        }
        // A distance changes with either of its poses (first-order projection of the mean over pairs, Hoeffding 1948).
        let order = if is_of_pairs { 2.0 } else { 1.0 };
        let mut largest: Vec<OfPoses> = errors.to_vec();
        largest.sort_by(|a, b| b.error.total_cmp(&a.error));
        largest.truncate(LARGEST);
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let (mut means, mut roots, mut maxima) = (Vec::new(), Vec::new(), Vec::new());
        let mut drawn = vec![false; poses];
        for _ in 0..RESAMPLES {
            drawn.fill(false);
            let mut total = Share::default();
            for _ in 0..poses {
                let pose = rng.random_range(0..poses);
                drawn[pose] = true;
                total.count += shares[pose].count;
                total.sum += shares[pose].sum;
                total.squares += shares[pose].squares;
            }
            if total.count > 0.0 {
                means.push(mean + order * total.sum / total.count);
                roots.push((square + order * total.squares / total.count).max(0.0).sqrt());
            }
            maxima.extend(largest.iter().find(|of| of.poses.iter().all(|pose| drawn[*pose])).map(|of| of.error));
        }
        let widened = widening(poses);
        Some(Self {
            mean: interval(means, mean, widened)?,
            rms: interval(roots, square.sqrt(), widened)?,
            max: interval(maxima, largest.first()?.error, 1.0)?,
        })
    }
}

/// Few poses look more alike than they are: the factor of Student's t in place of the normal distribution, and of n − 1 for n.
fn widening(poses: usize) -> f64 {
    let degrees = poses as f64 - 1.0;
    let student = 1.96 + 2.4 / degrees + 2.8 / degrees.powi(2);
    student / 1.96 * (poses as f64 / degrees).sqrt()
}

fn interval(mut resampled: Vec<f64>, estimate: f64, widened: f64) -> Option<[f64; 2]> {
    resampled.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the last index")]
    let at = |share: f64| resampled.get(((resampled.len().saturating_sub(1)) as f64 * share).round() as usize).copied();
    let (low, high) = (at(TAIL)?, at(1.0 - TAIL)?);
    Some([(estimate + (low - estimate) * widened).max(0.0), estimate + (high - estimate) * widened])
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn normal(rng: &mut ChaCha8Rng) -> [f64; 3] {
        std::array::from_fn(|_| StandardNormal.sample(rng))
    }

    fn norm(vector: [f64; 3]) -> f64 {
        vector.iter().map(|value: &f64| value * value).sum::<f64>().sqrt()
    }

    /// Of sets of 20 poses whose true figures are known, 95 of 100 intervals contain them.
    #[test]
    fn intervals_contain_the_truth_as_often_as_they_say() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (poses, trials) = (20, 400);
        let mut of_positions = 0;
        let mut of_distances = 0;
        // Root mean square of the norm of three normal numbers; of the difference along a line of two poses.
        let (true_rms, true_distance) = (3.0_f64.sqrt(), 2.0_f64.sqrt());
        for _ in 0..trials {
            let errors: Vec<[f64; 3]> = (0..poses).map(|_| normal(&mut rng)).collect();
            let positions: Vec<OfPoses> = errors
                .iter()
                .enumerate()
                .map(|(pose, error)| OfPoses { poses: [pose; 2], error: norm(*error) })
                .collect();
            let [low, high] = Intervals::new(&positions, poses).unwrap().rms;
            of_positions += usize::from((low..=high).contains(&true_rms));
            let pairs = (0..poses).flat_map(|one| (0..one).map(move |other| [one, other]));
            let distances: Vec<OfPoses> = pairs
                .map(|poses| OfPoses { poses, error: (errors[poses[0]][0] - errors[poses[1]][0]).abs() })
                .collect();
            let [low, high] = Intervals::new(&distances, poses).unwrap().rms;
            of_distances += usize::from((low..=high).contains(&true_distance));
        }
        for inside in [of_positions, of_distances] {
            let share = 100 * inside / trials;
            assert!((88..=99).contains(&share), "{share} %");
        }
    }

    #[test]
    fn repetitions_of_a_pose_do_not_narrow_an_interval() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let once: Vec<OfPoses> =
            (0..15).map(|pose| OfPoses { poses: [pose; 2], error: norm(normal(&mut rng)) }).collect();
        let often: Vec<OfPoses> = once.iter().flat_map(|of| [*of; 10]).collect();
        assert_eq!(Intervals::new(&once, 15), Intervals::new(&often, 15));
        assert_eq!(Intervals::new(&once[..4], 4), None);
    }
}
