//! A single line of text.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::FieldOutcome;
use crate::text::{self, wrapped};
use crate::tui::keymap::Key;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// Longest text, in characters; a paste beyond it is cut.
const LONGEST: usize = 4096;

/// Reads a text: how it is understood, or what is wrong with it.
pub type Validator = fn(&str) -> Result<String, String>;

/// A single line of text with a cursor.
#[derive(Clone, Debug)]
pub struct TextField {
    label: String,
    characters: Vec<char>,
    /// Index of the character at the cursor.
    cursor: usize,
    /// Whether the text is a proposal. Typing replaces a proposal, unless the cursor was moved into it first.
    is_proposal: bool,
    check: Option<Validator>,
    /// Of a path: how a tabulator completes it.
    complete: Option<fn(&str) -> Completion>,
    /// Names that the text can be completed to, where there are several.
    names: Vec<String>,
}

/// A path as far as it is certain, and the names among which it is not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    pub text: String,
    pub names: Vec<String>,
}

impl TextField {
    /// A field with an initial text and the cursor behind it.
    pub fn new(label: impl Into<String>, text: &str) -> Self {
        let mut field = Self {
            label: label.into(),
            characters: Vec::new(),
            cursor: 0,
            is_proposal: false,
            check: None,
            complete: None,
            names: Vec::new(),
        };
        field.paste(text);
        field
    }

    /// Makes the text a path, which a tabulator completes.
    #[must_use]
    pub const fn path(mut self, complete: fn(&str) -> Completion) -> Self {
        self.complete = Some(complete);
        self
    }

    /// Whether a tabulator completes the text.
    pub const fn is_path(&self) -> bool {
        self.complete.is_some()
    }

    /// Completes a path; whether there was something to add or to choose from.
    pub fn complete(&mut self) -> bool {
        let Some(complete) = self.complete else { return false };
        let text = self.text();
        let found = complete(&text);
        let has_news = found.text != text || (found.names.len() > 1 && found.names != self.names);
        self.is_proposal = false;
        self.characters = found.text.chars().take(LONGEST).collect();
        self.cursor = self.characters.len();
        self.names = found.names;
        has_news
    }

    /// The names that the text can be completed to, in one line.
    pub fn choices(&self) -> Option<String> {
        (self.names.len() > 1).then(|| self.names.join("  "))
    }

    /// Makes the initial text a proposal, which typing replaces like a selection.
    #[must_use]
    pub const fn proposed(mut self) -> Self {
        self.is_proposal = !self.characters.is_empty();
        self
    }

    /// Adds a check that runs while the text is typed.
    #[must_use]
    pub const fn checked(mut self, check: Validator) -> Self {
        self.check = Some(check);
        self
    }

    /// The label of the field.
    pub fn label(&self) -> &str {
        &self.label
    }

    pub fn text(&self) -> String {
        self.characters.iter().collect()
    }

    /// Index of the character at the cursor.
    pub const fn cursor(&self) -> usize {
        self.cursor
    }

    pub fn clear(&mut self) {
        self.characters.clear();
        self.cursor = 0;
    }

    /// What is wrong with the text, if anything.
    pub fn problem(&self) -> Option<String> {
        self.check.and_then(|check| check(self.text().trim()).err())
    }

    /// How the text is understood, if it is read while it is typed.
    pub fn understood(&self) -> Option<String> {
        self.check.and_then(|check| check(self.text().trim()).ok())
    }

    /// Whether the text is read while it is typed.
    pub const fn is_checked(&self) -> bool {
        self.check.is_some()
    }

    /// Inserts pasted text. Line breaks and tabs become blanks, other control characters are removed.
    pub fn paste(&mut self, text: &str) {
        if std::mem::take(&mut self.is_proposal) {
            self.clear();
        }
        let blank = |c: char| if matches!(c, '\n' | '\r' | '\t') { ' ' } else { c };
        let room = LONGEST.saturating_sub(self.characters.len());
        let text = text.trim_end_matches(['\n', '\r']);
        let pasted: Vec<char> = text.chars().map(blank).filter(|c| !c.is_control()).take(room).collect();
        let count = pasted.len();
        self.characters.splice(self.cursor..self.cursor, pasted);
        self.cursor += count;
    }

    pub fn on_key(&mut self, key: Key) -> FieldOutcome {
        let was_proposal = self.is_proposal;
        let reaction = self.edited(key);
        // An operator who moves or deletes inside a proposal wants to edit it.
        self.is_proposal = was_proposal && reaction == FieldOutcome::Ignored;
        reaction
    }

