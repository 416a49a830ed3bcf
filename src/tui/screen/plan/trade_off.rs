//! Number of poses against predicted error and time.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::figures::time;
use crate::session::plan_summary::TradeOffSummary;
use crate::tui::glyphs::shortened;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::{Chart, Column, Table};
use crate::wizard::view::PlanView;

/// Columns of the table.
const TABLE: u16 = 38;
/// Said where there is nothing to draw.
const NOTHING: &str = "The trade-off is known when poses have been chosen (Enter or p).";

/// Rows of the table.
pub(super) fn count(content: &PlanView) -> usize {
    options(content).len()
}

fn options(content: &PlanView) -> &[TradeOffSummary] {
    content.summary.as_deref().map_or(&[], |summary| &summary.trade_off)
}

/// Points in mm where the instrument is known, else in σ; with the unit.
fn points(options: &[TradeOffSummary]) -> (Vec<(f64, f64)>, bool) {
    let has_mm = options.iter().all(|option| option.predicted_rms_mm.is_some());
    let error = |option: &TradeOffSummary| option.predicted_rms_mm.unwrap_or(option.predicted_error_sigma);
    let error = |option: &TradeOffSummary| if has_mm { error(option) } else { option.predicted_error_sigma };
    (options.iter().map(|option| (option.poses as f64, error(option))).collect(), has_mm)
}

fn nearest(options: &[TradeOffSummary], poses: usize) -> Option<usize> {
    options.iter().enumerate().min_by_key(|(_, option)| option.poses.abs_diff(poses)).map(|(index, _)| index)
}

fn chart(theme: Theme, options: &[TradeOffSummary], poses: usize, area: Rect, buf: &mut Buffer) {
    let (points, has_mm) = points(options);
    let chart = Chart {
        points: &points,
        level: None,
        mark: Some(poses as f64),
        y_title: if has_mm { "predicted error (mm)" } else { "predicted error (sigma)" },
        x_title: "poses to identify",
        digits: if has_mm { 4 } else { 3 },
    };
    chart.draw(theme, area, buf);
}

/// An option in words.
fn in_words(option: &TradeOffSummary) -> String {
    let error = option
        .predicted_rms_mm
        .map_or_else(|| format!("{:.3} sigma", option.predicted_error_sigma), |mm| format!("{mm:.4} mm"));
    let cost = option.time_min.map_or_else(String::new, |minutes| format!(" in {}", time(minutes)));
    format!("{} poses: {error}{cost}", option.poses)
}

/// Draws the line with the present number of poses marked, and its neighbours in words.
pub(super) fn draw_in_short(theme: Theme, content: &PlanView, poses: usize, area: Rect, buf: &mut Buffer) {
    let options = options(content);
    let Some(index) = nearest(options, poses) else { return };
    let near: Vec<String> = [index.checked_sub(1), Some(index), Some(index + 1)]
        .into_iter()
        .flatten()
        .filter_map(|place| Some((place, options.get(place)?)))
        .map(|(place, option)| {
            let lead = if place == index { theme.glyphs.next() } else { "" };
            format!("{lead}{}", in_words(option))
        })
        .collect();
    let line = shortened(&near.join(theme.glyphs.dot()), usize::from(area.width), theme.glyphs);
    paint::text(buf, area, (0, 0), &theme.glyphs.show(&line), theme.style(Role::Title));
    chart(theme, options, poses, paint::band(area, 1, area.height), buf);
}

/// Draws table and line.
pub(super) fn draw(theme: Theme, content: &PlanView, poses: usize, scroll: usize, area: Rect, buf: &mut Buffer) {
    let options = options(content);
    if options.is_empty() {
        paint::text(buf, area, (0, 0), NOTHING, theme.style(Role::Hint));
        return;
    }
    let current = nearest(options, poses);
    let (points, has_mm) = points(options);
    let error = if has_mm { "error (mm)" } else { "error (sigma)" };
    let columns =
        [Column::text("", 1), Column::number("poses", 5), Column::number(error, 13), Column::number("time (min)", 10)];
    let digits = if has_mm { 4 } else { 3 };
    let rows: Vec<(Role, Vec<String>)> = options
        .iter()
        .zip(&points)
        .enumerate()
        .map(|(index, (option, (_, error)))| {
            let is_current = Some(index) == current;
            let lead = if is_current { theme.glyphs.next() } else { "" };
            let minutes = option.time_min.map_or_else(String::new, |minutes| format!("{minutes:.0}"));
            let cells = vec![lead.to_owned(), option.poses.to_string(), format!("{error:.digits$}"), minutes];
            (if is_current { Role::Title } else { Role::Plain }, cells)
        })
        .collect();
    let table = Rect { width: TABLE.min(area.width), ..area };
    Table { columns: &columns, rows: &rows, selected: None, first: scroll }.draw(theme, table, buf);
    let left = (TABLE + 2).min(area.width);
    chart(theme, options, poses, Rect { x: area.x + left, width: area.width - left, ..area }, buf);
}
