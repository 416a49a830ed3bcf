//! `trupose plan` and `trupose program` as their users run them.

use std::fs;

use crate::support::{root, trupose};
use serde_json::Value;

fn json(arguments: &[&str]) -> Value {
    let output = trupose(&[arguments, &["--json"]].concat());
    let code = output.status.code().unwrap();
    assert!(code <= 1, "{arguments:?}: exit {code}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn number(value: &Value, path: &str) -> f64 {
    path.split('.').fold(value, |value, key| &value[key]).as_f64().unwrap_or_else(|| panic!("no number at {path}"))
}

/// The paper's robot without filters, with few candidates: `cargo bench --bench planning_quality` has the figures of many.
const SMALL: [&str; 13] = [
    "plan",
    "--profile",
    "soochow",
    "--candidates",
    "300",
    "--poses",
    "30",
    "--verification",
    "8",
    "--no-filters",
    "--expected-deviation",
    "1mm,0.1deg",
    "--seed=1",
];

#[test]
fn a_plan_comes_with_its_figures_and_an_objective_with_its_price() {
    let balanced = json(&SMALL);
    let error = |plan: &Value| number(plan, "predicted_error_sigma");
    assert!(error(&balanced) < number(&balanced, "random.predicted_error_sigma.best"), "{}", error(&balanced));
    assert!(number(&balanced, "condition_number") < number(&balanced, "random.condition_number.best"));
    assert_eq!(balanced["rank"], 21);
    for key in ["o1", "o2", "o3", "o4", "o5"] {
        assert!(number(&balanced, &format!("observability.{key}")) > 0.0);
    }
    assert!((0.8..1.0).contains(&number(&balanced, "d_efficiency")));
    assert!((number(&balanced, "predicted_rms_mm") - 0.01 * error(&balanced)).abs() < 1e-9);
    assert!(number(&balanced, "elapsed_s") > 0.0 && number(&balanced, "condition_number_raw") > 1000.0);
    // Errors of the joints come on top, and every joint's range is filled as far as so few poses can.
    let with_joint_errors = number(&balanced, "predicted_level3_rms_mm");
    assert!(
        with_joint_errors > number(&balanced, "predicted_rms_mm") && with_joint_errors < 0.5,
        "{with_joint_errors}"
    );
    let gaps = balanced["joint_gaps"].as_array().unwrap();
    assert_eq!(gaps.len(), 6);
    for gap in gaps {
        let (gap, even) = (number(gap, "largest_gap"), number(gap, "even_gap"));
        assert!(gap >= even && gap < 4.0 * even, "{gaps:?}");
    }
    let poses = balanced["poses"].as_array().unwrap();
    let of_kind = |kind: &str| poses.iter().filter(|pose| pose["kind"] == kind).count();
    assert_eq!((of_kind("identification"), of_kind("verification"), of_kind("home")), (30, 8, 2));
    assert_eq!((&poses[0]["kind"], &poses.last().unwrap()["kind"]), (&"home".into(), &"home".into()));

    let condition = json(&[&SMALL[..], &["--objective", "condition"]].concat());
    assert!(number(&condition, "condition_number") < 0.7 * number(&balanced, "condition_number"));
    // And why it is a bad master.
    assert!(error(&condition) > number(&condition, "random.predicted_error_sigma.median"));
    let prediction = json(&[&SMALL[..], &["--objective", "prediction"]].concat());
    assert!(error(&prediction) <= error(&balanced), "{} {}", error(&prediction), error(&balanced));
}

#[test]
fn a_plan_is_the_same_for_any_number_of_threads_and_scores_the_same_when_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let plan = |threads: &str, out: &str| {
        json(&[
            "plan",
            "--profile",
            "ur5e",
            "--candidates",
            "300",
            "--poses",
            "30",
            "--verification",
            "8",
            "--threads",
            threads,
            "--out",
            out,
            "--sigma-mm",
            "0.02",
        ])
    };
    let (one, three) = (file("one.csv"), file("three.csv"));
    let made = plan("1", &one);
    plan("3", &three);
    assert_eq!(fs::read_to_string(&one).unwrap(), fs::read_to_string(&three).unwrap());

    let checked = json(&["plan", "--profile", "ur5e", "--candidates", "300", "--check", &one, "--sigma-mm", "0.02"]);
    for key in ["condition_number", "condition_number_raw", "predicted_error_sigma", "predicted_rms_mm"] {
        let (made, checked) = (number(&made, key), number(&checked, key));
        // The scores are those of the same poses; only the candidates around them differ.
        assert!((checked / made - 1.0).abs() < 1e-6, "{key}: {made} {checked}");
    }
    assert_eq!(checked["warnings"].as_array().unwrap().len(), 0, "{}", checked["warnings"]);
    // Measured poses are numbered in the order of the program, so that 'pose % 4' can pick them later.
    let kinds = ["identification", "verification"];
    let measured: Vec<&str> = made["poses"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|pose| kinds.contains(&pose["kind"].as_str().unwrap()))
        .map(|pose| pose["pose"].as_str().unwrap())
        .collect();
    let numbers: Vec<String> = (1..=38).map(|number| number.to_string()).collect();
    assert_eq!(measured, numbers);
    // What the operator will see holds the tracker's noise as well.
    let seen = number(&made, "predicted_verification_rms_mm");
    assert!(seen > 0.02 * 3.0_f64.sqrt() && seen < 0.06, "{seen}");

    // A pose through the floor, written by hand, is named.
    let text = fs::read_to_string(&one).unwrap();
    // Pose 1 is repeated as drift pose: two configurations for one name would be refused before anything is scored.
    let is_edited = |line: &str| line.contains(",identification,") && !line.starts_with("1,");
    let (at, pose) = text.lines().enumerate().find(|(_, line)| is_edited(line)).unwrap();
    let name = pose.split(',').next().unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[at] = format!("{name},identification,0,80,0,0,0,0,,,");
    fs::write(&one, lines.join("\n")).unwrap();
    let output = trupose(&["plan", "--profile", "ur5e", "--candidates", "300", "--check", &one]);
    let report = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{report}");
    assert!(report.contains("not_measurable") && report.contains(&format!("pose {name}:")), "{report}");
}

