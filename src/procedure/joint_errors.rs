//! What was found about the errors of the joints, for people: which were kept and why, the curve of each joint, and the joints that
//! somebody should look at.

use nalgebra::DVector;

use super::summary::parameter_summaries;
use super::workspace::ranges;
use crate::identification::verification::{DirectErrors, ErrorStatistics, FittedSetup, ModelErrors};
use crate::identification::{Identification, Problem, Scored, Settings, Terms, WithTerms};
use crate::kinematics::{JointTerm, JointType, KinematicChain, ParameterId, SMOOTH_ORDERS};
use crate::profile::Profile;
use crate::report::number;
use crate::session::summary::{
    CandidateSummary, Cause, JointErrorSummary, ParameterSummary, SelectionSummary, ShareSummary, Warning, WarningCode,
};
use crate::units::{DEGREE, MICRORADIAN, to_deg, to_mm};

/// Distance of the values that a curve is drawn at (rad): a few per cycle of its highest harmonics.
const STEP: f64 = 2.0 * DEGREE;
/// A joint whose curve is larger than this where it was measured (rad, rms) has a gear worth looking at.
const LARGE_CURVE: f64 = 600.0 * MICRORADIAN;
/// The same where it is so many times the median of the joints.
const LARGE_FOR_THE_ARM: f64 = 4.0;
/// A smaller curve is never unusual (rad, rms).
const SMALL_CURVE: f64 = 250.0 * MICRORADIAN;
/// A joint that turns more than this at its largest gravity torque (rad) is unusually soft.
const SOFT: f64 = 3.0e-3;
/// So many standard deviations make a finding.
const CLEAR: f64 = 4.0;

/// The geometry alone, where errors of joints were kept; else empty.
pub(super) fn geometric(with_terms: &WithTerms, settings: &Settings) -> Vec<ParameterSummary> {
    if with_terms.selection.terms().is_geometry() {
        return Vec::new();
    }
    parameter_summaries(&with_terms.geometric, settings.prior)
}

/// Which errors of joints were kept and why; `None` where no model could be scored.
pub(super) fn selection(
    problem: &Problem<'_>,
    with_terms: &WithTerms,
    nominal: &FittedSetup,
) -> Option<SelectionSummary> {
    let selection = &with_terms.selection;
    let kept = selection.kept()?;
    let nominal = nominal_rms(problem, &with_terms.found, nominal)?;
    let candidates = selection.candidates.iter().map(|scored| CandidateSummary {
        terms: scored.terms,
        left_out_rms_mm: to_mm(scored.score),
        residual_mm: to_mm(scored.sigma),
    });
    Some(SelectionSummary {
        candidates: candidates.collect(),
        kept: kept.terms,
        reason: reason(&selection.candidates, kept),
        nominal_rms_mm: to_mm(nominal),
        shares: shares(&selection.candidates, kept, nominal),
        left_rms_mm: to_mm(kept.score),
    })
}

/// Root mean square error of the nominal arm at the accepted samples (m).
pub(super) fn nominal_rms(problem: &Problem<'_>, found: &Identification, nominal: &FittedSetup) -> Option<f64> {
    let Some(errors) = ModelErrors::new(&nominal.arm, &nominal.base_from_station, &problem.observations.points) else {
        let direct = DirectErrors::new(&nominal.arm, &nominal.features, problem.observations);
        return direct.seat.or(direct.length).map(|statistics| statistics.rms);
    };
    let accepted = errors.vectors.iter().enumerate().filter(|(place, _)| !found.is_rejected(*place));
    Some(ErrorStatistics::new(accepted.map(|(_, vector)| vector.norm()).collect())?.rms)
}

fn score_of(candidates: &[Scored], is_it: impl Fn(&Terms) -> bool) -> Option<f64> {
    candidates.iter().find(|scored| is_it(&scored.terms)).map(|scored| scored.score)
}

fn reason(candidates: &[Scored], kept: &Scored) -> String {
    let mm = |value: f64| number(to_mm(value), 3);
    match score_of(candidates, Terms::is_geometry) {
        _ if candidates.iter().all(|scored| !scored.terms.is_geometry()) => {
            "asked for; the geometry alone was not compared".to_owned()
        }
        Some(_) if kept.terms.is_geometry() => {
            "no errors of joints predict poses that are left out better than the geometry alone by a clear 2 %"
                .to_owned()
        }
        geometry => format!(
            "poses that are left out are predicted to {} mm; with the geometry alone to {} mm. Each group had to gain more than 2 %",
            mm(kept.score),
            mm(geometry.unwrap_or(f64::NAN))
        ),
    }
}

