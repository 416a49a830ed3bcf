//! Measuring without a key: when the SMR rests for 2 s where the pose should be, and never otherwise.

use nalgebra::{Point3, Vector3};

use super::bench::{Bench, seen_at, started};
use crate::session::reading::LiveReading;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::wire::LinkChoice;
use crate::units::{DEGREE, MILLIMETRE};
use crate::wizard::{Effect, Event, Intent, Request};

/// Looks in a second.
const RATE: f64 = 10.0;

/// A bench with a link, and the clock of the link.
struct Cell {
    bench: Bench,
    seconds: f64,
}

/// What the link sees at one time.
fn sees(point: Point3<f64>) -> LiveReading {
    LiveReading { point: Some(point), ..LiveReading::default() }
}

impl Cell {
    /// At the capture step with so many samples taken by key.
    fn with(is_automatic: bool, samples: usize) -> Self {
        let choice = LinkChoice { address: "emscon:192.168.0.2".to_owned(), is_automatic, ..LinkChoice::default() };
        let mut bench = Bench::with(&InstrumentChoice::Linked(choice), Step::Capture);
        bench.measure(samples);
        Self { bench, seconds: 50.0 }
    }

    /// Where the tracker sees the SMR at the pose that is shown (m).
    fn here(&self) -> Point3<f64> {
        seen_at(&self.configuration())
    }

    fn configuration(&self) -> Vec<f64> {
        let row = self.bench.capture().row.unwrap();
        self.bench.wizard.session().rows[row].planned.configuration.clone()
    }

    /// Looks for a time, until the wizard does something; after how long (s), and what.
    fn look(&mut self, duration: f64, see: impl Fn(f64) -> LiveReading) -> Option<(f64, Vec<Effect>)> {
        let looks = (0_u32..).map(|number| f64::from(number) / RATE).take_while(|time| *time <= duration);
        for time in looks {
            self.seconds += 1.0 / RATE;
            let reading = LiveReading { seconds: self.seconds, ..see(time) };
            let effects = self.bench.wizard.update(Event::Live(reading));
            if !effects.is_empty() {
                return Some((time, effects));
            }
        }
        None
    }

    /// Looks for ten seconds; the wizard does nothing.
    fn is_left_alone(&mut self, see: impl Fn(f64) -> LiveReading) -> bool {
        let before = self.bench.wizard.session().measurements;
        self.look(10.0, see).is_none() && self.bench.wizard.session().measurements == before
    }

    /// The SMR rests at the pose that is shown until it is measured; the name of the pose.
    fn is_measured(&mut self) -> String {
        let here = self.here();
        let (_, effects) = self.look(10.0, |_| sees(here)).expect("nothing is measured");
        let (_, Request::Measure(request)) = started(&effects) else { panic!() };
        self.bench.settle(effects);
        request.pose
    }
}

#[test]
fn after_two_seconds_of_rest_near_the_predicted_place_the_pose_is_measured() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    let (time, effects) = cell.look(10.0, |_| sees(here)).unwrap();
    assert!((2.0 - 1e-9..2.2).contains(&time), "{time}");
    let (_, Request::Measure(request)) = started(&effects) else { panic!() };
    assert_eq!(request.pose, "5");
    cell.bench.settle(effects);
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("6"));
}

#[test]
fn who_did_not_ask_for_it_measures_by_key() {
    let mut cell = Cell::with(false, 4);
    let here = cell.here();
    assert!(cell.is_left_alone(|_| sees(here)));
}

#[test]
fn far_from_the_predicted_place_nothing_is_measured() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    let far = here + Vector3::new(0.0, 60.0 * MILLIMETRE, 0.0);
    assert!(cell.is_left_alone(|_| sees(far)));
    assert_eq!(cell.is_measured(), "5");
}

#[test]
fn before_anything_tells_which_pose_it_is_nothing_is_measured() {
    let mut cell = Cell::with(true, 3);
    let here = cell.here();
    assert!(cell.is_left_alone(|_| sees(here)));
}

#[test]
fn the_joints_of_the_robot_tell_which_pose_it_is_from_the_first_one_on() {
    let mut cell = Cell::with(true, 0);
    let (here, joints) = (cell.here(), cell.configuration());
    let off: Vec<f64> = joints.iter().map(|joint| joint + 0.1 * DEGREE).collect();
    let tells = |joints: &[f64], is_still| LiveReading {
        joints: Some(joints.to_vec()),
        is_still: Some(is_still),
        ..sees(here)
    };
    assert!(cell.is_left_alone(|_| tells(&off, true)), "another pose");
    assert!(cell.is_left_alone(|_| tells(&joints, false)), "the robot moves");
    let (_, effects) = cell.look(10.0, |_| tells(&joints, true)).unwrap();
    assert!(matches!(started(&effects), (_, Request::Measure(request)) if request.pose == "1"));
}

