//! The clock of the wizard: the system's, or a virtual one that advances only when something is measured.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use jiff::Timestamp;

#[derive(Clone, Debug)]
pub enum Clock {
    /// The clock of the system.
    System,
    /// Milliseconds since 1970, advanced by [`Clock::pass`].
    Virtual(Arc<AtomicI64>),
}

impl Clock {
    /// Returns a virtual clock that shows `start`.
    pub fn starting_at(start: Timestamp) -> Self {
        Self::Virtual(Arc::new(AtomicI64::new(start.as_millisecond())))
    }

    /// Returns the current time.
    pub fn now(&self) -> Timestamp {
        match self {
            Self::System => system_time(),
            Self::Virtual(milliseconds) => {
                Timestamp::from_millisecond(milliseconds.load(Ordering::Relaxed)).unwrap_or(Timestamp::UNIX_EPOCH)
            }
        }
    }

    /// Advances a virtual clock by `seconds`; the system's clock does not need it.
    pub fn pass(&self, seconds: f64) {
        if let Self::Virtual(milliseconds) = self {
            #[expect(clippy::cast_possible_truncation, reason = "a float to integer cast saturates")]
            let passed = (seconds.max(0.0) * 1e3).round() as i64;
            milliseconds.fetch_add(passed, Ordering::Relaxed);
        }
    }
}

/// Returns the time of the system, to the millisecond: finer digits would only fill the journal.
fn system_time() -> Timestamp {
    let now = Timestamp::now();
    Timestamp::from_millisecond(now.as_millisecond()).unwrap_or(now)
}
