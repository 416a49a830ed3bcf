//! Measuring: pose by pose, in any order, with second thoughts.

use super::bench::{Bench, IDENTIFICATION, MANUAL, MEASURED, VERIFICATION, blocked, offers, seen_at, started, texts};
use crate::session::journal::Entry;
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::session::state::{Row, SampleState};
use crate::wizard::view::RowState;
use crate::wizard::{Intent, Request};

fn go_to(pose: &str) -> Intent {
    Intent::GoToPose(pose.to_owned())
}

fn states(bench: &Bench) -> Vec<RowState> {
    bench.capture().rows.iter().map(|row| row.state).collect()
}

/// Points of rows of the plan as they are pasted.
fn pasted(bench: &Bench, rows: std::ops::Range<usize>) -> String {
    let rows = bench
        .wizard
        .session()
        .rows
        .iter()
        .filter(|row| row.planned.kind.is_measured())
        .skip(rows.start)
        .take(rows.len());
    let line = |row: &Row| {
        let point = seen_at(&row.planned.configuration) * 1e3;
        format!("P, {:.6}, {:.6}, {:.6}\n", point.x, point.y, point.z)
    };
    rows.map(line).collect()
}

#[test]
fn pasted_points_are_taken_one_by_one_until_one_is_in_question() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    let text = pasted(&bench, 0..5);
    bench.does(Intent::TypeReading(text));
    assert_eq!(bench.wizard.session().samples.len(), 5);
    assert_eq!(bench.capture().finding, None);
    // The third of four is wrong: the question comes before the fourth is taken.
    let text = pasted(&bench, 5..9);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[2] = "P 1000 2000 3000".to_owned();
    bench.does(Intent::TypeReading(lines.join("\n")));
    assert_eq!(bench.wizard.session().samples.len(), 8);
    assert!(bench.capture().finding.is_some());
    bench.does(Intent::LeaveOut);
    assert_eq!(bench.wizard.session().samples.len(), 9, "the fourth follows when the question is answered");
    assert_eq!(bench.capture().finding, None);
}

#[test]
fn the_first_pose_is_shown_with_all_that_can_be_done() {
    let bench = Bench::at(Step::Capture);
    assert_eq!(
        offers(&bench.wizard),
        [
            "Measure",
            "TypeReading -- the instrument supplies the coordinates",
            "AcceptReading -- no reading is held back",
            "MeasureAgain -- no sample is in question",
            "Keep -- no sample is in question",
            "LeaveOut -- no sample is in question",
            "ApplyRemedy -- no correction is proposed",
            "Passed*",
            "ThroughHome -- the way goes through home already, or there is no home",
            "Skip",
            "Undo -- nothing has been measured yet",
            "GoToPose",
            "Note",
            "SuggestPoses -- nothing has been measured yet",
            "Next -- 0 of at least 9 identification poses have been measured",
            "Back",
            "WriteProgram",
            "Dismiss",
            "Quit"
        ]
    );
    let view = bench.capture();
    assert_eq!((view.row, view.pose.as_deref(), view.kind), (Some(1), Some("1"), Some(PoseKind::Identification)));
    assert_eq!((view.measured, view.open, view.skipped, view.rows.len()), (0, MEASURED, 0, MEASURED));
    assert_eq!(view.on_the_way, ["home"]);
    assert_eq!(view.joints.len(), 6);
    assert!(view.joints.iter().all(|joint| joint.unit == "deg"));
    assert_eq!((view.last, view.prediction, view.minutes_left), (None, None, None));
}

