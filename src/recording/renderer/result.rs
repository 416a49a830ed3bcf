//! A result: both arms, their errors at every sample, and the steps of the solver.

use std::iter;

use jiff::Timestamp;
use nalgebra::{Matrix3, Point3, Vector3};
use rerun::{
    Arrows3D, BarChart, Color, Ellipsoids3D, FillMode, LineStrips3D, Points3D, Radius, Scalars, SeriesLines,
    SeriesPoints, Tensor, TensorData,
};

use super::tracker::Station;
use super::{cell, document};
use crate::geometry::{enlargement, register};
use crate::profile::Profile;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::posture::{Posture, reach, rest};
use crate::recording::{names, style};
use crate::session::calibration::Calibration;
use crate::session::journal::{IdentifiedText, PointErrorText, from_xyz_mm};
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::{MICROMETRE, MILLIMETRE, to_mm};

/// Largest drawn length of errors and differences, as a fraction of the arm's reach.
const SHOWN: f64 = 0.15;
/// Largest drawn half axis of ellipsoids, as a fraction of the arm's reach.
const SHOWN_ELLIPSOID: f64 = 0.05;
/// Number of pairs that are drawn.
const WORST_PAIRS: usize = 12;
/// Most samples in the map of all pairs; more are thinned out evenly.
const MAP_SIZE: usize = 128;

/// A sample with the errors of both arms (m).
struct Judged<'a> {
    sample: &'a Sample,
    /// Pendant values ((rad) or (m)).
    q: Vec<f64>,
    /// Measured point in the frame of the tracker.
    point: Point3<f64>,
    /// Measured point in the base of the identified arm.
    measured: Point3<f64>,
    /// Point of the nominal arm, in its own registration.
    nominal_at: Point3<f64>,
    /// Point of the identified arm.
    identified_at: Point3<f64>,
    nominal: Vector3<f64>,
    identified: Vector3<f64>,
    text: &'a PointErrorText,
}

/// Draws result number `run` of `session`.
pub(super) fn draw(
    canvas: &mut Canvas,
    session: &Session,
    station: &Station,
    identified: &IdentifiedText,
    run: usize,
    time: Timestamp,
) {
    let Some(profile) = session.mounted_profile() else { return };
    document::report(canvas, session, identified, time);
    parameters(canvas, identified);
    let Some(calibration) = &identified.calibration else { return };
    let judged = judged(session, &profile, identified, calibration);
    let trusted = || judged.iter().filter(|one| !one.text.rejected);
    let scales = Scales {
        nominal: scale(&profile, trusted().map(|one| one.nominal.norm())),
        identified: scale(&profile, trusted().map(|one| one.identified.norm())),
        arm: arm_scale(&profile, calibration, &judged),
        ellipsoid: ellipsoid_scale(&profile, &judged),
    };
    vectors(canvas, &profile, &judged, &scales, time);
    arms(canvas, session, &profile, calibration, scales.arm);
    series(canvas, session, &judged, run);
    pairs(canvas, &judged);
    ellipsoids(canvas, &judged, scales.ellipsoid);
    cell::pose(canvas, &profile, station, &rest(&profile), Moment::solver(0));
    solver(canvas, &profile, identified, calibration, &judged, &scales);
    note(canvas, &profile, &scales);
}

/// Factors by which things are drawn larger than they are.
struct Scales {
    nominal: f64,
    identified: f64,
    arm: f64,
    ellipsoid: f64,
}

fn judged<'a>(
    session: &'a Session,
    profile: &Profile,
    identified: &'a IdentifiedText,
    calibration: &Calibration,
) -> Vec<Judged<'a>> {
    let target = |index: usize| {
        let (x, y, z) = calibration.nominal_targets_mm.get(index).copied()?;
        Some(from_xyz_mm((x, y, z)))
    };
    let samples = identified.samples.iter().zip(&identified.points);
    samples
        .filter_map(|(number, text)| {
            let sample = session.sample(*number)?;
            let q = session.configuration_of(sample);
            let own = profile.targets().first().map(|target| target.position_in_flange)?;
            let at = target(sample.noted.target).unwrap_or(own);
            let identified_at = from_xyz_mm(text.at_mm);
            let error = from_xyz_mm(text.identified_mm).coords;
            Some(Judged {
                sample,
                nominal_at: Posture::new(profile.chain(), &at, &q).reflector,
                q,
                point: session.point_of(sample),
                measured: identified_at + error,
                identified_at,
                nominal: from_xyz_mm(text.nominal_mm).coords,
                identified: error,
                text,
            })
        })
        .collect()
}

