//! Circle-point analysis of the whole arm: its link constants from moving each joint in turn.
//!
//! A joint that turns leads the SMR round a circle, whose axis is that of the joint; one that slides leads it along a line, whose
//! direction is that of the joint. The axes of neighbouring joints fix the constants of the link between them: their angle and
//! distance give α and a, the places of the common normals along and around each axis give d and θ. Where neighbours are nearly
//! parallel the common normal has no definite place: there d is taken from the template, and α and β together give the direction
//! of the next axis (Hayati).
//!
//! An instrument that sees one SMR cannot see where the base is on the first axis, nor where the flange is on the last one: d and
//! θ of the first link and all constants of the last one are taken from the template, and the SMR is located relative to them.
//!
//! The standard deviations come from the scatter of the points, by the derivatives of every constant with respect to every
//! measured coordinate.

mod motion;
mod series;

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use thiserror::Error;

use motion::settle_sigmas;
use series::{Series, reference, series};

use super::CircleError;
use crate::kinematics::{
    Convention, ForwardKinematics, Joint, JointType, KinematicChain, KinematicsError, Link, LinkParameter, ParameterId,
};
use crate::units::{DEGREE, MICROMETRE, MILLIMETRE, to_mm};

/// Neighbouring axes nearer to parallel than this get a β (rad): 1°, far above any assembly error.
const PARALLEL: f64 = DEGREE;
/// Axes nearer to each other than this count as one where they are parallel (m).
const COINCIDENT: f64 = MILLIMETRE;
/// Change of a coordinate for the derivatives (m).
const STEP: f64 = MICROMETRE;
/// Shortest slide from which a direction is taken (m).
const SHORTEST_SLIDE: f64 = 20.0 * MILLIMETRE;
/// A slide that the table gives with another length than the tracker sees, as a part of it.
const SLIDE_TOLERANCE: f64 = 0.02;
/// Corrections of the place of an axis of sliding; each leaves a thousandth of the one before.
const PLACINGS: usize = 5;
/// Residuals this much above the stated standard deviation widen the result.
const EXCESS: f64 = 1.5;

/// Why the arm could not be measured.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum WholeArmError {
    /// A row that moves several joints.
    #[error(
        "row {row}: {joints} moved together since the row that began this series; move one joint at a time, from one position of the others"
    )]
    Together {
        /// Row from 1.
        row: usize,
        /// Names of the joints.
        joints: String,
    },
    /// Nothing moves.
    #[error("row {row}: no joint moves in this series; each joint needs at least 4 rows, better 8")]
    NothingMoves {
        /// Row from 1.
        row: usize,
    },
    /// Two series of one joint.
    #[error("joint {joint} is moved in two series (rows {first} and {second}); keep one")]
    Twice {
        /// Name of the joint.
        joint: String,
        /// First row of the one, from 1.
        first: usize,
        /// First row of the other, from 1.
        second: usize,
    },
    /// A joint without a series.
    #[error("joint {joint} is not moved in any series: each joint has to be moved in turn")]
    Missing {
        /// Name of the joint.
        joint: String,
    },
    /// A joint nearer to the base stood elsewhere.
    #[error(
        "joint {moved} has another value in the series of {series} than in that of {last}: return each joint to its position before the next one is moved"
    )]
    NotReturned {
        /// Name of the joint that stood elsewhere.
        moved: String,
        /// Name of the joint moved in one series.
        series: String,
        /// Name of the joint moved in the other.
        last: String,
    },
    /// A circle that cannot be used.
    #[error("joint {joint}: {error}")]
    Circle {
        /// Name of the joint.
        joint: String,
        /// What is wrong with it.
        error: CircleError,
    },
    /// A slide that cannot be used.
    #[error("joint {joint} moves the SMR by {:.1} mm where the table says {:.1} mm; at least {} mm are needed, and both must agree", to_mm(*seen), to_mm(*stated), to_mm(SHORTEST_SLIDE))]
    Slide {
        /// Name of the joint.
        joint: String,
        /// Length that the tracker sees (m).
        seen: f64,
        /// Length in the table (m).
        stated: f64,
    },
    /// Configurations and points do not match the arm.
    #[error("{configurations} configurations and {points} points of an arm with {joints} joints do not fit together")]
    Counts {
        /// Configurations given.
        configurations: usize,
        /// Points given.
        points: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// Geometry that makes no chain.
    #[error(transparent)]
    Geometry(#[from] KinematicsError),
}

/// What is known of the arm before it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Template {
    /// Joints in order, convention, base, flange, and the constants to compare with.
    pub chain: KinematicChain,
    /// Joints whose link has a β, from 0.
    pub beta_joints: Vec<usize>,
    /// Whether the constants of `chain` mean something; if not, only its joint types do.
    pub is_nominal: bool,
}

