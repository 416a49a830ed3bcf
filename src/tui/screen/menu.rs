//! A short menu: each entry has a sentence that says when to choose it.

use crossterm::event::KeyCode;

use super::page::Page;
use crate::tui::keymap::Key;
use crate::tui::theme::Role;

/// Position of the focus in a menu; `None` if the operator has not moved it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Menu {
    pub(super) at: Option<usize>,
}

impl Menu {
    /// Handles a key in a menu of `count` entries. Returns `false` if it is not a menu key.
    pub(super) fn on_key(&mut self, key: Key, count: usize) -> bool {
        let now = self.at.unwrap_or(0);
        let last = count.saturating_sub(1);
        self.at = Some(match key.code {
            KeyCode::Up => now.saturating_sub(1),
            KeyCode::Down => (now + 1).min(last),
            _ => return false,
        });
        true
    }

    /// Writes the entries, each with its explanation below. If `has_focus`, Enter chooses the focused entry.
    pub(super) fn write(self, page: &mut Page, pointer: &str, entries: &[(&str, &str)], has_focus: bool) {
        for (index, (title, about)) in entries.iter().enumerate() {
            let has_focus = has_focus && index == self.at.unwrap_or(0);
            let lead = if has_focus { pointer } else { "  " };
            let role = if has_focus { Role::Focus } else { Role::Title };
            let first = page.len();
            page.line(vec![(lead.to_owned(), Role::Hint), ((*title).to_owned(), role)]);
            page.marked(("    ", Role::Dim), about, Role::Dim);
            if has_focus && self.at.is_some() {
                page.keep_from(first);
            }
        }
    }
}
