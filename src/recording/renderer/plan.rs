//! Poses that wait, are next or are not used, and how the search for them went on.

use nalgebra::Point3;
use rerun::{Points3D, Radius, Scalars};

use crate::planning::Figures;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::latin::plain;
use crate::recording::posture::Posture;
use crate::recording::{layout, names};
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

/// Where the poses of the plan are. Those that are measured are covered by their points.
pub(super) fn poses(canvas: &mut Canvas, session: &Session) {
    let Some(profile) = session.mounted_profile() else { return };
    let planned = session.rows.iter().filter(|row| !row.skipped);
    let places = planned.map(|row| Posture::nominal(&profile, &row.planned.configuration).reflector);
    let points = Points3D::new(places.map(|place| layout::at(&place)))
        .with_radii([Radius::new_ui_points(2.5)])
        .with_colors([layout::LEFT]);
    canvas.fix(names::PLAN, &points);
}

/// Which pose is next, and what is not used. `is_new`: something may be used again.
pub(super) fn points(canvas: &mut Canvas, session: &Session, is_new: bool) {
    let Some(profile) = session.mounted_profile() else { return };
    let at = |q: &[f64]| Posture::nominal(&profile, q).reflector;
    let moment = Moment::pose(session.measurements);
    let open: Vec<usize> = session.open_rows().collect();
    let shown = session.shown.and_then(|shown| open.iter().find(|row| **row >= shown)).or_else(|| open.first());
    let next = shown.and_then(|row| session.rows.get(*row)).map(|row| &row.planned);
    let point = Points3D::update_fields()
        .with_positions(next.map(|next| layout::at(&at(&next.configuration))))
        .with_labels(next.map(|next| plain(&format!("next: {}", next.pose))));
    canvas.draw(moment, names::NEXT, &point);
    let skipped = session.rows.iter().filter(|row| row.skipped).map(|row| row.planned.configuration.clone());
    let out = session
        .samples
        .iter()
        .filter(|sample| matches!(sample.state, SampleState::LeftOut | SampleState::Undone))
        .map(|sample| session.configuration_of(sample));
    let unused: Vec<Point3<f64>> = skipped.chain(out).map(|q| at(&q)).collect();
    if is_new || !unused.is_empty() {
        canvas.draw(moment, names::UNUSED, &Points3D::update_fields().with_positions(unused.iter().map(layout::at)));
    }
}
