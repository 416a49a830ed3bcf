//! The modes of the terminal: entered once, and left in reverse order in any case.
//!
//! Errors while leaving are ignored: they could not be shown, and the terminal may be gone. The active modes are global, because the
//! panic hook must leave them without a guard. Nothing here queries the terminal.

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

/// Active modes.
static ENTERED: AtomicU8 = AtomicU8::new(0);
/// Folder of the session, for the panic hook.
static FOLDER: Mutex<Option<String>> = Mutex::new(None);
/// Messages of other threads that could not be printed while the screen was up.
static REMARKS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Keeps the terminal in the modes of a full screen until it is dropped.
#[derive(Debug)]
pub(super) struct TerminalGuard {
    has_mouse: bool,
}

impl TerminalGuard {
    /// Enters the modes. The mouse is optional, because it disables the terminal's own selection.
    ///
    /// # Errors
    /// The terminal refuses a mode. The modes entered before are left again.
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
        // A mode is noted before it is entered: leaving one that was never entered does no harm.
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

    /// Returns the terminal to the shell until the process is continued, then enters the modes again. The screen must be redrawn.
    ///
    /// # Errors
    /// The system refuses to stop the process, or the terminal a mode.
    pub(super) fn suspend(&self) -> io::Result<()> {
        leave();
        signal_hook::low_level::raise(signal_hook::consts::SIGTSTP)?;
        self.modes_on()
    }

    /// Gives up the terminal without writing to it, because it is gone.
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

/// Leaves the active modes.
fn leave() {
    let entered = ENTERED.swap(0, Ordering::SeqCst);
    let mut out = io::stdout();
    // If the terminal is gone, there is nothing to restore.
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

/// Stores the folder of the session for the panic hook.
pub(super) fn note_folder(folder: Option<&str>) {
    if let Ok(mut held) = FOLDER.lock() {
        *held = folder.map(str::to_owned);
    }
}

/// Takes the messages that could not be printed while the screen was up.
pub(super) fn take_remarks() -> Vec<String> {
    REMARKS.lock().map(|mut remarks| std::mem::take(&mut *remarks)).unwrap_or_default()
}

/// Installs a hook that restores the terminal on a panic and then prints where it happened and how to continue. A panic of another
/// thread is stored and leaves the screen alone: the owner of that thread reports it.
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
    let head = format!("error: internal error in thread '{}': {info}", thread.unwrap_or("unnamed"));
    match folder {
        Some(folder) => format!(
            "{head}\nhint: whatever was shown as saved is in your session; continue with 'trupose resume {folder}'"
        ),
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

    fn named<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> thread::JoinHandle<T> {
        thread::Builder::new().name("of the test".to_owned()).spawn(work).unwrap()
    }

    /// Says to [`panics_in_a_terminal`] that it runs in a terminal of its own.
    const IN_TERMINAL: &str = "TRUPOSE_TEST_PANICS_HERE";

    #[test]
    fn panics_in_a_terminal() {
        if std::env::var_os(IN_TERMINAL).is_none() {
            return;
        }
        note_folder(Some("sessions/a"));
        install_panic_hook();
        let panics = |text: &'static str| named(move || panic!("{text}")).join().is_err();
        assert!(panics("of another thread"));
        let _guard = TerminalGuard::enter(true).unwrap();
        // Noted, and the screen is left alone.
        assert!(panics("behind the screen"));
        assert!(take_remarks().concat().contains("behind the screen"));
        panic!("in front of the screen");
    }

    #[test]
    fn a_panic_gives_the_terminal_back() {
        use std::io::Read as _;

        use portable_pty::{CommandBuilder, PtySize, native_pty_system};

        let pair = native_pty_system().openpty(PtySize::default()).unwrap();
        let modes = || format!("{:?}", pair.master.get_termios().unwrap());
        let before = modes();
        // This very program, with that one test.
        let mut command = CommandBuilder::new(std::env::current_exe().unwrap());
        command.args(["--exact", "tui::terminal::tests::panics_in_a_terminal", "--nocapture", "--test-threads=1"]);
        command.cwd(std::env::current_dir().unwrap());
        command.env(IN_TERMINAL, "1");
        command.env("TERM", "xterm-256color");
        let mut child = pair.slave.spawn_command(command).unwrap();
        let mut written = Vec::new();
        let mut output = pair.master.try_clone_reader().unwrap();
        let reader = named(move || {
            let mut bytes = [0; 4096];
            // With the last one at the other end gone, Linux says EIO.
            while let Some(count) = output.read(&mut bytes).ok().filter(|count| *count > 0) {
                written.extend_from_slice(&bytes[..count]);
            }
            written
        });
        let status = child.wait().unwrap();
        let after = modes();
        drop(pair.slave);
        let written = String::from_utf8_lossy(&reader.join().unwrap()).replace('\u{1b}', "^");
        assert_eq!((status.exit_code(), status.signal()), (101, None), "{written}");
        assert_eq!(after, before);
        let (before_screen, rest) = written.split_once("^[?1049h").unwrap();
        let (on_screen, after_screen) = rest.split_once("^[?1049l").unwrap();
        assert!(before_screen.contains("of another thread"), "{written}");
        assert!(!on_screen.contains("behind the screen"), "{written}");
        for undone in ["^[?1003l", "^[?25h", "^[?2004l"] {
            assert!(on_screen.contains(undone), "{undone}: {written}");
        }
        for said in ["in front of the screen", "src/tui/terminal.rs:", "trupose resume sessions/a"] {
            assert!(after_screen.contains(said), "{said}: {written}");
        }
    }

    #[test]
    fn a_panic_says_how_to_go_on() {
        let text = panic_text("panicked at src/x.rs:1:2:\nboom", Some("main"), Some("sessions/a"));
        assert!(text.contains("src/x.rs:1:2") && text.contains("trupose resume sessions/a"), "{text}");
    }
}
