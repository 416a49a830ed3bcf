//! The cell: stated before measuring, limits also when the result has been seen.

use super::bench::{Bench, appended, offers, started, texts};
use crate::profile::CellText;
use crate::profile::cell_text::{AcceptanceText, InstrumentText, limits_from_text};
use crate::session::journal::Entry;
use crate::session::set_up::Step;
use crate::session::summary::WarningCode;
use crate::wizard::view::Content;
use crate::wizard::{Event, Intent, Request};

/// The cell on offer.
fn offered(bench: &Bench) -> CellText {
    let is_cell = |intent: &Intent| matches!(intent, Intent::DescribeCell(_));
    let offer = bench.wizard.intents().into_iter().rfind(|info| is_cell(&info.intent)).unwrap();
    let Intent::DescribeCell(cell) = offer.intent else { panic!("another offer") };
    *cell
}

const fn accepted(rms: f64) -> AcceptanceText {
    AcceptanceText { position_rms_mm: Some(rms), position_max_mm: None }
}

#[test]
fn a_cell_becomes_part_of_the_profile_and_is_offered_filled_in() {
    let mut bench = Bench::at(Step::Instrument);
    let first = offered(&bench);
    assert_eq!(first, CellText::of(&bench.wizard.session().robot.as_ref().unwrap().profile));
    let cell = CellText {
        instrument: Some(InstrumentText { name: "AT960".to_owned(), sigma_um: 7.5, sigma_um_per_m: 3.0 }),
        planning_limits: limits_from_text("J1 -20..30").unwrap(),
        ..first
    };
    let effects = bench.intend(Intent::DescribeCell(Box::new(cell.clone())));
    bench.settle(effects);
    assert!(bench.journal.iter().any(|line| matches!(line.entry, Entry::Cell(_))));
    let robot = bench.wizard.session().robot.as_ref().unwrap();
    assert_eq!(robot.profile.instrument().unwrap().name, "AT960");
    assert!(robot.text.contains("AT960"));
    let (low, _) = robot.profile.joints()[0].planning_limits.unwrap();
    assert!((low.to_degrees() + 20.0).abs() < 1e-9);
    assert_eq!(offered(&bench), cell);
    // A resumed session has it from its journal.
    let (resumed, _) = bench.resumed(bench.journal.len());
    assert_eq!(resumed.wizard.session().robot, bench.wizard.session().robot);
}

#[test]
fn the_cell_of_an_earlier_session_is_offered_again() {
    let mut bench = Bench::at(Step::Instrument);
    let earlier = CellText {
        tracker_mm: Some((1.0, 2.0, 3.0)),
        planning_limits: limits_from_text("J1 -20..30, A9 -1..1").unwrap(),
        ..CellText::default()
    };
    assert!(bench.wizard.update(Event::Cell(earlier)).is_empty());
    let cell = offered(&bench);
    assert_eq!((cell.tracker_mm, cell.planning_limits.len()), (Some((1.0, 2.0, 3.0)), 1));
    assert!(cell.instrument.is_some(), "what it does not state comes from the profile");
}

#[test]
fn a_cell_that_cannot_be_used_is_kept_for_correction() {
    let mut bench = Bench::at(Step::Plan);
    let wrong = CellText { planning_limits: limits_from_text("J9 -20..30").unwrap(), ..CellText::default() };
    assert!(bench.intend(Intent::DescribeCell(Box::new(wrong.clone()))).is_empty());
    assert!(bench.told().starts_with("this cell cannot be used: the arm has no joint 'J9'"), "{}", bench.told());
    assert_eq!(offered(&bench), wrong);
    let before = bench.wizard.session().clone();
    assert!(before.cell.is_empty());
}

#[test]
fn limits_set_after_the_result_are_evaluated_at_once_and_said() {
    let mut bench = Bench::at(Step::Verify);
    assert!(bench.wizard.session().limits_set.is_none());
    let samples = bench.wizard.session().samples.clone();
    let place = bench.wizard.session().robot.as_ref().unwrap().profile.tracker().position_in_base;
    let moved =
        CellText { acceptance: Some(accepted(0.000_1)), tracker_mm: Some((9.0, 9.0, 9.0)), ..CellText::default() };
    let effects = bench.intend(Intent::DescribeCell(Box::new(moved)));
    let (id, lines) = appended(&effects);
    let effects = bench.written(id, lines);
    assert_eq!(texts(&effects), ["start identifying"]);
    let (_, Request::Identify(request)) = started(&effects) else { panic!() };
    assert!(request.identification.warnings.iter().any(|warning| warning.code == WarningCode::LimitsSetLate));
    bench.settle(effects);
    let session = bench.wizard.session();
    assert!(session.limits_set.unwrap().after_result && session.is_current());
    assert_eq!(session.samples, samples);
    assert_eq!(
        session.robot.as_ref().unwrap().profile.tracker().position_in_base,
        place,
        "the tracker stood where it stood"
    );
    let Content::Verify(view) = bench.wizard.view().content else { panic!() };
    let verdict = format!("{:?}", view.verdict.unwrap());
    assert!(verdict.contains("0.0001"), "{verdict}");
    assert!(view.warnings.iter().any(|warning| warning.message.contains("after a result had been seen")));
}

#[test]
fn limits_set_before_measuring_need_no_remark() {
    let mut bench = Bench::at(Step::Instrument);
    bench.does(Intent::DescribeCell(Box::new(CellText { acceptance: Some(accepted(0.2)), ..CellText::default() })));
    let set = bench.wizard.session().limits_set.unwrap();
    assert!(!set.after_result);
    assert!(offers(&bench.wizard).contains(&"DescribeCell".to_owned()));
}
