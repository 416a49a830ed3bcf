//! The simulated cell: a robot, a tracker and an operator.
//!
//! Readings depend only on the seed, the number of the measurement and the request, not on earlier measurements of this
//! object, so that a resumed session sees the same values. One fault needs memory: swapped rows need the previous pose. If the
//! program was restarted between the two measurements, the second one is taken at the right pose.
//!
//! - **Arm.** Nominal plus the hidden deviations ([`HiddenArm`]); free targets are within a few millimetres of their nominal
//!   position, whatever uncertainty the profile states for them.
//!   Where a script asks for them, its joints have curves, compliance, tilt and harmonics of stated sizes, and it carries a payload.
//! - **Tracker.** Within about 0.1 m of its position in the profile, with a random orientation, so that nothing can rely on
//!   its frame.
//! - **Noise.** Normal and independent per coordinate and shot; the stated σ is that of the mean of the shots.
//! - **Time.** Virtual. A measurement takes its settling time, 1 s per shot, and the move to the next pose at a tenth of the
//!   joint speeds. The move to the current pose is not part of the request, so the move to the next one is counted instead.
//! - **Drift.** Grows with a fixed time of 15 s per measurement, for the same reason. After the last affected measurement it
//!   stays constant.

mod random;
mod truth;

use nalgebra::{Isometry3, Point3, Vector3};

pub use truth::HiddenArm;

use super::{Link, LinkError};
use crate::kinematics::{ForwardKinematics, JointType};
use crate::planning::order::Pace;
use crate::profile::{Instrument, JointRange, Profile};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::simulation::{Fault, FaultKind, Simulation};
use crate::units::{DEGREE, INCH, MILLIMETRE, from_mm, to_mm};
use random::{Random, Use};

/// Standard deviation of a coordinate if neither simulation nor profile states one (m).
const DEFAULT_NOISE: f64 = 0.01 * MILLIMETRE;
/// Standard deviation of the tracker's position, per coordinate (m).
const TRACKER_SPREAD: f64 = 0.1;
/// Duration of a whole measurement for the drift (s).
const USUAL_TIME: f64 = 15.0;

/// A cell simulated in this process. It does not report joint values.
#[derive(Clone, Debug)]
pub struct SimulatedCell {
    title: String,
    seed: u64,
    truth: HiddenArm,
    tracker_from_base: Isometry3<f64>,
    joints: Vec<JointRange>,
    noise: Noise,
    faults: Vec<Fault>,
    /// Number and configuration of the previous measurement.
    previous: Option<(u64, Vec<f64>)>,
}

/// Scatter of the instrument.
#[derive(Clone, Debug)]
enum Noise {
    /// Standard deviation of each coordinate (m).
    Constant(f64),
    /// Dependent on the distance.
    Instrument(Instrument),
}

impl SimulatedCell {
    /// The cell of a profile.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: invalid noise, errors of joints that the arm cannot have, a fault of a joint that the arm does not have or with the wrong unit, or the
    /// deviations of the method paper for another arm.
    pub fn new(profile: &Profile, simulation: &Simulation) -> Result<Self, LinkError> {
        let noise = match (simulation.noise_mm, profile.instrument()) {
            (Some(noise), _) if !(noise.is_finite() && noise >= 0.0) => {
                return Err(LinkError::SetUp(format!("the noise is {noise} mm; it must be a number of at least 0")));
            }
            (Some(noise), _) => Noise::Constant(from_mm(noise)),
            (None, Some(instrument)) => Noise::Instrument(instrument.clone()),
            (None, None) => Noise::Constant(DEFAULT_NOISE),
        };
        for fault in &simulation.faults {
            check_fault(fault, profile)?;
        }
        let seed = simulation.seed;
        let place = profile.tracker().position_in_base;
        let base_from_tracker = Random::new(seed, Use::Tracker).frame_near(&place, TRACKER_SPREAD);
        Ok(Self {
            title: profile.title().to_owned(),
            seed,
            truth: truth::hidden_arm(profile, simulation, base_from_tracker)?,
            tracker_from_base: base_from_tracker.inverse(),
            joints: profile.joints().to_vec(),
            noise,
            faults: simulation.faults.clone(),
            previous: None,
        })
    }

    /// The true cell, which the identification should find.
    pub const fn truth(&self) -> &HiddenArm {
        &self.truth
    }

    /// Kinds of the faults of measurement `number`, each with the measurement whose random values it uses.
    fn faults(&self, number: u64) -> impl Iterator<Item = (FaultKind, u64)> {
        self.faults.iter().filter(move |fault| fault.affects(number)).map(move |fault| {
            // A lasting fault is drawn once, a recurring one for each measurement.
            (fault.kind, if fault.kind.lasts() { fault.first } else { number })
        })
    }

