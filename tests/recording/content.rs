//! What is shown of a session is what its journal says.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use nalgebra::Point3;
use rerun::log::LogMsg;
use trupose::kinematics::ForwardKinematics;
use trupose::profile::Profile;
use trupose::recording;
use trupose::session::journal::Line;
use trupose::session::state::{Sample, Session};

use super::reading::{Row, SINGLE, assert_points, messages, numbers, results, rows, rows_in_order, whole};
use super::running::{RESULT, begun, eventful, plain, recorded, session_of, sliding, succeeded};
use crate::support::place::Place;

/// The recording of these lines.
pub(super) fn made_of(lines: &[Line]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    fs::read(recording::rebuild(folder.path(), lines).unwrap().path).unwrap()
}

/// Everything that the picture shows of a session is what its journal says.
pub(super) fn compare_with_journal(folder: &Path) {
    let path = folder.join(recording::FILE_NAME);
    let (journal, session) = session_of(folder);
    let profile = session.mounted_profile().unwrap();
    assert!(fs::read(&path).unwrap() == made_of(&journal.lines), "a recording is a function of the journal");
    assert_eq!(whole(&path), journal.lines.len());
    nothing_is_missing_on_any_timeline(&path);
    let moments = samples(&path, &session);
    let reflector = |number: u64, arm: &str| {
        let places = numbers(&path, &format!("/world/{arm}"), "story", "Capsules3D:translations");
        let (_, place) = places.into_iter().find(|(story, _)| *story == moments[&number]).unwrap();
        place[place.len() - 3..].to_vec()
    };
    let target = profile.targets()[0].position_in_flange;
    let forward = ForwardKinematics::new(profile.chain());
    for sample in &session.samples {
        let expected = forward.point_in_base(&session.configuration_of(sample), &target);
        assert_points(&reflector(sample.noted.number, "nominal"), std::iter::once(expected), SINGLE, "nominal");
    }

    let results = results(&journal);
    let Some(last) = results.last() else { return };
    let arm = last.calibration.as_ref().unwrap().identified(&profile).unwrap();
    let forward = ForwardKinematics::new(&arm.chain);
    for sample in &session.samples {
        let expected = forward.point_in_base(&session.configuration_of(sample), &arm.targets[0]);
        assert_points(&reflector(sample.noted.number, "identified"), std::iter::once(expected), SINGLE, "identified");
    }
    errors(&path, &session, &moments);
    let mut texts = rows(&path, false).into_iter().filter(|(entity, ..)| entity == "/text/headline");
    let headline = texts.find_map(|(_, _, mut values)| values.remove("TextDocument:text")).unwrap();
    assert!(headline.contains(" mm → ") && headline.contains("ACCEPTED"), "{headline}");
}

/// Every sample with its pose, joints and point; returns when each is in the story.
fn samples(path: &Path, session: &Session) -> BTreeMap<u64, i64> {
    let of = |component: &str| numbers(path, "/data/sample", "story", component);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of samples")]
    let moments: BTreeMap<u64, i64> =
        of("number").into_iter().map(|(story, number)| (number[0] as u64, story)).collect();
    let expected: BTreeSet<u64> = session.samples.iter().map(|sample| sample.noted.number).collect();
    assert_eq!(moments.keys().copied().collect::<BTreeSet<u64>>(), expected);
    let (points, joints): (BTreeMap<_, _>, BTreeMap<_, _>) =
        (of("xyz_mm").into_iter().collect(), of("joints").into_iter().collect());
    let names: BTreeMap<i64, (String, String)> = rows_in_order(path, false)
        .into_iter()
        .filter(|(_, (entity, ..))| entity == "/data/sample")
        .map(|(_, (_, times, values))| (times["story"], (values["pose"].clone(), values["kind"].clone())))
        .collect();
    for sample in &session.samples {
        let story = moments[&sample.noted.number];
        let (x, y, z) = sample.noted.xyz_mm;
        assert_eq!(points[&story], [x, y, z]);
        assert_eq!(joints[&story], sample.joints);
        let (pose, kind) = (session.pose_of(sample), session.kind_of(sample));
        assert_eq!(names[&story], (format!("[{pose}]"), format!("[{kind}]")));
    }
    moments
}

