//! Scripts through the whole program: every script that is shipped, the demo's transcript, what fails and how, recorded data.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use crate::support::{measured_data, root, text, trupose_in};
use serde_json::Value;
use tempfile::TempDir;

fn shipped(name: &str) -> PathBuf {
    root().join("sessions").join(name)
}

/// A script written to a temporary folder, and its run there.
fn run_script(script: &str, more: &[&str]) -> (TempDir, Output) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("test.script.ron"), script).unwrap();
    let mut arguments = vec!["--script", "test.script.ron"];
    arguments.extend(more);
    let output = trupose_in(folder.path(), &arguments);
    (folder, output)
}

/// The steps up to a plan of the paper's arm, on a cell with these faults.
fn begun(steps: &str) -> String {
    format!(
        r#"(title: "test", clock: Some("2026-01-05T08:00:00Z"), steps: [
            Do(ChooseProfile("soochow")), Do(NameSession("test")), Do(Next),
            Do(ChooseInstrument(Simulated((seed: 3, truth: Drawn)))), Do(Next), Do(ChooseTarget(Profile)), Do(Next),
            {steps}
        ])"#
    )
}

/// As [`begun`], with a plan of few poses that is quickly chosen.
fn planned(steps: &str) -> String {
    begun(&format!(
        "Do(MakePlan((poses: 20, verification: 6, candidates: 200, drift_every: 0))), Do(AcceptPlan), {steps}"
    ))
}

#[test]
fn every_shipped_script_that_needs_no_data_passes_and_says_nothing_on_stderr() {
    let mut names: Vec<String> = fs::read_dir(shipped(""))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".script.ron"))
        .collect();
    names.sort();
    assert!(names.len() >= 14, "{names:?}");
    for name in names {
        let script = fs::read_to_string(shipped(&name)).unwrap();
        // The demo is run as `trupose demo`.
        if script.contains("${data}") || name == "demo.script.ron" {
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let output = trupose_in(folder.path(), &["--script", shipped(&name).to_str().unwrap()]);
        assert_eq!(
            (output.status.code(), text(&output.stderr)),
            (Some(0), String::new()),
            "{name}: {}",
            text(&output.stdout)
        );
    }
}

#[test]
fn the_demo_gives_the_same_transcript_for_the_same_seed() {
    let run = |more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let output = trupose_in(folder.path(), &[&["demo"], more].concat());
        assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
        let calibration = fs::read_to_string(folder.path().join("sessions/demo/calibration.ron")).unwrap();
        let journal = fs::read_to_string(folder.path().join("sessions/demo/journal.ron")).unwrap();
        (text(&output.stdout), calibration, journal)
    };
    let (whole, ..) = run(&[]);
    assert!(whole.contains("Verdict: ACCEPTED"), "{whole}");
    assert!(whole.ends_with("session sessions/demo\n"), "{whole}");
    insta::assert_snapshot!("demo", whole);
    // A smaller plan of the same script.
    let small = ["--set", "candidates=200", "--set", "poses=20", "--set", "verification=10"];
    let quick = |seed| run(&[&["--seed", seed], &small[..]].concat());
    let (first, other) = (quick("1"), quick("2"));
    assert_eq!(first, quick("1"));
    assert_ne!(first.0, other.0);
}