    fn edited(&mut self, key: Key) -> FieldOutcome {
        match (key.code, key.has_modifier()) {
            (KeyCode::Enter, _) if self.problem().is_none() => return FieldOutcome::Submitted,
            (KeyCode::Enter, _) => {}
            (KeyCode::Esc, _) => return FieldOutcome::Cancelled,
            (KeyCode::Char('a'), true) | (KeyCode::Home, _) => self.cursor = 0,
            (KeyCode::Char('e'), true) | (KeyCode::End, _) => self.cursor = self.characters.len(),
            (KeyCode::Char('u'), true) => {
                self.characters.drain(..self.cursor);
                self.cursor = 0;
            }
            (KeyCode::Char('k'), true) => self.characters.truncate(self.cursor),
            (KeyCode::Char('w'), true) => self.delete_word(),
            (KeyCode::Char(c), false) if !c.is_control() => self.paste(&c.to_string()),
            (KeyCode::Left, _) => self.cursor = self.cursor.saturating_sub(1),
            (KeyCode::Right, _) => self.cursor = (self.cursor + 1).min(self.characters.len()),
            (KeyCode::Backspace, _) if self.cursor > 0 => {
                self.cursor -= 1;
                self.characters.remove(self.cursor);
            }
            (KeyCode::Delete, _) if self.cursor < self.characters.len() => {
                self.characters.remove(self.cursor);
            }
            (KeyCode::Tab, _) if self.complete() => return FieldOutcome::Changed,
            _ => return FieldOutcome::Ignored,
        }
        self.names.clear();
        FieldOutcome::Changed
    }

    /// Deletes the word before the cursor.
    fn delete_word(&mut self) {
        let before = self.characters.get(..self.cursor).unwrap_or_default();
        let blanks = before.iter().rev().take_while(|c| **c == ' ').count();
        let word = before.iter().rev().skip(blanks).take_while(|c| **c != ' ').count();
        let start = self.cursor.saturating_sub(blanks + word);
        self.characters.drain(start..self.cursor);
        self.cursor = start;
    }

