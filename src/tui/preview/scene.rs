//! What is in the picture, in the robot base (m). Plain data: no camera, no dots.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::geometry::enlargement;
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::profile::{KeepOut, Profile};
use crate::session::journal::from_xyz_mm;
use crate::session::plan::PoseKind;
use crate::session::state::Session;
use crate::session::station;
use crate::units::from_mm;

/// Thickness of an arm whose profile has no bodies, as a part of its length.
const SLENDER: f64 = 0.035;
/// Thickness of an arm that is compared with another, as a part of its reach.
const THIN: f64 = 0.008;
/// Size of a base without bodies, as a part of the arm's length.
const BASE: f64 = 0.09;

/// Longest error or difference as a part of the arm's reach.
const LONGEST_ERROR: f64 = 0.15;

/// The middle of each range (rad) or (m).
fn rest(profile: &Profile) -> Vec<f64> {
    let middle = |range: &crate::profile::JointRange| {
        range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high))
    };
    profile.joints().iter().map(middle).collect()
}

/// How an arm is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Solid: the nominal arm.
    Solid,
    /// Dashed lines through the joints: the identified arm.
    Dashed,
}

/// A line with a thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// One end.
    pub from: Point3<f64>,
    /// The other end.
    pub to: Point3<f64>,
    /// Distance to the surface.
    pub radius: f64,
}

/// An arm at a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// How it is drawn.
    pub look: Look,
    /// Castings, from the base to the flange.
    pub bodies: Vec<Body>,
    /// Origins of the link frames, from the base to the flange.
    pub joints: Vec<Point3<f64>>,
    /// Centre of the reflector.
    pub reflector: Option<Point3<f64>>,
}

impl Arm {
    /// The arm of `profile` with the link constants of `chain` at the pendant configuration `q` ((rad) or (m)) with the
    /// target of number `target`.
    pub fn new(profile: &Profile, chain: &KinematicChain, q: &[f64], target: usize, look: Look) -> Self {
        let mut q = q.to_vec();
        q.resize(chain.dof(), 0.0);
        let forward = ForwardKinematics::new(chain);
        let frames = forward.base_from_links(&q);
        let joints: Vec<Point3<f64>> = frames.iter().map(|frame| Point3::from(frame.translation.vector)).collect();
        let bodies = if profile.bodies().is_empty() { slender(&joints) } else { castings(profile, &frames) };
        let reflector =
            profile.targets().get(target).map(|target| forward.point_in_base(&q, &target.position_in_flange));
        Self { look, bodies, joints, reflector }
    }
}

/// The bodies of a profile where they are.
fn castings(profile: &Profile, frames: &[Isometry3<f64>]) -> Vec<Body> {
    let place = |body: &crate::profile::Capsule| {
        let frame = frames.get(body.link)?;
        Some(Body { from: frame * body.from, to: frame * body.to, radius: body.radius })
    };
    profile.bodies().iter().filter_map(place).collect()
}

/// Thin bodies along the joints.
fn thin(joints: &[Point3<f64>]) -> Vec<Body> {
    let reach = joints.last().map_or(1.0, |last| last.coords.norm());
    let from = std::iter::once(&Point3::origin()).chain(joints).copied().collect::<Vec<_>>();
    from.into_iter().zip(joints).map(|(from, to)| Body { from, to: *to, radius: THIN * reach }).collect()
}

/// Bodies along the joints of an arm that has none.
fn slender(joints: &[Point3<f64>]) -> Vec<Body> {
    let links =
        || std::iter::once(&Point3::origin()).chain(joints).copied().zip(joints.iter().copied()).collect::<Vec<_>>();
    let length: f64 = links().iter().map(|(from, to)| (to - from).norm()).sum();
    let base = Body { from: Point3::origin(), to: Point3::origin(), radius: BASE * length };
    let long = links().into_iter().filter(|(from, to)| (to - from).norm() > 1e-6);
    std::iter::once(base).chain(long.map(|(from, to)| Body { from, to, radius: SLENDER * length })).collect()
}

/// What has become of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// Waits to be measured.
    Left,
    /// Measured.
    Done,
    /// The one to go to.
    Next,
    /// Measured, and in doubt.
    Doubt,
}

/// A point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where.
    pub at: Point3<f64>,
    /// What has become of it.
    pub kind: MarkKind,
}