impl Template {
    /// An arm of which only the kinds of its joints are known, named J1, J2, ….
    ///
    /// # Errors
    /// No joint.
    pub fn unknown(types: &[JointType]) -> Result<Self, KinematicsError> {
        let joint = |(index, joint_type): (usize, &JointType)| Joint {
            name: format!("J{}", index + 1),
            joint_type: *joint_type,
            link: Link::default(),
            direction: 1.0,
            coupling: Vec::new(),
        };
        let joints = types.iter().enumerate().map(joint).collect();
        let fixed = Isometry3::identity();
        let chain = KinematicChain::new(Convention::Standard, fixed, joints, fixed)?;
        Ok(Self { chain, beta_joints: Vec::new(), is_nominal: false })
    }

    fn name(&self, joint: usize) -> String {
        self.chain.joints().get(joint).map_or_else(|| format!("J{}", joint + 1), |joint| joint.name.clone())
    }

    fn joint_type(&self, joint: usize) -> JointType {
        self.chain.joints().get(joint).map_or(JointType::Revolute, |joint| joint.joint_type)
    }

    /// The links between the joints, in the standard order whatever the convention: θ and d of a joint, then a, α and β up to the
    /// next one.
    fn links(&self) -> Vec<Link> {
        let links: Vec<Link> = self.chain.joints().iter().map(|joint| joint.link).collect();
        match self.chain.convention() {
            Convention::Standard => links,
            Convention::Modified => {
                let next = links.iter().skip(1).copied().chain([Link::default()]);
                let grouped = links.iter().zip(next);
                grouped.map(|(own, next)| Link { theta: own.theta, d: own.d, ..next }).collect()
            }
        }
    }

    /// Index of the joint to whose link a constant between joint `index` and the next one belongs.
    const fn owner(&self, index: usize, parameter: LinkParameter) -> usize {
        match (self.chain.convention(), parameter) {
            (Convention::Standard, _) | (Convention::Modified, LinkParameter::D | LinkParameter::Theta) => index,
            (Convention::Modified, LinkParameter::Alpha | LinkParameter::A | LinkParameter::Beta) => index + 1,
        }
    }

    /// The frame of the first joint in the base.
    fn base_from_first(&self) -> Isometry3<f64> {
        let first = self.chain.joints().first().map(|joint| joint.link).unwrap_or_default();
        match self.chain.convention() {
            Convention::Standard => *self.chain.base(),
            Convention::Modified => self.chain.base() * across(&first),
        }
    }

    /// Whether the link after joint `index` has a β: the template says so, or nothing is known and the axes are parallel.
    fn has_beta(&self, index: usize, sine: f64) -> bool {
        self.beta_joints.contains(&self.owner(index, LinkParameter::Beta)) || sine < PARALLEL.sin()
    }
}

/// From the end of `d` to the next axis: a, α and β.
fn across(link: &Link) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), link.alpha)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), link.beta);
    Isometry3::from_parts(Translation3::new(link.a, 0.0, 0.0), turn)
}

/// About and along an axis: θ and d.
fn along(theta: f64, d: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta);
    Isometry3::from_parts(Translation3::new(0.0, 0.0, d), turn)
}

/// A constant that the circles give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredConstant {
    /// Which constant, as in profiles.
    pub id: ParameterId,
    /// Its value (m or rad).
    pub value: f64,
    /// Its standard deviation (m or rad).
    pub sigma: f64,
    /// The value of the template (m or rad), if that is a nominal arm.
    pub nominal: Option<f64>,
}

