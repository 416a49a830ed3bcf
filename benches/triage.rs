//! Rates of the live triage: random robots, poses and tracker positions, one fault per session. The first table is what `docs/triage.md`
//! promises, and fails where it is not kept; the second one, faults by size and by place in the session, is printed with
//! `TRUPOSE_TRIAGE_TABLE=1`. `TRUPOSE_TRIAGE_SESSIONS` sets the number of sessions per row, 200 without it.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark that fails should say so; it prints tables")]

#[path = "../tests/support/faulty_session.rs"]
mod faulty_session;

use faulty_session::{Fault, Robot, Row, false_alarms, measure, promises};
use trupose::units::{DEGREE, MILLIMETRE};

/// Percentage of sessions in which a promised fault must be found and named.
const PROMISED: f64 = 95.0;
/// Percentage of faultless sessions that may have a finding.
const FALSE_ALARMS: usize = 1;

fn sessions() -> usize {
    let given = std::env::var_os("TRUPOSE_TRIAGE_SESSIONS");
    given.and_then(|text| text.to_str().and_then(|text| text.parse().ok())).unwrap_or(200)
}

fn robots() -> [Robot; 2] {
    [Robot::new("soochow"), Robot::new("ur5")]
}

/// Measures a row of the table, and prints it.
fn row(robot: &Robot, fault: Fault, at: Option<usize>) -> Row {
    let row = measure(robot, fault, at, sessions());
    let cells = |values: [f64; 3]| values.map(|value| format!("{value:.1}")).join(" / ");
    let place = at.map_or_else(|| "random".to_owned(), |at| (at + 1).to_string());
    let (found, named, first) = (cells(row.detected), cells(row.named), cells(row.first));
    println!("| {} | {fault:?} | {place} | {found} | {named} | {first} |", robot.name);
    row
}

/// Prints how many faultless sessions have a finding, and how many there were.
fn alarms(robot: &Robot, count: usize) -> usize {
    let alarms = false_alarms(robot, count);
    println!("{}: {alarms} of {count} faultless sessions with a finding", robot.name);
    alarms
}

/// What docs/triage.md promises.
fn promised() {
    let count = 2 * sessions();
    let robots = robots();
    let alarms: usize = robots.iter().map(|robot| alarms(robot, count)).sum();
    println!("| robot | fault | at | found (%) | named (%) | first (%) |\n|---|---|---|---|---|---|");
    let mut missed = Vec::new();
    for robot in &robots {
        for (fault, at) in promises() {
            if !row(robot, fault, at).keeps_the_promise(fault, PROMISED) {
                missed.push(format!("{} {fault:?} {at:?}", robot.name));
            }
        }
    }
    assert!(missed.is_empty(), "not found and named as often as promised: {}", missed.join(", "));
    assert!(100 * alarms <= FALSE_ALARMS * robots.len() * count, "{alarms} false alarms");
}

/// Faults of other sizes, by the sample at which they happen.
fn by_size_and_place() {
    for robot in robots() {
        alarms(&robot, 5 * sessions());
        for joint in [1, 3, 4] {
            row(&robot, Fault::SignAll(joint), None);
        }
        for at in [5, 9, 14, 19] {
            for degrees in [1.0, 3.0, 10.0] {
                row(&robot, Fault::Joint(degrees * DEGREE), Some(at));
            }
            for millimetres in [0.5, 1.0, 2.0, 5.0, 10.0, 20.0] {
                row(&robot, Fault::Bump(millimetres * MILLIMETRE), Some(at));
                row(&robot, Fault::Outlier(millimetres * MILLIMETRE), Some(at));
            }
        }
    }
}

fn main() {
    promised();
    if std::env::var_os("TRUPOSE_TRIAGE_TABLE").is_some() {
        by_size_and_place();
    }
}
