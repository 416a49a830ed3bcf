//! What surrounds the measuring: the robot program, the place of the tracker, limits and boxes, circles of the whole arm, two faces.

use super::bench::{Bench, MANUAL, blocked, offers, started};
use crate::profile::{BoxText, Profile};
use crate::session::journal::{Entry, from_xyz_mm};
use crate::session::set_up::{FacePair, InstrumentChoice, JointLimitsText, ProgramText, Step, TrackerPoints};
use crate::session::wire::{KnownLinks, LinkChoice, SerialPortName};
use crate::wizard::view::Content;
use crate::wizard::{Danger, Event, Intent, Request};

fn program(dialect: &str) -> ProgramText {
    ProgramText { dialect: dialect.to_owned(), dwell_s: Some(6.0), speed_percent: 10.0 }
}

#[test]
fn the_program_of_an_accepted_plan_is_written_and_driven_once() {
    let mut bench = Bench::at(Step::Capture);
    assert!(!offers(&bench.wizard).iter().any(|offer| offer.starts_with("ProgramDriven")));
    let effects = bench.intend(Intent::WriteProgram(program("krl")));
    let (_, Request::Program { rows, settings, .. }) = started(&effects) else { panic!("{effects:?}") };
    assert_eq!(rows.len(), bench.wizard.session().rows.iter().filter(|row| row.active).count());
    assert_eq!(settings.dialect, "krl");
    bench.settle(effects);
    assert!(bench.told().contains("calposes.krl"), "{}", bench.told());
    let written = bench.wizard.session().robot_program.clone().unwrap();
    assert_eq!((written.files.len(), written.was_driven), (1, false));
    bench.does(Intent::ProgramDriven);
    assert!(bench.wizard.session().robot_program.as_ref().unwrap().was_driven);
    assert!(!offers(&bench.wizard).iter().any(|offer| offer.starts_with("ProgramDriven")));
    // A resumed session knows both; another plan has no program yet.
    let (resumed, _) = bench.resumed(bench.journal.len());
    assert_eq!(resumed.wizard.session().robot_program, bench.wizard.session().robot_program);
    bench.measure(12);
    bench.does(Intent::SuggestPoses(2));
    assert_eq!(bench.wizard.session().robot_program, None);
}

#[test]
fn an_unknown_language_writes_nothing_and_a_failure_is_said() {
    let mut bench = Bench::at(Step::Capture);
    assert!(bench.intend(Intent::WriteProgram(program("basic"))).is_empty());
    assert!(bench.told().contains("no language of a robot"), "{}", bench.told());
    let effects = bench.intend(Intent::WriteProgram(program("inform")));
    let (id, _) = started(&effects);
    let before = bench.journal.len();
    let effects = bench.answer(id, super::bench::failure("pulses are missing"));
    bench.settle(effects);
    assert!(bench.told().contains("pulses are missing"), "{}", bench.told());
    assert_eq!(bench.journal.len(), before, "a program that fails is no refused measurement");
}

#[test]
fn three_points_place_the_tracker_and_a_slip_is_kept_for_correction() {
    let mut bench = Bench::with(&MANUAL, Step::Instrument);
    bench.does(Intent::ChooseInstrument(MANUAL));
    // The tracker is at (2000, 100, 500), turned by a quarter about z.
    let seen = |(x, y, z): (f64, f64, f64)| (y - 100.0, 2000.0 - x, z - 500.0);
    let base = [(500.0, 0.0, 200.0), (600.0, 700.0, 300.0), (200.0, -600.0, 800.0)];
    let points = TrackerPoints(base.iter().map(|point| (*point, seen(*point))).collect());
    let mut slip = points.clone();
    slip.0[1].1.0 += 200.0;
    bench.intend(Intent::PlaceTracker(slip.clone()));
    assert!(bench.told().contains("do not fit each other"), "{}", bench.told());
    let offered =
        bench.wizard.intents().into_iter().find(|info| matches!(info.intent, Intent::PlaceTracker(_))).unwrap();
    assert_eq!(offered.intent, Intent::PlaceTracker(slip));
    bench.does(Intent::PlaceTracker(points));
    assert!(bench.told().contains("(2000, 100, 500) mm"), "{}", bench.told());
    assert_eq!(bench.wizard.session().cell.tracker_mm, Some((2000.0, 100.0, 500.0)));
}

#[test]
fn the_measured_poses_place_the_tracker() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    bench.measure(2);
    bench.does(Intent::Back);
    assert!(blocked(&bench.wizard, "PlaceTrackerByPoses").contains("measure 4 poses"));
    assert!(blocked(&bench.wizard, "PlaceTracker").contains("points are measured"));
    bench.does(Intent::Next);
    bench.measure(3);
    bench.does(Intent::Back);
    let samples = bench.wizard.session().samples.clone();
    bench.does(Intent::PlaceTrackerByPoses);
    assert!(bench.wizard.session().cell.tracker_mm.is_some());
    assert_eq!(bench.wizard.session().samples, samples);
    // A simulated tracker is where the cell says.
    let mut simulated = Bench::at(Step::Capture);
    simulated.measure(5);
    simulated.does(Intent::Back);
    assert!(blocked(&simulated.wizard, "PlaceTrackerByPoses").contains("simulated"));
}

