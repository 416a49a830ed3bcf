//! Colours of the picture, and conversions into the types of the library. Orange is the nominal arm and blue the identified one, a
//! pair that colour-blind people can tell apart.

use nalgebra::{Matrix3, Point3, SymmetricEigen, UnitQuaternion, Vector3};
use rerun::{Color, Quaternion, Radius, Rgba32};

/// Returns an opaque colour.
pub(super) const fn rgb(red: u8, green: u8, blue: u8) -> Color {
    Color(Rgba32(u32::from_be_bytes([red, green, blue, 255])))
}

/// Background of all views.
pub(super) const BACKGROUND: Color = rgb(20, 24, 29);
/// Colour of the nominal arm and its errors.
pub(super) const NOMINAL: Color = rgb(255, 159, 64);
/// Colour of the identified arm and its errors.
pub(super) const IDENTIFIED: Color = rgb(86, 160, 255);
/// Colour of measured points.
pub(super) const DONE: Color = rgb(238, 240, 242);
/// Colour of poses to verify with.
pub(super) const VERIFICATION: Color = rgb(110, 220, 200);
/// Colour of questioned samples and the next pose.
pub(super) const ATTENTION: Color = rgb(255, 214, 60);
/// Colour of poses that are not measured yet.
pub(super) const LEFT: Color = rgb(130, 150, 164);
/// Colour of poses and samples that are not used.
pub(super) const OUT: Color = rgb(150, 110, 90);
/// Colour of the instrument and its beam.
pub(super) const TRACKER: Color = rgb(206, 130, 220);
/// Colour of floor and base.
pub(super) const CELL: Color = rgb(70, 80, 90);
/// Colour of limits.
pub(super) const LIMIT: Color = rgb(240, 240, 240);
/// Colour of the lines of a chart.
pub(super) const GRID: Color = rgb(62, 70, 79);
/// Colour of the texts of a chart.
pub(super) const TEXT: Color = rgb(190, 198, 206);

/// Colours from no error to the largest, evenly spread: cool to warm.
const RAMP: [[f64; 3]; 5] =
    [[70.0, 140.0, 255.0], [120.0, 195.0, 240.0], [240.0, 228.0, 180.0], [255.0, 160.0, 50.0], [214.0, 60.0, 20.0]];

/// Returns the colour of an error that is this `part` of the largest.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a colour value, and an index of five")]
pub(super) fn error(part: f64) -> Color {
    let place = part.clamp(0.0, 1.0) * 4.0;
    let below = (place as usize).min(3);
    let mix = |index: usize| {
        let (low, high) = (RAMP[below][index], RAMP[below + 1][index]);
        (low + (high - low) * (place - below as f64)).round() as u8
    };
    rgb(mix(0), mix(1), mix(2))
}

/// Returns a darker shade of a colour.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a colour value of 0 to 255")]
pub(super) fn shade(color: Color, part: f64) -> Color {
    let [red, green, blue, _] = color.0.to_array();
    let darker = |value: u8| (f64::from(value) * part).round() as u8;
    rgb(darker(red), darker(green), darker(blue))
}

/// Returns a radius in points of the screen.
pub(super) fn points(size: f32) -> Radius {
    Radius::new_ui_points(size)
}

/// Converts a position to single precision.
pub(super) fn at(point: &Point3<f64>) -> [f32; 3] {
    vector(&point.coords)
}

/// Converts a vector to single precision.
pub(super) fn vector(vector: &Vector3<f64>) -> [f32; 3] {
    [single(vector.x), single(vector.y), single(vector.z)]
}

/// Converts a number to single precision.
#[expect(clippy::cast_possible_truncation, reason = "the viewer's numbers are 32-bit floats")]
pub(super) const fn single(value: f64) -> f32 {
    value as f32
}

/// Converts an orientation to single precision.
pub(super) fn quaternion(rotation: &UnitQuaternion<f64>) -> Quaternion {
    let q = rotation.coords.map(single);
    Quaternion::from_xyzw([q.x, q.y, q.z, q.w])
}

/// Returns half axes (m) and orientation of the ellipsoid of one standard deviation of `covariance` (m²).
pub(super) fn ellipsoid(covariance: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let eigen = SymmetricEigen::new(*covariance);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    (eigen.eigenvalues.map(|value| value.max(0.0).sqrt()), UnitQuaternion::from_rotation_matrix(&rotation))
}
