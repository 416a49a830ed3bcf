//! Screen Identify: the identified parameters. No number here is an accuracy.

mod joints;
mod pages;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::{Page, Parts, Scroll, Tabs, picture};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::preview::Scene;
use crate::wizard::view::{Content, IdentifyView};

/// Columns of the text beside the picture.
const TEXT: u16 = 66;
/// Tab with the errors of the joints.
const JOINTS: usize = 2;
/// Tab with the picture alone.
const PICTURE: usize = 4;

/// Page and scroll position.
#[derive(Clone, Copy, Debug)]
pub(super) struct IdentifyScreen {
    tabs: Tabs,
    scroll: Scroll,
}

impl Default for IdentifyScreen {
    fn default() -> Self {
        Self {
            tabs: Tabs::new(&["result", "parameters", "joints", "limits of the data", "arms"]),
            scroll: Scroll::default(),
        }
    }
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a IdentifyView> {
    match &cx.view.content {
        Content::Identify(content) => Some(content),
        _ => None,
    }
}

impl IdentifyScreen {
    fn page(self, cx: &ScreenCx<'_>, columns: u16) -> Page {
        let mut page = Page::new(cx.theme, columns);
        let Some(content) = content(cx) else { return page };
        match (&content.summary, self.tabs.at) {
            (None, _) => pages::before(content, cx.view.busy.is_some(), &mut page),
            (Some(summary), 0 | PICTURE) => pages::result(content, summary, &mut page),
            (Some(summary), 1) => pages::parameters(summary, &mut page),
            (Some(summary), JOINTS) => joints::joints(summary, cx.theme.glyphs, &mut page),
            (Some(summary), _) => pages::limits(summary, &mut page),
        }
        page
    }

    fn parts(self, cx: &ScreenCx<'_>, area: Rect) -> Parts {
        Parts::of(cx, area, TEXT, has_result(cx) && self.tabs.at == PICTURE)
    }
}

fn has_result(cx: &ScreenCx<'_>) -> bool {
    content(cx).is_some_and(|content| content.summary.is_some())
}

impl Screen for IdentifyScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        if has_result(cx) { vec![self.tabs.key_hint(), Scroll::key_hint()] } else { Vec::new() }
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if has_result(cx) && self.tabs.on_key(key) {
            self.scroll = Scroll::default();
            return ScreenOutcome::Changed;
        }
        let lines = self.page(cx, TEXT).len();
        self.scroll.on_key(key, lines).into()
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        self.parts(cx, area).picture_place()
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let area = if has_result(cx) { self.tabs.draw(cx.theme, area, buf) } else { area };
        let page = |columns| self.page(cx, columns);
        let picture = |scene: &Scene, area, buf: &mut Buffer| picture(cx, scene, area, buf);
        self.parts(cx, area).draw(cx, buf, (page, self.scroll), picture);
    }
}
