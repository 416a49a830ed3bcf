//! The content of a step: how a screen draws and how it handles keys.
//!
//! A screen keeps only local state (focus, scroll). It draws from the [`ViewModel`], and the preview from a [`Scene`] that the
//! driver builds whenever the view changes. Keys go to an open dialog first, then to the screen, then to the table of
//! [`keymap`](super::keymap), and last to the camera of the preview.

mod capture;
mod deliver;
mod identify;
pub(super) mod instrument;
mod menu;
mod page;
mod plan;
mod profile;
mod target;
mod verify;

use std::fmt;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::dialog::Dialog;
use super::keymap::{Key, KeyHint};
use super::preview::{Camera, Scene};
use super::theme::Theme;
use crate::session::set_up::Step;
use crate::wizard::Intent;
use crate::wizard::view::ViewModel;

/// What a screen draws from.
#[derive(Clone, Copy, Debug)]
pub struct ScreenCx<'a> {
    pub view: &'a ViewModel,
    /// The robot at the configuration of this step, if there is one.
    pub scene: Option<&'a Scene>,
    /// Camera of the preview, which is kept over all steps.
    pub camera: &'a Camera,
    pub theme: Theme,
}

/// Place of the robot's picture on a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PicturePlace {
    /// Not shown, or its keys have another use.
    Nowhere,
    /// Beside or below other content.
    Beside,
    /// Alone on its page.
    Alone,
}

impl PicturePlace {
    const fn of(is_alone: bool, is_beside: bool) -> Self {
        match (is_alone, is_beside) {
            (true, _) => Self::Alone,
            (false, true) => Self::Beside,
            (false, false) => Self::Nowhere,
        }
    }
}

/// What a screen did with a key.
#[derive(Debug)]
pub enum ScreenOutcome {
    /// Not handled.
    Ignored,
    /// Changed local state.
    Changed,
    /// Sends an intent.
    Intent(Intent),
    /// Opens a dialog.
    Open(Box<Dialog>),
}

/// Whether local state changed.
impl From<bool> for ScreenOutcome {
    fn from(has_changed: bool) -> Self {
        if has_changed { Self::Changed } else { Self::Ignored }
    }
}

/// The content of a step.
pub trait Screen: fmt::Debug {
    /// Observes a new view, for what a screen remembers of earlier ones.
    fn see(&mut self, _view: &ViewModel) {}

    /// Keys that the screen handles itself, for footer and help. They replace the same keys of the table.
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint>;

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome;

    /// Whether letters are typed into a field of the screen, so that those of the table have no effect.
    fn takes_letters(&self) -> bool {
        false
    }

    /// Handles pasted text.
    fn on_paste(&mut self, _text: &str, _cx: &ScreenCx<'_>) -> ScreenOutcome {
        ScreenOutcome::Ignored
    }

    /// Where in `area` the robot is shown, so that the keys of the picture make sense.
    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace;

    /// Draws the content; must cope with any size.
    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer);
}

/// A new screen for a step.
pub fn of(step: Step) -> Box<dyn Screen> {
    match step {
        Step::Profile => Box::new(profile::ProfileScreen::default()),
        Step::Instrument => Box::new(instrument::InstrumentScreen::default()),
        Step::Target => Box::new(target::TargetScreen::default()),
        Step::Plan => Box::new(plan::PlanScreen::default()),
        Step::Capture => Box::new(capture::CaptureScreen::default()),
        Step::Identify => Box::new(identify::IdentifyScreen::default()),
        Step::Verify => Box::new(verify::VerifyScreen::default()),
        Step::Deliver => Box::new(deliver::DeliverScreen::default()),
    }
}

#[cfg(test)]
pub(crate) mod bench;
#[cfg(test)]
pub(crate) use capture::tests as capture_tests;
#[cfg(test)]
mod tests;
