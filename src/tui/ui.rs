//! The user interface without a terminal: screen, dialog, help and camera.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::dialog::{Dialog, DialogOutcome, taken};
use super::input::Input;
use super::keymap::{self, Action, Key, KeyHint, LocalAction};
use super::preview::{Camera, Scene};
use super::screen::{self, PicturePlace, Screen, ScreenCx, ScreenOutcome};
use super::theme::Theme;
use super::{frame, help, paint};
use crate::profile::{Profile, builtin};
use crate::session::set_up::Step;
use crate::session::state::Session;
use crate::units::{DEGREE, MILLIMETRE};
use crate::wizard::Intent;
use crate::wizard::notice::Severity;
use crate::wizard::view::{Content, JointShown, ViewModel};

/// Rows of a screen below a dialog that are worth showing.
const FEWEST_BELOW: u16 = 8;

/// A command to the driver.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    None,
    /// Send an intent to the wizard.
    Intent(Intent),
    Suspend,
    /// Redraw the whole screen.
    Redraw,
    /// Stop, because the terminal is gone.
    TerminalLost,
    /// Shut down, because keys can no longer be read.
    Shutdown,
}

/// State that exists only in the terminal: screen, dialog, camera.
#[derive(Debug)]
pub struct Ui {
    theme: Theme,
    step: Step,
    screen: Box<dyn Screen>,
    dialog: Option<Dialog>,
    /// The dialog that was submitted last. What was typed into it is proposed again if it is refused.
    submitted: Option<Dialog>,
    /// Scroll position of the help page; `None` if it is closed.
    help: Option<usize>,
    camera: Camera,
    scene: Option<Scene>,
    last_frame: LastFrame,
    /// The last key, if it had no effect.
    idle_key: Option<Key>,
    /// Whether local state changed since the last frame.
    is_dirty: bool,
    /// Whether the bell rings when something needs attention.
    has_bell: bool,
    /// What needs attention, if anything.
    attention: Option<Attention>,
    /// Whether the bell has to ring.
    is_ringing: bool,
}

/// Whether the last frame showed the robot: only then keys turn it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LastFrame {
    WithRobot,
    WithoutRobot,
}

