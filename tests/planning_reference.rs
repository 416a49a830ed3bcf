//! Pose planning on the reference case: the paper's robot, 1 mm and 0.1° for every length and angle, 1500 random candidates,
//! SMR position known, instrument frame free.
//!
//! Budgets are numbers of starts and sweeps, not clocks; times are printed for the reader (`--nocapture`).

#![expect(clippy::print_stdout, reason = "clippy's exception for tests does not reach their helpers")]

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::support::paper_case::{
    measure, normal, paper_chain, paper_parameters, paper_target, random_configurations, seeded,
};
use nalgebra::DVector;
use rand::seq::SliceRandom as _;
use trupose::identification::verification::ModelErrors;
use trupose::identification::{
    Estimator, Observability, Observations, PointSample, Prior, Problem, Settings, SigmaSource, identify,
};
use trupose::kinematics::{Arm, FreeParameter, Place};
use trupose::planning::{
    Chosen, DesignBound, Information, Objective, PlanningError, Score, Search, SearchSettings, TradeOff, Yardstick,
    trade_off,
};
use trupose::search::plan_in_parallel;
use trupose::units::{DEGREE, MICROMETRE, MILLIMETRE, Quantity};

const CANDIDATES: usize = 1500;
const FRESH: usize = 5000;

/// The reference case.
struct Reference {
    model: Arm,
    parameters: Vec<FreeParameter>,
    candidates: Vec<Place>,
    information: Information,
}

fn places(configurations: Vec<Vec<f64>>) -> Vec<Place> {
    configurations.into_iter().map(|configuration| Place { configuration, target: 0 }).collect()
}

impl Reference {
    fn new(candidates: usize) -> Self {
        let model = Arm { chain: paper_chain(), targets: vec![paper_target()] };
        let mut parameters = paper_parameters();
        for parameter in &mut parameters {
            parameter.expected = match parameter.id.quantity() {
                Quantity::Length => MILLIMETRE,
                Quantity::Angle => 0.1 * DEGREE,
            };
        }
        let candidates = places(random_configurations(candidates, &mut seeded(1)));
        let fresh = places(random_configurations(FRESH, &mut seeded(2)));
        let information = Information::new(&model, &parameters, &candidates, &fresh).unwrap();
        Self { model, parameters, candidates, information }
    }

    /// Searches on all the cores there are and prints what came out and when.
    fn plan(&self, settings: SearchSettings) -> Chosen {
        let search = Search::new(&self.information, settings).unwrap();
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let begin = now();
        let chosen = plan_in_parallel(&search, threads, &|| true, &|_| {}).unwrap();
        println!(
            "{:>10} {:>4} poses: condition number {:6.2}, predicted error {:.4} sigma, {:5.2} s",
            format!("{:?}", search.settings().objective),
            chosen.set.len(),
            chosen.figures.condition_number,
            chosen.figures.predicted_error,
            begin.elapsed().as_secs_f64()
        );
        chosen
    }

    fn objective(&self, objective: Objective) -> Chosen {
        self.plan(SearchSettings { objective, ..SearchSettings::default() })
    }

    /// Configurations of a set.
    fn configurations(&self, set: &[usize]) -> Vec<Vec<f64>> {
        set.iter().map(|&pose| self.candidates[pose].configuration.clone()).collect()
    }

    /// An arm with random deviations of the expected size.
    fn truth(&self, rng: &mut rand_chacha::ChaCha8Rng) -> Arm {
        let deviations = self.parameters.iter().map(|parameter| normal(rng) * parameter.expected);
        let deviations = DVector::from_iterator(self.parameters.len(), deviations);
        self.problem(&Observations::default()).arm_with(&deviations)
    }

    fn problem<'a>(&'a self, observations: &'a Observations) -> Problem<'a> {
        Problem { arm: &self.model, parameters: &self.parameters, observations }
    }

    /// RMS position error (in σ) at `fresh` configurations, registration included, after identification from noisy points.
    fn verification_error(
        &self,
        settings: &Settings,
        configurations: &[Vec<f64>],
        fresh: &[Vec<f64>],
        rng: &mut rand_chacha::ChaCha8Rng,
    ) -> f64 {
        let truth = self.truth(rng);
        let points = measure(&truth, configurations, SIGMA, rng);
        let observations = Observations { points, ..Observations::default() };
        let found = identify(&self.problem(&observations), settings, &mut |_| {}).unwrap();
        let truth: Vec<PointSample> = measure(&truth, fresh, 0.0, rng);
        ModelErrors::new(&found.arm, &found.base_from_station, &truth).unwrap().position.rms / SIGMA
    }
}

/// Standard deviation of a measured coordinate in the simulations (m).
const SIGMA: f64 = 10.0 * MICROMETRE;

