//! What the tests of screens share: a frame around a screen, a robot to show.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{Screen, ScreenCx, ScreenOutcome};
use crate::profile::{Profile, builtin};
use crate::session::set_up::Step;
use crate::tui::glyphs::Glyphs;
use crate::tui::keymap::{self, Key};
use crate::tui::preview::{Camera, Scene};
use crate::tui::theme::Theme;
use crate::tui::{frame, paint};
use crate::units::DEGREE;
use crate::wizard::view::{Content, ViewModel, purpose};
use crate::wizard::{IntentInfo, Wizard};

pub(crate) fn themes() -> [Theme; 2] {
    [Theme { has_colour: true, glyphs: Glyphs::Unicode }, Theme { has_colour: false, glyphs: Glyphs::Ascii }]
}

/// A view of a step in the middle of a session.
pub(crate) fn view(step: Step, content: Content, intents: Vec<IntentInfo>) -> ViewModel {
    let mut view = Wizard::new(jiff::Timestamp::UNIX_EPOCH).view();
    view.header.step = step;
    view.header.number = step.number();
    view.purpose = purpose(step);
    view.header.robot = Some("Soochow six-axis arm of the method paper".to_owned());
    view.header.session = Some("soochow-20260105".to_owned());
    view.header.instrument = Some("simulated tracker, seed 1".to_owned());
    view.header.samples = 12;
    view.header.elapsed_min = 34.2;
    view.content = content;
    view.intents = intents;
    view
}

pub(crate) fn scene() -> Scene {
    let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
    Scene::of(&profile, &[10.0, 15.0, -10.0, 20.0, 35.0, 0.0].map(|angle| angle * DEGREE))
}

/// The whole terminal.
pub(crate) fn drawn(screen: &dyn Screen, view: &ViewModel, theme: Theme, (width, height): (u16, u16)) -> Buffer {
    let (scene, camera) = (scene(), Camera::default());
    let cx = ScreenCx { view, scene: Some(&scene), camera: &camera, theme };
    let own = screen.key_hints(&cx);
    let mut items = keymap::key_hints(&view.intents, theme.glyphs);
    items.retain(|item| !own.iter().any(|own| own.key == item.key));
    items.extend(own);
    items.sort_by_key(|item| item.rank);
    let mut buf = Buffer::empty(Rect::new(0, 0, width, height));
    let area = buf.area;
    if let Some(content) = frame::draw(view, &items, theme, area, &mut buf) {
        screen.draw(&cx, content, &mut buf);
    }
    buf
}

pub(crate) fn press(screen: &mut dyn Screen, view: &ViewModel, key: Key) -> ScreenOutcome {
    let (scene, camera) = (scene(), Camera::default());
    screen.on_key(key, &ScreenCx { view, scene: Some(&scene), camera: &camera, theme: themes()[0] })
}

pub(crate) fn paste(screen: &mut dyn Screen, view: &ViewModel, text: &str) -> ScreenOutcome {
    let (scene, camera) = (scene(), Camera::default());
    screen.on_paste(text, &ScreenCx { view, scene: Some(&scene), camera: &camera, theme: themes()[0] })
}

/// Draws the content alone into `area` of a larger buffer and says whether a cell outside was touched.
pub(crate) fn leaks(screen: &dyn Screen, view: &ViewModel, theme: Theme, area: Rect) -> bool {
    let mut buf = Buffer::empty(Rect::new(0, 0, 140, 50));
    for cell in &mut buf.content {
        cell.set_char('~');
    }
    let area = area.intersection(buf.area);
    let (scene, camera) = (scene(), Camera::default());
    screen.draw(&ScreenCx { view, scene: Some(&scene), camera: &camera, theme }, area, &mut buf);
    let is_outside = |x: u16, y: u16| !area.contains((x, y).into());
    (0..50).any(|y| (0..140).any(|x| is_outside(x, y) && buf[(x, y)].symbol() != "~"))
}

pub(crate) fn shown(buf: &Buffer) -> String {
    paint::snapshot(buf)
}
