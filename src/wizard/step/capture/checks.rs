//! What the checks say about a new point: live triage by distance, and drift where a pose is measured again.

use crate::identification::PointSample;
use crate::identification::triage::{Cause, Finding, Names, PairDeviation, Triage, triage};
use crate::kinematics::Place;
use crate::profile::{Level, Profile};
use crate::session::journal::{
    Correction, FindingCause, FindingText, MeasuredText, PairText, from_edge, to_edge, to_length_mm,
};
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::{MILLIMETRE, to_mm};
use crate::wizard::step::Cx;

/// σ of a coordinate (m) where nothing is stated.
const UNKNOWN_SIGMA: f64 = 0.05 * MILLIMETRE;
/// A pose that is measured again may be off by this many standard deviations of a distance …
const DRIFT_FACTOR: f64 = 6.0;
/// … and by what a robot does not repeat (m).
const REPEATABILITY: f64 = 0.1 * MILLIMETRE;
/// Factors between units that differ by less than this are the same.
const SAME_FACTOR: f64 = 1e-9;

/// What the distances say about a point.
struct Found {
    text: FindingText,
    /// Something else is as likely.
    is_ambiguous: bool,
}

/// Judges a point that is about to be written: writes into it all that is found, the most important first, and what its
/// coordinates count times where it is in the other unit still that the measurement before was corrected to.
pub(super) fn judge(cx: &Cx<'_>, noted: &mut MeasuredText) {
    let Some(profile) = cx.profile() else { return };
    let mut found = by_distance(cx, noted, &profile);
    noted.factor = found.as_ref().and_then(|found| unit_before(cx.session, noted, found));
    if noted.factor.is_some() {
        found = by_distance(cx, noted, &profile);
    }
    let found = found.map(|found| found.text);
    // How far a point in an unknown unit has moved cannot be told.
    let has_unit = !matches!(found.as_ref().and_then(|found| found.remedy.as_ref()), Some(Correction::Scale { .. }));
    let drift = drift(cx.session, noted, &profile).filter(|_| has_unit);
    noted.findings = drift.into_iter().chain(found).collect();
}

/// What the coordinates of a new point count times if it is found to be in another unit, and for sure in the one that the
/// measurement before was corrected to. Once corrected, the operator is not asked again for every point.
fn unit_before(session: &Session, noted: &MeasuredText, found: &Found) -> Option<f64> {
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

/// What the distances to all earlier points say.
fn by_distance(cx: &Cx<'_>, noted: &MeasuredText, profile: &Profile) -> Option<Found> {
    let session = cx.session;
    let robot = cx.robot()?;
    // A sample of the same row is about to be superseded.
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
    let found = triage(&Triage {
        arm: &profile.arm(),
        parameters: &profile.free_parameters(Level::Geometric),
        sigma: stated_sigma(profile),
        planned: &planned,
        samples: &samples,
        excluded: &excluded,
        scatter: None,
    })?;
    let number = |index: usize| earlier.get(index).map_or(noted.number, |sample| sample.noted.number);
    // A drift pose has the name of the pose that it repeats.
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
    Some(Found { text, is_ambiguous: found.is_ambiguous() })
}

/// The distances that fit least.
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

/// What would set it right, where something short of measuring again does.
fn remedy(
    found: &Finding,
    cx: &Cx<'_>,
    number: &dyn Fn(usize) -> u64,
    samples: &[PointSample],
    rows: &[usize],
) -> Option<Correction> {
    match &found.cause {
        Cause::Unit { factor, since } => {
            // From the first sample on means from the first measurement on: refused ones and circles came the same way.
            let since = if *since == 0 { 1 } else { number(*since) };
            // Up to this one: in which unit those are that follow must show.
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

/// How far a pose that is measured again has moved, where that is too far.
fn drift(session: &Session, noted: &MeasuredText, profile: &Profile) -> Option<FindingText> {
    if noted.kind != PoseKind::Drift {
        return None;
    }
    let is_first =
        |sample: &&Sample| session.kind_of(sample) != PoseKind::Drift && session.pose_of(sample) == noted.pose;
    let first = session.counted().find(is_first)?;
    let moved = (session.point_noted(noted) - session.point_of(first)).norm();
    let sigma = session.sigma_noted(noted).unwrap_or_else(|| stated_sigma(profile));
    // Six coordinates scatter.
    let expected = 6.0_f64.sqrt() * sigma;
    let limit = (DRIFT_FACTOR * expected).max(REPEATABILITY);
    (moved > limit).then(|| FindingText {
        about: noted.number,
        cause: FindingCause::Drift,
        ratio: (moved / expected * 10.0).round() / 10.0,
        message: format!(
            "pose {}: measured {:.3} mm away from where it was at measurement {}; up to {:.3} mm is usual. The tracker, the robot's base or the SMR has moved, or something warms up: look for it; what was measured since may have to be measured again",
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
