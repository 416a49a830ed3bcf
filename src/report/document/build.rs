//! The report of a session.

use std::collections::BTreeSet;

use nalgebra::Point3;

use super::decisions::{corrections, findings, not_counted};
use super::{
    AirPart, BodyPart, Counts, DecisionPart, Details, Document, DriftPart, FilePart, Found, ParameterNote, PointOrigin,
    PointPart, PredictionPart, RemarkPart, ResultState, RobotPart, SCHEMA, SessionPart, TemperaturePart,
};
use crate::kinematics::ForwardKinematics;
use crate::profile::Capsule;
use crate::report::text::found;
use crate::session::about::Day;
use crate::session::journal::{MeasuredText, instrument_text, target_text};
use crate::session::plan::PoseKind;
use crate::session::set_up::{InstrumentChoice, PayloadText, TargetChoice};
use crate::session::sha256;
use crate::session::state::{Robot, Sample, Session};
use crate::session::summary::{IdentificationSummary, ParameterSummary, WarningCode};
use crate::units::to_mm;

/// Points of the drawn arm closer than this (mm) are one.
const SAME_POINT: f64 = 0.001;

/// Whether the points of a result are simulated according to its table.
fn says_simulated(result: Option<&IdentificationSummary>) -> bool {
    result.is_some_and(|result| result.warnings.iter().any(|warning| warning.code == WarningCode::Simulated))
}

impl Document {
    /// The report of a session in its current state, with the hashes of the `files` (name and text) beside it.
    pub fn new(session: &Session, files: &[(String, String)]) -> Self {
        let result = session.identified.as_deref().map(|result| result.summary.clone());
        let parameters = result.as_ref().map_or(&[][..], |result| &result.parameters);
        let drawn = drawn_arm(session);
        let report = Details {
            schema: SCHEMA,
            number: String::new(),
            state: state(session),
            decision: result.as_ref().map(|result| DecisionPart::new(result, state(session))),
            certificate_expired: certificate_expired(session),
            points_from: match &session.instrument {
                None if says_simulated(result.as_ref()) => PointOrigin::Simulated,
                None => PointOrigin::Tables,
                Some(InstrumentChoice::Manual { .. }) => PointOrigin::Typed,
                Some(InstrumentChoice::Simulated(_)) => PointOrigin::Simulated,
                Some(InstrumentChoice::Linked(_)) if session.is_simulated() => PointOrigin::Simulated,
                Some(InstrumentChoice::Linked(_)) => PointOrigin::Instrument,
                Some(InstrumentChoice::Replay { .. }) => PointOrigin::Recorded,
            },
            session: session_part(session),
            about: session.about.clone(),
            robot: session.robot.as_ref().map(robot_part),
            instrument: session.instrument.as_ref().map(|instrument| {
                let identities = session.identities.iter().map(|identity| format!("; {identity}"));
                instrument_text(instrument) + &identities.collect::<String>()
            }),
            target: target(session),
            payload: payload(session),
            temperature: temperature(session),
            air: air(session),
            counts: counts(session),
            parameter_notes: parameters.iter().map(|parameter| note(parameter, session)).collect(),
            points: points(session),
            arm_mm: drawn.line,
            bodies: drawn.bodies,
            plan: session.plan.clone(),
            prediction: prediction(session),
            drift: drift(session),
            not_counted: not_counted(session),
            refused: session.refused.clone(),
            findings: findings(session),
            corrections: corrections(session),
            notes: session.notes.clone(),
            remarks: remarks(session),
            files: files
                .iter()
                .map(|(name, text)| FilePart { name: name.clone(), sha256: sha256(text.as_bytes()) })
                .collect(),
        };
        Self { result, report }
    }
}

impl Document {
    /// The report of an identification from tables, in the form of a `session`: nothing is known about the time of measuring.
    pub fn of_tables(session: &Session, files: &[(String, String)]) -> Self {
        let mut document = Self::new(session, files);
        let program = std::mem::take(&mut document.report.session.program);
        document.report.session = SessionPart { program, ..SessionPart::default() };
        // Tables do not say how many readings are behind a row.
        (document.report.counts.fewest_shots, document.report.counts.most_shots) = (0, 0);
        document
    }
}

fn state(session: &Session) -> ResultState {
    match &session.identified {
        None => ResultState::None,
        Some(_) if !session.is_current() => ResultState::OutOfDate,
        Some(result) if result.calibration.is_none() => ResultState::Unusable,
        Some(_) => ResultState::Current,
    }
}

fn session_part(session: &Session) -> SessionPart {
    let times = || session.counted().map(|sample| sample.time);
    SessionPart {
        name: session.name.clone(),
        program: session.program.clone(),
        opened: session.opened.map(|time| time.to_string()),
        first_sample: times().min().map(|time| time.to_string()),
        last_sample: times().max().map(|time| time.to_string()),
        worked_min: session.worked / 60.0,
        resumed: session.resumed,
        journal_entries: session.lines,
    }
}

