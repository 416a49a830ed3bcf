//! Screen Plan: the number of poses, their benefit and their cost.
//!
//! ```text
//! Plan       settings, the proposed or accepted plan, search or trade-off
//! Trade-off  number of poses against predicted error and time
//! Weak       weakly determined parameters, and warnings
//! Picture    positions of the points
//! ```

mod figures;
mod form;
mod search;
mod trade_off;
mod weak;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::picture_if_any;
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::text::wrapped;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::paint;
use crate::tui::theme::Role;
use crate::tui::widget::{TabView, draw_tabs};
use crate::wizard::view::{Content, PlanView, ViewModel};
use crate::wizard::{Intent, PlanSettings};
use form::SettingsForm;
use search::Search;

/// Content columns from which the picture is beside the views (a terminal of 108).
const WIDE: u16 = 106;
/// Columns of the views beside the picture.
const VIEWS: u16 = 78;
/// Columns of the settings.
const SETTINGS: u16 = 34;
/// Lines of settings and figures.
const TOP: u16 = 8;
/// Columns between two parts.
const GAP: u16 = 2;

/// Explanation for an operator who has never planned poses.
const HELP: [&str; 3] = [
    "1. Random configurations are drawn that the robot can reach freely and where the tracker sees the SMR.",
    "2. Of these, the set that determines all parameters best is chosen; that takes seconds to minutes.",
    "3. You see its predicted error and its measuring time, then accept it or change the settings.",
];

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    Plan,
    TradeOff,
    Weak,
    Picture,
}

impl TabView for Tab {
    const ALL: &'static [(Self, &'static str)] = &[
        (Self::Plan, "Plan"),
        (Self::TradeOff, "Trade-off"),
        (Self::Weak, "Weak parameters"),
        (Self::Picture, "Picture"),
    ];
}

/// Settings that are not sent yet, and the results of the search so far.
#[derive(Clone, Debug, Default)]
pub(super) struct PlanScreen {
    tab: Tab,
    form: SettingsForm,
    search: Search,
    scroll: usize,
}

fn content(view: &ViewModel) -> Option<&PlanView> {
    match &view.content {
        Content::Plan(content) => Some(content),
        _ => None,
    }
}

/// Whether Enter chooses poses.
fn makes_by_default(view: &ViewModel) -> bool {
    view.intents.iter().any(|info| info.is_default && matches!(info.intent, Intent::MakePlan(_)))
}

/// Whether poses can be chosen now.
fn can_make(view: &ViewModel) -> bool {
    view.offers(|intent| matches!(intent, Intent::MakePlan(_)))
}

impl PlanScreen {
    fn make(&mut self, settings: PlanSettings) -> ScreenOutcome {
        self.tab = Tab::Plan;
        ScreenOutcome::Intent(Intent::MakePlan(settings))
    }
}