    /// Actual joint values of the robot, which differ from the requested ones in some faults.
    pub(super) fn actual_joints(&self, request: &MeasureRequest) -> Vec<f64> {
        let mut here = request.configuration.clone();
        for fault in &self.faults {
            let is_second = fault.first.checked_add(1) == Some(request.number);
            if fault.kind == FaultKind::SwappedRows
                && is_second
                && let Some((before, configuration)) = &self.previous
                && *before == fault.first
            {
                here.clone_from(configuration);
            }
        }
        for (kind, number) in self.faults(request.number) {
            match kind {
                FaultKind::SwappedRows => here = request.following.clone().unwrap_or(here),
                FaultKind::WrongPose => {
                    here = request
                        .following
                        .clone()
                        .unwrap_or_else(|| self.random_configuration(Use::Fault(kind, number)));
                }
                _ => {}
            }
        }
        // Joint faults apply at any pose, so they come after the faults that choose the pose.
        for (kind, _) in self.faults(request.number) {
            match kind {
                FaultKind::MistypedJoint { joint, by, quantity } => {
                    if let Some(value) = here.get_mut(joint) {
                        *value += quantity.from_edge(by);
                    }
                }
                FaultKind::JointUnit { joint, factor } => {
                    if let Some(value) = here.get_mut(joint) {
                        *value *= factor;
                    }
                }
                FaultKind::JointCoupling { joint, with, factor } => {
                    let other = here.get(with).copied().unwrap_or(0.0);
                    if let Some(value) = here.get_mut(joint) {
                        *value += factor * other;
                    }
                }
                FaultKind::JointSign { joint } => {
                    if let Some(value) = here.get_mut(joint) {
                        *value = -*value;
                    }
                }
                _ => {}
            }
        }
        here
    }

    /// A random configuration within the joint limits.
    fn random_configuration(&self, of: Use) -> Vec<f64> {
        let mut random = Random::new(self.seed, of);
        let joints = self.truth.arm.chain.joints().iter().zip(&self.joints);
        joints
            .map(|(joint, range)| {
                let reach = default_reach(joint.joint_type);
                let (low, high) = range.planning_limits.or(range.limits).unwrap_or((-reach, reach));
                random.between(low, high)
            })
            .collect()
    }

    /// Position of the SMR in the tracker frame (m), without noise.
    fn true_point(&self, request: &MeasureRequest) -> Option<Point3<f64>> {
        let mut target = *self.truth.arm.targets.get(request.target)?;
        for (kind, number) in self.faults(request.number) {
            if let FaultKind::TargetBumped { by_mm } = kind {
                target += self.direction(kind, number) * from_mm(by_mm);
            }
        }
        let arm = ForwardKinematics::new(&self.truth.arm.chain);
        Some(self.tracker_from_base * arm.point_in_base(&self.actual_joints(request), &target))
    }

    /// Random direction of a fault.
    fn direction(&self, kind: FaultKind, number: u64) -> Vector3<f64> {
        Random::new(self.seed, Use::Fault(kind, number)).direction()
    }

    /// Common offset of all shots (m), and the RMS vector of the motion between them (m).
    fn errors(&self, number: u64) -> (Vector3<f64>, Vector3<f64>) {
        let (mut offset, mut motion) = (Vector3::zeros(), Vector3::zeros());
        for (kind, drawn_for) in self.faults(number) {
            let by = |millimetres| self.direction(kind, drawn_for) * from_mm(millimetres);
            match kind {
                FaultKind::Outlier { by_mm } => offset += by(by_mm),
                FaultKind::NotAtRest { by_mm } => {
                    offset += by(by_mm);
                    motion += by(by_mm);
                }
                _ => {}
            }
        }
        // After its last measurement the drift stays constant.
        for fault in self.faults.iter().filter(|fault| fault.first < number) {
            if let FaultKind::Drift { mm_per_hour } = fault.kind {
                let measurements = number.min(fault.last.unwrap_or(number)).saturating_sub(fault.first);
                let hours = measurements as f64 * USUAL_TIME / 3600.0;
                offset += self.direction(fault.kind, fault.first) * from_mm(mm_per_hour * hours);
            }
        }
        (offset, motion)
    }

    /// Factor that results from reading the instrument's numbers in the wrong unit.
    fn unit_factor(&self, number: u64) -> f64 {
        self.faults(number).fold(1.0, |factor, (kind, _)| match kind {
            FaultKind::Inch => factor * MILLIMETRE / INCH,
            FaultKind::Metre => factor * MILLIMETRE,
            _ => factor,
        })
    }

    /// Duration of a measurement and of the move to the next pose (s).
    pub(super) fn time(&self, request: &MeasureRequest, shots: u32) -> f64 {
        let onward = request.following.as_deref().unwrap_or(&request.configuration);
        let max_speeds = self.joints.iter().map(|joint| joint.max_speed).collect();
        let pace = Pace { max_speeds, ..Pace::default() };
        let joint_types = self.truth.arm.chain.joints().iter().map(|joint| joint.joint_type);
        pace.move_time(joint_types, &request.configuration, onward) + request.settle + f64::from(shots) * pace.shot
    }

