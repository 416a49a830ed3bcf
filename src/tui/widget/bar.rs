//! A progress bar.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Columns of the percentage after the bar.
const NUMBER: u16 = 6;

/// Draws the first line of `area` as a bar with its percentage. `part` is clamped to 0 … 1.
pub fn bar(theme: Theme, part: f64, area: Rect, buf: &mut Buffer) {
    let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
    let columns = area.width.saturating_sub(NUMBER);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the number of columns")]
    let done = (part * f64::from(columns)).round() as u16;
    let glyphs = theme.glyphs;
    let column = paint::text(buf, area, (0, 0), &glyphs.bar_done().repeat(done.into()), theme.style(Role::Ok));
    let left = columns.saturating_sub(done);
    let column = paint::text(buf, area, (column, 0), &glyphs.bar_left().repeat(left.into()), theme.style(Role::Dim));
    // 100 % only when everything is done.
    let percent = if part < 1.0 { (100.0 * part).floor() } else { 100.0 };
    paint::text(buf, area, (column, 0), &format!(" {percent:3.0} %"), theme.style(Role::Plain));
}
