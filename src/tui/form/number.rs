//! A number field with unit and range.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{FieldOutcome, TextField};
use crate::tui::keymap::Key;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

/// A field for a number in a range.
#[derive(Clone, Debug)]
pub struct NumberField {
    field: TextField,
    unit: &'static str,
    range: (f64, f64),
    is_whole: bool,
}

impl NumberField {
    /// A field for a number in `unit` from `range.0` to `range.1`.
    pub fn new(label: impl Into<String>, value: f64, unit: &'static str, range: (f64, f64)) -> Self {
        Self { field: TextField::new(label, &value.to_string()), unit, range, is_whole: false }
    }

    /// Accepts only whole numbers.
    #[must_use]
    pub const fn whole(mut self) -> Self {
        self.is_whole = true;
        self
    }

    /// The number, with a decimal point or comma, or what is wrong with it.
    ///
    /// # Errors
    /// The text is not a number, or not in the range.
    pub fn value(&self) -> Result<f64, String> {
        let text = self.field.text();
        let text = text.trim();
        let (low, high) = self.range;
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match text.replace(',', ".").parse::<f64>() {
            Ok(value) if self.is_whole && value.fract() != 0.0 => Err(format!("'{text}' is not a whole number")),
            Ok(value) if value >= low && value <= high => Ok(value),
            Ok(value) if value.is_finite() => Err(format!("{value} is not between {low} and {high}{unit}")),
            _ => Err(format!("'{text}' is not a number from {low} to {high}{unit}")),
        }
    }

    pub fn label(&self) -> &str {
        self.field.label()
    }

    /// The number as it is written.
    pub fn text(&self) -> String {
        self.field.text()
    }

    /// Replaces the number.
    pub fn set(&mut self, text: &str) {
        self.field.clear();
        self.field.paste(text);
    }

    pub fn on_key(&mut self, key: Key) -> FieldOutcome {
        match self.field.on_key(key) {
            FieldOutcome::Submitted if self.value().is_err() => FieldOutcome::Changed,
            reaction => reaction,
        }
    }

    pub fn paste(&mut self, text: &str) {
        self.field.paste(text);
    }

    /// Draws the field in three lines.
    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let label = match self.unit {
            "" => self.field.label().to_owned(),
            unit => format!("{} ({unit})", self.field.label()),
        };
        paint::text(buf, area, (0, 0), &theme.glyphs.show(&label), theme.style(Role::Title));
        self.field.draw_line(theme, paint::band(area, 1, 1), buf);
        if let Err(problem) = self.value() {
            paint::text(buf, area, (0, 2), &theme.glyphs.show(&problem), theme.style(Role::Warn));
        }
    }
}

#[cfg(test)]
mod tests {
    use crossterm::event::KeyCode;

    use super::*;

    #[test]
    fn numbers_are_checked_as_they_are_typed() {
        let mut field = NumberField::new("sigma", 0.5, "mm", (0.0, 50.0));
        assert_eq!(field.value(), Ok(0.5));
        field.on_key(Key::char('x'));
        assert_eq!(field.value(), Err("'0.5x' is not a number from 0 to 50 mm".to_owned()));
        assert_eq!(field.on_key(Key::plain_code(KeyCode::Enter)), FieldOutcome::Changed);
        field.on_key(Key::ctrl('u'));
        field.paste("1,25");
        assert_eq!(field.value(), Ok(1.25));
        field.paste("e3");
        assert_eq!(field.value(), Err("1250 is not between 0 and 50 mm".to_owned()));
        let poses = NumberField::new("poses", 4.5, "", (1.0, 99.0)).whole();
        assert_eq!(poses.value(), Err("'4.5' is not a whole number".to_owned()));
    }
}
