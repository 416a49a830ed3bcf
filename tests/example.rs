//! The example in `sessions/soochow-example`: made here from the method paper's tables, and checked against what is committed.
//!
//! To write it anew: `TRUPOSE_WRITE_EXAMPLE=1 cargo test --test example`.

#![expect(clippy::disallowed_methods, reason = "a failure of a test is a panic; test files need no atomic writes")]

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;

use support::{PaperCase, measure, paper_deviations, random_configurations, seeded};
use trupose::identification::ArmModel;
use trupose::kinematics::JointType;
use trupose::session::measurements::{Row, read, write};
use trupose::units::{MICROMETRE, to_mm};

const JOINTS: [JointType; 6] = [JointType::Revolute; 6];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/soochow-example")
}

/// Random poses of the paper's robot with the errors of table II and 10 µm of noise, as two tables.
fn example() -> [(&'static str, String); 2] {
    let mut rng = seeded(2014);
    let truth = ArmModel::with_deviations(&PaperCase::new(Vec::new()).problem(), &paper_deviations());
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
            std::fs::create_dir_all(folder()).unwrap();
            std::fs::write(&path, &text).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap();
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
    let output = Command::new(env!("CARGO_BIN_EXE_trupose"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["identify", "--profile", "soochow"])
        .args(["--measurements", "sessions/soochow-example/measurements.csv"])
        .args(["--verify", "sessions/soochow-example/verification.csv"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let volatile = text.lines().filter(|line| !line.starts_with("  trupose "));
    insta::assert_snapshot!(volatile.collect::<Vec<_>>().join("\n"));
    assert!(text.lines().all(|line| line.chars().count() <= 80), "wider than 80 columns");
}
