//! The wizard in a terminal: keys become intents, the view becomes characters.
//!
//! ```text
//! input thread ── keys ──┐                        ┌── dialog ── screen ── keymap ── camera
//! signal thread ─ Event ─┼─► Engine::wait ─► Ui ──┤
//! work threads ── Event ─┘                        └── frame, content, footer ─► terminal
//! ```
//!
//! - The driver waits in one place, the engine's channel; keys only wake it. Nothing runs while nothing happens.
//! - Drawing is a function of the `ViewModel` and of the local state in [`ui::Ui`]. It happens when one of them has changed, at
//!   most twenty times a second.
//! - Only `tui::terminal` enters and leaves the terminal. When the terminal is lost, nothing more is written to it, the session
//!   is closed and the process exits with 129.
//! - Roles instead of colours ([`theme`]), symbols with an ASCII form ([`glyphs`]), one table of keys ([`keymap`]).

pub mod dialog;
pub mod form;
pub mod frame;
pub mod glyphs;
mod help;
mod input;
pub mod keymap;
pub mod lines;
pub mod paint;
pub mod preview;
pub mod replay;
pub mod screen;
mod terminal;
pub mod theme;
pub mod ui;
mod values;
pub mod widget;

use std::io::{self, Stdout};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use ratatui::Terminal;
use ratatui::backend::{Backend as _, CrosstermBackend};
use ratatui::layout::{Position, Rect};

use crate::runtime::{CompletedIntent, Engine, signals};
use crate::session::journal::Entry;
use crate::wizard::{Activity, Intent, Notice, Wizard};
use input::Input;
use terminal::TerminalGuard;
use theme::Theme;
use ui::{Command, Ui};

/// Shortest time between two frames. More frames would only fill an SSH line.
const FRAME: Duration = Duration::from_millis(50);
/// Shortest time before a frame that a key has caused, without the picture of the robot: the operator is looking at it.
const FRAME_OF_KEY: Duration = Duration::from_millis(25);
/// Time for running work to finish before a change is drawn, so that saving an entry is only shown if it takes longer.
const SETTLE: Duration = Duration::from_millis(40);
/// Longest wait when there is nothing to do. An event always ends it.
const IDLE: Duration = Duration::from_hours(1);
/// Longest wait for the last entry of the journal after the terminal is lost.
const LAST_ENTRY: Duration = Duration::from_secs(10);
/// Number of the signal for a lost terminal.
const SIGHUP: i32 = 1;

/// Options of the terminal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Colours and glyphs.
    pub theme: Theme,
    /// Whether the program handles the mouse instead of the terminal.
    pub has_mouse: bool,
    /// Whether to use colours even if the environment disables them.
    pub forces_colour: bool,
    /// Whether the bell rings when a reading needs attention.
    pub has_bell: bool,
}

/// Why the program ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exit {
    /// Reason in words.
    pub cause: String,
    /// The signal that ended the program, if any.
    pub signal: Option<i32>,
    /// Folder of the session.
    pub folder: Option<String>,
    /// Folder of another session to continue.
    pub resumes: Option<String>,
    /// What was not saved, one description for each entry.
    pub unsaved: Vec<String>,
    /// Messages that could not be printed while the screen was up.
    pub remarks: Vec<String>,
}

impl Exit {
    fn of(wizard: &Wizard, signal: Option<i32>, remarks: Vec<String>) -> Self {
        let cause = wizard.ended().unwrap_or("ended").to_owned();
        let resumes = wizard.resumes().map(str::to_owned);
        let unsaved = wizard.unsaved().iter().map(Entry::describe).collect();
        Self { cause, signal, folder: wizard.folder().map(str::to_owned), resumes, unsaved, remarks }
    }
}

/// Called with the completed intents before the program ends, however it ends.
pub type AtEnd<'a> = &'a mut dyn FnMut(&[CompletedIntent]);

/// Something that drives the wizard in place of the operator, until a key is pressed.
pub trait Pilot {
    /// What is done next, now that the wizard is idle; `None` at the end.
    fn next(&mut self, wizard: &Wizard) -> Option<Move>;
}

/// A move of a pilot.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Time to read the screen before it.
    pub after: Duration,
    /// What is about to happen, in a sentence.
    pub caption: String,
    pub intent: Intent,
}

