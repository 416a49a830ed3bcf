//! Robot profiles: a RON text that describes arm, targets, instrument, acceptance limits and cell, as checked values.
//!
//! [`Profile::parse`] finds all problems of a text in one pass and shows each with line and caret; a [`Profile`] is always
//! consistent. Values are in metres, radians and seconds; the text uses millimetres and degrees, stated in the field names.
//! Points are in the flange frame (targets), a link frame (bodies) or the robot base (floor, boxes, tracker), as documented.
//!
//! This module does not read files; it turns text into values and messages.

mod builtin;
mod cell;
pub mod cell_text;
mod check;
pub mod datasheet;
mod decode;
mod diagnostic;
mod expected;
mod gaps;
mod masses;
mod retarget;
mod schema;
mod syntax;
mod text;
pub mod wire;

use clap::ValueEnum;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

pub use builtin::{builtin, builtin_names};
pub use cell::{Capsule, Instrument, KeepOut, Tracker};
pub use cell_text::{BoxText, CellText};
pub use diagnostic::{Diagnostic, ProfileErrors, Severity};
pub use expected::{ExpectedDeviation, ExpectedDeviations};
pub use gaps::Gap;
pub use masses::{Masses, Mounting};
pub use retarget::with_targets;
pub use text::{check_text, list_text, show_text};

use wire::LinkSettings;

use crate::kinematics::{Arm, FreeParameter, JointType, KinematicChain, LinkMass, LinkParameter, ParameterId};
use crate::text::{names_of_option, written_as_text};

/// Angle below which neighbouring axes count as parallel (rad): 1°, far above any assembly error and far below any design angle.
pub const PARALLEL_TOLERANCE: f64 = crate::units::DEGREE;

/// Default uncertainty of a target position (m): 50 mm, the size of a flange adapter.
pub const FREE_TARGET_UNCERTAINTY: f64 = 50.0 * crate::units::MILLIMETRE;

/// How far a revolute joint turns to either side in a plan, unless the profile states planning limits (rad).
const HALF_TURN: f64 = std::f64::consts::PI;

/// A checked description of a robot in its cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    name: String,
    title: String,
    source: String,
    /// Under gravity, if the masses are given.
    chain: KinematicChain,
    masses: Masses,
    mounting: Mounting,
    payload: Option<LinkMass>,
    joints: Vec<JointRange>,
    joint_aliases: Vec<Vec<String>>,
    base_from_world: Isometry3<f64>,
    beta_joints: Vec<usize>,
    fixed_parameters: Vec<ParameterId>,
    targets: Vec<Target>,
    expected_deviations: ExpectedDeviations,
    acceptance: Acceptance,
    instrument: Option<Instrument>,
    link: Option<LinkSettings>,
    bodies: Vec<Capsule>,
    floor: Option<f64>,
    keep_out: Vec<KeepOut>,
    tracker: Tracker,
}

/// Limits of a joint in pendant values: (rad) and (rad/s) for a revolute joint, (m) and (m/s) for a prismatic one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointRange {
    /// Lowest and highest value; `None` if the profile gives none.
    pub limits: Option<(f64, f64)>,
    /// Range for measuring poses, inside `limits`; if the profile gives none, that of [`Self::usual_planning_limits`].
    pub planning_limits: Option<(f64, f64)>,
    /// Highest speed.
    pub max_speed: Option<f64>,
    /// Encoder pulses per degree of the joint (revolute only): joint offsets can be shown in pulses.
    pub pulses_per_degree: Option<f64>,
}

impl JointRange {
    /// The range for measuring poses of a joint whose profile states only its limits: what of them lies within ±180°. Cables and
    /// hoses seldom follow a wrist that turns farther, and no pose needs it.
    pub fn usual_planning_limits(joint_type: JointType, limits: (f64, f64)) -> (f64, f64) {
        let (low, high) = (limits.0.max(-HALF_TURN), limits.1.min(HALF_TURN));
        match joint_type {
            JointType::Revolute if low < high => (low, high),
            JointType::Revolute | JointType::Prismatic => limits,
        }
    }
}

