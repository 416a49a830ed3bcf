//! Journals: every entry there and back, damage at every place, and random damage.

use std::ops::ControlFlow;

use proptest::prelude::*;

use super::*;
use crate::identification::PointSample;
use crate::kinematics::Place;
use crate::planning::Figures;
use crate::procedure::EstimationSettings;
use crate::procedure::identify::{IdentifyRequest, NamedSample, identify};
use crate::profile::cell_text::InstrumentText;
use crate::profile::{CellText, Profile, builtin};
use crate::session::about::About;
use crate::session::corrected::CorrectedText;
use crate::session::measurements;
use crate::session::plan::PoseKind;
use crate::session::set_up::{
    CoordinateUnit, InstrumentChoice, PayloadText, ProgramText, RecordedSet, Step, TargetChoice,
};
use crate::session::simulation::{Fault, JointErrorSizes, SimulatedWire, Simulation, Truth};
use crate::session::summary::VerificationMode;
use crate::session::wire::WireProtocol;

/// Texts that a line-based format could stumble over.
const TRICKY: &str = "a\nb\r\n\"c\", (\"d\") \\ \u{0} \u{85} \u{2028} \u{7} ä 机 #\"# )";

fn lines(entries: Vec<Entry>) -> Vec<Line> {
    let start = Timestamp::from_second(1_772_356_502).unwrap();
    let later = |number: u64| start + std::time::Duration::from_millis(number * 1234);
    (1..).zip(entries).map(|(number, entry)| Line { number, time: later(number), entry }).collect()
}

/// The text of lines; where each begins, and where the last one ends.
fn text(lines: &[Line]) -> (Vec<u8>, Vec<usize>) {
    let (mut text, mut starts, mut sum) = (Vec::new(), vec![0], Sum::default());
    for line in lines {
        let (encoded, next) = encode(line, &sum).unwrap();
        assert_eq!(encoded.matches('\n').count(), 1, "{encoded}");
        text.extend_from_slice(encoded.as_bytes());
        starts.push(text.len());
        sum = next;
    }
    (text, starts)
}

fn opened() -> Entry {
    Entry::Opened { schema: SCHEMA, program: "trupose 0.1.0".to_owned(), name: "cell-7".to_owned() }
}

fn note(text: &str) -> Entry {
    Entry::Note { pose: None, text: text.to_owned() }
}

/// A few short lines.
fn some() -> Vec<Line> {
    let step = |step| Entry::Step(step);
    lines(vec![opened(), step(Step::Instrument), note("first"), note("second"), Entry::Sample(sample(1)), note("last")])
}

fn sample(number: u64) -> MeasuredText {
    MeasuredText {
        number,
        row: 3,
        pose: TRICKY.to_owned(),
        kind: PoseKind::Verification,
        target: 1,
        joints: vec![0.1 + 0.2, -1e-9, 180.0],
        reported_joints: Some(vec![f64::MIN_POSITIVE, f64::MAX, -0.0]),
        reported_scatter: Some(vec![0.001, 0.0, 1e-9]),
        reported_count: Some(75),
        xyz_mm: (1.0 / 3.0, -2_345.678_901, 1e-300),
        factor: Some(25.4),
        sigma_mm: Some(0.012),
        scatter_mm: Some(0.0),
        shots: u32::MAX,
        temperature_degc: Some(-3.5),
        pressure_hpa: Some(998.25),
        humidity_percent: Some(61.0),
        seconds: 11.25,
        predicted_error_sigma: Some(0.71),
        remarks: vec![TRICKY.to_owned(), "reduced (2)".to_owned()],
        findings: vec![
            FindingText {
                about: number,
                cause: FindingCause::WrongPose,
                ratio: f64::INFINITY,
                message: TRICKY.to_owned(),
                remedy: Some(Correction::Swap { first: 1, second: 2 }),
                worst: vec![PairText {
                    other: 1,
                    measured_mm: 1234.5678,
                    predicted_mm: -0.0,
                    expected_mm: f64::MIN_POSITIVE,
                }],
            },
            FindingText {
                about: 1,
                cause: FindingCause::Drift,
                ratio: 7.5,
                message: String::new(),
                remedy: None,
                worst: Vec::new(),
            },
        ],
    }
}

