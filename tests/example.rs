//! The examples in `sessions/`, made again and checked against what is committed.
//!
//! `soochow-example` is made here from the method paper's tables. To write it again: `TRUPOSE_WRITE_EXAMPLE=1 cargo test --test main example`.
//! `example` is a finished session; the head of `sessions/example.script.ron` has the command that makes it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::paper_case::{PaperCase, measure, paper_deviations, random_configurations, seeded};
use crate::support::{root, trupose};
use serde_json::Value;
use trupose::kinematics::JointType;
use trupose::session::calibration::Calibration;
use trupose::session::measurements::{Row, read, write};
use trupose::units::{MICROMETRE, to_mm};

const JOINTS: [JointType; 6] = [JointType::Revolute; 6];

fn folder() -> PathBuf {
    root().join("sessions/soochow-example")
}

/// Random poses of the paper's robot with the errors of table II and 10 µm of noise, as two tables.
fn example() -> [(&'static str, String); 2] {
    let mut rng = seeded(2014);
    let truth = PaperCase::new(Vec::new()).problem().arm_with(&paper_deviations());
    let mut table = |poses: usize, purpose: &str| {
        let samples = measure(&truth, &random_configurations(poses, &mut rng), 10.0 * MICROMETRE, &mut rng);
        let rows: Vec<Row> = samples
            .into_iter()
            .enumerate()
            .map(|(index, sample)| Row {
                line: 0,
                pose: index.to_string(),
                target: None,
                configuration: sample.at.configuration,
                point: sample.point,
                sigma: None,
                temperature: None,
                fields: Vec::new(),
            })
            .collect();
        format!(
            "# Simulated, not measured: the robot of the method paper's table I with the errors of its table II,\n\
             # random poses, 10 um of noise per coordinate. For {purpose}.\n{}",
            write(&rows, &JOINTS)
        )
    };
    [("measurements.csv", table(56, "identification")), ("verification.csv", table(20, "verification"))]
}

#[test]
fn the_committed_example_is_what_the_generator_makes() {
    for (name, text) in example() {
        let path = folder().join(name);
        if std::env::var_os("TRUPOSE_WRITE_EXAMPLE").is_some() {
            fs::create_dir_all(folder()).unwrap();
            fs::write(&path, &text).unwrap();
        }
        let committed = fs::read_to_string(&path).unwrap();
        let (made, committed) = (read(&text, name, &JOINTS).unwrap(), read(&committed, name, &JOINTS).unwrap());
        assert_eq!(made.rows.len(), committed.rows.len());
        // Sines and cosines may differ in the last digit from one machine to the next.
        for (made, committed) in made.rows.iter().zip(&committed.rows) {
            assert!(to_mm((made.point - committed.point).norm()) < 1e-5, "{name} pose {}", made.pose);
            assert_eq!(made.configuration, committed.configuration);
        }
    }
}

#[test]
fn the_first_identification_of_the_readme() {
    let measurements = ["--measurements", "sessions/soochow-example/measurements.csv"];
    let verification = ["--verify", "sessions/soochow-example/verification.csv"];
    let output = trupose(&[&["identify", "--profile", "soochow"][..], &measurements, &verification].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let volatile = text.lines().filter(|line| !line.starts_with("  trupose "));
    insta::assert_snapshot!(volatile.collect::<Vec<_>>().join("\n"));
    assert!(text.lines().all(|line| line.chars().count() <= 80), "wider than 80 columns");
}

/// Fails where two JSON values differ by more than a machine's last digits; what depends on the program's version or holds sums of
/// other files is left out.
fn compare(made: &Value, committed: &Value, place: &str) {
    match (made, committed) {
        (Value::Object(made), Value::Object(committed)) => {
            assert_eq!(made.keys().collect::<Vec<_>>(), committed.keys().collect::<Vec<_>>(), "{place}");
            for (name, value) in made {
                let is_number_of_document = name == "number" && value.is_string();
                let depends =
                    ["program", "check", "sha256", "singular_value_gap", "iterations"].contains(&name.as_str());
                if !depends && !is_number_of_document {
                    compare(value, &committed[name], &format!("{place}.{name}"));
                }
            }
        }
        (Value::Array(made), Value::Array(committed)) => {
            assert_eq!(made.len(), committed.len(), "{place}");
            for (index, (made, committed)) in made.iter().zip(committed).enumerate() {
                compare(made, committed, &format!("{place}[{index}]"));
            }
        }
        (Value::Number(made), Value::Number(committed)) => {
            let (made, committed) = (made.as_f64().unwrap(), committed.as_f64().unwrap());
            assert!(
                (made - committed).abs() <= 1e-6 * committed.abs().max(1.0),
                "{place}: {made} instead of {committed}"
            );
        }
        _ => assert_eq!(made, committed, "{place}"),
    }
}

/// A text without its numbers and hashes, which may differ in the last digit from machine to machine.
fn words(text: &str) -> Vec<&str> {
    let is_sum = |piece: &&str| matches!(piece.len(), 10 | 32..) && piece.chars().all(|c| c.is_ascii_hexdigit());
    let pieces = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|piece| !is_sum(piece));
    pieces.flat_map(|piece| piece.split(|c: char| c.is_ascii_digit())).filter(|word| word.len() > 1).collect()
}

#[test]
fn the_finished_session_is_what_its_script_makes() {
    let in_words = "trupose --script sessions/example.script.ron --sessions sessions";
    assert!(fs::read_to_string(root().join("sessions/example.script.ron")).unwrap().contains(in_words));
    let place = tempfile::tempdir().unwrap();
    let sessions = place.path().to_str().unwrap();
    let output = trupose(&["--script", "sessions/example.script.ron", "--sessions", sessions]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let (made, committed) = (place.path().join("example"), root().join("sessions/example"));
    let names = |folder: &Path| {
        let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| name != ".lock").collect();
        names.sort();
        names
    };
    assert_eq!(names(&made), names(&committed));
    for name in names(&made).iter().filter(|name| *name != "recording.rrd") {
        let [made, committed] = [&made, &committed].map(|folder| fs::read_to_string(folder.join(name)).unwrap());
        assert!(
            words(&made) == words(&committed),
            "{name} is not what the program writes today: make the example again"
        );
    }
    let text = |folder: &Path, name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let report = |folder: &Path| serde_json::from_str::<Value>(&text(folder, "report.json")).unwrap();
    compare(&report(&made), &report(&committed), "report");
    let calibration = |folder: &Path| {
        let calibration = Calibration::parse(&text(folder, "calibration.ron")).unwrap();
        calibration.parameters.into_iter().map(|parameter| (parameter.id, parameter.deviation, parameter.sigma))
    };
    for (made, committed) in calibration(&made).zip(calibration(&committed)) {
        assert_eq!(made.0, committed.0);
        let (sigma, committed_sigma) = (made.2.unwrap_or_default(), committed.2.unwrap_or_default());
        let is_same = (made.1 - committed.1).abs() < 1e-6 && (sigma - committed_sigma).abs() < 1e-6;
        assert!(is_same, "{made:?} {committed:?}");
    }
    let points = |folder: &Path| read(text(folder, "measurements.csv"), "measurements.csv", &JOINTS).unwrap();
    let (made, again) = (points(&made), points(&committed));
    assert_eq!(made.rows.len(), again.rows.len());
    for (made, again) in made.rows.iter().zip(&again.rows) {
        assert!(to_mm((made.point - again.point).norm()) < 1e-5 && made.configuration == again.configuration);
    }
    // Nothing of it but small.
    let size: u64 = fs::read_dir(&committed).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(size < 1_000_000, "{size} bytes");
}
