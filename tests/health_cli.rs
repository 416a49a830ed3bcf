//! `check` and `identify --from-calibration` as their users run them: files, exit codes, messages about bad input.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use nalgebra::{Isometry3, Vector3};
use serde_json::Value;
use trupose::kinematics::{LinkParameter, ParameterId, Place};
use trupose::procedure::joint_types;
use trupose::profile::{Profile, builtin};
use trupose::session::calibration::Calibration;
use trupose::session::plan;
use trupose::units::{DEGREE, MILLIMETRE, to_mm};

use crate::support::paper_case::{normal, seeded};
use crate::support::{text, trupose};

/// A calibration of the example, with a planned check.
struct Case {
    folder: tempfile::TempDir,
    planned: Value,
}

impl Case {
    fn shared() -> &'static Self {
        static CASE: OnceLock<Case> = OnceLock::new();
        CASE.get_or_init(|| {
            let case = Self { folder: tempfile::tempdir().unwrap(), planned: Value::Null };
            let data = "sessions/soochow-example/measurements.csv";
            let out = case.folder.path().to_str().unwrap();
            trupose(&["identify", "--profile", "soochow", "--measurements", data, "--out", out]);
            let (calibration, plan) = (case.path("calibration.ron"), case.path("check.csv"));
            let (code, printed, said) =
                run(&["check", "plan", "--calibration", &calibration, "--out", &plan, "--json"]);
            assert_eq!(code, 0, "{said}");
            Self { planned: serde_json::from_str(&printed).unwrap(), ..case }
        })
    }

    fn path(&self, file: &str) -> String {
        self.folder.path().join(file).display().to_string()
    }

    /// The points of the check on the identified arm with the zero of J3 moved, tracker and SMR elsewhere.
    fn measured(&self, file: &str, moved: f64) -> String {
        let profile = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0;
        let calibration = Calibration::parse(&fs::read_to_string(self.path("calibration.ron")).unwrap()).unwrap();
        let zero = ParameterId::Link { joint: 2, parameter: LinkParameter::Theta };
        let mut arm = calibration.identified(&profile).unwrap().with([(zero, moved * DEGREE)]).unwrap();
        arm.targets[0] += Vector3::new(0.02, -0.01, 0.015);
        let station = Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.2, 0.1, 2.5));
        let plan = plan::read(fs::read(self.path("check.csv")).unwrap(), "check.csv", &joint_types(&profile)).unwrap();
        let mut rng = seeded(11);
        let mut table = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n".to_owned();
        for row in plan.rows.iter().filter(|row| row.kind.is_measured()) {
            let point = arm.point_in_base(&Place { configuration: row.configuration.clone(), target: 0 });
            let noise = Vector3::from_fn(|_, _| 0.01 * MILLIMETRE * normal(&mut rng));
            write!(table, "{}", row.pose).unwrap();
            row.configuration.iter().for_each(|q| write!(table, ",{:.9}", q / DEGREE).unwrap());
            (station * (point + noise)).coords.iter().for_each(|x| write!(table, ",{:.6}", to_mm(*x)).unwrap());
            table.push('\n');
        }
        let path = self.path(file);
        fs::write(&path, table).unwrap();
        path
    }
}

fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = trupose(arguments);
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn evaluate(measurements: &str, more: &[&str]) -> (i32, String, String) {
    let calibration = Case::shared().path("calibration.ron");
    let fixed =
        ["check", "evaluate", "--calibration", &calibration, "--measurements", measurements, "--limit-mm", "0.3"];
    run(&[&fixed[..], more].concat())
}

#[test]
fn a_check_is_planned_in_ten_minutes() {
    let planned = &Case::shared().planned;
    assert_eq!(planned["poses"], 12);
    assert!(planned["minutes"].as_f64().unwrap() <= 10.0, "{planned}");
    let seen: Vec<bool> = planned["zeros"].as_array().unwrap().iter().map(|zero| !zero["sigma"].is_null()).collect();
    assert_eq!(seen, [false, true, true, true, true, false]);
}

#[test]
fn a_check_says_what_has_moved() {
    let case = Case::shared();
    let (code, out, said) = evaluate(&case.measured("same.csv", 0.0), &[]);
    assert!(code == 0 && out.contains("STILL VALID") && out.contains("limit 0.30"), "{code} {out} {said}");
    let (code, out, said) = evaluate(&case.measured("moved.csv", 0.05), &[]);
    assert!(code == 1 && out.contains("CHANGED: the zero of joint J3 has moved by 0.0"), "{code} {out} {said}");
    let (code, out, _) = evaluate(&case.path("moved.csv"), &["--json"]);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 1);
    assert!(json["steps"].as_array().unwrap().len() >= 8, "{json}");
}

#[test]
fn bad_input_of_a_check_is_named() {
    let case = Case::shared();
    let (code, _, said) = evaluate(&case.path("missing.csv"), &[]);
    assert!(code != 0 && said.contains("missing.csv"), "{code} {said}");
    let few: String = fs::read_to_string(case.measured("all.csv", 0.0))
        .unwrap()
        .lines()
        .take(3)
        .map(|l| l.to_owned() + "\n")
        .collect();
    fs::write(case.path("few.csv"), few).unwrap();
    let (code, _, said) = evaluate(&case.path("few.csv"), &[]);
    assert!(code == 2 && said.contains("pose"), "{code} {said}");
    // A digit of a deviation that changed, in a file that can still be read.
    let intact = fs::read_to_string(case.path("calibration.ron")).unwrap();
    let changed = intact.replacen("deviation: -3.8", "deviation: -3.7", 1);
    assert_ne!(changed, intact);
    fs::write(case.path("changed.ron"), changed).unwrap();
    let (calibration, out) = (case.path("changed.ron"), case.path("never.csv"));
    let planned = run(&["check", "plan", "--calibration", &calibration, "--out", &out]);
    let points = case.path("all.csv");
    let test = ["iso9283", "report", "--calibration", &calibration, "--measurements", &points, "--out", &out];
    for (code, _, said) in [planned, run(&test)] {
        assert!(code == 2 && said.contains("give '--edited'") && !PathBuf::from(&out).exists(), "{code} {said}");
    }
}

#[test]
fn a_recalibration_says_what_the_old_data_weigh() {
    let case = Case::shared();
    let old = case.path("calibration.ron");
    let few = "sessions/soochow-example/verification.csv";
    let arguments = ["identify", "--profile", "soochow", "--measurements", few, "--from-calibration", &old];
    let (code, out, said) = run(&[&arguments[..], &["--json"]].concat());
    assert!(code < 2, "{code} {said}");
    let json: Value = serde_json::from_str(&out).unwrap();
    let weight = json["earlier"]["weight_percent"].as_f64().unwrap();
    assert!((1.0..100.0).contains(&weight) && json["earlier"]["moved"].as_array().unwrap().is_empty(), "{json}");
    let (_, out, _) = run(&arguments);
    let words = out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("Begun with the calibration of"), "{out}");
    assert!(words.contains(&format!("(56 poses, which carry {weight:.0} % of the weight")), "{out}");
    let (code, _, said) = run(&["identify", "--profile", "soochow", "--measurements", few, "--from-calibration", few]);
    assert!(code == 2 && said.contains("not a usable calibration"), "{code} {said}");
}
