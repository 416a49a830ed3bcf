//! Trade-off of the number of poses against predicted error and time.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::figures::time;
use crate::session::plan_summary::TradeOffSummary;
use crate::text;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::{Chart, Column, Table};
use crate::wizard::view::PlanView;

/// Columns of the table.
const TABLE: u16 = 40;
/// Text if there is nothing to draw.
const NOTHING: &str = "The trade-off is known once poses have been chosen (Enter or p).";

/// The number of poses of the next larger or smaller option.
pub(super) fn next(content: &PlanView, poses: usize, is_more: bool) -> Option<usize> {
    let mut numbers = options(content).iter().map(|option| option.poses);
    if is_more { numbers.find(|number| *number > poses) } else { numbers.rfind(|number| *number < poses) }
}

fn options(content: &PlanView) -> &[TradeOffSummary] {
    content.summary.as_deref().map_or(&[], |summary| &summary.trade_off)
}

/// The points, and whether they are in mm (if the instrument is known) instead of σ.
fn points(options: &[TradeOffSummary]) -> (Vec<(f64, f64)>, bool) {
    let has_mm = options.iter().all(|option| option.predicted_rms_mm.is_some());
    let error =
        |option: &TradeOffSummary| option.predicted_rms_mm.filter(|_| has_mm).unwrap_or(option.predicted_error_sigma);
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
        limit: None,
        end: None,
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

/// Draws the curve with the current number of poses marked, and its neighbours in words.
pub(super) fn draw_in_short(theme: Theme, content: &PlanView, poses: usize, area: Rect, buf: &mut Buffer) {
    let options = options(content);
    let Some(index) = nearest(options, poses) else { return };
    let room = usize::from(area.width);
    let exact = options.get(index).is_some_and(|option| option.poses == poses);
    // The next larger option is of most interest; the next smaller one follows if there is room.
    let above = options.iter().find(|option| option.poses > poses);
    let below = options.iter().rfind(|option| option.poses < poses);
    let here = options.get(index).filter(|_| exact);
    let mut line = here.map_or_else(String::new, |option| format!("{} {}", theme.glyphs.next(), in_words(option)));
    for option in [above, below].into_iter().flatten() {
        let dot = if line.is_empty() { "" } else { theme.glyphs.dot() };
        let longer = format!("{line}{dot}{}", in_words(option));
        if text::columns(&longer) <= room {
            line = longer;
        }
    }
    paint::text(buf, area, (0, 0), &line, theme.style(Role::Title));
    chart(theme, options, poses, paint::band(area, 1, area.height), buf);
}

/// Draws table and curve.
pub(super) fn draw(theme: Theme, content: &PlanView, poses: usize, area: Rect, buf: &mut Buffer) {
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
    Table { columns: &columns, rows: &rows, selected: current, first: 0 }.draw(theme, table, buf);
    let left = (TABLE + 2).min(area.width);
    chart(theme, options, poses, Rect { x: area.x + left, width: area.width - left, ..area }, buf);
}
