//! Screen Capture, where a technician spends two hours. The next configuration is shown in large digits; Tab reaches the rest.
//!
//! ```text
//! Go to       configuration in large digits, or the questioned sample with the possible decisions
//! Poses       all poses with their states; Enter goes to one
//! Prediction  predicted error of the result, and whether the rest is worth the time
//! Live        live readings of the last seconds
//! Notes       notes, drift, and refused measurements
//! Picture     the arm, if it is not beside the other views anyway
//! ```

mod go_to;
mod joints;
mod live;
mod notes;
mod poses;
mod prediction;
mod proposed;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::{Scroll, picture_if_any};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::session::set_up::CoordinateUnit;
use crate::tui::dialog::{Dialog, ask};
use crate::tui::form::TextField;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::paint;
use crate::tui::widget::{TabView, draw_tabs};
use crate::wizard::view::{CaptureView, Content, RowState, RowView, ViewModel};
use crate::wizard::{Intent, reading};

/// Content columns from which the picture is beside the views (a terminal of 100).
const WIDE: u16 = 98;
/// Columns of the views beside the picture: two joints side by side, and one.
const VIEWS: [u16; 2] = [72, 46];
/// Rows of the "go to" view besides the joints.
const AROUND_JOINTS: u16 = 7;
/// Columns between view and picture.
const GAP: u16 = 2;
/// Columns for which the lines of the points shown are counted.
const PROPOSED: u16 = 78;
/// Rows that PgUp and PgDn scroll.
const PAGE: usize = 8;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    GoTo,
    Poses,
    Prediction,
    Live,
    Notes,
    Picture,
}

impl TabView for Tab {
    const ALL: &'static [(Self, &'static str)] = &[
        (Self::GoTo, "Go to"),
        (Self::Poses, "Poses"),
        (Self::Prediction, "Prediction"),
        (Self::Live, "Live"),
        (Self::Notes, "Notes"),
        (Self::Picture, "Picture"),
    ];
}

/// The shown view and the position in it.
#[derive(Clone, Debug, Default)]
pub(super) struct CaptureScreen {
    tab: Tab,
    /// Focused row of the list; `None`: the pose shown.
    cursor: Option<usize>,
    /// Whether the list begins with the worst fit instead of the first pose.
    by_fit: bool,
    /// Scroll position of the notes.
    scroll: usize,
    /// Scroll position of the points that are shown before they are taken.
    shown: Scroll,
}

fn content(view: &ViewModel) -> Option<&CaptureView> {
    match &view.content {
        Content::Capture(content) => Some(content),
        _ => None,
    }
}

/// Whether coordinates can be typed now.
fn takes_typing(view: &ViewModel) -> bool {
    view.offers(|intent| matches!(intent, Intent::TypeReading(_)))
}

/// Opens the dialog for coordinates, starting with the text typed or pasted so far.
fn reading_dialog(cx: &ScreenCx<'_>, begun: &str) -> ScreenOutcome {
    ScreenOutcome::Open(Box::new(ask::coordinates(cx.view, begun)))
}

/// Shows the points of several lines before they are taken; `None` if there is only one, or they cannot be read.
fn several_points(content: &CaptureView, text: &str) -> Option<ScreenOutcome> {
    let unit = CoordinateUnit::ALL.into_iter().find(|one| Some(one.sign()) == content.typed_unit.as_deref())?;
    let points = reading::parse_all(text, unit).ok().filter(|points| points.len() > 1)?;
    (points.len() > 1).then(|| ScreenOutcome::Intent(Intent::ShowPoints(text.to_owned())))
}

/// Asks for a note to a pose.
fn note_dialog(pose: &str) -> ScreenOutcome {
    let field = TextField::new(format!("Note to pose {pose}"), "");
    ScreenOutcome::Open(Box::new(Dialog::Note { field, pose: pose.to_owned() }))
}

