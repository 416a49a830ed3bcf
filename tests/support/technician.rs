//! A technician at the keys of a terminal of 80×24.

use std::time::Duration;

use super::place::Place;
use super::pty::{CTRL_U, ENTER, PATIENCE, Shown, Terminal};

/// A measurement, a reconnection or an identification on a busy machine.
pub(crate) const LONG: Duration = Duration::from_mins(1);

/// The terminal, and how many keys were pressed.
pub(crate) struct Technician {
    pub(crate) terminal: Terminal,
    pub(crate) keys: usize,
}

impl Technician {
    /// The wizard as it begins.
    pub(crate) fn start(place: &Place) -> Self {
        let terminal = Terminal::start(place.0.path(), &["wizard"], (80, 24));
        terminal.wait_for_step(1);
        Self { terminal, keys: 0 }
    }

    /// The wizard once more, in the same folder.
    pub(crate) fn begins_again(&mut self, place: &Place) {
        self.terminal = Self::start(place).terminal;
    }

    pub(crate) fn press(&mut self, keys: &str) {
        self.keys += keys.chars().count();
        self.terminal.send(keys);
    }

    /// Presses keys again and again until something is seen; they count once.
    pub(crate) fn presses_until(&mut self, keys: &str, what: &str, condition: impl FnMut(&Shown) -> bool) {
        self.keys += keys.chars().count();
        self.terminal.send_until(keys, what, condition);
    }

    /// Fills the fields of a form; `None` leaves one as it is.
    pub(crate) fn fill(&mut self, values: &[Option<&str>]) {
        for (index, value) in values.iter().enumerate() {
            if index > 0 {
                self.press("\t");
            }
            if let Some(value) = value {
                self.press(&format!("{CTRL_U}{value}"));
            }
        }
        self.press(ENTER);
    }

    #[track_caller]
    pub(crate) fn sees(&self, patience: Duration, what: &str, condition: impl FnMut(&Shown) -> bool) {
        assert!(self.terminal.comes(patience, condition), "{what} does not come:\n{}", self.terminal.text());
    }

    /// Presses a key when the screen offers it, and waits for what it does.
    #[track_caller]
    pub(crate) fn does(&mut self, keys: &str, what: &str, condition: impl FnMut(&Shown) -> bool) {
        self.press(keys);
        self.sees(LONG, what, condition);
    }

    /// Describes an arm that is not in the list by its data sheet; a mistyped dimension is seen at the flange and corrected.
    pub(crate) fn describes_an_arm(&mut self) {
        let form = |shown: &Shown| shown.has("from the drawing in its data sheet");
        self.does("d", "the form", form);
        let limits = Some("165, -110..110, -110..70, 160, 120, 180");
        let lengths = [Some("290"), Some("0"), Some("720"), Some("70"), Some("302"), Some("72"), Some("0")];
        self.fill(&[&[Some("Maker 6/0.6"), None], &lengths[..], &[limits]].concat());
        self.sees(PATIENCE, "the wrong flange", |shown| shown.has("(374.0, 0.0, 1080.0) mm"));
        self.does("d", "the form", form);
        self.fill(&[None, None, None, None, Some("270")]);
        self.sees(PATIENCE, "the flange", |shown| shown.has("(374.0, 0.0, 630.0) mm"));
        self.does(ENTER, "step 2", |shown| shown.step() == Some(2));
    }

    /// Describes the cell: accuracy from the list, place of the tracker, limits of the verdict.
    pub(crate) fn describes_the_cell(&mut self) {
        self.does("j", "the cell", |shown| shown.has("This cell."));
        self.press("\u{1b}[C\t\t\t");
        self.fill(&[None, Some("2500 0 700"), None, None, Some("0.3"), Some("0.8")]);
        self.sees(PATIENCE, "the accuracy", |shown| shown.has("Leica AT9xx"));
    }
}