#[test]
fn measured_poses_stay_in_and_new_ones_complete_them() {
    let folder = tempfile::tempdir().unwrap();
    let measured = folder.path().join("measured.csv");
    let rows = ["10,20,-30,40,50,60", "-40,-20,30,-80,-50,-60", "70,40,10,120,80,-160"];
    let rows: Vec<String> = rows.iter().enumerate().map(|(index, row)| format!("m{index},{row}")).collect();
    fs::write(&measured, format!("pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n{}\n", rows.join("\n"))).unwrap();
    let plan = json(&[
        "plan",
        "--profile",
        "soochow",
        "--candidates",
        "300",
        "--poses",
        "20",
        "--verification",
        "5",
        "--no-filters",
        "--include",
        measured.to_str().unwrap(),
    ]);
    assert_eq!(plan["identification_poses"], 23);
    let new = plan["poses"].as_array().unwrap().iter().filter(|pose| pose["kind"] == "identification").count();
    assert_eq!(new, 20, "the measured ones are not visited again");
    let codes: Vec<&str> =
        plan["warnings"].as_array().unwrap().iter().map(|warning| warning["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["not_checked"], "a plan without checks says so");

    // Of a plan that is included, only identification poses count as measured.
    let text = fs::read_to_string(&measured).unwrap().replace("pose,", "pose,kind,");
    let kinds = ["kind", "identification", "verification", "home"];
    let lines: Vec<String> =
        text.lines().zip(kinds).map(|(line, kind)| line.replacen(',', &format!(",{kind},"), 1)).collect();
    let lines = [&["pose,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg".to_owned()], &lines[1..]].concat();
    fs::write(&measured, lines.join("\n")).unwrap();
    let plan = json(&[
        "plan",
        "--profile",
        "soochow",
        "--candidates",
        "300",
        "--poses",
        "20",
        "--verification",
        "5",
        "--no-filters",
        "--include",
        measured.to_str().unwrap(),
    ]);
    assert_eq!(plan["identification_poses"], 21);
    assert_eq!(plan["warnings"][0]["code"], "not_included");
}

#[test]
fn bad_requests_are_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let profile = fs::read_to_string(root().join("profiles/soochow.ron")).unwrap();
    let inside = folder.path().join("inside.ron");
    fs::write(&inside, profile.replace("position_mm: (3500.0, 0.0, 1000.0)", "position_mm: (0.0, 0.0, 300.0)"))
        .unwrap();
    let inside = inside.to_str().unwrap();
    let cases: [(&[&str], &str); 6] = [
        (&["--profile", "soochow", "--limit", "j9=0..1"], "no joint 'j9'"),
        (&["--profile", "soochow", "--limit", "j2=170..175"], "leaves nothing of the range"),
        (&["--profile", "soochow", "--limit", "j2=60..-30"], "is not below the upper limit"),
        (&["--profile", "soochow", "--poses", "5", "--no-filters", "--candidates", "100"], "5 poses"),
        (&["--profile", "soochow", "--box", "5000..6000,0..10,0..10", "--candidates", "50"], "configurations tried"),
        (&["--profile", inside, "--candidates", "50"], "tracker"),
    ];
    for (arguments, reason) in cases {
        let output = trupose(&[&["plan"], arguments].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty() && message.contains(reason), "{arguments:?}: {message}");
    }
}

#[test]
fn a_program_is_written_for_a_plan() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.csv");
    fs::write(
        &plan,
        "pose,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\nh1,home,0,0,0,0,0,0\np1,identification,10,-20,30,-40,50,60\n",
    )
    .unwrap();
    let plan = plan.to_str().unwrap();
    let written = |dialect: &str, profile: &str| {
        let output = trupose(&["program", "--profile", profile, "--plan", plan, "--dialect", dialect]);
        (
            output.status.code().unwrap(),
            String::from_utf8(output.stdout).unwrap(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    let (code, rapid, err) = written("rapid", "abb_irb120");
    assert_eq!(code, 0, "{err}");
    assert!(rapid.contains("MoveAbsJ [[10.00000,-20.00000,30.00000,-40.00000,50.00000,60.00000]"), "{rapid}");
    let (code, urscript, _) = written("urscript", "ur5e");
    assert!(code == 0 && urscript.contains("movej([0.17453293,-0.34906585,"), "{urscript}");
    // Yaskawa wants pulses, and no shipped profile knows them.
    let (code, out, err) = written("inform", "ur5e");
    assert!(code == 2 && out.is_empty() && err.contains("pulses"), "{err}");
    let (code, _, err) = written("basic", "ur5e");
    assert!(code == 2 && err.contains("basic"), "{err}");
    // What the arm would run into is said in the program, too.
    let hit = folder.path().join("hit.csv");
    let rows = "pose,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\nhit,identification,0,0,170,0,0,0\n";
    fs::write(&hit, rows).unwrap();
    let output = trupose(&["program", "--profile", "ur5e", "--plan", hit.to_str().unwrap(), "--dialect", "urscript"]);
    let program = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{program}");
    assert!(program.contains("# DANGER: in pose hit "), "{program}");
    assert!(String::from_utf8(output.stderr).unwrap().contains("WARNING: in pose hit "));
    let out = folder.path().join("programs");
    let output = trupose(&[
        "program",
        "--profile",
        "staubli_tx2_60",
        "--plan",
        plan,
        "--dialect",
        "val3",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(fs::read_dir(&out).unwrap().count(), String::from_utf8(output.stdout).unwrap().lines().count());
}