impl CaptureScreen {
    /// The focused row of the list.
    fn selected(&self, content: &CaptureView) -> usize {
        let order = poses::order(content, self.by_fit);
        let is_shown = |index: &usize| content.rows.get(*index).is_some_and(|row| Some(row.row) == content.row);
        let shown = || order.iter().position(is_shown).unwrap_or(0);
        self.cursor.unwrap_or_else(shown).min(content.rows.len().saturating_sub(1))
    }

    /// The pose that has the focus in the list.
    fn row<'a>(&self, content: &'a CaptureView) -> Option<&'a RowView> {
        let order = poses::order(content, self.by_fit);
        content.rows.get(*order.get(self.selected(content))?)
    }

    fn on_list_key(&mut self, code: KeyCode, content: &CaptureView) -> ScreenOutcome {
        let selected = self.selected(content);
        let last = content.rows.len().saturating_sub(1);
        let to = match code {
            KeyCode::Up => selected.saturating_sub(1),
            KeyCode::Down => (selected + 1).min(last),
            KeyCode::PageUp => selected.saturating_sub(PAGE),
            KeyCode::PageDown => (selected + PAGE).min(last),
            KeyCode::Home => 0,
            KeyCode::End => last,
            KeyCode::Enter | KeyCode::Char('r') => {
                let Some(row) = self.row(content) else { return ScreenOutcome::Ignored };
                self.tab = Tab::GoTo;
                self.cursor = None;
                return ScreenOutcome::Intent(Intent::GoToPose(row.pose.clone()));
            }
            KeyCode::Char('x') => {
                let row = self.row(content);
                return row.map_or(ScreenOutcome::Ignored, |row| match row.state {
                    RowState::LeftOut => ScreenOutcome::Intent(Intent::Include(row.pose.clone())),
                    _ => ScreenOutcome::Intent(Intent::Exclude(row.pose.clone())),
                });
            }
            KeyCode::Char('w') => {
                return self.row(content).map_or(ScreenOutcome::Ignored, |row| note_dialog(&row.pose));
            }
            KeyCode::Char('o') => {
                self.by_fit = !self.by_fit;
                self.cursor = Some(0);
                return ScreenOutcome::Changed;
            }
            _ => return ScreenOutcome::Ignored,
        };
        self.cursor = Some(to);
        ScreenOutcome::Changed
    }

    fn on_notes_key(&mut self, code: KeyCode, content: &CaptureView) -> ScreenOutcome {
        let last = notes::count(content).saturating_sub(1);
        self.scroll = match code {
            KeyCode::Up => self.scroll.saturating_sub(1),
            KeyCode::Down => (self.scroll + 1).min(last),
            KeyCode::PageUp => self.scroll.saturating_sub(PAGE),
            KeyCode::PageDown => (self.scroll + PAGE).min(last),
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => return ScreenOutcome::Ignored,
        };
        ScreenOutcome::Changed
    }
}