/// How far a point is from where it should be; drawn longer by the scene's exaggeration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorVector {
    /// Where it begins.
    pub at: Point3<f64>,
    /// The error (m), not exaggerated.
    pub error: Vector3<f64>,
}

/// The beam from tracker to reflector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// The tracker.
    pub from: Point3<f64>,
    /// The reflector.
    pub to: Point3<f64>,
}

/// Everything in the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Arms; the first one is what the camera looks at.
    pub arms: Vec<Arm>,
    /// Height of the floor.
    pub floor: Option<f64>,
    /// Boxes to keep out of.
    pub keep_out: Vec<KeepOut>,
    /// Where the tracker stands.
    pub tracker: Option<Point3<f64>>,
    /// What it sees.
    pub beam: Option<Beam>,
    /// Planned and measured points.
    pub marks: Vec<Mark>,
    /// Errors of points.
    pub errors: Vec<ErrorVector>,
    /// Errors are drawn so many times longer than they are.
    pub exaggeration: f64,
    /// The difference of the second arm from the first is drawn so many times larger than it is; up to 1: as it is.
    pub magnified: f64,
    /// Verification samples with what they say about both arms.
    pub checked: Vec<Checked>,
}

/// A verification sample against both arms, in the registration of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// Name of the pose.
    pub pose: String,
    /// Where the identified arm has the reflector.
    pub at: Point3<f64>,
    /// Measured less predicted by the nominal arm (m).
    pub nominal: Vector3<f64>,
    /// Measured less predicted by the identified arm (m).
    pub identified: Vector3<f64>,
}

impl Scene {
    /// The robot of `profile` in its cell at the pendant configuration `q` ((rad) or (m)).
    pub fn of(profile: &Profile, q: &[f64]) -> Self {
        let arm = Arm::new(profile, profile.chain(), q, 0, Look::Solid);
        let tracker = profile.tracker().position_in_base;
        Self {
            beam: arm.reflector.map(|reflector| Beam { from: tracker, to: reflector }),
            arms: vec![arm],
            floor: profile.floor(),
            keep_out: profile.keep_out().to_vec(),
            tracker: Some(tracker),
            exaggeration: 1.0,
            ..Self::default()
        }
    }

    /// The robot of `profile` in a configuration in which its shape is seen: the middle of each range, elbow bent.
    pub fn at_rest(profile: &Profile) -> Self {
        Self::of(profile, &rest(profile))
    }

    /// The robot of a session at row `row` of its plan, with all points of the plan and what has become of them.
    pub fn of_session(session: &Session, row: Option<usize>) -> Option<Self> {
        let profile = &session.robot.as_ref()?.profile;
        let shown = row.and_then(|row| session.rows.get(row));
        let mut scene =
            shown.map_or_else(|| Self::at_rest(profile), |row| Self::of(profile, &row.planned.configuration));
        scene.place_tracker(session);
        let target = profile.targets().first()?;
        let forward = ForwardKinematics::new(profile.chain());
        let doubts: Vec<usize> = session.doubts().map(|(sample, _)| sample.row).collect();
        for (index, planned) in session.rows.iter().enumerate().filter(|(_, row)| row.active && !row.skipped) {
            let kind = match () {
                () if row == Some(index) => MarkKind::Next,
                () if doubts.contains(&index) => MarkKind::Doubt,
                () if session.sample_of_row(index).is_some() => MarkKind::Done,
                () => MarkKind::Left,
            };
            let mut q = planned.planned.configuration.clone();
            q.resize(profile.chain().dof(), 0.0);
            scene.marks.push(Mark { at: forward.point_in_base(&q, &target.position_in_flange), kind });
        }
        Some(scene)
    }

    /// Both arms of a session that is identified; `with_errors`: with what the verification samples say.
    pub fn of_identified(session: &Session, with_errors: bool) -> Option<Self> {
        let profile = session.mounted_profile()?;
        let mut scene = Self::at_rest(&profile);
        scene.place_tracker(session);
        let Some(result) = session.identified.as_deref() else { return Some(scene) };
        let chain = result.calibration.as_ref().and_then(|calibration| calibration.identified_chain(&profile));
        if let (Some(chain), false) = (&chain, with_errors) {
            // Castings would hide the other arm.
            scene.arms.iter_mut().for_each(|arm| arm.bodies = thin(&arm.joints));
            scene = scene.with_identified(&profile, chain, &rest(&profile));
            scene.magnify();
        }
        if with_errors {
            for (number, point) in result.samples.iter().zip(&result.points) {
                let Some(sample) = session.sample(*number) else { continue };
                if session.kind_of(sample) == PoseKind::Verification {
                    scene.checked.push(Checked {
                        pose: session.pose_of(sample).to_owned(),
                        at: from_xyz_mm(point.at_mm),
                        nominal: from_xyz_mm(point.nominal_mm).coords,
                        identified: from_xyz_mm(point.identified_mm).coords,
                    });
                }
            }
            scene.show_errors(true);
        }
        Some(scene)
    }