/// How well one joint was seen to move.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMotion {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Number of points.
    pub points: usize,
    /// Radius of the circle (m); `None` for a joint that slides.
    pub radius: Option<f64>,
    /// Arc (rad), or length of the slide (m).
    pub extent: f64,
    /// Root mean square distance of the points from circle or line (m).
    pub rms: f64,
    /// Standard deviation of a coordinate that was used (m).
    pub sigma: f64,
}

/// The arm as the circles show it.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredArm {
    /// The chain of the template with the measured constants.
    pub chain: KinematicChain,
    /// Joints whose link has a β, from 0, ascending.
    pub beta_joints: Vec<usize>,
    /// The measured constants, joint by joint.
    pub constants: Vec<MeasuredConstant>,
    /// The SMR in the flange frame of the template (m).
    pub point_in_flange: Point3<f64>,
    /// Standard deviation of its coordinates (m), relative to the last axis.
    pub point_sigma: Vector3<f64>,
    /// Where the tracker stands (m).
    pub base_from_tracker: Isometry3<f64>,
    /// The motions, from the base to the flange.
    pub motions: Vec<JointMotion>,
    /// Distance of each point from where the measured arm puts it (m), in the order of the rows.
    pub residuals: Vec<f64>,
}

/// Measures an arm from rows in which one joint moves after the other, each from one common position of the joints nearer to the
/// base. The rows of a joint follow each other; the order of the joints does not matter.
///
/// `configurations` are pendant values (rad, sliding joints m), `points` the SMR in the tracker frame (m). `sigma` is the standard
/// deviation of a coordinate (m), if it is known; else that of the residuals.
///
/// # Errors
/// Rows that do not move one joint at a time, a joint that is missing, or a motion that shows no axis.
pub fn measure_arm(
    template: &Template,
    configurations: &[Vec<f64>],
    points: &[Point3<f64>],
    sigma: Option<f64>,
) -> Result<MeasuredArm, WholeArmError> {
    let joints = template.chain.dof();
    if configurations.len() != points.len() || configurations.iter().any(|q| q.len() != joints) {
        let (configurations, points) = (configurations.len(), points.len());
        return Err(WholeArmError::Counts { configurations, points, joints });
    }
    let variables: Vec<Vec<f64>> = configurations.iter().map(|q| variables(&template.chain, q)).collect();
    let series = series(template, &variables)?;
    let reference = reference(template, &variables, &series)?;
    let mut motions = Vec::new();
    let mut axes = Vec::new();
    for one in &series {
        let (axis, motion) = motion::motion(template, one, &variables, points)?;
        axes.push(axis);
        motions.push(motion);
    }
    settle_sigmas(template, &mut motions, sigma);
    let setting = Setting { template, configurations, variables: &variables, reference: &reference, series: &series };
    let choices = setting.choices(&axes);
    let solution = setting.solve(&axes, points, &choices)?;
    let shown = setting.shown(&choices);
    let variances = setting.variances(&axes, points, &choices, &shown, &motions, &solution)?;
    Ok(setting.measured(solution, &shown, &variances, motions, points))
}

/// Kinematic joint variables of a configuration.
fn variables(chain: &KinematicChain, q: &[f64]) -> Vec<f64> {
    chain.joints().iter().enumerate().map(|(index, joint)| joint.variable(index, q)).collect()
}

/// A line with a sense.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    point: Point3<f64>,
    direction: Vector3<f64>,
}

impl Axis {
    /// Where it passes through a plane of constant z.
    fn at_height(&self, z: f64) -> Point3<f64> {
        self.point + self.direction * ((z - self.point.z) / self.direction.z)
    }
}

/// How the constants of a link follow from its two axes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Choice {
    has_beta: bool,
    /// Sense of the common normal.
    sign: f64,
    /// Whether θ is taken from the template, because the axes coincide.
    keeps_theta: bool,
}

/// What does not depend on the measured points.
struct Setting<'a> {
    template: &'a Template,
    configurations: &'a [Vec<f64>],
    variables: &'a [Vec<f64>],
    reference: &'a [f64],
    series: &'a [Series],
}

/// Link constants and set-up.
#[derive(Clone, Debug)]
struct Solution {
    /// In the standard order.
    links: Vec<Link>,
    chain: KinematicChain,
    base_from_tracker: Isometry3<f64>,
    point_in_flange: Point3<f64>,
}

