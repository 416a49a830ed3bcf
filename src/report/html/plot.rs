//! Axes, marks and frames of the drawings, as inline SVG. Places are rounded to 0.1; what is not finite is not drawn.

use super::markup::{add, escape, number};

/// Width of a drawing in its own units; about a column of the page, so that text comes out as large as it is meant.
pub(super) const WIDTH: f64 = 360.0;
/// Space beside the axes.
const LEFT: f64 = 42.0;
const RIGHT: f64 = 8.0;
const TOP: f64 = 18.0;
const BOTTOM: f64 = 32.0;
/// Room for an entry of a legend.
const SLOT: f64 = 68.0;
/// A logarithmic axis does not go further down than this below its largest value (decades).
const MOST_DECADES: f64 = 7.0;

/// Maps values to positions in a drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    is_log: bool,
}

impl Scale {
    /// Of values that run from `low` to `high`; a span of nothing is widened.
    pub(super) fn linear(low: f64, high: f64) -> Self {
        let (low, high) = if low.is_finite() && high.is_finite() { (low.min(high), high.max(low)) } else { (0.0, 1.0) };
        let least = 1e-9_f64.max(1e-9 * low.abs().max(high.abs()));
        let (low, high) =
            if high - low < least { (low, low + if low.abs() > 1.0 { low.abs() } else { 1.0 }) } else { (low, high) };
        Self { low, high, from: 0.0, to: 1.0, is_log: false }
    }

    /// From zero to the largest of the values, with a little room above.
    pub(super) fn from_zero(values: impl Iterator<Item = f64>) -> Self {
        let high = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
        Self::linear(0.0, 1.06 * high)
    }

    /// Around the values.
    pub(super) fn around(values: impl Iterator<Item = f64> + Clone) -> Self {
        let finite = values.filter(|value| value.is_finite());
        let low = finite.clone().fold(f64::INFINITY, f64::min);
        let high = finite.fold(f64::NEG_INFINITY, f64::max);
        let room = 0.04 * (high - low);
        Self::linear(low - room, high + room)
    }

    /// Logarithmic, around the positive values.
    pub(super) fn log(values: impl Iterator<Item = f64> + Clone) -> Self {
        let positive = values.filter(|value| value.is_finite() && *value > 0.0);
        let high = positive.clone().fold(0.0, f64::max);
        let low = positive.fold(f64::INFINITY, f64::min);
        if high <= 0.0 {
            return Self { is_log: true, ..Self::linear(-3.0, 0.0) };
        }
        let top = (1.1 * high).log10();
        let bottom = (0.9 * low).log10().max(top - MOST_DECADES).min(top - 0.5);
        Self { is_log: true, ..Self::linear(bottom, top) }
    }

    const fn over(self, from: f64, to: f64) -> Self {
        Self { from, to, ..self }
    }

    /// Place of a value; values beyond an end are placed at the end.
    pub(super) fn at(&self, value: f64) -> f64 {
        let value = if self.is_log { value.max(f64::MIN_POSITIVE).log10() } else { value };
        let part = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.from + part * (self.to - self.from)
    }

    /// Values that get a number, with that number.
    fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        if self.is_log { self.log_ticks() } else { self.linear_ticks(most) }
    }

    fn linear_ticks(&self, most: usize) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) / most.max(1) as f64;
        let step = nice_above(rough);
        let decimals = decimals_of(step);
        let first = (self.low / step - 1e-6).ceil() * step;
        (0..=most + 1)
            .map(|index| step.mul_add(index as f64, first))
            .take_while(|value| *value <= self.high + 1e-6 * step)
            .map(|value| (value, number(value, decimals)))
            .collect()
    }

    fn log_ticks(&self) -> Vec<(f64, String)> {
        let decades = self.high - self.low;
        let factors: &[f64] = if decades < 2.2 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let mut ticks = Vec::new();
        let mut decade = self.low.floor();
        while decade <= self.high {
            for factor in factors {
                let value = factor * 10.0_f64.powf(decade);
                if (self.low - 1e-9..=self.high + 1e-9).contains(&value.log10()) {
                    ticks.push((value, number(value, decimals_of(value))));
                }
            }
            decade += 1.0;
        }
        ticks
    }
}

