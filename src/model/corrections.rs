//! `joint-corrections.csv`: what to add to the commanded angle of each joint, for controllers that take such a table.

use super::ModelError;
use super::export::CalibratedArm;
use super::proof::Agreement;
use crate::kinematics::{Joint, JointError, JointType};
use crate::session::summary::JointErrorSummary;
use crate::text::{fixed, listed, printable};
use crate::units::{DEGREE, MICRORADIAN};

/// Distance of the rows (deg).
const STEP: f64 = 1.0;
/// Decimals of the corrections (µrad).
const DECIMALS: usize = 2;
/// Largest difference of a row from the curve after reading it back (rad): rounding.
const ROUNDING: f64 = 0.006 * MICRORADIAN;

/// The columns.
const HEADER: &str = "joint,angle_deg,correction_urad,sigma_urad";

/// A turning joint with its error.
struct Curve<'a> {
    joint: &'a Joint,
    error: &'a JointError,
    summary: &'a JointErrorSummary,
}

impl Curve<'_> {
    /// What to add to the commanded angle `value` (deg) so that the joint reaches it (rad).
    fn correction(&self, value: f64) -> f64 {
        -self.joint.direction * self.error.curve(value * DEGREE)
    }

    /// The whole degrees of the joint's range, and its ends.
    fn values(&self) -> Vec<f64> {
        let (Some((first, ..)), Some((last, ..))) = (self.summary.curve.first(), self.summary.curve.last()) else {
            return Vec::new();
        };
        let mut values = vec![*first];
        let mut value = first.floor() + STEP;
        while value < *last {
            values.push(value);
            value += STEP;
        }
        values.push(*last);
        values
    }
}

fn curves(arm: &CalibratedArm) -> Vec<Curve<'_>> {
    let chain = &arm.identified.chain;
    let joints = chain.joints().iter().zip(chain.errors()).filter(|(joint, _)| joint.joint_type == JointType::Revolute);
    joints
        .filter_map(|(joint, error)| {
            let summary = arm.joint_errors.iter().find(|summary| summary.joint == joint.name)?;
            Some(Curve { joint, error, summary })
        })
        .collect()
}

/// The table, and how well linear interpolation between its rows agrees with the curves after reading it back.
pub(super) fn write(arm: &CalibratedArm) -> Result<(String, Agreement), ModelError> {
    let curves = curves(arm);
    if curves.is_empty() {
        return Err(ModelError::Unsuitable(
            "no errors of joints were identified, so there is nothing to correct besides the geometry".to_owned(),
        ));
    }
    let mut comments = arm.about.clone();
    comments.push(
        "correction_urad: ADD it to the commanded angle (pendant value) of the joint; the joint then turns to the"
            .to_owned(),
    );
    comments.push(
        "angle that was meant. It is minus the angle by which the joint turns too far. sigma_urad: one standard"
            .to_owned(),
    );
    comments
        .push("deviation; it is large where the joint was not measured. Interpolate linearly between rows.".to_owned());
    comments
        .push("The corrections belong to the link constants of calibration.ron, not to those of dh.csv.".to_owned());
    for Curve { joint, summary, .. } in &curves {
        let (from, to) = summary.measured_deg;
        comments.push(format!(
            "{}: measured from {} to {} deg{}",
            joint.name,
            fixed(from, 1),
            fixed(to, 1),
            compliance(summary).map_or_else(String::new, |words| format!("; compliance {words}"))
        ));
    }
    if curves.iter().any(|curve| curve.summary.compliance_urad.is_some()) {
        comments.push(
            "compliance: turn about the joint's axis per gravity torque about it; it is not part of correction_urad."
                .to_owned(),
        );
    }
    let coupled: Vec<&str> = arm
        .identified
        .chain
        .joints()
        .iter()
        .filter(|joint| joint.coupling.iter().any(|factor| *factor != 0.0))
        .map(|joint| joint.name.as_str())
        .collect();
    if !coupled.is_empty() {
        comments.push(format!(
            "{} follow other joints (coupling in the profile): take the couplings out after adding the corrections.",
            listed(&coupled)
        ));
    }
    let mut text: String = comments.iter().flat_map(|line| ["# ", &printable(line), "\n"].map(str::to_owned)).collect();
    text.push_str(HEADER);
    text.push('\n');
    for curve in &curves {
        for value in curve.values() {
            let sigma = curve.summary.at(value).map_or(f64::NAN, |(_, sigma)| sigma);
            let correction = fixed(curve.correction(value) / MICRORADIAN, DECIMALS);
            text += &[quoted(&curve.joint.name), value.to_string(), correction, fixed(sigma, 1)].join(",");
            text.push('\n');
        }
    }
    let agreement = prove(&text, &curves)?;
    Ok((text, agreement))
}

/// `0.84 ± 0.10 urad/Nm (129 ± 15 urad at 153 Nm)`.
fn compliance(summary: &JointErrorSummary) -> Option<String> {
    let ((turn, sigma), torque) = (summary.compliance_urad?, summary.torque_nm?);
    let per_torque = |value: f64| fixed(value / torque, 3);
    Some(format!("{} ± {} urad/Nm ({})", per_torque(turn), per_torque(sigma), summary.gravity_words()?))
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

/// Reads the table and compares it with the curves, at its rows and between them.
fn prove(text: &str, curves: &[Curve<'_>]) -> Result<Agreement, ModelError> {
    let failed = |error: &dyn std::error::Error| ModelError::ReadBack(error.to_string());
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let mut rows: Vec<(String, f64, f64)> = Vec::new();
    for row in reader.deserialize::<(String, f64, f64, Option<f64>)>() {
        let (joint, value, correction, _) = row.map_err(|error| failed(&error))?;
        rows.push((joint, value, correction * MICRORADIAN));
    }
    let mut largest = 0.0_f64;
    for curve in curves {
        let of_joint: Vec<&(String, f64, f64)> = rows.iter().filter(|(name, ..)| *name == curve.joint.name).collect();
        if of_joint.len() != curve.values().len() {
            return Err(ModelError::ReadBack(format!("joint {} has lost rows", curve.joint.name)));
        }
        for (_, value, correction) in &of_joint {
            let off = (correction - curve.correction(*value)).abs();
            // What is not a number differs as well.
            if off.is_nan() || off > ROUNDING {
                return Err(ModelError::ReadBack(format!("joint {} differs at {value} deg", curve.joint.name)));
            }
        }
        for pair in of_joint.windows(2) {
            let [(_, from, low), (_, to, high)] = pair else { continue };
            let between = curve.correction(f64::midpoint(*from, *to));
            largest = largest.max((f64::midpoint(*low, *high) - between).abs());
        }
    }
    Ok(Agreement { position: 0.0, angle: largest })
}