/// Links from axes.
struct Linked {
    links: Vec<Link>,
    tracker_from_first: Isometry3<f64>,
    /// Joints that slide with how far their axis is from where the next one meets their link (m).
    missed: Vec<(usize, Vector3<f64>)>,
}

impl Setting<'_> {
    fn joints(&self) -> usize {
        self.template.chain.dof()
    }

    /// The axes with a place for those that only have a direction: on the next axis, the last one through the SMR.
    fn placed(&self, axes: &[Axis]) -> Vec<Axis> {
        let mut placed = axes.to_vec();
        for joint in (0..axes.len().saturating_sub(1)).rev() {
            if self.template.joint_type(joint) == JointType::Prismatic
                && let Some(next) = placed.get(joint + 1).copied()
                && let Some(axis) = placed.get_mut(joint)
            {
                axis.point = next.point;
            }
        }
        placed
    }

    /// Decisions that must not change with the noise: made once.
    fn choices(&self, axes: &[Axis]) -> Vec<Choice> {
        let axes = self.placed(axes);
        let links = self.template.links();
        let pairs = axes.windows(2).zip(&links).enumerate();
        let choice = |(index, (pair, link)): (usize, (&[Axis], &Link))| {
            let [own, next] = pair else { return Choice { has_beta: false, sign: 1.0, keeps_theta: false } };
            let cross = own.direction.cross(&next.direction);
            let has_beta = self.template.has_beta(index, cross.norm());
            let between = next.point - own.point;
            if has_beta {
                let distance = (between - own.direction * between.dot(&own.direction)).norm();
                let sign = if self.template.is_nominal && link.a < 0.0 { -1.0 } else { 1.0 };
                return Choice { has_beta, sign, keeps_theta: distance < COINCIDENT };
            }
            let a = between.dot(&cross) / cross.norm();
            let is_turned = if self.template.is_nominal { link.alpha.sin() < 0.0 } else { a < -COINCIDENT };
            Choice { has_beta, sign: if is_turned { -1.0 } else { 1.0 }, keeps_theta: false }
        };
        pairs.map(choice).collect()
    }

    /// Constants of all links, frame of the base, and the SMR.
    fn solve(&self, axes: &[Axis], points: &[Point3<f64>], choices: &[Choice]) -> Result<Solution, WholeArmError> {
        let mut axes = self.placed(axes);
        let mut linked = self.linked(&axes, choices);
        // An axis of sliding has no place of its own: it is moved until the next one meets it where the link puts it.
        for _ in 0..PLACINGS {
            if linked.missed.is_empty() {
                break;
            }
            for (index, by) in &linked.missed {
                if let Some(axis) = axes.get_mut(*index) {
                    axis.point += by;
                }
            }
            linked = self.linked(&axes, choices);
        }
        let Linked { links, tracker_from_first, .. } = linked;
        let chain = self.chain(&links)?;
        let base_from_tracker = self.template.base_from_first() * tracker_from_first.inverse();
        let kinematics = ForwardKinematics::new(&chain);
        let last = self.series.last().copied().unwrap_or(Series { joint: 0, rows: (0, 0) });
        let seen = last.of(self.configurations).iter().zip(last.of(points));
        let sum: Vector3<f64> = seen
            .map(|(q, point)| (kinematics.base_from_flange(q).inverse() * (base_from_tracker * point)).coords)
            .sum();
        let point_in_flange = Point3::from(sum / last.of(points).len().max(1) as f64);
        Ok(Solution { links, chain, base_from_tracker, point_in_flange })
    }

    /// Constants of all links from axes that all have a place.
    fn linked(&self, axes: &[Axis], choices: &[Choice]) -> Linked {
        let mut links = self.template.links();
        let mut frame = axes.first().map_or_else(Isometry3::identity, start);
        let mut tracker_from_first = frame;
        let mut missed = Vec::new();
        for (index, (choice, next)) in choices.iter().zip(axes.iter().skip(1)).enumerate() {
            let Some(link) = links.get_mut(index) else { continue };
            let nominal = *link;
            let at = self.reference.get(index).copied().unwrap_or_default();
            let is_sliding = self.template.joint_type(index) == JointType::Prismatic;
            let (turned, slid) = if is_sliding { (0.0, at) } else { (at, 0.0) };
            let in_frame = Axis { point: frame.inverse() * next.point, direction: frame.inverse() * next.direction };
            let total = between(&in_frame, choice, nominal.theta + turned, nominal.d + slid);
            if is_sliding && choice.keeps_theta {
                let foot = in_frame.at_height(total.d);
                let wanted =
                    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), total.theta) * Vector3::x() * nominal.a;
                missed.push((index, frame * Vector3::new(foot.x - wanted.x, foot.y - wanted.y, 0.0)));
            }
            if index == 0 {
                // Turned and moved along the first axis so that θ and d are those of the template.
                tracker_from_first =
                    frame * along(total.theta, total.d) * along(nominal.theta + turned, nominal.d + slid).inverse();
                *link = Link { theta: nominal.theta, d: nominal.d, ..total };
            } else {
                let theta = near(total.theta - turned, nominal.theta);
                *link = Link { theta, d: total.d - slid, ..total };
            }
            frame = frame * along(total.theta, total.d) * across(&total);
        }
        Linked { links, tracker_from_first, missed }
    }

    /// The chain of the template with other links.
    fn chain(&self, links: &[Link]) -> Result<KinematicChain, WholeArmError> {
        let chain = &self.template.chain;
        let mut joints = chain.joints().to_vec();
        for parameter in LinkParameter::ALL {
            for (index, link) in links.iter().enumerate() {
                let owner = self.template.owner(index, parameter);
                if let Some(joint) = joints.get_mut(owner) {
                    *joint.link.value_mut(parameter) = link.value(parameter);
                }
            }
        }
        Ok(KinematicChain::new(chain.convention(), *chain.base(), joints, *chain.flange())?)
    }

    /// Constants that the motions show, as pairs of link in the standard order and parameter.
    fn shown(&self, choices: &[Choice]) -> Vec<(usize, LinkParameter)> {
        let mut shown = Vec::new();
        for (index, choice) in choices.iter().enumerate() {
            // The place of an axis along which the arm slides is arbitrary.
            let slides = self.template.joint_type(index) == JointType::Prismatic;
            let is_arbitrary =
                (index + 1..self.joints()).all(|later| self.template.joint_type(later) == JointType::Prismatic);
            let mut add = |parameter, is_shown: bool| {
                if is_shown {
                    shown.push((index, parameter));
                }
            };
            add(LinkParameter::Alpha, true);
            add(LinkParameter::A, !slides && !is_arbitrary);
            add(LinkParameter::D, index > 0 && !choice.has_beta && !is_arbitrary);
            add(LinkParameter::Theta, index > 0 && !choice.keeps_theta && !(choice.has_beta && is_arbitrary));
            add(LinkParameter::Beta, choice.has_beta);
        }
        shown
    }

    /// Variances of the shown constants, then of the coordinates of the SMR.
    fn variances(
        &self,
        axes: &[Axis],
        points: &[Point3<f64>],
        choices: &[Choice],
        shown: &[(usize, LinkParameter)],
        motions: &[JointMotion],
        at: &Solution,
    ) -> Result<Vec<f64>, WholeArmError> {
        let mut variances = vec![0.0; shown.len() + 3];
        let mut points = points.to_vec();
        let mut axes = axes.to_vec();
        for (index, (series, motion)) in self.series.iter().zip(motions).enumerate() {
            let kept = axes.get(index).copied();
            for (row, axis) in (series.rows.0..series.rows.1).flat_map(|row| (0..3).map(move |axis| (row, axis))) {
                let before = points.get(row).copied();
                if let Some(point) = points.get_mut(row) {
                    point[axis] += STEP;
                }
                let (seen, _) = motion::motion(self.template, series, self.variables, &points)?;
                if let Some(place) = axes.get_mut(index) {
                    *place = seen;
                }
                let changed = self.solve(&axes, &points, choices)?;
                let by_constant = shown.iter().map(|(link, parameter)| {
                    let value =
                        |solution: &Solution| solution.links.get(*link).map_or(0.0, |link| link.value(*parameter));
                    value(&changed) - value(at)
                });
                let by_point = (0..3).map(|axis| changed.point_in_flange[axis] - at.point_in_flange[axis]);
                for (variance, change) in variances.iter_mut().zip(by_constant.chain(by_point)) {
                    *variance += (change / STEP * motion.sigma).powi(2);
                }
                if let (Some(point), Some(before)) = (points.get_mut(row), before) {
                    *point = before;
                }
            }
            if let (Some(place), Some(kept)) = (axes.get_mut(index), kept) {
                *place = kept;
            }
        }
        Ok(variances)
    }

    fn measured(
        &self,
        solution: Solution,
        shown: &[(usize, LinkParameter)],
        variances: &[f64],
        motions: Vec<JointMotion>,
        points: &[Point3<f64>],
    ) -> MeasuredArm {
        let nominal = self.template.links();
        let constant = |((link, parameter), variance): (&(usize, LinkParameter), &f64)| {
            let value = |links: &[Link]| links.get(*link).map_or(0.0, |link| link.value(*parameter));
            MeasuredConstant {
                id: ParameterId::Link { joint: self.template.owner(*link, *parameter), parameter: *parameter },
                value: value(&solution.links),
                sigma: variance.sqrt(),
                nominal: self.template.is_nominal.then(|| value(&nominal)),
            }
        };
        let mut constants: Vec<MeasuredConstant> = shown.iter().zip(variances).map(constant).collect();
        constants.sort_by_key(|constant| constant.id);
        let mut beta_joints = self.template.beta_joints.clone();
        beta_joints.extend(constants.iter().filter_map(|constant| match constant.id {
            ParameterId::Link { joint, parameter: LinkParameter::Beta } => Some(joint),
            ParameterId::Link { .. } | ParameterId::Joint { .. } | ParameterId::Target { .. } => None,
        }));
        beta_joints.sort_unstable();
        beta_joints.dedup();
        let sigma = |axis: usize| variances.get(shown.len() + axis).copied().unwrap_or_default().sqrt();
        let kinematics = ForwardKinematics::new(&solution.chain);
        let residual = |(q, point): (&Vec<f64>, &Point3<f64>)| {
            (solution.base_from_tracker * point - kinematics.point_in_base(q, &solution.point_in_flange)).norm()
        };
        let residuals = self.configurations.iter().zip(points).map(residual).collect();
        MeasuredArm {
            residuals,
            beta_joints,
            constants,
            point_in_flange: solution.point_in_flange,
            point_sigma: Vector3::new(sigma(0), sigma(1), sigma(2)),
            base_from_tracker: solution.base_from_tracker,
            motions,
            chain: solution.chain,
        }
    }
}

