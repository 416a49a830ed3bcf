//! Recordings without a session, and their replay.

use std::fs;
use std::path::Path;

use trupose::session::state::Session;

use super::content::{TEMPERATURES, compare_frames, enlarged, opens_on, views};
use super::reading::{numbers, results, rows, whole};
use super::running::{begun, plain, recorded, session_of, succeeded};
use crate::support::place::Place;
use crate::support::text;

#[test]
fn an_identification_from_files_is_recorded() {
    let place = recorded(&format!("{} CaptureAll(Fail)", begun("")));
    let table = place.run(&["replay", "sessions/s", "--csv"]);
    succeeded(&table);
    fs::write(place.path("measured.csv"), &table.stdout).unwrap();
    let output =
        place.run(&["identify", "--profile", "soochow", "--measurements", "measured.csv", "--record", "out.rrd"]);
    assert!([0, 1].contains(&output.status.code().unwrap()), "{}", text(&output.stderr));
    let path = place.path("out.rrd");
    let journal = whole(&path);
    let session = Session::of(&journal).unwrap();
    let (_, measured) = session_of(&place.session());
    assert_eq!(session.samples.len(), measured.counted().count());
    let profile = session.mounted_profile().unwrap();
    compare_frames(&path, &session, "/world/nominal/frames", "nominal", profile.chain());
    assert_eq!(results(&journal).len(), 1);
    assert!(!views(&path).contains(TEMPERATURES));
    // A recording may be replaced; nothing else is overwritten, least of all what was measured.
    let identify = ["identify", "--profile", "soochow", "--measurements", "measured.csv", "--record"];
    for (target, code) in [("out.rrd", &[0, 1][..]), ("measured.csv", &[2])] {
        let output = place.run(&[&identify[..], &[target]].concat());
        assert!(code.contains(&output.status.code().unwrap()), "{target}: {}", text(&output.stderr));
    }
    assert_eq!(fs::read(place.path("measured.csv")).unwrap(), table.stdout);
    let output = place.run(&["plan", "--profile", "soochow", "--record", "measured.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("'measured.csv' already exists and is not a recording"));
    // Nor is the recording of another program.
    let other = place.path("other.rrd");
    drop(rerun::RecordingStreamBuilder::new("other_program").enabled(true).save(&other).unwrap());
    let bytes = fs::read(&other).unwrap();
    assert_eq!(place.run(&["plan", "--profile", "soochow", "--record", "other.rrd"]).status.code(), Some(2));
    assert!(fs::read(&other).unwrap() == bytes);
    // An instrument that knows the temperature.
    let rows = text(&table.stdout);
    let lines = rows.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).enumerate();
    let warm: Vec<String> =
        lines.map(|(row, line)| if row == 0 { line + ",temperature_degc" } else { line + ",21.5" }).collect();
    fs::write(place.path("warm.csv"), warm.join("\n")).unwrap();
    let output = place.run(&["identify", "--profile", "soochow", "--measurements", "warm.csv", "--record", "warm.rrd"]);
    assert!([0, 1].contains(&output.status.code().unwrap()), "{}", text(&output.stderr));
    let path = place.path("warm.rrd");
    assert!(views(&path).contains(TEMPERATURES));
    let temperatures = numbers(&path, "/capture/temperature_degc", "pose", "Scalars:scalars");
    assert_eq!(temperatures.len(), session.samples.len());
    assert!(temperatures.iter().all(|(_, values)| values == &[21.5]), "{temperatures:?}");
}

#[test]
fn a_rejected_sample_spoils_no_scale_no_mean_and_no_pair() {
    let place = recorded(&format!("{} CaptureAll(Fail)", begun("")));
    let table = text(&place.run(&["replay", "sessions/s", "--csv"]).stdout);
    let identify = |name: &str, table: &str| {
        fs::write(place.path("measured.csv"), table).unwrap();
        let output =
            place.run(&["identify", "--profile", "soochow", "--measurements", "measured.csv", "--record", name]);
        assert!([0, 1].contains(&output.status.code().unwrap()), "{}", text(&output.stderr));
        place.path(name)
    };
    let good = identify("good.rrd", &table);
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[9].split(',').map(str::to_owned).collect();
    cells[7] = (cells[7].parse::<f64>().unwrap() + 3.0).to_string();
    lines[9] = cells.join(",");
    let bad = identify("bad.rrd", &lines.join("\n"));
    let mean = |path: &Path, entity: &str| {
        let values: Vec<f64> =
            numbers(path, entity, "pose", "Scalars:scalars").into_iter().flat_map(|(_, values)| values).collect();
        assert!(!values.is_empty(), "{entity}");
        values.iter().sum::<f64>() / values.len() as f64
    };
    for entity in ["/errors_mm/position_identified/fit_1", "/errors_mm/distance_identified/fit_1"] {
        assert!(mean(&bad, entity) < 1.2 * mean(&good, entity), "{entity}");
    }
    let rejected = numbers(&bad, "/errors_mm/position_identified/rejected_1", "pose", "Scalars:scalars");
    assert!(rejected.len() == 1 && (rejected[0].1[0] - 3.0).abs() < 0.1, "{rejected:?}");
    let scales = enlarged(&bad, "(identified) ") / enlarged(&good, "(identified) ");
    assert!((0.3..3.0).contains(&scales), "{scales}");
    let solved = |path: &Path| {
        let steps = numbers(path, "/solver/mean_error_mm", "solver_iteration", "Scalars:scalars");
        steps.last().unwrap().1[0]
    };
    assert!(solved(&bad) < 1.2 * solved(&good));
    let worst = rows(&bad, false)
        .into_iter()
        .find(|(entity, _, values)| entity == "/world/pairs/identified" && values.contains_key("LineStrips3D:labels"));
    let labels = worst.unwrap().2["LineStrips3D:labels"].clone();
    assert!(labels.contains("+0.0") || labels.contains("-0.0"), "{labels}");
    assert!(!labels.contains("2."), "{labels}");
}

#[test]
fn a_recording_is_replayed_like_its_session_also_when_its_end_is_missing() {
    let place = recorded(&plain());
    let bytes = fs::read(place.recording()).unwrap();
    fs::write(place.path("whole.rrd"), &bytes).unwrap();
    fs::write(place.path("cut.rrd"), &bytes[..bytes.len() * 9 / 10]).unwrap();
    for format in ["--print", "--csv"] {
        let expected = place.run(&["replay", "sessions/s", format]);
        succeeded(&expected);
        for file in ["whole.rrd", "cut.rrd"] {
            let shown = place.run(&["replay", file, format]);
            succeeded(&shown);
            assert!(shown.stdout.len() > 200);
            assert_eq!(text(&shown.stdout), text(&expected.stdout), "{file} {format}");
        }
    }
}

#[test]
fn a_plan_is_recorded_and_opens_on_its_search() {
    let place = Place::new();
    let output = place.run(&[
        "plan",
        "--profile",
        "soochow",
        "--poses",
        "16",
        "--verification",
        "4",
        "--candidates",
        "150",
        "--record",
        "p.rrd",
    ]);
    succeeded(&output);
    let path = place.path("p.rrd");
    let journal = whole(&path);
    assert_eq!(opens_on(&path), "[plan_iteration]");
    let search = numbers(&path, "/search/condition_number", "plan_iteration", "Scalars:scalars");
    assert!(search.len() > 1, "{search:?}");
    let steps: Vec<i64> = search.iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, (1..).take(steps.len()).collect::<Vec<i64>>());
    let planned = rows(&path, false)
        .into_iter()
        .find(|(entity, _, values)| entity == "/world/plan/poses" && values.contains_key("Points3D:positions"));
    let rows = Session::of(&journal).unwrap().rows.len();
    assert_eq!(planned.unwrap().2["Points3D:positions"].matches('[').count(), rows + 1);
}