#[expect(clippy::disallowed_methods, reason = "times are printed for the reader; nothing depends on them")]
fn now() -> Instant {
    Instant::now()
}

#[test]
fn random_sets_score_as_the_prototype_found() {
    let reference = Reference::new(CANDIDATES);
    assert_eq!(reference.information.rank(), 21);
    let of_56 = Yardstick::new(&reference.information, 56, 500, 1).unwrap();
    let of_40 = Yardstick::new(&reference.information, 40, 500, 1).unwrap();
    println!("random 56: {of_56:?}\nrandom 40: {of_40:?}");
    let near = |value: f64, expected: f64, share: f64| (value / expected - 1.0).abs() < share;
    assert!(near(of_56.conditions.median, 92.0, 0.05));
    assert!(near(of_56.conditions.best, 82.0, 0.05));
    assert!(near(of_56.errors.median, 0.75, 0.03));
    assert!(near(of_40.errors.median, 0.93, 0.03));
}

#[test]
fn the_objectives_reach_what_they_must() {
    let reference = Reference::new(CANDIDATES);
    let balanced = reference.objective(Objective::Balanced);
    assert!(balanced.figures.predicted_error <= 0.68 && balanced.figures.condition_number <= 68.0, "{balanced:?}");
    let prediction = reference.objective(Objective::Prediction);
    assert!(prediction.figures.predicted_error <= 0.65, "{prediction:?}");
    assert!(balanced.figures.predicted_error <= 1.045 * prediction.figures.predicted_error);
    let condition = reference.objective(Objective::Condition);
    assert!(condition.figures.condition_number <= 32.0, "{condition:?}");
    // That is the trap: the best condition number predicts worse than random poses.
    assert!(condition.figures.predicted_error > 1.0, "{condition:?}");
    let d = reference.objective(Objective::D);
    assert!(d.figures.predicted_error <= 0.68, "{d:?}");

    // Every index is best served by its own objective, up to what so short a search leaves to chance.
    let score = |set: &Chosen| Score::new(&reference.information, &set.set).unwrap().observability;
    let indices = |set: &Chosen| {
        let o = score(set);
        [o.o1, o.o2, o.o3, o.o4, o.o5]
    };
    let objectives = [Objective::O1, Objective::O2, Objective::O3, Objective::O4, Objective::O5];
    let few =
        |objective| reference.plan(SearchSettings { objective, starts: 2, sweeps: 4, ..SearchSettings::default() });
    let found = objectives.map(|objective| indices(&few(objective)));
    for own in 0..5 {
        for other in 0..5 {
            assert!(found[own][own] >= 0.95 * found[other][own], "O{} by O{}: {found:?}", own + 1, other + 1);
        }
    }
}

#[test]
fn the_score_is_that_of_the_set_and_of_identification() {
    let reference = Reference::new(CANDIDATES);
    let information = &reference.information;
    let mut set: Vec<usize> = (100..156).collect();
    let score = Score::new(information, &set).unwrap();
    set.shuffle(&mut seeded(5));
    assert_eq!(Score::new(information, &set).unwrap(), score);

    // The same condition numbers as identification reports for these poses.
    let points = measure(&reference.model, &reference.configurations(&set), 0.0, &mut seeded(1));
    let observations = Observations { points, ..Observations::default() };
    let observed = Observability::new(&reference.problem(&observations));
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
    assert_eq!(observed.rank, Some(score.rank));
    assert!(same(observed.condition_number.unwrap(), score.condition_number));
    assert!(same(observed.condition_number_raw.unwrap(), score.condition_number_raw));
    assert!(same(score.observability.o2, 1.0 / score.condition_number));
    assert!(same(score.observability.o4, score.observability.o3 * score.observability.o2));

    // Blind parameters are weak whatever the instrument; with a worse instrument more are.
    let weak = |sigma| score.weak(sigma).count();
    let blind = score.precision.iter().filter(|precision| !precision.identifiable).count();
    assert!(blind > 0 && weak(0.0) == blind && weak(MILLIMETRE) > blind);
    assert!((score.predicted_rms(SIGMA) - SIGMA * score.predicted_error).abs() < 1e-18);
}

