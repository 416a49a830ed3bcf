//! A form: several fields that together make an intent.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::plain::{replace, with_value};
use crate::text::{alternatives, wrapped};
use crate::tui::form::{FieldOutcome, TextField};
use crate::tui::keymap::Key;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::Intent;

const LABELS: u16 = 24;

/// Builds the intent from the values of the fields, or says what is wrong with them.
pub type Build = fn(&[String]) -> Result<Intent, String>;

/// Several fields, one line each.
#[derive(Clone, Debug)]
pub struct Form {
    title: String,
    fields: Vec<Field>,
    focus: usize,
    build: Build,
    /// Whether the operator has tried to submit the form. From then on errors are shown.
    is_tried: bool,
}

/// A field with an explanation.
#[derive(Clone, Debug)]
struct Field {
    label: &'static str,
    about: &'static str,
    value: Value,
}

#[derive(Clone, Debug)]
enum Value {
    Text(TextField),
    Pick { options: &'static [&'static str], at: usize },
}

impl Value {
    fn text(&self) -> String {
        match self {
            Self::Text(field) => field.text().trim().to_owned(),
            Self::Pick { options, at } => options.get(*at).copied().unwrap_or_default().to_owned(),
        }
    }
}

/// Rows below the fields: a blank one, the explanation, what is wrong.
const EXPLANATION: u16 = 4;

impl Form {
    pub fn new(title: impl Into<String>, build: Build) -> Self {
        Self { title: title.into(), fields: Vec::new(), focus: 0, build, is_tried: false }
    }

    /// Adds a line of text.
    #[must_use]
    pub fn text(mut self, label: &'static str, value: &str, about: &'static str) -> Self {
        self.fields.push(Field { label, about, value: Value::Text(TextField::new(label, value)) });
        self
    }

