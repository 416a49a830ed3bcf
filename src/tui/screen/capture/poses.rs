//! All poses with their states.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::{Column, Table};
use crate::wizard::view::{CaptureView, RowState};

const COLUMNS: [Column<'static>; 3] = [Column::text("pose", 10), Column::text("for", 15), Column::text("state", 14)];

/// Draws the list with the focus on row `selected`.
pub(super) fn draw(theme: Theme, content: &CaptureView, selected: usize, area: Rect, buf: &mut Buffer) {
    if content.rows.is_empty() {
        paint::text(buf, area, (0, 1), "The plan has no poses: go back to the plan step.", theme.style(Role::Hint));
        return;
    }
    let rows: Vec<(Role, Vec<String>)> = content
        .rows
        .iter()
        .map(|row| {
            let is_shown = Some(row.row) == content.row;
            let is_asked = content.finding.as_ref().is_some_and(|finding| finding.pose == row.pose)
                && row.state == RowState::Measured;
            let (role, word) = match row.state {
                RowState::Measured if is_asked => (Role::Warn, format!("{} in question", theme.glyphs.doubt())),
                RowState::Measured => (Role::Ok, "done".to_owned()),
                RowState::Open if is_shown => (Role::Title, format!("{} next", theme.glyphs.next())),
                RowState::Open => (Role::Plain, "open".to_owned()),
                RowState::Skipped => (Role::Dim, "skipped".to_owned()),
                RowState::LeftOut => (Role::Warn, "excluded".to_owned()),
            };
            (role, vec![row.pose.clone(), row.kind.name().to_owned(), word])
        })
        .collect();
    Table { columns: &COLUMNS, rows: &rows, selected: Some(selected), first: 0 }.draw(theme, area, buf);
}
