//! How good planned poses are, on the reference case: the figures of `docs/planning.md`, and what they must not fall below.
//! `TRUPOSE_PLANNING_TRIALS` sets the number of identifications per row, 1000 without it.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark that fails should say so; it measures time, and prints"
)]

#[path = "../tests/support/paper_case.rs"]
mod paper_case;
#[path = "../tests/support/reference_case.rs"]
mod reference_case;

use std::time::Instant;

use paper_case::{random_configurations, seeded};
use rand_chacha::ChaCha8Rng;
use reference_case::{CANDIDATES, Reference, SIGMA};
use trupose::identification::{Settings, SigmaSource};
use trupose::planning::{Chosen, DesignBound, Objective, Score, SearchSettings, Yardstick, trade_off};

fn trials() -> usize {
    let given = std::env::var_os("TRUPOSE_PLANNING_TRIALS");
    given.and_then(|text| text.to_str().and_then(|text| text.parse().ok())).unwrap_or(1000)
}

/// Searches with the default effort, and prints what comes out and when.
fn plan(reference: &Reference, objective: Objective, poses: usize) -> Chosen {
    let begin = Instant::now();
    let chosen = reference.plan(SearchSettings { objective, poses, ..SearchSettings::default() });
    println!(
        "{:>10} {:>4} poses: condition number {:6.2}, predicted error {:.4} sigma, {:5.2} s",
        format!("{objective:?}"),
        chosen.set.len(),
        chosen.figures.condition_number,
        chosen.figures.predicted_error,
        begin.elapsed().as_secs_f64()
    );
    chosen
}

/// What every objective reaches.
fn objectives(reference: &Reference) {
    for poses in [56, 40] {
        println!("random, {poses} poses: {:?}", Yardstick::new(&reference.information, poses, 500, 1).unwrap());
    }
    let balanced = plan(reference, Objective::Balanced, 56);
    assert!(balanced.figures.predicted_error <= 0.68 && balanced.figures.condition_number <= 68.0);
    let prediction = plan(reference, Objective::Prediction, 56);
    assert!(prediction.figures.predicted_error <= 0.65);
    assert!(balanced.figures.predicted_error <= 1.045 * prediction.figures.predicted_error);
    let condition = plan(reference, Objective::Condition, 56);
    assert!(condition.figures.condition_number <= 32.0 && condition.figures.predicted_error > 1.0);
    let d = plan(reference, Objective::D, 56);
    assert!(d.figures.predicted_error <= 0.68);

    let bound = DesignBound::new(&reference.information, &|| true);
    let efficiency = bound.efficiency(&reference.information, &d.set).unwrap();
    println!("D-efficiency {efficiency:.4}, bound to {:.4}", bound.gap);
    assert!(efficiency <= 1.0 && efficiency > 0.9);
}

/// How the predicted error falls with the number of poses.
fn numbers_of_poses(reference: &Reference) {
    let sizes: Vec<usize> = (2..=10).map(|tens| 10 * tens).collect();
    let begin = Instant::now();
    let table = trade_off(&reference.information, &[], &sizes, 1, &|| true).unwrap();
    for row in &table {
        println!("{:>4} poses: {:.4} sigma", row.poses, row.predicted_error);
    }
    println!("{:.2} s", begin.elapsed().as_secs_f64());
    assert!(table.windows(2).all(|pair| pair[1].predicted_error < pair[0].predicted_error));
    let of_40 = table.iter().find(|row| row.poses == 40).unwrap();
    assert!((of_40.predicted_error / 0.774 - 1.0).abs() < 0.02);
}

/// The predicted error against that of identifications.
fn predicted_against_found(reference: &Reference) {
    let trials = u32::try_from(trials()).unwrap().div_ceil(3);
    let mut rng = seeded(8);
    for set in [(0..56).collect::<Vec<_>>(), (500..530).collect()] {
        let predicted = Score::new(&reference.information, &set).unwrap().predicted_error;
        let found = reference.least_squares_error(&set, trials, &mut rng);
        println!("{} poses: predicted {predicted:.4} sigma, found {found:.4}", set.len());
        assert!((found / predicted - 1.0).abs() < 0.04);
    }
}

/// Median error (σ) at fresh poses of arms that were identified at `configurations`.
fn median_error(reference: &Reference, configurations: impl Fn(&mut ChaCha8Rng) -> Vec<Vec<f64>>) -> f64 {
    let settings = Settings { sigma: Some((SIGMA, SigmaSource::Option)), ..Settings::default() };
    let mut errors: Vec<f64> = (0..trials() as u64)
        .map(|trial| {
            // Every way of choosing meets the same arms and the same fresh poses.
            let mut rng = seeded(1000 + trial);
            let fresh = random_configurations(200, &mut rng);
            let poses = configurations(&mut seeded(trial));
            reference.verification_error(&settings, &poses, &fresh, &mut rng)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

/// What planning is for: error of the identified arm at fresh poses, by the way the measured poses were chosen.
fn planned_against_random(reference: &Reference) {
    let random = median_error(reference, |rng| random_configurations(56, rng));
    println!("random, 56 poses: {random:.4} sigma");
    let against_random = |objective, poses| {
        let chosen = plan(reference, objective, poses);
        let configurations = reference.configurations(&chosen.set);
        let error = median_error(reference, |_| configurations.clone());
        println!("{objective:?}, {poses} poses: {error:.4} sigma ({:+.1} %)", 100.0 * (error / random - 1.0));
        error / random
    };
    assert!(against_random(Objective::Balanced, 56) <= 0.92);
    assert!(against_random(Objective::Prediction, 56) <= 0.88);
    assert!(against_random(Objective::D, 56) <= 0.92);
    assert!(against_random(Objective::Balanced, 46) <= 1.0);
    assert!(against_random(Objective::Condition, 56) > 1.0);
}

fn main() {
    let reference = Reference::new(CANDIDATES);
    objectives(&reference);
    numbers_of_poses(&reference);
    predicted_against_found(&reference);
    planned_against_random(&reference);
}
