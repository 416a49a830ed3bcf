//! A sample: the measured point, the plotted figures, and its data.

use std::sync::Arc;

use nalgebra::Point3;
use rerun::external::arrow::array::{ArrayRef, Float64Array, StringArray};
use rerun::{AnyValues, AsComponents, Color, Points3D, Scalars, SeriesPoints};

use super::station::Station;
use crate::profile::Profile;
use crate::recording::arm::Posture;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::latin::plain;
use crate::recording::{names, style};
use crate::session::plan::PoseKind;
use crate::session::state::{Sample, Session};
use crate::units::to_mm;

/// Draws a sample of `session`. `drawn` collects the series that have a row.
pub(super) fn draw(
    canvas: &mut Canvas,
    session: &Session,
    station: &Station,
    sample: &Sample,
    moment: Moment,
    drawn: &mut Vec<&'static str>,
) {
    let Some(profile) = session.mounted_profile() else { return };
    let noted = &sample.noted;
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
    let sigma = profile.instrument().map(|instrument| to_mm(instrument.sigma));
    let predicted = noted.predicted_error_sigma.zip(sigma).map(|(per_sigma, sigma)| per_sigma * sigma);
    let series: [(&'static str, &str, Color, Option<f64>); 4] = [
        (names::SCATTER, "scatter of the shots", style::LEFT, noted.scatter_mm),
        (names::TEMPERATURE, "temperature", style::ATTENTION, noted.temperature_degc),
        (names::DRIFT, "drift", style::NOMINAL, drift(session, sample)),
        (names::PREDICTED, "predicted error of a calibration so far", style::IDENTIFIED, predicted),
    ];
    for (path, name, color, value) in series {
        let Some(value) = value.filter(|value| value.is_finite()) else { continue };
        let value = Scalars::new([value]);
        let looks = SeriesPoints::new().with_colors([color]).with_names([name]).with_marker_sizes([3.0]);
        if drawn.contains(&path) {
            canvas.draw(moment, path, &value);
        } else {
            drawn.push(path);
            canvas.draw(moment, path, &[&value as &dyn AsComponents, &looks]);
        }
    }
    data(canvas, session, sample, moment);
}

/// Draws the numbers of a sample for tables, in full precision.
fn data(canvas: &mut Canvas, session: &Session, sample: &Sample, moment: Moment) {
    let (x, y, z) = sample.noted.xyz_mm;
    let values = AnyValues::default()
        .with_component_from_data("number", numbers([sample.noted.number as f64]))
        .with_component_from_data("pose", text(session.pose_of(sample)))
        .with_component_from_data("kind", text(session.kind_of(sample).name()))
        .with_component_from_data("state", text(&sample.state.to_string()))
        .with_component_from_data("joints", numbers(sample.joints.iter().copied()))
        .with_component_from_data("xyz_mm", numbers([x, y, z]));
    canvas.draw(moment, names::SAMPLES, &values);
}

/// Returns numbers as an array of the library.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}

/// Returns a text as an array of the library.
pub(super) fn text(value: &str) -> ArrayRef {
    Arc::new(StringArray::from(vec![plain(value)]))
}

/// Returns the point in the base. The samples so far register the instrument to the nominal arm; before there are enough of them, it
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