#[test]
fn every_line_of_the_json_transcript_is_an_object() {
    let (_folder, output) = run_script(&planned("Capture(2, Fail), Say(\"two\")"), &["--json"]);
    assert_eq!(output.status.code(), Some(0));
    let events: Vec<String> = text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["event"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(events.first().map(String::as_str), Some("script"));
    assert_eq!(events.iter().filter(|event| *event == "say").count(), 1);
    assert!(events.iter().filter(|event| *event == "saved").count() >= 10, "{events:?}");
}

#[test]
fn a_failed_expectation_names_the_step_what_was_expected_and_what_was_seen() {
    let (_folder, output) = run_script(&planned("Capture(2, Fail), Expect(\"capture.measured\", Is(\"3\"))"), &[]);
    assert_eq!(output.status.code(), Some(1));
    let error = text(&output.stderr);
    assert_eq!(error, "error: script step 11: expected capture.measured to be '3'; seen: 2\n");
    let transcript = text(&output.stdout);
    assert!(transcript.contains("failed  step 11"), "{transcript}");
    // The session is closed all the same.
    assert!(transcript.contains("closed: quit"), "{transcript}");
}

#[test]
fn what_is_not_possible_is_a_failure_with_the_reason() {
    for (steps, part) in [
        ("Do(Next)", "Next is not possible now: accept a plan first"),
        ("Do(Measure)", "Measure is not offered here; offered:"),
        ("Do(LoadPlan(\"none.csv\"))", "LoadPlan failed: cannot read 'none.csv'"),
        ("Fails(AcceptPlan, \"x\")", "AcceptPlan is not possible now"),
        ("Fails(Note(\"x\"), \"x\")", "Note is not offered here"),
        ("Do(Quit), Say(\"never\")", "the program has ended ('quit'), 1 steps are left"),
        ("Expect(\"plan.nonsense\", Exists)", "no 'nonsense' in plan, which has accepted, left, measured"),
        (
            "CaptureAll(Fail), Expect(\"header.step\", Is(\"Capture\"))",
            "expected header.step to be 'Capture'; seen: Plan",
        ),
        (
            "Fails(LoadPlan(\"none.csv\"), \"cannot read\"), Do(AcceptPlan)",
            "AcceptPlan is not possible now: there is no new plan to accept",
        ),
    ] {
        let (_folder, output) = run_script(&begun(steps), &[]);
        // Lines are broken for the terminal: compare words.
        let error = text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code(), Some(1), "{steps}: {error}");
        assert!(error.contains(part), "{steps}: {error}");
    }
}

#[test]
fn blocked_intents_can_be_expected() {
    let steps = "Blocked(Next, \"accept a plan\"), Blocked(AcceptPlan, \"no new plan\")";
    let (_folder, output) = run_script(&begun(steps), &[]);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    let (_folder, output) = run_script(&begun("Blocked(MakePlan((poses: 5)), \"no\")"), &[]);
    let error = text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(error.contains("because 'no'; it is possible"), "{error}");
}

#[test]
fn scripts_with_defects_are_refused_with_their_place() {
    for (script, part) in [
        ("(title: \"x\", steps: [Do(Nex)])", "'test.script.ron': line 1, column 25"),
        ("(title: \"x\", step: [])", "Unexpected field named `step`"),
        ("(title: \"x\", clock: Some(\"noon\"), steps: [])", "'noon' is not a time"),
        ("(title: \"x\", steps: [Say(\"${who}\")])", "needs a value for 'who': use '--set who=…'"),
    ] {
        let (_folder, output) = run_script(script, &[]);
        let error = text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code(), Some(2), "{script}: {error}");
        assert!(error.contains(part), "{script}: {error}");
    }
    let (_folder, output) = run_script("(title: \"x\", steps: [])", &["--set", "seed=1"]);
    assert!(text(&output.stderr).contains("the script has no placeholder 'seed'"));
    let script = "(title: \"x\", steps: [Do(MakePlan((poses: ${poses:20})))])";
    let (_folder, output) = run_script(script, &["--set", "poses=abc"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("hint: does the value given with '--set' fit here? poses=abc"),
        "{}",
        text(&output.stderr)
    );
    let (_folder, output) = run_script(script, &["--set", "poses=20", "--set", "poses=30"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("'poses' is given twice"), "{}", text(&output.stderr));
}

#[test]
fn what_was_done_can_be_recorded_and_played_again() {
    let (folder, output) =
        run_script(&planned("CaptureAll(Fail), Do(Next), Do(Identify)"), &["--record-script", "again.script.ron"]);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    let again = trupose_in(folder.path(), &["--script", "again.script.ron"]);
    assert_eq!((again.status.code(), text(&again.stderr)), (Some(0), String::new()));
    let tables =
        |output: &Output| text(&output.stdout).split_once("\nIdentification of").unwrap().1.replace("test-2", "test");
    assert_eq!(tables(&output), tables(&again));
}

#[test]
fn the_poses_of_a_file_can_be_the_plan() {
    let plan = "pose,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,identification,0,0,0,0,30,0\nb,verification,10,5,0,20,40,0\n";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("few.csv"), plan).unwrap();
    let steps = "Do(LoadPlan(\"few.csv\")), Do(AcceptPlan), CaptureAll(Fail), Blocked(Next, \"1 of at least 9 identification poses\")";
    fs::write(folder.path().join("test.script.ron"), begun(steps)).unwrap();
    let output = trupose_in(folder.path(), &["--script", "test.script.ron"]);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
}

