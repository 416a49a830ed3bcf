//! How well a calibration knows the arm at a target: the error that its own samples predict there.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3};

use crate::identification::predicted::Forecast;
use crate::kinematics::{Arm, FreeParameter, Place};
use crate::model::CalibratedArm;
use crate::session::calibration::Calibration;
use crate::units::from_mm;

/// Predicts the error of the identified arm.
#[derive(Debug)]
pub(super) struct Uncertainty {
    forecast: Forecast,
    /// Standard deviation of what differs from pose to pose (m).
    poses: f64,
}

impl Uncertainty {
    /// From the samples of a calibration; `None` if it has none.
    pub(super) fn new(calibration: &Calibration, arm: &CalibratedArm) -> Option<Self> {
        let dof = arm.identified.chain.dof();
        let joints = arm.identified.chain.joints();
        let mut seen = BTreeSet::new();
        let mut places = Vec::new();
        for sample in &calibration.samples {
            let is_usable = sample.joints.len() == dof && sample.target < arm.identified.targets.len();
            // Readings of one pose share its error: they count once.
            let bits: Vec<u64> = sample.joints.iter().map(|value| value.to_bits()).collect();
            if is_usable && seen.insert((sample.target, bits)) {
                let pairs = sample.joints.iter().zip(joints);
                let configuration = pairs.map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect();
                places.push(Place { configuration, target: sample.target });
            }
        }
        if places.is_empty() || calibration.parameters.is_empty() {
            return None;
        }
        let free = calibration.parameters.iter().map(|parameter| FreeParameter {
            id: parameter.id,
            expected: parameter.unit.from_edge(parameter.expected),
        });
        let free: Vec<FreeParameter> = free.collect();
        let identified = Arm { chain: arm.identified.chain.clone(), targets: arm.identified.targets.clone() };
        let mut forecast = Forecast::new(&identified, &free, &[], from_mm(calibration.sigma.used_mm));
        for place in &places {
            forecast.measure(place);
        }
        Some(Self { forecast, poses: from_mm(calibration.sigma.poses_mm.unwrap_or(0.0)) })
    }

    /// Root mean square error predicted for the end of a tool at a configuration (m).
    pub(super) fn at(&self, q: &[f64], flange_from_tool: &Isometry3<f64>) -> f64 {
        let known = self.forecast.error_at(q, &Point3::from(flange_from_tool.translation.vector));
        known.hypot(3.0_f64.sqrt() * self.poses)
    }
}
