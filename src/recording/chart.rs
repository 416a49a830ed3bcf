//! Charts that are drawn line by line in a 2D view: the library's plots have neither logarithmic axes nor names beside bars.

use rerun::{AsComponents, Boxes2D, Color, Image, LineStrips2D, Points2D};

use super::canvas::Canvas;
use super::style;

/// Width and height of a chart's sheet, in its own units.
pub(super) const SHEET: [f64; 2] = [300.0, 100.0];
/// Half the height of a text, and half the width of a letter, on a sheet that is 600 points wide.
const HANGING: f64 = 5.2;
const LETTER: f64 = 2.0;
/// Steps between the ticks of a linear axis.
const TICKS: f64 = 5.0;
/// Most ticks of any axis.
const MOST_TICKS: u32 = 40;

/// A range of values, spread evenly or by their logarithms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    is_logarithmic: bool,
}

impl Axis {
    pub(super) const fn linear(low: f64, high: f64) -> Self {
        Self { low, high: if high > low { high } else { low + 1.0 }, is_logarithmic: false }
    }

    /// Makes an axis of whole decades around positive values.
    pub(super) fn decades(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite() && *value > 0.0)
            .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if high > 0.0 { (low, high) } else { (0.1, 1.0) };
        let (low, high) = (low.log10().floor(), high.log10().ceil());
        Self { low: 10_f64.powf(low), high: 10_f64.powf(high.max(low + 1.0)), is_logarithmic: true }
    }

    /// Returns how far along the axis a value is, from 0 to 1.
    pub(super) fn part(self, value: f64) -> f64 {
        let of = |value: f64| if self.is_logarithmic { value.max(self.low).log10() } else { value };
        ((of(value) - of(self.low)) / (of(self.high) - of(self.low))).clamp(0.0, 1.0)
    }

    fn ticks(self) -> Vec<f64> {
        if self.is_logarithmic {
            let decades = (self.high / self.low).log10().round();
            let steps = (0_u32..MOST_TICKS).map(f64::from).take_while(|step| *step <= decades);
            return steps.map(|step| self.low * 10_f64.powf(step)).collect();
        }
        let step = whole_step((self.high - self.low) / TICKS);
        let first = (self.low / step).ceil() * step;
        let ticks = (0_u32..MOST_TICKS).map(|index| first + f64::from(index) * step);
        ticks.take_while(|tick| *tick <= self.high + step * 1e-6).collect()
    }
}

/// Returns the next larger of 1, 2 or 5 times a power of ten.
fn whole_step(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-12).log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|step| step * power)
        .find(|step| *step >= value * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// Returns the next larger of 1, 1.5, 2, 3, 5 or 7.5 times a power of ten.
pub(super) fn round_up(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-12).log10().floor());
    [1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0]
        .into_iter()
        .map(|step| step * power)
        .find(|step| *step >= value * (1.0 - 1e-9))
        .unwrap_or(power)
}

