//! The live triage on simulated sessions with one fault each, and on a real arm. Few sessions: `cargo bench --bench triage` measures the
//! rates that `docs/triage.md` promises.

use nalgebra::Point3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::identification::PointSample;
use trupose::kinematics::Place;
use trupose::units::{DEGREE, MILLIMETRE};

use crate::support::faulty_session::{
    Fault, NOISE, POSES, Robot, Session, false_alarms, measure, on_threads, promises,
};
use crate::support::measured_data;

/// Sessions of each kind.
const SESSIONS: usize = 10;

#[test]
fn faultless_sessions_raise_no_alarm() {
    for name in ["soochow", "ur5"] {
        assert_eq!(false_alarms(&Robot::new(name), 2 * SESSIONS), 0, "{name}");
    }
}

#[test]
fn faults_are_found_and_named() {
    let mut missed = Vec::new();
    for robot in [Robot::new("soochow"), Robot::new("ur5")] {
        for (fault, at) in promises() {
            let row = measure(&robot, fault, at, SESSIONS);
            let is_first = row.first[2] >= 80.0 || matches!(fault, Fault::Instrument(_));
            if !row.keeps_the_promise(fault, 80.0) || !is_first {
                missed.push(format!("{} {fault:?} {at:?}: {row:?}", robot.name));
            }
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

/// Columns of the joints, and the first of the coordinates, in the table of the measured arm.
const COLUMNS_Q: std::ops::Range<usize> = 1..7;
const COLUMN_X: usize = 7;

/// A real arm is less perfect than its tracker; it must not raise an alarm at every point.
#[test]
fn a_measured_ur5_is_left_alone() {
    let Some(file) = measured_data("ur5/grid.csv") else { return };
    let text = std::fs::read_to_string(file).unwrap();
    let robot = Robot::new("ur5");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.trim().parse().unwrap_or(0.0)).collect())
        .collect();
    for sigma in [NOISE, 10.0 * NOISE] {
        let alarms: Vec<usize> = on_threads(20, |seed| {
            let rng = &mut ChaCha8Rng::seed_from_u64(seed);
            let picked: Vec<&Vec<f64>> = (0..POSES).map(|_| &rows[rng.random_range(0..rows.len())]).collect();
            let planned: Vec<Vec<f64>> =
                picked.iter().map(|row| row[COLUMNS_Q].iter().map(|deg| deg * DEGREE).collect()).collect();
            let samples = picked
                .iter()
                .zip(&planned)
                .map(|(row, configuration)| PointSample {
                    at: Place { configuration: configuration.clone(), target: 0 },
                    station: 0,
                    point: Point3::new(row[COLUMN_X], row[COLUMN_X + 1], row[COLUMN_X + 2]) * MILLIMETRE,
                    sigma: Some(sigma),
                })
                .collect();
            let session = Session { planned, samples, k: 0, joint: 0, by: 0.0 };
            (4..=POSES).filter(|&count| session.after(&robot, count).is_some()).count()
        });
        let total: usize = alarms.iter().sum();
        println!("measured UR5, sigma {sigma:.0e} m: {total} findings in {} checks", alarms.len() * (POSES - 3));
        if sigma > 5.0 * NOISE {
            assert_eq!(total, 0, "the profile's sigma is that of the arm");
        }
    }
}
