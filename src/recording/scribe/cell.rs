//! What does not move: floor, base, tracker, boxes, and the castings and axes that move with the frames of the arm.

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};
use rerun::{
    Arrows3D, AsComponents, Boxes3D, Capsules3D, CoordinateFrame, FillMode, LineStrips3D, Radius, ViewCoordinates,
};

use super::{Posture, reach};
use crate::kinematics::Convention;
use crate::profile::{Capsule, Profile};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::{layout, names};

/// Size of the tracker (m).
const TRACKER_SIZE: [f32; 3] = [0.11, 0.11, 0.16];
/// Lines of the floor are this far apart (m).
const FLOOR_STEP: f64 = 0.5;

/// Draws the cell of `profile` and its arm in the middle of its ranges.
pub(super) fn draw(canvas: &Canvas, profile: &Profile) {
    canvas.fix(names::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP());
    floor(canvas, profile);
    tracker(canvas, profile);
    keep_out(canvas, profile);
    arm(canvas, profile);
    pose(canvas, profile, &rest(profile), Moment { pose: Some(0), ..Moment::default() });
    // The timelines of the computations show the arm too.
    pose(canvas, profile, &rest(profile), Moment::search(0));
}

/// The middle of each range ((rad) or (m)).
pub(super) fn rest(profile: &Profile) -> Vec<f64> {
    let middle = |range: &crate::profile::JointRange| {
        range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high))
    };
    profile.joints().iter().map(middle).collect()
}

/// The nominal arm at the pendant configuration `q` ((rad) or (m)), with the beam to its reflector.
pub(super) fn pose(canvas: &Canvas, profile: &Profile, q: &[f64], moment: Moment) {
    let posture = Posture::nominal(profile, q);
    for (index, frame) in posture.frames.iter().enumerate() {
        canvas.draw(moment, names::NOMINAL_FRAMES, &layout::frame(frame, &names::frame("nominal", index)));
    }
    if profile.bodies().is_empty() {
        let radius = layout::single(0.02 * reach(profile));
        let line = LineStrips3D::new([posture.line.iter().map(layout::at).collect::<Vec<_>>()])
            .with_radii([radius])
            .with_colors([layout::NOMINAL]);
        canvas.draw(moment, names::NOMINAL_SKELETON, &line);
    }
    let beam = [layout::at(&profile.tracker().position_in_base), layout::at(&posture.reflector)];
    let beam = LineStrips3D::new([beam]).with_radii([Radius::new_ui_points(1.0)]).with_colors([layout::TRACKER]);
    canvas.draw(moment, names::BEAM, &beam);
}

fn floor(canvas: &Canvas, profile: &Profile) {
    let height = profile.floor().unwrap_or(0.0);
    let tracker = profile.tracker().position_in_base;
    let side = (1.3 * reach(profile)).max(tracker.x.abs().max(tracker.y.abs()) + FLOOR_STEP);
    let lines = (side / FLOOR_STEP).ceil();
    let side = lines * FLOOR_STEP;
    let mut strips = Vec::new();
    let mut at = -side;
    while at <= side + FLOOR_STEP / 2.0 {
        strips.push([layout::at(&Point3::new(at, -side, height)), layout::at(&Point3::new(at, side, height))]);
        strips.push([layout::at(&Point3::new(-side, at, height)), layout::at(&Point3::new(side, at, height))]);
        at += FLOOR_STEP;
    }
    let grid = LineStrips3D::new(strips).with_radii([Radius::new_ui_points(0.5)]).with_colors([layout::CELL]);
    canvas.fix(names::FLOOR, &grid);
    // A pedestal where the robot stands above the floor, a plate where it does not.
    let plate = 0.09 * reach(profile);
    let top = height.max(-0.001);
    let (low, high) = if height < -0.02 { (height, 0.0) } else { (top - 0.02, top) };
    let base = Boxes3D::from_centers_and_half_sizes(
        [layout::at(&Point3::new(0.0, 0.0, f64::midpoint(low, high)))],
        [layout::vector(&Vector3::new(plate, plate, (high - low) / 2.0))],
    )
    .with_colors([layout::CELL])
    .with_fill_mode(FillMode::Solid);
    canvas.fix(names::BASE, &base);
}

fn tracker(canvas: &Canvas, profile: &Profile) {
    let tracker =
        Boxes3D::from_centers_and_half_sizes([layout::at(&profile.tracker().position_in_base)], [TRACKER_SIZE])
            .with_colors([layout::TRACKER])
            .with_fill_mode(FillMode::Solid)
            .with_labels(["laser tracker (roughly)"]);
    canvas.fix(names::TRACKER, &tracker);
}

fn keep_out(canvas: &Canvas, profile: &Profile) {
    let boxes = profile.keep_out();
    if boxes.is_empty() {
        return;
    }
    let centres = boxes.iter().map(|one| layout::at(&nalgebra::center(&one.min, &one.max)));
    let halves = boxes.iter().map(|one| layout::vector(&((one.max - one.min) / 2.0)));
    let names: Vec<String> = boxes.iter().map(|one| crate::recording::read::plain(&one.name)).collect();
    let drawn = Boxes3D::from_centers_and_half_sizes(centres, halves)
        .with_colors([layout::OUT])
        .with_radii([Radius::new_ui_points(1.5)])
        .with_labels(names);
    canvas.fix(names::KEEP_OUT, &drawn);
}

/// Castings and joint axes, fixed to the frames: one entity per frame.
fn arm(canvas: &Canvas, profile: &Profile) {
    // A joint turns about or slides along the z axis of the frame before it, or of its own.
    let before = usize::from(profile.chain().convention() == Convention::Modified);
    let half = 0.13 * reach(profile);
    for frame in 0..=profile.chain().dof() + 1 {
        let name = CoordinateFrame::new(names::frame("nominal", frame));
        let bodies: Vec<(&Capsule, (f64, UnitQuaternion<f64>))> =
            profile.bodies().iter().filter(|body| body.link == frame).map(|body| (body, along(body))).collect();
        let castings = Capsules3D::from_lengths_and_radii(
            bodies.iter().map(|(_, (length, _))| layout::single(*length)),
            bodies.iter().map(|(body, _)| layout::single(body.radius)),
        )
        .with_translations(bodies.iter().map(|(body, _)| layout::at(&body.from)))
        .with_quaternions(bodies.iter().map(|(_, (_, turned))| layout::quaternion(turned)))
        .with_colors([layout::NOMINAL])
        .with_fill_mode(FillMode::Solid);
        let joint = frame.checked_sub(before).and_then(|index| profile.chain().joints().get(index));
        let axis = joint.map(|joint| {
            Arrows3D::from_vectors([layout::vector(&Vector3::new(0.0, 0.0, 2.0 * half))])
                .with_origins([layout::vector(&Vector3::new(0.0, 0.0, -half))])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_colors([layout::AXIS])
                .with_labels([crate::recording::read::plain(&joint.name)])
                .with_show_labels(true)
        });
        let mut parts: Vec<&dyn AsComponents> = vec![&name];
        if !bodies.is_empty() {
            parts.push(&castings);
        }
        if let Some(axis) = &axis {
            parts.push(axis);
        }
        if parts.len() > 1 {
            canvas.fix(&format!("{}/{frame}", names::NOMINAL_LINKS), &parts);
        }
    }
}

/// Length of the line of a capsule (m), and the rotation from +z onto it.
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