    /// Draws the label, the text with its cursor, and the error, in three lines or more.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        paint::text(buf, area, (0, 0), &theme.glyphs.show(&self.label), theme.style(Role::Title));
        self.draw_line(theme, paint::band(area, 1, 1), buf);
        if let Some(problem) = self.problem().filter(|_| !self.characters.is_empty()) {
            let lines = wrapped(&theme.glyphs.show(&problem), usize::from(area.width));
            for (row, line) in (2..area.height).zip(&lines) {
                paint::text(buf, area, (0, row), line, theme.style(Role::Warn));
            }
        }
        if let Some(choices) = self.choices() {
            let lines = wrapped(&theme.glyphs.show(&choices), usize::from(area.width));
            for (row, line) in (2..area.height).zip(&lines) {
                paint::text(buf, area, (0, row), line, theme.style(Role::Hint));
            }
        }
        if let Some(understood) = self.understood().filter(|_| !self.characters.is_empty()) {
            paint::text(buf, area, (2, 2), &theme.glyphs.show(&understood), theme.style(Role::Ok));
        }
    }

    /// Draws the text alone. The cursor is always in view.
    pub fn draw_line(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let lead = theme.glyphs.pointer();
        let start = paint::text(buf, area, (0, 0), lead, theme.style(Role::Hint));
        let room = usize::from(area.width.saturating_sub(start));
        if room == 0 {
            return;
        }
        let shown = |range: &[char]| theme.glyphs.show(&range.iter().collect::<String>());
        let mut first = 0;
        while text::columns(&shown(self.characters.get(first..self.cursor).unwrap_or_default())) >= room {
            first += 1;
        }
        let before = shown(self.characters.get(first..self.cursor).unwrap_or_default());
        let at = self.characters.get(self.cursor).map_or_else(|| " ".to_owned(), |c| shown(&[*c]));
        let after = shown(self.characters.get(self.cursor + 1..).unwrap_or_default());
        // A proposal looks selected.
        let role = if self.is_proposal { Role::Focus } else { Role::Plain };
        let column = paint::text(buf, area, (start, 0), &before, theme.style(role));
        let column = paint::text(buf, area, (column, 0), &at, theme.style(Role::Focus));
        paint::text(buf, area, (column, 0), &after, theme.style(Role::Plain));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(field: &mut TextField, keys: &[KeyCode]) {
        for code in keys {
            field.on_key(Key::plain_code(*code));
        }
    }

    #[test]
    fn typing_moving_and_deleting() {
        let mut field = TextField::new("note", "SMR");
        typed(&mut field, &[KeyCode::Home, KeyCode::Char('ü'), KeyCode::Right, KeyCode::Delete, KeyCode::End]);
        typed(&mut field, &[KeyCode::Char('漢'), KeyCode::Left, KeyCode::Backspace]);
        assert_eq!((field.text().as_str(), field.cursor()), ("üS漢", 2));
        field.paste("a\r\nb\u{7}\tc\n");
        assert_eq!(field.text(), "üSa  b c漢");
        field.on_key(Key::ctrl('w'));
        assert_eq!(field.text(), "üSa  b 漢");
        field.on_key(Key::ctrl('u'));
        field.on_key(Key::ctrl('k'));
        assert_eq!(field.text(), "");
    }

    #[test]
    fn typing_takes_the_place_of_a_proposal() {
        let proposed = || TextField::new("file", "plan.csv").proposed();
        let mut field = proposed();
        typed(&mut field, &[KeyCode::F(5), KeyCode::Char('a'), KeyCode::Char('b')]);
        assert_eq!(field.text(), "ab");
        let mut field = proposed();
        field.paste("other.csv");
        assert_eq!(field.text(), "other.csv");
        // Once the cursor has moved, or something was deleted, it is a text like any other.
        let mut field = proposed();
        typed(&mut field, &[KeyCode::Home, KeyCode::Char('a'), KeyCode::End, KeyCode::Backspace]);
        assert_eq!(field.text(), "aplan.cs");
        let mut field = proposed();
        assert_eq!(field.on_key(Key::plain_code(KeyCode::Enter)), FieldOutcome::Submitted);
        assert_eq!(field.text(), "plan.csv");
    }

    #[test]
    fn a_wrong_text_is_not_accepted() {
        let check: Validator =
            |text| if text.is_empty() { Err("write something".to_owned()) } else { Ok(text.to_uppercase()) };
        let mut field = TextField::new("note", "").checked(check);
        assert_eq!(field.on_key(Key::plain_code(KeyCode::Enter)), FieldOutcome::Changed);
        assert_eq!(field.problem().as_deref(), Some("write something"));
        typed(&mut field, &[KeyCode::Char('x')]);
        assert_eq!(field.understood().as_deref(), Some("X"));
        assert_eq!(field.on_key(Key::plain_code(KeyCode::Enter)), FieldOutcome::Submitted);
        assert_eq!(field.on_key(Key::plain_code(KeyCode::Esc)), FieldOutcome::Cancelled);
    }

    #[test]
    fn a_tabulator_completes_a_path_and_then_lists_what_is_possible() {
        let folder = |begun: &str| match begun {
            "pl" => Completion { text: "plan".to_owned(), names: vec!["plan.csv".to_owned(), "plan2.csv".to_owned()] },
            other => Completion { text: other.to_owned(), names: vec!["plan.csv".to_owned(), "plan2.csv".to_owned()] },
        };
        let mut field = TextField::new("file", "pl").path(folder);
        let tab = Key::plain_code(KeyCode::Tab);
        assert_eq!((field.on_key(tab), field.text().as_str()), (FieldOutcome::Changed, "plan"));
        assert_eq!(field.choices().as_deref(), Some("plan.csv  plan2.csv"));
        // Nothing new: a form goes to its next field.
        assert_eq!(field.on_key(tab), FieldOutcome::Ignored);
        typed(&mut field, &[KeyCode::Char('2')]);
        assert_eq!((field.text().as_str(), field.choices()), ("plan2", None));
        assert_eq!(TextField::new("note", "pl").on_key(tab), FieldOutcome::Ignored);
    }

    #[test]
    fn the_cursor_stays_in_view_at_any_width() {
        let field = TextField::new("note", "a long text that does not fit 漢字");
        for columns in 0..20 {
            let mut buffer = Buffer::empty(Rect::new(0, 0, columns, 3));
            field.draw(Theme::default(), buffer.area, &mut buffer);
            let has_cursor =
                buffer.content.iter().any(|cell| cell.modifier.contains(ratatui::style::Modifier::REVERSED));
            assert_eq!(has_cursor, columns > 2, "{columns}");
        }
    }
}
