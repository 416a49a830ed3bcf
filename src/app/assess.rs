//! From errors to a verification summary and a verdict.

use crate::identification::PointSample;
use crate::identification::verification::{
    CoverageGap, DirectErrors, ErrorStatistics, ModelErrors, coverage_gaps, residual_against_joints,
};
use crate::kinematics::Joint;
use crate::profile::Acceptance;
use crate::session::summary::{
    AxisSummary, JointBin, JointSummary, LimitCheck, ModelSummary, StatisticsSummary, Verdict, VerificationSummary,
    Warning,
};
use crate::units::to_mm;

use super::estimate::warning;

/// Fewer verification samples than this say little about the largest error.
const FEW_SAMPLES: usize = 10;

pub(super) fn statistics(statistics: &ErrorStatistics) -> StatisticsSummary {
    let ErrorStatistics { count, mean, rms, p95, max } = *statistics;
    StatisticsSummary { count, mean: to_mm(mean), rms: to_mm(rms), p95: to_mm(p95), max: to_mm(max) }
}

pub(super) fn model_summary(errors: &ModelErrors) -> ModelSummary {
    ModelSummary {
        position_mm: Some(statistics(&errors.position)),
        axis_mm: Some(AxisSummary { mean: errors.axis_mean.map(to_mm), max: errors.axis_max.map(to_mm) }),
        distance_mm: errors.distance.as_ref().map(statistics),
        seat_mm: None,
    }
}

pub(super) fn direct_summary(errors: &DirectErrors) -> ModelSummary {
    ModelSummary {
        position_mm: None,
        axis_mm: None,
        distance_mm: errors.length.as_ref().map(statistics),
        seat_mm: errors.seat.as_ref().map(statistics),
    }
}

/// Errors of the identified model against each joint.
pub(super) fn joint_summaries(
    joints: &[Joint],
    configurations: &[&[f64]],
    vectors: &[nalgebra::Vector3<f64>],
) -> Vec<JointSummary> {
    residual_against_joints(joints, configurations, vectors)
        .into_iter()
        .map(|residual| {
            let joint = &joints[residual.joint];
            let quantity = joint.joint_type.quantity();
            JointSummary {
                joint: joint.name.clone(),
                unit: quantity.unit().to_owned(),
                explained: residual.explained,
                bins: residual
                    .bins
                    .into_iter()
                    .map(|(from, to, count, mean)| JointBin {
                        from: quantity.to_edge(from),
                        to: quantity.to_edge(to),
                        count,
                        mean_mm: to_mm(mean),
                    })
                    .collect(),
            }
        })
        .collect()
}

/// A verification by points.
pub(super) fn point_verification(
    joints: &[Joint],
    samples: &[PointSample],
    nominal: &ModelErrors,
    identified: &ModelErrors,
    basis: String,
    refit: &str,
) -> VerificationSummary {
    let configurations: Vec<&[f64]> = samples.iter().map(|sample| sample.at.configuration.as_slice()).collect();
    VerificationSummary {
        samples: samples.len(),
        basis,
        refit: refit.to_owned(),
        nominal: model_summary(nominal),
        identified: model_summary(identified),
        residual_by_joint: joint_summaries(joints, &configurations, &identified.vectors),
    }
}

/// What is doubtful about a pair of identification and verification sets.
pub(super) fn set_warnings(
    joints: &[Joint],
    identification: &[PointSample],
    verification: &[PointSample],
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let shared = verification
        .iter()
        .filter(|sample| identification.iter().any(|known| known.at == sample.at && known.point == sample.point));
    let shared = shared.count();
    if shared > 0 {
        let message = format!(
            "{shared} of {} verification samples are also in the identification set: the figures below are not an independent verification",
            verification.len()
        );
        warnings.push(warning("not_independent", message, true));
    }
    if verification.len() < FEW_SAMPLES {
        let message = format!("only {} verification samples: the largest error is hardly known", verification.len());
        warnings.push(warning("few_verification_samples", message, false));
    }
    let known: Vec<&[f64]> = identification.iter().map(|sample| sample.at.configuration.as_slice()).collect();
    let tested: Vec<&[f64]> = verification.iter().map(|sample| sample.at.configuration.as_slice()).collect();
    warnings.extend(coverage_gaps(joints, &known, &tested).iter().map(|gap| coverage_warning(joints, gap)));
    warnings
}

