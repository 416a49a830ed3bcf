//! The help page: every key of the screen, with the reason if it is blocked.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::keymap::KeyHint;
use super::paint;
use super::preview;
use super::theme::{Role, Theme};
use crate::text::wrapped;

/// Columns for the names of keys.
const KEYS: u16 = 11;

/// Lines of the page: key, text, role.
fn lines(items: &[KeyHint], has_picture_keys: bool, theme: Theme, columns: usize) -> Vec<(String, String, Role)> {
    let mut lines = Vec::new();
    for item in items {
        let (text, role) = match &item.blocked {
            Some(reason) => (format!("{} (not now: {reason})", item.label), Role::Dim),
            None => (item.label.clone(), Role::Plain),
        };
        let wrapped = wrapped(&theme.glyphs.show(&text), columns.saturating_sub(KEYS.into()));
        let keys = std::iter::once(item.key.clone()).chain(std::iter::repeat(String::new()));
        lines.extend(wrapped.into_iter().zip(keys).map(|(text, key)| (key, text, role)));
    }
    if !has_picture_keys {
        return lines;
    }
    lines.push((String::new(), String::new(), Role::Plain));
    lines.push((String::new(), "robot picture".to_owned(), Role::Title));
    for (key, label) in preview::KEYS {
        lines.push((key.name(theme.glyphs), label.to_owned(), Role::Plain));
    }
    lines
}

/// Draws the page of a screen of the wizard from line `scroll` on. Returns the largest possible scroll.
pub(super) fn draw(items: &[KeyHint], scroll: usize, theme: Theme, area: Rect, buf: &mut Buffer) -> usize {
    draw_lines(&lines(items, true, theme, area.width.into()), scroll, theme, area, buf)
}

/// Draws the keys alone.
pub(super) fn draw_keys(items: &[KeyHint], theme: Theme, area: Rect, buf: &mut Buffer) {
    draw_lines(&lines(items, false, theme, area.width.into()), 0, theme, area, buf);
}

fn draw_lines(lines: &[(String, String, Role)], scroll: usize, theme: Theme, area: Rect, buf: &mut Buffer) -> usize {
    let last = lines.len().saturating_sub(area.height.into());
    for (row, (key, text, role)) in (0..area.height).zip(lines.iter().skip(scroll.min(last))) {
        paint::text(buf, area, (0, row), key, theme.style(Role::Title));
        paint::text(buf, area, (KEYS, row), text, theme.style(*role));
    }
    last
}