#[test]
fn a_calibration_with_a_found_smr_verifies_its_own_measurements() {
    let folder = tempfile::tempdir().unwrap();
    let script = shipped("circles.script.ron");
    let text_of = fs::read_to_string(script).unwrap();
    let with_files = text_of.replace("    ],\n)", "        Do(Next),\n        Do(Deliver),\n    ],\n)");
    fs::write(folder.path().join("test.script.ron"), with_files).unwrap();
    let output = trupose_in(folder.path(), &["--script", "test.script.ron"]);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    let arguments = [
        "verify",
        "--calibration",
        "sessions/circles/calibration.ron",
        "--measurements",
        "sessions/circles/measurements.csv",
        "--use",
        "kind == 'verification'",
        "--json",
    ];
    let verified = trupose_in(folder.path(), &arguments);
    let verified: Value = serde_json::from_str(&text(&verified.stdout)).unwrap();
    let report = fs::read_to_string(folder.path().join("sessions/circles/report.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    let rms = |value: &Value| value["verification"]["identified"]["position_mm"]["rms"].as_f64().unwrap();
    assert!((rms(&verified) - rms(&report)).abs() < 1e-6, "{} {}", rms(&verified), rms(&report));
    assert!(rms(&report) < 0.05);
}

#[test]
fn recorded_data_give_the_same_numbers_as_identify() {
    let Some(ur5) = measured_data("ur5") else { return };
    let ur5 = ur5.canonicalize().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let set = format!("data={}", ur5.display());
    let output =
        trupose_in(folder.path(), &["--script", shipped("ur5-recorded.script.ron").to_str().unwrap(), "--set", &set]);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    let report = fs::read_to_string(folder.path().join("sessions/ur5-recorded/report.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    let (grid, random) = (ur5.join("grid.csv"), ur5.join("random.csv"));
    let arguments = [
        "identify",
        "--profile",
        "ur5",
        "--measurements",
        grid.to_str().unwrap(),
        "--use",
        "pose % 17 == 0",
        "--verify",
        random.to_str().unwrap(),
        "--json",
    ];
    let direct: Value = serde_json::from_str(&text(&trupose_in(folder.path(), &arguments).stdout)).unwrap();
    for part in ["rank", "samples", "parameters", "rejected"] {
        compare(&report[part], &direct[part], part);
    }
    for part in ["nominal", "identified"] {
        compare(&report["verification"][part], &direct["verification"][part], part);
    }
}

/// The same numbers, to a millionth of a millimetre or degree.
fn compare(a: &Value, b: &Value, path: &str) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            assert!((a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-6, "{path}: {a} {b}");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{path}");
            a.iter().zip(b).enumerate().for_each(|(index, (a, b))| compare(a, b, &format!("{path}.{index}")));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{path}");
            a.iter().for_each(|(key, a)| compare(a, &b[key], &format!("{path}.{key}")));
        }
        (a, b) => assert_eq!(a, b, "{path}"),
    }
}