fn scale(profile: &Profile, lengths: impl Iterator<Item = f64>) -> f64 {
    enlargement(lengths.fold(0.0, f64::max), SHOWN * reach(profile))
}

/// Returns the factor by which the deviations of the arm are enlarged so that the difference is visible.
fn arm_scale(profile: &Profile, calibration: &Calibration, judged: &[Judged<'_>]) -> f64 {
    let Ok(arm) = calibration.identified(profile) else { return 1.0 };
    let target = Point3::origin();
    let difference = |one: &Judged<'_>| {
        let (nominal, found) =
            (Posture::new(profile.chain(), &target, &one.q), Posture::new(&arm.chain, &target, &one.q));
        (found.reflector - nominal.reflector).norm()
    };
    enlargement(judged.iter().map(difference).fold(0.0, f64::max), SHOWN * reach(profile))
}

fn ellipsoid_scale(profile: &Profile, judged: &[Judged<'_>]) -> f64 {
    let axes = judged.iter().filter_map(|one| covariance(one.text)).map(|one| style::ellipsoid(&one).0.max());
    enlargement(axes.fold(0.0, f64::max), SHOWN_ELLIPSOID * reach(profile))
}

/// Returns an error as it is drawn. That of a rejected sample is cut, because the scale is not made for it.
fn drawn_error(profile: &Profile, one: &Judged<'_>, error: &Vector3<f64>, scale: f64) -> Vector3<f64> {
    let drawn = error * scale;
    if one.text.rejected { drawn.cap_magnitude(SHOWN * reach(profile)) } else { drawn }
}

/// Draws errors as arrows from the point of the identified arm. The timeline of the solver has arrows of its own.
fn vectors(canvas: &mut Canvas, profile: &Profile, judged: &[Judged<'_>], scales: &Scales, time: Timestamp) {
    let moment = Moment { time: Some(time), ..Moment::pose(0) };
    let arrows = |scale: f64, pick: fn(&Judged<'_>) -> Vector3<f64>| {
        Arrows3D::update_fields()
            .with_vectors(judged.iter().map(|one| style::vector(&drawn_error(profile, one, &pick(one), scale))))
            .with_origins(judged.iter().map(|one| style::at(&one.identified_at)))
    };
    let nominal = arrows(scales.nominal, |one| one.nominal);
    let identified = arrows(scales.identified, |one| one.identified);
    let all = [
        (names::ERRORS_NOMINAL, nominal, style::NOMINAL_ERROR),
        (names::ERRORS_IDENTIFIED, identified, style::IDENTIFIED),
    ];
    for (path, drawn, color) in all {
        canvas.draw_static(path, &arrow_style(color));
        canvas.draw(moment, path, &drawn);
    }
}

/// Returns the looks of arrows.
fn arrow_style(color: Color) -> Arrows3D {
    Arrows3D::update_fields().with_radii([Radius::new_ui_points(1.5)]).with_colors([color])
}

/// Draws the identified arm at every pose, true to scale and enlarged.
fn arms(canvas: &mut Canvas, session: &Session, profile: &Profile, calibration: &Calibration, enlarged: f64) {
    let larger = calibration.parameters.iter().map(|parameter| parameter.deviation * enlarged);
    let (Ok(arm), Ok(bent)) = (calibration.identified(profile), calibration.identified_with(profile, larger)) else {
        return;
    };
    cell::enlarged_style(canvas, profile);
    if let Some(target) = bent.targets.first() {
        // Before the first pose, and on the timeline of the search.
        let posture = Posture::new(&bent.chain, target, &rest(profile));
        cell::enlarged(canvas, profile, &posture, Moment::pose(0));
        cell::enlarged(canvas, profile, &posture, Moment::search(0));
    }
    for sample in &session.samples {
        let target = sample.noted.target;
        let (Some(at), Some(bent_at)) = (arm.targets.get(target), bent.targets.get(target)) else { continue };
        let moment = Moment::pose(sample.noted.number);
        let q = session.configuration_of(sample);
        let posture = Posture::new(&arm.chain, at, &q);
        for (index, frame) in posture.frames.iter().enumerate() {
            canvas.draw(moment, names::IDENTIFIED_FRAMES, &style::frame(frame, &names::frame("identified", index)));
        }
        cell::enlarged(canvas, profile, &Posture::new(&bent.chain, bent_at, &q), moment);
    }
}

/// The use that the identification made of a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Group {
    Fit,
    Verification,
    Rejected,
}

impl Group {
    const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Verification => "verification",
            Self::Rejected => "rejected",
        }
    }
}

