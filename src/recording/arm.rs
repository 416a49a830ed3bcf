//! The shape of an arm at a configuration.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use rerun::{Capsules3D, Color, FillMode};

use super::style;
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::profile::{JointRange, Profile};

/// Radius of the reflector, somewhat larger than life so that it is seen (m).
const REFLECTOR: f64 = 0.025;
/// Radius of the rod that holds the reflector (m).
const ROD: f64 = 0.009;
/// Radius of the links of an arm whose castings are not known, as a fraction of its reach.
const LINK: f64 = 0.03;

/// An arm at a configuration: its frames and the points that a line through it visits, the reflector last.
pub(super) struct Posture {
    pub(super) frames: Vec<Isometry3<f64>>,
    line: Vec<Point3<f64>>,
    pub(super) reflector: Point3<f64>,
}

impl Posture {
    /// Computes the posture at the pendant values `q` ((rad) or (m)); missing ones are zero.
    pub(super) fn new(chain: &KinematicChain, target: &Point3<f64>, q: &[f64]) -> Self {
        let mut q = q.to_vec();
        q.resize(chain.dof(), 0.0);
        let forward = ForwardKinematics::new(chain);
        let frames = forward.base_from_links(&q);
        let reflector = forward.point_in_base(&q, target);
        let mut line = vec![Point3::origin()];
        line.extend(frames.iter().map(|frame| Point3::from(frame.translation.vector)));
        line.dedup_by(|one, other| (*one - *other).norm() < 1e-6);
        Self { frames, line, reflector }
    }

    /// Computes the posture of the nominal arm of `profile` with its first target.
    pub(super) fn nominal(profile: &Profile, q: &[f64]) -> Self {
        let target = profile.targets().first().map_or_else(Point3::origin, |target| target.position_in_flange);
        Self::new(profile.chain(), &target, q)
    }
}

/// A capsule in the base: the line between two points, and its radius (m).
struct Solid {
    from: Point3<f64>,
    to: Point3<f64>,
    radius: f64,
}

/// Returns the castings of the arm, the rod and the reflector.
fn solids(profile: &Profile, posture: &Posture) -> Vec<Solid> {
    let frame = |index: usize| posture.frames.get(index).copied().unwrap_or_else(Isometry3::identity);
    let mut solids: Vec<Solid> = if profile.bodies().is_empty() {
        let radius = LINK * reach(profile);
        posture.line.windows(2).map(|ends| Solid { from: ends[0], to: ends[1], radius }).collect()
    } else {
        let placed = |body: &crate::profile::Capsule| {
            let frame = frame(body.link);
            Solid { from: frame * body.from, to: frame * body.to, radius: body.radius }
        };
        profile.bodies().iter().map(placed).collect()
    };
    let flange = posture.frames.last().map_or_else(Point3::origin, |frame| Point3::from(frame.translation.vector));
    solids.push(Solid { from: flange, to: posture.reflector, radius: ROD });
    solids.push(Solid { from: posture.reflector, to: posture.reflector, radius: REFLECTOR });
    solids
}

/// Returns the looks of an arm, which never change. Neighbouring castings differ in brightness.
pub(super) fn looks(profile: &Profile, color: Color) -> Capsules3D {
    let solids = solids(profile, &Posture::nominal(profile, &rest(profile)));
    let count = solids.len();
    let colors = (0..count).map(|index| match count - index {
        1 => style::DONE,
        2 => style::CELL,
        _ if index % 2 == 0 => style::shade(color, 0.62),
        _ => style::shade(color, 0.85),
    });
    Capsules3D::update_fields()
        .with_lengths(lengths(&solids))
        .with_radii(solids.iter().map(|solid| style::single(solid.radius)))
        .with_colors(colors)
        .with_fill_mode(FillMode::Solid)
}

/// Returns an arm at a posture. Its castings are one entity, placed in the base, which takes a third of the bytes that a frame for
/// each would.
pub(super) fn placed(profile: &Profile, posture: &Posture) -> Capsules3D {
    let solids = solids(profile, posture);
    let capsules = Capsules3D::update_fields()
        .with_translations(solids.iter().map(|solid| style::at(&solid.from)))
        .with_quaternions(solids.iter().map(|solid| style::quaternion(&upright_onto(&(solid.to - solid.from)))));
    // Only the links of an arm without castings change their lengths, where a joint slides.
    if profile.bodies().is_empty() { capsules.with_lengths(lengths(&solids)) } else { capsules }
}

fn lengths(solids: &[Solid]) -> Vec<f32> {
    solids.iter().map(|solid| style::single((solid.to - solid.from).norm())).collect()
}

/// Returns the rotation from +z onto a direction.
fn upright_onto(line: &Vector3<f64>) -> UnitQuaternion<f64> {
    if line.norm() < 1e-9 {
        return UnitQuaternion::identity();
    }
    let half_turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turned = Rotation3::rotation_between(&Vector3::z(), line).unwrap_or(half_turn);
    UnitQuaternion::from_rotation_matrix(&turned)
}

/// Returns the length of the stretched arm (m), the unit of sizes in the picture.
pub(super) fn reach(profile: &Profile) -> f64 {
    profile.chain().length().max(0.1)
}

/// Returns the middle of each joint's range ((rad) or (m)).
pub(super) fn rest(profile: &Profile) -> Vec<f64> {
    let middle =
        |range: &JointRange| range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high));
    profile.joints().iter().map(middle).collect()
}

/// Returns the values at a `part` of the way from one configuration to another.
pub(super) fn between(from: &[f64], to: &[f64], part: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + (to - from) * part).collect()
}
