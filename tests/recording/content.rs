//! What is shown of a session is what its journal says.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use nalgebra::Point3;
use rerun::log::LogMsg;
use trupose::kinematics::{ForwardKinematics, KinematicChain};
use trupose::recording;
use trupose::session::journal::{Entry, Journal, PointErrorText};
use trupose::session::plan::PoseKind;
use trupose::session::state::Session;

use super::reading::{
    SINGLE, assert_near, assert_points, data, frames, journal_text, messages, numbers, results, rows, whole,
};
use super::running::{RESULT, begun, eventful, plain, recorded, session_of, sliding, succeeded};
use crate::support::place::Place;

/// Every frame of `chain` at every sample.
pub(super) fn compare_frames(path: &Path, session: &Session, entity: &str, arm: &str, chain: &KinematicChain) {
    let found = frames(path, entity, "pose");
    let forward = ForwardKinematics::new(chain);
    for sample in &session.samples {
        let number = i64::try_from(sample.noted.number).unwrap();
        let expected = forward.base_from_links(&session.configuration_of(sample));
        assert_eq!(found.keys().filter(|(pose, _)| *pose == number).count(), expected.len());
        for (index, expected) in expected.iter().enumerate() {
            assert_near(&found[&(number, format!("{arm}/{index}"))], expected, &format!("{arm}, pose {number}"));
        }
    }
    // Pose 0 stands for the time before the first measurement.
    let poses: BTreeSet<i64> = found.keys().map(|(pose, _)| *pose).filter(|pose| *pose > 0).collect();
    assert_eq!(poses.len(), session.samples.len());
}

/// How many times larger errors of an arm are drawn, as the picture says it.
pub(super) fn enlarged(path: &Path, before: &str) -> f64 {
    let note = rows(path, false)
        .into_iter()
        .find(|(entity, _, values)| entity == "/world/scale_note" && values.contains_key("Points3D:labels"))
        .unwrap();
    let text = &note.2["Points3D:labels"];
    text.split_once(before).unwrap().1.split_whitespace().next().unwrap().parse().unwrap()
}

/// Everything that the picture shows of a session is what its journal says.
pub(super) fn compare_with_journal(folder: &Path) {
    let path = folder.join(recording::FILE_NAME);
    let (journal, session) = session_of(folder);
    let profile = session.mounted_profile().unwrap();
    assert_eq!(journal_text(&path).into_bytes(), fs::read(folder.join("journal.ron")).unwrap());
    assert_eq!(whole(&path), journal);

    compare_frames(&path, &session, "/world/nominal/frames", "nominal", profile.chain());
    let readings = numbers(&path, "/reading/xyz_mm", "pose", "Scalars:scalars");
    let expected = session.samples.iter().map(|sample| {
        let (x, y, z) = sample.noted.xyz_mm;
        (i64::try_from(sample.noted.number).unwrap(), vec![x, y, z])
    });
    assert_eq!(readings, expected.collect::<Vec<_>>());
    assert_eq!(numbers(&path, "/world/measured", "pose", "Points3D:positions").len(), session.samples.len());
    let logged = rows(&path, false).iter().filter(|(entity, ..)| entity == "/log").count();
    assert_eq!(logged, journal.lines.len());

    let results = results(&journal);
    assert_eq!(results.len(), session.runs_in(&journal));
    let Some(last) = results.last() else { return };
    let calibration = last.calibration.as_ref().unwrap();
    let chain = calibration.identified(&profile).unwrap().chain;
    compare_frames(&path, &session, "/world/identified/frames", "identified", &chain);
    for (run, result) in (1..).zip(&results) {
        let samples = || result.samples.iter().zip(&result.points);
        for (arm, pick) in [("nominal", 0), ("identified", 1)] {
            let error = |text: &PointErrorText| {
                let (x, y, z) = [text.nominal_mm, text.identified_mm][pick];
                Point3::new(x, y, z)
            };
            for (suffix, is_verification) in [("fit", false), ("verification", true)] {
                let entity = format!("/errors_mm/position_{arm}/{suffix}_{run}");
                let found = numbers(&path, &entity, "pose", "Scalars:scalars");
                let mut expected: Vec<(i64, f64)> = samples()
                    .filter(|(number, _)| {
                        let kind = session.kind_of(session.sample(**number).unwrap());
                        (kind == PoseKind::Verification) == is_verification
                    })
                    .inspect(|(_, text)| assert!(!text.rejected, "a rejected sample is no {suffix}"))
                    .map(|(number, text)| (i64::try_from(*number).unwrap(), error(text).coords.norm()))
                    .collect();
                expected.sort_by_key(|(number, _)| *number);
                assert_eq!(found.len(), expected.len(), "{entity}");
                for ((at, values), (number, length)) in found.iter().zip(&expected) {
                    assert_eq!(at, number);
                    assert!((values[0] - length).abs() < 1e-9, "{entity}: {values:?} instead of {length}");
                }
            }
        }
    }
    for (arm, label) in [("nominal", "(nominal) "), ("identified", "(identified) ")] {
        let entity = format!("/world/errors/{arm}");
        let scale = enlarged(&path, label);
        assert!(scale >= 1.0);
        let vectors = numbers(&path, &entity, "pose", "Arrows3D:vectors");
        assert_eq!(vectors.len(), 1);
        let expected = last.points.iter().map(|text| {
            let (x, y, z) = if arm == "nominal" { text.nominal_mm } else { text.identified_mm };
            Point3::new(x, y, z) * (scale * 1e-3)
        });
        assert_points(&vectors[0].1, expected, 1e-6, &entity);
        let origins = numbers(&path, &entity, "pose", "Arrows3D:origins");
        let at = last.points.iter().map(|text| Point3::new(text.at_mm.0, text.at_mm.1, text.at_mm.2) * 1e-3);
        assert_points(&origins.last().unwrap().1, at, SINGLE, &entity);
    }
    // The animation ends at the result.
    let steps = last.summary.iterations.len();
    let solved = numbers(&path, "/world/identified/enlarged", "solver_iteration", "Capsules3D:translations");
    assert_eq!(solved.len(), steps + 1);
    assert_eq!(usize::try_from(solved.last().unwrap().0).unwrap(), steps);
    assert_eq!(solved.last().unwrap().1.len(), 3 * profile.bodies().len());
}