/// Parts of the nominal arm's error (rms, m) by cause; the rest is what the kept model leaves.
fn shares(candidates: &[Scored], kept: &Scored, nominal: f64) -> Vec<ShareSummary> {
    let is_gravity = |terms: &Terms| {
        !terms.harmonics
            && terms.curves.is_none()
            && terms.compliance == kept.terms.compliance
            && terms.tilt == kept.terms.tilt
    };
    let geometry = score_of(candidates, Terms::is_geometry).unwrap_or(kept.score);
    let with_gravity = score_of(candidates, is_gravity).unwrap_or(geometry).min(geometry).max(kept.score.min(geometry));
    let percent = |from: f64, to: f64| (100.0 * (from - to) / nominal.max(f64::MIN_POSITIVE)).max(0.0);
    let has_curves = kept.terms.harmonics || kept.terms.curves.is_some();
    let has_gravity = kept.terms.compliance || kept.terms.tilt;
    [
        (true, Cause::Geometry, percent(nominal, geometry)),
        (has_gravity, Cause::Gravity, percent(geometry, with_gravity)),
        (has_curves, Cause::JointCurves, percent(with_gravity, kept.score)),
    ]
    .into_iter()
    .filter(|(is_there, ..)| *is_there)
    .map(|(_, cause, percent)| ShareSummary { cause, percent })
    .collect()
}

/// The error of one joint in the parameters of an identification.
struct JointParameters<'a> {
    found: &'a Identification,
    joint: usize,
    /// Index and term of each of its parameters.
    terms: Vec<(usize, JointTerm)>,
}

impl<'a> JointParameters<'a> {
    fn new(found: &'a Identification, joint: usize) -> Self {
        let of_joint = |(index, id)| match id {
            ParameterId::Joint { joint: of, term } if of == joint => Some((index, term)),
            ParameterId::Joint { .. } | ParameterId::Link { .. } | ParameterId::Target { .. } => None,
        };
        let ids = found.estimates.iter().map(|estimate| estimate.id).enumerate();
        Self { found, joint, terms: ids.filter_map(of_joint).collect() }
    }

    /// Coefficient of a term with its standard deviation (rad).
    fn value(&self, term: JointTerm) -> Option<(f64, f64)> {
        let (index, _) = self.terms.iter().find(|(_, of)| *of == term)?;
        self.found.estimates.get(*index).map(|estimate| (estimate.deviation, estimate.sigma))
    }

    /// Error that follows the joint's own value, and its standard deviation (rad).
    fn curve(&self, value: f64) -> (f64, f64) {
        let factors = DVector::from_iterator(
            self.terms.len(),
            self.terms.iter().map(|(_, term)| match term {
                JointTerm::Sine(order) => (f64::from(*order) * value).sin(),
                JointTerm::Cosine(order) => (f64::from(*order) * value).cos(),
                JointTerm::Compliance | JointTerm::Tilt(_) => 0.0,
            }),
        );
        let error = self.found.arm.chain.errors().get(self.joint).map_or(0.0, |error| error.curve(value));
        let mut variance = 0.0;
        for (a, (i, _)) in self.terms.iter().enumerate().filter(|(a, _)| factors[*a] != 0.0) {
            for (b, (j, _)) in self.terms.iter().enumerate() {
                variance += factors[a] * factors[b] * self.found.covariance[(*i, *j)];
            }
        }
        (error, variance.max(0.0).sqrt())
    }
}

/// Values of a joint that were measured (rad).
fn values_of(problem: &Problem<'_>, joint: usize) -> Vec<f64> {
    problem.observations.places().filter_map(|place| place.configuration.get(joint).copied()).collect()
}