/// Plots errors at each pose. Those of samples that the identification used are residuals, and are named so.
fn series(canvas: &mut Canvas, session: &Session, judged: &[Judged<'_>], run: usize) {
    let is_verification = |one: &Judged<'_>| session.kind_of(one.sample) == PoseKind::Verification;
    let group_of = |one: &Judged<'_>| match one.text.rejected {
        true => Group::Rejected,
        false if is_verification(one) => Group::Verification,
        false => Group::Fit,
    };
    let again = if run > 1 { format!(" (result {run})") } else { String::new() };
    let used: Vec<&Judged<'_>> = judged.iter().filter(|one| group_of(one) == Group::Fit).collect();
    for group in [Group::Fit, Group::Verification, Group::Rejected] {
        let suffix = group.name();
        let members: Vec<&Judged<'_>> = judged.iter().filter(|one| group_of(one) == group).collect();
        if members.is_empty() {
            continue;
        }
        // A rejected sample is compared with those that were used.
        let others = if group == Group::Rejected { &used } else { &members };
        for quantity in ["position", "distance"] {
            for (arm, color) in [("nominal", style::NOMINAL_ERROR), ("identified", style::IDENTIFIED)] {
                let (path, name) = (names::errors(run, quantity, arm, suffix), format!("{arm}, {suffix}{again}"));
                // A line between verification samples, which are far apart, would suggest values between them.
                let points =
                    |color| SeriesPoints::new().with_names([&*name]).with_colors([color]).with_marker_sizes([3.0]);
                match group {
                    Group::Fit => {
                        canvas.draw_static(&path, &SeriesLines::new().with_names([&*name]).with_colors([color]));
                    }
                    Group::Verification => canvas.draw_static(&path, &points(style::VERIFICATION)),
                    Group::Rejected => canvas.draw_static(&path, &points(style::OUT)),
                }
            }
        }
        for one in &members {
            let moment = Moment::pose(one.sample.noted.number);
            let mut plot = |quantity: &str, arm: &str, error: f64| {
                canvas.draw(moment, &names::errors(run, quantity, arm, suffix), &Scalars::new([to_mm(error)]));
            };
            plot("position", "nominal", one.nominal.norm());
            plot("position", "identified", one.identified.norm());
            if let Some((nominal, identified)) = distance_errors(one, others) {
                plot("distance", "nominal", nominal);
                plot("distance", "identified", identified);
            }
        }
    }
}

/// Returns the mean absolute distance errors (m) of the pairs of one sample with all others, of both arms.
fn distance_errors(one: &Judged<'_>, group: &[&Judged<'_>]) -> Option<(f64, f64)> {
    let others = group.iter().filter(|other| other.sample.noted.number != one.sample.noted.number);
    let (mut count, mut nominal, mut identified) = (0_u32, 0.0, 0.0);
    for other in others {
        let errors = pair(one, other);
        count += 1;
        nominal += errors.0.abs();
        identified += errors.1.abs();
    }
    (count > 0).then(|| (nominal / f64::from(count), identified / f64::from(count)))
}

/// Returns the distance errors (m) of a pair, measured less predicted: of the nominal and of the identified arm.
fn pair(one: &Judged<'_>, other: &Judged<'_>) -> (f64, f64) {
    let measured = (one.point - other.point).norm();
    (measured - (one.nominal_at - other.nominal_at).norm(), measured - (one.identified_at - other.identified_at).norm())
}