/// An SMR on the flange.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name in tables.
    pub name: String,
    /// Centre of the SMR in the flange frame (m).
    pub position_in_flange: Point3<f64>,
    /// Standard deviation expected of each coordinate (m); zero: taken as exact and not identified.
    pub uncertainty: f64,
    /// Direction that the SMR faces, in the flange frame.
    pub axis_in_flange: Unit<Vector3<f64>>,
}

impl Target {
    /// An SMR whose place nobody has stated.
    pub fn beside_the_flange(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            position_in_flange: Point3::origin(),
            uncertainty: FREE_TARGET_UNCERTAINTY,
            axis_in_flange: Vector3::z_axis(),
        }
    }

    /// Whether the position is identified together with the arm.
    pub fn is_free(&self) -> bool {
        self.uncertainty > 0.0
    }
}

/// Limits for the verification of an identified arm (m); `None`: no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Acceptance {
    /// Mean position error.
    pub position_mean: Option<f64>,
    /// RMS position error.
    pub position_rms: Option<f64>,
    /// Largest position error.
    pub position_max: Option<f64>,
    /// Mean distance error.
    pub distance_mean: Option<f64>,
    /// RMS distance error.
    pub distance_rms: Option<f64>,
    /// Largest distance error.
    pub distance_max: Option<f64>,
}

/// Which parameters are identified: θ of revolute and d of prismatic joints alone, all link constants, with β where the profile
/// has it, or the errors of the joints as well. The comments on the values are the help of `--level`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Level {
    /// Level 3 as far as the data support it: all link constants, and those errors of the joints that predict better
    #[default]
    Auto,
    /// Level 1: joint offsets
    Offsets,
    /// Level 2: all link constants
    Geometric,
    /// Level 3: all link constants and all errors of the joints, whatever the data support
    Full,
}

names_of_option!(Level);
written_as_text!(Level);

impl Profile {
    /// Reads a profile. `file_name` is used only in messages.
    ///
    /// # Errors
    /// All problems of the text, including warnings, if at least one makes the profile unusable; otherwise the warnings
    /// come with the profile.
    pub fn parse(text: &str, file_name: &str) -> Result<(Self, Vec<Diagnostic>), ProfileErrors> {
        schema::parse(text, file_name)
    }

    /// Short name: lower-case letters, digits, `_` and `-`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name for people, one line.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Source of the values, in one line.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Links and joints of the nominal arm, with gravity on them if the masses are given.
    pub const fn chain(&self) -> &KinematicChain {
        &self.chain
    }

    /// The nominal arm with its targets.
    pub fn arm(&self) -> Arm {
        let targets = self.targets.iter().map(|target| target.position_in_flange).collect();
        Arm { chain: self.chain.clone(), targets }
    }

    /// Limits and speeds, one entry per joint of the chain.
    pub fn joints(&self) -> &[JointRange] {
        &self.joints
    }

    /// Further names of each joint, such as those of common URDFs, from base to flange.
    pub fn joint_aliases(&self) -> &[Vec<String>] {
        &self.joint_aliases
    }

    /// The frame in which the controller gives Cartesian positions, in the base of the arm. They differ where a maker puts its
    /// origin on axis 2.
    pub const fn base_from_world(&self) -> &Isometry3<f64> {
        &self.base_from_world
    }

    /// Masses of the arm.
    pub const fn masses(&self) -> &Masses {
        &self.masses
    }

    /// How the base is mounted.
    pub const fn mounting(&self) -> Mounting {
        self.mounting
    }

    /// What the flange carries, if the profile says.
    pub const fn payload(&self) -> Option<LinkMass> {
        self.payload
    }

    /// Joints whose link has a β to identify, from 0, ascending.
    pub fn beta_joints(&self) -> &[usize] {
        &self.beta_joints
    }

    /// Parameters that are never identified.
    pub fn fixed_parameters(&self) -> &[ParameterId] {
        &self.fixed_parameters
    }

