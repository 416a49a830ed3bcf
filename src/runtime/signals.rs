//! Turns signals that end the program into an event, so that the session is closed in good order.
//!
//! A script may end its engine and continue with another one ([`SignalWatch::redirect`]): the event goes to the one that runs,
//! and a signal between the two is not lost.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::events::Events;
use crate::wizard::Event;

/// Remembers the last signal and reports it to an engine.
#[derive(Clone, Debug)]
pub struct SignalWatch {
    /// Number of the last signal; 0: none.
    number: Arc<AtomicI32>,
    engine: Arc<Mutex<Events>>,
}

impl SignalWatch {
    /// Returns the number of the last signal.
    pub fn signal(&self) -> Option<i32> {
        Some(self.number.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
    }

    /// Reports to this engine from now on; at once if a signal has already arrived.
    pub fn redirect(&self, events: Events) {
        *self.engine.lock().unwrap_or_else(PoisonError::into_inner) = events;
        if let Some(signal) = self.signal() {
            self.report(signal);
        }
    }

    fn report(&self, signal: i32) {
        let cause = match signal {
            SIGINT => "interrupted (SIGINT)",
            SIGTERM => "terminated (SIGTERM)",
            _ => "the terminal went away (SIGHUP)",
        };
        let events = self.engine.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // An engine that is gone has ended in good order; the next one, if any, gets the signal from `redirect`.
        events.send(Event::Shutdown { cause: cause.to_owned() });
    }
}

/// Reports SIGINT, SIGTERM and SIGHUP to an engine, from a thread of its own.
///
/// # Errors
/// The system refuses.
pub fn watch(events: Events) -> io::Result<SignalWatch> {
    let watch = SignalWatch { number: Arc::default(), engine: Arc::new(Mutex::new(events)) };
    let noted = watch.clone();
    on_signal(move |signal| {
        noted.number.store(signal, Ordering::SeqCst);
        noted.report(signal);
    })?;
    Ok(watch)
}

/// Makes a write beyond the limit of the size of files an error with a message, as on a full disk, instead of the end of the program.
pub fn keep_large_files_an_error() {
    #[cfg(unix)]
    {
        // Any handler keeps the signal from ending the process. Without one, the program is as safe, but cannot say what happened.
        let ignored = Arc::new(AtomicBool::new(false));
        drop(signal_hook::flag::register(signal_hook::consts::SIGXFSZ, ignored));
    }
}

/// Calls `handle` for every SIGINT, SIGTERM and SIGHUP, on a thread of its own.
///
/// # Errors
/// The system refuses.
pub fn on_signal(handle: impl Fn(i32) + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(handle))?;
    Ok(())
}