#[test]
fn findings_of_journals_before_there_was_a_table_are_read() {
    let text = r#"(about: 3, cause: "wrong_pose", ratio: 9.5, message: "it does not fit")"#;
    let found: FindingText = ron::from_str(text).unwrap();
    assert_eq!((found.about, found.worst), (3, Vec::new()));
}

#[test]
fn corrections_of_units_of_journals_before_they_had_an_end_are_read() {
    let correction: Correction = ron::from_str("Scale(since: 5, factor: 25.4)").unwrap();
    assert_eq!(correction, Correction::Scale { since: 5, factor: 25.4, until: None });
    assert_eq!(ron::to_string(&correction).unwrap(), "Scale(since:5,factor:25.4)");
}

fn plan() -> PlanText {
    let row = |kind, xyz_mm| PlannedText { pose: "12b".to_owned(), kind, joints: vec![1.5, -0.000_000_001], xyz_mm };
    PlanText {
        origin: TRICKY.to_owned(),
        condition_number: Some(69.25),
        predicted_error_sigma: None,
        minutes: Some(0.1),
        search: vec![Figures { condition_number: 61.5, o1: 0.25, predicted_error: 0.7 }],
        rows: PoseKind::ALL
            .iter()
            .map(|kind| row(*kind, Some((1.0, 2.0, -3.001))))
            .chain([row(PoseKind::Via, None)])
            .collect(),
    }
}

