//! The program as its users run it: exit codes, messages about bad data, files written and read back.

use std::fs;
use std::path::PathBuf;

use crate::support::{root, trupose};
use serde_json::Value;

fn example(file: &str) -> String {
    let path = root().join("sessions/soochow-example").join(file);
    fs::read_to_string(path).unwrap()
}

/// The example's header and rows, cell by cell.
fn cells() -> (Vec<String>, Vec<Vec<String>>) {
    let text = example("measurements.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let header = split(lines.next().unwrap());
    (header, lines.map(split).collect())
}

/// A table changed by `change`, written to a temporary folder.
struct Table {
    folder: tempfile::TempDir,
}

impl Table {
    fn changed(change: impl FnOnce(&mut Vec<String>, &mut Vec<Vec<String>>)) -> Self {
        let (mut header, mut rows) = cells();
        change(&mut header, &mut rows);
        let lines: Vec<String> = std::iter::once(&header).chain(&rows).map(|cells| cells.join(",")).collect();
        Self::text(&lines.join("\n"))
    }

    fn text(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("table.csv"), text).unwrap();
        Self { folder }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("table.csv")
    }

    /// Identifies from it: exit code, stdout, stderr without the folder's name.
    fn identify(&self, more: &[&str]) -> (i32, String, String) {
        let path = self.path();
        let mut arguments = vec!["identify", "--profile", "soochow", "--measurements", path.to_str().unwrap()];
        arguments.extend(["--verify", "sessions/soochow-example/verification.csv"]);
        arguments.extend(more);
        let output = trupose(&arguments);
        let clean = |bytes: Vec<u8>| {
            String::from_utf8(bytes).unwrap().replace(&format!("{}/", self.folder.path().display()), "")
        };
        (output.status.code().unwrap(), clean(output.stdout), clean(output.stderr))
    }

    fn json(&self, more: &[&str]) -> (i32, Value) {
        let (code, out, err) = self.identify(&[more, &["--json"]].concat());
        (code, serde_json::from_str(&out).unwrap_or_else(|_| panic!("no JSON; stderr: {err}")))
    }
}

/// Multiplies the numbers of some columns.
fn scale(rows: &mut [Vec<String>], columns: std::ops::Range<usize>, factor: f64) {
    for row in rows {
        for cell in &mut row[columns.clone()] {
            *cell = (cell.parse::<f64>().unwrap() * factor).to_string();
        }
    }
}

