//! The test of ISO 9283: poses that the arm can reach, and figures against an arm whose accuracy and repeatability are known.

use std::fmt::Write as _;
use std::fs;

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;
use trupose::iso9283::{Label, MeasuringPlane, POSES};
use trupose::kinematics::{Arm, ForwardKinematics, LinkParameter, ParameterId, Place};
use trupose::procedure::iso9283::{TestError, TestPlanRequest, plan};
use trupose::profile::{Profile, builtin};
use trupose::program::Dialect;
use trupose::session::plan::PoseKind;
use trupose::units::{DEGREE, MILLIMETRE, to_mm};

use crate::support::trupose;

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

#[test]
fn the_arm_reaches_all_poses_of_its_cube() {
    for name in ["ur5", "abb_irb120", "kuka_kr6_r900", "fanuc_lrmate200id"] {
        let profile = profile(name);
        let request = TestPlanRequest { cycles: 3, multi_directional: true, ..TestPlanRequest::default() };
        let test = plan(&profile, &request).unwrap();
        let arm = profile.arm();
        assert!(test.cube.edge >= 0.25, "{name}");
        for row in &test.rows {
            let reached = arm.point_in_base(&Place { configuration: row.configuration.clone(), target: 0 });
            assert!((reached - row.point_in_base.unwrap()).norm() < 1e-8, "{name} {}", row.pose);
            let orientation = ForwardKinematics::new(&arm.chain).base_from_flange(&row.configuration).rotation;
            assert!(orientation.angle_to(&test.orientation) < 1e-8, "{name} {}", row.pose);
        }
        // P5, P4, P3, P2, P1 in every cycle, then three directions of P1, P2 and P4 in every cycle.
        let visits: Vec<Label> =
            test.rows.iter().filter(|row| row.kind.is_measured()).map(|row| row.pose.parse().unwrap()).collect();
        assert_eq!(visits.len(), 3 * POSES + 3 * 9);
        assert_eq!(visits[..5].iter().map(|visit| visit.pose).collect::<Vec<_>>(), [5, 4, 3, 2, 1]);
        let approaches = test.rows.iter().filter(|row| row.kind == PoseKind::Via).count();
        assert_eq!(approaches, 27, "{name}");
    }
}

#[test]
fn a_cube_that_is_too_large_is_refused() {
    let request = TestPlanRequest { edge: Some(1.0), ..TestPlanRequest::default() };
    assert!(matches!(plan(&profile("abb_irb120"), &request), Err(TestError::NoCube { .. })));
    let centre = Some(Point3::new(5.0, 0.0, 0.0));
    let request = TestPlanRequest { centre, ..TestPlanRequest::default() };
    assert!(matches!(plan(&profile("abb_irb120"), &request), Err(TestError::NoCube { .. })));
}

/// The arm with a length that is 1 mm and a joint that is 0.05° off.
fn real_arm(profile: &Profile) -> Arm {
    let deviations = [
        (ParameterId::Link { joint: 1, parameter: LinkParameter::A }, MILLIMETRE),
        (ParameterId::Link { joint: 2, parameter: LinkParameter::Theta }, 0.05 * DEGREE),
    ];
    profile.arm().with(deviations).unwrap()
}

/// A table of a test on `arm`, with noise of `sigma` (m) per coordinate.
fn measured(profile: &Profile, arm: &Arm, sigma: f64, seed: u64) -> String {
    let request =
        TestPlanRequest { multi_directional: true, plane: MeasuringPlane::FallsAlongX, ..TestPlanRequest::default() };
    let test = plan(profile, &request).unwrap();
    let station_from_base = Isometry3::new(Vector3::new(2.0, 1.0, 0.3), Vector3::new(0.1, 0.2, 1.0));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut table = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n".to_owned();
    for row in test.rows.iter().filter(|row| row.kind.is_measured()) {
        let point = arm.point_in_base(&Place { configuration: row.configuration.clone(), target: 0 });
        let point = station_from_base * (point + sigma * Vector3::from_fn(|_, _| noise()));
        write!(table, "{}", row.pose).unwrap();
        row.configuration.iter().for_each(|q| write!(table, ",{:.9}", q / DEGREE).unwrap());
        point.coords.iter().for_each(|value| write!(table, ",{:.6}", to_mm(*value)).unwrap());
        table.push('\n');
    }
    table
}