fn robot_part(robot: &Robot) -> RobotPart {
    let profile = &robot.profile;
    let joints = profile.chain().joints();
    RobotPart {
        title: profile.title().to_owned(),
        profile: profile.name().to_owned(),
        source: profile.source().to_owned(),
        profile_sha256: robot.sha256.clone(),
        joints: joints.iter().map(|joint| joint.name.clone()).collect(),
        joint_units: joints.iter().map(|joint| joint.joint_type.quantity().unit()).collect(),
        instrument: profile
            .instrument()
            .map(|instrument| format!("{}, {} per coordinate", instrument.name, instrument.sigma_text())),
    }
}

/// Position of the SMR on the flange, with coordinates where it is that of the profile.
fn target(session: &Session) -> Option<String> {
    let first = session.robot.as_ref()?.profile.targets().first()?;
    Some(match &session.target {
        Some(choice) if *choice != TargetChoice::Profile => target_text(choice),
        _ => {
            let [x, y, z] = first.position_in_flange.coords.map(to_mm).into();
            let known =
                if first.is_free() { format!(", to {} mm", to_mm(first.uncertainty)) } else { ", exact".to_owned() };
            format!("as the profile says: {} at ({x:.3}, {y:.3}, {z:.3}) mm in the flange{known}", first.name)
        }
    })
}

/// What the flange carried: as stated in the session, else as the profile says.
fn payload(session: &Session) -> Option<String> {
    if let Some(stated) = session.payload {
        return Some(stated.to_string());
    }
    let of_profile = session.robot.as_ref()?.profile.payload()?;
    Some(format!("as the profile says: {}", PayloadText::of(of_profile)))
}

fn temperature(session: &Session) -> Option<TemperaturePart> {
    let measured = session.counted().filter_map(|sample| sample.noted.temperature_degc);
    let measured: Vec<f64> = measured.filter(|value| value.is_finite()).collect();
    let lowest_degc = measured.iter().copied().reduce(f64::min)?;
    let highest_degc = measured.iter().copied().reduce(f64::max)?;
    Some(TemperaturePart { lowest_degc, highest_degc, samples: measured.len() })
}

/// Change of a distance that light measures in air, per K, hPa and % of relative humidity (ppm): the derivatives of Edlén's equation
/// at 20 °C, 1013 hPa and 50 %, 633 nm.
const PPM_PER_DEGREE: f64 = 0.93;
const PPM_PER_HECTOPASCAL: f64 = -0.27;
const PPM_PER_PERCENT: f64 = 0.0085;

fn air(session: &Session) -> Option<AirPart> {
    let range = |of: fn(&MeasuredText) -> Option<f64>| {
        let values: Vec<f64> =
            session.counted().filter_map(|sample| of(&sample.noted)).filter(|value| value.is_finite()).collect();
        Some((values.iter().copied().reduce(f64::min)?, values.iter().copied().reduce(f64::max)?))
    };
    let (pressure_hpa, humidity_percent) = (range(|noted| noted.pressure_hpa), range(|noted| noted.humidity_percent));
    pressure_hpa.or(humidity_percent)?;
    let effect = |noted: &MeasuredText| {
        PPM_PER_DEGREE * noted.temperature_degc.unwrap_or(0.0)
            + PPM_PER_HECTOPASCAL * noted.pressure_hpa.unwrap_or(0.0)
            + PPM_PER_PERCENT * noted.humidity_percent.unwrap_or(0.0)
    };
    let first = session.counted().next().map_or(0.0, |sample| effect(&sample.noted));
    let change_ppm = session.counted().map(|sample| (effect(&sample.noted) - first).abs()).fold(0.0, f64::max);
    Some(AirPart { pressure_hpa, humidity_percent, change_ppm })
}

fn counts(session: &Session) -> Counts {
    let count = |kind| session.counted_of(kind).count();
    let judged: Vec<&Sample> = [PoseKind::Identification, PoseKind::Verification]
        .into_iter()
        .flat_map(|kind| session.counted_of(kind))
        .collect();
    // Minus zero is zero.
    let joints = |sample: &Sample| sample.joints.iter().map(|value| (value + 0.0).to_bits()).collect::<Vec<u64>>();
    let different: BTreeSet<_> = judged.iter().map(|sample| (joints(sample), sample.noted.target)).collect();
    let shots = || judged.iter().map(|sample| sample.noted.shots);
    Counts {
        identification: count(PoseKind::Identification),
        verification: count(PoseKind::Verification),
        drift: count(PoseKind::Drift),
        repeats: judged.len() - different.len(),
        fewest_shots: shots().min().unwrap_or(0),
        most_shots: shots().max().unwrap_or(0),
        open: session.open_rows().count(),
        skipped: session.rows.iter().filter(|row| row.active && row.skipped).count(),
    }
}

fn note(parameter: &ParameterSummary, session: &Session) -> ParameterNote {
    let meaning = session.robot.as_ref().map(|robot| parameter.id.meaning(robot.profile.chain())).unwrap_or_default();
    ParameterNote { name: parameter.id.to_string(), meaning, found: found(parameter) }
}

