//! The arm before and after, side by side: one camera, one scale, one map of colours, so that what is longer is worse.

use super::charts::{norm, shown, thinned};
use super::markup::{add, number};
use super::plot::{decimals_of, figure, nice_above};
use super::verdict::figure as shown_figure;
use crate::geometry::enlargement;
use crate::report::document::{BodyPart, Details, PointPart};
use crate::session::summary::{Figure, VerificationSummary};
use crate::text::counted;

/// Size of a picture.
const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 198.0;
/// Room at the edges.
const EDGE: f64 = 8.0;
/// The largest error is drawn at most this part of the size of everything long.
const LARGEST: f64 = 0.22;
/// Steps of the map of colours.
const STEPS: usize = 8;
/// Part of the nominal errors within the map; the rest has the last colour.
const WITHIN: f64 = 0.95;
/// How far the camera looks down (rad).
const DOWN: f64 = 0.33;
/// How far it is turned from the direction of the points, so that the arm is seen from the side (rad).
const ASIDE: f64 = 1.0;
/// Errors drawn shorter than this are dots.
const DOT: f64 = 2.5;
/// Length of the barbs of an arrow at most.
const BARB: f64 = 4.0;

/// The camera: axes of the picture in the base.
struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    towards: [f64; 3],
}

/// A place in a picture: right, up, and nearness.
#[derive(Clone, Copy)]
struct Seen {
    x: f64,
    y: f64,
    near: f64,
}

impl Camera {
    /// From the side of the points.
    fn aside(points: &[&PointPart]) -> Self {
        let count = points.len().max(1) as f64;
        let sum = |axis: usize| points.iter().filter_map(|point| point.at_mm.get(axis)).sum::<f64>() / count;
        let azimuth = sum(1).atan2(sum(0)) - ASIDE;
        let ((sin, cos), (down_sin, down_cos)) = (azimuth.sin_cos(), DOWN.sin_cos());
        Self {
            right: [-sin, cos, 0.0],
            up: [-down_sin * cos, -down_sin * sin, down_cos],
            towards: [down_cos * cos, down_cos * sin, down_sin],
        }
    }

    fn see(&self, place: [f64; 3]) -> Seen {
        let along = |axis: [f64; 3]| axis.iter().zip(place).map(|(axis, place)| axis * place).sum();
        Seen { x: along(self.right), y: along(self.up), near: along(self.towards) }
    }
}

/// The map of colours: a step per this many mm.
#[derive(Clone, Copy)]
struct Map {
    step: f64,
}

impl Map {
    fn new(points: &[&PointPart]) -> Self {
        let mut lengths: Vec<f64> =
            points.iter().map(|point| norm(point.nominal_mm)).filter(|length| length.is_finite()).collect();
        lengths.sort_by(f64::total_cmp);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a length")]
        let most = lengths.get((lengths.len().saturating_sub(1) as f64 * WITHIN) as usize).copied().unwrap_or(1.0);
        Self { step: round_above(most / STEPS as f64) }
    }

    /// The step of an error.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number, not negative")]
    fn step_of(self, length: f64) -> usize {
        ((length / self.step) as usize).min(STEPS - 1)
    }

    /// Keys with the lengths that they mean.
    fn legend(self) -> String {
        let (width, left) = (52.0, 8.0);
        let mut body = String::new();
        for step in 0..STEPS {
            let x = width * step as f64 + left;
            add(
                &mut body,
                &format!("<rect class=\"k{step}\" x=\"{x:.1}\" y=\"3\" width=\"{width}\" height=\"9\"></rect>\n"),
            );
        }
        for step in 0..STEPS {
            let x = width * step as f64 + left;
            let value = number(self.step * step as f64, decimals_of(self.step));
            add(&mut body, &format!("<text x=\"{x:.1}\" y=\"23\" text-anchor=\"middle\">{value}</text>\n"));
        }
        let x = width * STEPS as f64 + left;
        add(&mut body, &format!("<text x=\"{x:.1}\" y=\"23\" text-anchor=\"middle\">and more</text>\n"));
        add(&mut body, &format!("<text x=\"{:.1}\" y=\"12\">position error (mm), both pictures</text>\n", x + 8.0));
        format!(
            "<svg viewBox=\"0 0 {} 26\" role=\"img\" aria-label=\"Colours of the errors\">\n{body}</svg>\n",
            2.0 * WIDTH
        )
    }
}

