//! The settings of a plan: whole numbers, one to a line.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::PlanSettings;

/// Step of '+' and '-' in poses.
const MORE: usize = 4;
/// Column after the numbers.
const NUMBERS: usize = 30;
/// Largest number of digits.
const MOST_DIGITS: usize = 9;

#[derive(Clone, Copy, Debug)]
struct Field {
    label: &'static str,
    range: (usize, usize),
    step: usize,
}

const FIELDS: [Field; 5] = [
    Field { label: "poses to identify", range: (1, 500), step: 1 },
    Field { label: "poses to verify", range: (0, 200), step: 1 },
    Field { label: "candidates", range: (50, 200_000), step: 500 },
    Field { label: "seed", range: (0, 999_999_999), step: 1 },
    Field { label: "poses between drift checks", range: (0, 500), step: 5 },
];

/// Explanation of each setting.
const MEANING: [&str; 5] = [
    "used to identify the arm",
    "used only to check the result",
    "random poses to choose from",
    "another seed, other candidates",
    "0: no pose is repeated",
];

/// The settings being edited.
#[derive(Clone, Debug, Default)]
pub(super) struct SettingsForm {
    /// The settings of the wizard.
    given: PlanSettings,
    edited: PlanSettings,
    focus: usize,
    /// Digits typed into the focused setting.
    typed: Option<String>,
}

impl SettingsForm {
    /// Takes over the wizard's settings if they have changed.
    pub(super) fn follow(&mut self, settings: PlanSettings) {
        if settings != self.given {
            self.given = settings;
            self.edited = settings;
            self.typed = None;
        }
    }

    /// The settings, including the digits being typed.
    pub(super) fn settings(&self) -> PlanSettings {
        let mut form = self.clone();
        form.commit();
        form.edited
    }

    /// Whether they differ from those of the wizard.
    pub(super) fn is_changed(&self) -> bool {
        self.settings() != self.given
    }

    /// The settings with the next seed.
    pub(super) fn with_other_seed(&self) -> PlanSettings {
        let settings = self.settings();
        PlanSettings { seed: settings.seed.wrapping_add(1) % 1_000_000_000, ..settings }
    }

    /// Sets the number of identification poses.
    pub(super) fn set_poses(&mut self, poses: usize) {
        self.commit();
        self.set(0, poses);
    }

    fn value(&self, index: usize) -> usize {
        match index {
            0 => self.edited.poses,
            1 => self.edited.verification,
            2 => self.edited.candidates,
            3 => usize::try_from(self.edited.seed).unwrap_or(usize::MAX),
            _ => self.edited.drift_every,
        }
    }

    fn set(&mut self, index: usize, value: usize) {
        let Some(field) = FIELDS.get(index) else { return };
        let value = value.clamp(field.range.0, field.range.1);
        match index {
            0 => self.edited.poses = value,
            1 => self.edited.verification = value,
            2 => self.edited.candidates = value,
            3 => self.edited.seed = u64::try_from(value).unwrap_or(0),
            _ => self.edited.drift_every = value,
        }
    }

    /// Applies the typed digits, clamped to the range.
    fn commit(&mut self) {
        if let Some(value) = self.typed.take().and_then(|typed| typed.parse().ok()) {
            self.set(self.focus, value);
        }
    }

    /// Handles a key. Returns `false` if it is not a key of the form.
    pub(super) fn on_key(&mut self, code: KeyCode) -> bool {
        let step = FIELDS.get(self.focus).map_or(1, |field| field.step);
        match code {
            KeyCode::Char(c @ '0'..='9') => {
                let typed = self.typed.get_or_insert_default();
                if typed.len() < MOST_DIGITS {
                    typed.push(c);
                }
                return true;
            }
            KeyCode::Backspace => {
                let value = self.value(self.focus).to_string();
                self.typed.get_or_insert(value).pop();
                return true;
            }
            KeyCode::Delete => {
                self.typed = Some(String::new());
                return true;
            }
            _ => self.commit(),
        }
        match code {
            KeyCode::Up => self.focus = self.focus.checked_sub(1).unwrap_or(FIELDS.len() - 1),
            KeyCode::Down => self.focus = (self.focus + 1) % FIELDS.len(),
            KeyCode::Left => self.set(self.focus, self.value(self.focus).saturating_sub(step)),
            KeyCode::Right => self.set(self.focus, self.value(self.focus).saturating_add(step)),
            KeyCode::Char('+' | '=') => self.set(0, self.edited.poses.saturating_add(MORE)),
            KeyCode::Char('-') => self.set(0, self.edited.poses.saturating_sub(MORE)),
            _ => return false,
        }
        true
    }

    /// The allowed range, if the typed number is outside it.
    fn problem(&self) -> Option<String> {
        let typed = self.typed.as_ref()?;
        let (low, high) = FIELDS.get(self.focus)?.range;
        let is_good = typed.parse().is_ok_and(|value: usize| (low..=high).contains(&value));
        (!is_good).then(|| format!("{low} to {high}"))
    }

    /// Draws title, settings, and the explanation of the focused one.
    pub(super) fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let title = if self.is_changed() { "Settings (changed; Enter applies)" } else { "Settings" };
        paint::text(buf, area, (0, 0), title, theme.style(Role::Title));
        for (row, (index, field)) in (1_u16..).zip(FIELDS.iter().enumerate()) {
            let has_focus = index == self.focus;
            let lead = if has_focus { theme.glyphs.pointer() } else { "  " };
            let column = paint::text(buf, area, (0, row), lead, theme.style(Role::Hint));
            paint::text(buf, area, (column, row), field.label, theme.style(Role::Plain));
            let typed = self.typed.as_ref().filter(|_| has_focus);
            let value = typed.map_or_else(|| self.value(index).to_string(), |typed| format!("{typed}_"));
            let start = u16::try_from(NUMBERS.saturating_sub(text::columns(&value)) + 3).unwrap_or(0);
            let role = if has_focus { Role::Focus } else { Role::Title };
            paint::text(buf, area, (start, row), &value, theme.style(role));
        }
        let below = u16::try_from(FIELDS.len()).unwrap_or(0) + 1;
        match (self.problem(), MEANING.get(self.focus)) {
            (Some(problem), _) => paint::text(buf, area, (2, below), &problem, theme.style(Role::Warn)),
            (None, Some(meaning)) => paint::text(buf, area, (2, below), meaning, theme.style(Role::Dim)),
            (None, None) => below,
        };
    }
}