#[test]
fn an_smr_that_creeps_or_trembles_is_not_measured() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    let creeping = |time: f64| sees(here + Vector3::new(0.2 * MILLIMETRE * time, 0.0, 0.0));
    assert!(cell.is_left_alone(creeping));
    let trembling = |time: f64| sees(here + Vector3::new(0.0, 0.3 * MILLIMETRE * (time * 9.0).sin(), 0.0));
    assert!(cell.is_left_alone(trembling));
    assert!(cell.is_left_alone(|_| LiveReading::default()), "no SMR is seen");
}

#[test]
fn a_pose_is_measured_once_however_long_the_smr_stays() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    assert_eq!(cell.is_measured(), "5");
    assert!(cell.is_left_alone(|_| sees(here)));
    // The beam is broken and restored at the same place.
    assert!(cell.is_left_alone(|_| LiveReading::default()));
    assert!(cell.is_left_alone(|_| sees(here)));
    assert_eq!(cell.is_measured(), "6");
    assert_eq!(cell.is_measured(), "7");
}

#[test]
fn where_a_key_has_measured_the_wizard_does_not_measure_again() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    assert!(cell.look(0.5, |_| sees(here)).is_none());
    cell.bench.does(Intent::Measure);
    assert!(cell.is_left_alone(|_| sees(here)));
    // The same after the program was ended and has gone on with its session.
    let (resumed, effects) = cell.bench.resumed(cell.bench.journal.len());
    let mut cell = Cell { bench: resumed, seconds: 3.0 };
    cell.bench.settle(effects);
    assert!(cell.is_left_alone(|_| sees(here)));
    assert_eq!(cell.is_measured(), "6");
}

#[test]
fn a_measurement_that_fails_is_not_tried_for_ever() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    let (_, effects) = cell.look(10.0, |_| sees(here)).unwrap();
    let (id, _) = started(&effects);
    let effects = cell.bench.answer(id, super::bench::failure("the instrument sees no reflector"));
    cell.bench.settle(effects);
    assert!(cell.is_left_alone(|_| sees(here)));
    assert_eq!(cell.bench.told(), "the instrument sees no reflector");
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("5"));
}

#[test]
fn a_link_that_is_down_measures_nothing() {
    let mut cell = Cell::with(true, 4);
    let here = cell.here();
    let down = |_| LiveReading { down: Some("the connection is lost".to_owned()), ..sees(here) };
    assert!(cell.is_left_alone(down));
    assert_eq!(cell.is_measured(), "5");
}

#[test]
fn after_an_undo_the_smr_has_to_move_first() {
    let mut cell = Cell::with(true, 4);
    assert_eq!(cell.is_measured(), "5");
    cell.bench.does(Intent::Undo);
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("5"));
    let here = cell.here();
    assert!(cell.is_left_alone(|_| sees(here)));
    // The robot goes away and comes back.
    let away = here + Vector3::new(0.0, 0.0, 80.0 * MILLIMETRE);
    assert!(cell.look(0.5, |_| sees(away)).is_none());
    assert_eq!(cell.is_measured(), "5");
}

/// The pose where the robot would be at a row of the plan.
fn joints_of(cell: &Cell, pose: &str) -> Vec<f64> {
    let rows = &cell.bench.wizard.session().rows;
    rows.iter().find(|row| row.planned.pose == pose).unwrap().planned.configuration.clone()
}

#[test]
fn a_robot_that_passed_over_a_pose_is_measured_where_it_is() {
    let mut cell = Cell::with(true, 4);
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("5"));
    let joints = joints_of(&cell, "9");
    let there = seen_at(&joints);
    let reports = |_| LiveReading { joints: Some(joints.clone()), is_still: Some(true), ..sees(there) };
    let (_, effects) = cell.look(10.0, reports).expect("it is not recognised");
    cell.bench.settle(effects);
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("9"));
    assert_eq!(cell.bench.told(), "the robot is at pose 9, not at 5");
    let (_, effects) = cell.look(10.0, reports).expect("it is not measured");
    assert!(matches!(started(&effects), (_, Request::Measure(request)) if request.pose == "9"));
    cell.bench.settle(effects);
    // The order of the plan continues from there, and what was passed over comes last.
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("10"));
    cell.bench.measure(usize::MAX);
    let measured: Vec<String> = {
        let session = cell.bench.wizard.session();
        session.samples.iter().map(|sample| session.pose_of(sample).to_owned()).collect()
    };
    assert_eq!(measured[measured.len() - 4..], ["5", "6", "7", "8"]);
}

#[test]
fn the_place_of_the_smr_tells_the_pose_where_the_robot_reports_nothing() {
    let mut cell = Cell::with(true, 8);
    let there = seen_at(&joints_of(&cell, "13"));
    let (_, effects) = cell.look(10.0, |_| sees(there)).expect("it is not recognised");
    cell.bench.settle(effects);
    assert_eq!(cell.bench.capture().pose.as_deref(), Some("13"));
    assert_eq!(cell.is_measured(), "13");
}
