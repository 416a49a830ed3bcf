//! Verification summaries, and the verdict on them.

use std::collections::BTreeMap;

use super::intervals::{Intervals, OfPoses};
use crate::identification::verification::{DirectErrors, ErrorStatistics, ModelErrors, residual_against_joints};
use crate::identification::{Observations, Places, PointSample};
use crate::kinematics::{Joint, Place};
use crate::profile::Acceptance;
use crate::report::number;
use crate::session::advice::Advice;
use crate::session::decision::{self, Outcome};
use crate::session::summary::{
    AxisSummary, Figure, JointBin, JointSummary, LimitCheck, LimitedQuantity, ModelSummary, Refit, SigmaSummary,
    StatisticsSummary, Verdict, VerdictStatus, VerificationSummary, Warning, WarningCode,
};
use crate::units::to_mm;

fn statistics(statistics: &ErrorStatistics, intervals: Option<Intervals>) -> StatisticsSummary {
    let ErrorStatistics { count, mean, rms, p95, max } = *statistics;
    let mm = |pick: fn(&Intervals) -> [f64; 2]| intervals.as_ref().map(|intervals| pick(intervals).map(to_mm));
    StatisticsSummary {
        count,
        mean: to_mm(mean),
        rms: to_mm(rms),
        p95: to_mm(p95),
        max: to_mm(max),
        mean_interval: mm(|intervals| intervals.mean),
        rms_interval: mm(|intervals| intervals.rms),
        max_interval: mm(|intervals| intervals.max),
    }
}

/// Statistics of rotations, which are shown in mrad as lengths are in mm.
fn in_mrad(errors: &ErrorStatistics, intervals: Option<Intervals>) -> StatisticsSummary {
    // One thousandth of the unit of the inside, for both.
    statistics(errors, intervals)
}

/// The poses of samples, counted from zero, and how many there are.
struct Poses {
    of_samples: Vec<usize>,
    count: usize,
}

impl Poses {
    fn new(joints: &[Joint], samples: &[PointSample]) -> Self {
        let any_target: Vec<Place> = samples.iter().map(|sample| Place { target: 0, ..sample.at.clone() }).collect();
        Self::of(&Places::new(joints, &any_target).first_of_each())
    }

    /// From what each sample has in common with others.
    fn of(first: &[usize]) -> Self {
        let mut numbers = BTreeMap::new();
        let of_samples = first
            .iter()
            .map(|first| {
                let next = numbers.len();
                *numbers.entry(*first).or_insert(next)
            })
            .collect();
        Self { of_samples, count: numbers.len() }
    }

    fn intervals(&self, errors: impl Iterator<Item = ([usize; 2], f64)>) -> Option<Intervals> {
        let of_poses = |(samples, error): ([usize; 2], f64)| {
            let [one, other] = samples.map(|sample| self.of_samples.get(sample).copied());
            Some(OfPoses { poses: [one?, other?], error: error.abs() })
        };
        Intervals::new(&errors.map(of_poses).collect::<Option<Vec<_>>>()?, self.count)
    }
}

fn model_summary(errors: &ModelErrors, poses: &Poses) -> ModelSummary {
    let vectors = errors.vectors.iter().enumerate();
    let of_positions = poses.intervals(vectors.map(|(index, vector)| ([index; 2], vector.norm())));
    let pairs = errors.distances.iter().map(|pair| (pair.samples.map(|index| index as usize), pair.error));
    let of_distances = poses.intervals(pairs);
    let turns = errors.orientations.iter();
    let of_orientations = poses.intervals(turns.map(|turn| ([turn.sample; 2], turn.vector.norm())));
    ModelSummary {
        position_mm: Some(statistics(&errors.position, of_positions)),
        axis_mm: Some(AxisSummary { mean: errors.axis_mean.map(to_mm), max: errors.axis_max.map(to_mm) }),
        distance_mm: errors.distance.as_ref().map(|errors| statistics(errors, of_distances)),
        seat_mm: None,
        orientation_mrad: errors.orientation.as_ref().map(|errors| in_mrad(errors, of_orientations)),
    }
}