/// The errors of the last result in tables, and drawn equally magnified before and after.
fn errors(path: &Path, session: &Session, moments: &BTreeMap<u64, i64>) {
    let last = session.identified.as_ref().unwrap();
    for (arm, is_nominal) in [("nominal", true), ("identified", false)] {
        let found: BTreeMap<i64, Vec<f64>> =
            numbers(path, "/data/error", "story", &format!("{arm}_um")).into_iter().collect();
        for (number, text) in last.samples.iter().zip(&last.points) {
            let (x, y, z) = if is_nominal { text.nominal_mm } else { text.identified_mm };
            let expected = std::iter::once(Point3::new(x, y, z) * 1e3);
            assert_points(&found[&moments[number]], expected, 1e-6, arm);
        }
    }
    let mut drawn: Vec<_> = last.samples.iter().zip(&last.points).collect();
    drawn.sort_by_key(|(number, _)| **number);
    let is_drawn = |sample: &Sample| session.kind_of(sample) != trupose::session::plan::PoseKind::Verification;
    drawn.retain(|(number, text)| is_drawn(session.sample(**number).unwrap()) && !text.rejected);
    let all = |entity: &str| numbers(path, entity, "story", "Arrows3D:vectors");
    let (before, after) = (all("/world/before").pop().unwrap().1, all("/world/after"));
    if drawn.len() * 3 != before.len() {
        return;
    }
    let magnified = 1e3 * before[0] / drawn[0].1.nominal_mm.0;
    assert!(magnified >= 1.0);
    for (found, is_nominal) in [(&before, true), (&after.last().unwrap().1, false)] {
        let expected = drawn.iter().map(|(_, text)| {
            let (x, y, z) = if is_nominal { text.nominal_mm } else { text.identified_mm };
            Point3::new(x, y, z) * (magnified * 1e-3)
        });
        assert_points(found, expected, 1e-5, "drawn errors");
    }
    // They appear and shrink picture by picture.
    assert!(after.len() >= 35);
}

/// A viewer shows a red mark or nothing where a part has no value on its timeline, and a heap where it has looks without a place.
fn nothing_is_missing_on_any_timeline(path: &Path) {
    let drawn: Vec<Row> = rows(path, false).into_iter().filter(|(entity, ..)| !entity.starts_with("/__")).collect();
    let mut begin: BTreeMap<&str, i64> = BTreeMap::new();
    let mut stories: Vec<(i64, i64)> = Vec::new();
    for (entity, times, _) in drawn.iter().filter(|(_, times, _)| !times.is_empty()) {
        assert_eq!(times.keys().map(String::as_str).collect::<Vec<_>>(), ["story", "time"], "{entity}");
        stories.push((times["story"], times["time"]));
        let first = begin.entry(entity).or_insert(i64::MAX);
        *first = times["story"].min(*first);
    }
    stories.sort_unstable();
    assert!(stories.is_sorted_by_key(|(_, time)| *time), "both timelines go the same way");
    for arm in ["/world/nominal", "/world/identified"] {
        assert!(begin.get(arm).is_none_or(|first| *first == 0), "{arm} has no place at the beginning");
    }
    // Every view has something to show.
    let is_known = |path: &str| drawn.iter().any(|(entity, ..)| entity.starts_with(path));
    for (view, _, values) in
        rows(path, true).iter().filter(|(.., values)| values.contains_key("ViewBlueprint:space_origin"))
    {
        let contents =
            rows(path, true).into_iter().find(|(entity, ..)| *entity == format!("{view}/ViewContents")).unwrap();
        let origin = values["ViewBlueprint:space_origin"].trim_matches(['[', ']']);
        let query = contents.2["ViewContents:query"].replace("$origin", origin);
        let mut paths = query
            .trim_matches(['[', ']'])
            .split(", ")
            .map(|part| part.trim_start_matches("+ ").trim_end_matches("/**"));
        assert!(paths.any(is_known), "{view} is empty: {query}");
    }
}

/// The recording of a session equals the one that is made from its journal, byte by byte.
pub(super) fn compare_with_rebuilt(place: &Place) {
    let recorded = fs::read(place.recording()).unwrap();
    succeeded(&place.run(&["record", "rebuild", "sessions/s"]));
    assert!(fs::read(place.recording()).unwrap() == recorded);
}

/// Where the instrument is drawn at last, and its label.
fn tracker(path: &Path) -> (Point3<f64>, String) {
    let mut drawn: Vec<Row> = rows(path, false).into_iter().filter(|(entity, ..)| entity == "/world/tracker").collect();
    drawn.sort_by_key(|(_, times, _)| times["story"]);
    let (_, place) = numbers(path, "/world/tracker", "story", "Points3D:positions").pop().unwrap();
    (Point3::new(place[0], place[1], place[2]), drawn.pop().unwrap().2["Points3D:labels"].clone())
}

fn beam(path: &Path) -> Vec<f64> {
    numbers(path, "/world/nominal", "story", "LineStrips3D:strips").pop().unwrap().1
}

