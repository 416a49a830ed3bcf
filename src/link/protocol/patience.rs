//! Patience with a peer that is busy: it is asked again after growing pauses, and not for ever.

use std::time::Duration;

use super::Moment;

/// The first pause; every other one is twice as long as the one before it.
const FIRST: Duration = Duration::from_millis(200);

/// The longest pause.
const LONGEST: Duration = Duration::from_secs(2);

/// A peer that is busy for longer than this is not asked any more.
const LIMIT: Duration = Duration::from_secs(15);

/// Patience over one request.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    busy_since: Option<Moment>,
    pause: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { busy_since: None, pause: FIRST }
    }
}

impl Patience {
    /// The peer says that it is busy: when to ask it again; `None` once that has gone on for too long.
    pub fn again_at(&mut self, now: Moment) -> Option<Moment> {
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
        let (mut patience, mut now, mut pauses) = (Patience::default(), start, Vec::new());
        while let Some(at) = patience.again_at(now) {
            pauses.push(at.saturating_sub(now).as_millis());
            now = at;
        }
        assert_eq!(pauses, [200, 400, 800, 1600, 2000, 2000, 2000, 2000, 2000, 2000]);
        assert!(now <= start + LIMIT);
        assert_eq!(patience.again_at(now), None);
    }
}