/// Returns a number for a tick.
pub(super) fn number(value: f64) -> String {
    let text = format!("{:.6}", if value.abs() < 1e-9 { 0.0 } else { value });
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The part of a sheet in which values are drawn, with its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl Frame {
    /// Returns the place of a value on the sheet, whose y points down.
    pub(super) fn at(&self, x: f64, y: f64) -> [f64; 2] {
        [self.left + self.width * self.x.part(x), self.top + self.height * (1.0 - self.y.part(y))]
    }
}

/// A chart that is being drawn.
#[derive(Debug, Default)]
pub(super) struct Chart {
    lines: Vec<(Vec<[f32; 2]>, Color, f32)>,
    dots: Vec<([f32; 2], Color, f32)>,
    labels: Vec<([f64; 2], String, Color)>,
}

fn single([x, y]: [f64; 2]) -> [f32; 2] {
    [style::single(x), style::single(y)]
}

impl Chart {
    pub(super) fn line(&mut self, points: impl IntoIterator<Item = [f64; 2]>, color: Color, width: f32) {
        self.lines.push((points.into_iter().map(single).collect(), color, width));
    }

    pub(super) fn dot(&mut self, at: [f64; 2], color: Color, size: f32) {
        self.dots.push((single(at), color, size));
    }

    /// Writes a text around a place.
    pub(super) fn label(&mut self, at: [f64; 2], text: impl Into<String>, color: Color) {
        self.labels.push((at, super::latin::plain(&text.into()), color));
    }

    /// Draws the axes of a frame with ticks, and their titles.
    pub(super) fn axes(&mut self, frame: &Frame, x_title: &str, y_title: &str) {
        let bottom = frame.top + frame.height;
        for tick in frame.y.ticks() {
            let [_, y] = frame.at(0.0, tick);
            self.line([[frame.left, y], [frame.left + frame.width, y]], style::GRID, 0.5);
            self.label([frame.left - 9.0, y], number(tick), style::TEXT);
        }
        for tick in frame.x.ticks() {
            let [x, _] = frame.at(tick, 0.0);
            self.line([[x, frame.top], [x, bottom]], style::GRID, 0.3);
            self.label([x, bottom + 4.5], number(tick), style::TEXT);
        }
        self.label([frame.left + frame.width / 2.0, bottom + 11.5], x_title, style::TEXT);
        self.label([frame.left - 9.0, frame.top - 7.0], y_title, style::TEXT);
    }

    /// Draws a limit as a line over the whole frame, named at a `part` of its length.
    pub(super) fn limit(&mut self, frame: &Frame, value: f64, name: &str, part: f64) {
        let [_, y] = frame.at(0.0, value);
        let dashes = 80;
        for dash in (0..dashes).step_by(2) {
            let x = |index: i32| frame.left + frame.width * f64::from(index) / f64::from(dashes);
            self.line([[x(dash), y], [x(dash + 1), y]], style::LIMIT, 0.8);
        }
        self.label([frame.left + frame.width * part, y - 5.0], name, style::LIMIT);
    }

    /// Draws the chart, above an image if there is one.
    pub(super) fn draw(self, canvas: &mut Canvas, path: &str, image: Option<&Image>) {
        let lines = LineStrips2D::new(self.lines.iter().map(|(line, ..)| line.clone()))
            .with_colors(self.lines.iter().map(|(_, color, _)| *color))
            .with_radii(self.lines.iter().map(|(.., width)| style::points(*width)))
            .with_draw_order(1.0);
        let dots = Points2D::new(self.dots.iter().map(|(at, ..)| *at))
            .with_colors(self.dots.iter().map(|(_, color, _)| *color))
            .with_radii(self.dots.iter().map(|(.., size)| style::points(*size)))
            .with_draw_order(2.0);
        // A text hangs below a box without a border, whose width it may take.
        let labels = Boxes2D::from_centers_and_half_sizes(
            self.labels.iter().map(|([x, y], ..)| single([*x, y - HANGING])),
            self.labels.iter().map(|(_, text, _)| [style::single(LETTER * (text.chars().count() as f64 + 2.0)), 0.01]),
        )
        .with_labels(self.labels.iter().map(|(_, text, _)| text.as_str()))
        .with_colors(self.labels.iter().map(|(.., color)| *color))
        .with_radii([0.0])
        .with_show_labels(true)
        .with_draw_order(3.0);
        let mut parts: Vec<&dyn AsComponents> = vec![&lines, &labels];
        if !self.dots.is_empty() {
            parts.push(&dots);
        }
        if let Some(image) = image {
            parts.push(image);
        }
        canvas.draw_static(path, &parts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_round_ticks_and_hold_their_values() {
        let axis = Axis::linear(0.0, 0.93);
        assert_eq!(
            axis.ticks().iter().map(|tick| number(*tick)).collect::<Vec<_>>(),
            ["0", "0.2", "0.4", "0.6", "0.8"]
        );
        let axis = Axis::decades([0.02, 3.0, 0.0, f64::NAN].into_iter());
        assert_eq!(axis.ticks().iter().map(|tick| number(*tick)).collect::<Vec<_>>(), ["0.01", "0.1", "1", "10"]);
        assert!((axis.part(1.0) - 2.0 / 3.0).abs() < 1e-12);
        assert!((axis.part(0.0) - 0.0).abs() < 1e-12, "what a logarithm cannot show is at the bottom");
        assert_eq!([0.031, 0.2, 6.0, 10.0].map(|value| number(round_up(value))), ["0.05", "0.2", "7.5", "10"]);
    }
}