/// Where the tracker is drawn at last, and its label.
pub(super) fn tracker(path: &Path) -> (Point3<f64>, String) {
    let of = |component: &str| {
        let mut rows = rows(path, false).into_iter();
        rows.find_map(|(entity, _, mut values)| (entity == "/world/tracker/body").then(|| values.remove(component))?)
            .unwrap()
    };
    let centre: Vec<f64> = of("Boxes3D:centers")
        .trim_matches(['[', ']'])
        .split(',')
        .map(|number| number.trim().parse().unwrap())
        .collect();
    (Point3::new(centre[0], centre[1], centre[2]), of("Boxes3D:labels"))
}

#[test]
fn the_tracker_is_drawn_as_planned_until_points_tell_where_it_stands() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let (_, session) = session_of(&place.session());
    let profile = session.mounted_profile().unwrap();
    let planned = profile.tracker().position_in_base;
    let truth = trupose::link::SimulatedCell::new(
        &profile,
        &trupose::session::simulation::Simulation { seed: 1, ..Default::default() },
    )
    .unwrap();
    let stands = Point3::from(truth.truth().base_from_tracker.translation.vector);
    assert!((stands - planned).norm() > 0.05, "the test needs one that stands elsewhere: {stands} {planned}");
    let beams = |from: &Point3<f64>, count: usize| {
        let beams = numbers(&place.recording(), "/world/tracker/beam", "pose", "LineStrips3D:strips");
        // Also that before the first measurement.
        assert_eq!(beams.len(), 1 + count);
        for (pose, beam) in beams {
            assert_points(&beam[..3], std::iter::once(*from), SINGLE, &format!("beam at {pose}"));
        }
    };
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker (as planned)]");
    assert_points(&[drawn.x, drawn.y, drawn.z], std::iter::once(planned), SINGLE, "planned");
    beams(&drawn, 3);
    // The fourth point tells; the nominal arm is off by centimetres.
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker]");
    assert!((drawn - stands).norm() < 0.1 && (drawn - planned).norm() > 0.02, "{drawn} instead of {stands}");
    beams(&drawn, 4);
    let rest = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    let (drawn, label) = tracker(&place.recording());
    assert_eq!(label, "[tracker]");
    // The identified arm locates it to a millimetre; it is not drawn again for less than 20 mm.
    assert!((drawn - stands).norm() < 0.021, "{drawn} instead of {stands}");
    let (_, session) = session_of(&place.session());
    beams(&drawn, session.samples.len());
    compare_with_rebuilt(&place);
    // Measurements and poses of the plan are counted apart: the name is at the point.
    let names: BTreeMap<i64, String> = rows(&place.recording(), false)
        .into_iter()
        .filter(|(entity, times, _)| entity == "/world/measured" && !times.is_empty())
        .map(|(_, times, values)| (times["pose"], values["Points3D:labels"].clone()))
        .collect();
    assert_eq!(names.len(), session.samples.len());
    for sample in &session.samples {
        let number = i64::try_from(sample.noted.number).unwrap();
        assert_eq!(names[&number], format!("[pose {}]", session.pose_of(sample)));
    }
}

