//! Accuracy and repeatability of poses and distances.

use nalgebra::{Point3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Fewest cycles of which a spread can be told.
pub const FEWEST: usize = 3;
/// Resamples of a bootstrap.
const RESAMPLES: usize = 2000;
/// Seed of the bootstrap: the same points give the same interval.
const SEED: u64 = 9283;
/// Share of the resamples below and above the interval.
const TAIL: f64 = 0.025;

/// A figure with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The figure as the standard defines it (m).
    pub value: f64,
    /// Lower end (m).
    pub low: f64,
    /// Upper end (m).
    pub high: f64,
}

/// Figures of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFigures {
    /// Number of cycles.
    pub cycles: usize,
    /// Pose accuracy AP: from the commanded point to the barycentre of the attained ones.
    pub accuracy: Estimate,
    /// Components of the accuracy, attained less commanded, in the base (m).
    pub components: Vector3<f64>,
    /// Pose repeatability RP: mean distance from the barycentre plus three standard deviations of that distance.
    pub repeatability: Estimate,
    /// The barycentre of the attained points, in the base (m).
    pub barycentre: Point3<f64>,
}

/// Figures of one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceFigures {
    /// Number of cycles in which both poses were attained.
    pub cycles: usize,
    /// Commanded distance (m).
    pub commanded: f64,
    /// Distance accuracy AD: mean attained distance less the commanded one.
    pub accuracy: Estimate,
    /// Components of the distance accuracy, in the base (m).
    pub components: Vector3<f64>,
    /// Distance repeatability RD: three standard deviations of the distance, to both sides.
    pub repeatability: Estimate,
}

/// The figures of a pose from the points attained in every cycle, all in one frame (m); none below [`FEWEST`] cycles.
pub fn pose_figures(commanded: &Point3<f64>, attained: &[Point3<f64>]) -> Option<PoseFigures> {
    if attained.len() < FEWEST {
        return None;
    }
    let centre = barycentre(attained.iter().copied());
    let accuracy = |points: &[Point3<f64>]| (barycentre(points.iter().copied()) - commanded).norm();
    let components = centre - commanded;
    Some(PoseFigures {
        cycles: attained.len(),
        // The accuracy is a length: resamples scatter about the barycentre in all directions and make it longer on average. Its
        // interval is that of the component along the error.
        accuracy: about(accuracy(attained), attained, |points| {
            components
                .try_normalize(0.0)
                .map_or(0.0, |along| (barycentre(points.iter().copied()) - commanded).dot(&along))
        }),
        components,
        repeatability: about(repeatability(attained), attained, repeatability),
        barycentre: centre,
    })
}

/// The figures of the distance between two poses: `attained` has both points of every cycle (m); none below [`FEWEST`] cycles.
pub fn distance_figures(
    commanded: (&Point3<f64>, &Point3<f64>),
    attained: &[(Point3<f64>, Point3<f64>)],
) -> Option<DistanceFigures> {
    if attained.len() < FEWEST {
        return None;
    }
    let wanted = commanded.1 - commanded.0;
    let count = attained.len() as f64;
    let components = attained.iter().map(|(first, second)| second - first).sum::<Vector3<f64>>() / count - wanted;
    let distances: Vec<f64> = attained.iter().map(|(first, second)| (second - first).norm()).collect();
    let accuracy = |distances: &[f64]| average(distances) - wanted.norm();
    let spread = |distances: &[f64]| 3.0 * standard_deviation(distances);
    Some(DistanceFigures {
        cycles: attained.len(),
        commanded: wanted.norm(),
        accuracy: about(accuracy(&distances), &distances, accuracy),
        components,
        repeatability: about(spread(&distances), &distances, spread),
    })
}

/// Multi-directional pose accuracy variation vAP: the largest distance between the barycentres of different directions of approach (m).
pub fn multi_directional_variation(barycentres: &[Point3<f64>]) -> Option<f64> {
    let pairs = barycentres
        .iter()
        .enumerate()
        .flat_map(|(index, one)| barycentres[..index].iter().map(move |other| (one, other)));
    pairs.map(|(one, other)| (one - other).norm()).reduce(f64::max)
}

/// Drift: the largest change of a figure since the first time it was found (m).
pub fn drift(figures: &[f64]) -> Option<f64> {
    let first = figures.first()?;
    figures.iter().map(|figure| (figure - first).abs()).reduce(f64::max)
}

