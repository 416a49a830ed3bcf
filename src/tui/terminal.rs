//! The modes of the terminal: entered once, undone exactly, in reverse order, whatever happens.
//!
//! Errors of undoing are ignored: nobody is left to tell, and the terminal may be gone. The modes that are on are known
//! globally, because the panic hook must undo them without a guard at hand. Nothing here asks the terminal a question.

use std::io::{self, Write};
use std::panic::{self, PanicHookInfo};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread::{self, ThreadId};

use crossterm::cursor::{Hide, Show};
use crossterm::event::{DisableBracketedPaste, DisableMouseCapture, EnableBracketedPaste, EnableMouseCapture};
use crossterm::terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode};
use crossterm::{execute, queue};

const RAW: u8 = 1;
const SCREEN: u8 = 1 << 1;
const PASTE: u8 = 1 << 2;
const MOUSE: u8 = 1 << 3;
const CURSOR: u8 = 1 << 4;

/// Modes that are on.
static ENTERED: AtomicU8 = AtomicU8::new(0);
/// Folder of the session, for the panic hook.
static FOLDER: Mutex<Option<String>> = Mutex::new(None);
/// What other threads could not say while the screen was up.
static REMARKS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Keeps the terminal in the modes of a full screen until it is dropped.
#[derive(Debug)]
pub(super) struct TerminalGuard {
    has_mouse: bool,
}

impl TerminalGuard {
    /// Enters the modes; the mouse only when asked for, because it takes the terminal's own selection away.
    ///
    /// # Errors
    /// The terminal refuses a mode; those entered before are undone.
    pub(super) fn enter(has_mouse: bool) -> io::Result<Self> {
        let guard = Self { has_mouse };
        guard.modes_on()?;
        Ok(guard)
    }

    fn modes_on(&self) -> io::Result<()> {
        let result = self.try_modes_on(&mut io::stdout());
        if result.is_err() {
            leave();
        }
        result
    }

    fn try_modes_on(&self, out: &mut impl Write) -> io::Result<()> {
        // A mode counts from before it is asked for: undoing one that never came on does no harm.
        ENTERED.fetch_or(RAW, Ordering::SeqCst);
        enable_raw_mode()?;
        ENTERED.fetch_or(SCREEN | PASTE | CURSOR, Ordering::SeqCst);
        execute!(out, EnterAlternateScreen, EnableBracketedPaste, Hide)?;
        if self.has_mouse {
            ENTERED.fetch_or(MOUSE, Ordering::SeqCst);
            execute!(out, EnableMouseCapture)?;
        }
        Ok(())
    }

    /// Gives the terminal back to the shell until the process is continued, then takes it again. The screen must be drawn
    /// anew.
    ///
    /// # Errors
    /// The system refuses to stop the process, or the terminal a mode.
    pub(super) fn suspend(&self) -> io::Result<()> {
        leave();
        signal_hook::low_level::raise(signal_hook::consts::SIGTSTP)?;
        self.modes_on()
    }

    /// Leaves the terminal alone for good: it is gone.
    pub(super) fn abandon(self) {
        ENTERED.store(0, Ordering::SeqCst);
        drop(self);
    }
}

impl Drop for TerminalGuard {
    fn drop(&mut self) {
        leave();
    }
}

/// Undoes the modes that are on.
fn leave() {
    let entered = ENTERED.swap(0, Ordering::SeqCst);
    let mut out = io::stdout();
    // With the terminal gone there is nothing to give back.
    drop(write_leave(&mut out, entered));
    if entered & RAW != 0 {
        drop(disable_raw_mode());
    }
}

fn write_leave(out: &mut impl Write, entered: u8) -> io::Result<()> {
    if entered & MOUSE != 0 {
        queue!(out, DisableMouseCapture)?;
    }
    if entered & CURSOR != 0 {
        queue!(out, Show)?;
    }
    if entered & PASTE != 0 {
        queue!(out, DisableBracketedPaste)?;
    }
    if entered & SCREEN != 0 {
        queue!(out, LeaveAlternateScreen)?;
    }
    out.flush()
}

/// Rings the bell.
///
/// # Errors
/// The terminal is gone.
pub(super) fn ring() -> io::Result<()> {
    let mut out = io::stdout();
    out.write_all(b"\x07")?;
    out.flush()
}

/// Tells the panic hook where the session is.
pub(super) fn note_folder(folder: Option<&str>) {
    if let Ok(mut held) = FOLDER.lock() {
        *held = folder.map(str::to_owned);
    }
}

/// What was to be said while the screen was up.
pub(super) fn take_remarks() -> Vec<String> {
    REMARKS.lock().map(|mut remarks| std::mem::take(&mut *remarks)).unwrap_or_default()
}

/// From now on a panic gives the terminal back first, then says where it happened and how to go on. A panic of another
/// thread is noted and leaves the screen alone: whoever waits for that thread is told.
pub(super) fn install_panic_hook() {
    let owner = thread::current().id();
    panic::set_hook(Box::new(move |info| on_panic(owner, info)));
}

fn on_panic(owner: ThreadId, info: &PanicHookInfo<'_>) {
    let folder = FOLDER.try_lock().ok().and_then(|folder| folder.clone());
    let thread = thread::current();
    let text = panic_text(&info.to_string(), thread.name(), folder.as_deref());
    if thread.id() == owner || ENTERED.load(Ordering::SeqCst) == 0 {
        leave();
        drop(writeln!(io::stderr(), "{text}"));
    } else if let Ok(mut remarks) = REMARKS.try_lock() {
        remarks.push(text);
    }
}

fn panic_text(info: &str, thread: Option<&str>, folder: Option<&str>) -> String {
    let head = format!("error: a defect of this program, thread '{}': {info}", thread.unwrap_or("unnamed"));
    match folder {
        Some(folder) => format!("{head}\nhint: your session is saved; go on with 'trupose resume {folder}'"),
        None => format!("{head}\nhint: nothing was measured yet; start again with 'trupose'"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_what_was_entered_is_undone_in_reverse() {
        let undone = |entered| {
            let mut out = Vec::new();
            write_leave(&mut out, entered).unwrap();
            String::from_utf8(out).unwrap().replace('\u{1b}', "^")
        };
        assert_eq!(undone(0), "");
        assert_eq!(undone(SCREEN), "^[?1049l");
        assert_eq!(undone(RAW | SCREEN | PASTE | CURSOR), "^[?25h^[?2004l^[?1049l");
        assert!(undone(MOUSE).contains("^[?1003l"));
    }

    #[test]
    fn a_panic_says_how_to_go_on() {
        let text = panic_text("panicked at src/x.rs:1:2:\nboom", Some("main"), Some("sessions/a"));
        assert!(text.contains("src/x.rs:1:2") && text.contains("trupose resume sessions/a"), "{text}");
    }
}
