//! A form: several fields that together make an intent.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::completed;
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
    /// Whether each value is preceded by its label and a tabulator: for forms whose fields depend on the robot.
    has_labels: bool,
    /// What the links see now.
    taken: Taken,
    /// Whether it has a place of its own where Enter accepts it.
    is_accepted_at_its_end: bool,
}

/// What a field can take over from a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    /// The SMR as the instrument sees it (mm).
    Seen,
    /// The SMR in the base at the present joints (mm).
    SmrInBase,
    /// The flange in the base at the present joints (mm).
    FlangeInBase,
    /// The present value of a joint, by its index.
    Joint(usize),
}

/// What the links see now, as it is written into fields; `None` or too short where nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Taken {
    pub seen: Option<String>,
    pub smr_in_base: Option<String>,
    pub flange_in_base: Option<String>,
    /// Per joint.
    pub joints: Vec<String>,
}

impl Taken {
    fn value(&self, take: Take) -> Option<&str> {
        match take {
            Take::Seen => self.seen.as_deref(),
            Take::SmrInBase => self.smr_in_base.as_deref(),
            Take::FlangeInBase => self.flange_in_base.as_deref(),
            Take::Joint(joint) => self.joints.get(joint).map(String::as_str),
        }
    }
}

/// A field with an explanation.
#[derive(Clone, Debug)]
struct Field {
    label: String,
    about: &'static str,
    value: Value,
    /// What Enter takes over, if a link sees it.
    take: Option<Take>,
    /// Whether the operator has typed into it: that is not overwritten.
    is_typed: bool,
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
        Self {
            title: title.into(),
            fields: Vec::new(),
            focus: 0,
            build,
            is_tried: false,
            has_labels: false,
            taken: Taken::default(),
            is_accepted_at_its_end: false,
        }
    }

    /// Adds a line of text.
    #[must_use]
    pub fn text(mut self, label: impl Into<String>, value: &str, about: &'static str) -> Self {
        let label = label.into();
        let value = Value::Text(TextField::new(label.clone(), value));
        self.fields.push(Field { label, about, value, take: None, is_typed: false });
        self
    }

    /// Makes the last field a path, which a tabulator completes.
    #[must_use]
    pub fn path(mut self) -> Self {
        if let Some(Field { value: Value::Text(field), .. }) = self.fields.last_mut() {
            *field = field.clone().path(completed);
        }
        self
    }

    /// The question that the form asks.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Lets Enter take over what a link sees into the last field, and move on to the next one.
    #[must_use]
    pub fn taking(mut self, take: Take) -> Self {
        if let Some(field) = self.fields.last_mut() {
            field.take = Some(take);
        }
        self
    }

    /// Adds the place where Enter accepts the form.
    #[must_use]
    pub fn done(mut self) -> Self {
        self.is_accepted_at_its_end = true;
        self.pick("done", &["Enter accepts all"], 0, "Up/Down goes back to a line.")
    }

    /// Begins at the field with this label.
    #[must_use]
    pub fn starting_at(mut self, label: &str) -> Self {
        self.focus = self.fields.iter().position(|field| field.label == label).unwrap_or(self.focus);
        self
    }

    /// Puts the label and a tabulator before each value.
    #[must_use]
    pub const fn with_labels(mut self) -> Self {
        self.has_labels = true;
        self
    }

    /// Sees what the links see now.
    pub fn see(&mut self, taken: &Taken) {
        self.taken.clone_from(taken);
    }

    /// What Enter takes over into a field.
    fn offered(&self, number: usize) -> Option<&str> {
        let field = self.fields.get(number)?;
        self.taken.value(field.take?)
    }

    /// What Enter takes over now, for the keys of the dialog.
    pub fn offer(&self) -> Option<String> {
        let is_typed = self.fields.get(self.focus).is_some_and(|field| field.is_typed);
        self.offered(self.focus).filter(|_| !is_typed).map(str::to_owned)
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
        let (label, value) = (label.to_owned(), Value::Pick { options, at });
        self.fields.push(Field { label, about, value, take: None, is_typed: false });
        self
    }

    /// The intent, or what is wrong.
    ///
    /// # Errors
    /// A field is invalid.
    pub fn value(&self) -> Result<Intent, String> {
        let value = |field: &Field| {
            if self.has_labels { format!("{}\t{}", field.label, field.value.text()) } else { field.value.text() }
        };
        let values: Vec<String> = self.fields.iter().map(value).collect();
        (self.build)(&values)
    }

    /// The question of a field, for plain lines.
    pub(super) fn question(&self, number: usize) -> Option<Vec<String>> {
        let field = self.fields.get(number)?;
        let title = (number == 0).then(|| self.title.clone());
        let about = [format!("  {}", field.about)];
        let asked = match &field.value {
            Value::Text(text) => match self.offered(number) {
                Some(here) => format!("{} (. takes {here})", with_value(&field.label, &text.text())),
                None => with_value(&field.label, &text.text()),
            },
            Value::Pick { options, at } => {
                format!("{}: {} [{}]", field.label, alternatives(options), options.get(*at).unwrap_or(&""))
            }
        };
        Some(title.into_iter().chain(about).chain([asked]).collect())
    }

    /// Answers the question of a field, for plain lines.
    pub(super) fn answer(&mut self, number: usize, line: &str) -> Result<(), String> {
        let here = self.offered(number).filter(|_| line == ".").map(str::to_owned);
        match self.fields.get_mut(number).map(|field| &mut field.value) {
            Some(Value::Text(field)) => replace(field, here.as_deref().unwrap_or(line)),
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
            KeyCode::Enter if self.is_on_the_way() => {
                let here = self.offer();
                if let (Some(here), Some(Value::Text(field))) =
                    (here, self.fields.get_mut(self.focus).map(|field| &mut field.value))
                {
                    field.clear();
                    field.paste(&here);
                }
                self.focus = (self.focus + 1) % count;
            }
            KeyCode::Enter => {
                self.is_tried = true;
                return if self.value().is_ok() { FieldOutcome::Submitted } else { FieldOutcome::Changed };
            }
            KeyCode::Esc => return FieldOutcome::Cancelled,
            // A path is completed first; with nothing to add the focus moves on.
            KeyCode::Tab if self.completes() => {}
            KeyCode::Tab | KeyCode::Down => self.focus = (self.focus + 1) % count,
            KeyCode::BackTab | KeyCode::Up => self.focus = (self.focus + count - 1) % count,
            _ => {
                let Some(focused) = self.fields.get_mut(self.focus) else { return FieldOutcome::Ignored };
                return match &mut focused.value {
                    Value::Text(field) => {
                        let before = field.text();
                        let outcome = field.on_key(key);
                        focused.is_typed |= field.text() != before;
                        outcome
                    }
                    Value::Pick { options, at } => picked(options.len().max(1), at, key),
                };
            }
        }
        FieldOutcome::Changed
    }

    /// Completes the path in the focused field; whether it is one with something to add.
    fn completes(&mut self) -> bool {
        let Some(Field { value: Value::Text(field), is_typed, .. }) = self.fields.get_mut(self.focus) else {
            return false;
        };
        let has_news = !field.text().trim().is_empty() && field.complete();
        *is_typed |= has_news;
        has_news
    }

    /// Whether Enter moves on to the next field: a link sees what this one takes, or the form is accepted at its end and lacks
    /// something.
    fn is_on_the_way(&self) -> bool {
        let is_last = self.focus + 1 >= self.fields.len();
        self.offered(self.focus).is_some() || (self.is_accepted_at_its_end && !is_last && self.value().is_err())
    }

    /// Inserts pasted text into the focused field.
    pub fn paste(&mut self, text: &str) {
        if let Some(Field { value: Value::Text(field), is_typed, .. }) = self.fields.get_mut(self.focus) {
            field.paste(text);
            *is_typed = true;
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
            paint::text(buf, area, (0, row), &theme.glyphs.show(&field.label), theme.style(role));
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
        let focused = self.fields.get(self.focus);
        let choices = focused.and_then(|field| match &field.value {
            Value::Text(text) => text.choices(),
            Value::Pick { .. } => None,
        });
        let about = choices.unwrap_or_else(|| focused.map_or("", |field| field.about).to_owned());
        for line in wrapped(&theme.glyphs.show(&about), columns) {
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
