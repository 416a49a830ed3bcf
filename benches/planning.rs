//! Speed of pose planning on one core: the paper's robot, 1 mm and 0.1° expected.

#![expect(clippy::unwrap_used, reason = "a benchmark that fails should say so")]

#[path = "../tests/support/paper_case.rs"]
mod paper_case;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use paper_case::{paper_chain, paper_parameters, paper_target, random_configurations, seeded};
use trupose::kinematics::{Arm, FreeParameter, ParameterUnit, Place};
use trupose::planning::{DesignBound, Information, Objective, Score, Search, SearchSettings, Yardstick, trade_off};
use trupose::units::{DEGREE, MILLIMETRE};

fn main() {
    divan::main();
}

fn places(count: usize, seed: u64) -> Vec<Place> {
    let configurations = random_configurations(count, &mut seeded(seed));
    configurations.into_iter().map(|configuration| Place { configuration, target: 0 }).collect()
}

fn information(candidates: &[Place]) -> Information {
    let model = Arm { chain: paper_chain(), targets: vec![paper_target()] };
    let expected = |parameter: FreeParameter| FreeParameter {
        expected: if parameter.id.unit() == ParameterUnit::Millimetre { MILLIMETRE } else { 0.1 * DEGREE },
        ..parameter
    };
    let parameters: Vec<_> = paper_parameters().into_iter().map(expected).collect();
    Information::new(&model, &parameters, candidates, &places(2000, 2)).unwrap()
}

/// Points, Jacobians, rank and reduction of a pool.
#[divan::bench(args = [1500, 10_000])]
fn information_of_pool(bencher: Bencher<'_, '_>, count: usize) {
    let candidates = places(count, 1);
    bencher.counter(ItemsCount::new(count)).bench_local(|| information(black_box(&candidates)));
}

/// Every figure of one set of 56.
#[divan::bench]
fn score_of_56(bencher: Bencher<'_, '_>) {
    let information = information(&places(1500, 1));
    let set: Vec<usize> = (0..56).collect();
    bencher.bench_local(|| Score::new(&information, black_box(&set)));
}

/// Two sweeps of one start: candidates judged per second (56 places, 1444 candidates each).
#[divan::bench(args = [Objective::Condition, Objective::Prediction, Objective::D, Objective::O1, Objective::O3, Objective::O5])]
fn candidates_judged(bencher: Bencher<'_, '_>, objective: Objective) {
    let information = information(&places(1500, 1));
    let search =
        Search::new(&information, SearchSettings { objective, starts: 1, sweeps: 2, ..Default::default() }).unwrap();
    let sweeps = search.settings().sweeps_of(search.first_stage());
    bencher.counter(ItemsCount::new(sweeps * 56 * 1444)).bench_local(|| search.run(&|| true, &|_| {}));
}

/// The whole plan: pool, balanced set of 56, score, bound, 500 random sets, nine sizes.
#[divan::bench(args = [1500, 10_000], sample_count = 3, sample_size = 1)]
fn whole_plan(bencher: Bencher<'_, '_>, count: usize) {
    let candidates = places(count, 1);
    let sizes: Vec<usize> = (2..=10).map(|tens| 10 * tens).collect();
    bencher.bench_local(|| {
        let information = information(black_box(&candidates));
        let chosen = Search::new(&information, SearchSettings::default()).unwrap().run(&|| true, &|_| {}).unwrap();
        let score = Score::new(&information, &chosen.set).unwrap();
        let efficiency = DesignBound::new(&information, &|| true).efficiency(&information, &chosen.set).unwrap();
        let yardstick = Yardstick::new(&information, 56, 500, 1).unwrap();
        let table = trade_off(&information, &[], &sizes, 1, &|| true).unwrap();
        (score, efficiency, yardstick, table)
    });
}
