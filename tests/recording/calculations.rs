//! Recordings without a session.

use std::fs;

use super::content::{TEMPERATURES, views};
use super::reading::{numbers, rows, whole};
use super::running::{begun, recorded, session_of, succeeded};
use crate::support::place::Place;
use crate::support::text;

/// A place with the table of a session.
fn measured() -> (Place, String) {
    let place = recorded(&format!("{} CaptureAll(Fail)", begun("")));
    let table = place.run(&["replay", "sessions/s", "--csv"]);
    succeeded(&table);
    (place, text(&table.stdout))
}

#[test]
fn an_identification_from_files_is_recorded() {
    let (place, table) = measured();
    let identify = |table: &str, record: &str, codes: &[i32]| {
        fs::write(place.path("measured.csv"), table).unwrap();
        let options = ["identify", "--profile", "soochow", "--measurements", "measured.csv", "--record", record];
        let output = place.run(&options);
        assert!(codes.contains(&output.status.code().unwrap()), "{record}: {}", text(&output.stderr));
        place.path(record)
    };
    let path = identify(&table, "out.rrd", &[0, 1]);
    let (_, measured) = session_of(&place.session());
    assert_eq!(numbers(&path, "/data/sample", "story", "xyz_mm").len(), measured.counted().count());
    assert!(whole(&path) > measured.counted().count());
    assert!(!views(&path).contains(TEMPERATURES));
    // A recording may be replaced; nothing else is overwritten, least of all what was measured.
    identify(&table, "out.rrd", &[0, 1]);
    identify(&table, "measured.csv", &[2]);
    assert_eq!(fs::read_to_string(place.path("measured.csv")).unwrap(), table);
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
    let lines = table.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).enumerate();
    let warm: Vec<String> =
        lines.map(|(row, line)| if row == 0 { line + ",temperature_degc" } else { line + ",21.5" }).collect();
    let path = identify(&warm.join("\n"), "warm.rrd", &[0, 1]);
    assert!(views(&path).contains(TEMPERATURES));
    let temperatures = numbers(&path, "/capture/temperature_degc", "story", "Scalars:scalars");
    assert_eq!(temperatures.len(), measured.counted().count());
    assert!(temperatures.iter().all(|(_, values)| values == &[21.5]), "{temperatures:?}");
    // A point that is 3 mm off spoils no scale.
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[9].split(',').map(str::to_owned).collect();
    cells[7] = (cells[7].parse::<f64>().unwrap() + 3.0).to_string();
    lines[9] = cells.join(",");
    let bad = identify(&lines.join("\n"), "bad.rrd", &[0, 1]);
    let good = identify(&table, "good.rrd", &[0, 1]);
    let scales = |path| -> Vec<f64> {
        let views = views(path).into_iter();
        views.filter_map(|view| view.split_once(" drawn ")?.1.trim_end_matches(" x]").parse().ok()).collect()
    };
    let (bad_scales, good_scales) = (scales(&bad), scales(&good));
    assert_eq!(bad_scales.len(), 3);
    let ratios = bad_scales.iter().zip(&good_scales).map(|(bad, good)| bad / good);
    assert!(ratios.into_iter().all(|ratio| (0.3..3.0).contains(&ratio)), "{bad_scales:?} instead of {good_scales:?}");
    let is_rejected =
        |(entity, _, values): &super::reading::Row| entity == "/data/error" && values["rejected"] == "[true]";
    assert_eq!(rows(&bad, false).iter().filter(|row| is_rejected(row)).count(), 1);
    assert_eq!(rows(&good, false).iter().filter(|row| is_rejected(row)).count(), 0);
}

#[test]
fn a_plan_is_recorded_as_a_film() {
    let place = Place::new();
    let plan = ["plan", "--profile", "soochow", "--poses", "16", "--verification", "4", "--candidates", "150"];
    succeeded(&place.run(&[&plan[..], &["--out", "p.csv", "--record", "p.rrd"]].concat()));
    let path = place.path("p.rrd");
    assert!(views(&path).contains("[Search for poses]"));
    let table = fs::read_to_string(place.path("p.csv")).unwrap();
    let planned = table.lines().filter(|line| !line.starts_with('#')).count() - 1;
    let points: usize = numbers(&path, "/world/trail/plan", "story", "Points3D:positions")
        .iter()
        .map(|(_, points)| points.len() / 3)
        .sum();
    assert_eq!(points, planned);
    // The arm drives through all of them.
    assert_eq!(numbers(&path, "/world/trail/path", "story", "LineStrips3D:strips").len(), planned);
    let arm = numbers(&path, "/world/nominal", "story", "Capsules3D:translations");
    assert!(arm.len() > 2 * planned);
    let last = &arm.last().unwrap().1;
    let end = &numbers(&path, "/world/trail/path", "story", "LineStrips3D:strips").pop().unwrap().1;
    assert_eq!(last[last.len() - 3..], end[3..]);
}