#[test]
fn figures_are_those_of_the_arm() {
    let profile = profile("abb_irb120");
    let arm = real_arm(&profile);
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("test.csv");
    let sigma = 0.01;
    fs::write(&table, measured(&profile, &arm, sigma * MILLIMETRE, 3)).unwrap();
    let arguments = ["iso9283", "evaluate", "--profile", "abb_irb120", "--measurements", table.to_str().unwrap()];
    let output = trupose(&[&arguments[..], &["--load", "3 kg", "--speed", "100 %", "--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    // The distance from the barycentre follows a Maxwell distribution: mean 1.596 sigma, deviation 0.673 sigma.
    let repeatability = sigma * (1.596 + 3.0 * 0.673);
    for pose in json["poses"].as_array().unwrap() {
        assert_eq!(pose["cycles"], 30);
        assert!((number(&pose["repeatability_mm"]["value"]) / repeatability - 1.0).abs() < 0.35, "{pose}");
    }
    // The attained distances are those of the real arm, whatever the frame.
    let rows = plan(&profile, &TestPlanRequest { plane: MeasuringPlane::FallsAlongX, ..TestPlanRequest::default() })
        .unwrap()
        .rows;
    let at = |pose: usize| Place { configuration: rows[POSES - pose].configuration.clone(), target: 0 };
    let distance = |arm: &Arm, from, to| (arm.point_in_base(&at(from)) - arm.point_in_base(&at(to))).norm();
    let (mut contained, all) = (0, json["distances"].as_array().unwrap());
    assert_eq!(all.len(), 10);
    for row in all {
        let pose = |name: &Value| name.as_str().unwrap()[1..].parse::<usize>().unwrap();
        let (from, to) = (pose(&row["from"]), pose(&row["to"]));
        let truth = to_mm(distance(&arm, from, to) - distance(&profile.arm(), from, to));
        assert!((number(&row["nominal_mm"]["value"]) - truth).abs() < 0.02, "{row} {truth}");
        let interval = number(&row["nominal_mm"]["low"])..=number(&row["nominal_mm"]["high"]);
        contained += usize::from(interval.contains(&truth));
        assert!(
            (number(&row["repeatability_mm"]["value"]) / (3.0 * 2.0_f64.sqrt() * sigma) - 1.0).abs() < 0.4,
            "{row}"
        );
    }
    assert!(contained >= 7, "{contained} of 10");
    assert_eq!(json["directions"].as_array().unwrap().len(), 3);
    assert!(number(&json["directions"][0]["variation_mm"]) < 4.0 * sigma);
    let deviations = json["deviations"].to_string();
    assert!(deviations.contains("fitted") && !deviations.contains("cycles"), "{deviations}");

    let output = trupose(&arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    assert!(
        text.contains("P2-P4") && text.contains("the load is not stated") && !text.contains("in accordance"),
        "{text}"
    );

    let page = folder.path().join("test.html");
    let replaced = ["iso9283", "report", "--profile", "abb_irb120", "--measurements", table.to_str().unwrap()];
    let output = trupose(&[&replaced[..], &["--load", "<3 kg>", "--out", page.to_str().unwrap()]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let html = fs::read_to_string(page).unwrap();
    // The page has the figures of the text, needs nothing else, and claims no more.
    let figure = text.lines().find(|line| line.starts_with("P2-P4")).unwrap();
    let figure = figure.split_whitespace().nth(1).unwrap().replace('-', "−");
    assert!(html.contains("P2 to P4") && html.contains(&figure), "{figure} {html}");
    assert!(html.contains("&lt;3 kg&gt;") && html.contains("the speed is not stated") && html.contains("dAP of P1"));
    assert!(!html.contains("in accordance") && !html.contains("//") && !html.contains("<script"), "{html}");
}

#[test]
fn rows_of_other_poses_and_too_few_cycles_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("test.csv");
    let arguments = ["iso9283", "evaluate", "--profile", "abb_irb120", "--measurements", table.to_str().unwrap()];
    let header = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n";
    for (rows, expected) in [
        ("c01-P1,0,0,0,0,30,0,1,2,3\nQ7,0,0,0,0,30,0,1,2,4\n", "line 3: 'Q7' is not a pose of the test"),
        ("c01-P1,0,0,0,0,30,0,1,2,3\nc01-P2,0,9,0,0,30,0,1,2,4\n", "at least three of the five"),
        (
            "c01-P1,0,0,0,0,30,0,1,2,3\nc01-P2,0,9,0,0,30,0,1,90,4\nc01-P3,0,9,9,0,30,0,80,9,4\n",
            "no pose was attained in at least 3 cycles",
        ),
    ] {
        fs::write(&table, format!("{header}{rows}")).unwrap();
        let output = trupose(&arguments);
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn a_plan_becomes_a_program_of_every_robot() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("iso.csv");
    let out = path.to_str().unwrap();
    let output =
        trupose(&["iso9283", "plan", "--profile", "ur5", "--cycles", "3", "--multi-directional", "--out", out]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("42 poses to measure"));
    let programs = folder.path().to_str().unwrap();
    for dialect in Dialect::NAMES {
        let arguments = ["program", "--profile", "ur5", "--plan", out, "--dialect", dialect, "--out", programs];
        let output = trupose(&arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        // A job in pulses needs the pulses of each joint, which this robot's profile does not have.
        let expected = if *dialect == "inform" { 2 } else { 0 };
        assert_eq!(output.status.code(), Some(expected), "{dialect}: {said}");
        assert_eq!(said.contains("'pulses_per_degree'"), expected == 2, "{dialect}: {said}");
    }
}
