//! Names of the views of a screen, with the shown one marked.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Hint about the key.
const HINT: &str = "Tab: next view";

/// Draws the first line of `area`. The shown view is in brackets, so that no colour is needed.
pub fn tabs(theme: Theme, names: &[&str], shown: usize, area: Rect, buf: &mut Buffer) {
    let mut column = 0;
    for (index, name) in names.iter().enumerate() {
        let (text, role) =
            if index == shown { (format!("[{name}]"), Role::Focus) } else { (format!(" {name} "), Role::Plain) };
        column = paint::text(buf, area, (column, 0), &text, theme.style(role)) + 1;
    }
    let start = usize::from(area.width).saturating_sub(text::columns(HINT));
    if let Some(start) = u16::try_from(start).ok().filter(|start| *start > column) {
        paint::text(buf, area, (start, 0), HINT, theme.style(Role::Dim));
    }
}