/// The barycentre of points (m); not a number without points.
pub fn barycentre(points: impl IntoIterator<Item = Point3<f64>>) -> Point3<f64> {
    let (mut sum, mut count) = (Vector3::zeros(), 0_usize);
    for point in points {
        sum += point.coords;
        count += 1;
    }
    Point3::from(sum / count as f64)
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn standard_deviation(values: &[f64]) -> f64 {
    let mean = average(values);
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (square / (values.len() as f64 - 1.0)).sqrt()
}

fn repeatability(points: &[Point3<f64>]) -> f64 {
    let centre = barycentre(points.iter().copied());
    let distances: Vec<f64> = points.iter().map(|point| (point - centre).norm()).collect();
    average(&distances) + 3.0 * standard_deviation(&distances)
}

/// A figure with the percentiles of `figure` over resamples of what it comes from.
fn about<T: Clone>(value: f64, from: &[T], figure: impl Fn(&[T]) -> f64) -> Estimate {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut resampled: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let again: Vec<T> = (0..from.len()).map(|_| from[rng.random_range(0..from.len())].clone()).collect();
            figure(&again)
        })
        .collect();
    resampled.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the last index")]
    let at = |share: f64| resampled[((RESAMPLES - 1) as f64 * share).round() as usize];
    Estimate { value, low: at(TAIL), high: at(1.0 - TAIL) }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    /// Worked by hand: a commanded point at the origin, four attained ones.
    #[test]
    fn figures_of_a_table_worked_by_hand() {
        let attained = [(1.0, 0.0, 2.0), (3.0, 0.0, 2.0), (2.0, 1.0, 2.0), (2.0, -1.0, 2.0)];
        let attained = attained.map(|(x, y, z)| Point3::new(x, y, z));
        let pose = pose_figures(&Point3::origin(), &attained).unwrap();
        // Barycentre (2, 0, 2); every point is 1 away from it: no spread of the distance.
        assert!((pose.accuracy.value - 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(pose.components, Vector3::new(2.0, 0.0, 2.0));
        assert!((pose.repeatability.value - 1.0).abs() < 1e-12);
        // Distances from the barycentre 0, 0, 3, 3 (on a line): mean 1.5, deviation sqrt(4 * 1.5² / 3) = sqrt(3).
        let on_a_line = [-3.0, 0.0, 0.0, 3.0].map(|x| Point3::new(x, 0.0, 0.0));
        let pose = pose_figures(&Point3::origin(), &on_a_line).unwrap();
        assert!((pose.repeatability.value - (1.5 + 3.0 * 3.0_f64.sqrt())).abs() < 1e-12);
        // Distances 10, 12, 11 against 10: mean 11, deviation 1.
        let pairs = [10.0, 12.0, 11.0].map(|x| (Point3::origin(), Point3::new(x, 0.0, 0.0)));
        let distance = distance_figures((&Point3::origin(), &Point3::new(10.0, 0.0, 0.0)), &pairs).unwrap();
        assert!((distance.accuracy.value - 1.0).abs() < 1e-12 && (distance.repeatability.value - 3.0).abs() < 1e-12);
        assert_eq!(distance.components, Vector3::new(1.0, 0.0, 0.0));
        let corners = [(0.0, 0.0), (3.0, 0.0), (0.0, 4.0)].map(|(x, y)| Point3::new(x, y, 0.0));
        assert_eq!(multi_directional_variation(&corners), Some(5.0));
        assert_eq!(drift(&[0.3, 0.1, 0.6]), Some(0.3));
        assert!(pose_figures(&Point3::origin(), &attained[..2]).is_none());
    }

    /// Points with a known accuracy and repeatability: the intervals contain the truth about as often as they say.
    #[test]
    fn intervals_contain_the_truth() {
        let (offset, sigma) = (Vector3::new(0.2, -0.1, 0.05), 0.02);
        // The distance from the barycentre of a normal cloud follows a Maxwell distribution.
        let true_repeatability =
            sigma * ((8.0_f64 / std::f64::consts::PI).sqrt() + 3.0 * (3.0 - 8.0 / std::f64::consts::PI).sqrt());
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let trials = 300;
        let (mut accurate, mut repeatable) = (0, 0);
        for _ in 0..trials {
            let mut noise = || {
                Vector3::from_fn(|_, _| {
                    let value: f64 = StandardNormal.sample(&mut rng);
                    sigma * value
                })
            };
            let attained: Vec<Point3<f64>> = (0..30).map(|_| Point3::from(offset + noise())).collect();
            let pose = pose_figures(&Point3::origin(), &attained).unwrap();
            let contains = |estimate: &Estimate, truth: f64| (estimate.low..=estimate.high).contains(&truth);
            accurate += usize::from(contains(&pose.accuracy, offset.norm()));
            repeatable += usize::from(contains(&pose.repeatability, true_repeatability));
        }
        assert!(accurate * 100 >= 90 * trials, "{accurate} of {trials}");
        assert!(repeatable * 100 >= 80 * trials, "{repeatable} of {trials}");
    }
}
