//! The view of the capture step.

use super::{CaptureStep, has_enough};
use crate::session::journal::PairText;
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, SampleState, Session};
use crate::units::to_mm;
use crate::wizard::step::Cx;
use crate::wizard::view::{
    CaptureView, DriftView, FindingView, JointShown, MeasuredRow, PairView, PredictionView, RowState, RowView,
    SampleView,
};

/// The view of a capture step.
pub(super) fn view(step: &CaptureStep, cx: &Cx<'_>) -> CaptureView {
    let session = cx.session;
    let rows: Vec<RowView> = (0..session.rows.len()).filter_map(|row| row_view(session, row)).collect();
    let count = |kind| session.counted_of(kind).count();
    let open = session.open_rows().count();
    let measured = session.counted().count();
    CaptureView {
        row: step.row,
        pose: step.row.and_then(|row| session.rows.get(row)).map(|row| row.planned.pose.clone()),
        kind: step.row.and_then(|row| session.rows.get(row)).map(|row| row.planned.kind),
        joints: joints(step, cx),
        on_the_way: step.stops().iter().map(|stop| stop.name.clone()).collect(),
        move_check: step.move_check(),
        predicted_point_in_base_mm: step
            .row
            .and_then(|row| session.rows.get(row)?.planned.point_in_base)
            .map(|point| [to_mm(point.x), to_mm(point.y), to_mm(point.z)]),
        measured,
        open,
        skipped: session.rows.iter().filter(|row| row.active && row.skipped).count(),
        identification: count(PoseKind::Identification),
        verification: count(PoseKind::Verification),
        minutes_left: minutes_left(session, open),
        last: session.samples.last().map(|sample| sample_view(session, sample)),
        held: step.held.as_ref().map(|held| held.reason.clone()),
        finding: step.doubt(session).map(|(about, finding)| FindingView {
            pose: session.pose_of(about).to_owned(),
            measurement: about.noted.number,
            cause: finding.cause,
            message: finding.message.clone(),
            has_remedy: finding.remedy.is_some(),
            worst: finding.worst.iter().map(|pair| pair_view(session, pair)).collect(),
        }),
        drift: drift(session),
        prediction: prediction(step, cx),
        typed_unit: CaptureStep::manual_unit(cx).map(|unit| unit.sign().to_owned()),
        too_few: has_enough(session, step.fewest).err(),
        rows,
        notes: session.notes.iter().map(|note| (note.pose.clone(), note.text.clone())).collect(),
        refused: session.refused.iter().map(|refused| (refused.pose.clone(), refused.reason.clone())).collect(),
    }
}

/// The configuration to go to next. The joint that moves most is marked.
fn joints(step: &CaptureStep, cx: &Cx<'_>) -> Vec<JointShown> {
    let (Some(row), Some(robot)) = (step.row.and_then(|row| cx.session.rows.get(row)), cx.robot()) else {
        return Vec::new();
    };
    let configuration = step.next_stop().unwrap_or(&row.planned.configuration);
    let from = cx.session.arm().map(|(_, arm)| arm);
    let moves: Vec<f64> = configuration
        .iter()
        .enumerate()
        .map(|(index, value)| from.as_ref().and_then(|from| from.get(index)).map_or(0.0, |from| (value - from).abs()))
        .collect();
    let most = moves.iter().copied().fold(0.0, f64::max);
    robot
        .profile
        .chain()
        .joints()
        .iter()
        .zip(configuration)
        .zip(&moves)
        .map(|((joint, value), moved)| {
            let quantity = joint.joint_type.quantity();
            JointShown {
                name: joint.name.clone(),
                value: quantity.to_edge(*value),
                unit: quantity.unit().to_owned(),
                moves: quantity.to_edge(*moved),
                moves_most: most > 0.0 && moved.to_bits() == most.to_bits(),
            }
        })
        .collect()
}

fn row_view(session: &Session, index: usize) -> Option<RowView> {
    let row = session.rows.get(index)?;
    if !row.planned.kind.is_measured() {
        return None;
    }
    let sample = session.sample_of_row(index);
    let left_out = session.samples.iter().any(|sample| sample.row == index && sample.state == SampleState::LeftOut);
    let state = match sample {
        Some(_) => RowState::Measured,
        None if left_out => RowState::LeftOut,
        None if row.skipped => RowState::Skipped,
        None if !row.active => return None,
        None => RowState::Open,
    };
    let pose = row.planned.pose.clone();
    let has_note = session.notes.iter().any(|note| note.pose.as_ref() == Some(&pose));
    let measured = sample.map(|sample| MeasuredRow {
        fit_mm: fit_mm(session, sample),
        scatter_mm: sample.noted.scatter_mm,
        shots: sample.noted.shots,
        // `2026-03-01T09:15:02Z`
        time: sample.time.to_string().get(11..16).unwrap_or_default().to_owned(),
    });
    Some(RowView { row: index, pose, kind: row.planned.kind, state, measured, has_note })
}