impl Screen for CaptureScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        if content(cx.view).is_some_and(|content| content.proposed.is_some()) {
            return vec![Scroll::key_hint()];
        }
        let mut items = vec![KeyHint::new("Tab", self.tab.turned(1).1.to_lowercase(), 4)];
        match self.tab {
            Tab::Poses => {
                let row = content(cx.view).and_then(|content| self.row(content));
                let state = row.map_or(RowState::Open, |row| row.state);
                let enter = if state == RowState::Open { "go to this pose" } else { "measure this pose again" };
                items.push(KeyHint::new("Enter", enter, 0));
                items.push(KeyHint::new("Up/Down", "choose", 1));
                match state {
                    RowState::Measured => items.push(KeyHint::new("x", "exclude it", 2)),
                    RowState::LeftOut => items.push(KeyHint::new("x", "let it count again", 2)),
                    RowState::Open | RowState::Skipped => {}
                }
                items.push(KeyHint::new("w", "note to it", 3));
                items.push(KeyHint::new("o", if self.by_fit { "plan order" } else { "worst fit first" }, 2));
            }
            Tab::Notes => items.push(KeyHint::new("Up/Down", "scroll", 7)),
            Tab::GoTo | Tab::Prediction | Tab::Live | Tab::Picture => {}
        }
        if takes_typing(cx.view) && self.tab != Tab::Picture {
            items.push(KeyHint::new("0-9, paste", "coordinates", 3));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        let Some(content) = content(cx.view) else { return ScreenOutcome::Ignored };
        if let Some(proposed) = &content.proposed {
            let lines = proposed::page(cx.theme, proposed, PROPOSED).len();
            return self.shown.on_key(key, lines).into();
        }
        match key.code {
            _ if key.has_modifier() => return ScreenOutcome::Ignored,
            code if self.tab.on_key(code) => {}
            KeyCode::Char(c @ ('0'..='9' | '-' | '+' | '.' | ','))
                if self.tab != Tab::Picture && takes_typing(cx.view) =>
            {
                return reading_dialog(cx, &c.to_string());
            }
            code => {
                return match self.tab {
                    Tab::Poses => self.on_list_key(code, content),
                    Tab::Notes => self.on_notes_key(code, content),
                    Tab::GoTo | Tab::Prediction | Tab::Live | Tab::Picture => ScreenOutcome::Ignored,
                };
            }
        }
        self.cursor = None;
        ScreenOutcome::Changed
    }

    fn on_paste(&mut self, text: &str, cx: &ScreenCx<'_>) -> ScreenOutcome {
        match content(cx.view) {
            Some(content) if takes_typing(cx.view) => {
                several_points(content, text).unwrap_or_else(|| reading_dialog(cx, text.trim()))
            }
            _ => ScreenOutcome::Ignored,
        }
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        let beside = content(cx.view).and_then(|content| parts(cx, content, area).1);
        PicturePlace::of(cx.scene.is_some() && self.tab == Tab::Picture, beside.is_some())
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let Some(content) = content(cx.view) else { return };
        let (main, beside) = parts(cx, content, area);
        if let Some(proposed) = &content.proposed {
            proposed::page(cx.theme, proposed, main.width).draw(self.shown.0, main, buf);
            if let Some(beside) = beside {
                picture_if_any(cx, beside, buf);
            }
            return;
        }
        draw_tabs(cx.theme, self.tab, paint::band(main, 0, 1), buf);
        let body = paint::band(main, 1, main.height);
        match self.tab {
            Tab::GoTo => go_to::draw(cx, content, body, buf),
            Tab::Poses => {
                let order = poses::order(content, self.by_fit);
                poses::draw(cx.theme, content, (&order, self.selected(content)), body, buf);
            }
            Tab::Prediction => prediction::draw(cx.theme, content, body, buf),
            Tab::Live => live::draw(cx, content, body, buf),
            Tab::Notes => notes::draw(cx.theme, content, self.scroll, body, buf),
            Tab::Picture => {}
        }
        let picture = if self.tab == Tab::Picture { Some(paint::band(area, 1, area.height)) } else { beside };
        if let Some(picture) = picture {
            picture_if_any(cx, picture, buf);
        }
    }
}

/// The area of the views, and of the picture beside them.
fn parts(cx: &ScreenCx<'_>, content: &CaptureView, area: Rect) -> (Rect, Option<Rect>) {
    if area.width < WIDE || cx.scene.is_none() {
        return (area, None);
    }
    let joints = u16::try_from(content.joints.len()).unwrap_or(u16::MAX);
    let fits_in_one = area.height >= joints.saturating_mul(3).saturating_add(AROUND_JOINTS);
    let [two, one] = VIEWS;
    let columns = if fits_in_one { one.max(area.width * 2 / 5) } else { two };
    let main = Rect { width: columns, ..area };
    let left = columns + GAP;
    (main, Some(Rect { x: area.x + left, width: area.width - left, ..area }))
}

#[cfg(test)]
pub(crate) mod tests;
