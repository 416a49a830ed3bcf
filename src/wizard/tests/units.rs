//! Readings in another unit: found, corrected, and the correction undone.

use super::bench::{Bench, MEASURED, reading, seen_at, started, texts};
use crate::session::journal::{Correction, Entry, FindingCause};
use crate::session::set_up::Step;
use crate::session::state::Session;
use crate::units::{INCH, MICROMETRE, MILLIMETRE};
use crate::wizard::{Answer, Effect, Intent, Request, Severity};

/// Measures the pose shown with an instrument that counts in inches, which are taken for millimetres.
fn inches(bench: &mut Bench) -> Vec<String> {
    let effects = bench.intend(Intent::Measure);
    let (id, Request::Measure(request)) = started(&effects) else { panic!() };
    let mut reading = reading(&request);
    reading.point.coords *= MILLIMETRE / INCH;
    let effects = bench.answer(id, Answer::Measured(reading));
    let told = texts(&effects);
    bench.settle(effects);
    told
}

/// Whether every sample that counts is where the tracker has seen the SMR.
fn all_are_right(session: &Session) -> bool {
    session.counted().all(|sample| {
        let off = session.point_of(sample) - seen_at(&session.configuration_of(sample));
        off.norm() < 20.0 * MICROMETRE
    })
}

fn cause(bench: &Bench) -> Option<FindingCause> {
    bench.capture().finding.map(|finding| finding.cause)
}

/// Eight good points, the ninth in inches.
fn one_in_inches() -> Bench {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(8);
    inches(&mut bench);
    assert_eq!(cause(&bench), Some(FindingCause::Unit));
    bench
}

fn corrects(bench: &mut Bench) -> Vec<Effect> {
    let effects = bench.intend(Intent::ApplyRemedy);
    bench.settle(effects.clone());
    effects
}

#[test]
fn one_reading_in_inches_is_corrected_and_no_other() {
    let mut bench = one_in_inches();
    let effects = corrects(&mut bench);
    assert_eq!(texts(&effects), ["append 19 corrected: coordinates of measurement 9 times 25.4"]);
    assert_eq!(
        bench.told(),
        "coordinates of measurement 9 are multiplied by 25.4; the original values stay in the journal"
    );
    bench.measure(usize::MAX);
    assert_eq!((cause(&bench), bench.capture().measured), (None, MEASURED));
    assert!(all_are_right(bench.wizard.session()));
    assert!(bench.wizard.session().samples.iter().all(|sample| sample.noted.factor.is_none()));
}

#[test]
fn undo_takes_the_correction_back_that_the_sample_led_to() {
    let mut bench = one_in_inches();
    corrects(&mut bench);
    let effects = bench.intend(Intent::Undo);
    assert_eq!(texts(&effects), ["append 20 undone: a correction (line 19)"]);
    bench.settle(effects);
    assert_eq!(bench.told(), "undone: a correction");
    assert!(cause(&bench).is_some(), "the question is open again");
    bench.does(Intent::Undo);
    let session = bench.wizard.session();
    assert_eq!((session.corrections.len(), session.counted().count(), session.correction_of(9)), (0, 8, 1.0));
    assert_eq!((bench.capture().pose.as_deref(), cause(&bench)), (Some("9"), None));
    bench.measure(usize::MAX);
    assert_eq!((cause(&bench), bench.capture().measured), (None, MEASURED));
    assert!(all_are_right(bench.wizard.session()));
}

#[test]
fn undoing_past_the_sample_takes_the_correction_back_as_well() {
    let mut bench = Bench::at(Step::Capture);
    // In inches from the first point on: the fourth shows it.
    for _ in 0..4 {
        inches(&mut bench);
    }
    corrects(&mut bench);
    assert!(all_are_right(bench.wizard.session()));
    bench.measure(2);
    for undone in 1..=7 {
        assert_eq!(bench.wizard.session().corrections.len(), usize::from(undone <= 3));
        bench.does(Intent::Undo);
    }
    assert_eq!(bench.wizard.session().corrections, []);
    bench.measure(usize::MAX);
    assert_eq!((cause(&bench), bench.capture().measured), (None, MEASURED));
    assert!(all_are_right(bench.wizard.session()));
}

#[test]
fn an_instrument_that_stays_in_the_other_unit_is_asked_about_once() {
    let mut bench = one_in_inches();
    corrects(&mut bench);
    let told = inches(&mut bench);
    assert!(told[0].contains("times 25.4, in the unit of the one before"), "the journal says so: {told:?}");
    assert_eq!(cause(&bench), None);
    assert_eq!(bench.wizard.notice().unwrap().severity, Severity::Attention);
    assert_eq!(bench.told(), "pose 10: still in the wrong unit; its coordinates are multiplied by 25.4");
    // Across the pose that is measured again for drift.
    while bench.capture().measured < 16 {
        inches(&mut bench);
        assert_eq!(cause(&bench), None, "{}", bench.told());
    }
    assert!(bench.capture().drift[0].moved_mm < 0.03);
    assert!(all_are_right(bench.wizard.session()));
    // Set back, a point counts as it is; switched once more, it is asked about once more.
    bench.measure(1);
    assert_eq!((cause(&bench), bench.told().as_str()), (None, ""));
    inches(&mut bench);
    assert_eq!(cause(&bench), Some(FindingCause::Unit));
    corrects(&mut bench);
    assert!(all_are_right(bench.wizard.session()));
    let resumed = bench.resumed(bench.journal.len()).0;
    assert_eq!(resumed.wizard.session().samples, bench.wizard.session().samples);
}

#[test]
fn a_fault_of_a_reading_in_the_other_unit_is_found_behind_it() {
    let mut bench = one_in_inches();
    corrects(&mut bench);
    for _ in 0..4 {
        inches(&mut bench);
    }
    // Not as far off as another unit, but far more than the arm.
    let effects = bench.intend(Intent::Measure);
    let (id, Request::Measure(request)) = started(&effects) else { panic!() };
    let mut reading = reading(&request);
    reading.point.x += 5.0 * MILLIMETRE;
    reading.point.coords *= MILLIMETRE / INCH;
    let effects = bench.answer(id, Answer::Measured(reading));
    bench.settle(effects);
    let found = cause(&bench);
    assert!(found.is_some(), "{}", bench.told());
}

/// Journals of earlier versions: a correction without an end continues.
#[test]
fn a_correction_without_an_end_counts_for_all_that_follows() {
    let mut bench = one_in_inches();
    let Entry::Sample(noted) = bench.last_entry().clone() else { panic!() };
    assert_eq!(noted.findings[0].remedy, Some(Correction::Scale { since: 9, factor: 25.4, until: Some(9) }));
    corrects(&mut bench);
    let last = bench.journal.last_mut().unwrap();
    last.entry = Entry::Correction(Correction::Scale { since: 9, factor: 25.4, until: None });
    let (mut bench, effects) = bench.resumed(bench.journal.len());
    bench.settle(effects);
    inches(&mut bench);
    assert_eq!(cause(&bench), None);
    let noted = &bench.wizard.session().samples.last().unwrap().noted;
    assert_eq!(noted.factor, None, "the correction says it already");
    // In millimetres again: found once, then known.
    bench.measure(1);
    assert_eq!(cause(&bench), Some(FindingCause::Unit));
    corrects(&mut bench);
    bench.measure(usize::MAX);
    assert_eq!((cause(&bench), bench.capture().measured), (None, MEASURED));
    assert!(all_are_right(bench.wizard.session()));
}
