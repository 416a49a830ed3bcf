//! Checks that make a result a measured point.

use nalgebra::Point3;

use super::super::{Failure, Shot, known_sigma};
use super::EmsconOptions;
use super::packet::SingleResult;
use super::status::ResultStatus;

/// Millimetres, the unit of the wire, in a metre.
const MM_PER_METRE: f64 = 1000.0;

/// The point of a result in the units and the coordinate type of the set-up.
///
/// # Errors
/// The result is not a success, in try mode, of another mode, not finite or out of range.
pub(super) fn shot_of(result: SingleResult, options: &EmsconOptions, face: Option<u8>) -> Result<Shot, Failure> {
    if result.status != ResultStatus::AllOk {
        return Err(result.status.measurement_failure());
    }
    if result.is_try {
        return Err(Failure::Settings("the tracker is in try mode, which does not take real measurements".to_owned()));
    }
    if !result.mode.is_point() {
        return Err(Failure::Settings(format!("the measurement mode is {}, not stationary", result.mode)));
    }
    let point = Point3::from(result.values) / MM_PER_METRE;
    let distance = point.coords.norm();
    if !distance.is_finite() {
        return Err(Failure::Unusable("a coordinate is not a finite number".to_owned()));
    }
    let &EmsconOptions { nearest, farthest, .. } = options;
    if !(nearest..=farthest).contains(&distance) {
        return Err(Failure::Unusable(format!(
            "the point is {distance:.6} m from the tracker, which measures from {nearest} m to {farthest} m"
        )));
    }
    let [temperature, pressure, humidity] = result.weather.map(|value| Some(value).filter(|value| value.is_finite()));
    Ok(Shot {
        sigma: known_sigma(result.sigma.map(|value| value / MM_PER_METRE)),
        face,
        temperature,
        pressure,
        humidity,
        raw: result.raw,
        ..Shot::bare(point)
    })
}

/// Position of the reflector for the live view; it only has to be finite.
pub(super) fn position_of(values: [f64; 3], raw: Vec<u8>, face: Option<u8>) -> Option<Shot> {
    let is_finite = values.iter().all(|value| value.is_finite());
    is_finite.then(|| Shot { face, raw, ..Shot::bare(Point3::from(values) / MM_PER_METRE) })
}