/// How far a sample is from where the identified arm has it (mm), if the result is of the samples that count now.
fn fit_mm(session: &Session, sample: &Sample) -> Option<f64> {
    let result = session.identified.as_ref().filter(|_| session.is_current())?;
    let at = result.samples.iter().position(|number| *number == sample.noted.number)?;
    let (x, y, z) = result.points.get(at)?.identified_mm;
    Some(x.hypot(y).hypot(z))
}

fn sample_view(session: &Session, sample: &Sample) -> SampleView {
    let point = session.point_of(sample);
    SampleView {
        measurement: sample.noted.number,
        pose: session.pose_of(sample).to_owned(),
        xyz_mm: [to_mm(point.x), to_mm(point.y), to_mm(point.z)],
        scatter_mm: sample.noted.scatter_mm,
        counts: sample.state == SampleState::Counts,
    }
}

/// A distance with the name of the pose at its other end.
fn pair_view(session: &Session, pair: &PairText) -> PairView {
    let other = session.sample(pair.other);
    PairView {
        pose: other.map_or_else(|| "?".to_owned(), |other| session.pose_of(other).to_owned()),
        is_drift: other.is_some_and(|other| session.kind_of(other) == PoseKind::Drift),
        measured_mm: pair.measured_mm,
        predicted_mm: pair.predicted_mm,
        difference_mm: pair.measured_mm - pair.predicted_mm,
        expected_mm: pair.expected_mm,
    }
}

/// Movement of each repeated pose since its first measurement.
fn drift(session: &Session) -> Vec<DriftView> {
    let mut found = Vec::new();
    for sample in session.counted_of(PoseKind::Drift) {
        let pose = session.pose_of(sample);
        let first =
            session.counted().find(|first| session.kind_of(first) != PoseKind::Drift && session.pose_of(first) == pose);
        if let Some(first) = first {
            let moved = (session.point_of(sample) - session.point_of(first)).norm();
            found.push(DriftView { pose: pose.to_owned(), measurement: sample.noted.number, moved_mm: to_mm(moved) });
        }
    }
    found
}

fn prediction(step: &CaptureStep, cx: &Cx<'_>) -> Option<PredictionView> {
    let prediction = &step.prediction;
    let acceptance = cx.robot()?.profile.acceptance();
    let limit = acceptance.position_rms.or(acceptance.position_mean);
    let is_identification =
        |row: &usize| cx.session.rows.get(*row).is_some_and(|row| row.planned.kind == PoseKind::Identification);
    Some(PredictionView {
        curve_mm: prediction.curve.iter().map(|(poses, error)| (*poses, to_mm(*error))).collect(),
        now_mm: to_mm(prediction.now()?),
        with_all_mm: prediction.with_all.map(to_mm),
        limit_mm: limit.map(to_mm),
        open: cx.session.open_rows().filter(is_identification).count(),
        is_enough: prediction.is_enough(limit),
    })
}

/// Minutes for the remaining rows at the pace so far, the median time from sample to sample.
fn minutes_left(session: &Session, open: usize) -> Option<f64> {
    let times: Vec<f64> = session.samples.iter().map(|sample| sample.time.as_millisecond() as f64 / 60_000.0).collect();
    pace(&times).map(|minutes| minutes * open as f64)
}

/// Longest time from sample to sample that is no pause (min).
const LONGEST_STEP: f64 = 5.0;

/// The usual time from sample to sample, from their times in minutes.
fn pace(times: &[f64]) -> Option<f64> {
    // A clock that was set back, or a lunch break, says nothing about the pace.
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0 && *step <= LONGEST_STEP).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_do_not_count_for_the_pace() {
        assert_eq!(pace(&[0.0, 1.0, 61.0]), Some(1.0));
        assert_eq!(pace(&[0.0, 1.0, 61.0, 121.0, 122.0]), Some(1.0));
        assert_eq!(pace(&[0.0, 60.0, 59.0]), None);
        assert_eq!(pace(&[0.0, 4.0]), Some(4.0));
        assert_eq!(pace(&[0.0]), None);
    }
}