#[test]
fn the_predicted_error_is_what_identification_makes() {
    let reference = Reference::new(CANDIDATES);
    let settings = Settings {
        prior: Prior::None,
        estimator: Estimator::LeastSquares,
        sigma: Some((SIGMA, SigmaSource::Option)),
        ..Settings::default()
    };
    let mut rng = seeded(8);
    for set in [(0..56).collect::<Vec<_>>(), (500..530).collect()] {
        let predicted = Score::new(&reference.information, &set).unwrap().predicted_error;
        let configurations = reference.configurations(&set);
        let trials = 300;
        let square: f64 = (0..trials)
            .map(|_| {
                let fresh = random_configurations(200, &mut rng);
                reference.verification_error(&settings, &configurations, &fresh, &mut rng).powi(2)
            })
            .sum();
        let found = (square / f64::from(trials)).sqrt();
        println!("{} poses: predicted {predicted:.4} sigma, found {found:.4}", set.len());
        assert!((found / predicted - 1.0).abs() < 0.04, "predicted {predicted}, found {found}");
    }
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    let reference = Reference::new(600);
    for objective in [Objective::Balanced, Objective::O5] {
        let settings = SearchSettings { objective, sweeps: 3, poses: 30, window: 250, ..SearchSettings::default() };
        let search = Search::new(&reference.information, settings.clone()).unwrap();
        let one = search.run(&|| true, &|_| {}).unwrap();
        for threads in [0, 1, 2, 4] {
            assert_eq!(plan_in_parallel(&search, threads, &|| true, &|_| {}).unwrap(), one, "{threads} threads");
        }
        let other = Search::new(&reference.information, SearchSettings { seed: 2, ..settings }).unwrap();
        assert_ne!(other.run(&|| true, &|_| {}).unwrap().set, one.set);
    }
}

#[test]
fn required_poses_stay_and_help() {
    let reference = Reference::new(600);
    let required: Vec<usize> = (0..30).collect();
    let settings = SearchSettings { required: required.clone(), poses: 40, sweeps: 4, ..SearchSettings::default() };
    let chosen = reference.plan(settings);
    assert!(required.iter().all(|pose| chosen.set.contains(pose)));
    assert_eq!(chosen.set.len(), 40);
    let random = Yardstick::new(&reference.information, 40, 100, 1).unwrap();
    assert!(chosen.figures.predicted_error < random.errors.best);
    let all = SearchSettings { required: required.clone(), poses: 30, sweeps: 2, ..SearchSettings::default() };
    assert_eq!(reference.plan(all).set, required);
    let table = trade_off(&reference.information, &required, &[20, 30, 40], 1, &|| true).unwrap();
    assert_eq!(table.iter().map(|row| row.poses).collect::<Vec<_>>(), [30, 40]);
}