fn coverage_warning(joints: &[Joint], gap: &CoverageGap) -> Warning {
    let joint = &joints[gap.joint];
    let quantity = joint.joint_type.quantity();
    let range = |(low, high): (f64, f64)| {
        format!("{:.0}…{:.0} {}", quantity.to_edge(low), quantity.to_edge(high), quantity.unit())
    };
    let (known, tested) = (range(gap.identification), range(gap.verification));
    let message = if gap.extrapolates {
        format!("verification reaches outside the identification set: {} {tested}, identified on {known}", joint.name)
    } else {
        format!(
            "verification covers a part only: {} {tested}, identified on {known}; the rest is not verified",
            joint.name
        )
    };
    warning("coverage", message, false)
}

/// Compares a verification with the acceptance limits of the profile.
pub(super) fn verdict(
    acceptance: &Acceptance,
    verification: Option<&VerificationSummary>,
    warnings: &[Warning],
) -> Verdict {
    let decided = |status: &str, reasons: Vec<String>, checks| Verdict { status: status.to_owned(), reasons, checks };
    let Some(verification) = verification else {
        let reason = "there are no verification samples; give '--verify FILE', or '--use CONDITION --verify-rest'";
        return decided("not_evaluated", vec![reason.to_owned()], Vec::new());
    };
    let checks = limit_checks(acceptance, &verification.identified);
    let mut reasons: Vec<String> = checks
        .iter()
        .filter(|check| !check.met)
        .map(|check| {
            format!(
                "{} {:.3} mm is above the limit of {:.3} mm",
                check.quantity.replace('_', " "),
                check.value_mm,
                check.limit_mm
            )
        })
        .collect();
    let failed = !reasons.is_empty();
    let doubts = warnings.iter().filter(|warning| warning.blocks_acceptance);
    reasons.extend(doubts.map(|warning| format!("see the warning '{}'", warning.code)));
    if !reasons.is_empty() && (failed || !checks.is_empty()) {
        return decided("not_accepted", reasons, checks);
    }
    if checks.is_empty() {
        reasons.insert(0, "the profile states no acceptance limits for these figures".to_owned());
        return decided("not_evaluated", reasons, checks);
    }
    let count = checks.len();
    let reason = if count == 1 {
        "the acceptance limit is met".to_owned()
    } else {
        format!("all {count} acceptance limits are met")
    };
    decided("accepted", vec![reason], checks)
}

fn limit_checks(acceptance: &Acceptance, found: &ModelSummary) -> Vec<LimitCheck> {
    let position = |pick: fn(&StatisticsSummary) -> f64| found.position_mm.as_ref().map(pick);
    let distance = |pick: fn(&StatisticsSummary) -> f64| found.distance_mm.as_ref().map(pick);
    [
        ("position_mean", acceptance.position_mean, position(|s| s.mean)),
        ("position_rms", acceptance.position_rms, position(|s| s.rms)),
        ("position_max", acceptance.position_max, position(|s| s.max)),
        ("distance_mean", acceptance.distance_mean, distance(|s| s.mean)),
        ("distance_rms", acceptance.distance_rms, distance(|s| s.rms)),
        ("distance_max", acceptance.distance_max, distance(|s| s.max)),
    ]
    .into_iter()
    .filter_map(|(quantity, limit, value)| {
        let (limit_mm, value_mm) = (to_mm(limit?), value?);
        Some(LimitCheck { quantity: quantity.to_owned(), value_mm, limit_mm, met: value_mm <= limit_mm })
    })
    .collect()
}
