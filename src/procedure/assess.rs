//! Verification summaries, and the verdict on them.

use super::result::DOES_NOT_FIT;
use crate::identification::verification::{DirectErrors, ErrorStatistics, ModelErrors, residual_against_joints};
use crate::identification::{Observations, PointSample};
use crate::kinematics::Joint;
use crate::profile::Acceptance;
use crate::report::number;
use crate::session::advice::Advice;
use crate::session::summary::{
    AxisSummary, JointBin, JointSummary, LimitCheck, LimitedQuantity, ModelSummary, Refit, StatisticsSummary, Verdict,
    VerdictStatus, VerificationSummary, Warning,
};
use crate::units::to_mm;

fn statistics(statistics: &ErrorStatistics) -> StatisticsSummary {
    let ErrorStatistics { count, mean, rms, p95, max } = *statistics;
    StatisticsSummary { count, mean: to_mm(mean), rms: to_mm(rms), p95: to_mm(p95), max: to_mm(max) }
}

fn model_summary(errors: &ModelErrors) -> ModelSummary {
    ModelSummary {
        position_mm: Some(statistics(&errors.position)),
        axis_mm: Some(AxisSummary { mean: errors.axis_mean.map(to_mm), max: errors.axis_max.map(to_mm) }),
        distance_mm: errors.distance.as_ref().map(statistics),
        seat_mm: None,
    }
}

fn direct_summary(errors: &DirectErrors) -> ModelSummary {
    ModelSummary {
        position_mm: None,
        axis_mm: None,
        distance_mm: errors.length.as_ref().map(statistics),
        seat_mm: errors.seat.as_ref().map(statistics),
    }
}

