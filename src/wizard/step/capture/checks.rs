//! Checks of a new point: live triage by distance, and drift where a pose is measured again.

use crate::identification::triage::{Cause, Finding, Names, PairDeviation, Triage, triage};
use crate::identification::{PointSample, Terms};
use crate::kinematics::Place;
use crate::profile::{Level, Profile};
use crate::session::journal::{
    Correction, FindingCause, FindingText, MeasuredText, PairText, from_edge, to_edge, to_length_mm,
};
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::{MILLIMETRE, to_mm};
use crate::wizard::step::Cx;

/// σ of a coordinate (m) if the profile states no instrument.
const UNKNOWN_SIGMA: f64 = 0.05 * MILLIMETRE;
/// Drift below this many standard deviations of a distance is not reported.
const DRIFT_FACTOR: f64 = 6.0;
/// Drift below the repeatability of a robot is not reported (m).
const REPEATABILITY: f64 = 0.1 * MILLIMETRE;
/// Errors of joints that arms with stated masses may show: without them a soft arm looks mismeasured. Where no masses are stated, the
/// scatter of the points so far has to do.
const SMOOTH: Terms = Terms { compliance: true, tilt: true, harmonics: true, curves: None };
/// What the finer curves of joints add to the σ of a coordinate then (m).
const CURVES: f64 = 0.05 * MILLIMETRE;
/// Relative difference below which two unit factors are the same.
const SAME_FACTOR: f64 = 1e-9;

/// A finding from the distances to earlier points.
struct DistanceFinding {
    text: FindingText,
    /// Whether another cause is equally likely.
    is_ambiguous: bool,
}

/// Checks a point that is about to be written, and adds the findings to it, the most important first. A point in the wrong unit
/// that was already corrected for the previous measurement gets the same factor instead.
pub(super) fn judge(cx: &Cx<'_>, noted: &mut MeasuredText) {
    let Some(profile) = cx.profile() else { return };
    let mut found = by_distance(cx, noted, &profile);
    noted.factor = found.as_ref().and_then(|found| unit_before(cx.session, noted, found));
    if noted.factor.is_some() {
        found = by_distance(cx, noted, &profile);
    }
    let found = found.map(|found| found.text);
    // Drift cannot be judged for a point in an unknown unit.
    let has_unit = !matches!(found.as_ref().and_then(|found| found.remedy.as_ref()), Some(Correction::Scale { .. }));
    let drift = drift(cx.session, noted, &profile).filter(|_| has_unit);
    noted.findings = drift.into_iter().chain(found).collect();
}

/// The unit factor of the previous measurement, if the new point is certainly in the same wrong unit. After the first correction
/// the operator is not asked again for every point.
fn unit_before(session: &Session, noted: &MeasuredText, found: &DistanceFinding) -> Option<f64> {
    let Some(Correction::Scale { since, factor, .. }) = found.text.remedy else { return None };
    let before = session.scale_noted(&session.counted().last()?.noted);
    let is_same = (session.scale_noted(noted) * factor / before - 1.0).abs() < SAME_FACTOR;
    (since == noted.number && is_same && !found.is_ambiguous).then_some(factor)
}

/// σ of a coordinate of one shot (m).
fn stated_sigma(profile: &Profile) -> f64 {
    let distance = profile.tracker().position_in_base.coords.norm();
    profile.instrument().map_or(UNKNOWN_SIGMA, |instrument| instrument.sigma_at(distance))
}

/// The finding from the distances to all earlier points, if they do not fit.
fn by_distance(cx: &Cx<'_>, noted: &MeasuredText, profile: &Profile) -> Option<DistanceFinding> {
    let session = cx.session;
    let robot = cx.robot()?;
    // An earlier sample of the same row is about to be superseded.
    let earlier: Vec<&Sample> = session.counted().filter(|sample| sample.row != noted.row).collect();
    let point_sample = |configuration: Vec<f64>, point, sigma| PointSample {
        at: Place { configuration, target: noted.target },
        station: 0,
        point,
        sigma,
    };
    let mut samples: Vec<PointSample> = earlier
        .iter()
        .map(|sample| {
            point_sample(session.configuration_of(sample), session.point_of(sample), session.sigma_of(sample))
        })
        .collect();
    let joints = noted.reported_joints.as_ref().unwrap_or(&noted.joints);
    samples.push(point_sample(
        from_edge(joints, &robot.joint_types),
        session.point_noted(noted),
        session.sigma_noted(noted),
    ));
    let excluded: Vec<usize> =
        earlier.iter().enumerate().filter(|(_, sample)| sample.kept).map(|(index, _)| index).collect();
    let rows: Vec<usize> = (0..session.rows.len())
        .filter(|row| session.rows.get(*row).is_some_and(|row| row.planned.kind.is_measured()))
        .collect();
    let planned: Vec<Vec<f64>> =
        rows.iter().filter_map(|row| session.rows.get(*row)).map(|row| row.planned.configuration.clone()).collect();
    let arm = profile.arm();
    let mut parameters = profile.parameters(Level::Geometric);
    let mut sigma = stated_sigma(profile);
    if arm.chain.loads().is_some() {
        parameters.extend(SMOOTH.parameters(&arm.chain));
        sigma = sigma.hypot(CURVES);
        for sample in &mut samples {
            sample.sigma = sample.sigma.map(|own| own.hypot(CURVES));
        }
    }
    let found = triage(&Triage {
        arm: &arm,
        parameters: &parameters,
        sigma,
        planned: &planned,
        samples: &samples,
        excluded: &excluded,
        scatter: None,
    })?;
    let number = |index: usize| earlier.get(index).map_or(noted.number, |sample| sample.noted.number);
    // A drift pose has the same name as the pose that it repeats.
    let pose = |index: usize| {
        let (name, kind) = earlier
            .get(index)
            .map_or((noted.pose.as_str(), noted.kind), |sample| (session.pose_of(sample), session.kind_of(sample)));
        if kind == PoseKind::Drift { format!("pose {name} (again)") } else { format!("pose {name}") }
    };
    let of_row = |index: usize| rows.get(index).and_then(|row| session.rows.get(*row));
    let names = Names {
        sample: &pose,
        pose: &|index| of_row(index).map_or_else(|| "?".to_owned(), |row| row.planned.pose.clone()),
        joint: &|joint| profile.chain().joints().get(joint).map_or_else(|| "?".to_owned(), |joint| joint.name.clone()),
    };
    let text = FindingText {
        about: number(found.sample),
        cause: (&found.cause).into(),
        ratio: (found.ratio * 10.0).round() / 10.0,
        message: found.describe(&names),
        remedy: remedy(&found, cx, &number, &samples, &rows),
        worst: worst(&found, &number, &samples),
    };
    Some(DistanceFinding { text, is_ambiguous: found.is_ambiguous() })
}

