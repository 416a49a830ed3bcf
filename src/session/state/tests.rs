//! The fold: what must hold after any entries, and entries that do not fit.

use proptest::prelude::*;

use super::*;
use crate::profile::builtin;
use crate::session::journal::{Correction, SCHEMA};

const ROWS: usize = 4;

fn line(number: u64, second: i64, entry: Entry) -> Line {
    Line { number, time: Timestamp::from_second(1_772_356_502 + second).unwrap(), entry }
}

fn planned(pose: usize) -> PlannedText {
    PlannedText { pose: pose.to_string(), kind: PoseKind::Identification, joints: vec![pose as f64; 6], xyz_mm: None }
}

fn plan() -> PlanText {
    let rows = (0..ROWS).map(planned).collect();
    PlanText {
        origin: "test".to_owned(),
        condition_number: None,
        predicted_error_sigma: None,
        minutes: None,
        search: Vec::new(),
        rows,
    }
}

/// A session that can be measured.
fn begun() -> Session {
    let text = builtin("soochow").unwrap().to_owned();
    let sha256 = crate::session::sha256(text.as_bytes());
    let opened = Entry::Opened { schema: SCHEMA, program: "trupose".to_owned(), name: "s".to_owned() };
    let profile = Entry::Profile { source: "soochow".to_owned(), sha256, text };
    let mut session = Session::default();
    for (number, entry) in (1..).zip([opened, profile, Entry::Plan(plan())]) {
        session.apply(&line(number, 0, entry)).unwrap();
    }
    session
}

fn sample(number: u64, row: usize) -> Entry {
    Entry::Sample(MeasuredText {
        number,
        row,
        pose: row.to_string(),
        kind: PoseKind::Identification,
        target: 0,
        joints: vec![row as f64; 6],
        reported_joints: None,
        reported_scatter: None,
        reported_count: None,
        xyz_mm: (number as f64, 0.0, 0.0),
        factor: None,
        sigma_mm: None,
        scatter_mm: None,
        shots: 1,
        temperature_degc: None,
        pressure_hpa: None,
        humidity_percent: None,
        seconds: 10.0,
        predicted_error_sigma: None,
        remarks: Vec::new(),
        findings: Vec::new(),
    })
}

/// One of everything that changes which samples count.
#[derive(Clone, Debug)]
enum Step {
    Measure(usize),
    Decide(u64, Decision),
    Swap(u64, u64),
    Move(u64, usize),
    Scale(u64, Option<u64>),
    TakeBack(usize),
    Skip(usize, bool),
    Replan,
}

fn step() -> impl Strategy<Value = Step> {
    let number = || 1..9_u64;
    prop_oneof![
        4 => (0..ROWS).prop_map(Step::Measure),
        3 => (number(), prop_oneof![Just(Decision::Keep), Just(Decision::LeaveOut), Just(Decision::Undo)])
            .prop_map(|(number, decision)| Step::Decide(number, decision)),
        2 => (number(), number()).prop_map(|(first, second)| Step::Swap(first, second)),
        2 => (number(), 0..ROWS).prop_map(|(number, row)| Step::Move(number, row)),
        1 => (number(), proptest::option::of(number())).prop_map(|(since, until)| Step::Scale(since, until)),
        1 => (0..4_usize).prop_map(Step::TakeBack),
        1 => (0..ROWS, any::<bool>()).prop_map(|(row, skipped)| Step::Skip(row, skipped)),
        1 => Just(Step::Replan),
    ]
}

