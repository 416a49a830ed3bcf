//! Replay of a session: the fold of its journal up to any entry. Nothing is locked and nothing is written.

mod draw;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use crossterm::event::KeyCode;
use ratatui::Terminal;
use ratatui::backend::{Backend as _, CrosstermBackend};
use ratatui::layout::{Position, Rect};

use super::input::{self, Input};
use super::keymap::Key;
use super::preview::{Camera, Scene};
use super::terminal::{self, TerminalGuard};
use super::theme::Theme;
use super::{FRAME, IDLE, Options, SIGHUP};
use crate::runtime::signals;
use crate::session::journal::{Entry, Journal, Line};
use crate::session::state::{FoldError, Session};
use crate::session::summary::IdentificationSummary;

/// Entries per second, slowest to fastest.
const SPEEDS: [f64; 7] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 20.0];
/// Lines that PgUp and PgDn scroll.
const PAGE: usize = 8;

/// The page below the entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Page {
    /// The neighbouring entries and the robot.
    #[default]
    Robot,
    /// The samples so far.
    Samples,
    /// The result, once there is one.
    Result,
}

/// A command to the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayCommand {
    None,
    /// Draw a frame.
    Draw,
    /// Redraw the whole screen.
    Redraw,
    Suspend,
    /// Quit the replay.
    Quit,
}

/// A journal and a position in it.
#[derive(Clone, Debug)]
pub struct Replay {
    lines: Vec<Line>,
    /// Index of the entry that is shown.
    place: usize,
    /// The session up to that entry.
    session: Session,
    is_playing: bool,
    /// Whether the page of keys is open.
    has_help: bool,
    speed: usize,
    page: Page,
    scroll: usize,
    camera: Camera,
    theme: Theme,
    /// Formats the tables of a result.
    tables: fn(&IdentificationSummary) -> String,
}

impl Replay {
    /// A replay at the first entry. `tables` formats a result.
    ///
    /// # Errors
    /// The entries are inconsistent.
    pub fn new(
        journal: Journal,
        tables: fn(&IdentificationSummary) -> String,
        theme: Theme,
    ) -> Result<Self, FoldError> {
        // All entries are checked before any is shown.
        Session::of(&journal)?;
        let mut replay = Self {
            lines: journal.lines,
            place: 0,
            session: Session::default(),
            is_playing: false,
            has_help: false,
            speed: 2,
            page: Page::default(),
            scroll: 0,
            camera: Camera::default(),
            theme,
            tables,
        };
        replay.go(0);
        Ok(replay)
    }

    /// Goes to the entry of index `place`, or the last one.
    pub fn go(&mut self, place: usize) {
        let place = place.min(self.lines.len().saturating_sub(1));
        let is_onward = self.session.opened.is_some() && place >= self.place;
        let first = if is_onward { self.place + 1 } else { 0 };
        if !is_onward {
            self.session = Session::default();
        }
        for line in self.lines.iter().take(place + 1).skip(first) {
            // The entries are consistent: `new` has checked them.
            drop(self.session.apply(line));
        }
        self.place = place;
    }

    /// The session after the shown entry.
    pub const fn session(&self) -> &Session {
        &self.session
    }

    fn is_at_end(&self) -> bool {
        self.place + 1 >= self.lines.len()
    }

    /// Time to the next entry; `None` while paused or at the end.
    fn pause(&self) -> Option<Duration> {
        let speed = SPEEDS.get(self.speed).copied().unwrap_or(1.0);
        (self.is_playing && !self.is_at_end()).then(|| Duration::from_secs_f64(1.0 / speed))
    }

    /// Advances by one entry.
    fn tick(&mut self) {
        self.go(self.place + 1);
        self.is_playing &= !self.is_at_end();
    }

    pub fn on_key(&mut self, key: Key) -> ReplayCommand {
        let was_open = std::mem::take(&mut self.has_help);
        match key.code {
            KeyCode::Char('?') => self.has_help = !was_open,
            // As in the wizard, any key closes the page, and the program is left from the picture.
            KeyCode::Esc | KeyCode::Enter | KeyCode::Char('q') if was_open => {}
            KeyCode::Char('z') if key.has_modifier() => return ReplayCommand::Suspend,
            KeyCode::Char('l') if key.has_modifier() => return ReplayCommand::Redraw,
            KeyCode::Char('c') if key.has_modifier() => return ReplayCommand::Quit,
            _ if key.has_modifier() => return ReplayCommand::None,
            KeyCode::Char('q') => return ReplayCommand::Quit,
            KeyCode::Left => self.stop_at(self.place.saturating_sub(1)),
            KeyCode::Right => self.stop_at(self.place + 1),
            KeyCode::Home => self.stop_at(0),
            KeyCode::End => self.stop_at(usize::MAX),
            KeyCode::Char(' ') => {
                if self.is_at_end() && !self.is_playing {
                    self.go(0);
                }
                self.is_playing = !self.is_playing;
            }
            KeyCode::Char('+' | '=') => self.speed = (self.speed + 1).min(SPEEDS.len() - 1),
            KeyCode::Char('-') => self.speed = self.speed.saturating_sub(1),
            KeyCode::Tab => {
                self.scroll = 0;
                self.page = match self.page {
                    Page::Robot => Page::Samples,
                    Page::Samples => Page::Result,
                    Page::Result => Page::Robot,
                };
            }
            KeyCode::PageDown => self.scroll = (self.scroll + PAGE).min(self.last_line()),
            KeyCode::PageUp => self.scroll = self.scroll.saturating_sub(PAGE),
            KeyCode::Char('<') => return self.turn(Key::plain_code(KeyCode::Left)),
            KeyCode::Char('>') => return self.turn(Key::plain_code(KeyCode::Right)),
            KeyCode::Char('z') => self.camera.zoom(1.2),
            KeyCode::Char('Z') => self.camera.zoom(1.0 / 1.2),
            _ => return self.turn(key),
        }
        ReplayCommand::Draw
    }

