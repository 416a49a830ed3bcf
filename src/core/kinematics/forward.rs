//! Forward kinematics, as products of elementary transforms on one moving frame.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::loads::JointLoad;
use super::{Convention, Joint, JointError, JointType, KinematicChain, Link};

/// A chain prepared for many configurations: sines and cosines of the constant angles are computed once.
#[derive(Clone, Debug)]
pub struct ForwardKinematics<'a> {
    chain: &'a KinematicChain,
    links: Vec<PreparedLink>,
    base: Frame,
    flange_rotation: Matrix3<f64>,
    flange_translation: Vector3<f64>,
    flange_is_identity: bool,
    disturbance: Disturbance,
}

/// What moves the joints besides their values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Disturbance {
    None,
    Curves,
    Loads,
}

const UNLOADED: JointLoad = JointLoad { torque: 0.0, moment: [0.0; 2] };

/// Link constants with the sine and cosine of the fixed angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct PreparedLink {
    link: Link,
    joint_type: JointType,
    alpha: (f64, f64),
    beta: (f64, f64),
}

/// A moving frame: the axes and the origin in the base. Elementary transforms act on its own axes (from the right).
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) x: Vector3<f64>,
    pub(super) y: Vector3<f64>,
    pub(super) z: Vector3<f64>,
    pub(super) origin: Vector3<f64>,
}

impl Frame {
    fn from_isometry(pose: &Isometry3<f64>) -> Self {
        let axes = pose.rotation.to_rotation_matrix();
        Self {
            x: axes.matrix().column(0).into(),
            y: axes.matrix().column(1).into(),
            z: axes.matrix().column(2).into(),
            origin: pose.translation.vector,
        }
    }

    fn to_isometry(self) -> Isometry3<f64> {
        let axes = Rotation3::from_matrix_unchecked(self.axes());
        Isometry3::from_parts(Translation3::from(self.origin), UnitQuaternion::from_rotation_matrix(&axes))
    }

    /// The axes as columns.
    pub(super) fn axes(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&[self.x, self.y, self.z])
    }

    #[inline]
    fn rotate_x(&mut self, (sin, cos): (f64, f64)) {
        let y = self.y;
        self.y = y * cos + self.z * sin;
        self.z = self.z * cos - y * sin;
    }

    #[inline]
    fn rotate_y(&mut self, (sin, cos): (f64, f64)) {
        let x = self.x;
        self.x = x * cos - self.z * sin;
        self.z = self.z * cos + x * sin;
    }

    #[inline]
    fn rotate_z(&mut self, (sin, cos): (f64, f64)) {
        let x = self.x;
        self.x = x * cos + self.y * sin;
        self.y = self.y * cos - x * sin;
    }
}

/// The twists of one link's five constants, seen from the base: what the identification Jacobian is made of.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LinkAxes {
    /// Axis of α and direction of a.
    pub(super) x: Vector3<f64>,
    /// A point on the axis of α.
    pub(super) x_origin: Vector3<f64>,
    /// Axis of θ and direction of d.
    pub(super) z: Vector3<f64>,
    /// A point on the axis of θ.
    pub(super) z_origin: Vector3<f64>,
    /// Axes of a tilt of the joint's bearing, through the same point.
    pub(super) tilt: [Vector3<f64>; 2],
    /// Axis of β.
    pub(super) y: Vector3<f64>,
    /// A point on the axis of β.
    pub(super) y_origin: Vector3<f64>,
}

impl PreparedLink {
    fn new(joint: &Joint) -> Self {
        Self {
            link: joint.link,
            joint_type: joint.joint_type,
            alpha: joint.link.alpha.sin_cos(),
            beta: joint.link.beta.sin_cos(),
        }
    }

    /// Moves `frame` over this link at kinematic joint variable `variable` and returns the link's axes on the way.
    #[inline]
    fn advance(&self, convention: Convention, variable: f64, error: &Vector3<f64>, frame: &mut Frame) -> LinkAxes {
        let (theta, d) = match self.joint_type {
            JointType::Revolute => (self.link.theta + variable, self.link.d),
            JointType::Prismatic => (self.link.theta, self.link.d + variable),
        };
        let theta = theta + error.z;
        let mut axes = LinkAxes::default();
        let tilt = |frame: &mut Frame| {
            let x = frame.x;
            if error.x != 0.0 {
                frame.rotate_x(error.x.sin_cos());
            }
            let y = frame.y;
            if error.y != 0.0 {
                frame.rotate_y(error.y.sin_cos());
            }
            [x, y]
        };
        match convention {
            Convention::Standard => {
                axes.tilt = tilt(frame);
                axes.z = frame.z;
                axes.z_origin = frame.origin;
                frame.rotate_z(theta.sin_cos());
                frame.origin += frame.z * d + frame.x * self.link.a;
                axes.x = frame.x;
                axes.x_origin = frame.origin;
                frame.rotate_x(self.alpha);
                axes.y = frame.y;
                axes.y_origin = frame.origin;
                frame.rotate_y(self.beta);
            }
            Convention::Modified => {
                axes.x = frame.x;
                axes.x_origin = frame.origin;
                frame.rotate_x(self.alpha);
                frame.origin += frame.x * self.link.a;
                axes.y = frame.y;
                axes.y_origin = frame.origin;
                frame.rotate_y(self.beta);
                axes.tilt = tilt(frame);
                axes.z = frame.z;
                axes.z_origin = frame.origin;
                frame.rotate_z(theta.sin_cos());
                frame.origin += frame.z * d;
            }
        }
        axes
    }
}

