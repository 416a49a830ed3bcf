//! Keys, pasted text and resizing, read by a separate thread.
//!
//! The thread is never joined, because a read of a lost terminal never returns. Inputs go into a bounded channel, and then the
//! driver is woken, so that it only waits in one place.

use std::io;
use std::panic;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use crossterm::event::{self, Event, KeyEventKind, MouseEventKind};

use super::keymap::Key;

/// Capacity of the channel. When it is full, the terminal's own buffer holds what is typed.
const WAITING: usize = 256;
/// Longest wait for the thread to start listening.
const LISTENS: Duration = Duration::from_millis(500);

/// An input from the terminal.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    Key(Key),
    /// Pasted text.
    Paste(String),
    /// Lines of the mouse wheel; down is positive.
    Scroll(i16),
    Resize,
    /// The terminal can no longer be read.
    Gone,
    /// The parser of the terminal library failed on what the terminal sent.
    Broken,
}

/// Starts reading. `wake` wakes the driver, and returns `false` if it has ended.
///
/// # Errors
/// The system refuses a thread.
pub(super) fn start(wake: impl Fn() -> bool + Send + 'static) -> io::Result<Receiver<Input>> {
    let (sender, inputs) = sync_channel(WAITING);
    let (ready, listens) = sync_channel(1);
    let work = move || {
        // The first poll subscribes to new sizes. Its errors appear again in `read`, and the receiver may already be gone.
        drop(panic::catch_unwind(|| event::poll(Duration::ZERO)));
        let _gone = ready.send(());
        read(&sender, &wake);
    };
    thread::Builder::new().name("input".to_owned()).spawn(work)?;
    // A frame drawn before that would miss a new size right after it. A terminal that hangs must not delay the start for long.
    let _late = listens.recv_timeout(LISTENS);
    Ok(inputs)
}

fn read(inputs: &SyncSender<Input>, wake: &impl Fn() -> bool) {
    loop {
        // A malformed mouse sequence makes the parser of crossterm 0.29 panic where overflows are checked, then again at every
        // byte.
        let input = match panic::catch_unwind(event::read) {
            Ok(Ok(event)) => input(event),
            Ok(Err(error)) if error.kind() == io::ErrorKind::Interrupted => None,
            Ok(Err(_gone)) => Some(Input::Gone),
            Err(_panic) => Some(Input::Broken),
        };
        let Some(input) = input else { continue };
        let is_last = matches!(input, Input::Gone | Input::Broken);
        if inputs.send(input).is_err() || !wake() || is_last {
            break;
        }
    }
}

/// The input of a terminal event. Movements of the mouse are ignored.
fn input(event: Event) -> Option<Input> {
    match event {
        Event::Key(key) => (key.kind != KeyEventKind::Release).then(|| Input::Key(Key::from(key))),
        Event::Paste(text) => Some(Input::Paste(text)),
        Event::Resize(..) => Some(Input::Resize),
        Event::Mouse(mouse) => match mouse.kind {
            MouseEventKind::ScrollUp => Some(Input::Scroll(-3)),
            MouseEventKind::ScrollDown => Some(Input::Scroll(3)),
            _ => None,
        },
        Event::FocusGained | Event::FocusLost => None,
    }
}
