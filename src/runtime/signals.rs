//! Signals that end the program: turned into an event, so that the session is closed in good order.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::engine::Events;
use crate::wizard::Event;

/// Which signal has arrived; 0: none.
#[derive(Clone, Debug, Default)]
pub struct Received(Arc<AtomicI32>);

impl Received {
    /// Number of the signal.
    pub fn signal(&self) -> Option<i32> {
        Some(self.0.load(Ordering::Relaxed)).filter(|signal| *signal != 0)
    }
}

/// Watches SIGINT, SIGTERM and SIGHUP on a thread of its own.
///
/// # Errors
/// The system refuses.
pub fn watch(events: Events) -> io::Result<Received> {
    let received = Received::default();
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    let noted = received.clone();
    thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            noted.0.store(signal, Ordering::Relaxed);
            let cause = match signal {
                SIGINT => "interrupted (SIGINT)",
                SIGTERM => "terminated (SIGTERM)",
                _ => "the terminal went away (SIGHUP)",
            };
            if !events.send(Event::Shutdown { cause: cause.to_owned() }) {
                break;
            }
        }
    })?;
    Ok(received)
}