impl<'a> ForwardKinematics<'a> {
    /// Prepares a chain.
    pub fn new(chain: &'a KinematicChain) -> Self {
        let flange = chain.flange();
        Self {
            chain,
            links: chain.joints().iter().map(PreparedLink::new).collect(),
            base: Frame::from_isometry(chain.base()),
            flange_rotation: *flange.rotation.to_rotation_matrix().matrix(),
            flange_translation: flange.translation.vector,
            flange_is_identity: *flange == Isometry3::identity(),
            disturbance: if chain.is_loaded() {
                Disturbance::Loads
            } else if chain.errors().iter().any(|error| *error != JointError::default()) {
                Disturbance::Curves
            } else {
                Disturbance::None
            },
        }
    }

    /// The chain that was prepared.
    pub const fn chain(&self) -> &'a KinematicChain {
        self.chain
    }

    /// Pose of the flange in the base at the pendant configuration `q` ((rad) or (m), one entry per joint).
    pub fn base_from_flange(&self, q: &[f64]) -> Isometry3<f64> {
        self.flange_frame(q, |_, _| {}).to_isometry()
    }

    /// Position in the base of a point fixed to the flange (m).
    pub fn point_in_base(&self, q: &[f64], target_in_flange: &Point3<f64>) -> Point3<f64> {
        let flange = self.flange_frame(q, |_, _| {});
        Point3::from(flange.origin + flange.axes() * target_in_flange.coords)
    }

    /// Poses of all link frames in the base, `dof + 2` entries: entry 0 is the first link frame (`base`), entry i the frame
    /// after link i, and the last entry the flange.
    pub fn base_from_links(&self, q: &[f64]) -> Vec<Isometry3<f64>> {
        let mut poses = Vec::with_capacity(self.links.len() + 2);
        poses.push(self.base.to_isometry());
        let mut frame = self.base;
        let errors = self.errors(q);
        for (index, (prepared, joint)) in self.links.iter().zip(self.chain.joints()).enumerate() {
            let error = errors.get(index).copied().unwrap_or_default();
            prepared.advance(self.chain.convention(), joint.variable(index, q), &error, &mut frame);
            poses.push(frame.to_isometry());
        }
        poses.push(self.base_from_flange(q));
        poses
    }

    /// Small rotations of the joints about x, y and z (rad); empty where there are none.
    fn errors(&self, q: &[f64]) -> Vec<Vector3<f64>> {
        match self.disturbance {
            Disturbance::None => Vec::new(),
            Disturbance::Curves | Disturbance::Loads => {
                let of_joints = self.chain.errors().iter().enumerate();
                let loads = if self.disturbance == Disturbance::Loads { self.relative_loads(q) } else { Vec::new() };
                of_joints
                    .map(|(joint, error)| {
                        error.rotation(q.get(joint).copied().unwrap_or(0.0), loads.get(joint).unwrap_or(&UNLOADED))
                    })
                    .collect()
            }
        }
    }

    /// Gravity on each joint relative to the largest; empty without masses.
    pub(super) fn relative_loads(&self, q: &[f64]) -> Vec<JointLoad> {
        self.chain.loads().map_or_else(Vec::new, |loads| loads.relative(&loads.forward(), q))
    }

    /// Frames of the joints before their own rotation, frames at the ends of the links, and the flange.
    pub(super) fn frames(&self, q: &[f64]) -> (Vec<Frame>, Vec<Frame>, Frame) {
        let (mut joints, mut ends) = (Vec::with_capacity(self.links.len()), Vec::with_capacity(self.links.len()));
        let mut frame = self.base;
        for (index, (prepared, joint)) in self.links.iter().zip(self.chain.joints()).enumerate() {
            let variable = joint.variable(index, q);
            let axes = prepared.advance(self.chain.convention(), variable, &Vector3::zeros(), &mut frame);
            joints.push(Frame { x: axes.tilt[0], y: axes.tilt[1], z: axes.z, origin: axes.z_origin });
            ends.push(frame);
        }
        (joints, ends, self.flange_of(frame))
    }

    /// Moves a frame from the base to the flange; `visit` receives the axes of each link on the way.
    #[inline]
    pub(super) fn flange_frame(&self, q: &[f64], mut visit: impl FnMut(usize, &LinkAxes)) -> Frame {
        let mut frame = self.base;
        let convention = self.chain.convention();
        let errors = self.errors(q);
        for (index, (prepared, joint)) in self.links.iter().zip(self.chain.joints()).enumerate() {
            let error = errors.get(index).copied().unwrap_or_default();
            let axes = prepared.advance(convention, joint.variable(index, q), &error, &mut frame);
            visit(index, &axes);
        }
        self.flange_of(frame)
    }

    fn flange_of(&self, mut frame: Frame) -> Frame {
        if !self.flange_is_identity {
            let axes = frame.axes();
            frame.origin += axes * self.flange_translation;
            let axes = axes * self.flange_rotation;
            frame.x = axes.column(0).into();
            frame.y = axes.column(1).into();
            frame.z = axes.column(2).into();
        }
        frame
    }
}
