//! The time that the wizard is told: that of the system, or one that passes only when something is measured.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use jiff::Timestamp;

/// A clock.
#[derive(Clone, Debug)]
pub enum Clock {
    /// The system's.
    System,
    /// Virtual: milliseconds since 1970, moved on by [`Clock::pass`].
    Virtual(Arc<AtomicI64>),
}

impl Clock {
    /// A virtual clock that begins at `start`.
    pub fn starting_at(start: Timestamp) -> Self {
        Self::Virtual(Arc::new(AtomicI64::new(start.as_millisecond())))
    }

    /// The time.
    pub fn now(&self) -> Timestamp {
        match self {
            Self::System => system_time(),
            Self::Virtual(milliseconds) => {
                Timestamp::from_millisecond(milliseconds.load(Ordering::Relaxed)).unwrap_or(Timestamp::UNIX_EPOCH)
            }
        }
    }

    /// So many seconds pass, if they do not pass by themselves.
    pub fn pass(&self, seconds: f64) {
        if let Self::Virtual(milliseconds) = self {
            #[expect(clippy::cast_possible_truncation, reason = "a float to integer cast saturates")]
            let passed = (seconds.max(0.0) * 1e3).round() as i64;
            milliseconds.fetch_add(passed, Ordering::Relaxed);
        }
    }
}

/// The time of the system, to the millisecond: finer digits would only fill the journal.
fn system_time() -> Timestamp {
    let now = Timestamp::now();
    Timestamp::from_millisecond(now.as_millisecond()).unwrap_or(now)
}