#[test]
fn a_measurement_asks_for_the_pose_shown_and_names_the_next() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (_, Request::Measure(request)) = started(&effects) else { panic!() };
    assert_eq!((request.number, request.pose.as_str(), request.target, request.shots), (1, "1", 0, 3));
    let session = bench.wizard.session();
    assert_eq!(request.configuration, session.rows[1].planned.configuration);
    assert_eq!(request.following.as_ref(), Some(&session.rows[2].planned.configuration));
    bench.settle(effects);
    let Entry::Sample(noted) = bench.last_entry() else { panic!() };
    assert_eq!((noted.number, noted.row, noted.pose.as_str(), noted.findings.len()), (1, 1, "1", 0));
    assert_eq!((noted.scatter_mm, noted.temperature_degc), (Some(0.008), Some(21.5)));
    assert!(noted.sigma_mm.is_some_and(|sigma| (sigma - 0.01).abs() < 1e-9));
    let view = bench.capture();
    assert_eq!((view.pose.as_deref(), view.measured, view.identification), (Some("2"), 1, 1));
    assert_eq!(view.last.map(|last| (last.measurement, last.pose, last.counts)), Some((1, "1".to_owned(), true)));
}

#[test]
fn a_whole_plan_is_measured_in_its_order() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(usize::MAX);
    let view = bench.capture();
    assert_eq!((view.row, view.open, view.measured), (None, 0, MEASURED));
    assert_eq!((view.identification, view.verification, view.too_few), (IDENTIFICATION, VERIFICATION, None));
    assert_eq!((view.finding, view.held, view.refused.len()), (None, None, 0));
    let rows: Vec<usize> = bench.wizard.session().samples.iter().map(|sample| sample.row).collect();
    assert_eq!(rows, (1..=7).chain(9..=20).collect::<Vec<_>>());
    // The drift pose is the first pose again: it moved by the noise only.
    let [drift] = &view.drift[..] else { panic!() };
    assert_eq!((drift.pose.as_str(), drift.measurement), ("1", 15));
    assert!(drift.moved_mm < 0.03, "{}", drift.moved_mm);
    assert_eq!(blocked(&bench.wizard, "Measure"), "all poses of the plan have been measured");
    assert!(offers(&bench.wizard).contains(&"Next*".to_owned()));
    let prediction = view.prediction.unwrap();
    assert_eq!(prediction.curve_mm.last().unwrap().0, IDENTIFICATION);
    assert!(prediction.is_enough);
    assert!(prediction.now_mm > 0.0);
}

#[test]
fn too_few_samples_block_identifying_with_numbers() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(8);
    let few = "8 of at least 9 identification poses have been measured";
    assert_eq!(blocked(&bench.wizard, "Next"), few);
    assert_eq!(bench.capture().too_few.as_deref(), Some(few));
    bench.measure(1);
    bench.does(Intent::Next);
    assert_eq!(blocked(&bench.wizard, "Next"), "identify first");
    bench.does(Intent::Back);
    bench.does(Intent::Undo);
    assert_eq!(blocked(&bench.wizard, "Next"), few);
}

/// As many as planning allows, which counts what distances can find: see there.
#[test]
fn the_fewest_samples_that_can_be_planned_can_be_identified_from_and_are_warned_of() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(9);
    bench.does(Intent::Next);
    bench.does(Intent::Identify);
    let result = bench.wizard.session().identified.clone().unwrap();
    assert!(result.calibration.is_some());
    let poor = result
        .summary
        .warnings
        .iter()
        .find(|warning| warning.code == crate::session::summary::WarningCode::PoorData)
        .unwrap();
    assert!(poor.message.starts_with("too few data: 21 independent values for 21 combinations"), "{}", poor.message);
    assert!(poor.blocks_acceptance);
}

/// Distances tell its coordinates and the last link apart no better than the last link alone.
#[test]
fn an_smr_that_is_identified_as_well_needs_no_more_samples() {
    let mut bench = Bench::at(Step::Target);
    bench.does(Intent::ChooseTarget(crate::session::set_up::TargetChoice::Free { sigma_mm: 50.0 }));
    bench.does(Intent::Next);
    bench.pass(&super::bench::simulated());
    assert_eq!(blocked(&bench.wizard, "Next"), "0 of at least 9 identification poses have been measured");
}

