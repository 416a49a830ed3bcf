//! Measuring: pose by pose, in any order, with second thoughts.

use super::bench::{
    Bench, IDENTIFICATION, MANUAL, MEASURED, VERIFICATION, blocked, fold, offers, seen_at, started, texts,
};
use crate::session::journal::Entry;
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::session::state::{Row, SampleState};
use crate::wizard::view::{ProposedState, RowState};
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
            "Undo -- there is nothing to undo",
            "Redo -- there is nothing to redo",
            "Exclude -- nothing has been measured yet",
            "Include -- no pose is excluded",
            "ReadPoints -- the instrument supplies the coordinates",
            "ShowPoints -- the instrument supplies the coordinates",
            "GoToPose",
            "Note",
            "NotePose",
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
    assert_eq!(texts(&effects), ["append 13 undone: pose 3 measured (line 12)"]);
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
    assert_eq!(blocked(&bench.wizard, "Undo"), "there is nothing to undo");
}

/// Excluding, skipping, noting and correcting are undone like measuring, and everything can be redone, here and from the journal.
#[test]
fn the_whole_history_is_undone_and_redone() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(3);
    bench.does(Intent::Exclude("2".to_owned()));
    bench.does(Intent::Skip);
    bench.does(Intent::NotePose { pose: "1".to_owned(), text: "warm".to_owned() });
    bench.does(Intent::Include("2".to_owned()));
    bench.does(Intent::SuggestPoses(2));
    bench.measure(2);
    let picture = |bench: &Bench| {
        let view = bench.capture();
        (view.rows, view.notes, view.measured, view.open, view.skipped)
    };
    let mut before = vec![picture(&bench)];
    while bench.wizard.session().undoable().is_some() {
        bench.does(Intent::Undo);
        before.push(picture(&bench));
        assert_eq!(fold(&bench.journal), *bench.wizard.session(), "a resumed session is the same");
    }
    assert_eq!(before.len(), 11, "ten actions");
    let nothing = before.last().unwrap();
    assert_eq!((nothing.2, nothing.3, nothing.4), (0, MEASURED, 0));
    assert!(nothing.0.iter().all(|row| row.state == RowState::Open) && nothing.1.is_empty());
    for earlier in before.iter().rev().skip(1) {
        bench.does(Intent::Redo);
        assert_eq!(picture(&bench), *earlier);
        assert_eq!(fold(&bench.journal), *bench.wizard.session());
    }
    assert_eq!(blocked(&bench.wizard, "Redo"), "there is nothing to redo");
    // What is done after an undo takes the place of what was undone.
    bench.does(Intent::Undo);
    bench.does(Intent::Note("other".to_owned()));
    assert_eq!(blocked(&bench.wizard, "Redo"), "there is nothing to redo");
    assert_eq!(bench.wizard.session().samples.len(), 5, "a sample is never deleted");
}

#[test]
fn a_pose_is_excluded_and_counts_again_by_name() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(4);
    bench.does(Intent::Exclude("2".to_owned()));
    assert_eq!(bench.capture().rows[1].state, RowState::LeftOut);
    assert_eq!(bench.capture().pose.as_deref(), Some("5"), "the pose that waits stays");
    bench.does(Intent::Exclude("2".to_owned()));
    assert_eq!(bench.told(), "pose 2 has no sample that counts");
    bench.does(Intent::Include("2".to_owned()));
    assert_eq!(bench.capture().rows[1].state, RowState::Measured);
    bench.does(Intent::Exclude("99".to_owned()));
    assert_eq!(bench.told(), "there is no pose '99' in the plan");
}

#[test]
fn a_pose_can_be_measured_again_when_all_are_done() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(usize::MAX);
    bench.does(go_to("3"));
    assert!(offers(&bench.wizard).contains(&"Measure*".to_owned()), "{:?}", offers(&bench.wizard));
    bench.does(go_to("1 again"));
    let row = bench.capture().row.unwrap();
    assert_eq!(bench.wizard.session().rows[row].planned.kind, PoseKind::Drift);
}

#[test]
fn points_are_shown_with_their_checks_before_any_is_taken() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    let text = pasted(&bench, 0..9);
    let mut lines: Vec<String> = text.lines().map(|line| line.replace("P, ", "")).collect();
    // One digit is wrong in the sixth, and the eighth is no measurement.
    lines[5] = "1000 2000 3000".to_owned();
    lines[7] = "0 0 0".to_owned();
    bench.does(Intent::ShowPoints(lines.join("\n")));
    assert_eq!(bench.wizard.session().samples.len(), 0, "nothing is taken yet");
    let shown = bench.capture().proposed.unwrap();
    let poses: Vec<&str> = shown.points.iter().filter_map(|point| point.pose.as_deref()).collect();
    assert_eq!(poses, ["1", "2", "3", "4", "5", "6", "7", "8", "9"]);
    let states: Vec<ProposedState> = shown.points.iter().map(|point| point.state).collect();
    let (fits, asks, no) = (ProposedState::Fits, ProposedState::InQuestion, ProposedState::Impossible);
    assert_eq!(states, [fits, fits, fits, fits, fits, asks, fits, no, fits]);
    assert!(shown.points[5].message.is_some());
    assert_eq!(shown.points[7].message.as_deref(), Some("the reading is 0, 0, 0: the instrument has no target"));
    bench.does(Intent::TakePoints);
    assert_eq!(bench.capture().measured, 7);
    assert_eq!(bench.capture().finding, None);
    assert_eq!(bench.capture().pose.as_deref(), Some("10"));
    assert_eq!(bench.capture().rows[5].state, RowState::Open, "the others are still to be measured");
}

#[test]
fn all_points_are_taken_with_questions_or_none() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    let text = pasted(&bench, 0..7);
    let mut lines: Vec<String> = text.lines().map(|line| line.replace("P, ", "")).collect();
    lines[5] = "1000 2000 3000".to_owned();
    let text = lines.join("\n");
    bench.does(Intent::ShowPoints(text.clone()));
    bench.does(Intent::DropPoints);
    assert_eq!((bench.capture().measured, bench.capture().proposed), (0, None));
    bench.does(Intent::ShowPoints(text));
    bench.does(Intent::TakeAllPoints);
    assert_eq!(bench.wizard.session().samples.len(), 6, "the question comes before the seventh is taken");
    assert!(bench.capture().finding.is_some());
    bench.does(Intent::LeaveOut);
    assert_eq!(bench.wizard.session().samples.len(), 7);
}

#[test]
fn points_of_a_file_go_to_the_poses_that_they_name() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    bench.does(Intent::ReadPoints("missing.csv".to_owned()));
    assert_eq!(bench.told(), "cannot read 'missing.csv'");
    bench.does(Intent::ReadPoints("points.csv".to_owned()));
    let shown = bench.capture().proposed.unwrap();
    assert_eq!(shown.points.len(), IDENTIFICATION);
    assert!(shown.points.iter().all(|point| point.pose == point.name && point.state == ProposedState::Fits));
    bench.does(Intent::TakePoints);
    assert_eq!(bench.capture().identification, IDENTIFICATION);
}

#[test]
fn a_refused_point_of_several_says_which_why_and_what_to_do() {
    let mut bench = Bench::with(&MANUAL, Step::Capture);
    let text = pasted(&bench, 0..4);
    let mut lines: Vec<&str> = text.lines().collect();
    lines[1] = "0 0 0";
    bench.does(Intent::TypeReading(lines.join("\n")));
    assert_eq!(
        bench.told(),
        "the point for pose 2 was not taken: the reading is 0, 0, 0: the instrument has no target; the points after it were not taken either (3 and 4)"
    );
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
