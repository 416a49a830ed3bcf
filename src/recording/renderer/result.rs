//! A result: the errors of the nominal arm appear, shrink to those of the identified one, and the verification poses follow.

use jiff::Timestamp;
use nalgebra::{Matrix3, Point3, Vector3};
use rerun::external::arrow::array::BooleanArray;
use rerun::{AnyValues, Arrows3D, AsComponents, Color, Ellipsoids3D, FillMode, Points3D};

use super::sample::{numbers, text};
use super::{Renderer, arm_and_beam, cell, charts, document};
use crate::geometry::enlargement;
use crate::profile::Profile;
use crate::recording::arm::{Posture, reach};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::chart::round_up;
use crate::recording::{names, style};
use crate::session::calibration::Calibration;
use crate::session::journal::{IdentifiedText, PointErrorText, from_xyz_mm};
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::{MICROMETRE, to_mm};

/// Percentage of the errors that the scale is made for. The colour of the others is the warmest, too.
const USUAL: usize = 95;
/// Their largest drawn length, as a fraction of the arm's reach.
const SHOWN: f64 = 0.15;
/// Errors that are drawn of many, evenly thinned out, and the worst that are drawn besides.
const ARROWS: usize = 200;
const WORST: usize = 20;
/// Pictures in which the errors appear, and in which they shrink.
const APPEARING: u32 = 5;
const SHRINKING: u32 = 30;
/// Groups of verification poses; the arm drives to the first of each.
const GROUPS: usize = 20;
/// The pace from group to group is that of a drive through so many poses.
const PACE: usize = 100;
/// How long each chapter takes (s).
const APPEAR: f64 = 1.0;
const LOOK: f64 = 1.0;
const SHRINK: f64 = 3.0;
const REST: f64 = 1.5;

/// How many times larger errors are drawn.
#[derive(Clone, Copy, Debug)]
pub(in crate::recording) struct Magnified {
    /// Those of both arms.
    pub(in crate::recording) both: f64,
    /// Those of the identified arm in a view of their own.
    pub(in crate::recording) residual: f64,
}

/// A sample with the errors of both arms (m).
pub(super) struct Judged<'a> {
    sample: &'a Sample,
    pub(super) is_verification: bool,
    /// Pendant values ((rad) or (m)).
    q: Vec<f64>,
    /// Measured point in the frame of the instrument.
    point: Point3<f64>,
    /// Point of the nominal arm, in its own registration.
    nominal_at: Point3<f64>,
    /// Point of the identified arm.
    identified_at: Point3<f64>,
    pub(super) nominal: Vector3<f64>,
    pub(super) identified: Vector3<f64>,
    pub(super) text: &'a PointErrorText,
}

impl Judged<'_> {
    /// Returns the distance errors (m) of the pair with another sample, measured less predicted: of the nominal and the identified arm.
    pub(super) fn distance_errors(&self, other: &Self) -> [f64; 2] {
        let measured = (self.point - other.point).norm();
        let of = |one: Point3<f64>, other: Point3<f64>| measured - (one - other).norm();
        [of(self.nominal_at, other.nominal_at), of(self.identified_at, other.identified_at)]
    }

    /// Returns the covariance of the predicted position (m²).
    fn covariance(&self) -> Option<Matrix3<f64>> {
        let (xx, xy, xz, yy, yz, zz) = self.text.covariance_um2?;
        Some(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * MICROMETRE.powi(2))
    }
}

fn judged<'a>(
    session: &'a Session,
    profile: &Profile,
    identified: &'a IdentifiedText,
    calibration: &Calibration,
) -> Vec<Judged<'a>> {
    let own = profile.targets().first().map_or_else(Point3::origin, |target| target.position_in_flange);
    let samples = identified.samples.iter().zip(&identified.points);
    let mut judged: Vec<Judged<'_>> = samples
        .filter_map(|(number, text)| {
            let sample = session.sample(*number)?;
            let q = session.configuration_of(sample);
            let target = calibration.nominal_targets_mm.get(sample.noted.target).copied().map_or(own, from_xyz_mm);
            Some(Judged {
                sample,
                is_verification: session.kind_of(sample) == PoseKind::Verification,
                nominal_at: Posture::new(profile.chain(), &target, &q).reflector,
                q,
                point: session.point_of(sample),
                identified_at: from_xyz_mm(text.at_mm),
                nominal: from_xyz_mm(text.nominal_mm).coords,
                identified: from_xyz_mm(text.identified_mm).coords,
                text,
            })
        })
        .collect();
    judged.sort_by_key(|one| one.sample.noted.number);
    judged
}

