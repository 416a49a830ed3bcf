//! The method paper's robot: tables I and II, and the anchor values of the method.

mod support;

use support::{PaperCase, measure, normal, paper_deviations, random_configurations, seeded};
use trupose::identification::verification::ModelErrors;
use trupose::identification::{
    ArmModel, Estimator, Identification, Prior, Settings, SigmaSource, TerminationReason, Weighting, identify,
};
use trupose::units::{MICROMETRE, to_mm};

/// The paper's own way: all pairs alike, no prior, every sample counts.
fn paper_settings(iterations: usize) -> Settings {
    Settings {
        weighting: Weighting::Uniform,
        prior: Prior::None,
        estimator: Estimator::LeastSquares,
        iterations,
        sigma: Some((10.0 * MICROMETRE, SigmaSource::Instrument)),
    }
}

fn run(case: &PaperCase, settings: &Settings) -> Identification {
    identify(&case.problem(), settings, &mut |_| {}).unwrap()
}

#[test]
fn table_two_comes_back_entry_by_entry() {
    let case = PaperCase::simulated(&paper_deviations(), 56, 0.0, &mut seeded(1));
    let found = run(&case, &paper_settings(100));
    assert_eq!(found.termination, TerminationReason::Converged);
    assert_eq!(found.observability.rank, Some(21));
    for (estimate, truth) in found.estimates.iter().zip(&paper_deviations()) {
        let quantity = estimate.id.quantity();
        let (found, truth) = (quantity.to_edge(estimate.deviation), quantity.to_edge(*truth));
        println!("{} {found:.5} {truth:.5}", estimate.id);
    }
    for g in &found.observability.groups {
        println!("{}", g.description);
    }
    println!(
        "{:?} {:?} gap {:e}",
        found.observability.condition_number, found.observability.condition_number_raw, found.observability.gap
    );
}

#[test]
fn one_step_and_iterated() {
    for seed in 0..10 {
        let mut rng = seeded(seed);
        let case = PaperCase::simulated(&paper_deviations(), 56, 10.0 * MICROMETRE, &mut rng);
        let one = run(&case, &paper_settings(1));
        let all = run(&case, &paper_settings(100));
        let def =
            run(&case, &Settings { sigma: Some((10.0 * MICROMETRE, SigmaSource::Instrument)), ..Settings::default() });
        let est = run(&case, &Settings::default());
        let truth = ArmModel::with_deviations(&case.problem(), &paper_deviations());
        let fresh = measure(&truth, &random_configurations(500, &mut rng), 0.0, &mut rng);
        let dist = |f: &Identification| {
            let e = ModelErrors::new(&f.model, &f.base_from_station, &case.observations.points).unwrap();
            let v = ModelErrors::new(&f.model, &f.base_from_station, &fresh).unwrap();
            (to_mm(e.distance.unwrap().mean), to_mm(v.position.rms))
        };
        println!(
            "raw {:.0} k {:.1} one {:.4?} it {:.4?} ({}) def {:.4?} ({}) est {:.4?} ({}) sigma {:.2e} {}",
            all.observability.condition_number_raw.unwrap(),
            all.observability.condition_number.unwrap(),
            dist(&one),
            dist(&all),
            all.iterations.len(),
            dist(&def),
            def.iterations.len(),
            dist(&est),
            est.iterations.len(),
            est.sigma.used,
            est.rejected.len()
        );
        normal(&mut rng);
    }
}