#[test]
fn poses_can_be_measured_in_any_order() {
    let mut bench = Bench::at(Step::Capture);
    bench.does(go_to("5"));
    assert_eq!(bench.capture().pose.as_deref(), Some("5"));
    bench.does(Intent::Measure);
    assert_eq!(bench.capture().pose.as_deref(), Some("6"));
    bench.does(go_to("18"));
    bench.does(Intent::Measure);
    assert_eq!(bench.capture().pose.as_deref(), Some("1"), "after the last the first that waits");
    bench.does(go_to("7"));
    bench.does(Intent::Measure);
    assert_eq!(bench.capture().on_the_way, ["via1"]);
    bench.does(go_to("nowhere\u{1b}[31m"));
    assert!(bench.told().starts_with("there is no pose 'nowhere") && !bench.told().contains('\u{1b}'));
    bench.does(go_to("home"));
    assert_eq!(bench.told(), "there is no pose 'home' in the plan");
    assert_eq!(bench.capture().pose.as_deref(), Some("8"));
    let rows: Vec<usize> = bench.wizard.session().samples.iter().map(|sample| sample.row).collect();
    assert_eq!(rows, [5, 20, 7]);
    bench.measure(usize::MAX);
    assert_eq!(bench.capture().measured, MEASURED);
}

#[test]
fn a_skipped_pose_can_be_measured_after_all() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Skip);
    assert_eq!(texts(&effects), ["append 10 row 2 of the plan skipped"]);
    bench.settle(effects);
    let view = bench.capture();
    assert_eq!((view.pose.as_deref(), view.skipped, view.open), (Some("2"), 1, MEASURED - 1));
    assert_eq!(states(&bench)[0], RowState::Skipped);
    // The drift pose has the same name and waits: it is shown before the one that is skipped.
    bench.does(go_to("1"));
    assert_eq!(bench.capture().kind, Some(PoseKind::Drift));
    bench.does(Intent::Measure);
    let effects = bench.intend(go_to("1"));
    assert_eq!(
        texts(&effects),
        ["append 13 row 2 of the plan is to be measured after all | 14 went to row 2 of the plan"]
    );
    bench.settle(effects);
    let view = bench.capture();
    assert_eq!((view.row, view.skipped), (Some(1), 0));
    bench.does(Intent::Measure);
    assert_eq!(states(&bench)[0], RowState::Measured);
    // Now everything with that name is done: the pose itself is shown, not its repetition.
    bench.does(go_to("1"));
    assert_eq!(bench.capture().kind, Some(PoseKind::Identification));
}

#[test]
fn skipping_everything_leaves_nothing_to_measure() {
    let mut bench = Bench::at(Step::Capture);
    for _ in 0..MEASURED {
        bench.does(Intent::Skip);
    }
    assert_eq!(bench.capture().row, None);
    for name in ["Measure", "Skip"] {
        assert_eq!(blocked(&bench.wizard, name), "all poses of the plan have been measured");
    }
    assert_eq!(blocked(&bench.wizard, "Next"), "0 of at least 9 identification poses have been measured");
    bench.does(go_to("3"));
    bench.does(Intent::Measure);
    assert_eq!(bench.capture().measured, 1);
}

#[test]
fn undo_takes_back_one_sample_after_the_other() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(3);
    let effects = bench.intend(Intent::Undo);
    assert_eq!(texts(&effects), ["append 13 measurement 3: undone"]);
    bench.settle(effects);
    assert_eq!((bench.capture().pose.as_deref(), bench.capture().measured), (Some("3"), 2));
    bench.does(Intent::Undo);
    assert_eq!(bench.capture().pose.as_deref(), Some("2"));
    bench.measure(1);
    assert_eq!(bench.capture().pose.as_deref(), Some("3"));
    let states: Vec<SampleState> = bench.wizard.session().samples.iter().map(|sample| sample.state).collect();
    assert_eq!(states, [SampleState::Counts, SampleState::Undone, SampleState::Undone, SampleState::Counts]);
    assert_eq!(bench.wizard.session().measurements, 4, "numbers are never used twice");
    bench.does(Intent::Undo);
    bench.does(Intent::Undo);
    assert_eq!(blocked(&bench.wizard, "Undo"), "nothing has been measured yet");
}

