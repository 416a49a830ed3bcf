//! Signals that end the program: turned into an event, so that the session is closed in good order.
//!
//! A script may end its engine and go on with another one ([`Received::follow`]): the event goes to whichever runs, and one that
//! came between the two is not lost.

use std::io;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::events::Events;
use crate::wizard::Event;

/// Which signal has arrived, and who is told.
#[derive(Clone, Debug)]
pub struct Received {
    /// 0: none.
    number: Arc<AtomicI32>,
    engine: Arc<Mutex<Events>>,
}

impl Received {
    /// Number of the signal.
    pub fn signal(&self) -> Option<i32> {
        Some(self.number.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
    }

    /// From now on this engine is told; at once if a signal has arrived already.
    pub fn follow(&self, events: Events) {
        *self.engine.lock().unwrap_or_else(PoisonError::into_inner) = events;
        if let Some(signal) = self.signal() {
            self.tell(signal);
        }
    }

    fn tell(&self, signal: i32) {
        let cause = match signal {
            SIGINT => "interrupted (SIGINT)",
            SIGTERM => "terminated (SIGTERM)",
            _ => "the terminal went away (SIGHUP)",
        };
        let events = self.engine.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // An engine that is gone has ended in good order; the next one, if any, is told when it is followed.
        events.send(Event::Shutdown { cause: cause.to_owned() });
    }
}

/// Watches SIGINT, SIGTERM and SIGHUP on a thread of its own.
///
/// # Errors
/// The system refuses.
pub fn watch(events: Events) -> io::Result<Received> {
    let received = Received { number: Arc::default(), engine: Arc::new(Mutex::new(events)) };
    let noted = received.clone();
    each(move |signal| {
        noted.number.store(signal, Ordering::SeqCst);
        noted.tell(signal);
    })?;
    Ok(received)
}

/// Has every SIGINT, SIGTERM and SIGHUP told, on a thread of its own.
///
/// # Errors
/// The system refuses.
pub fn each(tell: impl Fn(i32) + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(tell))?;
    Ok(())
}
