//! Errors of the nominal and the identified arm at every sample.

use nalgebra::{Matrix3, Point3};

use super::identify::{Identified, NamedSample};
use crate::identification::predicted::position_covariances;
use crate::kinematics::Place;
use crate::session::journal::{PointErrorText, to_xyz_mm};
use crate::units::MICROMETRE;

/// The errors of both arms at all samples, first those that went into the identification, then those that verify it. Empty for
/// data without coordinates of one station.
pub fn point_errors(identified: &Identified, judged: &[NamedSample], tested: &[NamedSample]) -> Vec<PointErrorText> {
    let (found, nominal) = (&identified.found, &identified.nominal);
    let (Some(of_found), Some(of_nominal)) = (found.base_from_station.first(), nominal.base_from_station.first())
    else {
        return Vec::new();
    };
    let all = || judged.iter().chain(tested).map(|named| &named.sample);
    let places: Vec<&Place> = all().map(|sample| &sample.at).collect();
    let error = |measured: Point3<f64>, predicted: Point3<f64>| to_xyz_mm(&Point3::from(measured - predicted), 6);
    all()
        .zip(position_covariances(found, &places))
        .enumerate()
        .map(|(index, (sample, covariance))| {
            let at = found.arm.point_in_base(&sample.at);
            PointErrorText {
                at_mm: to_xyz_mm(&at, 3),
                nominal_mm: error(of_nominal * sample.point, nominal.arm.point_in_base(&sample.at)),
                identified_mm: error(of_found * sample.point, at),
                covariance_um2: text(&covariance),
                rejected: index < judged.len() && found.is_rejected(index),
            }
        })
        .collect()
}

/// A covariance (m²) in µm², rounded to six decimals.
fn text(covariance: &Matrix3<f64>) -> Option<(f64, f64, f64, f64, f64, f64)> {
    let edge = |row, column| (covariance[(row, column)] / MICROMETRE.powi(2) * 1e6).round() / 1e6 + 0.0;
    covariance
        .iter()
        .all(|value| value.is_finite())
        .then(|| (edge(0, 0), edge(0, 1), edge(0, 2), edge(1, 1), edge(1, 2), edge(2, 2)))
}
