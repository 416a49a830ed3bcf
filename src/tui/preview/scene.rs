//! The content of the picture in the robot base (m). Plain data without camera or dots.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::geometry::enlargement;
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::profile::{KeepOut, Profile};
use crate::session::journal::from_xyz_mm;
use crate::session::plan::PoseKind;
use crate::session::state::Session;
use crate::session::station;
use crate::units::from_mm;

/// Radius of an arm whose profile has no bodies, as a part of its length.
const SLENDER: f64 = 0.035;
/// Radius of an arm that is compared with another, as a part of its reach.
const THIN: f64 = 0.008;
/// Radius of the base of an arm without bodies, as a part of its length.
const BASE: f64 = 0.09;
/// Longest drawn error or difference, as a part of the arm's reach.
const LONGEST_ERROR: f64 = 0.15;

/// The middle of each joint range (rad, sliding joints m).
fn rest(profile: &Profile) -> Vec<f64> {
    let middle = |range: &crate::profile::JointRange| {
        range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high))
    };
    profile.joints().iter().map(middle).collect()
}

/// Style of a drawn arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmStyle {
    /// Solid bodies: the nominal arm.
    Solid,
    /// Dashed lines through the joints: the identified arm.
    Dashed,
}

/// A capsule (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    pub from: Point3<f64>,
    pub to: Point3<f64>,
    pub radius: f64,
}

/// An arm at a configuration, to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnArm {
    pub style: ArmStyle,
    /// Castings, from the base to the flange.
    pub bodies: Vec<Body>,
    /// Origins of the link frames, from the base to the flange.
    pub joints: Vec<Point3<f64>>,
    /// Centre of the reflector.
    pub reflector: Option<Point3<f64>>,
}

impl DrawnArm {
    /// The arm of `profile` with the link constants of `chain` at the pendant configuration `q` (rad, sliding joints m), with
    /// the target of index `target`.
    pub fn new(profile: &Profile, chain: &KinematicChain, q: &[f64], target: usize, style: ArmStyle) -> Self {
        let mut q = q.to_vec();
        q.resize(chain.dof(), 0.0);
        let forward = ForwardKinematics::new(chain);
        let frames = forward.base_from_links(&q);
        let joints: Vec<Point3<f64>> = frames.iter().map(|frame| Point3::from(frame.translation.vector)).collect();
        let bodies = if profile.bodies().is_empty() { slender(&joints) } else { castings(profile, &frames) };
        let reflector =
            profile.targets().get(target).map(|target| forward.point_in_base(&q, &target.position_in_flange));
        Self { style, bodies, joints, reflector }
    }
}

/// The bodies of a profile at their positions.
fn castings(profile: &Profile, frames: &[Isometry3<f64>]) -> Vec<Body> {
    let place = |body: &crate::profile::Capsule| {
        let frame = frames.get(body.link)?;
        Some(Body { from: frame * body.from, to: frame * body.to, radius: body.radius })
    };
    profile.bodies().iter().filter_map(place).collect()
}

/// The lines from the base through the joints.
fn links(joints: &[Point3<f64>]) -> impl Iterator<Item = (Point3<f64>, Point3<f64>)> {
    let starts = std::iter::once(Point3::origin()).chain(joints.iter().copied());
    starts.zip(joints.iter().copied())
}

/// Thin bodies along the joints.
fn thin(joints: &[Point3<f64>]) -> Vec<Body> {
    let radius = THIN * joints.last().map_or(1.0, |last| last.coords.norm());
    links(joints).map(|(from, to)| Body { from, to, radius }).collect()
}

/// Bodies along the joints of an arm whose profile has none.
fn slender(joints: &[Point3<f64>]) -> Vec<Body> {
    let length: f64 = links(joints).map(|(from, to)| (to - from).norm()).sum();
    let mut bodies = vec![Body { from: Point3::origin(), to: Point3::origin(), radius: BASE * length }];
    let long = links(joints).filter(|(from, to)| (to - from).norm() > 1e-6);
    bodies.extend(long.map(|(from, to)| Body { from, to, radius: SLENDER * length }));
    bodies
}

/// State of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// Not measured yet.
    Open,
    /// Measured.
    Done,
    /// The next one to measure.
    Next,
    /// Measured but questioned.
    Doubt,
}

/// A point of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    pub at: Point3<f64>,
    pub kind: MarkKind,
}

/// The error of a point, which is drawn enlarged by the scene's exaggeration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorVector {
    /// Start of the vector.
    pub at: Point3<f64>,
    /// The error itself (m).
    pub error: Vector3<f64>,
}

/// The arm whose errors are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorsOf {
    Nominal,
    #[default]
    Identified,
}

/// The beam from tracker to reflector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    pub from: Point3<f64>,
    pub to: Point3<f64>,
}

/// The content of the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Arms; the camera looks at the first one.
    pub arms: Vec<DrawnArm>,
    /// Height of the floor.
    pub floor: Option<f64>,
    /// Boxes that the arm must not enter.
    pub keep_out: Vec<KeepOut>,
    /// Position of the tracker.
    pub tracker: Option<Point3<f64>>,
    /// Beam of the tracker.
    pub beam: Option<Beam>,
    /// Planned and measured points.
    pub marks: Vec<Mark>,
    /// Errors of points.
    pub errors: Vec<ErrorVector>,
    /// The arm whose errors they are.
    pub errors_of: ErrorsOf,
    /// Enlargement of the errors.
    pub exaggeration: f64,
    /// Ends of errors that the picture has to contain.
    pub tips: Vec<Point3<f64>>,
    /// Enlargement of the difference between the second arm and the first; up to 1: none.
    pub magnified: f64,
    /// Verification samples with the errors of both arms.
    pub verified: Vec<VerifiedPoint>,
}