/// A result as the program makes it, with everything that a summary can hold.
fn identified() -> IdentifiedText {
    let profile_text = builtin("soochow").unwrap();
    let (profile, _) = Profile::parse(profile_text, "soochow").unwrap();
    let joints: Vec<_> = profile.chain().joints().iter().map(|joint| joint.joint_type).collect();
    let table = include_str!("../../../sessions/soochow-example/measurements.csv");
    let rows = measurements::read(table, "measurements.csv", &joints).unwrap();
    let named: Vec<NamedSample> = rows
        .distinct_rows()
        .map(|row| NamedSample {
            pose: row.pose.clone(),
            line: row.line,
            sample: PointSample {
                at: Place { configuration: row.configuration.clone(), target: 0 },
                station: 0,
                point: row.point,
                sigma: row.sigma,
            },
            temperature: row.temperature,
        })
        .collect();
    let (verification, identification) = named.split_at(12);
    let found = identify(
        &IdentifyRequest {
            mounted: None,
            payload: Some(PayloadText { mass_kg: 2.5, centre_mm: (0.0, 0.0, 60.0) }),
            profile,
            profile_text: profile_text.to_owned(),
            created: "2026-01-02T03:04:05Z".to_owned(),
            inputs: Vec::new(),
            settings: EstimationSettings::default(),
            identification: identification.to_vec().into(),
            verification: verification.to_vec().into(),
            basis: "the first twelve".to_owned(),
            verification_mode: VerificationMode::Rest,
            layout: None,
            socket_distance_mm: None,
            previous: None,
        },
        &mut |_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!(found.summary.verification.is_some() && !found.summary.blind_groups.is_empty());
    assert!(found.calibration.is_some());
    let point = PointErrorText {
        at_mm: (1.0, -2.0, 3.5),
        nominal_mm: (0.25, 0.0, -1.0),
        identified_mm: (1e-6, 0.0, 0.0),
        covariance_um2: Some((1.0, 0.0, -0.5, 2.0, 0.25, 3.0)),
        rejected: true,
    };
    let samples = (1..=40).collect();
    IdentifiedText { samples, summary: found.summary, calibration: found.calibration, points: vec![point] }
}

/// Entries of every variant, with every variant of what they hold.
#[expect(clippy::too_many_lines, reason = "one of each")]
fn all_entries() -> Vec<Entry> {
    let recorded = |layout: &str, rows: Option<&str>| RecordedSet {
        file: TRICKY.to_owned(),
        kind: PoseKind::Verification,
        rows: rows.map(str::to_owned),
        layout: layout.to_owned(),
    };
    let fault = |text: &str| text.to_owned().try_into().unwrap();
    let faults: Vec<Fault> =
        ["wrong-pose@12", "target-bumped@20:5mm", "joint-sign@1:j3", "beam-break@7-9", "drift@3:0.25mm/h"]
            .into_iter()
            .filter_map(|text| Fault::try_from(text.to_owned()).ok())
            .chain([fault("inch@2")])
            .collect();
    let instruments = CoordinateUnit::ALL.map(|unit| InstrumentChoice::Manual { unit }).into_iter().chain([
        InstrumentChoice::Simulated(Simulation {
            seed: u64::MAX,
            truth: Truth::Paper,
            joint_errors: Some(JointErrorSizes { curves_urad: 100.0, ..JointErrorSizes::default() }),
            payload: Some(PayloadText { mass_kg: 2.5, centre_mm: (0.0, 0.0, 60.0) }),
            noise_mm: Some(0.5),
            faults,
            wires: vec![SimulatedWire::Serial(WireProtocol::Geocom)],
        }),
        InstrumentChoice::Simulated(Simulation::default()),
        InstrumentChoice::Replay { sets: vec![recorded("delmia", Some("pose % 17 == 0")), recorded("named", None)] },
    ]);
    let targets = [
        TargetChoice::Profile,
        TargetChoice::Known { xyz_mm: (-1.473, 26.384, 71.991), sigma_mm: 0.0 },
        TargetChoice::Free { sigma_mm: 50.0 },
        TargetChoice::Circles { xyz_mm: (0.1, 1e10, -0.0), sigma_mm: 0.013 },
    ];
    let corrections = [
        Correction::Scale { since: 1, factor: 25.4, until: None },
        Correction::Scale { since: 1, factor: 25.4, until: Some(9) },
        Correction::Swap { first: 4, second: 5 },
        Correction::Row { sample: 6, row: 0 },
        Correction::Joints { sample: 7, joints: vec![0.1, -170.25] },
        Correction::TakenBack { line: 12 },
    ];
    let bare = MeasuredText {
        reported_joints: None,
        reported_scatter: None,
        reported_count: None,
        factor: None,
        sigma_mm: None,
        scatter_mm: None,
        temperature_degc: None,
        pressure_hpa: None,
        humidity_percent: None,
        predicted_error_sigma: None,
        remarks: Vec::new(),
        findings: Vec::new(),
        ..sample(1)
    };
    let mut no_solution = identified();
    no_solution.calibration = None;
    no_solution.summary.verification = None;
    let mut entries = vec![
        opened(),
        Entry::Profile { source: TRICKY.to_owned(), sha256: "00".to_owned(), text: builtin("ur5").unwrap().to_owned() },
        Entry::CirclePoint(JointPointText { number: 1, joint: 5, joints: vec![1.0, 2.0], xyz_mm: (1.0, 2.0, 3.0) }),
        Entry::CirclesDiscarded,
        Entry::Undone { line: 4, what: TRICKY.to_owned() },
        Entry::Redone { line: 4, what: String::new() },
        Entry::JointCheckPoint(JointPointText {
            number: 1,
            joint: None,
            joints: vec![1.0, 2.0],
            xyz_mm: (1.0, 2.0, 3.0),
        }),
        Entry::JointCheckPoint(JointPointText {
            number: 2,
            joint: Some(1),
            joints: vec![1.0, 12.0],
            xyz_mm: (1.0, -2.0, 3.0),
        }),
        Entry::JointCheckDiscarded,
        Entry::Plan(plan()),
        Entry::PlanExtended(PlanText { rows: Vec::new(), condition_number: None, minutes: None, ..plan() }),
        Entry::Sample(sample(2)),
        Entry::Sample(bare),
        Entry::Refused { number: 9, pose: "7".to_owned(), reason: TRICKY.to_owned(), xyz_mm: Some((1.0, 2.0, 3.0)) },
        Entry::Refused { number: 10, pose: String::new(), reason: String::new(), xyz_mm: None },
        Entry::Row(3),
        Entry::Passed { pose: TRICKY.to_owned(), joints: vec![1.5, -2.0] },
        Entry::ThroughHome(3),
        Entry::Skipped { row: 3, skipped: true },
        Entry::Skipped { row: 3, skipped: false },
        Entry::Note { pose: Some(TRICKY.to_owned()), text: TRICKY.to_owned() },
        note(""),
        Entry::Identified(Box::new(identified())),
        Entry::Identified(Box::new(no_solution)),
        Entry::Delivered { files: vec!["a.csv".to_owned(), TRICKY.to_owned()], left_out: Vec::new(), sums: Vec::new() },
        Entry::Delivered {
            files: vec!["a.csv".to_owned()],
            left_out: vec![TRICKY.to_owned()],
            sums: vec!["00ff".to_owned()],
        },
        Entry::Corrected(CorrectedText {
            source: TRICKY.to_owned(),
            file: TRICKY.to_owned(),
            corrected: 3,
            left: 1,
            reasons: vec![TRICKY.to_owned()],
            largest_mm: Some(1.25),
            uncertainty_mm: None,
            path_mm: Some(0.1),
        }),
        Entry::Resumed { program: "trupose 9".to_owned(), torn_bytes: usize::MAX },
        Entry::Closed { reason: TRICKY.to_owned() },
        Entry::Connected { identity: TRICKY.to_owned() },
    ];
    entries.extend(Step::ALL.iter().copied().map(Entry::Step));
    entries.push(Entry::About(About { serial: TRICKY.to_owned(), ..About::default() }));
    entries.extend(instruments.map(Entry::Instrument));
    entries.extend(targets.map(Entry::Target));
    let limits = [(TRICKY.to_owned(), (-1e-9, 170.5))];
    let instrument = InstrumentText { name: TRICKY.to_owned(), sigma_um: 7.5, sigma_um_per_m: 0.0 };
    let cell = CellText { instrument: Some(instrument), planning_limits: limits.into(), ..CellText::default() };
    entries.push(Entry::Cell(cell));
    for dwell_s in [None, Some(6.5)] {
        let settings = ProgramText { dialect: "krl".to_owned(), dwell_s, speed_percent: 10.0 };
        let files = vec!["calposes.src".to_owned(), "calposes.dat".to_owned()];
        entries.push(Entry::RobotProgram(RobotProgramText { settings, files, was_driven: false }));
    }
    entries.push(Entry::ProgramDriven);
    entries.push(Entry::Payload(PayloadText { mass_kg: 2.5, centre_mm: (0.1, -20.0, 1e-9) }));
    entries.extend(corrections.map(Entry::Correction));
    let decisions = [Decision::Keep, Decision::LeaveOut, Decision::Undo];
    entries.extend(decisions.map(|decision| Entry::Decision { sample: u64::MAX, decision }));
    entries
}

/// Breaks when a variant is added: it then belongs into [`all_entries`] as well.
fn variant(entry: &Entry) -> usize {
    match entry {
        Entry::Opened { .. } => 0,
        Entry::Profile { .. } => 1,
        Entry::Step(_) => 2,
        Entry::Instrument(_) => 3,
        Entry::Target(_) => 4,
        Entry::CirclePoint(_) => 5,
        Entry::CirclesDiscarded => 6,
        Entry::Plan(_) => 7,
        Entry::PlanExtended(_) => 8,
        Entry::Sample(_) => 9,
        Entry::Refused { .. } => 10,
        Entry::Decision { .. } => 11,
        Entry::Correction(_) => 12,
        Entry::Skipped { .. } => 13,
        Entry::Note { .. } => 14,
        Entry::Identified(_) => 15,
        Entry::Delivered { .. } => 16,
        Entry::Resumed { .. } => 17,
        Entry::Closed { .. } => 18,
        Entry::Row(_) => 19,
        Entry::About(_) => 20,
        Entry::Connected { .. } => 21,
        Entry::Payload(_) => 22,
        Entry::Passed { .. } => 23,
        Entry::ThroughHome(_) => 24,
        Entry::Cell(_) => 25,
        Entry::RobotProgram(_) => 26,
        Entry::ProgramDriven => 27,
        Entry::Undone { .. } => 28,
        Entry::Redone { .. } => 29,
        Entry::JointCheckPoint(_) => 30,
        Entry::JointCheckDiscarded => 31,
        Entry::Corrected(_) => 32,
    }
}

#[test]
fn every_entry_comes_back_as_it_was() {
    let lines = lines(all_entries());
    let variants: std::collections::BTreeSet<usize> = lines.iter().map(|line| variant(&line.entry)).collect();
    assert_eq!(variants.len(), 33);
    let (text, starts) = text(&lines);
    let journal = read(&text).unwrap();
    for (read, written) in journal.lines.iter().zip(&lines) {
        assert_eq!(read, written);
    }
    assert_eq!(journal.lines.len(), lines.len());
    assert_eq!((journal.good_bytes, journal.torn_bytes), (*starts.last().unwrap(), 0));
    // The next entry continues from there.
    let (next, _) = encode(&lines[0], &journal.sum).unwrap();
    let (other, _) = encode(&lines[0], &Sum::default()).unwrap();
    assert_ne!(next, other);
}

#[test]
fn times_come_back_to_the_nanosecond() {
    let times = ["2026-03-01T09:15:02.5Z", "1969-12-31T23:59:59.999999999Z", "-009999-01-02T01:59:59Z"];
    for time in times.map(|time| time.parse::<Timestamp>().unwrap()) {
        let line = Line { number: 1, time, entry: opened() };
        let (text, _) = encode(&line, &Sum::default()).unwrap();
        assert_eq!(read(text.as_bytes()).unwrap().lines, [line]);
    }
}

/// The line that an error names.
fn damaged_line(bytes: &[u8]) -> usize {
    match read(bytes) {
        Err(JournalError::Damaged { line, .. }) => line,
        other => panic!("{other:?}"),
    }
}

#[test]
fn damage_in_the_middle_is_an_error_that_names_the_line() {
    let (text, starts) = text(&some());
    let count = starts.len() - 1;
    let part = |index: usize| &text[starts[index]..starts[index + 1]];
    // Every bit of every line before the last one. A line break that is gone makes one line of two.
    for index in 0..count - 1 {
        for at in starts[index]..starts[index + 1] - 1 {
            for bit in 0..8 {
                let mut changed = text.clone();
                changed[at] ^= 1 << bit;
                assert_eq!(damaged_line(&changed), index + 1, "byte {at}, bit {bit}");
            }
        }
    }
    for index in 0..count - 1 {
        let lost = [&text[..starts[index]], &text[starts[index + 1]..]].concat();
        let twice = [&text[..starts[index + 1]], part(index), &text[starts[index + 1]..]].concat();
        let swapped = [&text[..starts[index]], part(index + 1), part(index), &text[starts[index + 1]..]].concat();
        // A line of another journal, intact.
        let foreign = [&text[..starts[index + 1]], part(0), &text[starts[index + 1]..]].concat();
        let blank = [&text[..starts[index]], b"\n", &text[starts[index]..]].concat();
        for (what, bytes, line) in [
            ("lost", &lost, index + 1),
            ("twice", &twice, index + 2),
            ("swapped", &swapped, index + 1),
            ("foreign", &foreign, index + 2),
            ("blank", &blank, index + 1),
        ] {
            assert_eq!(damaged_line(bytes), line, "line {} {what}", index + 1);
        }
    }
    let error = read(&[&text[..starts[2]], b"x\n", &text[starts[2]..]].concat()).unwrap_err();
    insta::assert_snapshot!(error, @"line 3 of the journal is damaged (it does not read like a line of a journal); lines before it are intact, those after it cannot be trusted");
}

#[test]
fn a_line_break_that_is_gone_is_damage() {
    let (text, starts) = text(&some());
    let count = starts.len() - 1;
    for index in 0..count - 2 {
        let mut changed = text.clone();
        changed[starts[index + 1] - 1] = b' ';
        assert_eq!(damaged_line(&changed), index + 1);
    }
}

#[test]
fn a_torn_last_line_is_dropped_and_said_wherever_it_is_cut() {
    let lines = some();
    let (text, starts) = text(&lines);
    let (last, end) = (starts[starts.len() - 2], text.len());
    let tails: [&[u8]; 5] = [b"", b"\0", &[0; 5000], b"garbage \xff\xfe(\"", b"\r"];
    for cut in last..end {
        for tail in tails {
            let bytes = [&text[..cut], tail].concat();
            let journal = read(&bytes).unwrap();
            assert_eq!(journal.lines, lines[..lines.len() - 1], "cut at {cut}");
            assert_eq!((journal.good_bytes, journal.torn_bytes), (last, cut - last + tail.len()));
            // NUL bytes as a file system leaves them: as long as the line was to be.
            let holes = [&text[..cut], &vec![0; end - cut], b"\n"].concat();
            assert_eq!(read(&holes).unwrap().lines.len(), lines.len() - 1);
        }
    }
    // Behind a whole line as well.
    for tail in tails {
        let journal = read(&[&text[..], tail].concat()).unwrap();
        assert_eq!((journal.lines, journal.torn_bytes), (lines.clone(), tail.len()));
    }
    // A line break in it says that something was written after it: that is no crash.
    assert_eq!(damaged_line(&[&text[..end - 5], b"\n\0\0\n"].concat()), lines.len());
}

#[test]
fn every_cut_gives_whole_lines() {
    let lines = some();
    let (text, starts) = text(&lines);
    for cut in starts[1]..=text.len() {
        let whole = starts.iter().filter(|start| **start <= cut).count() - 1;
        let journal = read(&text[..cut]).unwrap();
        assert_eq!(journal.lines, lines[..whole]);
        assert_eq!((journal.good_bytes, journal.torn_bytes), (starts[whole], cut - starts[whole]));
    }
    for cut in 0..starts[1] {
        let error = read(&text[..cut]).unwrap_err();
        assert_eq!(error, JournalError::Empty, "cut at {cut}");
    }
}

#[test]
fn what_is_no_journal_is_refused() {
    assert_eq!(read(b""), Err(JournalError::Empty));
    assert_eq!(read(b"robot: ur5"), Err(JournalError::NotAJournal));
    assert_eq!(read(b"robot: ur5\n"), Err(JournalError::NotAJournal));
    assert_eq!(read(&[0; 64]), Err(JournalError::NotAJournal));
    assert_eq!(read(b"a\nb\n"), Err(JournalError::NotAJournal));
    let (closed, _) = text(&lines(vec![Entry::Closed { reason: "?".to_owned() }, opened()]));
    assert_eq!(read(&closed), Err(JournalError::NotAJournal));
}

#[test]
fn bytes_that_are_no_text_are_named() {
    let (mut text, starts) = text(&some());
    text[starts[2] + 30] = 0xff;
    let error = read(&text).unwrap_err();
    assert_eq!(error, JournalError::Damaged { line: 3, what: "it is not UTF-8 text".to_owned() });
}

/// A line of a program that this one does not know, with its right check sum.
fn foreign(number: u64, entry: &str, before: &Sum) -> (String, Sum) {
    let rest = format!("{number}, \"2030-01-01T00:00:00Z\", {entry})");
    let sum = before.next(&rest);
    (format!("(\"{}\", {rest}\n", sum.0), sum)
}

#[test]
fn a_newer_schema_names_the_program_that_wrote_it() {
    let newer = JournalError::Newer { found: SCHEMA + 1, program: "trupose 7.0".to_owned() };
    // Known fields only; a field that is not known; and in a journal of one line.
    for fields in ["", ",cell:\"B\""] {
        let entry = format!("Opened(schema:{},program:\"trupose 7.0\",name:\"x\"{fields})", SCHEMA + 1);
        let (first, sum) = foreign(1, &entry, &Sum::default());
        let (second, _) = foreign(2, "Wonder(1)", &sum);
        assert_eq!(read(first.as_bytes()).unwrap_err(), newer);
        assert_eq!(read(format!("{first}{second}").as_bytes()).unwrap_err(), newer);
    }
    insta::assert_snapshot!(newer, @"the journal has schema 2, this program understands up to 1; it was written by trupose 7.0");
}

#[test]
fn an_intact_line_is_never_taken_for_a_torn_one() {
    let lines = some();
    let (text, _) = text(&lines);
    let sum = read(&text).unwrap().sum;
    let next = lines.len() as u64 + 1;
    // It was on disk and counted, although this program does not understand it: dropping it would lose data.
    let (unknown, _) = foreign(next, "Wonder(1)", &sum);
    let (misnumbered, _) = foreign(next + 1, "CirclesDiscarded", &sum);
    for line in [unknown, misnumbered] {
        assert_eq!(damaged_line(&[&text, line.as_bytes()].concat()), lines.len() + 1, "{line}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to the bytes: an error, or the lines before the damage with what is lost told.
    #[test]
    fn random_damage_never_gives_a_silently_different_session(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..6),
        cut in any::<Option<prop::sample::Index>>(),
    ) {
        let lines = some();
        let (whole, starts) = text(&lines);
        let mut bytes = whole.clone();
        for (at, byte, how) in changes {
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => drop(bytes.remove(at)),
            }
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        let Ok(journal) = read(&bytes) else { return Ok(()) };
        prop_assert!(lines.starts_with(&journal.lines));
        prop_assert_eq!(journal.good_bytes, starts[journal.lines.len()]);
        prop_assert_eq!(&bytes[..journal.good_bytes], &whole[..journal.good_bytes]);
        prop_assert_eq!(journal.good_bytes + journal.torn_bytes, bytes.len());
        // Nothing but a cut at the end of a line goes unnoticed.
        prop_assert!(journal.torn_bytes > 0 || whole.starts_with(&bytes));
    }

    #[test]
    fn bytes_at_random_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read(&bytes).is_err());
        let (mut text, _) = text(&some());
        text.extend_from_slice(&bytes);
        drop(read(&text));
    }

    /// Texts of all kinds come back, each on one line.
    #[test]
    fn every_note_comes_back(text in any::<String>(), pose in any::<Option<String>>()) {
        let written = lines(vec![opened(), Entry::Note { pose, text: text.clone() }, note(&text)]);
        let (bytes, _) = self::text(&written);
        prop_assert_eq!(read(&bytes).unwrap().lines, written);
    }

    /// Numbers come back bit by bit.
    #[test]
    fn every_number_comes_back(x in any::<f64>(), factor in any::<f64>()) {
        let correction = Entry::Correction(Correction::Scale { since: 1, factor, until: Some(1) });
        let measured = Entry::Sample(MeasuredText { xyz_mm: (x, -x, 1.0), ..sample(1) });
        let written = lines(vec![opened(), correction, measured]);
        let (bytes, _) = self::text(&written);
        prop_assert_eq!(read(&bytes).unwrap().lines, written);
    }
}
