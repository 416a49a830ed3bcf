//! The method paper's robot: tables I and II, and the anchor values of the method.

use crate::support::paper_case::{PaperCase, measure, paper_deviations, random_configurations, seeded};
use trupose::identification::verification::ModelErrors;
use trupose::identification::{
    Estimator, Identification, Prior, Settings, SigmaSource, TerminationReason, Weighting, identify,
};
use trupose::kinematics::{Axis, LinkParameter, ParameterId};
use trupose::units::{MICROMETRE, to_mm};

const NOISE: f64 = 10.0 * MICROMETRE;

/// The paper's own way: all pairs alike, no prior, every sample counts.
fn paper_settings(iterations: usize) -> Settings {
    Settings {
        weighting: Weighting::Uniform,
        prior: Prior::None,
        estimator: Estimator::LeastSquares,
        iterations,
        sigma: Some((NOISE, SigmaSource::Instrument)),
    }
}

fn default_settings() -> Settings {
    Settings { sigma: Some((NOISE, SigmaSource::Instrument)), ..Settings::default() }
}

fn run(case: &PaperCase, settings: &Settings) -> Identification {
    identify(&case.problem(), settings, &mut |_| {}).unwrap()
}

/// Mean distance error over all pairs of the identification set (mm): the paper's own in-sample figure.
fn in_sample_distance_error(case: &PaperCase, found: &Identification) -> f64 {
    let errors = ModelErrors::new(&found.arm, &found.base_from_station, &case.observations.points).unwrap();
    to_mm(errors.distance.unwrap().mean)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn table_two_comes_back_entry_by_entry() {
    let case = PaperCase::simulated(&paper_deviations(), 56, 0.0, &mut seeded(1));
    for weighting in [Weighting::Uniform, Weighting::Covariance] {
        let found = run(&case, &Settings { weighting, ..paper_settings(100) });
        assert_eq!(found.termination, TerminationReason::Converged);
        for (estimate, truth) in found.estimates.iter().zip(&paper_deviations()) {
            let unit = estimate.id.unit();
            let (deviation, truth) = (unit.to_edge(estimate.deviation), unit.to_edge(*truth));
            // Half a unit of the last printed digit (four decimals).
            assert!((deviation - truth).abs() < 5e-5, "{} {deviation} {truth} {}", estimate.id, unit);
        }
    }
}

#[test]
fn rank_and_blind_directions_of_the_papers_robot() {
    let mut case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(1));
    let found = run(&case, &default_settings());
    assert_eq!((found.estimates.len(), found.observability.rank), (25, Some(21)));
    assert!(found.observability.gap > 1e9);
    let said: Vec<&str> = found.observability.groups.iter().map(|group| group.description.as_str()).collect();
    assert_eq!(said[0], "d1: cannot be found from distances, it only moves the robot's base frame");
    assert_eq!(said[1], "theta1: cannot be found from distances, it only moves the robot's base frame");
    assert_eq!(said[2], "d2 and d3: only their sum");
    assert!(said[3].starts_with("alpha6, a6, d6 and theta6: cannot be told apart along"), "{}", said[3]);
    assert_eq!(said.len(), 4);
    let alone: Vec<String> =
        found.estimates.iter().filter(|e| !e.identifiable).map(|estimate| estimate.id.to_string()).collect();
    assert_eq!(alone, ["d1", "theta1", "d2", "d3", "alpha6", "a6", "d6", "theta6"]);

    // With the target free as well, its three coordinates add nothing that the last link does not already move.
    let free = Axis::ALL
        .map(|axis| trupose::kinematics::FreeParameter { id: ParameterId::Target { target: 0, axis }, expected: 0.05 });
    case.parameters.extend(free);
    assert_eq!(run(&case, &default_settings()).observability.rank, Some(21));

    // Without beta, the common normal of axes 2 and 3 hides the error of their parallelism: one combination less.
    case.parameters.retain(|p| p.id != ParameterId::Link { joint: 1, parameter: LinkParameter::Beta });
    case.parameters.truncate(24);
    assert_eq!(run(&case, &default_settings()).observability.rank, Some(20));
}

