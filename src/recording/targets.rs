//! A picture of targets before and after compensation.

use std::path::Path;

use jiff::Timestamp;
use nalgebra::Point3;
use rerun::external::re_log_types::{StoreId, StoreKind};
use rerun::{Arrows3D, Points3D, Radius, ViewCoordinates};

use super::canvas::Canvas;
use super::{RecordingError, latin, names, rrd, style};
use crate::session::sha256;
use crate::store;

/// How much larger than life corrections are drawn.
const ENLARGED: f64 = 100.0;

/// A target in the base (m).
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnTarget {
    pub name: String,
    /// Where the tool is to be.
    pub meant: Point3<f64>,
    /// Where the nominal arm has it at the command.
    pub commanded: Point3<f64>,
}

/// Writes a recording with the targets as they are meant and as they are commanded, and the corrections 100 times enlarged.
///
/// # Errors
/// The file cannot be written.
pub fn write_targets(path: &Path, time: Timestamp, targets: &[DrawnTarget]) -> Result<(), RecordingError> {
    let mut canvas = Canvas::default();
    let labels = || targets.iter().map(|target| latin::plain(&target.name));
    let meant = || targets.iter().map(|target| style::at(&target.meant));
    let size = Radius::new_ui_points(4.0);
    canvas.draw_static(names::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP());
    let nominal = Points3D::new(meant()).with_colors([style::NOMINAL]).with_radii([size]).with_labels(labels());
    canvas.draw_static("world/targets/nominal", &nominal.with_show_labels(false));
    let commanded = targets.iter().map(|target| style::at(&target.commanded));
    let corrected = Points3D::new(commanded).with_colors([style::IDENTIFIED]).with_radii([size]).with_labels(labels());
    canvas.draw_static("world/targets/corrected", &corrected.with_show_labels(false));
    let vectors = targets.iter().map(|target| style::vector(&((target.commanded - target.meant) * ENLARGED)));
    let arrows = Arrows3D::from_vectors(vectors).with_origins(meant()).with_colors([style::ATTENTION]);
    canvas.draw_static("world/targets/correction_x100", &arrows);
    let id = sha256(format!("targets {time}").as_bytes()).chars().take(32).collect::<String>();
    let bytes = rrd::encode_rows(&StoreId::new(StoreKind::Recording, names::APPLICATION, id), time, canvas.rows)?;
    Ok(store::replace_bytes(path, &bytes)?)
}