fn codes(report: &Value) -> Vec<String> {
    let warnings = report["warnings"].as_array().unwrap();
    warnings.iter().map(|warning| warning["code"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn mistakes_in_a_whole_table_are_named_and_refused() {
    let rename = |header: &mut Vec<String>, from: &str, to: &str| {
        for name in header {
            *name = name.replace(from, to);
        }
    };
    let cases: [(Table, &str); 8] = [
        (Table::changed(|header, _| rename(header, "_deg", "_rad")), "fit when read as degrees"),
        (Table::changed(|_, rows| scale(rows, 1..7, std::f64::consts::PI / 180.0)), "fit when read as radians"),
        (Table::changed(|_, rows| scale(rows, 7..10, 1e-3)), "metres were read as millimetres"),
        (Table::changed(|_, rows| scale(rows, 7..10, 1.0 / 25.4)), "inches were read as millimetres"),
        (Table::changed(|header, _| rename(header, "_mm", "_m")), "millimetres were read as metres"),
        (Table::changed(|_, rows| scale(rows, 4..5, -1.0)), "joint J4 counts the other way"),
        (
            Table::changed(|_, rows| {
                for row in rows {
                    row[3] = (row[3].parse::<f64>().unwrap() + 90.0).to_string();
                }
            }),
            "joint J3 has another zero: the data fit with -90 deg added",
        ),
        (Table::changed(|_, rows| scale(rows, 8..9, -1.0)), "left-handed"),
    ];
    for (table, cause) in cases {
        // What the instrument promises for each point says nothing about such mistakes.
        let with_sigma: Vec<String> = fs::read_to_string(table.path())
            .unwrap()
            .lines()
            .enumerate()
            .map(|(row, line)| if row == 0 { format!("{line},sigma_mm") } else { format!("{line},0.010") })
            .collect();
        for table in [Table::text(&with_sigma.join("\n")), table] {
            let (code, out, err) = table.identify(&[]);
            assert_eq!((code, out.as_str()), (2, ""), "{cause}: {err}");
            let flat = err.replace("\n ", "");
            assert!(err.starts_with("error: ") && flat.contains(cause), "{cause}: {err}");
        }
    }
}

#[test]
fn single_wrong_rows_are_named_and_left_out() {
    let bumped = Table::changed(|_, rows| rows[5][7] = (rows[5][7].parse::<f64>().unwrap() + 2.0).to_string());
    let mistyped = Table::changed(|_, rows| rows[5][2] = "80".to_owned());
    for table in [bumped, mistyped] {
        let (code, report) = table.json(&[]);
        let rejected = report["rejected"].as_array().unwrap();
        assert_eq!((code, rejected.len()), (0, 1), "{rejected:?}");
        // Line 1 is the header.
        assert_eq!((&rejected[0]["pose"], &rejected[0]["line"]), (&"5".into(), &7.into()));
    }
    let swapped = Table::changed(|_, rows| {
        let (first, second) = (rows[16][7..].to_vec(), rows[17][7..].to_vec());
        rows[16].splice(7.., second);
        rows[17].splice(7.., first);
    });
    let (code, report) = swapped.json(&[]);
    assert_eq!(code, 0);
    let reasons: Vec<&str> =
        report["rejected"].as_array().unwrap().iter().map(|r| r["reason"].as_str().unwrap()).collect();
    assert_eq!(reasons, ["looks swapped with pose 17 (line 19)", "looks swapped with pose 16 (line 18)"]);
}

#[test]
fn poor_data_are_never_accepted() {
    let few = Table::changed(|_, rows| rows.truncate(8));
    let two_joints = Table::changed(|_, rows| {
        // Poses along joints 1 and 2 of the true robot would be needed to fit; here the point is that nothing else moves.
        let first = rows[0].clone();
        for row in rows {
            row[3..7].clone_from_slice(&first[3..7]);
        }
    });
    let (code, report) = few.json(&[]);
    assert_eq!((code, report["verdict"]["status"].as_str()), (1, Some("not_accepted")));
    assert_eq!(codes(&report)[0], "poor_data");
    let (code, out, err) = two_joints.identify(&[]);
    assert!(code != 0, "{out}{err}");
    let shifted = Table::changed(|_, rows| {
        let first = rows[0][7..].to_vec();
        for index in 1..rows.len() {
            let next = rows[index][7..].to_vec();
            rows[index - 1].splice(7.., next);
        }
        rows.last_mut().unwrap().splice(7.., first);
    });
    let (code, _, err) = shifted.identify(&[]);
    let flat = err.replace("\n ", "");
    assert!(
        code == 2 && flat.contains("from sample 1 on, each point belongs to the joint values of the row below"),
        "{err}"
    );
    assert!(!flat.contains("equally well"), "{err}");
    // Two halves of different rows: nothing simple explains it.
    let mixed = Table::changed(|_, rows| {
        let points: Vec<Vec<String>> = rows.iter().map(|row| row[7..].to_vec()).collect();
        let count = rows.len();
        for (index, row) in rows.iter_mut().enumerate() {
            row.splice(7.., points[(index * 25 + 11) % count].clone());
        }
    });
    let (code, report) = mixed.json(&[]);
    assert_eq!((code, report["verdict"]["status"].as_str()), (1, Some("not_accepted")));
    assert!(codes(&report).contains(&"implausible".to_owned()));
}

#[test]
fn only_two_moving_joints_are_called_out() {
    // Simulated on the nominal robot, so that nothing but the excitation is wrong.
    use trupose::kinematics::JointType;
    use trupose::kinematics::Place;
    use trupose::session::measurements::{Row, write};
    let (profile, _) = trupose::profile::Profile::parse(trupose::profile::builtin("soochow").unwrap(), "").unwrap();
    let model = profile.arm();
    let rows: Vec<Row> = (0..40)
        .map(|index| {
            let turn = f64::from(index);
            let configuration = vec![(0.9 * turn).sin(), 0.8 * (1.7 * turn).cos(), 0.1, 0.2, 0.5, 0.3];
            let point = model.point_in_base(&Place { configuration: configuration.clone(), target: 0 });
            Row {
                line: 0,
                pose: index.to_string(),
                target: None,
                configuration,
                point,
                sigma: None,
                temperature: None,
                fields: Vec::new(),
            }
        })
        .collect();
    let (code, report) = Table::text(&write(&rows, &[JointType::Revolute; 6])).json(&[]);
    assert_eq!((code, report["verdict"]["status"].as_str()), (1, Some("not_accepted")));
    let messages: Vec<&str> =
        report["warnings"].as_array().unwrap().iter().map(|warning| warning["message"].as_str().unwrap()).collect();
    for joint in ["J3", "J4", "J5", "J6"] {
        let wanted = format!("joint {joint} hardly moves");
        assert!(messages.iter().any(|message| message.starts_with(&wanted)), "{wanted}: {messages:?}");
    }
}

#[test]
fn the_verdict_needs_samples_that_were_not_used() {
    let measurements = "sessions/soochow-example/measurements.csv";
    let unverified = trupose(&["identify", "--profile", "soochow", "--measurements", measurements, "--json"]);
    let report: Value = serde_json::from_slice(&unverified.stdout).unwrap();
    assert_eq!((unverified.status.code(), report["verdict"]["status"].as_str()), (Some(0), Some("not_evaluated")));
    assert!(report["verification"].is_null());
    let itself =
        ["identify", "--profile", "soochow", "--measurements", measurements, "--verify", measurements, "--json"];
    let output = trupose(&itself);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), codes(&report)[0].as_str()), (Some(1), "not_independent"));
}