/// The constants from one axis to the next, which is given in the frame of the first; θ and d include the joint variable.
fn between(next: &Axis, choice: &Choice, theta: f64, d: f64) -> Link {
    let cross = Vector3::z().cross(&next.direction);
    if choice.has_beta {
        return nearly_parallel(next, choice, theta, d);
    }
    let x = cross.normalize() * choice.sign;
    // The feet of the common normal.
    let square = cross.norm_squared();
    let along_next = (next.direction.z * next.point.z - next.point.coords.dot(&next.direction)) / square;
    let foot = next.point + next.direction * along_next;
    Link {
        theta: x.y.atan2(x.x),
        d: foot.z,
        a: foot.coords.dot(&x),
        alpha: cross.dot(&x).atan2(next.direction.z),
        beta: 0.0,
    }
}

/// The constants to an axis that is nearly parallel: it is met in the plane at `d`.
fn nearly_parallel(next: &Axis, choice: &Choice, theta: f64, d: f64) -> Link {
    let foot = next.at_height(d);
    let (theta, a) = if choice.keeps_theta {
        (theta, foot.x * theta.cos() + foot.y * theta.sin())
    } else {
        ((foot.y * choice.sign).atan2(foot.x * choice.sign), choice.sign * foot.x.hypot(foot.y))
    };
    let direction = Rotation3::from_axis_angle(&Vector3::z_axis(), theta).inverse() * next.direction;
    Link { theta, d, a, alpha: (-direction.y).atan2(direction.z), beta: direction.x.clamp(-1.0, 1.0).asin() }
}

/// An angle plus full turns, as near to another as possible.
fn near(angle: f64, other: f64) -> f64 {
    angle - ((angle - other) / TAU).round() * TAU
}

/// A frame with an axis as z.
fn start(axis: &Axis) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &axis.direction)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
    Isometry3::from_parts(Translation3::from(axis.point.coords), turn)
}