/// The smallest of 1, 2, 5, 10, 20, … that is not below `value`.
pub(super) fn nice_above(value: f64) -> f64 {
    if !value.is_finite() || value <= 0.0 {
        return 1.0;
    }
    let decade = 10.0_f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * decade)
        .find(|nice| *nice >= value * (1.0 - 1e-9))
        .unwrap_or(value)
}

/// Decimals that a round number needs.
pub(super) fn decimals_of(value: f64) -> usize {
    (0..=6).find(|&decimals| value.abs() * 10.0_f64.powi(decimals) >= 1.0 - 1e-9).map_or(6, i32::unsigned_abs) as usize
}

/// A drawing with two axes.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    x: Scale,
    y: Scale,
    width: f64,
    height: f64,
    body: String,
}

impl Plot {
    /// An empty one with axes and their labels (plain text).
    pub(super) fn new((width, height): (f64, f64), (x, x_label): (Scale, &str), (y, y_label): (Scale, &str)) -> Self {
        let (right, bottom) = (width - RIGHT, height - BOTTOM);
        let (x, y) = (x.over(LEFT, right), y.over(bottom, TOP));
        let mut plot = Self { x, y, width, height, body: String::new() };
        let most = if width < 300.0 { 4 } else { 7 };
        for (value, text) in y.ticks(5) {
            let at = y.at(value);
            plot.line("gr", &[(LEFT, at), (right, at)]);
            plot.text((LEFT - 4.0, at + 3.4), "end", &text);
        }
        for (value, text) in x.ticks(most) {
            let at = x.at(value);
            plot.line("ax", &[(at, bottom), (at, bottom + 3.0)]);
            plot.text((at, bottom + 13.0), "middle", &text);
        }
        plot.line("ax", &[(LEFT, TOP), (LEFT, bottom), (right, bottom)]);
        plot.text((f64::midpoint(LEFT, right), height - 5.0), "middle", x_label);
        plot.text((2.0, 9.0), "start", y_label);
        plot
    }

    /// Place of a pair of values; none unless both are finite.
    pub(super) fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        (x.is_finite() && y.is_finite()).then(|| (self.x.at(x), self.y.at(y)))
    }

    /// A line through places.
    pub(super) fn line(&mut self, class: &str, places: &[(f64, f64)]) {
        let places: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        add(&mut self.body, &format!("<polyline class=\"{class}\" points=\"{}\"></polyline>\n", places.join(" ")));
    }

    /// A line through values.
    pub(super) fn curve(&mut self, class: &str, values: impl Iterator<Item = (f64, f64)>) {
        let places: Vec<_> = values.filter_map(|(x, y)| self.at(x, y)).collect();
        self.line(class, &places);
    }

    /// The area between two curves over the same values: x, lower and upper end.
    pub(super) fn band(&mut self, class: &str, values: impl DoubleEndedIterator<Item = (f64, f64, f64)> + Clone) {
        let upper = values.clone().filter_map(|(x, _, high)| self.at(x, high));
        let lower = values.rev().filter_map(|(x, low, _)| self.at(x, low));
        let places: Vec<_> = upper.chain(lower).collect();
        self.line(class, &places);
    }

    /// A mark at a place.
    pub(super) fn mark(&mut self, mark: Mark, place: (f64, f64)) {
        self.body.push_str(&mark.svg(place));
    }

    /// A bar from zero to `y` over a part of x.
    pub(super) fn bar(&mut self, class: &str, (from, to): (f64, f64), y: f64) {
        if let (Some((left, top)), Some((right, bottom))) = (self.at(from, y), self.at(to, 0.0)) {
            let (width, height) = ((right - left - 1.0).max(0.5), (bottom - top).max(0.0));
            add(
                &mut self.body,
                &format!(
                    "<rect class=\"{class}\" x=\"{:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"></rect>\n",
                    left + 0.5
                ),
            );
        }
    }

    /// A limit of x with its name, the names below each other by `row`.
    pub(super) fn limit(&mut self, x: f64, row: f64, name: &str) {
        if let Some((at, _)) = self.at(x, 0.0) {
            self.line("lim", &[(at, TOP), (at, self.height - BOTTOM)]);
            let (beside, anchor) = if at > 0.4 * self.width { (at - 4.0, "end") } else { (at + 4.0, "start") };
            let y = row.mul_add(11.0, TOP + 8.0);
            add(
                &mut self.body,
                &format!(
                    "<text class=\"lbl\" x=\"{beside:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>\n",
                    escape(name)
                ),
            );
        }
    }

    /// Plain text at a place.
    pub(super) fn text(&mut self, (x, y): (f64, f64), anchor: &str, text: &str) {
        add(
            &mut self.body,
            &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>\n", escape(text)),
        );
    }

    /// What the marks mean, at the right of the top line.
    pub(super) fn legend(&mut self, entries: &[(Mark, &str)]) {
        let first = SLOT.mul_add(-(entries.len() as f64), self.width);
        for (index, (mark, text)) in entries.iter().enumerate() {
            let left = SLOT.mul_add(index as f64, first);
            self.mark(*mark, (left, 5.6));
            self.text((left + 7.0, 9.0), "start", text);
        }
    }

    /// The drawing with a caption; `caption` is HTML.
    pub(super) fn figure(self, title: &str, caption: &str) -> String {
        figure(title, caption, (self.width, self.height), &self.body)
    }
}

