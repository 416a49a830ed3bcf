//! Back-off for a busy peer: retries after growing pauses, up to a limit.

use std::time::Duration;

use super::Moment;

/// The first pause; each following one is twice as long.
const FIRST: Duration = Duration::from_millis(200);

/// The longest pause.
const LONGEST: Duration = Duration::from_secs(2);

/// A peer that stays busy for longer than this is not asked again.
const LIMIT: Duration = Duration::from_secs(15);

/// Retry times of one request.
#[derive(Clone, Copy, Debug)]
pub struct Backoff {
    busy_since: Option<Moment>,
    pause: Duration,
}

impl Default for Backoff {
    fn default() -> Self {
        Self { busy_since: None, pause: FIRST }
    }
}

impl Backoff {
    /// The time of the next attempt after a busy answer; `None` once the peer has been busy for too long.
    pub fn next_attempt(&mut self, now: Moment) -> Option<Moment> {
        let since = *self.busy_since.get_or_insert(now);
        let at = now.saturating_add(self.pause);
        self.pause = (self.pause * 2).min(LONGEST);
        (at.saturating_sub(since) <= LIMIT).then_some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pauses_grow_up_to_two_seconds_and_end_within_fifteen() {
        let start = Duration::from_secs(100);
        let (mut backoff, mut now, mut pauses) = (Backoff::default(), start, Vec::new());
        while let Some(at) = backoff.next_attempt(now) {
            pauses.push(at.saturating_sub(now).as_millis());
            now = at;
        }
        assert_eq!(pauses, [200, 400, 800, 1600, 2000, 2000, 2000, 2000, 2000, 2000]);
        assert!(now <= start + LIMIT);
        assert_eq!(backoff.next_attempt(now), None);
    }
}
