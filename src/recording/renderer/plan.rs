//! The poses of the plan.

use jiff::Timestamp;
use nalgebra::Point3;
use rerun::{Color, LineStrips3D, Points3D};

use super::{charts, document};
use crate::recording::arm::Posture;
use crate::recording::canvas::{Canvas, Film, Moment};
use crate::recording::latin::plain;
use crate::recording::{names, style};
use crate::session::plan::PoseKind;
use crate::session::state::{SampleState, Session};

/// How long the poses take to fall into place (s), and in how many groups.
const SEARCH: f64 = 2.0;
const GROUPS: usize = 20;

/// Returns the colour of a pose of a plan.
const fn color(kind: PoseKind) -> Color {
    match kind {
        PoseKind::Identification => style::DONE,
        PoseKind::Verification => style::VERIFICATION,
        PoseKind::Drift => style::ATTENTION,
        PoseKind::Home | PoseKind::Via => style::LEFT,
    }
}

/// Draws the rows of a plan from number `first` on, one group after the other, and the course of the search for them.
pub(super) fn draw(canvas: &mut Canvas, film: &mut Film, session: &Session, first: usize, time: Timestamp) {
    let (Some(profile), Some(plan)) = (session.mounted_profile(), &session.plan) else { return };
    charts::search(canvas, &plan.search);
    let planned: Vec<_> = session.rows.iter().skip(first).map(|row| &row.planned).collect();
    document::caption(canvas, film.now(), "The search", &document::plan_in_words(session));
    let [from, to] = film.advance(SEARCH, time);
    let size = planned.len().div_ceil(GROUPS).max(1);
    for (index, group) in planned.chunks(size).enumerate() {
        let places = group.iter().map(|row| Posture::nominal(&profile, &row.configuration).reflector);
        let points = Points3D::update_fields()
            .with_positions(places.map(|place| style::at(&place)))
            .with_colors(group.iter().map(|row| style::shade(color(row.kind), 0.7)))
            .with_labels(group.iter().map(|row| plain(&format!("{}: {}", row.pose, row.kind.name()))));
        canvas.draw(from.towards(to, (index + 1) as f64 / GROUPS as f64), names::PLAN, &points);
    }
}

/// Draws a piece of the way of the reflector.
pub(super) fn way(canvas: &mut Canvas, moment: Moment, ends: [Point3<f64>; 2]) {
    canvas.draw(moment, names::PATH, &LineStrips3D::update_fields().with_strips([ends.map(|end| style::at(&end))]));
}

/// Draws the next pose, and what is not used.
pub(super) fn points(canvas: &mut Canvas, session: &Session, moment: Moment) {
    let Some(profile) = session.mounted_profile() else { return };
    let at = |q: &[f64]| Posture::nominal(&profile, q).reflector;
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
    canvas.draw(moment, names::UNUSED, &Points3D::update_fields().with_positions(unused.iter().map(style::at)));
}