/// The distances that fit worst.
fn worst(found: &Finding, number: &dyn Fn(usize) -> u64, samples: &[PointSample]) -> Vec<PairText> {
    let text = |pair: &PairDeviation| {
        let measured = (samples.get(found.sample)?.point - samples.get(pair.other)?.point).norm();
        Some(PairText {
            other: number(pair.other),
            measured_mm: to_length_mm(measured),
            predicted_mm: to_length_mm(measured - pair.deviation),
            expected_mm: to_length_mm(pair.expected),
        })
    };
    found.worst.iter().filter_map(text).collect()
}

/// The correction that fixes the sample, if it does not need to be measured again.
fn remedy(
    found: &Finding,
    cx: &Cx<'_>,
    number: &dyn Fn(usize) -> u64,
    samples: &[PointSample],
    rows: &[usize],
) -> Option<Correction> {
    match &found.cause {
        Cause::Unit { factor, since } => {
            // From the first sample means from the first measurement: refused readings and circles had the same unit.
            let since = if *since == 0 { 1 } else { number(*since) };
            // Up to this measurement: later ones are checked again.
            Some(Correction::Scale { since, factor: *factor, until: Some(number(samples.len() - 1)) })
        }
        Cause::SwappedRows { with } => Some(Correction::Swap { first: number(*with), second: number(found.sample) }),
        Cause::WrongPose { planned } => {
            let row = *rows.get(*planned)?;
            cx.session.is_open(row).then(|| Correction::Row { sample: number(found.sample), row })
        }
        Cause::MistypedJoint { joint, by, .. } => {
            let mut configuration = samples.get(found.sample)?.at.configuration.clone();
            *configuration.get_mut(*joint)? += by;
            let joints = to_edge(&configuration, &cx.robot()?.joint_types);
            Some(Correction::Joints { sample: number(found.sample), joints })
        }
        Cause::JointSign { .. }
        | Cause::StayedAtPrevious
        | Cause::TargetMoved { .. }
        | Cause::InstrumentMoved { .. }
        | Cause::NotAtRest { .. }
        | Cause::Unexplained => None,
    }
}

/// A finding about a repeated pose that has moved too far.
fn drift(session: &Session, noted: &MeasuredText, profile: &Profile) -> Option<FindingText> {
    if noted.kind != PoseKind::Drift {
        return None;
    }
    let is_first =
        |sample: &&Sample| session.kind_of(sample) != PoseKind::Drift && session.pose_of(sample) == noted.pose;
    let first = session.counted().find(is_first)?;
    let moved = (session.point_noted(noted) - session.point_of(first)).norm();
    let sigma = session.sigma_noted(noted).unwrap_or_else(|| stated_sigma(profile));
    // The difference of two points has the scatter of six coordinates.
    let expected = 6.0_f64.sqrt() * sigma;
    let limit = (DRIFT_FACTOR * expected).max(REPEATABILITY);
    (moved > limit).then(|| FindingText {
        about: noted.number,
        cause: FindingCause::Drift,
        ratio: (moved / expected * 10.0).round() / 10.0,
        message: format!(
            "pose {}: now {:.3} mm away from measurement {} of the same pose; up to {:.3} mm is usual. The tracker, the robot base or the SMR has moved, or something is warming up: find the cause; poses measured since then may have to be measured again",
            noted.pose,
            to_mm(moved),
            first.noted.number,
            to_mm(limit)
        ),
        remedy: None,
        worst: vec![PairText {
            other: first.noted.number,
            measured_mm: to_length_mm(moved),
            predicted_mm: 0.0,
            expected_mm: to_length_mm(expected),
        }],
    })
}