    /// Adds a choice of words.
    #[must_use]
    pub fn pick(
        mut self,
        label: &'static str,
        options: &'static [&'static str],
        at: usize,
        about: &'static str,
    ) -> Self {
        self.fields.push(Field { label, about, value: Value::Pick { options, at } });
        self
    }

    /// The intent, or what is wrong.
    ///
    /// # Errors
    /// A field is invalid.
    pub fn value(&self) -> Result<Intent, String> {
        let values: Vec<String> = self.fields.iter().map(|field| field.value.text()).collect();
        (self.build)(&values)
    }

    /// The question of a field, for plain lines.
    pub(super) fn question(&self, number: usize) -> Option<Vec<String>> {
        let field = self.fields.get(number)?;
        let title = (number == 0).then(|| self.title.clone());
        let about = [format!("  {}", field.about)];
        let asked = match &field.value {
            Value::Text(text) => with_value(field.label, &text.text()),
            Value::Pick { options, at } => {
                format!("{}: {} [{}]", field.label, alternatives(options), options.get(*at).unwrap_or(&""))
            }
        };
        Some(title.into_iter().chain(about).chain([asked]).collect())
    }

    /// Answers the question of a field, for plain lines.
    pub(super) fn answer(&mut self, number: usize, line: &str) -> Result<(), String> {
        match self.fields.get_mut(number).map(|field| &mut field.value) {
            Some(Value::Text(field)) => replace(field, line),
            Some(Value::Pick { options, at }) if !line.is_empty() => {
                *at = options
                    .iter()
                    .position(|option| option.eq_ignore_ascii_case(line))
                    .ok_or_else(|| format!("'{line}' is not one of {}", alternatives(options)))?;
            }
            Some(Value::Pick { .. }) | None => {}
        }
        Ok(())
    }

    pub fn on_key(&mut self, key: Key) -> FieldOutcome {
        let count = self.fields.len().max(1);
        match key.code {
            KeyCode::Enter => {
                self.is_tried = true;
                return if self.value().is_ok() { FieldOutcome::Submitted } else { FieldOutcome::Changed };
            }
            KeyCode::Esc => return FieldOutcome::Cancelled,
            KeyCode::Tab | KeyCode::Down => self.focus = (self.focus + 1) % count,
            KeyCode::BackTab | KeyCode::Up => self.focus = (self.focus + count - 1) % count,
            _ => {
                return match self.fields.get_mut(self.focus).map(|field| &mut field.value) {
                    Some(Value::Text(field)) => field.on_key(key),
                    Some(Value::Pick { options, at }) => picked(options.len().max(1), at, key),
                    None => FieldOutcome::Ignored,
                };
            }
        }
        FieldOutcome::Changed
    }

    /// Inserts pasted text into the focused field.
    pub fn paste(&mut self, text: &str) {
        if let Some(Value::Text(field)) = self.fields.get_mut(self.focus).map(|field| &mut field.value) {
            field.paste(text);
        }
    }

    /// Draws title, fields, the explanation of the focused field, and the error.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        paint::text(buf, area, (0, 0), &theme.glyphs.show(&self.title), theme.style(Role::Title));
        let mut row = 2;
        // On a low screen the fields around the focused one are shown.
        let room = usize::from(area.height.saturating_sub(2 + EXPLANATION)).max(1);
        let first = (self.focus + 1).saturating_sub(room);
        for (index, field) in self.fields.iter().enumerate().skip(first).take(room) {
            let has_focus = index == self.focus;
            let role = if has_focus { Role::Title } else { Role::Dim };
            paint::text(buf, area, (0, row), field.label, theme.style(role));
            let column = LABELS.min(area.width);
            let place = paint::band(Rect { x: area.x + column, width: area.width - column, ..area }, row, 1);
            match &field.value {
                Value::Text(text) if has_focus => text.draw_line(theme, place, buf),
                Value::Text(text) => {
                    paint::text(buf, place, (2, 0), &theme.glyphs.show(&text.text()), theme.style(Role::Plain));
                }
                Value::Pick { options, at } => {
                    let width: usize = options.iter().map(|option| option.chars().count() + 3).sum();
                    if width + 1 > usize::from(place.width) {
                        let shown = format!("[{}]  {} of {}", options.get(*at).unwrap_or(&""), at + 1, options.len());
                        let role = if has_focus { Role::Focus } else { Role::Plain };
                        paint::text(buf, place, (2, 0), &theme.glyphs.show(&shown), theme.style(role));
                        row += 1;
                        continue;
                    }
                    let mut column = 2;
                    for (number, option) in options.iter().enumerate() {
                        let is_chosen = number == *at;
                        let shown = if is_chosen { format!("[{option}]") } else { format!(" {option} ") };
                        let role = match (is_chosen, has_focus) {
                            (true, true) => Role::Focus,
                            (true, false) => Role::Plain,
                            (false, _) => Role::Dim,
                        };
                        column = paint::text(buf, place, (column, 0), &shown, theme.style(role)) + 1;
                    }
                }
            }
            row += 1;
        }
        row += 1;
        let columns = usize::from(area.width);
        let about = self.fields.get(self.focus).map_or("", |field| field.about);
        for line in wrapped(&theme.glyphs.show(about), columns) {
            paint::text(buf, area, (0, row), &line, theme.style(Role::Hint));
            row += 1;
        }
        if let (true, Err(problem)) = (self.is_tried, self.value()) {
            for line in wrapped(&theme.glyphs.show(&format!("not yet: {problem}")), columns) {
                paint::text(buf, area, (0, row), &line, theme.style(Role::Warn));
                row += 1;
            }
        }
    }
}

fn picked(count: usize, at: &mut usize, key: Key) -> FieldOutcome {
    *at = match key.code {
        KeyCode::Right | KeyCode::Char(' ') => (*at + 1) % count,
        KeyCode::Left => (*at + count - 1) % count,
        _ => return FieldOutcome::Ignored,
    };
    FieldOutcome::Changed
}
