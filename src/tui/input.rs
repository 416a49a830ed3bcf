//! Keys, paste and resizing, read on a thread of their own.
//!
//! Nobody joins that thread: when the terminal goes away, a read never returns. What it reads goes into a bounded channel, then
//! whoever waits is woken, so that the driver waits on one thing only.

use std::io;
use std::panic;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use crossterm::event::{self, Event, KeyEventKind, MouseEventKind};

use super::keymap::Key;

/// Inputs that wait; then the terminal's own buffer holds what is typed.
const WAITING: usize = 256;
/// So long the start waits for the thread to listen.
const LISTENS: Duration = Duration::from_millis(500);

/// Something from the terminal.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A key.
    Key(Key),
    /// Pasted text.
    Paste(String),
    /// The wheel: lines, down is positive.
    Scroll(i16),
    /// A new size.
    Resize,
    /// The terminal cannot be read any more.
    Gone,
    /// Reading it has failed by a defect: what was sent made no sense to it.
    Broken,
}

/// Starts reading; `wake` tells whoever waits that there is something, `false` if nobody does.
///
/// # Errors
/// The system refuses a thread.
pub(super) fn start(wake: impl Fn() -> bool + Send + 'static) -> io::Result<Receiver<Input>> {
    let (sender, inputs) = sync_channel(WAITING);
    let (ready, listens) = sync_channel(1);
    let work = move || {
        // The first look has the system tell of new sizes. Nobody may be waiting any more, and `read` says what is wrong.
        drop(panic::catch_unwind(|| event::poll(Duration::ZERO)));
        let _nobody = ready.send(());
        read(&sender, &wake);
    };
    thread::Builder::new().name("input".to_owned()).spawn(work)?;
    // Whoever draws before would not hear of a size that changes right after. A terminal that hangs holds nobody up for long.
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

/// What an event of the terminal means; movements of the mouse mean nothing.
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
