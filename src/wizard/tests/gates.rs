//! What stands between a reading and a sample: gates, typing, doubts and decisions.

use nalgebra::Point3;

use super::bench::{Bench, MANUAL, appended, blocked, failure, offers, reading, seen_at, started, texts};
use crate::session::journal::{Entry, FindingCause, FindingText};
use crate::session::reading::{LiveReading, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step};
use crate::session::state::SampleState;
use crate::session::wire::LinkChoice;
use crate::units::MILLIMETRE;
use crate::wizard::{Activity, Answer, Effect, Event, Intent, Request, Severity};

/// Measures the pose shown; the instrument gives what `change` makes of a good reading.
fn measure(bench: &mut Bench, change: impl FnOnce(&mut Reading)) -> Vec<Effect> {
    let effects = bench.intend(Intent::Measure);
    let (id, Request::Measure(request)) = started(&effects) else { panic!() };
    let mut reading = reading(&request);
    change(&mut reading);
    bench.answer(id, Answer::Measured(reading))
}

#[test]
fn what_is_no_measurement_is_refused_and_noted() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(1);
    let previous = bench.wizard.session().samples[0].noted.xyz_mm;
    let previous = crate::session::journal::from_xyz_mm(previous);
    let cases = [
        (Point3::new(f64::NAN, 1.0, 1.0), "the reading is not a number"),
        (Point3::new(1.0, f64::INFINITY, 1.0), "the reading is not a number"),
        (Point3::origin(), "the reading is 0, 0, 0: the instrument has no target"),
        (Point3::new(2000.0, 0.0, 0.0), "the reading is 2000 m away: no instrument measures that far"),
        (
            previous,
            "identical to the previous reading to the last digit: the instrument did not take a new measurement",
        ),
    ];
    for (number, (point, reason)) in (2..).zip(cases) {
        let effects = measure(&mut bench, |reading| reading.point = point);
        assert_eq!(
            texts(&effects),
            [format!("append {} measurement {number}: pose 2: no sample: {reason}", bench.journal.len() + 1)]
        );
        bench.settle(effects);
        assert_eq!(bench.told(), format!("pose 2: {reason}"));
        assert_eq!(bench.capture().refused.last().unwrap(), &("2".to_owned(), reason.to_owned()));
    }
    assert_eq!((bench.capture().measured, bench.capture().pose.as_deref()), (1, Some("2")));
    bench.measure(1);
    assert_eq!(bench.wizard.session().samples[1].noted.number, 7);
}

#[test]
fn a_link_that_fails_is_noted_with_its_message() {
    let mut bench = Bench::at(Step::Capture);
    let effects = bench.intend(Intent::Measure);
    let (id, _) = started(&effects);
    let effects = bench.answer(id, failure("the beam is broken"));
    assert_eq!(texts(&effects), ["append 10 measurement 1: pose 1: no sample: the beam is broken"]);
    bench.settle(effects);
    assert_eq!((bench.told().as_str(), bench.capture().pose.as_deref()), ("the beam is broken", Some("1")));
}

#[test]
fn shots_that_scatter_are_held_back_until_they_are_taken() {
    for scatter in [0.4 * MILLIMETRE, f64::NAN] {
        let mut bench = Bench::at(Step::Capture);
        let effects = measure(&mut bench, |reading| reading.scatter = Some(scatter));
        let (_, lines) = appended(&effects);
        assert!(matches!(lines[0].entry, Entry::Refused { number: 1, .. }), "noted with its reason, no sample");
        bench.settle(effects);
        assert_eq!(bench.wizard.notice().unwrap().severity, Severity::Attention);
        assert_eq!(bench.capture().held, Some(bench.told()));
        assert_eq!((bench.capture().measured, bench.capture().pose.as_deref()), (0, Some("1")));
        assert!(offers(&bench.wizard).contains(&"AcceptReading".to_owned()));
        let effects = bench.intend(Intent::AcceptReading);
        let (_, lines) = appended(&effects);
        let Entry::Sample(noted) = &lines[0].entry else { panic!() };
        assert_eq!((noted.number, noted.findings.len(), noted.findings[0].cause), (2, 1, FindingCause::NotAtRest));
        assert!(matches!(lines[1].entry, Entry::Decision { sample: 2, .. }), "that it scatters is decided with it");
        bench.settle(effects);
        assert_eq!((bench.capture().measured, bench.capture().held), (1, None));
    }
}