fn entry(step: &Step, session: &Session) -> Entry {
    match *step {
        Step::Measure(row) => sample(session.measurements + 1, row),
        Step::Decide(sample, decision) => Entry::Decision { sample, decision },
        Step::Swap(first, second) => Entry::Correction(Correction::Swap { first, second }),
        Step::Move(sample, row) => Entry::Correction(Correction::Row { sample, row }),
        Step::Scale(since, until) => Entry::Correction(Correction::Scale { since, factor: 2.0, until }),
        Step::TakeBack(place) => {
            let line = session.corrections.get(place).map_or(0, |corrected| corrected.line);
            Entry::Correction(Correction::TakenBack { line })
        }
        Step::Skip(row, skipped) => Entry::Skipped { row, skipped },
        Step::Replan => Entry::Plan(plan()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_row_has_one_sample_that_counts_and_nothing_measured_is_lost(steps in proptest::collection::vec(step(), 0..25)) {
        let mut session = begun();
        let mut measured = 0;
        for step in steps {
            let before = session.clone();
            let entry = entry(&step, &session);
            if session.apply(&line(session.lines + 1, 0, entry)).is_ok() {
                measured += usize::from(matches!(step, Step::Measure(_)));
            } else {
                prop_assert_eq!(&session, &before, "an entry that does not fit changes nothing");
            }
            prop_assert_eq!(session.samples.len(), measured);
            for row in 0..session.rows.len() {
                let stands = session.samples.iter().filter(|sample| {
                    sample.row == row && matches!(sample.state, SampleState::Counts | SampleState::LeftOut)
                });
                prop_assert!(stands.count() <= 1, "row {} after {:?}: {:?}", row, step, session.samples);
                let is_open = session.is_open(row);
                prop_assert!(!is_open || session.sample_of_row(row).is_none());
            }
            let mut numbers: Vec<u64> = session.samples.iter().map(|sample| sample.noted.number).collect();
            numbers.dedup();
            prop_assert_eq!(numbers.len(), measured);
        }
    }
}

/// What the samples say: where, at which pose, whether they count.
fn standing(session: &Session) -> Vec<(Sample, Point3<f64>)> {
    session.samples.iter().map(|sample| (sample.clone(), session.point_of(sample))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_correction_that_is_taken_back_leaves_nothing(steps in proptest::collection::vec(step(), 0..25), correction in step()) {
        let mut session = begun();
        for step in steps {
            let entry = entry(&step, &session);
            drop(session.apply(&line(session.lines + 1, 0, entry)));
        }
        let before = standing(&session);
        let corrections = session.corrections.clone();
        let taken_back = session.lines + 1;
        let entry = entry(&correction, &session);
        let is_correction = matches!(entry, Entry::Correction(ref made) if !matches!(made, Correction::TakenBack { .. }));
        if is_correction && session.apply(&line(taken_back, 0, entry)).is_ok() {
            let undo = Entry::Correction(Correction::TakenBack { line: taken_back });
            session.apply(&line(taken_back + 1, 0, undo)).unwrap();
            prop_assert_eq!(standing(&session), before);
            prop_assert_eq!(session.corrections, corrections);
        }
    }
}

#[test]
fn a_sample_that_was_moved_twice_does_not_count_beside_another() {
    let mut session = begun();
    let mut apply = |entry| {
        let next = session.lines + 1;
        session.apply(&line(next, 0, entry)).unwrap();
    };
    let to_row = |sample, row| Entry::Correction(Correction::Row { sample, row });
    apply(sample(1, 3));
    apply(sample(2, 1));
    apply(to_row(2, 3));
    apply(sample(3, 0));
    apply(to_row(1, 0));
    let first = session.corrections[0].line;
    session.apply(&line(session.lines + 1, 0, Entry::Correction(Correction::TakenBack { line: first }))).unwrap();
    let counted: Vec<(u64, usize)> = session.counted().map(|sample| (sample.noted.number, sample.row)).collect();
    assert_eq!(counted, [(2, 1), (3, 0)]);
}

#[test]
fn a_scale_counts_for_the_measurements_it_names() {
    let mut session = begun();
    for number in 1..=4 {
        session.apply(&line(session.lines + 1, 0, sample(number, 0))).unwrap();
    }
    let scale = |since, until| Entry::Correction(Correction::Scale { since, factor: 2.0, until });
    session.apply(&line(session.lines + 1, 0, scale(2, Some(3)))).unwrap();
    let scales = |session: &Session| (1..=5).map(|number| session.correction_of(number)).collect::<Vec<_>>();
    assert_eq!(scales(&session), [1.0, 2.0, 2.0, 1.0, 1.0]);
    session.apply(&line(session.lines + 1, 0, scale(3, None))).unwrap();
    assert_eq!(scales(&session), [1.0, 2.0, 4.0, 2.0, 2.0]);
    let Entry::Sample(noted) = sample(5, 1) else { panic!("it is a sample") };
    for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let noted = MeasuredText { factor: Some(factor), ..noted.clone() };
        assert!(session.clone().apply(&line(session.lines + 1, 0, Entry::Sample(noted))).is_err(), "{factor}");
    }
    let noted = MeasuredText { factor: Some(3.0), sigma_mm: Some(1.0), ..noted };
    session.apply(&line(session.lines + 1, 0, Entry::Sample(noted))).unwrap();
    let last = session.samples.last().unwrap();
    assert_eq!((session.point_of(last), session.sigma_of(last)), (Point3::new(0.03, 0.0, 0.0), Some(0.006)));
}

#[test]
fn a_sample_that_was_measured_again_does_not_come_back() {
    let mut session = begun();
    let mut apply = |entry| {
        let number = session.lines + 1;
        session.apply(&line(number, 0, entry)).unwrap();
        session.counted().map(|sample| sample.noted.number).collect::<Vec<_>>()
    };
    let decide = |sample, decision| Entry::Decision { sample, decision };
    assert_eq!(apply(sample(1, 0)), [1]);
    assert_eq!(apply(sample(2, 0)), [2]);
    assert_eq!(apply(decide(1, Decision::LeaveOut)), [2]);
    assert_eq!(apply(decide(1, Decision::Keep)), [2]);
    assert_eq!(apply(decide(2, Decision::LeaveOut)), [0; 0]);
    assert_eq!(apply(decide(2, Decision::Keep)), [2]);
    assert_eq!(apply(decide(2, Decision::Undo)), [0; 0]);
    assert_eq!(apply(sample(3, 1)), [3]);
    // Superseded, it changes places with one that counts in a row that has one already.
    assert_eq!(apply(sample(4, 0)), [3, 4]);
    assert_eq!(apply(Entry::Correction(Correction::Swap { first: 1, second: 3 })), [4]);
}

#[test]
fn a_clock_that_jumps_back_changes_nothing_but_times() {
    let mut session = begun();
    for (number, second) in [(1, 100), (2, -1_000_000), (3, 50)] {
        session.apply(&line(session.lines + 1, second, sample(number, 0))).unwrap();
    }
    assert_eq!(session.counted().map(|sample| sample.noted.number).collect::<Vec<_>>(), [3]);
    assert_eq!(session.latest, Some(line(1, 100, sample(1, 0)).time));
}

#[test]
fn entries_that_do_not_fit_are_refused() {
    let session = begun();
    let text = builtin("ur5").unwrap().to_owned();
    let short = PlannedText { joints: vec![0.0; 5], ..planned(0) };
    let endless = PlannedText { joints: vec![f64::NAN; 6], ..planned(0) };
    let bad_plan = |row| Entry::Plan(PlanText { rows: vec![planned(1), row], ..plan() });
    let misfits = [
        Entry::Opened { schema: SCHEMA, program: String::new(), name: String::new() },
        Entry::Profile { source: "ur5".to_owned(), sha256: "wrong".to_owned(), text: text.clone() },
        Entry::Profile {
            source: "x".to_owned(),
            sha256: crate::session::sha256(b"not RON"),
            text: "not RON".to_owned(),
        },
        bad_plan(short),
        bad_plan(endless),
        sample(1, ROWS),
        sample(0, 0),
        Entry::Decision { sample: 1, decision: Decision::Keep },
        Entry::Correction(Correction::Row { sample: 1, row: 0 }),
        Entry::Correction(Correction::Joints { sample: 1, joints: vec![0.0; 6] }),
        Entry::Correction(Correction::Swap { first: 1, second: 1 }),
        Entry::Correction(Correction::TakenBack { line: 3 }),
        Entry::Correction(Correction::Scale { since: 1, factor: 0.0, until: None }),
        Entry::Correction(Correction::Scale { since: 1, factor: f64::NAN, until: Some(1) }),
        Entry::Skipped { row: ROWS, skipped: true },
    ];
    for entry in misfits {
        let mut tried = session.clone();
        let error = tried.apply(&line(4, 0, entry.clone())).unwrap_err().to_string();
        assert!(error.starts_with("line 4: "), "{entry:?}: {error}");
        assert_eq!(tried, session);
    }
    let mut measured = session;
    measured.apply(&line(4, 0, sample(1, 0))).unwrap();
    for joints in [vec![0.0; 7], vec![f64::INFINITY; 6]] {
        let Entry::Sample(noted) = sample(2, 0) else { panic!("it is a sample") };
        let wrong = [
            Entry::Sample(MeasuredText { joints: joints.clone(), ..noted.clone() }),
            Entry::Sample(MeasuredText { reported_joints: Some(joints.clone()), ..noted }),
            Entry::Correction(Correction::Joints { sample: 1, joints }),
        ];
        for entry in wrong {
            assert!(measured.clone().apply(&line(5, 0, entry.clone())).is_err(), "{entry:?}");
        }
    }
    let sha256 = crate::session::sha256(text.as_bytes());
    let other = Entry::Profile { source: "ur5".to_owned(), sha256, text };
    assert_eq!(
        measured.apply(&line(5, 0, other)).unwrap_err().to_string(),
        "line 5: another profile after measuring has begun; the journal was not written by this program"
    );
    // A number is used once.
    assert!(measured.apply(&line(5, 0, sample(1, 1))).is_err());
}