/// Identifies the example into a folder.
fn calibrated(more: &[&str]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["identify", "--profile", "soochow", "--out", folder.path().to_str().unwrap()];
    if !more.contains(&"--measurements") {
        arguments.extend(["--measurements", "sessions/soochow-example/measurements.csv"]);
    }
    arguments.extend(more);
    let output = trupose(&arguments);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
    let calibration = folder.path().join("calibration.ron").to_str().unwrap().to_owned();
    (folder, calibration)
}

/// Verifies with JSON output.
fn verified(calibration: &str, measurements: &str, more: &[&str]) -> (i32, Value) {
    let arguments = ["verify", "--calibration", calibration, "--measurements", measurements, "--json"];
    let output = trupose(&[&arguments[..], more].concat());
    let report = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("no JSON; stderr: {}", String::from_utf8_lossy(&output.stderr)));
    (output.status.code().unwrap(), report)
}

#[test]
fn identification_samples_never_verify() {
    let (_folder, calibration) = calibrated(&[]);
    // The same poses, measured once more with other noise: still not independent.
    let again = Table::changed(|_, rows| {
        for row in rows {
            row[7] = (row[7].parse::<f64>().unwrap() + 0.001).to_string();
        }
    });
    let path = again.path();
    let (code, report) = verified(&calibration, path.to_str().unwrap(), &[]);
    assert_eq!((code, codes(&report)[0].as_str()), (1, "not_independent"));
    assert_eq!(report["verification"]["independent"], false);
    let (code, report) = again.json(&[]);
    assert_eq!((code, &report["verification"]["independent"]), (0, &true.into()));
    let text = trupose(&["verify", "--calibration", &calibration, "--measurements", path.to_str().unwrap()]);
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(!text.contains("did not see") && text.contains("all 56 verification samples"), "{text}");
    let (code, report) = verified(&calibration, "sessions/soochow-example/verification.csv", &[]);
    assert_eq!((code, report["verdict"]["status"].as_str()), (0, Some("accepted")));
}

#[test]
fn a_bad_calibration_stays_bad() {
    let few = Table::changed(|_, rows| rows.truncate(8));
    let path = few.path();
    let (_folder, calibration) = calibrated(&["--measurements", path.to_str().unwrap()]);
    let (code, report) = verified(&calibration, "sessions/soochow-example/verification.csv", &[]);
    assert_eq!((code, report["verdict"]["status"].as_str()), (1, Some("not_accepted")));
    let warning = report["warnings"].as_array().unwrap().iter().find(|w| w["code"] == "calibration_not_acceptable");
    assert!(warning.unwrap()["message"].as_str().unwrap().contains("not acceptable: poor_data"), "{warning:?}");
}

