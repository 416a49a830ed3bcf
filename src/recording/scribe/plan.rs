//! Poses that wait, are next or are not used, and how the search for them went on.

use jiff::Timestamp;
use nalgebra::Point3;
use rerun::{Color, Points3D, Radius, Scalars};

use super::{Posture, pose_moment};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::{layout, names};
use crate::session::plan_summary::SearchStepSummary;
use crate::session::state::{SampleState, Session};
use crate::units::to_mm;

/// The search, sweep by sweep.
pub(super) fn search(canvas: &Canvas, steps: &[SearchStepSummary]) {
    for (index, step) in steps.iter().enumerate() {
        let moment = Moment::search(index + 1);
        canvas.draw(moment, names::CONDITION, &Scalars::new([step.condition_number]));
        canvas.draw(moment, names::OBSERVABILITY, &Scalars::new([to_mm(step.o1)]));
        canvas.draw(moment, names::SEARCH_PREDICTED, &Scalars::new([step.predicted_error_sigma]));
    }
}

/// The points of the plan as they are now.
pub(super) fn points(canvas: &Canvas, session: &Session, time: Timestamp) {
    let Some(profile) = session.mounted_profile() else { return };
    let at = |q: &[f64]| Posture::nominal(&profile, q).reflector;
    let moment = pose_moment(session.measurements, time);
    let open: Vec<usize> = session.open_rows().collect();
    let shown = session.shown.and_then(|shown| open.iter().find(|row| **row >= shown)).or_else(|| open.first());
    let mut marks: Vec<Mark> = Vec::new();
    for index in &open {
        let Some(row) = session.rows.get(*index) else { continue };
        let is_next = Some(index) == shown;
        marks.push(Mark {
            at: at(&row.planned.configuration),
            color: if is_next { layout::ATTENTION } else { layout::LEFT },
            size: if is_next { 6.0 } else { 3.0 },
            label: if is_next { format!("next: {}", row.planned.pose) } else { String::new() },
        });
    }
    let skipped = session.rows.iter().filter(|row| row.skipped).map(|row| row.planned.configuration.clone());
    let unused = session
        .samples
        .iter()
        .filter(|sample| matches!(sample.state, SampleState::LeftOut | SampleState::Undone))
        .map(|sample| session.configuration_of(sample));
    let out = |q: Vec<f64>| Mark { at: at(&q), color: layout::OUT, size: 5.0, label: String::new() };
    marks.extend(skipped.chain(unused).map(out));
    let points = Points3D::new(marks.iter().map(|mark| layout::at(&mark.at)))
        .with_colors(marks.iter().map(|mark| mark.color))
        .with_radii(marks.iter().map(|mark| Radius::new_ui_points(mark.size)))
        .with_labels(marks.iter().map(|mark| crate::recording::read::plain(&mark.label)));
    canvas.draw(moment, names::PLAN, &points);
    if session.samples.is_empty() {
        canvas.draw(Moment::search(0), names::PLAN, &points);
    }
}

/// A point of the plan.
struct Mark {
    at: Point3<f64>,
    color: Color,
    size: f32,
    label: String,
}