#[test]
fn limits_and_boxes_are_parts_of_the_cell() {
    let mut bench = Bench::at(Step::Plan);
    bench.does(Intent::LimitJoints(JointLimitsText(vec![
        ("J1".to_owned(), Some((-20.0, 30.0))),
        ("J2".to_owned(), None),
    ])));
    let table = BoxText { name: "table".to_owned(), min_mm: (300.0, -500.0, 0.0), max_mm: (900.0, 500.0, 400.0) };
    bench.does(Intent::AddBox(table.clone()));
    let cell = &bench.wizard.session().cell;
    assert_eq!((cell.planning_limits.get("J1"), cell.planning_limits.len()), (Some(&(-20.0, 30.0)), 1));
    assert_eq!(cell.keep_out.last(), Some(&table));
    // The same name replaces the box.
    bench.does(Intent::AddBox(BoxText { max_mm: (800.0, 500.0, 400.0), ..table }));
    assert_eq!(bench.wizard.session().cell.keep_out.iter().filter(|one| one.name == "table").count(), 1);
}

#[test]
fn circles_of_the_whole_arm_become_a_profile() {
    let mut bench = Bench::at(Step::Target);
    bench.does(Intent::StartWholeArm);
    let Content::Target(view) = bench.wizard.view().content else { panic!() };
    let circles = view.circles.unwrap();
    assert_eq!((circles.joint.as_deref(), circles.of), (Some("J1"), 48));
    for point in 0..48 {
        if point == 20 {
            // Interrupted: the same circles continue.
            let (mut resumed, effects) = bench.resumed(bench.journal.len());
            resumed.settle(effects);
            bench = resumed;
            assert!(blocked(&bench.wizard, "StartCircles").contains("another kind"));
            bench.does(Intent::StartWholeArm);
        }
        bench.does(Intent::Measure);
    }
    assert!(bench.told().contains("within 0.0"), "{}", bench.told());
    let Content::Target(view) = bench.wizard.view().content else { panic!() };
    let arm = view.circles.unwrap().arm.unwrap();
    assert!(arm.constants.len() > 15 && arm.constants.iter().all(|constant| !constant.is_astonishing), "{arm:?}");
    let effects = bench.intend(Intent::SaveArm);
    let (_, Request::Deliver { files, .. }) = started(&effects) else { panic!() };
    let (name, text) = &files[0];
    assert_eq!(name, "measured-arm.ron");
    let (profile, _) = Profile::parse(text, name).unwrap();
    assert_eq!(profile.name(), "soochow_measured");
    bench.settle(effects);
    assert!(bench.told().contains("measured-arm.ron"), "{}", bench.told());
    bench.does(Intent::UseCircles);
    assert!(matches!(bench.last_entry(), Entry::Target(_)));
    bench.does(Intent::DiscardCircles);
    bench.does(Intent::StartCircles);
}

#[test]
fn both_faces_are_compared_before_and_after() {
    let mut bench = Bench::at(Step::Instrument);
    let pair = FacePair { first_mm: (3000.0, 0.0, 0.0), second_mm: (3000.0, 0.01, 0.0) };
    bench.does(Intent::CheckFaces(pair));
    assert!(bench.wizard.session().about.field_check.starts_with("two faces, start: 0.010 mm at 3.0 m, limit"));
    let mut bench = Bench::at(Step::Capture);
    bench.measure(1);
    bench.does(Intent::CheckFaces(FacePair { second_mm: (3000.0, 0.9, 0.0), ..pair }));
    assert!(bench.wizard.session().about.field_check.contains("two faces, end: 0.900 mm"));
    assert!(bench.wizard.notice().unwrap().hints[0].contains("beyond the limit"), "{:?}", bench.wizard.notice());
}

#[test]
fn known_links_are_shown_in_the_instrument_step() {
    let mut bench = Bench::at(Step::Instrument);
    let choice = LinkChoice { address: "emscon:10.0.0.2".to_owned(), ..LinkChoice::default() };
    let port = SerialPortName { device: "/dev/ttyUSB0".to_owned(), description: String::new() };
    let known = KnownLinks { recent: vec![choice], ports: vec![port] };
    assert!(bench.wizard.update(Event::Links(known.clone())).is_empty());
    let Content::Instrument(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.known, known);
}

#[test]
fn the_tracker_is_turned_only_once_its_place_is_known_and_after_a_word() {
    let choice = LinkChoice { address: "emscon:10.0.0.2".to_owned(), ..LinkChoice::default() };
    let linked = InstrumentChoice::Linked(choice);
    let mut bench = Bench::with(&linked, Step::Capture);
    assert!(blocked(&bench.wizard, "TurnTracker").contains("after 4 measured poses"));
    bench.measure(4);
    let offer = bench.wizard.intents().into_iter().find(|info| info.intent == Intent::TurnTracker).unwrap();
    assert_eq!(offer.danger, Danger::Turns);
    if let Some(reason) = &offer.blocked {
        assert!(reason.contains("at most 60 deg"), "{reason}");
        return;
    }
    assert!(!offer.is_default, "turning by hand stays the usual way");
    let effects = bench.intend(Intent::TurnTracker);
    let (_, Request::Turn { at_mm }) = started(&effects) else { panic!("{effects:?}") };
    let next = bench.capture().row.unwrap();
    let there = super::bench::seen_at(&bench.wizard.session().rows[next].planned.configuration);
    let off = (from_xyz_mm(at_mm) - there).norm();
    assert!(off < 1e-3, "{off}");
    bench.settle(effects);
    assert!(bench.told().contains("has found the SMR"), "{}", bench.told());
    // A typed instrument has no motors.
    let typed = Bench::with(&MANUAL, Step::Capture);
    assert!(!offers(&typed.wizard).iter().any(|offer| offer.starts_with("TurnTracker")));
}
