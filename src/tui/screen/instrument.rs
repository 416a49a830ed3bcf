//! Screen Instrument: a menu of the ways to measure.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::menu::Menu;
use super::page::{Page, Parts, Scroll, picture};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice};
use crate::text::counted;
use crate::tui::dialog::{Dialog, ask, links};
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::theme::Role;
use crate::tui::values;
use crate::wizard::Intent;
use crate::wizard::view::{Content, InstrumentView, ViewModel};

/// Columns of the text beside the picture.
const TEXT: u16 = 62;
/// The menu entries with their explanations.
const WAYS: [(&str, &str); 6] = [
    ("by hand, in mm", "you read x y z off the instrument and type or paste them"),
    ("by hand, in m", "the same, for an instrument that shows metres"),
    ("by hand, in inch", "the same, for an instrument that shows inches"),
    ("over a wire ...", "choose from a list: network, serial ports, links used before, rehearsals"),
    ("simulated cell ...", "an arm with hidden errors: rehearse the whole procedure"),
    ("recorded measurements ...", "tables of earlier measurements, played back as if captured now"),
];
const UNITS: [CoordinateUnit; 3] = [CoordinateUnit::Millimetre, CoordinateUnit::Metre, CoordinateUnit::Inch];

/// The focus in the menu.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstrumentScreen {
    menu: Menu,
    scroll: Scroll,
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a InstrumentView> {
    match &cx.view.content {
        Content::Instrument(content) => Some(content),
        _ => None,
    }
}

/// Whether the instrument can no longer be changed.
fn is_fixed(cx: &ScreenCx<'_>) -> bool {
    !cx.view.offers(|intent| matches!(intent, Intent::ChooseInstrument(_))) && cx.view.busy.is_none()
}

impl InstrumentScreen {
    /// Whether Enter chooses from the menu instead of continuing.
    fn chooses(&self, cx: &ScreenCx<'_>) -> bool {
        !is_fixed(cx) && content(cx).is_some_and(|content| self.menu.at.is_some() || content.choice.is_none())
    }

    fn choose(&mut self, cx: &ScreenCx<'_>) -> ScreenOutcome {
        match way(self.menu.at.take().unwrap_or(0), cx.view) {
            Ok(intent) => ScreenOutcome::Intent(intent),
            Err(dialog) => ScreenOutcome::Open(dialog),
        }
    }

    fn page(&self, cx: &ScreenCx<'_>, columns: u16) -> Page {
        let mut page = Page::new(cx.theme, columns);
        let Some(content) = content(cx) else { return page };
        state(content, cx, &mut page);
        page.gap();
        if is_fixed(cx) {
            page.paragraph(
                "Points have already been measured: those of another instrument cannot be mixed with them.",
                Role::Dim,
            );
            return page;
        }
        self.menu.write(&mut page, cx.theme.glyphs.pointer(), &WAYS, self.chooses(cx));
        page
    }
}

/// The ways to measure, with their explanations.
pub(in crate::tui) const fn ways() -> &'static [(&'static str, &'static str)] {
    &WAYS
}

/// The intent of a way to measure, or the dialog that it needs first.
pub(in crate::tui) fn way(at: usize, view: &ViewModel) -> Result<Intent, Box<Dialog>> {
    match UNITS.get(at) {
        Some(unit) => Ok(Intent::ChooseInstrument(InstrumentChoice::Manual { unit: *unit })),
        None if at == UNITS.len() => Err(Box::new(match &view.content {
            Content::Instrument(content) => links::links(content),
            _ => ask::linked(None),
        })),
        None if at == UNITS.len() + 1 => {
            let is_paper = view.header.robot.as_deref().is_some_and(|robot| robot.contains("method paper"));
            Err(Box::new(ask::simulated(is_paper)))
        }
        None => Err(Box::new(ask::recorded())),
    }
}

/// The chosen instrument, its identity and its uncertainty.
fn state(content: &InstrumentView, cx: &ScreenCx<'_>, page: &mut Page) {
    let robot = "none stated; sigma is estimated from the residuals";
    page.pair("profile", content.stated_sigma.as_deref().unwrap_or(robot));
    if let Some(cell) = &content.cell {
        page.pair("cell", &format!("{cell} (j: change)"));
    }
    let Some(choice) = &content.choice else {
        page.pair("chosen", "nothing yet: what measures the SMR?");
        return;
    };
    page.pair("chosen", choice);
    match (&content.identity, &cx.view.busy) {
        (Some(identity), _) => page.pair_as("answers", identity, Role::Ok),
        (None, Some(_)) => page.pair("answers", "connecting ..."),
        (None, None) => page.pair_as("answers", "NO RESPONSE: press r to reconnect, or choose another", Role::Warn),
    }
    if let Some(live) = &cx.view.live {
        if live.down.is_none() {
            page.pair("sees", &values::seen(live));
        }
        if let Some(text) = values::live(live).filter(|_| live.point_mm.is_some() || live.down.is_some()) {
            page.pair("", &text);
        }
    }
    if content.recorded_poses > 0 {
        page.pair("recorded", &counted(content.recorded_poses, "pose"));
    }
}

impl Screen for InstrumentScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        if is_fixed(cx) {
            return vec![Scroll::key_hint()];
        }
        let mut items = vec![KeyHint::new("Up/Down", "choose", 2), Scroll::key_hint()];
        if self.chooses(cx) {
            items.push(KeyHint::new("Enter", "use this instrument", 0));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if key.has_modifier() {
            return ScreenOutcome::Ignored;
        }
        let lines = self.page(cx, TEXT).len();
        if !is_fixed(cx) {
            if self.menu.on_key(key, WAYS.len()) {
                return ScreenOutcome::Changed;
            }
            match key.code {
                KeyCode::Enter if self.chooses(cx) => return self.choose(cx),
                KeyCode::Char('c') => {
                    self.menu.at.get_or_insert(0);
                    return ScreenOutcome::Changed;
                }
                _ => {}
            }
        }
        self.scroll.on_key(key, lines).into()
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        Parts::of(cx, area, TEXT, false).picture_place()
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let page = |columns| self.page(cx, columns);
        let parts = Parts::of(cx, area, TEXT, false);
        parts.draw(cx, buf, (page, self.scroll), |scene, area, buf| picture(cx, scene, area, buf));
    }
}
