//! Poses for verification: spread over the same space as the identification set, none of them in it.
//!
//! Distance between two candidates: root mean square of the joint differences relative to the limits, and the distance of
//! their SMR positions in parts of the size of the candidates' cloud, both together.

use nalgebra::Point3;

use super::candidates::Candidate;

/// Chooses `count` of the `candidates` as far as possible from each other and from the ones at the places `taken`, which are
/// never chosen (farthest-first traversal: Gonzalez 1985; at most a factor two from the best possible smallest distance).
/// `limits` are those of the joints.
///
/// Returns places in `candidates`, in the order of choice: every beginning of the list is spread too. Fewer than `count`
/// when there are no more; copies of a taken or chosen candidate are never chosen.
pub fn choose(candidates: &[Candidate], taken: &[usize], limits: &[(f64, f64)], count: usize) -> Vec<usize> {
    let space = Space::new(candidates, limits);
    let mut gaps: Vec<f64> = candidates.iter().map(|candidate| space.distance_to_middle(candidate)).collect();
    if taken.is_empty() {
        // Nothing to keep away from: begin in the middle, go on from there.
        let Some(first) = smallest(&gaps) else { return Vec::new() };
        return farthest_first(candidates, &space, vec![f64::INFINITY; candidates.len()], Some(first), count);
    }
    gaps.fill(f64::INFINITY);
    for other in taken.iter().filter_map(|&place| candidates.get(place)) {
        space.narrow(&mut gaps, candidates, other);
    }
    farthest_first(candidates, &space, gaps, None, count)
}

fn farthest_first(
    candidates: &[Candidate],
    space: &Space<'_>,
    mut gaps: Vec<f64>,
    first: Option<usize>,
    count: usize,
) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut next = first;
    while chosen.len() < count {
        let farthest = || largest(&gaps).filter(|&place| gaps.get(place).is_some_and(|gap| *gap > 0.0));
        let Some(place) = next.take().or_else(farthest) else { break };
        let Some(candidate) = candidates.get(place) else { break };
        chosen.push(place);
        space.narrow(&mut gaps, candidates, candidate);
    }
    chosen
}

fn largest(values: &[f64]) -> Option<usize> {
    // From the back: of equals the first counts.
    values.iter().enumerate().rev().max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(place, _)| place)
}

fn smallest(values: &[f64]) -> Option<usize> {
    values.iter().enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(place, _)| place)
}

/// The scales of the distance.
struct Space<'a> {
    limits: &'a [(f64, f64)],
    middle: Point3<f64>,
    /// Size of the cloud of SMR positions (m): twice the root mean square distance from its middle.
    size: f64,
}

impl<'a> Space<'a> {
    fn new(candidates: &[Candidate], limits: &'a [(f64, f64)]) -> Self {
        let count = candidates.len().max(1) as f64;
        let points = || candidates.iter().map(|candidate| candidate.point_in_base);
        let middle = Point3::from(points().map(|point| point.coords).sum::<nalgebra::Vector3<f64>>() / count);
        let spread = (points().map(|point| (point - middle).norm_squared()).sum::<f64>() / count).sqrt();
        let size = if spread > 0.0 { 2.0 * spread } else { 1.0 };
        Self { limits, middle, size }
    }

    fn distance(&self, one: (&[f64], &Point3<f64>), other: (&[f64], &Point3<f64>)) -> f64 {
        let joints = one.0.iter().zip(other.0).zip(self.limits);
        let squares: f64 = joints.map(|((a, b), (low, high))| ((a - b) / (high - low)).powi(2)).sum();
        (squares / self.limits.len().max(1) as f64 + ((one.1 - other.1) / self.size).norm_squared()).sqrt()
    }

    fn distance_to_middle(&self, candidate: &Candidate) -> f64 {
        let middle: Vec<f64> = self.limits.iter().map(|(low, high)| f64::midpoint(*low, *high)).collect();
        self.distance((&candidate.configuration, &candidate.point_in_base), (&middle, &self.middle))
    }

    /// Narrows the gap of every candidate to what `other` leaves it.
    fn narrow(&self, gaps: &mut [f64], candidates: &[Candidate], other: &Candidate) {
        for (gap, candidate) in gaps.iter_mut().zip(candidates) {
            let one = (candidate.configuration.as_slice(), &candidate.point_in_base);
            *gap = gap.min(self.distance(one, (&other.configuration, &other.point_in_base)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One joint, places on a line.
    fn line(places: &[f64]) -> Vec<Candidate> {
        let candidate = |&q: &f64| Candidate { configuration: vec![q], point_in_base: Point3::new(q, 0.0, 0.0) };
        places.iter().map(candidate).collect()
    }

    const LIMITS: [(f64, f64); 1] = [(0.0, 10.0)];

    #[test]
    fn gaps_are_filled_and_taken_ones_left_alone() {
        let candidates = line(&[0.0, 1.0, 4.0, 5.0, 6.0, 9.0, 10.0, 5.0]);
        assert_eq!(choose(&candidates, &[0, 6], &LIMITS, 1), [3]);
        let all = choose(&candidates, &[0, 6], &LIMITS, 20);
        assert_eq!(all.len(), 5, "neither the taken ones nor a second copy: {all:?}");
        assert!(!all.contains(&0) && !all.contains(&6) && !all.contains(&7));
    }

    #[test]
    fn without_taken_ones_it_begins_in_the_middle_and_goes_to_the_ends() {
        let candidates = line(&[0.0, 2.0, 4.5, 5.0, 7.0, 10.0]);
        assert_eq!(choose(&candidates, &[], &LIMITS, 3), [3, 0, 5]);
        assert!(choose(&[], &[], &LIMITS, 3).is_empty());
    }
}
