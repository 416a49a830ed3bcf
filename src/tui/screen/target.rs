//! Target: four ways to say where the SMR sits; and the circle-point analysis.

mod circles;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::menu::Menu;
use super::page::{Page, Scroll, picture, split};
use super::{PicturePlace, Reply, Screen, ScreenCx};
use crate::session::set_up::TargetChoice;
use crate::tui::dialog::ask;
use crate::tui::keymap::{Item, Key};
use crate::tui::theme::Role;
use crate::wizard::Intent;
use crate::wizard::view::{Content, TargetView};

/// Columns of the configuration beside the picture.
const CIRCLES: u16 = 44;
/// Columns of the text beside the picture.
const TEXT: u16 = 62;
/// The ways, with when to take each.
const WAYS: [(&str, &str); 4] = [
    ("as the profile says", "when the adapter is the one of the profile and nothing was changed"),
    ("known coordinates ...", "when the adapter was measured, for example with a CMM"),
    ("left free", "when nobody knows: it is identified together with the arm"),
    (
        "circle-point analysis",
        "turn the last two axes, some points each: finds the SMR and uncovers wrong joint signs and a wrong frame",
    ),
];

/// The focus in the list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TargetScreen {
    menu: Menu,
    scroll: Scroll,
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a TargetView> {
    match &cx.view.content {
        Content::Target(content) => Some(content),
        _ => None,
    }
}

/// Whether the SMR is chosen for good.
fn is_fixed(cx: &ScreenCx<'_>) -> bool {
    let mut offers = cx.view.intents.iter().filter(|info| matches!(info.intent, Intent::ChooseTarget(_)));
    offers.all(|info| !info.is_enabled()) && cx.view.busy.is_none()
}

fn is_offered(cx: &ScreenCx<'_>, wanted: &Intent) -> bool {
    cx.view.intents.iter().any(|info| info.intent == *wanted && info.is_enabled())
}

/// Whether a point of a circle is to be measured now.
fn is_in_circles(cx: &ScreenCx<'_>) -> bool {
    content(cx).and_then(|content| content.circles.as_ref()).is_some_and(|circles| circles.joint.is_some())
}

/// Whether there is a result of the circles that is not taken.
fn has_new_result(cx: &ScreenCx<'_>) -> bool {
    is_offered(cx, &Intent::UseCircles)
        && content(cx).is_some_and(|content| content.choice.as_ref().is_none_or(|text| !text.contains("from circles")))
}

impl TargetScreen {
    /// Whether the list is there.
    fn has_menu(cx: &ScreenCx<'_>) -> bool {
        !is_in_circles(cx) && !is_fixed(cx)
    }

    /// Whether Enter chooses from the list.
    fn chooses(&self, cx: &ScreenCx<'_>) -> bool {
        let is_open = content(cx).is_some_and(|content| content.choice.is_none());
        Self::has_menu(cx) && (self.menu.at.is_some() || is_open && !has_new_result(cx))
    }

    fn choose(&mut self, cx: &ScreenCx<'_>) -> Reply {
        match self.menu.at.take().unwrap_or(0) {
            0 => Reply::Intend(Intent::ChooseTarget(TargetChoice::Profile)),
            1 => known(cx),
            2 => cx
                .view
                .intents
                .iter()
                .find(|info| matches!(info.intent, Intent::ChooseTarget(TargetChoice::Free { .. })))
                .map_or(Reply::Ignored, |info| Reply::Intend(info.intent.clone())),
            _ => Reply::Intend(Intent::StartCircles),
        }
    }

    fn page(&self, cx: &ScreenCx<'_>, columns: u16) -> Page {
        let mut page = Page::new(cx.theme, columns);
        let Some(content) = content(cx) else { return page };
        if let Some(circles) = content.circles.as_ref().filter(|circles| circles.joint.is_some()) {
            circles::to_measure(circles, &mut page);
            return page;
        }
        let [x, y, z] = content.nominal_mm;
        let sigma = if content.nominal_sigma_mm > 0.0 {
            format!("sigma {} mm", content.nominal_sigma_mm)
        } else {
            "taken as exact".to_owned()
        };
        page.pair("profile", &format!("({x:.3}, {y:.3}, {z:.3}) mm in the flange, {sigma}"));
        page.pair("chosen", content.choice.as_deref().unwrap_or("nothing yet: where is the centre of the SMR?"));
        if let Some(circles) = &content.circles {
            page.gap();
            circles::result(circles, &mut page);
        }
        page.gap();
        if !Self::has_menu(cx) {
            page.paragraph("Samples are measured with this SMR: another mounting is another session.", Role::Dim);
            return page;
        }
        self.menu.write(&mut page, cx.theme.glyphs.pointer(), &WAYS, self.chooses(cx));
        page
    }
}

/// Columns of the text beside the picture.
fn columns(cx: &ScreenCx<'_>) -> u16 {
    if is_in_circles(cx) { CIRCLES } else { TEXT }
}

/// Asks for coordinates, the profile's to begin with.
fn known(cx: &ScreenCx<'_>) -> Reply {
    content(cx).map_or(Reply::Ignored, |content| Reply::Ask(Box::new(ask::known_target(content.nominal_mm))))
}

impl Screen for TargetScreen {
    fn items(&self, cx: &ScreenCx<'_>) -> Vec<Item> {
        let mut items = vec![Scroll::item()];
        if Self::has_menu(cx) {
            items.push(Item::new("Up/Down", "choose", 2));
            items.push(Item::new("k", "known coordinates", 4));
        }
        if self.chooses(cx) {
            items.push(Item::new("Enter", "take this way", 0));
        } else if has_new_result(cx) {
            items.push(Item::new("Enter", "take the result of the circles", 0));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> Reply {
        if key.has_modifier() {
            return Reply::Ignored;
        }
        if Self::has_menu(cx) && self.menu.on_key(key, WAYS.len()) {
            return Reply::Changed;
        }
        match key.code {
            KeyCode::Enter if self.chooses(cx) => return self.choose(cx),
            KeyCode::Enter if has_new_result(cx) => return Reply::Intend(Intent::UseCircles),
            KeyCode::Char('k') if Self::has_menu(cx) => return known(cx),
            _ => {}
        }
        let lines = self.page(cx, TEXT).len();
        if self.scroll.on_key(key, lines) { Reply::Changed } else { Reply::Ignored }
    }

    fn on_paste(&mut self, text: &str, cx: &ScreenCx<'_>) -> Reply {
        // Coordinates from the instrument's program.
        if is_in_circles(cx) && is_offered(cx, &Intent::TypeReading(String::new())) {
            return Reply::Intend(Intent::TypeReading(text.trim().to_owned()));
        }
        Reply::Ignored
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        PicturePlace::of(false, split(area, columns(cx), cx.scene.is_some()).1.is_some())
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let (text, side) = split(area, columns(cx), cx.scene.is_some());
        self.page(cx, text.width).draw(self.scroll.0, text, buf);
        if let (Some(side), Some(scene)) = (side, cx.scene) {
            picture(cx, scene, side, buf);
        }
    }
}