/// Runs the wizard in the terminal until it ends. When the terminal is lost, the process ends here.
///
/// # Errors
/// The terminal cannot be used, or the system refuses a thread.
pub fn run(engine: Engine, options: Options, at_end: AtEnd<'_>) -> io::Result<Exit> {
    watch(engine, options, None, at_end)
}

/// Runs the wizard in the terminal, driven by a pilot until the operator presses a key.
///
/// # Errors
/// As [`run`].
pub fn watch<'p>(
    mut engine: Engine,
    options: Options,
    pilot: Option<&'p mut (dyn Pilot + 'p)>,
    at_end: AtEnd<'_>,
) -> io::Result<Exit> {
    let received = signals::watch(engine.sender())?;
    if options.forces_colour {
        crossterm::style::force_color_output(true);
    }
    terminal::note_folder(engine.wizard().folder());
    terminal::install_panic_hook();
    let guard = TerminalGuard::enter(options.has_mouse)?;
    let events = engine.sender();
    let inputs = input::start(move || events.wake())?;
    let screen = Terminal::new(CrosstermBackend::new(io::stdout()))?;
    let mut driver = Driver {
        engine: &mut engine,
        inputs,
        screen,
        guard: &guard,
        ui: Ui::new(options.theme).with_bell(options.has_bell),
        pilot,
        planned: None,
    };
    let end = driver.run(&received);
    // Dropping it would write to the terminal once more, which may be gone.
    let Driver { screen, .. } = driver;
    std::mem::forget(screen);
    if end == End::Gone || received.signal() == Some(SIGHUP) {
        guard.abandon();
        close_without_terminal(&mut engine, at_end);
    }
    drop(guard);
    at_end(engine.completed_intents());
    let remarks = engine.end_recording().into_iter().chain(terminal::take_remarks()).collect();
    Ok(Exit::of(engine.wizard(), received.signal(), remarks))
}

/// Closes the session without touching the terminal, and ends the process.
fn close_without_terminal(engine: &mut Engine, at_end: AtEnd<'_>) -> ! {
    engine.abandon_recording();
    engine.shut_down("the terminal went away (SIGHUP)");
    while !engine.has_exited() && engine.wait(LAST_ENTRY) {}
    engine.release();
    at_end(engine.completed_intents());
    #[expect(clippy::exit, reason = "unwinding would write to a terminal that is gone, and abort")]
    std::process::exit(128 + SIGHUP)
}

/// How the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Exited,
    Gone,
}

struct Driver<'a, 'p> {
    engine: &'a mut Engine,
    inputs: Receiver<Input>,
    screen: Terminal<CrosstermBackend<Stdout>>,
    guard: &'a TerminalGuard,
    ui: Ui,
    /// Drives the wizard until a key is pressed.
    pilot: Option<&'p mut (dyn Pilot + 'p)>,
    /// The pilot's next move, and when it is due.
    planned: Option<(Instant, Intent)>,
}