/// Picks the nominal or the identified one of two errors.
type Pick = fn(&(f64, f64)) -> f64;

/// Draws the worst pairs as lines, and the errors of all pairs as a map.
fn pairs(canvas: &mut Canvas, judged: &[Judged<'_>]) {
    let trusted: Vec<&Judged<'_>> = judged.iter().filter(|one| !one.text.rejected).collect();
    let step = trusted.len().div_ceil(MAP_SIZE).max(1);
    let shown: Vec<&Judged<'_>> = trusted.into_iter().step_by(step).collect();
    let mut all = Vec::new();
    let count = shown.len();
    let mut maps = (vec![0_u16; count * count], vec![0_u16; count * count]);
    for (i, one) in shown.iter().enumerate() {
        for (j, other) in shown.iter().enumerate().filter(|(j, _)| *j != i) {
            let errors = pair(one, other);
            // The map is symmetric: only one half is filled.
            if j > i {
                maps.0[i * count + j] = micrometres(errors.0);
                maps.1[i * count + j] = micrometres(errors.1);
                all.push((errors, one, other));
            }
        }
    }
    if all.is_empty() {
        return;
    }
    let shape = || vec![count as u64, count as u64];
    for (path, map) in [(names::MAP_NOMINAL, maps.0), (names::MAP_IDENTIFIED, maps.1)] {
        let data = TensorData::new(shape(), rerun::TensorBuffer::U16(map.into()));
        canvas.draw_static(path, &Tensor::new(data).with_dim_names(["sample", "with sample"]));
    }
    let picks: [(&str, Pick); 2] =
        [(names::PAIRS_NOMINAL, |errors| errors.0), (names::PAIRS_IDENTIFIED, |errors| errors.1)];
    for (path, pick) in picks {
        all.sort_by(|(one, ..), (other, ..)| pick(other).abs().total_cmp(&pick(one).abs()));
        let worst: Vec<_> = all.iter().take(WORST_PAIRS).collect();
        let largest = worst.first().map_or(1.0, |(errors, ..)| pick(errors).abs());
        let strips = worst.iter().map(|(_, one, other)| [style::at(&one.measured), style::at(&other.measured)]);
        let labels = worst.iter().map(|(errors, ..)| format!("{:+.3} mm", to_mm(pick(errors))));
        let lines = LineStrips3D::new(strips)
            .with_colors(worst.iter().map(|(errors, ..)| style::two_sided(pick(errors) / largest)))
            .with_radii([Radius::new_ui_points(1.5)])
            .with_labels(labels);
        canvas.draw_static(path, &lines);
    }
}

/// Returns the size of an error (m) in whole micrometres, up to 65 mm.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
const fn micrometres(error: f64) -> u16 {
    (error.abs() / MICROMETRE).round() as u16
}

/// Returns the covariance of a predicted position (m²).
fn covariance(text: &PointErrorText) -> Option<Matrix3<f64>> {
    let (xx, xy, xz, yy, yz, zz) = text.covariance_um2?;
    Some(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * MICROMETRE.powi(2))
}

fn ellipsoids(canvas: &mut Canvas, judged: &[Judged<'_>], scale: f64) {
    let known: Vec<_> =
        judged.iter().filter_map(|one| Some((one.identified_at, style::ellipsoid(&covariance(one.text)?)))).collect();
    let drawn = Ellipsoids3D::from_centers_and_half_sizes(
        known.iter().map(|(at, _)| style::at(at)),
        known.iter().map(|(_, (axes, _))| style::vector(&(axes * scale))),
    )
    .with_quaternions(known.iter().map(|(_, (_, rotation))| style::quaternion(rotation)))
    .with_colors([style::VERIFICATION])
    .with_line_radii([Radius::new_ui_points(0.4)])
    .with_fill_mode(FillMode::MajorWireframe);
    canvas.draw_static(names::UNCERTAINTY, &drawn);
}

/// Draws the steps of the solver: the arm bends from nominal to identified, and the errors shrink.
fn solver(
    canvas: &mut Canvas,
    profile: &Profile,
    identified: &IdentifiedText,
    calibration: &Calibration,
    judged: &[Judged<'_>],
    scales: &Scales,
) {
    let middle = rest(profile);
    let nothing = vec![0.0; calibration.parameters.len()];
    canvas.draw_static(names::ERRORS_SOLVING, &arrow_style(style::NOMINAL_ERROR));
    canvas.draw_static(names::COST_AND_STEP, &SeriesLines::new().with_names(["cost", "largest step"]));
    let steps = identified.summary.iterations.iter().map(|step| (Some(step), &step.deviations));
    for (index, (step, deviations)) in iter::once((None, &nothing)).chain(steps).enumerate() {
        let moment = Moment::solver(index);
        if let Some(step) = step {
            let (cost, largest) = (step.cost.log10(), step.step.log10());
            if cost.is_finite() && largest.is_finite() {
                canvas.draw(moment, names::COST_AND_STEP, &Scalars::new([cost, largest]));
            }
        }
        let larger = deviations.iter().map(|deviation| deviation * scales.arm);
        let Ok(bent) = calibration.identified_with(profile, larger) else { continue };
        if let Some(target) = bent.targets.first() {
            cell::enlarged(canvas, profile, &Posture::new(&bent.chain, target, &middle), moment);
        }
        let Ok(arm) = calibration.identified_with(profile, deviations.iter().copied()) else { continue };
        let predicted: Vec<Point3<f64>> = judged
            .iter()
            .filter_map(|one| {
                Some(Posture::new(&arm.chain, arm.targets.get(one.sample.noted.target)?, &one.q).reflector)
            })
            .collect();
        let pairs = judged.iter().map(|one| one.measured).zip(predicted.iter().copied());
        let trusted = judged.iter().map(|one| if one.text.rejected { 0.0 } else { 1.0 });
        let weighed = pairs.clone().zip(trusted).map(|((from, to), weight)| (weight, from, to));
        let Some(found) = register(weighed.collect::<Vec<_>>().iter().copied()) else { continue };
        let errors: Vec<Vector3<f64>> =
            pairs.map(|(measured, predicted)| found.to_from_from * measured - predicted).collect();
        let arrows = Arrows3D::update_fields()
            .with_vectors(
                judged
                    .iter()
                    .zip(&errors)
                    .map(|(one, error)| style::vector(&drawn_error(profile, one, error, scales.nominal))),
            )
            .with_origins(predicted.iter().map(style::at));
        canvas.draw(moment, names::ERRORS_SOLVING, &arrows);
        let counted = judged.iter().zip(&errors).filter(|(one, _)| !one.text.rejected);
        let (count, sum) = counted.fold((0_u32, 0.0), |(count, sum), (_, error)| (count + 1, sum + error.norm()));
        let mean = sum / f64::from(count.max(1));
        canvas.draw(moment, names::FIT, &Scalars::new([to_mm(mean)]));
    }
}

/// Draws the deviations of the constants as bars, in units of their standard deviation.
fn parameters(canvas: &mut Canvas, identified: &IdentifiedText) {
    let of_sigma: Vec<f64> = identified
        .summary
        .constants()
        .map(|parameter| parameter.sigma.map_or(0.0, |sigma| finite(parameter.deviation / sigma)))
        .collect();
    let data = TensorData::new(vec![of_sigma.len() as u64], rerun::TensorBuffer::F64(of_sigma.into()));
    canvas.draw_static(names::SIGNIFICANCE, &BarChart::new(data).with_color(style::IDENTIFIED));
}

/// Returns zero for values that cannot be drawn.
const fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

/// Draws the factors of enlargement above the robot.
fn note(canvas: &mut Canvas, profile: &Profile, scales: &Scales) {
    let text = format!(
        "drawn larger:\nred errors (nominal) {} x\ngreen errors (identified) {} x\ngreen arm's deviations {} x",
        scales.nominal, scales.identified, scales.arm
    );
    // Points are rarely above the arm.
    let at = Point3::new(0.0, 0.0, 0.85 * reach(profile));
    let note = Points3D::new([style::at(&at)])
        .with_radii([style::single(0.1 * MILLIMETRE)])
        .with_colors([style::NOMINAL])
        .with_labels([text])
        .with_show_labels(true);
    canvas.draw_static(names::SCALE_NOTE, &note);
}