    /// Puts the tracker where the measured points say that it stands; it stays as planned where they do not.
    fn place_tracker(&mut self, session: &Session) {
        let Some(found) = station::registration(session) else { return };
        let place = Point3::from(found.to_from_from.translation.vector);
        self.tracker = Some(place);
        if let Some(beam) = &mut self.beam {
            beam.from = place;
        }
    }

    /// Shows the errors of the identified or of the nominal arm, each so much longer that the largest is well seen.
    pub fn show_errors(&mut self, of_identified: bool) {
        let pick = |one: &Checked| if of_identified { one.identified } else { one.nominal };
        self.errors = self.checked.iter().map(|one| ErrorVector { at: one.at, error: pick(one) }).collect();
        let largest = self.errors.iter().map(|vector| vector.error.norm()).fold(0.0, f64::max);
        self.exaggeration = enlargement(largest, LONGEST_ERROR * self.radius());
    }

    /// Moves the second arm away from the first until the difference is seen.
    fn magnify(&mut self) {
        let room = LONGEST_ERROR * self.radius();
        let [nominal, identified] = self.arms.as_mut_slice() else { return };
        let points = || nominal.joints.iter().chain(&nominal.reflector);
        let others = identified.joints.iter().chain(&identified.reflector);
        let largest = points().zip(others).map(|(one, other)| (other - one).norm()).fold(0.0, f64::max);
        let factor = enlargement(largest, room);
        for (one, other) in points().zip(identified.joints.iter_mut().chain(&mut identified.reflector)) {
            *other = one + (*other - one) * factor;
        }
        self.magnified = factor;
    }

    /// Adds the arm with other link constants, drawn dashed.
    #[must_use]
    pub fn with_identified(mut self, profile: &Profile, identified: &KinematicChain, q: &[f64]) -> Self {
        self.arms.push(Arm::new(profile, identified, q, 0, Look::Dashed));
        self
    }

    /// The same cell with other points (mm, in the base), all of them to be measured.
    #[must_use]
    pub fn with_points(mut self, points_mm: impl Iterator<Item = [f64; 3]>) -> Self {
        let at = |point: [f64; 3]| Point3::from(point.map(from_mm));
        self.marks = points_mm.map(|point| Mark { at: at(point), kind: MarkKind::Left }).collect();
        self
    }

    /// The reflector of the first arm.
    pub fn reflector(&self) -> Option<Point3<f64>> {
        self.arms.first().and_then(|arm| arm.reflector)
    }

    /// Points with radii around the arms.
    pub(super) fn around_arms(&self) -> Vec<(Point3<f64>, f64)> {
        let bodies = self.arms.iter().flat_map(|arm| &arm.bodies);
        let joints = self.arms.iter().flat_map(|arm| arm.joints.iter().chain(&arm.reflector));
        let floor = self.floor.unwrap_or(f64::NEG_INFINITY);
        bodies
            .flat_map(|body| [(body.from, body.radius), (body.to, body.radius)])
            // What is below the floor is not seen.
            .map(|(point, radius)| (point, radius.min((point.z - floor).max(0.0))))
            .chain(joints.map(|point| (*point, 0.0)))
            .collect()
    }

    /// Points with radii around everything.
    pub(super) fn around_all(&self) -> Vec<(Point3<f64>, f64)> {
        let mut shown = self.around_arms();
        shown.extend(self.marks.iter().map(|mark| (mark.at, 0.0)));
        shown.extend(self.tracker.map(|tracker| (tracker, 0.2)));
        shown
    }

    /// Longest horizontal distance of the arms from the axis of the base.
    pub(super) fn radius(&self) -> f64 {
        let points = self.around_arms();
        points
            .iter()
            .map(|(point, radius)| point.coords.xy().norm() + radius)
            .filter(|r| r.is_finite())
            .fold(0.3, f64::max)
    }
}
