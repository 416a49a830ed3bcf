//! The view of the capture step.

use super::{CaptureStep, has_enough};
use crate::geometry::Registration;
use crate::kinematics::ForwardKinematics;
use crate::profile::Profile;
use crate::session::journal::{PairText, to_edge};
use crate::session::plan::PoseKind;
use crate::session::state::{Note, Sample, SampleState, Session};
use crate::session::station;
use crate::units::to_mm;
use crate::wizard::step::Cx;
use crate::wizard::view::{
    CaptureView, DriftView, ExpectedView, FindingView, JointShown, MeasuredRow, PairView, PredictionView, RowState,
    RowView, SampleView,
};

/// Most samples that are compared with the nominal arm whenever the screen is drawn.
const MOST_COMPARED: usize = 300;

/// The view of a capture step.
pub(super) fn view(step: &CaptureStep, cx: &Cx<'_>) -> CaptureView {
    let session = cx.session;
    let fits = Fits::new(session);
    let rows: Vec<RowView> = (0..session.rows.len()).filter_map(|row| row_view(session, row, &fits)).collect();
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
            .map(|point| [point.x, point.y, point.z].map(to_mm)),
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
        expected: step.row.and_then(|row| expected(session, row, &fits)),
        fit_is_nominal: matches!(fits, Fits::Nominal(_)),
        proposed: step.proposal.as_ref().map(|proposal| proposal.view(session)),
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

fn row_view(session: &Session, index: usize, fits: &Fits) -> Option<RowView> {
    let row = session.rows.get(index)?;
    if !row.planned.kind.is_measured() {
        return None;
    }
    let stands =
        |sample: &&Sample| sample.row == index && matches!(sample.state, SampleState::Counts | SampleState::LeftOut);
    let sample = session.samples.iter().find(stands);
    let state = match sample {
        Some(sample) if sample.state == SampleState::LeftOut => RowState::LeftOut,
        Some(_) => RowState::Measured,
        None if row.skipped => RowState::Skipped,
        None if !row.active => return None,
        None => RowState::Open,
    };
    let about = |note: &&Note| note.pose.as_ref() == Some(&row.planned.pose);
    let joint_types = session.robot.as_ref().map_or(&[][..], |robot| &robot.joint_types);
    Some(RowView {
        row: index,
        pose: session.row_name(index),
        kind: row.planned.kind,
        state,
        joints: to_edge(&row.planned.configuration, joint_types),
        measured: sample.map(|sample| measured_row(session, sample, fits)),
        notes: session.notes.iter().filter(about).map(|note| note.text.clone()).collect(),
    })
}

fn measured_row(session: &Session, sample: &Sample, fits: &Fits) -> MeasuredRow {
    let number = sample.noted.number;
    let findings = session.samples.iter().flat_map(|sample| &sample.noted.findings);
    MeasuredRow {
        fit_mm: fits.of(session, sample),
        shots: sample.noted.shots,
        // `2026-03-01T09:15:02Z`
        time: sample.time.to_string().get(11..16).unwrap_or_default().to_owned(),
        sample: sample_view(session, sample),
        findings: findings.filter(|finding| finding.about == number).map(|finding| finding.message.clone()).collect(),
        earlier: session.samples.iter().filter(|other| other.row == sample.row && other.noted.number < number).count(),
    }
}

/// What samples are compared with.
enum Fits {
    /// The identified arm: the result is of the samples that count now.
    Identified,
    /// The nominal arm, to which the samples are registered.
    Nominal(Box<(Registration, Profile)>),
    /// Nothing yet.
    Unknown,
}

impl Fits {
    /// The identified arm if there is one, or else the nominal one, for as many samples as are compared in no time.
    fn new(session: &Session) -> Self {
        if session.identified.is_some() && session.is_current() {
            return Self::Identified;
        }
        Self::nominal(session).map_or(Self::Unknown, Self::Nominal)
    }

    /// The samples registered to the nominal arm.
    fn nominal(session: &Session) -> Option<Box<(Registration, Profile)>> {
        if session.samples.len() > MOST_COMPARED {
            return None;
        }
        Some(Box::new((station::registration(session)?, session.mounted_profile()?)))
    }

    /// How far a sample is from where the arm has it (mm).
    fn of(&self, session: &Session, sample: &Sample) -> Option<f64> {
        match self {
            Self::Identified => {
                let result = session.identified.as_ref()?;
                let at = result.samples.iter().position(|number| *number == sample.noted.number)?;
                let (x, y, z) = result.points.get(at)?.identified_mm;
                Some(x.hypot(y).hypot(z))
            }
            Self::Nominal(with) => {
                let (registration, profile) = with.as_ref();
                let target = profile.targets().first()?.position_in_flange;
                let q = session.configuration_of(sample);
                let nominal = ForwardKinematics::new(profile.chain()).point_in_base(&q, &target);
                Some(to_mm((registration.to_from_from * session.point_of(sample) - nominal).norm()))
            }
            Self::Unknown => None,
        }
    }
}

/// Where the instrument will see the SMR at a row.
fn expected(session: &Session, row: usize, fits: &Fits) -> Option<ExpectedView> {
    let own = if matches!(fits, Fits::Identified) { Fits::nominal(session) } else { None };
    let with = match (fits, &own) {
        (Fits::Nominal(with), _) => with,
        (_, own) => own.as_ref()?,
    };
    let (registration, profile) = with.as_ref();
    let target = profile.targets().first()?.position_in_flange;
    let q = &session.rows.get(row)?.planned.configuration;
    let in_base = ForwardKinematics::new(profile.chain()).point_in_base(q, &target);
    let point = registration.to_from_from.inverse_transform_point(&in_base);
    Some(ExpectedView { xyz_mm: [point.x, point.y, point.z].map(to_mm), spread_mm: to_mm(registration.rms) })
}

fn sample_view(session: &Session, sample: &Sample) -> SampleView {
    let point = session.point_of(sample);
    SampleView {
        measurement: sample.noted.number,
        pose: session.pose_of(sample).to_owned(),
        xyz_mm: [point.x, point.y, point.z].map(to_mm),
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
/// Shortest time from sample to sample (min) of points that were not given together.
const SHORTEST_STEP: f64 = 0.03;

/// The usual time from sample to sample, from their times in minutes.
fn pace(times: &[f64]) -> Option<f64> {
    // A clock that was set back, or a lunch break, says nothing about the pace.
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| (SHORTEST_STEP..=LONGEST_STEP).contains(step)).collect();
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