#[test]
fn a_held_reading_gives_way_to_a_better_one_or_another_pose() {
    let mut bench = Bench::at(Step::Capture);
    let hold = |bench: &mut Bench| {
        let effects = measure(bench, |reading| reading.scatter = Some(MILLIMETRE));
        bench.settle(effects);
    };
    hold(&mut bench);
    assert!(bench.told().starts_with("the shots scatter by 1.000 mm"), "{}", bench.told());
    bench.does(Intent::Measure);
    assert_eq!((bench.capture().held, bench.capture().measured), (None, 1));
    assert_eq!(blocked(&bench.wizard, "AcceptReading"), "no reading is held back");
    for leave in [Intent::GoToPose("4".to_owned()), Intent::Skip] {
        hold(&mut bench);
        assert!(bench.capture().held.is_some());
        bench.does(leave);
        assert_eq!(bench.capture().held, None);
    }
}

#[test]
fn joint_values_that_the_robot_reports_are_those_that_count() {
    let mut bench = Bench::at(Step::Capture);
    let effects = measure(&mut bench, |reading| {
        reading.configuration = Some(vec![0.1; 6]);
        reading.point = seen_at(&[0.1; 6]);
    });
    bench.settle(effects);
    let sample = &bench.wizard.session().samples[0];
    let configuration = bench.wizard.session().configuration_of(sample);
    assert!(configuration.iter().all(|value| (value - 0.1).abs() < 1e-9), "{configuration:?}");
}

#[test]
fn joint_values_that_cannot_be_this_robots_are_refused() {
    for reported in [vec![0.1; 5], vec![0.1; 7], vec![f64::NAN; 6]] {
        let mut bench = Bench::at(Step::Capture);
        let effects = measure(&mut bench, |reading| reading.configuration = Some(reported));
        bench.settle(effects);
        assert_eq!(bench.wizard.session().samples.len(), 0);
        assert_eq!(bench.capture().refused.len(), 1);
    }
}

#[test]
fn coordinates_are_typed_in_the_unit_that_was_chosen() {
    for unit in CoordinateUnit::ALL {
        let mut bench = Bench::with(&InstrumentChoice::Manual { unit }, Step::Capture);
        assert_eq!(blocked(&bench.wizard, "Measure"), "the coordinates are typed in");
        bench.does(Intent::Passed);
        assert!(offers(&bench.wizard).contains(&"TypeReading*".to_owned()));
        let point = seen_at(&bench.wizard.session().rows[1].planned.configuration).coords / unit.size();
        bench.does(Intent::TypeReading(format!("x={:.9}; y={:.9}; z={:.9}", point.x, point.y, point.z)));
        let session = bench.wizard.session();
        let noted = session.point_of(&session.samples[0]).coords / unit.size();
        assert!((noted - point).norm() * unit.size() < 1e-6, "{unit:?}: {noted:?} {point:?}");
        let sample = &session.samples[0].noted;
        assert_eq!((sample.shots, sample.scatter_mm, sample.sigma_mm), (1, None, None));
    }
}

#[test]
fn what_cannot_be_read_is_said_and_nothing_is_noted() {
    let mut bench = Bench::with(&super::bench::MANUAL, Step::Capture);
    let lines = bench.journal.len();
    for (typed, part) in [
        ("", "found 0 numbers"),
        ("1 2", "found 2 numbers"),
        ("1,2,3", "several ways"),
        ("1 2 3 in", "the reading is in in, but mm was chosen"),
        ("\u{1b}[2Jx", "is not a point"),
    ] {
        bench.does(Intent::TypeReading(typed.to_owned()));
        assert!(bench.told().contains(part), "{typed}: {}", bench.told());
        assert!(!bench.told().contains('\u{1b}'));
    }
    assert_eq!(bench.journal.len(), lines);
    bench.does(Intent::TypeReading("0 0 0".to_owned()));
    assert_eq!(bench.capture().refused.len(), 1);
}

