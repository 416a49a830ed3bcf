//! What the terminal shows and does with keys, without a terminal: screen, dialog, help, camera.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::dialog::{Answer, Dialog};
use super::input::Input;
use super::keymap::{self, Item, Key, Local, Meaning};
use super::preview::{Camera, Scene};
use super::screen::{self, PicturePlace, Reply, Screen, ScreenCx};
use super::theme::Theme;
use super::{frame, help};
use crate::profile::{Profile, builtin};
use crate::session::set_up::Step;
use crate::session::state::Session;
use crate::units::{DEGREE, MILLIMETRE};
use crate::wizard::Intent;
use crate::wizard::view::{Content, TargetView, ViewModel};

/// What the driver is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Nothing.
    None,
    /// Tell the wizard.
    Intend(Intent),
    /// Back to the shell for a while.
    Suspend,
    /// Draw everything anew.
    Redraw,
    /// The terminal is gone.
    Gone,
    /// End: no key can be read any more.
    End,
}

/// Everything local.
#[derive(Debug)]
pub struct Ui {
    theme: Theme,
    step: Step,
    screen: Box<dyn Screen>,
    dialog: Option<Dialog>,
    /// Lines scrolled; none: no help.
    help: Option<usize>,
    camera: Camera,
    scene: Option<Scene>,
    /// Something local changed since it was drawn.
    is_dirty: bool,
    /// Whether the bell rings when something needs attention.
    has_bell: bool,
    /// What needs attention.
    attention: Option<Attention>,
    /// The bell is to ring.
    is_ringing: bool,
}

/// Something in the capture step that nobody should miss with the back to the screen.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Attention {
    /// The sample of this measurement is in question.
    Finding(u64),
    /// A reading is held back.
    Held(String),
}

impl Attention {
    fn of(view: &ViewModel) -> Option<Self> {
        let Content::Capture(content) = &view.content else { return None };
        let finding = content.finding.as_ref().map(|finding| Self::Finding(finding.measurement));
        finding.or_else(|| content.held.clone().map(Self::Held))
    }
}

impl Ui {
    /// Before anything is known.
    pub fn new(theme: Theme) -> Self {
        Self {
            theme,
            step: Step::Profile,
            screen: screen::of(Step::Profile),
            dialog: None,
            help: None,
            camera: Camera::default(),
            scene: None,
            is_dirty: true,
            has_bell: false,
            attention: None,
            is_ringing: false,
        }
    }

    /// With the bell on or off.
    #[must_use]
    pub const fn with_bell(mut self, has_bell: bool) -> Self {
        self.has_bell = has_bell;
        self
    }

    /// Whether the bell is to ring since it was asked last.
    pub const fn take_bell(&mut self) -> bool {
        std::mem::replace(&mut self.is_ringing, false)
    }

    /// Takes note of a new view. The session gives the preview its numbers and nothing else.
    pub fn refresh(&mut self, view: &ViewModel, session: &Session) {
        if view.header.step != self.step {
            self.step = view.header.step;
            self.screen = screen::of(self.step);
            self.dialog = None;
            self.help = None;
        }
        self.screen.see(view);
        self.scene = scene(view, session);
        let attention = Attention::of(view);
        self.is_ringing |= self.has_bell && attention.is_some() && attention != self.attention;
        self.attention = attention;
        self.is_dirty = true;
    }

    /// Whether something local changed since it was asked last.
    pub fn take_dirty(&mut self) -> bool {
        std::mem::take(&mut self.is_dirty)
    }

    /// Takes an input.
    pub fn on_input(&mut self, input: Input, view: &ViewModel) -> Wish {
        let was_dirty = std::mem::replace(&mut self.is_dirty, true);
        let wish = self.take_input(input, view);
        // A key without effect does not take back what one before it has changed.
        self.is_dirty |= was_dirty;
        wish
    }

    fn take_input(&mut self, input: Input, view: &ViewModel) -> Wish {
        match input {
            Input::Gone => Wish::Gone,
            Input::Broken => Wish::End,
            Input::Resize => Wish::Redraw,
            Input::Key(key) => self.on_key(key, view),
            Input::Paste(text) => {
                if let Some(dialog) = &mut self.dialog {
                    dialog.paste(&text);
                    return Wish::None;
                }
                let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
                let reply = self.screen.on_paste(&text, &cx);
                self.on_reply(reply).unwrap_or(Wish::None)
            }
            Input::Scroll(lines) => {
                let code = if lines < 0 { KeyCode::PageUp } else { KeyCode::PageDown };
                self.on_key(Key::plain_code(code), view)
            }
        }
    }

    fn on_key(&mut self, key: Key, view: &ViewModel) -> Wish {
        if let Some(dialog) = &mut self.dialog {
            if key == Key::ctrl('z') {
                return Wish::Suspend;
            }
            return match dialog.on_key(key) {
                Answer::Open => Wish::None,
                Answer::Closed => {
                    self.dialog = None;
                    Wish::None
                }
                Answer::Intend(intent) => {
                    self.dialog = None;
                    Wish::Intend(intent)
                }
            };
        }
        if let Some(scroll) = &mut self.help {
            match key.code {
                KeyCode::Down | KeyCode::PageDown | KeyCode::Char(' ') => *scroll += 5,
                KeyCode::Up | KeyCode::PageUp => *scroll = scroll.saturating_sub(5),
                _ => self.help = None,
            }
            return Wish::None;
        }
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        let reply = self.screen.on_key(key, &cx);
        if let Some(wish) = self.on_reply(reply) {
            return wish;
        }
        match keymap::meaning(key, &view.intents) {
            Some(Meaning::Offer(info)) => {
                // What cannot be done now is not asked about: the wizard says why.
                self.dialog = Dialog::before(&info, view).filter(|_| info.is_enabled());
                if self.dialog.is_some() { Wish::None } else { Wish::Intend(info.intent) }
            }
            Some(Meaning::Local(Local::Help)) => {
                self.help = Some(0);
                Wish::None
            }
            Some(Meaning::Local(Local::Suspend)) => Wish::Suspend,
            Some(Meaning::Local(Local::Redraw)) => Wish::Redraw,
            Some(Meaning::Local(Local::Bell)) => {
                self.has_bell = !self.has_bell;
                // It shows what it is like.
                self.is_ringing = self.has_bell;
                Wish::None
            }
            None => {
                self.is_dirty = self.scene.is_some() && self.camera.on_key(key);
                Wish::None
            }
        }
    }