/// An event of the capture step that an operator who is not looking at the screen should not miss.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Attention {
    /// The sample of this measurement is questioned.
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
    /// A new user interface, before the first view.
    pub fn new(theme: Theme) -> Self {
        Self {
            theme,
            step: Step::Profile,
            screen: screen::of(Step::Profile),
            dialog: None,
            submitted: None,
            help: None,
            camera: Camera::default(),
            scene: None,
            last_frame: LastFrame::WithRobot,
            idle_key: None,
            is_dirty: true,
            has_bell: false,
            attention: None,
            is_ringing: false,
        }
    }

    /// Turns the bell on or off.
    #[must_use]
    pub const fn with_bell(mut self, has_bell: bool) -> Self {
        self.has_bell = has_bell;
        self
    }

    /// Returns whether the bell has to ring, and clears the request.
    pub const fn take_bell(&mut self) -> bool {
        std::mem::replace(&mut self.is_ringing, false)
    }

    /// Takes a new view. The session is only used for the preview.
    pub fn refresh(&mut self, view: &ViewModel, session: &Session) {
        if view.header.step != self.step {
            self.step = view.header.step;
            self.screen = screen::of(self.step);
            self.dialog = None;
            self.help = None;
        }
        self.screen.see(view);
        if let Some(dialog) = &mut self.dialog {
            dialog.see(&taken(view));
        }
        self.scene = scene(view, session);
        let attention = Attention::of(view);
        self.is_ringing |= self.has_bell && attention.is_some() && attention != self.attention;
        self.attention = attention;
        self.is_dirty = true;
    }

    /// Returns whether local state changed, and clears the flag.
    pub fn take_dirty(&mut self) -> bool {
        std::mem::take(&mut self.is_dirty)
    }

    /// Takes note of whether the robot is in the frame that was drawn.
    pub const fn note_picture(&mut self, has_picture: bool) {
        self.last_frame = if has_picture { LastFrame::WithRobot } else { LastFrame::WithoutRobot };
    }

    pub fn on_input(&mut self, input: Input, view: &ViewModel) -> Command {
        let was_dirty = std::mem::replace(&mut self.is_dirty, true);
        let command = self.take_input(input, view);
        // A key without effect must not clear the change of an earlier one.
        self.is_dirty |= was_dirty;
        command
    }

    fn take_input(&mut self, input: Input, view: &ViewModel) -> Command {
        match input {
            Input::Gone => Command::TerminalLost,
            Input::Broken => Command::Shutdown,
            Input::Resize => Command::Redraw,
            Input::Key(key) => self.on_key(key, view),
            Input::Paste(text) => {
                if let Some(dialog) = &mut self.dialog {
                    dialog.paste(&text);
                    return Command::None;
                }
                let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
                let outcome = self.screen.on_paste(&text, &cx);
                self.on_outcome(outcome, view).unwrap_or(Command::None)
            }
            Input::Scroll(lines) => {
                let code = if lines < 0 { KeyCode::PageUp } else { KeyCode::PageDown };
                self.on_key(Key::plain_code(code), view)
            }
        }
    }

    fn on_key(&mut self, key: Key, view: &ViewModel) -> Command {
        let was_idle = self.idle_key.take().is_some();
        if let Some(dialog) = &mut self.dialog {
            if key == Key::ctrl('z') {
                return Command::Suspend;
            }
            return match dialog.on_key(key) {
                DialogOutcome::Open => Command::None,
                DialogOutcome::Closed => {
                    self.dialog = None;
                    Command::None
                }
                DialogOutcome::Submitted(intent) => {
                    self.submitted = self.dialog.take();
                    Command::Intent(intent)
                }
            };
        }
        if let Some(scroll) = &mut self.help {
            match key.code {
                KeyCode::Down | KeyCode::PageDown | KeyCode::Char(' ') => *scroll += 5,
                KeyCode::Up | KeyCode::PageUp => *scroll = scroll.saturating_sub(5),
                _ => self.help = None,
            }
            return Command::None;
        }
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        let outcome = self.screen.on_key(key, &cx);
        if let Some(command) = self.on_outcome(outcome, view) {
            return command;
        }
        match keymap::action(key, &view.intents) {
            Some(Action::Offer(info)) => {
                // A blocked intent needs no dialog: the wizard answers with the reason.
                let dialog = Dialog::before(&info, view).filter(|_| info.is_enabled());
                self.dialog = dialog.map(|dialog| self.again_if_refused(dialog, view));
                if self.dialog.is_some() { Command::None } else { Command::Intent(info.intent) }
            }
            Some(Action::Local(LocalAction::Help)) => {
                self.help = Some(0);
                Command::None
            }
            Some(Action::Local(LocalAction::Suspend)) => Command::Suspend,
            Some(Action::Local(LocalAction::Redraw)) => Command::Redraw,
            Some(Action::Local(LocalAction::ToggleBell)) => {
                self.has_bell = !self.has_bell;
                // Ring once, so that the operator knows the sound.
                self.is_ringing = self.has_bell;
                Command::None
            }
            None => {
                let is_shown = self.last_frame == LastFrame::WithRobot && self.scene.is_some();
                let turns_the_robot = is_shown && self.camera.on_key(key);
                let is_letter = matches!(key.code, KeyCode::Char(_)) && !key.has_modifier();
                self.idle_key = Some(key).filter(|_| is_letter && !turns_the_robot);
                self.is_dirty = turns_the_robot || was_idle || self.idle_key.is_some();
                Command::None
            }
        }
    }

    /// The command that follows from a screen's outcome; `None` if it did not handle the input.
    fn on_outcome(&mut self, outcome: ScreenOutcome, view: &ViewModel) -> Option<Command> {
        match outcome {
            ScreenOutcome::Ignored => None,
            ScreenOutcome::Changed => Some(Command::None),
            ScreenOutcome::Intent(intent) => Some(Command::Intent(intent)),
            ScreenOutcome::Open(dialog) => {
                self.dialog = Some(self.again_if_refused(*dialog, view));
                Some(Command::None)
            }
        }
    }

    /// The dialog as it was submitted, if the wizard refused that; else the new one.
    fn again_if_refused(&mut self, dialog: Dialog, view: &ViewModel) -> Dialog {
        let is_refused = view.notice.as_ref().is_some_and(|notice| notice.severity >= Severity::Error);
        match self.submitted.take() {
            Some(before) if is_refused => dialog.with_answers_of(before),
            _ => dialog,
        }
    }

    fn key_hints(&self, cx: &ScreenCx<'_>, area: Rect) -> Vec<KeyHint> {
        match (&self.dialog, self.help) {
            (Some(dialog), _) => dialog.key_hints(),
            (None, Some(_)) => {
                vec![KeyHint::new("any key", "back", 0), KeyHint::new("Up/Down", "scroll", 1)]
            }
            (None, None) => {
                let mut items = self.page_key_hints(cx, area);
                if let Some(key) = self.idle_key {
                    let hint = KeyHint::new(key.name(self.theme.glyphs), "has no effect here", 0);
                    items.insert(items.len().min(1), hint);
                }
                items
            }
        }
    }

    /// Keys of the page, with those of the table.
    fn page_key_hints(&self, cx: &ScreenCx<'_>, area: Rect) -> Vec<KeyHint> {
        let own = self.screen.key_hints(cx);
        let mut items = keymap::key_hints(&cx.view.intents, self.theme.glyphs);
        // The screen handles keys first, so its keys hide those of the table.
        items.retain(|item| !own.iter().any(|one| one.key == item.key));
        if self.screen.takes_letters() {
            items.retain(|item| item.key.chars().count() > 1);
        }
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
        items.push(KeyHint::new(arrows, "turn the picture", rank));
        items.sort_by_key(|item| item.rank);
        items
    }

    /// Where in `area` the page with these keys shows the robot.
    fn picture_place(&self, cx: &ScreenCx<'_>, items: &[KeyHint], area: Rect) -> PicturePlace {
        let content = frame::content_area(cx.view, items, self.theme, area);
        content.map_or(PicturePlace::Nowhere, |content| self.screen.picture_place(cx, content))
    }

    /// Whether the robot is shown in `area`.
    pub fn shows_picture(&self, view: &ViewModel, area: Rect) -> bool {
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        self.dialog.is_none()
            && self.help.is_none()
            && self.picture_place(&cx, &self.key_hints(&cx, area), area) != PicturePlace::Nowhere
    }

    /// Draws the whole terminal, without side effects.
    pub fn draw(&self, view: &ViewModel, area: Rect, buf: &mut Buffer) {
        let cx = ScreenCx { view, scene: self.scene.as_ref(), camera: &self.camera, theme: self.theme };
        let Some(content) = frame::draw(view, &self.key_hints(&cx, area), self.theme, area, buf) else { return };
        match (&self.dialog, self.help) {
            (Some(dialog), _) => {
                let above = dialog.rows_above().filter(|above| content.height > above + FEWEST_BELOW);
                let rows = above.unwrap_or(content.height);
                dialog.draw(self.theme, paint::band(content, 0, rows), buf);
                if above.is_some() {
                    self.screen.draw(&cx, paint::band(content, rows, content.height), buf);
                }
            }
            (None, Some(scroll)) => {
                help::draw(&self.page_key_hints(&cx, area), scroll, self.theme, content, buf);
            }
            (None, None) => self.screen.draw(&cx, content, buf),
        }
    }
}