#[test]
fn the_tracker_is_drawn_as_planned_until_points_determine_its_place() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let (_, session) = session_of(&place.session());
    let profile: Profile = session.mounted_profile().unwrap();
    let planned = profile.tracker().position_in_base;
    let truth = trupose::link::SimulatedCell::new(
        &profile,
        &trupose::session::simulation::Simulation { seed: 1, ..Default::default() },
    )
    .unwrap();
    let stands = Point3::from(truth.truth().base_from_tracker.translation.vector);
    assert!((stands - planned).norm() > 0.05, "the test needs one that stands elsewhere: {stands} {planned}");
    let path = place.recording();
    let (drawn, label) = tracker(&path);
    assert_eq!(label, "[tracker (as planned)]");
    assert_points(&[drawn.x, drawn.y, drawn.z], std::iter::once(planned), SINGLE, "planned");
    assert_points(&beam(&path)[..3], std::iter::once(drawn), SINGLE, "beam");
    // The fourth point determines it; the nominal arm is off by centimetres.
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&path);
    assert_eq!(label, "[tracker]");
    assert!((drawn - stands).norm() < 0.1 && (drawn - planned).norm() > 0.02, "{drawn} instead of {stands}");
    assert_points(&beam(&path)[..3], std::iter::once(drawn), SINGLE, "beam");
    let rest = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&path);
    assert_eq!(label, "[tracker]");
    // The identified arm locates it to a millimetre; it is not drawn again for less than 20 mm.
    assert!((drawn - stands).norm() < 0.021, "{drawn} instead of {stands}");
    compare_with_rebuilt(&place);
}

#[test]
fn a_recording_shows_what_the_journal_says_and_is_rebuilt_the_same() {
    let place = recorded(&plain());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
    // Everyone who may read the other results may read this one.
    fs::write(place.path("plain"), "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&place.recording()), mode(&place.path("plain")));
    assert_eq!(mode(&place.recording()), mode(&place.session().join("report.json")));
    // About 240 kB do not depend on the number of poses, which take 1 kB each.
    let bytes = fs::metadata(place.recording()).unwrap().len();
    assert!(bytes < 240_000 + 2000 * 20, "{bytes} bytes");
}

#[test]
fn what_was_measured_again_left_out_corrected_or_skipped_is_shown_as_it_is() {
    let place = recorded(&eventful());
    let (journal, session) = session_of(&place.session());
    assert_eq!(results(&journal).len(), 2);
    assert!(session.rows.iter().any(|row| row.skipped));
    compare_with_journal(&place.session());
    let unused = numbers(&place.recording(), "/world/unused", "story", "Points3D:positions");
    let out = session.samples.iter().filter(|sample| {
        use trupose::session::state::SampleState;
        matches!(sample.state, SampleState::LeftOut | SampleState::Undone)
    });
    let skipped = session.rows.iter().filter(|row| row.skipped).count();
    assert_eq!(unused.last().unwrap().1.len(), 3 * (out.count() + skipped));
    compare_with_rebuilt(&place);
}

#[test]
fn an_arm_with_a_sliding_and_a_coupled_joint_is_drawn_where_it_is() {
    let place = recorded(&sliding());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
}

#[test]
fn a_recording_carries_one_layout_that_plays_its_story() {
    let place = recorded(&plain());
    let layouts: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::BlueprintActivationCommand(command) => Some(command.blueprint_id),
            _ => None,
        })
        .collect();
    assert_eq!(layouts.len(), 1);
    let stores: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::SetStoreInfo(info) if info.info.store_id.is_blueprint() => Some(info.info.store_id),
            _ => None,
        })
        .collect();
    assert_eq!(stores, layouts);
    assert_eq!(opens_on(&place.recording()), "[story]");
    let shown = views(&place.recording());
    let errors = "[Position error at every pose]";
    assert!(shown.contains(errors) && shown.iter().any(|view| view.starts_with("[BEFORE: nominal arm, ")), "{shown:?}");
    assert!(!shown.contains(TEMPERATURES), "{shown:?}");
    // While there is no result there is no room for it.
    let place = recorded(&format!("{} Capture(2, Fail)", begun("")));
    assert!(!views(&place.recording()).contains(errors));
    nothing_is_missing_on_any_timeline(&place.recording());
}

/// The plot that is there where temperatures were measured.
pub(super) const TEMPERATURES: &str = "[Temperature, °C]";

/// Names of what a viewer shows.
pub(super) fn views(path: &Path) -> BTreeSet<String> {
    let layout = rows(path, true).into_iter();
    layout.filter_map(|(_, _, values)| values.get("ViewBlueprint:display_name").cloned()).collect()
}

/// The timeline that a viewer shows first.
fn opens_on(path: &Path) -> String {
    let layout = rows(path, true);
    let panel = layout.iter().find(|(_, _, values)| values.contains_key("TimePanelBlueprint:timeline")).unwrap();
    panel.2["TimePanelBlueprint:timeline"].clone()
}
