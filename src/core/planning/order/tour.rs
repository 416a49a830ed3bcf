//! Short tours: visit all nodes once, begin and end at node 0. Times are symmetric.

/// Symmetric times between nodes (s).
#[derive(Clone, Debug)]
pub(super) struct Times {
    count: usize,
    values: Vec<f64>,
}

impl Times {
    pub(super) fn new(count: usize, time: impl Fn(usize, usize) -> f64) -> Self {
        let values = (0..count * count).map(|place| time(place / count, place % count)).collect();
        Self { count, values }
    }

    pub(super) fn get(&self, a: usize, b: usize) -> f64 {
        self.values.get(a * self.count + b).copied().unwrap_or(f64::INFINITY)
    }

    pub(super) fn set(&mut self, a: usize, b: usize, time: f64) {
        for place in [a * self.count + b, b * self.count + a] {
            if let Some(value) = self.values.get_mut(place) {
                *value = time;
            }
        }
    }
}

/// A set of unordered pairs of nodes.
#[derive(Clone, Debug)]
pub(super) struct Pairs {
    count: usize,
    members: Vec<bool>,
}

impl Pairs {
    pub(super) fn new(count: usize) -> Self {
        Self { count, members: vec![false; count * count] }
    }

    fn place(&self, a: usize, b: usize) -> usize {
        a.min(b) * self.count + a.max(b)
    }

    pub(super) fn contains(&self, a: usize, b: usize) -> bool {
        self.members.get(self.place(a, b)).copied().unwrap_or(false)
    }

    /// Whether the pair is new.
    pub(super) fn insert(&mut self, a: usize, b: usize) -> bool {
        let place = self.place(a, b);
        self.members.get_mut(place).is_some_and(|member| !std::mem::replace(member, true))
    }
}

/// Always on to the nearest node that was not visited.
pub(super) fn nearest_neighbour(times: &Times) -> Vec<usize> {
    let mut left: Vec<usize> = (1..times.count).collect();
    let mut visits = vec![0];
    let mut at = 0;
    while let Some(place) = (0..left.len()).min_by(|&a, &b| times.get(at, left[a]).total_cmp(&times.get(at, left[b]))) {
        at = left.remove(place);
        visits.push(at);
    }
    visits
}

/// The moves of a tour, the one back to its beginning last.
pub(super) fn legs(visits: &[usize]) -> Vec<(usize, usize)> {
    let next = visits.iter().skip(1).chain(visits.first());
    visits.iter().copied().zip(next.copied()).filter(|(a, b)| a != b).collect()
}

/// Least gain that counts (s): keeps rounding from going round in circles.
const LEAST_GAIN: f64 = 1e-9;

/// Reverses parts (2-opt) and moves parts of up to three nodes elsewhere (or-opt) while that makes the tour shorter.
/// Node 0 stays first.
pub(super) fn improve(visits: &mut Vec<usize>, times: &Times) {
    while reverse_a_part(visits, times) || move_a_part(visits, times) {}
}

/// One round of 2-opt; whether something was gained.
fn reverse_a_part(visits: &mut [usize], times: &Times) -> bool {
    let count = visits.len();
    let mut is_better = false;
    for first in 1..count {
        for last in first + 1..count {
            let (before, after) = (visits[first - 1], visits[(last + 1) % count]);
            let (a, b) = (visits[first], visits[last]);
            let gain = times.get(before, a) + times.get(b, after) - times.get(before, b) - times.get(a, after);
            if gain > LEAST_GAIN {
                visits[first..=last].reverse();
                is_better = true;
            }
        }
    }
    is_better
}

/// One round of or-opt; whether something was gained.
fn move_a_part(visits: &mut Vec<usize>, times: &Times) -> bool {
    let count = visits.len();
    let mut is_better = false;
    for length in 1..=3 {
        for first in 1..(count + 1).saturating_sub(length) {
            let (a, b) = (visits[first], visits[first + length - 1]);
            let (before, after) = (visits[first - 1], visits[(first + length) % count]);
            let taken_out = times.get(before, a) + times.get(b, after) - times.get(before, after);
            let mut rest: Vec<usize> = visits.clone();
            let part: Vec<usize> = rest.drain(first..first + length).collect();
            // Place after which the part goes, and whether it is turned round.
            let places = (0..rest.len()).flat_map(|place| [(place, false), (place, true)]);
            let put_in = |(place, turned): (usize, bool)| {
                let (from, to) = (rest[place], rest[(place + 1) % rest.len()]);
                let (a, b) = if turned { (b, a) } else { (a, b) };
                times.get(from, a) + times.get(b, to) - times.get(from, to)
            };
            let Some(best) = places.min_by(|x, y| put_in(*x).total_cmp(&put_in(*y))) else { continue };
            if put_in(best) < taken_out - LEAST_GAIN {
                let (place, turned) = best;
                let ordered: Vec<usize> = if turned { part.into_iter().rev().collect() } else { part };
                let behind = rest.split_off(place + 1);
                rest.extend(ordered.into_iter().chain(behind));
                *visits = rest;
                is_better = true;
            }
        }
    }
    is_better
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length(visits: &[usize], times: &Times) -> f64 {
        legs(visits).into_iter().map(|(a, b)| times.get(a, b)).sum()
    }

    /// On a circle the shortest tour goes round it.
    #[test]
    fn points_on_a_circle_are_visited_in_turn() {
        // Places in a scrambled order, node 0 at place 0.
        let places: Vec<f64> = (0..23).map(|node| f64::from(node * 7 % 23)).collect();
        let angle = |node: usize| places[node] * std::f64::consts::TAU / 23.0;
        let times = Times::new(23, |a, b| 2.0 * ((angle(a) - angle(b)) / 2.0).sin().abs());
        let mut visits = nearest_neighbour(&times);
        improve(&mut visits, &times);
        let shortest = 23.0 * 2.0 * (std::f64::consts::PI / 23.0).sin();
        assert!((length(&visits, &times) - shortest).abs() < 1e-9, "{visits:?}");
        assert_eq!(visits[0], 0);
    }

    #[test]
    fn small_tours_are_optimal_up_to_a_few_percent() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        for _ in 0..20 {
            let points: Vec<(f64, f64)> = (0..7).map(|_| (random(), random())).collect();
            let times = Times::new(7, |a, b| (points[a].0 - points[b].0).hypot(points[a].1 - points[b].1));
            let mut visits = nearest_neighbour(&times);
            improve(&mut visits, &times);
            let mut sorted = visits.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..7).collect::<Vec<_>>());
            let mut best = f64::INFINITY;
            permutations(&mut vec![0], 7, &mut |tour| best = best.min(length(tour, &times)));
            assert!(length(&visits, &times) <= 1.05 * best);
        }
    }

    fn permutations(tour: &mut Vec<usize>, count: usize, visit: &mut impl FnMut(&[usize])) {
        if tour.len() == count {
            visit(tour);
            return;
        }
        for node in 1..count {
            if !tour.contains(&node) {
                tour.push(node);
                permutations(tour, count, visit);
                tour.pop();
            }
        }
    }

    #[test]
    fn a_single_node_is_no_trouble() {
        let times = Times::new(1, |_, _| 0.0);
        let mut visits = nearest_neighbour(&times);
        improve(&mut visits, &times);
        assert_eq!(visits, [0]);
        assert!(legs(&visits).is_empty());
    }
}
