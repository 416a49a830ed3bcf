//! The cell: floor, base, boxes to keep out of, and the arm at a pose.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use rerun::{
    Arrows3D, AsComponents, Boxes3D, Capsules3D, Color, CoordinateFrame, FillMode, LineStrips3D, Points3D, Radius,
    ViewCoordinates,
};

use super::tracker::Station;
use crate::kinematics::Convention;
use crate::profile::{Capsule, Profile};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::latin::plain;
use crate::recording::posture::{Posture, reach, rest};
use crate::recording::{names, style};

/// Distance between the lines of the floor (m).
const FLOOR_STEP: f64 = 0.5;

/// Draws the cell of `profile` and its arm in the middle of its ranges.
pub(super) fn draw(canvas: &mut Canvas, profile: &Profile, station: &Station) {
    canvas.draw_static(names::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP());
    floor(canvas, profile);
    station.draw(canvas, profile);
    keep_out(canvas, profile);
    styles(canvas, profile);
    arm(canvas, profile);
    pose(canvas, profile, station, &rest(profile), Moment::pose(0));
    // The timelines of the computations show the arm too.
    pose(canvas, profile, station, &rest(profile), Moment::search(0));
}

/// Draws radii and colours that never change once for all rows, which are smaller without them.
fn styles(canvas: &mut Canvas, profile: &Profile) {
    let beam = LineStrips3D::update_fields().with_radii([Radius::new_ui_points(1.0)]).with_colors([style::TRACKER]);
    canvas.draw_static(names::BEAM, &beam);
    let points =
        |size: f32, color| Points3D::update_fields().with_radii([Radius::new_ui_points(size)]).with_colors([color]);
    // The names of dozens of points would cover the picture. The viewer shows the one that is pointed at.
    let measured = Points3D::update_fields().with_radii([Radius::new_ui_points(4.0)]).with_show_labels(false);
    canvas.draw_static(names::MEASURED, &measured);
    canvas.draw_static(names::NEXT, &points(7.0, style::ATTENTION));
    canvas.draw_static(names::UNUSED, &points(5.0, style::OUT));
    if profile.bodies().is_empty() {
        canvas.draw_static(names::NOMINAL_SKELETON, &skeleton_style(profile, style::NOMINAL));
    }
}

/// Returns the radius and colour of the line through the joints of an arm without castings.
pub(super) fn skeleton_style(profile: &Profile, color: Color) -> LineStrips3D {
    let radius = style::single(0.02 * reach(profile));
    LineStrips3D::update_fields().with_radii([radius]).with_colors([color])
}

/// Returns the line through the joints of an arm without castings.
pub(super) fn skeleton(posture: &Posture) -> LineStrips3D {
    LineStrips3D::update_fields().with_strips([posture.line.iter().map(style::at).collect::<Vec<_>>()])
}

/// Draws the nominal arm at the pendant configuration `q` ((rad) or (m)), with the beam to its reflector.
pub(super) fn pose(canvas: &mut Canvas, profile: &Profile, station: &Station, q: &[f64], moment: Moment) {
    let posture = Posture::nominal(profile, q);
    for (index, frame) in posture.frames.iter().enumerate() {
        canvas.draw(moment, names::NOMINAL_FRAMES, &style::frame(frame, &names::frame("nominal", index)));
    }
    // The timeline of clock times shows only the arm and the points, to keep files small.
    let lines = Moment { time: None, ..moment };
    if profile.bodies().is_empty() {
        canvas.draw(lines, names::NOMINAL_SKELETON, &skeleton(&posture));
    }
    station.beam(canvas, profile, &posture, lines);
}

fn floor(canvas: &mut Canvas, profile: &Profile) {
    let height = profile.floor().unwrap_or(0.0);
    let tracker = profile.tracker().position_in_base;
    let side = (1.3 * reach(profile)).max(tracker.x.abs().max(tracker.y.abs()) + FLOOR_STEP);
    let lines = (side / FLOOR_STEP).ceil();
    let side = lines * FLOOR_STEP;
    let mut strips = Vec::new();
    let mut at = -side;
    while at <= side + FLOOR_STEP / 2.0 {
        strips.push([style::at(&Point3::new(at, -side, height)), style::at(&Point3::new(at, side, height))]);
        strips.push([style::at(&Point3::new(-side, at, height)), style::at(&Point3::new(side, at, height))]);
        at += FLOOR_STEP;
    }
    let grid = LineStrips3D::new(strips).with_radii([Radius::new_ui_points(0.5)]).with_colors([style::CELL]);
    canvas.draw_static(names::FLOOR, &grid);
    // A pedestal if the robot is above the floor, otherwise a plate.
    let plate = 0.09 * reach(profile);
    let top = height.max(-0.001);
    let (low, high) = if height < -0.02 { (height, 0.0) } else { (top - 0.02, top) };
    let base = Boxes3D::from_centers_and_half_sizes(
        [style::at(&Point3::new(0.0, 0.0, f64::midpoint(low, high)))],
        [style::vector(&Vector3::new(plate, plate, (high - low) / 2.0))],
    )
    .with_colors([style::CELL])
    .with_fill_mode(FillMode::Solid);
    canvas.draw_static(names::BASE, &base);
}