impl Driver<'_, '_> {
    fn run(&mut self, received: &signals::SignalWatch) -> End {
        let mut view = self.engine.wizard().view();
        self.ui.refresh(&view, self.engine.wizard().session());
        let mut drawn: Option<Instant> = None;
        let mut changed: Option<Instant> = None;
        let mut is_due = true;
        let mut is_by_key = false;
        let mut has_picture = false;
        loop {
            if received.signal() == Some(SIGHUP) {
                return End::Gone;
            }
            if self.engine.has_exited() {
                return End::Exited;
            }
            let pace = if is_by_key && !has_picture { FRAME_OF_KEY } else { FRAME };
            let mut early = drawn.map_or(Duration::ZERO, |drawn| pace.saturating_sub(since(drawn)));
            if is_due && self.engine.wizard().activity() == Activity::Working {
                early = early.max(SETTLE.saturating_sub(since(*changed.get_or_insert_with(now))));
            }
            if self.ui.take_bell() && terminal::ring().is_err() {
                return End::Gone;
            }
            if is_due && early.is_zero() {
                let Ok(shows_picture) = self.draw(&view) else { return End::Gone };
                drawn = Some(now());
                has_picture = shows_picture;
                self.ui.note_picture(shows_picture);
                changed = None;
                (is_due, is_by_key) = (false, false);
            }
            let timeout = if is_due { early } else { IDLE };
            let timeout = self.fly().map_or(timeout, |until| timeout.min(until));
            if self.engine.wait(timeout) {
                // Handle all events that have arrived before drawing.
                while !self.engine.has_exited() && self.engine.wait(Duration::ZERO) {}
            }
            view = self.refresh(view, &mut is_due);
            while let Ok(input) = self.inputs.try_recv() {
                is_by_key = true;
                if self.takes_over(&input) {
                    view = self.refresh(view, &mut is_due);
                    continue;
                }
                match self.ui.on_input(input, &view) {
                    Command::None => {}
                    Command::Intent(intent) => {
                        self.engine.intend(intent);
                        view = self.refresh(view, &mut is_due);
                    }
                    Command::Suspend => {
                        if self.guard.suspend().is_err() || self.redraw().is_err() {
                            return End::Gone;
                        }
                        is_due = true;
                    }
                    Command::Redraw => {
                        if self.redraw().is_err() {
                            return End::Gone;
                        }
                        is_due = true;
                    }
                    Command::TerminalLost => return End::Gone,
                    Command::Shutdown => self.engine.shut_down("keys can no longer be read"),
                }
            }
            is_due |= self.ui.take_dirty();
        }
    }

    /// Lets the pilot plan or do its next move. Returns the time until it is due.
    fn fly(&mut self) -> Option<Duration> {
        let pilot = self.pilot.as_mut()?;
        if self.engine.wizard().activity() != Activity::Idle || self.engine.has_exited() {
            return None;
        }
        match self.planned.take() {
            Some((at, intent)) if at <= now() => {
                self.engine.intend(intent);
                // What it leads to is drawn first.
                Some(Duration::ZERO)
            }
            Some((at, intent)) => {
                self.planned = Some((at, intent));
                Some(at.saturating_duration_since(now()))
            }
            None => {
                if let Some(Move { after, caption, intent }) = pilot.next(self.engine.wizard()) {
                    self.engine.remark(Notice::info(caption).hint("you are watching; any key takes over"));
                    self.planned = Some((now() + after, intent));
                } else {
                    self.pilot = None;
                    self.engine.remark(Notice::info("this was the whole calibration").hint("the keys are yours now"));
                }
                Some(Duration::ZERO)
            }
        }
    }

    /// Whether an input only ends the pilot: the key that takes over does nothing else.
    fn takes_over(&mut self, input: &Input) -> bool {
        if self.pilot.is_none() || !matches!(input, Input::Key(_) | Input::Paste(_)) {
            return false;
        }
        (self.pilot, self.planned) = (None, None);
        self.engine.remark(Notice::info("you have taken over").hint("the footer shows what the keys do"));
        true
    }

    /// Returns the current view. If it has changed, a frame is due.
    fn refresh(&mut self, before: crate::wizard::ViewModel, is_due: &mut bool) -> crate::wizard::ViewModel {
        // They are not used here and must not pile up.
        self.engine.outputs().for_each(drop);
        let view = self.engine.wizard().view();
        if view == before {
            return before;
        }
        terminal::note_folder(view.header.folder.as_deref());
        self.ui.refresh(&view, self.engine.wizard().session());
        *is_due = true;
        view
    }

    /// Draws a frame. Returns whether the robot is in it.
    fn draw(&mut self, view: &crate::wizard::ViewModel) -> io::Result<bool> {
        let ui = &self.ui;
        let area = self
            .screen
            .draw(|frame| {
                let area = frame.area();
                ui.draw(view, area, frame.buffer_mut());
            })?
            .area;
        Ok(ui.shows_picture(view, area))
    }

    /// Makes the next frame redraw everything, without querying the terminal.
    fn redraw(&mut self) -> io::Result<()> {
        let size = self.screen.backend().size()?;
        self.screen.resize(Rect::from((Position::ORIGIN, size)))
    }
}

fn now() -> Instant {
    #[expect(clippy::disallowed_methods, reason = "the pace of frames; nothing else depends on it")]
    Instant::now()
}

fn since(earlier: Instant) -> Duration {
    now().saturating_duration_since(earlier)
}
