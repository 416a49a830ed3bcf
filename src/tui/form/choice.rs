//! A choice from a list. Typing narrows the list.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{FieldOutcome, TextField};
use crate::tui::glyphs::shortened;
use crate::tui::keymap::Key;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Rows that PageUp and PageDown pass over.
const PAGE: usize = 10;

/// A list to choose from.
#[derive(Clone, Debug)]
pub struct ChoiceList {
    label: String,
    choices: Vec<String>,
    filter: TextField,
    /// Position among the choices that match the filter.
    selected: usize,
}

impl ChoiceList {
    /// A list with the focus on the choice `selected`.
    pub fn new(label: impl Into<String>, choices: Vec<String>, selected: usize) -> Self {
        Self { label: label.into(), choices, filter: TextField::new("", ""), selected }
    }

    /// Indices of the choices that contain every typed word, ignoring case.
    pub fn matching(&self) -> Vec<usize> {
        let wanted = self.filter.text().to_lowercase();
        let fits = |choice: &String| {
            let choice = choice.to_lowercase();
            wanted.split_whitespace().all(|word| choice.contains(word))
        };
        self.choices.iter().enumerate().filter(|(_, choice)| fits(choice)).map(|(index, _)| index).collect()
    }

    /// Index of the focused choice in the whole list.
    pub fn selected(&self) -> Option<usize> {
        let matching = self.matching();
        matching.get(self.selected).or_else(|| matching.last()).copied()
    }

    /// The numbered choices as a question, for plain lines.
    pub fn question(&self) -> Vec<String> {
        let choices = self.choices.iter().zip(1..).map(|(choice, number): (_, usize)| format!("{number:5}  {choice}"));
        let last = format!("number [{}]", self.selected + 1);
        [self.label.clone()].into_iter().chain(choices).chain([last]).collect()
    }

    /// Chooses by a number or by the beginning of a choice, for plain lines.
    ///
    /// # Errors
    /// No choice, or several, are meant.
    pub fn answer(&mut self, line: &str) -> Result<(), String> {
        if line.is_empty() {
            return Ok(());
        }
        let by_number = line.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let by_name = || {
            let exact = self.choices.iter().position(|choice| choice == line);
            let mut beginning = self.choices.iter().enumerate().filter(|(_, choice)| choice.starts_with(line));
            exact.or_else(|| match (beginning.next(), beginning.next()) {
                (Some((index, _)), None) => Some(index),
                _ => None,
            })
        };
        let chosen = by_number.filter(|index| *index < self.choices.len()).or_else(by_name);
        self.selected = chosen.ok_or_else(|| format!("'{line}' is none of the choices: answer with a number"))?;
        Ok(())
    }

    pub fn on_key(&mut self, key: Key) -> FieldOutcome {
        let last = self.matching().len().saturating_sub(1);
        let now = self.selected.min(last);
        self.selected = match key.code {
            KeyCode::Enter => {
                return if self.selected().is_some() { FieldOutcome::Submitted } else { FieldOutcome::Changed };
            }
            KeyCode::Up => now.saturating_sub(1),
            KeyCode::Down => (now + 1).min(last),
            KeyCode::PageUp => now.saturating_sub(PAGE),
            KeyCode::PageDown => (now + PAGE).min(last),
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => {
                let before = self.filter.text();
                let reaction = self.filter.on_key(key);
                if self.filter.text() != before {
                    self.selected = 0;
                }
                return reaction;
            }
        };
        FieldOutcome::Changed
    }

    /// Narrows the list by pasted text.
    pub fn paste(&mut self, text: &str) {
        self.filter.paste(text);
        self.selected = 0;
    }

    /// Draws label and filter, then as much of the list around the focus as fits.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let glyphs = theme.glyphs;
        let matching = self.matching();
        let typed = self.filter.text();
        let column = paint::text(buf, area, (0, 0), &glyphs.show(&self.label), theme.style(Role::Title));
        let found = match typed.as_str() {
            "" => " (type to search)".to_owned(),
            _ => format!(" '{typed}': {} of {}", matching.len(), self.choices.len()),
        };
        paint::text(buf, area, (column, 0), &glyphs.show(&found), theme.style(Role::Dim));
        let list = paint::band(area, 1, area.height);
        let rows = usize::from(list.height);
        let selected = self.selected.min(matching.len().saturating_sub(1));
        let first = (selected + 1).saturating_sub(rows).max(selected.saturating_sub(rows / 2));
        let first = first.min(matching.len().saturating_sub(rows));
        for (row, (place, index)) in (0_u16..).zip(matching.iter().enumerate().skip(first).take(rows)) {
            let Some(choice) = self.choices.get(*index) else { continue };
            let is_selected = place == selected;
            let lead = if is_selected { glyphs.pointer() } else { "  " };
            let style = theme.style(if is_selected { Role::Focus } else { Role::Plain });
            let column = paint::text(buf, list, (0, row), lead, theme.style(Role::Hint));
            let room = usize::from(list.width.saturating_sub(column));
            paint::text(buf, list, (column, row), &shortened(&glyphs.show(choice), room, glyphs), style);
        }
        if matching.is_empty() {
            paint::text(buf, list, (0, 0), "no match; Backspace widens the search", theme.style(Role::Warn));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robots() -> ChoiceList {
        let names = ["abb_irb120", "kuka_kr6_r900", "ur10e", "ur5e"];
        ChoiceList::new("robot", names.map(str::to_owned).to_vec(), 1)
    }

    #[test]
    fn typing_narrows_and_enter_takes() {
        let mut list = robots();
        assert_eq!(list.selected(), Some(1));
        for c in "UR e".chars() {
            list.on_key(Key::char(c));
        }
        assert_eq!((list.matching(), list.selected()), (vec![2, 3], Some(2)));
        list.on_key(Key::plain_code(KeyCode::Down));
        list.on_key(Key::plain_code(KeyCode::Down));
        assert_eq!(list.selected(), Some(3));
        assert_eq!(list.on_key(Key::plain_code(KeyCode::Enter)), FieldOutcome::Submitted);
        list.paste("zzz");
        assert_eq!((list.selected(), list.on_key(Key::plain_code(KeyCode::Enter))), (None, FieldOutcome::Changed));
    }

    #[test]
    fn the_focus_is_drawn_at_any_height() {
        let mut list = robots();
        list.on_key(Key::plain_code(KeyCode::End));
        for height in 2..6 {
            let mut buffer = Buffer::empty(Rect::new(0, 0, 20, height));
            list.draw(Theme::default(), buffer.area, &mut buffer);
            assert!(paint::snapshot(&buffer).contains("▸ ur5e"), "{height}");
        }
    }
}