    fn check(&self, request: &MeasureRequest) -> Result<(), LinkError> {
        let joints = self.truth.arm.chain.dof();
        let poses = [Some(&request.configuration), request.following.as_ref()];
        for configuration in poses.into_iter().flatten() {
            if configuration.len() != joints || !configuration.iter().all(|value| value.is_finite()) {
                return Err(LinkError::SetUp(format!(
                    "pose {} is not a configuration of the simulated arm: it has {joints} joints",
                    request.pose
                )));
            }
        }
        Ok(())
    }
}

/// Range of a joint without limits, to both sides of zero (rad or m).
const fn default_reach(joint_type: JointType) -> f64 {
    match joint_type {
        JointType::Revolute => 90.0 * DEGREE,
        JointType::Prismatic => 0.1,
    }
}

/// Checks that the arm has the joint of a fault.
fn check_fault(fault: &Fault, profile: &Profile) -> Result<(), LinkError> {
    let (joint, quantity) = match fault.kind {
        FaultKind::JointSign { joint } | FaultKind::JointUnit { joint, .. } => (joint, None),
        FaultKind::JointCoupling { joint, with, .. } => (joint.max(with), None),
        FaultKind::MistypedJoint { joint, quantity, .. } => (joint, Some(quantity)),
        _ => return Ok(()),
    };
    let joints = profile.chain().joints();
    let Some(found) = joints.get(joint) else {
        return Err(LinkError::SetUp(format!("fault '{fault}': '{}' has {} joints", profile.name(), joints.len())));
    };
    let needed = found.joint_type.quantity();
    if quantity.is_some_and(|quantity| quantity != needed) {
        return Err(LinkError::SetUp(format!("fault '{fault}': joint {} is in {}", found.name, needed.unit())));
    }
    Ok(())
}

impl Link for SimulatedCell {
    fn connect(&mut self) -> Result<String, LinkError> {
        let noise = match &self.noise {
            Noise::Constant(sigma) => format!("noise {} mm", to_mm(*sigma)),
            Noise::Instrument(instrument) => format!("{}, {}", instrument.name, instrument.sigma_text()),
        };
        Ok(format!("simulated cell: {}, {noise}, seed {}", self.title, self.seed))
    }

    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError> {
        if !keep_going() {
            return Err(LinkError::Cancelled);
        }
        let (shots, sigma) = self.single_shots(request)?;
        let count = u32::try_from(shots.len()).unwrap_or(u32::MAX);
        let mean = shots.iter().sum::<Vector3<f64>>() / f64::from(count);
        let square = shots.iter().map(|shot| (shot - mean).norm_squared()).sum::<f64>() / f64::from(count);
        Ok(Reading {
            point: Point3::from(mean),
            sigma: (sigma > 0.0).then(|| sigma / f64::from(count).sqrt()),
            scatter: (count > 1).then(|| square.sqrt()),
            shots: count,
            temperature: None,
            pressure: None,
            humidity: None,
            configuration: None,
            joint_scatter: None,
            remarks: Vec::new(),
            seconds: self.time(request, count),
        })
    }
}

impl SimulatedCell {
    /// The shots of a measurement in the tracker frame (m) and their σ per coordinate (m).
    ///
    /// # Errors
    /// The request does not fit this cell, or the beam is broken.
    pub(super) fn single_shots(&mut self, request: &MeasureRequest) -> Result<(Vec<Vector3<f64>>, f64), LinkError> {
        self.check(request)?;
        let true_point = self.true_point(request);
        self.previous = Some((request.number, request.configuration.clone()));
        let Some(true_point) = true_point else {
            return Err(LinkError::SetUp(format!("the simulated arm has no target {}", request.target + 1)));
        };
        if self.faults(request.number).any(|(kind, _)| kind == FaultKind::BeamBreak) {
            return Err(LinkError::BeamBroken);
        }
        let sigma = match &self.noise {
            Noise::Constant(sigma) => *sigma,
            Noise::Instrument(instrument) => instrument.sigma_at(true_point.coords.norm()),
        };
        let (offset, motion) = self.errors(request.number);
        let count = request.shots.max(1);
        let mut random = Random::new(self.seed, Use::Noise(request.number));
        let factor = self.unit_factor(request.number);
        let shots = along_line(count)
            .map(|position| (true_point.coords + offset + motion * position + random.normals() * sigma) * factor)
            .collect();
        Ok((shots, sigma * factor))
    }
}

/// Evenly spaced positions with mean 0 and mean square 1 (a single one is 0).
fn along_line(count: u32) -> impl Iterator<Item = f64> {
    let n = f64::from(count);
    let step = if count > 1 { (12.0 / (n * n - 1.0)).sqrt() } else { 0.0 };
    (0..count).map(move |index| (f64::from(index) - (n - 1.0) / 2.0) * step)
}

#[cfg(test)]
mod tests;
