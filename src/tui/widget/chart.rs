//! A line chart, in braille, half blocks or ASCII.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text;
use crate::tui::glyphs::Glyphs;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Dots per character.
const DOTS: (usize, usize) = (2, 4);
/// Smallest useful plotting area.
const LEAST: (u16, u16) = (6, 2);

/// A line chart.
#[derive(Clone, Copy, Debug)]
pub struct Chart<'a> {
    /// The points, in ascending order of x.
    pub points: &'a [(f64, f64)],
    /// The best possible level, drawn dotted.
    pub level: Option<f64>,
    /// A value of y that must not be exceeded, drawn dashed; the axis then begins at zero.
    pub limit: Option<f64>,
    /// The x at which the axis ends, if not with the last point.
    pub end: Option<f64>,
    /// The x at which the line is marked.
    pub mark: Option<f64>,
    /// Title of the y axis, with its unit.
    pub y_title: &'a str,
    /// Title of the x axis, with its unit.
    pub x_title: &'a str,
    /// Decimals of the y axis.
    pub digits: usize,
}

/// Maps numbers to dots.
#[derive(Clone, Copy, Debug)]
struct Scale {
    x: (f64, f64),
    y: (f64, f64),
    dots: (usize, usize),
}

impl Scale {
    fn at(&self, x: f64, y: f64) -> (usize, usize) {
        (place(x, self.x, self.dots.0), self.dots.1.saturating_sub(1) - place(y, self.y, self.dots.1))
    }
}

/// The dot of a value within a range.
fn place(value: f64, (low, high): (f64, f64), dots: usize) -> usize {
    let last = dots.saturating_sub(1);
    let part = if high > low { (value - low) / (high - low) } else { 0.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the number of dots")]
    let dot = (part.clamp(0.0, 1.0) * last as f64).round() as usize;
    dot.min(last)
}

/// Rows with their values: both ends, and between them at most every third row.
fn ticks((low, high): (f64, f64), rows: u16) -> Vec<(u16, f64)> {
    let last = rows.saturating_sub(1);
    let parts = (last / 3).clamp(1, 4);
    let tick = |part: u16| {
        let row = (f64::from(last) * f64::from(part) / f64::from(parts)).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a row of the chart")]
        let row = row as u16;
        (row, high - (high - low) * f64::from(row) / f64::from(last.max(1)))
    };
    (0..=parts).map(tick).collect()
}

/// Smallest and largest value.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

impl Chart<'_> {
    /// Draws the title, and the line with its axes.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let points: Vec<(f64, f64)> =
            self.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let level = self.level.filter(|level| level.is_finite());
        let limit = self.limit.filter(|limit| limit.is_finite());
        let end = self.end.filter(|end| end.is_finite());
        let x = range(points.iter().map(|point| point.0).chain(end));
        let y = range(points.iter().map(|point| point.1).chain(level).chain(limit).chain(limit.map(|_| 0.0)));
        let label = |value: f64| format!("{value:.*}", self.digits);
        let left = [y.0, y.1].into_iter().chain(limit).map(|value| text::columns(&label(value))).max().unwrap_or(0) + 1;
        let left = u16::try_from(left).unwrap_or(u16::MAX);
        let plot = paint::band(area, 1, area.height.saturating_sub(2));
        let plot = Rect { x: plot.x.saturating_add(left), width: plot.width.saturating_sub(left), ..plot };
        if points.is_empty() || plot.width < LEAST.0 || plot.height < LEAST.1 {
            return;
        }
        let dim = theme.style(Role::Dim);
        paint::text(buf, area, (0, 0), &theme.glyphs.show(self.y_title), dim);
        let right =
            |label: &str| u16::try_from(usize::from(left - 1).saturating_sub(text::columns(label))).unwrap_or(0);
        for (row, value) in ticks(y, plot.height) {
            let tick = label(value);
            paint::text(buf, area, (right(&tick), 1 + row), &tick, dim);
        }
        self.x_axis(theme, x, (area, left), buf);

        let (columns, rows) = (usize::from(plot.width), usize::from(plot.height));
        let scale = Scale { x, y, dots: (columns * DOTS.0, rows * DOTS.1) };
        let mut cells = vec![0_u8; columns * rows];
        if let Some(level) = level {
            let (_, down) = scale.at(x.0, level);
            (0..scale.dots.0).step_by(4).for_each(|across| set_dot(&mut cells, columns, (across, down)));
        }
        if let Some(limit) = limit {
            let (_, down) = scale.at(x.0, limit);
            let dashes = (0..scale.dots.0).filter(|across| across % 8 < 5);
            dashes.for_each(|across| set_dot(&mut cells, columns, (across, down)));
        }
        draw_line(&points, &scale, columns, &mut cells);
        paint_cells(&cells, theme, plot, buf);
        if let Some((x, y)) = self.mark.and_then(|x| on_line(&points, x)) {
            let (across, down) = scale.at(x, y);
            let at = (across / DOTS.0, down / DOTS.1);
            if let (Ok(column), Ok(row)) = (u16::try_from(at.0), u16::try_from(at.1)) {
                paint::text(buf, plot, (column, row), theme.glyphs.next(), theme.style(Role::Title));
            }
        }
    }

    fn x_axis(&self, theme: Theme, x: (f64, f64), (area, left): (Rect, u16), buf: &mut Buffer) {
        let row = area.height.saturating_sub(1);
        let dim = theme.style(Role::Dim);
        let column = paint::text(buf, area, (left, row), &format!("{:.0}", x.0), dim);
        let last = format!("{:.0}", x.1);
        let end = usize::from(area.width).saturating_sub(text::columns(&last));
        let title = theme.glyphs.show(self.x_title);
        let middle = (usize::from(left) + usize::from(area.width)).saturating_sub(text::columns(&title)) / 2;
        if middle > usize::from(column) && middle + text::columns(&title) < end {
            paint::text(buf, area, (u16::try_from(middle).unwrap_or(0), row), &title, dim);
        }
        if x.1 > x.0 {
            paint::text(buf, area, (u16::try_from(end).unwrap_or(0), row), &last, dim);
        }
    }
}