/// Draws the last result of the session.
pub(super) fn draw(film: &mut Renderer, identified: &IdentifiedText, time: Timestamp) {
    let Some(profile) = film.session.mounted_profile() else { return };
    let session = film.session.clone();
    document::result(&mut film.canvas, &session, identified, time);
    charts::parameters(&mut film.canvas, &identified.summary);
    let Some(calibration) = &identified.calibration else { return };
    let judged = judged(&session, &profile, identified, calibration);
    let usual = |of: fn(&Judged<'_>) -> f64| most(judged.iter().filter(|one| !one.text.rejected).map(of).collect());
    let drawn = |largest: f64| enlargement(largest, SHOWN * reach(&profile));
    let magnified =
        Magnified { both: drawn(usual(|one| one.nominal.norm())), residual: drawn(usual(|one| one.identified.norm())) };
    film.magnified = Some(magnified);
    let scale = Scale {
        magnified: magnified.both,
        warmest: round_up(to_mm(usual(|one| one.nominal.norm()))),
        longest: 3.0 * SHOWN * reach(&profile),
    };
    let residual = Scale { magnified: magnified.residual, ..scale };

    charts::legend(&mut film.canvas, "error, mm", scale.warmest, profile.acceptance().position_mean.map(to_mm));
    charts::errors(&mut film.canvas, &judged, profile.acceptance());
    charts::pairs(&mut film.canvas, &judged);
    if !identified.summary.joint_errors.is_empty() {
        charts::joints(&mut film.canvas, &identified.summary.joint_errors);
    }
    magnified_errors(&mut film.canvas, &judged, residual);
    data(film, &judged, &profile);
    chapters(film, &profile, identified, &judged, scale, time);
    identified_arm(film, &profile, calibration);
}

/// Draws the errors in both views, chapter by chapter.
fn chapters(
    film: &mut Renderer,
    profile: &Profile,
    identified: &IdentifiedText,
    judged: &[Judged<'_>],
    scale: Scale,
    time: Timestamp,
) {
    let all =
        |is_verification: bool| judged.iter().filter(|one| one.is_verification == is_verification).collect::<Vec<_>>();
    let (fit, verification) = (shown(all(false)), shown(all(true)));
    for path in [names::BEFORE_VERIFICATION, names::AFTER_VERIFICATION] {
        film.canvas.draw_static(path, &arrow_looks());
    }
    let [start, end] = film.film.advance(APPEAR, time);
    document::caption(&mut film.canvas, start, "Before", &document::errors_in_words(judged, false));
    for path in [names::BEFORE, names::AFTER] {
        let mut begin = arrow_looks();
        begin.extend(origins(&fit));
        film.canvas.draw(start, path, &begin);
        for step in 1..=APPEARING {
            let part = f64::from(step) / f64::from(APPEARING);
            film.canvas.draw(start.towards(end, part), path, &scale.arrows(&fit, |one| one.nominal * part));
        }
    }
    film.film.advance(LOOK, time);
    let [start, end] = film.film.advance(SHRINK, time);
    document::caption(&mut film.canvas, start, "The identification", "from the nominal to the identified arm");
    for step in 1..=SHRINKING {
        let part = f64::from(step) / f64::from(SHRINKING);
        // To first order in the deviations the errors change evenly, the registration included.
        let arrows = scale.arrows(&fit, |one| one.nominal.lerp(&one.identified, part));
        film.canvas.draw(start.towards(end, part), names::AFTER, &arrows);
    }
    let [_, mut moment] = film.film.advance(LOOK, time);
    if !verification.is_empty() {
        document::caption(&mut film.canvas, moment, "The verification", &document::errors_in_words(judged, true));
    }
    for group in verification.chunks(verification.len().div_ceil(GROUPS).max(1)) {
        if let Some(first) = group.first() {
            moment = film.drive(profile, &first.q, PACE, time);
        }
        let both = [scale.arrows(group, |one| one.nominal), scale.arrows(group, |one| one.identified)];
        for (path, mut arrows) in [names::BEFORE_VERIFICATION, names::AFTER_VERIFICATION].into_iter().zip(both) {
            arrows.extend(origins(group));
            film.canvas.draw(moment, path, &arrows);
        }
    }
    let [_, end] = film.film.advance(REST, time);
    document::caption(&mut film.canvas, end, "The verdict", &document::verdict_in_words(identified));
}

/// Draws the identified arm at every picture of the nominal one so far.
fn identified_arm(film: &mut Renderer, profile: &Profile, calibration: &Calibration) {
    let Ok(arm) = calibration.identified(profile) else { return };
    let Some(target) = arm.targets.first() else { return };
    if let Some((beginning, _)) = film.pictures.first() {
        cell::arm(&mut film.canvas, profile, names::IDENTIFIED, style::IDENTIFIED, *beginning);
    }
    for (moment, q) in &film.pictures {
        let posture = Posture::new(&arm.chain, target, q);
        film.canvas.draw(*moment, names::IDENTIFIED, &arm_and_beam(&film.station, profile, &posture));
    }
}

/// Returns the errors to draw of many: some that are evenly thinned out, and the worst.
fn shown<'j, 'a>(all: Vec<&'j Judged<'a>>) -> Vec<&'j Judged<'a>> {
    if all.len() <= ARROWS + WORST {
        return all;
    }
    let mut by_size: Vec<usize> = (0..all.len()).collect();
    by_size.sort_by(|one, other| all[*other].nominal.norm().total_cmp(&all[*one].nominal.norm()));
    let mut kept: Vec<usize> = (0..ARROWS).map(|index| index * all.len() / ARROWS).collect();
    kept.extend(by_size.into_iter().take(WORST));
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|index| all[index]).collect()
}

/// How errors are drawn.
#[derive(Clone, Copy)]
struct Scale {
    /// How many times longer than they are.
    magnified: f64,
    /// Error with the warmest colour (mm).
    warmest: f64,
    /// Drawn length at which the errors of rejected samples are cut (m): the scale is not made for them.
    longest: f64,
}

impl Scale {
    fn arrows(self, errors: &[&Judged<'_>], of: impl Fn(&Judged<'_>) -> Vector3<f64>) -> Vec<Box<dyn AsComponents>> {
        let drawn = |one: &Judged<'_>| {
            let drawn = of(one) * self.magnified;
            style::vector(&if one.text.rejected { drawn.cap_magnitude(self.longest) } else { drawn })
        };
        let colors: Vec<Color> = errors.iter().map(|one| style::error(to_mm(of(one).norm()) / self.warmest)).collect();
        let arrows =
            Arrows3D::update_fields().with_vectors(errors.iter().map(|one| drawn(one))).with_colors(colors.clone());
        vec![Box::new(arrows), Box::new(Points3D::update_fields().with_colors(colors))]
    }
}