/// The smallest whole number of up to one digit, times a power of ten, that is not below `step`.
fn round_above(step: f64) -> f64 {
    let power = nice_above(step) / 10.0;
    (1..=10_u8)
        .map(|times| f64::from(times) * power)
        .find(|round| *round >= step * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// Something to draw, far things first.
struct Drawn {
    near: f64,
    svg: String,
}

/// Both pictures with their common map of colours; nothing without points.
pub(super) fn pair(report: &Details, verification: Option<&VerificationSummary>) -> String {
    let is_drawn = |point: &&PointPart| {
        let numbers = point.at_mm.iter().chain(&point.nominal_mm).chain(&point.identified_mm);
        !point.rejected && numbers.into_iter().all(|value| value.is_finite())
    };
    let tested: Vec<&PointPart> = report.points.iter().filter(is_drawn).filter(|point| point.verification).collect();
    let is_verified = !tested.is_empty();
    let all = if is_verified { tested } else { report.points.iter().filter(is_drawn).collect() };
    if all.is_empty() {
        return String::new();
    }
    let map = Map::new(&all);
    let points: Vec<&PointPart> = shown(&all).into_iter().map(|(_, point)| point).collect();
    let camera = Camera::aside(&points);
    let places = || points.iter().map(|point| point.at_mm).chain(report.arm_mm.iter().copied());
    let size = (0..3).map(|axis| span(places().filter_map(|place| place.get(axis).copied()))).fold(1.0, f64::max);
    let longest = points.iter().map(|point| norm(point.nominal_mm).max(norm(point.identified_mm))).fold(0.0, f64::max);
    let times = enlargement(longest, LARGEST * size);
    let frame = Frame::around(&camera, report, &points, times);
    let note = if is_verified { "" } else { "; residuals of the fit, no accuracy" };
    let means = |pick: fn(&VerificationSummary) -> Option<(Figure, Figure)>| verification.and_then(pick);
    let (before, after) = (
        means(|verification| Some(figures(verification.nominal.position_mm?))),
        means(|verification| Some(figures(verification.identified.position_mm?))),
    );
    let caption = |figures: Option<(Figure, Figure)>| {
        figures.map_or_else(
            || note.to_owned(),
            |(mean, max)| format!("mean {}, largest {} mm", shown_figure(mean), shown_figure(max)),
        )
    };
    let draw = |name: &str, figures, error: fn(&PointPart) -> [f64; 3]| {
        let body = frame.body(&camera, report, &points, map, times, error);
        figure(name, &caption(figures), (WIDTH, HEIGHT), &body)
    };
    let pictures = draw("Before: nominal arm", before, |point| point.nominal_mm)
        + &draw("After: identified arm", after, |point| point.identified_mm);
    let times = number(times, 0);
    format!(
        "<div class=\"grid pair\">\n{pictures}</div>\n<div class=\"wide\">{}</div>\n<p class=\"small\">{}: measured less predicted position, {times} times as long as it is in both pictures{}.</p>\n",
        map.legend(),
        counted(all.len(), "pose"),
        thinned(all.len())
    )
}

const fn figures(statistics: crate::session::summary::StatisticsSummary) -> (Figure, Figure) {
    let [mean, _, _, max] = statistics.figures();
    (mean, max)
}

fn span(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if high >= low { high - low } else { 0.0 }
}

/// The place where an error is drawn to end.
fn tip(point: &PointPart, error: [f64; 3], times: f64) -> [f64; 3] {
    let mut tip = point.at_mm;
    for (place, error) in tip.iter_mut().zip(error) {
        *place = error.mul_add(times, *place);
    }
    tip
}

/// Maps what the camera sees into the picture.
struct Frame {
    scale: f64,
    middle: (f64, f64),
}

impl Frame {
    /// Around all that is drawn in either picture.
    fn around(camera: &Camera, report: &Details, points: &[&PointPart], times: f64) -> Self {
        let ends = points.iter().flat_map(|point| {
            [point.at_mm, tip(point, point.nominal_mm, times), tip(point, point.identified_mm, times)]
        });
        let bodies =
            report.bodies.iter().flat_map(|body| [(body.from_mm, body.radius_mm), (body.to_mm, body.radius_mm)]);
        let places = ends.chain(report.arm_mm.iter().copied()).map(|place| (place, 0.0)).chain(bodies);
        let mut low = (f64::INFINITY, f64::INFINITY);
        let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for (place, radius) in places.filter(|(place, _)| place.iter().all(|value| value.is_finite())) {
            let seen = camera.see(place);
            low = (low.0.min(seen.x - radius), low.1.min(seen.y - radius));
            high = (high.0.max(seen.x + radius), high.1.max(seen.y + radius));
        }
        let (wide, tall) = ((high.0 - low.0).max(1.0), (high.1 - low.1).max(1.0));
        let scale = ((WIDTH - 2.0 * EDGE) / wide).min((HEIGHT - 2.0 * EDGE) / tall);
        Self { scale, middle: (f64::midpoint(low.0, high.0), f64::midpoint(low.1, high.1)) }
    }

    fn at(&self, seen: Seen) -> (f64, f64) {
        let x = (seen.x - self.middle.0).mul_add(self.scale, WIDTH / 2.0);
        (x, (seen.y - self.middle.1).mul_add(-self.scale, HEIGHT / 2.0))
    }

    /// The arm and the errors of one model, what is nearer in front.
    fn body(
        &self,
        camera: &Camera,
        report: &Details,
        points: &[&PointPart],
        map: Map,
        times: f64,
        error: fn(&PointPart) -> [f64; 3],
    ) -> String {
        let mut drawn: Vec<Drawn> = Vec::new();
        // Castings need not touch each other: the line from joint to joint is seen between them.
        drawn.push(Drawn { near: f64::NEG_INFINITY, svg: self.skeleton(camera, &report.arm_mm) });
        drawn.extend(report.bodies.iter().map(|body| self.casting(camera, body)));
        drawn.extend(points.iter().map(|point| {
            let (from, to) = (camera.see(point.at_mm), camera.see(tip(point, error(point), times)));
            let step = map.step_of(norm(error(point)));
            Drawn { near: from.near, svg: arrow(self.at(from), self.at(to), step) }
        }));
        drawn.sort_by(|one, other| one.near.total_cmp(&other.near));
        drawn.into_iter().map(|drawn| drawn.svg).collect()
    }

    /// A part of the arm.
    fn casting(&self, camera: &Camera, body: &BodyPart) -> Drawn {
        let (from, to) = (camera.see(body.from_mm), camera.see(body.to_mm));
        let ((x1, y1), (mut x2, y2)) = (self.at(from), self.at(to));
        if (x1 - x2).hypot(y1 - y2) < 0.1 {
            // A line of no length is not drawn everywhere.
            x2 = x1 + 0.1;
        }
        let width = 2.0 * body.radius_mm * self.scale;
        let line = |class: &str, width: f64| {
            format!(
                "<path class=\"{class}\" stroke-width=\"{width:.1}\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\"></path>\n"
            )
        };
        let svg = line("rim", width) + &line("cast", (width - 1.6).max(0.4));
        Drawn { near: f64::midpoint(from.near, to.near), svg }
    }

    /// The line from joint to joint.
    fn skeleton(&self, camera: &Camera, arm: &[[f64; 3]]) -> String {
        let places: Vec<String> = arm
            .iter()
            .filter(|place| place.iter().all(|value| value.is_finite()))
            .map(|place| {
                let (x, y) = self.at(camera.see(*place));
                format!("{x:.1},{y:.1}")
            })
            .collect();
        format!("<polyline class=\"arm\" points=\"{}\"></polyline>\n", places.join(" "))
    }
}

/// An error: an arrow, or a dot where it is too short to be one.
fn arrow((x1, y1): (f64, f64), (x2, y2): (f64, f64), step: usize) -> String {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let length = dx.hypot(dy);
    if length < DOT {
        return format!("<circle class=\"k{step}\" cx=\"{x1:.1}\" cy=\"{y1:.1}\" r=\"1.4\"></circle>\n");
    }
    let barb = BARB.min(0.4 * length) / length;
    let (bx, by) = (dx * barb, dy * barb);
    let (nx, ny) = (-0.5 * by, 0.5 * bx);
    format!(
        "<path class=\"a{step}\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}M{:.1} {:.1}L{x2:.1} {y2:.1}L{:.1} {:.1}\"></path>\n",
        x2 - bx + nx,
        y2 - by + ny,
        x2 - bx - nx,
        y2 - by - ny
    )
}
