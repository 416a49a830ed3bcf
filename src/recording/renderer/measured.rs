//! A sample: the arm at its pose, the measured point, and the plotted figures.

use jiff::Timestamp;
use nalgebra::Point3;
use rerun::{Points3D, Scalars};

use super::tracker::Station;
use super::{cell, pose_moment};
use crate::profile::Profile;
use crate::recording::canvas::Canvas;
use crate::recording::latin::plain;
use crate::recording::posture::Posture;
use crate::recording::{names, style};
use crate::session::journal::MeasuredText;
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::to_mm;

/// Draws a sample that is already in `session`.
pub(super) fn sample(canvas: &mut Canvas, session: &Session, station: &Station, noted: &MeasuredText, time: Timestamp) {
    let (Some(profile), Some(sample)) = (session.mounted_profile(), session.sample(noted.number)) else { return };
    let moment = pose_moment(noted.number, time);
    let q = session.configuration_of(sample);
    cell::pose(canvas, &profile, station, &q, moment);
    let color = match session.kind_of(sample) {
        _ if !noted.findings.is_empty() => style::ATTENTION,
        PoseKind::Verification => style::VERIFICATION,
        _ => style::DONE,
    };
    let dot = Points3D::update_fields()
        .with_positions([style::at(&place(session, &profile, station, sample))])
        .with_colors([color])
        .with_labels([plain(&format!("pose {}", session.pose_of(sample)))]);
    canvas.draw(moment, names::MEASURED, &dot);
    let (x, y, z) = noted.xyz_mm;
    canvas.draw(moment, names::READING, &Scalars::new([x, y, z]));
    let drift = drift(session, sample);
    let sigma = profile.instrument().map(|instrument| to_mm(instrument.sigma));
    let predicted = noted.predicted_error_sigma.zip(sigma).map(|(per_sigma, sigma)| per_sigma * sigma);
    let series = [
        (names::SCATTER, noted.scatter_mm),
        (names::TEMPERATURE, noted.temperature_degc),
        (names::DRIFT, drift),
        (names::PREDICTED, predicted),
    ];
    for (path, value) in series {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            canvas.draw(moment, path, &Scalars::new([value]));
        }
    }
}

/// Returns the point in the base. The samples so far register the tracker to the nominal arm; before there are enough of them, it
/// is where the nominal arm puts the reflector.
fn place(session: &Session, profile: &Profile, station: &Station, sample: &Sample) -> Point3<f64> {
    let registered = station.base_from_tracker().map(|base_from_tracker| base_from_tracker * session.point_of(sample));
    let is_finite = |point: &Point3<f64>| point.coords.iter().all(|value| value.is_finite());
    registered
        .filter(is_finite)
        .unwrap_or_else(|| Posture::nominal(profile, &session.configuration_of(sample)).reflector)
}

/// Returns the distance (mm) of a repeated pose from its first measurement.
fn drift(session: &Session, sample: &Sample) -> Option<f64> {
    let pose = session.pose_of(sample);
    let first = session.counted().find(|other| session.pose_of(other) == pose)?;
    let is_repeated = session.kind_of(sample) == PoseKind::Drift && first.noted.number != sample.noted.number;
    is_repeated.then(|| to_mm((session.point_of(sample) - session.point_of(first)).norm()))
}