/// Returns where arrows begin. An error that is too short for an arrow is still a point.
fn origins(errors: &[&Judged<'_>]) -> Vec<Box<dyn AsComponents>> {
    let origins: Vec<[f32; 3]> = errors.iter().map(|one| style::at(&one.identified_at)).collect();
    let points = Points3D::update_fields().with_positions(origins.clone());
    vec![Box::new(Arrows3D::update_fields().with_origins(origins)), Box::new(points)]
}

/// Returns the length (m) that most errors do not exceed.
fn most(mut lengths: Vec<f64>) -> f64 {
    lengths.sort_by(f64::total_cmp);
    lengths.get((lengths.len() * USUAL).div_ceil(100).saturating_sub(1)).copied().unwrap_or(0.0).max(1e-9)
}

fn arrow_looks() -> Vec<Box<dyn AsComponents>> {
    let arrows = Arrows3D::update_fields().with_radii([style::points(1.4)]);
    let points = Points3D::update_fields().with_radii([style::points(2.6)]);
    vec![Box::new(arrows), Box::new(points)]
}

/// Draws the errors of the identified arm so large that their pattern is seen, and beside them what was predicted.
fn magnified_errors(canvas: &mut Canvas, judged: &[Judged<'_>], scale: Scale) {
    let errors = shown(judged.iter().collect());
    let mut arrows = scale.arrows(&errors, |one| one.identified);
    arrows.extend(arrow_looks());
    arrows.extend(origins(&errors));
    canvas.draw_static(names::RESIDUAL, &arrows);
    let known: Vec<_> =
        errors.iter().filter_map(|one| Some((one.identified_at, style::ellipsoid(&one.covariance()?)))).collect();
    let ellipsoids = Ellipsoids3D::from_centers_and_half_sizes(
        known.iter().map(|(at, _)| style::at(at)),
        known.iter().map(|(_, (axes, _))| style::vector(&(axes * scale.magnified))),
    )
    .with_quaternions(known.iter().map(|(_, (_, rotation))| style::quaternion(rotation)))
    .with_colors([style::LEFT])
    .with_line_radii([style::points(0.3)])
    .with_fill_mode(FillMode::MajorWireframe);
    canvas.draw_static(names::UNCERTAINTY, &ellipsoids);
}

/// Draws the errors and the limits for tables, in full precision.
fn data(film: &mut Renderer, judged: &[Judged<'_>], profile: &Profile) {
    let um = |error: &Vector3<f64>| numbers(error.iter().map(|value| value / MICROMETRE));
    let moment_of = |number: u64, moments: &[(u64, Moment)]| {
        moments.iter().find(|(of, _)| *of == number).map(|(_, moment)| *moment)
    };
    for one in judged {
        let Some(moment) = moment_of(one.sample.noted.number, &film.moments) else { continue };
        let values = AnyValues::default()
            .with_component_from_data("nominal_um", um(&one.nominal))
            .with_component_from_data("identified_um", um(&one.identified))
            .with_component_from_data("rejected", std::sync::Arc::new(BooleanArray::from(vec![one.text.rejected])))
            .with_component_from_data("use", text(if one.is_verification { "verification" } else { "identification" }));
        film.canvas.draw(moment, names::SAMPLE_ERRORS, &values);
    }
    let acceptance = profile.acceptance();
    let limits = [
        ("position_mean_mm", acceptance.position_mean),
        ("position_rms_mm", acceptance.position_rms),
        ("position_max_mm", acceptance.position_max),
        ("distance_mean_mm", acceptance.distance_mean),
        ("distance_rms_mm", acceptance.distance_rms),
        ("distance_max_mm", acceptance.distance_max),
    ];
    let values = limits.into_iter().filter_map(|(name, limit)| Some((name, to_mm(limit?))));
    let values = values
        .fold(AnyValues::default(), |values, (name, limit)| values.with_component_from_data(name, numbers([limit])));
    film.canvas.draw_static(names::LIMITS, &values);
}
