//! Gravity on the joints: the masses that the links carry, the payload, and how the base is mounted.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use super::{Convention, ForwardKinematics, KinematicChain};

/// Gravitational acceleration (m/s²).
pub const GRAVITY: f64 = 9.81;
/// Configurations at which the largest load is looked for.
const LOAD_SAMPLES: usize = 4096;
/// Their square roots are irrational parts that have nothing in common.
const PRIMES: [u8; 10] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29];
/// A joint with less gravity torque than this (N·m) has no compliance to find.
pub(super) const NO_TORQUE: f64 = 1e-3;

/// A mass that a link or the flange carries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkMass {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the frame at the end of the link, or in the flange frame (m).
    pub centre: Point3<f64>,
}

/// What the coefficients of compliance and tilt are relative to. It belongs to an identification: a coefficient is the angle at
/// these loads, whatever the arm carries later.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadScale {
    /// Largest gravity torque about the axis of each joint (N·m).
    pub torques: Vec<f64>,
    /// Largest gravity moment of the arm (N·m).
    pub moment: f64,
}

/// Gravity on the joints of the nominal arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Loads {
    nominal: KinematicChain,
    links: Vec<LinkMass>,
    payload: LinkMass,
    gravity: Vector3<f64>,
    scale: LoadScale,
}

/// Gravity on one joint (N·m), or relative to a [`LoadScale`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLoad {
    /// Torque about the joint's axis.
    pub torque: f64,
    /// Moment about x and y of the joint's frame before its own rotation.
    pub moment: [f64; 2],
}

impl Loads {
    /// The loads of the arm `nominal` whose links carry `links`, with `payload` in the flange frame. `down` is the direction of
    /// gravity in the base. `ranges` are the limits of the pendant joints, over which the largest loads are taken as the scale.
    pub fn new(
        nominal: &KinematicChain,
        links: Vec<LinkMass>,
        payload: LinkMass,
        down: Vector3<f64>,
        ranges: &[(f64, f64)],
    ) -> Self {
        let gravity = down.try_normalize(f64::EPSILON).unwrap_or_else(|| -Vector3::z()) * GRAVITY;
        let scale = LoadScale::default();
        let loads = Self { nominal: nominal.without_errors(), links, payload, gravity, scale };
        let scale = loads.largest(ranges);
        Self { scale, ..loads }
    }

    /// The same arm with another payload. The scale stays, so that coefficients keep their meaning.
    #[must_use]
    pub fn with_payload(&self, payload: LinkMass) -> Self {
        Self { payload, ..self.clone() }
    }

    /// The same loads relative to another scale, such as that of an earlier identification.
    #[must_use]
    pub fn with_scale(&self, scale: LoadScale) -> Self {
        Self { scale, ..self.clone() }
    }

    /// Masses of the links, one per joint.
    pub fn links(&self) -> &[LinkMass] {
        &self.links
    }

    /// What the flange carries.
    pub const fn payload(&self) -> LinkMass {
        self.payload
    }

    /// The loads at which coefficients are angles.
    pub const fn scale(&self) -> &LoadScale {
        &self.scale
    }

    /// Largest gravity torque about the axis of a joint (N·m): what one unit of its compliance term stands for.
    pub fn largest_torque(&self, joint: usize) -> f64 {
        self.scale.torques.get(joint).copied().unwrap_or(0.0)
    }

    /// Largest gravity moment of the arm (N·m).
    pub const fn largest_moment(&self) -> f64 {
        self.scale.moment
    }

    /// Whether gravity ever turns the joint.
    pub fn turns(&self, joint: usize) -> bool {
        self.largest_torque(joint) > NO_TORQUE
    }

    /// Gravity on every joint at the pendant configuration `q`.
    pub fn at(&self, q: &[f64]) -> Vec<JointLoad> {
        self.at_with(&self.forward(), q)
    }

    fn at_with(&self, forward: &ForwardKinematics<'_>, q: &[f64]) -> Vec<JointLoad> {
        let (joints, ends, flange) = forward.frames(q);
        let mut mass = self.payload.mass;
        let mut weighted = (flange.origin + flange.axes() * self.payload.centre.coords) * mass;
        let mut loads = vec![JointLoad::default(); joints.len()];
        for (joint, frame) in joints.iter().enumerate().rev() {
            if let Some(link) = self.links.get(joint) {
                weighted += (ends[joint].origin + ends[joint].axes() * link.centre.coords) * link.mass;
                mass += link.mass;
            }
            let moment = (weighted - frame.origin * mass).cross(&self.gravity);
            loads[joint] =
                JointLoad { torque: frame.z.dot(&moment), moment: [frame.x.dot(&moment), frame.y.dot(&moment)] };
        }
        loads
    }