/// The point of the line at `x`, clamped to its ends.
fn on_line(points: &[(f64, f64)], x: f64) -> Option<(f64, f64)> {
    let (first, last) = (points.first()?, points.last()?);
    let x = if x.is_finite() { x.clamp(first.0, last.0.max(first.0)) } else { last.0 };
    let pair = points.windows(2).find(|pair| pair.iter().map(|point| point.0 >= x).eq([false, true]));
    match pair {
        Some([from, to]) => Some((x, from.1 + (to.1 - from.1) * (x - from.0) / (to.0 - from.0))),
        _ => points.iter().find(|point| point.0 >= x).copied(),
    }
}

fn set_dot(cells: &mut [u8], columns: usize, (across, down): (usize, usize)) {
    let bit = (down % DOTS.1) * DOTS.0 + across % DOTS.0;
    if let Some(cell) = cells.get_mut(down / DOTS.1 * columns + across / DOTS.0) {
        *cell |= 1 << bit;
    }
}

fn draw_line(points: &[(f64, f64)], scale: &Scale, columns: usize, cells: &mut [u8]) {
    let dots: Vec<(usize, usize)> = points.iter().map(|(x, y)| scale.at(*x, *y)).collect();
    for dot in &dots {
        set_dot(cells, columns, *dot);
    }
    for pair in dots.windows(2) {
        let [from, to] = pair else { continue };
        let steps = from.0.abs_diff(to.0).max(from.1.abs_diff(to.1)).max(1);
        let between = |a: usize, b: usize, step: usize| (a * (steps - step) + b * step + steps / 2) / steps;
        for step in 0..=steps {
            set_dot(cells, columns, (between(from.0, to.0, step), between(from.1, to.1, step)));
        }
    }
}

fn paint_cells(cells: &[u8], theme: Theme, plot: Rect, buf: &mut Buffer) {
    let columns = usize::from(plot.width).max(1);
    for (row, line) in (0_u16..).zip(cells.chunks(columns)) {
        for (column, cell) in (0_u16..).zip(line) {
            if let Some(c) = character(*cell, theme.glyphs) {
                paint::text(buf, plot, (column, row), c.encode_utf8(&mut [0; 4]), theme.style(Role::Hint));
            }
        }
    }
}

/// The character for a pattern of dots; bit 2·row + column.
fn character(lit: u8, glyphs: Glyphs) -> Option<char> {
    /// Braille dot of each place (Unicode chapter 21.1).
    const BRAILLE: [u32; 8] = [0x01, 0x08, 0x02, 0x10, 0x04, 0x20, 0x40, 0x80];
    if lit == 0 {
        return None;
    }
    let (is_upper, is_lower) = (lit & 0x0f != 0, lit & 0xf0 != 0);
    match glyphs {
        Glyphs::Unicode => {
            let dots: u32 = BRAILLE.iter().enumerate().filter(|(bit, _)| lit >> bit & 1 == 1).map(|(_, dot)| dot).sum();
            char::from_u32(0x2800 + dots)
        }
        Glyphs::Blocks => Some(match (is_upper, is_lower) {
            (true, true) => '█',
            (true, false) => '▀',
            _ => '▄',
        }),
        Glyphs::Ascii => Some(match (is_upper, is_lower) {
            (true, true) => ':',
            (true, false) => '\'',
            _ => '.',
        }),
    }
}
