//! The poses of the plan, and the search that found them.

use nalgebra::Point3;
use rerun::{Points3D, Radius, Scalars};

use crate::planning::Figures;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::latin::plain;
use crate::recording::posture::Posture;
use crate::recording::{names, style};
use crate::session::state::{SampleState, Session};
use crate::units::to_mm;

/// Draws the progress of the search, sweep by sweep.
pub(super) fn search(canvas: &mut Canvas, steps: &[Figures]) {
    for (index, step) in steps.iter().enumerate() {
        let moment = Moment::search(index + 1);
        canvas.draw(moment, names::CONDITION, &Scalars::new([step.condition_number]));
        canvas.draw(moment, names::OBSERVABILITY, &Scalars::new([to_mm(step.o1)]));
        canvas.draw(moment, names::SEARCH_PREDICTED, &Scalars::new([step.predicted_error]));
    }
}

/// Draws the poses of the plan that are not skipped. Measured points cover theirs.
pub(super) fn poses(canvas: &mut Canvas, session: &Session) {
    let Some(profile) = session.mounted_profile() else { return };
    let planned = session.rows.iter().filter(|row| !row.skipped);
    let places = planned.map(|row| Posture::nominal(&profile, &row.planned.configuration).reflector);
    let points = Points3D::new(places.map(|place| style::at(&place)))
        .with_radii([Radius::new_ui_points(2.5)])
        .with_colors([style::LEFT]);
    canvas.draw_static(names::PLAN, &points);
}

/// Draws the next pose, and what is not used. `is_changed`: something may be in use again, so the unused points are drawn even if
/// there are none.
pub(super) fn points(canvas: &mut Canvas, session: &Session, is_changed: bool) {
    let Some(profile) = session.mounted_profile() else { return };
    let at = |q: &[f64]| Posture::nominal(&profile, q).reflector;
    let moment = Moment::pose(session.measurements);
    let open: Vec<usize> = session.open_rows().collect();
    let shown = session.shown.and_then(|shown| open.iter().find(|row| **row >= shown)).or_else(|| open.first());
    let next = shown.and_then(|row| session.rows.get(*row)).map(|row| &row.planned);
    let point = Points3D::update_fields()
        .with_positions(next.map(|next| style::at(&at(&next.configuration))))
        .with_labels(next.map(|next| plain(&format!("next: {}", next.pose))));
    canvas.draw(moment, names::NEXT, &point);
    let skipped = session.rows.iter().filter(|row| row.skipped).map(|row| row.planned.configuration.clone());
    let out = session
        .samples
        .iter()
        .filter(|sample| matches!(sample.state, SampleState::LeftOut | SampleState::Undone))
        .map(|sample| session.configuration_of(sample));
    let unused: Vec<Point3<f64>> = skipped.chain(out).map(|q| at(&q)).collect();
    if is_changed || !unused.is_empty() {
        canvas.draw(moment, names::UNUSED, &Points3D::update_fields().with_positions(unused.iter().map(style::at)));
    }
}