    /// The largest loads over these ranges of the pendant joints.
    fn largest(&self, ranges: &[(f64, f64)]) -> LoadScale {
        let dof = self.nominal.dof();
        let forward = self.forward();
        let mut scale = LoadScale { torques: vec![0.0; dof], moment: 0.0 };
        // Evenly spread without a pattern: multiples of irrational parts of each range.
        let part = |joint: usize| f64::from(PRIMES[joint % PRIMES.len()]).sqrt().fract();
        for sample in 0..LOAD_SAMPLES {
            let q: Vec<f64> = (0..dof)
                .map(|joint| {
                    let (low, high) = ranges.get(joint).copied().unwrap_or((-PI, PI));
                    low + (high - low) * ((sample as f64 + 0.5) * part(joint)).fract()
                })
                .collect();
            for (largest, JointLoad { torque, moment }) in scale.torques.iter_mut().zip(self.at_with(&forward, &q)) {
                *largest = largest.max(torque.abs());
                scale.moment = scale.moment.max(moment[0].hypot(moment[1])).max(torque.abs());
            }
        }
        scale
    }

    pub(super) fn forward(&self) -> ForwardKinematics<'_> {
        ForwardKinematics::new(&self.nominal)
    }

    /// Loads of every joint relative to the scale.
    pub(super) fn relative(&self, forward: &ForwardKinematics<'_>, q: &[f64]) -> Vec<JointLoad> {
        let loads = self.at_with(forward, q).into_iter().enumerate();
        let over = |value: f64, largest: f64| if largest > NO_TORQUE { value / largest } else { 0.0 };
        loads
            .map(|(joint, JointLoad { torque, moment })| JointLoad {
                torque: over(torque, self.largest_torque(joint)),
                moment: moment.map(|moment| over(moment, self.scale.moment)),
            })
            .collect()
    }
}

impl KinematicChain {
    /// The same arm under gravity.
    #[must_use]
    pub fn with_loads(self, loads: Loads) -> Self {
        self.loaded(Some(Arc::new(loads)))
    }

    /// The same arm with another payload on its flange, relative to the same scale; unchanged if its masses are unknown.
    #[must_use]
    pub fn with_payload(self, payload: LinkMass) -> Self {
        match self.loads().map(|loads| loads.with_payload(payload)) {
            Some(loads) => self.with_loads(loads),
            None => self,
        }
    }

    /// The same arm with the meaning that coefficients had in an earlier identification; unchanged if its masses are unknown.
    #[must_use]
    pub fn with_load_scale(self, scale: LoadScale) -> Self {
        match self.loads().map(|loads| loads.with_scale(scale)) {
            Some(loads) => self.with_loads(loads),
            None => self,
        }
    }

    /// A rough split of the arm's weight (kg) over its links, for arms whose maker publishes only the total.
    ///
    /// Half of the weight is drives, half is structure. A drive weighs in proportion to the reach of the arm beyond its joint, which
    /// sets its torque; half of it belongs to the link before the joint and half to the link after. The structure between two joints
    /// weighs in proportion to its length times the mean reach beyond it, with its centre in the middle. Reach and length count along
    /// the joints' origins. What belongs to the base carries no load and is left out.
    pub fn split_weight(&self, weight: f64) -> Vec<LinkMass> {
        let (origins, ends) = self.origins_and_ends();
        let lengths: Vec<f64> = origins.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let reach = |joint: usize| lengths[joint.min(lengths.len())..].iter().sum::<f64>();
        let structure = |joint: usize| lengths[joint] * f64::midpoint(reach(joint), reach(joint + 1));
        let drives: f64 = (0..self.dof()).map(reach).sum();
        let structures: f64 = (0..self.dof()).map(structure).sum();
        if !(drives > 0.0 && structures > 0.0) {
            return vec![LinkMass::default(); self.dof()];
        }
        (0..self.dof())
            .map(|joint| {
                let (near, far) = (origins[joint], origins[joint + 1]);
                let parts = [
                    (near, weight / 4.0 * reach(joint) / drives),
                    (nalgebra::center(&near, &far), weight / 2.0 * structure(joint) / structures),
                    (far, weight / 4.0 * reach(joint + 1) / drives),
                ];
                let mass: f64 = parts.iter().map(|(_, mass)| mass).sum();
                let weighted: Vector3<f64> = parts.iter().map(|(place, mass)| place.coords * *mass).sum();
                let centre = if mass > 0.0 { Point3::from(weighted / mass) } else { near };
                LinkMass { mass, centre: ends[joint].inverse_transform_point(&centre) }
            })
            .collect()
    }

    /// Origins of the joints and of the flange, and the frames at the ends of the links, at joint values zero.
    fn origins_and_ends(&self) -> (Vec<Point3<f64>>, Vec<Isometry3<f64>>) {
        let frames = ForwardKinematics::new(self).base_from_links(&vec![0.0; self.dof()]);
        let (ends, flange) = (&frames[1..=self.dof()], &frames[self.dof() + 1]);
        let origin = |joint: usize| match self.convention() {
            Convention::Standard => Point3::from(frames[joint].translation.vector),
            // The last step of a link goes along its joint's axis.
            Convention::Modified => ends[joint] * Point3::new(0.0, 0.0, -self.joints()[joint].link.d),
        };
        let origins = (0..self.dof()).map(origin).chain([Point3::from(flange.translation.vector)]);
        (origins.collect(), ends.to_vec())
    }
}
