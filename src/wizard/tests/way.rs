//! The arm moves only where somebody has looked: stops on the way, moves out of order, and what nobody can know.

use super::bench::{Bench, appended, fold};
use crate::session::journal::Entry;
use crate::session::reading::LiveReading;
use crate::session::set_up::{InstrumentChoice, Step};
use crate::session::wire::LinkChoice;
use crate::wizard::view::MoveCheck;
use crate::wizard::{Event, Intent};

fn go_to(pose: &str) -> Intent {
    Intent::GoToPose(pose.to_owned())
}

/// Drives through the stops on the way, and returns their names.
fn drive(bench: &mut Bench) -> Vec<String> {
    let mut passed = Vec::new();
    while let Some(stop) = bench.capture().on_the_way.first().cloned() {
        bench.does(Intent::Passed);
        passed.push(stop);
    }
    passed
}

#[test]
fn the_first_move_is_unknown_and_goes_through_home() {
    let mut bench = Bench::at(Step::Capture);
    let view = bench.capture();
    assert_eq!((view.pose.as_deref(), view.on_the_way), (Some("1"), vec!["home".to_owned()]));
    let MoveCheck::NotChecked { reason } = view.move_check else { panic!("{:?}", view.move_check) };
    assert_eq!(reason, "it is not known where the arm is now");
    // The digits are those of home.
    let home = &bench.wizard.session().rows[0].planned.configuration;
    assert!(view.joints.iter().zip(home).all(|(shown, home)| (shown.value - home.to_degrees()).abs() < 1e-9));
    bench.does(Intent::Passed);
    assert!(matches!(bench.last_entry(), Entry::Passed { pose, .. } if pose == "home"));
    let view = bench.capture();
    let pose = &bench.wizard.session().rows[1].planned.configuration;
    assert!(view.on_the_way.is_empty());
    assert!(view.joints.iter().zip(pose).all(|(shown, pose)| (shown.value - pose.to_degrees()).abs() < 1e-9));
    // Where the arm is survives a crash, but it may have been moved meanwhile.
    let (resumed, effects) = bench.resumed(bench.journal.len());
    let mut resumed = resumed;
    resumed.settle(effects);
    let MoveCheck::NotChecked { reason } = resumed.capture().move_check else { panic!() };
    assert_eq!(reason, "the program was not running, and the arm may have been moved");
}

#[test]
fn every_move_out_of_order_is_checked_from_where_the_arm_is() {
    let mut bench = Bench::at(Step::Capture);
    drive(&mut bench);
    bench.measure(5);
    for pose in ["12", "9", "3", "18", "1"] {
        bench.does(go_to(pose));
        // The bench has no order of short moves: each is either free or led around what is in the way.
        let view = bench.capture();
        match &view.move_check {
            MoveCheck::Free { from } => assert_eq!(*from, bench.wizard.session().arm().unwrap().0),
            MoveCheck::Blocked { from, obstruction } => assert!(!from.is_empty() && obstruction.contains("would")),
            check @ (MoveCheck::NotChecked { .. } | MoveCheck::Arrived) => panic!("{pose}: {check:?}"),
        }
        drive(&mut bench);
        bench.does(Intent::Measure);
    }
}

#[test]
fn skipping_asks_for_the_way_from_the_last_pose() {
    let mut bench = Bench::at(Step::Capture);
    drive(&mut bench);
    bench.does(Intent::Measure);
    bench.does(Intent::Skip);
    bench.does(Intent::Skip);
    let view = bench.capture();
    assert_eq!(view.pose.as_deref(), Some("4"));
    let from = match view.move_check {
        MoveCheck::Free { from } | MoveCheck::Blocked { from, .. } => from,
        check @ (MoveCheck::NotChecked { .. } | MoveCheck::Arrived) => panic!("{check:?}"),
    };
    assert_eq!(from, "pose 1");
}

#[test]
fn the_way_through_home_is_a_decision_in_the_journal() {
    let mut bench = Bench::at(Step::Capture);
    drive(&mut bench);
    bench.does(Intent::Measure);
    let direct = |bench: &Bench| bench.capture().on_the_way.first().is_none_or(|stop| stop != "home");
    while !direct(&bench) {
        bench.does(Intent::Skip);
    }
    bench.does(Intent::ThroughHome);
    assert_eq!(bench.capture().on_the_way[0], "home");
    let row = bench.capture().row.unwrap();
    assert!(matches!(bench.last_entry(), Entry::ThroughHome(found) if *found == row));
    assert_eq!(fold(&bench.journal).through_home, Some(row));
    let (resumed, effects) = bench.resumed(bench.journal.len());
    let mut resumed = resumed;
    resumed.settle(effects);
    assert_eq!(resumed.capture().on_the_way[0], "home");
    drive(&mut bench);
    assert_eq!(bench.capture().row, Some(row));
    assert_eq!(bench.wizard.session().through_home, None);
}

#[test]
fn who_measures_at_once_is_there() {
    let mut bench = Bench::at(Step::Capture);
    assert_eq!(bench.capture().on_the_way, ["home"]);
    let effects = bench.intend(Intent::Measure);
    assert!(bench.capture().on_the_way.is_empty());
    bench.settle(effects);
    assert_eq!(bench.wizard.session().arm().unwrap().0, "pose 1");
}

#[test]
fn a_robot_that_reports_its_joints_passes_stops_without_a_key() {
    let choice = LinkChoice { address: "emscon:192.168.0.2".to_owned(), ..LinkChoice::default() };
    let mut bench = Bench::with(&InstrumentChoice::Linked(choice), Step::Capture);
    let home = bench.wizard.session().rows[0].planned.configuration.clone();
    let reading = |joints: Vec<f64>, is_still| LiveReading {
        joints: Some(joints),
        is_still: Some(is_still),
        ..LiveReading::default()
    };
    let elsewhere = home.iter().map(|value| value + 0.1).collect();
    assert!(bench.wizard.update(Event::Live(reading(elsewhere, true))).is_empty());
    assert!(bench.wizard.update(Event::Live(reading(home.clone(), false))).is_empty());
    let effects = bench.wizard.update(Event::Live(reading(home, true)));
    let (_, lines) = appended(&effects);
    assert!(matches!(&lines[0].entry, Entry::Passed { pose, .. } if pose == "home"));
}
