//! Speed of the geometric part of planning: candidates judged, moves checked, poses ordered. The paper's robot.

#![expect(clippy::unwrap_used, reason = "a benchmark stops when its case is broken")]

use divan::Bencher;
use divan::counter::ItemsCount;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::planning::candidates::CandidateFilter;
use trupose::planning::collision::DEFAULT_CLEARANCE;
use trupose::planning::order::{Pace, Stops, home_pose, order};
use trupose::planning::{Cell, verification_set};
use trupose::profile::{Profile, builtin};

#[path = "../tests/support/cell_of.rs"]
mod cell_of;
use cell_of::cell;

fn main() {
    divan::main();
}

fn profile() -> Profile {
    Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0
}

fn configurations(cell: &Cell, count: usize) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| cell.limits.iter().map(|(low, high)| rng.random_range(*low..*high)).collect()).collect()
}

/// Configurations judged by all rules.
#[divan::bench]
fn judge_10000(bencher: Bencher<'_, '_>) {
    let profile = profile();
    let cell = cell(&profile);
    let filter = CandidateFilter::new(profile.chain(), &cell, DEFAULT_CLEARANCE).unwrap();
    let configurations = configurations(&cell, 10_000);
    bencher
        .counter(ItemsCount::new(configurations.len()))
        .bench(|| filter.collect(configurations.iter().cloned(), usize::MAX));
}

/// The route through so many poses, every move checked.
#[divan::bench(args = [30, 60, 100])]
fn order_poses(bencher: Bencher<'_, '_>, count: usize) {
    let profile = profile();
    let cell = cell(&profile);
    let filter = CandidateFilter::new(profile.chain(), &cell, DEFAULT_CLEARANCE).unwrap();
    let found = filter.collect(configurations(&cell, 10_000), 400).kept;
    let chosen = verification_set::choose(&found, &[], &cell.limits, count);
    let poses: Vec<Vec<f64>> = chosen.iter().map(|&place| found[place].configuration.clone()).collect();
    let home = home_pose(filter.shape(), []).unwrap();
    let stops = Stops { home: &home, poses: &poses, vias: &[], drift_every: Some(10) };
    bencher.bench(|| order(filter.shape(), &stops, &Pace::default()).unwrap());
}
