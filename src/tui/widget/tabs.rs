//! Names of the views of a screen, with the shown one marked.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Hint about the key.
const HINT: &str = "Tab: next view";

/// The views of a screen.
pub trait TabView: Copy + PartialEq + 'static {
    /// All views in their order, with their names.
    const ALL: &'static [(Self, &'static str)];

    fn index(self) -> usize {
        Self::ALL.iter().position(|(tab, _)| *tab == self).unwrap_or(0)
    }

    /// The view `by` places further on, and its name.
    fn turned(self, by: usize) -> (Self, &'static str) {
        Self::ALL.get((self.index() + by) % Self::ALL.len().max(1)).copied().unwrap_or((self, "other view"))
    }

    /// Handles a key. Returns `false` if it is not a key for another view.
    fn on_key(&mut self, code: KeyCode) -> bool {
        *self = match code {
            KeyCode::Tab => self.turned(1).0,
            KeyCode::BackTab => self.turned(Self::ALL.len().saturating_sub(1)).0,
            _ => return false,
        };
        true
    }
}

/// Draws the first line of `area`. The shown view is in brackets, so that no colour is needed.
pub fn draw_tabs<T: TabView>(theme: Theme, shown: T, area: Rect, buf: &mut Buffer) {
    let mut column = 0;
    for (tab, name) in T::ALL {
        let (text, role) =
            if *tab == shown { (format!("[{name}]"), Role::Focus) } else { (format!(" {name} "), Role::Plain) };
        column = paint::text(buf, area, (column, 0), &text, theme.style(role)) + 1;
    }
    let start = usize::from(area.width).saturating_sub(text::columns(HINT));
    if let Some(start) = u16::try_from(start).ok().filter(|start| *start > column) {
        paint::text(buf, area, (start, 0), HINT, theme.style(Role::Dim));
    }
}
