//! The cell: floor, base, boxes to keep out of, and looks that never change.

use nalgebra::{Point3, Vector3};
use rerun::{AsComponents, Boxes3D, Color, FillMode, LineStrips3D, Points3D, ViewCoordinates};

use crate::profile::Profile;
use crate::recording::arm::{looks, reach};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::latin::plain;
use crate::recording::{names, style};

/// Distance between the lines of the floor (m).
const FLOOR_STEP: f64 = 0.25;

/// Draws the cell of `profile`. What moves gets its looks at the `beginning`.
pub(super) fn draw(canvas: &mut Canvas, profile: &Profile, beginning: Moment) {
    canvas.draw_static(names::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP());
    canvas.draw_static(names::CELL, &[&floor(profile) as &dyn AsComponents, &boxes(profile)]);
    let points = |size: f32, color: Option<Color>| {
        // The names of dozens of points would cover the picture. The viewer shows the one that is pointed at.
        let points = Points3D::update_fields().with_radii([style::points(size)]).with_show_labels(false);
        color.map_or_else(|| points.clone(), |color| points.clone().with_colors([color]))
    };
    canvas.draw_static(names::PLAN, &points(1.8, None));
    canvas.draw_static(names::MEASURED, &points(1.8, None));
    canvas.draw(beginning, names::NEXT, &points(6.0, Some(style::ATTENTION)));
    canvas.draw(beginning, names::UNUSED, &points(4.0, Some(style::OUT)));
    canvas.draw_static(
        names::PATH,
        &LineStrips3D::update_fields().with_radii([style::points(0.6)]).with_colors([style::LEFT]),
    );
}

/// Draws the looks of an arm and its beam.
pub(super) fn arm(canvas: &mut Canvas, profile: &Profile, path: &str, color: Color, beginning: Moment) {
    let beam = LineStrips3D::update_fields().with_radii([style::points(1.2)]).with_colors([style::TRACKER]);
    canvas.draw(beginning, path, &[&looks(profile, color) as &dyn AsComponents, &beam]);
}

fn floor(profile: &Profile) -> LineStrips3D {
    let height = profile.floor().unwrap_or(0.0);
    let lines = (1.4 * reach(profile) / FLOOR_STEP).ceil();
    let side = lines * FLOOR_STEP;
    let mut strips = Vec::new();
    let mut at = -side;
    while at <= side + FLOOR_STEP / 2.0 {
        strips.push([style::at(&Point3::new(at, -side, height)), style::at(&Point3::new(at, side, height))]);
        strips.push([style::at(&Point3::new(-side, at, height)), style::at(&Point3::new(side, at, height))]);
        at += FLOOR_STEP;
    }
    LineStrips3D::new(strips).with_radii([style::points(0.4)]).with_colors([style::GRID])
}

/// Returns the base, a pedestal if the robot is above the floor and a plate otherwise, and the boxes to keep out of.
fn boxes(profile: &Profile) -> Boxes3D {
    let height = profile.floor().unwrap_or(0.0);
    let plate = 0.09 * reach(profile);
    let top = height.max(-0.001);
    let (low, high) = if height < -0.02 { (height, 0.0) } else { (top - 0.02, top) };
    let base = (Point3::new(-plate, -plate, low), Point3::new(plate, plate, high), String::new());
    let kept_out = profile.keep_out().iter().map(|one| (one.min, one.max, plain(&one.name)));
    let all: Vec<_> = std::iter::once(base).chain(kept_out).collect();
    let halves = all.iter().map(|(min, max, _)| (max - min) / 2.0).map(|half: Vector3<f64>| style::vector(&half));
    let centres = all.iter().map(|(min, max, _)| style::at(&nalgebra::center(min, max)));
    let boxes = Boxes3D::from_centers_and_half_sizes(centres, halves)
        .with_colors(all.iter().map(|(.., name)| if name.is_empty() { style::CELL } else { style::OUT }))
        .with_radii([style::points(1.0)]);
    // Solid boxes to keep out of would hide the arm.
    if all.len() > 1 {
        boxes.with_labels(all.iter().map(|(.., name)| name.as_str()))
    } else {
        boxes.with_fill_mode(FillMode::Solid)
    }
}