    /// What a screen's reply means; none: it had no use for the input.
    fn on_reply(&mut self, reply: Reply) -> Option<Wish> {
        match reply {
            Reply::Ignored => None,
            Reply::Changed => Some(Wish::None),
            Reply::Intend(intent) => Some(Wish::Intend(intent)),
            Reply::Ask(dialog) => {
                self.dialog = Some(*dialog);
                Some(Wish::None)
            }
        }
    }

    fn items(&self, cx: &ScreenCx<'_>, area: Rect) -> Vec<Item> {
        match (&self.dialog, self.help) {
            (Some(dialog), _) => dialog.items(),
            (None, Some(_)) => {
                vec![Item::new("any key", "back", 0), Item::new("Up/Down", "scroll", 1)]
            }
            (None, None) => self.page_items(cx, area),
        }
    }

    /// Keys of the screen itself.
    fn page_items(&self, cx: &ScreenCx<'_>, area: Rect) -> Vec<Item> {
        let own = self.screen.items(cx);
        let mut items = keymap::items(&cx.view.intents, self.theme.glyphs);
        // The screen is asked first: its keys hide those of the table.
        items.retain(|item| !own.iter().any(|one| one.key == item.key));
        let bell = keymap::BELL.name(self.theme.glyphs);
        for item in items.iter_mut().filter(|item| item.key == bell) {
            let now = if self.has_bell { "on" } else { "off" };
            item.label = format!("bell when a reading needs attention: now {now}");
        }
        let glyphs = self.theme.glyphs;
        let takes_up_and_down = own.iter().any(|item| item.key == "Up/Down");
        let arrows = if takes_up_and_down { glyphs.sideways() } else { glyphs.arrows() };
        items.extend(own);
        items.sort_by_key(|item| item.rank);
        let rank = match self.picture_place(cx, &items, area) {
            PicturePlace::Nowhere => return items,
            PicturePlace::Beside => 8,
            PicturePlace::Alone => 3,
        };
        items.push(Item::new(arrows, "turn the picture", rank));
        items.sort_by_key(|item| item.rank);
        items
    }

    /// Where in `area` the page with these keys shows the robot.
    fn picture_place(&self, cx: &ScreenCx<'_>, items: &[Item], area: Rect) -> PicturePlace {
        let content = frame::room(cx.view, items, self.theme, area);
        content.map_or(PicturePlace::Nowhere, |content| self.screen.picture_place(cx, content))
    }

    /// Whether the robot is to be seen in `area`.
    pub fn shows_picture(&self, view: &ViewModel, area: Rect) -> bool {
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        self.dialog.is_none()
            && self.help.is_none()
            && self.picture_place(&cx, &self.items(&cx, area), area) != PicturePlace::Nowhere
    }

    /// Draws everything; nothing changes by it.
    pub fn draw(&self, view: &ViewModel, area: Rect, buf: &mut Buffer) {
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        let Some(content) = frame::draw(view, &self.items(&cx, area), self.theme, area, buf) else { return };
        match (&self.dialog, self.help) {
            (Some(dialog), _) => dialog.draw(self.theme, content, buf),
            (None, Some(scroll)) => {
                help::draw(&self.page_items(&cx, area), scroll, self.theme, content, buf);
            }
            (None, None) => self.screen.draw(&cx, content, buf),
        }
    }
}

/// What the preview shows in this step.
fn scene(view: &ViewModel, session: &Session) -> Option<Scene> {
    match &view.content {
        Content::Profile(content) => {
            let chosen = content.chosen.as_ref()?;
            match builtin(&chosen.name).and_then(|text| Profile::parse(text, &chosen.name).ok()) {
                Some((profile, _)) => Some(Scene::at_rest(&profile)),
                None => Scene::of_session(session, None),
            }
        }
        Content::Plan(content) => {
            let scene = Scene::of_session(session, None)?;
            Some(match &content.summary {
                Some(summary) => scene.with_points(summary.poses.iter().filter_map(|pose| pose.point_in_base_mm)),
                None => scene,
            })
        }
        Content::Target(TargetView { circles: Some(circles), .. }) if !circles.joints.is_empty() => {
            let profile = &session.robot.as_ref()?.profile;
            let size = |unit: &str| if unit == "deg" { DEGREE } else { MILLIMETRE };
            let q: Vec<f64> = circles.joints.iter().map(|joint| joint.value * size(&joint.unit)).collect();
            (q.len() == profile.chain().dof()).then(|| Scene::of(profile, &q))
        }
        Content::Instrument(_) | Content::Target(_) => Scene::of_session(session, None),
        Content::Capture(content) => Scene::of_session(session, content.row),
        Content::Identify(_) => Scene::of_identified(session, false),
        Content::Verify(_) => Scene::of_identified(session, true),
        Content::Deliver(_) => None,
    }
}

#[cfg(test)]
mod tests;