    /// The targets; at least one.
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Sizes of the prior.
    pub const fn expected_deviations(&self) -> &ExpectedDeviations {
        &self.expected_deviations
    }

    /// Limits for the verification.
    pub const fn acceptance(&self) -> &Acceptance {
        &self.acceptance
    }

    /// The measuring instrument, if its uncertainty is known.
    pub const fn instrument(&self) -> Option<&Instrument> {
        self.instrument.as_ref()
    }

    /// Link to the instrument, if the profile states one.
    pub const fn link(&self) -> Option<&LinkSettings> {
        self.link.as_ref()
    }

    /// Capsules around the links.
    pub fn bodies(&self) -> &[Capsule] {
        &self.bodies
    }

    /// Height of the floor: z in the robot base (m). A profile of an upright arm that states none has it at the base.
    pub const fn floor(&self) -> Option<f64> {
        self.floor
    }

    /// Boxes that the arm must not enter.
    pub fn keep_out(&self) -> &[KeepOut] {
        &self.keep_out
    }

    /// Position of the tracker and limits of its line of sight.
    pub const fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// The robot with target `index` replaced; unchanged if there is none.
    #[must_use]
    pub fn with_target(&self, index: usize, target: Target) -> Self {
        let mut changed = self.clone();
        if let Some(place) = changed.targets.get_mut(index) {
            *place = target;
        }
        changed
    }

    /// The robot with a tracker at another place (m, in the base).
    #[must_use]
    pub fn with_tracker_at(&self, position_in_base: Point3<f64>) -> Self {
        let mut changed = self.clone();
        changed.tracker.position_in_base = position_in_base;
        changed
    }

    /// The robot with another payload. What compliance and tilt are relative to is computed again, as for an identification at this load;
    /// an arm that is identified already changes its payload by [`KinematicChain::with_payload`].
    #[must_use]
    pub fn with_payload(&self, payload: LinkMass) -> Self {
        Self { payload: Some(payload), ..self.clone() }.under_gravity()
    }

    /// The robot with the gravity that its masses, its payload and its mounting make.
    fn under_gravity(mut self) -> Self {
        if let Some(loads) = self.masses.loads(&self.chain, self.payload, self.mounting, &self.joints) {
            self.chain = self.chain.with_loads(loads);
        }
        self
    }

    /// The parameters that a level identifies, in the order of equation (19) of the method paper: α, a, d, θ joint by joint,
    /// then the β's, then the coordinates of targets that are not taken as exact. Fixed parameters are left out.
    pub fn parameters(&self, level: Level) -> Vec<FreeParameter> {
        let joints = || self.chain.joints().iter().enumerate();
        let mut ids: Vec<ParameterId> = match level {
            Level::Offsets => joints()
                .map(|(index, joint)| ParameterId::Link {
                    joint: index,
                    parameter: LinkParameter::joint_offset(joint.joint_type),
                })
                .collect(),
            // The errors of the joints are selected from the data.
            Level::Auto | Level::Geometric | Level::Full => {
                let constants = [LinkParameter::Alpha, LinkParameter::A, LinkParameter::D, LinkParameter::Theta];
                let links = joints().flat_map(|(joint, _)| constants.map(|parameter| (joint, parameter)));
                let betas = self.beta_joints.iter().map(|joint| (*joint, LinkParameter::Beta));
                links.chain(betas).map(|(joint, parameter)| ParameterId::Link { joint, parameter }).collect()
            }
        };
        let free_targets = self.targets.iter().enumerate().filter(|(_, target)| target.is_free());
        ids.extend(free_targets.flat_map(|(target, _)| ParameterId::of_target(target)));
        ids.retain(|id| !self.fixed_parameters.contains(id));
        let free = |id| FreeParameter { id, expected: self.expected_deviations.of(id, &self.chain, &self.targets) };
        ids.into_iter().map(free).collect()
    }
}

#[cfg(test)]
mod tests;
