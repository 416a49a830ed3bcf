//! A table with titles and an optional focused row.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text;
use crate::tui::glyphs::shortened;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Columns between two columns of the table.
const GAP: u16 = 2;

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub struct Column<'a> {
    /// Its title, with the unit.
    pub title: &'a str,
    /// Width in columns of the terminal.
    pub width: u16,
    /// Whether the cells are right-aligned.
    pub is_right: bool,
}

impl<'a> Column<'a> {
    /// A column of text.
    pub const fn text(title: &'a str, width: u16) -> Self {
        Self { title, width, is_right: false }
    }

    /// A column of numbers.
    pub const fn number(title: &'a str, width: u16) -> Self {
        Self { title, width, is_right: true }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// Columns from left to right.
    pub columns: &'a [Column<'a>],
    /// Rows with their roles. A row may have fewer cells than there are columns.
    pub rows: &'a [(Role, Vec<String>)],
    /// The focused row, which is always in view.
    pub selected: Option<usize>,
    /// First row shown if none has the focus.
    pub first: usize,
}

impl Table<'_> {
    /// Draws the titles and as many rows as fit.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let titles: Vec<&str> = self.columns.iter().map(|column| column.title).collect();
        self.line(theme, &titles, Role::Title, false, paint::band(area, 0, 1), buf);
        let body = paint::band(area, 1, area.height);
        let room = usize::from(body.height);
        let last_first = self.rows.len().saturating_sub(room);
        let first = match self.selected {
            Some(selected) => (selected + 1).saturating_sub(room).max(selected.saturating_sub(room / 2)),
            None => self.first,
        };
        let first = first.min(last_first);
        for (row, (index, (role, cells))) in (0_u16..).zip(self.rows.iter().enumerate().skip(first).take(room)) {
            let cells: Vec<&str> = cells.iter().map(String::as_str).collect();
            self.line(theme, &cells, *role, self.selected == Some(index), paint::band(body, row, 1), buf);
        }
        let below = self.rows.len().saturating_sub(first + room);
        if below > 0 && room > 0 {
            let said = format!(" {below} more below ");
            let column = usize::from(body.width).saturating_sub(text::columns(&said));
            let at = (u16::try_from(column).unwrap_or(0), body.height - 1);
            paint::text(buf, body, at, &said, theme.style(Role::Dim));
        }
    }

    fn line(&self, theme: Theme, cells: &[&str], role: Role, has_focus: bool, area: Rect, buf: &mut Buffer) {
        let glyphs = theme.glyphs;
        let lead = if has_focus { glyphs.pointer() } else { "  " };
        let mut column =
            if self.selected.is_some() { paint::text(buf, area, (0, 0), lead, theme.style(Role::Hint)) } else { 0 };
        let style = theme.style(if has_focus { Role::Focus } else { role });
        for (place, cell) in self.columns.iter().zip(cells) {
            let room = usize::from(place.width);
            let text = shortened(&glyphs.show(cell), room, glyphs);
            let missing = " ".repeat(room.saturating_sub(text::columns(&text)));
            let text = if place.is_right { missing + &text } else { text + &missing };
            paint::text(buf, area, (column, 0), &text, style);
            column = column.saturating_add(place.width + GAP);
        }
    }
}