#[test]
fn a_whole_session_can_be_typed() {
    let bench = Bench::with(&super::bench::MANUAL, Step::Deliver);
    assert!(bench.wizard.session().is_current());
}

/// Measures the pose shown 20 mm beside where it is.
fn measure_badly(bench: &mut Bench) {
    let effects = measure(bench, |reading| reading.point.x += 20.0 * MILLIMETRE);
    bench.settle(effects);
}

/// A session with a sample in question: pose 13, the 13th measurement.
fn in_question() -> Bench {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(12);
    measure_badly(&mut bench);
    bench
}

#[test]
fn a_sample_in_question_has_to_be_decided_about() {
    let bench = in_question();
    let view = bench.capture();
    let finding = view.finding.unwrap();
    assert_eq!((finding.pose.as_str(), finding.measurement, finding.cause), ("13", 13, FindingCause::Unexplained));
    assert!(!finding.has_remedy);
    // The distances that fit least: to the poses before, with what was expected.
    let [first, second, ..] = finding.worst.as_slice() else { panic!("{:?}", finding.worst) };
    assert!(finding.worst.iter().all(|pair| pair.pose != "13" && pair.measured_mm > 0.0 && !pair.is_drift));
    let share = |pair: &crate::wizard::view::PairView| (pair.difference_mm / pair.expected_mm).abs();
    assert!(share(first) >= share(second) && share(first) > 5.0, "{first:?}");
    assert!((first.measured_mm - first.predicted_mm - first.difference_mm).abs() < 1e-9);
    assert!(finding.message.contains(&format!("{:.2} mm", first.difference_mm.abs())), "{}", finding.message);
    assert_eq!(view.pose.as_deref(), Some("13"), "the pose in question stays on the screen");
    let first = "resolve the questioned sample first: keep it, remeasure it or exclude it";
    assert_eq!(blocked(&bench.wizard, "Measure"), first);
    assert_eq!(blocked(&bench.wizard, "Skip"), first);
    assert_eq!(blocked(&bench.wizard, "ApplyRemedy"), "no correction is proposed");
    let offers = offers(&bench.wizard);
    for offer in ["MeasureAgain*", "Keep", "LeaveOut", "Undo"] {
        assert!(offers.contains(&offer.to_owned()), "{offer}: {offers:?}");
    }
}

#[test]
fn it_is_kept_left_out_measured_again_or_taken_back() {
    let decide = |intent| {
        let mut bench = in_question();
        bench.does(intent);
        let view = bench.capture();
        assert_eq!(view.finding, None);
        let states: Vec<SampleState> = bench.wizard.session().samples.iter().map(|sample| sample.state).collect();
        (states[12], view.measured, view.pose.unwrap())
    };
    assert_eq!(decide(Intent::Keep), (SampleState::Counts, 13, "14".to_owned()));
    assert_eq!(decide(Intent::LeaveOut), (SampleState::LeftOut, 12, "14".to_owned()));
    assert_eq!(decide(Intent::MeasureAgain), (SampleState::Superseded, 13, "14".to_owned()));
    assert_eq!(decide(Intent::Undo), (SampleState::Undone, 12, "13".to_owned()));
}

#[test]
fn a_pose_that_is_left_out_can_be_measured_again() {
    let mut bench = in_question();
    bench.does(Intent::LeaveOut);
    assert_eq!(bench.capture().rows[12].state, crate::wizard::view::RowState::LeftOut);
    bench.does(Intent::GoToPose("13".to_owned()));
    bench.does(Intent::Measure);
    assert_eq!(bench.capture().rows[12].state, crate::wizard::view::RowState::Measured);
}

