//! A picture of targets before and after compensation.

use std::path::Path;

use jiff::Timestamp;
use nalgebra::{Point3, Vector3};
use rerun::{Arrows3D, AsComponents, Points3D, RecordingInfo, ViewCoordinates};

use super::blueprint::{eye_on, rows_of_targets};
use super::canvas::{Canvas, Film, Layout};
use super::chart::round_up;
use super::identity::Identity;
use super::renderer::{legend, significant};
use super::{RecordingError, latin, names, rrd, style};
use crate::geometry::enlargement;
use crate::store;
use crate::text::counted;
use crate::units::to_mm;

/// Time in which all targets appear, one after the other (s).
const ALL: f64 = 10.0;
/// Longest drawn correction, as a part of the room that the targets take.
const SHOWN: f64 = 0.12;

/// A target in the base (m).
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnTarget {
    pub name: String,
    /// Where the tool is to be.
    pub meant: Point3<f64>,
    /// Where the nominal arm has it at the command.
    pub commanded: Point3<f64>,
}

/// Writes a recording with the targets as they are meant and the corrections of their commands, one after the other.
///
/// # Errors
/// The file cannot be written.
pub fn write_targets(path: &Path, time: Timestamp, targets: &[DrawnTarget]) -> Result<(), RecordingError> {
    let mut canvas = Canvas::default();
    let identity = Identity::named("targets", time);
    canvas.draw_static(names::PROPERTIES, &RecordingInfo::new().with_name("targets"));
    canvas.draw_static(names::WORLD, &ViewCoordinates::RIGHT_HAND_Z_UP());
    let correction = |target: &DrawnTarget| target.commanded - target.meant;
    let lengths = || targets.iter().map(|target| correction(target).norm());
    let (largest, count) = (lengths().fold(0.0, f64::max), targets.len().max(1) as f64);
    let places: Vec<Point3<f64>> = targets.iter().map(|target| target.meant).chain([Point3::origin()]).collect();
    let room = places.iter().map(|place| place.coords.norm()).fold(0.1, f64::max);
    let magnified = enlargement(largest, SHOWN * room);
    let warmest = round_up(to_mm(largest));
    let page = format!(
        "# {}: corrected by {} mm on average, {} mm at most\nPoints are where the tool is to be, arrows lead to the command that takes it there.\n",
        counted(targets.len(), "target"),
        significant(to_mm(lengths().sum::<f64>() / count)),
        significant(to_mm(largest)),
    );
    canvas.draw_static(names::HEADLINE, &rerun::TextDocument::from_markdown(latin::plain(&page)));
    legend(&mut canvas, "mm", warmest, None);
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| style::vector(&(axis * 0.15 * room)));
    let base = Arrows3D::from_vectors(axes).with_origins([[0.0; 3]]).with_labels(["base", "", ""]);
    canvas.draw_static("world/targets", &base.with_colors([style::LEFT]));
    let (arrows, points) = (Arrows3D::update_fields(), Points3D::update_fields().with_show_labels(false));
    let looks: [&dyn AsComponents; 2] =
        [&arrows.with_radii([style::points(1.6)]), &points.with_radii([style::points(3.0)])];
    canvas.draw_static("world/trail/targets", &looks);
    let mut film = Film::begin(time);
    for target in targets {
        let color = style::error(to_mm(correction(target).norm()) / warmest);
        let arrow = Arrows3D::update_fields()
            .with_vectors([style::vector(&(correction(target) * magnified))])
            .with_origins([style::at(&target.meant)])
            .with_colors([color]);
        let point = Points3D::update_fields()
            .with_positions([style::at(&target.meant)])
            .with_colors([style::DONE])
            .with_labels([latin::plain(&target.name)]);
        let drawn: [&dyn AsComponents; 2] = [&arrow, &point];
        canvas.draw(film.now(), "world/trail/targets", &drawn);
        film.advance((ALL / count).min(0.5), time);
    }
    canvas.layout = Some(Layout { line: 1, rows: rows_of_targets(eye_on(&places), magnified) });
    let bytes = rrd::write(&identity, canvas, rrd::Ids::at(time))?;
    Ok(store::replace_bytes(path, &bytes)?)
}