/// What the journal says about results.
pub(super) trait Runs {
    fn runs_in(&self, journal: &Journal) -> usize;
}

impl Runs for Session {
    fn runs_in(&self, journal: &Journal) -> usize {
        journal.lines.iter().filter(|line| matches!(line.entry, Entry::Identified(_))).count()
    }
}

/// The recording of a session equals the one that is made from its journal, byte by byte.
pub(super) fn compare_with_rebuilt(place: &Place) {
    let recorded = data(&place.recording());
    succeeded(&place.run(&["record", "rebuild", "sessions/s"]));
    assert!(data(&place.recording()) == recorded);
}

#[test]
fn a_recording_shows_what_the_journal_says_and_is_rebuilt_the_same() {
    let place = recorded(&plain());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
    // Whoever may read the other results may read this one.
    fs::write(place.path("plain"), "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&place.recording()), mode(&place.path("plain")));
    assert_eq!(mode(&place.recording()), mode(&place.session().join("report.json")));
}

#[test]
fn what_was_measured_again_left_out_corrected_or_skipped_is_shown_as_it_is() {
    let place = recorded(&eventful());
    let (journal, session) = session_of(&place.session());
    assert_eq!(results(&journal).len(), 2);
    assert!(session.rows.iter().any(|row| row.skipped));
    compare_with_journal(&place.session());
    let unused = numbers(&place.recording(), "/world/plan/unused", "pose", "Points3D:positions");
    let out = session.samples.iter().filter(|sample| {
        use trupose::session::state::SampleState;
        matches!(sample.state, SampleState::LeftOut | SampleState::Undone)
    });
    let skipped = session.rows.iter().filter(|row| row.skipped).count();
    assert_eq!(unused.last().unwrap().1.len(), 3 * (out.count() + skipped));
    compare_with_rebuilt(&place);
}

#[test]
fn an_arm_with_a_sliding_and_a_coupled_joint_is_drawn_as_it_stands() {
    let place = recorded(&sliding());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
}

#[test]
fn a_recording_carries_one_layout_that_opens_on_the_poses() {
    let place = recorded(&plain());
    let activations: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::BlueprintActivationCommand(command) => Some(command.blueprint_id),
            _ => None,
        })
        .collect();
    assert_eq!(activations.len(), 1);
    let stores: Vec<_> = messages(&place.recording())
        .into_iter()
        .filter_map(|message| match message {
            LogMsg::SetStoreInfo(info) if info.info.store_id.is_blueprint() => Some(info.info.store_id),
            _ => None,
        })
        .collect();
    assert_eq!(stores, activations);
    assert_eq!(opens_on(&place.recording()), "[pose]");
    let errors = "[Position error, identified arm (mm)]".to_owned();
    assert!(views(&place.recording()).contains(&errors));
    // While there is no result there is no room for it.
    let place = recorded(&format!("{} Capture(2, Fail)", begun("")));
    let shown = views(&place.recording());
    assert!(!shown.contains(&errors) && !shown.contains(TEMPERATURES), "{shown:?}");
}

/// The plot that is there where temperatures were measured.
pub(super) const TEMPERATURES: &str = "[Temperature (degC)]";

/// Names of what a viewer shows.
pub(super) fn views(path: &Path) -> BTreeSet<String> {
    let layout = rows(path, true).into_iter();
    layout.filter_map(|(_, _, values)| values.get("ViewBlueprint:display_name").cloned()).collect()
}

/// The timeline that a viewer shows first.
pub(super) fn opens_on(path: &Path) -> String {
    let layout = rows(path, true);
    let panel = layout.iter().find(|(_, _, values)| values.contains_key("TimePanelBlueprint:timeline")).unwrap();
    panel.2["TimePanelBlueprint:timeline"].clone()
}