/// Errors of the identified model against each joint.
fn joint_summaries(
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

/// The summary of a verification by points.
pub(crate) fn point_verification(
    joints: &[Joint],
    samples: &[PointSample],
    nominal: &ModelErrors,
    identified: &ModelErrors,
    basis: String,
    refit: Refit,
) -> VerificationSummary {
    let configurations: Vec<&[f64]> = samples.iter().map(|sample| sample.at.configuration.as_slice()).collect();
    VerificationSummary {
        samples: samples.len(),
        left_out: 0,
        basis,
        independent: true,
        refit,
        nominal: model_summary(nominal),
        identified: model_summary(identified),
        residual_by_joint: joint_summaries(joints, &configurations, &identified.vectors),
    }
}

/// The summary of a verification by direct distances.
pub(crate) fn direct_verification(
    joints: &[Joint],
    nominal: &DirectErrors,
    identified: &DirectErrors,
    observations: &Observations,
    basis: String,
) -> VerificationSummary {
    let seats = observations.shared.iter().filter(|shared| shared.at.len() > 1).flat_map(|shared| &shared.at);
    let configurations: Vec<&[f64]> = seats.map(|at| at.configuration.as_slice()).collect();
    let residual_by_joint = if configurations.is_empty() {
        Vec::new()
    } else {
        joint_summaries(joints, &configurations, &identified.seats)
    };
    VerificationSummary {
        samples: identified.seats.len() + identified.lengths.len(),
        left_out: 0,
        basis,
        independent: true,
        refit: Refit::None,
        nominal: direct_summary(nominal),
        identified: direct_summary(identified),
        residual_by_joint,
    }
}

/// Compares a verification with the acceptance limits of the profile; if there is none, the verdict carries advice how to get one.
pub(crate) fn verdict(
    acceptance: &Acceptance,
    verification: Result<&VerificationSummary, Advice>,
    warnings: &[Warning],
) -> Verdict {
    let decided = |status, reasons: Vec<String>, checks| Verdict { status, reasons, checks, advice: None };
    let verification = match verification {
        Ok(verification) => verification,
        Err(advice) => {
            let mut reasons = vec!["there are no verification samples".to_owned()];
            // Data that do not describe the robot need no verification to be refused.
            let refuted = warnings.iter().any(|warning| warning.code == DOES_NOT_FIT);
            let status = if refuted { VerdictStatus::NotAccepted } else { VerdictStatus::NotEvaluated };
            if refuted {
                reasons.insert(0, format!("see the warning '{DOES_NOT_FIT}'"));
            }
            return Verdict { advice: Some(advice), ..decided(status, reasons, Vec::new()) };
        }
    };
    let checks = limit_checks(acceptance, &verification.identified);
    let mut reasons: Vec<String> = checks
        .iter()
        .filter(|check| check.met == Some(false))
        .map(|check| {
            let (name, limit) = (check.quantity.words(), number(check.limit_mm, 3));
            match check.value_mm {
                Some(value) if value.is_finite() => {
                    format!("{name} {} mm is above the limit of {limit} mm", number(value, 3))
                }
                _ => format!("{name} is not a number; the limit is {limit} mm"),
            }
        })
        .collect();
    let mut doubts: Vec<&str> = Vec::new();
    for warning in warnings.iter().filter(|warning| warning.blocks_acceptance) {
        if !doubts.contains(&warning.code.as_str()) {
            doubts.push(&warning.code);
        }
    }
    reasons.extend(doubts.iter().map(|code| format!("see the warning '{code}'")));
    if checks.is_empty() {
        reasons.insert(0, "the profile states no acceptance limits".to_owned());
        return decided(VerdictStatus::NotEvaluated, reasons, checks);
    }
    let open: Vec<String> =
        checks.iter().filter(|check| check.met.is_none()).map(|check| check.quantity.words()).collect();
    let refused = !reasons.is_empty();
    if !open.is_empty() {
        reasons.push(format!("these data cannot show: {}", open.join(", ")));
    }
    if refused {
        return decided(VerdictStatus::NotAccepted, reasons, checks);
    }
    if !open.is_empty() {
        return decided(VerdictStatus::NotEvaluated, reasons, checks);
    }
    let count = checks.len();
    let reason = if count == 1 {
        "the acceptance limit is met".to_owned()
    } else {
        format!("all {count} acceptance limits are met")
    };
    decided(VerdictStatus::Accepted, vec![reason], checks)
}

/// Compares every limit of the profile with the errors found. The distance of a seat from its shared point is a position error.
fn limit_checks(acceptance: &Acceptance, found: &ModelSummary) -> Vec<LimitCheck> {
    let position_errors = found.position_mm.as_ref().or(found.seat_mm.as_ref());
    let position = |pick: fn(&StatisticsSummary) -> f64| position_errors.map(pick);
    let distance = |pick: fn(&StatisticsSummary) -> f64| found.distance_mm.as_ref().map(pick);
    [
        (LimitedQuantity::PositionMean, acceptance.position_mean, position(|s| s.mean)),
        (LimitedQuantity::PositionRms, acceptance.position_rms, position(|s| s.rms)),
        (LimitedQuantity::PositionMax, acceptance.position_max, position(|s| s.max)),
        (LimitedQuantity::DistanceMean, acceptance.distance_mean, distance(|s| s.mean)),
        (LimitedQuantity::DistanceRms, acceptance.distance_rms, distance(|s| s.rms)),
        (LimitedQuantity::DistanceMax, acceptance.distance_max, distance(|s| s.max)),
    ]
    .into_iter()
    .filter_map(|(quantity, limit, value_mm)| {
        let limit_mm = to_mm(limit?);
        // A value that is not a number does not meet the limit.
        let met = value_mm.map(|value| value <= limit_mm);
        Some(LimitCheck { quantity, value_mm, limit_mm, met })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(distance_mm: Option<f64>) -> VerificationSummary {
        let statistics = |value: f64| StatisticsSummary { count: 9, mean: value, rms: value, p95: value, max: value };
        let identified = ModelSummary {
            seat_mm: Some(statistics(0.1)),
            distance_mm: distance_mm.map(statistics),
            ..ModelSummary::default()
        };
        VerificationSummary {
            samples: 9,
            left_out: 0,
            basis: String::new(),
            independent: true,
            refit: Refit::None,
            nominal: identified.clone(),
            identified,
            residual_by_joint: Vec::new(),
        }
    }

    #[test]
    fn limits_that_cannot_be_evaluated_are_never_accepted() {
        let acceptance = Acceptance { position_rms: Some(2e-4), distance_rms: Some(2e-4), ..Acceptance::default() };
        let status = |distance, warnings: &[Warning]| verdict(&acceptance, Ok(&of(distance)), warnings).status;
        assert_eq!(status(Some(0.1), &[]), VerdictStatus::Accepted);
        assert_eq!(status(None, &[]), VerdictStatus::NotEvaluated);
        assert_eq!(status(Some(0.3), &[]), VerdictStatus::NotAccepted);
        assert_eq!(status(Some(f64::NAN), &[]), VerdictStatus::NotAccepted);
        let twice = [Warning::new("poor_data", "", true), Warning::new("poor_data", "", true)];
        let found = verdict(&acceptance, Ok(&of(None)), &twice);
        assert_eq!(found.status, VerdictStatus::NotAccepted);
        assert_eq!(found.reasons, ["see the warning 'poor_data'", "these data cannot show: distance rms"]);
    }
}