    fn stop_at(&mut self, place: usize) {
        self.is_playing = false;
        self.go(place);
    }

    fn turn(&mut self, key: Key) -> ReplayCommand {
        if self.camera.on_key(key) { ReplayCommand::Draw } else { ReplayCommand::None }
    }

    fn on_input(&mut self, input: &Input) -> ReplayCommand {
        match *input {
            Input::Key(key) => self.on_key(key),
            Input::Resize => ReplayCommand::Redraw,
            Input::Scroll(lines) if lines < 0 => self.on_key(Key::plain_code(KeyCode::PageUp)),
            Input::Scroll(_) => self.on_key(Key::plain_code(KeyCode::PageDown)),
            Input::Paste(_) => ReplayCommand::None,
            Input::Gone | Input::Broken => ReplayCommand::Quit,
        }
    }

    /// The scene of the shown entry.
    fn scene(&self) -> Option<Scene> {
        let row = match self.lines.get(self.place).map(|line| &line.entry) {
            Some(Entry::Sample(sample)) => self.session.sample(sample.number).map(|sample| sample.row),
            Some(Entry::Skipped { row, .. } | Entry::Row(row)) => Some(*row),
            _ => self.session.shown.or_else(|| self.session.samples.last().map(|sample| sample.row)),
        };
        Scene::of_session(&self.session, row)
    }
}

/// Wakes the driver; a full channel means that it is awake already. Returns `false` if the driver has ended.
fn wake(waker: &SyncSender<()>) -> bool {
    !matches!(waker.try_send(()), Err(TrySendError::Disconnected(())))
}

/// Shows a session in the terminal until the operator quits. Returns the signal that ended it, if any.
///
/// # Errors
/// The terminal cannot be used, or the system refuses a thread.
pub fn run(mut replay: Replay, options: Options) -> io::Result<Option<i32>> {
    if options.forces_colour {
        crossterm::style::force_color_output(true);
    }
    let (waker, woken) = sync_channel(1);
    let received = Arc::new(AtomicI32::new(0));
    let noted = (Arc::clone(&received), waker.clone());
    signals::on_signal(move |signal| {
        noted.0.store(signal, Ordering::SeqCst);
        wake(&noted.1);
    })?;
    let signal = || Some(received.load(Ordering::SeqCst)).filter(|signal| *signal != 0);
    terminal::install_panic_hook();
    let guard = TerminalGuard::enter(options.has_mouse)?;
    let inputs = input::start(move || wake(&waker))?;
    let mut screen = Terminal::new(CrosstermBackend::new(io::stdout()))?;
    let mut end = Ok(ReplayCommand::Draw);
    let mut is_due = true;
    while end.is_ok() && signal().is_none() {
        if is_due {
            end = screen
                .draw(|frame| {
                    let area = frame.area();
                    replay.draw(area, frame.buffer_mut());
                })
                .map(|_| ReplayCommand::Draw);
            is_due = false;
        }
        let after = match inputs.try_recv() {
            Ok(input) => replay.on_input(&input),
            Err(_) => match woken.recv_timeout(replay.pause().map_or(IDLE, |pause| pause.max(FRAME))) {
                Err(RecvTimeoutError::Timeout) if replay.pause().is_some() => {
                    replay.tick();
                    ReplayCommand::Draw
                }
                _ => ReplayCommand::None,
            },
        };
        is_due |= after != ReplayCommand::None;
        if after == ReplayCommand::Quit {
            break;
        }
        if after == ReplayCommand::Suspend {
            end = guard.suspend().map(|()| ReplayCommand::Redraw);
        }
        if matches!(after, ReplayCommand::Redraw | ReplayCommand::Suspend) && end.is_ok() {
            let size = screen.backend().size();
            end =
                size.and_then(|size| screen.resize(Rect::from((Position::ORIGIN, size)))).map(|()| ReplayCommand::Draw);
        }
    }
    // Dropping it would write to the terminal once more, which may be gone.
    std::mem::forget(screen);
    if end.is_err() || signal() == Some(SIGHUP) {
        guard.abandon();
        return Ok(Some(SIGHUP));
    }
    Ok(signal())
}

#[cfg(test)]
mod tests;
