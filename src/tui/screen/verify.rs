//! Screen Verify: the accuracy of the arm, from verification samples only. The verdict comes first.

mod pages;
mod poses;

pub(super) use pages::status;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::{Page, Parts, Scroll, Tabs, picture};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::text::fixed;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::paint;
use crate::tui::preview::{ErrorsOf, Scene};
use crate::tui::theme::Role;
use crate::units::to_mm;
use crate::wizard::view::{Content, VerifyView};

/// Columns of the text beside the picture.
const TEXT: u16 = 66;
/// Least columns for both pictures beside each other.
const PAIR: u16 = 116;
/// Tab with the picture alone.
const PICTURE: usize = 3;

/// Page, scroll position, and whose errors the picture shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct VerifyScreen {
    tabs: Tabs,
    scroll: Scroll,
    is_nominal: bool,
}

impl Default for VerifyScreen {
    fn default() -> Self {
        let tabs = Tabs::new(&["accuracy", "poses", "joints", "picture"]);
        Self { tabs, scroll: Scroll::default(), is_nominal: false }
    }
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a VerifyView> {
    match &cx.view.content {
        Content::Verify(content) => Some(content),
        _ => None,
    }
}

impl VerifyScreen {
    fn page(self, cx: &ScreenCx<'_>, columns: u16) -> Page {
        let mut page = Page::new(cx.theme, columns);
        let Some(content) = content(cx) else { return page };
        match self.tabs.at {
            1 => poses::poses(content, cx.scene, cx.theme.glyphs, &mut page),
            2 => pages::joints(content, &mut page),
            _ => pages::accuracy(content, &mut page),
        }
        page
    }

    /// Text and picture. The tab of the picture has no text where there is room for both arms beside each other.
    const fn parts(self, cx: &ScreenCx<'_>, area: Rect) -> Parts {
        let is_picture = self.tabs.at == PICTURE;
        let text = if is_picture && area.width >= PAIR { area.width } else { TEXT };
        Parts::of(cx, area, text, is_picture)
    }

    /// Draws the picture and whose errors it shows; where there is room, both arms beside each other on one scale.
    fn picture(self, cx: &ScreenCx<'_>, scene: &Scene, area: Rect, buf: &mut Buffer) {
        if area.width >= PAIR && !scene.verified.is_empty() {
            let half = area.width / 2;
            let left = Rect { width: half.saturating_sub(1), ..area };
            let right = Rect { x: area.x + half, width: area.width - half, ..area };
            for (of, area) in [(ErrorsOf::Nominal, left), (ErrorsOf::Identified, right)] {
                let mut shown = scene.clone();
                shown.show_errors_alike(of);
                let said = format!("{}, {}", title(of), largest(&shown));
                paint::text(buf, area, (0, 0), &said, cx.theme.style(role(of)));
                picture(cx, &shown, paint::band(area, 1, area.height), buf);
            }
            return;
        }
        let of = if self.is_nominal { ErrorsOf::Nominal } else { ErrorsOf::Identified };
        let mut shown = scene.clone();
        shown.show_errors(of);
        let other = if self.is_nominal { "identified" } else { "nominal" };
        let said = if shown.verified.is_empty() {
            "no verification samples to draw".to_owned()
        } else {
            format!("{} arm's errors (m: {other})", title(of))
        };
        paint::text(buf, area, (0, 0), &said, cx.theme.style(Role::Title));
        picture(cx, &shown, paint::band(area, 1, area.height), buf);
    }
}

const fn title(of: ErrorsOf) -> &'static str {
    match of {
        ErrorsOf::Nominal => "BEFORE: nominal",
        ErrorsOf::Identified => "AFTER: identified",
    }
}

const fn role(of: ErrorsOf) -> Role {
    match of {
        ErrorsOf::Nominal => Role::Nominal,
        ErrorsOf::Identified => Role::Identified,
    }
}

/// The largest error that is drawn, in words.
fn largest(scene: &Scene) -> String {
    let largest = scene.errors.iter().map(|vector| vector.error.norm()).fold(0.0, f64::max);
    format!("largest {} mm", fixed(to_mm(largest), 3))
}

impl Screen for VerifyScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        let mut items = vec![self.tabs.key_hint(), Scroll::key_hint()];
        if cx.scene.is_some_and(|scene| !scene.verified.is_empty()) {
            items.push(KeyHint::new("m", "errors before/after", 5));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if self.tabs.on_key(key) {
            self.scroll = Scroll::default();
            return ScreenOutcome::Changed;
        }
        if key == Key::plain_code(KeyCode::Char('m')) {
            self.is_nominal = !self.is_nominal;
            return ScreenOutcome::Changed;
        }
        let lines = self.page(cx, TEXT).len();
        self.scroll.on_key(key, lines).into()
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        self.parts(cx, area).picture_place()
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let area = self.tabs.draw(cx.theme, area, buf);
        let page = |columns| self.page(cx, columns);
        let picture = |scene: &Scene, area, buf: &mut Buffer| self.picture(cx, scene, area, buf);
        self.parts(cx, area).draw(cx, buf, (page, self.scroll), picture);
    }
}