#[test]
fn a_verification_table_is_checked_as_one_for_identification() {
    let (_folder, calibration) = calibrated(&[]);
    let verification = |change: fn(&mut Vec<String>)| {
        let text: Vec<String> = example("verification.csv")
            .lines()
            .map(|line| {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                if cells.len() > 9 && cells[9].parse::<f64>().is_ok() {
                    change(&mut cells);
                }
                cells.join(",")
            })
            .collect();
        Table::text(&text.join("\n"))
    };
    let cases: [(Table, &str); 3] = [
        (
            verification(|cells| {
                for cell in &mut cells[7..10] {
                    *cell = (cell.parse::<f64>().unwrap() / 25.4).to_string();
                }
            }),
            "inches were read as millimetres",
        ),
        (
            verification(|cells| cells[4] = (-cells[4].parse::<f64>().unwrap()).to_string()),
            "joint J4 counts the other way",
        ),
        (verification(|cells| cells[8] = (-cells[8].parse::<f64>().unwrap()).to_string()), "left-handed"),
    ];
    for (table, cause) in cases {
        let path = table.path();
        let output = trupose(&["verify", "--calibration", &calibration, "--measurements", path.to_str().unwrap()]);
        let message = String::from_utf8(output.stderr).unwrap().replace("\n ", "");
        assert_eq!(output.status.code(), Some(2), "{cause}: {message}");
        assert!(message.contains(cause), "{cause}: {message}");
    }
}

#[test]
fn few_verification_samples_are_not_enough() {
    let (_folder, calibration) = calibrated(&[]);
    for (rows, code, status) in [(1, 1, "not_accepted"), (4, 1, "not_accepted"), (6, 0, "accepted")] {
        let condition = format!("pose < {rows}");
        let (found, report) =
            verified(&calibration, "sessions/soochow-example/verification.csv", &["--use", &condition]);
        assert_eq!((found, report["verdict"]["status"].as_str()), (code, Some(status)), "{rows}");
        assert!(codes(&report).contains(&"few_verification_samples".to_owned()), "{rows}");
        if rows == 1 {
            let checks = report["verdict"]["checks"].as_array().unwrap();
            let distance = checks.iter().find(|check| check["quantity"] == "distance_mean").unwrap();
            assert!(distance["met"].is_null() && distance["value_mm"].is_null(), "{distance}");
        }
    }
}

