//! Speed of kinematics and identification on one core.

#![expect(clippy::unwrap_used, reason = "a failure of a test or benchmark is a panic")]

#[path = "../tests/support/paper_case.rs"]
mod paper_case;

use divan::{Bencher, black_box};
use paper_case::{PaperCase, paper_deviations, paper_parameters, random_configurations, seeded};
use trupose::identification::{Identification, Observability, Settings, SigmaSource, Weighting, identify};
use trupose::kinematics::{IdentificationJacobian, Place};
use trupose::units::MICROMETRE;

fn main() {
    divan::main();
}

fn case(poses: usize) -> PaperCase {
    PaperCase::simulated(&paper_deviations(), poses, 10.0 * MICROMETRE, &mut seeded(1))
}

fn run(case: &PaperCase, settings: &Settings) -> Identification {
    identify(&case.problem(), settings, &mut |_| {}).unwrap()
}

fn instrument(weighting: Weighting) -> Settings {
    Settings { weighting, sigma: Some((10.0 * MICROMETRE, SigmaSource::Instrument)), ..Settings::default() }
}

/// Forward kinematics and the 3 × 25 Jacobian of one pose.
#[divan::bench]
fn forward_and_jacobian(bencher: Bencher<'_, '_>) {
    let PaperCase { arm, .. } = PaperCase::new(Vec::new());
    let arm = arm.prepared();
    let ids: Vec<_> = paper_parameters().iter().map(|parameter| parameter.id).collect();
    let mut jacobian = IdentificationJacobian::new(&ids);
    let place = Place { configuration: random_configurations(1, &mut seeded(1)).remove(0), target: 0 };
    let mut rows = vec![0.0; 3 * ids.len()];
    bencher.bench_local(|| jacobian.at(&arm, black_box(&place), &mut rows));
}

/// Rank, blind directions and condition numbers of a set.
#[divan::bench(args = [56, 1000])]
fn observability(bencher: Bencher<'_, '_>, poses: usize) {
    let case = case(poses);
    bencher.bench_local(|| Observability::new(&case.problem()));
}

/// Whole identification with the default settings and the σ of the instrument.
#[divan::bench(args = [56, 1000, 12_000, 100_000], sample_count = 10)]
fn identify_covariance(bencher: Bencher<'_, '_>, poses: usize) {
    let case = case(poses);
    bencher.bench_local(|| run(&case, &instrument(Weighting::Covariance)));
}

/// The same with σ estimated from the residuals.
#[divan::bench(args = [56, 1000])]
fn identify_estimated_sigma(bencher: Bencher<'_, '_>, poses: usize) {
    let case = case(poses);
    bencher.bench_local(|| run(&case, &Settings::default()));
}

/// Whole identification, all pairs alike.
#[divan::bench(args = [56, 200], sample_count = 20)]
fn identify_uniform(bencher: Bencher<'_, '_>, poses: usize) {
    let case = case(poses);
    bencher.bench_local(|| run(&case, &instrument(Weighting::Uniform)));
}

/// One step over all 499,500 pairs of 1000 points (two linearisations).
#[divan::bench(sample_count = 10)]
fn uniform_1000_one_step(bencher: Bencher<'_, '_>) {
    let case = case(1000);
    let settings = Settings { iterations: 1, ..instrument(Weighting::Uniform) };
    bencher.bench_local(|| run(&case, &settings));
}
