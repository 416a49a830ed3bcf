//! Screen Target: four ways to locate the SMR, and the circle-point analysis.

mod circles;
mod joint_check;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::menu::Menu;
use super::page::{Page, Parts, Scroll, picture};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::session::set_up::TargetChoice;
use crate::tui::dialog::ask;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::theme::Role;
use crate::wizard::Intent;
use crate::wizard::view::{Content, TargetView};

/// Columns of the configuration beside the picture.
const CIRCLES: u16 = 44;
/// Columns of the text beside the picture.
const TEXT: u16 = 62;
/// The menu entries, with when to choose each.
const WAYS: [(&str, &str); 6] = [
    ("as the profile says", "if the adapter is that of the profile and nothing was changed"),
    ("known coordinates ...", "if the adapter was measured, for example with a CMM"),
    ("left free", "if unknown: it is identified together with the arm"),
    (
        "circle-point analysis",
        "turn the last two axes, a few points each: locates the SMR and reveals wrong joint signs and a wrong frame",
    ),
    (
        "the whole arm by circles",
        "turn every axis in turn: gives all link constants beside the data sheet, as a profile to save",
    ),
    ("joint check", "move each joint a little: verifies sign, zero, unit and coupling in two minutes"),
];

/// The focus in the menu.
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

/// Whether the SMR can no longer be changed.
fn is_fixed(cx: &ScreenCx<'_>) -> bool {
    !cx.view.offers(|intent| matches!(intent, Intent::ChooseTarget(_))) && cx.view.busy.is_none()
}

fn is_offered(cx: &ScreenCx<'_>, wanted: &Intent) -> bool {
    cx.view.offers(|intent| intent == wanted)
}

/// Whether a point of a circle or of the joint check is to be measured now.
fn is_measuring(cx: &ScreenCx<'_>) -> bool {
    let Some(content) = content(cx) else { return false };
    let in_circles = content.circles.as_ref().is_some_and(|circles| circles.joint.is_some());
    in_circles || content.joint_check.as_ref().is_some_and(|check| !check.joints.is_empty())
}

/// Whether the circles have a result that is not used yet.
fn has_new_result(cx: &ScreenCx<'_>) -> bool {
    is_offered(cx, &Intent::UseCircles)
        && content(cx).is_some_and(|content| content.choice.as_ref().is_none_or(|text| !text.contains("from circles")))
}

impl TargetScreen {
    /// Whether the menu is shown.
    fn has_menu(cx: &ScreenCx<'_>) -> bool {
        !is_measuring(cx) && !is_fixed(cx)
    }

    /// Whether Enter chooses from the menu.
    fn chooses(&self, cx: &ScreenCx<'_>) -> bool {
        let is_open = content(cx).is_some_and(|content| content.choice.is_none());
        Self::has_menu(cx) && (self.menu.at.is_some() || is_open && !has_new_result(cx))
    }

    fn choose(&mut self, cx: &ScreenCx<'_>) -> ScreenOutcome {
        match self.menu.at.take().unwrap_or(0) {
            0 => ScreenOutcome::Intent(Intent::ChooseTarget(TargetChoice::Profile)),
            1 => known(cx),
            2 => cx
                .view
                .intents
                .iter()
                .find(|info| matches!(info.intent, Intent::ChooseTarget(TargetChoice::Free { .. })))
                .map_or(ScreenOutcome::Ignored, |info| ScreenOutcome::Intent(info.intent.clone())),
            3 => ScreenOutcome::Intent(Intent::StartCircles),
            4 => ScreenOutcome::Intent(Intent::StartWholeArm),
            _ => ScreenOutcome::Intent(Intent::StartJointCheck),
        }
    }

    fn page(&self, cx: &ScreenCx<'_>, columns: u16) -> Page {
        let mut page = Page::new(cx.theme, columns);
        let Some(content) = content(cx) else { return page };
        if let Some(check) = content.joint_check.as_ref().filter(|check| !check.joints.is_empty()) {
            joint_check::to_measure(check, &mut page);
            return page;
        }
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
        if let Some(payload) = &content.payload {
            page.pair("payload", payload);
        }
        if let Some(circles) = &content.circles {
            page.gap();
            circles::result(circles, &mut page);
        }
        if let Some(check) = &content.joint_check {
            page.gap();
            joint_check::result(check, &mut page);
        } else if content.advises_joint_check {
            page.gap();
            page.paragraph(
                "This profile is new: check its joints before 60 poses are spent on it. Two minutes; n skips it.",
                Role::Warn,
            );
        }
        page.gap();
        if !Self::has_menu(cx) {
            page.paragraph("Samples were measured with this SMR: a different mounting needs a new session.", Role::Dim);
            return page;
        }
        self.menu.write(&mut page, cx.theme.glyphs.pointer(), &WAYS, self.chooses(cx));
        page
    }
}

/// Columns of the text beside the picture.
fn columns(cx: &ScreenCx<'_>) -> u16 {
    if is_measuring(cx) { CIRCLES } else { TEXT }
}

/// Asks for coordinates, starting with those of the profile.
fn known(cx: &ScreenCx<'_>) -> ScreenOutcome {
    content(cx)
        .map_or(ScreenOutcome::Ignored, |content| ScreenOutcome::Open(Box::new(ask::known_target(content.nominal_mm))))
}

impl Screen for TargetScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        let mut items = vec![Scroll::key_hint()];
        if Self::has_menu(cx) {
            items.push(KeyHint::new("Up/Down", "choose", 2));
            items.push(KeyHint::new("k", "known coordinates", 4));
        }
        if self.chooses(cx) {
            items.push(KeyHint::new("Enter", "choose this", 0));
        } else if has_new_result(cx) {
            items.push(KeyHint::new("Enter", "use the result of the circles", 0));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if key.has_modifier() {
            return ScreenOutcome::Ignored;
        }
        if Self::has_menu(cx) && self.menu.on_key(key, WAYS.len()) {
            return ScreenOutcome::Changed;
        }
        match key.code {
            KeyCode::Enter if self.chooses(cx) => return self.choose(cx),
            KeyCode::Enter if has_new_result(cx) => return ScreenOutcome::Intent(Intent::UseCircles),
            KeyCode::Char('k') if Self::has_menu(cx) => return known(cx),
            _ => {}
        }
        let lines = self.page(cx, TEXT).len();
        self.scroll.on_key(key, lines).into()
    }

    fn on_paste(&mut self, text: &str, cx: &ScreenCx<'_>) -> ScreenOutcome {
        // Coordinates copied from the instrument's software.
        if is_measuring(cx) && is_offered(cx, &Intent::TypeReading(String::new())) {
            return ScreenOutcome::Intent(Intent::TypeReading(text.trim().to_owned()));
        }
        ScreenOutcome::Ignored
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        Parts::of(cx, area, columns(cx), false).picture_place()
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let page = |columns| self.page(cx, columns);
        let parts = Parts::of(cx, area, columns(cx), false);
        parts.draw(cx, buf, (page, self.scroll), |scene, area, buf| picture(cx, scene, area, buf));
    }
}