fn points(session: &Session) -> Vec<PointPart> {
    let Some(result) = session.identified.as_deref() else { return Vec::new() };
    let part = |(number, point): (&u64, &crate::session::journal::PointErrorText)| {
        let sample = session.sample(*number)?;
        let array = |(x, y, z): (f64, f64, f64)| [x, y, z];
        Some(PointPart {
            number: *number,
            pose: session.pose_of(sample).to_owned(),
            verification: session.kind_of(sample) == PoseKind::Verification,
            rejected: point.rejected,
            joints: sample.joints.clone(),
            at_mm: array(point.at_mm),
            nominal_mm: array(point.nominal_mm),
            identified_mm: array(point.identified_mm),
        })
    };
    result.samples.iter().zip(&result.points).filter_map(part).collect()
}

/// The day on which the certificate of the instrument expired, if it was measured with later.
fn certificate_expired(session: &Session) -> Option<Day> {
    let due = session.about.certificate_due?;
    let last = session.counted().map(|sample| sample.time).max()?;
    (Day::of(last) > due).then_some(due)
}

/// Remarks of samples that count, in the order in which they were first made.
fn remarks(session: &Session) -> Vec<RemarkPart> {
    let mut remarks: Vec<RemarkPart> = Vec::new();
    for sample in session.counted() {
        for text in &sample.noted.remarks {
            match remarks.iter_mut().find(|remark| remark.text == *text) {
                Some(remark) => remark.samples += 1,
                None => remarks.push(RemarkPart { text: text.clone(), first: sample.noted.number, samples: 1 }),
            }
        }
    }
    remarks
}

/// An arm as it is drawn, in mm.
#[derive(Default)]
struct DrawnArm {
    line: Vec<[f64; 3]>,
    bodies: Vec<BodyPart>,
}

/// The nominal arm at the first sample that counts, or in the middle of its ranges.
fn drawn_arm(session: &Session) -> DrawnArm {
    let Some(profile) = session.mounted_profile() else { return DrawnArm::default() };
    let middle = || {
        let ranges = profile.joints().iter();
        let middle = |(low, high)| f64::midpoint(low, high);
        ranges.map(|range| range.planning_limits.or(range.limits).map_or(0.0, middle)).collect::<Vec<_>>()
    };
    let first = session.counted_of(PoseKind::Identification).next();
    let q = first.map_or_else(middle, |sample| session.configuration_of(sample));
    let forward = ForwardKinematics::new(profile.chain());
    let links = forward.base_from_links(&q);
    let mut line = vec![Point3::origin()];
    line.extend(links.iter().map(|frame| Point3::from(frame.translation.vector)));
    line.extend(profile.targets().first().map(|target| forward.point_in_base(&q, &target.position_in_flange)));
    let mm = |point: &Point3<f64>| [to_mm(point.x), to_mm(point.y), to_mm(point.z)];
    let mut line: Vec<[f64; 3]> = line.iter().map(mm).collect();
    line.dedup_by(|one, other| one.iter().zip(other.iter()).all(|(a, b)| (a - b).abs() < SAME_POINT));
    let body = |body: &Capsule| {
        let frame = links.get(body.link)?;
        let [from_mm, to_mm] = [body.from, body.to].map(|end| mm(&(frame * end)));
        Some(BodyPart { from_mm, to_mm, radius_mm: crate::units::to_mm(body.radius) })
    };
    DrawnArm { bodies: profile.bodies().iter().filter_map(body).collect(), line }
}

fn prediction(session: &Session) -> Vec<PredictionPart> {
    let samples = session.counted_of(PoseKind::Identification).enumerate();
    samples
        .filter_map(|(index, sample)| {
            let predicted_error_sigma = sample.noted.predicted_error_sigma.filter(|value| value.is_finite())?;
            Some(PredictionPart { samples: index + 1, predicted_error_sigma })
        })
        .collect()
}

/// Repetitions against the first sample of the same pose.
fn drift(session: &Session) -> Vec<DriftPart> {
    let part = |sample: &Sample| {
        let pose = session.pose_of(sample);
        let first = session.counted().find(|other| session.pose_of(other) == pose)?;
        let moved = (session.point_of(sample) - session.point_of(first)).map(to_mm);
        let is_repeated = first.noted.number != sample.noted.number && moved.iter().all(|value| value.is_finite());
        is_repeated.then(|| DriftPart {
            number: sample.noted.number,
            pose: pose.to_owned(),
            since: first.noted.number,
            minutes: sample.time.duration_since(first.time).as_secs_f64() / 60.0,
            moved_mm: moved.into(),
        })
    };
    session.counted_of(PoseKind::Drift).filter_map(part).collect()
}

impl Found {
    /// The word in a table.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::Weakly => "weakly",
            Self::OnlyCombined => "only combined",
        }
    }
}