/// What marks a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// The nominal arm: an open square.
    Nominal,
    /// The identified arm: a full circle.
    Identified,
    /// A residual of the fit: a small open circle.
    Residual,
    /// A rejected sample: a cross.
    Rejected,
}

impl Mark {
    /// At a place.
    pub(super) fn svg(self, (x, y): (f64, f64)) -> String {
        match self {
            Self::Nominal => format!(
                "<rect class=\"nom\" x=\"{:.1}\" y=\"{:.1}\" width=\"5\" height=\"5\"></rect>\n",
                x - 2.5,
                y - 2.5
            ),
            Self::Identified => format!("<circle class=\"idn\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\"></circle>\n"),
            Self::Residual => format!("<circle class=\"res\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.9\"></circle>\n"),
            Self::Rejected => {
                format!("<path class=\"rej\" d=\"M{:.1} {:.1}l6 6m0 -6l-6 6\"></path>\n", x - 3.0, y - 3.0)
            }
        }
    }
}

/// A drawing with its caption; `caption` and `body` are HTML and SVG.
pub(super) fn figure(title: &str, caption: &str, (width, height): (f64, f64), body: &str) -> String {
    let name = escape(title);
    format!(
        "<figure><figcaption><b>{name}</b>{caption}</figcaption>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{name}\">\n{body}</svg></figure>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let shown = |scale: Scale| scale.ticks(5).into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" ");
        assert_eq!(shown(Scale::linear(0.0, 0.21)), "0.00 0.05 0.10 0.15 0.20");
        assert_eq!(shown(Scale::linear(-170.0, 160.0)), "−100 0 100");
        assert_eq!(shown(Scale::log([0.004, 21.0].into_iter())), "0.01 0.1 1 10");
        assert_eq!(shown(Scale::log([0.05, 0.4].into_iter())), "0.05 0.1 0.2");
        assert_eq!(shown(Scale::linear(3.0, 3.0)), "3 4 5 6");
        assert_eq!(shown(Scale::log([0.0, f64::NAN].into_iter())), "0.001 0.01 0.1 1");
    }

    #[test]
    fn what_is_not_finite_is_not_drawn() {
        let scale = Scale::around([f64::NAN, f64::INFINITY].into_iter());
        let mut plot = Plot::new((WIDTH, 100.0), (scale, "x"), (Scale::from_zero([f64::NAN].into_iter()), "y"));
        assert_eq!((plot.at(f64::NAN, 0.0), plot.at(0.0, f64::INFINITY)), (None, None));
        plot.curve("il", [(0.0, f64::NAN), (0.5, 0.5)].into_iter());
        let svg = plot.figure("t", "");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn round_numbers_are_found() {
        assert_eq!([0.0123, 3.0, 1.0, 6.0, 2000.0, 0.0].map(nice_above).to_vec(), [0.02, 5.0, 1.0, 10.0, 2000.0, 1.0]);
    }
}