#[test]
fn a_question_outlives_the_program() {
    let bench = in_question();
    let (mut resumed, effects) = bench.resumed(bench.journal.len());
    resumed.settle(effects);
    assert_eq!(resumed.capture().finding, bench.capture().finding);
    assert_eq!(resumed.capture().row, bench.capture().row);
    resumed.does(Intent::Keep);
    assert_eq!(resumed.capture().finding, None);
}

#[test]
fn one_question_after_the_other_is_asked() {
    // A journal in which two samples are in doubt.
    let mut bench = Bench::at(Step::Capture);
    bench.measure(3);
    let finding = |about| FindingText {
        about,
        cause: FindingCause::Unexplained,
        ratio: 9.0,
        message: format!("measurement {about} is odd"),
        remedy: None,
        worst: Vec::new(),
    };
    let last = bench.journal.last_mut().unwrap();
    let Entry::Sample(noted) = &mut last.entry else { panic!() };
    noted.findings = vec![finding(2), finding(3)];
    let (mut bench, effects) = bench.resumed(bench.journal.len());
    bench.settle(effects);
    let asked = |bench: &Bench| bench.capture().finding.map(|finding| finding.measurement);
    assert_eq!(asked(&bench), Some(3));
    bench.does(Intent::Keep);
    assert_eq!((asked(&bench), bench.capture().pose), (Some(2), Some("2".to_owned())));
    bench.does(Intent::LeaveOut);
    assert_eq!(asked(&bench), None);
    bench.does(Intent::Measure);
    assert_eq!(bench.wizard.session().samples.len(), 4);
}

#[test]
fn a_question_about_the_last_sample_comes_before_going_on() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(super::bench::MEASURED - 1);
    measure_badly(&mut bench);
    let defaults =
        |bench: &Bench| offers(&bench.wizard).into_iter().filter(|offer| offer.contains('*')).collect::<Vec<_>>();
    assert_eq!(defaults(&bench), ["MeasureAgain*"]);
    bench.does(Intent::Keep);
    assert_eq!(defaults(&bench), ["Next*"]);
}

#[test]
fn what_an_instrument_warns_of_is_told_apart_from_its_name() {
    let mut bench = Bench::new();
    bench.pass(&MANUAL);
    let effects = bench.intend(Intent::ChooseInstrument(linked()));
    let (id, lines) = appended(&effects);
    let (request, _) = started(&bench.written(id, lines));
    let warnings = vec!["no weather monitor".to_owned(), "points are not in its own frame".to_owned()];
    let identity = format!("tracker; {}", warnings.join("; "));
    let effects = bench.answer(request, Answer::Connected { identity, warnings, recorded: Vec::new() });
    bench.settle(effects);
    let notice = bench.wizard.notice().unwrap();
    assert_eq!(notice.severity, Severity::Attention);
    for part in ["no weather monitor", "points are not in its own frame"] {
        assert!(notice.what.contains(part), "{notice:?}");
    }
    assert!(matches!(bench.last_entry(), Entry::Connected { identity } if identity.contains("own frame")));
}

#[test]
fn while_the_link_is_down_nothing_is_measured_and_nothing_waits_to_be() {
    let mut bench = Bench::with(&linked(), Step::Capture);
    bench.measure(1);
    let look =
        |down: Option<&str>| Event::Live(LiveReading { down: down.map(str::to_owned), ..LiveReading::default() });
    bench.wizard.update(look(Some("the connection is lost: closed")));
    assert!(bench.intend(Intent::Measure).is_empty());
    let told = bench.told();
    assert_eq!(told, "not now: the link is down: the connection is lost: closed; reconnecting");
    // It comes back: what was asked for before is not done now.
    assert!(bench.wizard.update(look(None)).is_empty());
    assert_eq!(bench.wizard.activity(), Activity::Idle);
    let (_, request) = started(&bench.intend(Intent::Measure));
    assert!(matches!(request, Request::Measure(_)));
}

fn linked() -> InstrumentChoice {
    InstrumentChoice::Linked(LinkChoice { address: "emscon:192.168.0.2".to_owned(), ..LinkChoice::default() })
}
