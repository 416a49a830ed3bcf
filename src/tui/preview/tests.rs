use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::profile::{Profile, builtin};
use crate::session::state::Session;
use crate::tui::glyphs::Glyphs;

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

/// A configuration in which a robot looks like one (deg).
fn scene(name: &str, q_deg: &[f64]) -> Scene {
    let q: Vec<f64> = q_deg.iter().map(|angle| angle * DEGREE).collect();
    Scene::of(&profile(name), &q)
}

fn soochow() -> Scene {
    scene("soochow", &[10.0, 15.0, -10.0, 20.0, 35.0, 0.0])
}

fn with_everything() -> Scene {
    let mut scene = soochow();
    let kinds = [MarkKind::Open, MarkKind::Done, MarkKind::Next, MarkKind::Doubt];
    for (index, kind) in kinds.into_iter().cycle().take(24).enumerate() {
        let (sin, cos) = (index as f64).sin_cos();
        let at = Point3::new(0.9 + 0.4 * cos, 0.8 * sin, 0.5 + 0.04 * index as f64);
        scene.marks.push(Mark { at, kind });
        scene.errors.push(ErrorVector { at, error: Vector3::new(0.0, 0.0, 0.001) });
    }
    scene.exaggeration = 200.0;
    let robot = profile("soochow");
    scene.with_identified(&robot, robot.chain(), &[0.1, 0.3, -0.2, 0.3, 0.6, 0.0])
}

fn drawn(scene: &Scene, camera: &Camera, glyphs: Glyphs, width: u16, height: u16) -> Buffer {
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    let theme = Theme { has_colour: true, glyphs };
    Preview { scene, camera, theme }.render(buffer.area, &mut buffer);
    buffer
}

#[test]
fn the_paper_robot_at_80x24() {
    let camera = Camera::default();
    insta::assert_snapshot!("soochow", paint::snapshot(&drawn(&soochow(), &camera, Glyphs::Unicode, 80, 24)));
    insta::assert_snapshot!("soochow_small", paint::snapshot(&drawn(&soochow(), &camera, Glyphs::Unicode, 40, 15)));
    insta::assert_snapshot!("soochow_ascii", paint::snapshot(&drawn(&soochow(), &camera, Glyphs::Ascii, 80, 24)));
    insta::assert_snapshot!("soochow_blocks", paint::snapshot(&drawn(&soochow(), &camera, Glyphs::Blocks, 80, 24)));
}

#[test]
fn the_tracker_of_a_session_stands_where_its_readings_say() {
    let text = include_bytes!("../../../sessions/example/journal.ron");
    let mut journal = crate::session::journal::read(text).unwrap();
    let session = Session::of(&journal).unwrap();
    let scene = Scene::of_identified(&session, false).unwrap();
    let tracker = scene.tracker.unwrap();
    assert_eq!(Some(tracker), Scene::of_session(&session, None).unwrap().tracker);
    assert_eq!(scene.beam.unwrap().from, tracker);
    let planned = session.robot.as_ref().unwrap().profile.tracker().position_in_base;
    assert!((planned - tracker).norm() > 0.02, "the test needs one that stands elsewhere: {tracker}");
    // A tracker measures how far away a point is; the scene places it with the nominal arm, which is off by up to 25 mm.
    let result = session.identified.as_deref().unwrap();
    assert!(result.samples.len() > 20);
    for (number, point) in result.samples.iter().zip(&result.points).filter(|(_, point)| !point.rejected) {
        let (x, y, z) = point.at_mm;
        let away = (Point3::new(x, y, z) * 1e-3 - tracker).norm();
        let measured = session.point_of(session.sample(*number).unwrap()).coords.norm();
        assert!((away - measured).abs() < 0.03, "sample {number}: {away} m instead of {measured} m");
    }
    // Before four points are measured it stands as planned.
    let is_sample =
        |line: &&crate::session::journal::Line| matches!(line.entry, crate::session::journal::Entry::Sample(_));
    let fourth = journal.lines.iter().filter(is_sample).nth(3).unwrap().number;
    journal.lines.retain(|line| line.number < fourth);
    let scene = Scene::of_session(&Session::of(&journal).unwrap(), None).unwrap();
    assert_eq!(scene.tracker, Some(planned));
}

#[test]
fn a_collaborative_robot_at_80x24() {
    let scene = scene("ur10e", &[20.0, -70.0, 100.0, -30.0, -60.0, 0.0]);
    insta::assert_snapshot!("ur10e", paint::snapshot(&drawn(&scene, &Camera::default(), Glyphs::Unicode, 80, 24)));
}

#[test]
fn everything_at_120x40() {
    let mut camera = Camera::default();
    camera.framing = Framing::All;
    let buffer = drawn(&with_everything(), &camera, Glyphs::Unicode, 120, 40);
    insta::assert_snapshot!("everything", paint::snapshot(&buffer));
}

#[test]
fn every_shipped_robot_is_drawn() {
    for name in crate::profile::builtin_names() {
        let scene = Scene::at_rest(&profile(name));
        let buffer = drawn(&scene, &Camera::default(), Glyphs::Ascii, 80, 24);
        let inked = buffer.content.iter().filter(|cell| cell.symbol() != " ").count();
        assert!(inked > 150, "{name}: {inked}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn nothing_is_drawn_outside_whatever_the_size_and_view(
        x in 0_u16..30, y in 0_u16..30, width in 0_u16..80, height in 0_u16..50,
        keys in prop::collection::vec(0_usize..KEYS.len(), 0..30), ascii: bool,
    ) {
        let mut camera = Camera::default();
        for key in keys {
            prop_assert!(camera.on_key(KEYS[key].0));
        }
        let mut buffer = Buffer::empty(Rect::new(0, 0, 70, 40));
        for cell in &mut buffer.content {
            cell.set_char('~');
        }
        let area = Rect::new(x, y, width, height);
        let glyphs = if ascii { Glyphs::Ascii } else { Glyphs::Unicode };
        let scene = with_everything();
        Preview { scene: &scene, camera: &camera, theme: Theme { has_colour: true, glyphs } }.render(area, &mut buffer);
        for row in 0..40 {
            for column in 0..70 {
                let is_inside = area.contains((column, row).into());
                prop_assert!(is_inside || buffer[(column, row)].symbol() == "~", "{column} {row}");
            }
        }
    }
}
