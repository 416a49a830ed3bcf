//! The poses in space: two projections, with the errors drawn larger than they are by a factor that is stated.

use super::charts::{norm, shown, thinned};
use super::markup::add;
use super::plot::{Mark, figure, nice_above};
use crate::geometry::enlargement;
use crate::report::document::{Details, PointPart};
use crate::text::counted;

/// Size of a view.
const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 300.0;
/// Room at the edges.
const EDGE: f64 = 26.0;
/// The largest error is drawn at most this part of the arm's reach long.
const LARGEST: f64 = 0.25;

/// Looks along an axis of the base.
#[derive(Clone, Copy, Debug)]
struct View {
    name: &'static str,
    /// Axes of the base to the right and up.
    axes: (usize, usize),
    labels: (&'static str, &'static str),
}

const VIEWS: [View; 2] = [
    View { name: "from the side", axes: (0, 2), labels: ("x", "z") },
    View { name: "from above", axes: (0, 1), labels: ("x", "y") },
];

/// What the identification left, from two sides.
pub(super) fn views(report: &Details) -> String {
    VIEWS.iter().map(|view| draw(report, *view)).collect()
}

fn draw(report: &Details, view: View) -> String {
    let error = |point: &PointPart| point.identified_mm;
    let points: Vec<&PointPart> = report
        .points
        .iter()
        .filter(|point| {
            !point.rejected && point.at_mm.iter().chain(&point.identified_mm).all(|value| value.is_finite())
        })
        .collect();
    let all = points.len();
    let points: Vec<&PointPart> = shown(&points).into_iter().map(|(_, point)| point).collect();
    let pick = |place: [f64; 3]| (place[view.axes.0], place[view.axes.1]);
    let arm: Vec<(f64, f64)> = report
        .arm_mm
        .iter()
        .filter(|place| place.iter().all(|value| value.is_finite()))
        .map(|place| pick(*place))
        .collect();
    let places = || arm.iter().copied().chain(points.iter().map(|point| pick(point.at_mm)));
    let span = |axis: fn((f64, f64)) -> f64| {
        places()
            .map(axis)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    };
    let ((left, right), (bottom, top)) = (span(|place| place.0), span(|place| place.1));
    let (wide, high) = ((right - left).max(1.0), (top - bottom).max(1.0));
    if !(wide.is_finite() && high.is_finite()) {
        return String::new();
    }
    let scale = ((WIDTH - 2.0 * EDGE) / wide).min((HEIGHT - 2.0 * EDGE) / high) * 0.94;
    let middle = (f64::midpoint(left, right), f64::midpoint(bottom, top));
    let at =
        |(x, y): (f64, f64)| ((x - middle.0).mul_add(scale, WIDTH / 2.0), (y - middle.1).mul_add(-scale, HEIGHT / 2.0));
    let longest = points.iter().map(|point| norm(error(point))).fold(0.0, f64::max);
    let exaggeration = enlargement(longest, LARGEST * size(report));

    let mut body = String::new();
    let line = |class: &str, places: &[(f64, f64)]| {
        let places: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        format!("<polyline class=\"{class}\" points=\"{}\"></polyline>\n", places.join(" "))
    };
    let joints: Vec<(f64, f64)> = arm.iter().copied().map(at).collect();
    body.push_str(&line("arm", &joints));
    for (x, y) in &joints {
        add(&mut body, &format!("<circle class=\"jnt\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\"></circle>\n"));
    }
    for point in &points {
        let from = pick(point.at_mm);
        let by = pick(error(point));
        let to = (by.0.mul_add(exaggeration, from.0), by.1.mul_add(exaggeration, from.1));
        body.push_str(&line("il", &[at(from), at(to)]));
        body.push_str(&if point.verification { Mark::Identified } else { Mark::Residual }.svg(at(from)));
    }
    body.push_str(&bar(wide, scale));
    body.push_str(&cross(view.labels));
    let caption =
        format!("{}: errors drawn {exaggeration:.0} times as long as they are{}", counted(all, "pose"), thinned(all));
    figure(&format!("Identified arm, {}", view.name), &caption, (WIDTH, HEIGHT), &body)
}

/// Size of all that is drawn (mm), the same for every view.
fn size(report: &Details) -> f64 {
    let places = || report.points.iter().map(|point| point.at_mm).chain(report.arm_mm.iter().copied());
    let span = |axis: usize| {
        let values = places().filter_map(|place| place.get(axis).copied()).filter(|value| value.is_finite());
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        (high - low).max(1.0)
    };
    (0..3).map(span).filter(|span| span.is_finite()).fold(1.0, f64::max)
}

/// A bar of a round length.
fn bar(wide: f64, scale: f64) -> String {
    let length = nice_above(wide / 8.0);
    let (left, y) = (6.0, HEIGHT - 8.0);
    let right = length.mul_add(scale, left);
    format!(
        "<polyline class=\"ax\" points=\"{left},{y1} {left},{y} {right:.1},{y} {right:.1},{y1}\"></polyline>\n<text x=\"{:.1}\" y=\"{y}\">{length:.0} mm</text>\n",
        right + 4.0,
        y1 = y - 4.0
    )
}

/// Which way the axes of the base point.
fn cross((right, up): (&str, &str)) -> String {
    let (x, y) = (WIDTH - 40.0, HEIGHT - 8.0);
    format!(
        "<polyline class=\"ax\" points=\"{x},{:.1} {x},{y} {:.1},{y}\"></polyline>\n<text x=\"{:.1}\" y=\"{:.1}\">{right}</text>\n<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{up}</text>\n",
        y - 22.0,
        x + 22.0,
        x + 25.0,
        y + 3.0,
        x - 3.0,
        y - 16.0
    )
}
