//! The content of a step: what a screen gets, how it draws, and how it takes keys.
//!
//! A screen keeps only what is local (focus, scroll). It draws from the [`ViewModel`], and the preview from a [`Scene`] that the
//! driver makes whenever the view changes. Keys go to an open dialog first, then to the screen, then to the table of
//! [`keymap`](super::keymap), last to the camera of the preview.

mod capture;
mod deliver;
mod identify;
mod instrument;
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
use super::keymap::{Item, Key};
use super::preview::{Camera, Scene};
use super::theme::Theme;
use crate::session::set_up::Step;
use crate::wizard::Intent;
use crate::wizard::view::ViewModel;

/// What a screen sees.
#[derive(Clone, Copy, Debug)]
pub struct ScreenCx<'a> {
    /// What there is to show.
    pub view: &'a ViewModel,
    /// The robot at the configuration of this step, if there is one.
    pub scene: Option<&'a Scene>,
    /// From where the preview is seen; kept over all steps.
    pub camera: &'a Camera,
    /// How to show it.
    pub theme: Theme,
}

/// Where the picture of the robot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PicturePlace {
    /// Not shown, or its keys mean something else.
    Nowhere,
    /// Beside or below something else.
    Beside,
    /// It is what the page is for.
    Alone,
}

impl PicturePlace {
    /// Alone on its page, or beside something else.
    const fn of(is_alone: bool, is_beside: bool) -> Self {
        match (is_alone, is_beside) {
            (true, _) => Self::Alone,
            (false, true) => Self::Beside,
            (false, false) => Self::Nowhere,
        }
    }
}

/// What a screen makes of a key.
#[derive(Debug)]
pub enum Reply {
    /// It has no use for it.
    Ignored,
    /// Something local changed.
    Changed,
    /// The operator wants this.
    Intend(Intent),
    /// This has to be asked first.
    Ask(Box<Dialog>),
}

/// The content of a step.
pub trait Screen: fmt::Debug {
    /// Takes note of a new view, for what a screen remembers of earlier ones.
    fn see(&mut self, _view: &ViewModel) {}

    /// Its own keys, for footer and help; they stand for the same keys of the table.
    fn items(&self, cx: &ScreenCx<'_>) -> Vec<Item>;

    /// Takes a key.
    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> Reply;

    /// Takes pasted text.
    fn on_paste(&mut self, text: &str, cx: &ScreenCx<'_>) -> Reply;

    /// Where in `area` the robot is shown, so that its keys have a sense.
    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace;

    /// Draws itself; any size must do.
    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer);
}

/// The screen of a step, as it is when the step is entered.
pub fn of(step: Step) -> Box<dyn Screen> {
    match step {
        Step::Profile => Box::new(profile::ProfileScreen::default()),
        Step::Instrument => Box::new(instrument::InstrumentScreen::default()),
        Step::Target => Box::new(target::TargetScreen::default()),
        Step::Plan => Box::new(plan::Plan::default()),
        Step::Capture => Box::new(capture::Capture::default()),
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