#[test]
fn one_step_leaves_a_tenth_of_a_millimetre_and_iteration_reaches_the_noise() {
    let (mut one, mut iterated, mut raw) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..21 {
        let case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(seed));
        one.push(in_sample_distance_error(&case, &run(&case, &paper_settings(1))));
        let found = run(&case, &paper_settings(100));
        iterated.push(in_sample_distance_error(&case, &found));
        raw.push(found.observability.condition_number_raw.unwrap());
    }
    // Published range of sets of 56 random poses; one set in twenty is luckier.
    let usual = raw.iter().filter(|condition| (11_000.0..16_000.0).contains(*condition)).count();
    assert!(usual >= 19, "{raw:?}");
    // The paper reports 0.103 mm after its single step; published range for random poses 0.08–0.11.
    let (one, iterated) = (median(one), median(iterated));
    assert!((0.08..=0.11).contains(&one), "{one}");
    assert!((0.009..=0.011).contains(&iterated), "{iterated}");
}

/// The Cramér–Rao bound for distances: covariance of any unbiased estimate from 56 points with independent noise, frame
/// included, carried over to fresh points. Computed here from scratch, with difference quotients and the frame as six
/// explicit unknowns, and compared with what identification achieves with default settings.
#[test]
fn default_settings_reach_the_cramer_rao_bound() {
    use nalgebra::{DMatrix, DVector, Vector3};
    const TRIALS: u64 = 200;
    let (mut achieved, mut uniform, mut bound) = (0.0, 0.0, 0.0);
    for seed in 0..TRIALS {
        let mut rng = seeded(seed);
        let case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut rng);
        let truth = case.problem().arm_with(&paper_deviations());
        let fresh = measure(&truth, &random_configurations(100, &mut rng), 0.0, &mut rng);
        for (settings, sum) in [
            (default_settings(), &mut achieved),
            (Settings { weighting: Weighting::Uniform, ..default_settings() }, &mut uniform),
        ] {
            let found = run(&case, &settings);
            let errors = ModelErrors::new(&found.arm, &found.base_from_station, &fresh).unwrap();
            *sum += errors.position.rms.powi(2) / TRIALS as f64;
        }
        if seed >= 20 {
            continue;
        }
        // Rows of d(point in base)/d(parameters, frame) at the truth.
        let problem = case.problem();
        let count = problem.parameters.len() + 6;
        let rows = |points: &[trupose::identification::PointSample]| {
            let mut matrix = DMatrix::zeros(3 * points.len(), count);
            for column in 0..problem.parameters.len() {
                let step = 1e-6;
                let shifted = |sign: f64| {
                    let mut x = paper_deviations();
                    x[column] += sign * step;
                    problem.arm_with(&x).points_in_base(points.iter().map(|s| &s.at))
                };
                let (plus, minus) = (shifted(1.0), shifted(-1.0));
                for (index, (a, b)) in plus.iter().zip(&minus).enumerate() {
                    matrix.view_mut((3 * index, column), (3, 1)).copy_from(&((a - b) / (2.0 * step)));
                }
            }
            for (index, point) in truth.points_in_base(points.iter().map(|s| &s.at)).iter().enumerate() {
                for axis in 0..3 {
                    let mut unit = Vector3::zeros();
                    unit[axis] = 1.0;
                    let column = problem.parameters.len() + axis;
                    matrix.view_mut((3 * index, column), (3, 1)).copy_from(&unit);
                    matrix.view_mut((3 * index, column + 3), (3, 1)).copy_from(&unit.cross(&point.coords));
                }
            }
            matrix
        };
        let scale = DVector::from_iterator(
            count,
            problem.parameters.iter().map(|parameter| parameter.expected).chain([1e-3; 6]),
        );
        let information = rows(&case.observations.points) * DMatrix::from_diagonal(&scale);
        let fresh_rows = rows(&fresh) * DMatrix::from_diagonal(&scale);
        let svd = information.svd(false, true);
        let v_t = svd.v_t.unwrap();
        let largest = svd.singular_values.max();
        let mut variance = 0.0;
        for (index, value) in svd.singular_values.iter().enumerate() {
            if *value > 1e-7 * largest {
                let direction = v_t.row(index).transpose();
                variance += (&fresh_rows * direction).norm_squared() / (value * value);
            }
        }
        bound += NOISE * NOISE * variance / fresh.len() as f64 / 20.0;
    }
    let ratio = (achieved / bound).sqrt();
    let loss = (uniform / achieved).sqrt() - 1.0;
    println!(
        "verification rms {:.3} um, bound {:.3} um, ratio {ratio:.4}; uniform weighting loses {:.1} %",
        1e6 * achieved.sqrt(),
        1e6 * bound.sqrt(),
        100.0 * loss
    );
    assert!((0.95..1.03).contains(&ratio), "{ratio}");
    assert!(loss > 0.02, "uniform weighting must be worse: {loss}");
}