impl Screen for PlanScreen {
    fn see(&mut self, view: &ViewModel) {
        if let Some(content) = content(view) {
            self.form.follow(content.settings);
        }
        self.search.see(view.busy.as_ref());
    }

    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        let mut items = vec![KeyHint::new("Tab", self.tab.turned(1).1.to_lowercase(), 5)];
        if !can_make(cx.view) {
            return items;
        }
        if self.form.is_changed() {
            items.push(KeyHint::new("Enter", "choose poses with these settings", 0));
        }
        if self.tab == Tab::Plan {
            items.push(KeyHint::new("Up/Down", "setting", 4));
            items.push(KeyHint::new("0-9", "type its value", 4));
            items.push(KeyHint::new("+/-", "more or fewer poses", 4));
        }
        if self.tab == Tab::TradeOff {
            items.push(KeyHint::new("Up/Down", "number of poses", 3));
        }
        items.push(KeyHint::new("o", "choose with another seed", 5));
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if key.has_modifier() || content(cx.view).is_none() {
            return ScreenOutcome::Ignored;
        }
        let is_free = can_make(cx.view);
        match key.code {
            code if self.tab.on_key(code) => self.scroll = 0,
            KeyCode::Enter if is_free && (self.form.is_changed() || makes_by_default(cx.view)) => {
                let settings = self.form.settings();
                return self.make(settings);
            }
            KeyCode::Char('p') if is_free => {
                let settings = self.form.settings();
                return self.make(settings);
            }
            KeyCode::Char('o') if is_free && self.tab != Tab::Picture => {
                let settings = self.form.with_other_seed();
                return self.make(settings);
            }
            code if self.tab == Tab::Plan && is_free => {
                return self.form.on_key(code).into();
            }
            KeyCode::Up | KeyCode::Down if self.tab == Tab::TradeOff && is_free => {
                let poses = self.form.settings().poses;
                let to =
                    content(cx.view).and_then(|content| trade_off::next(content, poses, key.code == KeyCode::Down));
                if let Some(poses) = to {
                    self.form.set_poses(poses);
                }
            }
            KeyCode::Up | KeyCode::PageUp if self.tab == Tab::Weak => {
                self.scroll = self.scroll.saturating_sub(1);
            }
            KeyCode::Down | KeyCode::PageDown if self.tab == Tab::Weak => {
                let most = content(cx.view).map_or(0, weak::count);
                self.scroll = (self.scroll + 1).min(most.saturating_sub(1));
            }
            _ => return ScreenOutcome::Ignored,
        }
        ScreenOutcome::Changed
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        // While settings can be changed, the arrows belong to them.
        let is_beside = area.width >= WIDE && !(self.tab == Tab::Plan && can_make(cx.view));
        PicturePlace::of(cx.scene.is_some() && self.tab == Tab::Picture, cx.scene.is_some() && is_beside)
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let Some(content) = content(cx.view) else { return };
        let is_wide = area.width >= WIDE && cx.scene.is_some();
        let main = Rect { width: if is_wide { VIEWS.max(area.width / 2) } else { area.width }, ..area };
        draw_tabs(cx.theme, self.tab, paint::band(main, 0, 1), buf);
        let body = paint::band(main, 2, main.height);
        match self.tab {
            Tab::Plan => self.overview(cx, content, body, buf),
            Tab::TradeOff => trade_off::draw(cx.theme, content, self.form.settings().poses, body, buf),
            Tab::Weak => weak::draw(cx.theme, content, self.scroll, body, buf),
            Tab::Picture => {}
        }
        let beside = || {
            let left = main.width + GAP;
            Rect { x: area.x + left, width: area.width - left, ..area }
        };
        let picture = match self.tab {
            Tab::Picture => Some(paint::band(area, 1, area.height)),
            _ => is_wide.then(beside),
        };
        if let Some(picture) = picture {
            picture_if_any(cx, picture, buf);
        }
    }
}

fn what_happens(cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
    let lines = HELP.iter().flat_map(|line| wrapped(&cx.theme.glyphs.show(line), usize::from(area.width)));
    for (row, line) in (0_u16..area.height).zip(lines) {
        paint::text(buf, area, (0, row), &line, cx.theme.style(Role::Dim));
    }
}

impl PlanScreen {
    fn overview(&self, cx: &ScreenCx<'_>, content: &PlanView, area: Rect, buf: &mut Buffer) {
        let settings = Rect { width: SETTINGS.min(area.width), ..paint::band(area, 0, TOP) };
        self.form.draw(cx.theme, settings, buf);
        let left = (SETTINGS + GAP).min(area.width);
        let figures = Rect { x: area.x + left, width: area.width - left, ..paint::band(area, 0, TOP) };
        figures::draw(cx.theme, content, self.search.is_running(), figures, buf);
        let below = paint::band(area, TOP, area.height);
        if self.search.is_running() {
            self.search.draw(cx.theme, below, buf);
        } else if content.proposal.is_none() && content.accepted.is_none() {
            what_happens(cx, below, buf);
        } else if content.proposal.is_none() {
            figures::draw_program(cx.theme, content.program.as_ref(), below, buf);
        } else {
            trade_off::draw_in_short(cx.theme, content, self.form.settings().poses, below, buf);
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