fn keep_out(canvas: &mut Canvas, profile: &Profile) {
    let boxes = profile.keep_out();
    if boxes.is_empty() {
        return;
    }
    let centres = boxes.iter().map(|one| style::at(&nalgebra::center(&one.min, &one.max)));
    let halves = boxes.iter().map(|one| style::vector(&((one.max - one.min) / 2.0)));
    let names: Vec<String> = boxes.iter().map(|one| plain(&one.name)).collect();
    let drawn = Boxes3D::from_centers_and_half_sizes(centres, halves)
        .with_colors([style::OUT])
        .with_radii([Radius::new_ui_points(1.5)])
        .with_labels(names);
    canvas.draw_static(names::KEEP_OUT, &drawn);
}

/// Draws castings and joint axes of the nominal arm, attached to its frames: one entity per frame.
fn arm(canvas: &mut Canvas, profile: &Profile) {
    // A joint turns about or slides along the z axis of the frame before it, or of its own.
    let before = usize::from(profile.chain().convention() == Convention::Modified);
    let half = 0.13 * reach(profile);
    for frame in 0..=profile.chain().dof() + 1 {
        let name = CoordinateFrame::new(names::frame("nominal", frame));
        let bodies: Vec<&Capsule> = profile.bodies().iter().filter(|body| body.link == frame).collect();
        let castings = capsules(&bodies, style::NOMINAL)
            .with_translations(bodies.iter().map(|body| style::at(&body.from)))
            .with_quaternions(bodies.iter().map(|body| style::quaternion(&along(body).1)))
            .with_fill_mode(FillMode::Solid);
        let joint = frame.checked_sub(before).and_then(|index| profile.chain().joints().get(index));
        let axis = joint.map(|joint| {
            Arrows3D::from_vectors([style::vector(&Vector3::new(0.0, 0.0, 2.0 * half))])
                .with_origins([style::vector(&Vector3::new(0.0, 0.0, -half))])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_colors([style::AXIS])
                .with_labels([plain(&joint.name)])
        });
        let mut parts: Vec<&dyn AsComponents> = vec![&name];
        if !bodies.is_empty() {
            parts.push(&castings);
        }
        if let Some(axis) = &axis {
            parts.push(axis);
        }
        if parts.len() > 1 {
            canvas.draw_static(&format!("{}/{frame}", names::NOMINAL_LINKS), &parts);
        }
    }
}

/// Returns castings with their sizes and colour.
fn capsules(bodies: &[&Capsule], color: Color) -> Capsules3D {
    Capsules3D::from_lengths_and_radii(
        bodies.iter().map(|body| style::single(along(body).0)),
        bodies.iter().map(|body| style::single(body.radius)),
    )
    .with_colors([color])
}

/// Draws the looks of the identified arm with its enlarged deviations: glassy, so that the nominal arm is visible inside.
pub(super) fn enlarged_style(canvas: &mut Canvas, profile: &Profile) {
    if profile.bodies().is_empty() {
        canvas.draw_static(names::ENLARGED, &skeleton_style(profile, style::IDENTIFIED));
    } else {
        let bodies: Vec<&Capsule> = profile.bodies().iter().collect();
        let castings = capsules(&bodies, style::IDENTIFIED).with_fill_mode(FillMode::TransparentFillMajorWireframe);
        canvas.draw_static(names::ENLARGED, &castings);
    }
}

/// Draws the identified arm with its enlarged deviations at a pose. All castings are one entity, placed in the base, which takes a
/// third of the bytes that frames would.
pub(super) fn enlarged(canvas: &mut Canvas, profile: &Profile, posture: &Posture, moment: Moment) {
    if profile.bodies().is_empty() {
        canvas.draw(moment, names::ENLARGED, &skeleton(posture));
        return;
    }
    let placed: Vec<Isometry3<f64>> = profile
        .bodies()
        .iter()
        .map(|body| {
            let frame = posture.frames.get(body.link).copied().unwrap_or_else(Isometry3::identity);
            frame * Isometry3::from_parts(body.from.coords.into(), along(body).1)
        })
        .collect();
    let castings = Capsules3D::update_fields()
        .with_translations(placed.iter().map(|place| style::vector(&place.translation.vector)))
        .with_quaternions(placed.iter().map(|place| style::quaternion(&place.rotation)));
    canvas.draw(moment, names::ENLARGED, &castings);
}

/// Returns the length of the line of a capsule (m), and the rotation from +z onto it.
fn along(body: &Capsule) -> (f64, UnitQuaternion<f64>) {
    let line = body.to - body.from;
    let length = line.norm();
    let turned = if length > 1e-9 {
        let half_turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Rotation3::rotation_between(&Vector3::z(), &line).unwrap_or(half_turn)
    } else {
        Rotation3::identity()
    };
    (length, UnitQuaternion::from_rotation_matrix(&turned))
}