/// A verification sample against both arms, in the registration of each.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifiedPoint {
    /// Name of the pose.
    pub pose: String,
    /// Position of the reflector predicted by the identified arm.
    pub at: Point3<f64>,
    /// Measured minus predicted by the nominal arm (m).
    pub nominal: Vector3<f64>,
    /// Measured minus predicted by the identified arm (m).
    pub identified: Vector3<f64>,
}

impl VerifiedPoint {
    /// The error of an arm (m).
    const fn error(&self, of: ErrorsOf) -> Vector3<f64> {
        match of {
            ErrorsOf::Nominal => self.nominal,
            ErrorsOf::Identified => self.identified,
        }
    }
}

impl Scene {
    /// The robot of `profile` in its cell at the pendant configuration `q` (rad, sliding joints m).
    pub fn of(profile: &Profile, q: &[f64]) -> Self {
        let arm = DrawnArm::new(profile, profile.chain(), q, 0, ArmStyle::Solid);
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

    /// The robot of `profile` in the middle of each joint range, where its shape can be seen.
    pub fn at_rest(profile: &Profile) -> Self {
        Self::of(profile, &rest(profile))
    }

    /// The robot of a session at row `row` of its plan, with the states of all points of the plan.
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
            let kind = if row == Some(index) {
                MarkKind::Next
            } else if doubts.contains(&index) {
                MarkKind::Doubt
            } else if session.sample_of_row(index).is_some() {
                MarkKind::Done
            } else {
                MarkKind::Open
            };
            let mut q = planned.planned.configuration.clone();
            q.resize(profile.chain().dof(), 0.0);
            scene.marks.push(Mark { at: forward.point_in_base(&q, &target.position_in_flange), kind });
        }
        Some(scene)
    }

    /// Both arms of an identified session, or if `with_errors` the errors at the verification samples.
    pub fn of_identified(session: &Session, with_errors: bool) -> Option<Self> {
        let profile = session.mounted_profile()?;
        let mut scene = Self::at_rest(&profile);
        scene.place_tracker(session);
        let Some(result) = session.identified.as_deref() else { return Some(scene) };
        let calibration = result.calibration.as_ref();
        let chain = calibration.and_then(|calibration| calibration.identified(&profile).ok()).map(|arm| arm.chain);
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
                    scene.verified.push(VerifiedPoint {
                        pose: session.pose_of(sample).to_owned(),
                        at: from_xyz_mm(point.at_mm),
                        nominal: from_xyz_mm(point.nominal_mm).coords,
                        identified: from_xyz_mm(point.identified_mm).coords,
                    });
                }
            }
            scene.show_errors(ErrorsOf::Identified);
        }
        Some(scene)
    }

    /// Moves the tracker to its registered position. Without a registration it stays as planned.
    fn place_tracker(&mut self, session: &Session) {
        let Some(found) = station::registration(session) else { return };
        let place = Point3::from(found.to_from_from.translation.vector);
        self.tracker = Some(place);
        if let Some(beam) = &mut self.beam {
            beam.from = place;
        }
    }

    /// Shows the errors of an arm, enlarged so that the largest is clearly visible.
    pub fn show_errors(&mut self, of: ErrorsOf) {
        self.put_errors(of, &[of]);
    }

    /// Shows the errors of an arm as much enlarged as those of the other, so that what is longer is worse.
    pub fn show_errors_alike(&mut self, of: ErrorsOf) {
        self.put_errors(of, &[ErrorsOf::Nominal, ErrorsOf::Identified]);
    }

    /// Shows the errors of an arm, with enlargement and framing for those of `together`.
    fn put_errors(&mut self, of: ErrorsOf, together: &[ErrorsOf]) {
        self.errors = self.verified.iter().map(|one| ErrorVector { at: one.at, error: one.error(of) }).collect();
        self.errors_of = of;
        let lengths = together.iter().flat_map(|of| self.verified.iter().map(|one| one.error(*of).norm()));
        let times = enlargement(lengths.fold(0.0, f64::max), LONGEST_ERROR * self.radius());
        let tips = together.iter().flat_map(|of| self.verified.iter().map(move |one| one.at + one.error(*of) * times));
        self.tips = self.verified.iter().map(|one| one.at).chain(tips).collect();
        self.exaggeration = times;
    }

    /// Enlarges the difference of the second arm from the first until it is visible.
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
        self.arms.push(DrawnArm::new(profile, identified, q, 0, ArmStyle::Dashed));
        self
    }

    /// The same cell with other points (mm, in the base), all of them open.
    #[must_use]
    pub fn with_points(mut self, points_mm: impl Iterator<Item = [f64; 3]>) -> Self {
        let at = |point: [f64; 3]| Point3::from(point.map(from_mm));
        self.marks = points_mm.map(|point| Mark { at: at(point), kind: MarkKind::Open }).collect();
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
            // The part below the floor is not visible.
            .map(|(point, radius)| (point, radius.min((point.z - floor).max(0.0))))
            .chain(joints.map(|point| (*point, 0.0)))
            .collect()
    }

    /// Points with radii around the arms and the errors that are drawn.
    pub(super) fn around_errors(&self) -> Vec<(Point3<f64>, f64)> {
        let mut shown = self.around_arms();
        shown.extend(self.tips.iter().map(|tip| (*tip, 0.0)));
        shown
    }

    /// Points with radii around everything.
    pub(super) fn around_all(&self) -> Vec<(Point3<f64>, f64)> {
        let mut shown = self.around_errors();
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