#[test]
fn measuring_a_pose_once_more_supersedes_its_sample() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(3);
    bench.does(go_to("2"));
    bench.does(Intent::Measure);
    let states: Vec<SampleState> = bench.wizard.session().samples.iter().map(|sample| sample.state).collect();
    assert_eq!(states, [SampleState::Counts, SampleState::Superseded, SampleState::Counts, SampleState::Counts]);
    assert_eq!(bench.capture().measured, 3);
    assert_eq!(bench.capture().pose.as_deref(), Some("4"));
}

#[test]
fn a_result_is_stale_as_soon_as_a_sample_changes() {
    let mut bench = Bench::at(Step::Verify);
    bench.does(Intent::Back);
    bench.does(Intent::Back);
    bench.does(Intent::Undo);
    bench.does(Intent::Next);
    assert_eq!(blocked(&bench.wizard, "Next"), "the samples have changed since then: identify again");
    assert_eq!(offers(&bench.wizard)[0], "Identify*");
    bench.does(Intent::Identify);
    bench.does(Intent::Next);
    assert_eq!(bench.step(), Step::Verify);
}

#[test]
fn notes_belong_to_the_pose_shown() {
    let mut bench = Bench::at(Step::Capture);
    bench.does(Intent::Note("  fan\tis \u{7}on  ".to_owned()));
    let Entry::Note { pose, text } = bench.last_entry() else { panic!() };
    assert_eq!(pose.as_deref(), Some("1"));
    assert!(!text.contains('\u{7}') && text.starts_with("fan") && text.ends_with("on"), "{text}");
    let lines = bench.journal.len();
    bench.does(Intent::Note(" \n ".to_owned()));
    assert_eq!(bench.journal.len(), lines, "nothing is no note");
    bench.measure(usize::MAX);
    bench.does(Intent::Note("done".to_owned()));
    assert_eq!(*bench.last_entry(), Entry::Note { pose: None, text: "done".to_owned() });
    assert_eq!(bench.capture().notes.len(), 2);
}

#[test]
fn the_next_best_poses_go_on_after_the_last_name() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(12);
    let effects = bench.intend(Intent::SuggestPoses(2));
    let (_, Request::Plan { request, .. }) = started(&effects) else { panic!() };
    assert_eq!((request.poses, request.verification, request.drift_every), (2, 0, 0));
    assert_eq!((request.included.len(), request.numbered_after), (12, 18));
    bench.settle(effects);
    let Entry::PlanExtended(plan) = bench.last_entry() else { panic!() };
    assert_eq!(plan.origin, "2 suggested poses");
    let names: Vec<&str> = plan.rows.iter().map(|row| row.pose.as_str()).collect();
    assert_eq!(names, ["19", "20"], "the robot is not sent home in between");
    let view = bench.capture();
    assert_eq!((view.pose.as_deref(), view.open), (Some("13"), MEASURED - 12 + 2));
    bench.measure(usize::MAX);
    assert_eq!(bench.capture().identification, IDENTIFICATION + 2);
    bench.does(Intent::SuggestPoses(1));
    assert_eq!(bench.capture().pose.as_deref(), Some("21"));
}

#[test]
fn another_plan_drops_what_waits_and_keeps_what_is_measured() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(4);
    bench.does(Intent::Back);
    bench.does(Intent::LoadPlan("more.csv".to_owned()));
    bench.does(Intent::AcceptPlan);
    let view = bench.capture();
    assert_eq!((view.measured, view.open), (4, MEASURED));
    assert_eq!(view.row, Some(23), "the first row of the new plan");
    bench.measure(1);
    assert_eq!(bench.capture().measured, 5);
}