#[test]
fn a_pose_that_is_measured_again_counts_once() {
    /// Every row `times` times, each some micrometres elsewhere.
    fn repeated(rows: &[Vec<String>], times: usize) -> Vec<Vec<String>> {
        let again = |(number, row): (usize, &Vec<String>)| {
            let mut row = row.clone();
            let x: f64 = row[7].parse().unwrap();
            row[7] = format!("{:.4}", x + 0.003 * (number as f64).sin());
            row
        };
        rows.iter().cycle().take(times * rows.len()).enumerate().map(again).collect()
    }
    let once = Table::changed(|_, rows| rows.truncate(10));
    let thrice = Table::changed(|_, rows| *rows = repeated(&rows[..10], 3));
    let poor = |table: &Table| {
        let (code, report) = table.json(&[]);
        assert_eq!(code, 1);
        let warnings = report["warnings"].as_array().unwrap();
        let warning = warnings.iter().find(|warning| warning["code"] == "poor_data").unwrap();
        warning["message"].as_str().unwrap().to_owned()
    };
    assert!(poor(&once).starts_with("too few data: 24 independent values for 21 combinations of parameters; "));
    let message = poor(&thrice);
    assert!(message.starts_with("too few data: 24 independent values for 21 combinations"), "{message}");
    assert!(message.contains("(a pose that is measured again counts once)"), "{message}");

    let (_folder, calibration) = calibrated(&[]);
    let text = example("verification.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().unwrap();
    let first: Vec<Vec<String>> = vec![lines.next().unwrap().split(',').map(str::to_owned).collect()];
    let rows: Vec<String> = repeated(&first, 20).iter().map(|row| row.join(",")).collect();
    let table = Table::text(&format!("{header}\n{}", rows.join("\n")));
    for refit in ["none", "frame"] {
        let (code, report) = verified(&calibration, table.path().to_str().unwrap(), &["--refit", refit]);
        assert_eq!((code, report["verdict"]["status"].as_str()), (1, Some("not_accepted")), "{refit}");
        let found = codes(&report);
        assert!(found.contains(&"few_verification_samples".to_owned()), "{found:?}");
        assert_eq!(found.contains(&"few_data".to_owned()), refit == "frame", "{found:?}");
        // Between repetitions there is nothing but noise.
        assert!(report["verification"]["identified"]["distance_mm"].is_null(), "{refit}");
    }
}

#[test]
fn what_is_wrong_with_verification_samples_is_named() {
    let (_folder, calibration) = calibrated(&[]);
    let text = example("verification.csv");
    let mut lines: Vec<String> = text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect();
    // One SMR was bumped.
    let bumped: Vec<&str> = lines[5].split(',').collect();
    let x = bumped[7].parse::<f64>().unwrap() + 4.0;
    lines[5] = [&bumped[..7], &[&x.to_string()], &bumped[8..]].concat().join(",");
    let table = Table::text(&lines.join("\n"));
    let path = table.path();
    let path = path.to_str().unwrap();
    let far = |report: &Value| {
        let warnings = report["warnings"].as_array().unwrap();
        let warning = warnings.iter().find(|warning| warning["code"] == "far_verification_samples").unwrap();
        warning["message"].as_str().unwrap().to_owned()
    };
    let (code, report) = verified(&calibration, path, &[]);
    assert_eq!(code, 1);
    assert!(far(&report).contains(": pose 4 (line 6) by 3.9"), "{}", far(&report));
    let measurements = "sessions/soochow-example/measurements.csv";
    let identify = ["identify", "--profile", "soochow", "--measurements", measurements, "--verify", path, "--json"];
    let output = trupose(&identify);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(far(&report).contains(": pose 4 (line 6) by 3.9"), "{}", far(&report));
    // All of them in another unit.
    let inches = |line: &String| {
        let cells: Vec<&str> = line.split(',').collect();
        let of =
            |cell: &&str| cell.parse::<f64>().map_or_else(|_| (*cell).to_owned(), |value| (value / 25.4).to_string());
        [cells[..7].join(","), cells[7..].iter().map(of).collect::<Vec<_>>().join(",")].join(",")
    };
    fs::write(path, lines.iter().map(inches).collect::<Vec<_>>().join("\n")).unwrap();
    let output = trupose(&identify);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8(output.stderr).unwrap().replace("\n ", "");
    assert!(message.contains("verification: the measured points are typically"), "{message}");
    assert!(message.contains("inches were read as millimetres"), "{message}");
}

#[test]
fn simulated_points_are_called_so_wherever_they_go() {
    let points = "sessions/example/measurements.csv";
    let folder = tempfile::tempdir().unwrap();
    let results = folder.path().join("results");
    let out = ["--out", results.to_str().unwrap()];
    let identify = ["identify", "--profile", "soochow", "--measurements", points, "--use", "kind == 'identification'"];
    let output = trupose(&[&identify[..], &["--verify-rest", "--json"], &out].concat());
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let said = "SIMULATED: the points come from the simulated cell (seed 14), not from a robot";
    let warnings = |report: &Value| -> Vec<String> {
        let warnings = report["warnings"].as_array().unwrap().iter().filter(|warning| warning["code"] == "simulated");
        warnings.map(|warning| warning["message"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(warnings(&report).len(), 1);
    assert!(warnings(&report)[0].starts_with(said), "{report}");
    assert!(fs::read_to_string(results.join("report.html")).unwrap().contains("SIMULATED."));
    let calibration = results.join("calibration.ron");
    let (_, report) = verified(calibration.to_str().unwrap(), points, &["--use", "kind == 'verification'"]);
    assert_eq!(warnings(&report).len(), 1);
    // Also where only one of both is simulated.
    let real = Table::changed(|_, _| {});
    let measured = real.path();
    let output = trupose(&[
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        measured.to_str().unwrap(),
        "--verify",
        points,
        "--json",
    ]);
    // The tracker of one is elsewhere than that of the other: what matters is what is said.
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(warnings(&report).len(), 1);
    let (_folder, calibration) = calibrated(&[]);
    let (_, report) = verified(&calibration, points, &["--refit", "frame", "--use", "kind == 'verification'"]);
    assert_eq!(warnings(&report).len(), 1);
}

/// Points of other rows: the numbers stay, and say everywhere that they are not accepted.
#[test]
fn data_of_no_robot_leave_a_result_that_is_never_accepted() {
    let shuffled = Table::changed(|_, rows| {
        let points: Vec<Vec<String>> = rows.iter().map(|row| row[7..].to_vec()).collect();
        for (index, row) in rows.iter_mut().enumerate() {
            row.splice(7.., points[(index * 25 + 11) % points.len()].clone());
        }
    });
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = shuffled.identify(&["--out", folder.path().to_str().unwrap()]);
    assert_eq!(code, 1, "{err}");
    assert!(out.contains("Verdict: NOT ACCEPTED") && out.contains("implausible"), "{out}");
    let calibration = folder.path().join("calibration.ron");
    let (_, report) = verified(calibration.to_str().unwrap(), "sessions/soochow-example/verification.csv", &[]);
    let warnings = report["warnings"].as_array().unwrap();
    let says = |warning: &Value| warning["message"].as_str().unwrap().contains("not acceptable");
    assert!(warnings.iter().any(says), "{warnings:?}");
    assert_ne!(report["verdict"]["status"], "accepted");
}

#[test]
fn no_usable_solution_ends_with_4_and_leaves_no_calibration() {
    let scattered = Table::changed(|_, rows| {
        for (index, row) in rows.iter_mut().enumerate() {
            for (axis, cell) in row[7..].iter_mut().enumerate() {
                *cell = format!("{}", (index * 7919 + axis * 104_729 + index * index * 31) % 6000);
            }
        }
    });
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--prior", "none", "--out", folder.path().to_str().unwrap()];
    let (code, out, err) = scattered.identify(&arguments);
    assert_eq!(code, 4, "{err}");
    assert!(!folder.path().join("calibration.ron").exists());
    assert!(out.contains("Verdict: NOT ACCEPTED") && err.contains("not written: calibration.ron"), "{out}{err}");
    fs::write(folder.path().join("calibration.ron"), "old").unwrap();
    let (_, _, err) = scattered.identify(&arguments);
    assert!(err.contains("from an earlier run"), "{err}");
    assert_eq!(fs::read_to_string(folder.path().join("calibration.ron")).unwrap(), "old");
    assert!(folder.path().join("report.json").exists());
}

#[test]
fn parameters_that_nothing_determines_have_no_sigma() {
    let (_folder, calibration) = calibrated(&["--prior", "none"]);
    let text = fs::read_to_string(&calibration).unwrap();
    assert!(text.contains("sigma: None"), "{text}");
    let (_, report) = verified(&calibration, "sessions/soochow-example/verification.csv", &[]);
    assert!(report["verification"]["identified"]["position_mm"]["rms"].as_f64().unwrap() < 0.1);
}

#[test]
fn a_calibration_with_impossible_numbers_is_refused() {
    let (_folder, calibration) = calibrated(&[]);
    let text = fs::read_to_string(&calibration).unwrap();
    let after = |mark: &str, wrong: &str| {
        let start = text.find(mark).unwrap() + mark.len();
        let end = start + text[start..].find(['\n', ')']).unwrap();
        format!("{}{wrong}{}", &text[..start], &text[end..])
    };
    let cases = [
        (after("quaternion_xyzw: (", "0.0, 0.0, 0.0, 0.5"), "'base_from_station' is not a pose"),
        (after("xyz_mm: (", "NaN, 0.0, 0.0"), "'base_from_station' is not a pose"),
        (text.replacen("unit: \"deg\"", "unit: \"mm\"", 1), "'alpha1' has the unit 'mm'"),
        (after("sigma: Some(", "-1.0"), "'alpha1' has a standard or expected deviation"),
        (after("deviation: ", "inf,"), "'alpha1' has a number that is not finite"),
        (text.replacen("\"1: ", "\"0: ", 1), "is not a sample"),
    ];
    for (wrong, cause) in cases {
        fs::write(&calibration, wrong).unwrap();
        let verification = "sessions/soochow-example/verification.csv";
        let output = trupose(&["verify", "--calibration", &calibration, "--measurements", verification]);
        let message = String::from_utf8(output.stderr).unwrap().replace("\n ", "");
        assert_eq!(output.status.code(), Some(2), "{cause}: {message}");
        assert!(message.contains(cause), "{cause}: {message}");
    }
}

#[test]
fn deviations_far_beyond_the_expected_ones_are_not_accepted() {
    let table = Table::changed(|_, _| {});
    for (expected, blocks) in [("0.2mm,0.1deg", true), ("0.5mm,0.3deg", false)] {
        let (_, report) = table.json(&["--expected-deviation", expected]);
        let warnings = report["warnings"].as_array().unwrap();
        let far = warnings.iter().find(|warning| warning["code"] == "large_deviation").unwrap();
        assert_eq!(far["blocks_acceptance"], blocks, "{expected}: {far}");
        let status = report["verdict"]["status"].as_str().unwrap();
        assert_eq!(status == "accepted", !blocks, "{expected}: {warnings:?}");
    }
}

#[test]
fn warnings_about_rows_name_the_file_where_there_are_two() {
    let (_, report) = Table::changed(|_, rows| rows[3][1] = "500".to_owned()).json(&[]);
    let warnings = report["warnings"].as_array().unwrap();
    let limits = warnings.iter().find(|warning| warning["code"] == "joint_limits").unwrap();
    assert!(limits["message"].as_str().unwrap().contains("table.csv' "), "{limits}");
}

#[test]
fn joint_offsets_alone_do_not_accuse_the_robot() {
    let table = Table::changed(|_, _| {});
    let (code, report) = table.json(&["--level", "offsets"]);
    assert_eq!(code, 1);
    let codes = codes(&report);
    assert!(codes.contains(&"offsets_only".to_owned()) && !codes.contains(&"does_not_fit".to_owned()), "{codes:?}");
}

#[test]
fn control_characters_never_reach_the_terminal() {
    let output = trupose(&["identify", "--profile", "\u{1b}[31mred", "--measurements", "x.csv"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("[31mred") && !message.contains('\u{1b}'), "{message:?}");
    assert!(message.lines().all(|line| line.chars().count() <= 80), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a\u{1b}[31m.csv");
    fs::write(&file, example("measurements.csv")).unwrap();
    let output = trupose(&["identify", "--profile", "soochow", "--measurements", file.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("[31m.csv") && !text.contains('\u{1b}'), "{text:?}");
}

#[test]
fn a_calibration_is_read_back_to_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/results");
    let output = trupose(&[
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        "sessions/soochow-example/measurements.csv",
        "--verify",
        "sessions/soochow-example/verification.csv",
        "--out",
        out.to_str().unwrap(),
        "--json",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let identified: Value = serde_json::from_slice(&output.stdout).unwrap();
    let saved: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    let names = identified.as_object().unwrap().keys();
    for name in names {
        assert_eq!(saved[name], identified[name], "{name}");
    }
    let calibration = out.join("calibration.ron");
    let output = trupose(&[
        "verify",
        "--calibration",
        calibration.to_str().unwrap(),
        "--measurements",
        "sessions/soochow-example/verification.csv",
        "--json",
    ]);
    let verified: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (model, error) in [("nominal", "position_mm"), ("identified", "position_mm"), ("identified", "distance_mm")] {
        for statistic in ["mean", "rms", "p95", "max"] {
            let pick = |report: &Value| report["verification"][model][error][statistic].as_f64().unwrap();
            assert!((pick(&verified) - pick(&identified)).abs() < 1e-9, "{model} {error} {statistic}");
        }
    }
    // A calibration that was tampered with is refused with its place.
    let text = fs::read_to_string(&calibration).unwrap();
    fs::write(&calibration, text.replacen("deviation: ", "deviatoin: ", 1)).unwrap();
    let output = trupose(&[
        "verify",
        "--calibration",
        calibration.to_str().unwrap(),
        "--measurements",
        "sessions/soochow-example/verification.csv",
    ]);
    let message = String::from_utf8(output.stderr).unwrap().replace("\n ", "");
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("is not a usable calibration: line ") && message.contains("`deviation`"), "{message}");
}

#[test]
fn another_set_up_is_fitted_and_said_so() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let arguments = [
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        "sessions/soochow-example/measurements.csv",
        "--out",
        out,
    ];
    assert_eq!(trupose(&arguments).status.code(), Some(0));
    // The tracker moved by a metre and turned by a quarter: only '--refit frame' makes sense of it.
    let moved: Vec<String> = example("verification.csv")
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            match cells.get(9).and_then(|cell| cell.parse::<f64>().ok()) {
                Some(z) => {
                    let number = |index: usize| cells[index].parse::<f64>().unwrap();
                    format!("{},{},{},{}", cells[..7].join(","), 1000.0 - number(8), number(7), z)
                }
                None => line.to_owned(),
            }
        })
        .collect();
    let table = Table::text(&moved.join("\n"));
    let calibration = folder.path().join("calibration.ron");
    let verify = |refit: &str| {
        let output = trupose(&[
            "verify",
            "--calibration",
            calibration.to_str().unwrap(),
            "--measurements",
            table.path().to_str().unwrap(),
            "--refit",
            refit,
            "--json",
        ]);
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        (output.status.code().unwrap(), report)
    };
    let (code, report) = verify("none");
    assert_eq!(code, 1);
    assert!(report["verification"]["identified"]["position_mm"]["rms"].as_f64().unwrap() > 100.0);
    let (code, report) = verify("frame");
    assert_eq!((code, report["verification"]["refit"].as_str()), (0, Some("frame")));
    assert!(report["verification"]["basis"].as_str().unwrap().contains("fitted to these same points"));
    assert!(report["verification"]["identified"]["position_mm"]["rms"].as_f64().unwrap() < 0.03);
}

#[test]
fn the_papers_single_step_can_be_reproduced() {
    let output = trupose(&[
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        "sessions/soochow-example/measurements.csv",
        "--weighting",
        "uniform",
        "--prior",
        "none",
        "--estimator",
        "least-squares",
        "--iterations",
        "1",
        "--json",
    ]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((report["iterations"].as_array().unwrap().len(), &report["rank"]), (1, &21.into()));
    let raw = report["condition_number_mm_rad"].as_f64().unwrap();
    assert!((11_000.0..16_000.0).contains(&raw), "{raw}");
}

#[test]
fn wrong_command_lines_end_with_2() {
    let cases: [&[&str]; 6] = [
        &["identify"],
        &["identify", "--profile", "nobody", "--measurements", "x.csv"],
        &["identify", "--profile", "soochow", "--measurements", "not-there.csv"],
        &[
            "identify",
            "--profile",
            "soochow",
            "--measurements",
            "sessions/soochow-example/measurements.csv",
            "--use",
            "pose %",
        ],
        &[
            "identify",
            "--profile",
            "soochow",
            "--measurements",
            "sessions/soochow-example/measurements.csv",
            "--sigma-mm",
            "-1",
        ],
        &["identify", "--profile", "ur5", "--measurements", "Cargo.toml"],
    ];
    for arguments in cases {
        let output = trupose(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
    }
    let output = trupose(&["identify", "--profile", "nobody", "--measurements", "x.csv"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("no profile or file 'nobody'") && message.contains("soochow"), "{message}");
}

#[test]
fn results_that_cannot_be_written_end_with_5() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    fs::write(&file, "not a folder").unwrap();
    let output = trupose(&[
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        "sessions/soochow-example/measurements.csv",
        "--out",
        file.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(5));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("cannot write") && message.contains("choose another folder"), "{message}");
    let report = String::from_utf8(output.stdout).unwrap();
    assert!(report.contains("Verdict: ") && !report.contains("written:"), "{report}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "not a folder");
}

#[test]
fn profiles_are_listed_shown_and_checked() {
    let list = String::from_utf8(trupose(&["profile", "list"]).stdout).unwrap();
    for name in trupose::profile::builtin_names() {
        assert!(list.contains(name), "{name}");
        let shown = trupose(&["profile", "show", name]);
        assert_eq!(shown.status.code(), Some(0), "{name}");
        let file = format!("profiles/{name}.ron");
        assert_eq!(trupose(&["profile", "check", &file]).status.code(), Some(0), "{name}");
        assert_eq!(trupose(&["profile", "check", name]).status.code(), Some(0), "{name}");
    }
    let output = trupose(&["profile", "check", "Cargo.toml"]);
    assert_eq!(output.status.code(), Some(2));
}