fn direct_summary(errors: &DirectErrors) -> ModelSummary {
    // Seats of one shared point depend on each other; lengths do not.
    let shared = Poses::of(&errors.shared);
    let seats = errors.seats.iter().enumerate();
    let of_seats = shared.intervals(seats.map(|(index, seat)| ([index; 2], seat.norm())));
    let each = Poses::of(&(0..errors.lengths.len()).collect::<Vec<_>>());
    let lengths = errors.lengths.iter().enumerate();
    let of_lengths = each.intervals(lengths.map(|(index, error)| ([index; 2], *error)));
    ModelSummary {
        position_mm: None,
        axis_mm: None,
        distance_mm: errors.length.as_ref().map(|errors| statistics(errors, of_lengths)),
        seat_mm: errors.seat.as_ref().map(|errors| statistics(errors, of_seats)),
        orientation_mrad: None,
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
    let poses = Poses::new(joints, samples);
    VerificationSummary {
        samples: samples.len(),
        poses: poses.count,
        left_out: 0,
        basis,
        independent: true,
        refit,
        nominal: model_summary(nominal, &poses),
        identified: model_summary(identified, &poses),
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
        poses: 0,
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
    sigma: &SigmaSummary,
) -> Verdict {
    let decided =
        |status, reasons: Vec<String>, checks| Verdict { status, reasons, checks, undecided: Vec::new(), advice: None };
    let verification = match verification {
        Ok(verification) => verification,
        Err(advice) => {
            let mut reasons = vec!["there are no verification samples".to_owned()];
            // Data that do not describe the robot need no verification to be refused.
            let refuted = warnings.iter().any(|warning| warning.code == WarningCode::DoesNotFit);
            let status = if refuted { VerdictStatus::NotAccepted } else { VerdictStatus::NotEvaluated };
            if refuted {
                reasons.insert(0, format!("see the warning '{}'", WarningCode::DoesNotFit));
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
    reasons.extend(Warning::blocking(warnings).into_iter().map(|code| format!("see the warning '{code}'")));
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
    let undecided: Vec<LimitedQuantity> = decision::decided(&checks, sigma)
        .into_iter()
        .filter(|limit| limit.outcome != Outcome::Pass)
        .map(|limit| limit.quantity)
        .collect();
    let mut reasons = vec![reason];
    if !undecided.is_empty() {
        let which: Vec<String> = undecided.iter().map(|quantity| quantity.words()).collect();
        reasons.push(format!("not with the uncertainty of the figure (k = 2): {}", which.join(", ")));
    }
    Verdict { undecided, ..decided(VerdictStatus::Accepted, reasons, checks) }
}

/// Compares every limit of the profile with the errors found. The distance of a seat from its shared point is a position error.
fn limit_checks(acceptance: &Acceptance, found: &ModelSummary) -> Vec<LimitCheck> {
    let position_errors = found.position_mm.as_ref().or(found.seat_mm.as_ref());
    let position = |pick: fn(&StatisticsSummary) -> Figure| position_errors.map(pick);
    let distance = |pick: fn(&StatisticsSummary) -> Figure| found.distance_mm.as_ref().map(pick);
    let mean = |statistics: &StatisticsSummary| statistics.figures()[0];
    let rms = |statistics: &StatisticsSummary| statistics.figures()[1];
    let max = |statistics: &StatisticsSummary| statistics.figures()[3];
    [
        (LimitedQuantity::PositionMean, acceptance.position_mean, position(mean)),
        (LimitedQuantity::PositionRms, acceptance.position_rms, position(rms)),
        (LimitedQuantity::PositionMax, acceptance.position_max, position(max)),
        (LimitedQuantity::DistanceMean, acceptance.distance_mean, distance(mean)),
        (LimitedQuantity::DistanceRms, acceptance.distance_rms, distance(rms)),
        (LimitedQuantity::DistanceMax, acceptance.distance_max, distance(max)),
    ]
    .into_iter()
    .filter_map(|(quantity, limit, figure)| {
        let limit_mm = to_mm(limit?);
        let value_mm = figure.map(|figure| figure.value);
        let interval_mm = figure.and_then(|figure| figure.interval);
        // A value that is not a number does not meet the limit.
        let met = value_mm.map(|value| value <= limit_mm);
        Some(LimitCheck { quantity, value_mm, interval_mm, limit_mm, met })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(distance_mm: Option<f64>) -> VerificationSummary {
        let statistics = |value: f64| StatisticsSummary {
            count: 9,
            mean: value,
            rms: value,
            p95: value,
            max: value,
            ..StatisticsSummary::default()
        };
        let identified = ModelSummary {
            seat_mm: Some(statistics(0.1)),
            distance_mm: distance_mm.map(statistics),
            ..ModelSummary::default()
        };
        VerificationSummary {
            samples: 9,
            poses: 9,
            left_out: 0,
            basis: String::new(),
            independent: true,
            refit: Refit::None,
            nominal: identified.clone(),
            identified,
            residual_by_joint: Vec::new(),
        }
    }

    fn sigma(used_mm: f64) -> SigmaSummary {
        SigmaSummary {
            used_mm,
            source: crate::identification::SigmaSource::Option,
            from_residuals_mm: None,
            instrument_mm: None,
            shots_mm: None,
            poses_mm: None,
        }
    }

    #[test]
    fn a_limit_within_the_uncertainty_is_undecided_in_every_word() {
        let acceptance = Acceptance { distance_rms: Some(2e-4), ..Acceptance::default() };
        let mut found = of(Some(0.15));
        found.identified.distance_mm.as_mut().unwrap().rms_interval = Some([0.14, 0.16]);
        let decided = |sigma_mm| verdict(&acceptance, Ok(&found), &[], &sigma(sigma_mm));
        assert_eq!(decided(0.01).word(), "ACCEPTED");
        // U of two ends of 30 µm each: 85 µm.
        let open = decided(0.03);
        assert_eq!((open.word(), open.status), ("UNDECIDED", VerdictStatus::Accepted));
        assert_eq!(open.undecided, [LimitedQuantity::DistanceRms]);
        assert_eq!(open.reasons[1], "not with the uncertainty of the figure (k = 2): distance rms");
    }

    #[test]
    fn limits_that_cannot_be_evaluated_are_never_accepted() {
        let acceptance = Acceptance { position_rms: Some(2e-4), distance_rms: Some(2e-4), ..Acceptance::default() };
        let status =
            |distance, warnings: &[Warning]| verdict(&acceptance, Ok(&of(distance)), warnings, &sigma(0.01)).status;
        assert_eq!(status(Some(0.1), &[]), VerdictStatus::Accepted);
        assert_eq!(status(None, &[]), VerdictStatus::NotEvaluated);
        assert_eq!(status(Some(0.3), &[]), VerdictStatus::NotAccepted);
        assert_eq!(status(Some(f64::NAN), &[]), VerdictStatus::NotAccepted);
        let twice = [Warning::new(WarningCode::PoorData, "", true), Warning::new(WarningCode::PoorData, "", true)];
        let found = verdict(&acceptance, Ok(&of(None)), &twice, &sigma(0.01));
        assert_eq!(found.status, VerdictStatus::NotAccepted);
        assert_eq!(found.reasons, ["see the warning 'poor_data'", "these data cannot show: distance rms"]);
    }
}
