//! Pose planning on the reference case: scores, bounds, determinism, refusals. `cargo bench --bench planning_quality` measures how good
//! the chosen sets are.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rand::seq::SliceRandom as _;
use trupose::identification::{Observability, Observations};
use trupose::planning::{
    Chosen, DesignBound, Objective, PlanningError, Score, Search, SearchSettings, Yardstick, trade_off,
};
use trupose::search::plan_in_parallel;
use trupose::units::MILLIMETRE;

use crate::support::paper_case::{measure, seeded};
use crate::support::reference_case::{CANDIDATES, Reference, SIGMA};

#[test]
fn random_sets_score_as_the_prototype_found() {
    let reference = Reference::new(CANDIDATES);
    assert_eq!(reference.information.rank(), 21);
    let of_56 = Yardstick::new(&reference.information, 56, 500, 1).unwrap();
    let of_40 = Yardstick::new(&reference.information, 40, 500, 1).unwrap();
    let near = |value: f64, expected: f64, share: f64| (value / expected - 1.0).abs() < share;
    assert!(near(of_56.conditions.median, 92.0, 0.05));
    assert!(near(of_56.conditions.best, 82.0, 0.05));
    assert!(near(of_56.errors.median, 0.75, 0.03));
    assert!(near(of_40.errors.median, 0.93, 0.03));
}

/// Few candidates and short searches: `cargo bench --bench planning_quality` has the figures of the long ones.
#[test]
fn every_objective_does_best_by_its_own_figure() {
    let reference = Reference::new(300);
    let chosen = |objective| {
        reference.plan(SearchSettings { objective, poses: 30, starts: 2, sweeps: 8, ..SearchSettings::default() })
    };
    let random = Yardstick::new(&reference.information, 30, 100, 1).unwrap();
    let balanced = chosen(Objective::Balanced);
    let prediction = chosen(Objective::Prediction);
    let condition = chosen(Objective::Condition);
    let d = chosen(Objective::D);
    assert!(prediction.figures.predicted_error < random.errors.best, "{prediction:?}");
    assert!(d.figures.predicted_error < random.errors.best, "{d:?}");
    assert!(balanced.figures.predicted_error <= 1.045 * prediction.figures.predicted_error, "{balanced:?}");
    assert!(balanced.figures.condition_number < prediction.figures.condition_number, "{balanced:?}");
    assert!(condition.figures.condition_number < 0.7 * balanced.figures.condition_number, "{condition:?}");
    // That is the trap: the best condition number predicts worse than random poses.
    assert!(condition.figures.predicted_error > random.errors.median, "{condition:?}");

    // Every index is best served by its own objective, up to what so short a search leaves to chance.
    let indices = |set: &Chosen| {
        let o = Score::new(&reference.information, &set.set).unwrap().observability;
        [o.o1, o.o2, o.o3, o.o4, o.o5]
    };
    let objectives = [Objective::O1, Objective::O2, Objective::O3, Objective::O4, Objective::O5];
    let found = objectives.map(|objective| indices(&chosen(objective)));
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
    let set: Vec<usize> = (0..56).collect();
    let predicted = Score::new(&reference.information, &set).unwrap().predicted_error;
    let found = reference.least_squares_error(&set, 40, &mut seeded(8));
    // Of so few trials: the benchmark has 300, and 4 %.
    assert!((found / predicted - 1.0).abs() < 0.1, "predicted {predicted}, found {found}");
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    let reference = Reference::new(300);
    for objective in [Objective::Balanced, Objective::O5] {
        let settings = SearchSettings { objective, sweeps: 3, poses: 30, window: 120, ..SearchSettings::default() };
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
    assert!(bound.gap < 0.01);
    let d =
        reference.plan(SearchSettings { objective: Objective::D, starts: 1, sweeps: 2, ..SearchSettings::default() });
    let efficiency = bound.efficiency(information, &d.set).unwrap();
    let random = bound.efficiency(information, &(0..56).collect::<Vec<_>>()).unwrap();
    assert!(efficiency <= 1.0 && efficiency > 0.9 && random < efficiency, "{efficiency} chosen, {random} random");
    // The whole pool is a design too, and a loose bound is still a bound.
    assert!(bound.efficiency(information, &(0..CANDIDATES).collect::<Vec<_>>()).unwrap() <= 1.0);
    let early = DesignBound::new(information, &|| false);
    assert!(early.log_det >= bound.log_det && early.gap > bound.gap);
}

#[test]
fn more_poses_predict_better() {
    let reference = Reference::new(600);
    let sizes = [20, 30, 40, 60];
    let table = trade_off(&reference.information, &[], &sizes, 1, &|| true).unwrap();
    assert_eq!(table.iter().map(|row| row.poses).collect::<Vec<_>>(), sizes);
    assert!(table.windows(2).all(|pair| pair[1].predicted_error < pair[0].predicted_error), "{table:?}");
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