/// The error of each joint; empty without any.
pub(super) fn summaries(profile: &Profile, problem: &Problem<'_>, found: &Identification) -> Vec<JointErrorSummary> {
    let chain = &problem.arm.chain;
    let ranges = ranges(profile).unwrap_or_default();
    let of_joint = |(joint, (low, high)): (usize, (f64, f64))| {
        let parameters = JointParameters::new(found, joint);
        if parameters.terms.is_empty() || chain.joints()[joint].joint_type != JointType::Revolute {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most a turn, and at least one step"
        )]
        let steps = ((high - low) / STEP).ceil().clamp(1.0, 1e4) as usize;
        let micro = |value: f64| (value / MICRORADIAN * 10.0).round() / 10.0 + 0.0;
        let curve = (0..=steps).map(|index| {
            let value = low + (high - low) * index as f64 / steps as f64;
            let (error, sigma) = parameters.curve(value);
            ((to_deg(value) * 1e3).round() / 1e3 + 0.0, micro(error), micro(sigma))
        });
        let measured = values_of(problem, joint);
        let (first, last) =
            measured.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        let compliance = parameters.value(JointTerm::Compliance);
        Some(JointErrorSummary {
            joint: chain.joints()[joint].name.clone(),
            measured_deg: (to_deg(first), to_deg(last)),
            compliance_urad: compliance.map(|(value, sigma)| (micro(value), micro(sigma))),
            torque_nm: compliance.and_then(|_| Some(chain.loads()?.largest_torque(joint))),
            curve_rms_urad: micro(curve_rms(&parameters, &measured)),
            curve: curve.collect(),
        })
    };
    ranges.into_iter().enumerate().filter_map(of_joint).collect()
}

/// Root mean square of a joint's curve at the measured values (rad).
fn curve_rms(parameters: &JointParameters<'_>, measured: &[f64]) -> f64 {
    let error = parameters.found.arm.chain.errors().get(parameters.joint);
    root_mean_square(measured, |value| error.map_or(0.0, |error| error.curve(value)))
}

/// The same of the part above the first harmonics, which over a narrow range cannot be told from the geometry.
fn ripple_rms(parameters: &JointParameters<'_>, measured: &[f64]) -> f64 {
    root_mean_square(measured, |value| {
        let of_term = |(index, term): &(usize, JointTerm)| {
            let factor = match term {
                JointTerm::Sine(order) if *order > SMOOTH_ORDERS => (f64::from(*order) * value).sin(),
                JointTerm::Cosine(order) if *order > SMOOTH_ORDERS => (f64::from(*order) * value).cos(),
                JointTerm::Sine(_) | JointTerm::Cosine(_) | JointTerm::Compliance | JointTerm::Tilt(_) => 0.0,
            };
            factor * parameters.found.estimates[*index].deviation
        };
        parameters.terms.iter().map(of_term).sum()
    })
}

fn root_mean_square(values: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    (values.iter().map(|value| of(*value).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Warnings about joints that are worse than joints should be. None of them makes the result less accurate.
pub(super) fn warnings(problem: &Problem<'_>, found: &Identification) -> Vec<Warning> {
    let chain: &KinematicChain = &problem.arm.chain;
    let joints: Vec<JointParameters<'_>> = (0..chain.dof()).map(|joint| JointParameters::new(found, joint)).collect();
    let sizes: Vec<f64> =
        joints.iter().map(|parameters| ripple_rms(parameters, &values_of(problem, parameters.joint))).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let micro = |value: f64| number(value / MICRORADIAN, 0);
    let mut messages = Vec::new();
    for (parameters, size) in joints.iter().zip(sizes) {
        let name = &chain.joints()[parameters.joint].name;
        if size > LARGE_CURVE || size > (LARGE_FOR_THE_ARM * median).max(SMALL_CURVE) {
            messages.push(format!(
                "the angle error of joint {name} ripples by {} urad rms, unusually much (median of the joints {} urad): have its gear and encoder looked at",
                micro(size),
                micro(median)
            ));
        }
        if let Some((value, sigma)) = parameters.value(JointTerm::Compliance) {
            if value < -CLEAR * sigma {
                messages.push(format!(
                    "joint {name} seems to turn against gravity ({} ± {} urad at its largest torque): the masses, the mounting or the payload in the profile are probably wrong",
                    micro(value),
                    micro(sigma)
                ));
            } else if value > SOFT && value > CLEAR * sigma {
                messages.push(format!(
                    "joint {name} gives by {} ± {} urad at its largest gravity torque, unusually soft: have its gear looked at, and check the payload in the profile",
                    micro(value),
                    micro(sigma)
                ));
            }
        }
    }
    messages.into_iter().map(|message| Warning::new(WarningCode::UnusualJoint, message, false)).collect()
}