/// The scene of the preview in this step.
fn scene(view: &ViewModel, session: &Session) -> Option<Scene> {
    match &view.content {
        Content::Profile(content) => {
            let chosen = content.chosen.as_ref()?;
            if let Some(profile) = &chosen.profile {
                return Some(Scene::at_rest(profile));
            }
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
        Content::Target(content) => {
            let check = content.joint_check.as_ref().map(|check| &check.joints);
            let circles = content.circles.as_ref().map(|circles| &circles.joints);
            let shown = check.into_iter().chain(circles).find(|joints| !joints.is_empty());
            shown.map_or_else(|| Scene::of_session(session, None), |joints| at_joints(session, joints))
        }
        Content::Instrument(_) => Scene::of_session(session, None),
        Content::Capture(content) => Scene::of_session(session, content.row),
        Content::Identify(_) => Scene::of_identified(session, false),
        Content::Verify(_) => Scene::of_identified(session, true),
        Content::Deliver(_) => None,
    }
}

/// The robot at joint values that are shown.
fn at_joints(session: &Session, joints: &[JointShown]) -> Option<Scene> {
    let profile = &session.robot.as_ref()?.profile;
    let size = |unit: &str| if unit == "deg" { DEGREE } else { MILLIMETRE };
    let q: Vec<f64> = joints.iter().map(|joint| joint.value * size(&joint.unit)).collect();
    (q.len() == profile.chain().dof()).then(|| Scene::of(profile, &q))
}

#[cfg(test)]
mod tests;