#[test]
fn an_interrupted_search_gives_the_best_so_far() {
    let reference = Reference::new(600);
    for objective in [Objective::Balanced, Objective::Condition] {
        for allowed in [0, 10, 500] {
            let asked = AtomicUsize::new(0);
            let keep_going = || asked.fetch_add(1, Ordering::Relaxed) < allowed;
            let settings = SearchSettings { objective, ..SearchSettings::default() };
            let search = Search::new(&reference.information, settings).unwrap();
            let chosen = plan_in_parallel(&search, 2, &keep_going, &|_| {}).unwrap();
            assert!(chosen.interrupted && chosen.set.len() == 56);
            let score = Score::new(&reference.information, &chosen.set).unwrap();
            assert!((score.condition_number / chosen.figures.condition_number - 1.0).abs() < 1e-9);
            assert!((score.predicted_error / chosen.figures.predicted_error - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn progress_never_gets_worse() {
    let reference = Reference::new(600);
    let seen = Mutex::new(Vec::new());
    let settings =
        SearchSettings { objective: Objective::Condition, sweeps: 5, starts: 1, ..SearchSettings::default() };
    let search = Search::new(&reference.information, settings).unwrap();
    let chosen = search.run(&|| true, &|progress| seen.lock().unwrap().push(*progress)).unwrap();
    let seen = seen.into_inner().unwrap();
    assert_eq!(seen.iter().map(|progress| progress.sweep).collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
    assert!(seen.windows(2).all(|pair| pair[1].figures.condition_number <= pair[0].figures.condition_number));
    assert!((seen[4].figures.condition_number / chosen.figures.condition_number - 1.0).abs() < 1e-9);
}

#[test]
fn the_bound_lies_above_every_set() {
    let reference = Reference::new(CANDIDATES);
    let information = &reference.information;
    let bound = DesignBound::new(information, &|| true);
    println!("{bound:?}");
    assert!(bound.gap < 0.01);
    let d = reference.objective(Objective::D);
    let efficiency = bound.efficiency(information, &d.set).unwrap();
    let random = bound.efficiency(information, &(0..56).collect::<Vec<_>>()).unwrap();
    println!("D-efficiency: {efficiency:.4} chosen, {random:.4} random");
    assert!(efficiency <= 1.0 && efficiency > 0.9 && random < efficiency);
    // The whole pool is a design too, and a loose bound is still a bound.
    assert!(bound.efficiency(information, &(0..CANDIDATES).collect::<Vec<_>>()).unwrap() <= 1.0);
    let early = DesignBound::new(information, &|| false);
    assert!(early.log_det >= bound.log_det && early.gap > bound.gap);
}

#[test]
fn more_poses_predict_better() {
    let reference = Reference::new(CANDIDATES);
    let sizes: Vec<usize> = (2..=10).map(|tens| 10 * tens).collect();
    let begin = now();
    let table = trade_off(&reference.information, &[], &sizes, 1, &|| true).unwrap();
    println!("{table:?} {:.2} s", begin.elapsed().as_secs_f64());
    assert_eq!(table.len(), sizes.len());
    assert!(table.windows(2).all(|pair| pair[1].predicted_error < pair[0].predicted_error));
    let TradeOff { poses, predicted_error } = table[2];
    assert!(poses == 40 && (predicted_error / 0.774 - 1.0).abs() < 0.02, "{predicted_error}");
}

#[test]
fn the_smallest_set_is_found_and_a_smaller_one_refused() {
    let reference = Reference::new(300);
    let information = &reference.information;
    assert_eq!(information.fewest_poses(), 9);
    let smallest = reference.plan(SearchSettings { poses: 9, sweeps: 2, starts: 1, ..SearchSettings::default() });
    assert!(smallest.figures.condition_number.is_finite() && smallest.figures.predicted_error.is_finite());
    let refused = |settings| Search::new(information, settings).unwrap_err();
    let default = SearchSettings::default;
    let five = refused(SearchSettings { poses: 5, ..default() });
    assert_eq!(
        five.to_string(),
        "5 poses are too few: 25 parameters have 21 combinations that distances can find; with the 6 of the tracker's frame \
         that is 27 unknowns at 3 coordinates per pose, so at least 9 poses are needed"
    );
    assert_eq!(
        refused(SearchSettings { poses: 301, ..default() }),
        PlanningError::TooFewCandidates { poses: 301, candidates: 300 }
    );
    assert_eq!(
        Yardstick::new(information, 301, 1, 1).unwrap_err(),
        PlanningError::TooFewCandidates { poses: 301, candidates: 300 }
    );
    assert_eq!(
        refused(SearchSettings { required: vec![3, 300], ..default() }),
        PlanningError::UnknownCandidate { pose: 300, candidates: 300 }
    );
    assert_eq!(
        refused(SearchSettings { required: vec![3, 4, 3], ..default() }),
        PlanningError::RepeatedPose { pose: 3 }
    );
    assert_eq!(
        refused(SearchSettings { poses: 10, required: (0..11).collect(), ..default() }),
        PlanningError::TooManyRequired { required: 11, poses: 10 }
    );
}

/// What planning is for: error of the identified arm at fresh poses, by the way the measured poses were chosen.
#[test]
fn planned_poses_identify_better_than_random_ones() {
    const TRIALS: usize = 1000;
    let reference = Reference::new(CANDIDATES);
    let settings = Settings { sigma: Some((SIGMA, SigmaSource::Option)), ..Settings::default() };
    let median_error = |configurations: &dyn Fn(&mut rand_chacha::ChaCha8Rng) -> Vec<Vec<f64>>, trials: usize| {
        let mut errors: Vec<f64> = (0..trials)
            .map(|trial| {
                // Every way of choosing meets the same arms and the same fresh poses.
                let mut rng = seeded(1000 + trial as u64);
                let fresh = random_configurations(200, &mut rng);
                let poses = configurations(&mut seeded(trial as u64));
                reference.verification_error(&settings, &poses, &fresh, &mut rng)
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        errors[trials / 2]
    };
    let random = |count: usize| move |rng: &mut rand_chacha::ChaCha8Rng| random_configurations(count, rng);
    let planned = |objective, poses| {
        let chosen = reference.plan(SearchSettings { objective, poses, ..SearchSettings::default() });
        let configurations = reference.configurations(&chosen.set);
        (chosen, move |_: &mut rand_chacha::ChaCha8Rng| configurations.clone())
    };
    let random_56 = median_error(&random(56), TRIALS);
    println!("random        56 poses: {random_56:.4} sigma");
    let against_random = |objective, poses| {
        let (chosen, configurations) = planned(objective, poses);
        let error = median_error(&configurations, TRIALS);
        println!(
            "{objective:?} {poses} poses: {error:.4} sigma ({:+.1} %), condition number {:.1}",
            100.0 * (error / random_56 - 1.0),
            chosen.figures.condition_number
        );
        error / random_56
    };
    assert!(against_random(Objective::Balanced, 56) <= 0.92);
    assert!(against_random(Objective::Prediction, 56) <= 0.88);
    assert!(against_random(Objective::D, 56) <= 0.92);
    assert!(against_random(Objective::Balanced, 46) <= 1.0);
    assert!(against_random(Objective::Condition, 56) > 1.0);
}
