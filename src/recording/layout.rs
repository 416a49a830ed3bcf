//! What is where and how large: lengths, colours and enlargements of the picture.

use nalgebra::{Isometry3, Matrix3, Point3, SymmetricEigen, UnitQuaternion, Vector3};
use rerun::{Color, Quaternion, Rgba32, Transform3D};

/// An opaque colour.
pub(super) const fn rgb(red: u8, green: u8, blue: u8) -> Color {
    Color(Rgba32(u32::from_be_bytes([red, green, blue, 255])))
}

/// Castings of the nominal arm.
pub(super) const NOMINAL: Color = rgb(176, 190, 205);
/// Errors of the nominal arm.
pub(super) const NOMINAL_ERROR: Color = rgb(239, 83, 80);
/// The identified arm and its errors.
pub(super) const IDENTIFIED: Color = rgb(76, 205, 110);
/// Measured points.
pub(super) const DONE: Color = rgb(238, 240, 242);
/// Verification samples.
pub(super) const VERIFICATION: Color = rgb(66, 165, 245);
/// Samples in doubt, and the pose to go to.
pub(super) const ATTENTION: Color = rgb(255, 202, 40);
/// Poses that wait.
pub(super) const LEFT: Color = rgb(120, 144, 156);
/// What is not used.
pub(super) const OUT: Color = rgb(188, 120, 90);
/// Axes of the joints.
pub(super) const AXIS: Color = rgb(160, 172, 180);
/// Tracker and beam.
pub(super) const TRACKER: Color = rgb(186, 104, 200);
/// Floor and base.
pub(super) const CELL: Color = rgb(84, 94, 104);

/// A position in single precision.
pub(super) fn at(point: &Point3<f64>) -> [f32; 3] {
    vector(&point.coords)
}

/// A vector in single precision.
#[expect(clippy::cast_possible_truncation, reason = "the viewer's numbers are 32-bit floats")]
pub(super) fn vector(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

/// A number in single precision.
#[expect(clippy::cast_possible_truncation, reason = "the viewer's numbers are 32-bit floats")]
pub(super) const fn single(value: f64) -> f32 {
    value as f32
}

/// An orientation in single precision.
pub(super) fn quaternion(rotation: &UnitQuaternion<f64>) -> Quaternion {
    let q = rotation.coords.map(single);
    Quaternion::from_xyzw([q.x, q.y, q.z, q.w])
}

/// The transform of a named frame in the robot base.
pub(super) fn frame(pose: &Isometry3<f64>, name: &str) -> Transform3D {
    Transform3D::from_translation_rotation(vector(&pose.translation.vector), quaternion(&pose.rotation))
        .with_parent_frame(super::names::WORLD_FRAME)
        .with_child_frame(name)
}

/// Half axes (m) and orientation of the ellipsoid of one standard deviation of `covariance` (m²).
pub(super) fn ellipsoid(covariance: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let eigen = SymmetricEigen::new(*covariance);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    (eigen.eigenvalues.map(|value| value.max(0.0).sqrt()), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// From blue over white to red: `value` from −1 to 1.
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
