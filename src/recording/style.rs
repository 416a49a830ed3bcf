//! Colours of the picture, and conversions into the types of the library.

use nalgebra::{Isometry3, Matrix3, Point3, SymmetricEigen, UnitQuaternion, Vector3};
use rerun::{Color, Quaternion, Rgba32, Transform3D};

/// Returns an opaque colour.
pub(super) const fn rgb(red: u8, green: u8, blue: u8) -> Color {
    Color(Rgba32(u32::from_be_bytes([red, green, blue, 255])))
}

/// Colour of the castings of the nominal arm.
pub(super) const NOMINAL: Color = rgb(176, 190, 205);
/// Colour of the errors of the nominal arm.
pub(super) const NOMINAL_ERROR: Color = rgb(239, 83, 80);
/// Colour of the identified arm and its errors.
pub(super) const IDENTIFIED: Color = rgb(76, 205, 110);
/// Colour of measured points.
pub(super) const DONE: Color = rgb(238, 240, 242);
/// Colour of verification samples.
pub(super) const VERIFICATION: Color = rgb(66, 165, 245);
/// Colour of questioned samples and the next pose.
pub(super) const ATTENTION: Color = rgb(255, 202, 40);
/// Colour of poses that are not measured yet.
pub(super) const LEFT: Color = rgb(120, 144, 156);
/// Colour of poses and samples that are not used.
pub(super) const OUT: Color = rgb(188, 120, 90);
/// Colour of the joint axes.
pub(super) const AXIS: Color = rgb(160, 172, 180);
/// Colour of tracker and beam.
pub(super) const TRACKER: Color = rgb(186, 104, 200);
/// Colour of floor and base.
pub(super) const CELL: Color = rgb(84, 94, 104);

/// Converts a position to single precision.
pub(super) fn at(point: &Point3<f64>) -> [f32; 3] {
    vector(&point.coords)
}

/// Converts a vector to single precision.
#[expect(clippy::cast_possible_truncation, reason = "the viewer's numbers are 32-bit floats")]
pub(super) fn vector(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
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

/// Returns the transform of a named frame in the robot base.
pub(super) fn frame(pose: &Isometry3<f64>, name: &str) -> Transform3D {
    Transform3D::from_translation_rotation(vector(&pose.translation.vector), quaternion(&pose.rotation))
        .with_parent_frame(super::names::WORLD_FRAME)
        .with_child_frame(name)
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

/// Returns a colour from blue over white to red for a `value` from −1 to 1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a colour value of 0 to 255")]
pub(super) fn two_sided(value: f64) -> Color {
    let value = value.clamp(-1.0, 1.0);
    let fade = |towards: f64| (255.0 - (255.0 - towards) * value.abs()).round() as u8;
    if value < 0.0 {
        Color::from_rgb(fade(30.0), fade(110.0), 255)
    } else {
        Color::from_rgb(255, fade(60.0), fade(40.0))
    }
}
